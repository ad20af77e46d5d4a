"""By how much the force of a record is late against its motion, and what is said of it."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from scipy.integrate import cumulative_trapezoid

from stickslip.files.arrays import Array, Mask
from stickslip.measurement.instruments.direct_force.direct_run import DirectMotion
from stickslip.measurement.instruments.instrument import Samples
from stickslip.measurement.signals.clocks.clock_offset import Offset
from stickslip.measurement.signals.clocks.lag_at_slips import FEWEST_SLIPS, lag_at_slips, note_on_lag_at_slips
from stickslip.measurement.signals.clocks.lag_over_speed import lag_over_speed
from stickslip.measurement.signals.sample_runs import runs_of
from stickslip.measurement.signals.smooth import jerk_spline


def notes_on_lag(record: Samples, motion: DirectMotion, clock_offset: float) -> list[str]:
    """What is said of a force that is late or early over speed, where this clock_offset was taken out already."""
    lag = lag_over_speed(record.time, record["force"], motion.w, motion.acceleration, _position_terms(record, motion))
    return [] if lag is None else [lag.note(clock_offset, record.units["force"], motion.length)]


def _position_terms(record: Samples, motion: DirectMotion) -> Array:
    """What of the force may follow the position to and fro: a spring, and of an angle the gravity of an arm, (n, 0 to 3)."""
    w = motion.w
    if not ((w > 0).any() and (w < 0).any()):
        return np.empty((len(w), 0))
    position = record["displacement"] if "displacement" in record else cumulative_trapezoid(w, record.time, initial=0)
    gravity = [np.sin(position), np.cos(position)] if motion.length == "rad" else []
    return np.stack([position, *gravity], axis=1)


def lag_between_sticks(record: Samples, motion: DirectMotion, stuck: Mask) -> Offset | None:
    """The lag of the force against the slips between sticks, each with half of the sticks beside it; all one way.

    One whose error is larger than half a step and than a fifth of itself is not given.
    """
    w, sticks = motion.w, runs_of(stuck)
    middles = [(first + last) // 2 for first, last in sticks]
    ways = {bool(np.mean(w[one[1] : other[0]]) > 0) for one, other in pairwise(sticks) if one[1] < other[0]}
    if len(middles) <= FEWEST_SLIPS or len(ways) != 1:
        return None
    time, force = record.time, jerk_spline(record.time, record["force"], cutoff=motion.cutoff).x
    path = cumulative_trapezoid(w, time, initial=0)
    windows = list(pairwise(middles))
    lag = lag_at_slips(time, force, path, w, motion.acceleration, motion.acceleration_error, windows)
    least = 0.5 * float(np.median(np.diff(time)))
    return None if lag is None or lag.error > max(least, 0.2 * abs(lag.value)) else lag


def notes_on_lag_between_sticks(lag: Offset | None, clock_offset: float, step: float) -> list[str]:
    """What is said of a lag that is clear of its error and of a step."""
    if lag is None or abs(lag.value) <= max(0.5 * step, 5 * lag.error):
        return []
    return [note_on_lag_at_slips(lag, clock_offset)]


def late_error(lag: Offset | None, step: float) -> float:
    """Standard error in s that the time of the force has in common at all break-aways.

    A record whose samples are in step with its slips misses each highest force by the same part of a step.
    """
    return step if lag is None else math.hypot(lag.value, lag.error, step / math.sqrt(12))
