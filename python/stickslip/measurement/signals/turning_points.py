"""Valleys and peaks of a signal, and the flanks between them on which a spring is wound up."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from stickslip.files.arrays import Array
from stickslip.measurement.signals.presmooth import Presmoothed
from stickslip.measurement.signals.sampling import mean_step


def turning_points(values: Array, least: float) -> tuple[list[int], list[int]]:
    """Valleys and peaks between which the values change by more than `least`, alternating in time.

    Returns
    -------
    valleys, peaks : indices, each in order.

    Examples
    --------
    >>> turning_points(np.array([0.0, 2.0, 1.9, 3.0, 1.0, 4.0, 0.0]), 0.5)
    ([0, 4], [3, 5])
    """
    valleys: list[int] = []
    peaks: list[int] = []
    high = low = 0
    rising: bool | None = None
    for i, value in enumerate(values.tolist()):
        if rising is not False:
            if value > values[high]:
                high = i
            elif values[high] - value > least:
                peaks.append(high)
                rising, low = False, i
        if rising is not True:
            if value < values[low]:
                low = i
            elif value - values[low] > least:
                valleys.append(low)
                rising, high = True, i
    return valleys, peaks


@dataclass(frozen=True)
class Flanks:
    """Stretches on which the spring is wound up, each from a valley to a peak; all sticks lie on them.

    Attributes
    ----------
    limits : (first, last) sample of each.
    drops : (m,) falls of x between them.
    least : the smallest fall that was counted.
    smaller : number of falls that stand clear of the noise but are smaller than that.
    """

    limits: list[tuple[int, int]]
    drops: Array
    least: float
    smaller: int


def find_flanks(presmoothed: Presmoothed, least_drop: float) -> Flanks:
    """Cut the record at every fall of the spring that counts as a slip.

    Falls must stand eight sigmas of the presmoothed clear of the noise, and reach `least_drop` times their median.
    """
    floor = 8 * _wander(presmoothed)
    _, drops = _walk(presmoothed.extension, floor)
    if len(drops) == 0:
        return Flanks([], drops, floor, 0)
    least = max(floor, least_drop * float(np.median(drops)))
    limits, counted = _walk(presmoothed.extension, least)
    return Flanks(limits, counted, least, int(len(drops) - len(counted)))


def _wander(presmoothed: Presmoothed) -> float:
    """Standard error of the level of the presmoothed record: white noise averaged over its resolution."""
    step = mean_step(presmoothed.time)
    return presmoothed.noise * min(math.sqrt(2 * step * presmoothed.cutoff), 1.0)


def rises_before(values: Array, least: float) -> list[tuple[int, int]]:
    """First and last sample of each rise between two falls of at least that size.

    >>> rises_before(np.array([0.0, 2.0, 1.9, 3.0, 1.0, 4.0, 0.0]), 0.5)
    [(0, 3), (4, 5)]
    """
    return _walk(values, least)[0]


def _walk(values: Array, least: float) -> tuple[list[tuple[int, int]], Array]:
    valleys, peaks = turning_points(values, least)
    if not peaks or not valleys:
        return [], np.zeros(0)
    marks = sorted([(i, False) for i in valleys] + [(i, True) for i in peaks])
    limits: list[tuple[int, int]] = []
    drops: list[float] = []
    if marks[0][1] and marks[0][0] > 0:
        limits.append((0, marks[0][0]))
    for (i, is_peak), (j, _) in pairwise(marks):
        if is_peak:
            drops.append(float(values[i] - values[j]))
        else:
            limits.append((i, j))
    last, is_peak = marks[-1]
    if is_peak:  # a fall that the record's end cuts off, or the last valley and what follows it
        tail = last + int(np.argmin(values[last:]))
        drops.append(float(values[last] - values[tail]))
        last = tail
    if last < len(values) - 1:
        limits.append((last, len(values) - 1))
    return limits, np.array(drops)
