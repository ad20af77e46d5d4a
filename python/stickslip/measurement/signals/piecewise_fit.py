"""Smooth pieces that meet at events: the fit from which all velocities and accelerations here are taken."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy import sparse
from scipy.interpolate import BSpline
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.optimize import minimize_scalar

from stickslip.files.arrays import Array
from stickslip.measurement.signals.sampling import mean_step

Kind = Literal["slip", "creep", "rest"]
Part = Literal["slip", "creep"]

DEGREE = 5
BAND = DEGREE + 3
"""Diagonals of the normal matrix: a coefficient beside a joint hangs on the two numbers of the joint."""
GAUSS_NODES, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(5)
STRIDE = math.log(2)
"""Of the first look for a cut-off, in its logarithm: a valley of the likelihood is wider than an octave."""


@dataclass(frozen=True)
class OscillatorConstants:
    """What the fit knows of the oscillator: m, D, k and V in the units of the record."""

    mass: float
    damping: float
    stiffness: float
    drive_velocity: float


@dataclass
class PiecewiseFit:
    """Penalised quintic splines of the slip path u(t), one per piece, that meet with equal value and slope.

    The slip path is u = V t - x: constant while the mass sticks, and u' = w. Minimised is

        sum_i a_i (y_i - u(t_i))^2 + lambda_slip * integral over slips of (df/dt)^2
                                   + lambda_creep * integral over creeping sticks of (u''')^2,

    with the friction force f = k (V t - u) + D (V - u') - m u'', so inside a slip the fit prefers a friction force that
    changes little, and nothing is said about it across an event, where it may jump. A `rest` piece is held at
    constant u.

    Parameters
    ----------
    time, path : (n,) seconds, and the measured slip path.
    weight : (n,) 1 for a good sample, 0 for one that is left out.
    breaks : (j + 1,) limits of the pieces, the first and last at the ends of the record.
    kinds : (j,) "slip", "creep" or "rest".
    oscillator : m, D, k, V.
    slip_knots, creep_knots : distance of knots in seconds.
    together : samples that count as one, where neighbours have alike noise (:class:`~.coloured_noise.Colour`).

    Attributes
    ----------
    noise : residual standard deviation times the square root of `together`, of white noise of the same density.
    """

    time: Array
    path: Array
    weight: Array
    breaks: Array
    kinds: list[Kind]
    oscillator: OscillatorConstants
    slip_knots: float
    creep_knots: float
    together: float = 1.0
    coefficients: Array = field(init=False)
    noise: float = field(init=False)

    def __post_init__(self) -> None:
        self.step = mean_step(self.time)
        self.origin = float(self.time[0])
        # one offset keeps the squares small over a long record
        self.offset = float(np.median(self.path))
        knots = [
            np.linspace(a, b, 2 + (0 if kind == "rest" else _inner_knots(b - a, kind, self)))
            for a, b, kind in zip(self.breaks[:-1], self.breaks[1:], self.kinds, strict=True)
        ]
        self.knots = knots
        self._counts = np.array([len(piece) - 2 + DEGREE + 1 for piece in knots])
        self._make_joints()
        design = self.design(self.time, 0)
        weighted = _scale_rows(design, self.weight)
        self.normal = _lower_band(weighted.T @ design)
        self.right = weighted.T @ (self.path - self.offset)
        self.square = float(np.sum(self.weight * (self.path - self.offset) ** 2))
        self.samples = int(np.count_nonzero(self.weight))
        self._make_penalties()

    def _make_joints(self) -> None:
        """Map the free numbers (few per joint) to the coefficients of all pieces, so that u and u' are continuous."""
        entries: list[tuple[int, int, float]] = []
        column = -1
        starts = np.concatenate([[0], np.cumsum(self._counts)])
        joint: tuple[int, int | None] | None = None  # columns of value and slope at the left end
        for j, kind in enumerate(self.kinds):
            first, count = int(starts[j]), int(self._counts[j])
            if kind == "rest":
                if joint is None:
                    column += 1
                    joint = (column, None)
                entries += [(first + i, joint[0], 1.0) for i in range(count)]
                joint = (joint[0], None)
                continue
            spacing = (self.knots[j][1] - self.knots[j][0]) / DEGREE
            last_spacing = (self.knots[j][-1] - self.knots[j][-2]) / DEGREE
            inner_first = 0
            if joint is not None:
                value, slope = joint
                entries += [(first, value, 1.0), (first + 1, value, 1.0)]
                if slope is not None:
                    entries.append((first + 1, slope, spacing / self.slip_knots))
                inner_first = 2
            is_last = j == len(self.kinds) - 1
            inner_last = count if is_last else count - 2
            for i in range(inner_first, inner_last):
                column += 1
                entries.append((first + i, column, 1.0))
            if not is_last:
                next_rests = self.kinds[j + 1] == "rest"
                column += 1
                value = column
                slope = None
                entries += [(first + count - 2, value, 1.0), (first + count - 1, value, 1.0)]
                if not next_rests:
                    column += 1
                    slope = column
                    entries.append((first + count - 2, slope, -last_spacing / self.slip_knots))
                joint = (value, slope)
        rows, columns, values = map(np.array, zip(*entries, strict=True))
        shape = int(starts[-1]), column + 1
        self.joints: sparse.csr_matrix[np.float64] = sparse.csr_matrix((values, (rows, columns)), shape=shape)

    def _degree_knots(self, degree: int) -> Array:
        """Knots of all pieces for splines of this degree, with a full break between pieces."""
        parts = [np.full(degree + 1, self.breaks[0])]
        for piece, end in zip(self.knots, self.breaks[1:], strict=True):
            parts += [piece[1:-1], np.full(degree + 1, end)]
        return np.concatenate(parts)

    def design(self, time: Array, derivative: int) -> sparse.csr_matrix:
        """Matrix that takes the free numbers to the derivative of u at these times."""
        return self._raw_design(time, derivative) @ self.joints

    def _raw_design(self, time: Array, derivative: int) -> sparse.csr_matrix:
        degree = DEGREE - derivative
        basis = BSpline.design_matrix(time, self._degree_knots(degree), degree)
        return basis @ self._differentiation(derivative) if derivative else sparse.csr_matrix(basis)

    def _differentiation(self, derivative: int) -> sparse.csr_matrix:
        product: sparse.csr_matrix | None = None
        for order in range(derivative):
            degree = DEGREE - order
            knots = self._degree_knots(degree)
            count = len(knots) - degree - 1
            span = knots[degree + 1 : degree + count] - knots[1:count]
            inside = np.flatnonzero(span > 0)  # a pair that straddles a break has none
            factor = degree / span[inside]
            rows = np.arange(len(inside))
            step = sparse.csr_matrix(
                (
                    np.concatenate([-factor, factor]),
                    (np.concatenate([rows, rows]), np.concatenate([inside, inside + 1])),
                ),
                shape=(len(inside), count),
            )
            product = step if product is None else step @ product
        assert product is not None
        return product

    def _make_penalties(self) -> None:
        o = self.oscillator
        size = self.joints.shape[1]
        self.penalty: dict[Part, Array] = {}
        self.penalty_right: dict[Part, Array] = {}
        self.penalty_square: dict[Part, float] = {}
        self.rank: dict[Part, int] = {}
        for part in ("slip", "creep"):
            pieces = [j for j, kind in enumerate(self.kinds) if kind == part]
            self.penalty[part] = np.zeros((BAND, size))
            self.penalty_right[part] = np.zeros(size)
            self.penalty_square[part] = 0.0
            self.rank[part] = 0
            if not pieces:
                continue
            nodes, weights = _quadrature([self.knots[j] for j in pieces])
            if part == "slip":
                # df/dt / m = (k V - k u' - D u'' - m u''') / m; the weight is per unit inertia
                rows = self.design(nodes, 3)
                rows = rows + self.design(nodes, 2) * (o.damping / o.mass)
                rows = (rows + self.design(nodes, 1) * (o.stiffness / o.mass)).tocsr()
                target = np.full(len(nodes), o.stiffness * o.drive_velocity / o.mass)
            else:
                rows = self.design(nodes, 3)
                target = np.zeros(len(nodes))
            weighted = _scale_rows(rows, weights)
            self.penalty[part] = _lower_band(weighted.T @ rows)
            self.penalty_right[part] = weighted.T @ target
            self.penalty_square[part] = float(np.sum(weights * target**2))
            self.rank[part] = int(sum(self._counts[j] - 3 for j in pieces))

    def weights(self, cutoff: dict[Part, float]) -> dict[Part, float]:
        """Penalty weights from cut-off frequencies (Hz) at which the fit passes half of a sine."""
        return {part: 1 / (self.step * (2 * math.pi * frequency) ** 6) for part, frequency in cutoff.items()}

    def _system(self, cutoff: dict[Part, float]) -> tuple[Array, Array, float]:
        matrix, right, square = self.normal.copy(), self.right.copy(), self.square
        for part, weight in self.weights(cutoff).items():
            matrix += weight * self.penalty[part]
            right += weight * self.penalty_right[part]
            square += weight * self.penalty_square[part]
        # a stretch without good samples may leave a number undetermined to rounding
        matrix[0] *= 1 + 1e-13
        return matrix, right, square

    def solve(self, cutoff: dict[Part, float]) -> PiecewiseFit:
        """Fit with these cut-offs (Hz); sets `coefficients` and `noise`."""
        matrix, right, square = self._system(cutoff)
        self.cutoff = dict(cutoff)
        self.factor = cholesky_banded(matrix, lower=True, check_finite=False)
        self.coefficients = cho_solve_banded((self.factor, True), right, check_finite=False)
        misfit = max(square - float(right @ self.coefficients), 0.0)
        self.noise = math.sqrt(self.together * misfit / max(self.samples - self._diffuse(), 1))
        return self

    def _diffuse(self) -> int:
        return max(self.joints.shape[1] - self.rank["slip"] - self.rank["creep"], 1)

    def deviance(self, cutoff: dict[Part, float], noise: float | None = None) -> float:
        """-2 log marginal likelihood of the record under these cut-offs, the unknown path integrated out.

        With `noise` (the standard deviation of the samples) known, or profiled over it where it is None.
        """
        matrix, right, square = self._system(cutoff)
        factor = cholesky_banded(matrix, lower=True, check_finite=False)
        solution = cho_solve_banded((factor, True), right, check_finite=False)
        misfit = max(square - float(right @ solution), 1e-300)
        free = max(self.samples / (self.together if noise is None else 1.0) - self._diffuse(), 1.0)
        value = 2 * float(np.sum(np.log(factor[0])))
        for part, weight in self.weights(cutoff).items():
            value -= self.rank[part] * math.log(weight)
        if noise is None:
            return value + free * math.log(misfit / free)
        return value + misfit / noise**2 + free * math.log(noise**2)

    def best_cutoff(self, part: Part, limits: tuple[float, float], others: dict[Part, float]) -> float:
        """Cut-off (Hz) of one part that makes the record most likely."""

        def value(log_frequency: float) -> float:
            return self.deviance({**others, part: math.exp(log_frequency)})

        return math.exp(deepest_valley(value, math.log(limits[0]), math.log(limits[1]), 0.05))

    def piece(self, time: Array) -> npt.NDArray[np.int64]:
        """Index of the piece in which each time lies: at an event the one that begins there."""
        return np.asarray(np.searchsorted(self.breaks[1:-1], time, side="right"), np.int64)

    def evaluate(self, time: Array, derivative: int) -> Array:
        """u or a derivative of it at these times, from the piece on the right at an event."""
        values = np.asarray(self._raw_design(time, derivative) @ np.asarray(self.joints @ self.coefficients))
        return values + self.offset if derivative == 0 else values

    def deviation(self, time: Array, terms: dict[int, float], noise: float) -> Array:
        """Standard error of sum over derivatives d of terms[d] * u^(d) at these times.

        It holds the noise and what the smoothing leaves open (the posterior of the penalty read as a prior).
        """
        stacked = sparse.vstack(
            [self.design(time, derivative).multiply(factor) for derivative, factor in terms.items()]
        )
        positions = np.tile(np.arange(len(time)), len(terms))
        total = sparse.csr_matrix((np.ones(len(positions)), (positions, np.arange(len(positions)))))
        rows: sparse.csr_matrix = total @ stacked
        size = self.joints.shape[1]
        # columns of the inverse fade within some tens of knots, so unit vectors that far apart share one solve
        stride = min(size, 96)
        index = np.arange(size)
        probes = np.zeros((size, stride))
        probes[index, index % stride] = 1.0
        inverse = cho_solve_banded((self.factor, True), probes, check_finite=False)
        coo = rows.tocoo()
        # variance = sum_ij r_i C_ij r_j: first C r restricted to the columns of the row
        order = np.argsort(coo.row, kind="stable")
        row, col, val = coo.row[order], coo.col[order], coo.data[order]
        counts = np.bincount(row, minlength=len(time))
        width = int(counts.max(initial=1))
        table = np.zeros((len(time), width), dtype=np.int64)
        factors = np.zeros((len(time), width))
        position = np.arange(len(row)) - np.repeat(np.concatenate([[0], np.cumsum(counts)[:-1]]), counts)
        table[row, position] = col
        factors[row, position] = val
        variance = np.zeros(len(time))
        for i in range(width):
            for j in range(width):
                variance += factors[:, i] * factors[:, j] * inverse[table[:, i], table[:, j] % stride]
        return noise * np.sqrt(np.maximum(variance, 0.0))


def deepest_valley(value: Callable[[float], float], low: float, high: float, tolerance: float) -> float:
    """Where between `low` and `high` a function is least: a look at every `STRIDE`, then a search about the best.

    A search alone ends in whichever valley it falls into. That of a cut-off at which all motion counts as noise lies beside
    that of the motion where a period has few samples.

    Examples
    --------
    >>> round(deepest_valley(lambda x: min((x - 1) ** 2, (x - 6.3) ** 2 - 1), 0.0, 9.0, 1e-3), 2)
    6.3
    """
    at = np.linspace(low, high, max(math.ceil((high - low) / STRIDE), 1) + 1)
    seen = [value(float(x)) for x in at]
    best = int(np.argmin(seen))
    bounds = float(at[max(best - 1, 0)]), float(at[min(best + 1, len(at) - 1)])
    found = minimize_scalar(value, bounds=bounds, method="bounded", options={"xatol": tolerance, "maxiter": 20})
    return float(found.x) if found.fun <= seen[best] else float(at[best])


def _inner_knots(length: float, kind: Kind, fit: PiecewiseFit) -> int:
    spacing = fit.slip_knots if kind == "slip" else fit.creep_knots
    return max(math.ceil(length / spacing) - 1, 0)


def _quadrature(pieces: list[Array]) -> tuple[Array, Array]:
    left = np.concatenate([piece[:-1] for piece in pieces])
    right = np.concatenate([piece[1:] for piece in pieces])
    half = (right - left) / 2
    nodes = (left + half)[:, None] + half[:, None] * GAUSS_NODES
    weights = half[:, None] * GAUSS_WEIGHTS
    return nodes.ravel(), weights.ravel()


def _scale_rows(matrix: sparse.csr_matrix, factors: Array) -> sparse.csr_matrix:
    return sparse.csr_matrix(sparse.diags_array(factors) @ matrix)


def _lower_band(matrix: sparse.spmatrix) -> Array:
    """Lower band of a symmetric sparse matrix as LAPACK wants it."""
    coo = sparse.tril(matrix).tocoo()
    band = np.zeros((BAND, matrix.shape[0]))
    np.add.at(band, (coo.row - coo.col, coo.col), coo.data)
    return band
