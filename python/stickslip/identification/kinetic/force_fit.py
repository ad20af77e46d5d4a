"""The least-squares engine: numbers of a law fitted to measured kinetic force and break-aways, memory included."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import pandas as pd

from stickslip.errors import InputError
from stickslip.identification.estimator.least_squares import OUTLIER, acting, minimize
from stickslip.identification.estimator.record_scatter import record_scatter
from stickslip.identification.estimator.uncertainty import (
    clipped_scale,
    cluster_scores,
    correlation_time,
    estimate,
    own_error,
    recurrence,
    robust_scale,
    variance_inflation,
)
from stickslip.identification.kinetic.motion import WITH_MEMORY, Motion
from stickslip.identification.law_parameters import parameters_of_law
from stickslip.identification.records import FrictionRecord
from stickslip.laws import Coulomb, Law
from stickslip.laws.numbers import Replacement, numbers, value, with_values
from stickslip.laws.state_law import StateLaw

Array = npt.NDArray[np.float64]
Samples = npt.NDArray[np.int_]

ROUNDS = 4
"""Times that the fit is repeated with new scales and weights."""
MOST_CORRELATED = 20.0
"""Correlation beyond that many rows is taken for misfit, which must not take weight from a group during the fit."""
FEWEST_ROWS = 5
"""Rows of which a mean and its error can be told."""
STATED = 5.0
"""Of fewer rows the stated errors are believed too: they count as the scatter of so many more."""
OFFSET = "offset"
"""Name of the constant in the measured force."""


@dataclass(frozen=True)
class BranchFit:
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
    shifts : by name of each number that is held at a guess, how far the fitted ones move with it by one standard deviation.
    """

    law: Law
    parameters: pd.DataFrame
    covariance: pd.DataFrame
    groups: pd.DataFrame
    rms: float
    offset: pd.Series | None = None
    shifts: Mapping[str, pd.Series] = field(default_factory=dict)


STEEPEST = 0.02
"""Least approach of load and limit of a stick, over the rise of the load."""


@dataclass(frozen=True)
class _BreakAways:
    """The break-aways of a record that are compared, each column of shape (n,)."""

    slip: list[tuple[int, int]]
    stick_time: Array
    force: Array
    rate: Array
    sense: Array
    stated: Array

    @classmethod
    def of(cls, table: pd.DataFrame) -> _BreakAways | None:
        """Of a table of them; None of an empty one."""
        if not len(table):
            return None
        names = ("stick_time", "force", "rate", "sense", "stated")
        return cls(table["slip"].to_list(), *(table[name].to_numpy(float) for name in names))


class Problem:
    """Records, a kind of law, and the numbers that are free: what residuals are made of.

    Numbers that are held at a guess come with its standard deviation (`guessed`).

    Residuals come in groups (the kinetic force of each record, the break-aways of each record). A group has its own
    scale, found from its residuals, and its own correlation time τ: smoothed data are not independent, and each group
    weighs what its n / τ independent rows are worth. Where records differ from one another by more than that, each weighs
    as one observation.
    """

    def __init__(
        self,
        records: Sequence[FrictionRecord],
        law: Law,
        free: Sequence[str],
        relative: bool = False,
        constraints: Mapping[str, str] | None = None,
        within: Mapping[str, tuple[float, float]] | None = None,
        offset: bool = False,
        every_row: bool = False,
        guessed: Mapping[str, float] | None = None,
    ) -> None:
        self.guessed = dict(guessed or {})
        # A constant in the measured force is no number of the law; it stands last.
        self.free = [*free, OFFSET] if offset else list(free)
        self.parameters = parameters_of_law(law, self.free, within, constraints)
        self.law = law
        self.relative = relative
        # Break-aways tell Coulomb's law nothing, but it predicts them.
        self.every_row = every_row
        self.motions = [Motion.of(record, type(law)) for record in records]
        self.groups: list[tuple[int, str]] = []
        self.stated: list[Array] = []
        self.tables = [_BreakAways.of(self._rows(motion)) for motion in self.motions]
        for number, (motion, table) in enumerate(zip(self.motions, self.tables, strict=True)):
            if motion.stretches:
                self.groups.append((number, "kinetic"))
                self.stated.append(motion.misfit_error())
            if table is not None:
                self.groups.append((number, "break-away"))
                self.stated.append(table.stated)
        if not self.groups:
            raise InputError(
                "identify: the records hold no stretch of slip whose history is known: take longer records, with "
                "several periods of the motion"
            )
        self._scales = self._natural_scales()
        force = max(float(np.max(np.abs(motion.record.force))) for motion in self.motions)
        stiff = max(max(motion.record.constants.get("stiffness", 1.0), 1.0) for motion in self.motions)
        self.rounding = max(1e-9 * force / stiff, 1e-300)

    def _rows(self, motion: Motion) -> pd.DataFrame:
        # Adhesion is no limit but a state in laws that have one.
        if isinstance(self.law, StateLaw) or (isinstance(self.law, Coulomb) and not self.every_row):
            return pd.DataFrame()
        record = motion.record
        table = record.break_away.assign(slip=pd.Series(record.own_slip(), dtype=object))
        table = table[table["stick_time"].notna() & (table["stick_time"] > 0)]
        if self.relative:
            table = table[table["slip"].notna()]
        rate = table["force_rate"].abs().fillna(_usual_rate(record))
        sense = [record.sense_of(slip) for slip in table["slip"]]
        late = _lag(record) if isinstance(self.law, WITH_MEMORY) else 0.0
        known = record.constants
        shared = np.hypot(rate * known.get("late", 0.0), known.get("common", 0.0))
        own = own_error(table["force_error"].fillna(0.0), shared)
        return table.assign(rate=rate, sense=sense, stated=np.hypot(own, rate * late))

    def _natural_scales(self) -> dict[str, float]:
        force = float(np.median([np.median(np.abs(m.record.force[~m.record.stuck])) for m in self.motions]))
        speed = float(np.max([np.max(np.abs(m.slip_velocity)) for m in self.motions]))
        force, speed = max(force, 1e-300), max(speed, 1e-300)
        sizes = {"": 1.0, "angle": 1.0, "velocity": speed, "force velocity^-1": force / speed}
        known = numbers(self.law)
        by_name = {name: 1.0 if item.ratio else sizes.get(item.dimension, force) for name, item in known.items()}
        return {name: by_name.get(name, force) for name in self.free}

    def late(self, law: Law) -> list[Array]:
        """For each group how its residuals change by what all rows of its record share, by one standard error.

        All break-aways may be seen late, and all forces be off. Of a late break-away the force is read
        further up the loading line, and the stick is taken for longer than it was. A break-away that is compared with its
        own slip shares the error of all forces with it.
        """
        found = [np.zeros_like(stated) for stated in self.stated]
        for i, (number, kind) in enumerate(self.groups):
            motion, table = self.motions[number], self.tables[number]
            late, common = (motion.record.constants.get(name, 0.0) for name in ("late", "common"))
            if kind == "kinetic" and common > 0:
                found[i] = motion.misfit(law) - motion.misfit(law, common)
            if kind == "break-away" and common > 0 and not self.relative:
                found[i] = np.full_like(self.stated[i], common)
            if kind == "break-away" and table is not None and late > 0:
                load = table.sense * table.rate
                grown = law.break_away_force(table.stick_time + late, load) - law.break_away_force(
                    table.stick_time, load
                )
                found[i] = np.hypot(found[i], table.rate * late - grown)
        return found

    def approach(self, law: Law, number: int) -> Array:
        """How fast the load of each stick of a record nears its limit, over how fast the load rises: 1 − f_s′/δ.

        A stick that is stronger by r breaks away r / (1 − f_s′/δ) higher up its loading line, as the limit grows while the
        load goes on to meet it. At least `STEEPEST`.
        """
        table = self.tables[number]
        assert table is not None
        load, h = table.sense * table.rate, 1e-3 * table.stick_time
        above, below = (law.break_away_force(table.stick_time + step, load) for step in (h, -h))
        return np.asarray(np.maximum(1 - (above - below) / (2 * h * np.maximum(table.rate, 1e-300)), STEEPEST))

    # --- numbers <-> law

    @property
    def law(self) -> Law:
        """The law whose other numbers are held."""
        return self._replacement.law

    @law.setter
    def law(self, law: Law) -> None:
        self._replacement = Replacement(law, [item.name for item in self.parameters.all if item.name != OFFSET])

    def numbers(self, law: Law) -> Array:
        """The search vector of a law."""
        return self.parameters.vector({name: 0.0 if name == OFFSET else value(law, name) for name in self.free})

    def at(self, numbers: Array) -> Law:
        """The law with these free numbers."""
        values = self.parameters.values(numbers)
        return self._replacement([values[item.name] for item in self.parameters.all if item.name != OFFSET])

    def offset(self, numbers: Array) -> float:
        """The constant in the measured force."""
        return float(numbers[-1]) if self.free[-1] == OFFSET else 0.0

    def scale(self, name: str) -> float:
        """A natural size of a number."""
        return self._scales[name]

    def bounds(self) -> tuple[Array, Array]:
        """Limits of the search vector."""
        return self.parameters.bounds()

    # --- residuals

    def residuals(self, law: Law, offset: float = 0.0) -> list[Array]:
        """Measured minus predicted, one array per group."""
        found: list[Array] = []
        for number, motion in enumerate(self.motions):
            if motion.stretches:
                found.append(motion.misfit(law, offset))
            table = self.tables[number]
            if table is not None:
                rest = table.force - law.break_away_force(table.stick_time, table.sense * table.rate)
                if offset:
                    rest = rest - offset * table.sense
                if self.relative:
                    ahead = motion.record.force - motion.replay(law) - offset
                    means = [motion.record.sense(*slip) * motion.work_mean(ahead, *slip) for slip in table.slip]
                    rest = rest - np.array(means)
                found.append(rest)
        return found

    def column(self, numbers: Array) -> Array:
        """All residuals at these free numbers."""
        return np.concatenate(self.groups_at(numbers))

    def groups_at(self, numbers: Array) -> list[Array]:
        """Residuals at these free numbers, one array per group."""
        return self.residuals(self.at(numbers), self.offset(numbers))

    def rms(self, law: Law, offset: float = 0.0) -> float:
        """Root mean square of measured minus predicted kinetic force."""
        parts = []
        for motion in self.motions:
            rest = motion.record.force - motion.replay(law) - offset
            parts += [rest[a:b] for a, b in motion.stretches]
        return float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) if parts else math.nan

    def cost(self, law: Law, scales: Sequence[Array] | None = None) -> float:
        """Sum over the groups of the mean of ρ(r / scale): a quick judgement between starting points."""
        total = 0.0
        for i, rest in enumerate(self.residuals(law)):
            scale = robust_scale(rest) if scales is None else scales[i]
            total += float(np.mean(2 * (np.sqrt(1 + (rest / scale) ** 2) - 1)))
        return total

    def jacobian(self, numbers: Array, residuals: Callable[[Array], Array]) -> Array:
        """Central differences, one-sided where one side makes no law.

        The replay of a law with memory is continuous but has kinks, so the steps are wider than rounding asks for.
        """
        low, high = self.bounds()
        here: Array | None = None
        columns = []
        for j, name in enumerate(self.free):
            h = 1e-4 * (abs(numbers[j]) + 0.1 * self._scales[name])
            sides = []
            for step in (h, -h):
                trial = numbers.copy()
                trial[j] = np.clip(trial[j] + step, low[j], high[j])
                try:
                    sides.append((trial[j] - numbers[j], residuals(trial)))
                except InputError:
                    continue
            if len(sides) < 2:
                here = residuals(numbers) if here is None else here
                sides += [(0.0, here)] * (2 - len(sides))
            (above, up), (below, down) = sides[0], sides[1]
            columns.append((up - down) / (above - below) if above != below else np.zeros_like(up))
        return np.stack(columns, axis=1)

    def refuse(self, silent: npt.NDArray[np.bool_]) -> None:
        """Refuse free numbers of which the residuals say nothing, one flag for each."""
        names = [name for name, none in zip(self.free, silent, strict=True) if none]
        if names:
            raise InputError(
                f"identify: the records say nothing about {', '.join(names)} of {type(self.law).__name__}: leave it out of "
                "the free parameters, or add records in which it acts"
            )

    def refuse_silent(self, start: Law) -> None:
        """Refuse a free number that acts neither at the start nor beside it, before anything is searched.

        A number that does not act at one place may act at another, such as a node that other numbers move. So it is looked
        for at the start, and where all others lie a tenth of their size above and below.
        """
        low, high = self.bounds()
        middle = self.numbers(start)
        tenth = 0.1 * (np.abs(middle) + 0.1 * np.array([self._scales[name] for name in self.free]))
        silent = np.ones(len(self.free), dtype=bool)
        for side in (0.0, 1.0, -1.0):
            try:
                steep = self.jacobian(np.clip(middle + side * tenth, low, high), self.column)
            except InputError:
                continue
            silent &= ~acting(steep)
            if not silent.any():
                return
        self.refuse(silent)

    def slope(self, numbers: Array, name: str) -> Array:
        """Derivative of all residuals by a number of the law that is not free, one-sided where one side makes no law."""
        law, offset, error = self.at(numbers), self.offset(numbers), self.guessed[name]
        sides = []
        for step in (0.1 * error, -0.1 * error, 0.0):
            try:
                moved = with_values(law, {name: value(law, name) + step})
                sides.append((step, np.concatenate(self.residuals(moved, offset))))
            except InputError:
                continue
        (above, up), (below, down) = sides[:2]
        return np.asarray((up - down) / (above - below))


def fit_branches(problem: Problem, start: Law, effort: int = 60) -> BranchFit:
    """Least squares from a first guess, with scales, weights and correlation found on the way.

    Parameters
    ----------
    problem : records and free numbers.
    start : the first guess.
    effort : most iterations per round.

    Raises
    ------
    InputError
        where the records say nothing about one of the free numbers.
    """
    numbers = problem.numbers(start)
    low, high = problem.bounds()
    # A search cannot start on a limit.
    inside = 1e-6 * np.array([problem.scale(name) for name in problem.free])
    numbers = np.clip(numbers, low + inside, high - inside)
    problem.refuse_silent(problem.at(numbers))
    first = numbers
    groups = problem.groups_at(numbers)
    common = [float(np.median(np.abs(late))) for late in problem.late(problem.at(numbers))]
    record_scatter = _record_scatter(problem, groups, common)
    apart = np.hypot(record_scatter, common)
    sigma, tau = _scales(problem, groups, apart)
    weights = [np.ones_like(rest) for rest in groups]
    assumed = _assumed(problem, sigma, tau, apart)
    for number in range(ROUNDS):
        factor = np.concatenate([w / a for w, a in zip(weights, assumed, strict=True)])
        numbers = _solve(problem, numbers, factor, effort if number in (0, ROUNDS - 1) else effort // 2)
        groups = problem.groups_at(numbers)
        record_scatter = _record_scatter(problem, groups, common)
        apart = np.hypot(record_scatter, common)
        sigma, tau = _scales(problem, groups, apart)
        weights = [
            (1 + (rest / (OUTLIER * np.hypot(s, b))) ** 2) ** -0.25
            for rest, s, b in zip(groups, sigma, apart, strict=True)
        ]
        if number < ROUNDS - 1:
            assumed = _assumed(problem, sigma, tau, apart)
            # a first step from afar may lead to where a number does not act, from which no further one leads back
            silent = ~acting(problem.jacobian(numbers, problem.column))
            numbers = np.where(silent, first, numbers)
    factors = [w / a for w, a in zip(weights, assumed, strict=True)]
    return _result(problem, numbers, groups, sigma, tau, record_scatter, factors, assumed)


def _solve(problem: Problem, numbers: Array, factor: Array, effort: int) -> Array:
    def scaled(trial: Array) -> Array:
        return problem.column(trial) * factor

    return minimize(
        scaled,
        [numbers],
        problem.bounds(),
        partial(problem.jacobian, residuals=scaled),
        evaluations=effort,
        tolerance=1e-9,
    ).vector


def _scales(
    problem: Problem, groups: Sequence[Array], apart: npt.NDArray[np.float64]
) -> tuple[list[Array], list[float]]:
    """Standard deviation of each row and correlation time of each group, beside what sets the records apart."""
    sigma, tau = [], []
    for group, stated, shifted in zip(groups, problem.stated, apart > 0, strict=True):
        rest = group - float(np.median(group)) if shifted else group
        spread = robust_scale(rest)
        inner = math.sqrt(max(spread**2 - float(np.median(stated**2)), 0.0)) if rest.size >= FEWEST_ROWS else 0.0
        if not stated.any():
            inner = spread
        # Exact data have no scatter: below this rounding would be fitted.
        floor = problem.rounding
        row = np.maximum(np.hypot(stated, inner), floor)
        # Rows whose stated errors are too small or too large for their scatter: believe the scatter.
        if rest.size >= FEWEST_ROWS:
            row = np.maximum(row * clipped_scale(rest / row), floor)
        elif stated.any():
            row = row * math.sqrt((STATED + float(np.sum((rest / row) ** 2))) / (STATED + rest.size))
        sigma.append(row)
        tau.append(correlation_time(rest / row))
    return sigma, tau


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
            0.5 * math.pi * robust_scale(rest) ** 2 * correlation_time(rest) / rest.size + common[i] ** 2
            for i, rest in zip(same, centred, strict=True)
        ]
        for i in same:
            found[i] = record_scatter(means, variances)
    return found


def _assumed(
    problem: Problem, sigma: Sequence[Array], tau: Sequence[float], apart: npt.NDArray[np.float64]
) -> list[Array]:
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
) -> BranchFit:
    factor = np.concatenate(factors)
    jacobian = problem.jacobian(numbers, problem.column) * factor[:, None]
    names = problem.free
    length = np.linalg.norm(jacobian, axis=0)
    problem.refuse((length == 0) | ~np.isfinite(length))
    left, singular, right = np.linalg.svd(jacobian / length, full_matrices=False)
    if singular[-1] < 1e-7 * singular[0]:
        mixed = [name for name, part in zip(names, right[-1], strict=True) if abs(part) > 0.3]
        raise InputError(
            f"identify: {' and '.join(mixed)} of {type(problem.law).__name__} cannot be told apart with these records: hold "
            "one of them fixed, or add records at other drive velocities"
        )
    edges = np.cumsum([0, *[len(rest) for rest in groups]])
    # Ordinary least squares with weights 1 / assumed, but residuals of variance σ² that go τ by τ: the sandwich.
    inner = (left / singular) @ right  # J (JᵀJ)⁻¹ in units of the columns
    together = [s**2 * t + len(s) * b**2 for s, t, b in zip(sigma, tau, record_scatter, strict=True)]
    excess = np.concatenate([whole / a**2 for whole, a in zip(together, assumed, strict=True)])
    spread = inner * excess[:, None]
    covariance = inner.T @ spread / np.outer(length, length)
    share = np.array([np.sum(inner[a:b] * spread[a:b], axis=0) for a, b in pairwise(edges)])
    share = share / share.sum(axis=0)
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
        part = np.array([np.sum(inner[a:b] * spread[a:b], axis=0) for cuts in cycles for a, b in pairwise(cuts)])
        freedom_of = np.where(excessive > 1, np.sum(part, axis=0) ** 2 / np.sum(part**2, axis=0), freedom_of)
        covariance = covariance * np.sqrt(np.outer(np.maximum(excessive, 1), np.maximum(excessive, 1)))
    law = problem.at(numbers)
    repeats = _repeats(problem, law, problem.offset(numbers), inner, factor, spread, edges)
    covariance = covariance * np.sqrt(np.outer(repeats, repeats))
    freedom_of = np.maximum(freedom_of / repeats, 1.0)
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
    return BranchFit(
        law=law,
        parameters=table.loc[inner_names],
        covariance=whole.loc[inner_names, inner_names],
        groups=pd.DataFrame(rows),
        rms=problem.rms(law, problem.offset(numbers)),
        offset=table.T[OFFSET] if OFFSET in names else None,
        shifts={
            name: pd.Series(shift * problem.parameters.units(numbers), index=names) for name, shift in shifts.items()
        },
    )


def _repeats(
    problem: Problem, law: Law, offset: float, inner: Array, factor: Array, spread: Array, edges: Samples
) -> Array:
    """By how much the variance of each number grows where what the law leaves is there again in every period.

    A ripple along the path, or a form that is not quite that of the contact, repeats with the motion: further periods say
    nothing new of it. This is seen on the samples, as rows that repeat do not scatter.
    """
    seen = np.stack([np.sum(inner[a:b] * spread[a:b], axis=0) for a, b in pairwise(edges)])
    found = seen.copy()
    for i, (number, kind) in enumerate(problem.groups):
        motion = problem.motions[number]
        if kind != "kinetic" or motion.indirect:
            continue
        w = np.concatenate([motion.slip_velocity[a:b] for a, b in motion.stretches])
        period = recurrence(w)
        if not period:
            continue
        rows, parts = motion.shares(motion.record.force - motion.replay(law) - offset)
        weight = inner[edges[i] : edges[i + 1]] * factor[edges[i] : edges[i + 1], None]
        scores = weight[rows] * parts[:, None]
        found[i] = np.maximum(found[i], [np.sum(score**2) * variance_inflation(score, period) for score in scores.T])
    return np.asarray(found.sum(axis=0) / seen.sum(axis=0))


def _cycles(problem: Problem, edges: Samples) -> list[list[int]]:
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


def _usual_rate(record: FrictionRecord) -> float:
    known = record.constants
    return known.get("stiffness", 0.0) * known.get("drive_velocity", 0.0)


def _lag(record: FrictionRecord) -> float:
    """How late the end of a stick may be seen where friction does not jump at it.

    After such a release the slip path grows like (k V / m) t³ / 6; it shows once it passes the noise of the instrument.
    """
    known = record.constants
    if not {"noise", "mass", "stiffness", "drive_velocity"} <= set(known):
        return 0.0
    jerk = known["stiffness"] * abs(known["drive_velocity"]) / known["mass"]
    return float((6 * known["noise"] / jerk) ** (1 / 3)) if jerk > 0 else 0.0
