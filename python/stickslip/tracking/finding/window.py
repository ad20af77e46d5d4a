"""Markers in small windows around where they are expected, the whole picture only now and then."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from stickslip.tracking.finding.blobs import find_blobs, look_near
from stickslip.tracking.finding.detections import Detections, Row
from stickslip.tracking.finding.response_map import ResponseMap
from stickslip.tracking.linking import RIVAL
from stickslip.tracking.video.source import Picture

FAINT = 0.75
"""A spot of less than this share of its last score is looked for in the whole picture."""

MOST_ALTERNATIVES = 3
"""Where there are more rivals than this for every marker, whole pictures are looked at."""

KEPT = 1 << 28
"""Bytes of pictures that are kept until a whole picture shows that nothing new has come."""

LONGEST = 256
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

    row: Row
    score: float
    velocity: tuple[float, float] | None = None
    off: float = 0.0

    @property
    def ahead(self) -> tuple[float, float]:
        """Where it is expected."""
        right, down = self.velocity or (0.0, 0.0)
        return self.row.x + right, self.row.y + down

    @property
    def reach(self) -> float:
        """How far from there it may be; of what was seen once, so far that it is not taken for another."""
        return FIRST * self.row.size if self.velocity is None else SPARE + 2 * self.off

    @property
    def half(self) -> float:
        """Half the side of its window: the ground around a spot is a part of what is measured."""
        return 10 + 0.85 * self.row.size + self.reach

    def missed(self, row: Row) -> float:
        """Distance of a detection from there."""
        return math.dist(self.ahead, row[:2])

    def moved_to(self, row: Row) -> _Spot:
        return _Spot(row, self.score, (row.x - self.row.x, row.y - self.row.y), max(self.missed(row), 0.7 * self.off))


@dataclass
class WindowedFinder:
    """Detections of picture after picture, in order.

    A spot is looked for in a window around where its last velocity takes it, cut at half its contrast. The whole picture is
    looked at until all spots have a velocity. Every `LONGEST` pictures it is looked at coarsely for a rival of the markers,
    about as large as they are, that was not there; where there is one, the pictures since the last such look are looked at
    again as a whole. Where a spot is not found again as it was, they are too, and those that follow until all spots are where
    they are expected: what a lost marker may be mistaken for must be known.

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
            if picture is None:
                waiting.append((None, Detections.of([])))
                continue
            sure = self.windows and self._fit(picture, followed)
            near = self._near(picture, followed) if sure else None
            if near is not None:
                followed = near
                waiting.append((picture, Detections.of([spot.row for spot in followed])))
                if len(waiting) < min(LONGEST, KEPT // picture.nbytes):
                    continue
                if not self._newcomer(picture, followed, known):
                    yield from self._settled(waiting, False)
                    waiting, followed = [], [replace(spot, score=spot.row.score) for spot in followed]
                    continue
                waiting.pop()
            # what a marker may be mistaken for where it is lost shows in whole pictures only
            lost = sure and near is None
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

    def _newcomer(self, picture: Picture, followed: list[_Spot], known: Detections) -> bool:
        """Whether a coarse look at a picture shows a rival that is neither followed nor was there."""
        size = float(np.median([spot.row.size for spot in followed]))
        least = RIVAL * min(spot.row.score for spot in followed)
        found = self._look(picture, self.size or size, max(self.threshold or 0.0, least / (2 * size) ** 0.25))
        return any(
            row.score >= least
            and min(math.dist(row[:2], spot.row[:2]) for spot in followed) > size / 2
            and not (np.hypot(known.x - row.x, known.y - row.y) < size / 2).any()
            for row in found.rows()
        )

    def _look(self, picture: Picture, size: float | None = None, threshold: float | None = None) -> Detections:
        return find_blobs(
            self.response(picture),
            size=size or self.size,
            threshold=threshold or self.threshold,
            level=self.level,
            opening=self.opening,
            black=self.black,
        )

    def _alternatives(self, found: Detections, before: list[_Spot], known: Detections) -> tuple[list[_Spot], bool]:
        """What is followed from here on, and whether a rival is among it that the last whole picture did not show."""
        if len(found) < self.count:
            return [], False
        spots, new = [], False
        for row in found.take(np.flatnonzero(found.score >= RIVAL * np.sort(found.score)[-self.count])).rows():
            spot = _Spot(row, row.score)
            near = row.size / 2
            last = min(before, key=lambda one: one.missed(row), default=None)
            if last is not None and last.missed(row) < max(last.reach, near):
                spot = replace(last.moved_to(row), score=spot.score)
            else:
                new |= not (np.hypot(known.x - row.x, known.y - row.y) < near).any()
            if not (row.cut_x or row.cut_y):
                spots.append(spot)
        return spots if self.count <= len(spots) <= self.count * (1 + MOST_ALTERNATIVES) else [], new

    def _fit(self, picture: Picture, followed: list[_Spot]) -> bool:
        """Whether spots are followed, all with a velocity, in windows that are together smaller than the picture."""
        known = bool(followed) and all(spot.velocity is not None for spot in followed)
        return known and sum((2 * spot.half) ** 2 for spot in followed) <= picture.shape[0] * picture.shape[1]

    def _near(self, picture: Picture, followed: list[_Spot]) -> list[_Spot] | None:
        """The followed spots in this picture; None where one of them is not found as it was, or two are one."""
        found = []
        for spot in followed:
            (x, y), half = spot.ahead, spot.half
            left, top = max(round(x - half), 0), max(round(y - half), 0)
            window = picture[top : round(y + half) + 1, left : round(x + half) + 1]
            if min(window.shape[:2]) < spot.row.size:
                return None
            row = look_near(
                self.response(window),
                spot.row,
                (x - left, y - top),
                size=self.size,
                level=self.level,
                opening=self.opening,
                black=self.black,
            )
            if row is None or row.score < FAINT * spot.score:
                return None
            found.append(spot.moved_to(row.moved(left, top)))
        # of two that pass each other both windows may show the same one
        twice = any(math.dist(one.row[:2], other.row[:2]) < one.row.size / 2 for one, other in combinations(found, 2))
        return None if twice else found
