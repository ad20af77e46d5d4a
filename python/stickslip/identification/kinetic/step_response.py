"""Steps of the drive's speed: their table, and friction after one through a spring, by the rate-and-state law."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from scipy.integrate import odeint

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.identification.estimator.parameters import Parameter, Parameters
from stickslip.identification.estimator.result import Result, in_digits
from stickslip.identification.records import tree_of
from stickslip.laws.law import law_file
from stickslip.laws.numbers import pointers, units_of
from stickslip.laws.rate_state import RateState

OF_CONTACT = (
    Parameter("a", logarithmic=True),
    Parameter("b"),
    Parameter("length", logarithmic=True, unit="m"),
    Parameter("stiffness", logarithmic=True, unit="1/m"),
)
"""What a step is fitted with: the contact's numbers, and the machine's stiffness as friction per length."""
OF_SECOND = (Parameter("second_b"), Parameter("second_length", logarithmic=True, unit="m"))
"""What it is fitted with beside them where friction has two state variables."""
A_MINUS_B = {"a_minus_b": {"a": 1.0, "b": -1.0}}
"""What is derived of these numbers."""


def step_response(path: Array, numbers: Array, jump: float, form: str, ramp: float = 0.0) -> Array | None:
    """Friction since a step from V₁ to V₂, from that before it: dμ/dy = κ (1 − w/V₂) along the drive's path y.

    The contact begins in steady slip at V₁: μ = μ₀ + a ln(w/V₁) + b ψ, with ψ as in :class:`stickslip.laws.RateState`. The
    equation stands here, as with a call of the core's law at each evaluation a curve takes nearly twice as long.

    Parameters
    ----------
    path : y, ascending from 0 or later, shape (n,).
    numbers : search vector of `OF_CONTACT`, for two state variables with that of `OF_SECOND` behind it.
    jump : ln(V₂/V₁).
    form : evolution law, "aging" or "slip".
    ramp : path from the step over which the drive changes from V₁ to V₂, at an even acceleration (m).

    Returns
    -------
    μ − μ(0), shape (n,); None where the equations cannot be integrated with these numbers.
    """
    contact = (*OF_CONTACT, *OF_SECOND)[: len(numbers)]
    a, b, length, stiffness, *second = (float(value) for value in Parameters(contact).plain(numbers))

    grows = math.expm1(2 * jump) / ramp if ramp > 0 else 0.0

    def rates(state: Array, y: float) -> list[float]:
        drive = jump if y >= ramp else 0.5 * math.log1p(grows * y)  # ln(V/V₁)
        fast = min(max((state[0] - b * state[1]) / a, -60.0), 60.0)  # ln(w/V₁)
        w = math.exp(fast - drive)  # over the drive's speed
        aging = math.exp(min(-state[1], 60.0) - drive) - w if form == "aging" else -w * (fast + state[1])
        return [stiffness * (1 - w), aging / length]

    def two_rates(state: Array, y: float) -> list[float]:
        drive = jump if y >= ramp else 0.5 * math.log1p(grows * y)
        friction, *states = state
        fast = min(max((friction - b * states[0] - second[0] * states[1]) / a, -60.0), 60.0)
        w = math.exp(fast - drive)
        aging = [math.exp(min(-psi, 60.0) - drive) - w if form == "aging" else -w * (fast + psi) for psi in states]
        return [stiffness * (1 - w), aging[0] / length, aging[1] / second[1]]

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # numbers at which the integration stalls are answered by None
        # the same LSODA as behind solve_ivp, without a call of Python for each of its steps
        found, report = odeint(
            two_rates if second else rates,
            [0.0] * (3 if second else 2),
            np.append(0.0, path),
            rtol=1e-8,
            atol=1e-11,
            mxstep=10_000,
            full_output=True,
        )
    return found[1:, 0] if report["message"] == "Integration successful." else None


def table_of_steps(friction: Any) -> tuple[xr.DataTree, pd.DataFrame, str]:
    """The record, its steps of the drive's speed and its name; refused where friction is no coefficient."""
    tree = tree_of(friction)
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


def path_of_decay(path: Array, friction: Array, level: float) -> float:
    """Path from its peak over which friction after a step (path > 0) falls to a third of its distance from the level."""
    later = path > 0
    above = np.abs(friction[later] - level)
    peak = int(np.argmax(above))
    fallen = np.flatnonzero(above[peak:] < above[peak] / 3)
    end = peak + (int(fallen[0]) if fallen.size else len(above) - peak - 1)
    return max(float(path[later][end] - path[later][peak]), 1e-9)


def means_about(
    at: float, row: tuple[float, float], time: Array, values: Iterable[Array], bins: tuple[int, int]
) -> tuple[Array, list[Array], tuple[int, int, int]]:
    """Means of samples about a step: so many bins in the later half of the hold before it, and in growing bins after it.

    Parameters
    ----------
    at : time of the step.
    row : begin of the hold before and end of the hold after it.
    time, values : of the samples, each (n,).
    bins : before and after the step, at the most.

    Returns
    -------
    Samples in each bin; the means of each of the values; first sample, that at the step, and the one behind the last.
    """
    first, here, end = np.searchsorted(time, [(row[0] + at) / 2, at, row[1]]).tolist()
    before = np.linspace(first, here, bins[0] + 1).astype(int)
    after = here + np.geomspace(1, max(end - here, 2), bins[1]).astype(int) - 1
    edges = np.unique(np.concatenate([before, after]))
    counts = np.diff(edges)
    means = [np.add.reduceat(one[: edges[-1]], edges[:-1]) / counts for one in values]
    return counts, means, (first, here, end)


def a_minus_b_words(parameters: pd.DataFrame) -> str:
    """What is found of a - b, with its interval."""
    row = parameters.loc["a_minus_b"]
    side = "does not differ from zero within its error" if row["low"] <= 0 <= row["high"] else f"is {row['value']:.2g}"
    return f"a - b {side} ({row['low']:.2g} to {row['high']:.2g})"


class OfSteps(Result):
    """What fits to steps of the drive's speed have in common: a law with numbers of the machine beside its own."""

    law: RateState
    parameters: pd.DataFrame
    covariance: pd.DataFrame
    rms: dict[str, float]

    def estimates(self) -> pd.DataFrame:
        """The parameters."""
        return self.parameters

    def misfits(self) -> str:
        """The misfit of each evolution law, in words."""
        return ", ".join(f"{name} {value:.3g}" for name, value in self.rms.items())

    def tables(self) -> list[str]:
        """The parameters."""
        return [in_digits(self.parameters).to_string()]

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and words."""
        return {
            "law": self.law.to_dict(),
            "parameters": self.parameters.to_dict("index"),
            "rms": self.rms,
            "notes": self.notes,
        }

    def to_toml(self) -> str:
        """The law file: the tables [law], [uncertainty], [covariance] and [source]."""
        # what the law has not, the machine's stiffness, is in its source
        of_law = [name for name in self.covariance.index if name in pointers(self.law)]
        source = {
            "values": self.parameters["value"].to_dict(),
            "errors": self.parameters["error"].to_dict(),
            "rms": self.rms,
            "notes": self.notes,
        }
        return law_file(self.law, self.covariance.loc[of_law, of_law], source, units_of(self.law, "1"))
