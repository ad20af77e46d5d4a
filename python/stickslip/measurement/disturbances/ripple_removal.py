"""A ripple taken out of a draft, of its sticks alone or of its slips too, where the record is likelier without it."""

from __future__ import annotations

import numpy as np

from stickslip.measurement.disturbances.ripple import RemovedRipple, find_ripple, refined_ripple
from stickslip.measurement.indirect.draft import Draft
from stickslip.measurement.indirect.draft_fit import fit_pieces, fit_resting_sticks
from stickslip.measurement.indirect.recalibration import most_mistaken, resting_sticks
from stickslip.measurement.indirect.sticks.creeping_sticks import creep_delay, creeping_sticks
from stickslip.measurement.indirect.sticks.stick import Stick
from stickslip.measurement.rigs.rig import Rig

UNSEEN = 2.0
"""Break-aways are seen within so many delays of a sudden one, or there was none."""


def without_ripple(draft: Draft, rig: Rig, pixel: float | None) -> tuple[Draft, RemovedRipple | None]:
    """The draft without a line that all its sticks share, and what was taken; as it is where there is none.

    A line after whose removal masses break away long before they are seen to move is none: such is an error of positions.
    """
    o = draft.oscillator
    guesses = creeping_sticks(draft.presmoothed, draft.flanks, o.drive_velocity)
    found, removed = _ripple_taken(draft, rig, pixel, guesses)
    if removed is None:
        return draft, None
    ends = np.array([stick.end for stick in fit_resting_sticks(found)[0] if stick.ends])
    seen = np.array([stick.end for stick in guesses if stick.ends])
    if ends.size and seen.size:
        early = seen - ends[np.abs(seen[:, None] - ends).argmin(axis=1)]
        if float(np.median(early)) > UNSEEN * creep_delay(draft.presmoothed, guesses, o.drive_velocity):
            return draft, None
    return found, removed


def _ripple_taken(
    draft: Draft, rig: Rig, pixel: float | None, guesses: list[Stick]
) -> tuple[Draft, RemovedRipple | None]:
    """The same by what the samples say of a line, with first guesses of the sticks."""
    o = draft.oscillator
    samples = draft.time, draft.extension, draft.weight
    ripple = find_ripple(*samples, guesses, draft.noise, rig.mains_frequency, pixel)
    if ripple is None:
        return draft, None
    removed = RemovedRipple(ripple, True)
    still = removed.taken_from(draft)
    _, slope, resting = resting_sticks(still, o.drive_velocity)
    if slope is None or not resting or abs(slope.value / o.drive_velocity - 1) > most_mistaken(rig):
        return draft, None
    if not (sticks := fit_resting_sticks(still)[0]):
        return draft, None
    # the slips tell whether they have it too
    inner = fit_resting_sticks(RemovedRipple(ripple, False, sticks).taken_from(draft))[0]
    if not inner:
        return still, removed
    bridged = RemovedRipple(refined_ripple(ripple, *samples, inner, draft.noise), False, inner)
    joined = bridged.taken_from(draft)
    fits = [fit_pieces(still, sticks, resting=True), fit_pieces(joined, inner, resting=True)]
    both = [fit.deviance(fit.cutoff) for fit in fits]
    # first guesses that hold parts of slips may share a line that the sticks have not
    if plain := fit_resting_sticks(draft)[0]:
        fit = fit_pieces(draft, plain, resting=True)
        if fit.deviance(fit.cutoff) < min(both):
            return draft, None
    return (still, removed) if both[0] + ripple.releasing(inner) < both[1] else (joined, bridged)
