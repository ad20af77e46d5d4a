"""The limits of a stick in a mass that does not creep: where the record is likeliest."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.interpolate import BSpline
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from stickslip.measurement.pieces import DEGREE, GAUSS_NODES, GAUSS_WEIGHTS, Oscillator
from stickslip.measurement.sticks import Stick, own_period

Array = npt.NDArray[np.float64]


LIMITS_COST = 6.0
"""What two free limits cost in deviance: each is known to about a sample and was looked for over some ten."""


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

    def slip(self, start: float, end: float, origin: float, joined: str, soft: bool = False) -> Evidence:
        """Evidence of a slip that meets a stick (u = U, u' = 0) at its ``"start"`` or ``"end"``, or ``"nowhere"``.

        A `soft` joint has u'' = 0 too: the friction force does not jump there.
        """
        matrix, right, constant, prior, held = self._system(start, end, origin)
        count = len(right)
        if joined == "nowhere":
            return Evidence(1.0, 0.0, constant + self._inner(matrix, right, prior, held, [0, 1, 2]))
        tied = 3 if soft else 2
        ends, free = slice(0, tied), slice(tied, count)
        if joined == "end":
            ends, free = slice(count - tied, count), slice(0, count - tied)
        inner, cross = matrix[free, free], matrix[free, ends].sum(axis=1)
        factor = cho_factor(inner, lower=True, check_finite=False)
        solved = cho_solve(factor, np.stack([right[free], cross], axis=1), check_finite=False)
        row = 2 if joined == "start" else 5
        log_prior = _log_determinant(prior[free, free], held[row : row if soft else row + 1, free])
        determinant = 2 * float(np.sum(np.log(np.diagonal(factor[0]))))
        return Evidence(
            float(matrix[ends, ends].sum() - cross @ solved[:, 1]),
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
        basis = reference.basis(places)
        y, w = self.path[part] - origin, self.weight[part]
        weighted = basis * (w / self.noise**2)[:, None]
        # df/dt / m = target - sum_d factors[d] u^(d)
        factors = np.array([o.stiffness / o.mass / h, o.damping / o.mass / h**2, 1 / h**3])
        target = o.stiffness * o.drive_velocity / o.mass
        strength = 1 / (self.step * (2 * math.pi * self.cutoff) ** 6 * self.noise**2)
        size = count + DEGREE
        pairs = strength * h * np.outer(factors, factors).ravel()
        prior = (pairs @ reference.products.reshape(9, -1)).reshape(size, size)
        right = weighted.T @ y + target * strength * h * (factors @ reference.integrals)
        constant = float(w @ (y * y)) / self.noise**2 + target**2 * strength * (end - start)
        rate = math.sqrt(o.stiffness / o.mass)
        units = np.array([rate, 1 / h, 1 / (h * h * rate)] * 2) / o.drive_velocity
        return weighted.T @ basis + prior, right, constant, prior, reference.ends * units[:, None]


@dataclass(frozen=True)
class _Reference:
    knots: Array
    products: Array
    integrals: Array
    ends: Array
    pieces: Array

    def basis(self, places: Array) -> Array:
        """(n, size) values of the splines: on every interval six polynomials of its own coordinate."""
        count = len(self.pieces)
        interval = np.minimum(places.astype(np.int64), count - 1)
        powers = (places - interval)[:, None] ** np.arange(DEGREE + 1)
        values = np.zeros((len(places), count + DEGREE))
        local = np.einsum("np,npj->nj", powers, self.pieces[interval])
        np.put_along_axis(values, interval[:, None] + np.arange(DEGREE + 1), local, axis=1)
        return values


@lru_cache(maxsize=512)
def _reference(count: int) -> _Reference:
    """Splines on `count` intervals of length one: integrals of products of their derivatives 1 to 3, and both ends."""
    knots = np.concatenate([np.zeros(DEGREE), np.arange(count + 1.0), np.full(DEGREE, float(count))])
    size = count + DEGREE
    nodes = (np.arange(count)[:, None] + 0.5 + 0.5 * GAUSS_NODES).ravel()
    spline = BSpline(knots, np.eye(size), DEGREE)
    derivatives = np.stack([np.asarray(spline.derivative(d)(nodes)) for d in (1, 2, 3)])
    weighted = derivatives * np.tile(0.5 * GAUSS_WEIGHTS, count)[:, None]
    limits = [(0.0, d) for d in range(3)] + [(float(count), d) for d in range(3)]
    ends = np.array([spline(place, nu=d) for place, d in limits])
    products = np.einsum("ink,jnl->ijkl", weighted, derivatives, optimize=True)
    powers = 1 / np.array([math.factorial(p) for p in range(DEGREE + 1)])
    taylor = np.array([spline(np.arange(float(count)), nu=p) for p in range(DEGREE + 1)]) * powers[:, None, None]
    pieces = np.stack([taylor[:, i, i : i + DEGREE + 1] for i in range(count)])
    return _Reference(knots, products, weighted.sum(axis=1), ends, pieces)


def _log_determinant(precision: Array, held: Array) -> float:
    """Log determinant of a precision that leaves the held states open, per unit of those states."""
    own = held.T @ held
    scale = float(np.trace(own) / np.trace(precision)) if len(held) else 1.0
    factor = cho_factor(scale * precision + own, lower=True, check_finite=False)
    rank = len(precision) - len(held)
    return 2 * float(np.sum(np.log(np.diagonal(factor[0])))) - rank * math.log(scale)


def refine_sticks(
    search: LimitSearch, sticks: list[Stick], span: float, soft: bool | None = None
) -> tuple[list[Stick], bool]:
    """Move the limits of each stick to where the record puts them, and drop sticks the record does not need.

    The stretch from the middle of the slip before to the middle of the slip after is taken as slip, rest, slip. A limit
    is where its evidence over time is greatest, or the mean of that evidence where the force does not jump and the
    peak is flat and skewed; its error is the spread of the evidence. A stick stays if it is likelier than a slip
    without it by more than its two limits cost. Whether the friction force jumps when
    a stick gives way is decided once for all sticks, by their evidence together.

    Parameters
    ----------
    search : the record.
    sticks : first guesses.
    span : how far to look on each side of a guess, in s.
    soft : whether the force jumps at a break-away where that is known already.

    Returns
    -------
    sticks, soft : with `soft` if the force does not jump at the break-away.
    """
    reach = own_period(search.oscillator) / 2
    choices = (False, True) if soft is None else (soft,)
    refined: dict[bool, list[Stick]] = {choice: [] for choice in choices}
    total = dict.fromkeys(choices, 0.0)
    for number, stick in enumerate(sticks):
        low, high = float(search.time[0]), float(search.time[-1])
        if number > 0:
            low = (sticks[number - 1].end + stick.start) / 2
        if number + 1 < len(sticks):
            high = (stick.end + sticks[number + 1].start) / 2
        one = _OneStick(search, stick, max(low, stick.start - reach), min(high, stick.end + reach), span)
        for choice in choices:
            try:
                found, deviance = one.refined(choice)
            except LinAlgError:
                found, deviance = stick, 0.0
            total[choice] += deviance
            if found is not None:
                refined[choice].append(found)
    best = min(choices, key=lambda choice: total[choice])
    return refined[best], best


class _OneStick:
    """The search for the limits of one stick between two times."""

    def __init__(self, search: LimitSearch, stick: Stick, low: float, high: float, span: float) -> None:
        self.search, self.stick, self.low, self.high, self.span = search, stick, low, high, span
        self.soft = False
        # one cut-off serves a whole slip, but friction changes fastest just before a capture, where a stiff slip would
        # push the capture late, and slowest after a break-away, where a lax slip would pass for rest
        self.before_search = replace(search, cutoff=1.5 * search.cutoff, knots=search.knots / 1.5)
        self.after_search = replace(search, cutoff=0.75 * search.cutoff)
        self.origin = float(np.interp((stick.start + stick.end) / 2, search.time, search.path))
        self.kept: dict[tuple[str, float], Evidence] = {}
        part = slice(*np.searchsorted(search.time, [low, high]))
        y, w = search.path[part] - self.origin, search.weight[part] / search.noise**2
        self.inside = search.time[part]
        self.sums = np.concatenate([np.zeros((3, 1)), np.cumsum([w, w * y, w * y * y], axis=1)], axis=1)

    def rest(self, start: float, end: float) -> Evidence:
        """Evidence of the samples between two times if the mass rests there."""
        a, b = np.searchsorted(self.inside, [start, end])
        return Evidence(*(self.sums[:, b] - self.sums[:, a]).tolist())

    def before(self, start: float) -> Evidence:
        key = ("before", start)
        if key not in self.kept:
            self.kept[key] = self.before_search.slip(self.low, start, self.origin, "end")
        return self.kept[key]

    def after(self, end: float) -> Evidence:
        key = ("soft" if self.soft else "hard", end)
        if key not in self.kept:
            self.kept[key] = self.after_search.slip(end, self.high, self.origin, "start", self.soft)
        return self.kept[key]

    def value(self, start: float, end: float) -> float:
        total = self.rest(start, end)
        if self.stick.starts:
            total = total + self.before(start)
        if self.stick.ends:
            total = total + self.after(end)
        return total.integrated()

    def refined(self, soft: bool) -> tuple[Stick | None, float]:
        """The stick with its limits and errors, or None, and the deviance of the stretch."""
        self.soft = soft
        stick, step = self.stick, self.search.step
        margin = 6 * step
        # the valley of a hard capture is a few samples wide and has hills beside it, so look everywhere first
        starts = self._places(
            stick.start, stick.starts, self.low + margin, self.high - (2 * margin if stick.ends else 3 * step)
        )
        ends = self._places(
            stick.end, stick.ends, self.low + (2 * margin if stick.starts else 3 * step), self.high - margin
        )
        table = np.full((len(starts), len(ends)), np.inf)
        for i, start in enumerate(starts):
            for j, end in enumerate(ends):
                if end - start > step:
                    table[i, j] = self.value(float(start), float(end))
        best = float(np.min(table))
        if not math.isfinite(best):
            return None, 0.0
        row, column = divmod(int(np.argmin(table)), len(ends))
        start, end = float(starts[row]), float(ends[column])
        if stick.starts and stick.ends:
            # both readings with one and the same cut-off, or they would not compare
            without = self.search.slip(self.low, self.high, self.origin, "nowhere").integrated()
            resting = (
                self.rest(start, end)
                + self.search.slip(self.low, start, self.origin, "end")
                + self.search.slip(end, self.high, self.origin, "start", soft)
            )
            if without - resting.integrated() < LIMITS_COST:
                return None, without
        start_error, end_error = stick.start_error, stick.end_error
        if len(starts) > 1:
            start, start_error = self._centre(lambda to: self.value(to, end), starts, table[:, column], False)
        if len(ends) > 1:
            end, end_error = self._centre(lambda to: self.value(start, to), ends, table[row], self.soft)
        if end - start < step:
            return None, best
        return replace(stick, start=start, end=end, start_error=start_error, end_error=end_error), best

    def _places(self, at: float, free: bool, lowest: float, highest: float) -> Array:
        a, b = max(at - self.span, lowest), min(at + self.span, highest)
        if not free or b <= a:
            return np.array([at])
        return np.linspace(a, b, max(math.ceil((b - a) / self.search.step), 2) + 1)

    def _centre(self, value: Callable[[float], float], places: Array, values: Array, soft: bool) -> tuple[float, float]:
        """Place and spread of a limit under its evidence, on a grid fine enough for it."""
        wide = np.flatnonzero(values < values.min() + 15)
        spacing = float(places[1] - places[0])
        a, b = float(places[wide[0]]) - spacing, float(places[wide[-1]]) + spacing
        a, b = max(a, float(places[0])), min(b, float(places[-1]))
        fine = np.linspace(a, b, int(np.clip(math.ceil(5 * (b - a) / spacing), 2, 16)) + 1)
        deviances = np.array([value(float(place)) if b > a else 0.0 for place in fine])
        deviances[~np.isfinite(deviances)] = np.inf
        likelihood = np.exp(-0.5 * (deviances - deviances.min()))
        likelihood /= likelihood.sum()
        mean = float(likelihood @ fine)
        spread = math.sqrt(float(likelihood @ (fine - mean) ** 2))
        # a grid cannot tell less than a part of its spacing
        spread = max(spread, (fine[1] - fine[0]) / math.sqrt(12), 1e-3 * self.search.step)
        if soft:
            return mean, spread
        i = int(np.clip(np.argmin(deviances), 1, len(fine) - 2))
        left, lowest, right = deviances[i - 1 : i + 2]
        bend = left + right - 2 * lowest
        shift = float(np.clip(0.5 * (left - right) / bend, -1, 1)) if 0 < bend < np.inf else 0.0
        return float(fine[i] + shift * (fine[1] - fine[0])), spread
