"""The way down: robust least squares by Levenberg and Marquardt, for many samples and few unknowns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

OUTLIER = 3.0
"""Residuals beyond that many standard deviations lose weight."""
ITERATIONS = 60
"""The most steps of one way down."""
PATIENCE = 4
"""Steps in a row that gain hardly anything, where a kink in the misfit holds the way down."""


def robust(rest: Array) -> tuple[float, Array]:
    """Σ ρ(r) and the weights ρ'(r)/(2r), with ρ(r) = 2 c² (√(1 + (r/c)²) − 1): squares near zero, straight far out.

    >>> cost, weight = robust(np.array([0.01, 300.0]))
    >>> round(cost), weight.round(2).tolist()
    (1782, [1.0, 0.01])
    """
    root = np.sqrt(1 + (rest / OUTLIER) ** 2)
    return float(2 * OUTLIER**2 * np.sum(root - 1)), 1 / root


def descend(
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
        loose = np.flatnonzero(~outward & (np.diag(curvature) > 0))
        inner = curvature[np.ix_(loose, loose)]
        if float(gradient[loose] @ np.linalg.lstsq(inner, gradient[loose], rcond=1e-14)[0]) < enough:
            break
        while damping < 1e10:
            push = np.linalg.solve(inner + damping * np.diag(np.diag(inner)), -gradient[loose])
            trial = at.copy()
            trial[loose] = np.clip(at[loose] + push, low[loose], high[loose])
            ahead = residuals(trial)
            lower, lighter = robust(ahead)
            if lower <= cost:
                steeper = slopes(trial)
                if not (acting(steep) & ~acting(steeper)).any():
                    break
            damping *= 5
        else:
            return at
        slow = slow + 1 if cost - lower < enough else 0
        at, rest, steep, cost, weight, damping = trial, ahead, steeper, lower, lighter, max(damping / 10, 1e-12)
        if slow == PATIENCE:
            break
    return at


def acting(slopes: Any) -> npt.NDArray[np.bool_]:
    """Which unknowns change a residual."""
    return np.asarray(abs(slopes).sum(axis=0)).ravel() > 0
