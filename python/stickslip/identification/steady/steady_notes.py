"""What is said of a curve of friction over slip velocity: how it was chosen, what it leaves, what it says of rest."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from scipy.special import chdtri

from stickslip.identification.estimator.record_scatter import BY_CHANCE
from stickslip.identification.kinetic.replayed_motion import extrapolated_note
from stickslip.identification.steady.curves import FEW_ROWS, GRAVITY, Rows, SteadyFit
from stickslip.identification.steady.misfit import is_blurred
from stickslip.identification.steady.single_form_fit import record_scatter_of

APART = 0.1
"""Friction that misses the curve by more than this part of it is named."""
SEEN_FALL = 0.7
"""The part of a fall of friction with the speed from which on, where it was measured, rest is known by its form."""
SEEN_TIE = 0.8
"""Correlation of load and logarithm of the speed from which on it is said that they are tied."""
STANDS_OUT = 6.0
"""A row that is missed by more than so many median misfits is named."""


def notes_on_disagreement(rows: Rows, best: SteadyFit) -> list[str]:
    """What the chosen curve leaves of the points that chance cannot have made, as plain sentences."""
    notes = []
    off = np.sign(rows.w) * (rows.force - best.curve.columns(rows) @ best.numbers)
    level = float(np.mean(np.abs(rows.force)))
    if rows.apart:
        spread = scatter_between_records(rows, best)
        means = [float(off[part].mean()) for part in rows.records]
        names = [Path(rows.source[part[0]]).name for part in rows.records]
        named = ", ".join(f"{mean:+.2g} ({name})" for mean, name in zip(means, names, strict=True))
        if len(names) > 6:
            low, high = int(np.argmin(means)), int(np.argmax(means))
            named = f"{means[low]:+.2g} ({names[low]}) to {means[high]:+.2g} ({names[high]})"
        notes.append(
            f"The {len(names)} records do not lie on one curve: their friction is off from it by {named}, with a "
            f"standard deviation of {spread:.2g}, {100 * spread / level:.2g} % of the mean; look whether they are of one "
            "contact. Each counts as one, and the intervals hold what sets them apart."
        )
    elif rows.known:
        z = off / rows.error
        freedom = len(rows) - len(best.parameters)
        if float(np.sum(z**2)) > chdtri(freedom, BY_CHANCE):
            notes.append(
                f"The points lie {math.sqrt(float(np.sum(z**2)) / freedom):.2g} times their stated errors off the curve, "
                "more than chance makes: they disagree with each other or with this form. The intervals hold this scatter."
            )
    if best.rms > APART * level:
        notes.append(f"The curve misses friction by {best.rms:.2g} (rms), {100 * best.rms / level:.2g} % of its mean.")
    return notes


def notes_on_choice(
    rows: Rows, fits: dict[str, SteadyFit], chosen: str, undecided: list[str], hidden: dict[str, SteadyFit]
) -> list[str]:
    """What the form `chosen` is, what may be in its place, and what it does not tell, as plain sentences."""
    best = fits[chosen]
    notes = []
    if len(fits) > 1:
        notes.append(
            f"{chosen} is the simplest of {len(fits)} forms that predicts held-back rows as well as any (rms "
            f"{best.held_back:.3g})."
        )
    if undecided:
        more = f" and {len(undecided) - 4} more" if len(undecided) > 4 else ""
        notes.append(f"The record cannot decide between it and {'; '.join(undecided[:4])}{more}.")
    offset = best.parameters.loc["offset"] if "offset" in best.parameters.index else None
    if offset is not None:
        without = fits.get(", ".join(part for part in chosen.split(", ") if part != "offset"))
        sense = "<" if offset["value"] < 0 else ">"
        gain = "" if without is None else f" Without it held-back rows are missed by {without.held_back:.3g}."
        notes.append(
            f"The force has an offset of {offset['value']:.3g} (95 %: {offset['low']:.3g} to {offset['high']:.3g}) that "
            f"keeps its sign when the motion turns: the zero of an instrument, gravity, or friction that is "
            f"{abs(2 * offset['value']):.3g} larger for w {sense} 0; speed alone cannot show which. It is not part of the "
            f"law, which is the mean of both ways.{gain}"
        )
        if "restoring" in best.parameters.index:
            slope = best.parameters.loc["restoring"]
            notes.append(
                f"The offset changes with the place, by {slope['value']:.3g} ({slope['low']:.3g} to {slope['high']:.3g}) per "
                "length, as gravity or a spring would have it; at the mean place it is as given."
            )
    elif len(set(np.sign(rows.w))) == 1:
        notes.append(
            "All slip is one way, so an offset of the instrument or of gravity cannot be separated from the kinetic force "
            "and is in it."
        )
    if "gravity_sine" in best.parameters.index:
        arm = math.hypot(*best.parameters.loc[list(GRAVITY), "value"])
        notes.append(
            f"The force has a part of {arm:.3g} that follows sine and cosine of the angle, as the weight of an arm has; it "
            "is not part of the law."
        )
    notes += _asymmetry(rows, best) + _confounded(rows, fits, chosen)
    notes += _extrapolated(rows, fits, [chosen, *undecided], hidden)
    apart = np.sqrt(best.losses / np.median(best.losses)) if np.median(best.losses) > 0 else np.zeros(1)
    if len(rows) <= FEW_ROWS and float(apart.max()) > STANDS_OUT:
        at = int(np.argmax(apart))
        notes.append(
            f"Row {at} (w = {rows.w[at]:.4g}, f = {rows.force[at]:.4g}) lies {apart[at]:.2g} times as far off as rows do in "
            "the median, and least squares follow it: look at it."
        )
    for name, row in best.parameters.iterrows():
        if row["low"] <= 0 <= row["high"]:
            notes.append(
                f"{name} does not differ from zero within its interval: {row['value']:.3g} ({row['low']:.3g} to "
                f"{row['high']:.3g})."
            )
    return notes


def _asymmetry(rows: Rows, best: SteadyFit) -> list[str]:
    """That friction differs by the sense of the slip."""
    if not best.by_sense:
        return []
    doubt = (
        ""
        if np.isfinite(rows.position).all()
        else " Gravity may look the same. The position tells it, if each run is measured into a friction file of its own, "
        "as stickslip run does."
    )
    if "restoring" in best.parameters.index:
        doubt = " A constant part of that may be the spring's or gravity's, whose zero is not known."
    w = best.curve.reference
    forward, backward = (float(abs(best([sense * w])[0])) for sense in (1.0, -1.0))
    return [
        f"Friction differs by the sense of the slip, and by more than a constant: at w = {w:.3g} it is "
        f"{forward:.3g} forward (w > 0) and {backward:.3g} backward. The law is Asymmetric. A zero of the instrument cannot "
        "be separated from that and is in the law, added one way and taken off the other, beyond its intervals: give the "
        f"channel its zero if you know it.{doubt}"
    ]


def _confounded(rows: Rows, fits: dict[str, SteadyFit], chosen: str) -> list[str]:
    """That what is given as an effect of the load may be one of the speed, or the other way round."""
    if abs(rows.tie) < SEEN_TIE:
        return []
    terms = [term for term in fits[chosen].parameters.index if term in ("load", "viscous", "quadratic", "logarithm")]
    instead = [
        f"{name} {row['value']:.3g} ({row['low']:.3g} to {row['high']:.3g})"
        for form in fits
        if is_constant(form) != is_constant(chosen) and len(fits[form].parameters) == len(fits[chosen].parameters)
        for name, row in fits[form].parameters.iterrows()
        if name in ("load", "viscous", "quadratic", "logarithm")
    ]
    alone = f" Instead of {' and '.join(terms)} it may be {' or '.join(instead)}." if terms and instead else ""
    return [
        f"Load and slip velocity are tied in these records (correlation {rows.tie:.2f}): what is given as the one may be the "
        f"other; vary them apart.{alone}"
    ]


def _extrapolated(rows: Rows, fits: dict[str, SteadyFit], names: list[str], hidden: dict[str, SteadyFit]) -> list[str]:
    """What the law says of rest, where nothing was measured, and what forms that predict as well say of it."""
    slow = float(np.abs(rows.w).min())
    value, low, high = fits[names[0]].at_rest(slow)
    if is_blurred(rows, fits[names[0]]):
        return [
            f"Nothing was measured below w = {slow:.3g}, and the error of the speed blurs the fall of friction above that. "
            f"The break-away force of the law, {value:.3g}, is where this form goes on to: friction at rest cannot be told; "
            "measure a break-away."
        ]
    _, lowest, highest = at_rest(slow, [fits[name] for name in names], hidden.values())
    here = fits[names[0]].at_rest(slow, slow)[0]
    open_ended = "upwards" if highest == math.inf else f"to {highest:.3g}"
    if hidden:
        return [
            f"Nothing was measured below w = {slow:.3g}, where friction still falls: {', '.join(hidden)} with a fall below "
            f"that predicts held-back rows better than {names[0]}. The break-away force cannot be determined: {value:.3g} by "
            f"the chosen form, and anything from {lowest:.3g} {open_ended} by these; measure slower, or a break-away."
        ]
    if "weakening" not in fits[names[0]].curve.terms:
        return [
            f"Nothing was measured below w = {slow:.3g}: a fall of friction there would not be seen. The break-away force "
            f"comes from no stick: it is the kinetic force extrapolated to rest, {value:.3g} ({low:.3g} to {high:.3g} by the "
            "curve alone), and may be larger by any amount; measure break-aways to know it."
        ]
    if max(abs(value - here), highest - high, low - lowest) < APART * abs(here):
        return [extrapolated_note(slow)]
    return [
        f"Nothing was measured below w = {slow:.3g}. Friction goes on to {value:.3g} at rest ({low:.3g} to {high:.3g}) by "
        f"the chosen form, and to anything from {lowest:.3g} {open_ended} by those that predict as well, if it does not "
        "fall below that speed, which would not be seen: the break-away force of the law is an extrapolation; measure "
        "slower, or a break-away."
    ]


def at_rest(slow: float, fits: Iterable[SteadyFit], hidden: Iterable[SteadyFit]) -> tuple[float, float, float]:
    """Friction at rest by the first of these fits, and the ends of what all of them and the hidden ones leave open."""
    chosen, *others = fits
    ends = [fit.at_rest(slow) for fit in (chosen, *others, *hidden)]
    curve = chosen.curve
    seen = "weakening" in curve.terms and math.exp(-((slow / curve.scale) ** curve.exponent)) > SEEN_FALL
    return ends[0][0], min(low for _, low, _ in ends), max(high for _, _, high in ends) if seen else math.inf


def scatter_between_records(rows: Rows, fit: SteadyFit) -> float:
    """Standard deviation of friction from record to record about this curve, 0 where chance makes it."""
    columns = fit.curve.columns(rows)
    return record_scatter_of(rows, rows.force - columns @ fit.numbers, columns / rows.error[:, None])[0]


def is_constant(form: str) -> bool:
    """Whether friction of this form is the same at every speed."""
    return form.split(", ")[0] == "Coulomb"
