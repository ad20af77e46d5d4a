"""A law refined until its simulated motions agree with the measured ones."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from stickslip.errors import InputError, fraction, number, whole_number
from stickslip.files.arrays import Array
from stickslip.files.progress import waiting_by_stage
from stickslip.identification.estimator.threads import one_thread
from stickslip.identification.estimator.uncertainty import Inseparable
from stickslip.identification.law_fit_notes import notes_on_uncertain_numbers
from stickslip.identification.law_parameters import LawParameters
from stickslip.identification.trajectory.checkpoint import Checkpoint
from stickslip.identification.trajectory.motion_misfit import MotionMisfit
from stickslip.identification.trajectory.profile import profile_intervals, why_no_parabola
from stickslip.identification.trajectory.search import Progress, Refined, distance, search
from stickslip.identification.trajectory.single_shooting import SingleShooting
from stickslip.identification.trajectory.slip_shooting import SlipShooting, scattering
from stickslip.laws.numbers import check_names

if TYPE_CHECKING:
    from stickslip.identification.result import Identification

DISAGREE = 3.0
"""Standard errors by which two ways through the same records may differ."""


@one_thread
def fit_trajectories(
    first: Identification,
    free: Iterable[str] | None = None,
    settled_after: float = 0.4,
    *,
    shooting: Literal["auto", "records", "slips"] = "auto",
    bounds: Mapping[str, tuple[float, float]] | None = None,
    starts: int = 8,
    profile: bool = False,
    zero_error: float = 0.0,
    scale_error: float | None = None,
    seed: int = 0,
    progress: Progress | None = None,
    checkpoint: str | Path | None = None,
) -> Identification:
    """Sharpen an identified law until the motion it makes lies over the measured motion.

    Minimised is Σ ρ((x_simulated(t + φ; law) − x_measured(t)) / σ_r) over all records r, with σ_r the noise of the record and
    ρ quadratic for small residuals and straight beyond three standard deviations.

    By records (single shooting) x_simulated is the settled motion under the record's drive and φ one shift of time a record.
    Each start is led near first by what does not depend on φ: period, turning points, time stuck, distance of the phase
    trajectories, kind of motion. A motion of another kind than the measured one is never taken.

    By slips (multiple shooting without matching conditions) each slip that follows a whole stick and ends in one is
    simulated anew, from its own break-away: where and when it begins are unknowns of that slip, the numbers of the law are
    shared. How static friction grows is then taken from where the sticks end, see
    :mod:`stickslip.identification.trajectory.first_passage`.

    Parameters
    ----------
    first : an identification whose records hold a displacement; any law by records, one with a break-away by slips.
    free : names of the numbers to fit; default those of `first`.
    settled_after : the fraction of each record that is left out as transient, in [0, 1).
    shooting : ``"records"``, ``"slips"``, or ``"auto"``: by slips where the cycles of a record scatter, which `notes` says.
    bounds : (low, high) by name, within which a free number stays, beyond those that `first` was given.
    starts : the most starting points that are tried; the first is that of `first`, the others lie around it. The search
        ends where only noise is left.
    profile : intervals by the profile of the likelihood instead of the curvature at its top; by records.
    zero_error, scale_error : standard errors of the zero (a length) and the scale (relative) of the instrument, the same for
        all records. They do not show in a record, and at low noise they are most of what is not known. Default of the scale:
        the largest that the records state, as those from a film do.
    seed : of the starting points.
    progress : called as ``progress(what, done, of)``; default a line for a person who waits.
    checkpoint : a law file that holds the best so far from start to start, and after an interruption; where it exists
        and is from the same records and numbers, the search goes on from it. It is removed at the end.

    Returns
    -------
    Identification with the refined law, its parameters and covariance; ``rms`` is that of the displacement, in standard
    deviations of the motion; ``motions`` has a row for each record.

    Raises
    ------
    InputError
        for a record without displacement or with unknown constants, or where no motion lies near the record.
    KeyboardInterrupt
        after the best so far was written to `checkpoint`.

    Limits: by records for steady, repeating motions; the covariance takes the correlation of the residuals from sample to
    sample and from cycle to cycle into account. Where more than noise is left, errors are no smaller than those
    of `first`, and hold how far the two lie apart. By slips for motions that stick; the intervals hold
    what differs from slip to slip. Neither holds
    errors of the rig's mass, stiffness, damping and drive velocity. Slopes by records go through all events by the core's
    derivatives; of a smooth law, or one with an internal state, and by slips they are differences of exact orbits.

    Source: the criterion of identification of the paper's Section 6, agreement of phase trajectories; multiple shooting
    after Bock, in Modelling of Chemical Reaction Systems (1981) 102.
    """
    fraction("settled_after", settled_after, "fit_trajectories")
    whole_number("starts", starts, "fit_trajectories")
    if shooting not in ("auto", "records", "slips"):
        raise InputError(f"fit_trajectories: shooting must be auto, records or slips, got {shooting!r}")
    names = check_names(first.law, first.parameters.index if free is None else free)
    if scale_error is None:
        scale_error = max(float(record.attrs.get("scale_error", 0.0)) for record in first.records)
    for name, size in (("zero_error", zero_error), ("scale_error", scale_error)):
        if number(name, size, "fit_trajectories") < 0:
            raise InputError(f"fit_trajectories: {name} must not be negative, got {size}")
    bounds = {**first.bounds, **_checked(bounds or {}, names)}
    numbers, instrument = LawParameters(first.law, names, first.ties, bounds), (zero_error, scale_error)
    why = scattering(first, settled_after) if shooting == "auto" else None
    shots: SingleShooting | SlipShooting
    if shooting == "slips" or why is not None:
        if profile:
            raise InputError(
                "fit_trajectories: intervals by slips come from how the slips differ, not from a profile: leave profile out"
                + ("" if why is None else f", or shoot by records ({why})")
            )
        shots = SlipShooting(first.records, settled_after, numbers, instrument)
    else:
        shots = SingleShooting([MotionMisfit(record, settled_after) for record in first.records], numbers, instrument)
    about = [names, settled_after, seed, type(shots).__name__, sorted(bounds.items())]
    memory = Checkpoint(checkpoint, first, about)
    progress = waiting_by_stage(progress)
    search(shots, first, starts, np.random.default_rng(seed), memory, progress)
    shots, refined, notes = _finished(shots)
    result = _result(first, shots, refined, [*notes, *([] if why is None else [f"Shot by slips: {why}."])])
    if isinstance(shots, SingleShooting):
        if profile:
            result = _profiled(result, shots, refined, progress)
        elif (doubt := why_no_parabola(shots, shots.best[1], refined.covariance)) is not None:
            result = replace(result, notes=[*result.notes, doubt])
    memory.remove()
    return result


def _finished(
    shots: SingleShooting | SlipShooting,
) -> tuple[SingleShooting | SlipShooting, Refined, list[str]]:
    """The search ended, with sentences on numbers that the motions do not tell: after a long search they are held."""
    notes: list[str] = []
    while True:
        try:
            return shots, shots.finish(), notes
        except Inseparable as error:
            if isinstance(shots, SlipShooting) or len(error.names) < 2:
                raise
            name = error.names[-1]
            at = dict(zip(shots.free.names, shots.free.values(shots.best[1][: shots.count]), strict=True))[name]
            shots = shots.holding(name)
            notes.append(
                f"{' and '.join(error.names)} cannot be separated by these motions: {name} is held at {at:.4g}, where the "
                "search ended, and the intervals of the others are for that value; a record at another drive velocity may "
                "tell them."
            )


def _checked(bounds: Mapping[str, tuple[float, float]], names: Iterable[str]) -> dict[str, tuple[float, float]]:
    known = list(names)
    for name, pair in bounds.items():
        if name not in known:
            raise InputError(
                f"fit_trajectories: bounds are given for {name}, which is not fitted; fitted are {', '.join(known)}"
            )
        if not len(pair) == 2 or not pair[0] < pair[1]:
            raise InputError(f"fit_trajectories: the bounds of {name} must be a pair (low, high), got {pair}")
    return {name: (float(low), float(high)) for name, (low, high) in bounds.items()}


def _result(
    first: Identification, shots: SingleShooting | SlipShooting, refined: Refined, notes: list[str]
) -> Identification:
    free, count = shots.free, len(shots.free.names)
    covariance = refined.covariance[:count, :count]
    if isinstance(shots, SingleShooting) and shots.misses(refined.motions):
        apart, said = _fits_differ(first, free, refined)
        covariance = covariance + np.outer(apart, apart) + np.diag(_lacking(first, free, refined) ** 2)
        notes = [*notes, *said]
    parameters, full = free.estimate(refined.numbers, covariance, refined.freedom)
    options = ["--trajectories", *(["--shooting slips"] if isinstance(shots, SlipShooting) else [])]
    for name, size in zip(("zero", "scale"), shots.instrument_error.tolist(), strict=True):
        if size:
            options.append(f"--{name}-error {size:g}")
            notes.append(
                f"An error of {size:.3g} of the instrument's {name}, common to all records, is in the intervals."
            )
    held = (refined.numbers <= free.low) | (refined.numbers >= free.high)
    notes += [
        f"{name} is held by a bound, so its interval and those of the other numbers leave out that it may lie beyond."
        for name, at in zip(free.names, held, strict=True)
        if at
    ]
    # What the first fit left undecided, the motions may have told.
    before = notes_on_uncertain_numbers(first.parameters, first.covariance)
    return replace(
        first,
        law=free.law(refined.numbers),
        parameters=parameters,
        covariance=full,
        rms=distance(refined.motions),
        motions=refined.motions,
        command=" ".join([first.command, *options]),
        notes=[
            *(note for note in first.notes if note not in before),
            *notes_on_uncertain_numbers(parameters, full),
            *notes,
            *refined.notes,
        ],
    )


def _fits_differ(first: Identification, free: LawParameters, refined: Refined) -> tuple[Array, list[str]]:
    """How far the motions took each number from where forces and break-aways had it, beyond the errors of both; in words too.

    Zero where they agree. Two ways through one record that disagree show that the law has not the form of the friction: the
    distance between them is an error of either.
    """
    plain, units = free.values(refined.numbers), free.units(refined.numbers)
    errors = np.sqrt(np.diag(refined.covariance)[: len(plain)]) * units
    apart, said = np.zeros(len(plain)), []
    for i, name in enumerate(free.names):
        if name not in first.parameters.index:
            continue
        before, known = first.parameters.loc[name, ["value", "error"]].to_numpy(float)
        if abs(plain[i] - before) > DISAGREE * math.hypot(errors[i], known):
            apart[i] = (plain[i] - before) / units[i]
            said.append(
                f"{name}: the motions say {plain[i]:.4g} and forces and break-aways {before:.4g} ± {known:.2g}, so the law "
                "has not quite the form of the friction; the distance is in its error."
            )
    return apart, said


def _lacking(first: Identification, free: LawParameters, refined: Refined) -> Array:
    """What the standard error of each number lacks of the one from forces and break-aways, in the units of the search.

    Of a law with another form than the friction a motion is fitted closely by numbers that are off by far more than what is
    left of it lets expect: their errors are then no smaller than those that need no motion.
    """
    units = free.units(refined.numbers)
    known = first.parameters["error"].reindex(free.names).fillna(0.0).to_numpy() / units
    return np.asarray(np.sqrt(np.maximum(known**2 - np.diag(refined.covariance)[: known.size], 0.0)))


def _profiled(result: Identification, shots: SingleShooting, refined: Refined, progress: Progress) -> Identification:
    ends, open_ends = profile_intervals(shots, shots.best[1], refined.covariance, progress)
    return replace(
        result,
        parameters=result.parameters.assign(low=ends["low"], high=ends["high"]),
        command=result.command + " --profile",
        notes=[*result.notes, "Intervals are those of the profile likelihood.", *open_ends],
    )
