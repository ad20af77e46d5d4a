"""Runs at a drive velocity from different starts: at rest, beside steady slip, nearly together, from an orbit."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from stickslip.dynamics.continuation.branch import SpecialPoint
from stickslip.dynamics.critical.end_of_run import EndOfRun, end_of_run, rest
from stickslip.dynamics.equilibria.steady_slip import steady_slip
from stickslip.dynamics.periodic.event_sequence import with_number
from stickslip.files.progress import waiting_by_stage
from stickslip.model.system import Oscillator, System
from stickslip.simulation.time_limit import TimeIsUp, TimeLimit

PATH = "/drive_velocity"
#: How long runs of several masses have to be, where only runs tell a change.
LONGEST = 3000

#: A run of so many cycles at a drive velocity.
Run = Callable[[float, float], EndOfRun]


class Monitor:
    """Says how far a search is, makes its runs, and ends it at a limit of time."""

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

    def end_of_run(self, *run: Any) -> EndOfRun:
        """A run, before the limit."""
        self.go_on()
        found = end_of_run(*run, max_seconds=self.limit.left)
        if found.stop == "max_seconds":
            raise TimeIsUp
        return found


def from_rest(system: Oscillator | System, monitor: Monitor) -> Run:
    """Runs that start at rest on the drive, of several masses at unlike positions (:func:`~.end_of_run.rest`)."""
    return lambda speed, cycles: monitor.end_of_run(with_number(system, PATH, speed), cycles)


def nearly_together(system: System, monitor: Monitor) -> Run:
    """Runs of several masses that start as a simulation without a start does, but for a thousandth of their reach."""
    start = rest(system, 1e-3)
    return lambda speed, cycles: monitor.end_of_run(with_number(system, PATH, speed), cycles, start)


def beside(system: Oscillator | System, monitor: Monitor, value: float | None = None) -> Run:
    """Runs from a small disturbance of steady slip; near a corner of the law at a speed one that does not reach it."""

    def run(speed: float, cycles: float) -> EndOfRun:
        size = 0.1 * (speed if value is None else abs(speed - value))
        return monitor.end_of_run(with_number(system, PATH, speed), cycles, *disturbed(system, speed, size))

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


def from_orbit(system: Oscillator | System, monitor: Monitor, special: SpecialPoint) -> Run:
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
    return lambda speed, cycles: monitor.end_of_run(with_number(system, PATH, speed), cycles, x, v)
