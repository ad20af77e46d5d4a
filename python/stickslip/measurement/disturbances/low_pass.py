"""A low-pass ahead of the converter: how it colours the noise, and the errors that it makes in the friction."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from stickslip.files.units import unit_suffix
from stickslip.measurement.disturbances.ripple import find_ripple
from stickslip.measurement.indirect.draft import Draft
from stickslip.measurement.indirect.force import Friction
from stickslip.measurement.indirect.sticks.stick import Stick, ends_of
from stickslip.measurement.rigs.rig import Rig, RigUnits
from stickslip.measurement.signals.coloured_noise import Colour, noise_colour
from stickslip.measurement.signals.presmooth import presmooth
from stickslip.measurement.signals.turning_points import find_flanks, rises_before

LARGE = 0.3
"""Falls of so much of the largest one are slips, whatever the noise."""
FILTERED = 0.3
"""Noise of which more than this share is coloured came through a filter, as the signal did; the converter's own is white."""
LONG_HIDDEN = 1.0
"""A shift that all break-aways share is worth a word from so many samples on."""


def noise_colour_of(draft: Draft, rig: Rig, least: float) -> Colour | None:
    """That of the noise in the middle halves of the rises before the large falls, a ripple taken out; None of white noise.

    Noise with a standard deviation below `least` is none.
    """
    x, weight, time, presmoothed = draft.extension, draft.weight, draft.time, draft.presmoothed
    if not len(draft.flanks.drops):
        return None
    rises = rises_before(presmoothed.extension, LARGE * float(draft.flanks.drops.max()))
    stretches = [(a + (b - a) // 4, b - (b - a) // 4) for a, b in rises]
    colour = noise_colour(x, weight, stretches)
    sticks = [Stick(time[a], time[b], 0.0, 0.0) for a, b in rises]
    if colour and (ripple := find_ripple(time, x, weight, sticks, draft.noise, rig.mains_frequency)):
        colour = noise_colour(x - ripple.at(time), weight, stretches)
    return None if colour is None or colour.deviation < least else colour


def with_coloured_noise(draft: Draft, colour: Colour, deviation: float) -> Draft:
    """The draft with noise of this colour and standard deviation; its `noise` is that of white noise of the same density."""
    noise = deviation * math.sqrt(colour.count)
    presmoothed = presmooth(draft.time, draft.extension, draft.weight, draft.oscillator, noise)
    flanks = find_flanks(presmoothed, 0.0)
    return replace(draft, noise=noise, presmoothed=presmoothed, flanks=flanks, together=colour.count)


def note_on_coloured_noise(colour: Colour, deviation: float, units: RigUnits) -> str:
    """The sentence on noise of this colour and standard deviation."""
    return (
        f"the noise is coloured: samples scatter by {deviation:.2g}{unit_suffix(units.length)}, and neighbours are alike to "
        f"{colour.share * colour.correlation:.2f}, so that {colour.count:.2g} samples count as one in all errors; creep or a "
        "ripple smaller than that noise is not seen"
    )


def behind_low_pass(friction: Friction, sticks: list[Stick], colour: Colour, step: float) -> Friction:
    """With errors that hold what a low-pass of the first order does, whose time constant the colour of the noise tells.

    It shifts all break-aways alike, and leaves exp(-t / tau) of a jump of friction after a time t. Captures are placed
    where the smeared motion ends, so as much goes ahead of them. As it is where too little of the noise is coloured.
    """
    if colour.share <= FILTERED:
        return friction
    time_constant = -step / math.log(colour.correlation)
    slips, ends = ~friction.stuck, ends_of(sticks)
    smeared = np.zeros(len(friction.time))
    if len(ends) and slips.any():
        events = np.sort([t for stick in sticks for t in (stick.start, stick.end)])
        moments = friction.time[slips]
        beside = np.searchsorted(events, moments)[:, None] - [1, 0]
        away = np.abs(moments[:, None] - events[np.clip(beside, 0, len(events) - 1)]).min(axis=1)
        jump = float(np.median(np.interp(ends, friction.time, friction.force)) - np.median(friction.force[slips]))
        smeared[slips] = jump * np.exp(-away / time_constant)
    return replace(
        friction.with_late_error(time_constant / math.sqrt(3)),
        force_error=np.hypot(friction.force_error, smeared),
        low_pass=time_constant,
    )


def notes_on_low_pass(friction: Friction, step: float, units: RigUnits) -> list[str]:
    """What is said of a low-pass that the noise shows."""
    if not friction.low_pass:
        return []
    return [
        f"the noise is alike over {friction.low_pass / step:.2g} samples, as behind {_low_pass(friction.low_pass, units)}: "
        "that shifts break-aways and smears the force beside them and beside captures, which the errors hold; remove the "
        "filter, or set it far above the slips"
    ]


def notes_on_late_break_aways(friction: Friction, units: RigUnits) -> list[str]:
    """Whether what hides each break-away lasts longer than a sample, as behind a low-pass."""
    step, late = friction.fit.step, friction.late
    if late < LONG_HIDDEN * step:
        return []
    return [
        f"all break-aways may be early or late together by {late:.2g}{unit_suffix(units.time)}, {late / step:.2g} samples: "
        f"friction falls on as the slip begins, or {_low_pass(late, units)} smears what begins and ends a stick; the errors "
        "of break-aways include that, but sticks that such a filter hides are not seen, and friction at low slip speed and "
        "its kinetic level are off; take the filter out, or sample it far above the slips"
    ]


def _low_pass(time_constant: float, units: RigUnits) -> str:
    return f"a low-pass of some {1 / (2 * math.pi * time_constant):.2g}{unit_suffix(units.frequency)} ahead of the converter"
