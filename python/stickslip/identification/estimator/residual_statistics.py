"""Statistics of residuals: their scale, their correlation time, what repeats in them, and what clusters do to a fit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from stickslip.files.arrays import Array
from stickslip.files.median_deviation import median_deviation

RECURRENT = 0.8
"""Correlation of a motion with itself, some time later, from which on it is said to repeat itself."""


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
    scale = median_deviation(residuals)
    return scale if scale > 0 else float(np.sqrt(np.mean(residuals**2)))


def median_error(values: Array) -> float:
    """Standard error of the median of normal numbers, from their robust scatter about it."""
    return 1.2533 * robust_scale(values - np.median(values)) / math.sqrt(values.size)


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
