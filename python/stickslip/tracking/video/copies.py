"""Pictures that a film holds more than once, as one that was converted to a higher rate does."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from stickslip.tracking.video.source import Picture
from stickslip.tracking.video.vision import vision

NEAR = 0.1
"""A copy differs from the picture before by less than this share of what new pictures differ by: a coder may change it."""

LONGEST = 8
"""Times that one picture is looked for; beyond lie the whole pictures that a coder puts between differences."""

FEWEST = 8
"""New pictures that must be seen."""

REGULAR = 0.95
"""Share of new pictures that come after a multiple of the usual number, as where nothing moves one is like a copy."""

USUAL = 0.8
"""Share of them that come after that number itself."""


class Changes:
    """How much each picture of a film differs from the one before: the mean over the grey levels."""

    def __init__(self) -> None:
        self.values: list[float] = []
        self._last: Picture | None = None

    def look(self, picture: Picture | None) -> None:
        """Take in the next picture, None where it cannot be read."""
        change = math.nan
        if picture is not None and self._last is not None:
            cv2 = vision()
            change = cv2.norm(picture, self._last, cv2.NORM_L1) / max(1, picture.size)
        self.values.append(float(change))
        self._last = picture


def copies(changes: list[float]) -> tuple[int, npt.NDArray[np.bool_]]:
    """How many times each picture stands in a film, and which of its pictures are copies.

    Parameters
    ----------
    changes : of each picture from the one before, the first NaN.

    Returns
    -------
    1 and none where there is no such number.

    >>> copies([math.nan, 0.0, *[4.0, 0.0] * 9])[0], copies([math.nan, 2.0, 0.0, 1.0, 3.0] * 4)[0]
    (2, 1)
    """
    change = np.array(changes)
    none = 1, np.zeros(len(change), dtype=bool)
    seen = change[np.isfinite(change)]
    if not seen.size:
        return none
    # of the pictures in a row at least one in LONGEST is new
    usual = float(np.quantile(seen, 1 - 0.5 / LONGEST))
    new = np.flatnonzero(~(change <= NEAR * usual))
    gaps = np.diff(new)
    if usual == 0 or len(gaps) < FEWEST:
        return none
    times = int(np.argmax(np.bincount(gaps)))
    if not 1 < times <= LONGEST or np.mean(gaps == times) < USUAL or np.mean(gaps % times == 0) < REGULAR:
        return none
    copied = np.zeros(len(change), dtype=bool)
    last = 0
    for i in range(1, len(change)):
        # one that comes when a new one is due is new, and nothing moved
        copied[i] = change[i] <= NEAR * usual and i - last < times
        last = last if copied[i] else i
    return times, copied


def note_on_copies(shown: int, rate: float) -> str:
    """What a track says of copies, by how often each picture is shown and how many new ones there are per second."""
    return (
        f"{shown - 1} of {shown} pictures are copies of the one before, which are no samples, and were left "
        f"out: the camera took {rate:.4g} pictures per second, not {rate * shown:.4g}."
    )
