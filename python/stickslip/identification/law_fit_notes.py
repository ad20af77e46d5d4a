"""What is said of the numbers of a fitted law: which are held, bounded, biased, uncertain, or beyond what was measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from stickslip.files.units import unit_suffix
from stickslip.identification.kinetic.force_fit import ForceFit
from stickslip.identification.kinetic.force_residuals import Problem
from stickslip.identification.kinetic.replayed_motion import WITH_MEMORY, extrapolated_note
from stickslip.identification.records import FrictionRecord
from stickslip.laws import Law
from stickslip.laws.numbers import value
from stickslip.laws.state_law import StateLaw

CORRELATED = 0.98
"""Two numbers whose estimates correlate by more can hardly be separated."""
FARTHEST_SPEED = 10.0
"""Up to so many times the fastest slip of the records a law is asked whether its friction drives."""


def notes_on_bias(problem: Problem) -> list[str]:
    """That the interval of f_s(0) does not hold it, where it comes from indirect forces of motions without sticks."""
    if "static_friction.initial" not in problem.free or not isinstance(problem.law, WITH_MEMORY):
        return []
    sticking = {number for number, kind in problem.groups if kind == "break-away"}
    if not any(motion.indirect and number not in sticking for number, motion in enumerate(problem.motions)):
        return []
    return [
        "The interval of static_friction.initial does not hold its bias: single cycles of motions without sticks lie off as "
        "a whole and make it too low, in trials by two to five stated errors; fit_trajectories has not this error."
    ]


def notes_on_break_away_speed(problem: Problem) -> list[str]:
    """That a break-away force was fitted to records without break-aways."""
    if not any(name.endswith("break_away") for name in problem.free) or any(
        kind == "break-away" for _, kind in problem.groups
    ):
        return []
    speeds = [np.abs(motion.slip_velocity[a:b]).min() for motion in problem.motions for a, b in motion.stretches]
    return [extrapolated_note(float(min(speeds)))]


def rigid_note(name: str, least: float | None, held: float) -> str:
    """That records do not limit a number of bristles from above: its least value if they tell one, and where it is held."""
    known = (
        f"Only a lower bound of the {name} is determined: {name} > {least:.2g} (95 %)."
        if least is not None
        else f"The {name} is not determined: sticks hide how bristles bend, and the slips are as of rigid ones."
    )
    return (
        f"{known} It is held at {held:.2g}, where bristles have settled between two samples; to know it, record reversals of "
        "the slip with more samples."
    )


def notes_on_held_numbers(found: ForceFit) -> list[str]:
    """Which numbers are held at a guess, and what that does to the fitted ones."""
    said = []
    for name, shift in found.shifts.items():
        moved = shift[shift.abs() > 0.1 * found.parameters["error"].reindex(shift.index)]
        others = (
            ", ".join(f"{other} by {abs(size):.2g}" for other, size in moved.items())
            or "no other by a tenth of its error"
        )
        said.append(
            f"{name} = {value(found.law, name):.3g} is held at a guess, not measured: where it is off by a likely amount it "
            f"moves {others}; the errors include that."
        )
    return said


def notes_on_bounds(found: ForceFit, bounds: Mapping[str, tuple[float, float]]) -> list[str]:
    """Which numbers the records push against the bounds they were given."""
    return [
        f"{name} = {number:.4g} lies on the bound it was given: the records ask for a value beyond it."
        for name, number, error in found.parameters[["value", "error"]].itertuples()
        if name in bounds and min(abs(number - end) for end in bounds[name]) < 0.01 * error
    ]


def notes_on_range(records: Sequence[FrictionRecord], law: Law) -> list[str]:
    """Up to which slip speed the records tell a law whose friction depends on it."""
    fastest = max(float(np.abs(record.slip_velocity[~record.stuck]).max()) for record in records)
    unit = unit_suffix(records[0].units.get("slip_velocity", "1"))
    if isinstance(law, StateLaw) or np.ptp(law.kinetic_force(np.array([0.5, 1.0, 1.5]) * fastest)) == 0:
        return []
    notes = [f"The records hold slip up to w = {fastest:.3g}{unit}: beyond it the form of the law is extrapolated."]
    beyond = fastest * np.geomspace(1.0, FARTHEST_SPEED, 300)
    drives = np.sign(np.stack([law.kinetic_force(beyond), -law.kinetic_force(-beyond)])).min(axis=0) < 0
    if drives.any():
        first = float(beyond[np.argmax(drives)])
        notes.append(
            f"By its form friction changes its sign near w = {first:.2g}{unit} and drives the slip from there on: a "
            "motion that gets there may grow without end. Simulate no faster slip, or hold the part that falls with the "
            "slip velocity at zero (--fixed) where the records do not separate the two."
        )
    return notes


def notes_on_uncertain_numbers(parameters: pd.DataFrame, covariance: pd.DataFrame) -> list[str]:
    """Sentences on numbers that may be zero, and on those that are known only together."""
    notes = []
    for name, number, error, low, high in parameters[["value", "error", "low", "high"]].itertuples():
        if low <= 0 <= high:  # of one that is fitted by its logarithm neither end is
            notes.append(f"{name} does not differ from zero within its error: {number:.3g} ± {error:.2g}.")
    errors = parameters["error"].to_numpy()
    correlation = covariance.to_numpy() / np.outer(errors, errors)
    names = list(parameters.index)
    notes += [
        f"{names[j]} and {names[i]} can hardly be separated (correlation {correlation[i, j]:.3f}): a combination of them is "
        "known far better than either."
        for i in range(len(names))
        for j in range(i)
        if abs(correlation[i, j]) > CORRELATED
    ]
    return notes


def notes_on_zero(records: Sequence[FrictionRecord], offset: bool) -> list[str]:
    """A sentence where the level of friction stands on a zero of the instrument that nobody gave and no record can tell."""
    rigs = [record.rig for record in records]
    known = any(not rig or rig.get("rest") or _zeroed(rig) for rig in rigs)
    if offset or known or any(record.both_senses() for record in records):
        return []
    spring = all(rig.get("instrument") in ("displacement", "spring_force") for rig in rigs)
    taken = (
        "The spring is taken as slack at the reading 0 (rest in the rig sets another)."
        if spring
        else "The reading 0 of the instrument is taken as no force (zero of its column in the rig sets another)."
    )
    return [
        f"{taken} All slip is one way, so the record cannot show it: where that zero is arbitrary, all friction forces are "
        "off by the force it stands for. This error is not included in any interval."
    ]


def _zeroed(rig: Mapping[str, Any]) -> bool:
    """Whether a rig says which reading of its force means zero."""
    columns = rig.get("columns", {})
    given = [columns[name] for name in ("force", "current", "torque") if name in columns]
    return any(isinstance(column, Mapping) and {"zero", "zero_row"} & {*column} for column in given)
