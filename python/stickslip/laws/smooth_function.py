"""A user's own friction law as a smooth one: polynomials that meet the function within a stated error, carried as data."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike

from stickslip.errors import InputError, positive
from stickslip.files.arrays import Array
from stickslip.laws.piecewise_polynomial import PiecewisePolynomial
from stickslip.laws.tabulation import evaluate, table, uneven

_DEGREE = 16
_RELATIVE = 1e-13
#: Where a piece is compared with the function, besides the points of a fixed set that lie in it.
_CHECKS = 48
_NARROWEST = 1e-10
_MOST_PIECES = 1000


#: Chebyshev points of a piece from −1 to 1, and the matrix from values there to Chebyshev coefficients.
_POINTS = -np.cos(np.pi * np.arange(_DEGREE + 1) / _DEGREE)
_COEFFICIENTS = np.linalg.inv(chebyshev.chebvander(_POINTS, _DEGREE))


def smooth_from_function(
    f: Callable[[Any], Any] | ArrayLike,
    w_max: float | None = None,
    derivative: Callable[[Any], Any] | None = None,
    break_away: float | None = None,
    error: float | None = None,
) -> PiecewisePolynomial:
    """A smooth law from a function or a table of the kinetic force.

    Its Hopf speeds, multipliers and periods are those of the function, to about the error. Beyond w_max the tangent goes on.

    Parameters
    ----------
    f : the kinetic force over the slip speed, smooth on [0, w_max]: a function of one number (or array); or a table of two
        columns, slip speed (from 0, increasing) and force, through which a cubic spline is laid, or of three columns, the
        third being the slope, for cubic Hermite pieces.
    w_max : the largest slip speed that will occur; only for a function.
    derivative : f′ as a function: the law is checked against it too.
    break_away : f_s, at least f(0); default f(0).
    error : the largest deviation from f on [0, w_max], in the unit of force; default 1e-13 of the largest force.

    Returns
    -------
    PiecewisePolynomial of degree 16 for a function, of degree 3 for a table.

    Raises
    ------
    InputError
        where f gives anything but finite numbers, is not smooth enough for the error, or `derivative` is not its derivative.

    How the error is met: a piece is halved until the polynomial through its Chebyshev points deviates by no more than `error`
    at 48 other points of the piece, and at those of 4096 uneven points of [0, w_max] that lie in it (a feature narrower than
    w_max/10,000 can be missed). Where a root or a power of w makes f steep at rest, pieces become narrow there.

    Source: Trefethen, Approximation Theory and Approximation Practice (SIAM 2013), ch. 8: the error falls geometrically with
    the degree for a function that is analytic around a piece.

    >>> import numpy as np
    >>> law = smooth_from_function(lambda w: 0.5 + 0.5 * np.exp(-w), 4.0, derivative=lambda w: -0.5 * np.exp(-w))
    >>> len(law.nodes), bool(abs(law.kinetic_force(0.3) - 0.5 - 0.5 * np.exp(-0.3)) < 1e-13)
    (17, True)
    """
    where = "smooth_from_function"
    if not callable(f):
        if any(given is not None for given in (w_max, derivative, error)):
            raise InputError(
                f"{where}: w_max, derivative and error are for a function, and f is a table, whose slopes are its third "
                "column: leave them out"
            )
        nodes, degree = _spline(f, where), 3
    else:
        if w_max is None:
            raise InputError(f"{where}: w_max is missing; give the largest slip speed that will occur")
        nodes, degree = _pieces(f, derivative, positive("w_max", w_max, where), error, where), _DEGREE
    pairs = tuple((float(w), float(force)) for w, force in nodes)
    return PiecewisePolynomial(pairs, pairs[0][1] if break_away is None else break_away, degree)


def _pieces(
    f: Callable[[Any], Any], derivative: Callable[[Any], Any] | None, top: float, error: float | None, where: str
) -> Array:
    everywhere = uneven(top)
    values = evaluate(f, everywhere, where)
    allowed = _RELATIVE * float(np.abs(values).max()) if error is None else positive("error", error, where)
    left = [(0.0, top)]
    done: list[Array] = []
    while left:
        low, high = left.pop()
        # The ends of neighbours are the same numbers, to the bit.
        w = low + (high - low) * (0.5 + 0.5 * _POINTS)
        w[0], w[-1] = low, high
        force = evaluate(f, w, where)
        inner = low + (high - low) * (np.arange(_CHECKS) + 0.382) / _CHECKS
        inside = slice(*np.searchsorted(everywhere, [low, high]))
        other = np.concatenate([inner, everywhere[inside]])
        coefficients = _COEFFICIENTS @ force
        at = (2 * other - (low + high)) / (high - low)
        found = np.concatenate([evaluate(f, inner, where), values[inside]])
        off = np.abs(chebyshev.chebval(at, coefficients) - found)
        if off.max() > allowed:
            if high - low < _NARROWEST * top or len(left) + len(done) > _MOST_PIECES:
                raise InputError(
                    f"{where}: f is not smooth enough near w = {other[off.argmax()]:.6g}, where a narrow piece still "
                    f"deviates by {off.max():.2g}, and {allowed:.2g} is allowed: allow a larger error, or use "
                    "from_function for a law with corners"
                )
            middle = 0.5 * (low + high)
            left += [(middle, high), (low, middle)]
            continue
        if derivative is not None:
            slope = chebyshev.chebval(at, chebyshev.chebder(coefficients)) * 2 / (high - low)
            given = evaluate(derivative, other, where, "derivative")
            # Markov: so much steeper may what deviates by `allowed` be.
            steeper = np.abs(slope - given) > 4 * _DEGREE**2 * allowed / (high - low) + 1e-9 * np.abs(given)
            if steeper.any():
                i = int(steeper.argmax())
                raise InputError(
                    f"{where}: expected the derivative of f, which is {slope[i]:.6g} at w = {other[i]:.6g}, got "
                    f"{given[i]:.6g}; correct derivative, or leave it out"
                )
        done.append(np.stack([w, force], axis=1)[len(done) > 0 :])
    return np.concatenate(done)


def _spline(rows: Any, where: str) -> Array:
    from scipy.interpolate import CubicHermiteSpline, CubicSpline

    w, *columns = table(rows, where, most=3)
    spline = CubicSpline(w, columns[0]) if len(columns) == 1 else CubicHermiteSpline(w, columns[0], columns[1])
    share = np.array([0.0, 0.25, 0.75])
    inner = w[:-1, None] + np.diff(w)[:, None] * share
    at = np.append(inner.ravel(), w[-1])
    force = np.asarray(spline(at), float)
    force[::3] = columns[0]  # to the bit
    return np.stack([at, force], axis=1)
