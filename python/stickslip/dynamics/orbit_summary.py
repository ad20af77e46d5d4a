"""What is steady in an orbit: its turning points, extremes and regime."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stickslip.dynamics.surface import Surface
from stickslip.dynamics.sweep import Look, columns_of
from stickslip.simulation.orbit import Orbit


def steady_motion(orbit: Orbit, fraction: float, contact: int = 0) -> dict[str, Any]:
    """Turning points, extremes and regime in the last `fraction` of an orbit.

    Parameters
    ----------
    orbit : long enough that its last part is steady.
    fraction : in (0, 1].
    contact : of a system of masses, the contact that is looked at, with its mass.

    Returns
    -------
    ``turning_x`` where ẋ changes its sign, ``turning_slip_velocity`` where ẇ does (arrays, the last 100,000), ``amplitude``
    (half of max x − min x), ``x_min``, ``x_max``, ``w_min``, ``w_max``, ``stuck_share`` (numbers), ``regime``.

    >>> from stickslip import paper, simulate
    >>> round(steady_motion(simulate(paper.oscillator(0.3), 600), 0.2)["amplitude"], 4)
    0.3055
    """
    look = Look(1 - fraction, fraction, 1e-6, points=100_000, contact=contact)
    surface = Surface(normal=(0.0, 1.0, 0.0), direction=-1)
    core = orbit._steady(look.to_json(), orbit.t_end, json.dumps(surface.to_dict()), contact)
    row = {name: column[0] for name, column in columns_of(core).items()}
    motion = {name: row[name][np.isfinite(row[name])] for name in ("turning_x", "turning_slip_velocity")}
    numbers = ("amplitude", "x_min", "x_max", "w_min", "w_max", "stuck_share")
    return motion | {name: float(row[name]) for name in numbers} | {"regime": str(row["regime"])}


def sign_changes(
    function: Callable[[NDArray[np.float64]], NDArray[np.float64]], times: NDArray[np.float64], direction: int = 0
) -> NDArray[np.float64]:
    """Times where `function` changes its sign between samples, by bisection; it may jump and may rest at zero.

    Parameters
    ----------
    function : a function of time, arrays to arrays.
    times : samples in increasing order, dense enough to part the changes.
    direction : 1 takes changes to positive values, −1 to negative ones, 0 both.

    Returns
    -------
    The times, in order; a function that rests at zero in between changes its sign where the rest begins.

    >>> sign_changes(lambda t: np.cos(t), np.linspace(0.0, 6.0, 50)).round(6).tolist()
    [1.570796, 4.712389]
    """
    signs = np.sign(function(times))
    known = np.flatnonzero(signs)
    here, there = signs[known][:-1], signs[known][1:]
    changes = (here != there) & ((direction == 0) | (there == direction))
    last, following = known[:-1][changes], known[1:][changes]
    low, high, before = times[last], times[following], signs[last]
    # Thirty halvings of a two-hundredth of a period: what is read off at an extreme is exact to the bit long before.
    for _ in range(30 if low.size else 0):
        middle = (low + high) / 2
        same = np.sign(function(middle)) == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return np.asarray(high, float)
