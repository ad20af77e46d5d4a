"""A list of slips made elsewhere: when each began, the force before it and how far that fell."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from stickslip.errors import InputError
from stickslip.measurement.instruments.errors_of_means import straight_line
from stickslip.measurement.instruments.instrument import Instrument, InstrumentRig, Samples, only
from stickslip.measurement.result import event_table, friction_tree


def _measure(records: list[Samples], rig: InstrumentRig) -> xr.DataTree:
    """The table of break-aways of a list of slips: the stick time is the wait since the slip before.

    Nothing says how long a slip lasts, so the stick time is too long by that; the force rate is what was regained over
    the wait. The forces are taken as exact: a list states no errors.
    """
    record = only(records, "event_list")
    time, force = record.time, record["force"]
    if "drop" not in record and "force_after" not in record:
        raise InputError(
            f"{record.source}: an event_list needs a column of drop or of force_after; add it to [columns]"
        )
    drop = record["drop"] if "drop" in record else force - record["force_after"]
    if (rising := np.flatnonzero(drop <= 0)).size:
        raise InputError(
            f"{record.source}: slip {rising[0] + 1} has a drop of {drop[rising[0]]:.4g}, and {rising.size} of {len(drop)} "
            "are not above 0; expected how far the force falls in each slip: correct the sign, or the column of force_after"
        )
    wait = np.concatenate([[math.nan], np.diff(time)])
    regained = np.concatenate([[math.nan], force[1:] - (force - drop)[:-1]])
    unknown = np.full(len(time), math.nan)
    zero = np.zeros(len(time))
    rows = np.stack([time, zero, wait, zero, regained / wait, unknown, force, zero, drop, zero], axis=1)
    unit = record.units["force"]
    facts: dict[str, float | str] = {
        "slips": float(len(time)),
        "regime": "stick_slip",
        "force": float(force.mean()),
        "force_error": float(force.std(ddof=1)),
        "lowest_force": float(force.min()),
        "highest_force": float(force.max()),
        "lowest_drop": float(drop.min()),
        "highest_drop": float(drop.max()),
        "recurrence": float(np.nanmean(wait)),
    }
    notes = [
        *record.notes,
        "a list of slips shows nothing of the motion between them: the stick time is the wait since the slip before, and "
        "there is no friction while slipping",
    ]
    known = wait > 0
    if np.count_nonzero(known) > 5 and wait[known].max() > 1.01 * wait[known].min():
        logarithm = np.log10(wait[known])
        facts["force_per_decade"], facts["force_per_decade_error"] = straight_line(logarithm, force[known])
        facts["correlation"] = float(np.corrcoef(logarithm, force[known])[0, 1])
    if "slip" in record:
        facts |= {"lowest_slip": float(record["slip"].min()), "highest_slip": float(record["slip"].max())}
    return friction_tree(
        series={},
        tables={"break_away": event_table(rows.tolist(), unit)},
        source=record.source,
        rig=rig.toml,
        notes=notes,
        facts=facts,
    )


EVENT_LIST = Instrument(
    name="event_list",
    channels={"force": ("force", "torque", "pressure", "ratio")},
    optional={
        "drop": ("force", "torque", "pressure", "ratio"),
        "force_after": ("force", "torque", "pressure", "ratio"),
        "slip": ("length", "angle"),
    },
    constants={},
    measure=_measure,
)
