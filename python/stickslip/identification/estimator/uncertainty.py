"""Standard errors and intervals of parameters from their covariance, degrees of freedom and Student's t.

The covariance of a fit with clustered errors is here. Fits of a law to a record or a motion make their own, in
`kinetic/force_fit.py`, `trajectory/single_shooting.py` and `trajectory/slip_shooting.py`.

What residuals say of their own scale and correlation is in `residual_statistics`; intervals of trajectory fits from the
profile of the likelihood are in `trajectory/profile.py`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.special import stdtrit

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.identification.estimator.parameters import Parameters
from stickslip.identification.estimator.residual_statistics import variance_inflation

WIDEST = 600.0
"""Largest half-width of an interval of a logarithm, so that its ends are still numbers."""


class Inseparable(InputError):
    """Numbers of which the records tell a combination alone; `names` may be empty where it is made of many."""

    def __init__(self, names: Sequence[str]) -> None:
        self.names = list(names)
        super().__init__(
            f"identify: {' and '.join(names) or 'the free numbers'} cannot be separated by these motions: hold one of them "
            "fixed, or add records at other drive velocities"
        )


def no_evidence(by: str, names: str) -> InputError:
    """The error for free numbers that change nothing of what is compared, which is named by `by`."""
    return InputError(
        f"identify: {by} say nothing about {names}: hold it at a value (fixed, --fixed), ask for a law without it, or add "
        "records in which it acts"
    )


def own_error(error: npt.ArrayLike, common: npt.ArrayLike) -> Array:
    """What is left of standard errors without the part that rows have in common."""
    return np.asarray(np.sqrt(np.maximum(np.square(error) - np.square(common), 0.0)))


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
    stickslip.identification.estimator.uncertainty.Inseparable: identify: limit and rate cannot be separated ...
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
