"""The standard deviation of numbers a few of which may be far off: from the median of their sizes."""

from __future__ import annotations

import numpy as np

from stickslip.files.arrays import Array

MAD_TO_SIGMA = 1.4826
"""Standard deviation of normal numbers over the median of their sizes."""


def median_deviation(residuals: Array) -> float:
    """Standard deviation of normal numbers about zero, from the median of their sizes.

    >>> round(median_deviation(np.array([-1.0, 1.0, -1.0, 1.0, 50.0])), 3)
    1.483
    """
    return MAD_TO_SIGMA * float(np.median(np.abs(residuals)))
