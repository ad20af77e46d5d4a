"""The vision library, fetched when it is first needed and kept quiet: what goes wrong is said by our own sentences."""

from __future__ import annotations

import importlib
import os
from functools import cache
from typing import Any

from stickslip.errors import InputError

MOST_PIXELS = 1 << 27
"""Of a picture, some 400 MB: a file of a hundred kilobytes may claim many times as much."""


@cache
def vision() -> Any:
    """OpenCV, imported now.

    Raises
    ------
    InputError
        where it is not installed.
    """
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")  # read once, when the first film is opened
    os.environ.setdefault("OPENCV_LOG_LEVEL", "SILENT")
    os.environ.setdefault("OPENCV_IO_MAX_IMAGE_PIXELS", str(MOST_PIXELS))  # the same, when it is imported
    try:
        cv2 = importlib.import_module("cv2")
    except ImportError:
        raise InputError(
            "films need the vision library OpenCV, which is not installed; run `pip install stickslip[video]`"
        ) from None
    # where a user imported the library first; from version 5 on it lies a room deeper
    quiet = getattr(cv2, "setLogLevel", None) or getattr(getattr(cv2.utils, "logging", None), "setLogLevel", None)
    if quiet is not None:
        quiet(0)
    return cv2
