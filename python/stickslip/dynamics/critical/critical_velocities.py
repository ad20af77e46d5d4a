"""The drive velocities at which the kind of motion changes, found directly and confirmed by runs on both sides.

Their values come from `speed_sweep.py`, `vanishing.py` and the special points of `continuation/`.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from stickslip.dynamics.continuation.branch import SpecialPoint
from stickslip.dynamics.critical.branch_search import branches_of, branches_of_masses
from stickslip.dynamics.critical.confirmation import ends_between, sides_of
from stickslip.dynamics.critical.runs import PATH, Monitor, beside, from_orbit, from_rest, nearly_together
from stickslip.dynamics.critical.speed_sweep import Sweep, changes_of_sticking, look_over, unlike_neighbours
from stickslip.dynamics.equilibria.criticality import criticality
from stickslip.dynamics.equilibria.hopf_points import steady_changes
from stickslip.dynamics.equilibria.steady_slip import stability
from stickslip.dynamics.periodic.event_sequence import check, with_number
from stickslip.dynamics.periodic.poincare_map import forcing_period
from stickslip.dynamics.scales import speed_scale
from stickslip.errors import InputError, UnfinishedWarning, number
from stickslip.files.notebook import InNotebook
from stickslip.model.system import Oscillator, System
from stickslip.simulation.time_limit import TimeIsUp, TimeLimit

#: Special points of cycles that a run can show.
_KINDS = (
    *("grazing_sliding", "crossing_sliding", "switching_sliding", "adding_sliding", "nonsmooth_fold", "fold"),
    *("nonsmooth_hopf", "vanishing_stick"),
)
#: Two speeds closer than this, relative to the bounds, are the same.
_SAME = 1e-6
#: Candidates closer than this, relative to the speed, may be too near for runs to tell which of them changes the motion.
_TOGETHER = 1e-3
#: Runs lose a cycle so far before its end at the most, relative to the speed.
_LOST_BEFORE = 1e-2


@dataclass(frozen=True)
class CriticalVelocities(Mapping[str, float], InNotebook):
    """Critical drive velocities by name, the lowest of each and the greatest end of stick-slip; `all` has every one.

    `criticalities` has (drive velocity, word) of each smooth Hopf point: ``"supercritical"`` where the cycle born there is
    stable, ``"subcritical"`` where it repels, ``"degenerate"`` where the first Lyapunov coefficient vanishes,
    ``"undetermined"`` where it is not known; `criticality` is the word at ``["hopf"]``. `neutral` has the ranges
    of the drive velocity in which small disturbances of steady slip neither grow nor decay. `special_points` are those of the
    cycles that were followed; `not_shown` are those among them where runs on both sides end in the same motion, as on cycles
    that repel: there it is the set of starts which lead to each motion that
    changes. Not `finished` is a search that ended after its limit of time, with what it had confirmed; `brackets` has (name,
    low, high) of what runs from rest show by then, where nothing that is confirmed explains it: stick-slip ends or begins
    between two speeds. Of several masses also a search that is finished may leave some. `unstable` is the range of drive
    velocities where steady slip is unstable at every one of them, else None. `beyond` is the greatest speed of the search
    where a run still sticks there, so that stick-slip ends above it or never; else None.
    """

    all: tuple[tuple[str, float], ...]
    criticalities: tuple[tuple[float, str], ...] = ()
    special_points: tuple[SpecialPoint, ...] = field(default=(), repr=False)
    neutral: tuple[tuple[float, float], ...] = ()
    finished: bool = True
    brackets: tuple[tuple[str, float, float], ...] = ()
    unstable: tuple[float, float] | None = None
    beyond: float | None = None

    def __getitem__(self, name: str) -> float:
        values = [value for kind, value in self.all if kind == name]
        if not values:
            raise KeyError(name)
        return max(values) if name == "end_of_stick_slip" else min(values)

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys(kind for kind, _ in self.all))

    def __len__(self) -> int:
        return len({kind for kind, _ in self.all})

    @property
    def criticality(self) -> str | None:
        """That of the lowest smooth Hopf point, ``["hopf"]``; None where there is none."""
        return dict(self.criticalities).get(self.get("hopf", math.nan))

    @property
    def not_shown(self) -> tuple[SpecialPoint, ...]:
        """The special points that are no critical velocity by themselves."""
        return tuple(
            point
            for point in self.special_points
            if all(abs(point.parameter - value) > _SAME * abs(value) for _, value in self.all)
        )

    def facts(self) -> dict[str, Any]:
        """What a notebook shows."""
        kinds = dict.fromkeys(kind for kind, _ in self.all)
        found: dict[str, Any] = {one: [value for kind, value in self.all if kind == one] for one in kinds}
        ranges = [f"{low:.6g} to {high:.6g}" for low, high in self.neutral]
        hidden = [f"{point.kind} {point.parameter:.12g}" for point in self.not_shown]
        return (
            found
            | ({"neutral slip": ranges} if ranges else {})
            | ({"steady slip": f"unstable {self._everywhere()}"} if self.unstable else {})
            | ({"stick-slip": f"goes on beyond {self.beyond:.6g}"} if self.beyond else {})
            | ({"on cycles, not shown by runs": hidden} if hidden else {})
            | {f"{name}, not confirmed": f"{low:.6g} to {high:.6g}" for name, low, high in self.brackets}
            | ({} if self.finished else {"finished": False})
        )

    def _everywhere(self) -> str:
        low, high = self.unstable or (math.nan, math.nan)
        return f"at every speed from {low:.6g} to {high:.6g}"

    def __repr__(self) -> str:
        said = [f"{kind} {value:.12g}" for kind, value in self.all] or ["none"]
        said += [f"steady slip is unstable {self._everywhere()}"] if self.unstable else []
        said += [f"stick-slip goes on beyond {self.beyond:.12g}"] if self.beyond else []
        said += [f"neutral slip from {low:.12g} to {high:.12g}" for low, high in self.neutral]
        said += [f"{point.kind} {point.parameter:.12g} on a cycle (not shown by runs)" for point in self.not_shown]
        said += [f"{name} between {low:.12g} and {high:.12g} (not confirmed)" for name, low, high in self.brackets]
        said += [] if self.finished else ["unfinished"]
        return f"<CriticalVelocities {', '.join(said)}>"


def critical_velocities(
    system: Oscillator | System,
    bounds: tuple[float, float] | None = None,
    *,
    progress: Callable[[str, int, int], Any] | None = None,
    max_seconds: float | None = None,
) -> CriticalVelocities:
    """The drive velocities at which steady slip loses its stability and at which stick-slip and slip cycles end.

    Steady slip: the zeros of D + F′(s), of several masses of the largest real part of the eigenvalues of small disturbances,
    and the corners of a piecewise-linear law at which that changes its sign by a jump.
    Cycles: the motion from rest and the slip cycle are followed over the drive velocity until a test function of a sliding
    bifurcation vanishes, a fold turns them back, they shrink to a point, or their stick time vanishes; each is a root of its
    own condition by Newton's method. Each is then run on both sides, from the orbit there, and is given only where the two
    runs end in different motions.

    Parameters
    ----------
    system : an oscillator of one mass without forcing, or a system of several whose contacts are all on one drive, such as a
        :func:`~stickslip.chain`; its own drive velocity does not matter.
    bounds : (low, high) of the drive velocity that is searched; default from a hundredth of F_s/√(k m) to three times that,
        of several masses of the greatest F_s/(m ω) of each, with the lowest natural frequency ω.
    progress : called as ``progress(what, done, n)`` through three stages: ``"runs"`` over the drive velocity, ``"cycles"`` of
        those runs that are followed, ``"confirmation"`` of what was found; within a stage it is called
        again with the same numbers before each run and each point of a cycle.
    max_seconds : time on the clock > 0 after which the search ends, asked during runs, between points of a cycle and
        between looks at steady slip, with a warning and with what it has confirmed by then (without
        ``"end_of_stick_slip"``, the greatest of several) and the ``.brackets`` of what it has not; default none.

    Returns
    -------
    Mapping of the names that exist to drive velocities: ``"hopf"``, ``"nonsmooth_hopf"`` (corner of the law, or a cycle that
    shrinks linearly to a point), ``"end_of_stick_slip"`` (the greatest velocity up to which stick-slip exists),
    ``"onset_of_stick_slip"`` (found by runs alone), either with ``"_from_rest"`` where stick-slip goes on beyond and only the
    run from rest no longer comes to it, ``"nonsmooth_fold"``, ``"grazing_sliding"``, ``"fold"``.
    ``.criticality`` says by the first Lyapunov coefficient, of one mass under a constant normal force by F‴(s), whether the
    cycle born at ``"hopf"`` is stable, ``.criticalities`` so of every smooth Hopf point,
    ``.neutral`` where slip is neutral, D + F′(s) = 0: a centre, as without damping under constant kinetic friction.

    Raises
    ------
    InputError
        for a forced system or bounds that make no sense; of several masses for contacts that are not all on one drive,
        springs that are not linear, or masses that nothing ties to the ground.

    Several masses start at rest at x_i = c (0.618 i mod 1), i = 0, 1, …, with c a tenth and a thousandth of the largest
    F_s/k, and along the mode that grows beside steady slip; a motion that sticks is carried on where the next speed, from
    rest, shows another. Their motions may be chaotic, with long transients; of them only the changes of steady slip and of
    sticking are given: every end and onset of stick-slip, as it may end and begin again. A cycle beside it is followed to
    what ends it (to rounding, with its name), else runs of 3000 of the slowest natural periods tell it to 1e-5. What these do
    not settle is in ``.brackets``, such as motions of equal masses in step. Sticks in less than 1e-4 of the time are none.

    Limits: cycles that are reached neither from rest, nor from beside steady slip, nor from those at another speed, are not
    looked for; nor is, of several masses, what happens and is undone between two of the 96 speeds.

    Source: Thomsen & Fidlin, Int. J. Non-Linear Mech. 38 (2003) 389; Leine & Nijmeijer 2004 (LNACM 18), ch. 8.

    >>> from stickslip.laws import ExponentialStribeck
    >>> found = critical_velocities(Oscillator(0.1, 1.0, ExponentialStribeck(1.0, 0.5, 0.5)))
    >>> round(found["hopf"], 12), found.criticality, round(found["nonsmooth_fold"], 7)
    (1.151292546497, 'subcritical', 1.836601)
    """
    scale = _checked(system)
    if bounds is None and not scale > 0:
        raise InputError("critical_velocities: there is no static friction by which to choose speeds; give bounds")
    low, high = bounds if bounds is not None else (0.01 * scale, 3 * scale)
    low, high = number("low", low, "critical_velocities"), number("high", high, "critical_velocities")
    if not 0 < low < high:
        raise InputError(
            f"critical_velocities: bounds must be (low, high) with 0 < low < high, got ({low:g}, {high:g})"
        )
    search = _Search(system, (low, high), Monitor(progress, TimeLimit.after(max_seconds, "critical_velocities")))
    try:
        search.steady_slip()
        search.go()
    except TimeIsUp:
        warnings.warn(
            "critical_velocities: the search ended after max_seconds and is unfinished; raise max_seconds to go on",
            UnfinishedWarning,
            stacklevel=2,
        )
        return search.result(finished=False)
    return search.result()


def _grows_everywhere(system: Oscillator | System, low: float, high: float) -> bool:
    """Whether small disturbances of steady slip grow, at five speeds of a range in which that does not change."""
    return all(stability(with_number(system, PATH, speed))[0] < 0 for speed in np.linspace(low, high, 5))


def _checked(system: Oscillator | System) -> float:
    """What velocities are measured by, :func:`speed_scale`.

    Raises
    ------
    InputError
        for a system that is not one drive under one mass or several.
    """
    check(system, "critical_velocities")
    if forcing_period(system) is not None:
        raise InputError("critical_velocities: the system is forced; use continuation over drive_velocity")
    if isinstance(system, Oscillator):
        return speed_scale(system)
    if len(system.driven) < len(system.contacts) or system.drive_velocity is None:
        raise InputError(
            "critical_velocities: every contact of a system of masses must be on one drive of constant velocity; "
            "simulate at each value, or look at an orbit_diagram over a number of one contact"
        )
    if any(contact.normal_force is not None for contact in system.contacts):
        raise InputError(
            "critical_velocities: of several masses the normal forces must be constant; look at an orbit_diagram over "
            "drive_velocity"
        )
    if np.linalg.matrix_rank(np.array(system.stiffness)) < system.masses:
        raise InputError(
            "critical_velocities: the masses can move together without a force, so there is no steady slip; tie one of "
            "them to the ground"
        )
    return speed_scale(system)


@dataclass
class _Search:
    """What a search has found so far.

    Attributes
    ----------
    sweeps : what runs show.
    steady : where steady slip changes; `neutral` where it is neutral; `unstable` the bounds where it is unstable throughout;
        `natures` the kinds of its Hopf points.
    found : what runs confirm; `points` the special points of the cycles.
    ends : of stick-slip; `left` where only the start of a run leaves the basin of a motion that goes on.
    """

    system: Oscillator | System
    bounds: tuple[float, float]
    monitor: Monitor
    sweeps: list[Sweep] = field(default_factory=list)
    steady: list[tuple[str, float]] = field(default_factory=list)
    neutral: list[tuple[float, float]] = field(default_factory=list)
    unstable: tuple[float, float] | None = None
    natures: list[tuple[float, str]] = field(default_factory=list)
    found: list[tuple[str, float]] = field(default_factory=list)
    points: list[SpecialPoint] = field(default_factory=list)
    ends: list[float] = field(default_factory=list)
    left: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        system, monitor = self.system, self.monitor
        self.sweeps = [Sweep("rest", from_rest(system, monitor)), Sweep("beside", beside(system, monitor))]
        if isinstance(system, System):
            self.sweeps.append(Sweep("nearly together", nearly_together(system, monitor)))

    def steady_slip(self) -> None:
        """Where it changes, and how."""
        keep = self.monitor.limit.keep
        self.steady, self.neutral = steady_changes(self.system, PATH, self.bounds, keep=keep)
        for kind, value in self.steady:
            if kind == "hopf":
                keep()
                self.natures.append((value, criticality(self.system, PATH, value)))
        if not self.steady and not self.neutral and _grows_everywhere(self.system, *self.bounds):
            self.unstable = self.bounds

    def go(self) -> None:
        """What runs show, the special points of the cycles, and what runs confirm of them."""
        look_over(self.system, *self.bounds, self.monitor, self.sweeps)
        if isinstance(self.system, Oscillator):
            branches = branches_of(self.system, self.bounds, self.steady, self.neutral, self.sweeps, self.monitor)
        else:
            branches = branches_of_masses(self.system, self.bounds, self.sweeps, self.monitor)
        for point in (point for branch in branches for point in branch.special_points):
            if not any(self._same(point.parameter, other.parameter) for other in self.points):
                self.points.append(point)
        candidates: list[tuple[str, float, SpecialPoint | None]] = [(*item, None) for item in self.steady]
        # A motion ends at a fold; what else happens to the cycle beside it does so on the way.
        for point in sorted(self.points, key=lambda point: "fold" not in point.kind):
            known = any(kind == point.kind and self._same(point.parameter, value) for kind, value in self.steady)
            if point.kind in _KINDS and not known:
                candidates.append((point.kind, point.parameter, point))
        for done, candidate in enumerate(candidates):
            self.monitor("confirmation", done, len(candidates) + 1)
            self._confirm(*candidate, [other for _, other, _ in candidates])
        cycles = tuple(self.ends)
        for sweep in self.sweeps:
            self._changes(sweep, cycles)
        self.monitor("confirmation", len(candidates) + 1, len(candidates) + 1)
        self.ends = [end for end in self.ends if end in cycles or not _lost_before(end, self.ends)]

    def _same(self, one: float, other: float) -> bool:
        """Whether two speeds are the same."""
        return abs(one - other) <= _SAME * (self.bounds[1] - self.bounds[0])

    def _confirm(self, kind: str, value: float, special: SpecialPoint | None, candidates: list[float]) -> None:
        """Keep a candidate where runs on both sides of it show different motions."""
        others = [abs(other - value) for other in candidates if not self._same(other, value)]
        run = beside(self.system, self.monitor, value)
        if special is not None:
            run = from_orbit(self.system, self.monitor, special)
        sides = sides_of(run, value, min(others, default=math.inf))
        if sides is None and all(abs(other - value) > _TOGETHER * value for _, other in self.found):
            # Runs between two so near to each other change too slowly: those on both sides of both tell of the first.
            sides = sides_of(run, value, min((gap for gap in others if gap > _TOGETHER * value), default=math.inf))
        if sides is None or (special is not None and not ends_between(self.system, self.monitor, value, *sides)):
            return
        if kind != "vanishing_stick":
            self.found.append((kind, value))
        if special is not None and sides[0].sticks and not sides[1].sticks:
            self.ends.append(value)

    def _changes(self, sweep: Sweep, cycles: Sequence[float]) -> None:
        """Keep the ends and onsets of stick-slip that runs show and the ends of `cycles` do not explain."""
        for value, sides in changes_of_sticking(sweep, [*self.ends, *(value for _, value in self.found)]):
            if sides[0].sticks and _lost_before(value, cycles):
                continue
            # Where a motion goes on beyond, a start has left its basin; of those the run from rest has a name.
            suffix = "" if ends_between(self.system, self.monitor, value, *sides) else "_from_rest"
            if suffix and sweep.start != "rest":
                self.left += [value] if sweep.start != "followed" else []
            elif sides[0].sticks and not suffix:
                self.ends.append(value)
            elif value not in (other for _, other in self.found):
                self.found.append((("end" if sides[0].sticks else "onset") + "_of_stick_slip" + suffix, value))

    def result(self, *, finished: bool = True) -> CriticalVelocities:
        """As far as the search came."""
        found, brackets = list(self.found), tuple[tuple[str, float, float], ...]()
        looks, top = [(speed, end.sticks) for sweep in self.sweeps for speed, end in sweep.looks], self.bounds[1]
        if not finished:
            brackets = _brackets(
                [sweep for sweep in self.sweeps if sweep.start == "rest"], [value for _, value in found]
            )
        elif isinstance(self.system, Oscillator):
            found += [("end_of_stick_slip", max(self.ends))] if self.ends else []
        else:
            # Stick-slip of several masses may end and begin again, and what does so may not be told from a transient.
            found += [("end_of_stick_slip", value) for value in sorted(set(self.ends))]
            brackets = _brackets(self.sweeps, [*self.left, *(value for _, value in found)])
        return CriticalVelocities(
            all=tuple(found),
            criticalities=tuple(self.natures),
            special_points=tuple(self.points),
            neutral=tuple(self.neutral),
            finished=finished,
            brackets=brackets,
            unstable=self.unstable,
            beyond=top if any(look == (top, True) for look in looks) else None,
        )


def _lost_before(value: float, ends: Sequence[float]) -> bool:
    """Whether runs that lose a motion at a speed may have lost it before its end, near which its basin is small."""
    return any(value < end < (1 + _LOST_BEFORE) * value for end in ends)


def _brackets(sweeps: list[Sweep], known: list[float]) -> tuple[tuple[str, float, float], ...]:
    """Between which speeds runs stop or begin to stick, where no speed that is known explains it; what overlaps is one."""
    found: list[tuple[str, float, float]] = []
    for sweep in sweeps:
        for (low, below), (high, _) in unlike_neighbours(sweep.looks):
            name = "end_of_stick_slip" if below.sticks else "onset_of_stick_slip"
            # Runs lose a cycle before its end.
            slack = _LOST_BEFORE * high if below.sticks else 0.0
            if not any(low <= value <= high + slack for value in known):
                found.append((name, low, high))
    whole: list[tuple[str, float, float]] = []
    for name, low, high in sorted(found):
        if whole and whole[-1][0] == name and low <= whole[-1][2]:
            whole[-1] = name, whole[-1][1], max(high, whole[-1][2])
        else:
            whole.append((name, low, high))
    return tuple(whole)
