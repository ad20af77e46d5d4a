"""How the motion answers to each number of a law, the question of the paper's Fig. 10."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.files.equality import ByContent
from stickslip.files.notebook import OfTable
from stickslip.identification.result import Identification
from stickslip.identification.trajectory.motion_misfit import MotionMisfit
from stickslip.laws.numbers import numbers, value, with_values
from stickslip.simulation.orbit import Orbit

RELATIVE_STEP = 1e-3
"""Relative change of a number for its derivatives."""
ZERO_STEP = 1e-4
"""Change of a number that is 0."""


@dataclass(frozen=True, repr=False, eq=False)
class Sensitivity(ByContent, OfTable):
    """Answers of the motion under one record's drive to changes of the law.

    Attributes
    ----------
    table : DataFrame over the names: for 1 % of the number (of 1 where it is 0) the change of the ``period`` in %, of the
        turning points ``x low``, ``x high``, ``v low``, ``v high`` in % of the half-widths of the measured motion, and of
        the ``stuck`` share of the time in points of per cent.
    record_misfit, identification : what it was computed from.
    """

    table: pd.DataFrame
    record_misfit: MotionMisfit
    identification: Identification

    def plot(self, name: str, change: float = 0.1, ax: Any = None) -> Any:
        """Phase trajectories with one number changed by ∓ `change` of it, as in the paper's Fig. 10; returns the Axes."""
        from stickslip.show.canvas import ABOVE, in_units
        from stickslip.show.canvas import axes as axes_of

        axes = axes_of(ax)
        law = self.identification.law
        middle = value(law, name)
        span = change * abs(middle) if middle else change
        for number, width in ((middle - span, 1.0), (middle, 2.2), (middle + span, 1.0)):
            try:
                orbit, transient = self.record_misfit.orbit(
                    with_values(law, {name: number}), 3 * self.record_misfit.cycle
                )
            except InputError:
                # Not a law there.
                continue
            x, v = orbit.at(_fine(orbit, transient, transient + 3 * self.record_misfit.cycle))
            axes.plot(x, v, lw=width, label=f"{number:.4g}")
        units = self.identification.records[0].units
        velocity, time = units.get("slip_velocity"), units.get("time", "1")
        axes.set_xlabel("displacement x" + in_units(velocity and velocity.removesuffix(f"/{time}")))
        axes.set_ylabel("velocity ẋ" + in_units(velocity))
        axes.legend(**ABOVE, ncols=3, columnspacing=1.0, title=name)
        return axes


def _fine(orbit: Orbit, first: float, last: float) -> Array:
    """Times at which every slip is seen as a curve, however short it is beside the sticks."""
    inner = orbit.events["t"].to_numpy()
    edges = [first, *inner[(inner > first) & (inner < last)], last]
    per_period = 60 / orbit.system.natural_period
    return np.concatenate([np.linspace(a, b, 2 + min(int((b - a) * per_period), 600)) for a, b in pairwise(edges)])


def sensitivity(identification: Identification, record: int = 0) -> Sensitivity:
    """How period, turning points and sticks of the identified motion answer to each fitted number.

    Parameters
    ----------
    identification : a law with its records.
    record : the number of the record whose drive, mass, stiffness and damping are taken.

    Returns
    -------
    Sensitivity: ``.table``, ``.plot(name)``.

    Raises
    ------
    InputError
        for a record without displacement, or a constant that is not known.

    Limits: derivatives of the settled motion, by central differences of exact orbits; at the border of two kinds of motion
    they belong to one side.

    Source: the paper's Section 6 and Fig. 10, in which D moves.
    """
    record_misfit = MotionMisfit(identification.records[record], 0.4)
    names = [str(name) for name in identification.parameters.index]
    rows, known = {}, numbers(identification.law)
    for name in names:
        middle = value(identification.law, name)
        step = RELATIVE_STEP * abs(middle) or ZERO_STEP
        found = []
        for number in (middle + step, middle - step):
            number = min(max(number, known[name].low), known[name].high)
            try:
                found.append((number, record_misfit.landmarks(with_values(identification.law, {name: number}))[0]))
            except InputError:
                continue
        if len(found) < 2:
            rows[name] = [math.nan] * 6
            continue
        (a, up), (b, down) = found
        unit = (abs(middle) or 1.0) / (a - b)
        period = (up.period - down.period) / record_misfit.cycle * unit
        turns = (up.turns - down.turns) / record_misfit.half[[0, 0, 1, 1]] * unit
        rows[name] = [period, *turns, (up.stuck - down.stuck) * unit]
    columns = ["period", "x low", "x high", "v low", "v high", "stuck"]
    table = pd.DataFrame.from_dict(rows, orient="index", columns=columns)
    return Sensitivity(table, record_misfit, identification)
