"""What break-aways cannot tell of static friction, and what only looks like its growth with rest: a sentence each."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pandas as pd

from stickslip.files.units import unit_of
from stickslip.identification.estimator.least_squares import linear
from stickslip.identification.estimator.residual_statistics import median_error, robust_scale
from stickslip.identification.static.form_fit import StaticFit, choose
from stickslip.identification.static.forms import ONSET, OWN_LEVEL
from stickslip.identification.static.rows import FEWEST_ROWS, common_error, on_loading_line, one_rate

TOGETHER = 0.5
"""Correlation of stick time with time beyond which a drift may pass for growth."""
EQUAL = 0.01
"""Stick times that scatter by less than that many decades within each record are of one length."""
CROWDED = 1.25
"""Falls within this ratio of the smallest lie at the edge of what is seen."""
CLEARLY = 3
"""Standard errors beyond which a few break-aways differ with stick time."""
OF_STICK_TIME = (
    "constant",
    "logarithmic",
    ONSET,
    *(form + level for form in ("exponential", "power", "Kato") for level in ("", OWN_LEVEL)),
)
"""Forms in which the force rate does not stand."""
BEGINNING_SCATTER = 0.3
"""Sticks begin at one force where the forces there scatter by less than that part of those at their ends."""
NARROW = 1.25
"""Stick times (10th to 90th percentile) within this ratio say nothing about growth."""


def notes_on_ties(rows: pd.DataFrame) -> list[str]:
    """A sentence where stick time and force rate cannot be told apart, else nothing."""
    known = rows[rows["force_rate"].notna() & (rows["force_rate"].abs() > 0)]
    if len(known) < 2:
        return ["No force rate is known, so static friction is taken to depend on the stick time alone."]
    if len(known) < len(rows):
        return [
            f"{len(rows) - len(known)} of {len(rows)} break-aways have no force rate, so static friction is taken to depend "
            "on the stick time alone; give the missing rates, or leave these rows out."
        ]
    rate = np.log(known["force_rate"].abs().to_numpy())
    time = np.log(known["stick_time"].to_numpy())
    if one_rate(known):
        return [
            f"All break-aways come at nearly one force rate ({math.exp(float(np.median(rate))):.3g}"
            f"{unit_behind(rows, 'force time^-1')}, one drive velocity): stick time and force rate cannot be "
            "separated, and the growth is known at that rate only."
        ]
    correlation = float(np.corrcoef(time, rate)[0, 1])
    if abs(correlation) > 0.9:
        return [
            f"Stick time and force rate are tied in these records (correlation of their logarithms {correlation:.2f}): "
            "what is given as growth with stick time may be an effect of the force rate; vary the stiffness as well."
        ]
    return []


def why_no_growth(rows: pd.DataFrame) -> str:
    """Why no growth with stick time is fitted to so few break-aways, and whether it is seen in them all the same.

    Along a loading line a stick that happens to hold more also lasts longer: there a rise says nothing of growth.
    """
    count = f"{len(rows)} break-aways are" if len(rows) != 1 else "1 break-away is"
    why = f"{count} too few to fit growth with stick time, which takes {FEWEST_ROWS}"
    error = np.asarray(rows["force_error"], float)
    alike = len(rows) < 2 or rows["stick_time"].max() < NARROW * rows["stick_time"].min()
    if alike or not (error > 0).all() or (one_rate(rows) and on_loading_line(rows).any()):
        return why
    force, decades = (np.asarray(part, float) for part in (rows["force"], np.log10(rows["stick_time"])))
    decades = decades - np.average(decades, weights=1 / error**2)
    columns = np.column_stack([np.ones(len(rows)), decades])
    numbers = linear(columns, force, error)
    off = (force - columns @ numbers) / error
    wider = max(1.0, float(off @ off) / max(len(rows) - 2, 1))  # they scatter by more than they state
    slope, spread = float(numbers[1]), math.sqrt(wider) / float(np.linalg.norm(decades / error))
    if abs(slope) <= CLEARLY * spread:
        return why
    return (
        f"{why}; yet they {'rise' if slope > 0 else 'fall'} by {abs(slope):.2g} ± {spread:.1g}{unit_behind(rows, 'force')} "
        "per decade of stick time, and a constant is no more than their mean"
    )


def notes_on_unlike_records(rows: pd.DataFrame, fits: Mapping[str, StaticFit]) -> list[str]:
    """A sentence where the records lie further from the fit to all of them than the scatter within each lets expect.

    Such a fit is a compromise; its intervals hold the scatter within the records and not what sets them apart.
    """
    fit = min((fits[name] for name in OF_STICK_TIME if name in fits), key=lambda fit: fit.criterion)
    residuals = pd.Series(fit.residuals, index=rows.index)
    parts = [part for _, part in residuals.groupby(rows["record"]) if len(part) >= FEWEST_ROWS]
    if len(parts) < 2:
        return []
    middle = np.array([float(np.median(part)) for part in parts])
    late = common_error(rows)
    error = np.hypot(
        [median_error(np.asarray(part, float)) for part in parts],
        [float(np.median(late[part.index])) for part in parts],
    )
    if float(np.sum((middle / np.maximum(error, 1e-300)) ** 2)) < 10 * len(parts):
        return []
    apart = ", ".join(f"{value:.2g} ± {spread:.1g}" for value, spread in zip(middle, error, strict=True))
    return [
        f"The records differ from one law of stick time: their break-away forces lie {apart} off the {fit.form} form. It is "
        f"a compromise, and a further run may lie {float(np.sqrt(np.mean(middle**2))):.2g} aside."
    ]


def notes_on_missing_growth(rows: pd.DataFrame) -> list[str]:
    """A sentence where sticks of one force rate are of one length, or begin at one force, and so say nothing of growth."""
    known = rows[rows["force_rate"].notna()]
    if len(known) < 2 or not one_rate(known):
        return []
    low, high = np.quantile(known["stick_time"], [0.1, 0.9])
    if high < NARROW * low:
        return [
            f"Nearly all sticks last from {low:.4g} to {high:.4g}, which shows nothing about growth with rest: static "
            "friction is taken as constant. Records at other drive velocities are needed."
        ]
    begun, held = (
        robust_scale((part - part.median()).to_numpy())
        for part in (known["force"] - known["force_rate"].abs() * known["stick_time"], known["force"])
    )
    if begun > BEGINNING_SCATTER * held:
        return []
    return [
        f"All sticks begin at nearly one force (they scatter by {begun:.2g} there and by {held:.2g} at the break-away), so "
        "they lie on one loading line, and a stick that happens to hold more also lasts longer: growth with rest cannot be "
        "separated from that, and static friction is taken as constant. Records at other drive velocities are needed."
    ]


def notes_on_weakening(rows: pd.DataFrame, fits: Mapping[str, StaticFit]) -> list[str]:
    """A sentence where static friction falls with stick time from record to record, each at a force rate of its own."""
    if rows["force_rate"].isna().any() or one_rate(rows):
        return []
    ends = np.array([rows["stick_time"].min(), rows["stick_time"].max()])
    name, log = choose(fits)[0], fits["logarithmic"]
    shortest, longest = fits[name](ends)
    if longest >= shortest:
        return []
    slope = log.parameters.loc["slope"]
    if slope["high"] >= 0:  # the closest form may bend between few stick times as nothing measured does
        return [
            f"Break-away forces do not grow clearly with stick time: on the logarithmic form by {slope['value']:.2g} per "
            f"decade (95 %: {slope['low']:.2g} to {slope['high']:.2g}). Static friction is taken as constant, as the "
            f"{name} form, which lies closest, falls from the shortest stick to the longest, and rest makes nothing weaker."
        ]
    shortest, longest = log(ends)
    return [
        f"Break-away forces fall by {shortest - longest:.2g}{unit_behind(rows, 'force')} from the shortest stick to the "
        "longest."
        " Rest makes nothing weaker: it is the force rate, or something else that differs between the records, and static "
        "friction is taken as constant. Records in which stick time and force rate vary independently are needed."
    ]


def notes_on_loading_line(rows: pd.DataFrame, fits: Mapping[str, StaticFit]) -> list[str]:
    """A sentence where the scatter of friction along a track on which it drifts may be what looks like growth."""
    if len(set(rows["record"])) > 1 or rows["force_rate"].isna().all():
        return []
    rate = float(np.nanmedian(np.abs(rows["force_rate"].to_numpy())))
    log = fits["logarithmic"]
    middle = float(np.median(rows["stick_time"]))
    slope = float(log.parameters["value"].to_numpy()[1]) / (math.log(10) * middle)
    if slope < 0.1 * rate or log.scatter < 0.1 * rate * float(np.std(rows["stick_time"])):
        return []
    return [
        f"Within one record break-aways lie on the loading line (force = force at capture + {rate:.3g} × stick time), "
        f"so scatter along the track alone would look like growth of {rate / 2:.3g} per unit time, where "
        f"{slope:.3g} was found: take the growth as an upper limit until records at other drive velocities confirm it."
    ]


def notes_on_drift(rows: pd.DataFrame, fits: Mapping[str, StaticFit]) -> list[str]:
    """A sentence where a drift in time may be what looks like growth with stick time, or the other way round."""
    found = fits["logarithmic"]
    time, log = rows["t"] - rows.groupby("record")["t"].transform("mean"), np.log10(rows["stick_time"])
    log = log - log.groupby(rows["record"]).transform("mean")
    # Sticks of one length in each record show no growth within it; a table made by hand may have no times at all.
    if not time.std() > 0 or log.std() < EQUAL or not abs(float(np.corrcoef(time, log)[0, 1])) >= TOGETHER:
        return []
    slope, error = (float(found.parameters[column]["slope"]) for column in ("value", "error"))
    whole = found.residuals + slope * log
    columns = np.stack([np.ones(len(rows)), log, time / time.std()], axis=1)
    numbers = linear(columns, whole)
    if abs(numbers[1] - slope) < 2 * error:
        return []
    return [
        f"Stick times change along the record, and so may friction: with a drift in time beside it the slope over stick time "
        f"is {numbers[1]:.3g} per decade instead of {slope:.3g}; a drift and growth with rest cannot be separated here."
    ]


def notes_on_least_drop(rows: pd.DataFrame) -> list[str]:
    """A sentence where falls of the force crowd at the smallest that was seen: those below it are missing."""
    drop = rows["drop"].dropna().to_numpy()
    if drop.size < 20 or not (drop > 0).all():
        return []
    low, tenth, high = np.quantile(drop, [0.0, 0.1, 0.9])
    if tenth > CROWDED * low or high < 2 * tenth:
        return []
    return [
        f"A tenth of the break-aways fall by {low:.3g} to {tenth:.3g}, at the edge of what is taken for a slip: smaller ones "
        "are missing, their sticks are counted into the next, and long sticks with high forces are picked out, which looks "
        "like growth with stick time."
    ]


def notes_on_undetermined(fits: Mapping[str, StaticFit]) -> list[str]:
    """The forms of which the break-aways do not tell every number."""
    named = [f"{fit.form} ({', '.join(fit.undetermined)})" for fit in fits.values() if fit.undetermined]
    if not named:
        return []
    return [
        f"Not chosen, as these break-aways determine only combinations of the numbers in brackets: {'; '.join(named)}. "
        "Rests of other lengths separate them."
    ]


def unit_behind(rows: pd.DataFrame, dimension: str) -> str:
    """The unit of a force, a time or a force rate of these break-aways behind a number; nothing where it is not known."""
    units = rows.attrs.get("units", {})
    if "force" not in units or units["force"] == units.get("time", "1") == "1":
        return ""
    return f" {unit_of(dimension, units['force'], '1', units.get('time', '1'))}"
