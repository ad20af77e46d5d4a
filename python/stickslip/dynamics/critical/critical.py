"""The drive velocities at which the kind of motion changes, found directly and confirmed by runs on both sides."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from stickslip.dynamics.continuation.branch import SpecialPoint
from stickslip.dynamics.critical.branch_search import branches_of, branches_of_masses
from stickslip.dynamics.critical.confirmation import Shown, speed_scale
from stickslip.dynamics.critical.runs import (
    LONGEST,
    PATH,
    Sweep,
    Watch,
    beside,
    changes_of_sticking,
    from_orbit,
    from_rest,
    look_over,
    nearly_together,
    sides_of,
    unlike_neighbours,
)
from stickslip.dynamics.periodic.equilibria import criticality, stability, steady_changes
from stickslip.dynamics.periodic.event_sequence import check, with_number
from stickslip.dynamics.periodic.poincare_map import forcing_period
from stickslip.errors import InputError, UnfinishedWarning
from stickslip.files.checks import number
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
    velocities where steady slip is unstable at every one of them, else None.
    """

    all: tuple[tuple[str, float], ...]
    criticalities: tuple[tuple[float, str], ...] = ()
    special_points: tuple[SpecialPoint, ...] = field(default=(), repr=False)
    neutral: tuple[tuple[float, float], ...] = ()
    finished: bool = True
    brackets: tuple[tuple[str, float, float], ...] = ()
    unstable: tuple[float, float] | None = None

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
    found: list[tuple[str, float]] = []
    points: list[SpecialPoint] = []
    steady: list[tuple[str, float]] = []
    neutral: list[tuple[float, float]] = []
    natures: tuple[tuple[float, str], ...] = ()
    unstable = None
    watch = Watch(progress, TimeLimit.after(max_seconds, "critical_velocities"))
    sweeps: list[Sweep] = [(from_rest(system, watch), []), (beside(system, watch), [])]
    if isinstance(system, System):
        sweeps.append((nearly_together(system, watch), []))
    try:
        steady, neutral = steady_changes(system, PATH, (low, high), keep=watch.limit.keep)
        for kind, value in steady:
            if kind == "hopf":
                watch.limit.keep()
                natures += ((value, criticality(system, PATH, value)),)
        if not steady and not neutral and _grows_everywhere(system, low, high):
            unstable = (low, high)
        ends, left = _search(system, (low, high), steady, neutral, watch, sweeps, found, points)
    except TimeIsUp:
        warnings.warn(
            "critical_velocities: the search ended after max_seconds and is unfinished; raise max_seconds to go on",
            UnfinishedWarning,
            stacklevel=2,
        )
        brackets = _brackets(sweeps[:1], [value for _, value in found])
        return CriticalVelocities(tuple(found), natures, tuple(points), tuple(neutral), False, brackets, unstable)
    if isinstance(system, Oscillator):
        found += [("end_of_stick_slip", max(ends))] if ends else []
        return CriticalVelocities(tuple(found), natures, tuple(points), tuple(neutral), unstable=unstable)
    # Stick-slip of several masses may end and begin again, and what does so may not be told from a transient.
    found += [("end_of_stick_slip", value) for value in sorted(set(ends))]
    brackets = _brackets(sweeps, [*left, *(value for _, value in found)])
    return CriticalVelocities(
        tuple(found), natures, tuple(points), tuple(neutral), brackets=brackets, unstable=unstable
    )


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
        return float(system.law.break_away_force() / (system.stiffness * system.mass) ** 0.5)
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


def _search(
    system: Oscillator | System,
    bounds: tuple[float, float],
    steady: list[tuple[str, float]],
    neutral: list[tuple[float, float]],
    watch: Watch,
    sweeps: list[Sweep],
    found: list[tuple[str, float]],
    points: list[SpecialPoint],
) -> tuple[list[float], list[float]]:
    """Add what runs show, the special points of cycles and what runs confirm of them to the lists.

    Returns
    -------
    the ends of stick-slip, and where only the start of a run leaves the basin of a motion that goes on.
    """
    low, high = bounds
    look_over(system, low, high, watch, sweeps)
    if isinstance(system, Oscillator):
        branches = branches_of(system, bounds, steady, neutral, sweeps, watch)
    else:
        branches = branches_of_masses(system, bounds, sweeps, watch)
    for branch in branches:
        for point in branch.special_points:
            if all(abs(point.parameter - other.parameter) > _SAME * (high - low) for other in points):
                points.append(point)
    candidates: list[tuple[str, float, SpecialPoint | None]] = [(*item, None) for item in steady]
    # A motion ends at a fold; what else happens to the cycle beside it does so on the way.
    for point in sorted(points, key=lambda point: "fold" not in point.kind):
        same = [value for kind, value in steady if kind == point.kind]
        if point.kind in _KINDS and all(abs(point.parameter - value) > _SAME * (high - low) for value in same):
            candidates.append((point.kind, point.parameter, point))
    ends: list[float] = []
    for done, (kind, value, special) in enumerate(candidates):
        watch("confirmation", done, len(candidates) + 1)
        others = [abs(other - value) for _, other, _ in candidates if abs(other - value) > _SAME * (high - low)]
        run = beside(system, watch, value) if special is None else from_orbit(system, watch, special)
        sides = sides_of(run, value, min(others, default=math.inf))
        if sides is None and all(abs(other - value) > _TOGETHER * value for _, other in found):
            # Runs between two so near to each other change too slowly: those on both sides of both tell of the first.
            sides = sides_of(run, value, min((gap for gap in others if gap > _TOGETHER * value), default=math.inf))
        if sides is None or (special is not None and not _ends(system, watch, value, *sides)):
            continue
        if kind != "vanishing_stick":
            found.append((kind, value))
        if special is not None and sides[0].sticks and not sides[1].sticks:
            ends.append(value)
    ends_of_cycles, left = tuple(ends), list[float]()
    for run, looks in sweeps:
        for value, sides in changes_of_sticking(run, looks, [*ends, *(value for _, value in found)]):
            if sides[0].sticks and _lost_before(value, ends_of_cycles):
                continue
            # Where a motion goes on beyond, a start has left its basin; of those the run from rest has a name.
            suffix = "" if _ends(system, watch, value, *sides) else "_from_rest"
            if suffix and run is not sweeps[0][0]:
                left += [value] if run in (start for start, _ in sweeps[:3]) else []
                continue
            if sides[0].sticks and not suffix:
                ends.append(value)
            elif value not in (other for _, other in found):
                found.append((("end" if sides[0].sticks else "onset") + "_of_stick_slip" + suffix, value))
    watch("confirmation", len(candidates) + 1, len(candidates) + 1)
    return [end for end in ends if end in ends_of_cycles or not _lost_before(end, ends)], left


def _lost_before(value: float, ends: Sequence[float]) -> bool:
    """Whether runs that lose a motion at a speed may have lost it before its end, near which its basin is small."""
    return any(value < end < (1 + _LOST_BEFORE) * value for end in ends)


def _ends(system: Oscillator | System, watch: Watch, value: float, below: Shown, above: Shown) -> bool:
    """Whether a motion ends between two speeds; of several masses one that sticks, as little else is clear in chaos."""
    if isinstance(system, Oscillator):
        return _attracts(system, watch, value, below, above)
    here, there = (below, above) if below.sticks else (above, below)
    beyond = with_number(system, PATH, there.speed)
    return here.sticks and not there.sticks and not watch.shown(beyond, LONGEST, *here.start_at(there.speed)).sticks


def _attracts(system: Oscillator, watch: Watch, value: float, below: Shown, above: Shown) -> bool:
    """Whether a motion that attracts on one side does not on the other: from where it ended it goes on on both sides.

    Where neither motion changes, the start of the runs left the basin of one for that of the other.
    """

    def goes_on(side: Shown, speed: float, cycles: float) -> Shown:
        return watch.shown(with_number(system, PATH, speed), cycles, *side.start_at(speed))

    sides = [below, above]
    for i, side in enumerate(sides):
        if abs(side.size - side.size_before) > 1e-3 * side.size:  # it has not settled
            sides[i] = goes_on(side, side.speed, 3000)
    return any(
        goes_on(side, side.speed, cycles).differs(goes_on(side, 2 * value - side.speed, cycles))
        for cycles in (300, 3000)
        for side in sides
    )


def _brackets(sweeps: list[Sweep], known: list[float]) -> tuple[tuple[str, float, float], ...]:
    """Between which speeds runs stop or begin to stick, where no speed that is known explains it; what overlaps is one."""
    found: list[tuple[str, float, float]] = []
    for _, looks in sweeps:
        for (low, below), (high, _) in unlike_neighbours(looks):
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
