"""The ground beside a marker: whether its texture stays where it is while the marker passes, or moves along with it."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from stickslip.files.arrays import Array
from stickslip.files.median_deviation import MAD_TO_SIGMA
from stickslip.tracking.finding.response_map import ResponseMap
from stickslip.tracking.video.vision import vision

FEWEST = 5
"""Positions of a marker from which that can be told."""

APART = 0.5
"""Positions that are so many px apart are two."""

BESIDE = 0.65, 2.5
"""A ring of ground begins at so many diameters and px more from the centre, clear of the corners of a square."""

WIDTH = 4.0
"""Its width in px."""

OUTSIDE = 3.0
"""What is off the ring's level by so many times its usual scatter belongs to the marker, or to another thing."""

LEAST_GROUND = 12
"""Pixels of it that must be seen at all positions."""

CLEARLY = 0.7
"""A larger share of the scatter may be all of it: what is left is the rim of the marker."""

TRAVEL = 8.0
"""A marker that stays within so many px passes too little of a ground with texture."""

BYTES = 1 << 25
"""Memory for the pictures that are kept; twice as many as are needed are kept in any case."""

MOST = 24
"""Pictures that are kept at most."""


class KeptPictures:
    """Some pictures of a film, evenly spread over what has been seen of it so far, by their numbers."""

    def __init__(self) -> None:
        self.pictures: dict[int, ResponseMap] = {}
        self._step = 1

    def due(self, number: int) -> bool:
        """Whether this picture is to be kept."""
        return number % self._step == 0

    def keep(self, number: int, picture: ResponseMap) -> None:
        """Keep it, and every other of the former ones where they are too many."""
        self.pictures[number] = picture
        if len(self.pictures) > max(2 * FEWEST, min(MOST, BYTES // max(1, picture.nbytes))):
            self._step *= 2
            self.pictures = {one: kept for one, kept in self.pictures.items() if one % self._step == 0}


def share_that_passes(pictures: dict[int, ResponseMap], x: Array, y: Array, size: float) -> float:
    """The scatter of the ground beside a marker that changes as it moves, over all of that scatter.

    Of a ring p_k in the frame of the marker at positions k = 1 to n, each less its mean,
    √(Σ_k |p_k − p̄|² / Σ_k |p_k|² · n/(n − 1)): 1 of a ground that rests and of the noise of a camera, near 0 of texture that
    moves along with the marker.

    Parameters
    ----------
    pictures : some pictures of the film, by number.
    x, y : the centre in each picture of the film, in px of these pictures; NaN where it was not seen.
    size : diameter of the marker in px.

    Returns
    -------
    1 where it is not clearly less, or the marker is seen at too few positions to tell.

    Limits: texture that rests and is alike over longer than the marker travels is taken for one that moves along.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> rests = dict.fromkeys(range(9), rng.integers(0, 99, (60, 200)).astype(np.uint8))
    >>> along = {k: np.roll(rests[0], 10 * k, axis=1) for k in range(9)}
    >>> x, y = 50 + 10.0 * np.arange(9), np.full(9, 30.0)
    >>> round(share_that_passes(rests, x, y, 20.0), 1), round(share_that_passes(along, x, y, 20.0), 1)
    (1.0, 0.0)
    """
    inner = BESIDE[0] * size + BESIDE[1]
    half = math.ceil(inner + WIDTH)
    rows, columns = np.mgrid[-half : half + 1, -half : half + 1]
    away = np.hypot(rows, columns)
    ring = (away >= inner) & (away < inner + WIDTH)
    chosen: list[tuple[float, float]] = []
    found: list[npt.NDArray[np.float32]] = []
    for number, picture in pictures.items():
        at = float(x[number]), float(y[number])
        if np.isfinite(at).all() and all(math.dist(at, other) >= APART for other in chosen):
            chosen.append(at)
            patch = vision().getRectSubPix(picture, (2 * half + 1,) * 2, at, patchType=vision().CV_32F)[ring]
            high, wide = picture.shape
            across, down = columns[ring] + at[0], rows[ring] + at[1]
            patch[(across < 0) | (across > wide - 1) | (down < 0) | (down > high - 1)] = math.nan
            found.append(patch)
    patches = np.array(found, float)
    if len(patches):
        patches = patches[:, np.isfinite(patches).all(axis=0)]
    if len(patches) < FEWEST or np.ptp(chosen, axis=0).max() < TRAVEL or patches.shape[1] < LEAST_GROUND:
        return 1.0
    patches -= np.median(patches, axis=1, keepdims=True)
    limit = OUTSIDE * MAD_TO_SIGMA * max(float(np.median(np.abs(patches))), 0.5)
    patches = np.clip(patches[:, np.abs(np.median(patches, axis=0)) < limit], -limit, limit)
    whole = float(np.sum(patches**2))
    changing = float(np.sum((patches - patches.mean(axis=0)) ** 2)) * len(patches) / (len(patches) - 1)
    share = math.sqrt(changing / whole) if whole > 0 else 1.0
    return share if share < CLEARLY else 1.0
