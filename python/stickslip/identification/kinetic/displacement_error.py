"""The motion nearest to a measured one that obeys a law: slip velocity and force have their errors from one displacement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stickslip import _core
from stickslip.files.arrays import Array


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
        oscillator = self.step, self.mass, self.damping, self.stiffness
        found = _core.displacement_errors(oscillator, difference, slope, carried, lengths or (difference.size,))
        return found[0], found[1:].T


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
    motions = np.ascontiguousarray(open_motions.T)
    return _core.without(motions, residual, prior.tolist(), lengths or (residual.size,))
