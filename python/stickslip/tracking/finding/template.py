"""Templates: pieces of the first picture found again by correlation, then fitted to a fraction of a pixel."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from stickslip.tracking.finding.detections import Detections
from stickslip.tracking.video.vision import vision

Grey = npt.NDArray[np.float32]

LEAST_CORRELATION = 0.6
"""Below this a place does not look like the template."""


def find_templates(picture: Grey, templates: list[Grey]) -> Detections:
    """Places that look like one of the templates; the label says which.

    Each template is correlated with the whole picture (normalised, mean removed); its highest peaks are refined by
    Gauss-Newton on Σ [I(p + d) − a T(p) − b]² over shift d, gain a and offset b, which also gives the standard error of d
    from what is left over.

    Parameters
    ----------
    picture : (height, width) grey.
    templates : (h, w) pieces; the centre of a piece is the place that is given back.

    Returns
    -------
    Detections; contrast is 100 times the correlation, size the side of a square of the piece's area.

    Limits: no rotation or change of size beyond a few per cent; texture in both directions is needed.
    """
    cv2 = vision()
    rows: list[tuple[float, ...]] = []
    for label, piece in enumerate(templates):
        high, wide = piece.shape
        if high > picture.shape[0] or wide > picture.shape[1]:
            continue
        response = cv2.matchTemplate(picture, piece, cv2.TM_CCOEFF_NORMED)
        for _ in range(4):
            _, best, _, (column, row) = cv2.minMaxLoc(response)
            if best < LEAST_CORRELATION:
                break
            top, left = max(0, row - high // 2), max(0, column - wide // 2)
            response[top : row + high // 2 + 1, left : column + wide // 2 + 1] = -1
            fit = _refine(cv2, picture, piece, float(column), float(row))
            if fit is None:
                continue
            x, y, x_error, y_error = fit
            size = math.sqrt(high * wide)
            place = (x + (wide - 1) / 2, y + (high - 1) / 2)
            rows.append((*place, x_error, y_error, size, 100 * best, 100 * best**2, label, 0, 0))
    return Detections.of(rows)


def _refine(cv2: Any, picture: Grey, piece: Grey, x: float, y: float) -> tuple[float, float, float, float] | None:
    high, wide = piece.shape
    columns, rows = np.meshgrid(np.arange(wide, dtype=np.float32), np.arange(high, dtype=np.float32))
    down, right = np.gradient(piece.astype(float))
    ones = np.ones(piece.size)
    design = np.stack([right.ravel(), down.ravel(), piece.ravel().astype(float), ones], axis=1)
    normal = design.T @ design
    if np.linalg.cond(normal) > 1e14:
        return None
    inverse = np.linalg.inv(normal)
    start = x, y
    for _ in range(20):
        here = cv2.remap(picture, columns + np.float32(x), rows + np.float32(y), cv2.INTER_CUBIC)
        solution = inverse @ (design.T @ here.ravel().astype(float))
        gain = solution[2]
        if gain <= 0.1:
            return None
        dx, dy = solution[0] / gain, solution[1] / gain
        x, y = x - dx, y - dy
        if math.hypot(dx, dy) < 1e-3:
            break
    if math.hypot(x - start[0], y - start[1]) > 2:
        return None
    left_over = here.ravel() - design @ solution
    noise = math.sqrt(float((left_over**2).sum()) / max(1, piece.size - 4)) / gain
    errors = noise * np.sqrt(np.diag(inverse)[:2])
    return x, y, max(float(errors[0]), 0.005), max(float(errors[1]), 0.005)
