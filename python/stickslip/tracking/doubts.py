"""What makes a track doubtful, in sentences: leaps, a size that grows, other spots as clear.

Of meetings with an equal marker `positions/meetings.py` tells, of scatter and ground `positions/standard_errors.py`, of
copied pictures `video/copies.py`, of missing ones `film_tracking.py`, which gathers all of them.
"""

from __future__ import annotations

import math

import numpy as np

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.tracking.finding.detections import Detections
from stickslip.tracking.linking import CLEAR, Track
from stickslip.tracking.positions.size_changes import FEWEST_PICTURES, size_change, usual_change
from stickslip.tracking.setup import Setup

LEAP = 8.0
"""A step that is so many times longer than all but one in twenty is a leap."""

GROWN = 0.3
"""One that gains so much is blurred, or something lies beside it."""

TEXTURE = 1.1
"""Below this the marker is one of many equal spots."""


def notes_on_track(mass: int, x: Array, y: Array, size: Array) -> list[str]:
    """Sentences on the leaps of a track and the changes of its size; places in px, NaN where it was not seen."""
    found = []
    seen = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    steps = np.hypot(np.diff(x[seen]), np.diff(y[seen])) / np.diff(seen)  # a picture
    if len(steps) >= FEWEST_PICTURES:
        usual, width = float(np.quantile(steps, 0.95)), float(np.nanmedian(size))
        leaps = np.flatnonzero(steps > max(LEAP * usual, 2 * width))
        if len(leaps):
            longest = int(leaps[np.argmax(steps[leaps])])
            found.append(
                f"Mass {mass} leaps {len(leaps)} times, by up to {steps[longest]:.0f} px between pictures {seen[longest]} "
                f"and {seen[longest + 1]}, where its steps are {usual:.2g} px: another spot may have been taken for it; "
                "give size, region or max_jump."
            )
    change = size_change(size)
    grown = np.flatnonzero(change > max(GROWN, usual_change(change)))
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


def unclear(name: str, setup: Setup, pictures: list[Detections], whole: list[bool], tracks: list[Track]) -> list[str]:
    """A sentence where other spots look as much like the marker; refused where it is one of many and none is asked for."""
    if setup.finder != "blob":
        return []
    known = [*tracks, *(still for track in tracks for still in track.at_rest)]
    ratio, others, moves = clearness(pictures, whole, known)
    if ratio >= CLEAR:
        return []
    given = any(getattr(setup, name) is not None for name in ("size", "start", "region", "threshold", "level"))
    like = f"{others:.0f} other spots in a picture look like a {describe(setup)}, the best {1 / ratio:.2g} times as much as "
    if ratio < TEXTURE and not (given or setup.moving):
        if others >= 3 * setup.count:
            raise InputError(
                f"{name}: {like}what was found, as texture does; give size, start, region or moving, or look whether "
                "there is a marker"
            )
        if moves:
            raise InputError(
                f"{name}: {like}what was found, and it moves too: give start, the first place of the marker that is "
                "meant (region or size where these separate them), or masses = 2 to follow both"
            )
    return [
        f"{like[0].upper()}{like[1:]}what was taken: look whether it is the marker; size, start, region or moving decide."
    ]


def describe(setup: Setup) -> str:
    """What is looked for, in words."""
    if setup.finder == "blob":
        size = f" of about {setup.size:g} px" if setup.size else ""
        return f"{setup.marker} marker{size}"
    return "template" if setup.finder == "template" else f"fiducial of the dictionary {setup.dictionary}"
