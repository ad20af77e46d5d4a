"""Numbers of a law fitted to measured kinetic force and break-aways: scales, weights, and the covariance of what is found."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise

import numpy as np
import pandas as pd

from stickslip.errors import InputError
from stickslip.files.arrays import Array, Indices
from stickslip.identification.estimator.least_squares import OUTLIER, has_effect, minimize
from stickslip.identification.estimator.record_scatter import record_scatter
from stickslip.identification.estimator.residual_statistics import (
    clipped_scale,
    cluster_scores,
    correlation_time,
    recurrence,
    robust_scale,
    variance_inflation,
)
from stickslip.identification.estimator.uncertainty import estimate
from stickslip.identification.kinetic.force_residuals import OFFSET, Problem
from stickslip.identification.kinetic.replayed_motion import WITH_MEMORY
from stickslip.laws import Law

ROUNDS = 4
"""Times that the fit is repeated with new scales and weights."""
EFFORT = 60
"""The most evaluations of the first and of the last of them; half as many of the others."""
MOST_CORRELATED = 20.0
"""Correlation beyond that many rows is taken for misfit, which must not take weight from a group during the fit."""
FEWEST_ROWS = 5
"""Rows of which a mean and its error can be told."""
BY_CHANCE = 1.2
"""Mean correlation time of 10 to 80 independent rows about their mean: what is found is above 1 by chance."""
STATED = 5.0
"""Of fewer rows the stated errors are believed too: they count as the scatter of so many more."""


@dataclass(frozen=True)
class ForceFit:
    """Numbers of a law that lie closest to the records.

    Attributes
    ----------
    law : the law with these numbers.
    parameters : value, error, low and high of the 95 % interval, by name.
    offset : the same of a constant in the measured force, where it was asked for.
    covariance : of the numbers, by name in both directions.
    groups : one row per group of residuals: record, kind, rows, independent rows, scale, record_scatter (standard
        deviation from record to record).
    rms : root mean square of measured minus predicted kinetic force over the samples of all slips.
    weights : of each row, one over the standard deviation by which it is weighed.
    shifts : by name of each number that is held at a guess, how far the fitted ones move with it by one standard deviation.
    """

    law: Law
    parameters: pd.DataFrame
    covariance: pd.DataFrame
    groups: pd.DataFrame
    rms: float
    weights: Array
    offset: pd.Series | None = None
    shifts: Mapping[str, pd.Series] = field(default_factory=dict)


def fit_forces(problem: Problem, start: Law) -> ForceFit:
    """Least squares from a first guess, with scales, weights and correlation found on the way.

    Parameters
    ----------
    problem : records and free numbers.
    start : the first guess.

    Raises
    ------
    InputError
        where the records say nothing about one of the free numbers.
    """
    numbers = problem.numbers(start)
    low, high = problem.parameters.bounds()
    # A search cannot start on a limit.
    numbers = np.clip(numbers, low + 1e-6 * problem.scales, high - 1e-6 * problem.scales)
    problem.refuse_silent(problem.at(numbers))
    first = numbers
    groups = problem.groups_at(numbers)
    common = [float(np.median(np.abs(late))) for late in problem.late(problem.at(numbers))]
    record_scatter = _record_scatter(problem, groups, common)
    apart = np.hypot(record_scatter, common)
    sigma, tau, _ = _scales(problem, groups, apart)
    weights = [np.ones_like(residuals) for residuals in groups]
    assumed = _assumed(problem, sigma, tau, apart)
    for number in range(ROUNDS):
        factor = np.concatenate([w / a for w, a in zip(weights, assumed, strict=True)])
        numbers = _solve(problem, numbers, factor, EFFORT if number in (0, ROUNDS - 1) else EFFORT // 2)
        groups = problem.groups_at(numbers)
        record_scatter = _record_scatter(problem, groups, common)
        apart = np.hypot(record_scatter, common)
        sigma, tau, together = _scales(problem, groups, apart)
        weights = [
            (1 + (residuals / (OUTLIER * np.hypot(s, b))) ** 2) ** -0.25
            for residuals, s, b in zip(groups, sigma, apart, strict=True)
        ]
        if number < ROUNDS - 1:
            assumed = _assumed(problem, sigma, tau, apart)
            # a first step from afar may lead to where a number does not act, from which no further one leads back
            numbers = _acting_again(problem, numbers, first)
    factors = [w / a for w, a in zip(weights, assumed, strict=True)]
    return _result(problem, numbers, groups, sigma, together, record_scatter, factors, assumed)


def _acting_again(problem: Problem, numbers: Array, first: Array) -> Array:
    """The numbers, those that do not act as they were first; all of them, where the two together make no law."""
    silent = ~has_effect(problem.jacobian(numbers, problem.column))
    mended = np.where(silent, first, numbers)
    try:
        problem.at(mended)
    except InputError:
        return first
    return mended


def _solve(problem: Problem, numbers: Array, factor: Array, effort: int) -> Array:
    def scaled(trial: Array) -> Array:
        return problem.column(trial) * factor

    return minimize(
        scaled,
        [numbers],
        problem.parameters.bounds(),
        partial(problem.jacobian, residuals=scaled),
        evaluations=effort,
        tolerance=1e-9,
    ).vector


def _scales(problem: Problem, groups: Sequence[Array], apart: Array) -> tuple[list[Array], list[float], list[float]]:
    """Standard deviation of each row and correlation time of each group, beside what sets the records apart.

    The correlation times come twice: for the weights, and for the errors, where what each break-away is known to have as an
    error of its own counts as independent, and what independent rows show by chance is taken off.
    """
    sigma, tau, together = [], [], []
    for (_, kind), group, stated, shifted in zip(problem.groups, groups, problem.stated, apart > 0, strict=True):
        residuals = group - float(np.median(group)) if shifted else group
        spread = robust_scale(residuals)
        inner = math.sqrt(max(spread**2 - float(np.median(stated**2)), 0.0)) if residuals.size >= FEWEST_ROWS else 0.0
        if not stated.any():
            inner = spread
        # Exact data have no scatter: below this rounding would be fitted.
        floor = problem.rounding
        row = np.maximum(np.hypot(stated, inner), floor)
        # Rows whose stated errors are too small or too large for their scatter: believe the scatter.
        alone, by_chance = 0.0, BY_CHANCE if kind == "break-away" else 1.0
        if residuals.size >= FEWEST_ROWS:
            scale = clipped_scale(residuals / row)
            alone = min(scale**2, 1.0) * float(np.median((stated / row) ** 2)) if kind == "break-away" else 0.0
            row = np.maximum(row * scale, floor)
        elif stated.any():
            row = row * math.sqrt((STATED + float(np.sum((residuals / row) ** 2))) / (STATED + residuals.size))
        sigma.append(row)
        tau.append(correlation_time(residuals / row))
        together.append(1.0 + (max(tau[-1] / by_chance, 1.0) - 1.0) * (1.0 - alone))
    return sigma, tau, together


def _record_scatter(problem: Problem, groups: Sequence[Array], common: Sequence[float]) -> list[float]:
    """Standard deviation from record to record of the groups' means, for each group; 0 where its rows are no plain forces.

    That is beyond the error that the rows of each group are known to have in common.
    """
    found = [0.0] * len(groups)
    for kind in ("kinetic", "break-away"):
        same = [
            i
            for i, (number, name) in enumerate(problem.groups)
            if name == kind and groups[i].size >= FEWEST_ROWS and (kind != "kinetic" or problem.motions[number].by_work)
        ]
        if len(same) < 2:
            continue
        means = [float(np.median(groups[i])) for i in same]
        centred = [groups[i] - mean for i, mean in zip(same, means, strict=True)]
        # the variance of a median is pi / 2 times that of a mean
        variances = [
            0.5 * math.pi * robust_scale(residuals) ** 2 * correlation_time(residuals) / residuals.size + common[i] ** 2
            for i, residuals in zip(same, centred, strict=True)
        ]
        for i in same:
            found[i] = record_scatter(means, variances)
    return found


def _assumed(problem: Problem, sigma: Sequence[Array], tau: Sequence[float], apart: Array) -> list[Array]:
    """Standard deviations by which rows are weighed in the fit, as if each row stood alone.

    Where the noise of the instrument is known it is that: a group that fits badly may not excuse itself by a large
    scale. What sets records apart is common to the n rows of a group, so that it counts n times in each.
    """
    found = []
    for (number, kind), row, t, shifted in zip(problem.groups, sigma, tau, apart, strict=True):
        motion = problem.motions[number]
        if kind == "kinetic" and motion.indirect and not motion.by_work:
            found.append(np.full_like(row, motion.record.constants["noise"]))
        else:
            found.append(np.hypot(row * math.sqrt(min(t, MOST_CORRELATED)), shifted * math.sqrt(row.size)))
    return found


def _result(
    problem: Problem,
    numbers: Array,
    groups: Sequence[Array],
    sigma: Sequence[Array],
    tau: Sequence[float],
    record_scatter: Sequence[float],
    factors: Sequence[Array],
    assumed: Sequence[Array],
) -> ForceFit:
    factor = np.concatenate(factors)
    jacobian = problem.jacobian(numbers, problem.column) * factor[:, None]
    names = problem.free
    length = np.linalg.norm(jacobian, axis=0)
    problem.refuse((length == 0) | ~np.isfinite(length))
    left, singular, right = np.linalg.svd(jacobian / length, full_matrices=False)
    if singular[-1] < 1e-7 * singular[0]:
        mixed = [name for name, part in zip(names, right[-1], strict=True) if abs(part) > 0.3]
        raise InputError(
            f"identify: {' and '.join(mixed)} of {type(problem.law).__name__} cannot be separated with these records: hold "
            "one of them fixed, or add records at other drive velocities"
        )
    edges = np.cumsum([0, *[len(residuals) for residuals in groups]])
    # Ordinary least squares with weights 1 / assumed, but residuals of variance σ² that go τ by τ: the sandwich.
    inner = (left / singular) @ right  # J (JᵀJ)⁻¹ in units of the columns
    together = [s**2 * t + len(s) * b**2 for s, t, b in zip(sigma, tau, record_scatter, strict=True)]
    excess = np.concatenate([whole / a**2 for whole, a in zip(together, assumed, strict=True)])
    spread = inner * excess[:, None]
    covariance = inner.T @ spread / np.outer(length, length)
    parts = _sums(inner * spread, edges)
    share = parts / parts.sum(axis=0)
    # Few independent rows: each group's variance is that of its residuals over its own degrees of freedom.
    leverage = np.array([np.sum(left[a:b] ** 2) for a, b in pairwise(edges)])
    alone = [float(np.mean(s**2 / whole)) for s, whole in zip(sigma, together, strict=True)]
    independent = np.array([max(len(s) * part, 1.0) for s, part in zip(sigma, alone, strict=True)])
    few = [len(s) < FEWEST_ROWS and bool(stated.any()) for s, stated in zip(sigma, problem.stated, strict=True)]
    scatter_of = independent + np.where(few, STATED, 0.0)
    freedom = np.maximum(scatter_of - leverage, 1.0)
    swell = np.sqrt(np.sum(share * (scatter_of / freedom)[:, None], axis=0))
    covariance = covariance * np.outer(swell, swell)
    freedom_of = 1 / np.sum(share**2 / freedom[:, None], axis=0)
    cycles = _cycles(problem, edges)
    if cycles:
        # The scatter of whole cycles sees what goes together within one, but nothing where they are few: the larger of both.
        column = np.concatenate(groups) * factor
        scores = np.concatenate([cluster_scores(left, column, cuts) for cuts in cycles]) / singular @ right / length
        excessive = np.sum(scores**2, axis=0) / np.diag(covariance)
        part = np.concatenate([_sums(inner * spread, cuts) for cuts in cycles])
        freedom_of = np.where(excessive > 1, np.sum(part, axis=0) ** 2 / np.sum(part**2, axis=0), freedom_of)
        covariance = covariance * np.sqrt(np.outer(np.maximum(excessive, 1), np.maximum(excessive, 1)))
    law = problem.at(numbers)
    repeats, freedom_there = _repeats(problem, law, problem.offset(numbers), inner, factor, parts, edges, freedom)
    covariance = covariance * np.sqrt(np.outer(repeats, repeats))
    freedom_of = np.where(repeats > 1, freedom_there, freedom_of)
    shifts = {
        name: -(inner / length).T @ (factor * problem.slope(numbers, name)) * error
        for name, error in problem.guessed.items()
    }
    # What the break-aways of a record have in common is known beforehand; it adds no scatter that would have to be told.
    scatter = np.diag(covariance)
    for number, late in enumerate(problem.late(law)):
        rows_of = slice(edges[number], edges[number + 1])
        if late.any():
            shift = (inner[rows_of] / length).T @ (factor[rows_of] * late)
            covariance = covariance + np.outer(shift, shift)
    freedom_of = freedom_of * (np.diag(covariance) / scatter) ** 2
    covariance = covariance + sum(np.outer(shift, shift) for shift in shifts.values())
    table, whole = estimate(problem.parameters, numbers, covariance, freedom_of)
    rows = [
        {
            "record": problem.motions[number].record.name,
            "kind": kind,
            "rows": len(groups[i]),
            "independent": independent[i],
            "scale": float(np.median(sigma[i])),
            "record_scatter": record_scatter[i],
        }
        for i, (number, kind) in enumerate(problem.groups)
    ]
    inner_names = [name for name in names if name != OFFSET]
    return ForceFit(
        law=law,
        parameters=table.loc[inner_names],
        covariance=whole.loc[inner_names, inner_names],
        groups=pd.DataFrame(rows),
        rms=problem.rms(law, problem.offset(numbers)),
        weights=factor,
        offset=table.T[OFFSET] if OFFSET in names else None,
        shifts={
            name: pd.Series(shift * problem.parameters.units(numbers), index=names) for name, shift in shifts.items()
        },
    )


def _sums(rows: Array, edges: Sequence[int] | Indices) -> Array:
    """Sums of the rows between edges, shape (edges - 1, columns)."""
    return np.array([np.sum(rows[a:b], axis=0) for a, b in pairwise(edges)])


def _repeats(
    problem: Problem,
    law: Law,
    offset: float,
    inner: Array,
    factor: Array,
    parts: Array,
    edges: Indices,
    freedom: Array,
) -> tuple[Array, Array]:
    """By how much the variance of each number grows where what the law leaves is there again in every period.

    A ripple along the path, or a form that is not quite that of the contact, repeats with the motion: further periods say
    nothing new of it. This is seen on the samples, as rows that repeat do not scatter.

    Returns
    -------
    the growth, at least 1, of the variance that is the sum of `parts`, one for each group of rows; and the degrees of freedom
    of the grown variance, from the `freedom` of each group of rows and, where it is that of samples, from how many
    independent ones there are.
    """
    found, free = parts.copy(), np.repeat(freedom[:, None], parts.shape[1], axis=1)
    for i, (number, kind) in enumerate(problem.groups):
        motion = problem.motions[number]
        if kind != "kinetic" or motion.indirect:
            continue
        w = np.concatenate([motion.slip_velocity[a:b] for a, b in motion.stretches])
        period = recurrence(w)
        if not period:
            continue
        rows, rests = motion.shares(motion.difference(law, offset))
        weight = inner[edges[i] : edges[i + 1]] * factor[edges[i] : edges[i + 1], None]
        scores = weight[rows] * rests[:, None]
        inflation = np.array([variance_inflation(score, period) for score in scores.T])
        of_samples = np.sum(scores**2, axis=0) * inflation
        independent = np.maximum(rows.size / inflation - parts.shape[1], 1.0)
        free[i] = np.where(of_samples > found[i], independent, free[i])
        found[i] = np.maximum(found[i], of_samples)
    share = found / found.sum(axis=0)
    return found.sum(axis=0) / parts.sum(axis=0), 1 / np.sum(share**2 / free, axis=0)


def _cycles(problem: Problem, edges: Indices) -> list[list[int]]:
    """Where the cycles of each record's kinetic force begin among all rows, for laws with memory.

    These carry an error of a turn through all of the climb and the branch that follow. Cycles that are too few for their
    scatter to be told are none.
    """
    if not isinstance(problem.law, WITH_MEMORY):
        return []
    found = [
        [int(start) + row for row in problem.motions[number].cycles()]
        for start, (number, kind) in zip(edges[:-1], problem.groups, strict=True)
        if kind == "kinetic"
    ]
    return found if sum(len(cuts) - 1 for cuts in found) >= 2 * len(problem.free) else []
