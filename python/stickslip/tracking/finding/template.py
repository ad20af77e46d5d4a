"""Templates: pieces of the first picture found again by correlation, then fitted to a fraction of a pixel."""

from __future__ import annotations

import math

from stickslip.tracking.finding.detections import Detections
from stickslip.tracking.finding.response_map import ResponseMap
from stickslip.tracking.finding.subset import Subset
from stickslip.tracking.video.vision import vision

LEAST_ERROR = 0.002
"""Of a place in px: what quintic splines leave of the fraction of a pixel."""

LEAST_CORRELATION = 0.6
"""Below this a place does not look like the template."""


def find_templates(picture: ResponseMap, templates: list[Subset]) -> Detections:
    """Places that look like one of the templates; the label says which.

    Each template is correlated with the whole picture (normalised, mean removed); its highest peaks are refined by
    :class:`stickslip.tracking.finding.subset.Subset`, which also gives the standard errors.

    Parameters
    ----------
    picture : (height, width) grey.
    templates : the pieces; the centre of a piece is the place that is given back.

    Returns
    -------
    Detections; contrast is 100 times the correlation, size the side of a square of the piece's area.

    Limits: no rotation or change of size beyond a few per cent; texture in both directions is needed.
    """
    cv2 = vision()
    rows: list[tuple[float, ...]] = []
    for label, subset in enumerate(templates):
        piece = subset.piece
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
            fit = subset.find(picture, column + (wide - 1) / 2, row + (high - 1) / 2)
            if fit is None:
                continue
            errors = (max(error, LEAST_ERROR) for error in (fit.x_error, fit.y_error))
            rows.append(
                (fit.x, fit.y, *errors, math.sqrt(high * wide), math.nan, 100 * best, 100 * best**2, label, 0, 0)
            )
    return Detections.of(rows)
