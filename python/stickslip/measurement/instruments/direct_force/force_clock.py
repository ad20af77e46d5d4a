"""The force, or the current that stands for it, at the times of the motion it belongs to."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.measurement.instruments.direct_force.direct_run import DirectMotion, motion_of, moved_channel
from stickslip.measurement.instruments.instrument import LEAST_SAMPLES, InstrumentRig, Samples
from stickslip.measurement.signals.clocks.clock_offset import LEAST_CORRELATION, Offset, clock_offset, inertia_offset


def force_of_current(samples: Samples, motion: Samples, rig: InstrumentRig) -> Samples:
    """The samples with the force, or the torque of a motor that turns, that the current of a motor stands for."""
    if "current" not in samples:
        return samples
    unit = "N m" if {"rad", "rad/s"} & set(motion.units.values()) else "N"
    force = rig.number("force_per_current") * samples["current"]
    channels = {name: values for name, values in samples.channels.items() if name != "current"} | {"force": force}
    return replace(samples, channels=channels, units={**samples.units, "force": unit})


def without_stated_lag(samples: Samples, rig: InstrumentRig) -> Samples:
    """The force at the times of the motion it belongs to, where the rig says by how much it is written late."""
    lag = rig.maybe("clock_offset")
    if not lag:
        return samples
    force = replace(samples, channels={"time": samples.time, "force": samples["force"]})
    note = f"the force was taken {lag:g} s later than the motion, as the rig says (clock_offset)"
    return replace(samples, channels=_on_the_clock_of_the_motion(force, samples, lag), notes=(*samples.notes, note))


def _on_the_clock_of_the_motion(force: Samples, motion: Samples, offset: float) -> dict[str, Array]:
    """The channels of the motion, and those of the force so much later, where both are there."""
    time = motion.time + offset
    inside = (time >= force.time[0]) & (time <= force.time[-1])
    if np.count_nonzero(inside) < LEAST_SAMPLES:
        raise InputError(
            f"{force.source}: with a clock_offset of {offset:g} s force and motion have {np.count_nonzero(inside)} samples "
            f"in common, at least {LEAST_SAMPLES} are needed; correct clock_offset"
        )
    taken = {name: np.interp(time[inside], force.time, force[name]) for name in force.channels if name != "time"}
    return motion.part(inside).channels | taken


def on_one_clock(force: Samples, motion: Samples, rig: InstrumentRig) -> Samples:
    """The force on the clock of the motion.

    Where the inertia is given the offset is that under which the force is inertia and friction of the motion: where inertia
    makes most of the force, its size has nothing of that of the speed.
    """
    if moved_channel(motion) is None:
        raise InputError(f"{motion.source}: the companion of a force record must hold displacement or velocity")
    given, inertia, moved = rig.maybe("clock_offset"), rig.number("inertia"), motion_of(motion, rig)
    if inertia > 0:
        found = inertia_offset(force.time, force["force"], motion.time, moved.w, moved.acceleration, inertia)
        alike = "force with inertia and friction"
    else:
        found = clock_offset(force.time, force["force"], motion.time, moved.w)
        alike = "force and speed"
        if given is None:
            _check_without_inertia(found, force, motion, moved)
    if given is None and found.correlation < LEAST_CORRELATION:
        raise InputError(
            f"{force.source}: the offset between the clock of the force and that of {motion.source} cannot be determined: "
            f"the correlation of {alike} is {found.correlation:.2f} at best, and {LEAST_CORRELATION:g} is needed; give "
            "clock_offset in the rig" + ("" if inertia > 0 else ", or the inertia between instrument and contact")
        )
    offset = found.value if given is None else given
    notes = [*force.notes, *motion.notes]
    seen = f"{found.value:.3g} +- {found.error:.1g} s by the correlation ({found.correlation:.2f}) of {alike}"
    if given is None:
        notes.append(f"the clock of the force is ahead of that of the motion by {seen}; this was used")
    else:
        notes.append(
            f"the clock of the force is ahead of that of the motion by {given:g} s as the rig says; it is {seen}"
        )
        notes += found.contradiction(given)
    units, source = {**motion.units, **force.units}, f"{force.source}, {motion.source}"
    return Samples(
        _on_the_clock_of_the_motion(force, motion, offset), units, source, tuple(notes), scale_error=motion.scale_error
    )


def _check_without_inertia(found: Offset, force: Samples, motion: Samples, moved: DirectMotion) -> None:
    """Refuse an offset that makes inertia pass for friction: a motion to and fro fits either, a part of a period apart."""
    clocks = force.time, force["force"], motion.time, moved.w, moved.acceleration
    without, free = inertia_offset(*clocks, 0.0), inertia_offset(*clocks, None)
    apart = abs(free.value - found.value) > 3 * math.hypot(free.error, found.error)
    if apart and 1 - free.correlation**2 < 0.5 * (1 - without.correlation**2):
        raise InputError(
            f"{force.source}: the offset between the clock of the force and that of {motion.source} cannot be determined: by "
            f"force and speed it is {found.value:.3g} s, but with inertia in the force {free.value:.3g} s fits better; give "
            "clock_offset in the rig, or the inertia between instrument and contact"
        )
