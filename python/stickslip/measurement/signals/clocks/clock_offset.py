"""The offset between the clocks of two records."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from stickslip.errors import InputError
from stickslip.files.arrays import Array

MOST_OFFSETS = 200_000
"""Offsets of two clocks that are tried."""

LEAST_CORRELATION = 0.5
"""Signals that are less alike than this at their best offset tell nothing of their clocks."""

STAMP_ERROR = 0.1
"""Of a sampling interval: so well a sample is stamped at best."""

LEAST_SAMPLES = 8
"""Of an extension, from which a spring can be told."""


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

    def contradiction(self, given: float) -> list[str]:
        """What is said where the offset that the rig gives lies outside three errors."""
        if abs(given - self.value) <= 3 * self.error:
            return []
        return ["the offset of the rig contradicts the records: look at both"]


def clock_offset(time_a: Array, a: Array, time_b: Array, b: Array) -> Offset:
    """The offset under which two signals rise and fall together: a(t + offset) goes with b(t).

    Of each signal only its size counts (a force sensor does not know the sign of a velocity). Their correlation is
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
    common = 0.5 * min(float(np.ptp(time_a)), float(np.ptp(time_b)))
    offsets = _offsets(time_a, time_b, step)
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


@dataclass(frozen=True)
class SpringOffset(Offset):
    """Two clocks joined by a spring, and the spring with them.

    Attributes
    ----------
    stiffness, stiffness_error : N/m.
    residual : rms of what is left of the force, N.
    """

    stiffness: float
    stiffness_error: float
    residual: float


def spring_offset(
    time_a: Array, force: Array, time_b: Array, extension: Array, *, taut: float | None = None
) -> SpringOffset:
    """The offset under which a force is that of the spring whose extension another record holds.

    For each offset o the line

        force(t + o) = k x(t) + c

    is fitted by least squares; S(o) is its mean square residual. The offset is the mean, and its error the spread, of
    the weight S(o)^(-n/2), n the samples of the extension, fewer where a residual is like its neighbour
    (n (1 - r)/(1 + r)); the error is never less than that of a sample somewhere in a step of the force's clock.

    Parameters
    ----------
    time_a, force : the force on its clock, s and N.
    time_b, extension : on theirs, s and m, from any zero.
    taut : smaller forces are left out: a spring that is not taut yet follows no line.

    Raises
    ------
    InputError
        where the records are too short, or the force grows with the extension at no offset.

    Limits: a steady pull alone tells nothing of the offset, slips do.

    Examples
    --------
    >>> t, film = np.arange(0, 40, 0.25), np.arange(0.0, 36, 2)
    >>> found = spring_offset(t + 1.5, 0.4 * t - 3.0 * (t > 25), film, (0.4 * film - 3.0 * (film > 25)) / 500)
    >>> abs(found.value - 1.5) < 2 * found.error < 1.5, round(found.stiffness)  # the slip is between two pictures
    (True, 500)
    """
    step_a, step_b = (float(np.median(np.diff(time))) for time in (time_a, time_b))
    coarse = max(step_a, step_b)
    offsets = _offsets(time_a, time_b, coarse)

    def at(offset: float) -> _Fit:
        return _Fit.fit(extension, np.interp(time_b + offset, time_a, force, np.nan, np.nan), taut)

    offsets, lines, weight, samples = _refined(at, offsets, coarse, min(step_a, step_b) / 5, float(np.ptp(force)))
    best = lines[int(np.argmax(weight))]
    if not math.isfinite(best.mean_square):
        raise InputError(
            "the force of the spring grows with its extension at no offset of the clocks; correct the sign or the columns"
        )
    value = float(weight @ offsets)
    stiffness = np.array([line.stiffness if math.isfinite(line.mean_square) else best.stiffness for line in lines])
    mean = float(weight @ stiffness)
    own = best.mean_square / samples / best.spread
    return SpringOffset(
        value=value,
        error=math.hypot(math.sqrt(float(weight @ (offsets - value) ** 2)), step_a / math.sqrt(12)),
        correlation=best.correlation,
        stiffness=mean,
        stiffness_error=math.sqrt(float(weight @ (stiffness - mean) ** 2) + own),
        residual=math.sqrt(best.mean_square),
    )


def inertia_offset(
    time_a: Array, force: Array, time_b: Array, speed: Array, acceleration: Array, inertia: float | None
) -> Offset:
    """The offset under which a force is inertia and friction of the motion that another record holds.

    For each offset o

        force(t + o) - m a(t) = c0 + c1 tanh(w(t) / w0) + c2 w(t),   w0 a twentieth of the rms of w,

    is fitted by least squares, a friction law of any instrument's zero that says little and is right in the sign; offset and
    error are those of the mean square residual, as in :func:`spring_offset`.

    Parameters
    ----------
    time_a, force : the force on its clock, s and N.
    time_b, speed, acceleration : w and a on theirs.
    inertia : m that is accelerated between instrument and contact, kg; None: fitted too.

    Returns
    -------
    Offset; `correlation` is that of the force with what was fitted.

    Examples
    --------
    >>> t = np.arange(0, 10, 0.01)
    >>> w, a = np.sin(2 * t + 0.1 * t**2), (2 + 0.2 * t) * np.cos(2 * t + 0.1 * t**2)
    >>> found = inertia_offset(t + 0.3, 2 * a + np.sign(w), t, w, a, 2.0)
    >>> bool(abs(found.value - 0.3) < 3 * found.error < 0.03)
    True
    """
    step_a, step_b = (float(np.median(np.diff(time))) for time in (time_a, time_b))
    coarse = max(step_a, step_b)
    rms = float(np.sqrt(np.mean(speed**2)))
    columns = [np.ones_like(speed), np.tanh(20 * speed / rms), speed / rms]
    known_part = np.zeros_like(speed) if inertia is None else inertia * acceleration
    design = np.stack([*columns, acceleration] if inertia is None else columns, axis=1)

    def at(offset: float) -> _Fit:
        seen = np.interp(time_b + offset, time_a, force, np.nan, np.nan)
        known = np.isfinite(seen)
        if np.count_nonzero(known) < max(LEAST_SAMPLES, 0.4 * len(seen)):
            return _Fit(math.inf)
        friction = seen[known] - known_part[known]
        residuals = friction - design[known] @ np.linalg.lstsq(design[known], friction, rcond=None)[0]
        fitted = seen[known] - residuals
        spread = float(np.std(seen[known]) * np.std(fitted))
        alike = (
            float(np.mean((seen[known] - seen[known].mean()) * (fitted - fitted.mean()))) / spread if spread else 0.0
        )
        return _Fit(float(np.mean(residuals**2)), correlation=alike, residuals=residuals)

    offsets = _offsets(time_a, time_b, coarse)
    offsets, lines, weight, _ = _refined(at, offsets, coarse, min(step_a, step_b) / 5, float(np.ptp(force)))
    value = float(weight @ offsets)
    error = math.hypot(math.sqrt(float(weight @ (offsets - value) ** 2)), STAMP_ERROR * min(step_a, step_b))
    return Offset(value, error, lines[int(np.argmax(weight))].correlation)


def _offsets(time_a: Array, time_b: Array, step: float) -> Array:
    """Offsets that leave at least half of the shorter record in common."""
    span_a, span_b = float(np.ptp(time_a)), float(np.ptp(time_b))
    common = 0.5 * min(span_a, span_b)
    offsets = np.arange(time_a[0] - time_b[-1] + common, time_a[-1] - time_b[0] - common + step, step)
    if not 3 <= len(offsets) <= MOST_OFFSETS:
        raise InputError(
            f"the two records last {span_a:g} s and {span_b:g} s: too short, or with too many samples, to find the offset of "
            "their clocks; give clock_offset in the rig"
        )
    return offsets


def _refined(
    at: Callable[[float], _Fit], offsets: Array, coarse: float, fine: float, scale: float
) -> tuple[Array, list[_Fit], Array, float]:
    """Finer offsets around the best of these, the fit of each, its weight S^(-n/2), and n.

    `scale` is the size of the force: residuals of rounding alone are like anything.
    """
    rough = offsets[int(np.argmin([at(offset).mean_square for offset in offsets]))]
    offsets = rough + np.arange(-2 * coarse, 2 * coarse, fine)
    lines = [at(offset) for offset in offsets]
    mean_squares = np.array([line.mean_square for line in lines])
    best = lines[int(np.argmin(mean_squares))]
    if not math.isfinite(best.mean_square):
        return offsets, lines, np.full(len(lines), 1 / len(lines)), 1.0
    floor = max(best.mean_square, (1e-9 * scale) ** 2)
    left = best.residuals
    alike = np.clip(np.corrcoef(left[1:], left[:-1])[0, 1], 0.0, 0.9) if best.mean_square == floor else 0.0
    samples = (len(left) - 3) * (1 - alike) / (1 + alike)
    weight = (floor / np.maximum(mean_squares, floor)) ** (samples / 2)
    # the grid is too coarse for what the records know
    if weight.max() > 0.5 * weight.sum() and fine > STAMP_ERROR**2 * coarse:
        return _refined(at, offsets, fine, fine / 10, scale)
    return offsets, lines, weight / weight.sum(), samples


@dataclass(frozen=True)
class _Fit:
    """A line through force over extension: its residuals and their mean square, `spread` the extension's variance."""

    mean_square: float
    stiffness: float = math.nan
    correlation: float = math.nan
    spread: float = math.nan
    residuals: Array = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def fit(cls, extension: Array, force: Array, taut: float | None) -> _Fit:
        known = np.isfinite(force) if taut is None else force >= taut
        x, f = extension[known], force[known]
        if len(x) < max(LEAST_SAMPLES, 0.4 * len(extension)) or np.ptp(x) == 0 or np.ptp(f) == 0:
            return cls(math.inf)
        stiffness, level = (float(value) for value in np.polyfit(x, f, 1))
        if stiffness <= 0:
            return cls(math.inf)
        residuals = f - stiffness * x - level
        mean_square = float(np.mean(residuals**2))
        return cls(mean_square, stiffness, float(np.corrcoef(x, f)[0, 1]), float(np.var(x)), residuals)
