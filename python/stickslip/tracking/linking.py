"""Detections to tracks: which spot of this picture is which spot of the last one."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from stickslip.files.arrays import Array, Indices
from stickslip.tracking.finding.detections import Detections, Row

Rows = list[list[Row]]
"""The detections of each picture."""

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

FRESH = 3
"""Pictures after which a track that was missed is not expected ahead any more, and must prove itself."""

PATIENCE = 5
"""A track seen less often than this dies when it is missed three times; longer ones wait for their marker."""


@dataclass(eq=False)
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
    _way: Array = field(default_factory=lambda: np.empty((0, 2)))

    @property
    def rank(self) -> float:
        """Its score, or that of a clearer spot that rests."""
        return max(track.score for track in (self, *self.at_rest))

    def add(self, frame: int, index: int, row: Row) -> None:
        """Take a row, number `index` of picture `frame`."""
        if self.frames:
            gap = frame - self.frames[-1]
            ahead = math.hypot(row.x - self.x - gap * self.vx, row.y - self.y - gap * self.vy)
            self.flies = ahead < math.hypot(row.x - self.x, row.y - self.y)
            self.vx, self.vy = (row.x - self.x) / gap, (row.y - self.y) / gap
        share = 1.0 if not self.frames else 0.2  # marks change slowly: light, blur, distance
        if not (row.cut_x or row.cut_y) or not self.frames:
            self.size += share * (row.size - self.size)
            self.contrast += share * (row.contrast - self.contrast)
        self.x, self.y = row.x, row.y
        self.label = row.label
        self.score += row.score
        self.frames.append(frame)
        self.indices.append(index)

    def rows(self, film: Rows) -> list[Row]:
        """Where it was seen."""
        return [film[frame][index] for frame, index in zip(self.frames, self.indices, strict=True)]

    def way(self, film: Rows) -> Array:
        """The places where it was seen, (n, 2); kept, as every track is laid beside every other."""
        if len(self._way) != len(self.frames):
            self._way = np.array([row[:2] for row in self.rows(film)]).reshape(-1, 2)
        return self._way


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
    def of(cls, tracks: list[Track], film: Rows, reach: float) -> Limits:
        """Those of these tracks: what they did in all but one step of a hundred, and as much again.

        `reach` is the one with which they were followed.
        """
        rows = []
        for track in tracks:
            walker = Track()
            for frame, index, seen in zip(track.frames, track.indices, track.rows(film), strict=True):
                if walker.frames and not (seen.cut_x or seen.cut_y):
                    rows.append((seen.size, walker.size, seen.contrast, walker.contrast))
                walker.add(frame, index, seen)
        if len(rows) < 10:
            return cls(reach)
        size, its, contrast, of_it = np.array(rows).T
        found = 0.15 + SURE * np.percentile([_apart(size, its), _apart(contrast, of_it)], 99, axis=1)
        return cls(reach, *(min(float(one), most) for one, most in zip(found, (cls.size, cls.contrast), strict=True)))


def _apart(one: npt.ArrayLike, other: npt.ArrayLike) -> Array:
    """Distance of two logarithms; inf where a number is not positive."""
    one, other = np.broadcast_arrays(np.asarray(one, float), np.asarray(other, float))
    ratio = np.divide(one, other, out=np.full(one.shape, math.inf), where=(one > 0) & (other > 0))
    return np.asarray(np.abs(np.log(ratio)))


def find_markers(
    pictures: list[Detections],
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
    pictures : the detections of each picture.
    count, start, moving, resting : as for :func:`choose`.
    max_jump : the reach in px, where it is known.

    Returns
    -------
    At most `count` tracks, in the order of :func:`choose`.

    Limits: markers that look alike must not jump by more than a third of their distance from one picture to the next
    without having moved that way before; which is which after two meet is told in ``positions/meetings.py``.
    """
    film = [detections.rows() for detections in pictures]

    def markers(limits: Limits) -> list[Track]:
        return choose(link(film, limits), film, count, start=start, moving=moving, resting=resting)

    if max_jump is not None:
        return markers(Limits(max_jump))
    # no tracks can score higher than the best detections of every picture: a reach that does is not beaten by longer ones
    most = sum(float(np.sort(detections.score)[-count:].sum()) for detections in pictures)
    tried = []
    for reach in _reaches(pictures):
        tried.append((reach, markers(Limits(reach))))
        if start is None and not moving and sum(track.rank for track in tried[-1][1]) >= WHOLE * most:
            break
    scores = [sum(track.rank for track in tracks) for _, tracks in tried]
    for (reach, tracks), score in zip(tried, scores, strict=True):
        if score >= WHOLE * max(scores):
            return markers(Limits.of(tracks, film, reach))
    return []


def _reaches(pictures: list[Detections]) -> list[float]:
    """From two diameters of what is seen to the whole field in which anything is seen."""
    seen = [detections for detections in pictures if len(detections)]
    if not seen:
        return []
    indices = np.concatenate([np.stack([detections.x, detections.y], axis=1) for detections in seen])
    first = 2 * float(np.median(np.concatenate([detections.size for detections in seen])))
    last = max(first, float(np.hypot(*np.ptp(indices, axis=0))))
    return list(np.geomspace(first, last, 1 + math.ceil(math.log(last / first, 1.6))))


def link(film: Rows, limits: Limits) -> list[Track]:
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
    alive: list[Track] = []
    gone: list[Track] = []
    for frame, rows in enumerate(film):
        taken: set[int] = set()
        for number, index in _pairs(alive, rows, frame, limits):
            alive[number].add(frame, index, rows[index])
            taken.add(index)
        for index, row in enumerate(rows):
            if index not in taken:
                track = Track()
                track.add(frame, index, row)
                alive.append(track)
        over = [len(track.frames) < PATIENCE and frame - track.frames[-1] >= FRESH for track in alive]
        gone += [track for track, ended in zip(alive, over, strict=True) if ended]
        alive = [track for track, ended in zip(alive, over, strict=True) if not ended]
    return gone + alive


def _pairs(tracks: list[Track], rows: list[Row], frame: int, limits: Limits) -> list[tuple[int, int]]:
    """Which track goes on with which detection, by numbers."""
    if not (tracks and rows):
        return []
    gap = np.array([frame - track.frames[-1] for track in tracks])
    known = np.array([(t.x, t.y, t.vx, t.vy, t.size, t.contrast, t.label, t.flies) for t in tracks], float)
    track_x, track_y, vx, vy, size, contrast, own, flies = known.T
    # after a few missed pictures the last velocity says nothing any more
    ahead = np.where(gap <= FRESH, gap, 0)
    step = 0.5 * ahead * np.hypot(vx, vy)
    reach = limits.reach * np.minimum(1 + 0.25 * (gap - 1), 2.0)
    # how clearly a track has been seen: a marker must not give way to passing clutter
    seen = np.array([len(track.frames) for track in tracks])
    weight = np.array([track.score for track in tracks]) / seen * np.where(seen < PATIENCE, 0.3, 1.0)
    alone = 1.15 * weight  # what it costs to leave it waiting
    found = np.array([(row.x, row.y, row.size, row.contrast, row.label, row.cut_x or row.cut_y) for row in rows], float)
    x, y, row_size, row_contrast, label, cut = found.T
    far = (reach + 2 * step)[:, None]
    same = (label == own[:, None]) & (label >= 0) | (label < 0) & (own[:, None] < 0)
    number, index = np.nonzero(same & (abs(x - track_x[:, None]) <= far) & (abs(y - track_y[:, None]) <= far))
    away_x, away_y = x[index] - track_x[number], y[index] - track_y[number]
    here = np.hypot(away_x, away_y)
    there = np.hypot(away_x - (ahead * vx)[number], away_y - (ahead * vy)[number])
    # what flies is expected ahead, what jumps back and forth where it was; the other costs half the last step more
    cost = np.where(flies[number] > 0, np.minimum(here + step[number], there), np.minimum(here, there + step[number]))
    fresh = gap[number] <= FRESH
    unlike = _apart(row_size[index], size[number]), _apart(row_contrast[index], contrast[number])
    # a marker that was away for longer must prove itself: noise comes by all the time
    patience = np.where(fresh, 1.0, 0.6)
    alike = (unlike[0] < patience * limits.size) & (unlike[1] < patience * limits.contrast)
    cut = cut[index] > 0
    labelled = own[number] >= 0
    possible = labelled | (cost <= reach[number]) & (alike | cut & fresh)
    # of two candidates at one place the one that looks like before
    cost += np.where(cut, 0.0, 2.0 * np.minimum(gap, 4)[number] * size[number] * sum(unlike))
    cost *= (weight / reach)[number]
    cost = np.where(labelled, np.minimum(cost, 0.5 * alone[number]), cost)
    return _least(number[possible], index[possible], cost[possible], alone, len(rows))


def _least(number: Indices, index: Indices, cost: Array, alone: Array, count: int) -> list[tuple[int, int]]:
    """Of the possible pairs (track, detection) those of the least sum, with what each track costs without one."""
    if len(set(number.tolist())) == len(set(index.tolist())) == len(number):
        kept = cost < alone[number]
        return list(zip(number[kept].tolist(), index[kept].tolist(), strict=True))
    from scipy.optimize import linear_sum_assignment

    # a column more for each track, that leaves it waiting
    costs = np.full((len(alone), count + len(alone)), np.inf)
    costs[np.arange(len(alone)), count + np.arange(len(alone))] = alone
    costs[number, index] = cost
    pairs = zip(*linear_sum_assignment(costs), strict=True)
    return [(int(track), int(index)) for track, index in pairs if index < count]


def choose(
    tracks: list[Track],
    film: Rows,
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
        chosen.sort(key=lambda track: track.rows(film)[0].x)
    else:
        chosen = []
        for x, y in start:
            left = [track for track in tracks if track not in chosen]
            if left:
                chosen.append(min(left, key=lambda track: math.dist(track.rows(film)[0][:2], (x, y))))
    for track in chosen:
        for piece in tracks:
            if piece not in chosen and piece.frames and _continues(piece, track, chosen, film):
                _join(track, piece)
    return chosen


def _prefer_moving(chosen: list[Track], tracks: list[Track], film: Rows, resting: int) -> None:
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


def _travel(track: Track, film: Rows) -> float:
    """How far apart its places lie, in px; of a coordinate that an edge cuts off nothing is known."""
    rows = track.rows(film)
    known = [row.x for row in rows if not row.cut_x], [row.y for row in rows if not row.cut_y]
    return math.hypot(*(float(np.ptp(np.percentile(whole, [5, 95]))) for whole in known if whole))


def _continues(piece: Track, track: Track, chosen: list[Track], film: Rows) -> bool:
    """Whether a piece is the same marker before or after a gap: like it, in reach and nobody else's."""
    before, after = (piece, track) if piece.frames[-1] < track.frames[0] else (track, piece)
    if before.frames[-1] >= after.frames[0] or len(piece.frames) < PATIENCE:
        return False
    if abs(math.log(piece.size / track.size)) > math.log(1.6) or abs(math.log(piece.contrast / track.contrast)) > 1:
        return False
    last, first = before.rows(film)[-1][:2], after.rows(film)[0][:2]
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


def _same_thing(one: Track, other: Track, film: Rows) -> bool:
    """Whether one is a part of the other: in most pictures they are nearer to each other than half a diameter."""
    _, own, its = np.intersect1d(one.frames, other.frames, assume_unique=True, return_indices=True)
    apart = np.hypot(*(one.way(film)[own] - other.way(film)[its]).T)
    return bool(2 * np.count_nonzero(apart < 0.5 * max(one.size, other.size)) > len(own))
