"""The table of break-aways that a fit of static friction starts from, and what it holds at all."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from stickslip.files.arrays import Array
from stickslip.identification.estimator.residual_statistics import robust_scale
from stickslip.identification.records import FrictionRecord

FEWEST_ROWS = 5
SAME_RATE = 1.5
"""Force rates within this ratio are one."""
LONGER = 1.1
"""Scatter of forces may make a stick that much longer than its load takes from -f to f."""


def break_away_rows(records: list[FrictionRecord]) -> pd.DataFrame:
    """All break-aways with a known stick time, with its `record`, and `level` (kinetic force) and `sense` of its slip."""
    frames = []
    for number, record in enumerate(records):
        table = record.break_away.assign(force_rate=record.force_rates())
        slips = record.own_slip()
        table["record"] = number
        table["late"] = record.constants.get("late", 0.0)
        table["common"] = record.constants.get("common", 0.0)
        table["level"] = [math.nan if slip is None else record.slip_level(*slip) for slip in slips]
        table["sense"] = [record.sense_of(slip) for slip in slips]
        frames.append(table[table["stick_time"].notna() & (table["stick_time"] > 0)])
    rows = pd.concat(frames, ignore_index=True)
    rows.attrs["units"] = dict(records[0].units)
    return rows


def common_error(rows: pd.DataFrame) -> Array:
    """Standard error in force that each break-away has in common with the others of its record: late, or of the zero."""
    late = np.asarray((rows["late"] * rows["force_rate"].abs()).fillna(0.0))
    return np.hypot(late, np.asarray(rows["common"])) if "common" in rows else late


def is_relative(rows: pd.DataFrame) -> tuple[bool, list[str]]:
    """Whether friction drifts along the records so much that each break-away must be compared with its own slip."""
    both = rows[rows["level"].notna()]
    if len(both) < FEWEST_ROWS:
        return False, []
    centred = both[["force", "level"]] - both.groupby("record")[["force", "level"]].transform("median")
    plain = robust_scale(centred["force"].to_numpy())
    above = robust_scale((centred["force"] - centred["level"]).to_numpy())
    if above > 0.7 * plain:
        return False, []
    return True, [
        f"Break-away forces scatter by {plain:.3g}, but only by {above:.3g} above the kinetic force of the slip that "
        "follows each: static friction was fitted above that force."
    ]


def one_rate(rows: pd.DataFrame) -> bool:
    """Whether all break-aways with a force rate come at nearly one, as from one drive velocity."""
    rate = np.log(rows["force_rate"].abs()[rows["force_rate"].abs() > 0].to_numpy())
    return bool(rate.size and np.subtract(*np.quantile(rate, [0.9, 0.1])) < math.log(SAME_RATE))


def on_loading_line(rows: pd.DataFrame) -> pd.Series[bool]:
    """Which sticks were loaded steadily, at the one rate of their record, so that where each ends follows from its chance.

    A stick that began at -f and is loaded to f cannot have lasted longer; one that did, by `LONGER`, was a rest of the drive.
    """
    rate = rows["force_rate"].abs()
    each = rate.groupby(rows["record"])
    one = each.transform("max") < SAME_RATE * each.transform("min")
    return one & (rate * rows["stick_time"] <= 2 * LONGER * rows["force"].abs())
