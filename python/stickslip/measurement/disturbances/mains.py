"""The line of the mains in a record: taken out where the rig names it, else said."""

from __future__ import annotations

import math

import numpy as np

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.measurement.read import Record
from stickslip.measurement.rigs.rig import Rig
from stickslip.measurement.signals.noise import line_excess, mains_hum


def without_mains(record: Record, rig: Rig, notes: list[str]) -> Array:
    """The signal without the mains line that the rig names; a line it does not name is noted."""
    signal = record.signal
    if rig.mains_frequency is not None:
        if rig.mains_frequency * record.step > 0.4:
            raise InputError(
                f"{record.source}: a mains line of {rig.mains_frequency:g} Hz cannot be seen at "
                f"{1 / record.step:g} samples per second; remove mains_frequency from the rig"
            )
        line, frequency = mains_hum(signal, record.time, rig.mains_frequency)
        notes.append(
            f"a mains line at {frequency:.4g} Hz with an amplitude of {math.sqrt(2) * float(np.std(line)):.2g} "
            f"{rig.unit} was subtracted"
        )
        return signal - line
    if rig.unit != "1":  # a dimensionless record has no mains
        for frequency in (50.0, 60.0):
            excess = line_excess(signal, record.step, frequency)
            if excess > 10:
                notes.append(
                    f"the record has a line at {frequency:g} Hz, {excess:.0f} times its neighbourhood; set "
                    f"mains_frequency = {frequency:g} in the rig to take it out"
                )
    return signal
