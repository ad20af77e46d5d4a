"""What does not belong to the motion: white noise, isolated impulses, readings at the end of the range."""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import binary_closing, median_filter

from stickslip.files.arrays import Array, Mask
from stickslip.files.median_deviation import median_deviation
from stickslip.measurement.signals.sample_runs import runs_of

BAND = 7.0
"""Within so many standard deviations lie all samples of a level with noise."""
PILED = 5.0
"""Readings at the end of the range for each one at the values next to it."""
FEWEST_AT_END = 6
"""Equal readings at the end of a range: two runs of three."""
FLAT = 12
"""Fewest samples of a flat that has noise."""


def noise_level(signal: Array, weight: Array | None = None) -> float:
    """Standard deviation of white noise on a smooth signal, from its third differences.

    A third difference removes what is quadratic over four samples and has 20 times the variance of the noise; the
    median makes it blind to impulses and to the samples at events. Differences with a sample of no `weight` do not count:
    readings at the end of a range, and lines across what is missing, have no noise.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> round(noise_level(np.sin(np.arange(5000) / 50) + 0.01 * rng.standard_normal(5000)), 3)
    0.01
    """
    differences = np.abs(np.diff(signal, 3))
    if weight is not None:
        seen = np.lib.stride_tricks.sliding_window_view(weight > 0, 4).all(axis=1)
        differences = differences[seen] if seen.any() else differences
    level = median_deviation(differences) / math.sqrt(20)
    if level == 0.0:  # a coarsely quantised record: most differences vanish
        level = float(np.sqrt(np.mean(np.minimum(differences, np.quantile(differences, 0.99)) ** 2) / 20))
    return level


def impulses(signal: Array, noise: float) -> Mask:
    """Samples that stand out alone, more than five sigmas from the median of their seven neighbours.

    The excess over the neighbourhood's own range is what counts, so a steep slip is not taken for an impulse; nor is the
    sharp end of a slip that few samples show, which the cubic through the four neighbours predicts. The first and the last
    sample stand out where they lie off the parabola through the next three, by three times the range of the next seven.
    """
    middle = median_filter(signal, 7, mode="nearest")
    deviation = np.abs(signal - middle)
    # on a slope the median of seven is off by up to three steps of the slope
    slope = np.abs(np.gradient(median_filter(signal, 5, mode="nearest")))
    slope = median_filter(slope, 5, mode="nearest")
    around = np.pad(signal, 2, mode="edge")
    cubic = (4 * (around[1:-3] + around[3:-1]) - around[:-4] - around[4:]) / 6
    least = 5 * max(noise, 1e-300)
    found = np.asarray((deviation > least + 3 * slope) & (np.abs(signal - cubic) > least))
    for at, inward in ((0, 1), (-1, -1)):  # the first and the last sample have neighbours on one side only
        beside = signal[::inward][1:8]
        expected = 3 * beside[0] - 3 * beside[1] + beside[2]
        found[at] |= bool(abs(signal[at] - expected) > math.sqrt(20) * least + 3 * float(np.ptp(beside)))
    return found


def lone_spikes(force: Array, noise: float, speed: Array) -> Mask:
    """`impulses` of a friction force, without the peaks of friction itself.

    A spike lies beyond its six neighbours, the highest and the lowest of them left out, by more than their range. Where the
    speed changes its sense or more than doubles among them, friction has short peaks of its own: there it must lie beyond
    them by more than the range of the whole record.

    Parameters
    ----------
    force, speed : (n,) of one record.
    noise : standard deviation of the force.

    Examples
    --------
    >>> speed = np.sin(np.arange(2000) / 50)
    >>> force = 5 * np.sign(speed)
    >>> force[[400, 1001]] += 60.0
    >>> np.flatnonzero(lone_spikes(force, 0.1, speed)).tolist()
    [400, 1001]
    """
    found = impulses(force, noise)
    whole = float(np.subtract(*np.quantile(force, [0.99, 0.01])))
    for at in np.flatnonzero(found).tolist():
        first, last = max(at - 3, 0), at + 4
        beside = np.sort(np.delete(force[first:last], at - first))[1:-1]
        speeds = speed[first:last]
        steady = speeds.min() > 0.5 * speeds.max() > 0 or speeds.max() < 0.5 * speeds.min() < 0
        excess = max(force[at] - beside[-1], beside[0] - force[at])
        found[at] = excess > (beside[-1] - beside[0] if steady else whole)
    return found


def piles_up(upward: Array, fewest: int) -> bool:
    """Whether readings pile up at the largest value, as those of an instrument do whose range ends there.

    They do where at least five times as many have it as each of the five values below it.

    Parameters
    ----------
    upward : (n,) readings.
    fewest : so many of them at least, and of values: the more, the less else speaks for an end of the range.

    >>> saw = np.arange(1000) % 50 / 50.0
    >>> piles_up(saw, 6), piles_up(np.minimum(saw, 0.84), 6)
    (False, True)
    """
    values, counts = np.unique(upward, return_counts=True)
    return bool(len(values) >= fewest and counts[-1] >= max(fewest, PILED * counts[-6:-1].max()))


def clipped(signal: Array, noise: float) -> Mask:
    """Samples at the end of an instrument's range, where it would have read on.

    The readings at the largest (or the smallest) value are taken for clipped where they pile up there (:func:`piles_up`), and
    where the line through the samples before a run of at least three of them goes on, for the most of them, by more than five
    sigmas. So are those of an amplifier that saturates ahead of the converter, whose flats
    have the noise of the rest: the readings of the highest band of noise, where they are as many, scatter in runs of at
    least twelve by no more than noise about one level, and come of such lines.

    Parameters
    ----------
    signal : (n,) record.
    noise : its standard deviation.

    Returns
    -------
    (n,) True at the samples that say no more than that the range has ended.

    Examples
    --------
    >>> saw = np.arange(1000) % 50 / 50.0
    >>> int(clipped(saw, 0.001).sum()), int(clipped(np.minimum(saw, 0.84), 0.001).sum())
    (0, 160)
    """
    found = np.zeros(len(signal), dtype=bool)
    if len(np.unique(signal)) < FEWEST_AT_END:
        return found
    for upward in (signal, -signal):
        end = float(upward.max())
        if piles_up(upward, FEWEST_AT_END):
            at_end, least = upward == end, 3
        else:
            at_end, least = upward > end - BAND * noise, FLAT
            bands = [np.count_nonzero(upward > end - count * BAND * noise) for count in (1, 6)]
            if bands[0] < bands[1] - bands[0]:
                continue
            end = float(np.median(upward[at_end]))
            # A reading beyond the band of noise parts no flat.
            at_end = binary_closing(at_end, np.ones(3, bool))
        runs = [(a, b) for a, b in runs_of(at_end) if a >= 8 and b - a >= least]
        if least == FLAT and not (runs and _flat([upward[a:b] for a, b in runs], end, noise)):
            continue
        onwards = [_extrapolated(upward, a, b) > end + 5 * noise for a, b in runs]
        # One alone may be where a drive stops.
        if np.sum(onwards) >= 2 and np.average(onwards, weights=[b - a for a, b in runs]) > 0.5:
            found |= at_end
    return found


def _extrapolated(upward: Array, first: int, last: int) -> float:
    """Where the line through as many samples before a run, 8 to 100, is half as far on."""
    count = min(max(last - first, 8), 100, first)
    line = np.polyfit(np.arange(-count, 0), upward[first - count : first], 1)
    return float(np.polyval(line, min(last - first, max(count, 10)) / 2))


def _flat(runs: list[Array], level: float, noise: float) -> bool:
    """Whether most runs scatter about this level by their noise alone, their first and last two samples left out."""
    scatter = np.array([math.sqrt(float(np.mean((run[2:-2] - level) ** 2))) for run in runs])
    count = np.array([len(run) - 4 for run in runs])
    return bool(np.mean(scatter < noise * (1 + 2 / np.sqrt(2 * count))) > 0.5)
