"""What a record was taken with: the instrument, the spring, the mass and the drive."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tomli_w

from stickslip.errors import InputError
from stickslip.files.documents import did_you_mean, number, read_toml, toml_table
from stickslip.measurement.layout import Layout
from stickslip.measurement.units import FARTHEST, find_unit, quantity
from stickslip.measurement.units import UNITS as SIZES

if TYPE_CHECKING:
    from stickslip.model.system import Oscillator

INSTRUMENTS = ("spring_force", "displacement")
UNITS = {"spring_force": ("N", "mg", "1"), "displacement": ("m", "1")}
"""The usual units of each; any other unit of force or length will do too."""
QUANTITIES = {
    "stiffness": "stiffness",
    "mass": "mass",
    "effective_mass": "mass",
    "drive_velocity": "speed",
    "gravity": "acceleration",
}
"""Numbers that a rig file may give as a text with their unit."""
DIMENSIONS = {"spring_force": "force", "displacement": "length"}


@dataclass(frozen=True, kw_only=True)
class Rig:
    """The rig behind one record of an oscillator that is driven by friction.

    m x'' + D x' + k x = friction, with x the extension of the spring from where it is slack. For a slider that a
    moving stage pulls through a spring, x' = drive_velocity - slider velocity.

    Parameters
    ----------
    instrument : ``"spring_force"`` (the record is the force k x of the spring) or ``"displacement"`` (it is x itself).
    column : name of the recorded variable, or its number from 1.
    unit : of force (``"N"``, ``"kip"``, ..., or ``"mg"``, force over weight) for a spring force, of length (``"m"``,
        ``"mm"``, ...) for a displacement, ``"1"`` for either when the whole rig is dimensionless.
    rest : the reading, in that unit, at which the spring is slack; default 0.
    stiffness : k in N/m, > 0.
    mass : m in kg, > 0; it also gives the weight of the unit ``"mg"``.
    drive_velocity : V in m/s, > 0.
    damping : D in N s/m, >= 0.
    effective_mass : inertia that acts on the friction force in kg, where it is known to differ from the mass; default
        the mass.
    time_column : name or number of the time variable, or None for a record without one; then `sampling_rate` is needed.
    time_unit : of that variable; default s.
    sampling_rate : samples per second; checked against the time stamps where there are any.
    mains_frequency : line in Hz (50 or 60) to take out of the record.
    noise : standard deviation of the record's white noise in its own unit; default: estimated from the record.
    gravity : m/s^2, used for the unit ``"mg"``.
    least_drop : where the mass creeps, a fall of the spring force counts as a slip if it is at least this fraction of
        the median fall; smaller ones are creep inside a stick. Their sizes have no gap, so this is a convention:
        halving it finds some 5 to 10 % more slips. A mass that truly rests needs no such level.
    recalibrate : whether sticks in the record may correct the stiffness (of a spring force, by 20 % at most) or the drive
        velocity (of a displacement, by 10 %); default true. With false the rig is believed as it stands.
    read : how the file is laid out, where it is unusual (the table ``[read]`` of a rig file).

    Raises
    ------
    InputError
        with one sentence that names the key, what it must be and what came.

    Examples
    --------
    >>> rig = Rig(instrument="spring_force", column="Fnorm", unit="mg", stiffness=168.0, mass=0.0307, drive_velocity=42e-6)
    >>> round(rig.force_unit, 4)
    0.3012
    >>> Rig.from_toml(rig.to_toml()) == rig
    True
    """

    instrument: str
    column: str | int
    stiffness: float
    mass: float
    drive_velocity: float
    unit: str = ""
    damping: float = 0.0
    effective_mass: float | None = None
    rest: float = 0.0
    time_column: str | int | None = "t"
    time_unit: str = "s"
    sampling_rate: float | None = None
    mains_frequency: float | None = None
    noise: float | None = None
    gravity: float = 9.81
    least_drop: float = 0.5
    recalibrate: bool = True
    read: Layout = field(default_factory=Layout)

    def __post_init__(self) -> None:
        if self.instrument not in INSTRUMENTS:
            raise InputError(
                f"rig: instrument must be one of {', '.join(INSTRUMENTS)}, got {self.instrument!r}"
                f"{did_you_mean(str(self.instrument), INSTRUMENTS)}"
            )
        if not isinstance(self.unit, str):
            raise InputError(f"rig: unit must be a text, got {self.unit!r}")
        if self.unit == "":
            object.__setattr__(self, "unit", UNITS[self.instrument][0])
        if self.unit not in UNITS[self.instrument] and self.unit not in SIZES[DIMENSIONS[self.instrument]]:
            known = list(dict.fromkeys([*UNITS[self.instrument], *SIZES[DIMENSIONS[self.instrument]]]))
            raise InputError(
                f"rig: unit of a {self.instrument} record must be one of {', '.join(known)}, got {self.unit!r}"
                f"{did_you_mean(str(self.unit), known)}"
            )
        find_unit(self.time_unit, ("time",), "rig: time_unit")
        if isinstance(self.column, bool) or not isinstance(self.column, str | int) or not self.column:
            raise InputError(f"rig: column must be the name of the recorded variable, got {self.column!r}")
        if self.time_column is not None and not isinstance(self.time_column, str | int):
            raise InputError(f"rig: time_column must be the name of the time variable, got {self.time_column!r}")
        if not isinstance(self.recalibrate, bool):
            raise InputError(f"rig: recalibrate must be true or false, got {self.recalibrate!r}")
        if not isinstance(self.read, Layout):
            raise InputError(f"rig: read must be a Layout, got {self.read!r}")
        object.__setattr__(self, "rest", number("rest", self.rest, "rig"))
        for name in ("stiffness", "mass", "drive_velocity", "gravity"):
            self._check_number(name, positive=True)
        for name in ("sampling_rate", "mains_frequency", "noise", "effective_mass"):
            if getattr(self, name) is not None:
                self._check_number(name, positive=True)
        for name in ("damping", "least_drop"):
            self._check_number(name, positive=False)

    def _check_number(self, name: str, *, positive: bool) -> None:
        value = getattr(self, name)
        wanted = "a positive number" if positive else "zero or a positive number"
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise InputError(f"rig: {name} must be {wanted}, got {value!r}")
        if not -FARTHEST <= value <= FARTHEST or value < 0 or (positive and value == 0):
            raise InputError(f"rig: {name} must be {wanted}, got {value!r}")
        object.__setattr__(self, name, float(value))

    @property
    def inertia(self) -> float:
        """Mass that multiplies the acceleration, in kg."""
        return self.mass if self.effective_mass is None else self.effective_mass

    @property
    def force_unit(self) -> float:
        """SI units (N or m) per unit of the record."""
        if self.unit == "mg":
            return self.mass * self.gravity
        return 1.0 if self.unit == "1" else SIZES[DIMENSIONS[self.instrument]][self.unit]

    @property
    def natural_frequency(self) -> float:
        """sqrt(k/m)/2pi in Hz, with the inertia."""
        return math.sqrt(self.stiffness / self.inertia) / (2 * math.pi)

    @classmethod
    def of(cls, system: Oscillator, time_column: str = "t") -> Rig:
        """The rig that sees the position, in column ``x``, of an oscillator whose numbers are dimensionless.

        >>> from stickslip import paper
        >>> Rig.of(paper.oscillator(0.3)).drive_velocity
        0.3
        """
        return cls(
            instrument="displacement",
            column="x",
            unit="1",
            time_column=time_column,
            stiffness=system.stiffness,
            mass=system.mass,
            damping=system.damping,
            drive_velocity=system.drive_velocity,
        )

    @classmethod
    def from_toml(cls, text: str, source: str = "rig") -> Rig:
        """Read a rig from the text of a TOML document; `source` names it in error messages."""
        return cls.from_table(toml_table(text, source), source)

    @classmethod
    def from_table(cls, table: Mapping[str, Any], source: str = "rig") -> Rig:
        """Read a rig from the table of its document."""
        table = dict(table)
        known = [field.name for field in fields(cls)]
        for key in table:
            if key not in known:
                raise InputError(
                    f"{source}: unknown key {key!r}{did_you_mean(key, known)}; a rig has the keys {', '.join(known)}"
                )
        for key in ("instrument", "column", "stiffness", "mass", "drive_velocity"):
            if key not in table:
                raise InputError(f"{source}: {key} is missing; add a line `{key} = ...`")
        if "time_column" not in table and "sampling_rate" in table:
            # a file without time stamps says its rate; one with stamps in "t" may say both
            table["time_column"] = None
        for key, dimension in QUANTITIES.items():
            if isinstance(table.get(key), str):
                table[key] = quantity(key, table[key], (dimension,), source)
        if "read" in table:
            table["read"] = Layout.from_table(table["read"], source)
        try:
            return cls(**table)
        except InputError as error:
            raise InputError(str(error).replace("rig:", f"{source}:", 1)) from None

    @classmethod
    def load(cls, path: str | Path) -> Rig:
        """Read a rig file."""
        return cls.from_table(read_toml(path, "rig file"), str(path))

    def to_toml(self) -> str:
        """The rig as a TOML document that `from_toml` reads back to an equal rig."""
        table = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "read"}
        layout = self.read.to_table()
        plain = {name: value for name, value in table.items() if value is not None}
        return tomli_w.dumps(plain | ({"read": layout} if layout else {}))
