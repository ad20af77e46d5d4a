"""Runs that look at the motion over drive velocities, and where what they show changes."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from stickslip.dynamics.continuation.branch import SpecialPoint
from stickslip.dynamics.critical.confirmation import Shown, rest, shown
from stickslip.dynamics.periodic.equilibria import stability, steady_slip
from stickslip.dynamics.periodic.event_sequence import with_number
from stickslip.files.notebook import waiting_by_stage
from stickslip.model.system import Oscillator, System
from stickslip.simulation.time_limit import TimeIsUp, TimeLimit

PATH = "/drive_velocity"
#: Speeds from low to high at which runs look at the motion, and half as many that lie closer at the low end.
_SWEEP = 64
#: How far on both sides of a speed runs confirm it, relative to the speed, and for how many cycles; the next if they do not.
_CONFIRM = ((1e-3, 300), (1e-3, 3000), (1e-2, 300), (1e-4, 3000))
#: How long the runs of a sweep are, and those that close in on a change which no followed cycle explains.
_CYCLES, _LONG = 100, 600
#: How long runs of several masses have to be, where only runs tell a change, and how near that is, relative to the speed.
LONGEST, _NEAR = 3000, 1e-5
#: The last step of a motion that is followed to its end, relative to the speed.
_CLOSE = 1e-4

#: A run of so many cycles at a drive velocity.
Run = Callable[[float, float], Shown]
#: Two runs, below a speed and above it.
Sides = tuple[Shown, Shown]


@dataclass
class Sweep:
    """What runs of one kind show over the speeds.

    Attributes
    ----------
    start : ``"rest"``, ``"beside"`` steady slip, ``"nearly together"`` of several masses, or ``"followed"`` from the motion
        at another speed.
    looks : each speed with what its run shows.
    """

    start: str
    run: Run
    looks: list[tuple[float, Shown]] = field(default_factory=list)


class Watch:
    """Says how far a search is, and ends it at a limit of time."""

    def __init__(self, progress: Callable[[str, int, int], Any] | None, limit: TimeLimit) -> None:
        self.say, self.limit = waiting_by_stage(progress), limit
        self._last = ("runs", 0, 1)

    def __call__(self, what: str, done: int, n: int) -> None:
        """So many of n steps of this stage are done."""
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


def sides_of(run: Run, value: float, gap: float) -> Sides | None:
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


def from_rest(system: Oscillator | System, watch: Watch) -> Run:
    """Runs that start at rest on the drive, of several masses at unlike positions (:func:`~.confirmation.rest`)."""
    return lambda speed, cycles: watch.shown(with_number(system, PATH, speed), cycles)


def nearly_together(system: System, watch: Watch) -> Run:
    """Runs of several masses that start as a simulation without a start does, but for a thousandth of their reach."""
    start = rest(system, 1e-3)
    return lambda speed, cycles: watch.shown(with_number(system, PATH, speed), cycles, start)


def beside(system: Oscillator | System, watch: Watch, value: float | None = None) -> Run:
    """Runs from a small disturbance of steady slip; near a corner of the law at a speed one that does not reach it."""

    def run(speed: float, cycles: float) -> Shown:
        size = 0.1 * (speed if value is None else abs(speed - value))
        return watch.shown(with_number(system, PATH, speed), cycles, *disturbed(system, speed, size))

    return run


def disturbed(system: Oscillator | System, speed: float, size: float) -> tuple[Any, Any]:
    """A state beside steady slip, where friction and springs balance: with a velocity, of masses along their first mode."""
    if isinstance(system, Oscillator):
        return float(system.law.kinetic_force(speed)) / system.stiffness, size
    state = steady_slip(with_number(system, PATH, speed))
    if state is not None:
        return state.x + size * state.displacement, size * state.mode
    force = np.zeros(system.masses)
    for contact in system.contacts:
        force[contact.mass] += float(contact.law.kinetic_force(speed))
    return np.linalg.solve(np.array(system.stiffness), force), size * np.ones(system.masses)


def from_orbit(system: Oscillator | System, watch: Watch, special: SpecialPoint) -> Run:
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
    return lambda speed, cycles: watch.shown(with_number(system, PATH, speed), cycles, x, v)


def look_over(system: Oscillator | System, low: float, high: float, watch: Watch, sweeps: list[Sweep]) -> None:
    """Add what runs show over the speeds: from rest, beside steady slip that is unstable, and beyond where those end."""
    speeds = np.union1d(np.linspace(low, high, _SWEEP), np.geomspace(low, high, _SWEEP // 2)).tolist()
    unstable = []
    for speed in speeds:
        watch.limit.keep()
        damping, neutral = stability(with_number(system, PATH, speed))
        if not (damping >= 0 or neutral):
            unstable.append(speed)
    every = [unstable if sweep.start == "beside" else speeds for sweep in sweeps]
    count = sum(map(len, every))
    for sweep, some in zip(sweeps, every, strict=True):
        for speed in some:
            watch("runs", sum(len(known.looks) for known in sweeps), count)
            sweep.looks.append((speed, sweep.run(speed, _CYCLES)))
        if isinstance(system, System):
            _outlast(sweep)
    starts = tuple(sweeps)
    for changes in [tuple(unlike_neighbours(sweep.looks)) for sweep in starts]:
        for below, above in changes:
            sweep = _followed(system, watch, (below, above), speeds)
            # Where it ends at once, the sweep it comes from has shown that.
            if len(sweep.looks) > 2:
                sweeps.append(sweep)
                if isinstance(system, System):
                    _outlast(sweep)
    if isinstance(system, System):
        for sweep in starts:
            if sweep.start != "beside":
                _carry_on(system, watch, sweep.looks, speeds, sweeps)
    watch("runs", count, count)


def _carry_on(
    system: System, watch: Watch, looks: list[tuple[float, Shown]], speeds: Sequence[float], sweeps: list[Sweep]
) -> None:
    """Add sweeps of motions to which a start at rest leads at one speed, and to which it does not at the next."""
    for here, (speed, _) in tuple(itertools.pairwise(sorted(looks, key=lambda look: look[0]))):
        if not (here[1].sticks and here[1].repeats):
            continue
        look = watch.shown(with_number(system, PATH, speed), _CYCLES, *here[1].start_at(speed))
        known = [other for sweep in sweeps for at, other in sweep.looks if at == speed]
        if look.sticks and not any(look.resembles(other) for other in known):
            sweeps.append(_followed(system, watch, (here, (speed, look)), speeds))
            _outlast(sweeps[-1])


def _followed(
    system: Oscillator | System, watch: Watch, change: tuple[tuple[float, Shown], ...], speeds: Sequence[float]
) -> Sweep:
    """The motion that sticks on one side of a change, followed beyond it from speed to speed until it sticks no more."""
    here, beyond = change if change[0][1].sticks else change[::-1]
    way = math.copysign(1.0, beyond[0] - here[0])
    several = isinstance(system, System)
    ends = {here[0]: here[1]}

    def run(speed: float, cycles: float) -> Shown:
        start = ends[
            max((known for known in ends if way * known <= way * speed), key=lambda at: way * at, default=here[0])
        ]
        look = watch.shown(with_number(system, PATH, speed), cycles, *start.start_at(speed))
        if look.sticks:
            ends[speed] = look
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
        look = run(last + step, LONGEST if several else _LONG)
        if look.sticks:
            looks.insert(-1, (last := last + step, look))
        else:
            looks[-1] = (last + step, look)
            step /= 2
    return Sweep("followed", run, looks)


def _outlast(sweep: Sweep) -> None:
    """Run longer beside each speed at which the runs stop or begin to stick: of several masses transients are long."""
    known: set[float] = set()
    while doubtful := {speed for pair in unlike_neighbours(sweep.looks) for speed, _ in pair} - known:
        sweep.looks = [(speed, sweep.run(speed, LONGEST) if speed in doubtful else look) for speed, look in sweep.looks]
        known |= doubtful


def changes_of_sticking(sweep: Sweep, known: Sequence[float]) -> Iterator[tuple[float, Sides]]:
    """Where a sweep shows an end or an onset of stick-slip: at a known speed that explains it, else by bisection on runs.

    The runs of a bisection are added to it, of several masses of one that ends at a speed.
    """
    run, looks = sweep.run, sweep.looks
    for (low, below), (high, _) in tuple(unlike_neighbours(looks)):
        sticks = below.sticks
        slack = 0.0 if below.several else 0.02 * low
        for value in known:
            if low - slack <= value <= high + slack:
                sides = sides_of(run, value, math.inf)
                if sides is not None and sides[0].sticks == sticks != sides[1].sticks:
                    yield value, sides
                    break
        else:
            cycles, near = (LONGEST, _NEAR) if below.several else (_LONG, 1e-9)
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
            sides = sides_of(run, low, math.inf)
            # Sticks that go below what counts as one, at no speed in particular, do not end there.
            if (
                sides is not None
                and sides[0].sticks != sides[1].sticks
                and not run(low if sticks else high, cycles).short
                and not (below.several and any(run(side.speed, LONGEST).sticks != side.sticks for side in sides))
            ):
                if below.several:
                    looks += between
                yield low, sides


def unlike_neighbours(looks: list[tuple[float, Shown]]) -> Iterator[tuple[tuple[float, Shown], tuple[float, Shown]]]:
    """Speeds beside each other, in their order, of which only one shows sticks."""
    for pair in itertools.pairwise(sorted(looks, key=lambda look: look[0])):
        if pair[0][1].sticks != pair[1][1].sticks:
            yield pair
