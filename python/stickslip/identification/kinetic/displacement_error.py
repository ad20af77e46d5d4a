"""The motion nearest to a measured one that obeys a law: slip velocity and force have their errors from one displacement."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.linalg.lapack import dtbtrs

Array = npt.NDArray[np.float64]
Samples = npt.NDArray[np.int_]

STEEPEST_FALL = 0.9
"""A law that falls faster with w than m / h per unit of it cannot be followed with samples every h."""
DEPENDENT = 1e-14
"""Of a motion that others make up no more than this part is left by rounding."""


@dataclass(frozen=True)
class DisplacementError:
    """The oscillator through which an error of the displacement reaches both coordinates of friction over slip velocity.

    The force of the indirect method, m x'' + D x' + k x, and the slip velocity w = V − x' come from one displacement. Where
    that is off by ε from a motion that obeys the law F(w), the measured force is off from the law by

        e = m ε'' + (D + F'(w)) ε' + k ε

    to first order. Solved for ε, with what it starts from left open, x − ε is the motion that obeys the law; what is
    compared is how far the instrument's own samples are from it. Their noise is white, and neither the noise of w nor what
    smoothing did to w and to the corners of the force biases the law.

    Attributes
    ----------
    step : sampling interval.
    mass, damping, stiffness : of the oscillator.

    Source: least squares with errors in both coordinates, Deming (1943), by the tangent of the equation of motion.

    Limits: first order in ε; a change of the law at a turn of w enters by `carried` only.
    """

    step: float
    mass: float
    damping: float
    stiffness: float

    def solve(
        self, difference: Array, slope: Array, carried: Array | None = None, lengths: tuple[int, ...] = ()
    ) -> tuple[Array, Array]:
        """ε from rest at the first sample, and the motions that what is left open may add to it.

        Parameters
        ----------
        difference : e, measured minus predicted force, shape (n,).
        slope : F'(w) at each sample, shape (n,).
        carried : how friction changes with the slip velocity of the last turn, shape (n,), for a law that remembers it.
        lengths : numbers of samples of the stretches that follow each other, each from rest anew; none: one stretch.

        Returns
        -------
        ε, shape (n,), and the open motions, shape (n, 2 or 3): a shift, a speed at the start, an error of the last turn.

        >>> still = DisplacementError(step=0.01, mass=1.0, damping=0.0, stiffness=1.0)
        >>> t = 0.01 * np.arange(300)
        >>> found, free = still.solve(np.ones(300), np.zeros(300))
        >>> bool(np.allclose(found, 1 - np.cos(t), atol=1e-2)), bool(np.allclose(free[:, 1], np.sin(t), atol=1e-2))
        (True, True)
        """
        n, h2 = difference.size, self.step**2 / self.mass
        begins, _, rows = _stretches(lengths or (n,))
        drag = np.maximum((self.damping + slope) * self.step / (2 * self.mass), -STEEPEST_FALL)
        # Central differences, row by row the next sample from the two before it, of which every stretch begins with its own.
        band = np.zeros((3, n), order="F")
        band[0] = 1.0
        band[0, rows] += drag[rows - 1]
        band[1, rows - 1] = self.stiffness * h2 - 2
        band[2, rows - 2] = 1 - drag[rows - 1]
        pushed = np.zeros((n, 3 if carried is None else 4), order="F")
        pushed[rows, 0] = h2 * difference[rows - 1]
        pushed[begins, 1] = 1.0
        pushed[begins + 1, 1:3] = 1.0, self.step
        if carried is not None:
            pushed[rows, 3] = h2 * carried[rows - 1]
        found, _ = dtbtrs(band, pushed, uplo="L", overwrite_b=True)
        return found[:, 0], found[:, 1:]


@lru_cache(maxsize=64)
def _stretches(lengths: tuple[int, ...], more: int = 0) -> tuple[Samples, Samples, Samples]:
    """Of stretches with so many more rows each: the first row, the stretch of each row, the rows with two before them."""
    sizes = np.array(lengths) + more
    begins = np.cumsum(sizes) - sizes
    rows = np.arange(sizes.sum())
    stretch = np.repeat(np.arange(sizes.size), sizes)
    return begins, stretch, rows[rows >= begins[stretch] + 2]


def without(open_motions: Array, residual: Array, prior: Array, lengths: tuple[int, ...] = ()) -> Array:
    """The residual less what the open motions explain of it, as far as their priors let them.

    Parameters
    ----------
    open_motions : shape (n, m).
    residual : shape (n,); NaN where nothing was measured, which gives 0.
    prior : how large each may be, in the unit of the residual's noise; inf where it is free. Shape (m,).
    lengths : numbers of samples of the stretches that follow each other, each with motions of its own; none: one stretch.

    Returns
    -------
    shape (n + number of finite priors,) of each stretch: the residual, then what each bounded motion took relative to its
    prior.

    >>> line = np.arange(4.0)
    >>> without(line[:, None], 2 * line, np.array([np.inf])).round(12) + 0.0
    array([0., 0., 0., 0.])
    """
    lengths = lengths or (residual.size,)
    bounded = np.flatnonzero(np.isfinite(prior))
    begins, stretch, _ = _stretches(lengths, bounded.size)
    # Behind the samples of a stretch comes a row for each motion that is bounded there.
    extra = (begins + lengths)[:, None] + np.arange(bounded.size)
    sampled = np.ones(stretch.size, dtype=bool)
    sampled[extra] = False
    rest = np.zeros(stretch.size)
    known = np.isfinite(residual)
    rest[sampled] = np.where(known, residual, 0.0)

    def along(one: Array, other: Array) -> Array:
        return np.add.reduceat(one * other, begins)[stretch]

    basis: list[Array] = []
    for number, motion in enumerate(open_motions.T):
        column = np.zeros(stretch.size)
        column[sampled] = np.where(known, motion, 0.0)
        column[extra[:, bounded == number]] = 1 / prior[number]
        # Of a law that falls steeply they grow beyond what a square may be.
        largest = np.maximum.reduceat(np.abs(column), begins)[stretch]
        column /= np.where(largest > 0, largest, 1.0)
        size = along(column, column)
        # Twice is enough for a basis that is orthogonal to rounding (Kahan and Parlett).
        for other in (*basis, *basis):
            column = column - along(other, column) * other
        left = along(column, column)
        # What the motions before it make up but for rounding explains nothing more.
        column[left <= DEPENDENT**2 * size] = 0.0
        basis.append(column / np.sqrt(np.where(left > 0, left, 1.0)))
    for column in basis:
        rest -= along(column, rest) * column
    return rest
