"""A ruler in the picture: the edges of its marks, found along a line with sub-pixel places."""

from __future__ import annotations

import math

import numpy as np

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.tracking.video.source import Picture
from stickslip.tracking.video.vision import vision


def find_marks(
    picture: Picture,
    first: tuple[float, float],
    second: tuple[float, float],
    last: tuple[float, float],
    *,
    band: int = 3,
) -> tuple[Array, Array]:
    """Follow the marks of a ruler from the first to the last.

    The brightness along the line from `first` to `last` is averaged over a band; at every mark it jumps. Beginning with
    the distance of the first two marks each next mark is the jump that is strong and near to where the last two let it
    be expected (slope times exp(-(distance/0.08 pitch)²)), and its place the centre of the jump's slope. A pitch without
    a jump is passed over.

    Parameters
    ----------
    picture : (height, width, 3).
    first, second, last : (x, y) in px of the first two marks and the last one, to about a tenth of a pitch.
    band : half the number of picture rows that are averaged.

    Returns
    -------
    positions : (n, 2) px of the marks found.
    number : (n,) how many pitches each lies from the first mark.

    Raises
    ------
    InputError
        if fewer than three marks are found.
    """
    cv2 = vision()
    start, end = np.array(first, float), np.array(last, float)
    length = float(np.linalg.norm(end - start))
    pitch = float(np.linalg.norm(np.array(second, float) - start))
    if pitch < 4 or length < 1.5 * pitch:
        raise InputError(
            f"ruler: marks must be 4 px apart or more and the last beyond the second, got {pitch:.3g} px of {length:.3g} px"
        )
    along = (end - start) / length
    across = np.array([-along[1], along[0]])
    reach = 0.3 * pitch
    steps = np.arange(-math.ceil(reach) - 4, math.ceil(length + reach) + 5)
    grid = start + steps[:, None, None] * along + np.arange(-band, band + 1)[None, :, None] * across
    grey = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY).astype(np.float32)
    lines = cv2.remap(
        grey, *np.moveaxis(grid.astype(np.float32), 2, 0), cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
    )
    slope = np.abs(np.gradient(cv2.GaussianBlur(lines.mean(axis=1).reshape(1, -1), (0, 0), 1.0)[0]))
    slope = slope.astype(float)
    strong = 0.25 * float(np.percentile(slope, 99.5))
    found: list[tuple[float, int]] = []
    expected, number = 0.0, 0
    while expected <= length + 0.3 * pitch:
        near = (
            np.exp(-(((steps - expected) / (0.08 * pitch)) ** 2)) if found else np.abs(steps - expected) < 0.2 * pitch
        )
        peak = int(np.argmax(slope * near))
        if slope[peak] >= strong:
            flank = slice(max(0, peak - 3), peak + 4)
            weight = np.maximum(slope[flank] - 0.3 * slope[peak], 0)
            position = float((steps[flank] * weight).sum() / weight.sum())
            if found:
                step = (position - found[-1][0]) / (number - found[-1][1])
                pitch += 0.5 * (step - pitch)
            found.append((position, number))
            expected = position
        expected += pitch
        number += 1
    if len(found) < 3:
        raise InputError(f"ruler: {len(found)} marks found along the line, 3 or more are needed; check its ends")
    positions = np.array([position for position, _ in found])
    return start + positions[:, None] * along, np.array([float(n) for _, n in found])
