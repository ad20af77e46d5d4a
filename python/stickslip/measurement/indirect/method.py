"""The stages of the indirect method: from a record of a mass on a spring to friction, sticks and the kind of motion."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from stickslip.errors import InputError
from stickslip.files.units import unit_suffix
from stickslip.measurement.disturbances.converter_steps import coarse_step, note_on_steps
from stickslip.measurement.disturbances.low_pass import (
    behind_low_pass,
    noise_colour_of,
    note_on_coloured_noise,
    notes_on_late_break_aways,
    notes_on_low_pass,
    with_coloured_noise,
)
from stickslip.measurement.disturbances.ripple_removal import without_ripple
from stickslip.measurement.disturbances.zero_drift import note_on_drift, zero_drift
from stickslip.measurement.disturbances.zero_jump import ZeroJump, note_on_jumps, zero_error
from stickslip.measurement.indirect.draft import Draft
from stickslip.measurement.indirect.draft_fit import fit_draft
from stickslip.measurement.indirect.drive_changes import part_at_one_speed, part_while_driven
from stickslip.measurement.indirect.extension import extension_of
from stickslip.measurement.indirect.force import Friction
from stickslip.measurement.indirect.recalibration import (
    another_drive_velocity,
    most_mistaken,
    recalibrated,
    resting_sticks,
)
from stickslip.measurement.indirect.record_against_rig import (
    check_rise,
    driving_friction,
    notes_on_few_samples,
    notes_on_inertia,
    notes_on_overtaking,
    notes_on_stated_noise,
    shorter_than_a_period,
)
from stickslip.measurement.indirect.sticks.creeping_sticks import creep_delay
from stickslip.measurement.indirect.sticks.resting_sticks import BLUR
from stickslip.measurement.indirect.sticks.stick import Stick, ends_of
from stickslip.measurement.indirect.sticks.stick_slopes import stick_slope
from stickslip.measurement.indirect.untold_jump import notes_on_untold_jump
from stickslip.measurement.read import LEAST_SAMPLES, Record
from stickslip.measurement.regime import Regime, regime_notes
from stickslip.measurement.rigs.rig import Rig
from stickslip.measurement.signals.piecewise_fit import OscillatorConstants
from stickslip.measurement.signals.presmooth import natural_period, presmooth
from stickslip.measurement.signals.spectra import Line
from stickslip.measurement.signals.turning_points import find_flanks

FELT = 1 / 3
"""Of the scatter of the extensions at which masses break away: a common shift that is less is left out."""


@dataclass
class Measured:
    """Friction of one record of a mass on a spring, and what was found on the way.

    Attributes
    ----------
    friction, sticks, regime : see :class:`Friction`, :class:`Stick` and :class:`Regime`.
    resting : whether the mass rests while it sticks, to within the noise.
    slow : share of the time with |w| < 0.2 V.
    line : main line of the acceleration.
    saturated : samples at the end of the instrument's range.
    """

    friction: Friction
    sticks: list[Stick]
    resting: bool
    slow: float
    line: Line
    regime: str
    notes: list[str]
    saturated: int


def measure_indirectly(record: Record, rig: Rig, alone: bool = True) -> Measured:
    """Friction of one record of a mass on a spring; not `alone`, other masses pull on it too."""
    notes, units = list(record.notes), rig.units
    o = OscillatorConstants(rig.inertia, rig.damping, rig.stiffness, rig.drive_velocity)
    extension = extension_of(record, rig, o, notes)
    time, x, weight, noise = record.time, extension.value, extension.weight, extension.noise

    presmoothed = presmooth(time, x, weight, o, noise)
    flanks = find_flanks(presmoothed, 0.0)  # every fall that stands clear of the noise

    check_rise(record, rig, presmoothed, flanks)
    if extension.jumps:
        part, why = _between_jumps(record, rig, o, extension.jumps)
    else:
        part, why = part_while_driven(record, o, presmoothed, flanks)
    if not why:
        part, why = part_at_one_speed(record, o, x, weight, flanks)
    if why:
        weights = None if record.weight is None else record.weight[part]
        driven = replace(record, time=time[part], signal=record.signal[part], weight=weights)
        measured = measure_indirectly(replace(driven, notes=(*record.notes, *why)), rig, alone)
        if extension.jumps:
            measured.friction = measured.friction.with_common_error(o.stiffness * zero_error(extension.jumps))
        return measured

    # the spring and the drive as the sticks show them
    stated = Draft(time, x, weight, o, noise, presmoothed, flanks, True)
    pixel = None if record.pixel is None else record.pixel * abs(rig.force_unit) / extension.stiffness
    cleared, ripple = without_ripple(stated, rig, pixel)
    trial, slope, resting = resting_sticks(cleared, o.drive_velocity)
    colour = noise_colour_of(stated, rig, extension.least)
    if colour is not None and (ripple is not None or not resting):
        # what looks like a ripple or like creep may be noise that is slow
        deviation = extension.known_noise or colour.deviation
        notes.append(note_on_coloured_noise(colour, deviation, units))
        cleared, ripple = without_ripple(with_coloured_noise(stated, colour, deviation), rig, pixel)
        trial, slope, resting = resting_sticks(cleared, o.drive_velocity)
    stated = cleared
    x, presmoothed, flanks = stated.extension, stated.presmoothed, stated.flanks
    # A mass that does not go with the drive where it seems to rest does not rest; where nothing sticks, or for too few
    # samples to have a slope, nothing shows that it creeps.
    resting = slope is None or (resting and abs(slope.value / o.drive_velocity - 1) <= most_mistaken(rig))
    smaller: list[str] = []
    if not resting:
        flanks = find_flanks(presmoothed, rig.least_drop)
        if flanks.smaller:
            smaller.append(
                f"{flanks.smaller} falls of the spring smaller than {rig.least_drop:g} of the median fall were taken "
                "as creep inside a stick, not as slips (rig: least_drop)"
            )
        slope = stick_slope(time, x, weight, flanks, presmoothed, o.drive_velocity)
    stated = replace(stated, flanks=flanks, resting=resting)
    draft, why = (stated, []) if slope is None else recalibrated(stated, slope, trial, rig)
    friction, sticks, slow, found = fit_draft(draft)
    # on one mass of several the others pull as well
    driving = driving_friction(friction, units) if alone else ""
    # what swings, sticks or rests is seen to, however short the record
    short = shorter_than_a_period(record, o, units) if found.kind == "stable_slip" else ""
    if driving or short:
        found = Regime("unknown", "drives" if driving else "short")
    if found.kind != "stick_slip" and (sticks or draft is not stated):
        # What is not surely stick-slip has no sticks, and so nothing by which to correct the rig.
        why = [] if draft is not stated else why
        friction, sticks, slow, _ = fit_draft(stated, sticking=False)
    if not sticks and not driving:
        why = [*another_drive_velocity(stated, rig), *why]
    if ripple is not None:
        friction = ripple.returned(friction, sticks)
        notes.append(ripple.note(o, units))
    notes += why
    few = notes_on_few_samples(record, o, units) if sticks and resting else []
    notes += few
    if sticks and not resting:
        notes += smaller
        delay = creep_delay(presmoothed, sticks, o.drive_velocity)
        notes.append(
            "while stuck the mass creeps by more than the noise, or its positions have an error that is smooth along the way "
            "or in time: sticks are bounded where w passes half of V, and w is measured, not set to zero, inside them; a "
            f"sudden break-away is {delay:.2g}{unit_suffix(units.time)} earlier, which the errors of break-aways hold unless "
            "they scatter far more"
        )
    notes += [*notes_on_overtaking(friction, presmoothed.rate_error), *notes_on_stated_noise(friction, record, rig)]
    if sticks:
        per_reading = abs(rig.force_unit) * (o.stiffness / extension.stiffness)
        if coarse := coarse_step(record.signal[weight > 0], friction.noise * o.stiffness / per_reading):
            # each stick meets the same steps, so the error of the level of one is that of all
            stuck = max(np.count_nonzero(friction.stuck) / len(sticks), 1.0)
            common = per_reading * coarse / math.sqrt(12 * stuck)
            friction = friction.with_common_error(common)
            notes.append(note_on_steps(coarse, rig.unit, common, units.force))
    if sticks and (drift := zero_drift(presmoothed, flanks)):
        friction = friction.with_common_error(o.stiffness * drift.size / 2)
        notes.append(note_on_drift(drift, o.stiffness, units.force))
    notes += notes_on_untold_jump(friction, units) or notes_on_late_break_aways(friction, units)
    if sticks and colour is not None:
        friction = behind_low_pass(friction, sticks, colour, record.step)
        notes += notes_on_low_pass(friction, record.step, units)
    if few:  # so few samples place all break-aways alike
        friction = friction.with_late_error(BLUR * record.step)
    if sticks and not resting:
        late = delay / math.sqrt(3)
        levels = np.interp(ends_of(sticks), time, presmoothed.extension)
        # Break-aways that scatter by far more do not feel it.
        if not levels.size or o.drive_velocity * late > FELT * float(np.std(levels)):
            friction = friction.with_late_error(late)
    cycles, per_period = len(flanks.limits), natural_period(o) / record.step
    if driving or short:
        notes.append(driving or short)
    else:
        notes += regime_notes(found, slow, stated.blur, resting, len(sticks), cycles, per_period)
    line = draft.line(friction.slip_acceleration)
    # the pull of other masses has its own lines; of steady slip, and of less than a period, there is noise
    if alone and not short and found.kind not in ("stable_slip", "at_rest"):
        notes += notes_on_inertia(friction, rig, slow, line)
    ends = np.array([stick.end for stick in sticks])
    if found.kind == "stick_slip" and ends.size >= 3:
        line = draft.line(friction.slip_acceleration, 1 / float(np.median(np.diff(ends))))
    return Measured(friction, sticks, resting, slow, line, found.kind, notes, extension.saturated)


def _between_jumps(record: Record, rig: Rig, o: OscillatorConstants, jumps: list[ZeroJump]) -> tuple[slice, list[str]]:
    """The longest part of a record in which the zero stays, and the sentence on the jumps."""
    edges = [0, *(jump.index for jump in jumps), len(record.time)]
    part = max((slice(*pair) for pair in pairwise(edges)), key=lambda one: one.stop - one.start)
    said = note_on_jumps(jumps, record.time, part, o.stiffness, rig.units.force)
    if part.stop - part.start < LEAST_SAMPLES:
        raise InputError(f"{record.source}: {said}; that is too short, give a longer record")
    return part, [said]
