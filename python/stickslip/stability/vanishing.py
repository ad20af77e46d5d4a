"""Where a cycle shrinks to a point: linearly at a corner of friction, as a root at a smooth Hopf point."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stickslip.errors import InputError
from stickslip.stability.cycles import finished
from stickslip.stability.returns import size_of
from stickslip.stability.shooting import Family, Lost, Point, axis, corrected
from stickslip.stability.trail import Trail

#: Where in a direction the parameter stands.
_PARAMETER = -1
#: Cycles that are followed on the way, each of half the size, and how many of them are extrapolated.
_MOST, _USED = 16, 5


def vanishing(point: Point, family: Family) -> tuple[str, float, Point] | None:
    """Where the cycle of a point, made ever smaller, is none any more: kind, parameter, and the smallest cycle followed.

    The parameter is a smooth function of the size A of a cycle held to its event sequence, s(A) = s* + c₁A + c₂A² + …:
    near a corner of the law the motion is the same at any scale and c₁ ≠ 0 (a nonsmooth Hopf point), near steady slip of a
    smooth law c₁ = 0. s(0) is extrapolated from cycles each half as large as the one before. None where no such way goes on.
    """
    span = float(family.scales(point.values)[0])
    places, sizes = [float(point.values[0])], [_size(point)]
    target = places[0] + np.copysign(1e-4 * span, point.direction[_PARAMETER])
    estimates: list[float] = []
    for _ in range(_MOST):
        try:
            trail = _towards(point, target, family)
            point = corrected(trail, point.here.turns, family, np.array([target]), axis(trail))
            size = _size(point)
        except (Lost, InputError):
            return None
        if not 0.0 < size < sizes[-1]:
            return None
        places.append(float(point.values[0]))
        sizes.append(size)
        estimates.append(_extrapolated(sizes, places, 0.0))
        if len(estimates) > 4 and abs(estimates[-1] - estimates[-2]) < 1e-11 * span:
            break
        target = _extrapolated(sizes, places, size / 2)
    end = estimates[-1]
    if abs(end - estimates[-2]) > 1e-9 * span:
        return None
    # Half the size: half the distance, or a quarter of it.
    ratio = (places[-1] - end) / (places[-2] - end) * sizes[-2] / sizes[-1]
    return "nonsmooth_hopf" if abs(ratio - 1) < 0.2 else "hopf", end, point


def _size(point: Point) -> float:
    """The mean deviation of the position from its mean, which moves smoothly with the cycle."""
    cycle = finished(point.here, 0)
    x = cycle.orbit.at(np.linspace(0.0, cycle.period, 200, endpoint=False))[0]
    return float(np.std(x, axis=0).max())


def _extrapolated(sizes: list[float], places: list[float], size: float) -> float:
    """The polynomial through the last cycles (Neville)."""
    a: NDArray[np.float64] = np.array(sizes[-_USED:])
    p = np.array(places[-_USED:])
    for k in range(1, len(a)):
        p = ((size - a[k:]) * p[:-1] - (size - a[:-k]) * p[1:]) / (a[:-k] - a[k:])
    return float(p[0])


def _towards(point: Point, target: float, family: Family) -> Trail:
    """The start predicted for another value of the parameter."""
    here = point.here
    span = float(family.scales(point.values)[0])
    start = here.trail.start.copy()
    leap = (target - float(point.values[0])) / span / point.direction[_PARAMETER]
    start[here.lanes] += leap * point.direction[here.lanes] * size_of(here.trail.system, start, here.lanes)
    start[here.fixed] += here.fixed_parameter * (target - float(point.values[0]))
    return replace(here.trail, start=start)
