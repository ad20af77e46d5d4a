"""The law of a fit as a table: friction over the slip velocities of its records, with 95 % bands."""

from __future__ import annotations

import numpy as np
import pandas as pd

from stickslip.identification.kinetic.steady import SteadyFriction
from stickslip.identification.result import Identification
from stickslip.laws.bands import friction_table, long_rest

SPEEDS = 100
TIMES = 21


def law_table(found: Identification | SteadyFriction) -> pd.DataFrame:
    """Friction at slip velocities that the records reached, both ways, and at rest over stick times of the law.

    Returns
    -------
    DataFrame as of :func:`stickslip.laws.friction_table`, the units in the names of its columns where the records state them.
    Of a law without a memory of rest one row is at rest.

    Raises
    ------
    InputError
        where the fit is no law, or its covariance cannot be drawn from.
    """
    if isinstance(found, SteadyFriction):
        law, stated = found.checked_law(), found.stated
        w = found.rows["slip_velocity"].to_numpy()
    else:
        law, stated = found.law, found.records[0].units
        w = np.concatenate([record.slip_velocity[~record.stuck] for record in found.records])
    speed = np.abs(w[w != 0])
    speeds = np.geomspace(max(float(speed.min()), 1e-4 * float(speed.max())), float(speed.max()), SPEEDS)
    grown = law.break_away_force(1e12) > law.break_away_force(0.0)
    times = np.linspace(0.0, long_rest(law), TIMES) if grown else np.zeros(1)
    table = friction_table(law, np.concatenate([-speeds[::-1], speeds]), times)
    units = {"slip_velocity": stated.get("slip_velocity"), "stick_time": stated.get("time", "s" if stated else None)}
    units |= dict.fromkeys(("force", "low", "high"), stated.get("force"))
    return table.rename(columns={name: f"{name} ({unit})" for name, unit in units.items() if unit})
