"""Sightings to tracks: which spot of this picture is which spot of the last one."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from stickslip.tracking.sightings import Array, Sightings

REACH = 4.0
"""How far a marker may jump between two pictures, in its own diameters, where nothing else is said."""

PATIENCE = 5
"""A track seen less often than this dies when it is missed three times; longer ones wait for their marker."""


@dataclass
class Track:
    """One thing followed through a film.

    Attributes
    ----------
    frames : picture numbers where it was seen, increasing.
    places : its index in the sightings of each of them.
    score : sum of the scores of its sightings.
    """

    frames: list[int] = field(default_factory=list)
    places: list[int] = field(default_factory=list)
    score: float = 0.0
    x: float = 0.0
    y: float = 0.0
    vx: float = 0.0
    vy: float = 0.0
    flies: bool = False
    size: float = 0.0
    contrast: float = 0.0
    label: int = -1

    def add(self, frame: int, place: int, sightings: Sightings) -> None:
        """Take sighting `place` of picture `frame`."""
        x, y = float(sightings.x[place]), float(sightings.y[place])
        if self.frames:
            gap = frame - self.frames[-1]
            ahead = math.hypot(x - self.x - gap * self.vx, y - self.y - gap * self.vy)
            self.flies = ahead < math.hypot(x - self.x, y - self.y)
            self.vx, self.vy = (x - self.x) / gap, (y - self.y) / gap
        share = 1.0 if not self.frames else 0.2  # marks change slowly: light, blur, distance
        whole = not (sightings.cut_x[place] or sightings.cut_y[place])
        if whole or not self.frames:
            self.size += share * (float(sightings.size[place]) - self.size)
            self.contrast += share * (float(sightings.contrast[place]) - self.contrast)
        self.x, self.y = x, y
        self.label = int(sightings.label[place])
        self.score += float(sightings.score[place])
        self.frames.append(frame)
        self.places.append(place)


def link(film: list[Sightings], max_jump: float | None = None) -> list[Track]:
    """Follow everything that was seen through the film.

    In each picture tracks and sightings are paired so that the sum of the distances, over the reach and weighed by how
    clearly a track was seen so far, is least over all pairs at once (linear assignment). The distance is that to where
    the track would be at its last velocity, if that told its last step better than its last place did, else to its last
    place; or to the other of the two plus half the last step, so that a marker may stop dead or set off. Unlikeness adds to
    it, the more the longer a track was not seen. Pairs farther apart than `max_jump`, or unlike in size or contrast (by
    more than 2 and 2.5), or of another label, are never made: the track then waits, its reach growing by a quarter of
    `max_jump` with each missed picture up to twice. What is not paired begins a new track.

    Parameters
    ----------
    film : the sightings of each picture.
    max_jump : in px between two pictures; default 4 diameters of the marker.

    Returns
    -------
    All tracks; :func:`choose` picks the wanted ones.

    Limits: markers that look alike must not jump by more than a third of their distance from one picture to the next
    without having moved that way before.
    """
    from scipy.optimize import linear_sum_assignment

    alive: list[Track] = []
    gone: list[Track] = []
    for frame, sightings in enumerate(film):
        taken: set[int] = set()
        if alive and len(sightings):
            cost, allowed, worth = _distances(alive, sightings, frame, max_jump)
            # a column more for each track: what it costs to leave it waiting
            alone = np.where(np.eye(len(alive), dtype=bool), worth, np.inf)
            whole = np.hstack([np.where(allowed, cost, np.inf), alone])
            for row, column in zip(*linear_sum_assignment(whole), strict=True):
                if column < len(sightings):
                    alive[row].add(frame, int(column), sightings)
                    taken.add(int(column))
        for place in range(len(sightings)):
            if place not in taken:
                track = Track()
                track.add(frame, place, sightings)
                alive.append(track)
        for track in [track for track in alive if len(track.frames) < PATIENCE and frame - track.frames[-1] >= 3]:
            alive.remove(track)
            gone.append(track)
    return gone + alive


def _distances(
    tracks: list[Track], sightings: Sightings, frame: int, max_jump: float | None
) -> tuple[Array, npt.NDArray[np.bool_], Array]:
    column = {name: np.array([getattr(track, name) for track in tracks])[:, None] for name in _TRAITS}
    gap = frame - np.array([track.frames[-1] for track in tracks])[:, None]
    here = np.hypot(sightings.x - column["x"], sightings.y - column["y"])
    # after a few missed pictures the last velocity says nothing any more
    ahead = np.where(gap <= 3, gap, 0)
    there = np.hypot(sightings.x - column["x"] - ahead * column["vx"], sightings.y - column["y"] - ahead * column["vy"])
    # what flies is expected ahead, what jumps back and forth where it was; the other costs half the last step more
    step = 0.5 * ahead * np.hypot(column["vx"], column["vy"])
    cost = np.minimum(here + np.where(column["flies"], step, 0), there + np.where(column["flies"], 0, step))
    reach = (REACH * column["size"] if max_jump is None else max_jump) * np.minimum(1 + 0.25 * (gap - 1), 2.0)
    near = cost <= reach
    cut = sightings.cut_x | sightings.cut_y
    with np.errstate(divide="ignore"):
        size = np.abs(np.log(sightings.size / column["size"]))
        contrast = np.abs(np.log(sightings.contrast / column["contrast"]))
    fresh = gap <= 3  # a marker that was away for longer must prove itself: noise comes by all the time
    alike = ((size < np.log(np.where(fresh, 2.0, 1.5))) & (contrast < np.log(np.where(fresh, 2.5, 1.8)))) | (
        cut & fresh
    )
    same = (sightings.label == column["label"]) | ((sightings.label < 0) & (column["label"] < 0))
    labelled = (sightings.label >= 0) & same
    # of two candidates at one place the one that looks like before
    unlike = 2.0 * np.minimum(gap, 4) * column["size"]
    cost = cost + unlike * np.where(cut, 0.0, size + contrast)
    # in units of the reach, and of how clearly a track has been seen: a marker must not give way to passing clutter
    seen = np.array([len(track.frames) for track in tracks])[:, None]
    weight = np.array([track.score for track in tracks])[:, None] / seen * np.where(seen < PATIENCE, 0.3, 1.0)
    worth = 1.15 * weight
    allowed = (alike & same & near) | labelled
    return np.minimum(weight * cost / reach, np.where(labelled, 0.5 * worth, np.inf)), allowed, worth


_TRAITS = ("x", "y", "vx", "vy", "flies", "size", "contrast", "label")


def choose(
    tracks: list[Track],
    film: list[Sightings],
    count: int,
    *,
    start: tuple[tuple[float, float], ...] | None = None,
    moving: bool = False,
) -> list[Track]:
    """The `count` tracks that are the wanted markers.

    Those with the greatest sum of scores, that is seen longest and most clearly; with `start`, the track that passes
    nearest to each given place at its first sight; with `moving`, tracks that stay within 2 px come last. Pieces of one
    marker that was out of sight for long are joined where their likeness allows it and no other track claims them.

    Returns
    -------
    At most `count` tracks: in the order of `start`, else from left to right at first sight.
    """
    tracks = [track for track in tracks if len(track.frames) >= min(3, len(film))]

    def rank(track: Track) -> float:
        if not moving:
            return track.score
        seen = [
            (film[frame].x[place], film[frame].y[place])
            for frame, place in zip(track.frames, track.places, strict=True)
        ]
        rests = np.ptp(np.array(seen), axis=0).max() <= 2
        return track.score * (1e-6 if rests else 1.0)

    tracks.sort(key=rank, reverse=True)
    if start is None:
        chosen: list[Track] = []
        for track in tracks:
            if len(chosen) < count and not any(_same_thing(track, other, film) for other in chosen):
                chosen.append(track)
        chosen.sort(key=lambda track: float(film[track.frames[0]].x[track.places[0]]))
    else:
        chosen = []
        for x, y in start:
            left = [track for track in tracks if track not in chosen]
            if left:
                chosen.append(min(left, key=lambda track: _first_distance(track, film, x, y)))
    for track in chosen:
        for piece in tracks:
            if piece not in chosen and piece.frames and _continues(piece, track, chosen, film):
                _join(track, piece)
    return chosen


def _continues(piece: Track, track: Track, chosen: list[Track], film: list[Sightings]) -> bool:
    """Whether a piece is the same marker before or after a gap: like it, in reach and nobody else's."""
    before, after = (piece, track) if piece.frames[-1] < track.frames[0] else (track, piece)
    if before.frames[-1] >= after.frames[0] or len(piece.frames) < PATIENCE:
        return False
    if abs(math.log(piece.size / track.size)) > math.log(1.6) or abs(math.log(piece.contrast / track.contrast)) > 1:
        return False
    last, first = (
        (float(film[one.frames[at]].x[one.places[at]]), float(film[one.frames[at]].y[one.places[at]]))
        for one, at in ((before, -1), (after, 0))
    )
    if math.dist(last, first) > 3 * REACH * track.size:
        return False
    return not any(_same_thing(piece, other, film) for other in chosen if other is not track)


def _join(track: Track, piece: Track) -> None:
    order = (track, piece) if track.frames[-1] < piece.frames[0] else (piece, track)
    track.frames = order[0].frames + order[1].frames
    track.places = order[0].places + order[1].places
    for name in ("x", "y", "vx", "vy"):
        setattr(track, name, getattr(order[1], name))
    track.score += piece.score
    piece.frames, piece.places = [], []


def _first_distance(track: Track, film: list[Sightings], x: float, y: float) -> float:
    first = film[track.frames[0]]
    return math.hypot(float(first.x[track.places[0]]) - x, float(first.y[track.places[0]]) - y)


def _same_thing(one: Track, other: Track, film: list[Sightings]) -> bool:
    """Whether one is a part of the other: they are nearer to each other than half a diameter."""
    places = dict(zip(other.frames, other.places, strict=True))
    apart = [
        math.hypot(
            float(film[frame].x[place] - film[frame].x[places[frame]]),
            float(film[frame].y[place] - film[frame].y[places[frame]]),
        )
        for frame, place in zip(one.frames, one.places, strict=True)
        if frame in places
    ]
    return bool(apart) and float(np.median(apart)) < 0.5 * max(one.size, other.size)
