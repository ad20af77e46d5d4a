"""Intervals from the profile of the likelihood: how far a number can go before no choice of the others makes up for it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.stats import norm

if TYPE_CHECKING:
    from stickslip.identification.trajectory.single_shooting import SingleShooting

Array = npt.NDArray[np.float64]

CLOSE = 0.02
"""Standard deviations to which the end of an interval is found."""
TRIALS = 8
"""The most places that are tried for one end."""


def profile_intervals(
    fit: SingleShooting, unknowns: Array, covariance: Array, progress: Callable[[str, int, int], Any]
) -> tuple[pd.DataFrame, list[str]]:
    """Ends of the 95 % intervals where the signed root of the profile reaches 1.96.

    r_j(p) = sign(p − p̂) √((χ²(p) − χ²(p̂)) / τ), χ²(p) the least sum of squares with the j-th number held at p, and τ what
    correlation of the residuals takes from it. Where the misfit is a parabola the ends are those of the covariance.

    Parameters
    ----------
    fit, unknowns, covariance : a search at its minimum.
    progress : called as ``progress(what, done, of)`` before each number and at the end.

    Returns
    -------
    DataFrame over the names with low and high, and a sentence for each end that no misfit closes before a limit.

    Source: Venzon & Moolgavkar, Appl. Statist. 37 (1988) 87; Bates & Watts, Nonlinear Regression Analysis (1988), sec. 6.1.
    """
    want = float(norm.ppf(0.975))
    base = fit.cost(unknowns)
    slopes = fit.slopes(unknowns)
    plain = np.linalg.pinv(slopes.T @ slopes)
    rows, open_ends = [], []
    for j, name in enumerate(fit.free.names):
        progress(f"profile of {name}", j, fit.count)
        error = math.sqrt(covariance[j, j])
        excess = covariance[j, j] / plain[j, j]
        ends = []
        for sign in (-1.0, 1.0):
            reach, closed, inner, outer = want, False, 0.0, math.inf
            limit = (fit.free.low if sign < 0 else fit.free.high)[j]
            for _ in range(TRIALS):
                # beyond the outer there is no law, as friction of it would rise from rest to slip, or no motion of it
                reach = reach if reach < outer else 0.5 * (inner + outer)
                at = unknowns[j] + sign * reach * error
                if (at - limit) * sign >= 0:
                    at = limit
                alone = np.arange(unknowns.size) == j
                along = np.where(alone, 1.0, covariance[:, j] / covariance[j, j])
                trials = [unknowns + way * (at - unknowns[j]) for way in (along, alone)]
                lawful = [trial for trial in trials if fit.moves(trial)]
                if not lawful:
                    outer = reach
                    continue
                trial = fit.down(lawful[0], 1.0, 0.01, held=[j])
                root = math.sqrt(max(fit.cost(trial) - base, 0.0) / excess)
                if abs(root - want) < CLOSE:
                    closed = True
                    break
                if at == limit and root < want:
                    break
                inner = max(inner, reach) if root < want else inner
                reach *= min(max(want / max(root, 1e-3), 0.3), 3.0)
            lawless = not closed and outer < math.inf
            if lawless:
                at = unknowns[j] + sign * inner * error
            ends.append(at)
            if lawless or (not closed and at == limit):
                why = "beyond it there is no law with a motion" if lawless else "it ends at a limit"
                open_ends.append(f"The interval of {name} is open {'below' if sign < 0 else 'above'}: {why}.")
        rows.append(ends)
    progress("profiles", fit.count, fit.count)
    found = np.array(rows)
    # Each end is of one number alone: the others do not enter its value.
    low, high = fit.free.values(found[:, 0]), fit.free.values(found[:, 1])
    return pd.DataFrame({"low": low, "high": high}, index=pd.Index(fit.free.names, name="parameter")), open_ends
