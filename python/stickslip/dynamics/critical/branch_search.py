"""Branches of the cycles that runs over drive velocities show."""

from __future__ import annotations

from typing import Any

import numpy as np

from stickslip.dynamics.continuation.arclength import Family, Point, corrected_at
from stickslip.dynamics.continuation.branch import Branch, crossings
from stickslip.dynamics.continuation.branches import born_branch, lies_on
from stickslip.dynamics.continuation.walk import Walk
from stickslip.dynamics.critical.end_of_run import EndOfRun
from stickslip.dynamics.critical.runs import PATH, Monitor, disturbed
from stickslip.dynamics.critical.speed_sweep import Sweep, unlike_neighbours
from stickslip.dynamics.equilibria.steady_slip import steady_slip
from stickslip.dynamics.periodic.event_sequence import with_number
from stickslip.dynamics.periodic.newton_iteration import Lost
from stickslip.dynamics.periodic.periodic_orbits import event_cycle
from stickslip.dynamics.scales import drive_of, reach, slowest_period
from stickslip.errors import InputError
from stickslip.model.system import Oscillator, System

#: A cycle is followed at least so far beyond where the runs beside it end, relative to the speed.
_FURTHER = 0.02


def branches_of(
    system: Oscillator | System,
    bounds: tuple[float, float],
    steady: list[tuple[str, float]],
    neutral: list[tuple[float, float]],
    sweeps: list[Sweep],
    monitor: Monitor,
) -> list[Branch]:
    """The branches of the cycles that the sweeps show, and of those born at Hopf points."""
    family = Family((PATH,), (bounds,), relative=True)
    branches: list[Branch] = []

    def add_branch(speed: float, start: str, look: EndOfRun) -> None:
        guess: Any = None if start == "rest" else look.end
        if start == "beside":
            guess = disturbed(system, speed, 0.1 * speed)
        branch = _branch(with_number(system, PATH, speed), speed, guess, family, branches, monitor)
        if branch is not None:
            branches.append(branch)

    count, done = sum(len(sweep.looks) for sweep in sweeps) + len(steady), 0
    for sweep in sweeps:
        for speed, look in sweep.looks:
            monitor("cycles", done, count)
            done += 1
            # Around a centre there is a cycle of any size: none of them is a branch.
            centre = look.stick_time == 0 and any(first <= speed <= last for first, last in neutral)
            if (
                look.lasts
                and not centre
                and not _decays(system, speed, look)
                and not any(_passes(branch, speed, look) for branch in branches)
            ):
                add_branch(speed, sweep.start, look)
    for _, value in steady:
        monitor("cycles", done, count)
        done += 1
        new = born_branch(with_number(system, PATH, value), value, family, branches, 200, monitor.go_on)
        if new is not None:
            branches.append(new)
    monitor("cycles", count, count)
    return branches


def branches_of_masses(
    system: System, bounds: tuple[float, float], sweeps: list[Sweep], monitor: Monitor
) -> list[Branch]:
    """The branches of the cycles beside which the runs of masses stop or begin to stick, over the speeds around that.

    Most motions of several masses are no cycles, and those that are have many special points at which no motion ends.
    """
    branches: list[Branch] = []
    changes = [(sweep.looks, *pair) for sweep in sweeps for pair in unlike_neighbours(sweep.looks)]
    for done, (looks, below, above) in enumerate(changes):
        monitor("cycles", done, len(changes))
        last, beyond = (below[0], above[0]) if below[1].sticks else (above[0], below[0])
        # Near its end a motion settles slowly: the cycle is that of the nearest run that has settled.
        side = [look for look in looks if (look[0] - last) * (last - beyond) >= 0]
        settled = [look for look in side if look[1].sticks and look[1].repeats]
        if not settled:
            continue
        speed, look = min(settled, key=lambda look: abs(look[0] - last))
        # So far that the cycle is followed to what ends it.
        end = float(np.clip(beyond + np.copysign(max(abs(beyond - last), _FURTHER * beyond), beyond - last), *bounds))
        family = Family((PATH,), ((min(speed, end), max(speed, end)),), relative=True)
        branch = _branch(with_number(system, PATH, speed), speed, look.end, family, branches, monitor)
        if branch is not None:
            branches.append(branch)
    monitor("cycles", len(changes), len(changes))
    return branches


def _decays(system: Oscillator | System, speed: float, look: EndOfRun) -> bool:
    """Whether a motion without sticks decays as small disturbances of steady slip do, however slowly."""
    state = steady_slip(with_number(system, PATH, speed))
    if state is None or state.neutral or state.growth >= 0 or look.stick_time > 0:
        return False
    return abs(look.growth - state.growth) < 0.05 * abs(state.growth)


def _passes(branch: Branch, speed: float, look: EndOfRun) -> bool:
    """Whether a branch has a cycle as large as that of a run."""
    # Near a Hopf point neighbours differ much, so sizes are taken between them.
    near, shares = crossings(branch, speed)
    sizes = np.subtract(branch.x_max, branch.x_min)
    there = sizes[near] + shares * (sizes[near + 1] - sizes[near])
    return bool((np.abs(there - 2 * look.size) < 0.1 * there).any())


def _branch(
    system: Oscillator | System, value: float, guess: Any, family: Family, known: list[Branch], monitor: Monitor
) -> Branch | None:
    try:
        length = 150 * system.natural_period
        if isinstance(system, System):
            length = 30 * slowest_period(system) + 10 * reach(system).max() / drive_of(system)
        cycle = event_cycle(system, guess, t_end=None if guess is None else length, progress=monitor.go_on)
        neutral = cycle.marginal and (isinstance(system, System) or not cycle.sticks)
        if neutral or any(lies_on(branch, cycle, value) for branch in known):
            return None
        start = corrected_at(cycle.closed.sequence, cycle.forcing_periods, family, value)
        way = start.direction * (1.0 if start.direction[-1] > 0 else -1.0)
        up = Walk(family, 200, monitor.go_on).go(Point(start.here, start.values, way))
        down = Walk(family, 60, monitor.go_on).go(Point(start.here, start.values, -way)) if not cycle.sticks else None
    except (InputError, Lost):
        return None
    return up if down is None else down.reversed().joined(up)
