"""One law of a given kind fitted to friction records."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stickslip.errors import InputError
from stickslip.identification.fit_options import Options
from stickslip.identification.guesses.guess_data import BreakAways, Guess, GuessData, refuse_unreadable
from stickslip.identification.guesses.requested_guess import requested_guess, within_bounds
from stickslip.identification.guesses.state_laws import BRISTLES
from stickslip.identification.kinetic.force_fit import ForceFit, fit_forces
from stickslip.identification.kinetic.force_residuals import OFFSET, Problem
from stickslip.identification.kinetic.lower_bound import lower_bound
from stickslip.identification.lack_of_fit import lack_of_fit
from stickslip.identification.law_fit_notes import (
    notes_on_bias,
    notes_on_bounds,
    notes_on_break_away_speed,
    notes_on_held_numbers,
    notes_on_range,
    notes_on_uncertain_numbers,
    notes_on_zero,
    rigid_note,
)
from stickslip.identification.law_forms import (
    DECISIVE,
    forms_of_law,
    likeliest_fit,
    negative_log_likelihood,
    notes_on_form,
    wider_forms,
)
from stickslip.identification.records import FrictionRecord
from stickslip.identification.requested_law import kind_of, parts_of
from stickslip.identification.result import Identification
from stickslip.laws import Coulomb, DwellTime, Law, PiecewiseLinear, Tabulated, TwoBranch
from stickslip.laws.numbers import with_values

OF_PIECES = (PiecewiseLinear, TwoBranch, Tabulated)
"""Laws whose linear pieces are counted."""
USUAL_PIECES = 3
"""How many there are where nothing else is said."""


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
                "identify: an offset can be separated from friction only where a record slips in both senses, and none does: "
                "add one, or leave the offset out"
            )
        for record in records:
            refuse_unreadable(record)
        self.kind, self.asked, self.records, self.options = kind, law, records, options
        self._static = None if kind is Coulomb else break_aways.static
        relative, self._drift = (False, []) if kind is Coulomb else break_aways.relative
        grown = None if self._static is None else self._static.of_a_law
        data = GuessData(records, break_aways.rows, grown, relative, count, start=start, parts=parts_of(law))
        self.guess = within_bounds(requested_guess(kind, start, data, options), options.bounds)
        self.problems = []
        for form in [*forms_of_law(self.guess), *wider_forms(self.guess)]:
            problem = self._problem(form, relative)
            problem.law = _best_start(problem, form)  # numbers that are held are those of the start
            self.problems.append(problem)

    def _problem(self, form: Guess, relative: bool) -> Problem:
        """The search of the free numbers of a form."""
        return Problem(
            self.records,
            form.law,
            form.free,
            relative=relative,
            ties=form.ties,
            bounds=form.bounds,
            offset=self.options.offset,
            guessed=form.guessed,
        )

    def identify(self) -> Identification:
        """The law with its numbers."""
        guess, records, kind, static = self.guess, self.records, self.kind, self._static
        fits = [(self.problems[0], likeliest_fit(self.problems[0]))]
        for other in self.problems[1:]:
            try:
                fits.append((other, likeliest_fit(other)))
            except InputError:  # the records do not tell these numbers; the first form stands
                continue
        costs = [negative_log_likelihood(fit) for _, fit in fits]
        likeliest = int(np.argmin(costs))
        problem, found = fits[likeliest if costs[0] - costs[likeliest] > DECISIVE else 0]
        problem, found, stiff = self._with_stiffness_held(problem, found, *fits[0])
        constant = 0.0 if found.offset is None else float(found.offset["value"])
        notes = [
            *lack_of_fit(problem, found.law, constant),
            *notes_on_bias(problem),
            *notes_on_zero(records, self.options.offset),
            *notes_on_break_away_speed(problem),
            *(static.notes if static is not None else self._drift),
            *guess.notes,
            *(note for name, note in (guess.held | stiff).items() if name not in problem.free),
            *notes_on_held_numbers(found),
            *notes_on_form(found.law, guess, sorted(costs)),
            *notes_on_bounds(found, self.options.bounds),
            *notes_on_uncertain_numbers(found.parameters, found.covariance),
            *notes_on_range(records, found.law),
        ]
        if kind is DwellTime and static is not None and static.chosen != "exponential":
            notes.append("The requested law has the exponential form; the other form is named for comparison.")
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

    def _with_stiffness_held(
        self, problem: Problem, found: ForceFit, usual: Problem, narrow: ForceFit
    ) -> tuple[Problem, ForceFit, dict[str, str]]:
        """The fit with the stiffness of bristles held where the records do not limit it from above, and what is said of it.

        The fit begins from the curve of the first form (`usual`, `narrow`) too, which stands where nothing else can be.
        """
        name = "stiffness"
        if self.kind not in BRISTLES or name not in problem.free or name in self.options.bounds:
            return problem, found, {}
        greatest = self.guess.bounds[name][1]
        sticks = any(record.stuck.any() for record in self.records)
        least = lower_bound(problem, found, name, greatest, wanted=not sticks)
        if least is None:
            return problem, found, {}
        free = [other for other in problem.free if other not in (name, OFFSET)]
        if not free:
            raise InputError(
                f"identify: the records only say that the {name} of {self.kind.__name__} is large: hold it at a value, such "
                f"as fixed={{{name!r}: {greatest:.2g}}}, and fit another number"
            )
        rigid = [with_values(law, {name: greatest}) for law in (found.law, narrow.law)]
        # the damping of bristles acts with their stiffness alone: how far it moves with that is part of its error
        guessed = {name: greatest} if "damping" in free else {}
        form = replace(self.guess, law=rigid[0], free=free, guessed=guessed)
        held = self._problem(form, problem.relative)
        try:
            closest = min((fit_forces(held, law) for law in rigid), key=negative_log_likelihood)
        except InputError:
            if usual is problem:
                raise
            return usual, narrow, {}
        return held, closest, {name: rigid_note(name, None if sticks else least, greatest)}


def check_kind(records: list[FrictionRecord], law: str | type[Law] | Law, options: Options) -> type[Law]:
    """The class of the law asked for, where records and options go with it."""
    kind = kind_of(law)
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
    if options.pieces is not None and not {kind, *parts_of(law)[1:]} & set(OF_PIECES):
        names = ", ".join(law.__name__ for law in OF_PIECES)
        raise InputError(
            f"identify: {kind.__name__} has no linear pieces to count: leave pieces out, or ask for {names}"
        )
    return kind


def _best_start(problem: Problem, guess: Guess) -> Law:
    """Of the first guesses the one with the least misfit."""
    if not guess.candidates:
        return guess.law
    usual = [max(float(np.median(np.abs(residuals))), 1e-300) for residuals in problem.residuals(guess.law)]
    return min([guess.law, *guess.candidates], key=lambda law: problem.cost(law, usual))
