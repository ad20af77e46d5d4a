"""How fast the spring is wound up while the mass sticks, and whether it rests or creeps then."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from stickslip.files.arrays import Array
from stickslip.measurement.indirect.sticks.stick import Stick
from stickslip.measurement.regime import quiet_window
from stickslip.measurement.signals.presmooth import Presmoothed
from stickslip.measurement.signals.sampling import mean_step
from stickslip.measurement.signals.turning_points import Flanks

UNEVEN = 0.01
"""A drive may run so unevenly, as a share of its speed, from one stick to the next."""
COLOURED = 2.0
"""Noise need not be white: the slopes of sticks may scatter with so many times the variance that white noise gives."""


def local_slopes(time: Array, extension: Array, weight: Array, flanks: Flanks, window: int) -> Array:
    """Straight-line slopes of x in consecutive windows of the flanks, from the raw samples.

    Returns
    -------
    (j, 2) index of the flank, slope.
    """
    found: list[tuple[int, float]] = []
    for number, (first, last) in enumerate(flanks.limits):
        count = (last - first) // window
        for i in range(count):
            part = slice(first + i * window, first + (i + 1) * window)
            w = weight[part]
            total = w.sum()
            if total < window / 2:
                continue
            t = time[part] - np.sum(w * time[part]) / total
            found.append((number, float(np.sum(w * t * extension[part]) / np.sum(w * t * t))))
    return np.array(found).reshape(-1, 2)


@dataclass(frozen=True)
class StickSlope:
    """How fast the spring is wound up while the mass sticks, dx/dt, as the record itself shows it."""

    value: float
    error: float
    share: float


def stick_slope(
    time: Array, extension: Array, weight: Array, flanks: Flanks, presmoothed: Presmoothed, drive_velocity: float
) -> StickSlope | None:
    """The commonest slope on the flanks: a stick repeats its slope, slip does not.

    Windows are as long as a slope error of 5 % of the drive velocity asks for. The mode, not the mean, because creep
    before a slip lowers the slope of a part of each flank. None where there is no such mode.
    """
    if len(flanks.limits) < 3:
        return None
    step = mean_step(time)
    lengths = np.array([last - first for first, last in flanks.limits])
    window = int(np.clip(quiet_window(presmoothed.noise, step, drive_velocity), 6, max(np.median(lengths) / 3, 6)))
    slopes = local_slopes(time, extension, weight, flanks, window)
    if len(slopes) < 12:
        return None
    values = slopes[:, 1] / drive_velocity
    value = _mode(values)
    if not math.isfinite(value):
        return None
    near = np.abs(values - value) < 0.15 * value
    # the scatter of modes over interleaved parts of the record
    parts = np.array([_mode(values[slopes[:, 0] % 6 == i]) for i in range(6)])
    parts = parts[np.isfinite(parts)]
    error = float(np.std(parts, ddof=1) / math.sqrt(len(parts))) if len(parts) > 1 else value
    return StickSlope(value * drive_velocity, error * drive_velocity, float(np.mean(near)))


def _mode(values: Array) -> float:
    """Peak of a Gaussian density estimate."""
    if len(values) < 2:
        return float("nan")
    inner = values[(values > 0.3) & (values < 3)]
    if len(inner) < 2:
        return float("nan")
    quartiles = np.quantile(inner, [0.25, 0.75])
    width = max(0.9 * min(float(np.std(inner)), float(quartiles[1] - quartiles[0]) / 1.34), 1e-3) * len(inner) ** -0.2
    grid = np.linspace(0.3, 3.0, 1351)
    density = np.zeros_like(grid)
    for value in inner:
        density += np.exp(-0.5 * ((grid - value) / width) ** 2)
    return float(grid[np.argmax(density)])


def resting_slope(time: Array, extension: Array, weight: Array, sticks: list[Stick], noise: float) -> StickSlope | None:
    """One slope for the middle halves of all sticks, by least squares with an offset for each; None without samples."""
    slopes, errors = _own_slopes(time, extension, weight, sticks, noise)
    if len(slopes) == 0:
        return None
    total = float(np.sum(errors**-2))
    return StickSlope(float(np.sum(slopes * errors**-2)) / total, 1 / math.sqrt(total), 1.0)


def _own_slopes(time: Array, extension: Array, weight: Array, sticks: list[Stick], noise: float) -> tuple[Array, Array]:
    """Slope of the middle half of each stick and its error, of those with samples enough."""
    found: list[tuple[float, float]] = []
    for stick in sticks:
        part = slice(*np.searchsorted(time, stick.middle_half))
        w = weight[part]
        total = float(w.sum())
        if total < 6:
            continue
        t = time[part] - np.sum(w * time[part]) / total
        square = float(np.sum(w * t * t))
        found.append((float(np.sum(w * t * extension[part])) / square, noise / math.sqrt(square)))
    slopes, errors = np.array(found).reshape(-1, 2).T
    return slopes, errors


def is_resting(time: Array, extension: Array, weight: Array, sticks: list[Stick], slope: float, noise: float) -> bool:
    """Whether the middle halves of the sticks are lines of this one slope to within the noise.

    Their samples must lie on such lines, and their own slopes, each known far better than a sample, must agree: creep that
    is lost in the noise of samples shows there.
    """
    squares, count = 0.0, 0
    for stick in sticks:
        a, b = np.searchsorted(time, stick.middle_half)
        w = weight[a:b]
        if b - a < 8 or w.sum() < 6:
            continue
        residuals = extension[a:b] - slope * (time[a:b] - time[a])
        residuals = residuals - np.sum(w * residuals) / w.sum()
        squares += float(np.sum(w * residuals**2))
        count += int(w.sum()) - 1
    if count == 0:
        return True
    if math.sqrt(squares / count) > 1.15 * noise + 3 * noise / math.sqrt(2 * count):
        return False
    slopes, errors = _own_slopes(time, extension, weight, sticks, noise)
    if len(slopes) < 2:
        return True
    scatter = np.sum((slopes - slope) ** 2 / (errors**2 + (UNEVEN * slope) ** 2))
    return bool(scatter < COLOURED * chdtri(len(slopes) - 1, 1e-3))
