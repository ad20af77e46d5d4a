"""The lag of a force against the slips of a mass that a drive pulls by a spring, by the equation of motion."""

from __future__ import annotations

import math

import numpy as np

from stickslip.files.arrays import Array
from stickslip.measurement.signals.clocks.clock_offset import LEAST_SAMPLES, STAMP_ERROR, Offset

FEWEST_SLIPS = 4
"""Of a record, for a lag to be told."""
DRIVE_DEGREE = 3
"""Of the polynomial that the pull of the drive is in each slip."""
MOST_SAMPLES = 10_000
"""Of all windows that are looked at, spread over them."""
MOST_OF_VARIANCE, MOST_OF_NOISE = 0.05, 1.5
"""Shares of the variance of the acceleration, and of its noise, that the equation of motion may leave."""
LEAST_FORCE = 0.02
"""Share of the force that position and speed must leave."""
MOST_UNEXPLAINED = 0.6
"""Share of the acceleration left by position and speed that the force may leave."""


def lag_at_slips(
    time: Array,
    force: Array,
    position: Array,
    speed: Array,
    acceleration: Array,
    acceleration_error: Array,
    windows: list[tuple[int, int]],
) -> Offset | None:
    """The lag of a force against the slips of a mass that a drive pulls by a spring; None where it cannot be told.

    For each lag o

        a(t) = -force(t + o) / m - d w(t) - k x(t) + p_i(t)

    is fitted by least squares over all windows i, with the same m, d and k, p_i a polynomial of degree `DRIVE_DEGREE`: the
    equation of motion, whatever the friction law is. The error is that of the scatter from window to window (sandwich), and
    never less than that of a sample somewhere in its step. The lag can be told where there are `FEWEST_SLIPS` windows, where
    no more is left of the acceleration than `MOST_OF_VARIANCE` of its variance or `MOST_OF_NOISE` of its noise, and where
    the force is more than a sum of position and speed (`LEAST_FORCE`) and explains the acceleration (`MOST_UNEXPLAINED`).

    Parameters
    ----------
    time, force, position, speed, acceleration, acceleration_error : (n,) on one clock, all smoothed alike.
    windows : first sample and the one behind the last, each with one slip and a part of the sticks beside it.

    Returns
    -------
    Offset; `correlation` is that of the acceleration with what was fitted.

    Limits: of a drive that is uneven within a slip, of a string that swings by itself, and of a sensor in the spring, whose
    force follows position and speed alone, nothing is told.

    Examples
    --------
    >>> t = np.arange(0, 30, 0.02)
    >>> u = t % 3 - 1  # slips of 1 s: a half sine of the acceleration, friction what is left of a spring
    >>> slips = (u > 0) & (u < 1)
    >>> a = np.where(slips, np.sin(2 * np.pi * u), 0.0)
    >>> w = np.where(slips, 1 - np.cos(2 * np.pi * u), 0.0) / (2 * np.pi)
    >>> x = np.cumsum(w) * 0.02
    >>> friction = 5 * (t / (6 * np.pi) - x) - 2 * a
    >>> late = np.interp(t - 0.05, t, friction)
    >>> windows = [(i, i + 150) for i in range(75, 1200, 150)]
    >>> found = lag_at_slips(t, late, x, w, a, np.zeros_like(a), windows)
    >>> round(found.value, 2)
    0.05
    """
    step = float(np.median(np.diff(time)))
    lengths = [time[last - 1] - time[first] for first, last in windows]
    most = 0.25 * float(np.median(lengths)) if lengths else 0.0
    stride = -(-sum(last - first for first, last in windows) // MOST_SAMPLES) if windows else 1
    inside = [
        slice(first, last, stride)
        for first, last in windows
        if last - first >= LEAST_SAMPLES * stride
        and time[first] - most >= time[0]
        and time[last - 1] + most <= time[-1]
    ]
    if len(inside) < FEWEST_SLIPS or most < step:
        return None
    polynomials = [
        np.linalg.qr(
            np.polynomial.legendre.legvander(2 * (time[part] - time[part][0]) / np.ptp(time[part]) - 1, DRIVE_DEGREE)
        )[0]
        for part in inside
    ]

    def without_polynomial(values: Array, at: Array) -> Array:
        """The values at these times without the polynomial of their window, window by window."""
        found = [np.interp(at[part], time, values) for part in inside]
        return np.concatenate([one - p @ (p.T @ one) for one, p in zip(found, polynomials, strict=True)])

    base = np.linalg.qr(np.stack([without_polynomial(position, time), without_polynomial(speed, time)], axis=1))[0]
    moved = without_polynomial(acceleration, time)
    moved = moved - base @ (base.T @ moved)
    starts = np.cumsum([0, *(len(p) for p in polynomials[:-1])])

    def sums_of_squares(lag: float) -> Array:
        """Sum of squares of the residuals in each window."""
        seen = without_polynomial(force, time + lag)
        seen = seen - base @ (base.T @ seen)
        # a force that speeds the mass up is no friction
        left = moved - min(float(moved @ seen), 0.0) / max(float(seen @ seen), 1e-300) * seen
        return np.asarray(np.add.reduceat(left**2, starts))

    value, apart = 0.0, most / 20
    lags = np.linspace(-most, most, 41)
    while True:
        whole = [float(sums_of_squares(lag).sum()) for lag in lags]
        best = int(np.argmin(whole))
        if not 0 < best < len(lags) - 1:
            return None
        value = float(lags[best])
        if apart < STAMP_ERROR * step:
            break
        lags, apart = value + apart * np.linspace(-1.2, 1.2, 13), apart / 5
    before, here, after = (sums_of_squares(value + shift) for shift in (-step, 0.0, step))
    slope, curvature = (after - before) / (2 * step), float((after - 2 * here + before).sum()) / step**2
    variance = float(np.sum(without_polynomial(acceleration, time) ** 2))
    noise = sum(float(np.sum(acceleration_error[part] ** 2)) for part in inside)
    if not curvature > 0 or here.sum() > max(MOST_OF_VARIANCE * variance, MOST_OF_NOISE * noise):
        return None
    seen = without_polynomial(force, time + value)
    own = seen - base @ (base.T @ seen)
    if own @ own < LEAST_FORCE * (seen @ seen) or here.sum() > MOST_UNEXPLAINED * (moved @ moved):
        return None
    count = len(inside)
    error = math.sqrt(count / (count - 1) * float(np.sum((slope - slope.mean()) ** 2))) / curvature
    return Offset(value, math.hypot(error, STAMP_ERROR * step), math.sqrt(1 - float(here.sum()) / variance))


def note_on_lag_at_slips(lag: Offset, clock_offset: float) -> str:
    """The sentence on a lag that is left with this clock_offset of the rig."""
    late, when = ("late", "after") if lag.value > 0 else ("early", "before")
    return (
        f"the force is {late} against the motion by {abs(lag.value):.3g} +- {lag.error:.1g} s: where the mass begins and "
        f"ends to slip, the force changes so long {when} the speed. clock_offset = {lag.value + clock_offset:.3g} in the rig "
        "takes it out; the errors of all break-aways hold what the force may change in that time"
    )
