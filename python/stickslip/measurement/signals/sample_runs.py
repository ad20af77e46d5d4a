"""Runs of samples for which something holds."""

from __future__ import annotations

import numpy as np

from stickslip.files.arrays import Mask


def runs_of(mask: Mask) -> list[tuple[int, int]]:
    """First and one past the last index of every run of True.

    >>> runs_of(np.array([True, False, True, True]))
    [(0, 1), (2, 4)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
