"""The cycle that is born at a Hopf point of steady slip, stable or not. The points: `equilibria/hopf_points.py`."""

from __future__ import annotations

import math

import numpy as np

from stickslip.dynamics.continuation.arclength import Family, Point, corrected
from stickslip.dynamics.equilibria.steady_slip import steady_slip
from stickslip.dynamics.periodic.event_sequence import EventSequence
from stickslip.dynamics.periodic.newton_iteration import Lost
from stickslip.dynamics.periodic.periodic_orbits import amplitude, find, finished
from stickslip.dynamics.scales import fastest_drive
from stickslip.errors import InputError
from stickslip.model.system import Oscillator, System

#: Largest velocities of the cycle that is looked for, as shares of the drive velocity: none of them reaches w = 0.
_SHARES = (0.3, 0.1, 0.03)


def born(system: Oscillator | System, value: float, family: Family) -> Point | None:
    """A small cycle of the curve that begins at a Hopf point: of given velocity, at the parameter where it closes.

    Beside the point steady slip and cycle are close together, and a cycle that repels is reached by no run; with its size
    held and the parameter free it is as easy to close as one that attracts, also where the parameter turns with the size.

    Parameters
    ----------
    system : at the Hopf point.
    value : of the parameter there.
    family : the parameter and its bounds.

    Returns
    -------
    Point, None where no cycle is found or those at the Hopf point are a continuum, as around a centre.

    Source: Kuznetsov, Elements of Applied Bifurcation Theory, ch. 10 (a cycle from a Hopf point).
    """
    state = steady_slip(system)
    if state is None:
        return None
    low, high = family.ranges[0]
    # At a Hopf point of several masses all swing in one mode, whose frequency is any of theirs.
    period = system.natural_period if isinstance(system, Oscillator) else 2 * math.pi / max(state.frequency, 1e-300)
    drive = fastest_drive(system)
    for share in _SHARES:
        speed = share * drive
        start = (state.x + speed * state.displacement, speed * state.mode)
        try:
            run, kinds, _ = EventSequence.of_run(system, 4 * period, *start)
            cut, _ = find(system, run, kinds, False, None)
            size = np.zeros(cut.layout.width + 1)
            size[cut.layout.v] = state.mode
            point = corrected(cut, 0, family, np.array([value]), size)
            cycle = finished(point.here, 0)
        except (InputError, Lost):
            continue
        if cycle.marginal:
            return None
        reach = amplitude(cycle) * 2 * math.pi / period
        if low <= point.values[0] <= high and 0.5 * speed < reach < 2 * speed:
            return point
    return None
