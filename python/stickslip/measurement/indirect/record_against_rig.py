"""Where a record and its rig contradict each other: refused where nothing could be measured, else said."""

from __future__ import annotations

import math

import numpy as np

from stickslip.errors import InputError
from stickslip.files.units import unit_suffix
from stickslip.measurement.indirect.force import Friction, likeliest_inertia, restoring_excess
from stickslip.measurement.indirect.sticks.resting_sticks import BLUR, FEW_PER_PERIOD
from stickslip.measurement.read import Record
from stickslip.measurement.regime import PARTS
from stickslip.measurement.rigs.rig import Rig, RigUnits
from stickslip.measurement.signals.piecewise_fit import OscillatorConstants
from stickslip.measurement.signals.presmooth import Presmoothed, natural_period
from stickslip.measurement.signals.spectra import Line
from stickslip.measurement.signals.turning_points import Flanks

MOSTLY_SLOW = 0.4
"""Share of slow time below which the main line of a record is that of the oscillator."""

LEAST_PER_PERIOD = 6
"""Samples that the free mass must give in a period for its acceleration to be seen."""

SWING_OFF, SWING_ERRORS = 0.02, 4.0
"""Part by which the frequency of the slips must lie from sqrt(k/m)/2pi to be named, and standard errors."""
TRAVELS, LONG = 0.1, 5.0
"""A position that moves on with the drive, to that part, for more periods of the free mass is no stretch of a spring."""
DRIVING_ERRORS, DRIVING_PART = 3.0, 0.25
"""Friction does work on the slip where its mean is below zero by so many standard errors, and by that part of the spring's
swing."""
RISES = 30.0
"""No mass that a drive drags along rises so many times faster than the drive."""


def check_sampling(record: Record, rig: Rig) -> None:
    """Refuse samples too far apart for the free mass of the rig, as with stamps in another unit of time."""
    if record.step * rig.natural_frequency * LEAST_PER_PERIOD > 1:
        raise InputError(
            f"{record.source}: samples are {record.step:.3g} s apart, and by the rig's stiffness and mass the free mass "
            f"swings once in {1 / rig.natural_frequency:.3g} s; at least {LEAST_PER_PERIOD} samples a swing are needed: "
            "correct time_unit, stiffness or mass, or sample faster"
        )


def notes_on_few_samples(record: Record, oscillator: OscillatorConstants, units: RigUnits) -> list[str]:
    """Whether the samples are too few for break-aways to be placed to less than a sample."""
    period = natural_period(oscillator)
    if period >= FEW_PER_PERIOD * record.step:
        return []
    return [
        f"{period / record.step:.0f} samples in a period of the free mass: with fewer than {FEW_PER_PERIOD} a break-away may "
        f"be seen some {BLUR:g} samples ({BLUR * record.step:.2g}{unit_suffix(units.time)}) too early, its force too low by "
        "as much loading, and the friction of slow slip beside it too high; the errors of the break-aways include that; "
        "record faster"
    ]


def check_rise(record: Record, rig: Rig, presmoothed: Presmoothed, flanks: Flanks) -> None:
    """Refuse an extension that rises far faster than the drive can pull it, as in another unit of length."""
    x, time = presmoothed.extension, presmoothed.time
    rise = max(((x[b] - x[a]) / (time[b] - time[a]) for a, b in flanks.limits), default=0.0)
    if rise > RISES * rig.drive_velocity:
        raise InputError(
            f"{record.source}: column {rig.column!r} rises at {rise:.3g}{unit_suffix(rig.units.speed)} between two falls, "
            f"and the drive that drags the mass goes at {rig.drive_velocity:g}; correct the unit, the drive_velocity or the "
            "stiffness in the rig; or leave out drop-outs to a fixed reading, which rise as steeply: [read] valid = [lowest, "
            "highest]"
        )


def notes_on_overtaking(friction: Friction, rate_error: float) -> list[str]:
    """Whether the mass runs ahead of the drive by more than the noise, as the position of a slider that is pulled does."""
    o = friction.fit.oscillator
    drive = o.drive_velocity
    share = float(np.mean(friction.slip_velocity < -max(0.1 * drive, 4 * rate_error)))
    if share < 0.02:
        return []
    lasts = float(friction.time[-1] - friction.time[0])
    travels = 1 - float(np.mean(friction.slip_velocity)) / drive
    if abs(travels - 1) < TRAVELS and lasts > LONG * 2 * math.pi * math.sqrt(o.mass / o.stiffness):
        return [
            f"the recorded position moves with {travels:.2f} of the drive velocity throughout, where the stretch of a spring "
            "stays bounded: it is that of a slider that is pulled; record the stretch, drive_velocity times t less this "
            "position, or the force of the spring"
        ]
    return [
        f"the mass overtakes the drive for {100 * share:.0f} % of the time, by up to "
        f"{-float(friction.slip_velocity.min()) / drive:.2g} V: w < 0 there, or a unit, a sign or the drive_velocity of the "
        "rig is wrong"
    ]


def shorter_than_a_period(record: Record, oscillator: OscillatorConstants, units: RigUnits) -> str:
    """What is said of a record too short for the free mass of the rig to swing once, as with a mass in g; else nothing."""
    lasts, period = float(record.time[-1] - record.time[0]), natural_period(oscillator)
    if lasts >= period:
        return ""
    time = unit_suffix(units.time)
    return (
        f"the kind of motion cannot be determined: the record of {lasts:.3g}{time} is {100 * lasts / period:.2g} % of the "
        f"free period of {period:.3g}{time} of this rig; no sticks were taken: check the units of mass and stiffness, or "
        "give a longer record"
    )


def driving_friction(friction: Friction, units: RigUnits) -> str:
    """What is said of friction that drives the slip, as of a force or a position with the wrong sign; else nothing.

    Over a whole motion the mean friction is the mean force of the spring, whatever swings or is forced to swing, and its
    power is that times V less what the damping takes. A record of the right sign that was recorded without its mean can
    have a power just below zero by that damping. So the mean of the force must be below zero too, by more than it scatters
    over eighths of the record, and by a part of the swing of the spring.
    """
    w, force = friction.slip_velocity, friction.force
    path = float(np.sum(np.abs(w)))
    resists = float(np.sum(force * w)) / path if path > 0 else 0.0
    means = [float(np.mean(part)) for part in np.array_split(force, PARTS)]
    error = math.hypot(float(np.std(means, ddof=1)) / math.sqrt(PARTS), friction.common)
    swing = friction.fit.oscillator.stiffness * float(np.std(friction.extension))
    if not max(resists, float(np.mean(force))) < -max(DRIVING_ERRORS * error, DRIVING_PART * swing):
        return ""
    return (
        "the kind of motion cannot be determined: friction does work on the slip (it is "
        f"{resists:.3g}{unit_suffix(units.force)} in its sense on average), as no friction does; no sticks were taken: turn "
        "the sign of the recorded force or position (rig: scale, negative), or correct the reading at which the spring is "
        "slack (rig: rest)"
    )


def notes_on_stated_noise(friction: Friction, record: Record, rig: Rig) -> list[str]:
    """Whether the samples scatter otherwise than the file says they do."""
    if not record.error:
        return []
    spring = rig.instrument == "spring_force"
    stated = record.error * abs(rig.force_unit) / (friction.fit.oscillator.stiffness if spring else 1.0)
    scatter = friction.noise / math.sqrt(friction.fit.together)
    if 0.5 < scatter / max(stated, 1e-300) < 2:
        return []
    return [
        f"the record says its samples are good to {stated:.2g}{unit_suffix(rig.units.length)}, they scatter by "
        f"{scatter:.2g}{unit_suffix(rig.units.length)} about the fit: the scatter was believed"
    ]


def notes_on_inertia(friction: Friction, rig: Rig, slow: float, line: Line) -> list[str]:
    """Whether the resonance, or the smoothness of friction, speaks for another inertia than the rig's."""
    notes: list[str] = []
    o, hertz = friction.fit.oscillator, unit_suffix(rig.units.frequency)
    own = math.sqrt(o.stiffness / o.mass) / (2 * math.pi)
    nominal = math.sqrt(rig.stiffness / o.mass) / (2 * math.pi)
    # A slider that is slow most of the time sounds at the rate of its slips, not at its resonance.
    if slow < MOSTLY_SLOW and line.frequency > 0:
        ratio = line.frequency / own
        if abs(ratio - 1) > max(0.05, 3 * line.error / own):
            notes.append(
                f"the resonance line at {line.frequency:.3g} +- {line.error:.2g}{hertz} is {ratio:.2f} times sqrt(k/m)/2pi "
                f"= {own:.3g}{hertz} ({line.frequency / nominal:.2f} times the {nominal:.3g}{hertz} of the nominal "
                "stiffness): friction that depends on velocity shifts it, or the effective inertia is "
                f"{1 / ratio**2:.2f} of the mass {o.mass:g}"
            )
    excess, excess_error = restoring_excess(friction)
    if abs(excess) > max(SWING_ERRORS * excess_error, 2 * SWING_OFF):
        swing = math.sqrt(max(1 - excess, 0.0))
        notes.append(
            f"the slips swing at {swing:.3f} +- {excess_error / (2 * max(swing, 0.1)):.1g} times sqrt(k/m)/2pi, whatever "
            "friction does with the slip velocity: friction has branches or a memory, or the stiffness "
            f"{o.stiffness:.4g} or the inertia {o.mass:g} is wrong by some {100 * abs(excess):.0f} %; an error of the "
            "stiffness is in all forces k x and in no error given here"
        )
    likeliest, error = likeliest_inertia(friction)
    if math.isfinite(likeliest) and abs(likeliest - o.mass) > max(3 * error, 0.15 * o.mass):
        notes.append(
            f"the inertia that makes the friction force of the slips smoothest is {likeliest / o.mass:.2f} +- "
            f"{error / o.mass:.2f} times the {o.mass:g}{unit_suffix(rig.units.mass)} used here (a law that is steep in w "
            f"shifts this; rig: effective_mass sets another)"
        )
    return notes
