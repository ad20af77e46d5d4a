"""The limits of a stick in a mass that does not creep: where the record is likeliest."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np
import numpy.typing as npt
from scipy.interpolate import BSpline
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.optimize import minimize_scalar

from stickslip.measure.pieces import DEGREE, GAUSS_NODES, GAUSS_WEIGHTS, Oscillator
from stickslip.measure.sticks import Stick, own_period

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Evidence:
    """-2 log likelihood of a stretch as a function of the level U it shares with its neighbour: a U^2 - 2 b U + c."""

    square: float
    linear: float
    constant: float

    def __add__(self, other: Evidence) -> Evidence:
        return Evidence(self.square + other.square, self.linear + other.linear, self.constant + other.constant)

    def integrated(self) -> float:
        """The level integrated out."""
        return self.constant - self.linear**2 / self.square + math.log(self.square)


@dataclass(frozen=True)
class LimitSearch:
    """A record's slip path u = V t - x and the prior on its slips, in which limits of sticks are looked for.

    A slip is a quintic spline whose friction force does a random walk of the strength that the cut-off says (the
    penalty of `PiecewiseFit` read as a prior), so that slips of different length compare by their evidence.

    Attributes
    ----------
    time, path, weight : (n,) as in `PiecewiseFit`.
    oscillator : m, D, k, V.
    noise : standard deviation of the path's samples.
    knots : distance of knots in s.
    cutoff : of the slips in Hz.
    """

    time: Array
    path: Array
    weight: Array
    oscillator: Oscillator
    noise: float
    knots: float
    cutoff: float

    @property
    def step(self) -> float:
        """Sampling interval in s."""
        return float((self.time[-1] - self.time[0]) / (len(self.time) - 1))

    def rest(self, start: float, end: float, origin: float) -> Evidence:
        """Evidence of the samples between two times if the mass rests there; levels count from `origin`."""
        part = slice(*np.searchsorted(self.time, [start, end]))
        y, w = self.path[part] - origin, self.weight[part]
        return Evidence(
            float(np.sum(w)) / self.noise**2, float(w @ y) / self.noise**2, float(w @ (y * y)) / self.noise**2
        )

    def slip(self, start: float, end: float, origin: float, joined: str) -> Evidence:
        """Evidence of a slip that meets a stick (u = U, u' = 0) at its ``"start"`` or ``"end"``, or ``"nowhere"``."""
        matrix, right, constant, prior, held = self._system(start, end, origin)
        count = len(right)
        if joined == "nowhere":
            return Evidence(1.0, 0.0, constant + self._inner(matrix, right, prior, held, [0, 1, 2]))
        ends = np.array([0, 1] if joined == "start" else [count - 2, count - 1])
        free = np.setdiff1d(np.arange(count), ends)
        inner, cross = matrix[np.ix_(free, free)], matrix[np.ix_(free, ends)].sum(axis=1)
        factor = cho_factor(inner, lower=True, check_finite=False)
        solved = cho_solve(factor, np.stack([right[free], cross], axis=1), check_finite=False)
        row = held[2 if joined == "start" else 5][free]
        precision = prior[np.ix_(free, free)]
        log_prior = _log_determinant(precision, row[None, :])
        determinant = 2 * float(np.sum(np.log(np.diagonal(factor[0]))))
        return Evidence(
            float(matrix[np.ix_(ends, ends)].sum() - cross @ solved[:, 1]),
            float(right[ends].sum() - cross @ solved[:, 0]),
            constant - float(right[free] @ solved[:, 0]) + determinant - log_prior,
        )

    @staticmethod
    def _inner(matrix: Array, right: Array, prior: Array, held: Array, rows: list[int]) -> float:
        factor = cho_factor(matrix, lower=True, check_finite=False)
        determinant = 2 * float(np.sum(np.log(np.diagonal(factor[0]))))
        misfit = -float(right @ cho_solve(factor, right, check_finite=False))
        return misfit + determinant - _log_determinant(prior, held[rows])

    def _system(self, start: float, end: float, origin: float) -> tuple[Array, Array, float, Array, Array]:
        """Normal matrix, right side, constant, prior precision, and rows of the state (u, u', u'') at both ends."""
        o = self.oscillator
        count = max(math.ceil((end - start) / self.knots), 2)
        h = (end - start) / count
        reference = _reference(count)
        part = slice(*np.searchsorted(self.time, [start, end]))
        places = np.clip((self.time[part] - start) / h, 0.0, float(count))
        basis = BSpline.design_matrix(places, reference.knots, DEGREE).toarray()
        y, w = self.path[part] - origin, self.weight[part]
        weighted = basis * (w / self.noise**2)[:, None]
        first, second, third = reference.derivatives
        rows = third / h**3 + second * (o.damping / o.mass / h**2) + first * (o.stiffness / o.mass / h)
        strength = 1 / (self.step * (2 * math.pi * self.cutoff) ** 6 * self.noise**2)
        scaled = rows * (reference.weights * h * strength)[:, None]
        target = o.stiffness * o.drive_velocity / o.mass
        prior = scaled.T @ rows
        right = weighted.T @ y + target * scaled.sum(axis=0)
        constant = float(w @ (y * y)) / self.noise**2 + target**2 * strength * (end - start)
        rate = math.sqrt(o.stiffness / o.mass)
        units = np.array([rate, 1 / h, 1 / (h * h * rate)] * 2) / o.drive_velocity
        return weighted.T @ basis + prior, right, constant, prior, reference.ends * units[:, None]


@dataclass(frozen=True)
class _Reference:
    knots: Array
    derivatives: tuple[Array, Array, Array]
    weights: Array
    ends: Array


@lru_cache(maxsize=512)
def _reference(count: int) -> _Reference:
    """Splines on `count` intervals of length one: derivatives 1 to 3 at Gauss points, and u, u', u'' at both ends."""
    knots = np.concatenate([np.zeros(DEGREE), np.arange(count + 1.0), np.full(DEGREE, float(count))])
    size = count + DEGREE
    nodes = (np.arange(count)[:, None] + 0.5 + 0.5 * GAUSS_NODES).ravel()
    spline = BSpline(knots, np.eye(size), DEGREE)
    derivatives = tuple(np.asarray(spline.derivative(d)(nodes)) for d in (1, 2, 3))
    limits = [(0.0, d) for d in range(3)] + [(float(count), d) for d in range(3)]
    ends = np.array([spline(place, nu=d) for place, d in limits])
    return _Reference(
        knots,
        (derivatives[0], derivatives[1], derivatives[2]),
        np.tile(0.5 * GAUSS_WEIGHTS, count),
        ends,
    )


def _log_determinant(precision: Array, held: Array) -> float:
    """Log determinant of a precision that leaves the held states open, per unit of those states."""
    own = held.T @ held
    scale = float(np.trace(own) / np.trace(precision))
    factor = cho_factor(scale * precision + own, lower=True, check_finite=False)
    rank = len(precision) - len(held)
    return 2 * float(np.sum(np.log(np.diagonal(factor[0])))) - rank * math.log(scale)


def refine_sticks(search: LimitSearch, sticks: list[Stick]) -> list[Stick]:
    """Move the limits of each stick to where the record is likeliest, and drop sticks the record does not need.

    The stretch from the middle of the slip before to the middle of the slip after is taken as slip, rest, slip. A stick
    stays if it is likelier than a slip without it by more than its two limits cost (Bayes' information criterion).
    Limits carry the standard error that the curvature of the likelihood gives.
    """
    reach = own_period(search.oscillator)
    refined: list[Stick] = []
    for number, stick in enumerate(sticks):
        low, high = float(search.time[0]), float(search.time[-1])
        if number > 0:
            low = (sticks[number - 1].end + stick.start) / 2
        if number + 1 < len(sticks):
            high = (stick.end + sticks[number + 1].start) / 2
        try:
            found = _refine(search, stick, max(low, stick.start - reach), min(high, stick.end + reach))
        except LinAlgError:
            found = stick
        if found is not None:
            refined.append(found)
    return refined


def _refine(search: LimitSearch, stick: Stick, low: float, high: float) -> Stick | None:
    step = search.step
    middle = (stick.start + stick.end) / 2
    origin = float(np.interp(middle, search.time, search.path))
    span = max(8 * step, 0.06 * own_period(search.oscillator))
    margin = 8 * step
    kept: dict[tuple[str, float], Evidence] = {}

    def before(start: float) -> Evidence:
        key = ("before", start)
        if key not in kept:
            kept[key] = search.slip(low, start, origin, "end")
        return kept[key]

    def after(end: float) -> Evidence:
        key = ("after", end)
        if key not in kept:
            kept[key] = search.slip(end, high, origin, "start")
        return kept[key]

    def value(start: float, end: float) -> float:
        total = search.rest(start, end, origin)
        if stick.starts:
            total = total + before(start)
        if stick.ends:
            total = total + after(end)
        return total.integrated()

    def places(at: float, free: bool, bounds: tuple[float, float]) -> Array:
        a, b = max(at - span, bounds[0]), min(at + span, bounds[1])
        if not free or b <= a:
            return np.array([at])
        return np.linspace(a, b, max(math.ceil((b - a) / step), 2) + 1)

    # the valley of a hard capture is a few samples wide and has hills beside it, so look everywhere first
    starts = places(stick.start, stick.starts, (low + margin, high - 2 * margin))
    ends = places(stick.end, stick.ends, (low + 2 * margin, high - margin))
    table = np.full((len(starts), len(ends)), np.inf)
    for i, start in enumerate(starts):
        for j, end in enumerate(ends):
            if end - start > step:
                table[i, j] = value(float(start), float(end))
    if not np.isfinite(table).any():
        return None
    row, column = divmod(int(np.argmin(table)), len(ends))
    start, end, best = float(starts[row]), float(ends[column]), float(table[row, column])
    for _ in range(2):
        if len(starts) > 1:
            start, best = _lower(partial(value, end=end), start, best, step, end - step / 2)
        if len(ends) > 1:
            end, best = _lower(partial(value, start), end, best, step, math.inf)
    if len(starts) > 1 and len(ends) > 1:
        without = search.slip(low, high, origin, "nowhere").integrated()
        if without - best < 2 * math.log((high - low) / step):
            return None
    start_error = _error(partial(value, end=end), start, best, step) if len(starts) > 1 else stick.start_error
    end_error = _error(partial(value, start), end, best, step) if len(ends) > 1 else stick.end_error
    return replace(stick, start=start, end=end, start_error=start_error, end_error=end_error)


def _lower(value: Callable[[float], float], at: float, now: float, step: float, most: float) -> tuple[float, float]:
    bounds = (at - step, min(at + step, most))
    if bounds[1] <= bounds[0]:
        return at, now
    found = minimize_scalar(value, bounds=bounds, method="bounded", options={"xatol": 0.05 * step, "maxiter": 12})
    return (float(found.x), float(found.fun)) if found.fun < now else (at, now)


def _error(value: Callable[[float], float], at: float, now: float, step: float) -> float:
    """Half the width over which the deviance rises by one, looked for outwards."""
    sides = []
    for sign in (-1, 1):
        reach = 0.25 * step
        while reach < 16 * step:
            rise = value(at + sign * reach) - now
            if rise >= 1:
                break
            reach *= 2
        sides.append(reach / math.sqrt(max(rise, 1.0)))
    return (sides[0] + sides[1]) / 2
