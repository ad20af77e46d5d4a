"""Rate-and-state friction from all steps of the drive's speed in a record, together (one alone: `single_velocity_step`)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from stickslip.errors import InputError
from stickslip.files.arrays import Array, Indices, Mask
from stickslip.identification.estimator.least_squares import linear, minimize, project_out
from stickslip.identification.estimator.parameters import Parameters
from stickslip.identification.estimator.uncertainty import estimate, half_width
from stickslip.identification.kinetic.step_drive import notes_if_behind_spring, notes_on_ramps, ramp_of
from stickslip.identification.kinetic.step_response import (
    A_MINUS_B,
    OF_CONTACT,
    OfSteps,
    a_minus_b_words,
    means_about,
    path_of_decay,
    step_response,
    table_of_steps,
)
from stickslip.identification.kinetic.step_search import (
    EVALUATIONS,
    FIRST,
    RESOLVED,
    is_undetermined,
    notes_on_convergence,
    notes_on_undetermined,
    starting_points,
    with_limits,
)
from stickslip.laws.rate_state import RateState

NAMES = tuple(parameter.name for parameter in OF_CONTACT)
LEAST_STEPS = 4
"""Steps below which their scatter says too little of the errors."""
MEANS_ABOUT_STEP = (30, 120)
"""Means over each hold before a step, evenly over its later half, and after it, ever wider."""
REACH = np.array([4.0, 0.3, 6.0, 8.0])
"""How far ln a, b, ln D_c and ln κ are searched."""
JUMP_ROUNDING = 0.1
"""Steps whose logarithms of the ratio of speeds round alike to this are computed as one, and scaled by it."""


@dataclass(frozen=True)
class _Step:
    """Means around one step: the path since it, friction, and which run of holds under one load it belongs to.

    `sampled` is the path from sample to sample after the step, `ramp` the time that the drive takes for it.
    """

    path: Array
    friction: Array
    speeds: tuple[float, float]
    load: float
    run: int
    sampled: float
    ramp: float

    @property
    def jump(self) -> float:
        """ln(V₂/V₁)."""
        return math.log(self.speeds[1] / self.speeds[0])

    @property
    def alike(self) -> tuple[float, float]:
        """That of all steps that are computed as one with it, and the path of the drive's ramp."""
        jump = math.copysign(max(round(abs(self.jump) / JUMP_ROUNDING), 1) * JUMP_ROUNDING, self.jump)
        return jump, self.ramp * sum(self.speeds) / 2


@dataclass(frozen=True, repr=False, eq=False)
class VelocityStepsFit(OfSteps):
    """Rate-and-state friction fitted to all steps of a record.

    Attributes
    ----------
    law : with the evolution law that fits better.
    parameters : DataFrame over `a`, `b`, `length`, `stiffness` (of the machine, friction per length) and `a_minus_b`: value,
        error (standard error, from the scatter over the steps), low and high (95 %), and `scatter`, the standard deviation
        of one step's number about that of all.
    covariance : DataFrame of these numbers, names in both directions.
    loads : DataFrame of the same numbers for each run of steps under one load, with `normal_force` and `steps`.
    steps : DataFrame of the steps: speeds, load, rms, and the numbers each alone would pull the fit to (linearised).
    rms : root mean square of measured minus fitted, by evolution law.
    notes : plain sentences.
    curves : DataFrame of the means: step, path, measured, fitted, both from the friction before the step.
    """

    law: RateState
    parameters: pd.DataFrame
    covariance: pd.DataFrame
    loads: pd.DataFrame
    steps: pd.DataFrame
    rms: dict[str, float]
    notes: list[str]
    curves: pd.DataFrame = field(repr=False)

    def heading(self) -> list[str]:
        """The law, its steps and its misfit."""
        return [f"RateState, {self.law.law} law, from {len(self.steps)} steps (rms: {self.misfits()})"]

    def tables(self) -> list[str]:
        """The parameters, and those of each load where there are several."""
        shown = ["normal_force", "steps", *NAMES, "a_minus_b", "a_minus_b_low", "a_minus_b_high"]
        loads = [self.loads[shown]] if len(self.loads) > 1 else []
        return super().tables() + [table.to_string(float_format=lambda number: f"{number:.4g}") for table in loads]

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and words."""
        return super().to_dict() | {name: getattr(self, name).to_dict("records") for name in ("loads", "steps")}

    def plot(self, ax: Any = None) -> Any:
        """Friction from before each step over the path since it, over ln(V₂/V₁), measured and fitted; returns the Axes."""
        from stickslip.show.canvas import ABOVE, axes, logarithmic_x

        ax = axes(ax)
        # A path of nothing but rounding has no place on a logarithmic axis.
        seen = self.curves[self.curves["path"] > 1e-6 * self.curves["path"].max()]
        ax.plot(seen["path"], seen["measured"], ".", ms=2, alpha=0.3, color="0.5", label="measured", rasterized=True)
        for number, (_, one) in enumerate(seen.groupby("step")):
            ax.plot(one["path"], one["fitted"], lw=0.6, color="C0", label=None if number else f"{self.law.law} law")
        logarithmic_x(ax, seen["path"])
        ax.set_xlabel("path from the step (m)")
        ax.set_ylabel("(friction − before) / ln(V₂/V₁)")
        ax.legend(**ABOVE, ncols=2)
        return ax


def fit_velocity_steps(friction: xr.DataTree | str | Path) -> VelocityStepsFit:
    """Fit rate-and-state friction to all steps of the drive's speed at once, the machine's compliance with it.

    Along the path y that the drive goes since a step from V₁ to V₂, dμ/dy = κ (1 − w/V₂), μ = μ₀ + a ln(w/V₁) + b ψ, with
    ψ as in :class:`stickslip.laws.RateState`: so steps of one ratio V₂/V₁ are one curve over y. a, b, D_c and κ are common
    to all steps; each step has a level μ₀ of its own, each run of steps under one load a drift with the path. Every step
    weighs by its own misfit, and the errors come from how the steps differ from each other (the sandwich of clustered
    errors), so what repeats in none of them (a wave of the servo, a drift that bends) is in the errors.

    Parameters
    ----------
    friction : a friction DataTree or file of the instrument ``velocity_steps`` whose force is a friction coefficient.

    Returns
    -------
    VelocityStepsFit.

    Raises
    ------
    InputError
        for a record without steps or with fewer than four, or with a force in place of a friction coefficient.

    Limits: one contact, slip one way, no inertia, one state variable. What all steps have in common and the law has not, a
    second length for example, is in no error.

    Source: Ruina, J. Geophys. Res. 88 (1983) 10359; Reinen & Weeks, J. Geophys. Res. 98 (1993) 15937 (the fit); Liang &
    Zeger, Biometrika 73 (1986) 13 (clustered errors).
    """
    tree, table, name = table_of_steps(friction)
    if len(table) < LEAST_STEPS:
        raise InputError(
            f"{name}: {len(table)} steps are too few to tell their scatter, at least {LEAST_STEPS} are needed; fit one step "
            "with fit_velocity_step"
        )
    steps = _steps(tree, table)
    start = _start(table, steps)
    found = {form: _Fit.of(steps, [start], form, screened=True) for form in ("aging", "slip")}
    form = min(found, key=lambda key: found[key].cost)
    best, other = found[form], found["slip" if form == "aging" else "aging"]
    parameters, covariance, scores = best.table()
    runs = [[step for step in steps if step.run == run] for run in sorted({step.run for step in steps})]
    rows = []
    for part in runs:
        if len(part) < LEAST_STEPS:
            continue
        own = parameters if len(part) == len(steps) else _Fit.of(part, [best.numbers], form).table()[0]
        row: dict[str, float] = {"normal_force": float(np.mean([step.load for step in part])), "steps": len(part)}
        for end in ("value", "low", "high"):
            tail = "" if end == "value" else f"_{end}"
            row |= {f"{key}{tail}": float(number) for key, number in own[end].to_dict().items()}
        rows.append(row)
    per_step = table.assign(rms=best.rms_of_steps, **{key: scores[:, i] for i, key in enumerate((*NAMES, "a_minus_b"))})
    reference = float(np.exp(np.mean([np.log(step.speeds) for step in steps])))
    value = parameters["value"]
    levels = [
        m + value["a_minus_b"] * math.log(reference / s.speeds[0]) for m, s in zip(best.levels, steps, strict=True)
    ]
    law = RateState(
        normal_force=float(np.median([step.load for step in steps])),
        a=value["a"],
        b=value["b"],
        length=value["length"],
        reference_velocity=reference,
        reference_friction=float(np.median(levels)),
        law=form,
    )
    return VelocityStepsFit(
        law=law,
        parameters=parameters,
        covariance=covariance,
        loads=pd.DataFrame(rows),
        steps=per_step,
        rms={key: one.rms for key, one in sorted(found.items())},
        notes=_words(steps, best, other, parameters) + notes_if_behind_spring(tree, table),
        curves=best.curves(),
    )


def _words(steps: list[_Step], best: _Fit, other: _Fit, parameters: pd.DataFrame) -> list[str]:
    speeds = [speed for step in steps for speed in step.speeds]
    gain = other.costs - best.costs
    clear = float(gain.mean()) > 2 * float(gain.std(ddof=1)) / math.sqrt(len(gain))
    notes = [
        f"{len(steps)} steps between {min(speeds):.4g} and {max(speeds):.4g} m/s, all with one a, b, length and stiffness; "
        f"{a_minus_b_words(parameters)}",
        f"the {best.form} law fits better than the {other.form} law in {int(np.sum(gain > 0))} of the steps"
        + ("" if clear else "; they hardly separate the two"),
        "errors come from the scatter over the steps; a, b and the stiffness round the peak together, so they are known less "
        "well than a - b",
    ]
    notes += notes_on_undetermined(
        list(NAMES),
        best.undetermined,
        parameters["value"],
        min(step.sampled for step in steps),
        min(abs(s.jump) for s in steps),
    )
    notes += notes_on_ramps([step.ramp for step in steps], [step.alike[1] for step in steps])
    notes += notes_on_convergence(best.jacobian, best.residuals, best.undetermined)
    off, error, where = best.common()
    if abs(off) > 3 * error:
        notes.append(
            f"{where:.2g} m after a step all steps lie {off:+.2g} +- {error:.1g} (over ln(V2/V1)) off the law in common, as "
            "they do where one length is not enough; that is in no error"
        )
    return notes


def _steps(tree: xr.DataTree, table: pd.DataFrame) -> list[_Step]:
    time, x, friction = (tree[name].to_numpy() for name in ("time", "displacement", "force"))
    load = tree["normal_force"].to_numpy() if "normal_force" in tree.variables else np.ones(len(time))
    found: list[_Step] = []
    names = ("t", "begin", "end", "velocity_before", "velocity_after")
    run, until = 0, math.inf
    for at, begin, last, *speeds in table[list(names)].to_numpy().tolist():
        # where the hold before this step is not the one after the step before, the load was changed between them
        run, until = run + (begin > until), last
        at, ramp = ramp_of(time, x, at, begin, last)
        _, (path, mean), (first, here, end) = means_about(at, (begin, last), time, (x, friction), MEANS_ABOUT_STEP)
        path -= float(np.interp(at, time, x))
        sampled = speeds[1] * float(np.median(np.diff(time[here : end + 1])))
        found.append(_Step(path, mean, (speeds[0], speeds[1]), float(np.mean(load[first:end])), run, sampled, ramp))
    return found


def _start(table: pd.DataFrame, steps: list[_Step]) -> Array:
    """ln a, b, ln D_c, ln κ from the table of the steps and how far friction takes to settle."""
    a = max(float(table["direct_effect"].median()), 1e-5)
    b = max(a - float(table["a_minus_b"].median()), 1e-6)
    length = float(np.median([path_of_decay(step.path, step.friction, float(step.friction[-1])) for step in steps]))
    return np.array([math.log(a), b, math.log(length), math.log(3 * a / length)])


@dataclass(frozen=True)
class _Fit:
    """Numbers common to the steps, with levels and drifts solved for at every trial of them."""

    steps: list[_Step]
    form: str
    weights: Array
    numbers: Array
    jacobian: Array
    residuals: Array
    middle: Array
    """Of the search."""

    @classmethod
    def of(cls, steps: list[_Step], starts: list[Array], form: str, *, screened: bool = False) -> _Fit:
        """From the best of some starts (`screened`: and of a grid), then with each step weighed by its own misfit."""
        blank = cls(steps, form, np.ones(len(steps)), starts[0], np.empty(0), np.empty(0), starts[0])
        if screened:
            starts = [*starts, *blank._screened(math.exp(starts[0][0]), math.exp(starts[0][2]))]
        fit = min((blank._search(start, FIRST) for start in starts), key=lambda one: float(np.sum(one.residuals**2)))
        for _ in range(2):
            fit = replace(fit, weights=1 / np.maximum(fit.rms_of_steps, 1e-9))._search(fit.numbers)
        return fit

    def _screened(self, a: float, decay: float) -> list[Array]:
        without_nuisance = project_out(self._nuisance)
        friction = without_nuisance(np.concatenate([step.friction for step in self.steps]))
        return starting_points(lambda numbers: without_nuisance(self._model(numbers)), friction, a, decay)

    def _search(self, start: Array, evaluations: int = EVALUATIONS) -> _Fit:
        edges = self._edges
        weight = np.repeat(self.weights, np.diff(edges))
        friction = np.concatenate([step.friction for step in self.steps]) * weight
        without_nuisance = project_out(self._nuisance * weight[:, None])

        def residuals(numbers: Array) -> Array:
            return without_nuisance(friction - self._model(numbers) * weight)

        scale = np.array([0.1, 1e-3, 0.3, 0.3])
        found = minimize(
            residuals, [start], (start - REACH, start + REACH), scale=scale, step=1e-4, evaluations=evaluations
        )
        return replace(self, numbers=found.vector, jacobian=found.jacobian, residuals=found.residuals, middle=start)

    @property
    def _edges(self) -> Indices:
        return np.cumsum([0, *(len(step.path) for step in self.steps)])

    @property
    def _nuisance(self) -> Array:
        """Levels of the steps and drifts of the runs."""
        edges = self._edges
        runs = sorted({step.run for step in self.steps})
        columns = np.zeros((edges[-1], len(self.steps) + len(runs)))
        for number, step in enumerate(self.steps):
            here = slice(edges[number], edges[number + 1])
            columns[here, number] = 1.0
            columns[here, len(self.steps) + runs.index(step.run)] = step.path
        return np.asarray(columns / np.linalg.norm(columns, axis=0))

    def _model(self, numbers: Array) -> Array:
        """Friction from before each step: steps alike are one curve over the path."""
        curves: dict[tuple[float, float], tuple[Array, Array]] = {}
        for alike in {step.alike for step in self.steps}:
            far = max(float(step.path[-1]) for step in self.steps if step.alike == alike)
            grid = np.concatenate([[0.0], np.geomspace(1e-4, 1.0, 200) * far])
            response = step_response(grid, numbers, alike[0], self.form, alike[1])
            if response is None:
                raise InputError(f"no motion follows from {numbers}")  # such a step of the search is refused
            curves[alike] = grid, response
        parts = [step.jump / step.alike[0] * np.interp(step.path, *curves[step.alike]) for step in self.steps]
        return np.concatenate(parts)

    def _by_step(self, values: Array) -> list[Array]:
        return np.split(values, self._edges[1:-1])

    @property
    def costs(self) -> Array:
        """Sum of squared misfits of each step, over the weight that the better law gave it."""
        return np.array([float(np.sum(part**2)) for part in self._by_step(self.residuals)]) / self.weights**2

    @property
    def cost(self) -> float:
        """Sum of the logarithms of the steps' misfits: a noisy step counts as much as a quiet one."""
        return float(np.sum(np.log(self.costs)))

    @property
    def rms_of_steps(self) -> Array:
        """Root mean square of measured minus fitted, by step."""
        return np.sqrt(self.costs / np.diff(self._edges))

    @property
    def rms(self) -> float:
        """The same over all."""
        return float(np.sqrt(np.sum(self.costs) / self._edges[-1]))

    @property
    def levels(self) -> Array:
        """Friction before each step."""
        weight = np.repeat(self.weights, np.diff(self._edges))
        columns = self._nuisance
        off = np.concatenate([step.friction for step in self.steps]) - self._model(self.numbers)
        found = linear(columns, off, 1 / weight)
        sizes = [float(columns[at, number]) for number, at in enumerate(self._edges[:-1])]
        return np.asarray(found[: len(self.steps)] * sizes)

    @property
    def undetermined(self) -> Mask:
        """Which numbers the steps do not determine."""
        return is_undetermined(self.jacobian, self.residuals, self.numbers - self.middle, REACH)

    def _timing(self) -> Array:
        """What residuals change by where all steps come half a sample later, a whole one where the length is not resolved."""
        weight = np.repeat(self.weights, np.diff(self._edges))
        finest = min(step.sampled for step in self.steps)
        share = 0.5 if math.exp(self.numbers[2]) >= RESOLVED * finest else 1.0
        later = [replace(step, path=step.path - share * step.sampled) for step in self.steps]
        change = (self._model(self.numbers) - replace(self, steps=later)._model(self.numbers)) * weight
        return project_out(self._nuisance * weight[:, None])(change)

    def table(self) -> tuple[pd.DataFrame, pd.DataFrame, Array]:
        """Numbers with errors, their covariance, and those of each step alone.

        The errors come from the scatter over the steps, and from their times, which are known to half a sample.
        """
        count = len(self.steps)
        # A number that acts on nothing would take its share of every move at random.
        inverse, known = np.zeros((len(NAMES), len(NAMES))), ~self.undetermined
        inverse[np.ix_(known, known)] = np.linalg.pinv(self.jacobian[:, known].T @ self.jacobian[:, known])
        parts = zip(np.split(self.jacobian, self._edges[1:-1]), self._by_step(self.residuals), strict=True)
        # the minimum moves by minus this where a step counts once more; clustered errors are their squares
        moves = np.array([-inverse @ (jacobian.T @ part) for jacobian, part in parts])
        freedom = max(count - len(NAMES), 1)
        parameters = Parameters(OF_CONTACT)
        over_steps = moves.T @ moves * count / freedom
        timing = inverse @ (self.jacobian.T @ self._timing())
        whole = with_limits(over_steps + np.outer(timing, timing), REACH, self.undetermined)
        # what the timing adds does not come from a few steps (Welch & Satterthwaite)
        certain = freedom / np.maximum(np.diag(over_steps) / np.maximum(np.diag(whole), 1e-300), 1e-6) ** 2
        table, covariance = estimate(parameters, self.numbers, whole, certain, A_MINUS_B)
        alone = estimate(parameters, self.numbers, over_steps, freedom, A_MINUS_B)[0]["error"]
        change, error = table["value"].to_dict()["a_minus_b"], table["error"].to_dict()["a_minus_b"]
        half = half_width(error, freedom * (error / max(float(alone["a_minus_b"]), 1e-300)) ** 4)
        table.loc["a_minus_b", "low"], table.loc["a_minus_b", "high"] = change - half, change + half
        moves = moves * parameters.units(self.numbers)
        moves = np.column_stack([moves, moves[:, 0] - moves[:, 1]])
        table = table.assign(scatter=alone * math.sqrt(count))
        return table, covariance, np.asarray(table["value"].to_numpy() + count * moves)

    def common(self) -> tuple[float, float, float]:
        """The largest misfit that the steps have in common, over ln(V₂/V₁), its standard error, and the path it is at."""
        curves = self.curves()
        later = curves[curves["path"] > 0]
        bins = np.geomspace(float(later["path"].quantile(0.05)), float(later["path"].max()), 16)
        off = later.assign(off=later["measured"] - later["fitted"], bin=np.digitize(later["path"], bins))
        means = off.pivot_table(index="bin", columns="step", values="off")
        means = means[means.notna().mean(axis=1) > 0.5]
        value, error = means.mean(axis=1).to_numpy(), means.sem(axis=1).to_numpy()
        worst = int(np.argmax(np.abs(value) / error))
        return float(value[worst]), float(error[worst]), float(bins[max(int(means.index[worst]) - 1, 0)])

    def curves(self) -> pd.DataFrame:
        """The means of all steps, from the friction before each and over its jump."""
        parts = []
        fitted = self._by_step(self._model(self.numbers))
        residuals = self._by_step(self.residuals / np.repeat(self.weights, np.diff(self._edges)))
        for number, (step, model, off) in enumerate(zip(self.steps, fitted, residuals, strict=True)):
            jump = step.jump
            data = {"step": number, "path": step.path, "measured": (model + off) / jump, "fitted": model / jump}
            parts.append(pd.DataFrame(data))
        return pd.concat(parts, ignore_index=True)
