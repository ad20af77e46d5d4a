"""Friction and sticks of a draft: limits of the sticks and cut-off of the slips, fitted by turns.

Here it is chosen how sticks are decided: for a mass that creeps by `creeping_sticks`, for one that does
not by `refine_sticks` in `resting_sticks`. Whether it creeps was found before, in `method` (`Draft.resting`).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from stickslip.measurement.indirect.draft import Draft
from stickslip.measurement.indirect.force import Friction, friction_force
from stickslip.measurement.indirect.hidden_fall import with_hidden_fall
from stickslip.measurement.indirect.sticks.creeping_sticks import creeping_sticks
from stickslip.measurement.indirect.sticks.resting_sticks import refine_sticks, resting_candidates
from stickslip.measurement.indirect.sticks.stick import Stick
from stickslip.measurement.indirect.untold_jump import with_untold_jump
from stickslip.measurement.regime import Regime, regime, slow_share
from stickslip.measurement.signals.piecewise_fit import Kind, Part, PiecewiseFit
from stickslip.measurement.signals.presmooth import cutoff_limits, natural_period
from stickslip.measurement.signals.sample_runs import runs_of
from stickslip.measurement.signals.slip_evidence import SlipModel


class DraftFit(NamedTuple):
    """Friction of a draft, its sticks, the share of slow time, and the kind of motion."""

    friction: Friction
    sticks: list[Stick]
    slow: float
    regime: Regime


def fit_draft(draft: Draft, sticking: bool = True) -> DraftFit:
    """Friction of a draft, with its sticks, or with none where not `sticking`."""
    o, presmoothed, flanks = draft.oscillator, draft.presmoothed, draft.flanks
    if sticking and draft.resting:
        sticks, fit, soft, untold = fit_resting_sticks(draft)
    else:
        soft, untold = True, 0.0
        sticks = creeping_sticks(presmoothed, flanks, o.drive_velocity) if sticking else []
        fit = fit_pieces(draft, sticks, resting=False)
    friction = friction_force(fit, sticks)
    gaps = _gaps(draft)
    sticks = [
        replace(one, sure=one.sure and not any(a - one.end_error <= one.end <= b + one.end_error for a, b in gaps))
        for one in sticks
    ]
    if sticks and not soft:
        friction = with_hidden_fall(friction, sticks)
    if sticks and untold:
        friction = with_untold_jump(friction, sticks, untold)
    w, lasting = friction.slip_velocity, [stick.end - stick.start for stick in sticks]
    slow, slow_error = slow_share(w, o.drive_velocity, draft.noise, draft.step, lasting)
    found = regime(w, o.drive_velocity, slow, slow_error, draft.blur, draft.resting, len(sticks), len(flanks.limits))
    return DraftFit(friction, sticks, slow, found)


class RestingFit(NamedTuple):
    """Sticks of a mass that rests, and the fit of the record with them; the others as of `RefinedSticks`."""

    sticks: list[Stick]
    fit: PiecewiseFit
    soft: bool
    untold: float


def fit_resting_sticks(draft: Draft) -> RestingFit:
    """Alternate between the limits of the sticks and the cut-off of the slips."""
    time, presmoothed, o = draft.time, draft.presmoothed, draft.oscillator
    sticks = resting_candidates(presmoothed, draft.flanks, o.drive_velocity, 1 / natural_period(o))
    cutoff = presmoothed.cutoff
    step = float(time[1] - time[0])
    soft: bool | None = None
    untold = 0.0
    for span in (max(8 * step, 0.06 * natural_period(o)), 3 * step):
        model = SlipModel(time, draft.path, draft.weight, o, draft.noise, draft.knots, cutoff)
        sticks, soft, later = refine_sticks(model, sticks, span, soft)
        untold = max(untold, later)  # asked once
        fit = fit_pieces(draft, sticks, resting=True)
        changed = abs(math.log(fit.cutoff.get("slip", cutoff) / cutoff))
        cutoff = fit.cutoff.get("slip", cutoff)
        if not sticks or (soft and changed < 0.1):
            break
    return RestingFit(sticks, fit, bool(soft), untold)


def fit_pieces(draft: Draft, sticks: list[Stick], resting: bool) -> PiecewiseFit:
    """Fit the record in pieces that end at the limits of the sticks, each part with its likeliest cut-off."""
    time, oscillator, knots = draft.time, draft.oscillator, draft.knots
    period = natural_period(oscillator)
    stuck: Kind = "rest" if resting else "creep"
    breaks: list[float] = [float(time[0])]
    kinds: list[Kind] = []
    for stick in sticks:
        if stick.starts:
            kinds.append("slip")
            breaks.append(stick.start)
        kinds.append(stuck)
        if stick.ends:
            breaks.append(stick.end)
    if not sticks or sticks[-1].ends:
        kinds.append("slip")
    breaks.append(float(time[-1]))
    fit = PiecewiseFit(
        *(time, draft.path, draft.weight, np.array(breaks), kinds, oscillator),
        slip_knots=knots,
        creep_knots=max(period / 20, knots),
        together=draft.together,
    )
    cutoff: dict[Part, float] = {}
    slip_limits = cutoff_limits(oscillator, fit.step, knots)
    creep_limits = (0.01 / period, slip_limits[1] / 2)
    if "slip" in kinds:
        cutoff["slip"] = math.sqrt(slip_limits[0] * slip_limits[1])
    if "creep" in kinds:
        cutoff["creep"] = 0.3 / period
        cutoff["creep"] = fit.best_cutoff("creep", creep_limits, {k: v for k, v in cutoff.items() if k != "creep"})
    if "slip" in kinds:
        cutoff["slip"] = fit.best_cutoff("slip", slip_limits, {k: v for k, v in cutoff.items() if k != "slip"})
    return fit.solve(cutoff)


def _gaps(draft: Draft) -> list[tuple[float, float]]:
    """Times between which three samples in a row or more are missing, so that the end of a stick is not seen there."""
    runs = [(draft.time[a], draft.time[b - 1]) for a, b in runs_of(draft.weight == 0) if b - a >= 3]
    # What lacks them may place the end as far behind them as they are long.
    return [(before - 2 * draft.step, after + (after - before) + 2 * draft.step) for before, after in runs]
