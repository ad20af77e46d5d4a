"""Units at the border: what a rig file may say, what it is in SI, and how a number with its error is written."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence

from stickslip.errors import InputError, number

FARTHEST = 1e100
"""Larger numbers overflow when they are squared; no instrument gives them in any unit, and no rig has them."""

POUND = 4.4482216152605
"""Pound-force in N (exact)."""

UNITS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0},
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "in": 0.0254, "ft": 0.3048},
    "angle": {"rad": 1.0, "deg": math.pi / 180, "rev": 2 * math.pi},
    "speed": {"m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3, "um/s": 1e-6, "in/s": 0.0254},
    "angular_speed": {"rad/s": 1.0, "deg/s": math.pi / 180, "rpm": math.pi / 30},
    "force": {
        "N": 1.0, "mN": 1e-3, "cN": 1e-2, "daN": 10.0, "kN": 1e3, "MN": 1e6, "lb": POUND, "kip": 1000 * POUND, "kgf": 9.80665,
        "gf": 9.80665e-3,
    },
    "torque": {"N m": 1.0, "mN m": 1e-3, "kN m": 1e3, "lb in": POUND * 0.0254, "lb ft": POUND * 0.3048},
    "pressure": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "bar": 1e5, "psi": POUND / 0.0254**2},
    "current": {"A": 1.0, "mA": 1e-3},
    "mass": {"kg": 1.0, "g": 1e-3, "lb": 0.45359237},
    "inertia": {"kg m^2": 1.0, "kg cm^2": 1e-4},
    "acceleration": {"m/s^2": 1.0},
    "stiffness": {"N/m": 1.0, "N/mm": 1e3, "N/cm": 1e2},
    "torsional_stiffness": {"N m/rad": 1.0, "N m/deg": 180 / math.pi},
    "damping": {"N s/m": 1.0, "N s/mm": 1e3},
    "cubic_stiffness": {"N/m^3": 1.0, "N/mm^3": 1e9},
    "torsional_cubic_stiffness": {"N m/rad^3": 1.0},
    "square_damping": {"N s^2/m^2": 1.0},
    "torsional_square_damping": {"N m s^2/rad^2": 1.0},
    "cubic_damping": {"N s^3/m^3": 1.0},
    "torsional_cubic_damping": {"N m s^3/rad^3": 1.0},
    "force_rate": {"N/s": 1.0, "mN/s": 1e-3, "kN/s": 1e3},
    "frequency": {"rad/s": 1.0, "Hz": 2 * math.pi},
    "per_length": {"1/m": 1.0, "1/cm": 1e2, "1/mm": 1e3},
    "per_speed": {"s/m": 1.0, "s/cm": 1e2, "s/mm": 1e3},
    "torsional_damping": {"N m s/rad": 1.0},
    "force_per_current": {"N/A": 1.0},
    "torque_per_current": {"N m/A": 1.0, "mN m/A": 1e-3},
    "ratio": {"1": 1.0, "%": 0.01},
}  # fmt: skip
"""Dimension -> unit -> its size in SI; the first of each is the SI unit."""

SPELLINGS = {
    "µm": "um", "μm": "um", "µs": "us", "μs": "us", "µm/s": "um/s", "Nm": "N m", "lbf": "lb", "klbf": "kip", "sec": "s",
    "inch": "in", "kg m2": "kg m^2", "°": "deg", "kNm": "kN m", "mNm": "mN m",
}  # fmt: skip

_BASES = {name: {name: 1} for name in ("time", "length", "angle", "force", "mass", "current")} | {
    "pressure": {"force": 1, "length": -2}, "angular_speed": {"angle": 1, "time": -1},
}  # fmt: skip
"""Dimensions whose units may be parts of another, as powers of the first six."""


def _size(unit: str) -> tuple[float, dict[str, int]] | None:
    """Size in SI of a unit from those of its parts, and the powers of its dimensions; None where a part is not known.

    >>> _size("kN/mm"), _size("N/(m s)"), _size("N/V")
    ((1000000.0, {'force': 1, 'length': -1}), (1.0, {'force': 1, 'length': -1, 'time': -1}), None)
    """
    products = re.sub(r"(?<=[a-z])-(?=[a-z])|[*·]", " ", SPELLINGS.get(unit, unit))
    above, *below = products.split("/")
    size, powers = 1.0, dict[str, int]()
    for side, text in ((1, above), *((-1, text.strip().removeprefix("(").removesuffix(")")) for text in below)):
        for word in " ".join(SPELLINGS.get(part, part) for part in text.split()).split():
            name, power = re.fullmatch(r"(.*?)\^?(\d?)", word).groups()  # type: ignore[union-attr]
            name, power = SPELLINGS.get(name, name), side * int(power or 1)
            found = next((base for base in _BASES if name in UNITS[base]), None)
            if found is None and word != "1":
                return None
            if found is not None:
                size *= UNITS[found][name] ** power
                for base, own in _BASES[found].items():
                    powers[base] = powers.get(base, 0) + own * power
    return size, {base: power for base, power in powers.items() if power}


def si_unit(dimension: str) -> str:
    """The SI unit of a dimension.

    >>> si_unit("angular_speed")
    'rad/s'
    """
    return next(iter(UNITS[dimension]))


#: What a text with a unit may be where a number of a law or a system has one of these dimensions.
TEXTS = {
    "force": ("force", "torque"),
    "velocity": ("speed", "angular_speed"),
    "length": ("length", "angle"),
    "time": ("time",),
    "mass": ("mass", "inertia"),
    "stiffness": ("stiffness", "torsional_stiffness"),
    "damping": ("damping", "torsional_damping"),
    "force velocity^-1": ("damping", "torsional_damping"),
    "force velocity^-2": ("square_damping", "torsional_square_damping"),
    "force velocity^-3": ("cubic_damping", "torsional_cubic_damping"),
    "force length^-3": ("cubic_stiffness", "torsional_cubic_stiffness"),
    "force time^-1": ("force_rate",),
    "time^-1": ("frequency",),
    "length^-1": ("per_length",),
    "velocity^-1": ("per_speed",),
}

#: What the dimensions of a law are products of, as powers of force, length and time.
POWERS = {
    "force": (1, 0, 0),
    "length": (0, 1, 0),
    "time": (0, 0, 1),
    "velocity": (0, 1, -1),
    "stiffness": (1, -1, 0),
    "damping": (1, -1, 1),
}


OF_INERTIA = {"N s^2/m": "kg", "N m s^2/rad": "kg m^2"}
"""Units of inertia by their usual names."""


def unit_of(dimension: str, force: str = "N", length: str = "m", time: str = "s") -> str:
    """The unit of a product such as ``"force velocity^-1"`` from those of force, length and time; "1" for a pure number.

    >>> unit_of("force velocity^-1"), unit_of("force time^-1", "1"), unit_of("velocity", "1", "1", "1")
    ('N s/m', '1/s', '1')
    >>> unit_of("time^-exponent"), unit_of("angle")
    ('s^-exponent', 'deg')
    """
    if dimension == "angle":
        return "deg"
    units, powers, rest = (force, length, time), [0, 0, 0], []
    for factor in dimension.split():
        name, _, power = factor.partition("^")
        if not power.lstrip("-").isdigit() and power:  # the power is another number of the law
            rest += [f"{unit}^{power}" for unit, own in zip(units, POWERS[name], strict=True) if own and unit != "1"]
            continue
        powers = [total + int(power or 1) * own for total, own in zip(powers, POWERS[name], strict=True)]
    sized = [(unit, power) for unit, power in zip(units, powers, strict=True) if power and unit != "1"]
    above, below = (
        [unit if abs(power) == 1 else f"{unit}^{abs(power)}" for unit, power in sized if power * sign > 0]
        for sign in (1, -1)
    )
    under = " ".join(below) if len(below) < 2 else f"({' '.join(below)})"
    unit = " ".join(above + rest or ["1"]) + (f"/{under}" if below else "")
    return OF_INERTIA.get(unit, unit)


def find_unit(unit: str, dimensions: Sequence[str], where: str) -> tuple[str, float]:
    """Dimension and size in SI of a unit that must belong to one of `dimensions`.

    Raises
    ------
    InputError
        naming the units that would do.

    Examples
    --------
    >>> find_unit("kip", ("force", "torque"), "rig"), find_unit("kN/m", ("stiffness",), "rig")
    (('force', 4448.2216152605), ('stiffness', 1000.0))
    """
    if not isinstance(unit, str):
        raise InputError(f"{where}: the unit must be a text such as {si_unit(dimensions[0])!r}, got {unit!r}")
    written, unit = unit, SPELLINGS.get(unit, unit)
    for dimension in dimensions:
        if unit in UNITS[dimension] and not (dimension == "mass" and written == "lbf"):
            return dimension, UNITS[dimension][unit]
    compound = _size(unit)
    for dimension in dimensions:
        own = _size(si_unit(dimension))
        if compound and own and compound[1] and compound[1] == own[1]:
            return dimension, compound[0]
    known = [name for dimension in dimensions for name in UNITS[dimension]]
    # No unit is proposed for another: one letter more or less is a factor of a hundred.
    made = (
        "; one made of units that are known will do too, such as 'klbf ft' or 'kN/m'"
        if re.search("[-/* ]", unit)
        else ""
    )
    raise InputError(f"{where}: the unit must be one of {', '.join(known)}, got {unit!r}{made}")


def unit_in_name(name: str) -> str | None:
    """The unit in brackets at the end of a column's name, None where there is none that is known. A number is none.

    >>> unit_in_name("Weg [mm]"), unit_in_name("force (kN)"), unit_in_name("x (raw)"), unit_in_name("phi(1)")
    ('mm', 'kN', None, None)
    """
    found = re.search(r"[\[(]\s*([^\[\]()]+?)\s*[\])]\s*$", name)
    unit = SPELLINGS.get(found[1], found[1]) if found else None
    return unit if unit != "1" and any(unit in sizes for sizes in UNITS.values()) else None


def contradicts(unit: str, other: str | None) -> bool:
    """Whether two units have different sizes, as mm and m have, or are of different kinds, as rpm and m/s are.

    >>> contradicts("mm", "m"), contradicts("rpm", "m/s"), contradicts("mm", "V"), contradicts("mm", None)
    (True, True, False, False)
    """
    sizes, others = _sizes(unit), _sizes(other or "")
    return of_other_kinds(unit, other or "") or any(
        sizes[kind] != others[kind] for kind in sizes.keys() & others.keys()
    )


def of_other_kinds(unit: str, other: str) -> bool:
    """Whether two known units measure different things.

    >>> of_other_kinds("rpm", "m/s"), of_other_kinds("mm", "m"), of_other_kinds("mm", "V"), of_other_kinds("1", "N")
    (True, False, False, False)
    """
    sizes, others = _sizes(unit), _sizes(other)
    return "1" not in (unit, other) and bool(sizes and others) and not sizes.keys() & others.keys()


def _sizes(unit: str) -> dict[str, float]:
    """The size of a unit by each quantity that it measures."""
    unit = SPELLINGS.get(unit, unit)
    return {kind: sizes[unit] for kind, sizes in UNITS.items() if unit in sizes}


def quantity(name: str, value: object, dimensions: Sequence[str], where: str) -> float:
    """A number (SI) or a text such as ``"25.7 mm"`` as a number in SI.

    Examples
    --------
    >>> quantity("bore", "25.7 mm", ("length",), "rig")
    0.0257
    """
    if isinstance(value, str):
        text, _, unit = value.strip().partition(" ")
        try:
            size = float(text)
        except ValueError:
            raise InputError(
                f'{where}: {name} must be a number or a text such as "1.5 {si_unit(dimensions[0])}", got {value!r}'
            ) from None
        if not unit:
            raise InputError(f"{where}: {name} = {value!r} has no unit; write a number without quotes for SI")
        factor = find_unit(unit.strip(), dimensions, f"{where}: {name}")[1]
        whole = round(1 / factor) if factor < 1e-2 else 0  # a decimal such as 3.5 mm is the nearest double so
        result = size / whole if whole and math.isclose(whole * factor, 1, rel_tol=1e-12) else size * factor
    else:
        result = number(name, value, where)
    if not abs(result) <= FARTHEST:
        raise InputError(f"{where}: {name} must be a finite number of at most {FARTHEST:g}, got {value!r}")
    return result


TURNING = tuple(dimensions[1] for dimensions in TEXTS.values() if len(dimensions) > 1)
STRAIGHT = tuple(
    dimensions[0] for name, dimensions in TEXTS.items() if len(dimensions) > 1 or not name.startswith("time")
)
"""Dimensions of what turns about an axis, and of what moves along a line; times and frequencies are of either."""


def check_one_kind(table: Mapping[str, object], where: str) -> None:
    """Refuse a document that has units of a mass that moves along a line beside those of one that turns.

    Frequencies and phases have their units in either. Masses of both kinds in one document are believed.

    >>> check_one_kind({"mass": "1 kg", "stiffness": "600 N m/rad"}, "a.toml")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    stickslip.errors.InputError: a.toml: stiffness = '600 N m/rad' is of a mass that turns and mass = '1 kg' of one that ...
    """
    found: dict[bool, tuple[str, str]] = {}
    masses: set[bool] = set()

    def look(value: object, key: str) -> None:
        if isinstance(value, Mapping):
            for name, item in value.items():
                look(item, str(name))
        elif isinstance(value, list | tuple):
            for item in value:
                look(item, key)
        elif isinstance(value, str) and key not in ("frequency", "phase"):
            try:
                dimension = find_unit(value.strip().partition(" ")[2].strip(), (*STRAIGHT, *TURNING), where)[0]
            except InputError:
                return  # no quantity, or one that who reads it will refuse
            turns = dimension in TURNING
            found.setdefault(turns, (key, value))
            if key == "mass":
                masses.add(turns)

    look(table, "")
    if len(found) == 2 and len(masses) < 2:
        (turning, turned), (straight, moved) = found[True], found[False]
        raise InputError(
            f"{where}: {turning} = {turned!r} is of a mass that turns and {straight} = {moved!r} of one that moves along a "
            "line; write all in N, m and kg, or all in N m, rad and kg m^2"
        )


def unit_suffix(unit: str | None) -> str:
    """A unit as it stands behind a number in a sentence; nothing behind a pure number or where it is not known.

    >>> unit_suffix("N"), unit_suffix("1")
    (' N', '')
    """
    return "" if unit in (None, "1") else f" {unit}"


def rounded(value: float, error: float) -> str:
    """A value with its standard error, to the digits that the error allows.

    >>> rounded(5.99883, 0.0015245), rounded(1234.5, 60.0), rounded(0.6, 0.0)
    ('5.9988 ± 0.0015', '1234 ± 60', '0.6')
    """
    if not (math.isfinite(error) and error > 0):
        return f"{value:.5g}"
    digits = max(0, 1 - math.floor(math.log10(error)))
    return f"{value:.{digits}f} ± {error:.{digits}f}"


LARGE = 1e9
"""Numbers from here on are written by their power."""


def to_error(values: Sequence[float], error: float) -> list[str]:
    """Values in the digits that one error allows: two of its digits, five of each value where the error is not known.

    Ten digits at most, and numbers of another size by their power.

    >>> to_error([5.99883, 5.99578, 0.0015245], 0.0015245), to_error([2.0192e-05], 1.3132e-7)
    (['5.9988', '5.9958', '0.0015'], ['2.019e-05'])
    >>> to_error([0.035643, math.inf], math.inf)
    ['0.035643', 'inf']
    >>> to_error([10.0, 7.24e51, 1.3e-24], 1.3e-24)
    ['10.00000000', '7.2e+51', '1.3e-24']
    """
    if not (math.isfinite(error) and error > 0):
        return [f"{value:.5g}" for value in values]
    last = math.floor(math.log10(error)) - 1  # power of ten of the last digit
    sizes = [abs(value) for value in values if math.isfinite(value)]
    largest = max((size for size in sizes if size < LARGE), default=0.0)
    if largest >= 1e-4:
        last = max(last, math.floor(math.log10(largest)) - 9)
        plain = f".{max(0, -last)}f"
        return [
            f"{value:{plain}}" if value == 0 or 0.1 * 10.0**last <= abs(value) < LARGE else f"{value:.1e}"
            for value in values
        ]
    powers = [math.floor(math.log10(abs(value))) if value and math.isfinite(value) else last for value in values]
    return [f"{value:.{max(0, power - last)}e}" for value, power in zip(values, powers, strict=True)]
