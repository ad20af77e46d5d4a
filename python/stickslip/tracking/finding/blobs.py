"""Blobs: connected spots that stand out from what surrounds them, at whatever brightness that is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from stickslip.tracking.finding.detections import Array, Detections, Row
from stickslip.tracking.finding.response_map import ResponseMap
from stickslip.tracking.video.vision import vision

LEVELS = 16
"""Heights at which a picture is cut."""

LEAST_LEVELS = 3
"""A spot that is seen at fewer heights is noise or texture."""

JUMPS = 1.12
"""Shares below a tenth are left out, which jumps from picture to picture: errors are larger than by the rim's noise alone."""

EVEN = 0.08
"""A ground that scatters by no more than this share of a blob's contrast is even: only the light varies on it."""

ALIKE = 1.5
"""Diameters of one spot in successive pictures differ by less than this factor."""

DEPTHS = (0.5, 0.3, 0.7)
"""Shares of its contrast below its crown at which a spot that is known is cut out."""

FINE = 8.0
"""Outlines are looked for in steps of this part of a diameter, where that is known: blurred by as much, they hold no more."""

SAME = 0.9
"""One that has this share of its last score is the same, and not looked for at another depth."""

MOST = 80
"""Of a crowded picture no more spots than this are looked at closely, those that stand out most."""


LEAST_GROUND = 12
"""Pixels of ground at least around a spot, which its contrast is over."""

LEAST_ERROR = 0.005
"""Of a centre in px."""


@dataclass(frozen=True)
class _Spot:
    cut: float
    label: int
    area: int
    left: int
    top: int
    width: int
    height: int

    def times(self, step: int) -> _Spot:
        """The spot in a picture with so many more pixels each way."""
        sides = (step * side for side in (self.left, self.top, self.width, self.height))
        return _Spot(self.cut, self.label, step**2 * self.area, *sides)


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
    The centre is that of the response I above the ground around the blob, a plane (uneven light shifts a dark marker of 12 px
    by 0.035 px otherwise); the contrast c grows and falls with the light, so where `black` is known it is proportional to
    the brightness |ground − black| (without that, light that falls by 10 % over 200 px shifts a marker of 20 px by 0.008 px),

        x_c = Σ x_i g_i / Σ g_i,   g_i = clip(½ + s ((I_i − ground_i)/c_i − ½), 0, 1),   c = crown − ground,

    s = 1 up to 12 px of diameter and 2 from 24 px on (then only the rim is weighed, not the face's texture), and its
    standard error that of the picture's noise σ around the blob, σ_x = s σ/c √Σ(x_i − x_c)² / Σ g_i, the
    sum under the root over the rim where 0 < g_i < 1.

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
    cv2 = vision()
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
    chains = _chains(cv2, coarse, heights, *areas, least_levels if level is None else 1)
    spots = [_outline(chain).times(stride) for chain in sorted(chains, key=len, reverse=True)[:MOST]]
    rows = [row for spot in spots if (row := _centre(picture, work, spot, level, size, black)) is not None]
    found = Detections.of([row for row in rows if threshold is None or row.contrast >= threshold])
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
    work = _smoothed(picture, size, opening)
    if level is not None:
        cuts = [level]
    else:
        middle = work.size - round(0.125 * math.pi * like.size**2)
        crown = float(np.partition(work, middle, axis=None)[middle])
        cuts = [crown - share * like.contrast for share in DEPTHS]
    best: Row | None = None
    for cut in cuts:
        found = _spot_at(picture, work, cut, like, position, level, size, black)
        if found is not None and (best is None or found.score > best.score):
            best = found
        if best is not None and best.score > SAME * like.score:
            break
    return best


def _spot_at(
    picture: ResponseMap,
    work: ResponseMap,
    cut: float,
    like: Row,
    position: tuple[float, float],
    level: float | None,
    size: float | None,
    black: float | None,
) -> Row | None:
    """The spot nearest to a place, with the outline at one height; None where it is not like before, or not whole."""
    cv2 = vision()
    _, _, stats, middles = cv2.connectedComponentsWithStats(_above(work, cut), connectivity=8, ltype=4)
    usual = math.pi / 4 * like.size**2
    near = [
        (math.dist(middle, position), label)
        for label, (middle, spot) in enumerate(zip(middles.tolist(), stats.tolist(), strict=True))
        if label and usual / ALIKE**2 < spot[4] < usual * ALIKE**2
    ]
    if not near:
        return None
    label = min(near)[1]
    left, top, wide, high, area = stats[label].tolist()
    found = _centre(picture, work, _Spot(cut, label, area, left, top, wide, high), level, size, black)
    whole = found is not None and not (found.cut_x or found.cut_y)
    return found if whole and found is not None and 1 / ALIKE < found.size / like.size < ALIKE else None


def _above(work: ResponseMap, cut: float) -> ResponseMap:
    """What lies above a height, 255 there and 0 elsewhere."""
    return np.asarray(vision().threshold(work, cut, 255, 0)[1])


def _smoothed(picture: ResponseMap, size: float | None, opening: int) -> ResponseMap:
    """The picture in which outlines are looked for."""
    cv2 = vision()
    if opening > 1:
        kernel = cv2.getStructuringElement(cv2.MORPH_RECT, (opening, opening))
        return np.asarray(cv2.morphologyEx(picture, cv2.MORPH_OPEN, kernel))
    # with the size known, texture inside a marker must not break it into parts
    return np.asarray(cv2.GaussianBlur(picture, (0, 0), max(0.8, size / 8 if size else 0.0)))


def _one_each(found: Detections) -> Detections:
    """Of blobs around one centre the most marker-like: a spot and its halo are one thing."""
    kept: list[int] = []
    for i in np.argsort(-found.score, kind="stable"):
        near = [j for j in kept if math.hypot(found.x[i] - found.x[j], found.y[i] - found.y[j]) < 0.12 * found.size[i]]
        if not near:
            kept.append(int(i))
    return found.take(np.sort(np.array(kept, np.int64)))


def _chains(
    cv2: Any, work: npt.NDArray[np.uint8], heights: npt.NDArray[np.float64], smallest: float, largest: float, least: int
) -> list[list[_Spot]]:
    """Spots inside each other, from the highest level down; one list a blob."""
    finished: list[list[_Spot]] = []
    growing: list[list[_Spot]] = []
    for level in range(len(heights) - 1, -1, -1):
        _, labels, stats, _ = cv2.connectedComponentsWithStats(_above(work, heights[level]), connectivity=8, ltype=4)
        area = stats[:, 4]
        box = stats[:, 2].astype(float) * stats[:, 3]
        narrow = np.minimum(stats[:, 2], stats[:, 3]) / np.maximum(stats[:, 2:4].max(axis=1), 1)  # no ground: no size
        good = (area >= smallest) & (area <= largest) & (area >= 0.45 * box) & (narrow >= 0.25)
        good[0] = False
        spots = {
            int(label): _Spot(
                float(heights[level]), int(label), int(area[label]), *(int(value) for value in stats[label, :4])
            )
            for label in np.flatnonzero(good)
        }
        parents: dict[int, list[list[_Spot]]] = {}
        for chain in growing:
            last = chain[-1]
            inside = labels[last.top : last.top + last.height, last.left : last.left + last.width]
            # some pixel of the smaller spot lies in its parent; all of them do, so the most frequent label is it
            row, column = last.height // 2, last.width // 2
            label = int(inside[row, column])
            if label not in spots:
                label = int(np.bincount(inside.ravel()[inside.ravel() > 0], minlength=1).argmax())
            spot = spots.get(label)
            if spot is None or (len(chain) >= LEAST_LEVELS and spot.area > 2.5 * chain[len(chain) // 2].area):
                finished.append(chain)
                spots.pop(label, None) if spot is not None else None
            else:
                parents.setdefault(label, []).append(chain)
        growing = []
        for label, children in parents.items():
            children.sort(key=len, reverse=True)
            finished.extend(children[1:])
            if label in spots:
                growing.append([*children[0], spots.pop(label)])
            else:
                finished.append(children[0])
        growing.extend([spot] for spot in spots.values())
    return [chain for chain in finished + growing if len(chain) >= least]


def _outline(chain: list[_Spot]) -> _Spot:
    """The spot of a chain whose area changes least from level to level; of equals the one in the middle."""
    if len(chain) < 3:
        return chain[len(chain) // 2]
    area = np.array([spot.area for spot in chain], float)
    growth = (area[2:] - area[:-2]) / area[1:-1]
    middle = np.abs(np.arange(1, len(chain) - 1) - 0.5 * (len(chain) - 1)) / len(chain)
    return chain[1 + int(np.argmin(growth + 0.3 * middle))]


def _levels(values: ResponseMap, mask: ResponseMap) -> tuple[int, int, int]:
    """How many values there are in a mask, their upper median, and the upper median of what they are off it."""
    counts = vision().calcHist([values], [0], mask, [256], [0, 256]).ravel()
    below = counts.cumsum()
    middle = below[-1] // 2
    median = min(int(below.searchsorted(middle, "right")), 255)
    off = counts[median:].copy()
    down = counts[median - 1 :: -1] if median else counts[:0]
    apart = np.zeros(256)
    apart[: off.size] = off
    apart[1 : 1 + down.size] += down
    return int(below[-1]), median, int(apart.cumsum().searchsorted(middle, "right"))


def _tilt(window: ResponseMap, around: ResponseMap, count: int, ground: int, spread: float) -> Array | None:
    """How much the light falls off across the window: the plane through what is around the blob, less its middle.

    None where that is no even ground but holds edges or texture.
    """
    cv2 = vision()
    plain = cv2.bitwise_and(cv2.inRange(window, ground - 3 * spread - 1, ground + 3 * spread + 1), around)
    of = cv2.moments(plain, binaryImage=True)
    bright = cv2.moments(cv2.bitwise_and(window, plain))
    n = of["m00"]
    determinant = of["mu20"] * of["mu02"] - of["mu11"] ** 2
    if n < 0.95 * count or determinant <= 0:
        return None
    centre_x, centre_y = of["m10"] / n, of["m01"] / n
    xb, yb = bright["m10"] - centre_x * bright["m00"], bright["m01"] - centre_y * bright["m00"]
    right = (xb * of["mu02"] - yb * of["mu11"]) / determinant
    down = (yb * of["mu20"] - xb * of["mu11"]) / determinant
    high, wide = window.shape
    return np.asarray(down * (np.arange(high) - centre_y)[:, None] + right * (np.arange(wide) - centre_x))


def _centre(
    picture: ResponseMap, work: ResponseMap, half: _Spot, level: float | None, wanted: float | None, black: float | None
) -> Row | None:
    """The spot itself, see :func:`find_blobs`; None where it has no ground or does not stand out."""
    cv2 = vision()
    high, wide = picture.shape
    reach = min(6, 2 + math.ceil(0.12 * math.sqrt(half.area)))
    ring = reach + 2 + math.ceil(0.1 * math.sqrt(half.area))
    left, top = max(0, half.left - ring), max(0, half.top - ring)
    at = slice(top, half.top + half.height + ring), slice(left, half.left + half.width + ring)
    window, cut = picture[at], _above(work[at], half.cut)
    labels = cv2.connectedComponents(cut)[1]
    inside = labels[half.top - top :, half.left - left :][: half.height, : half.width]
    counts = np.bincount(inside.ravel())
    if len(counts) < 2:
        return None
    core = cv2.inRange(labels, *[1 + int(counts[1:].argmax())] * 2)
    others = cv2.dilate(cv2.subtract(cut, core), np.ones((5, 5), np.uint8))
    near = cv2.dilate(core, np.ones((2 * reach + 1, 2 * reach + 1), np.uint8))
    around = cv2.bitwise_not(cv2.bitwise_or(near, others))
    count, ground, off = _levels(window, around)
    if count < LEAST_GROUND:
        around = cv2.bitwise_not(near)
        count, ground, off = _levels(window, around)
    contrast = float(_levels(window, core)[1] - ground)
    if count < LEAST_GROUND or contrast <= 0:
        return None
    steep = min(max(math.sqrt(half.area) / 12, 1), 2)
    spread = 1.4826 * off
    tilt = _tilt(window, around, count, ground, spread) if spread <= EVEN * contrast else None
    middle = 0.5 * contrast if level is None else level - ground
    share = window.astype(np.float64)
    share -= ground + middle
    slope: float | Array = steep / contrast
    if tilt is not None:
        share -= tilt
        bright = math.nan if black is None else ground - black
        if abs(bright) > 0.5 * contrast:  # what reflects little says little of the light
            light = tilt / bright
            slope = slope / (1 + light)
            if level is None:
                share -= middle * light
    share *= slope
    share += 0.5
    np.clip(share, 0, 1, out=share)
    share[share < 0.1] = 0  # the ground's noise far from the centre weighs most
    share = cv2.copyTo(share, cv2.bitwise_and(near, cv2.bitwise_not(cv2.subtract(others, core))))
    of = cv2.moments(share)
    weight = of["m00"]
    if weight <= 0:
        return None
    x, y = of["m10"] / weight, of["m01"] / weight
    xx, yy, xy = of["mu20"] / weight, of["mu02"] / weight, of["mu11"] / weight
    noise = math.hypot(max(spread, 0.3), 1 / math.sqrt(12))
    rim = cv2.moments(((share > 0) & (share < 0.98)).view(np.uint8), binaryImage=True)
    rough = JUMPS * steep * noise / (contrast * weight)
    x_error = rough * math.sqrt(max(rim["m20"] + x * (x * rim["m00"] - 2 * rim["m10"]), 0))
    y_error = rough * math.sqrt(max(rim["m02"] + y * (y * rim["m00"] - 2 * rim["m01"]), 0))
    determinant = max(xx * yy - xy * xy, 1e-12)
    compact = min(1.0, weight / (4 * math.pi * math.sqrt(determinant)))
    wide_axis = 0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy)
    round_ = math.sqrt(determinant) / wide_axis if wide_axis > 0 else 1.0
    size = 2 * math.sqrt(weight / math.pi)
    score = contrast * compact**2 * math.sqrt(round_) * size**0.25
    if wanted is not None:
        score *= math.exp(-((math.log(size / wanted) / 0.4) ** 2))
    return Row(
        *(x + left, y + top, max(x_error, LEAST_ERROR), max(y_error, LEAST_ERROR), size, contrast, score, -1),
        half.left <= 0 or half.left + half.width >= wide,
        half.top <= 0 or half.top + half.height >= high,
    )
