"""Branches as values: a row a point, and the points where their kind changes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stickslip.dynamics.continuation.arclength import Label, Point
from stickslip.dynamics.periodic.closed_orbit import Cycle
from stickslip.dynamics.periodic.periodic_orbits import unchecked
from stickslip.errors import InputError, Interrupted
from stickslip.files.arrays import Array, Indices
from stickslip.files.equality import ByContent
from stickslip.files.notebook import InNotebook
from stickslip.model.system import Oscillator, System
from stickslip.simulation.orbit import Orbit

if TYPE_CHECKING:
    import xarray as xr


#: Periods and multipliers of one closed orbit differ by no more, relative to their size.
_SAME_ORBIT = 1e-6


@dataclass(frozen=True)
class SpecialPoint:
    """Where a branch changes: its kind, the value of the parameter there, and the orbit.

    kind is ``"fold"``, ``"flip"``, ``"neimark_sacker"``, ``"branch_point"``, ``"hopf"``, ``"nonsmooth_hopf"``,
    ``"grazing_sliding"``, ``"crossing_sliding"``, ``"switching_sliding"``, ``"adding_sliding"``, ``"grazing_node"``,
    ``"vanishing_stick"``, the limit in which the stick time vanishes and the slip is neutral, or ``"nonsmooth_fold"``, a
    boundary beyond which two orbits of different event sequences are gone together.
    """

    kind: str
    parameter: float
    #: The boundary that vanishes there, as named above; empty where none does.
    boundary: str = ""
    #: Position range of the orbit there.
    x: tuple[float, float] = (math.nan, math.nan)
    #: The system there.
    system: Oscillator | System | None = field(default=None, repr=False, compare=False)
    point: Point | None = field(default=None, repr=False, compare=False)
    label: Label | None = field(default=None, repr=False, compare=False)
    cycle: Cycle | None = field(default=None, repr=False, compare=False)

    @property
    def orbit(self) -> Cycle:
        """The closed orbit there, with its multipliers; to continue from it, over whatever number, give it as a guess.

        Raises
        ------
        InputError
            at a Hopf point of steady slip, which has no orbit.
        """
        if self.cycle is not None:
            return self.cycle
        if self.point is None:
            raise InputError(f"special point: a {self.kind} of steady slip has no orbit; take a point of a cycle")
        return unchecked(self.point.here)


@dataclass(repr=False, eq=False)
class Branch(ByContent, InNotebook):
    """One curve of motions: a row a point.

    Attributes
    ----------
    kind : ``"steady_slip"`` or ``"cycle"``.
    values : the parameter along the curve, a list of n numbers, as are the others but `multipliers`.
    stable : of n; None where the motion is marginal.
    period, multiplier : NaN on steady slip; the multiplier is the largest that is not the 1 of an autonomous cycle, for
        steady slip the growth rate of small disturbances.
    x_min, x_max : range of the position.
    sticks : whether adhesion is a part of the motion.
    special_points : in the order of the curve.
    orbits : the closed orbit of each point of a cycle, unstable ones too; :meth:`orbit` gives one.
    closed : whether the curve is closed: its last point is its first.
    cut : the limit by which the curve ended though it goes on, ``"most"`` or ``"max_seconds"``, or ``"interrupt"`` for
        Ctrl-C; empty where none did.
    ends : why the curve ends at its first and at its last point: ``"bounds"``, ``"closed"``, ``"flip"`` where the orbit is
        one of half its period taken twice, the kind of a sliding bifurcation or nonsmooth fold beyond which no orbit is
        found, ``"point"`` where the cycle shrinks to one, ``"vanishing_stick"``, ``"lost"`` where no orbit is found however
        small the step, or the word of `cut`; that of the special point where :func:`stickslip.switch_branch` begins; empty
        for steady slip.
    """

    kind: str
    values: list[float] = field(default_factory=list)
    stable: list[bool | None] = field(default_factory=list)
    period: list[float] = field(default_factory=list)
    multiplier: list[float] = field(default_factory=list)
    x_min: list[float] = field(default_factory=list)
    x_max: list[float] = field(default_factory=list)
    sticks: list[bool] = field(default_factory=list)
    special_points: list[SpecialPoint] = field(default_factory=list)
    orbits: list[Cycle] = field(default_factory=list, repr=False, compare=False)
    closed: bool = False
    cut: str = ""
    ends: tuple[str, str] = ("", "")

    def orbit(self, index: int) -> Cycle:
        """The orbit of a point, stable or not: its period, multipliers, phases and, as ``.orbit``, its motion.

        Raises
        ------
        InputError
            for a branch of steady slip, or an index that the branch has not.

        >>> import stickslip as ss
        >>> swing = ss.Oscillator(0.0, 0.0, ss.laws.Coulomb(0.6), forcing=ss.Harmonic(1.0, 0.7))
        >>> branch = ss.continuation(swing, "law.kinetic", (0.55, 0.75), seeds=0).branches[0]
        >>> branch.orbit(0).events, branch.orbit(-1).events
        (('crossing', 'crossing'), ('release', 'capture', 'release', 'capture'))
        """
        if not self.orbits:
            raise InputError(f"branch: a branch of {self.kind} has no orbits; see stickslip.periodic_orbit for one")
        if not -len(self.orbits) <= index < len(self.orbits):
            raise InputError(f"branch: orbit must be from 0 to {len(self.orbits) - 1}, got {index}")
        return self.orbits[index]

    def nearest(self, value: float) -> Cycle:
        """The orbit of the point whose parameter is nearest to a value, the first on the curve of several."""
        return self.orbit(int(np.argmin(np.abs(np.asarray(self.values) - value))) if self.values else 0)

    @property
    def multipliers(self) -> NDArray[np.complex128]:
        """All multipliers of each point, the largest first, shape (n, most); NaN where an orbit has fewer."""
        most = max((len(cycle.multipliers) for cycle in self.orbits), default=0)
        rows = [np.pad(c.multipliers, (0, most - len(c.multipliers)), constant_values=np.nan) for c in self.orbits]
        return np.array(rows, complex).reshape(len(self.orbits), most)

    def facts(self) -> dict[str, Any]:
        """What a notebook shows."""
        ends = f"{min(self.values):.6g} to {max(self.values):.6g}" if self.values else "nothing"
        stable = f"{sum(item is True for item in self.stable)} of {len(self.values)} points"
        if marginal := sum(item is None for item in self.stable):
            stable += f", marginal at {marginal}"
        points = [f"{item.kind} at {item.parameter:.6g}" for item in self.special_points]
        return {"kind": self.kind, "from": ends, "stable": stable, "special_points": points or "none"}

    def __repr__(self) -> str:
        facts = self.facts()
        return f"<Branch of {self.kind} from {facts['from']}, stable at {facts['stable']}>"

    def add(self, cycle: Cycle, value: float) -> None:
        """One more point."""
        self.orbits.append(cycle)
        low, high = range_of(cycle)
        row = (value, cycle.stable, cycle.period, cycle.largest, low, high, cycle.sticks)
        for name, item in zip(COLUMNS, row, strict=True):
            getattr(self, name).append(item)

    @contextmanager
    def kept(self) -> Iterator[None]:
        """Within it, Ctrl-C raises an :class:`Interrupted` that has this branch as far as it is."""
        try:
            yield
        except KeyboardInterrupt:
            # It may have come in the middle of a row.
            rows = min(len(getattr(self, name)) for name in (*COLUMNS, "orbits"))
            for name in (*COLUMNS, "orbits"):
                del getattr(self, name)[rows:]
            self.cut = "interrupt"
            self.ends = ("", self.cut)
            raise Interrupted(self) from None

    def reversed(self) -> Branch:
        """The same curve from its other end."""
        lists = {name: getattr(self, name)[::-1] for name in (*COLUMNS, "special_points", "orbits")}
        return replace(self, **lists, ends=self.ends[::-1])

    def joined(self, other: Branch) -> Branch:
        """The curve of both, where the other starts at the end of this one."""
        columns = {name: getattr(self, name) + getattr(other, name)[1:] for name in COLUMNS}
        points = self.special_points + other.special_points
        orbits, cut = self.orbits + other.orbits[1:], self.cut or other.cut
        ends = (self.ends[0], other.ends[1])
        return Branch(self.kind, **columns, special_points=points, orbits=orbits, cut=cut, ends=ends)


def both_ways_of(go: Callable[[float], Branch]) -> Branch:
    """The curve that `go` follows with a falling (−1) and a growing (1) parameter, from one end to the other.

    Raises
    ------
    Interrupted
        with the part that was followed before Ctrl-C.
    """
    halves: list[Branch] = []
    try:
        for sign in (-1.0, 1.0):
            halves.append(go(sign))
            if halves[-1].closed:
                return halves[-1]
    except Interrupted as stop:
        raise Interrupted(_joined([*halves, stop.result])) from None
    return _joined(halves)


def _joined(halves: list[Branch]) -> Branch:
    back = halves[0].reversed()
    return back.joined(halves[1]) if len(halves) > 1 else back


#: Columns of a branch, in the order in which a row is made.
COLUMNS = ("values", "stable", "period", "multiplier", "x_min", "x_max", "sticks")


@dataclass(frozen=True)
class OtherMotion:
    """A motion that a start ends in and no branch has.

    Attributes
    ----------
    value : of the parameter; regime : its word.
    x : its range of positions; start : a position and a velocity that lead to it.
    repeats : whether it was seen to repeat.

    >>> OtherMotion(0.3, "stick_slip", (0.1, 0.9), (1.0, 0.0), True).regime
    'stick_slip'
    """

    value: float
    regime: str
    x: tuple[float, float]
    start: tuple[float, float]
    repeats: bool


@dataclass(frozen=True, eq=False)
class Branches(ByContent, InNotebook):
    """The branches of a continuation.

    Attributes
    ----------
    system, parameter, bounds : what was asked.
    branches : of :class:`Branch`.
    special_points : of all branches, by parameter.
    others : the motions that starts ended in which are on no branch, as they do not repeat or could not be followed.
    """

    system: Oscillator | System
    parameter: str
    bounds: tuple[float, float]
    branches: tuple[Branch, ...]
    others: tuple[OtherMotion, ...] = ()

    @property
    def special_points(self) -> list[SpecialPoint]:
        """Those of all branches, by parameter; a flip at which a branch of twice the period ends is one."""
        found: list[SpecialPoint] = []
        for item in (item for branch in self.branches for item in branch.special_points):
            if item.kind != "flip" or not any(self._same_flip(item, other) for other in found):
                found.append(item)
        return sorted(found, key=lambda item: item.parameter)

    def _same_flip(self, one: SpecialPoint, other: SpecialPoint) -> bool:
        low, high = self.bounds
        if other.kind != "flip" or abs(one.parameter - other.parameter) > _SAME_ORBIT * (high - low):
            return False
        return same_motion(one.orbit, other.orbit)

    def to_xarray(self) -> xr.Dataset:
        """The branches over ``branch`` and ``point`` (NaN where a branch has fewer), the special points over ``special``."""
        import json

        import xarray as xr

        most = max((len(branch.values) for branch in self.branches), default=0)

        def padded(name: str) -> Any:
            rows = [np.asarray(getattr(branch, name), float) for branch in self.branches]
            return ("branch", "point"), np.array(
                [np.pad(row, (0, most - row.size), constant_values=np.nan) for row in rows]
            )

        points = self.special_points
        data: dict[str, Any] = {(self.parameter if name == "values" else name): padded(name) for name in COLUMNS}
        data |= {
            "special_kind": ("special", np.array([item.kind for item in points], dtype=str)),
            "special_boundary": ("special", np.array([item.boundary for item in points], dtype=str)),
            "special_parameter": ("special", np.array([item.parameter for item in points], float)),
            "cut": ("branch", np.array([branch.cut for branch in self.branches], dtype=str)),
            "ends": (("branch", "end"), np.array([branch.ends for branch in self.branches], dtype=str).reshape(-1, 2)),
            "special_x": (("special", "end"), np.array([item.x for item in points], float).reshape(-1, 2)),
        }
        attrs = {
            "title": "stickslip branches",
            "parameter": self.parameter,
            "system": json.dumps(self.system.to_dict()),
            "kinds": ", ".join(branch.kind for branch in self.branches),
        }
        return xr.Dataset(data, attrs=attrs)

    def facts(self) -> dict[str, Any]:
        """What a notebook shows."""
        points = [f"{item.kind} at {item.parameter:.6g}" for item in self.special_points]
        others = [f"{item.regime} at {item.value:.6g}" for item in self.others]
        return {"parameter": self.parameter, "branches": list(self.branches), "special_points": points or "none"} | (
            {"motions on no branch": others} if others else {}
        )

    def __repr__(self) -> str:
        found = ", ".join(f"{item.kind} {item.parameter:.9g}" for item in self.special_points) or "none"
        others = f", motions on no branch: {len(self.others)}" if self.others else ""
        return f"<Branches over {self.parameter}: {len(self.branches)}, special points: {found}{others}>"


def range_of(cycle: Cycle) -> tuple[float, float]:
    """Least and greatest position of a cycle."""
    return extremes(cycle.orbit)


def crossings(branch: Branch, value: float) -> tuple[Indices, Array]:
    """Where a branch has the value: the points just before, and the share of the way from each to the next."""
    values = np.asarray(branch.values)
    near = np.flatnonzero((values[:-1] - value) * (values[1:] - value) <= 0)
    gaps = values[near + 1] - values[near]
    return near, np.divide(value - values[near], gaps, out=np.zeros(len(near)), where=gaps != 0)


def same_motion(one: Cycle, other: Cycle) -> bool:
    """Whether two closed orbits at one value of the parameter are the same, wherever each of them begins."""
    if len(one.multipliers) != len(other.multipliers) or abs(one.period - other.period) > _SAME_ORBIT * other.period:
        return False
    low, high = range_of(other)
    # The extremes are those of samples, which lie elsewhere where the orbit begins elsewhere.
    if np.abs(np.subtract(range_of(one), (low, high))).max() > 1e-3 * (high - low):
        return False
    sizes = 1 + np.abs(other.multipliers)
    return bool((np.abs(one.multipliers - other.multipliers) <= _SAME_ORBIT * sizes).all())


def first_of(x: Any) -> float:
    """The position of the first mass."""
    return float(np.ravel(x)[0])


def extremes(orbit: Orbit) -> tuple[float, float]:
    """Least and greatest position, of several masses that of the first."""
    x = np.asarray(orbit.at(np.linspace(0.0, orbit.t_end, 201))[0])
    first = x.reshape(len(x), -1)[:, 0]
    return float(first.min()), float(first.max())
