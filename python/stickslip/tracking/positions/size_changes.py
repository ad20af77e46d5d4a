"""What the size of a marker tells: where it is partly hidden, and how far a change of it may have shifted the centre."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from stickslip.files.arrays import Array
from stickslip.files.median_deviation import MAD_TO_SIGMA

FEWEST_PICTURES = 30
"""Steps from which what is usual can be told."""

USUAL = 51
"""Pictures over which what is usual is taken: the size of a marker, its scatter."""

SHRUNK = 0.12
"""A marker that loses so much of its diameter for some pictures is hidden in part; blur by motion does not shrink it."""

ALONE = 0.25
"""A marker that loses so much in one picture alone."""

SLIGHT = 0.015
"""A marker that loses so much before or after that is being covered or uncovered."""


def hidden(size: Array) -> npt.NDArray[np.bool_]:
    """Pictures in which a marker is partly hidden, by its sizes (NaN where unseen).

    It is where it is markedly smaller than it usually is around then, and in the pictures before and after as long as its
    size is another at all, and one more: what comes near a marker seems a part of it, and shifts its centre, before it hides
    one. A single picture in which it is hardly smaller than that is noise.
    """
    from scipy.ndimage import binary_dilation, binary_propagation, label

    change, common = size_change(size), usual_change(size_change(size))
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
    change = size_change(size)
    off = np.where(np.abs(change) > usual_change(change), change, 0.0) * np.nan_to_num(size)
    steps = np.nan_to_num(np.hypot(np.diff(x, prepend=x[:1]), np.diff(y, prepend=y[:1])))
    blur = 2 / math.pi * np.maximum(steps, np.append(steps[1:], 0.0))
    return np.where(off > 0, np.maximum(off - blur, 0.0), -off)


def size_change(size: Array) -> Array:
    """Relative difference of each size from the usual one; 0 where it was not seen."""
    from scipy.ndimage import median_filter

    seen = np.flatnonzero(np.isfinite(size))
    change = np.zeros(len(size))
    if len(seen) >= FEWEST_PICTURES:
        known = size[seen]
        change[seen] = known / median_filter(known, min(USUAL, len(known)), mode="nearest") - 1
    return change


def usual_change(change: Array) -> float:
    """A relative change up to which a size is as usual: six standard deviations, from the median."""
    return 6 * MAD_TO_SIGMA * float(np.median(np.abs(change)))
