"""Detections to tracks: which spot of this picture is which spot of the last one."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from stickslip.tracking.finding.detections import Array, Detections

SURE = 2.0
"""What is measured on the clearest tracks may be exceeded by this factor."""

WHOLE = 0.995
"""Of two reaches that keep the markers in sight equally well, to this share, the shorter is taken."""

CLEAR = 1.3
"""A marker has a score so many times that of the best other spot; belt texture is like itself to a tenth."""

RIVAL = 1 / CLEAR
"""What has this share of the score of a marker may be taken for it."""

RESTS = 0.1
"""What moves by less than this share of another spot's motion rests beside it."""

PATIENCE = 5
"""A track seen less often than this dies when it is missed three times; longer ones wait for their marker."""


@dataclass
class Track:
    """One thing followed through a film.

    Attributes
    ----------
    frames : picture numbers where it was seen, increasing.
    indices : its index in the detections of each of them.
    score : sum of the scores of its detections.
    at_rest : spots that look like it and rest, beside which it was chosen because it moves.
    """

    frames: list[int] = field(default_factory=list)
    indices: list[int] = field(default_factory=list)
    score: float = 0.0
    x: float = 0.0
    y: float = 0.0
    vx: float = 0.0
    vy: float = 0.0
    flies: bool = False
    size: float = 0.0
    contrast: float = 0.0
    label: int = -1
    at_rest: list[Track] = field(default_factory=list)

    @property
    def rank(self) -> float:
        """Its score, or that of a clearer spot that rests."""
        return max(track.score for track in (self, *self.at_rest))

    def add(self, frame: int, index: int, detections: Detections) -> None:
        """Take detection `place` of picture `frame`."""
        x, y = float(detections.x[index]), float(detections.y[index])
        if self.frames:
            gap = frame - self.frames[-1]
            ahead = math.hypot(x - self.x - gap * self.vx, y - self.y - gap * self.vy)
            self.flies = ahead < math.hypot(x - self.x, y - self.y)
            self.vx, self.vy = (x - self.x) / gap, (y - self.y) / gap
        share = 1.0 if not self.frames else 0.2  # marks change slowly: light, blur, distance
        whole = not (detections.cut_x[index] or detections.cut_y[index])
        if whole or not self.frames:
            self.size += share * (float(detections.size[index]) - self.size)
            self.contrast += share * (float(detections.contrast[index]) - self.contrast)
        self.x, self.y = x, y
        self.label = int(detections.label[index])
        self.score += float(detections.score[index])
        self.frames.append(frame)
        self.indices.append(index)


@dataclass(frozen=True)
class Limits:
    """How the markers of one film behave from picture to picture, as far as is known.

    Attributes
    ----------
    reach : how far a marker may be from where it is expected, in px.
    size, contrast : by how much the logarithms of its size and contrast may differ from what they were.
    """

    reach: float
    size: float = math.log(2.0)
    contrast: float = math.log(2.5)

    @classmethod
    def of(cls, tracks: list[Track], film: list[Detections], reach: float) -> Limits:
        """Those of these tracks: what they did in all but one step of a hundred, and as much again.

        `reach` is the one with which they were followed.
        """
        rows = []
        for track in tracks:
            walker = Track()
            for frame, index in zip(track.frames, track.indices, strict=True):
                seen = film[frame]
                if walker.frames and not (seen.cut_x[index] or seen.cut_y[index]):
                    rows.append(
                        (
                            abs(math.log(seen.size[index] / walker.size)),
                            abs(math.log(seen.contrast[index] / walker.contrast)),
                        )
                    )
                walker.add(frame, index, seen)
        if len(rows) < 10:
            return cls(reach)
        found = 0.15 + SURE * np.percentile(np.array(rows), 99, axis=0)
        return cls(reach, *(min(float(one), most) for one, most in zip(found, (cls.size, cls.contrast), strict=True)))


def find_markers(
    film: list[Detections],
    count: int,
    *,
    max_jump: float | None = None,
    start: tuple[tuple[float, float], ...] | None = None,
    moving: bool = False,
    resting: int = 0,
) -> list[Track]:
    """The tracks of `count` markers, with reach and similarity measured on the film itself.

    The film is followed with reaches from two diameters to the whole field in which anything is seen; the shortest that
    keeps the markers in sight as well as any is taken, and the film followed once more with the similarity that the markers
    then kept (:class:`Limits`).

    Parameters
    ----------
    film : the detections of each picture.
    count, start, moving, resting : as for :func:`choose`.
    max_jump : the reach in px, where it is known.

    Returns
    -------
    At most `count` tracks, in the order of :func:`choose`.

    Limits: markers that look alike must not jump by more than a third of their distance from one picture to the next
    without having moved that way before; of markers that cross while one of them is hidden the identities are a guess.
    """

    def markers(limits: Limits) -> list[Track]:
        return choose(link(film, limits), film, count, start=start, moving=moving, resting=resting)

    if max_jump is not None:
        return markers(Limits(max_jump))
    # no tracks can score higher than the best detections of every picture: a reach that does is not beaten by longer ones
    most = sum(float(np.sort(detections.score)[-count:].sum()) for detections in film)
    tried = []
    for reach in _reaches(film):
        tried.append((reach, markers(Limits(reach))))
        if start is None and not moving and sum(track.rank for track in tried[-1][1]) >= WHOLE * most:
            break
    scores = [sum(track.rank for track in tracks) for _, tracks in tried]
    for (reach, tracks), score in zip(tried, scores, strict=True):
        if score >= WHOLE * max(scores):
            return markers(Limits.of(tracks, film, reach))
    return []


def _reaches(film: list[Detections]) -> list[float]:
    """From two diameters of what is seen to the whole field in which anything is seen."""
    seen = [detections for detections in film if len(detections)]
    if not seen:
        return []
    indices = np.concatenate([np.stack([detections.x, detections.y], axis=1) for detections in seen])
    first = 2 * float(np.median(np.concatenate([detections.size for detections in seen])))
    last = max(first, float(np.hypot(*np.ptp(indices, axis=0))))
    return list(np.geomspace(first, last, 1 + math.ceil(math.log(last / first, 1.6))))


def link(film: list[Detections], limits: Limits) -> list[Track]:
    """Follow everything that was seen through the film.

    In each picture tracks and detections are paired so that the sum of the distances, over the reach and weighed by how
    clearly a track was seen so far, is least over all pairs at once (linear assignment). The distance is that to where
    the track would be at its last velocity, if that told its last step better than its last place did, else to its last
    place; or to the other of the two plus half the last step, so that a marker may stop or start. Dissimilarity adds to
    it, the more the longer a track was not seen. Pairs farther apart than the reach, or more unlike in size or contrast
    than the limits say, or of another label, are never made: the track then waits, its reach growing by a quarter with
    each missed picture up to twice. What is not paired begins a new track.

    Returns
    -------
    All tracks; :func:`choose` picks the wanted ones.
    """
    from scipy.optimize import linear_sum_assignment

    alive: list[Track] = []
    gone: list[Track] = []
    for frame, detections in enumerate(film):
        taken: set[int] = set()
        if alive and len(detections):
            cost, allowed, gain = _distances(alive, detections, frame, limits)
            # a column more for each track: what it costs to leave it waiting
            alone = np.where(np.eye(len(alive), dtype=bool), gain, np.inf)
            whole = np.hstack([np.where(allowed, cost, np.inf), alone])
            for row, column in zip(*linear_sum_assignment(whole), strict=True):
                if column < len(detections):
                    alive[row].add(frame, int(column), detections)
                    taken.add(int(column))
        for index in range(len(detections)):
            if index not in taken:
                track = Track()
                track.add(frame, index, detections)
                alive.append(track)
        for track in [track for track in alive if len(track.frames) < PATIENCE and frame - track.frames[-1] >= 3]:
            alive.remove(track)
            gone.append(track)
    return gone + alive


def _distances(
    tracks: list[Track], detections: Detections, frame: int, limits: Limits
) -> tuple[Array, npt.NDArray[np.bool_], Array]:
    column = {name: np.array([getattr(track, name) for track in tracks])[:, None] for name in _TRAITS}
    gap = frame - np.array([track.frames[-1] for track in tracks])[:, None]
    here = np.hypot(detections.x - column["x"], detections.y - column["y"])
    # after a few missed pictures the last velocity says nothing any more
    ahead = np.where(gap <= 3, gap, 0)
    there = np.hypot(
        detections.x - column["x"] - ahead * column["vx"], detections.y - column["y"] - ahead * column["vy"]
    )
    # what flies is expected ahead, what jumps back and forth where it was; the other costs half the last step more
    step = 0.5 * ahead * np.hypot(column["vx"], column["vy"])
    cost = np.minimum(here + np.where(column["flies"], step, 0), there + np.where(column["flies"], 0, step))
    reach = limits.reach * np.minimum(1 + 0.25 * (gap - 1), 2.0)
    near = cost <= reach
    cut = detections.cut_x | detections.cut_y
    with np.errstate(divide="ignore"):
        size = np.abs(np.log(detections.size / column["size"]))
        contrast = np.abs(np.log(detections.contrast / column["contrast"]))
    fresh = gap <= 3  # a marker that was away for longer must prove itself: noise comes by all the time
    patience = np.where(fresh, 1.0, 0.6)
    alike = ((size < patience * limits.size) & (contrast < patience * limits.contrast)) | (cut & fresh)
    same = (detections.label == column["label"]) | ((detections.label < 0) & (column["label"] < 0))
    labelled = (detections.label >= 0) & same
    # of two candidates at one place the one that looks like before
    unlike = 2.0 * np.minimum(gap, 4) * column["size"]
    cost = cost + unlike * np.where(cut, 0.0, size + contrast)
    # in units of the reach, and of how clearly a track has been seen: a marker must not give way to passing clutter
    seen = np.array([len(track.frames) for track in tracks])[:, None]
    weight = np.array([track.score for track in tracks])[:, None] / seen * np.where(seen < PATIENCE, 0.3, 1.0)
    gain = 1.15 * weight
    allowed = (alike & same & near) | labelled
    return np.minimum(weight * cost / reach, np.where(labelled, 0.5 * gain, np.inf)), allowed, gain


_TRAITS = ("x", "y", "vx", "vy", "flies", "size", "contrast", "label")


def choose(
    tracks: list[Track],
    film: list[Detections],
    count: int,
    *,
    start: tuple[tuple[float, float], ...] | None = None,
    moving: bool = False,
    resting: int = 0,
) -> list[Track]:
    """The `count` tracks that are the wanted markers.

    Those with the greatest sum of scores, that is seen longest and most clearly, but one that moves rather than one as clear
    that rests, as long as `resting` of them may rest; with `start`, the track that passes
    nearest to each given place at its first sight; with `moving`, scores count times the way they went. Pieces of one
    marker that was out of sight for long are joined where their similarity allows it and no other track claims them.

    Returns
    -------
    At most `count` tracks: in the order of `start`, else from left to right at first sight.
    """
    tracks = [track for track in tracks if len(track.frames) >= min(3, len(film))]

    def rank(track: Track) -> float:
        return track.score * (_travel(track, film) if moving else 1.0)

    tracks.sort(key=rank, reverse=True)
    if start is None:
        chosen: list[Track] = []
        for track in tracks:
            if len(chosen) < count and not any(_same_thing(track, other, film) for other in chosen):
                chosen.append(track)
        if not moving:
            _prefer_moving(chosen, tracks, film, resting)
        chosen.sort(key=lambda track: float(film[track.frames[0]].x[track.indices[0]]))
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


def _prefer_moving(chosen: list[Track], tracks: list[Track], film: list[Detections], resting: int) -> None:
    """Take tracks that move for chosen ones that rest and look hardly more like a marker, down to `resting` of these."""
    left = [track for track in tracks if track not in chosen and track.score >= RIVAL * chosen[-1].score]
    left = [track for track in left if not any(_same_thing(track, other, film) for other in chosen)]
    if not left:
        return
    travel = {id(track): _travel(track, film) for track in [*chosen, *left]}

    def rests_beside(track: Track, other: Track) -> bool:
        return travel[id(track)] < RESTS * travel[id(other)] and other.score >= RIVAL * track.score

    for other in [*left]:
        still = [index for index, track in enumerate(chosen) if rests_beside(track, other)]
        if len(still) > resting:
            left[left.index(other)], chosen[still[-1]] = chosen[still[-1]], other
    for track in chosen:
        track.at_rest = [other for other in left if rests_beside(other, track)]


def _travel(track: Track, film: list[Detections]) -> float:
    """How far apart its places lie, in px; of a coordinate that an edge cuts off nothing is known."""
    rows = [(film[frame], index) for frame, index in zip(track.frames, track.indices, strict=True)]
    spans = []
    for axis in "xy":
        whole = [getattr(seen, axis)[index] for seen, index in rows if not getattr(seen, f"cut_{axis}")[index]]
        spans.append(float(np.ptp(np.percentile(whole, [5, 95]))) if whole else 0.0)
    return math.hypot(*spans)


def _continues(piece: Track, track: Track, chosen: list[Track], film: list[Detections]) -> bool:
    """Whether a piece is the same marker before or after a gap: like it, in reach and nobody else's."""
    before, after = (piece, track) if piece.frames[-1] < track.frames[0] else (track, piece)
    if before.frames[-1] >= after.frames[0] or len(piece.frames) < PATIENCE:
        return False
    if abs(math.log(piece.size / track.size)) > math.log(1.6) or abs(math.log(piece.contrast / track.contrast)) > 1:
        return False
    last, first = (
        (float(film[one.frames[at]].x[one.indices[at]]), float(film[one.frames[at]].y[one.indices[at]]))
        for one, at in ((before, -1), (after, 0))
    )
    if math.dist(last, first) > 12 * track.size + _travel(track, film):
        return False
    return not any(_same_thing(piece, other, film) for other in chosen if other is not track)


def _join(track: Track, piece: Track) -> None:
    order = (track, piece) if track.frames[-1] < piece.frames[0] else (piece, track)
    track.frames = order[0].frames + order[1].frames
    track.indices = order[0].indices + order[1].indices
    for name in ("x", "y", "vx", "vy"):
        setattr(track, name, getattr(order[1], name))
    track.score += piece.score
    piece.frames, piece.indices = [], []


def _first_distance(track: Track, film: list[Detections], x: float, y: float) -> float:
    first = film[track.frames[0]]
    return math.hypot(float(first.x[track.indices[0]]) - x, float(first.y[track.indices[0]]) - y)


def _same_thing(one: Track, other: Track, film: list[Detections]) -> bool:
    """Whether one is a part of the other: they are nearer to each other than half a diameter."""
    indices = dict(zip(other.frames, other.indices, strict=True))
    apart = [
        math.hypot(
            float(film[frame].x[index] - film[frame].x[indices[frame]]),
            float(film[frame].y[index] - film[frame].y[indices[frame]]),
        )
        for frame, index in zip(one.frames, one.indices, strict=True)
        if frame in indices
    ]
    return bool(apart) and float(np.median(apart)) < 0.5 * max(one.size, other.size)
