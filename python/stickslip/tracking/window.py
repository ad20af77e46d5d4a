"""Markers in small windows around where they are expected, the whole picture only now and then."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from stickslip.tracking.finding.blobs import find_blobs, look_near
from stickslip.tracking.finding.detections import Detections
from stickslip.tracking.finding.response_map import ResponseMap
from stickslip.tracking.linking import RIVAL
from stickslip.tracking.video.source import Picture

FAINT = 0.75
"""A spot of less than this share of its last score is looked for in the whole picture."""

MOST_ALTERNATIVES = 3
"""Where there are more rivals than this for every marker, whole pictures are looked at."""

KEPT = 1 << 26
"""Bytes of pictures that are kept until a whole picture shows that nothing new has come."""

LONGEST = 64
"""Pictures at most from one whole picture to the next."""

SPARE = 6.0
"""What a spot may be off where it is expected, in px."""

FIRST = 2.5
"""Diameters that a spot which was seen once may have moved."""


@dataclass
class _Spot:
    """One followed spot.

    Its last row; its score in the last whole picture; its velocity, None where it was seen once, and how far off that
    predicted it.
    """

    row: Detections
    score: float
    velocity: tuple[float, float] | None = None
    off: float = 0.0

    @property
    def ahead(self) -> tuple[float, float]:
        """Where it is expected."""
        right, down = self.velocity or (0.0, 0.0)
        return float(self.row.x[0]) + right, float(self.row.y[0]) + down

    @property
    def reach(self) -> float:
        """How far from there it may be; of what was seen once, so far that it is not taken for another."""
        return FIRST * float(self.row.size[0]) if self.velocity is None else SPARE + 2 * self.off

    @property
    def half(self) -> float:
        """Half the side of its window: the ground around a spot is a part of what is measured."""
        return 10 + 0.85 * float(self.row.size[0]) + self.reach

    def missed(self, row: Detections) -> float:
        """Distance of a detection from there."""
        return math.dist(self.ahead, (float(row.x[0]), float(row.y[0])))

    def moved_to(self, row: Detections) -> _Spot:
        dx, dy = float(row.x[0] - self.row.x[0]), float(row.y[0] - self.row.y[0])
        return _Spot(row, self.score, (dx, dy), max(self.missed(row), 0.7 * self.off))


@dataclass
class Watch:
    """Detections of picture after picture, in order.

    A spot is looked for in a window around where its last velocity takes it, cut at half its contrast. The whole picture is
    looked at until all spots have a velocity, and every `LONGEST` pictures. Where that shows a rival of the markers that was
    not there, the pictures since the last whole one are looked at again as a whole. Where a spot is not found again as it
    was, they are too, and those that follow until all spots are where they are expected: what a lost marker may be mistaken
    for must be known.

    Parameters
    ----------
    response : from a picture to its response map.
    count : markers that are wanted.
    size, threshold, level, opening, black : as for :func:`stickslip.tracking.finding.blobs.find_blobs`.
    windows : False: look at whole pictures only.
    """

    response: Callable[[Picture], ResponseMap]
    count: int
    size: float | None = None
    threshold: float | None = None
    level: float | None = None
    opening: int = 0
    black: float | None = None
    windows: bool = True

    def __call__(self, pictures: Iterator[Picture | None]) -> Iterator[tuple[Detections, bool]]:
        """Detections of each picture, none of one that cannot be read, and whether all of it was looked at."""
        followed: list[_Spot] = []
        known = Detections.of([])
        waiting: list[tuple[Picture | None, Detections]] = []
        for picture in pictures:
            due = picture is not None and (
                len(waiting) >= min(LONGEST, KEPT // picture.nbytes)
                or any(spot.velocity is None for spot in followed)
                or sum((2 * spot.half) ** 2 for spot in followed) > picture[..., 0].size
            )
            near = self._near(picture, followed) if picture is not None and self.windows and not due else None
            if near is not None and picture is not None:
                followed = near
                rows = Detections.joined([spot.row for spot in followed])
                waiting.append((picture, rows))
                continue
            if picture is None:
                waiting.append((None, Detections.of([])))
                continue
            # what a marker may be mistaken for where it is lost shows in whole pictures only
            lost = self.windows and bool(followed) and not due
            found = self._look(picture)
            followed, new = self._alternatives(found, followed, known)
            yield from self._settled(waiting, new or lost)
            known, waiting = found, []
            yield found, True
        yield from self._settled(waiting, False)

    def _settled(
        self, waiting: list[tuple[Picture | None, Detections]], again: bool
    ) -> Iterator[tuple[Detections, bool]]:
        for picture, found in waiting:
            yield (self._look(picture), True) if again and picture is not None else (found, picture is None)

    def _look(self, picture: Picture) -> Detections:
        return find_blobs(
            self.response(picture),
            size=self.size,
            threshold=self.threshold,
            level=self.level,
            opening=self.opening,
            black=self.black,
        )

    def _alternatives(self, found: Detections, before: list[_Spot], known: Detections) -> tuple[list[_Spot], bool]:
        """What is followed from here on, and whether a rival is among it that the last whole picture did not show."""
        if len(found) < self.count:
            return [], False
        spots, new = [], False
        for i in np.flatnonzero(found.score >= RIVAL * np.sort(found.score)[-self.count]):
            row = found.take(np.array([i]))
            spot = _Spot(row, float(row.score[0]))
            near = float(row.size[0]) / 2
            last = min(before, key=lambda one: one.missed(row), default=None)
            if last is not None and last.missed(row) < max(last.reach, near):
                spot = replace(last.moved_to(row), score=spot.score)
            else:
                new |= not (np.hypot(known.x - row.x, known.y - row.y) < near).any()
            if not (row.cut_x[0] or row.cut_y[0]):
                spots.append(spot)
        return spots if self.count <= len(spots) <= self.count * (1 + MOST_ALTERNATIVES) else [], new

    def _near(self, picture: Picture, followed: list[_Spot]) -> list[_Spot] | None:
        """The followed spots in this picture; None where one of them is not found as it was, or none is followed."""
        found = []
        for spot in followed:
            x, y = spot.ahead
            size = float(spot.row.size[0])
            left, top = max(round(x - spot.half), 0), max(round(y - spot.half), 0)
            window = picture[top : round(y + spot.half) + 1, left : round(x + spot.half) + 1]
            if min(window.shape[:2]) < size:
                return None
            row = look_near(
                self.response(window),
                spot.row,
                (x - left, y - top),
                size=self.size,
                level=self.level,
                opening=self.opening,
                black=self.black,
            ).moved(left, top)
            if not len(row) or row.score[0] < FAINT * spot.score:
                return None
            found.append(spot.moved_to(row))
        return found or None
