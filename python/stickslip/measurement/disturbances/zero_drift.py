"""A zero that drifts along a record: the levels at which sticks begin and end change together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc

from stickslip.files.arrays import Array
from stickslip.files.units import unit_suffix
from stickslip.measurement.signals.presmooth import Presmoothed
from stickslip.measurement.signals.turning_points import Flanks

FEWEST_CYCLES = 6
"""Fewer cycles show no drift."""
CURVED = 12
"""Cycles from which on a drift may be a cubic of time, and not only a line."""
BY_CHANCE = 1e-4
"""Levels that do not drift look so with this probability at most."""
TOGETHER = 0.5
"""The levels drift together where their distance changes by less than this part of what they do."""
NEGLIGIBLE = 0.003
"""A drift of less than this part of the range is not worth a word."""


@dataclass(frozen=True)
class ZeroDrift:
    """How far the levels drift over the record.

    Attributes
    ----------
    size : range of the drift, in the unit of the extension.
    share : the same over the usual distance of the levels.
    """

    size: float
    share: float


def zero_drift(presmoothed: Presmoothed, flanks: Flanks) -> ZeroDrift | None:
    """The drift that the lowest and the highest extension of each cycle share, a polynomial of time; None without one.

    A friction that grows would move the two apart, as the mass overshoots by as much as its break-away is above the kinetic
    force; one that rises as a whole looks like a zero that drifts.

    Examples
    --------
    >>> t = np.arange(2000) / 100
    >>> x = t % 1 + 0.02 * t
    >>> ends = np.arange(0, 2001, 100)
    >>> flanks = Flanks([(int(a), int(a) + 99) for a in ends[:-1]], np.ones(19), 0.1, 0)
    >>> round(zero_drift(Presmoothed(t, x, t, 0.0, 1.0, 0.0), flanks).size, 2)
    0.34
    """
    last = len(presmoothed.time) - 1
    whole = np.array([limits for limits in flanks.limits if limits[0] > 0 and limits[1] < last])
    if len(whole) < FEWEST_CYCLES:
        return None
    low, high = presmoothed.extension[whole].T
    middle = presmoothed.time[whole].mean(axis=1)
    degree = 3 if len(whole) >= CURVED else 1
    even = 2 * (middle - middle[0]) / (middle[-1] - middle[0]) - 1
    powers = np.vander(even, degree + 1)
    fits = [powers @ np.linalg.lstsq(powers, level, rcond=None)[0] for level in (low, high)]
    if not all(_clear(level, fit, degree) for level, fit in zip((low, high), fits, strict=True)):
        return None
    size, apart = float(np.ptp((fits[0] + fits[1]) / 2)), float(np.ptp(fits[1] - fits[0]))
    share = size / float(np.median(high - low))
    return ZeroDrift(size, share) if apart < TOGETHER * size and share > NEGLIGIBLE else None


def _clear(level: Array, fit: Array, degree: int) -> bool:
    """Whether a polynomial explains the level better than its mean, by an F test."""
    free = len(level) - degree - 1
    left = max(float(np.sum((level - fit) ** 2)), 1e-300)
    ratio = float(np.sum((fit - level.mean()) ** 2)) / degree * free / left
    return bool(fdtrc(degree, free, ratio) < BY_CHANCE)


def note_on_drift(drift: ZeroDrift, stiffness: float, unit: str) -> str:
    """The sentence that says how large it is."""
    size = f"{stiffness * drift.size:.3g}{unit_suffix(unit)}"
    return (
        f"the levels at which sticks begin and end drift together, by {size} over the record ({100 * drift.share:.2g} % of "
        "their distance): the zero of the instrument drifts, or all of the friction; the errors of forces hold half of it; "
        "correct the zero, or measure parts of the record ([read] window in the rig)"
    )
