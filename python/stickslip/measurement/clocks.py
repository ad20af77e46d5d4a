"""Two records on two clocks: the offset between them, found and said."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from stickslip.errors import InputError

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Offset:
    """How far one clock is ahead of another.

    Attributes
    ----------
    value, error : s; the error is half the range of offsets that correlate nearly as well.
    correlation : at the value, of the two activities.
    """

    value: float
    error: float
    correlation: float


def clock_offset(time_a: Array, a: Array, time_b: Array, b: Array) -> Offset:
    """The offset under which two signals rise and fall together: a(t + offset) goes with b(t).

    Of each signal only its size counts (a force gauge does not know the sign of a velocity). Their correlation is
    computed for all offsets that leave at least half of the shorter record in common; offsets whose correlation is less
    than 5 % of its range below the best are called as good.

    Parameters
    ----------
    time_a, a, time_b, b : two signals on their own clocks, s.

    Examples
    --------
    >>> t = np.arange(0, 10, 0.02)
    >>> pulse = np.exp(-(((t - 5) / 0.5) ** 2))
    >>> abs(clock_offset(t + 3.0, pulse, t, pulse).value - 3.0) < 0.02
    True
    """
    step = float(max(np.median(np.diff(time_a)), np.median(np.diff(time_b))))
    span_a, span_b = float(np.ptp(time_a)), float(np.ptp(time_b))
    common = 0.5 * min(span_a, span_b)
    low, high = time_a[0] - time_b[-1] + common, time_a[-1] - time_b[0] - common
    offsets = np.arange(low, high + step, step)
    if len(offsets) < 3 or len(offsets) > 200_000:
        raise InputError(
            f"the two records last {span_a:g} s and {span_b:g} s: too short to find the offset of their clocks; give "
            "clock_offset in the rig"
        )
    size_a, size_b = np.abs(a), np.abs(b)
    scores = np.full(len(offsets), -1.0)
    for i, offset in enumerate(offsets):
        inside = (time_b + offset >= time_a[0]) & (time_b + offset <= time_a[-1])
        if np.count_nonzero(inside) * step < 0.9 * common:
            continue
        x, y = np.interp(time_b[inside] + offset, time_a, size_a), size_b[inside]
        spread = float(np.std(x) * np.std(y))
        if spread > 0:
            scores[i] = float(np.mean((x - x.mean()) * (y - y.mean()))) / spread
    best = int(np.argmax(scores))
    good = offsets[scores > scores[best] - 0.05 * (scores[best] - np.median(scores))]
    return Offset(float(offsets[best]), float(max(np.ptp(good) / 2, step)), float(scores[best]))
