"""Between units of measurement and the dimensionless numbers of Eq. (2) of the paper, for systems, laws and motions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, TypeVar, overload

from stickslip.errors import InputError, number
from stickslip.files.schema import Document, kinds
from stickslip.files.units import TEXTS
from stickslip.laws.law import Law
from stickslip.laws.state_law import StateLaw
from stickslip.model.drive import Drive
from stickslip.model.system import Oscillator, System

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

Scaled = TypeVar("Scaled", Oscillator, System, Law, Drive)

#: What the columns of motions and tables of events are.
COLUMNS = {
    "t": "time", "time": "time", "x": "length", "v": "velocity", "a": "velocity time^-1", "slip_velocity": "velocity",
    "force": "force", "stick_time": "time", "force_rate": "force time^-1",
}  # fmt: skip

#: The names of the dimensions that an annotation says.
_NAMES = {texts: name for name, texts in reversed(TEXTS.items())}


@dataclass(frozen=True)
class Scale:
    """Units of mass, stiffness and force; those of time, length and velocity follow by Eq. (2).

    t = τ/τ₀, x = K X/F₀, d = D/√(K M), s = S √(K M)/F₀, f = F/F₀, with τ₀ = √(M/K).

    Parameters
    ----------
    mass, stiffness, force : M, K and F₀ > 0, what 1 stands for.

    Source: Eqs. (2), (3) and (10) of the paper; F₀ is any unit of friction, such as the weight or the break-away force.

    >>> from stickslip.laws import StaticKinetic
    >>> rig = Oscillator(3.2, 0.1, StaticKinetic(8.0, 5.0), mass=2.0, stiffness=800.0)  # kg, N/m, N s/m, m/s, N
    >>> small, scale = dimensionless(rig)
    >>> small.mass, small.stiffness, small.damping, small.drive_velocity, small.law
    (1.0, 1.0, 0.08, 0.5, StaticKinetic(break_away=1.0, kinetic=0.625))
    >>> scale.restore(small) == rig
    True
    """

    mass: float
    stiffness: float
    force: float

    def __post_init__(self) -> None:
        for name in ("mass", "stiffness", "force"):
            value = number(name, getattr(self, name), "Scale")
            if value <= 0:
                raise InputError(f"Scale: {name} must be greater than 0, got {value:g}; give the unit of {name}")
            object.__setattr__(self, name, value)

    @property
    def time(self) -> float:
        """τ₀ = √(M/K)."""
        return math.sqrt(self.mass / self.stiffness)

    @property
    def length(self) -> float:
        """F₀/K."""
        return self.force / self.stiffness

    @property
    def velocity(self) -> float:
        """F₀/√(K M)."""
        return self.force / math.sqrt(self.stiffness * self.mass)

    @property
    def damping(self) -> float:
        """√(K M)."""
        return math.sqrt(self.stiffness * self.mass)

    def unit(self, dimension: str, exponents: Mapping[str, float] | None = None) -> float:
        """What 1 stands for in a quantity of a dimension, a product such as ``"force velocity^-1"``.

        >>> Scale(2.0, 800.0, 8.0).unit("force time^-1")
        160.0
        """
        product = 1.0
        for factor in dimension.split():
            name, _, power = factor.partition("^")
            sign, power = (-1.0, power[1:]) if power.startswith("-") else (1.0, power or "1")
            size = (exponents or {}).get(power)
            product *= float(getattr(self, name)) ** (sign * (float(power) if size is None else size))
        return product

    def reduce(self, system: Scaled) -> Scaled:
        """An oscillator, system, drive or law in dimensionless numbers."""
        if not isinstance(system, Oscillator | System | Law | Drive):
            raise InputError(f"Scale: expected an oscillator, a system, a drive or a law, got {system!r}")
        reduced: Scaled = self._scaled(system, -1)
        return reduced

    @overload
    def restore(self, what: Scaled) -> Scaled: ...
    @overload
    def restore(self, what: xr.Dataset) -> xr.Dataset: ...
    @overload
    def restore(self, what: pd.DataFrame) -> pd.DataFrame: ...
    def restore(self, what: Any) -> Any:
        """The same in units again: an oscillator, system, drive or law; a motion (``orbit.to_xarray()``); ``orbit.events``.

        Columns that are not in :data:`COLUMNS` stay as they are (modes, and the state of a law that has one).
        """
        if isinstance(what, Oscillator | System | Law | Drive):
            return self._scaled(what, 1)
        known = [str(name) for name in (*what, *getattr(what, "coords", ())) if name in COLUMNS]
        scaled = {name: what[name] * self.unit(COLUMNS[name]) for name in known}
        if not hasattr(what, "coords"):
            return what.assign(**scaled)
        times = {name: scaled.pop(name).data for name in ("time",) if name in scaled}
        return what.assign({name: (what[name].dims, item.data) for name, item in scaled.items()}).assign_coords(times)

    def _scaled(self, what: Document, way: int, around: tuple[str, ...] = ()) -> Any:
        """A law, or what else has dimensions by its annotations; `around`: those that the document around it says."""
        if isinstance(what, Law):
            return self._law(what, way)

        def scaled(part: Any, dimensions: tuple[str, ...]) -> Any:
            if isinstance(part, Document):
                return self._scaled(part, way, dimensions)
            return self._value(part, _NAMES.get(dimensions, ""), way, {})

        values = {name: kind.converted(getattr(what, name), scaled) for name, kind in kinds(type(what)).items()}
        return replace(what, **values | {name: scaled(values[name], around) for name in what.BY_CONTEXT})

    def _law(self, law: Any, way: int) -> Any:
        values = {item.name: getattr(law, item.name) for item in fields(law)}
        units = {name: parameter.dimension for name, parameter in law.PARAMETERS.items()}
        exponents = {name: value for name, value in values.items() if units[name] == ""}
        return replace(law, **{name: self._value(value, units[name], way, exponents) for name, value in values.items()})

    def _value(self, value: Any, dimension: str, way: int, exponents: Mapping[str, Any]) -> Any:
        """A number, a point, nodes, or a law within a law; `way` is 1 to units and −1 from them."""
        if value is None or isinstance(value, str) or dimension == "":
            return value
        if isinstance(value, Document):
            return self._law(value, way)
        if isinstance(value, tuple):
            if value and isinstance(value[0], tuple):
                return tuple(self._value(item, dimension, way, exponents) for item in value)
            parts = dimension.split(", ")
            return tuple(self._value(item, part, way, exponents) for item, part in zip(value, parts, strict=False))
        last = dimension.split(", ")[-1]
        if last == "angle":
            # Of a line in the plane of force over velocity, in degrees.
            slope = self.unit("force velocity^-1")
            return math.degrees(math.atan(math.tan(math.radians(value)) * (slope if way > 0 else 1 / slope)))
        return value * self.unit(last, exponents) if way > 0 else value / self.unit(last, exponents)


@overload
def dimensionless(system: Oscillator, force: float | None = None) -> tuple[Oscillator, Scale]: ...
@overload
def dimensionless(system: System, force: float | None = None) -> tuple[System, Scale]: ...
def dimensionless(system: Oscillator | System, force: float | None = None) -> tuple[Any, Scale]:
    """The system in the dimensionless numbers of Eq. (2), and the :class:`Scale` that leads back.

    Parameters
    ----------
    system : an oscillator, whose mass and stiffness become 1; or a system, whose first mass and its own stiffness do.
    force : F₀, the unit of force; default the break-away force of the (first) contact without rest.

    Raises
    ------
    InputError
        where the law has no break-away force or it is 0, or the first mass no stiffness: then give a force, or a Scale.

    >>> from stickslip import chain, simulate
    >>> from stickslip.laws import StaticKinetic
    >>> rig = chain(3, StaticKinetic(8.0, 5.0), 0.01, mass=2.0, stiffness=600.0, coupling=200.0)
    >>> small, scale = dimensionless(rig)
    >>> small.stiffness[0], scale.time, scale.velocity
    ((1.0, -0.25, 0.0), 0.05, 0.2)
    >>> slow, fast = simulate(rig, 5.0).events["t"], scale.restore(simulate(small, 5.0 / scale.time).events)["t"]
    >>> bool(abs(slow - fast).max() < 1e-12)
    True
    """
    if isinstance(system, Oscillator):
        law, mass, stiffness = system.law, system.mass, system.stiffness
    else:
        law, mass, stiffness = system.contacts[0].law, system.mass[0][0], system.stiffness[0][0]
    if force is None:
        if isinstance(law, StateLaw):
            raise InputError(
                f"dimensionless: {type(law).__name__} has no break-away force to measure by; give the unit of force, such as "
                "dimensionless(system, force=1.0)"
            )
        force = law.break_away_force()
    scale = Scale(mass, stiffness, force)
    return scale._scaled(system, -1), scale
