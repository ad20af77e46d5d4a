"""What makes a track doubtful: leaps, changes of size, other spots as clear, and scatter that the noise does not explain."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from stickslip.tracking.finding.detections import Array, Detections
from stickslip.tracking.linking import Track

ORDERS = (6, 8, 10)
"""Differences of these orders hold nothing of a motion that twenty pictures a period show."""

UNRESOLVED = 1.5
"""Noise shows alike in differences of all orders; those of the highest see more where the motion bends too often."""

WIDEST = 1.6
"""Differences over so many times the usual time lie across a gap."""

FEWEST = 30
"""Steps from which what is usual can be told."""

FEW_SIZES = 10
"""Pictures from which the scatter of a size can be told."""

POSITION_STEP = 2.0
"""Places of a marker that are so many px apart are two."""

LEAP = 8.0
"""A step that is so many times longer than all but one in twenty is a leap."""

SHRUNK = 0.12
"""A marker that loses so much of its diameter for some pictures is hidden in part; blur by motion does not shrink it."""

ALONE = 0.25
"""A marker that loses so much in one picture alone."""

SLIGHT = 0.015
"""A marker that loses so much before or after that is being covered or uncovered."""

GROWN = 0.3
"""One that gains so much is blurred, or something lies beside it."""

USUAL = 51
"""Pictures over which what is usual is taken: the size of a marker, its scatter."""

NORMAL = 1.4826
"""Standard deviation of normal numbers over the median of their sizes."""

TEXTURE = 1.1
"""Below this the marker is one of many equal spots."""


def scatter(positions: Array, errors: Array, times: Array) -> Array:
    """What changes from picture to picture in one coordinate over its stated errors, at each picture.

    From divided differences of the positions that were seen, at their times, each over the standard error that the stated
    ones give it: the median of their sizes over some pictures around, as that of normal ones is. Differences of the order
    that sees least are taken.

    Parameters
    ----------
    positions, errors, times : shape (n,); NaN where it was not seen.

    Returns
    -------
    shape (n,), near 1 where the errors are right; NaN of too few, and where the motion itself shows in the differences, as of
    fewer than twenty pictures a period.

    Limits: blind to errors that stay for longer than some pictures.

    Examples
    --------
    >>> rng, t = np.random.default_rng(0), np.arange(400) + np.random.default_rng(1).uniform(-0.2, 0.2, 400)
    >>> found = scatter(50 * np.sin(t / 5) + 0.1 * rng.standard_normal(400), np.full(400, 0.05), t)
    >>> bool(np.abs(np.log(found / 2)).max() < 0.7)
    True
    """
    from scipy.ndimage import median_filter

    seen = np.flatnonzero(np.isfinite(positions) & np.isfinite(times))
    nothing = np.full(len(positions), math.nan)
    if len(seen) < FEWEST + max(ORDERS):
        return nothing
    found = []
    for order in ORDERS:
        moments, values, stated = (
            np.lib.stride_tricks.sliding_window_view(one[seen], order + 1) for one in (times, positions, errors)
        )
        span = moments[:, -1] - moments[:, 0]
        apart = (moments[:, :, None] - moments[:, None, :]) / span[:, None, None] + np.eye(order + 1)
        weight = 1 / apart.prod(axis=2)
        size = np.abs(np.sum(weight * values, axis=1)) / np.linalg.norm(weight * stated, axis=1)
        known = span < WIDEST * np.median(span)  # across a gap the motion itself differs
        middle = seen[order // 2 : order // 2 + len(known)][known]
        if len(middle) < FEWEST:
            return nothing
        found.append((NORMAL * float(np.median(size[known])), middle, size[known]))
    usual, middle, own = min(found, key=lambda one: one[0])
    if found[-1][0] > UNRESOLVED * usual:
        return nothing
    around = NORMAL * median_filter(own, min(USUAL, len(middle)), mode="reflect")
    # few of those around are independent: half way, by ratio, to that of the whole film
    return np.interp(np.arange(len(positions)), middle, np.sqrt(usual * around))


def size_scatter(x: Array, y: Array, size: Array, size_error: Array) -> float:
    """How much of its noise a marker shows: the scatter of its size over the stated error of that.

    The size feels the same noise at the same rim as the centre does, and what the ground beside the marker does not show.
    Each position counts alike, however long the marker rests there, and of few positions more is taken than they show.

    Limits: light that falls off moves the centre and not the size.

    Parameters
    ----------
    x, y, size, size_error : shape (n,), in px; NaN where the marker was not seen.

    Returns
    -------
    Near 1 where the error is right; inf where that cannot be told, as of few pictures.
    """
    seen = np.isfinite(size) & np.isfinite(size_error) & np.isfinite(x) & np.isfinite(y)
    if seen.sum() < FEW_SIZES:
        return math.inf
    positions = np.rint(np.stack([x[seen], y[seen]]) / POSITION_STEP)
    _, which, counts = np.unique(positions, axis=1, return_inverse=True, return_counts=True)
    weights = 1 / counts[which.ravel()]
    off = size[seen] - np.average(size[seen], weights=weights)
    found = math.sqrt(np.average(off**2, weights=weights)) / float(np.median(size_error[seen]))
    return (1 + 1 / math.sqrt(len(counts))) * found


def hidden(size: Array) -> npt.NDArray[np.bool_]:
    """Pictures in which a marker is partly hidden, by its sizes (NaN where unseen).

    It is where it is markedly smaller than it usually is around then, and in the pictures before and after as long as its
    size is another at all, and one more: what comes near a marker seems a part of it, and shifts its centre, before it hides
    one. A single picture in which it is hardly smaller than that is noise.
    """
    from scipy.ndimage import binary_dilation, binary_propagation, label

    change, common = _change(size), _common(_change(size))
    seen = np.flatnonzero(np.isfinite(size))
    found = np.zeros(len(size), bool)
    runs, count = label(change[seen] < -max(SLIGHT, 0.5 * common))
    for run in range(1, count + 1):
        pictures = seen[runs == run]
        least = float(change[pictures].min())
        if least < -(max(SHRUNK, common) if len(pictures) > 1 else max(ALONE, common)):
            found[pictures] = True
    beside = binary_propagation(found[seen], mask=found[seen] | (np.abs(change[seen]) > 0.5 * common))
    found[seen] = binary_dilation(beside)
    return found


def one_sided(x: Array, y: Array, size: Array) -> Array:
    """How far a change of its size may have shifted a marker, in px; 0 where the size is as usual around then.

    An area ΔA that is gained or lost at one side of a disc of diameter d, as in the edge of a shadow, changes the size by
    2 ΔA/(π d), and shifts the centre by as much. What a marker gains by blur as it moves by s px from picture to picture, up
    to the area d s, is on both sides.

    Parameters
    ----------
    x, y, size : shape (n,), in px; NaN where it was not seen.

    Limits: what changes for longer than 25 pictures is usual.
    """
    change = _change(size)
    off = np.where(np.abs(change) > _common(change), change, 0.0) * np.nan_to_num(size)
    steps = np.nan_to_num(np.hypot(np.diff(x, prepend=x[:1]), np.diff(y, prepend=y[:1])))
    blur = 2 / math.pi * np.maximum(steps, np.append(steps[1:], 0.0))
    return np.where(off > 0, np.maximum(off - blur, 0.0), -off)


def _change(size: Array) -> Array:
    """Relative difference of each size from the usual one; 0 where it was not seen."""
    from scipy.ndimage import median_filter

    seen = np.flatnonzero(np.isfinite(size))
    change = np.zeros(len(size))
    if len(seen) >= FEWEST:
        known = size[seen]
        change[seen] = known / median_filter(known, min(USUAL, len(known)), mode="nearest") - 1
    return change


def _common(change: Array) -> float:
    return 6 * NORMAL * float(np.median(np.abs(change)))


def remarks(mass: int, x: Array, y: Array, size: Array) -> list[str]:
    """Sentences on the leaps of a track and the changes of its size; places in px, NaN where it was not seen."""
    found = []
    seen = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    steps = np.hypot(np.diff(x[seen]), np.diff(y[seen])) / np.diff(seen)  # a picture
    if len(steps) >= FEWEST:
        usual, width = float(np.quantile(steps, 0.95)), float(np.nanmedian(size))
        leaps = np.flatnonzero(steps > max(LEAP * usual, 2 * width))
        if len(leaps):
            longest = int(leaps[np.argmax(steps[leaps])])
            found.append(
                f"Mass {mass} leaps {len(leaps)} times, by up to {steps[longest]:.0f} px between pictures {seen[longest]} "
                f"and {seen[longest + 1]}, where its steps are {usual:.2g} px: another spot may have been taken for it; "
                "give size, region or max_jump."
            )
    change = _change(size)
    grown = np.flatnonzero(change > max(GROWN, _common(change)))
    if len(grown):
        found.append(
            f"Mass {mass} is larger than usual in {len(grown)} pictures, by up to {100 * change.max():.0f} % (first in "
            f"picture {grown[0]}): motion blur, or something beside it that shifts its centre."
        )
    return found


def clearness(film: list[Detections], whole: list[bool], tracks: list[Track]) -> tuple[float, float, bool]:
    """The least score of the tracks over the best of all other spots, how many those are, and whether that one moves too.

    Over the `whole` pictures: a median, a mean, and whether the best other spot is seen in most of them, spread by more than
    its size. (inf, 0, False) where there are no others.
    """
    chosen: dict[int, list[int]] = {}
    for track in tracks:
        for frame, position in zip(track.frames, track.indices, strict=True):
            if whole[frame]:
                chosen.setdefault(frame, []).append(position)
    ratios, counts = [], []
    best: list[tuple[float, float, float]] = []
    for frame, indices in chosen.items():
        others = np.delete(np.arange(len(film[frame])), indices)
        counts.append(len(others))
        if not len(others):
            ratios.append(math.inf)
            continue
        other = int(others[np.argmax(film[frame].score[others])])
        ratios.append(float(film[frame].score[indices].min() / film[frame].score[other]))
        best.append((float(film[frame].x[other]), float(film[frame].y[other]), float(film[frame].size[other])))
    if not counts:
        return math.inf, 0.0, False
    moves = False
    if len(best) > len(counts) / 2:
        x, y, size = np.array(best).T
        moves = max(float(np.subtract(*np.quantile(of, [0.9, 0.1]))) for of in (x, y)) > float(np.median(size))
    return float(np.median(ratios)), float(np.mean(counts)), moves
