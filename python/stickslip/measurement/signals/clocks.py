"""Two records on two clocks: the offset between them, found and said."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from stickslip.errors import InputError

Array = npt.NDArray[np.float64]

MOST_OFFSETS = 200_000
"""Of two clocks are tried."""

LEAST_CORRELATION = 0.5
"""Signals that are less alike than this at their best offset tell nothing of their clocks."""

STAMPED = 0.1
"""Of a sampling interval: so well a sample is stamped at best."""

LAG_BINS, LAG_LEAST = 24, 0.5
"""Ranges of speed, and the share of the variance that a lag may leave."""

MOST_LAGS = 200
"""To each side are tried."""

MOST_SAMPLES = 20_000
"""Of the motion that are looked at for a lag, spread over the record."""

STRETCHES = 10
"""Of a record that must agree on a lag."""

SAME_REST, CLEARLY_LESS = 1.25, 2.0
"""Mean squares that differ by less than this factor tell no two explanations apart, and by more than this one surely do."""

PRESLIDING = 20
"""Distances over which friction may build up are tried."""

COLLINEAR = 1e-6
"""Columns of length 1 whose smallest singular value is less than this are one."""

FEWEST_SLIPS, DRIVE = 4, 3
"""Of a record, for a lag to be told, and the order of the polynomial that the pull of the drive is in each of them."""

SLIP_REST, NOISE_REST = 0.05, 1.5
"""Shares of the variance of the acceleration, and of its noise, that the equation of motion may leave."""

OWN, EXPLAINED = 0.02, 0.6
"""Share of the force that position and speed must leave, and of what they leave of the acceleration, that it may leave."""

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

    def at(offset: float) -> _Line:
        return _Line.fit(extension, np.interp(time_b + offset, time_a, force, np.nan, np.nan), taut)

    offsets, lines, weight, samples = _refined(at, offsets, coarse, min(step_a, step_b) / 5, float(np.ptp(force)))
    best = lines[int(np.argmax(weight))]
    if not math.isfinite(best.rest):
        raise InputError(
            "the force of the spring grows with its extension at no offset of the clocks; correct the sign or the columns"
        )
    value = float(weight @ offsets)
    stiffness = np.array([line.stiffness if math.isfinite(line.rest) else best.stiffness for line in lines])
    mean = float(weight @ stiffness)
    own = best.rest / samples / best.spread
    return SpringOffset(
        value=value,
        error=math.hypot(math.sqrt(float(weight @ (offsets - value) ** 2)), step_a / math.sqrt(12)),
        correlation=best.correlation,
        stiffness=mean,
        stiffness_error=math.sqrt(float(weight @ (stiffness - mean) ** 2) + own),
        residual=math.sqrt(best.rest),
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

    def at(offset: float) -> _Line:
        seen = np.interp(time_b + offset, time_a, force, np.nan, np.nan)
        known = np.isfinite(seen)
        if np.count_nonzero(known) < max(LEAST_SAMPLES, 0.4 * len(seen)):
            return _Line(math.inf)
        rest = seen[known] - known_part[known]
        left = rest - design[known] @ np.linalg.lstsq(design[known], rest, rcond=None)[0]
        fitted = seen[known] - left
        spread = float(np.std(seen[known]) * np.std(fitted))
        alike = (
            float(np.mean((seen[known] - seen[known].mean()) * (fitted - fitted.mean()))) / spread if spread else 0.0
        )
        return _Line(float(np.mean(left**2)), correlation=alike, left=left)

    offsets = _offsets(time_a, time_b, coarse)
    offsets, lines, weight, _ = _refined(at, offsets, coarse, min(step_a, step_b) / 5, float(np.ptp(force)))
    value = float(weight @ offsets)
    error = math.hypot(math.sqrt(float(weight @ (offsets - value) ** 2)), STAMPED * min(step_a, step_b))
    return Offset(value, error, lines[int(np.argmax(weight))].correlation)


@dataclass(frozen=True)
class Lag:
    """By how much a force is written later than the motion it belongs to.

    Attributes
    ----------
    value, error : s; positive where the force is late.
    before, after : rms of what is left of the force without and with the lag, in its unit.
    distance : m or rad over which friction that builds up after each reversal would leave as little; NaN: over none.
    """

    value: float
    error: float
    before: float
    after: float
    distance: float = math.nan


def lag_of_force(
    time: Array, force: Array, speed: Array, acceleration: Array, beside: Array | None = None
) -> Lag | None:
    """The lag under which friction over speed is one curve, for speeding up and for slowing down; None where none is seen.

    For each lag o

        force(t + o) = f(w(t)) + m a(t) + c b(t)

    is fitted by least squares, f by a level in each of `LAG_BINS` equally filled ranges of w, m and c free, so that an
    inertia or the gravity of an arm left in the force passes for no lag and hides none. A lag is seen where it is more than
    one sample and less than about a sixth of the time between two turns of the speed, where its fit leaves at most
    `LAG_LEAST` of the variance that is left without, in nine of ten stretches less, where the lags of these agree, and where
    friction that builds up over a distance after each reversal leaves no less: a shift over the path, or a force that is
    proportional to the path until it is that of slip (presliding).

    Parameters
    ----------
    time, force, speed, acceleration : (n,) on one clock.
    beside : (n, p) what else the force may follow, such as sine and cosine of an angle.

    Examples
    --------
    >>> t = np.arange(0, 40, 0.01)
    >>> w, a = np.sin(t) + np.sin(1.7 * t), np.cos(t) + 1.7 * np.cos(1.7 * t)
    >>> force = lambda t: 5 * np.sign(np.sin(t) + np.sin(1.7 * t)) + 2 * a
    >>> noise = 0.1 * np.random.default_rng(1).standard_normal(len(t))
    >>> lag_of_force(t, force(t) + noise, w, a) is None, round(lag_of_force(t, force(t - 0.06) + noise, w, a).value, 2)
    (True, 0.06)
    """
    step = float(np.median(np.diff(time)))
    some = slice(None, None, max(len(time) // MOST_SAMPLES, 1))
    w, a = speed[some], acceleration[some]
    ways = np.bincount(w * a > 0, minlength=2)
    if ways.min() < 10 * LAG_BINS or step <= 0:
        return None
    edges = np.quantile(w, np.linspace(0, 1, LAG_BINS + 1)[1:-1])
    # across a change of sign no level serves
    bins = np.searchsorted(np.unique([*edges, 0.0]), w)
    parts = np.arange(len(w)) * STRETCHES // len(w)
    others = a[:, None] if beside is None else np.column_stack([a, beside[some]])

    def rests(along: Array, shifts: Array, others: Array = others) -> Array:
        """Mean square of what is left in each stretch, (shifts, stretches), the force shifted along the time or the path."""
        inside = (along[some] + shifts.min() >= along[0]) & (along[some] + shifts.max() <= along[-1])
        here, kind, part = along[some][inside], bins[inside], parts[inside]
        count, total = np.maximum(np.bincount(kind), 1), np.bincount(part, minlength=STRETCHES)

        def without_levels(values: Array) -> Array:
            return np.asarray(values - (np.bincount(kind, values) / count)[kind])

        columns = np.stack([without_levels(column) for column in others[inside].T], axis=1)
        columns = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        base, size, _ = np.linalg.svd(columns, full_matrices=False)
        base = base[:, size > COLLINEAR]
        table = []
        for shift in shifts:
            left = without_levels(np.interp(here + shift, along, force))
            left = left - base @ (base.T @ left)
            table.append(np.bincount(part, left**2, STRETCHES) / np.where(total, total, np.nan))
        return np.array(table)

    # a lag is short against the time in which the motion turns round
    turns = max(int(np.count_nonzero(np.diff(np.sign(acceleration)))), 1)
    most = float(np.ptp(time)) * min(0.15 / turns, 0.05)
    lags = np.linspace(-most, most, 2 * int(np.clip(most / step, 2, MOST_LAGS)) + 1)
    table = rests(time, lags)
    whole = np.nanmean(table, axis=1)
    best = int(np.argmin(whole))
    if not 0 < best < len(lags) - 1 or np.isnan(table).all(axis=0).any():
        return None
    none = len(lags) // 2
    own = lags[np.nanargmin(table, axis=0)]
    # the half of the range that holds the middle half of the stretches, over the root of their number
    spread = float(np.subtract(*np.quantile(own, [0.75, 0.25]))) / 1.35
    value, error = (
        float(lags[best]),
        math.hypot(spread / math.sqrt(STRETCHES), float(lags[1] - lags[0]) / math.sqrt(12)),
    )
    better = np.count_nonzero(table[best] < table[none]) >= STRETCHES - 1
    clear = abs(value) > max(1.5 * step, 5 * error) and spread < 0.5 * abs(value)
    if not (better and clear and whole[best] < LAG_LEAST * whole[none]):
        return None
    path = np.concatenate([[0.0], np.cumsum(np.abs(speed[1:]) * np.diff(time))])
    longest = float(np.abs(speed).max()) * most
    along_path = np.nanmean(rests(path, np.linspace(0, longest, MOST_LAGS + 1)), axis=1)
    over = 0.0 if value < 0 else _path_after_reversals(path, speed, round(value / step))
    built_up, distance = math.inf, math.nan
    if over > 0:
        distances = over * np.geomspace(0.3, 10, PRESLIDING)
        senses = _presliding(path, speed, distances)[:, some] - np.sign(w)
        left = [float(np.nanmean(rests(time, np.zeros(1), np.column_stack([others, column])))) for column in senses]
        built_up, distance = min(left), float(distances[int(np.argmin(left))])
    if min(float(along_path.min()), built_up * CLEARLY_LESS) < whole[best]:
        return None
    distance = distance if built_up < SAME_REST * whole[best] else math.nan
    return Lag(value, error, math.sqrt(float(whole[none])), math.sqrt(float(whole[best])), distance)


def _path_after_reversals(path: Array, speed: Array, samples: int) -> float:
    """How far the motion usually goes in so many samples after the speed changes its sense, 0 where it never does."""
    turns = np.flatnonzero(np.diff(np.sign(speed))) + 1
    turns = turns[turns + samples < len(path)]
    return float(np.median(path[turns + samples] - path[turns])) if turns.size else 0.0


def _presliding(path: Array, speed: Array, distances: Array) -> Array:
    """Sense of a friction that is a spring up to slip, from one sense to the other over a distance: (distances, n)."""
    sense = np.sign(speed)
    starts = np.concatenate([[0], np.flatnonzero(np.diff(sense)) + 1])
    stretch = np.repeat(np.arange(len(starts)), np.diff([*starts, len(path)]))
    steepness = 2 / distances
    before = [np.full(len(distances), sense[0])]
    for start, end in pairwise(starts):
        before.append(np.clip(before[-1] + sense[start] * (path[end] - path[start]) * steepness, -1, 1))
    since = sense * (path - path[starts[stretch]])
    return np.asarray(np.clip(np.array(before).T[:, stretch] + steepness[:, None] * since, -1, 1))


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

    is fitted by least squares over all windows i, m, d and k the same in all, p_i a polynomial of the order `DRIVE`: the
    equation of motion, whatever the friction law is. The error is that of the scatter from window to window (sandwich), and
    never less than that of a sample somewhere in its step. The lag can be told where there are `FEWEST_SLIPS` windows, where
    no more is left of the acceleration than `SLIP_REST` of its variance or `NOISE_REST` of its noise, and where the force
    is more than a sum of position and speed (`OWN`) and explains the acceleration (`EXPLAINED`).

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
    stride = -(-sum(last - first for first, last in windows) // (MOST_SAMPLES // 2)) if windows else 1
    inside = [
        slice(first, last, stride)
        for first, last in windows
        if last - first >= LEAST_SAMPLES * stride
        and time[first] - most >= time[0]
        and time[last - 1] + most <= time[-1]
    ]
    if len(inside) < FEWEST_SLIPS or most < step:
        return None
    lines = [
        np.linalg.qr(
            np.polynomial.legendre.legvander(2 * (time[part] - time[part][0]) / np.ptp(time[part]) - 1, DRIVE)
        )[0]
        for part in inside
    ]

    def bent(values: Array, at: Array) -> Array:
        """The values at these times without the polynomial of their window, window by window."""
        found = [np.interp(at[part], time, values) for part in inside]
        return np.concatenate([one - line @ (line.T @ one) for one, line in zip(found, lines, strict=True)])

    base = np.linalg.qr(np.stack([bent(position, time), bent(speed, time)], axis=1))[0]
    moved = bent(acceleration, time)
    moved = moved - base @ (base.T @ moved)
    starts = np.cumsum([0, *(len(line) for line in lines[:-1])])

    def rests(lag: float) -> Array:
        """Sum of squares that is left in each window."""
        seen = bent(force, time + lag)
        seen = seen - base @ (base.T @ seen)
        # a force that speeds the mass up is no friction
        left = moved - min(float(moved @ seen), 0.0) / max(float(seen @ seen), 1e-300) * seen
        return np.asarray(np.add.reduceat(left**2, starts))

    value, apart = 0.0, most / 20
    lags = np.linspace(-most, most, 41)
    while True:
        whole = [float(rests(lag).sum()) for lag in lags]
        best = int(np.argmin(whole))
        if not 0 < best < len(lags) - 1:
            return None
        value = float(lags[best])
        if apart < STAMPED * step:
            break
        lags, apart = value + apart * np.linspace(-1.2, 1.2, 13), apart / 5
    before, here, after = (rests(value + shift) for shift in (-step, 0.0, step))
    slope, curvature = (after - before) / (2 * step), float((after - 2 * here + before).sum()) / step**2
    variance = float(np.sum(bent(acceleration, time) ** 2))
    noise = sum(float(np.sum(acceleration_error[part] ** 2)) for part in inside)
    if not curvature > 0 or here.sum() > max(SLIP_REST * variance, NOISE_REST * noise):
        return None
    seen = bent(force, time + value)
    own = seen - base @ (base.T @ seen)
    if own @ own < OWN * (seen @ seen) or here.sum() > EXPLAINED * (moved @ moved):
        return None
    count = len(inside)
    error = math.sqrt(count / (count - 1) * float(np.sum((slope - slope.mean()) ** 2))) / curvature
    return Offset(value, math.hypot(error, STAMPED * step), math.sqrt(1 - float(here.sum()) / variance))


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
    at: Callable[[float], _Line], offsets: Array, coarse: float, fine: float, scale: float
) -> tuple[Array, list[_Line], Array, float]:
    """Finer offsets around the best of these, the fit of each, its weight S^(-n/2), and n.

    `scale` is the size of the force: residuals of rounding alone are like anything.
    """
    rough = offsets[int(np.argmin([at(offset).rest for offset in offsets]))]
    offsets = rough + np.arange(-2 * coarse, 2 * coarse, fine)
    lines = [at(offset) for offset in offsets]
    rest = np.array([line.rest for line in lines])
    best = lines[int(np.argmin(rest))]
    if not math.isfinite(best.rest):
        return offsets, lines, np.full(len(lines), 1 / len(lines)), 1.0
    floor = max(best.rest, (1e-9 * scale) ** 2)
    alike = np.clip(np.corrcoef(best.left[1:], best.left[:-1])[0, 1], 0.0, 0.9) if best.rest == floor else 0.0
    samples = (len(best.left) - 3) * (1 - alike) / (1 + alike)
    weight = (floor / np.maximum(rest, floor)) ** (samples / 2)
    if (
        weight.max() > 0.5 * weight.sum() and fine > STAMPED**2 * coarse
    ):  # the grid is too coarse for what the records know
        return _refined(at, offsets, fine, fine / 10, scale)
    return offsets, lines, weight / weight.sum(), samples


@dataclass(frozen=True)
class _Line:
    """A line through force over extension: mean square `rest` of what is `left`, `spread` the extension's variance."""

    rest: float
    stiffness: float = math.nan
    correlation: float = math.nan
    spread: float = math.nan
    left: Array = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def fit(cls, extension: Array, force: Array, taut: float | None) -> _Line:
        known = np.isfinite(force) if taut is None else force >= taut
        x, f = extension[known], force[known]
        if len(x) < max(LEAST_SAMPLES, 0.4 * len(extension)) or np.ptp(x) == 0 or np.ptp(f) == 0:
            return cls(math.inf)
        stiffness, level = (float(value) for value in np.polyfit(x, f, 1))
        if stiffness <= 0:
            return cls(math.inf)
        left = f - stiffness * x - level
        return cls(float(np.mean(left**2)), stiffness, float(np.corrcoef(x, f)[0, 1]), float(np.var(x)), left)
