"""The drive velocities at which the kind of motion changes, found directly and confirmed by runs on both sides."""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from stickslip.dynamics.continuation.arclength import Family, Point, axis, corrected
from stickslip.dynamics.continuation.branch import Branch, SpecialPoint
from stickslip.dynamics.continuation.branches import born_branch, lies_on
from stickslip.dynamics.continuation.walk import Walk
from stickslip.dynamics.critical.confirmation import Shown, drive_of, reach, shown, slowest_period, speed_scale
from stickslip.dynamics.periodic.cycles import event_cycle
from stickslip.dynamics.periodic.equilibria import criticality, stability, steady_changes, steady_slip
from stickslip.dynamics.periodic.event_sequence import check, with_number
from stickslip.dynamics.periodic.poincare_map import Lost, forcing_period
from stickslip.errors import InputError, UnfinishedWarning
from stickslip.files.checks import number
from stickslip.files.notebook import InNotebook, waiting_by_stage
from stickslip.model.system import Oscillator, System
from stickslip.simulation.time_limit import TimeIsUp, TimeLimit

_PATH = "/drive_velocity"
#: Special points of cycles that a run can show.
_KINDS = (
    *("grazing_sliding", "crossing_sliding", "switching_sliding", "adding_sliding", "nonsmooth_fold", "fold"),
    *("nonsmooth_hopf", "vanishing_stick"),
)
#: Speeds from low to high at which runs look at the motion, and half as many that lie closer at the low end.
_SWEEP = 64
#: How far on both sides of a speed runs confirm it, relative to the speed, and for how many cycles; the next if they do not.
_CONFIRM = ((1e-3, 300), (1e-3, 3000), (1e-2, 300), (1e-4, 3000))
#: How long the runs of a sweep are, and those that close in on a change which no followed cycle explains.
_CYCLES, _LONG = 100, 600
#: How long runs of several masses have to be, where only runs tell a change, and how near that is, relative to the speed.
_LONGEST, _NEAR = 3000, 1e-5
#: The last step of a motion that is followed to its end, relative to the speed.
_CLOSE = 1e-4
#: Two speeds closer than this, relative to the bounds, are the same.
_SAME = 1e-6
#: Candidates closer than this, relative to the speed, may be too near for runs to tell which of them changes the motion.
_TOGETHER = 1e-3

#: A run of so many cycles at a drive velocity.
Run = Callable[[float, float], Shown]
#: What runs of one kind show over the speeds.
Sweep = tuple[Run, list[tuple[float, Shown]]]
#: Two runs, below a speed and above it.
Sides = tuple[Shown, Shown]


@dataclass(frozen=True)
class CriticalVelocities(Mapping[str, float], InNotebook):
    """Critical drive velocities by name, the lowest of each; `all` has every one.

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
        return min(values)

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


class _Watch:
    """Says how far a search is, and ends it at a limit of time."""

    def __init__(self, progress: Callable[[str, int, int], Any] | None, limit: TimeLimit) -> None:
        self.say, self.limit = waiting_by_stage(progress), limit
        self._last = ("runs", 0, 1)

    def __call__(self, what: str, done: int, n: int) -> None:
        self._last = (what, done, n)
        self.go_on()

    def go_on(self, *_: int) -> None:
        """The search is where it was, and goes on."""
        self.limit.keep()
        self.say(*self._last)

    def shown(self, *run: Any) -> Shown:
        """A run, before the limit."""
        self.go_on()
        found = shown(*run, max_seconds=self.limit.left)
        if found.stop == "max_seconds":
            raise TimeIsUp
        return found


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

    Several masses start at rest at unlike positions, and along the mode that grows beside steady slip. Their motions may be
    chaotic, with long transients; of them only the changes of steady slip and of sticking are given: every end and onset of
    stick-slip, as it may end and begin again. A cycle beside it is followed to what ends it (to rounding, with its name),
    else runs of 3000 of the slowest natural periods tell it to 1e-5. What these do not settle is in ``.brackets``. Sticks in
    less than 1e-4 of the time are none.

    Limits: cycles that are reached neither from rest, nor from beside steady slip, nor from those at another speed, are not
    looked for; nor is, of several masses, what happens and is undone between two of the 96 speeds.

    Source: Thomsen & Fidlin, Int. J. Non-Linear Mech. 38 (2003) 389; Leine & Nijmeijer 2004 (LNACM 18), ch. 8.

    >>> from stickslip.laws import ExponentialStribeck
    >>> found = critical_velocities(Oscillator(0.1, 1.0, ExponentialStribeck(1.0, 0.5, 0.5)))
    >>> round(found["hopf"], 12), found.criticality, round(found["nonsmooth_fold"], 7)
    (1.151292546497, 'subcritical', 1.836601)
    """
    scale = _checked(system)
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
    watch = _Watch(progress, TimeLimit.after(max_seconds, "critical_velocities"))
    sweeps: list[Sweep] = [(_from_rest(system, watch), []), (_beside(system, watch), [])]
    try:
        steady, neutral = steady_changes(system, _PATH, (low, high), keep=watch.limit.keep)
        for kind, value in steady:
            if kind == "hopf":
                watch.limit.keep()
                natures += ((value, criticality(system, _PATH, value)),)
        if not steady and not neutral and _grows_everywhere(system, low, high):
            unstable = (low, high)
        ends = _search(system, (low, high), steady, neutral, watch, sweeps, found, points)
    except TimeIsUp:
        warnings.warn(
            "critical_velocities: the search ended after max_seconds and is unfinished; raise max_seconds to go on",
            UnfinishedWarning,
            stacklevel=2,
        )
        brackets = _brackets(sweeps[0], found)
        return CriticalVelocities(tuple(found), natures, tuple(points), tuple(neutral), False, brackets, unstable)
    if isinstance(system, Oscillator):
        found += [("end_of_stick_slip", max(ends))] if ends else []
        return CriticalVelocities(tuple(found), natures, tuple(points), tuple(neutral), unstable=unstable)
    # Stick-slip of several masses may end and begin again, and what does so may not be told from a transient.
    found += [("end_of_stick_slip", value) for value in sorted(set(ends))]
    return CriticalVelocities(
        tuple(found), natures, tuple(points), tuple(neutral), brackets=_brackets(sweeps[0], found), unstable=unstable
    )


def _grows_everywhere(system: Oscillator | System, low: float, high: float) -> bool:
    """Whether small disturbances of steady slip grow, at five speeds of a range in which that does not change."""
    return all(stability(with_number(system, _PATH, speed))[0] < 0 for speed in np.linspace(low, high, 5))


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
    if system.springs or any(contact.normal_force is not None for contact in system.contacts):
        raise InputError(
            "critical_velocities: of several masses the springs must be linear and normal forces constant; look at an "
            "orbit_diagram over drive_velocity"
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
    watch: _Watch,
    sweeps: list[Sweep],
    found: list[tuple[str, float]],
    points: list[SpecialPoint],
) -> list[float]:
    """Add what runs show, the special points of cycles and what runs confirm of them to the lists; the ends of stick-slip."""
    low, high = bounds
    _look(system, low, high, watch, sweeps)
    if isinstance(system, Oscillator):
        branches = _branches(system, bounds, steady, neutral, sweeps, watch)
    else:
        branches = _branches_of_masses(system, bounds, sweeps, watch)
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
        run = _beside(system, watch, value) if special is None else _from_orbit(system, watch, special)
        sides = _sides(run, value, min(others, default=math.inf))
        if sides is None and all(abs(other - value) > _TOGETHER * value for _, other in found):
            # Runs between two so near to each other change too slowly: those on both sides of both tell of the first.
            sides = _sides(run, value, min((gap for gap in others if gap > _TOGETHER * value), default=math.inf))
        if sides is None or (special is not None and not _ends(system, watch, value, *sides)):
            continue
        if kind != "vanishing_stick":
            found.append((kind, value))
        if special is not None and sides[0].sticks and not sides[1].sticks:
            ends.append(value)
    for run, looks in sweeps:
        for value, sides in _changes_of_sticking(run, looks, [*ends, *(value for _, value in found)]):
            # Where a motion goes on beyond, a start has left its basin; of those the run from rest has a name.
            suffix = "" if _ends(system, watch, value, *sides) else "_from_rest"
            if suffix and run is not sweeps[0][0]:
                continue
            if sides[0].sticks and not suffix:
                ends.append(value)
            elif value not in (other for _, other in found):
                found.append((("end" if sides[0].sticks else "onset") + "_of_stick_slip" + suffix, value))
    watch("confirmation", len(candidates) + 1, len(candidates) + 1)
    return ends


def _sides(run: Run, value: float, gap: float) -> Sides | None:
    """What runs below and above a speed show, nearer to it than the next candidate; None where they show the same."""
    first = None
    for share, cycles in _CONFIRM:
        width = min(share * value, gap / 3)
        below, above = run(value - width, cycles), run(value + width, cycles)
        if below.differs(above):
            if below.decided and above.decided:
                return below, above
            first = first or (below, above)
    return first


def _ends(system: Oscillator | System, watch: _Watch, value: float, below: Shown, above: Shown) -> bool:
    """Whether a motion ends between two speeds; of several masses one that sticks, as little else is clear in chaos."""
    if isinstance(system, Oscillator):
        return _attracts(system, watch, value, below, above)
    here, there = (below, above) if below.sticks else (above, below)
    beyond = with_number(system, _PATH, there.speed)
    return here.sticks and not there.sticks and not watch.shown(beyond, _LONGEST, *here.end).sticks


def _attracts(system: Oscillator, watch: _Watch, value: float, below: Shown, above: Shown) -> bool:
    """Whether a motion that attracts on one side does not on the other: from where it ended it goes on on both sides.

    Where neither motion changes, the start of the runs left the basin of one for that of the other.
    """

    def goes_on(side: Shown, speed: float, cycles: float) -> Shown:
        return watch.shown(with_number(system, _PATH, speed), cycles, *side.end)

    sides = [below, above]
    for i, side in enumerate(sides):
        if abs(side.size - side.size_before) > 1e-3 * side.size:  # it has not settled
            sides[i] = goes_on(side, side.speed, 3000)
    return any(
        goes_on(side, side.speed, cycles).differs(goes_on(side, 2 * value - side.speed, cycles))
        for cycles in (300, 3000)
        for side in sides
    )


def _from_rest(system: Oscillator | System, watch: _Watch) -> Run:
    return lambda speed, cycles: watch.shown(with_number(system, _PATH, speed), cycles)


def _beside(system: Oscillator | System, watch: _Watch, value: float | None = None) -> Run:
    """Runs from a small disturbance of steady slip; near a corner of the law at a speed one that does not reach it."""

    def run(speed: float, cycles: float) -> Shown:
        size = 0.1 * (speed if value is None else abs(speed - value))
        return watch.shown(with_number(system, _PATH, speed), cycles, *_disturbed(system, speed, size))

    return run


def _disturbed(system: Oscillator | System, speed: float, size: float) -> tuple[Any, Any]:
    """A state beside steady slip, where friction and springs balance: with a velocity, of masses along their first mode."""
    if isinstance(system, Oscillator):
        return float(system.law.kinetic_force(speed)) / system.stiffness, size
    state = steady_slip(with_number(system, _PATH, speed))
    if state is not None:
        return state.x + size * state.displacement, size * state.mode
    force = np.zeros(system.masses)
    for contact in system.contacts:
        force[contact.mass] += float(contact.law.kinetic_force(speed))
    return np.linalg.solve(np.array(system.stiffness), force), size * np.ones(system.masses)


def _from_orbit(system: Oscillator | System, watch: _Watch, special: SpecialPoint) -> Run:
    """Runs from the orbit at a special point: from where it begins to stick, as nothing before is remembered there."""
    assert special.point is not None
    here = special.point.here
    state, stuck = here.sequence.start, here.sequence.stuck[:, 0]
    captures = np.flatnonzero(stuck & ~np.roll(stuck, 1))
    if captures.size and captures[0] > 0:
        state = here.sequence.follow(keep="nothing").states[captures[0] - 1]
    layout = here.sequence.layout
    x: Any = state[layout.x]
    v: Any = state[layout.v]
    if layout.masses == 1:
        x, v = float(x[0]), None if captures.size else float(v[0])
    return lambda speed, cycles: watch.shown(with_number(system, _PATH, speed), cycles, x, v)


def _brackets(sweep: Sweep, known: list[tuple[str, float]]) -> tuple[tuple[str, float, float], ...]:
    """Between which speeds the runs of a sweep stop or begin to stick, where no speed that is known explains it."""
    return tuple(
        ("end_of_stick_slip" if below.sticks else "onset_of_stick_slip", low, high)
        for (low, below), (high, _) in _unlike_neighbours(sweep[1])
        if not any(low <= value <= high for _, value in known)
    )


def _look(system: Oscillator | System, low: float, high: float, watch: _Watch, sweeps: list[Sweep]) -> None:
    """Add what runs show over the speeds: from rest, beside steady slip that is unstable, and beyond where those end."""
    speeds = np.union1d(np.linspace(low, high, _SWEEP), np.geomspace(low, high, _SWEEP // 2)).tolist()
    unstable = []
    for speed in speeds:
        watch.limit.keep()
        damping, neutral = stability(with_number(system, _PATH, speed))
        if not (damping >= 0 or neutral):
            unstable.append(speed)
    count = len(speeds) + len(unstable)
    for (run, looks), some in zip(sweeps, (speeds, unstable), strict=True):
        for speed in some:
            watch("runs", sum(len(known) for _, known in sweeps), count)
            looks.append((speed, run(speed, _CYCLES)))
        if isinstance(system, System):
            _outlast(run, looks)
    for changes in [tuple(_unlike_neighbours(looks)) for _, looks in sweeps]:
        for below, above in changes:
            sweep = _followed(system, watch, (below, above), speeds)
            # Where it ends at once, the sweep it comes from has shown that.
            if len(sweep[1]) > 2:
                sweeps.append(sweep)
                if isinstance(system, System):
                    _outlast(*sweep)
    watch("runs", count, count)


def _followed(
    system: Oscillator | System, watch: _Watch, change: tuple[tuple[float, Shown], ...], speeds: Sequence[float]
) -> Sweep:
    """The motion that sticks on one side of a change, followed beyond it from speed to speed until it sticks no more."""
    here, beyond = change if change[0][1].sticks else change[::-1]
    way = math.copysign(1.0, beyond[0] - here[0])
    ends = {here[0]: here[1].end}

    def run(speed: float, cycles: float) -> Shown:
        start = ends[
            max((known for known in ends if way * known <= way * speed), key=lambda at: way * at, default=here[0])
        ]
        look = watch.shown(with_number(system, _PATH, speed), cycles, *start)
        if look.sticks:
            ends[speed] = look.end
        elif speed != here[0]:
            ends.pop(speed, None)
        return look

    looks = [here]
    for speed in sorted((speed for speed in speeds if way * speed > way * here[0]), key=lambda speed: way * speed):
        looks.append((speed, run(speed, _CYCLES)))
        if not looks[-1][1].sticks:
            break
    # Near its end the basin of a motion is small: a long step leaves it before the motion ends.
    (last, _), (lost, look) = looks[-2:]
    step = 0.0 if look.sticks else (lost - last) / 2
    while abs(step) > _CLOSE * last:
        look = run(last + step, _LONG)
        if look.sticks:
            looks.insert(-1, (last := last + step, look))
        else:
            looks[-1] = (last + step, look)
            step /= 2
    return run, looks


def _outlast(run: Run, looks: list[tuple[float, Shown]]) -> None:
    """Run longer beside each speed at which the runs stop or begin to stick: of several masses transients are long."""
    known: set[float] = set()
    while doubtful := {speed for pair in _unlike_neighbours(looks) for speed, _ in pair} - known:
        looks[:] = [(speed, run(speed, _LONGEST) if speed in doubtful else look) for speed, look in looks]
        known |= doubtful


def _changes_of_sticking(
    run: Run, looks: list[tuple[float, Shown]], known: Sequence[float]
) -> Iterator[tuple[float, Sides]]:
    """Where a sweep shows an end or an onset of stick-slip: at a known speed that explains it, else by bisection on runs.

    The runs of a bisection are added to `looks`, of several masses of one that ends at a speed.
    """
    for (low, below), (high, _) in tuple(_unlike_neighbours(looks)):
        sticks = below.sticks
        slack = 0.0 if below.several else 0.02 * low
        for value in known:
            if low - slack <= value <= high + slack:
                sides = _sides(run, value, math.inf)
                if sides is not None and sides[0].sticks == sticks != sides[1].sticks:
                    yield value, sides
                    break
        else:
            cycles, near = (_LONGEST, _NEAR) if below.several else (_LONG, 1e-9)
            if run(low, cycles).sticks != sticks or run(high, cycles).sticks == sticks:
                continue
            between = [] if below.several else looks
            while high - low > near * high:
                middle = (low + high) / 2
                between.append((middle, run(middle, cycles)))
                if between[-1][1].sticks == sticks:
                    low = middle
                else:
                    high = middle
            sides = _sides(run, low, math.inf)
            # Sticks that go below what counts as one, at no speed in particular, do not end there.
            if (
                sides is not None
                and sides[0].sticks != sides[1].sticks
                and not run(low if sticks else high, cycles).short
                and not (below.several and any(run(side.speed, _LONGEST).sticks != side.sticks for side in sides))
            ):
                if below.several:
                    looks += between
                yield low, sides


def _branches(
    system: Oscillator | System,
    bounds: tuple[float, float],
    steady: list[tuple[str, float]],
    neutral: list[tuple[float, float]],
    sweeps: list[Sweep],
    watch: _Watch,
) -> list[Branch]:
    """The branches of the cycles that the sweeps show, and of those born at Hopf points."""
    family = Family((_PATH,), (bounds,), relative=True)
    branches: list[Branch] = []

    def follow(speed: float, sweep: int, look: Shown) -> None:
        there = with_number(system, _PATH, speed)
        guess = [None, _disturbed(system, speed, 0.1 * speed), look.end][min(sweep, 2)]
        branch = _branch(there, speed, guess, family, branches, watch)
        if branch is not None:
            branches.append(branch)

    count, done = sum(len(looks) for _, looks in sweeps) + len(steady), 0
    for sweep, (_, looks) in enumerate(sweeps):
        for speed, look in looks:
            watch("cycles", done, count)
            done += 1
            # Around a centre there is a cycle of any size: none of them is a branch.
            centre = look.stick_time == 0 and any(first <= speed <= last for first, last in neutral)
            if (
                look.lasts
                and not centre
                and not _decays(system, speed, look)
                and not any(_passes(branch, speed, look) for branch in branches)
            ):
                follow(speed, sweep, look)
    for _, value in steady:
        watch("cycles", done, count)
        done += 1
        new = born_branch(with_number(system, _PATH, value), value, family, branches, 200, watch.go_on)
        if new is not None:
            branches.append(new)
    watch("cycles", count, count)
    return branches


def _branches_of_masses(
    system: System, bounds: tuple[float, float], sweeps: list[Sweep], watch: _Watch
) -> list[Branch]:
    """The branches of the cycles beside which the runs of masses stop or begin to stick, over the speeds around that.

    Most motions of several masses are no cycles, and those that are have many special points at which no motion ends.
    """
    branches: list[Branch] = []
    changes = [(looks, *pair) for _, looks in sweeps for pair in _unlike_neighbours(looks)]
    for done, (looks, below, above) in enumerate(changes):
        watch("cycles", done, len(changes))
        last, beyond = (below[0], above[0]) if below[1].sticks else (above[0], below[0])
        # Near its end a motion settles slowly: the cycle is that of the nearest run that has settled.
        side = [look for look in looks if (look[0] - last) * (last - beyond) >= 0]
        settled = [look for look in side if look[1].sticks and look[1].repeats]
        if not settled:
            continue
        speed, look = min(settled, key=lambda look: abs(look[0] - last))
        # So far that the cycle is followed to what ends it.
        end = float(np.clip(2 * beyond - last, *bounds))
        family = Family((_PATH,), ((min(speed, end), max(speed, end)),), relative=True)
        branch = _branch(with_number(system, _PATH, speed), speed, look.end, family, branches, watch)
        if branch is not None:
            branches.append(branch)
    watch("cycles", len(changes), len(changes))
    return branches


def _unlike_neighbours(looks: list[tuple[float, Shown]]) -> Iterator[tuple[tuple[float, Shown], tuple[float, Shown]]]:
    """Speeds beside each other, in their order, of which only one shows sticks."""
    for pair in itertools.pairwise(sorted(looks, key=lambda look: look[0])):
        if pair[0][1].sticks != pair[1][1].sticks:
            yield pair


def _decays(system: Oscillator | System, speed: float, look: Shown) -> bool:
    """Whether a motion without sticks decays as small disturbances of steady slip do, however slowly."""
    state = steady_slip(with_number(system, _PATH, speed))
    if state is None or state.neutral or state.growth >= 0 or look.stick_time > 0:
        return False
    return abs(look.growth - state.growth) < 0.05 * abs(state.growth)


def _passes(branch: Branch, speed: float, look: Shown) -> bool:
    """Whether a branch has a cycle as large as that of a run."""
    values, sizes = np.asarray(branch.values), np.subtract(branch.x_max, branch.x_min)
    near = np.flatnonzero((values[:-1] - speed) * (values[1:] - speed) <= 0)
    # Near a Hopf point neighbours differ much.
    gaps = values[near + 1] - values[near]
    shares = np.divide(speed - values[near], gaps, out=np.zeros(len(near)), where=gaps != 0)
    there = sizes[near] + shares * (sizes[near + 1] - sizes[near])
    return bool((np.abs(there - 2 * look.size) < 0.1 * there).any())


def _branch(
    system: Oscillator | System, value: float, guess: Any, family: Family, known: list[Branch], watch: _Watch
) -> Branch | None:
    try:
        length = 150 * system.natural_period
        if isinstance(system, System):
            length = 30 * slowest_period(system) + 10 * reach(system).max() / drive_of(system)
        cycle = event_cycle(system, guess, t_end=None if guess is None else length, progress=watch.go_on)
        neutral = cycle.marginal and (isinstance(system, System) or not cycle.sticks)
        if neutral or any(lies_on(branch, cycle, value) for branch in known):
            return None
        sequence = cycle.closed.sequence
        start = corrected(sequence, cycle.forcing_periods, family, np.array([value]), axis(sequence))
        way = start.direction * (1.0 if start.direction[-1] > 0 else -1.0)
        up = Walk(family, 200, watch.go_on).go(Point(start.here, start.values, way))
        down = Walk(family, 60, watch.go_on).go(Point(start.here, start.values, -way)) if not cycle.sticks else None
    except (InputError, Lost):
        return None
    return up if down is None else down.reversed().joined(up)
