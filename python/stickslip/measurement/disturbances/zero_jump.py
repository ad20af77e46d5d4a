"""A zero that jumps between two samples: no mass goes so far in so short a time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d

from stickslip.files.arrays import Array
from stickslip.files.units import unit_suffix

SIDE = 6
"""Samples on each side of which a parabola is taken."""
LEAST_ERRORS = 8.0
"""A jump is that many times as large as its standard error by the noise."""
LEAST_MOTIONS = 3.0
"""And so many times what the largest acceleration of the free mass moves it by in a step squared."""
LASTING = 7
"""The medians of so many samples on each side are about as far apart too: those beside an impulse are not."""
MOST_JUMPS, LEAST_ABOVE_OTHERS = 3, 2.0
"""No record has more jumps, and none of them is smaller than so many times the largest distance that is none."""


@dataclass(frozen=True)
class ZeroJump:
    """A jump before the sample `index`, upwards by `size` in the unit of the signal."""

    index: int
    size: float


def zero_jumps(signal: Array, weight: Array, noise: float, turn: float) -> list[ZeroJump]:
    """The jumps of a record, in their order.

    The parabola through the samples before an instant and the one through those behind it differ there by what the mass
    goes in between. An event changes the acceleration by at most omega^2 times the range, and so this difference by no
    more than about (omega h)^2 of it. A jump is clear of that, of the noise and of all other instants.

    Parameters
    ----------
    signal, weight : (n,) record, and 0 for samples that are not to be used; instants near these have no jump.
    noise : standard deviation of a sample.
    turn : omega h, the angular frequency of the free mass times the step between samples.

    Examples
    --------
    >>> t = np.arange(1000)
    >>> x = np.sin(t / 20) + 0.001 * np.random.default_rng(1).standard_normal(1000)
    >>> [(one.index, round(one.size, 1)) for one in zero_jumps(x + 0.1 * (t >= 640), np.ones(1000), 0.001, 0.05)]
    [(640, 0.1)]
    """
    if len(signal) < 4 * SIDE:
        return []
    # the parabola through samples at 1/2, 3/2 ... is wanted at 0
    kernel = np.linalg.pinv(np.vander(np.arange(SIDE) + 0.5, 3, increasing=True))[0]
    windows = np.lib.stride_tricks.sliding_window_view(signal, SIDE)
    seen = np.lib.stride_tricks.sliding_window_view(weight, SIDE).min(axis=1) > 0
    apart = np.zeros(len(signal))
    steps = windows[SIDE:] @ kernel - windows[:-SIDE] @ kernel[::-1]
    apart[SIDE : len(signal) - SIDE + 1] = np.where(seen[SIDE:] & seen[:-SIDE], steps, 0.0)
    noisy = math.sqrt(2) * float(np.linalg.norm(kernel))
    least = max(LEAST_ERRORS * noise * noisy, LEAST_MOTIONS * turn**2 * float(np.ptp(signal)) / 2)
    padded = np.pad(signal, 2 * LASTING, mode="edge")
    medians = np.median(np.lib.stride_tricks.sliding_window_view(padded, LASTING), axis=1)
    before, left_of, right_of, behind = (medians[i * LASTING : i * LASTING + len(signal)] for i in range(4))
    lasting = right_of - left_of - (behind - right_of + left_of - before) / 2  # without the slope
    left = np.abs(apart)
    left[(left < maximum_filter1d(left, 2 * SIDE + 1)) | (np.abs(lasting - apart) > left / 2)] = 0.0
    found: list[ZeroJump] = []
    while len(found) <= MOST_JUMPS and left.max() > least:
        at = int(left.argmax())
        found.append(ZeroJump(at, float(apart[at])))
        left[at] = 0.0
    clear = all(abs(one.size) > LEAST_ABOVE_OTHERS * float(left.max()) for one in found)
    return sorted(found, key=lambda one: one.index) if clear and len(found) <= MOST_JUMPS else []


def zero_error(jumps: list[ZeroJump]) -> float:
    """Root mean square error of a zero where the lowest and the highest are as likely, in the unit of the signal."""
    return float(np.ptp(np.cumsum([0.0, *(jump.size for jump in jumps)]))) / math.sqrt(2)


def note_on_jumps(jumps: list[ZeroJump], time: Array, part: slice, stiffness: float, unit: str) -> str:
    """The sentence that says where they are, and which part was measured."""
    where = ", ".join(f"by {stiffness * one.size:.3g}{unit_suffix(unit)} at {time[one.index]:.4g}" for one in jumps)
    return (
        f"the reading jumps between two samples as no mass can, {where}: the zero of the instrument shifts; only "
        f"{time[part.start]:.4g} to {time[part.stop - 1]:.4g} was measured ([read] window in the rig takes another part); "
        "nothing shows which zero is right, and the errors of its forces include that"
    )
