"""The numbers of a law by name: place in its document, value, limits and unit; and laws drawn by their covariance."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from stickslip import _core
from stickslip.errors import InputError, did_you_mean
from stickslip.files.units import unit_of
from stickslip.laws.declarations import Number

if TYPE_CHECKING:
    import pandas as pd

    from stickslip.laws.law import Law

Pointer = tuple[str | int, ...]
T = TypeVar("T")


def pointers(law: Law) -> dict[str, Pointer]:
    """Where each number of a law stands in its document, by name.

    >>> from stickslip.laws import PiecewiseLinear
    >>> list(pointers(PiecewiseLinear(nodes=[(0, 1), (1, 0.5)], break_away=1)))[:3]
    ['nodes[0].slip_velocity', 'nodes[0].force', 'nodes[1].slip_velocity']
    """
    return {name: pointer for name, (pointer, _) in _numbers(law, law.to_dict()).items()}


def numbers(law: Law) -> dict[str, Number]:
    """What is known of each number of a law, by name.

    >>> from stickslip.laws import BogaczRyczek
    >>> numbers(BogaczRyczek())["static_friction.initial"].low
    0.0
    """
    return {name: number for name, (_, number) in _numbers(law, law.to_dict()).items()}


def _numbers(law: Law, document: Mapping[str, Any]) -> dict[str, tuple[Pointer, Number]]:
    found: dict[str, tuple[Pointer, Number]] = {}
    for key, value in document.items():
        if key == "type" or isinstance(value, str) or law.PARAMETERS[key].choices:
            continue
        pair = law.PARAMETERS[key].numbers
        if isinstance(value, dict) and "type" in value:
            inner = _numbers(getattr(law, key), value)
            found |= {f"{key}.{name}": ((key, *pointer), number) for name, (pointer, number) in inner.items()}
        elif isinstance(value, dict):
            # What a table inside the law leaves out, such as the scale of the force rate, has a name all the same.
            items = getattr(law, key).PARAMETERS.items()
            found |= {f"{key}.{name}": ((key, name), item.numbers[-1]) for name, item in items if item.numbers}
        elif not isinstance(value, list):
            found[key] = (key,), pair[-1]
        elif isinstance(value[0], list):
            found |= {
                f"{key}[{i}].{number.part}": ((key, i, j), number)
                for i in range(len(value))
                for j, number in enumerate(pair)
            }
        else:
            found |= {f"{key}.{number.part}": ((key, j), number) for j, number in enumerate(pair)}
    return found


def value(law: Law, name: str) -> float:
    """One number of a law.

    Raises
    ------
    InputError
        for a name the law does not have, or a number that is not set.

    >>> from stickslip.laws import BogaczRyczek
    >>> value(BogaczRyczek(), "B.f")
    1.33
    """
    found = maybe(law, name)
    if found is None:
        raise InputError(f"{type(law).__name__}: {name} is not set, so it has no value; give it one in fixed")
    return found


def maybe(law: Law, name: str) -> float | None:
    """One number of a law, None where it is not set."""
    here: Any = law.to_dict()
    (pointer,) = _pointers_to(law, here, [name])
    for key in pointer:
        here = None if isinstance(here, dict) and key not in here else here[key]
    return None if here is None or isinstance(here, str) else float(here)


def with_values(law: Law, values: Mapping[str, float]) -> Law:
    """The law with some of its numbers changed.

    Raises
    ------
    InputError
        for a name the law does not have, or values that do not make a law.

    >>> from stickslip.laws import StaticKinetic
    >>> with_values(StaticKinetic(break_away=1.0, kinetic=0.6), {"kinetic": 0.5})
    StaticKinetic(break_away=1.0, kinetic=0.5)
    """
    return Replacement(law, values)(values.values())


class Replacement:
    """Other values for some numbers of a law, again and again: where they stand is looked up once.

    Parameters
    ----------
    law : whose other numbers stay.
    names : of the numbers.

    Raises
    ------
    InputError
        for a name the law does not have; where it is called, for values that do not make a law.

    >>> from stickslip.laws import StaticKinetic
    >>> Replacement(StaticKinetic(break_away=1.0, kinetic=0.6), ["kinetic"])([0.5])
    StaticKinetic(break_away=1.0, kinetic=0.5)
    """

    def __init__(self, law: Law, names: Iterable[str]) -> None:
        self.law = law
        self._pointers = _pointers_to(law, law.to_dict(), names)
        self._paths = ["/" + "/".join(map(str, pointer)) for pointer in self._pointers]

    def __call__(self, values: Iterable[float]) -> Law:
        """The law with these values of its numbers, in the order of the names."""
        numbers = [float(number) for number in values]
        if isinstance(self.law.core, _core.Law):
            try:
                core = self.law.core.with_numbers(list(zip(self._paths, numbers, strict=True)))
            except ValueError:
                pass  # its document says what is wrong, and takes a number that was not set
            else:
                table = {item.name: getattr(self.law, item.name) for item in fields(self.law)}
                for (key, *rest), number in zip(self._pointers, numbers, strict=True):
                    table[str(key)] = replaced(table[str(key)], rest, number)
                return _made(type(self.law), table | {"core": core})
        document = self.law.to_dict()
        for pointer, number in zip(self._pointers, numbers, strict=True):
            put(document, pointer, number)
        return type(self.law).from_dict(document, type(self.law).__name__)


def _made(kind: type[T], table: dict[str, Any]) -> T:
    """A frozen dataclass of these values, which are known to be good."""
    made = object.__new__(kind)
    vars(made).update(table)
    return made


def replaced(part: Any, pointer: Sequence[str | int], number: float) -> Any:
    """A part of a document with another number at a place, known to be good; what stands alone is a list of one."""
    if not pointer:
        return number
    key, *rest = pointer
    if isinstance(part, tuple):
        return tuple(replaced(item, rest, number) if position == key else item for position, item in enumerate(part))
    if isinstance(key, int):
        return replaced(part, rest, number)
    table = {item.name: getattr(part, item.name) for item in fields(part)}
    return _made(type(part), table | {str(key): replaced(table[str(key)], rest, number)})


def put(document: Any, pointer: Pointer, number: float) -> None:
    """Write one number at its place in a document."""
    *way, last = pointer
    for key in way:
        document = document[key]
    document[last] = number


def check_names(law: Law, names: Iterable[str]) -> list[str]:
    """The names, each once and each a number of the law."""
    checked = list(dict.fromkeys(names))
    _pointers_to(law, law.to_dict(), checked)
    return checked


def _pointers_to(law: Law, document: Mapping[str, Any], names: Iterable[str]) -> list[Pointer]:
    """Where numbers of a law stand in its document."""
    known = _numbers(law, document)
    for name in names:
        if name not in known:
            raise InputError(
                f"{type(law).__name__} has no parameter {name!r}{did_you_mean(name, known)}; it has {', '.join(known)}"
            )
    return [known[name][0] for name in names]


def units_of(law: Law, force: str = "N", length: str = "m", time: str = "s") -> dict[str, str]:
    """The unit of each number of a law by name, from those of force, length and time; "1" for a pure number.

    >>> from stickslip.laws import ExponentialStribeck
    >>> units_of(ExponentialStribeck.example(), "N m", "rad")
    {'break_away': 'N m', 'kinetic': 'N m', 'scale': 'rad/s', 'viscous': 'N m s/rad'}
    """
    known = numbers(law)

    def dimension(name: str) -> str:
        """That of a number, whose power may be another number of the law: of an exponent of 1 the plain one."""
        exponent = f"{name[: name.rfind('.') + 1]}exponent"
        plain = exponent in known and maybe(law, exponent) == 1.0
        return known[name].dimension.replace("-exponent", "-1") if plain else known[name].dimension

    return {name: unit_of(dimension(name), force, length, time) for name in known}


class Spread:
    """The laws that may as well be, by the covariance of the fitted numbers of one.

    A number that is known by its ratio varies in its logarithm; one that is tied follows.

    Parameters
    ----------
    law : in the middle.
    covariance : of its fitted numbers, by name in both directions.
    ties : numbers that take the value of a fitted one.
    bounds : limits of fitted numbers that are narrower than those of the law.
    """

    def __init__(
        self,
        law: Law,
        covariance: pd.DataFrame,
        ties: Mapping[str, str] | None = None,
        bounds: Mapping[str, tuple[float, float]] | None = None,
    ) -> None:
        self.law, self.ties = law, dict(ties or {})
        self.names = check_names(law, map(str, covariance.index))
        known = [numbers(law)[name] for name in self.names]
        values = np.array([value(law, name) for name in self.names])
        self._ratio = np.array([number.ratio for number in known], bool) & (values > 0)
        self._middle = np.where(self._ratio, np.log(np.where(self._ratio, values, 1.0)), values)
        ends = [(bounds or {}).get(name, (-math.inf, math.inf)) for name in self.names]
        self._low = np.array([max(number.low, low) for number, (low, _) in zip(known, ends, strict=True)])
        self._high = np.array([min(number.high, high) for number, (_, high) in zip(known, ends, strict=True)])
        unit = np.where(self._ratio, values, 1.0)
        matrix = covariance.to_numpy(float) / np.outer(unit, unit)
        if not np.isfinite(matrix).all():
            unknown = [name for name, row in zip(self.names, np.isfinite(matrix), strict=True) if not row.all()]
            raise InputError(
                f"{type(law).__name__}: the covariance of {', '.join(unknown)} is not finite, so nothing can be drawn by it; "
                "hold these numbers when the law is fitted (fixed)"
            )
        variances, directions = np.linalg.eigh(matrix)
        self._root = directions * np.sqrt(np.maximum(variances, 0.0))

    def at(self, normal: NDArray[np.float64]) -> Law | None:
        """The law at a standard normal vector, one number for each name; None where that is beyond a limit or no law."""
        vector = self._middle + self._root @ normal
        found = np.where(self._ratio, np.exp(np.where(self._ratio, vector, 0.0)), vector)
        if not ((self._low <= found) & (found <= self._high)).all():
            return None
        moved = dict(zip(self.names, found.tolist(), strict=True))
        try:
            return with_values(self.law, moved | {name: moved[of] for name, of in self.ties.items() if of in moved})
        except InputError:
            return None
