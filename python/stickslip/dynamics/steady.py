"""What is steady in an orbit: its turning points, extremes and regime."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stickslip.model.system import System
from stickslip.simulation.orbit import Orbit

_FIXED = ("stable_slip", "at_rest")


def steady_motion(orbit: Orbit, fraction: float, contact: int = 0) -> dict[str, Any]:
    """Turning points, extremes and regime in the last `fraction` of an orbit.

    Parameters
    ----------
    orbit : long enough that its last part is steady.
    fraction : in (0, 1].
    contact : of a system of masses, the contact that is looked at, with its mass.

    Returns
    -------
    ``turning_x`` where ẋ changes its sign, ``turning_slip_velocity`` where ẇ does (arrays), ``amplitude`` (half of
    max x − min x), ``x_min``, ``x_max``, ``w_min``, ``w_max``, ``stuck_share`` (numbers), ``regime``.

    Limits: two turning points within 1/200 of a natural period are missed as a pair.

    >>> from stickslip import paper, simulate
    >>> round(steady_motion(simulate(paper.oscillator(0.3), 600), 0.2)["amplitude"], 4)
    0.3055
    """
    system: Any = orbit.system
    many = isinstance(system, System)
    words: dict[str, Any] = {"contact": contact} if many else {}
    regime = orbit.regime(transient=1 - fraction, **words)
    start = (1 - fraction) * orbit.t_end
    samples = max(2, int(200 * (orbit.t_end - start) / orbit.system.natural_period))
    times = np.linspace(start, orbit.t_end, samples)

    def column(name: str, t: NDArray[np.float64]) -> NDArray[Any]:
        values: NDArray[Any] = orbit.to_xarray(t)[name].to_numpy()
        if not many:
            return values
        picked: NDArray[Any] = values[:, system.contacts[contact].mass if name in "xva" else contact]
        return picked

    x, w = column("x", times), column("slip_velocity", times)
    if regime in _FIXED:
        turning_x, turning_w = x[-1:], w[-1:]
    else:
        turning_x = column("x", sign_changes(lambda t: column("v", t), times))
        turning_w = column("slip_velocity", sign_changes(lambda t: column("a", t), times))
    # The extremes lie at the turning points; a sample alone would miss them by its square.
    every_x, every_w = np.append(x, turning_x), np.append(w, turning_w)
    return {
        "turning_x": turning_x,
        "turning_slip_velocity": turning_w,
        "amplitude": float(np.ptp(every_x)) / 2,
        "x_min": float(every_x.min()),
        "x_max": float(every_x.max()),
        "w_min": float(every_w.min()),
        "w_max": float(every_w.max()),
        "stuck_share": float(column("stuck", times).mean()),
        "regime": regime,
    }


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
