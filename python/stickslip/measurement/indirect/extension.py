"""The extension of the spring that the readings of a record stand for, without those that are none."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.measurement.disturbances.mains import without_mains
from stickslip.measurement.disturbances.zero_jump import ZeroJump, zero_jumps
from stickslip.measurement.indirect.record_against_rig import check_sampling
from stickslip.measurement.read import Record
from stickslip.measurement.rigs.rig import Rig
from stickslip.measurement.signals.noise import clipped, impulses, noise_level
from stickslip.measurement.signals.piecewise_fit import OscillatorConstants

LEAST_NOISE = 1e-5
"""Of the range of a record: with less noise each slip would be told from a stick by what the splines of the fit round off."""


@dataclass(frozen=True)
class Extension:
    """The extension of the spring that a record tells.

    Attributes
    ----------
    value, weight : (n,) in the length of the rig, and 0 where a sample is no reading.
    noise : standard deviation of the samples, at least `least`; `known_noise` that of the rig.
    stiffness : force or extension that the readings are, per extension.
    saturated : samples at the end of the range; `jumps` of the zero.
    """

    value: Array
    weight: Array
    noise: float
    least: float
    known_noise: float | None
    stiffness: float
    saturated: int
    jumps: list[ZeroJump]


def extension_of(record: Record, rig: Rig, o: OscillatorConstants, notes: list[str]) -> Extension:
    """The readings as extensions; what is left out of them is said in the notes."""
    signal = (without_mains(record, rig, notes) - rig.rest) * rig.force_unit
    stiffness = o.stiffness if rig.instrument == "spring_force" else 1.0
    x = signal / stiffness
    if float(np.ptp(x)) < 1e-100:
        raise InputError(f"{record.source}: column {rig.column!r} is constant; there is no motion in it to measure")
    check_sampling(record, rig)
    known_noise = None if rig.noise is None else rig.noise * abs(rig.force_unit) / stiffness
    weight = np.ones(len(x)) if record.weight is None else record.weight.copy()
    noise, least = known_noise or noise_level(x, weight), LEAST_NOISE * float(np.ptp(x))
    beyond = clipped(x, max(noise, least))
    if beyond.any():
        weight[beyond] = 0.0
        noise = known_noise or noise_level(x, weight)
        notes.append(
            f"{np.count_nonzero(beyond)} samples ({100 * beyond.mean():.1f} %) stand at the end of the instrument's range: "
            "it was saturated there; they were left out, and break-aways among them are not seen; widen the range"
        )
    if noise < least:
        noise = least
        notes.append(
            f"the samples scatter by less than {LEAST_NOISE:g} of their range, as those of a simulated record do: noise of "
            "that size was taken, and the errors are those it makes"
        )
    spikes = impulses(x, noise)
    lone = spikes & ~np.roll(spikes, 1) & ~np.roll(spikes, -1)  # the two samples beside a jump look like impulses
    turn = math.sqrt(o.stiffness / o.mass) * record.step
    jumps = zero_jumps(x, np.where(lone, 0.0, weight), noise, turn)
    if spikes.any():
        weight[spikes] = 0.0
        notes.append(
            f"{np.count_nonzero(spikes)} isolated impulses ({100 * spikes.mean():.1f} % of the samples) were left out"
        )
    return Extension(x, weight, noise, least, known_noise, stiffness, int(np.count_nonzero(beyond)), jumps)
