"""How far apart the samples of a record are."""

from __future__ import annotations

from stickslip.files.arrays import Array


def mean_step(time: Array) -> float:
    """The mean sampling interval.

    >>> import numpy as np
    >>> mean_step(np.array([0.0, 0.1, 0.4]))
    0.2
    """
    return float((time[-1] - time[0]) / (len(time) - 1))
