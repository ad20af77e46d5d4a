"""Where a cycle or its stick vanishes: linearly at a corner of friction or into neutral slip, as a root elsewhere."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from stickslip.dynamics.continuation.arclength import Family, Point, axis, corrected
from stickslip.dynamics.continuation.bifurcation_conditions import PARAMETER
from stickslip.dynamics.periodic.event_sequence import EventSequence
from stickslip.dynamics.periodic.newton_iteration import Lost
from stickslip.dynamics.periodic.periodic_orbits import finished
from stickslip.dynamics.periodic.poincare_map import size_of
from stickslip.errors import InputError

#: Cycles that are followed on the way, each of half the size, and how many of them are extrapolated.
_MOST, _USED = 16, 7
#: A cycle of less than this share of the one before it has vanished on the way.
_GONE = 1e-2
#: The share of a period that the longest of them sticks at least.
_LEAST = 0.02


def vanishing(point: Point, family: Family) -> tuple[str, float, Point] | None:
    """Where the cycle of a point, made ever smaller, is none any more: kind, parameter, and the smallest cycle followed.

    Near a corner of the law the motion is the same at any scale and the parameter moves linearly with the size (a nonsmooth
    Hopf point), near steady slip of a smooth law with its square.
    """
    found = _limit(point, family, _size)
    return None if found is None else ("nonsmooth_hopf" if found[0] else "hopf", *found[1:])


# Kept for the shorter steps from the same point that follow.
@lru_cache(maxsize=4)
def vanishing_stick(point: Point, family: Family) -> tuple[float, Point] | None:
    """Where the stick of a cycle, made ever shorter, is none any more: parameter, and the cycle of the shortest stick.

    Where slip is neutral the parameter moves linearly with the stick time: a cycle without sticks exists on both sides, so
    no test function tells where it ends. Elsewhere it moves with the square, and a sliding bifurcation is located by its
    test function: None then.
    """
    start = _longer(point, family)
    found = None if start is None else _limit(start, family, stick_time)
    return found[1:] if found is not None and found[0] else None


def _longer(point: Point, family: Family) -> Point | None:
    """A cycle that sticks for long enough: where the capture is nearly tangent, rounding grows with its inverse square."""
    span = float(family.scales(point.values)[0])
    way = np.copysign(1.0, point.direction[PARAMETER])
    back = -1e-4 * span * way
    while stick_time(point) < _LEAST * point.here.period:
        target = float(point.values[0]) + back
        try:
            further = corrected(
                _towards(point, target, family), 0, family, np.array([target]), axis(point.here.sequence)
            )
        except (Lost, InputError):
            return None
        gain = stick_time(further) - stick_time(point)
        if gain <= 0:
            return None
        # A third more next: from farther away Newton's method finds the stick that has vanished.
        back *= min(stick_time(further) / (3 * gain), 10.0)
        point = replace(further, direction=way * further.direction)
    return point


def _limit(point: Point, family: Family, measure: Callable[[Point], float]) -> tuple[bool, float, Point] | None:
    """Whether the parameter s moves linearly with a measure A of a cycle that vanishes, s(0), and the last cycle followed.

    s is a smooth function of A for cycles held to their event sequence, s(A) = s* + c₁A + c₂A² + …; s(0) is extrapolated from
    cycles each of half the measure of the one before. None where no such way goes on.
    """
    span = float(family.scales(point.values)[0])
    parameters, sizes = [float(point.values[0])], [measure(point)]
    target = parameters[0] + np.copysign(1e-4 * span, point.direction[PARAMETER])
    estimates: list[float] = []
    followed: list[Point] = []
    for _ in range(_MOST):
        try:
            sequence = _towards(point, target, family)
            smaller = corrected(sequence, point.here.forcing_periods, family, np.array([target]), axis(sequence))
            size = measure(smaller)
        except (Lost, InputError):
            break
        if size < _GONE * sizes[-1]:
            # Beyond the end Newton's method finds steady slip, or the stick that has vanished.
            target = (target + parameters[-1]) / 2
            continue
        if size >= sizes[-1]:
            break
        point = smaller
        parameters.append(float(point.values[0]))
        sizes.append(size)
        followed.append(point)
        estimates.append(_extrapolated(sizes, parameters, 0.0))
        if len(estimates) > 4 and abs(estimates[-1] - estimates[-2]) < 1e-11 * span:
            break
        target = _extrapolated(sizes, parameters, size / 2)
    if len(estimates) < 5:
        return None
    # Beyond the best estimate rounding grows again: the multiplier goes to 1.
    changes = np.abs(np.diff(estimates))
    best = int(np.argmin(np.maximum(changes[1:], changes[:-1]))) + 1
    if changes[best] > 1e-9 * span:
        return None
    end = estimates[best + 1]
    # Half the size: half the distance, or a quarter of it.
    last, before = best + 2, best + 1
    ratio = (parameters[last] - end) / (parameters[before] - end) * sizes[before] / sizes[last]
    return abs(ratio - 1) < 0.2, end, followed[best + 1]


def stick_time(point: Point) -> float:
    """How long the cycle sticks in a period."""
    return float(point.here.durations[point.here.sequence.stuck.any(axis=1)].sum())


def _size(point: Point) -> float:
    """The mean deviation of the position from its mean, which moves smoothly with the cycle."""
    cycle = finished(point.here, 0)
    x = cycle.orbit.at(np.linspace(0.0, cycle.period, 200, endpoint=False))[0]
    return float(np.std(x, axis=0).max())


def _extrapolated(sizes: list[float], parameters: list[float], size: float) -> float:
    """The polynomial through the last cycles (Neville)."""
    a: NDArray[np.float64] = np.array(sizes[-_USED:])
    p = np.array(parameters[-_USED:])
    for k in range(1, len(a)):
        p = ((size - a[k:]) * p[:-1] - (size - a[:-k]) * p[1:]) / (a[:-k] - a[k:])
    return float(p[0])


def _towards(point: Point, target: float, family: Family) -> EventSequence:
    """The start predicted for another value of the parameter."""
    here = point.here
    span = float(family.scales(point.values)[0])
    start = here.sequence.start.copy()
    leap = (target - float(point.values[0])) / span / point.direction[PARAMETER]
    start[here.coordinates] += (
        leap * point.direction[here.coordinates] * size_of(here.sequence.system, start, here.coordinates)
    )
    start[here.fixed] += here.fixed_parameter * (target - float(point.values[0]))
    return replace(here.sequence, start=start)
