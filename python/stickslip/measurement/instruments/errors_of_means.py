"""Honest errors of means: samples that follow each other are not independent, and repetitions differ."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from stickslip.files.arrays import Array


def block_error(values: Array, blocks: int = 10) -> float:
    """Standard error of a mean from the scatter of the means of consecutive blocks.

    Unlike sd/sqrt(n) it does not believe that a thousand samples of one slow wave are a thousand measurements.

    Examples
    --------
    >>> slow = np.sin(np.linspace(0, 3, 1000))
    >>> block_error(slow) > 5 * float(slow.std()) / 1000**0.5
    True
    """
    return _error_of(np.mean, values, blocks)


def median_and_error(values: Array) -> tuple[float, float]:
    """Median and its standard error from the medians of ten consecutive blocks."""
    return float(np.median(values)) if len(values) else float("nan"), _error_of(np.median, values, 10)


def _error_of(middle: Callable[[Array], Any], values: Array, blocks: int) -> float:
    """Standard error of a mean or a median."""
    blocks = min(blocks, len(values) // 2)
    if blocks < 2:
        return float("nan")
    return float(np.std([middle(part) for part in np.array_split(values, blocks)], ddof=1) / np.sqrt(blocks))


def straight_line(x: Array, y: Array) -> tuple[float, float]:
    """Slope of a straight line and its standard error."""
    if len(x) < 3:
        return (float((y[-1] - y[0]) / (x[-1] - x[0])), float("nan")) if len(x) == 2 else (float("nan"), float("nan"))
    square = float(np.sum((x - x.mean()) ** 2))
    slope = float(np.sum((x - x.mean()) * y)) / square
    residuals = y - y.mean() - slope * (x - x.mean())
    return slope, float(np.sqrt(np.sum(residuals**2) / (len(x) - 2) / square))
