"""One measured slip, from its stick into the next, and the slip that a law makes from the same beginning."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.identification.records import FrictionRecord
from stickslip.identification.trajectory.motion_misfit import moving
from stickslip.laws import Law
from stickslip.model.system import Oscillator
from stickslip.simulation.simulate import simulate

FEWEST_SLIP_SAMPLES = 8
"""Samples a slip must have to tell a law anything."""
MOST_SLIP_SAMPLES = 200
"""Samples of a slip that are compared, evenly thinned."""
BESIDE = 0.5
"""Of the slip's duration, and of each stick: so much of the sticks before and after is compared with it."""
EARLIER = 0.3
"""Of the slip's duration: so much may its begin differ from where it was seen."""


@dataclass(frozen=True)
class Slip:
    """A slip as it was recorded, time and position counted from where its break-away was seen.

    Attributes
    ----------
    record : its number among the records.
    begin, position : where on the record's clock the break-away was seen, and the displacement there.
    time, x : samples from the stick before to the one after, x from `position`.
    stick_time : of the stick before.
    duration, depth : time to the next stick, and range of x.
    make : the oscillator of the record for a law.
    """

    record: int
    begin: float
    position: float
    time: Array
    x: Array
    stick_time: float
    duration: float
    depth: float
    make: partial[Oscillator]

    @property
    def reach(self) -> tuple[float, float]:
        """How far its true beginning may lie from where it was seen, in time and position."""
        return EARLIER * min(self.duration, self.stick_time), 0.5 * self.depth

    def trace(self, law: Law, late: float, off: float, level: float = 0.0) -> tuple[Array, Array] | None:
        """Position (from `position`) and velocity at the samples, of the law's slip begun `late` and `off` the place seen.

        With friction higher than the law has it by the stiffness times `level`, which shifts the motion as a whole.

        The motion starts in the stick, so that the memory of the law is that of its end; `law` is one whose break-away ends
        this stick there. None where it makes no such motion.
        """
        drive = self.make.keywords["drive_velocity"]
        clock = self.time + self.stick_time
        x0 = self.position + off - level - drive * (self.stick_time + late)
        try:
            orbit = simulate(self.make(law=law), float(clock[-1]), x0=x0)
            x, v = orbit.at(clock)
        except InputError:
            return None
        return np.asarray(x) + level - self.position, np.asarray(v)


def slips_of(record: FrictionRecord, number: int, settled_after: float) -> Iterator[Slip]:
    """The slips of a record that follow a stick of known length and end in one.

    Raises
    ------
    InputError
        where the record holds no displacement, or a constant of the oscillator is not known.
    """
    make, displacement = moving(record)
    signal = displacement if record.recorded is None else record.recorded
    settled = record.settled(settled_after)
    edges = [*(record.time[first] for first, _ in record.slips), record.time[-1]]
    for begin, stick_time, slip in zip(
        record.break_away["t"], record.break_away["stick_time"], record.own_slip(), strict=True
    ):
        if slip is None or not stick_time > 0 or begin - stick_time < settled or slip[1] >= record.time.size:
            continue
        end = float(record.time[slip[1]])
        following = min(edge for edge in edges if edge >= end)
        beside = BESIDE * (end - begin)
        window = begin - min(beside, BESIDE * stick_time), end + min(beside, BESIDE * (following - end))
        inside = (record.time >= window[0]) & (record.time <= window[1]) & np.isfinite(signal)
        if slip[1] - slip[0] < FEWEST_SLIP_SAMPLES or inside.sum() < FEWEST_SLIP_SAMPLES:
            continue
        thinned = np.flatnonzero(inside)[:: max(1, int(inside.sum()) // MOST_SLIP_SAMPLES)]
        position = float(np.interp(begin, record.time, displacement))
        x = signal[thinned] - position
        time = record.time[thinned] - begin
        yield Slip(
            number, float(begin), position, time, x, float(stick_time), end - float(begin), float(np.ptp(x)), make
        )
