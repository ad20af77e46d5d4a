"""Honest errors of means: samples that follow each other are not independent, and repetitions differ."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def block_error(values: Array, blocks: int = 10) -> float:
    """Standard error of a mean from the scatter of the means of consecutive blocks.

    Unlike sd/sqrt(n) it does not believe that a thousand samples of one slow wave are a thousand measurements.

    Examples
    --------
    >>> slow = np.sin(np.linspace(0, 3, 1000))
    >>> block_error(slow) > 5 * float(slow.std()) / 1000**0.5
    True
    """
    blocks = min(blocks, len(values) // 2)
    if blocks < 2:
        return float("nan")
    means = [float(part.mean()) for part in np.array_split(values, blocks)]
    return float(np.std(means, ddof=1) / np.sqrt(blocks))


def median_and_error(values: Array, blocks: int = 10) -> tuple[float, float]:
    """Median and its standard error from the medians of consecutive blocks."""
    if len(values) == 0:
        return float("nan"), float("nan")
    blocks = min(blocks, len(values) // 2)
    if blocks < 2:
        return float(np.median(values)), float("nan")
    medians = [float(np.median(part)) for part in np.array_split(values, blocks)]
    return float(np.median(values)), float(np.std(medians, ddof=1) / np.sqrt(blocks))


def straight_line(x: Array, y: Array) -> tuple[float, float]:
    """Slope of a straight line and its standard error."""
    if len(x) < 3:
        return (float((y[-1] - y[0]) / (x[-1] - x[0])), float("nan")) if len(x) == 2 else (float("nan"), float("nan"))
    square = float(np.sum((x - x.mean()) ** 2))
    slope = float(np.sum((x - x.mean()) * y)) / square
    rest = y - y.mean() - slope * (x - x.mean())
    return slope, float(np.sqrt(np.sum(rest**2) / (len(x) - 2) / square))
