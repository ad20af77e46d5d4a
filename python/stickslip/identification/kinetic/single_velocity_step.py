"""Rate-and-state friction from a step of the drive's speed: the jump, and how it fades with the path slid."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from stickslip.errors import InputError
from stickslip.files.arrays import Array, Mask
from stickslip.identification.estimator.least_squares import Minimum, minimize, project_out
from stickslip.identification.estimator.parameters import Parameter, Parameters
from stickslip.identification.estimator.residual_statistics import correlation_time
from stickslip.identification.estimator.uncertainty import correlated_covariance, estimate
from stickslip.identification.kinetic.step_drive import notes_on_ramps, ramp_of
from stickslip.identification.kinetic.step_response import (
    A_MINUS_B,
    OF_CONTACT,
    OF_SECOND,
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
    is_undetermined,
    notes_on_convergence,
    notes_on_undetermined,
    starting_points,
    with_limits,
)
from stickslip.laws.rate_state import RateState

OF_STEP = (*OF_CONTACT, Parameter("reference_friction"), Parameter("drift", unit="1/m"), Parameter("delay", unit="s"))
CONTACT, WITH_STEP, DRIFT = len(OF_CONTACT), len(OF_STEP), 5
"""How many numbers the contact and the step with it have; those of a second state are behind them."""
MEANS_ABOUT_STEP = (60, 240)
"""Means of samples before the step, evenly, and after it, ever wider."""
NOISY = 2.0
"""A misfit that many times the noise before the step is no noise."""
CLEAR_DEVIATIONS = 3.0
"""Standard deviations of noise that must lie between the curves of two laws to tell them apart."""


@dataclass(frozen=True, repr=False, eq=False)
class VelocityStepFit(OfSteps):
    """Rate-and-state friction fitted to one step of the drive's speed.

    Attributes
    ----------
    law : with the evolution law that fits better.
    parameters : DataFrame over `a`, `b`, `length`, `stiffness` (of the machine, friction per length), `reference_friction`,
        `drift` (friction per length), `delay` (s, of the step against where the displacement shows it), with two state
        variables `second_b` and `second_length`, and `a_minus_b` (less both effects of the state): value, error (standard
        error), low and high (95 %).
    covariance : DataFrame of these numbers, names in both directions.
    rms : root mean square of measured minus fitted, by evolution law.
    notes : plain sentences.
    curve : DataFrame: time, displacement (from the step), measured, fitted.
    """

    law: RateState
    parameters: pd.DataFrame
    covariance: pd.DataFrame
    rms: dict[str, float]
    notes: list[str]
    curve: pd.DataFrame

    def heading(self) -> list[str]:
        """The law and its misfit."""
        return [f"RateState, {self.law.law} law (rms: {self.misfits()})"]

    def plot(self, ax: Any = None) -> Any:
        """Friction over displacement around the step, measured and fitted; returns the Axes."""
        from stickslip.show.canvas import ABOVE, axes

        ax = axes(ax)
        ax.plot(self.curve["displacement"], self.curve["measured"], ".", ms=3, color="0.5", label="measured (means)")
        ax.plot(self.curve["displacement"], self.curve["fitted"], lw=1.5, color="C0", label=f"{self.law.law} law")
        ax.set_xlabel("displacement from the step (m)")
        ax.set_ylabel("friction coefficient")
        ax.legend(**ABOVE, ncols=2)
        return ax


def fit_velocity_step(
    friction: xr.DataTree | str | Path, step: int | None = None, *, states: int = 1
) -> VelocityStepFit:
    """Fit rate-and-state friction to a step of the drive's speed, the machine's compliance and a drift with it.

    The machine of stiffness κ pulls at V₁, then at V₂: dμ/dt = κ (V₂ − w), μ = μ₀ + a ln(w/V₁) + b ψ, with ψ as in
    :class:`stickslip.laws.RateState`. Both evolution laws are fitted by least squares.

    Parameters
    ----------
    friction : a friction DataTree or file of the instrument ``velocity_steps`` whose force is a friction coefficient.
    step : number of the step, from 0; default: the one whose jump stands out most from its noise.
    states : 1 or 2 state variables; of two, b ψ + b₂ ψ₂ stands for b ψ and the longer length is `length`.

    Returns
    -------
    VelocityStepFit.

    Raises
    ------
    InputError
        for a record without steps, with a force in place of a friction coefficient, a number that is none of its steps, or
        of states that is neither 1 nor 2.

    Limits: one step and one contact, slip one way. Errors hold noise that is correlated along the record, and half of
    what a drift makes of a number; not a drift that bends. `a` and the stiffness round the peak together, so they are
    known less well than a − b. Two state variables need a step whose noise is small beside b and b₂, and lengths well apart:
    otherwise their numbers have errors as large as they are.

    Source: Ruina, J. Geophys. Res. 88 (1983) 10359; Reinen & Weeks, J. Geophys. Res. 98 (1993) 15937 (the fit).
    """
    if isinstance(states, bool) or states not in (1, 2):
        raise InputError(f"fit_velocity_step: states must be 1 or 2, got {states!r}")
    tree, table, name = table_of_steps(friction)
    count = len(table)
    if step is None:
        step = int(np.argmax(table["direct_effect"] / table["direct_effect_error"]))
    if not 0 <= step < count:
        raise InputError(f"{name}: step must be a number from 0 to {count - 1}, got {step}")
    row = table.iloc[step]
    t, position, measured, weight, ramp = _means(tree, row)
    speeds = float(row["velocity_before"]), float(row["velocity_after"])
    jump = abs(math.log(speeds[1] / speeds[0]))
    guess_a = max(float(row["direct_effect"]), 1e-5)
    guess_b = max(guess_a - float(row["a_minus_b"]), 1e-6)
    fade = path_of_decay(t * speeds[1], measured, float(row["force_after"]))
    start = np.array([math.log(guess_a), guess_b, math.log(fade), math.log(3 * guess_a * jump / fade), 0.0, 0.0, 0.0])
    start[4] = float(row["force_before"])
    scale = np.array([0.1, 0.1 * guess_b, 0.2, 0.3, 1e-3, 1e-3 / float(np.ptp(position)), 0.2 * fade / speeds[1]])
    without_nuisance = project_out(np.column_stack([weight, position * weight]))
    within = np.array([4.0, 10 * guess_a, 4.0, 5.0, 0.1, 1e3 * scale[5], 10 * fade / speeds[1]])

    def fit(form: str, drifting: Minimum | None = None) -> Minimum:
        """The least misfit; without a drift the one beside that with it."""
        reach = within if drifting is None else np.where(np.arange(WITH_STEP) == DRIFT, 1e-12, within)

        def residuals(numbers: Array) -> Array:
            return (measured - _model(numbers, form, t, position, speeds, ramp)) * weight

        def response(contact: Array) -> Array:
            known = np.concatenate([contact, [0.0, 0.0, 0.0]])
            return without_nuisance(_model(known, form, t, position, speeds, ramp) * weight)

        starts = [start if drifting is None else drifting.vector]
        if drifting is None:
            tried = starting_points(response, without_nuisance(measured * weight), guess_a, fade)
            starts += [np.concatenate([contact, start[CONTACT:]]) for contact in tried]
        if states == 1 or drifting is None:
            limits = start - reach, start + reach
            one = minimize(residuals, starts, limits, scale=scale, step=1e-4, evaluations=FIRST)
            one = minimize(residuals, [one.vector], limits, scale=scale, step=1e-4, evaluations=EVALUATIONS)
            if states == 1:
                return one
            # Half of the effect to each length, the other a quarter of the one that fits alone or four times as long.
            half = np.where(np.arange(WITH_STEP) == 1, 0.5, 1.0) * one.vector
            starts = [np.concatenate([half, [half[1], half[2] + by]]) for by in (-math.log(4), math.log(4))]
        size, more = (np.concatenate([values, values[1:3]]) for values in (scale, reach))
        middle = np.concatenate([start, [0.0, start[2]]])
        found = minimize(
            residuals, starts, (middle - more, middle + more), scale=size, step=1e-4, evaluations=EVALUATIONS
        )
        return _longer_first(found)

    found = {form: fit(form) for form in ("aging", "slip")}
    rms = {
        form: float(np.sqrt(np.average((one.residuals / weight) ** 2, weights=weight**2)))
        for form, one in found.items()
    }
    form = min(found, key=lambda name: float(found[name].cost))
    numbers = found[form].vector
    middle = np.concatenate([start, [0.0, start[2]]])[: len(numbers)]
    reach = np.concatenate([within, within[1:3]])[: len(numbers)]
    undetermined = is_undetermined(found[form].jacobian, found[form].residuals, numbers - middle, reach)
    parameters, covariance = _table(found[form], fit(form, found[form]).vector, reach, undetermined)
    values = parameters["value"]
    load = float(tree["normal_force"].median()) if "normal_force" in tree.variables else 1.0
    law = RateState(
        normal_force=load,
        a=values["a"],
        b=values["b"],
        length=values["length"],
        reference_velocity=speeds[0],
        reference_friction=values["reference_friction"],
        law=form,
        second_b=values.get("second_b"),
        second_length=values.get("second_length"),
    )
    other = "slip" if form == "aging" else "aging"
    notes = [
        f"step from {speeds[0]:.4g} to {speeds[1]:.4g} m/s; {a_minus_b_words(parameters)}",
        f"the {form} law misses the means by {rms[form]:.2g}, the {other} law by {rms[other]:.2g}"
        + ("" if _laws_differ(found[form], found[other]) else "; this step does not separate them"),
    ]
    if (chi := float(np.sqrt(np.mean(found[form].residuals ** 2)))) > NOISY:
        notes.append(
            f"the fit misses the means by {chi:.2g} times what the noise from sample to sample gives them: noise is slower, "
            "or drive, machine or contact are not as in the law; the errors hold how the misfit goes on along the record, "
            "not what the law lacks: look at the plot"
        )
    notes += notes_on_ramps([ramp], [ramp * sum(speeds) / 2])
    notes += notes_on_convergence(found[form].jacobian, found[form].residuals, undetermined)
    after = tree["time"].to_numpy()
    after = after[(after > float(row["t"])) & (after < float(row["end"]))]
    sampled = speeds[1] * float(np.median(np.diff(after)))
    notes += notes_on_undetermined(list(parameters.index[: len(numbers)]), undetermined, values, sampled, jump)
    curve = pd.DataFrame({"time": t, "displacement": position, "measured": measured})
    curve["fitted"] = _model(numbers, form, t, position, speeds, ramp)
    return VelocityStepFit(law, parameters, covariance, rms, notes, curve)


def _laws_differ(best: Minimum, other: Minimum) -> bool:
    """Whether a law fits better by more than chance.

    Were the other law true, the two misfits could differ by Δχ² only where the noise along the difference of the two curves
    is √Δχ² standard deviations or more; here of noise that is as large and as correlated as what the better law leaves.
    """
    left = best.residuals
    unit = max(float(np.mean(left**2)), 1.0) * correlation_time(left)
    return 2 * float(other.cost - best.cost) > CLEAR_DEVIATIONS**2 * unit


def _longer_first(found: Minimum) -> Minimum:
    """The same minimum with the longer of two lengths as the first."""
    order = np.arange(WITH_STEP + 2)
    if found.vector[WITH_STEP + 1] > found.vector[2]:
        order[[1, 2, WITH_STEP, WITH_STEP + 1]] = [WITH_STEP, WITH_STEP + 1, 1, 2]
    return replace(found, vector=found.vector[order], jacobian=found.jacobian[:, order])


def _means(tree: xr.DataTree, row: pd.Series[Any]) -> tuple[Array, Array, Array, Array, float]:
    """Time and displacement from the step, friction and weight, as means of samples, and the drive's ramp (s)."""
    time = tree["time"].to_numpy()
    x = tree["displacement"].to_numpy()
    friction = tree["force"].to_numpy()
    t, begin, end = (float(row[name]) for name in ("t", "begin", "end"))
    at, ramp = ramp_of(time, x, t, begin, end)
    counts, means, (first, here, _) = means_about(at, (begin, end), time, (time, x, friction), MEANS_ABOUT_STEP)
    noise = max(float(np.std(np.diff(friction[first:here]))) / math.sqrt(2), 1e-12)
    return means[0] - at, means[1] - float(np.interp(at, time, x)), means[2], np.sqrt(counts) / noise, ramp


def _model(
    numbers: Array, form: str, t: Array, position: Array, speeds: tuple[float, float], ramp: float = 0.0
) -> Array:
    """Friction coefficient at these times from the step."""
    level, drift, delay = numbers[CONTACT:WITH_STEP]
    contact = np.concatenate([numbers[:CONTACT], numbers[WITH_STEP:]])
    since = t - delay
    later = since > 0
    change = np.zeros(len(t))
    if later.any():
        s, (old, new) = since[later], speeds
        path = new * s
        if ramp > 0:
            path = np.where(s < ramp, old * s + (new - old) * s**2 / (2 * ramp), new * s - (new - old) * ramp / 2)
        found = step_response(path, contact, math.log(new / old), form, ramp * (old + new) / 2)
        if found is None:
            return np.full(len(t), level + 1.0)  # no motion at these numbers: worse than any misfit
        change[later] = found
    return np.asarray(level + drift * position + change)


def _table(found: Minimum, steady: Array, reach: Array, undetermined: Mask) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Numbers with their errors: residuals that go together along the record, and whether friction drifts (`steady`: not).

    What is `undetermined` is known no better than to the `reach` of the search.
    """
    freedom = len(found.residuals) - len(found.vector)
    chi = float(np.sum(found.residuals**2)) / freedom
    covariance, independent = correlated_covariance(found.jacobian, found.residuals, max(chi, 1.0))
    drifted = (found.vector - steady) / 2
    drifted[DRIFT] = 0.0
    parameters = Parameters((*OF_STEP, *OF_SECOND)[: len(found.vector)])
    second = {"second_b": -1.0} if "second_b" in parameters.names else {}
    derived = {name: {**weights, **second} for name, weights in A_MINUS_B.items()}
    covariance = with_limits(covariance + np.outer(drifted, drifted), reach, undetermined)
    return estimate(parameters, found.vector, covariance, independent, derived)
