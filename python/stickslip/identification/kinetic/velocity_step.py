"""Rate-and-state friction from a step of the drive's speed: the jump, and how it fades with the path slid."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pandas as pd
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from stickslip.errors import InputError
from stickslip.identification.estimator.parameters import places
from stickslip.identification.estimator.uncertainty import correlation_time, half_width
from stickslip.identification.records import opened
from stickslip.laws.law import save_law
from stickslip.laws.rate_state import RateState

if TYPE_CHECKING:
    from stickslip.identification.kinetic.rate_and_state import VelocityStepsFit

Array = npt.NDArray[np.float64]

NAMES = ("a", "b", "length", "stiffness", "reference_friction", "drift", "delay")
BINS = (60, 240)
"""Means of samples before the step, evenly, and after it, ever wider."""


@dataclass(frozen=True)
class VelocityStepFit:
    """Rate-and-state friction fitted to one step of the drive's speed.

    Attributes
    ----------
    law : with the evolution law that fits better.
    parameters : DataFrame over `a`, `b`, `length`, `stiffness` (of the machine, friction per length), `reference_friction`,
        `drift` (friction per length), `delay` (s, of the step against where the displacement shows it) and `a_minus_b`:
        value, error (standard error), low and high (95 %).
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

    def report(self) -> str:
        """The result in words and a table."""
        table = self.parameters.to_string(float_format=lambda number: f"{number:.4g}")
        rms = ", ".join(f"{name} {value:.3g}" for name, value in self.rms.items())
        return "\n".join(
            [f"RateState, {self.law.law} law (rms: {rms})", "", table, "", *[f"- {note}" for note in self.notes]]
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and words."""
        return {
            "law": self.law.to_dict(),
            "parameters": self.parameters.to_dict("index"),
            "rms": self.rms,
            "notes": self.notes,
        }

    def save(self, path: str | Path) -> Path:
        """Write the law file; :func:`stickslip.load_law` and :func:`stickslip.laws.load_covariance` read it back."""
        return save_rate_and_state(path, self)

    def plot(self, ax: Any = None) -> Any:
        """Friction over displacement around the step, measured and fitted; returns the Axes."""
        from stickslip.show.canvas import ABOVE, new_axes

        axes = new_axes()[0] if ax is None else ax
        axes.plot(self.curve["displacement"], self.curve["measured"], ".", ms=3, color="0.5", label="measured (means)")
        axes.plot(self.curve["displacement"], self.curve["fitted"], lw=1.5, color="C0", label=f"{self.law.law} law")
        axes.set_xlabel("displacement from the step (m)")
        axes.set_ylabel("friction coefficient")
        axes.legend(**ABOVE, ncols=2)
        return axes


def fit_velocity_step(friction: xr.DataTree | str | Path, step: int | None = None) -> VelocityStepFit:
    """Fit rate-and-state friction to a step of the drive's speed, the machine's compliance and a drift with it.

    The machine of stiffness κ pulls at V₁, then at V₂: dμ/dt = κ (V₂ − w), μ = μ₀ + a ln(w/V₁) + b ψ, with ψ as in
    :class:`stickslip.laws.RateState`. Both evolution laws are fitted by least squares.

    Parameters
    ----------
    friction : a friction DataTree or file of the gauge ``velocity_steps`` whose force is a friction coefficient.
    step : number of the step, from 0; default: the one whose jump stands out most from its noise.

    Returns
    -------
    VelocityStepFit.

    Raises
    ------
    InputError
        for a record without steps, with a force in place of a friction coefficient, or a number that is none of its steps.

    Limits: one step and one contact, slip one way. Errors hold noise that is correlated along the record, and half of
    what a drift makes of a number; not a drift that bends. `a` and the stiffness round the peak together, so they are
    known less well than a − b.

    Source: Ruina, J. Geophys. Res. 88 (1983) 10359; Reinen & Weeks, J. Geophys. Res. 98 (1993) 15937 (the fit).
    """
    tree, table, name = table_of_steps(friction)
    count = len(table)
    if step is None:
        step = int(np.argmax(table["direct_effect"] / table["direct_effect_error"]))
    if not 0 <= step < count:
        raise InputError(f"{name}: step must be a number from 0 to {count - 1}, got {step}")
    row = table.iloc[step]
    t, place, measured, weight = _means(tree, row)
    speeds = float(row["velocity_before"]), float(row["velocity_after"])
    jump = abs(math.log(speeds[1] / speeds[0]))
    guess_a = max(float(row["direct_effect"]), 1e-5)
    guess_b = max(guess_a - float(row["a_minus_b"]), 1e-6)
    fade = path_of_decay(t * speeds[1], measured, float(row["force_after"]))
    start = np.array([math.log(guess_a), guess_b, math.log(fade), math.log(3 * guess_a * jump / fade), 0.0, 0.0, 0.0])
    start[4] = float(row["force_before"])
    scale = np.array([0.1, 0.1 * guess_b, 0.2, 0.3, 1e-3, 1e-3 / float(np.ptp(place)), 0.2 * fade / speeds[1]])
    within = np.array([4.0, 10 * guess_a, 4.0, 5.0, 0.1, 1e3 * scale[5], 10 * fade / speeds[1]])

    def fit(form: str, drifts: bool) -> Any:
        reach = within if drifts else np.where(np.arange(len(NAMES)) == NAMES.index("drift"), 1e-12, within)

        def rest(numbers: Array) -> Array:
            return (measured - _model(numbers, form, t, place, speeds)) * weight

        bounds = (start - reach, start + reach)
        return least_squares(
            rest, start, bounds=bounds, x_scale=scale, max_nfev=60, diff_step=np.full(len(start), 1e-4)
        )

    found = {form: fit(form, True) for form in ("aging", "slip")}
    rms = {form: float(np.sqrt(np.average((one.fun / weight) ** 2, weights=weight**2))) for form, one in found.items()}
    form = min(found, key=lambda name: float(found[name].cost))
    numbers = found[form].x
    parameters, covariance = _table(found[form], fit(form, False).x)
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
    )
    other = "slip" if form == "aging" else "aging"
    row_ = parameters.loc["a_minus_b"]
    side = "is not told apart from zero" if row_["low"] <= 0 <= row_["high"] else f"is {row_['value']:.2g}"
    notes = [
        f"step from {speeds[0]:.4g} to {speeds[1]:.4g} m/s; a - b {side} ({row_['low']:.2g} to {row_['high']:.2g})",
        f"the {form} law misses the means by {rms[form]:.2g}, the {other} law by {rms[other]:.2g}"
        + ("; one step hardly tells them apart" if rms[other] < 1.05 * rms[form] else ""),
    ]
    curve = pd.DataFrame({"time": t, "displacement": place, "measured": measured})
    curve["fitted"] = _model(numbers, form, t, place, speeds)
    return VelocityStepFit(law, parameters, covariance, rms, notes, curve)


def table_of_steps(friction: Any) -> tuple[xr.DataTree, pd.DataFrame, str]:
    """The record, its steps of the drive's speed and its name; refused where friction is no coefficient."""
    tree = opened(Path(friction)) if isinstance(friction, str | Path) else friction
    if not isinstance(tree, xr.DataTree):
        raise InputError(f"identify: expected a friction file or a DataTree from measure, got {type(tree).__name__}")
    table = tree.children["step"].to_dataset(inherit=False) if "step" in tree.children else xr.Dataset()
    name = str(tree.attrs.get("source", "record"))
    if table.sizes.get("step", 0) == 0:
        raise InputError(f"{name}: holds no step of the drive's speed; measure it with the instrument velocity_steps")
    if table["force_before"].attrs.get("units") != "1":
        raise InputError(
            f"{name}: rate-and-state friction is a friction coefficient, the force here is in "
            f"{table['force_before'].attrs.get('units')}; give the rig a normal_force"
        )
    return tree, table.to_dataframe(), name


def _means(tree: xr.DataTree, row: pd.Series[Any]) -> tuple[Array, Array, Array, Array]:
    """Time and displacement from the step, friction and weight, as means over stretches of samples."""
    time = tree["time"].to_numpy()
    at = float(row["t"])
    first, here, last = np.searchsorted(time, [(float(row["begin"]) + at) / 2, at, float(row["end"])])
    before = np.linspace(first, here, BINS[0] + 1).astype(int)
    after = here + np.geomspace(1, last - here, BINS[1]).astype(int) - 1
    edges = np.unique(np.concatenate([before, after]))
    counts = np.diff(edges)

    def mean(values: Array) -> Array:
        return np.add.reduceat(values[: edges[-1]], edges[:-1]) / counts

    x = tree["displacement"].to_numpy()
    place = mean(x) - float(np.interp(at, time, x))
    friction = tree["force"].to_numpy()
    noise = max(float(np.std(np.diff(friction[first:here]))) / math.sqrt(2), 1e-12)
    return mean(time) - at, place, mean(friction), np.sqrt(counts) / noise


def path_of_decay(path: Array, friction: Array, level: float) -> float:
    """Path from its peak over which friction after a step (path > 0) falls to a third of its distance from the level."""
    later = path > 0
    above = np.abs(friction[later] - level)
    peak = int(np.argmax(above))
    fallen = np.flatnonzero(above[peak:] < above[peak] / 3)
    end = peak + (int(fallen[0]) if fallen.size else len(above) - peak - 1)
    return max(float(path[later][end] - path[later][peak]), 1e-9)


def _model(numbers: Array, form: str, t: Array, place: Array, speeds: tuple[float, float]) -> Array:
    """Friction coefficient at these times from the step."""
    a, b, length, stiffness = math.exp(numbers[0]), numbers[1], math.exp(numbers[2]), math.exp(numbers[3])
    level, drift, delay = numbers[4:]
    first, second = speeds
    since = t - delay

    def rates(_: float, state: Array) -> list[float]:
        log_speed = min(max((state[0] - b * state[1]) / a, -60.0), 60.0)
        w = first * math.exp(log_speed)
        if form == "aging":
            ageing = (first * math.exp(min(-state[1], 60.0)) - w) / length
        else:
            ageing = -w / length * (log_speed + state[1])
        return [stiffness * (second - w), ageing]

    change = np.zeros(len(t))
    later = since > 0
    if later.any():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # numbers at which the integration stalls are answered below
            span = (0.0, float(since[-1]))
            found = solve_ivp(rates, span, [0.0, 0.0], method="LSODA", t_eval=since[later], rtol=1e-6, atol=1e-9)
        if not found.success:
            return np.full(len(t), level + 1.0)  # no motion at these numbers: worse than any misfit
        change[later] = found.y[0]
    return np.asarray(level + drift * place + change)


def _table(found: Any, steady: Array) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Numbers with their errors: residuals that go together along the record, and whether friction drifts (`steady`: not)."""
    numbers = found.x
    jacobian = found.jac
    inverse = np.linalg.pinv(jacobian.T @ jacobian)
    pulls = inverse @ jacobian.T * found.fun
    tau = np.array([correlation_time(pull) for pull in pulls])
    freedom = max(len(found.fun) / float(tau.max()) - len(numbers), 1.0)
    chi = float(np.sum(found.fun**2)) / (len(found.fun) - len(numbers))
    covariance = inverse * max(chi, 1.0) * np.sqrt(np.outer(tau, tau))
    values = numbers.copy()
    slopes = np.eye(len(NAMES) + 1, len(NAMES))
    for i in (0, 2, 3):  # fitted by their logarithm
        values[i] = math.exp(numbers[i])
        slopes[i, i] = values[i]
    slopes[-1, :2] = values[0], -1.0
    drifted = slopes @ (numbers - steady) / 2
    drifted[NAMES.index("drift")] = 0.0
    full = slopes @ covariance @ slopes.T + np.outer(drifted, drifted)
    errors = np.sqrt(np.diag(full))
    half = np.array([half_width(float(error), freedom) for error in errors])
    everything = np.append(values, values[0] - values[1])
    table = pd.DataFrame(
        {"value": everything, "error": errors, "low": everything - half, "high": everything + half},
        index=pd.Index([*NAMES, "a_minus_b"], name="parameter"),
    )
    for i in (0, 2, 3):
        ratio = math.exp(min(half[i] / values[i], 600.0))
        table.loc[NAMES[i], ["low", "high"]] = values[i] / ratio, values[i] * ratio
    return table, pd.DataFrame(full, index=table.index, columns=table.index)


def save_rate_and_state(path: str | Path, fit: VelocityStepFit | VelocityStepsFit) -> Path:
    """Write the law file of a fit to steps of the speed: what the law has not, the machine's stiffness, is in its source."""
    of_law = [name for name in fit.covariance.index if name in places(fit.law)]
    values = {"values": fit.parameters["value"].to_dict(), "errors": fit.parameters["error"].to_dict()}
    return save_law(path, fit.law, fit.covariance.loc[of_law, of_law], {**values, "rms": fit.rms, "notes": fit.notes})
