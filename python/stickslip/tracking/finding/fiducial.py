"""Fiducials: square ArUco markers that carry their number, so that no two are ever confused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from stickslip.errors import InputError
from stickslip.tracking.finding.detections import Detections
from stickslip.tracking.finding.response_map import response_map
from stickslip.tracking.video.source import Picture
from stickslip.tracking.video.vision import vision

CORNER_ERROR = 0.1
"""Standard error of a refined corner in px, as found on drawn markers with noise; see tests/test_track_films.py."""


def find_fiducials(picture: Picture, dictionary: str, ids: tuple[int, ...] | None = None) -> Detections:
    """The ArUco markers in a picture; the label is the marker's number.

    The centre is where the diagonals cross, which is the true centre also for a marker seen at an angle.

    Parameters
    ----------
    picture : (height, width, 3) or grey, (height, width).
    dictionary : as OpenCV calls it without its prefix, for example ``"4X4_50"``.
    ids : numbers wanted; default all.
    """
    cv2 = vision()
    detector = _detector(dictionary)
    corners, found, _ = detector.detectMarkers(response_map(picture, "bright"))
    rows: list[tuple[float, ...]] = []
    for quad, marker in zip(corners, [] if found is None else np.ravel(found), strict=True):
        if ids is not None and int(marker) not in ids:
            continue
        points = quad.reshape(4, 2).astype(float)
        centre = _crossing(points)
        # half of four corners' mean: each diagonal's crossing averages its two ends
        error = CORNER_ERROR / 2
        side = math.sqrt(abs(float(cv2.contourArea(quad.reshape(4, 2)))))
        rows.append((*centre, error, error, side, math.nan, 100.0, 100.0, int(marker), 0, 0))
    return Detections.of(rows)


def check_dictionary(dictionary: str) -> None:
    """Refuse a dictionary that OpenCV does not know."""
    _detector(dictionary)


def _detector(dictionary: str) -> Any:
    cv2 = vision()
    number = getattr(cv2.aruco, f"DICT_{dictionary}", None)
    if number is None:
        known = sorted(name.removeprefix("DICT_") for name in dir(cv2.aruco) if name.startswith("DICT_"))
        raise InputError(f"setup: dictionary must be one of {', '.join(known)}, got {dictionary!r}")
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    return cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(number), parameters)


def _crossing(points: npt.NDArray[np.float64]) -> tuple[float, float]:
    a, b, c, d = points
    one, two = c - a, d - b
    share = ((b - a)[0] * two[1] - (b - a)[1] * two[0]) / (one[0] * two[1] - one[1] * two[0])
    centre = a + share * one
    return float(centre[0]), float(centre[1])
