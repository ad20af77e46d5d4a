"""Runs at constant speed with a torque from a disturbance observer: one point of friction over speed a run."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import xarray as xr

from stickslip.errors import InputError
from stickslip.files.schema import any_number
from stickslip.measurement.instruments.errors_of_means import block_error
from stickslip.measurement.instruments.instrument import Constant, Instrument, InstrumentRig, Samples, notes_of
from stickslip.measurement.regime import regime_of_slip
from stickslip.measurement.result import facts_of_runs, friction_tree
from stickslip.measurement.signals.spectra import main_line

SLOW = 0.2
"""A joint slower than this share of its mean speed is taken as standing still."""
LEAST_RUN_SAMPLES = 16
"""Samples a run must have after it has settled."""


def _measure(records: list[Samples], rig: InstrumentRig) -> xr.DataTree:
    """Mean torque of each run after it has settled, with the error of a mean of samples that follow each other."""
    rows: list[dict[str, float]] = []
    words: list[str] = []
    notes = notes_of(records)
    for record in records:
        start = record.time[0] + rig.number("settle") * (record.time[-1] - record.time[0])
        late = record.time >= start
        torque, speed = record["torque"][late], record["velocity"][late]
        if len(torque) < LEAST_RUN_SAMPLES:
            raise InputError(
                f"{record.source}: {len(torque)} samples are left after settle = {rig.number('settle'):g} of the record, "
                f"at least {LEAST_RUN_SAMPLES} are needed; settle is the share of it that is left out, from 0 to less than 1"
            )
        mean = float(np.mean(speed))
        if mean == 0.0:
            raise InputError(
                f"{record.source}: the joint stands still, so there is no friction of slip in it; leave it out"
            )
        slow = float(np.mean(np.abs(speed) < SLOW * abs(mean)))
        line = main_line(torque, float(np.mean(np.diff(record.time))))
        words.append(regime_of_slip(speed, slow, slow > 0.1))
        rows.append(
            {
                "slip_velocity": mean,
                "velocity_deviation": float(np.std(speed)),
                "force": float(np.mean(torque)),
                "force_error": block_error(torque, 6),
                "force_deviation": float(np.std(torque)),
                "slow_share": slow,
                "main_line": line.frequency,
            }
        )
    order = np.argsort([row["slip_velocity"] for row in rows])
    table = {name: np.array([rows[i][name] for i in order]) for name in rows[0]}
    units = {"slip_velocity": "rad/s", "velocity_deviation": "rad/s", "slow_share": "1", "main_line": "Hz"}
    steady = xr.Dataset({name: ("row", values, {"units": units.get(name, "N m")}) for name, values in table.items()})
    steady["regime"] = ("row", [words[i] for i in order])
    steady["source"] = ("row", [records[i].source for i in order])
    notes.append(
        "the torque is the observer's own estimate: an offset of its zero or of gravity is in it, and runs in one sense "
        "only cannot separate that from friction; where the joint carries a load, measure each run by itself with "
        'instrument = "direct_force" and its angle, and gravity is fitted'
    )
    facts: dict[str, float | str] = {"regime": ", ".join(words[i] for i in order)}
    if len(rows) == 1:
        facts |= {"force": rows[0]["force"], "force_error": rows[0]["force_error"]}
    else:
        facts |= facts_of_runs([records[i].source for i in order], table["force"].tolist())
    return friction_tree(
        series=_series(records[0]) if len(records) == 1 else {},
        tables={"steady": steady},
        source=", ".join(record.source for record in records),
        rig=rig.toml,
        notes=notes,
        facts=facts,
    )


def _series(record: Samples) -> dict[str, tuple[npt.NDArray[np.generic], str]]:
    speed = record["velocity"]
    acceleration = np.gradient(speed, record.time)
    mean = abs(float(np.mean(speed)))
    return {
        "time": (record.time, "s"),
        "slip_velocity": (speed, "rad/s"),
        "slip_acceleration": (acceleration, "rad/s^2"),
        "force": (record["torque"], "N m"),
        "force_error": (np.full(len(speed), float(np.std(np.diff(record["torque"]))) / np.sqrt(2)), "N m"),
        "stuck": (np.abs(speed) < SLOW * mean, "1"),
    }


TORQUE_OBSERVER = Instrument(
    name="torque_observer",
    channels={"velocity": ("angular_speed",), "torque": ("torque",)},
    optional={"angle": ("angle",)},
    constants={"settle": Constant(any_number("ratio"), 0.5)},
    measure=_measure,
)
