"""What changes from picture to picture over its stated error: of a coordinate, and of the size of a marker."""

from __future__ import annotations

import math

import numpy as np

from stickslip.files.arrays import Array
from stickslip.files.median_deviation import MAD_TO_SIGMA, median_deviation
from stickslip.tracking.positions.size_changes import FEWEST_PICTURES, USUAL

ORDERS = (6, 8, 10)
"""Differences of these orders hold nothing of a motion that twenty pictures a period show."""

UNRESOLVED = 1.5
"""Noise shows alike in differences of all orders; those of the highest see more where the motion bends too often."""

WIDEST = 1.6
"""Differences over so many times the usual time lie across a gap."""

FEW_SIZES = 10
"""Pictures from which the scatter of a size can be told."""

POSITION_STEP = 2.0
"""Places of a marker that are so many px apart are two."""


def scatter(positions: Array, errors: Array, times: Array) -> Array:
    """What changes from picture to picture in one coordinate over its stated errors, at each picture.

    From divided differences of the positions that were seen, at their times, each over the standard error that the stated
    ones give it: the median of their sizes over some pictures around, as that of normal ones is. Differences of the order
    that sees least are taken.

    Parameters
    ----------
    positions, errors, times : shape (n,); NaN where it was not seen.

    Returns
    -------
    shape (n,), near 1 where the errors are right; NaN of too few, and where the motion itself shows in the differences, as of
    fewer than twenty pictures a period.

    Limits: blind to errors that stay for longer than some pictures.

    Examples
    --------
    >>> rng, t = np.random.default_rng(0), np.arange(400) + np.random.default_rng(1).uniform(-0.2, 0.2, 400)
    >>> found = scatter(50 * np.sin(t / 5) + 0.1 * rng.standard_normal(400), np.full(400, 0.05), t)
    >>> bool(np.abs(np.log(found / 2)).max() < 0.7)
    True
    """
    from scipy.ndimage import median_filter

    seen = np.flatnonzero(np.isfinite(positions) & np.isfinite(times))
    nothing = np.full(len(positions), math.nan)
    if len(seen) < FEWEST_PICTURES + max(ORDERS):
        return nothing
    found = []
    for order in ORDERS:
        moments, values, stated = (
            np.lib.stride_tricks.sliding_window_view(one[seen], order + 1) for one in (times, positions, errors)
        )
        span = moments[:, -1] - moments[:, 0]
        apart = (moments[:, :, None] - moments[:, None, :]) / span[:, None, None] + np.eye(order + 1)
        weight = 1 / apart.prod(axis=2)
        size = np.abs(np.sum(weight * values, axis=1)) / np.linalg.norm(weight * stated, axis=1)
        known = span < WIDEST * np.median(span)  # across a gap the motion itself differs
        middle = seen[order // 2 : order // 2 + len(known)][known]
        if len(middle) < FEWEST_PICTURES:
            return nothing
        found.append((median_deviation(size[known]), middle, size[known]))
    usual, middle, own = min(found, key=lambda one: one[0])
    if found[-1][0] > UNRESOLVED * usual:
        return nothing
    around = MAD_TO_SIGMA * median_filter(own, min(USUAL, len(middle)), mode="reflect")
    # few of those around are independent: half way, by ratio, to that of the whole film
    return np.interp(np.arange(len(positions)), middle, np.sqrt(usual * around))


def size_scatter(x: Array, y: Array, size: Array, size_error: Array) -> float:
    """How much of its noise a marker shows: the scatter of its size over the stated error of that.

    The size feels the same noise at the same rim as the centre does, and what the ground beside the marker does not show.
    Each position counts alike, however long the marker rests there, and of few positions more is taken than they show.

    Limits: light that falls off moves the centre and not the size.

    Parameters
    ----------
    x, y, size, size_error : shape (n,), in px; NaN where the marker was not seen.

    Returns
    -------
    Near 1 where the error is right; inf where that cannot be told, as of few pictures.
    """
    seen = np.isfinite(size) & np.isfinite(size_error) & np.isfinite(x) & np.isfinite(y)
    if seen.sum() < FEW_SIZES:
        return math.inf
    positions = np.rint(np.stack([x[seen], y[seen]]) / POSITION_STEP)
    _, which, counts = np.unique(positions, axis=1, return_inverse=True, return_counts=True)
    weights = 1 / counts[which.ravel()]
    off = size[seen] - np.average(size[seen], weights=weights)
    found = math.sqrt(np.average(off**2, weights=weights)) / float(np.median(size_error[seen]))
    return (1 + 1 / math.sqrt(len(counts))) * found
