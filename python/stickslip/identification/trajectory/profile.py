"""Intervals from the profile of the likelihood: how far a number can go before no choice of the others makes up for it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from scipy.special import ndtri

from stickslip.files.arrays import Array

if TYPE_CHECKING:
    from stickslip.identification.trajectory.single_shooting import SingleShooting

END_TOLERANCE = 0.02
"""Standard deviations to which the end of an interval is found."""
TRIALS = 8
"""The most places that are tried for one end."""
WANT = float(ndtri(0.975))
"""The root at the ends of a 95 % interval."""
LIKE_A_PARABOLA = 1.5
"""Within this ratio the misfit rises as the covariance has it."""


class Profile:
    """The misfit of a search at its minimum, with one number held beside it and all others at their best.

    The signed root of the profile is r_j(p) = sign(p − p̂) √((χ²(p) − χ²(p̂)) / τ), χ²(p) the least sum of squares with the
    j-th number held at p, and τ what correlation of the residuals takes from it. Of a parabola it is (p − p̂)/σ_j.

    Source: Bates & Watts, Nonlinear Regression Analysis (1988), sec. 6.1.
    """

    def __init__(self, fit: SingleShooting, unknowns: Array, covariance: Array) -> None:
        self.fit, self.unknowns, self.covariance = fit, unknowns, covariance
        self._base = fit.cost(unknowns)
        slopes = fit.slopes(unknowns)
        plain = np.diag(np.linalg.pinv(slopes.T @ slopes))
        self.error = np.sqrt(np.diag(covariance))
        self._excess = self.error**2 / plain

    def root(self, j: int, at: float) -> float | None:
        """The size of the root where the j-th number is `at`; None where there is no law with a motion."""
        alone = np.arange(self.unknowns.size) == j
        along = np.where(alone, 1.0, self.covariance[:, j] / self.covariance[j, j])
        for way in (along, alone):
            trial = self.unknowns + way * (at - self.unknowns[j])
            if self.fit.moves(trial):
                found = self.fit.down(trial, 1.0, 0.01, held=[j])
                return math.sqrt(max(self.fit.cost(found) - self._base, 0.0) / self._excess[j])
        return None


def why_no_parabola(fit: SingleShooting, unknowns: Array, covariance: Array) -> str | None:
    """A sentence where the misfit of the number that is known least does not rise as the covariance says."""
    profile = Profile(fit, unknowns, covariance)
    j = int(np.argmax(profile.error[: fit.count]))
    for sign in (1.0, -1.0):
        at = float(unknowns[j] + sign * WANT * profile.error[j])
        if fit.free.low[j] < at < fit.free.high[j] and (root := profile.root(j, at)) is not None:
            if WANT / LIKE_A_PARABOLA < root < WANT * LIKE_A_PARABOLA:
                return None
            return (
                f"{WANT:.2f} standard errors of {fit.free.names[j]} aside the misfit has risen by what belongs to "
                f"{root:.2g}, so the intervals are not to be trusted; --profile follows the misfit instead."
            )
    return None


def profile_intervals(
    fit: SingleShooting, unknowns: Array, covariance: Array, progress: Callable[[str, int, int], Any]
) -> tuple[pd.DataFrame, list[str]]:
    """Ends of the 95 % intervals where the signed root of the profile reaches 1.96.

    The root is that of :class:`Profile`; where the misfit is a parabola the ends are those of the covariance.

    Parameters
    ----------
    fit, unknowns, covariance : a search at its minimum.
    progress : called as ``progress(what, done, of)`` before each number and at the end.

    Returns
    -------
    DataFrame over the names with low and high, and a sentence for each end that no misfit closes before a limit.

    Source: Venzon & Moolgavkar, Appl. Statist. 37 (1988) 87.
    """
    profile = Profile(fit, unknowns, covariance)
    rows, open_ends = [], []
    for j, name in enumerate(fit.free.names):
        progress(f"profile of {name}", j, fit.count)
        error = profile.error[j]
        ends = []
        for sign in (-1.0, 1.0):
            reach, closed, inner, outer = WANT, False, 0.0, math.inf
            limit = (fit.free.low if sign < 0 else fit.free.high)[j]
            for _ in range(TRIALS):
                # beyond the outer there is no law, as friction of it would rise from rest to slip, or no motion of it
                reach = reach if reach < outer else 0.5 * (inner + outer)
                at = unknowns[j] + sign * reach * error
                if (at - limit) * sign >= 0:
                    at = limit
                root = profile.root(j, at)
                if root is None:
                    outer = reach
                    continue
                if abs(root - WANT) < END_TOLERANCE:
                    closed = True
                    break
                if at == limit and root < WANT:
                    break
                inner = max(inner, reach) if root < WANT else inner
                reach *= min(max(WANT / max(root, 1e-3), 0.3), 3.0)
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
