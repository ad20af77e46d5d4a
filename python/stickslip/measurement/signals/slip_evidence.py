"""The evidence of a slip: how likely the record makes it that the mass slips between two times."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.interpolate import BSpline
from scipy.linalg import LinAlgError
from scipy.linalg.lapack import dpotrf, dpotrs

from stickslip.measurement.signals.piecewise_fit import DEGREE, GAUSS_NODES, GAUSS_WEIGHTS, OscillatorConstants

Array = npt.NDArray[np.float64]

POWERS = np.arange(DEGREE + 1)


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
        return float(integrated_evidence(self.square, self.linear, self.constant))


def integrated_evidence(square: npt.ArrayLike, linear: npt.ArrayLike, constant: npt.ArrayLike) -> Array:
    """The evidences of :class:`Evidence` with these numbers, the level integrated out."""
    return np.asarray(np.asarray(constant) - np.square(linear) / square + np.log(square))


def _factor(matrix: Array) -> Array:
    """Lower triangle of a Cholesky factor; what SciPy adds to LAPACK costs as much for a matrix as small as these."""
    factor, failed = dpotrf(matrix, lower=True, clean=False)
    if failed:
        raise LinAlgError("the matrix is not positive definite")
    return np.asarray(factor)


def _log_of(factor: Array) -> float:
    """Log determinant of the matrix with this Cholesky factor."""
    return 2 * float(np.log(factor.diagonal()).sum())


def _solve(factor: Array, right: Array) -> Array:
    return np.asarray(dpotrs(factor, right, lower=True)[0])


@dataclass(frozen=True)
class SlipModel:
    """A record's slip path u = V t - x and the prior on its slips.

    A slip is a quintic spline whose friction force does a random walk of the strength that the cut-off says (the
    penalty of `PiecewiseFit` read as a prior), so that slips of different length compare by their evidence.

    Attributes
    ----------
    time, path, weight : (n,) as in `PiecewiseFit`.
    oscillator : m, D, k, V.
    noise : standard deviation of the path's samples.
    knots : distance of knots in s.
    cutoff : of the slips in Hz.
    slope : df/dw right after a break-away in N s/m, about which friction does its random walk: it falls as the slip speeds
        up, in every slip alike, and a walk about a constant would see each release late to make up for the fall.
    decay : of that slope with the time since the break-away, in 1/s.
    """

    time: Array
    path: Array
    weight: Array
    oscillator: OscillatorConstants
    noise: float
    knots: float
    cutoff: float
    slope: float = 0.0
    decay: float = 0.0

    @property
    def step(self) -> float:
        """Sampling interval in s."""
        return float((self.time[-1] - self.time[0]) / (len(self.time) - 1))

    def slip(self, start: float, end: float, origin: float, joined: str, soft: bool = False) -> Evidence:
        """Evidence of a slip that meets a stick (u = U, u' = 0) at its ``"start"`` or ``"end"``, or ``"nowhere"``.

        A `soft` joint has u'' = 0 too: the friction force does not jump there, and as df/dt = f'(w) w' with w' growing
        from zero, the random walk sets off as w' does while the friction still bears: like sqrt(k/m) t.
        """
        matrix, right, constant, prior, held = self._system(start, end, origin, soft, joined == "start")
        count = len(right)
        if joined == "nowhere":
            return Evidence(1.0, 0.0, constant + self._inner(matrix, right, prior, held, [0, 1, 2]))
        tied = 3 if soft else 2
        ends, free = slice(0, tied), slice(tied, count)
        if joined == "end":
            ends, free = slice(count - tied, count), slice(0, count - tied)
        inner, cross = matrix[free, free], matrix[free, ends].sum(axis=1)
        factor = _factor(inner)
        columns = np.empty((len(inner), 2), order="F")
        columns[:, 0], columns[:, 1] = right[free], cross
        solved = _solve(factor, columns)
        row = 2 if joined == "start" else 5
        log_prior = _log_determinant(prior[free, free], held[row : row if soft else row + 1, free])
        determinant = _log_of(factor)
        return Evidence(
            float(matrix[ends, ends].sum() - cross @ solved[:, 1]),
            float(right[ends].sum() - cross @ solved[:, 0]),
            constant - float(right[free] @ solved[:, 0]) + determinant - log_prior,
        )

    @staticmethod
    def _inner(matrix: Array, right: Array, prior: Array, held: Array, rows: list[int]) -> float:
        factor = _factor(matrix)
        determinant = _log_of(factor)
        misfit = -float(right @ _solve(factor, right))
        return misfit + determinant - _log_determinant(prior, held[rows])

    def _system(
        self, start: float, end: float, origin: float, soft: bool, released: bool
    ) -> tuple[Array, Array, float, Array, Array]:
        """Normal matrix, right side, constant, prior precision, and rows of the state (u, u', u'') at both ends.

        The slip begins with a break-away where it is `released`.
        """
        o = self.oscillator
        count = max(math.ceil((end - start) / self.knots), 2)
        h = (end - start) / count
        reference = _reference(count)
        part = slice(*self.time.searchsorted((start, end)))
        basis = reference.basis((self.time[part] - start) / h)
        y, w = self.path[part] - origin, self.weight[part] / self.noise**2
        weighted = basis.T * w
        # df/dt / m = target - sum_d factors[d] u^(d)
        factors = np.array([o.stiffness / o.mass / h, o.damping / o.mass / h**2, 1 / h**3])
        target = o.stiffness * o.drive_velocity / o.mass
        strength = 1 / (self.step * (2 * math.pi * self.cutoff) ** 6 * self.noise**2)
        rate = math.sqrt(o.stiffness / o.mass)
        weights = strength * h * reference.weights
        if soft:
            weights = weights * (1 + (rate * h * reference.nodes) ** -2)
        change = (factors @ reference.derivatives).reshape(basis.shape[1], -1)
        if released and self.slope:
            falls = self.slope * np.exp(-self.decay * h * reference.nodes)
            change += reference.derivatives[1].reshape(change.shape) * (falls / o.mass / h**2)
        prior = (change * weights) @ change.T
        right = weighted @ y + target * (change @ weights)
        constant = float(w @ (y * y)) + target**2 * float(weights.sum())
        units = np.array([rate, 1 / h, 1 / (h * h * rate)] * 2) / o.drive_velocity
        return weighted @ basis + prior, right, constant, prior, reference.ends * units[:, None]


@dataclass(frozen=True)
class _Reference:
    nodes: Array
    weights: Array
    derivatives: Array
    ends: Array
    pieces: Array

    def basis(self, positions: Array) -> Array:
        """(n, size) values of the splines: on every interval six polynomials of its own coordinate."""
        count, size = len(self.pieces), len(positions)
        interval = np.minimum(positions.astype(np.int64), count - 1)
        powers = (positions - interval)[:, None] ** POWERS
        values = np.zeros((size, count + DEGREE))
        local = (powers[:, None] @ self.pieces[interval])[:, 0]
        values[np.arange(size)[:, None], interval[:, None] + POWERS] = local
        return values


@lru_cache(maxsize=512)
def _reference(count: int) -> _Reference:
    """Splines on `count` intervals of length one: their derivatives 1 to 3 at Gauss nodes, and at both ends."""
    knots = np.concatenate([np.zeros(DEGREE), np.arange(count + 1.0), np.full(DEGREE, float(count))])
    size = count + DEGREE
    nodes = (np.arange(count)[:, None] + 0.5 + 0.5 * GAUSS_NODES).ravel()
    spline = BSpline(knots, np.eye(size), DEGREE)
    derivatives = np.stack([np.asarray(spline.derivative(d)(nodes)) for d in (1, 2, 3)])
    weights = np.tile(0.5 * GAUSS_WEIGHTS, count)
    limits = [(0.0, d) for d in range(3)] + [(float(count), d) for d in range(3)]
    ends = np.array([spline(position, nu=d) for position, d in limits])
    powers = 1 / np.array([math.factorial(p) for p in range(DEGREE + 1)])
    taylor = np.array([spline(np.arange(float(count)), nu=p) for p in range(DEGREE + 1)]) * powers[:, None, None]
    pieces = np.stack([taylor[:, i, i : i + DEGREE + 1] for i in range(count)])
    return _Reference(nodes, weights, derivatives.swapaxes(1, 2).reshape(len(derivatives), -1), ends, pieces)


def _log_determinant(precision: Array, held: Array) -> float:
    """Log determinant of a precision that leaves the held states open, per unit of those states."""
    own = held.T @ held
    scale = float(own.diagonal().sum() / precision.diagonal().sum()) if len(held) else 1.0
    factor = _factor(scale * precision + own)
    rank = len(precision) - len(held)
    return _log_of(factor) - rank * math.log(scale)
