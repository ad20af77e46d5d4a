"""Detections to tracks: which spot of this picture is which spot of the last one."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

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
                    rows.append((_apart(seen.size, walker.size), _apart(seen.contrast, walker.contrast)))
                walker.add(frame, index, seen)
        if len(rows) < 10:
            return cls(reach)
        found = 0.15 + SURE * np.percentile(np.array(rows), 99, axis=0)
        return cls(reach, *(min(float(one), most) for one, most in zip(found, (cls.size, cls.contrast), strict=True)))


def _apart(one: float, other: float) -> float:
    """Distance of two logarithms."""
    return abs(math.log(one / other)) if one > 0 and other > 0 else math.inf


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
    without having moved that way before; of markers that cross while one of them is hidden the identities are a guess.
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
        over = [len(track.frames) < PATIENCE and frame - track.frames[-1] >= 3 for track in alive]
        gone += [track for track, ended in zip(alive, over, strict=True) if ended]
        alive = [track for track, ended in zip(alive, over, strict=True) if not ended]
    return gone + alive


def _pairs(tracks: list[Track], rows: list[Row], frame: int, limits: Limits) -> list[tuple[int, int]]:
    """Which track goes on with which detection, by numbers."""
    gaps = [frame - track.frames[-1] for track in tracks]
    # after a few missed pictures the last velocity says nothing any more
    aheads = [gap if gap <= 3 else 0 for gap in gaps]
    steps = [0.5 * ahead * math.hypot(track.vx, track.vy) for ahead, track in zip(aheads, tracks, strict=True)]
    reaches = [limits.reach * min(1 + 0.25 * (gap - 1), 2.0) for gap in gaps]
    # how clearly a track has been seen: a marker must not give way to passing clutter
    seen = [len(track.frames) for track in tracks]
    weights = [track.score / n * (0.3 if n < PATIENCE else 1.0) for track, n in zip(tracks, seen, strict=True)]
    alone = [1.15 * weight for weight in weights]  # what it costs to leave it waiting
    x, y, label = np.array([(row.x, row.y, row.label) for row in rows]).reshape(-1, 3).T
    at = np.array([(track.x, track.y, track.label) for track in tracks]).reshape(-1, 3)
    far = np.array(reaches) + 2 * np.array(steps)
    here_x, here_y, own, far = (column[:, None] for column in (*at.T, far))
    near = (label == own) & (label >= 0) | (label < 0) & (own < 0) & (abs(x - here_x) <= far) & (abs(y - here_y) <= far)
    possible: list[tuple[int, int, float]] = []
    for number, index in np.argwhere(near).tolist():
        track, row, gap = tracks[number], rows[index], gaps[number]
        step, reach, labelled = steps[number], reaches[number], track.label >= 0
        there_x, there_y = track.x + aheads[number] * track.vx, track.y + aheads[number] * track.vy
        here = math.hypot(row.x - track.x, row.y - track.y)
        there = math.hypot(row.x - there_x, row.y - there_y)
        # what flies is expected ahead, what jumps back and forth where it was; the other costs half the last step more
        cost = min(here + step, there) if track.flies else min(here, there + step)
        cut, fresh = row.cut_x or row.cut_y, gap <= 3
        size, contrast = _apart(row.size, track.size), _apart(row.contrast, track.contrast)
        # a marker that was away for longer must prove itself: noise comes by all the time
        patience = 1.0 if fresh else 0.6
        alike = (size < patience * limits.size and contrast < patience * limits.contrast) or (cut and fresh)
        if not labelled and (cost > reach or not alike):
            continue
        # of two candidates at one place the one that looks like before
        if not cut:
            cost += 2.0 * min(gap, 4) * track.size * (size + contrast)
        cost *= weights[number] / reach
        possible.append((number, index, min(cost, 0.5 * alone[number]) if labelled else cost))
    return _least(possible, alone, len(rows))


def _least(possible: list[tuple[int, int, float]], alone: list[float], count: int) -> list[tuple[int, int]]:
    """Of the possible pairs (track, detection, cost) those of the least sum, with what each track costs without one."""
    if len({pair[0] for pair in possible}) == len({pair[1] for pair in possible}) == len(possible):
        return [(track, index) for track, index, cost in possible if cost < alone[track]]
    from scipy.optimize import linear_sum_assignment

    # a column more for each track, that leaves it waiting
    costs = np.full((len(alone), count + len(alone)), np.inf)
    costs[np.arange(len(alone)), count + np.arange(len(alone))] = alone
    for track, index, cost in possible:
        costs[track, index] = cost
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
    """Whether one is a part of the other: they are nearer to each other than half a diameter."""
    _, *both = np.intersect1d(one.frames, other.frames, assume_unique=True, return_indices=True)
    if not len(both[0]):
        return False
    own, its = (
        np.array([row[:2] for row in track.rows(film)])[among] for track, among in zip((one, other), both, strict=True)
    )
    return float(np.median(np.hypot(*(own - its).T))) < 0.5 * max(one.size, other.size)
