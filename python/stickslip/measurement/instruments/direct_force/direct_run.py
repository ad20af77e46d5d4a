"""One record of a force that is measured in its line: its motion, and its friction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stickslip.errors import InputError
from stickslip.files.arrays import Array, Mask
from stickslip.measurement.instruments.instrument import InstrumentRig, Samples
from stickslip.measurement.signals.smooth import jerk_spline


@dataclass(frozen=True)
class DirectMotion:
    """Speed and acceleration with their errors, (n,), the unit of length, and the cut-off of what smoothed them."""

    w: Array
    w_error: Array
    acceleration: Array
    acceleration_error: Array
    length: str
    cutoff: float


@dataclass(frozen=True)
class DirectRun:
    """A record with its motion and its friction.

    Attributes
    ----------
    force, error : (n,) friction and its standard error, in `unit`.
    stuck : (n,) whether the speed is that of a stick.
    lag : s by which the force is late at the slips; 0 where that is not known.
    between : share of a step by which the force was interpolated between its samples.
    """

    record: Samples
    motion: DirectMotion
    force: Array
    error: Array
    stuck: Mask
    lag: float
    between: float
    unit: str
    notes: list[str]
    facts: dict[str, float | str]


def moved_channel(samples: Samples) -> str | None:
    """The channel that the motion is taken from."""
    return next((name for name in ("velocity", "displacement") if name in samples), None)


def motion_of(record: Samples, rig: InstrumentRig) -> DirectMotion:
    """The motion of a record, from its speed or its displacement."""
    name = moved_channel(record)
    if name is None:
        raise InputError(f"{record.source}: a direct_force instrument needs a column of displacement or of velocity")
    smooth = jerk_spline(record.time, record[name], cutoff=rig.maybe("cutoff"))
    length = record.units[name].removesuffix("/s")
    numbers = (
        (smooth.x, smooth.x_error, smooth.v, smooth.v_error)
        if name == "velocity"
        else (smooth.v, smooth.v_error, smooth.a, smooth.a_error)
    )
    motion = DirectMotion(*numbers, length, smooth.cutoff)
    if not (np.abs(motion.w) > 0).any():
        raise InputError(
            f"{record.source}: nothing moves in this record, so it holds no friction of slip; take another"
        )
    return motion
