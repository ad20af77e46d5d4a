"""One law of a given kind fitted to friction records."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
import pandas as pd

from stickslip.errors import InputError
from stickslip.files.checks import did_you_mean
from stickslip.identification.guesses.evidence import BreakAways, Evidence, Guess, refuse_unreadable
from stickslip.identification.guesses.first_guess import GUESSES, first_guess
from stickslip.identification.kinetic.force_fit import ForceFit, fit_forces
from stickslip.identification.kinetic.force_residuals import Problem
from stickslip.identification.kinetic.replayed_motion import WITH_MEMORY, extrapolated_note
from stickslip.identification.lack_of_fit import lack_of_fit
from stickslip.identification.records import FrictionRecord
from stickslip.identification.result import Identification
from stickslip.laws import (
    Combined,
    Coulomb,
    DwellTime,
    Law,
    PiecewiseLinear,
    Tabulated,
    TwoBranch,
)
from stickslip.laws.numbers import check_names, maybe, pointers, value, with_values
from stickslip.laws.state_law import StateLaw

CORRELATED = 0.98
OF_PIECES = (PiecewiseLinear, TwoBranch, Tabulated)
"""Laws whose linear pieces are counted, and how many there are where nothing else is said."""
DECISIVE = 10.0
"""Difference of two logarithms of likelihoods, of rows that may be correlated, that decides between forms of a law."""
USUAL_PIECES = 3
FREE_LEVEL, FALL = "static.kinetic", ("kinetic.break_away", "kinetic.kinetic", "kinetic.scale")
"""Names in a `Combined` law of the level from which static friction grows, and of a fall of kinetic friction."""
WIDE = 0.25
"""Width of the fall that is tried beside the guessed one, over the fastest slip."""
FAR = 10.0
"""Up to so many times the fastest slip of the records a law is asked whether its friction drives."""


@dataclass(frozen=True)
class Options:
    """What :func:`stickslip.identify` is asked for beside records and law; see there."""

    free: Sequence[str] | None = None
    fixed: Mapping[str, float] = field(default_factory=dict)
    pieces: int | Literal["auto"] | None = None
    offset: bool = False
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    ties: Mapping[str, str] | None = None

    def __post_init__(self) -> None:
        def refuse(name: str, expected: str, got: Any) -> None:
            raise InputError(f"identify: expected {name} as {expected}, got {got!r}")

        def is_number(given: Any) -> bool:
            return hasattr(given, "__float__") and not isinstance(given, bool)

        if isinstance(self.free, str) or any(not isinstance(name, str) for name in self.free or ()):
            refuse("free", "a list of names such as ['scale']", self.free)
        for name, given in (("fixed", self.fixed), ("bounds", self.bounds), ("ties", self.ties or {})):
            if not isinstance(given, Mapping):
                refuse(name, "a dictionary by the names of numbers", given)
        for name, number in self.fixed.items():
            if not is_number(number):
                refuse(f"fixed[{name!r}]", "a number", number)
        for name, pair in self.bounds.items():
            ends = list(pair) if isinstance(pair, Iterable) else []
            if len(ends) != 2 or not all(map(is_number, ends)):
                refuse(f"bounds[{name!r}]", "a pair (low, high) of numbers, which may be infinite", pair)

    def command(self, records: Sequence[FrictionRecord], law: str | type[Law] | Law) -> str:
        """What to type to do it again."""
        files = [
            f"FRICTION-{i}.nc" if record.name == f"record {i}" else record.name for i, record in enumerate(records, 1)
        ]
        parts = ["stickslip", "identify", *files, "--law", law if isinstance(law, str) else _kind(law).__name__]
        if self.free is not None:
            parts += ["--free", *self.free]
        if self.fixed:
            parts += ["--fixed", *(f"{name}={value:g}" for name, value in self.fixed.items())]
        if self.pieces is not None:
            parts += ["--pieces", str(self.pieces)]
        if self.offset:
            parts.append("--offset")
        if self.bounds:
            parts += ["--bounds", *(f"{name}={low:g}:{high:g}" for name, (low, high) in self.bounds.items())]
        if self.ties is not None:
            parts += ["--ties", *(f"{name}={source}" for name, source in self.ties.items())]
        return shlex.join(parts)


def fit_law(
    records: list[FrictionRecord], law: str | type[Law] | Law, options: Options, break_aways: BreakAways | None = None
) -> Identification:
    """Fit one law to records; :func:`stickslip.identify` says how and what is raised.

    `break_aways` are those of these records, where several laws are fitted and what they show is worth finding once.
    """
    return LawFit(records, law, options, break_aways or BreakAways(records)).identify()


class LawFit:
    """One law ready to be fitted to records: its first guess, and the problems that follow from it.

    Parameters
    ----------
    records, law, options : as for :func:`fit_law`.
    break_aways : of these records.

    Attributes
    ----------
    kind : of the law.
    problems : one for each form that the law has, whose law is the first guess.
    """

    def __init__(
        self,
        records: list[FrictionRecord],
        law: str | type[Law] | Law,
        options: Options,
        break_aways: BreakAways,
    ) -> None:
        kind, start = check_kind(records, law, options), law if isinstance(law, Law) else None
        count = USUAL_PIECES if options.pieces is None else options.pieces
        if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= 12:
            raise InputError(f"identify: pieces must be a whole number from 1 to 12, or 'auto', got {options.pieces!r}")
        if options.offset and not any(record.both_senses() for record in records):
            raise InputError(
                "identify: an offset can be told from friction only where a record slips in both senses, and none does: add "
                "one, or leave the offset out"
            )
        for record in records:
            refuse_unreadable(record)
        self.kind, self.asked, self.records, self.options = kind, law, records, options
        self._static = None if kind is Coulomb else break_aways.static
        relative, self._drift = (False, []) if kind is Coulomb else break_aways.relative
        grown = None if self._static is None else self._static.of_a_law
        evidence = Evidence(records, break_aways.rows, grown, relative, count, start=start, parts=_parts(law))
        self.guess = _bounded(_guess(kind, start, evidence, options), options.bounds)
        self.problems = []
        for form in [*_forms(self.guess), *_wider(self.guess)]:
            problem = Problem(
                records,
                form.law,
                form.free,
                relative=relative,
                ties=form.ties,
                bounds=form.bounds,
                offset=options.offset,
                guessed=form.guessed,
            )
            problem.law = _best_start(problem, form)  # numbers that are held are those of the start
            self.problems.append(problem)

    def identify(self) -> Identification:
        """The law with its numbers."""
        guess, records, kind, static = self.guess, self.records, self.kind, self._static
        fits = [(self.problems[0], _likeliest(self.problems[0]))]
        for other in self.problems[1:]:
            try:
                fits.append((other, _likeliest(other)))
            except InputError:  # the records do not tell these numbers; the first form stands
                continue
        unlikeliness = [_unlikeliness(fit) for _, fit in fits]
        likeliest = int(np.argmin(unlikeliness))
        problem, found = fits[likeliest if unlikeliness[0] - unlikeliness[likeliest] > DECISIVE else 0]
        constant = 0.0 if found.offset is None else float(found.offset["value"])
        notes = [
            *lack_of_fit(problem, found.law, constant),
            *_bias(problem),
            *_unsaid_zero(records, self.options.offset),
            *_extrapolated(problem),
            *(static.notes if static is not None else self._drift),
            *guess.notes,
            *(note for name, note in guess.held.items() if name not in problem.free),
            *_held(found),
            *_chosen_form(found.law, guess, sorted(unlikeliness)),
            *_at_bounds(found, self.options.bounds),
            *undecided(found.parameters, found.covariance),
            *_measured_range(records, found.law),
        ]
        if kind is DwellTime and static is not None and static.chosen != "exponential":
            notes.append("The law asked for has the exponential form; the other form is named for comparison.")
        if problem.relative:
            notes.append("The kinetic force is the mean over the record; its error holds the drift from slip to slip.")
        notes += [f"{record.name}: {note}" for record in records for note in record.notes]
        return Identification(
            law=found.law,
            parameters=found.parameters,
            covariance=found.covariance,
            groups=found.groups,
            rms=found.rms,
            static=static,
            notes=list(dict.fromkeys(notes)),
            records=records,
            command=self.options.command(records, self.asked),
            ties=guess.ties,
            bounds=guess.bounds,
            offset=found.offset,
        )


def check_kind(records: list[FrictionRecord], law: str | type[Law] | Law, options: Options) -> type[Law]:
    """The class of the law asked for, where records and options go with it."""
    kind = _kind(law)
    if not any(record.slips for record in records):
        raise InputError(
            f"identify: {records[0].name} is a table of break-aways, so nothing is known of kinetic friction: leave the law "
            "out to fit static friction alone, or add a record of the motion"
        )
    for record in records:
        if not record.slips:
            raise InputError(
                f"identify: {record.name} holds break-aways and no slip, so its kinetic friction is not known beside the "
                "other records: leave it out, or fit static friction over stick time to it alone, without a law"
            )
    if options.pieces is not None and not {kind, *_parts(law)[1:]} & set(OF_PIECES):
        names = ", ".join(law.__name__ for law in OF_PIECES)
        raise InputError(
            f"identify: {kind.__name__} has no linear pieces to count: leave pieces out, or ask for {names}"
        )
    return kind


def _kind(law: str | type[Law] | Law) -> type[Law]:
    if isinstance(law, Law):
        return type(law)
    if isinstance(law, type) and issubclass(law, Law):
        return law
    if isinstance(law, str) and law in Law.ALL:
        return Law.ALL[law]
    if _parts(law):
        return Combined
    hint = did_you_mean(str(law), Law.ALL)
    known = ", ".join(item.__name__ for item in GUESSES)
    raise InputError(f"identify: unknown law {law!r}{hint}; known are {known}")


def _parts(law: str | type[Law] | Law) -> tuple[type[Law], ...]:
    """Kinds of the parts in ``"Combined:LogarithmicDwell"`` or ``"Combined:DwellTime:Lorentzian"``, else none."""
    if not isinstance(law, str) or not law.startswith(f"{Combined.__name__}:"):
        return ()
    names = law.split(":")[1:]
    for name in names:
        if name not in Law.ALL:
            raise InputError(f"identify: {law}: unknown law {name!r}{did_you_mean(name, Law.ALL)}")
    if len(names) > 2:
        raise InputError(
            f"identify: {law}: expected a static and a kinetic part after Combined, got {len(names)} parts"
        )
    return tuple(Law.ALL[name] for name in names)


def _guess(kind: type[Law], start: Law | None, evidence: Evidence, options: Options) -> Guess:
    fixed, asked = dict(options.fixed), None if options.free is None else list(options.free)
    if start is not None and asked is not None:
        guess = Guess(start, asked)
    else:
        guess = first_guess(kind, evidence)
        if start is not None:
            known = pointers(start)
            guess = Guess(
                start,
                [name for name in guess.free if name in known],
                guess.ties,
                guess.notes,
                bounds=guess.bounds,
                guessed=guess.guessed,
            )
    if asked is not None:
        guess = replace(guess, candidates=[*guess.candidates, *guess.starts], wider=[])
    guess = _with_ties(guess, asked, options.ties)
    names = check_names(guess.law, guess.free if asked is None else asked)
    check_names(guess.law, fixed)
    names = [name for name in names if name not in fixed]
    if not names:
        raise InputError("identify: no parameter is left to fit; give fewer in fixed, or more in free")
    laws: list[Law] = []
    for candidate in [guess.law, *guess.candidates]:
        try:
            laws.append(with_values(candidate, fixed))
        except InputError as error:
            reason = error
    if not laws:
        raise InputError(f"identify: the values that are held fixed do not make a law: {reason}")
    notes = list(guess.notes)
    tied = {*names, *fixed, *guess.ties}
    held = {name: maybe(guess.law, name) for name in pointers(guess.law) if name not in tied}
    if start is not None and asked is None and any(number is not None for number in held.values()):
        said = ", ".join(f"{name} = {number:g}" for name, number in held.items() if number is not None)
        notes.append(f"Held as in the law that was given: {said}; name them in free to fit them.")
    if fixed:
        notes.append("Held fixed as asked: " + ", ".join(f"{name} = {value:g}" for name, value in fixed.items()) + ".")
    guessed = {name: error for name, error in guess.guessed.items() if name not in [*names, *fixed]}
    held_notes = {name: note for name, note in guess.held.items() if name not in fixed}
    starts = [with_values(law, fixed) for law in guess.starts]
    wider = [name for name in guess.wider if name not in [*names, *fixed]]
    return Guess(laws[0], names, guess.ties, notes, laws[1:], guess.bounds, guessed, held_notes, wider, starts)


def _with_ties(guess: Guess, asked: list[str] | None, ties: Mapping[str, str] | None) -> Guess:
    """The guess with the ties asked for; a number that is asked for in `free` follows none."""
    if ties is None:
        kept = {name: source for name, source in guess.ties.items() if name not in (asked or [])}
        return replace(guess, ties=kept)
    check_names(guess.law, [*ties, *ties.values()])
    free = [*guess.free, *guess.ties] if asked is None else asked
    for name, source in ties.items():
        if name in (asked or []):
            raise InputError(
                f"identify: {name} is to be fitted and to follow {source}: leave it out of free or out of ties"
            )
        if source in ties or source == name:
            raise InputError(
                f"identify: {name} follows {source}, which follows another number itself: tie it to a free one"
            )
    said = ", ".join(f"{name} follows {source}" for name, source in ties.items()) or "no number follows another"
    notes = [note for note in guess.notes if not any(note.startswith(name) for name in (*guess.ties, *ties))]
    law = with_values(guess.law, {name: value(guess.law, source) for name, source in ties.items()})
    return Guess(
        law, [name for name in free if name not in ties], dict(ties), [*notes, f"As asked, {said}."], [], guess.bounds
    )


def _bounded(guess: Guess, bounds: Mapping[str, tuple[float, float]]) -> Guess:
    """The guess with the bounds asked for, and its numbers inside them."""
    if not bounds:
        return guess
    for name in check_names(guess.law, bounds):
        low, high = bounds[name]
        if name not in guess.free:
            raise InputError(f"identify: {name} has bounds but is not fitted; add it to free, or leave its bounds out")
        if not low < high:
            raise InputError(
                f"identify: the bounds of {name} must be the lower and the higher value, got {low:g} and {high:g}"
            )
    laws: list[Law] = []
    for law in [guess.law, *guess.candidates]:
        inside = {name: float(np.clip(value(law, name), *bounds[name])) for name in bounds}
        try:
            laws.append(with_values(law, inside))
        except InputError as error:
            reason = error
    if not laws:
        raise InputError(f"identify: within these bounds there is no law to begin with: {reason}")
    return replace(guess, law=laws[0], candidates=laws[1:], bounds=guess.bounds | dict(bounds))


def _bias(problem: Problem) -> list[str]:
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


def _extrapolated(problem: Problem) -> list[str]:
    """That a break-away force was fitted to records without break-aways."""
    if not any(name.endswith("break_away") for name in problem.free) or any(
        kind == "break-away" for _, kind in problem.groups
    ):
        return []
    speeds = [np.abs(motion.slip_velocity[a:b]).min() for motion in problem.motions for a, b in motion.stretches]
    return [extrapolated_note(float(min(speeds)))]


def _held(found: ForceFit) -> list[str]:
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
            f"moves {others}; the errors hold that."
        )
    return said


def _choices(law: Law) -> dict[str, float]:
    """The numbers that choose the form of a law, and of those that it is made of."""
    found: dict[str, float] = {}
    for name, parameter in law.PARAMETERS.items():
        part = getattr(law, name)
        if isinstance(part, Law):
            found |= {f"{name}.{inner}": number for inner, number in _choices(part).items()}
        elif parameter.choices:
            found[name] = part
    return found


def _forms(guess: Guess) -> list[Guess]:
    """A guess for each form of the law among the first guesses, as numbers that choose a form are never fitted."""
    laws = [guess.law, *guess.candidates]
    forms = [[law for law in laws if _choices(law) == choices] for choices in map(_choices, laws)]
    return [replace(guess, law=form[0], candidates=form[1:]) for i, form in enumerate(forms) if form not in forms[:i]]


def _wider(guess: Guess) -> list[Guess]:
    """Guesses with more numbers free, one for each law that the fit of them begins with."""
    free = [*guess.free, *guess.wider]
    return [replace(guess, law=law, free=free, candidates=[]) for law in guess.starts] if guess.wider else []


def _likeliest(problem: Problem) -> ForceFit:
    """The fit from the first guess; of a fall of kinetic friction beside a free level of static friction the likelier of two.

    Nothing then holds the curve at w = 0, and measured friction is rounded there: a fall that is guessed too short or too low
    stays so. The other begins half way up to static friction.
    """
    found = fit_forces(problem, problem.law)
    if not {FREE_LEVEL, *FALL}.issubset(problem.free):
        return found
    top, low, width = FALL
    half = 0.5 * (value(problem.law, FREE_LEVEL) + value(problem.law, low))
    fastest = max(float(np.abs(motion.slip_velocity).max()) for motion in problem.motions)
    wide = fit_forces(problem, with_values(problem.law, {top: half, width: WIDE * fastest}))
    return min(found, wide, key=_unlikeliness)


def _unlikeliness(found: ForceFit) -> float:
    """Minus the logarithm of the likelihood by what was fitted; the force residual would judge what smoothing rounds."""
    scale = np.maximum(found.groups["scale"].to_numpy(float), 1e-300)
    return float(np.sum(found.groups["rows"].to_numpy(float) * np.log(scale)))


def _chosen_form(law: Law, guess: Guess, unlikeliness: list[float]) -> list[str]:
    """Which form of a law that has several was taken, and whether the records tell."""
    if len(_forms(guess)) < 2:
        return []
    said = ", ".join(f"{name} = {number:g}" for name, number in _choices(law).items())
    form = f"the form of {type(law).__name__} with {said}"
    if len(unlikeliness) < 2:
        return [f"Of several forms {form} was taken; the others cannot be fitted to these records."]
    if unlikeliness[1] - unlikeliness[0] < DECISIVE:
        return [f"Of several forms {form} was taken, but these records hardly tell which it is."]
    return [f"Of several forms {form} lies closest to the records; it was taken."]


def _at_bounds(found: ForceFit, bounds: Mapping[str, tuple[float, float]]) -> list[str]:
    """Which numbers the records push against the bounds they were given."""
    return [
        f"{name} = {number:.4g} lies on the bound it was given: the records ask for a value beyond it."
        for name, number, error in found.parameters[["value", "error"]].itertuples()
        if name in bounds and min(abs(number - end) for end in bounds[name]) < 0.01 * error
    ]


def _best_start(problem: Problem, guess: Guess) -> Law:
    """Of the first guesses the one with the least misfit."""
    if not guess.candidates:
        return guess.law
    usual = [np.full_like(rest, max(float(np.median(np.abs(rest))), 1e-300)) for rest in problem.residuals(guess.law)]
    return min([guess.law, *guess.candidates], key=lambda law: problem.cost(law, usual))


def _measured_range(records: Sequence[FrictionRecord], law: Law) -> list[str]:
    """Up to which slip speed the records tell a law whose friction depends on it."""
    fastest = max(float(np.abs(record.slip_velocity[~record.stuck]).max()) for record in records)
    unit = records[0].units.get("slip_velocity", "1")
    if isinstance(law, StateLaw) or np.ptp(law.kinetic_force(np.array([0.5, 1.0, 1.5]) * fastest)) == 0:
        return []
    of_unit = "" if unit == "1" else f" {unit}"
    notes = [f"The records hold slip up to w = {fastest:.3g}{of_unit}: beyond it the form of the law is extrapolated."]
    beyond = fastest * np.geomspace(1.0, FAR, 300)
    drives = np.sign(np.stack([law.kinetic_force(beyond), -law.kinetic_force(-beyond)])).min(axis=0) < 0
    if drives.any():
        first = float(beyond[np.argmax(drives)])
        notes.append(
            f"By its form friction changes its sign near w = {first:.2g}{of_unit} and drives the slip from there on: a "
            "motion that gets there may grow without end. Simulate no faster slip, or hold the part that falls with the "
            "slip velocity at zero (--fixed) where the records do not tell it from that."
        )
    return notes


def undecided(parameters: pd.DataFrame, covariance: pd.DataFrame) -> list[str]:
    """Sentences on numbers that may be zero, and on those that are known only together."""
    notes = []
    for name, number, error, low, high in parameters[["value", "error", "low", "high"]].itertuples():
        if low <= 0 <= high:  # of one that is fitted by its logarithm neither end is
            notes.append(f"{name} is not told apart from zero: {number:.3g} ± {error:.2g}.")
    errors = parameters["error"].to_numpy()
    correlation = covariance.to_numpy() / np.outer(errors, errors)
    names = list(parameters.index)
    notes += [
        f"{names[j]} and {names[i]} are hardly told apart (correlation {correlation[i, j]:.3f}): a combination of them is "
        "known far better than either."
        for i in range(len(names))
        for j in range(i)
        if abs(correlation[i, j]) > CORRELATED
    ]
    return notes


def _unsaid_zero(records: Sequence[FrictionRecord], offset: bool) -> list[str]:
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
        f"{taken} All slip is one way, so nothing here can tell: where that zero is arbitrary, all friction forces are off "
        "by the force it stands for, which no interval holds."
    ]


def _zeroed(rig: Mapping[str, Any]) -> bool:
    """Whether a rig says which reading of its force means zero."""
    columns = rig.get("columns", {})
    given = [columns[name] for name in ("force", "current", "torque") if name in columns]
    return any(isinstance(column, Mapping) and {"zero", "zero_row"} & {*column} for column in given)
