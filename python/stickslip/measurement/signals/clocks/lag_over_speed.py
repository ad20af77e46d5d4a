"""The lag of a force against a motion to and fro: friction over speed is one curve only without it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.integrate import cumulative_trapezoid

from stickslip.files.arrays import Array

SPEED_BINS = 24
"""Ranges of speed."""
MOST_LEFT = 0.5
"""Share of the variance that a lag may leave."""
LAGS = 200
"""Tried to each side at most."""
MOST_SAMPLES = 20_000
"""Of the motion that are looked at, spread over the record."""
STRETCHES = 10
"""Of a record that must agree on a lag."""
NO_WORSE, CLEARLY_WORSE = 1.25, 2.0
"""Two explanations whose mean squares differ by less than this factor are not told apart; by more than this one they are."""
DISTANCES = 20
"""Over which friction may build up, tried."""
COLLINEAR = 1e-6
"""Columns of length 1 whose smallest singular value is less than this are one."""


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

    def note(self, clock_offset: float, force: str, length: str) -> str:
        """The sentence on a lag that is left with this clock_offset of the rig; units of force and length."""
        sense = "late" if self.value > 0 else "early"
        delay = f"a delay of the channel, which clock_offset = {self.value + clock_offset:.3g} in the rig takes out"
        shifted = "friction over speed is one curve for speeding up and for slowing down"
        scatter = f"it scatters by {self.after:.3g} {force}, now by {self.before:.3g} {force}"
        by = f"by {abs(self.value):.3g} +- {self.error:.1g} s"
        if math.isnan(self.distance):
            return (
                f"the force is {sense} against the motion {by}: so shifted, {shifted} ({scatter}). It is {delay}, or "
                "friction that builds up over a distance at each reversal"
            )
        return (
            f"after each reversal the force changes late against the motion {by}, or over a path of {self.distance:.2g} "
            f"{length}: shifted by either, {shifted} ({scatter}). It is friction that builds up over a distance "
            f"(presliding, a soft mount), or {delay}; this record does not tell one from the other, a motion with "
            "accelerations of other sizes does"
        )


def lag_over_speed(
    time: Array, force: Array, speed: Array, acceleration: Array, beside: Array | None = None
) -> Lag | None:
    """The lag under which friction over speed is one curve, for speeding up and for slowing down; None where none is seen.

    For each lag o

        force(t + o) = f(w(t)) + m a(t) + c b(t)

    is fitted by least squares, f by a level in each of `SPEED_BINS` equally filled ranges of w, m and c free, so that an
    inertia or the gravity of an arm left in the force passes for no lag and hides none. A lag is seen where it is more than
    one sample and less than about a sixth of the time between two turns of the speed, where its fit leaves at most
    `MOST_LEFT` of the variance that is left without, in nine of ten stretches less, where the lags of these agree, and where
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
    >>> lag_over_speed(t, force(t) + noise, w, a) is None, round(lag_over_speed(t, force(t - 0.06) + noise, w, a).value, 2)
    (True, 0.06)
    """
    step = float(np.median(np.diff(time)))
    some = slice(None, None, max(len(time) // MOST_SAMPLES, 1))
    w, a = speed[some], acceleration[some]
    ways = np.bincount(w * a > 0, minlength=2)
    if ways.min() < 10 * SPEED_BINS or step <= 0:
        return None
    edges = np.quantile(w, np.linspace(0, 1, SPEED_BINS + 1)[1:-1])
    # across a change of sign no level serves
    bins = np.searchsorted(np.unique([*edges, 0.0]), w)
    parts = np.arange(len(w)) * STRETCHES // len(w)
    others = a[:, None] if beside is None else np.column_stack([a, beside[some]])

    def mean_squares(along: Array, shifts: Array, others: Array = others) -> Array:
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
            residuals = without_levels(np.interp(here + shift, along, force))
            residuals = residuals - base @ (base.T @ residuals)
            table.append(np.bincount(part, residuals**2, STRETCHES) / np.where(total, total, np.nan))
        return np.array(table)

    # a lag is short against the time in which the motion turns round
    turns = max(int(np.count_nonzero(np.diff(np.sign(acceleration)))), 1)
    most = float(np.ptp(time)) * min(0.15 / turns, 0.05)
    lags = np.linspace(-most, most, 2 * int(np.clip(most / step, 2, LAGS)) + 1)
    table = mean_squares(time, lags)
    whole = np.nanmean(table, axis=1)
    best = int(np.argmin(whole))
    if not 0 < best < len(lags) - 1 or np.isnan(table).all(axis=0).any():
        return None
    none = len(lags) // 2
    own = lags[np.nanargmin(table, axis=0)]
    # the half of the range that holds the middle half of the stretches, over the root of their number
    spread = float(np.subtract(*np.quantile(own, [0.75, 0.25]))) / 1.35
    value = float(lags[best])
    error = math.hypot(spread / math.sqrt(STRETCHES), float(lags[1] - lags[0]) / math.sqrt(12))
    better = np.count_nonzero(table[best] < table[none]) >= STRETCHES - 1
    clear = abs(value) > max(1.5 * step, 5 * error) and spread < 0.5 * abs(value)
    if not (better and clear and whole[best] < MOST_LEFT * whole[none]):
        return None
    path = cumulative_trapezoid(np.abs(speed), time, initial=0)
    longest = float(np.abs(speed).max()) * most
    along_path = np.nanmean(mean_squares(path, np.linspace(0, longest, LAGS + 1)), axis=1)
    over = 0.0 if value < 0 else _path_after_reversals(path, speed, round(value / step))
    built_up, distance = math.inf, math.nan
    if over > 0:
        distances = over * np.geomspace(0.3, 10, DISTANCES)
        senses = _presliding(path, speed, distances)[:, some] - np.sign(w)
        left = [
            float(np.nanmean(mean_squares(time, np.zeros(1), np.column_stack([others, column])))) for column in senses
        ]
        built_up, distance = min(left), float(distances[int(np.argmin(left))])
    if min(float(along_path.min()), built_up * CLEARLY_WORSE) < whole[best]:
        return None
    distance = distance if built_up < NO_WORSE * whole[best] else math.nan
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
