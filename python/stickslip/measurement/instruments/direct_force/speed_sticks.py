"""Sticks as the measured speed shows them, and the force at which each breaks away."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from scipy.special import ndtr

from stickslip.files.arrays import Array, Mask
from stickslip.measurement.instruments.direct_force.direct_run import DirectRun
from stickslip.measurement.result import event_table
from stickslip.measurement.signals.noise import noise_level
from stickslip.measurement.signals.sample_runs import runs_of

QUARTILE = 0.3186
"""Of the size of a normal variable, in standard deviations."""
CLEAR_DEVIATIONS = 3.0
"""Standard deviations of the speed at rest from which on a mass moves; of the force, from which on it falls."""


def stuck_samples(w: Array, level: float, error: Array) -> Mask:
    """Slower than `level`, for three samples at least, holes closed where the speed stays below twice the level.

    On a soft spring a mass takes long to reach that speed, so each end moves to where the speed leaves what it scatters by
    at rest.
    """
    slow, near = np.abs(w) < level, np.abs(w) < 2 * level
    stuck = slow.copy()
    for first, last in runs_of(near):
        inside = np.flatnonzero(slow[first:last])
        if len(inside):
            stuck[first + inside[0] : first + inside[-1] + 1] = True
    for first, last in runs_of(stuck):
        at_rest = max(float(np.quantile(np.abs(w[first:last]), 0.25)) / QUARTILE, float(np.median(error[first:last])))
        resting = first + np.flatnonzero(np.abs(w[first:last]) < CLEAR_DEVIATIONS * at_rest)
        stuck[first:last] = False
        if resting.size:
            stuck[resting[0] : resting[-1] + 1] = True
    for first, last in runs_of(stuck):
        if last - first < 3:
            stuck[first:last] = False
    return stuck


def _unseen_motion(w: Array, time: Array, moves: int, way: int) -> float:
    """How long before its first sample `moves` that is seen to move the mass may have moved, time counted in this way.

    Where the speed grows as a power of the time since then, it doubles twice in times that tell it.
    """
    speed = np.abs(w[moves:] if way > 0 else w[moves::-1])
    times = np.abs((time[moves:] if way > 0 else time[moves::-1]) - time[moves])
    reached = [np.flatnonzero(speed >= factor * speed[0]) for factor in (2.0, 4.0)]
    if not all(one.size for one in reached):
        return 0.0
    once, twice = (float(times[one[0]]) for one in reached)
    ratio = (twice - once) / once if once > 0 else 0.0
    return once / (ratio - 1) if ratio > 1 else once


def _expected_excess(force: Array, noise: float) -> float:
    """By how much the highest sample of a stick is expected to lie above its highest force: more the longer it is near that.

    The force is taken from straight lines over an eighth of the stick, the noise as normal and independent.
    """
    from scipy.signal import savgol_filter  # loads for half a second

    if len(force) < 3 or not noise > 0:
        return 0.0
    smooth = savgol_filter(force, max(len(force) // 8, 3), 1)
    top = float(smooth.max())
    level = np.linspace(top - 4 * noise, top + 6 * noise, 200)
    below = np.prod(ndtr((level[:, None] - smooth[smooth > top - 8 * noise]) / noise), axis=1)
    return float(level[-1] - np.trapezoid(below, level)) - top


def break_aways_of(run: DirectRun) -> xr.Dataset:
    """One row for each stick that ends inside the record: the force is its largest size in the stick, less noise.

    The largest sample lies below the peak by half the height of the triangle that the force may have made between two
    samples, in the mean; one between two samples of a force that was taken later lies lower still.
    """
    time, w, force = run.record.time, run.motion.w, run.force
    noise, scatter = float(np.median(run.error)), noise_level(force)
    sticks = runs_of(run.stuck)
    rows: list[list[float]] = []
    for number, (first, last) in enumerate(sticks):
        if last >= len(time):
            continue
        ends = [
            _unseen_motion(w, time, last, 1),
            _unseen_motion(w, time, first - 1, -1) if first > 0 else 0.0,
        ]
        step = float(time[last] - time[last - 1])
        inside = force[first : last + 1]
        sense = 1.0 if inside[-1] >= 0 else -1.0
        # a late force begins the stick with that of the slip before it, which is no loading
        t, f = time[first : last + 1] - time[first], np.interp(time[first : last + 1] + run.lag, time, force)
        # nor is the fall behind its highest force
        loaded = int(np.argmax(sense * f)) + 1
        loading = slice(loaded if loaded > max(len(t) // 2, 2) else None)
        rate = float(np.polyfit(t[loading], f[loading], 1)[0])
        top = first + int(np.argmax(sense * inside))
        fall = max(sense * (force[top] - force[min(top + 1, len(force) - 1)]) - CLEAR_DEVIATIONS * scatter, 0.0)
        rise = max(sense * rate * step, 0.0)
        missed = rise * fall / (rise + fall) / 2 if fall > 0 else 0.0
        after = sense * (force[top] - force[min(top + 2, len(force) - 1)])
        missed += min((1 - run.between) * rise, run.between * max(after - CLEAR_DEVIATIONS * scatter, 0.0))
        peak = (float(np.max(sense * inside)) - _expected_excess(sense * inside, scatter) + missed) * sense
        residuals = f - np.polyval(np.polyfit(t, f, 1), t)
        following = sticks[number + 1][0] if number + 1 < len(sticks) else len(time)
        drop = abs(peak) - float(np.min(sense * force[last:following]))
        force_error = math.hypot(
            noise, abs(rate) * step / math.sqrt(12), abs(rate) * float(run.facts["break_away_late"])
        )
        stick_time = float(time[last] - time[first]) if first > 0 else math.nan
        spread = float(np.sqrt(np.sum(residuals**2) / max(len(t) - 2, 1) / np.sum((t - t.mean()) ** 2)))
        values = (float(time[last]), stick_time, rate, peak, drop)
        late, early = (math.hypot(step, end) for end in ends)
        errors = (late, math.hypot(late, early), spread, force_error, math.sqrt(2) * force_error)
        rows.append([number for pair in zip(values, errors, strict=True) for number in pair])
    return event_table(rows, run.unit)
