"""Standard errors and intervals: the scale of residuals, their autocorrelation time, and what follows for parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.special import stdtrit

from stickslip.errors import InputError
from stickslip.identification.estimator.parameters import Parameters
from stickslip.measurement.signals.noise import MAD_TO_SIGMA

Array = npt.NDArray[np.float64]

WIDEST = 600.0
"""Largest half-width of an interval of a logarithm, so that its ends are still numbers."""
RECURRENT = 0.8
"""Correlation of a motion with itself, some time later, from which on it is said to repeat itself."""


class Inseparable(InputError):
    """Numbers of which the records tell a combination alone; `names` may be empty where it is made of many."""

    def __init__(self, names: Sequence[str]) -> None:
        self.names = list(names)
        super().__init__(
            f"identify: {' and '.join(names) or 'the free numbers'} cannot be told apart by these motions: hold one of them "
            "fixed, or add records at other drive velocities"
        )


def robust_scale(residuals: Array) -> float:
    """Standard deviation of normal residuals from their median absolute value; outliers do not count.

    For fewer than five residuals their root mean square.

    >>> round(robust_scale(np.array([-1.0, 1.0, -1.0, 1.0, 50.0])), 3)
    1.483
    """
    if residuals.size == 0:
        return 0.0
    if residuals.size < 5:
        return float(np.sqrt(np.mean(residuals**2)))
    scale = MAD_TO_SIGMA * float(np.median(np.abs(residuals)))
    return scale if scale > 0 else float(np.sqrt(np.mean(residuals**2)))


def own_error(error: npt.ArrayLike, common: npt.ArrayLike) -> Array:
    """What is left of standard errors without the part that rows have in common."""
    return np.asarray(np.sqrt(np.maximum(np.square(error) - np.square(common), 0.0)))


def clipped_scale(residuals: Array) -> float:
    """Standard deviation of normal residuals, nearly as sure as the ordinary one; an outlier counts as two of them.

    The solution s of Σ min(r², c² s²) = n β s², c = 2, β = E min(z², c²) for standard normal z (Huber's proposal 2). Its
    variance is that of an ordinary standard deviation but for a tenth, where the median's is three times as large, so that
    Student's t holds for few residuals.

    Limits: of fewer than ten residuals two outliers are too many.

    Source: Huber, Ann. Math. Statist. 35 (1964) 73, doi:10.1214/aoms/1177703732.

    >>> round(clipped_scale(np.array([-1.0, 1.0, -1.0, 1.0, 0.5, -0.5, 50.0])), 2)
    1.36
    """
    scale = robust_scale(residuals)
    if residuals.size < 5 or scale == 0:
        return scale
    share = 4 - 3 * math.erf(math.sqrt(2)) - 4 * math.exp(-2) / math.sqrt(2 * math.pi)
    for _ in range(100):
        last, scale = scale, math.sqrt(float(np.mean(np.minimum(residuals**2, 4 * scale**2))) / share)
        if abs(scale - last) < 1e-6 * scale:
            break
    return scale


def correlation_time(residuals: Array) -> float:
    """Samples per independent one, τ = 1 + 2 Σ ρ_k, of residuals in their order of time.

    The sum ends where a pair of neighbouring correlations is no longer positive (Geyer's initial positive sequence), so
    it can be trusted for records much longer than τ. The variance of a mean of n samples is σ² τ / n.

    Parameters
    ----------
    residuals : shape (n,), evenly sampled; outliers are cut at four robust standard deviations.

    Returns
    -------
    τ ≥ 1 in samples, at most n / 2.

    Source: Geyer, Statist. Sci. 7 (1992) 473, doi:10.1214/ss/1177011137.

    >>> white = np.random.default_rng(0).standard_normal(100_000)
    >>> smooth = np.convolve(white, np.ones(8) / 8, mode="valid")  # a running mean of eight: τ = 8
    >>> bool(abs(correlation_time(white) - 1) < 0.1), bool(abs(correlation_time(smooth) - 8) < 1.0)
    (True, True)
    """
    n = residuals.size
    if n < 4:
        return 1.0
    scale = robust_scale(residuals)
    r = np.clip(residuals, -4 * scale, 4 * scale)
    size = 1 << (2 * n - 1).bit_length()
    spectrum = np.fft.rfft(r, size)
    covariance = np.fft.irfft(spectrum * spectrum.conj(), size)[:n] / n
    if covariance[0] <= 0:
        return 1.0
    rho = covariance / covariance[0]
    pairs = rho[: n - n % 2].reshape(-1, 2).sum(axis=1)
    end = int(np.argmax(pairs <= 0)) if (pairs <= 0).any() else pairs.size
    return float(np.clip(2 * pairs[:end].sum() - 1, 1.0, n / 2))


def recurrence(motion: Array) -> int:
    """Samples after which a motion repeats itself, 0 where it does not: the first lag at which it is again what it was.

    Parameters
    ----------
    motion : shape (n,), evenly sampled; repeated at least once, its correlation there at least `RECURRENT`.

    >>> t = np.arange(1000)
    >>> recurrence(np.sin(2 * np.pi * t / 130) + 0.5 * np.cos(4 * np.pi * t / 130))
    130
    >>> recurrence(np.random.default_rng(0).standard_normal(1000))
    0
    """
    n = motion.size
    size = 1 << (2 * n - 1).bit_length()
    spectrum = np.fft.rfft(motion - motion.mean(), size)
    covariance = np.fft.irfft(spectrum * spectrum.conj(), size)[: n // 2 + 1] / (n - np.arange(n // 2 + 1))
    if covariance[0] <= 0 or not (covariance < 0).any():
        return 0
    rho = covariance / covariance[0]
    first = int(np.argmax(rho < 0))
    top = float(rho[first:].max())
    if top < RECURRENT:
        return 0
    high = first + np.flatnonzero(rho[first:] > 0.98 * top)
    end = int(np.argmax(np.diff(high, append=high[-1] + 2) > 1)) + 1
    return int(high[:end][np.argmax(rho[high[:end]])])


def variance_inflation(scores: Array, period: int) -> float:
    """By how much the variance of a sum of scores exceeds that of as many independent ones.

    A score is what one sample's residual does to a number, in the order of time. Scores that go together over τ samples are
    one in τ (see :func:`correlation_time`). Where the motion repeats itself after `period` samples (0: never) and the
    residuals with it, so that they are the law's and not the noise's, further periods say nothing new of them: their
    share, the correlation over one period, is not averaged down.

    Parameters
    ----------
    scores : shape (n,).
    period : samples, 0 where the motion does not repeat.
    """
    factor = correlation_time(scores)
    if period:
        again = float(np.dot(scores[period:], scores[:-period]) / max(np.dot(scores, scores), 1e-300)) * scores.size
        share = min(max(again / (scores.size - period), 0.0), 1.0)
        factor *= 1 + share * (scores.size / period - 1)
    return factor


def cluster_scores(left: Array, residuals: Array, edges: Sequence[int]) -> Array:
    """What each cluster of residuals does to the numbers of a least-squares fit: summed squares are their covariance.

    Residuals of one cluster may go together in any way, those of two must not. The residuals r_c of a cluster that the fit
    has drawn to itself by its leverage H_c are too small, so (I − H_c)^(-1/2) r_c is taken for them (the estimate CR2).

    Parameters
    ----------
    left : left singular vectors of the whole Jacobian, shape (n, p).
    residuals : shape (n,).
    edges : first rows of the clusters, and the row after the last.

    Returns
    -------
    scores, shape (clusters, p), along the singular vectors; their sum of squares is unbiased for independent residuals.

    Limits: what all clusters have in common is in no error.

    Source: Liang & Zeger, Biometrika 73 (1986) 13; Bell & McCaffrey, Survey Methodology 28 (2002) 169 (CR2).

    >>> column, normal = np.full((60, 1), 60**-0.5), np.random.default_rng(0).standard_normal(20)
    >>> scores = cluster_scores(column, np.repeat(normal - normal.mean(), 3), range(0, 61, 3))  # twenty trios of one value
    >>> bool(np.isclose(np.sum(scores**2) / 60, np.var(normal, ddof=1) / 20))  # the squared error of their mean
    True
    """
    found = []
    for a, b in pairwise(edges):
        own, size, along = np.linalg.svd(left[a:b], full_matrices=False)
        found.append((size / np.sqrt(np.maximum(1 - size**2, 1e-12)) * (own.T @ residuals[a:b])) @ along)
    return np.array(found)


def half_width(error: float, freedom: float) -> float:
    """Half of the 95 % interval: the standard error times Student's t for that many degrees of freedom.

    >>> round(half_width(1.0, 1e9), 2)
    1.96
    """
    # What scipy.stats adds to the function costs a hundred times as much, and a comparison asks for thousands.
    return float(error * stdtrit(max(freedom, 1.0), 0.975))


def inverse(information: Array, names: Sequence[str]) -> Array:
    """The inverse of what the records say about some unknowns, of which the first have names; columns all act.

    Raises
    ------
    Inseparable
        where a combination of them is not told, with the names in it.

    >>> inverse(np.array([[1.0, 1.0], [1.0, 1.0]]), ["limit", "rate"])
    Traceback (most recent call last):
    stickslip.identification.estimator.uncertainty.Inseparable: identify: limit and rate cannot be told apart ...
    """
    length = np.sqrt(np.abs(np.diag(information)))
    scaled = information / np.outer(length, length)
    if scaled.size and np.linalg.cond(scaled) > 1e13:
        weak = np.linalg.svd(scaled)[2][-1, : len(names)]
        raise Inseparable([name for name, part in zip(names, weak, strict=True) if abs(part) > 0.3])
    return np.asarray(np.linalg.inv(scaled) / np.outer(length, length))


def correlated_covariance(
    jacobian: Array, residuals: Array, variance: float, period: int = 0, most: float = math.inf
) -> tuple[Array, float]:
    """Covariance of the numbers of a least-squares fit whose residuals go together from row to row, and its freedom.

    C_jk = v (JᵀJ)⁻¹_jk √(τ_j τ_k), with τ_j the variance inflation of the scores of number j: what goes together counts as
    far as it acts on a number; a slow drift hardly changes a slope that has nothing to do with time.

    Parameters
    ----------
    jacobian, residuals : shapes (n, p) and (n,), in units of the errors, in the order of time.
    variance : v, of one residual.
    period, most : see :func:`variance_inflation`; inflation is at most `most`.

    Returns
    -------
    covariance, shape (p, p), and degrees of freedom, n / max τ − p, at least 1.
    """
    count, free = jacobian.shape
    inverse = np.linalg.pinv(jacobian.T @ jacobian)
    scores = inverse @ jacobian.T * residuals
    tau = np.array([min(variance_inflation(score, period), most) for score in scores])
    covariance = inverse * variance * np.sqrt(np.outer(tau, tau))
    return np.asarray(covariance), max(count / float(tau.max()) - free, 1.0)


def estimate(
    parameters: Parameters,
    vector: Array,
    covariance: Array,
    freedom: float | Array,
    derived: Mapping[str, Mapping[str, float]] | None = None,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Value, standard error and 95 % interval by name, and the covariance of the values.

    Parameters
    ----------
    parameters : those of the fit.
    vector, covariance : the search vector and its covariance.
    freedom : degrees of freedom of the errors, one for all or one for each.
    derived : further numbers as sums of the free ones, weights by name; their intervals have no limits.

    >>> from stickslip.identification.estimator.parameters import Parameter
    >>> rate, limit = Parameter("rate", 0.0, logarithmic=True, unit="1/s"), Parameter("limit", 0.0, unit="N")
    >>> table, _ = estimate(Parameters([rate, limit]), np.array([0.0, 2.0]), np.diag([0.01, 0.04]), math.inf)
    >>> table.round(3)[["value", "low", "high"]].to_numpy().tolist()
    [[1.0, 0.822, 1.217], [2.0, 1.608, 2.392]]
    """
    names, values, units = list(parameters.names), parameters.plain(vector), parameters.units(vector)
    quantile = np.array([half_width(1.0, each) for each in np.broadcast_to(freedom, values.shape)])
    # A variance below zero is rounding where a form has a number too many: nothing is known of that one.
    variance = np.diag(covariance)
    spread = np.sqrt(np.where(variance < 0, math.inf, variance))
    half = quantile * spread
    # A ratio that ran off to where nothing is known of it has infinite errors and ends.
    with np.errstate(over="ignore", invalid="ignore"):
        ratio = np.exp(np.minimum(half, WIDEST))
        low = np.where(
            parameters.logarithmic, values / ratio, np.maximum(values - half, [item.low for item in parameters.free])
        )
        high = np.where(
            parameters.logarithmic, values * ratio, np.minimum(values + half, [item.high for item in parameters.free])
        )
        error, full = spread * units, covariance * np.outer(units, units)
    for name, weights in (derived or {}).items():
        sums = np.vstack([np.eye(len(values)), [weights.get(each, 0.0) for each in names]])
        names, values, full = [*names, name], sums @ values, sums @ full @ sums.T
        error = np.append(error, math.sqrt(full[-1, -1]))
        beyond = error[-1] * float(np.max(quantile))
        low, high = np.append(low, values[-1] - beyond), np.append(high, values[-1] + beyond)
    table = pd.DataFrame(
        {"value": values, "error": error, "low": low, "high": high}, index=pd.Index(names, name="parameter")
    )
    return table, pd.DataFrame(full, index=names, columns=names)
