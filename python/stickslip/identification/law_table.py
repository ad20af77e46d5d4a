"""The law of a fit as a table: friction over the slip velocities of its records, with 95 % bands."""

from __future__ import annotations

import numpy as np
import pandas as pd

from stickslip.identification.result import Identification
from stickslip.identification.steady.steady_result import SteadyFriction
from stickslip.laws.bands import table_up_to


def law_table(found: Identification | SteadyFriction) -> pd.DataFrame:
    """Friction at slip velocities that the records reached, each way that was measured, and at rest over stick times.

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
    ways = [way for way in (-1.0, 1.0) if (way * w > 0).any()]
    speed = np.abs(w[w != 0])
    time = stated.get("time", "s" if stated else None)
    top, least = float(speed.max()), float(speed.min())
    return table_up_to(law, top, stated.get("force"), stated.get("slip_velocity"), time, least, ways)
