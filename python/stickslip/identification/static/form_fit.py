"""Forms of static friction fitted to break-aways, and the choice among them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Self

import numpy as np
import numpy.typing as npt
import pandas as pd

from stickslip.files.arrays import Array, Mask
from stickslip.identification.estimator.least_squares import OUTLIER, minimize
from stickslip.identification.estimator.parameters import Parameter, Parameters
from stickslip.identification.estimator.residual_statistics import robust_scale
from stickslip.identification.estimator.uncertainty import correlated_covariance, estimate, own_error
from stickslip.identification.static.forms import BY_RATIO, Form, forms
from stickslip.identification.static.rows import common_error

UNDETERMINED = 1e-5
"""Numbers of a form of which a combination changes the forces less than this part of what each does alone are not told."""
NEAR = 4.0
"""Forms whose criterion is within this of the lowest do as well: the likelihoods differ by less than e² for one number."""
ROUNDS = ((1e-3, 60), (1e-4, 60), (1e-5, 60), (1e-8, 150))
"""Relative tolerance and most evaluations of the rounds: one that chooses the starting point, two that find the weights of
the rows, the last. A form that the rows do not determine runs along a valley: only the last round follows it."""
APPROACH = (0.02, 2.0)
"""Least and greatest approach of load and limit of a stick, over the rise of the load."""


@dataclass(frozen=True)
class StaticFit:
    """One form fitted to the break-aways.

    Attributes
    ----------
    form : its name; `formula` is written out.
    parameters : value, error, low and high of the 95 % interval, by name; infinite errors where the rows do not determine it.
    covariance : of the fitted numbers (the rate of the exponential by its logarithm), in the order of `parameters`.
    scatter : robust standard deviation of the residuals.
    criterion : Akaike's, corrected for few rows; the lower the better.
    residuals : measured minus fitted force, in the order of the rows.
    rate : the usual force rate.
    """

    form: str
    formula: str
    parameters: pd.DataFrame
    covariance: Array
    scatter: float
    criterion: float
    residuals: Array = field(repr=False)
    rate: float
    _at: Callable[[Array, Array], Array] = field(repr=False, compare=False)

    @property
    def undetermined(self) -> list[str]:
        """Names of the numbers of which the rows tell no more than a combination."""
        return [str(name) for name in self.parameters.index[np.isinf(self.parameters["error"])]]

    def __call__(self, stick_time: npt.ArrayLike, force_rate: npt.ArrayLike | None = None) -> Array:
        """The fitted force at these stick times and force rates, any shape; default the usual rate."""
        rate = self.rate if force_rate is None else force_rate
        time, rates = np.broadcast_arrays(np.asarray(stick_time, float), np.asarray(rate, float))
        return self._at(time.ravel(), rates.ravel()).reshape(time.shape)


def fit_forms(rows: pd.DataFrame, level: float, zero: float, rates_differ: bool) -> dict[str, StaticFit]:
    """All forms that these rows allow, by name; `zero` is the standard error of all forces together."""
    columns = (rows[name].to_numpy() for name in ("stick_time", "force_rate", "used"))
    time, rate, force = columns
    return {form.name: _fit(rows, form, zero) for form in forms(time, np.abs(rate), force, level, rates_differ)}


def choose(fits: Mapping[str, StaticFit]) -> tuple[str, str]:
    """The name of the form to take, and a sentence on why."""
    # A form whose numbers are not determined is one of fewer numbers that is among them too.
    order = sorted(fits.values(), key=lambda fit: (len(fit.undetermined) > 0, fit.criterion))
    near = [fit for fit in order if fit.criterion - order[0].criterion < NEAR and not fit.undetermined]
    best = min(near, key=lambda fit: (len(fit.parameters), fit.criterion))
    second = next(fit for fit in order if fit is not best)
    lead = second.criterion - best.criterion
    simplest = fits["constant"]
    slope = fits["logarithmic"].parameters.loc["slope"]
    growth = f"its slope is {slope['value']:.3g} per decade (95 %: {slope['low']:.3g} to {slope['high']:.3g})"
    if best is simplest:
        return best.form, (
            "Static friction is best described as constant: growth with stick time does not pay for its parameter; "
            f"on the logarithmic form {growth}."
        )
    strength = "clearly" if lead > 6 else "only slightly" if lead > 2 else "not decisively"
    why = (
        "as Akaike's criterion is lowest"
        if best is order[0]
        else "the simplest of those whose Akaike criterion is near the lowest"
    )
    return best.form, (
        f"Static friction over stick time: the {best.form} form is chosen, {why} "
        f"({strength}: by {lead:.1f} against the {second.form} form, by "
        f"{simplest.criterion - best.criterion:.1f} against a constant); on the logarithmic form {growth}."
    )


def _fit(rows: pd.DataFrame, form: Form, zero: float) -> StaticFit:
    """A form fitted; `zero` is the standard error of all forces together, which moves its level and nothing else."""
    time, force = rows["stick_time"].to_numpy(), rows["used"].to_numpy()
    rate = rows["force_rate"].abs().to_numpy()
    late = common_error(rows)
    stated = own_error(rows["force_error"].fillna(0.0), late)
    # one column for each record: its break-away forces are high or low together
    together = late[:, None] * (rows["record"].to_numpy()[:, None] == rows["record"].unique())
    starts = [np.array(start) for start in (form.start, *form.others)]
    on_line = rows["on_line"].to_numpy()
    aside = np.minimum(_beside_loading_line(rows), stated)
    beside = Beside.of(time, rate)

    def in_errors(numbers: Array, sigma: Array) -> Array:
        limit, nearing = beside.approach(partial(form.at, numbers))
        along = np.where(on_line, nearing, 1.0) * np.sqrt(np.maximum(sigma**2 - aside**2, 0.0))
        return np.asarray((force - limit) / np.hypot(along, aside))

    least = 1e-12 * float(np.abs(force).max()) or 1.0
    sigma = np.full(len(force), max(robust_scale(force - np.median(force)), least))
    for tolerance, evaluations in ROUNDS:
        columns = together / sigma[:, None]
        share = _shares(columns)

        def misfit(numbers: Array, sigma: Array = sigma, columns: Array = columns, share: Array = share) -> Array:
            rest = in_errors(numbers, sigma)
            high = share @ rest
            return np.concatenate([rest - columns @ high, high])

        found = minimize(misfit, starts, outlier=OUTLIER, evaluations=evaluations, tolerance=tolerance)
        starts = [found.vector]
        off = in_errors(found.vector, sigma)
        high = share @ off
        own = sigma * off - together @ high
        inner = math.sqrt(max(robust_scale(own) ** 2 - float(np.median(stated**2)), 0.0))
        sigma = np.maximum(np.hypot(stated, inner), least)
    residuals = force - form.at(found.vector, time, rate)
    count, free = len(force), len(form.names)
    variance = robust_scale(own / sigma) ** 2 * count / max(count - free, 1)
    order = np.argsort(rows["t"].to_numpy() + 1e9 * rows["record"].to_numpy(), kind="stable")
    order = np.append(order, np.arange(count, count + len(high)))
    # What the scatter says of the errors is said of those that each has alone: what is common to them is known beforehand.
    scale = math.sqrt(max(variance, 1e-24))
    jacobian, rest = (_with_errors(of, columns, scale) for of in (found.jacobian, found.residuals))
    covariance, freedom = correlated_covariance(jacobian[order], rest[order], 1.0)
    covariance[np.diag_indices(free)] += np.where(_undetermined(found.jacobian), math.inf, 0.0)
    if form.names[0] == "f0":
        covariance[0, 0] += zero**2
    numbers = Parameters([Parameter(name, logarithmic=name in BY_RATIO) for name in form.names])
    table, _ = estimate(numbers, found.vector, covariance, freedom)
    squares = (own / sigma) ** 2
    cut = np.minimum(squares, (3 * max(robust_scale(own / sigma), 1e-300)) ** 2)
    penalty = 2 * (free + 1) * count / max(count - free - 2, 1)
    deviance = (
        count * math.log(max(float(np.mean(cut)), 1e-300)) + 2 * float(np.sum(np.log(sigma))) + float(high @ high)
    )
    usual = float(np.nanmedian(rate)) if np.isfinite(rate).any() else math.nan
    return StaticFit(
        form.name,
        form.formula,
        table,
        covariance,
        robust_scale(residuals - together @ high),
        deviance + penalty,
        residuals,
        usual,
        partial(form.at, found.vector),
    )


def _beside_loading_line(rows: pd.DataFrame) -> Array:
    """The part of the stated errors of force that is no error of the time at which the stick ends."""
    stated, end = (rows[name].fillna(0.0) if name in rows else 0.0 for name in ("force_error", "t_error"))
    square = stated**2 - (rows["force_rate"].abs().fillna(0.0) * end) ** 2
    return np.asarray(np.sqrt(square.clip(lower=0.0)), float)


@dataclass(frozen=True)
class Beside:
    """Sticks at their stick times t_s and a little beside them, for the slope of a limit; shape (3 n,) each."""

    time: Array
    rate: Array

    @classmethod
    def of(cls, time: Array, rate: Array) -> Self:
        """Of stick times and force rates, shape (n,)."""
        return cls(np.concatenate([time, time + 1e-3 * time, time - 1e-3 * time]), np.tile(rate, 3))

    def approach(self, limit: Callable[[Array, Array], Array]) -> tuple[Array, Array]:
        """f_s(t_s, δ), and how fast the load of a stick nears it over how fast it rises: 1 − f_s′/δ, within `APPROACH`.

        A stick that is stronger by r, or is seen to end too late by r/δ, breaks away r / (1 − f_s′/δ) higher up its loading
        line, as the limit grows while the load goes on to meet it. 1 where no rate is known.
        """
        here, after, before = limit(self.time, self.rate).reshape(3, -1)
        count = here.size
        slope = (after - before) / (2e-3 * self.time[:count])
        with np.errstate(over="ignore"):  # it is cut off
            nearing = np.clip(1 - slope / np.maximum(self.rate[:count], 1e-300), *APPROACH)
        return here, np.where(np.isnan(nearing), 1.0, nearing)


def _shares(together: Array) -> Array:
    """Of residuals of unit variance, how much of each column is likeliest in them, each beforehand 0 ± 1: (columns, n)."""
    return np.asarray(np.linalg.solve(together.T @ together + np.eye(together.shape[1]), together.T))


def _with_errors(rows: Array, columns: Array, scale: float) -> Array:
    """The rows of a misfit with columns in common, `scale` times as large an error of each row alone."""
    count = len(columns)
    alone = (rows[:count] + columns @ rows[count:]) / scale
    columns = columns / scale
    high = _shares(columns) @ alone
    return np.concatenate([alone - columns @ high, high])


def _undetermined(jacobian: Array) -> Mask:
    """Which numbers the rows do not determine: those without effect, and those of a combination without effect."""
    size = np.linalg.norm(jacobian, axis=0)
    silent = size <= 1e-12 * float(size.max())
    _, singular, right = np.linalg.svd(jacobian / np.where(silent, 1.0, size), full_matrices=False)
    weak = right[singular < UNDETERMINED * singular[0]]
    return np.asarray(silent | (np.abs(weak) > 0.1).any(axis=0))
