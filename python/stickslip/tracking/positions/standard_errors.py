"""Standard errors of positions: from the noise around a marker, and from the scatter that is more than that explains."""

from __future__ import annotations

import math

import numpy as np

from stickslip.files.arrays import Array
from stickslip.tracking.finding.blobs import LEAST_ERROR
from stickslip.tracking.finding.response_map import ResponseMap
from stickslip.tracking.finding.surroundings import share_that_passes
from stickslip.tracking.positions.scatter import scatter, size_scatter
from stickslip.tracking.positions.size_changes import one_sided

UNEXPLAINED = 3.5
"""Scatter may exceed the stated errors by this over the root of the number of pictures by chance."""

PERSISTS = 1.15
"""What the noise does not explain goes on for some pictures, which differences do not see: errors are so much larger."""

COPIED = 1.6
"""The same where pictures are coded as differences: what rests or moves on is copied from one to the next, errors too."""

UNSEEN = 4.0
"""By so much at most errors are larger there because the size of the marker scatters: that of a small one always does."""

SHAKY = 3.0
"""So many times the scatter that noise explains is one of something else."""

SIZE_ERROR = 0.02
"""Of a size at least, in px: how a rim lies between the pixels."""

SMALL = 12.0
"""The size of markers that are smaller, in px, depends on how they lie between the pixels."""


def errors_from_surroundings(
    mass: int,
    kept: dict[int, ResponseMap],
    corner: tuple[int, int],
    x: Array,
    y: Array,
    size: Array,
    size_error: Array,
    copied: bool,
    *errors: Array,
) -> list[str]:
    """Scale errors to the noise that changes as a marker moves; say where its size shows more than there is around it.

    Texture that moves along with the marker is no noise. What is copied from picture to picture scatters only in the size.
    """
    left, top = corner
    width = float(np.nanmedian(size))
    passes = share_that_passes(kept, x - left, y - top, width)
    if copied:
        passes = max(passes, min(UNSEEN, size_scatter(x, y, size, size_error)))
    shifted = one_sided(x, y, size)
    for error in errors:
        error[:] = np.maximum(np.maximum(passes * error, LEAST_ERROR), shifted)
    unstable = size_scatter(x, y, size, np.maximum(passes * size_error, SIZE_ERROR))
    if copied or width < SMALL or not SHAKY < unstable < math.inf:
        return []
    return [
        f"The size of mass {mass} scatters {unstable:.2g} times as much as the noise around it explains. Specks, hairs or "
        "ticks on its way, or light and shadow that move over it, shift it by more than the errors hold; a change of "
        "distance, focus or brightness changes the size alone."
    ]


def errors_from_scatter(mass: int, times: Array, copied: bool, *axes: tuple[Array, Array]) -> list[str]:
    """Raise the errors to the scatter of the places where that is more than the picture's noise explains, and say it.

    Where pictures are copied from one to the next what rests scatters too little: a coordinate then has at least the scatter
    of the other.
    """
    found = [scatter(position, error, times) for position, error in axes]
    usual = [float(np.nanmedian(one)) if np.isfinite(one).any() else math.nan for one in found]
    given = []
    for (position, error), around, own, name in zip(axes, found, usual, "xy", strict=True):
        least = 1 + UNEXPLAINED / math.sqrt(max(np.isfinite(position).sum(), 1))
        if own > least:
            stated = float(np.nanmedian(error))
            given.append(f"{name} {own * stated:.2g} px where the noise explains {stated:.2g}")
        if copied:
            known = np.fmax(around, np.fmax(usual[0], usual[1]))
            error *= np.fmax(1, COPIED * np.where(np.isnan(known), 1.0, known))
        elif own > least:
            error *= np.fmax(1, PERSISTS * around)
    if copied:
        larger = " and ".join(f"{float(np.nanmedian(error)):.2g}" for _, error in axes)
        return [
            f"Mass {mass}: the film is strongly compressed, which copies errors from picture to picture. Those of x and y, "
            f"{larger} px, are estimated from the scatter of its position and its size; they do not include what lasts "
            "longer."
        ]
    if not given:
        return []
    return [
        f"Mass {mass} scatters from picture to picture ({', '.join(given)}): compression, flicker or a camera that shakes; "
        "the errors include that, but nothing that lasts longer than some pictures."
    ]
