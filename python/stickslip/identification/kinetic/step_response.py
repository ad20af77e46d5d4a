"""Steps of the drive's speed: their table, and friction after one through a spring, by the rate-and-state law."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd
import xarray as xr
from scipy.integrate import odeint

from stickslip.errors import InputError
from stickslip.identification.estimator.parameters import Parameter, Parameters
from stickslip.identification.estimator.result import Result, in_digits
from stickslip.identification.records import opened
from stickslip.laws.law import save_law
from stickslip.laws.numbers import pointers, units_of
from stickslip.laws.rate_state import RateState

Array = npt.NDArray[np.float64]

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
LENGTHS, EFFECTS, STIFFNESSES = (0.1, 0.3, 1.0, 3.0), (0.4, 0.8, 1.0, 1.4), (1.0, 6.0, 40.0)
"""Contacts that are tried before the search: D_c over the path of the decay, b / a, and κ D_c / a."""
KEPT = 2
"""So many of them, of different D_c, are starting points."""
GAP = 0.3
"""Ramp of the drive from one speed to the next, as a part of the shorter hold, above which it is no step."""
FIRST, EVALUATIONS = 15, 200
"""Most steps of the search from each starting point, and from the best of what they reach."""
RESOLVED = 3.0
"""A length must be so many times the path from sample to sample to show in its samples, not by the form of the law alone."""


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


def ramp_of(time: Array, x: Array, at: float, begin: float, end: float) -> tuple[float, float]:
    """When a drive begins to change its speed and how long it takes (s); (at, 0) where no even ramp stands out.

    Of an even ramp over T the displacement lies |V₂ − V₁| T / 8 above (below) the lines of the two holds where they cross, a
    quarter of that T / 4 before and after.
    """
    old, new = at - begin, end - at
    windows = (begin + 0.25 * old, at - 0.2 * old), (at + 0.2 * new, end - 0.25 * new)
    parts = [slice(*np.searchsorted(time, window).tolist()) for window in windows]
    if min(part.stop - part.start for part in parts) < 8:
        return at, 0.0
    lines = [np.polyfit(time[part] - at, x[part], 1) for part in parts]
    noise = max(
        float(np.std(x[part] - np.polyval(line, time[part] - at))) for part, line in zip(parts, lines, strict=True)
    )
    change = float(lines[1][0] - lines[0][0])
    crossing = at + float((lines[0][1] - lines[1][1]) / change)

    def off(when: float) -> float:
        line = lines[0] if when < crossing else lines[1]
        return math.copysign(1.0, change) * (float(np.interp(when, time, x)) - float(np.polyval(line, when - at)))

    lasts = 8 * off(crossing) / abs(change)
    sample = float(np.median(np.diff(time[parts[0].stop : parts[1].start + 1])))
    if off(crossing) < 5 * noise or not 4 * sample < lasts < GAP * min(old, new):
        return at, 0.0
    sides = [off(crossing + side * lasts / 4) / off(crossing) for side in (-1, 1)]
    return (crossing - lasts / 2, lasts) if all(0.1 < side < 0.45 for side in sides) else (at, 0.0)


def of_ramps(lasts: list[float], paths: list[float]) -> list[str]:
    """That the drive takes its time at a step, and how it is fitted."""
    if not max(lasts) > 0:
        return []
    return [
        f"the drive takes up to {max(lasts):.2g} s ({max(paths):.2g} m of its path) to change its speed in "
        f"{sum(one > 0 for one in lasts)} of the steps: fitted as even ramps; a sudden step tells a and length better"
    ]


def starting_points(response: Callable[[Array], Array], friction: Array, a: float, decay: float) -> list[Array]:
    """Contacts at which a search may begin: those of a grid that lie closest to the record.

    The response to a step is proportional to a where b / a, D_c and κ / a stay, so a follows by linear least squares.

    Parameters
    ----------
    response : of a search vector of `OF_CONTACT`, shape (n,), weighted as the friction is and as free of level and drift; an
        InputError says that there is none.
    friction : shape (n,).
    a, decay : sizes of the direct effect and of the path over which friction decays (m).
    """
    tried: list[tuple[float, float, Array]] = []
    for length, effect, stiffness in product(LENGTHS, EFFECTS, STIFFNESSES):
        size = math.log(a), effect * a, math.log(length * decay), math.log(stiffness * a / (length * decay))
        try:
            found = response(np.array(size))
        except InputError:
            continue
        square = float(found @ found)
        factor = float(np.clip(found @ friction / square, 0.02, 50.0)) if square > 0 else 1.0
        grown = np.array([size[0] + math.log(factor), size[1] * factor, size[2], size[3] + math.log(factor)])
        tried.append((float(np.sum((friction - factor * found) ** 2)), length, grown))
    best: dict[float, Array] = {}
    for _, length, numbers in sorted(tried, key=lambda one: one[0]):
        best.setdefault(length, numbers)
    return list(best.values())[:KEPT]


def undetermined(jacobian: Array, residuals: Array, off: Array, reach: Array) -> npt.NDArray[np.bool_]:
    """Which numbers the record does not determine: they ended at the limit of the search, or act on nothing.

    Parameters
    ----------
    jacobian, residuals : of the fit, shapes (n, p) and (n,).
    off, reach : distance of the search vector from the middle of the search, and the limit of it, shape (p,).
    """
    effect = np.linalg.norm(jacobian, axis=0) * reach
    return np.asarray((np.abs(off) > 0.999 * reach) | (effect < float(np.sqrt(np.mean(residuals**2)))))


def converged(jacobian: Array, residuals: Array, closed: npt.NDArray[np.bool_]) -> bool:
    """Whether another step of the search would move the numbers that are determined by less than a standard error."""
    left = np.linalg.lstsq(jacobian[:, closed], residuals, rcond=None)[0]
    gain = float(np.sum((jacobian[:, closed] @ left) ** 2))
    return gain <= float(np.sum(residuals**2)) / max(len(residuals) - len(left), 1)


def with_limits(covariance: Array, reach: Array, open_ended: npt.NDArray[np.bool_]) -> Array:
    """The covariance where numbers that the record does not determine are known no better than the search went."""
    closed = ~open_ended
    return np.asarray(covariance * np.outer(closed, closed) + np.diag(np.where(open_ended, reach**2, 0.0)))


def what_is_not_known(
    names: list[str], open_ended: npt.NDArray[np.bool_], values: Any, sampled: float, jump: float
) -> list[str]:
    """What the steps say nothing of, and lengths that are too short for the samples, as plain sentences.

    Parameters
    ----------
    names, open_ended : of the numbers, and which of them are not determined.
    values : by name.
    sampled : path from sample to sample after the step (m), of several steps the least.
    jump : ln(V₂/V₁).
    """
    notes = []
    if lost := [name for name, free in zip(names, open_ended, strict=True) if free]:
        notes.append(
            f"not determined by the record: {', '.join(lost)}; the value is where the search ended, the error the range that "
            "was searched"
        )
    lengths = {name: values[name] for name in ("length", "second_length") if name in values}
    for name, length in lengths.items():
        if length < RESOLVED * sampled:
            notes.append(
                f"{name} of {length:.2g} m is not resolved: the drive goes {sampled:.2g} m from sample to sample after a "
                "step, so the decay lies in a few samples and the numbers rest on the form of the law and on the time of "
                "the step; record faster, or step to lower speeds"
            )
    if (loading := values["a"] * abs(jump) / values["stiffness"]) < sampled:
        notes.append(
            f"the stiffness is not resolved: friction rises within {loading:.2g} m of the drive's path, less than the "
            f"{sampled:.2g} m from sample to sample; take it for a lower limit"
        )
    return notes


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


def path_of_decay(path: Array, friction: Array, level: float) -> float:
    """Path from its peak over which friction after a step (path > 0) falls to a third of its distance from the level."""
    later = path > 0
    above = np.abs(friction[later] - level)
    peak = int(np.argmax(above))
    fallen = np.flatnonzero(above[peak:] < above[peak] / 3)
    end = peak + (int(fallen[0]) if fallen.size else len(above) - peak - 1)
    return max(float(path[later][end] - path[later][peak]), 1e-9)


class OfSteps(Result):
    """What fits to steps of the drive's speed have in common: a law with numbers of the machine beside its own."""

    law: RateState
    parameters: pd.DataFrame
    covariance: pd.DataFrame
    rms: dict[str, float]

    def estimates(self) -> pd.DataFrame:
        """The parameters."""
        return self.parameters

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

    def save(self, path: str | Path) -> Path:
        """Write the law file; :func:`stickslip.load_law` and :func:`stickslip.laws.load_covariance` read it back."""
        # what the law has not, the machine's stiffness, is in its source
        of_law = [name for name in self.covariance.index if name in pointers(self.law)]
        source = {
            "values": self.parameters["value"].to_dict(),
            "errors": self.parameters["error"].to_dict(),
            "rms": self.rms,
            "notes": self.notes,
        }
        return save_law(path, self.law, self.covariance.loc[of_law, of_law], source, units_of(self.law, "1"))
