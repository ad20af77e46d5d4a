"""The motion nearest to a measured one that obeys a law: slip velocity and force have their errors from one displacement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg.lapack import dtbtrs

Array = npt.NDArray[np.float64]

STEEPEST_FALL = 0.9
"""A law that falls faster with w than m / h per unit of it cannot be followed with samples every h."""


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

    def solve(self, difference: Array, slope: Array, carried: Array | None = None) -> tuple[Array, Array]:
        """ε from rest at the first sample, and the motions that what is left open may add to it.

        Parameters
        ----------
        difference : e, measured minus predicted force, shape (n,).
        slope : F'(w) at each sample, shape (n,).
        carried : how friction changes with the slip velocity of the last turn, shape (n,), for a law that remembers it.

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
        drag = np.maximum((self.damping + slope) * self.step / (2 * self.mass), -STEEPEST_FALL)
        # Central differences, row by row the next sample from the two before it.
        band = np.zeros((3, n))
        band[0] = 1.0
        band[0, 2:] += drag[1:-1]
        band[1, 1:-1] = self.stiffness * h2 - 2
        band[2, :-2] = 1 - drag[1:-1]
        pushed = np.zeros((n, 3 if carried is None else 4))
        pushed[2:, 0] = h2 * difference[1:-1]
        pushed[:2, 1] = 1.0
        pushed[1, 2] = self.step
        if carried is not None:
            pushed[2:, 3] = h2 * carried[1:-1]
        found, _ = dtbtrs(band, pushed, uplo="L")
        return found[:, 0], found[:, 1:]


def without(open_motions: Array, residual: Array, prior: Array) -> Array:
    """The residual less what the open motions explain of it, as far as their priors let them.

    Parameters
    ----------
    open_motions : shape (n, m).
    residual : shape (n,); NaN where nothing was measured, which gives 0.
    prior : how large each may be, in the unit of the residual's noise; inf where it is free. Shape (m,).

    Returns
    -------
    shape (n + number of finite priors,): the residual, then what each bounded motion took relative to its prior.

    >>> line = np.arange(4.0)
    >>> without(line[:, None], 2 * line, np.array([np.inf])).round(12) + 0.0
    array([0., 0., 0., 0.])
    """
    bounded = np.flatnonzero(np.isfinite(prior))
    known = np.concatenate([np.isfinite(residual), np.ones(bounded.size, dtype=bool)])
    rows = np.zeros((bounded.size, open_motions.shape[1]))
    rows[np.arange(bounded.size), bounded] = 1 / prior[bounded]
    basis = np.linalg.qr(np.concatenate([open_motions, rows])[known])[0]
    rest = np.concatenate([residual, np.zeros(bounded.size)])
    rest[~known] = 0.0
    rest[known] -= basis @ (basis.T @ rest[known])
    return rest
