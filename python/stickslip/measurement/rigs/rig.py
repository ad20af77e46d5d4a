"""What a record was taken with: the instrument, the spring, the mass and the drive."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, NamedTuple, Self

from stickslip.errors import InputError
from stickslip.files.schema import Document, Limits, NotNegative, Positive, Says
from stickslip.files.units import SPELLINGS, TEXTS, find_unit
from stickslip.files.units import UNITS as SIZES
from stickslip.measurement.rigs.layout import Layout

if TYPE_CHECKING:
    from stickslip.model.system import Oscillator

UNITS = {"spring_force": ("N", "mg", "1"), "displacement": ("m", "1")}
"""The usual units of each; any other unit of force or length will do too."""
INSTRUMENTS = tuple(UNITS)
DIMENSIONS = {"spring_force": TEXTS["force"], "displacement": TEXTS["length"]}
"""Of a mass that slides, and of one that turns."""
QUANTITIES = {
    "stiffness": TEXTS["stiffness"],
    "mass": TEXTS["mass"],
    "effective_mass": TEXTS["mass"],
    "drive_velocity": TEXTS["velocity"],
    "damping": TEXTS["damping"],
}


class RigUnits(NamedTuple):
    """The units in which the results of a rig are given."""

    time: str
    length: str
    speed: str
    acceleration: str
    force: str
    mass: str

    @property
    def frequency(self) -> str:
        """Of a line."""
        return "1" if self.time == "1" else "Hz"

    @property
    def inertia(self) -> str:
        """What the mass of what moves so is called."""
        return "inertia" if self.length == "rad" else "mass"


SLIDES = RigUnits("s", "m", "m/s", "m/s^2", "N", "kg")
TURNS = RigUnits("s", "rad", "rad/s", "rad/s^2", "N m", "kg m^2")
PURE = RigUnits(*["1"] * 6)


@dataclass(frozen=True, kw_only=True)
class Rig(Document):
    """The rig behind one record of an oscillator that is driven by friction.

    m x'' + D x' + k x = friction, with x the extension of the spring from where it is slack. For a slider that a
    moving stage pulls through a spring, x' = drive_velocity - slider velocity. Of a mass that turns, x is an angle in rad,
    forces are torques in N m, the mass is its moment of inertia in kg m^2, and so on; numbers with a unit or the unit of
    the record say so.

    Parameters
    ----------
    instrument : ``"spring_force"`` (the record is the force k x of the spring) or ``"displacement"`` (it is x itself).
    column : name of the recorded variable, or its number from 1.
    unit : of force (``"N"``, ``"kip"``, ..., or ``"mg"``, force over weight) for a spring force, of length (``"m"``,
        ``"mm"``, ...) for a displacement, of torque (``"N m"``, ...) or angle (``"deg"``, ...) for a mass that turns, ``"1"``
        when the whole rig is dimensionless.
    scale : the size of one reading in that unit, for a record that is not calibrated or in a unit of its own; negative where
        the instrument counts the other way; default 1.
    rest : the reading, as it stands in the record, at which the spring is slack; default 0.
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
    noise : standard deviation of the record's white noise, as it stands there; default: estimated from the record.
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

    TITLE: ClassVar[str] = "rig"

    instrument: Annotated[str, Literal["spring_force", "displacement"]]
    column: Annotated[str | int, Says("the name of the recorded variable, or its number from 1")]
    stiffness: Annotated[float, Limits(above=0, dimensions=QUANTITIES["stiffness"])]
    mass: Annotated[float, Limits(above=0, dimensions=QUANTITIES["mass"])]
    drive_velocity: Annotated[float, Limits(above=0, dimensions=QUANTITIES["drive_velocity"])]
    unit: str = ""
    damping: Annotated[float, Limits(least=0, dimensions=QUANTITIES["damping"])] = 0.0
    effective_mass: Annotated[float, Limits(above=0, dimensions=QUANTITIES["mass"])] | None = None
    scale: float = 1.0
    rest: Annotated[float, Says("a number, the reading as it stands in the record")] = 0.0
    time_column: Annotated[str | int, Says("the name of the time variable, or its number from 1")] | None = "t"
    time_unit: str = "s"
    sampling_rate: Positive | None = None
    mains_frequency: Positive | None = None
    noise: Positive | None = None
    gravity: Annotated[float, Limits(above=0, dimensions=("acceleration",))] = 9.81
    least_drop: NotNegative = 0.5
    recalibrate: bool = True
    read: Layout = field(default_factory=Layout)

    def __post_init__(self) -> None:
        turns = self._stated()
        super().__post_init__()
        kinds = DIMENSIONS[self.instrument]
        if self.unit == "":
            object.__setattr__(self, "unit", next(iter(SIZES[kinds[turns]])))
        known = list(dict.fromkeys([*UNITS[self.instrument], *(unit for kind in kinds for unit in SIZES[kind])]))
        object.__setattr__(self, "unit", SPELLINGS.get(self.unit, self.unit))
        if self.unit not in known:
            self.refuse(
                f"unit of a {self.instrument} record must be one of {', '.join(known)}, got {self.unit!r}; for another one "
                "give its size with scale"
            )
        if self.scale == 0:
            self.refuse("scale must be the size of one reading in the unit, not 0")
        find_unit(self.time_unit, ("time",), "rig: time_unit")
        if not self.column:
            self.refuse(f"column must be the name of the recorded variable, or its number from 1, got {self.column!r}")

    def _stated(self) -> bool:
        """Whether the units that are written out are those of a mass that turns; units that contradict are refused."""
        texts = {key: value for key in QUANTITIES if isinstance(value := getattr(self, key), str)}
        found: dict[int, str] = {}  # 0 slides, 1 turns, and the first key that says so
        for key, text in {"unit": self.unit, **texts}.items():
            kinds = DIMENSIONS.get(self.instrument, ()) if key == "unit" else QUANTITIES[key]
            unit = "N" if text == "mg" else text if key == "unit" else text.strip().partition(" ")[2].strip()
            try:
                found.setdefault(kinds.index(find_unit(unit, kinds, "rig")[0]), f"{key} = {text!r}")
            except InputError:
                continue  # what is wrong with it is said where it is read
        if len(found) == 2:
            self.refuse(
                f"{found[1]} is of a mass that turns and {found[0]} of one that slides; give all units of one kind"
            )
        if found and self.unit == "1":
            self.refuse(
                f'unit = "1" is of a rig without units, and {next(iter(found.values()))}; write numbers alone, or the '
                "unit of the record"
            )
        return 1 in found

    @property
    def units(self) -> RigUnits:
        """The units of its results: those of a mass that slides or turns, or pure numbers.

        >>> numbers = {"stiffness": 2.0, "mass": 0.005, "drive_velocity": 2.0}
        >>> Rig(instrument="spring_force", column="torque", unit="N m", **numbers).units.speed
        'rad/s'
        """
        if self.unit == "1":
            return PURE
        return TURNS if self.unit in SIZES[DIMENSIONS[self.instrument][1]] else SLIDES

    @property
    def inertia(self) -> float:
        """Mass (or moment of inertia) that multiplies the acceleration, in kg (kg m^2)."""
        return self.mass if self.effective_mass is None else self.effective_mass

    @property
    def force_unit(self) -> float:
        """SI units (N or m, N m or rad) per reading of the record."""
        if self.unit == "mg":
            return self.scale * self.mass * self.gravity
        return self.scale * (1.0 if self.unit == "1" else find_unit(self.unit, DIMENSIONS[self.instrument], "rig")[1])

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
    def from_dict(cls, table: Mapping[str, Any], where: str = "rig") -> Self:
        """Read a rig from the table of its document."""
        # A file without time stamps says its rate; one with stamps in "t" may say both.
        if isinstance(table, Mapping) and "time_column" not in table and "sampling_rate" in table:
            table = {**table, "time_column": None}
        return super().from_dict(table, where)

    def to_dict(self) -> dict[str, Any]:
        """The table; of the layout what differs from the usual one."""
        table = super().to_dict() | {"read": self.read.changed()}
        return {key: value for key, value in table.items() if value != {}}
