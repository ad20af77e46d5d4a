"""Sweeps: what runs show over the drive velocities, and between which of them sticks end or begin."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from stickslip.dynamics.critical.confirmation import Sides, sides_of
from stickslip.dynamics.critical.end_of_run import EndOfRun
from stickslip.dynamics.critical.runs import LONGEST, PATH, Monitor, Run
from stickslip.dynamics.equilibria.steady_slip import stability
from stickslip.dynamics.periodic.event_sequence import with_number
from stickslip.model.system import Oscillator, System

#: Speeds from low to high at which runs look at the motion, and half as many that lie closer at the low end.
_SWEEP = 64
#: How long the runs of a sweep are, and those that close in on a change which no followed cycle explains.
_CYCLES, _LONG = 100, 600
#: How near runs of several masses close in on a change, relative to the speed.
_NEAR = 1e-5
#: The last step of a motion that is followed to its end, relative to the speed.
_CLOSE = 1e-4


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
    looks: list[tuple[float, EndOfRun]] = field(default_factory=list)


def look_over(system: Oscillator | System, low: float, high: float, monitor: Monitor, sweeps: list[Sweep]) -> None:
    """Add what runs show over the speeds: from rest, beside steady slip that is unstable, and beyond where those end."""
    speeds = np.union1d(np.linspace(low, high, _SWEEP), np.geomspace(low, high, _SWEEP // 2)).tolist()
    unstable = []
    for speed in speeds:
        monitor.limit.keep()
        damping, neutral = stability(with_number(system, PATH, speed))
        if not (damping >= 0 or neutral):
            unstable.append(speed)
    every = [unstable if sweep.start == "beside" else speeds for sweep in sweeps]
    count = sum(map(len, every))
    for sweep, some in zip(sweeps, every, strict=True):
        for speed in some:
            monitor("runs", sum(len(known.looks) for known in sweeps), count)
            sweep.looks.append((speed, sweep.run(speed, _CYCLES)))
        if isinstance(system, System):
            _outlast(sweep)
    starts = tuple(sweeps)
    for changes in [tuple(unlike_neighbours(sweep.looks)) for sweep in starts]:
        for below, above in changes:
            sweep = _followed(system, monitor, (below, above), speeds)
            # Where it ends at once, the sweep it comes from has shown that.
            if len(sweep.looks) > 2:
                sweeps.append(sweep)
                if isinstance(system, System):
                    _outlast(sweep)
    if isinstance(system, System):
        for sweep in starts:
            if sweep.start != "beside":
                _carry_on(system, monitor, sweep.looks, speeds, sweeps)
    monitor("runs", count, count)


def _carry_on(
    system: System, monitor: Monitor, looks: list[tuple[float, EndOfRun]], speeds: Sequence[float], sweeps: list[Sweep]
) -> None:
    """Add sweeps of motions to which a start at rest leads at one speed, and to which it does not at the next."""
    for here, (speed, _) in tuple(itertools.pairwise(sorted(looks, key=lambda look: look[0]))):
        if not (here[1].sticks and here[1].repeats):
            continue
        look = monitor.end_of_run(with_number(system, PATH, speed), _CYCLES, *here[1].start_at(speed))
        known = [other for sweep in sweeps for at, other in sweep.looks if at == speed]
        if look.sticks and not any(look.resembles(other) for other in known):
            sweeps.append(_followed(system, monitor, (here, (speed, look)), speeds))
            _outlast(sweeps[-1])


def _followed(
    system: Oscillator | System, monitor: Monitor, change: tuple[tuple[float, EndOfRun], ...], speeds: Sequence[float]
) -> Sweep:
    """The motion that sticks on one side of a change, followed beyond it from speed to speed until it sticks no more."""
    here, beyond = change if change[0][1].sticks else change[::-1]
    way = math.copysign(1.0, beyond[0] - here[0])
    several = isinstance(system, System)
    ends = {here[0]: here[1]}

    def run(speed: float, cycles: float) -> EndOfRun:
        start = ends[
            max((known for known in ends if way * known <= way * speed), key=lambda at: way * at, default=here[0])
        ]
        look = monitor.end_of_run(with_number(system, PATH, speed), cycles, *start.start_at(speed))
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


def unlike_neighbours(
    looks: list[tuple[float, EndOfRun]],
) -> Iterator[tuple[tuple[float, EndOfRun], tuple[float, EndOfRun]]]:
    """Speeds beside each other, in their order, of which only one shows sticks."""
    for pair in itertools.pairwise(sorted(looks, key=lambda look: look[0])):
        if pair[0][1].sticks != pair[1][1].sticks:
            yield pair
