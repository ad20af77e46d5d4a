"""Whether runs on both sides of a drive velocity show that the motion changes there, and whether one ends there.

`_confirm` in `critical_velocities.py` asks this of each candidate, `speed_sweep.py` of each change of sticking.
"""

from __future__ import annotations

from stickslip.dynamics.critical.end_of_run import EndOfRun
from stickslip.dynamics.critical.runs import LONGEST, PATH, Monitor, Run
from stickslip.dynamics.periodic.event_sequence import with_number
from stickslip.model.system import Oscillator, System

#: How far on both sides of a speed runs confirm it, relative to the speed, and for how many cycles; the next if they do not.
_CONFIRM = ((1e-3, 300), (1e-3, 3000), (1e-2, 300), (1e-4, 3000))

#: Two runs, below a speed and above it.
Sides = tuple[EndOfRun, EndOfRun]


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


def ends_between(system: Oscillator | System, monitor: Monitor, value: float, below: EndOfRun, above: EndOfRun) -> bool:
    """Whether a motion ends between two speeds; of several masses one that sticks, as little else is clear in chaos."""
    if isinstance(system, Oscillator):
        return _attracts_on_one_side(system, monitor, value, below, above)
    here, there = (below, above) if below.sticks else (above, below)
    beyond = with_number(system, PATH, there.speed)
    return (
        here.sticks and not there.sticks and not monitor.end_of_run(beyond, LONGEST, *here.start_at(there.speed)).sticks
    )


def _attracts_on_one_side(system: Oscillator, monitor: Monitor, value: float, below: EndOfRun, above: EndOfRun) -> bool:
    """Whether a motion that attracts on one side does not on the other: from where it ended it goes on on both sides.

    Where neither motion changes, the start of the runs left the basin of one for that of the other.
    """

    def goes_on(side: EndOfRun, speed: float, cycles: float) -> EndOfRun:
        return monitor.end_of_run(with_number(system, PATH, speed), cycles, *side.start_at(speed))

    sides = [below, above]
    for i, side in enumerate(sides):
        if abs(side.size - side.size_before) > 1e-3 * side.size:  # it has not settled
            sides[i] = goes_on(side, side.speed, 3000)
    return any(
        goes_on(side, side.speed, cycles).differs(goes_on(side, 2 * value - side.speed, cycles))
        for cycles in (300, 3000)
        for side in sides
    )
