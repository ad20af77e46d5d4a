"""Markers that meet: which is which afterwards, as far as their motion tells."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
import numpy.typing as npt

from stickslip.files.arrays import Array, Indices
from stickslip.files.median_deviation import MAD_TO_SIGMA

NEAR = 1.2
"""Two markers whose centres are so many diameters apart touch, or nearly."""

UNLIKE = 0.1, 0.3
"""Logarithms of size and contrast that differ by more than this, and by three times their scatter, tell two markers apart."""

GROWN = 0.05
"""A logarithm of a size that is larger by this, and by three times its scatter, is that of two markers as one spot."""

CLEARLY = 2.0
"""What deviates so many times more than the other, and than motion usually does, did not happen."""

USUAL = 0.95
"""Steps usually deviate less than this share of all do."""

FEWEST = 5
"""Steps from which that can be told."""


@dataclass
class Way:
    """What was seen of one marker, by picture, NaN where it was not.

    Attributes
    ----------
    positions : shape (n, 2), in px.
    looks : shape (n, 2), logarithms of its size and contrast.
    before, after : its velocities in px a picture when it came to a place, and when it left.
    """

    positions: Array
    looks: Array
    before: Array = field(init=False)
    after: Array = field(init=False)

    def __post_init__(self) -> None:
        self.before, self.after = np.full((2, *self.positions.shape), np.nan)
        seen = np.flatnonzero(np.isfinite(self.positions).all(axis=1))
        self.before[seen[1:]] = np.diff(self.positions[seen], axis=0) / np.diff(seen)[:, None]
        self.after[seen[:-1]] = self.before[seen[1:]]
        if len(seen) > 1:
            self.before[seen[0]], self.after[seen[-1]] = self.after[seen[0]], self.before[seen[-1]]
        self.middle = np.nanmedian(self.looks, axis=0)
        self.spread = MAD_TO_SIGMA * np.nanmedian(np.abs(self.looks - self.middle), axis=0)

    def alike(self, other: Way) -> bool:
        """Whether the look of the two does not tell them apart."""
        least = UNLIKE + 3 * (self.spread + other.spread)
        return bool((np.abs(self.middle - other.middle) <= least).all())

    def usual(self, gap: int, first: Indices, last: Indices) -> Array:
        """What all but one in twenty of its steps over so many pictures deviate less than; inf where that is not known.

        Steps across the gaps from `first` to `last` are left out, where others are left.
        """
        pictures = np.arange(len(self.positions) - gap)
        found = deviations(self, self, pictures, pictures + gap)
        known: npt.NDArray[np.bool_] = np.asarray(np.isfinite(found).all(axis=0))
        free = np.array(known)
        for before, after in zip(first[last - first > 1].tolist(), last[last - first > 1].tolist(), strict=True):
            free[max(before - gap, 0) : after + 1] = False  # velocities at its ends are across it, too
        if free.sum() >= FEWEST:
            known = free
        return np.quantile(found[:, known], USUAL, axis=1) if known.sum() >= FEWEST else np.full(2, math.inf)


def deviations(one: Way, other: Way, first: Indices, last: Indices) -> Array:
    """How far a marker that is `one` in the picture `first` and `other` in `last` is off staying, and off going on, in px.

    From p with the velocity v to q with w in g pictures: |q − p|, and |q − p − g (v + w)/2| + g |w − v|/2; shape (2, n) for n
    pairs of pictures.
    """
    gap = (last - first)[:, None]
    v, w = one.before[first], other.after[last]
    step = other.positions[last] - one.positions[first]
    return np.array([np.hypot(*step.T), np.hypot(*(step - gap * (v + w) / 2).T) + np.hypot(*(gap * (w - v) / 2).T)])


def meetings(a: Way, b: Way) -> tuple[Indices, Indices]:
    """The last picture before and the first after each meeting in which both are seen.

    They may have met between two such pictures where one or both were not seen (hidden, or one spot with the other), or
    where they are within 1.2 diameters.
    """
    apart = np.hypot(*(a.positions - b.positions).T)
    seen = np.flatnonzero(np.isfinite(apart))
    first, last = seen[:-1], seen[1:]
    near = NEAR * np.exp((a.middle[0] + b.middle[0]) / 2)
    met = (last - first > 1) | (np.minimum(apart[first], apart[last]) < near)
    return first[met], last[met]


def separate(
    x: Array, y: Array, size: Array, contrast: Array, others: list[Array], lost: np.ndarray, times: Array
) -> list[str]:
    """Give markers that met their own motion again, where that tells; a sentence for every two where it does not.

    Pictures in which two are one spot are taken out. Of two that look alike, both may go on as themselves after a meeting, or
    as each other. Of these that is taken which deviates less, summed over both markers, from what usually tells their motion
    over as many pictures better, that they stay or go on (:func:`deviations`), where the other deviates more than twice as
    much as it, and as they usually do.

    Parameters
    ----------
    x, y, size, contrast : of each marker, shape (n, markers), lengths in px; NaN where it was not seen.
    others : what else belongs to the markers.
    lost : why a marker is missing.
    times : of the pictures, in s.

    Limits: two that are one spot for a while, and turn back with the velocities of each other, are taken for two that pass.
    What is not followed, such as a resting spot, is not looked at, nor what meets before both were seen apart.
    """
    columns = [x, y, size, contrast, *others, lost]
    ways = _ways(x, y, size, contrast)
    for mass, way in enumerate(ways):
        for both in [together(way, other) for other in ways if other is not way]:
            lost[both, mass] = "one spot with another marker"
            for column in columns[:-1]:
                column[both, mass] = np.nan
    ways = _ways(x, y, size, contrast)
    found = []
    for one, other in combinations(range(len(ways)), 2):
        a, b = ways[one], ways[other]
        if not a.alike(b):
            continue
        first, last = meetings(a, b)
        kept, passed = _decided(a, b, first, last)
        for before, after in zip(first[passed].tolist(), last[passed].tolist(), strict=True):
            pictures = _from(a, b, before, after)
            for column in columns:
                column[pictures, one], column[pictures, other] = column[pictures, other], column[pictures, one]
        if passed.any():
            ways[one], ways[other] = _ways(*(column[:, [one, other]] for column in columns[:4]))
        doubtful = np.flatnonzero(~(kept | passed))
        if len(doubtful):
            found.append(_sentence(one, other, first[doubtful], last[doubtful], times))
    return found


def _ways(x: Array, y: Array, size: Array, contrast: Array) -> list[Way]:
    positions, looks = np.stack([x, y], axis=-1), np.log(np.stack([size, contrast], axis=-1))
    return [Way(positions[:, mass], looks[:, mass]) for mass in range(x.shape[1])]


def _decided(a: Way, b: Way, first: Indices, last: Indices) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """After which meetings the two clearly went on as themselves, and after which as each other."""
    usual = {gap: a.usual(gap, first, last) + b.usual(gap, first, last) for gap in set((last - first).tolist())}
    least = np.array([usual[gap] for gap in (last - first).tolist()]).reshape(-1, 2)
    better = np.argmin(least, axis=1), np.arange(len(first))
    kept = (deviations(a, a, first, last) + deviations(b, b, first, last))[better]
    swapped = (deviations(a, b, first, last) + deviations(b, a, first, last))[better]
    limit = CLEARLY * least.T[better]
    return (swapped > CLEARLY * kept) & (swapped > limit), (kept > CLEARLY * swapped) & (kept > limit)


def _from(a: Way, b: Way, first: int, last: int) -> Indices:
    """Pictures in which two that passed each other are exchanged: from `last` on, and before where that is nearer."""
    between = np.arange(first + 1, last)
    share = ((between - first) / (last - first))[:, None]
    ahead = [(1 - share) * one.positions[first] + share * other.positions[last] for one, other in ((a, b), (b, a))]
    kept, exchanged = (
        np.nansum(
            [np.hypot(*(way.positions[between] - position).T) for way, position in zip(pair, ahead, strict=True)],
            axis=0,
        )
        for pair in ((a, b), (b, a))
    )
    return np.concatenate([between[exchanged < kept], np.arange(last, len(a.positions))])


def _sentence(one: int, other: int, first: Indices, last: Indices, times: Array) -> str:
    often = "once," if len(first) == 1 else f"{len(first)} times, first"
    when = f"at {times[first[0]]:.4g} to {times[last[0]]:.4g} s (pictures {first[0]} to {last[0]})"
    return (
        f"Masses {one} and {other} look alike and meet {often} {when}, and their motion does not tell which is which "
        "afterwards: they may have been swapped. Give them different colours or sizes, or track each in a region of its own."
    )


def together(a: Way, b: Way) -> npt.NDArray[np.bool_]:
    """Pictures in which `a` is larger than usual and lies where `b` is, or should be: they are one spot there.

    Where it should be: on the straight way between its places before and after, else at its first or last place.
    """
    larger: npt.NDArray[np.bool_] = np.asarray(a.looks[:, 0] > a.middle[0] + GROWN + 3 * a.spread[0])
    seen = np.isfinite(b.positions).all(axis=1)
    if not (larger.any() and seen.any()):
        return np.zeros_like(larger)
    pictures = np.arange(len(larger))
    expected = np.stack([np.interp(pictures, pictures[seen], position[seen]) for position in b.positions.T], axis=1)
    near = NEAR * math.exp((a.middle[0] + b.middle[0]) / 2)
    return np.asarray(larger & (np.hypot(*(a.positions - expected).T) < near))
