"""The part of a record in which the drive neither stops nor changes its speed, as its spring shows it."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.files.median_deviation import MAD_TO_SIGMA
from stickslip.measurement.read import LEAST_SAMPLES, Record
from stickslip.measurement.signals.piecewise_fit import OscillatorConstants
from stickslip.measurement.signals.presmooth import Presmoothed, natural_period
from stickslip.measurement.signals.sample_runs import runs_of
from stickslip.measurement.signals.turning_points import Flanks

STANDS, DRIVEN = 0.1, 0.5
"""Parts of its speed below which a drive that stops is seen to move the spring, and above which it does just before."""
LASTING = 1.5
"""A drive that stops does so for longer than that many cycles of the motion."""
FEWEST_OF_RISE, FEWEST_RISES = 6, 3
"""Fewest samples of a rise that tell its slope, and rises that tell a speed of the drive."""
CHANGES, APART = 0.1, 6.0
"""Speeds of a drive differ by that part, and by so many times what the slopes of rises scatter."""


def part_while_driven(
    record: Record, oscillator: OscillatorConstants, presmoothed: Presmoothed, flanks: Flanks
) -> tuple[slice, list[str]]:
    """The longest part of the record in which the drive does not stop, and a sentence where there are several.

    The spring of a mass that rests keeps its length where the drive stops. One that slips at the speed of the drive does so
    too, but it swings until then: here the spring moves at half the speed of the drive less than half a period of the free
    mass before and after.
    """
    o, rate, time = oscillator, presmoothed.rate, record.time
    slow, fast = max(STANDS * o.drive_velocity, 4 * presmoothed.rate_error), DRIVEN * o.drive_velocity
    if len(flanks.limits) < 3 or slow > fast / 2:
        return slice(None), []
    cycle = float(np.median(np.diff([time[last] for _, last in flanks.limits])))
    near = max(round((natural_period(o) / 2 + 0.2 / presmoothed.cutoff) / record.step), 2)
    stops: list[tuple[int, int]] = []
    for first, last in runs_of(np.abs(rate) < slow):
        sides = ([rate[max(first - near, 0) : first]] if first > 0 else []) + (
            [rate[last : last + near]] if last < len(rate) else []
        )
        lasts = time[last - 1] - time[first] > max(LASTING * cycle, 2 * natural_period(o))
        if lasts and sides and all(np.abs(side).max() > fast for side in sides):
            stops.append((first, last))
    if not stops:
        return slice(None), []
    driven = np.concatenate([[0], np.ravel(stops), [len(time)]]).reshape(-1, 2)
    first, last = driven[np.argmax(driven[:, 1] - driven[:, 0])].tolist()
    said = ", ".join(f"{time[a]:.4g} to {time[b - 1]:.4g}" for a, b in stops)
    why = f"the drive seems to stop: the spring keeps its length from {said}, as it does where mass and drive rest"
    if last - first < LEAST_SAMPLES:
        raise InputError(f"{record.source}: {why}, and what is left is too short; give a longer record")
    return slice(first, last), [
        f"{why}; only {time[first]:.4g} to {time[last - 1]:.4g} was measured ([read] window in the rig takes another part)"
    ]


def part_at_one_speed(
    record: Record, oscillator: OscillatorConstants, extension: Array, weight: Array, flanks: Flanks
) -> tuple[slice, list[str]]:
    """The part of the record in which the drive keeps one speed, and a sentence where it has several.

    The spring is wound up at the speed of the drive while the mass sticks: its slope over the middle half of a rise then
    changes from one cycle to the next and stays so. Of several parts that is taken which has the speed of the rig, or else
    the longest.
    """
    time = record.time
    slopes, where = [], []
    for first, last in flanks.limits:
        quarter = (last - first) // 4
        part = slice(first + quarter, last - quarter)
        if first > 0 and last < len(time) - 1 and np.count_nonzero(weight[part]) >= FEWEST_OF_RISE:
            line = np.polyfit(time[part] - time[first], extension[part], 1, w=weight[part])
            slopes.append(float(line[0]))
            where.append((first, last))
    speeds = np.array(slopes)
    parts = _parts(np.log(speeds)) if len(speeds) and speeds.min() > 0 else []
    if len(parts) < 2:
        return slice(None), []
    level = [float(np.median(speeds[a:b])) for a, b in parts]
    limits = [0, *(where[b - 1][1] for _, b in parts[:-1]), len(time)]
    spans = list(pairwise(limits))
    near = [i for i, one in enumerate(level) if abs(math.log(one / oscillator.drive_velocity)) < CHANGES]
    chosen = max(near or range(len(spans)), key=lambda i: spans[i][1] - spans[i][0])
    first, last = spans[chosen]
    said = ", ".join(
        f"{one:.3g} from {time[a]:.4g} to {time[b - 1]:.4g}" for one, (a, b) in zip(level, spans, strict=True)
    )
    if last - first < LEAST_SAMPLES:
        return slice(None), []
    return slice(first, last), [
        f"the drive seems to run at several speeds, as the spring is wound up at {said}; only {time[first]:.4g} to "
        f"{time[last - 1]:.4g} was measured ([read] window and drive_velocity in the rig take another part)"
    ]


def _parts(values: Array) -> list[tuple[int, int]]:
    """Runs of values about one level each: levels stand clear of one another, and none lasts for a cycle or two only."""
    order = np.sort(values)
    groups = np.split(order, np.flatnonzero(np.diff(order) > CHANGES) + 1)
    levels = np.array([float(np.median(group)) for group in groups if len(group) >= FEWEST_RISES])
    if len(levels) < 2:
        return [(0, len(values))]
    nearest = np.argmin(np.abs(values[:, None] - levels), axis=1)
    off = np.abs(values - levels[nearest])
    edges = [0, *(np.flatnonzero(np.diff(nearest)) + 1).tolist(), len(values)]
    runs = list(pairwise(edges))
    shortest = min(b - a for a, b in runs)
    clear = APART * MAD_TO_SIGMA * float(np.median(off)) < float(np.diff(levels).min())
    return runs if clear and shortest >= FEWEST_RISES else [(0, len(values))]
