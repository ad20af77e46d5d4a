"""Robust least squares: scipy's for dense problems, Levenberg and Marquardt on normal equations for long sparse ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import optimize

from stickslip.errors import InputError
from stickslip.files.arrays import Array, Mask

OUTLIER = 3.0
"""Residuals beyond that many standard deviations lose weight."""
ITERATIONS = 60
"""Most steps of one descent."""
PATIENCE = 4
"""Steps in a row that gain hardly anything, after which a descent that is held by a kink ends."""


@dataclass(frozen=True)
class Minimum:
    """Where a sum of squares is least.

    Attributes
    ----------
    vector : the search vector there.
    residuals : shape (n,), without the weights of a robust loss.
    jacobian : shape (n, parameters), with these weights.
    cost : half of the robust sum of squares.
    """

    vector: Array
    residuals: Array
    jacobian: Array
    cost: float


def minimize(
    residuals: Callable[[Array], Array],
    starts: Sequence[Array],
    bounds: tuple[Array, Array] | None = None,
    jacobian: Callable[[Array], Array] | None = None,
    *,
    outlier: float | None = None,
    scale: Array | None = None,
    step: float | None = None,
    evaluations: int | None = None,
    tolerance: float = 1e-8,
) -> Minimum:
    """The least sum of squares that is reached from any of the starting points (scipy's ``least_squares``).

    Parameters
    ----------
    residuals : of the search vector, shape (n,), in units of their errors. An InputError says that there is no model there;
        such a step is refused.
    starts : starting points; what lies outside the bounds is put on them.
    bounds : limits of the search vector.
    jacobian : derivatives of the residuals, shape (n, parameters); default differences.
    outlier : residuals beyond it count by their size instead of their square; default all count by their square.
    scale : steps of the parameters that change the residuals alike; default from the Jacobian.
    step : relative step of the differences.
    evaluations : most evaluations of the residuals from each starting point.
    tolerance : of the sum of squares and the vector, relative.

    >>> t = np.linspace(0, 3, 50)
    >>> found = minimize(lambda p: p[0] * np.exp(-p[1] * t) - 2 * np.exp(-0.7 * t), [np.array([1.0, 1.0])])
    >>> found.vector.round(6).tolist()
    [2.0, 0.7]
    """
    low, high = (-np.inf, np.inf) if bounds is None else bounds

    def search(start: Array) -> Minimum:
        here = residuals(start)
        # A step to where there is no model is refused by a misfit that is worse than any seen.
        refused = np.full_like(here, 10 * float(np.max(np.abs(here))) + 1.0)

        def guarded(trial: Array) -> Array:
            try:
                return residuals(trial)
            except InputError:
                return refused

        found = optimize.least_squares(
            guarded,
            start,
            jac="2-point" if jacobian is None else jacobian,
            bounds=(low, high),
            loss="linear" if outlier is None else "soft_l1",
            f_scale=1.0 if outlier is None else outlier,
            x_scale="jac" if scale is None else scale,
            diff_step=None if step is None else np.full(start.size, step),
            max_nfev=evaluations,
            ftol=tolerance,
            xtol=tolerance,
        )
        return Minimum(found.x, found.fun, np.asarray(found.jac, dtype=float), float(found.cost))

    return min((search(np.clip(start, low, high)) for start in starts), key=lambda minimum: minimum.cost)


def linear(columns: Array, target: Array, error: Array | float = 1.0) -> Array:
    """Coefficients of the columns, shape (n, p), by weighted least squares; columns of any size."""
    size = np.linalg.norm(columns, axis=0)
    size[size == 0] = 1.0
    weight = 1 / np.broadcast_to(error, target.shape)
    return np.asarray(np.linalg.lstsq(columns / size * weight[:, None], target * weight, rcond=None)[0] / size)


def project_out(columns: Array) -> Callable[[Array], Array]:
    """What is left of residuals once these columns are fitted to them: parameters that enter linearly need no search.

    Source: variable projection, Golub & Pereyra, SIAM J. Numer. Anal. 10 (1973) 413.

    >>> project_out(np.ones((3, 1)))(np.array([1.0, 2.0, 6.0])).round(12).tolist()
    [-2.0, -1.0, 3.0]
    """
    base = np.linalg.qr(columns)[0]
    return lambda values: np.asarray(values - base @ (base.T @ values))


def robust(rest: Array) -> tuple[float, Array]:
    """Σ ρ(r) and the weights ρ'(r)/(2r), with ρ(r) = 2 c² (√(1 + (r/c)²) − 1): squares near zero, straight far out.

    >>> cost, weight = robust(np.array([0.01, 300.0]))
    >>> round(cost), weight.round(2).tolist()
    (1782, [1.0, 0.01])
    """
    root = np.sqrt(1 + (rest / OUTLIER) ** 2)
    return float(2 * OUTLIER**2 * np.sum(root - 1)), 1 / root


def levenberg_marquardt(
    residuals: Callable[[Array], Array],
    slopes: Callable[[Array], Any],
    bounds: tuple[Array, Array],
    start: Array,
    enough: float,
    held: Sequence[int] = (),
) -> Array:
    """The unknowns at which Σ ρ(residuals) is least, from a start near them.

    Normal equations, as the samples are many and the unknowns few. A step after which an unknown has no effect any more is
    not taken: from such a plateau nothing leads back.

    Parameters
    ----------
    residuals : of the unknowns, shape (samples,), in units of the noise.
    slopes : their derivatives, shape (samples, unknowns), an array or a sparse one.
    bounds : limits of the unknowns.
    start : where it begins; what lies outside the bounds is put on them.
    enough : it ends where no step could lower the sum of squares by more.
    held : unknowns that stay.
    """
    low, high = bounds
    at = np.clip(start, low, high)
    rest, steep = residuals(at), slopes(at)
    (cost, weight), damping, slow = robust(rest), 1e-3, 0
    for _ in range(ITERATIONS):
        gradient = steep.T @ (weight * rest)
        curvature = steep.T @ (weight[:, None] * steep)
        curvature = np.asarray(curvature.toarray() if hasattr(curvature, "toarray") else curvature)
        outward = ((at <= low) & (gradient > 0)) | ((at >= high) & (gradient < 0))
        outward[list(held)] = True
        interior = np.flatnonzero(~outward & (np.diag(curvature) > 0))
        inner = curvature[np.ix_(interior, interior)]
        if float(gradient[interior] @ np.linalg.lstsq(inner, gradient[interior], rcond=1e-14)[0]) < enough:
            break
        while damping < 1e10:
            push = np.linalg.solve(inner + damping * np.diag(np.diag(inner)), -gradient[interior])
            trial = at.copy()
            trial[interior] = np.clip(at[interior] + push, low[interior], high[interior])
            ahead = residuals(trial)
            lower, lighter = robust(ahead)
            if lower <= cost:
                steeper = slopes(trial)
                if not (has_effect(steep) & ~has_effect(steeper)).any():
                    break
            damping *= 5
        else:
            return at
        slow = slow + 1 if cost - lower < enough else 0
        at, rest, steep, cost, weight, damping = trial, ahead, steeper, lower, lighter, max(damping / 10, 1e-12)
        if slow == PATIENCE:
            break
    return at


def has_effect(slopes: Any) -> Mask:
    """Which unknowns change a residual."""
    return np.asarray(abs(slopes).sum(axis=0)).ravel() > 0
