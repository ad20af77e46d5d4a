"""Blobs: connected spots that stand out from what surrounds them, at whatever brightness that is.

The centre of one is computed in ``crates/stickslip-py/src/spots/centre.rs``.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from stickslip import _core
from stickslip.files.arrays import Array
from stickslip.tracking.finding.detections import Detections, Row
from stickslip.tracking.finding.response_map import ResponseMap
from stickslip.tracking.video.vision import vision

LEVELS = 16
"""Heights at which a picture is cut."""

LEAST_LEVELS = 3
"""A spot that is seen at fewer heights is noise or texture."""

ALIKE = _core.ALIKE
"""Diameters of one spot in successive pictures differ by less than this factor."""

LEAST_ERROR = _core.LEAST_ERROR
"""Standard error of a centre at least, in px."""

FINE = 8.0
"""Outlines are looked for in steps of this part of a diameter, where that is known: blurred by as much, they hold no more."""

MOST = 80
"""Of a crowded picture no more spots than this are looked at closely, those that stand out most."""


class _Spot(NamedTuple):
    cut: float
    area: int
    left: int
    top: int
    width: int
    height: int

    def times(self, step: int) -> _Spot:
        """The spot in a picture with so many more pixels each way."""
        sides = (step * side for side in (self.left, self.top, self.width, self.height))
        return _Spot(self.cut, step**2 * self.area, *sides)


def find_blobs(
    picture: ResponseMap,
    *,
    size: float | None = None,
    threshold: float | None = None,
    level: float | None = None,
    opening: int = 0,
    black: float | None = None,
) -> Detections:
    """Compact spots of high response with their centres.

    The picture is cut at 16 heights; spots that lie inside each other at successive heights are one blob (as in a
    component tree). Each has its own outline, where the area changes least with the height, so uneven light does no harm.

    Their centres and the errors of these are computed in ``crates/stickslip-py/src/spots/centre.rs``.

    Parameters
    ----------
    picture : (height, width) response map, 0 to 255.
    size : diameter in px; blobs from half to twice of it are kept. Default: from 3 px to two fifths of
        the picture's area.
    threshold : least contrast in grey levels; default a sixth of the picture's range.
    level : cut only here; for a body whose outline is known to be at that response.
    opening : thin things (strings, rims) narrower than this many px are taken off the blobs first.
    black : the response of what reflects no light: 255 of a map for dark markers, 0 for bright ones; None: not known.

    Returns
    -------
    Detections, n >= 0.

    Limits: a marker must be roughly as wide as it is high (up to 1:4, for motion blur), and its contrast must exceed the
    noise about five times.
    """
    high, wide = picture.shape
    smallest = math.pi / 4 * (0.5 * size if size else 3.0) ** 2
    largest = math.pi / 4 * (2.0 * size) ** 2 if size else 0.4 * high * wide
    work = _smoothed(picture, size, opening)
    low, top = (float(value) for value in np.percentile(work[:: max(1, high // 400)], [0.5, 100]))
    if top - low < 6:
        return Detections.of([])
    step = (top - low) / (LEVELS + 1)
    least_levels = LEAST_LEVELS if threshold is None else max(1, round(threshold / step))
    heights: Array = np.array([level], float) if level is not None else low + step * np.arange(1.0, LEVELS + 1)
    stride = max(1, int(size / FINE)) if size and opening <= 1 else 1
    coarse = np.ascontiguousarray(work[::stride, ::stride])
    areas = smallest / stride**2, largest / stride**2
    chains = _chains(coarse, heights, *areas, least_levels if level is None else 1)
    spots = [_outline(chain).times(stride) for chain in sorted(chains, key=len, reverse=True)[:MOST]]
    rows = [_core.spot_centre(picture, work, spot, (level, size, black)) for spot in spots]
    found = Detections.of([row for row in rows if row is not None])
    if threshold is not None:
        found = found.take(np.flatnonzero(found.contrast >= threshold))
    return _one_each(found)


def look_near(
    picture: ResponseMap,
    like: Row,
    position: tuple[float, float],
    *,
    size: float | None = None,
    level: float | None = None,
    opening: int = 0,
    black: float | None = None,
) -> Row | None:
    """The one spot that was seen before, in a small window around where it is expected.

    The window is cut half of the spot's contrast below its crown, which must stand out most in it, and higher or lower where
    something beside it runs into the spot.

    Parameters
    ----------
    picture : the window.
    like : its last detection.
    position : where it is expected, in px of the window.
    size, level, opening, black : as for :func:`find_blobs`.

    Returns
    -------
    Its detection; None where nothing alike lies whole in the window.
    """
    found = _core.spot_near(picture, _smoothed(picture, size, opening), like, position, (level, size, black))
    return None if found is None else Row(*found)


def _smoothed(picture: ResponseMap, size: float | None, opening: int) -> ResponseMap:
    """The picture in which outlines are looked for."""
    if opening > 1:
        cv2 = vision()
        kernel = cv2.getStructuringElement(cv2.MORPH_RECT, (opening, opening))
        return np.asarray(cv2.morphologyEx(picture, cv2.MORPH_OPEN, kernel))
    # with the size known, texture inside a marker must not break it into parts
    return _core.blurred(picture, max(0.8, size / 8 if size else 0.0))


def _one_each(found: Detections) -> Detections:
    """Of blobs around one centre the most marker-like: a spot and its halo are one thing."""
    kept: list[int] = []
    for i in np.argsort(-found.score, kind="stable"):
        near = [j for j in kept if math.hypot(found.x[i] - found.x[j], found.y[i] - found.y[j]) < 0.12 * found.size[i]]
        if not near:
            kept.append(int(i))
    return found.take(np.sort(np.array(kept, np.int64)))


def _chains(work: ResponseMap, heights: Array, smallest: float, largest: float, least: int) -> list[list[_Spot]]:
    """Spots inside each other, from the highest level down; one list a blob."""
    finished: list[list[_Spot]] = []
    # With the number of the spot below that holds the last one, -1 for none.
    growing: list[tuple[list[_Spot], int]] = []
    levels = _core.spot_levels(work, heights.tolist(), (smallest, largest))
    for height, level in zip(heights[::-1].tolist(), levels, strict=True):
        spots = {number: _Spot(height, *spot[:5]) for number, spot in enumerate(level)}
        parents: dict[int, list[list[_Spot]]] = {}
        for chain, number in growing:
            if number < 0:
                finished.append(chain)
            elif len(chain) >= LEAST_LEVELS and level[number][0] > 2.5 * chain[len(chain) // 2].area:
                finished.append(chain)
                spots.pop(number, None)
            else:
                parents.setdefault(number, []).append(chain)
        growing = []
        for number, children in parents.items():
            children.sort(key=len, reverse=True)
            finished.extend(children[1:])
            if number in spots:
                growing.append(([*children[0], spots.pop(number)], level[number][5]))
            else:
                finished.append(children[0])
        growing.extend(([spot], level[number][5]) for number, spot in spots.items())
    return [chain for chain in finished + [chain for chain, _ in growing] if len(chain) >= least]


def _outline(chain: list[_Spot]) -> _Spot:
    """The spot of a chain whose area changes least from level to level; of equals the one in the middle."""
    if len(chain) < 3:
        return chain[len(chain) // 2]
    area = np.array([spot.area for spot in chain], float)
    growth = (area[2:] - area[:-2]) / area[1:-1]
    middle = np.abs(np.arange(1, len(chain) - 1) - 0.5 * (len(chain) - 1)) / len(chain)
    return chain[1 + int(np.argmin(growth + 0.3 * middle))]
