"""Noise that is alike from one sample to the next: how many samples count as one."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from stickslip.files.arrays import Array

DEGREE = 5
"""Of the polynomial taken out of each stretch: creep, the swing of a mass that does not stick, and a slow ripple."""
SHORTEST_STRETCH, LONGEST_STRETCH = 24, 128
"""Samples of a stretch."""
FEWEST_STRETCHES = 3
"""Stretches that tell how noise is correlated."""
VARIANCE_RATIO = 6.0
"""A stretch whose samples scatter with so many times the usual variance holds more than noise."""
SHARES = 1e-4, 1 - 1e-4
"""Of the variance, that coloured noise may have."""
CORRELATIONS = 0.2, 0.99
"""Of coloured noise, from one sample to the next; what is slower is no noise of a sample."""
COLOUR_DEVIANCE = 16.0
"""Coloured noise must lower the deviance by so much."""
SLOW = 4.0
"""Noise that lasts for more than one in so many parts of a stretch cannot be told from creep."""
LEAST_TOGETHER = 1.5
"""Noise that makes less than so many samples count as one is taken as white."""


@dataclass(frozen=True)
class Colour:
    """White noise plus noise that decays exponentially, c_j = s^2 (share rho^|j| + (1 - share) delta_j).

    Attributes
    ----------
    deviation : s, the standard deviation of a sample.
    correlation : rho, from one sample to the next.
    share : of the variance that is correlated.
    """

    deviation: float
    correlation: float
    share: float

    @property
    def count(self) -> float:
        """Samples that count as one: the spectral density at frequency zero over that of white noise.

        >>> Colour(1.0, 0.5, 1.0).count
        3.0
        """
        return 1 - self.share + self.share * (1 + self.correlation) / (1 - self.correlation)


def noise_colour(signal: Array, weight: Array, stretches: list[tuple[int, int]]) -> Colour | None:
    """The likeliest colour of the noise about a smooth signal; None where it is white, or cannot be told.

    The stretches are cut into pieces of one length. The samples of a piece, less a polynomial of degree five, are normal
    with the covariance Q' C Q, C that of :class:`Colour` and Q the complement of the polynomials, so that what the
    polynomial takes of slow noise is accounted for.

    Parameters
    ----------
    signal : (n,) evenly sampled.
    weight : (n,) 0 for a sample that is left out; a piece with such a sample is.
    stretches : (first, last) sample of parts in which the signal is smooth.

    Examples
    --------
    >>> from scipy.signal import lfilter
    >>> steps = np.random.default_rng(1).standard_normal(6000)
    >>> parts = [(i, i + 100) for i in range(0, 6000, 100)]
    >>> noise_colour(steps, np.ones(6000), parts) is None
    True
    >>> round(noise_colour(lfilter([1.0], [1.0, -0.9], steps), np.ones(6000), parts).correlation, 1)
    0.9
    """
    lengths = [last - first for first, last in stretches if last - first >= SHORTEST_STRETCH]
    if not lengths:
        return None
    length = min(int(np.median(lengths)), LONGEST_STRETCH)
    starts = np.array([i for first, last in stretches for i in range(first, last - length + 1, length)], dtype=int)
    pieces = starts[:, None] + np.arange(length)
    pieces = pieces[(weight[pieces] > 0).all(axis=1)]
    powers = np.polynomial.legendre.legvander(np.linspace(-1, 1, length), DEGREE)
    complement = np.linalg.qr(powers, mode="complete")[0][:, DEGREE + 1 :]
    left = (signal[pieces] - signal[pieces].mean(axis=1, keepdims=True)) @ complement
    squares = np.mean(left**2, axis=1)
    left = left[squares < VARIANCE_RATIO * np.median(squares)] if len(squares) else left
    if len(left) < FEWEST_STRETCHES or not left.any():
        return None
    covariance = left.T @ left / len(left)
    apart = np.abs(np.subtract.outer(np.arange(length), np.arange(length)))

    def under(correlation: float) -> tuple[float, float, float]:
        """Deviance, share and variance that are likeliest with this correlation."""
        values, vectors = np.linalg.eigh(complement.T @ correlation**apart @ complement)
        seen = np.einsum("ij,ij->j", vectors, covariance @ vectors)

        def deviance(share: float) -> float:
            spread = 1 - share + share * values
            return len(left) * float(np.sum(np.log(spread)) + len(seen) * math.log(float(np.mean(seen / spread))))

        found = minimize_scalar(deviance, bounds=SHARES, method="bounded", options={"xatol": 1e-3})
        share = float(found.x)
        return float(found.fun), share, float(np.mean(seen / (1 - share + share * values)))

    bounds = math.atanh(CORRELATIONS[0]), math.atanh(CORRELATIONS[1])
    best = minimize_scalar(
        lambda z: under(math.tanh(z))[0], bounds=bounds, method="bounded", options={"xatol": 0.02, "maxiter": 25}
    )
    correlation = math.tanh(float(best.x))
    least, share, variance = under(correlation)
    colour = Colour(math.sqrt(variance), correlation, share)
    white = len(left) * left.shape[1] * math.log(float(np.mean(np.diag(covariance))))
    clear = white - least > COLOUR_DEVIANCE and length * (1 - correlation) > SLOW
    return colour if clear and colour.count > LEAST_TOGETHER else None
