"""The stiffness of the spring, or the speed of the drive, as the sticks of the record itself show it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from stickslip.files.units import unit_suffix
from stickslip.measurement.indirect.draft import Draft
from stickslip.measurement.indirect.record_against_rig import MOSTLY_SLOW
from stickslip.measurement.indirect.sticks.creeping_sticks import creeping_sticks
from stickslip.measurement.indirect.sticks.resting_sticks import resting_candidates
from stickslip.measurement.indirect.sticks.stick import Stick
from stickslip.measurement.indirect.sticks.stick_slopes import StickSlope, is_resting, resting_slope, stick_slope
from stickslip.measurement.regime import regime, slow_share
from stickslip.measurement.rigs.rig import Rig
from stickslip.measurement.signals.presmooth import natural_period

DRIVE_MISTAKEN = 0.1
"""A drive velocity is known better than this."""
SPRING_MISTAKEN = 0.2
"""So far the stiffness of a spring, or the scale of its instrument, may be off."""
LINE_MISTAKEN = 0.05
"""So far the resonance may lie from sqrt(k/m)/2pi and still speak for this stiffness."""


def recalibrated(draft: Draft, slope: StickSlope, candidates: list[Stick], rig: Rig) -> tuple[Draft, list[str]]:
    """The draft with the stiffness or drive velocity under which its sticks stand still, and the sentence that says so.

    A slip that turns round repeats its steepest slope too, so a slope alone is no stick: with that slope the motion must be
    stick-slip. The stiffness changes by 20 % at most, the drive velocity by 10 %. Where the main line of the record is that
    of the oscillator, it must speak for the new stiffness. And the rig must allow it (`recalibrate`). Else what the rig says
    is kept, and the sentence says why.

    Parameters
    ----------
    draft : read with what the rig says.
    slope : of the extension while the mass sticks.
    candidates : the sticks that it was taken from, where the mass does not creep.
    rig : of the record.
    """
    o, spring = draft.oscillator, rig.instrument == "spring_force"
    ratio, error = slope.value / o.drive_velocity, slope.error / o.drive_velocity
    if abs(ratio - 1) <= max(4 * error, 0.003):
        return draft, []
    slow = _slow_if_stuck(draft, slope.value, candidates)
    if slow is None:
        return draft, []
    kept = "stiffness" if spring else "drive_velocity"
    seen = (
        f"stick-phase slope is {ratio:.3f} +- {error:.3f} times k V"
        if spring
        else f"while stuck the mass moves at {ratio:.4f} +- {error:.4f} times the drive velocity"
    )
    most = most_mistaken(rig)
    refused = ""
    if not rig.recalibrate:
        refused = "as the rig asks (recalibrate)"
    elif abs(ratio - 1) > most:
        refused = (
            f"as so large a mistake (over {100 * most:.0f} %) is not believed: correct {kept}, drive_velocity or unit"
        )
    elif spring and slow < MOSTLY_SLOW:
        line = draft.line(np.gradient(draft.presmoothed.rate, draft.time))
        likely = math.sqrt(ratio * o.stiffness / o.mass) / (2 * math.pi)
        hertz = unit_suffix(rig.units.frequency)
        if abs(line.frequency / likely - 1) > max(LINE_MISTAKEN, 3 * line.error / likely):
            refused = (
                f"as the resonance line at {line.frequency:.3g} +- {line.error:.2g}{hertz} does not agree with that "
                f"({likely:.3g}{hertz})"
            )
    if refused:
        return draft, [f"{seen}: the {kept.replace('_', ' ')} of the rig was kept, {refused}"]
    if not spring:
        note = (
            f"{seen}: drive velocity re-calibrated from {o.drive_velocity:g} to {slope.value:.5g} (an error of the length "
            "scale, which is in all forces k x, would look the same)"
        )
        return replace(draft, oscillator=replace(o, drive_velocity=slope.value)), [note]
    note = (
        f"{seen}: stiffness re-calibrated from {o.stiffness:g} to {o.stiffness * ratio:.4g} N/m so that v = 0 while stuck "
        "(an error of the force scale or of V would look the same)"
    )
    return draft.with_stiffness(ratio), [note]


def resting_sticks(draft: Draft, speed: float) -> tuple[list[Stick], StickSlope | None, bool]:
    """Where a mass that does not creep may stick on a drive of this speed, their slope, and whether it rests there."""
    samples = draft.time, draft.extension, draft.weight
    trial = resting_candidates(draft.presmoothed, draft.flanks, speed, 1 / natural_period(draft.oscillator))
    slope = resting_slope(*samples, trial, draft.noise) if trial else None
    return trial, slope, slope is not None and is_resting(*samples, trial, slope.value, draft.noise)


def another_drive_velocity(draft: Draft, rig: Rig) -> list[str]:
    """Whether a record without sticks sticks most of the time if the drive moves at another speed, as with a wrong unit."""
    rates = [draft.presmoothed.rate[first : last + 1] for first, last in draft.flanks.limits]
    rising = [float(np.median(rate[rate > np.median(rate)])) for rate in rates if np.ptp(rate) > 0]
    speed = float(np.median(rising)) if rising else 0.0
    if speed <= 0:
        return []
    trial, slope, resting = resting_sticks(draft, speed)
    if not resting:
        slope = stick_slope(draft.time, draft.extension, draft.weight, draft.flanks, draft.presmoothed, speed)
    stated = draft.oscillator.drive_velocity
    if slope is None or slope.value <= 0 or abs(slope.value / stated - 1) <= most_mistaken(rig):
        return []
    slow = _slow_if_stuck(replace(draft, resting=resting), slope.value, trial)
    if slow is None or slow < MOSTLY_SLOW:
        return []
    unit = unit_suffix(rig.units.speed)
    return [
        f"no sticks were found at the drive_velocity of {stated:g}{unit}, but this record sticks {100 * slow:.0f} % of the "
        f"time if the drive moves at {slope.value:.3g}{unit}: correct drive_velocity, unit or stiffness in the rig"
    ]


def most_mistaken(rig: Rig) -> float:
    """Part by which sticks may at most correct the rig."""
    return SPRING_MISTAKEN if rig.instrument == "spring_force" else DRIVE_MISTAKEN


def _slow_if_stuck(draft: Draft, speed: float, candidates: list[Stick]) -> float | None:
    """Share of the time in which the mass is slow if a stick has this slope; None where that is no stick-slip."""
    sticks = candidates if draft.resting else creeping_sticks(draft.presmoothed, draft.flanks, speed)
    lasting = [stick.end - stick.start for stick in sticks]
    w = speed - draft.presmoothed.rate
    slow = slow_share(w, speed, draft.noise, draft.step, lasting)
    word = regime(w, speed, *slow, 0.0, draft.resting, len(sticks), len(draft.flanks.limits)).kind
    return slow[0] if word == "stick_slip" else None
