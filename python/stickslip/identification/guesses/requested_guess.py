"""The first guess with what is asked of its numbers: free, fixed, tied to others, and within bounds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from stickslip.errors import InputError
from stickslip.identification.fit_options import Options
from stickslip.identification.guesses.first_guess import first_guess
from stickslip.identification.guesses.guess_data import Guess, GuessData
from stickslip.identification.guesses.state_laws import BRISTLES, stiffest
from stickslip.laws import Law
from stickslip.laws.numbers import check_names, maybe, pointers, value, with_values


def requested_guess(kind: type[Law], start: Law | None, data: GuessData, options: Options) -> Guess:
    """The first guess for a law of this kind, or with `start` as its law, with the numbers free and tied as asked."""
    fixed, asked = dict(options.fixed), None if options.free is None else list(options.free)
    if start is not None and asked is not None:
        guess = Guess(start, asked)
    else:
        guess = first_guess(kind, data)
        if start is not None:
            known = pointers(start)
            names = [name for name in guess.free if name in known]
            ties = {name: source for name, source in guess.ties.items() if {name, source} <= {*known}}
            guess = replace(guess, law=start, free=names, ties=ties, candidates=[], held={}, wider=[], starts=[])
    if asked is not None:
        guess = replace(guess, candidates=[*guess.candidates, *guess.starts], wider=[])
    guess = _with_ties(guess, asked, fixed, options.ties)
    names = check_names(guess.law, guess.free if asked is None else asked)
    check_names(guess.law, fixed)
    names = [name for name in names if name not in fixed]
    if not names:
        raise InputError("identify: no parameter is left to fit; give fewer in fixed, or more in free")
    wider = [name for name in guess.wider if name not in [*names, *fixed]]
    loose = {name: source for name, source in guess.ties.items() if source in [*names, *wider]}

    def held_in(law: Law) -> dict[str, float]:
        # what follows a number that is held is held with it
        return fixed | {name: fixed.get(of, value(law, of)) for name, of in guess.ties.items() if name not in loose}

    law, *candidates = _laws_with(guess, held_in, "the values that are held fixed do not make a law")
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
    starts = [with_values(one, held_in(one)) for one in guess.starts]
    bounds = {"stiffness": (0.0, stiffest(data.records))} if kind in BRISTLES else {}
    return Guess(law, names, loose, notes, candidates, bounds | guess.bounds, guessed, held_notes, wider, starts)


def _with_ties(
    guess: Guess, asked: list[str] | None, fixed: Mapping[str, float], ties: Mapping[str, str] | None
) -> Guess:
    """The guess with the ties asked for; a number that is asked for in `free`, or held by `fixed`, follows none."""
    if ties is None:
        own = {*(asked or []), *fixed} & {*guess.ties}
        kept = {name: source for name, source in guess.ties.items() if name not in own}
        notes = [note for note in guess.notes if not any(note.startswith(name) for name in own)]
        return replace(guess, ties=kept, notes=notes)
    check_names(guess.law, [*ties, *ties.values()])
    free = [*guess.free, *guess.ties] if asked is None else asked
    for name, source in ties.items():
        if name in (asked or []):
            raise InputError(
                f"identify: {name} is to be fitted and to follow {source}: leave it out of free or out of ties"
            )
        if name in fixed:
            raise InputError(
                f"identify: {name} is to be held and to follow {source}: leave it out of fixed or out of ties"
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


def within_bounds(guess: Guess, bounds: Mapping[str, tuple[float, float]]) -> Guess:
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

    def inside(law: Law) -> dict[str, float]:
        return {name: float(np.clip(value(law, name), *bounds[name])) for name in bounds}

    law, *candidates = _laws_with(guess, inside, "within these bounds there is no law to begin with")
    return replace(guess, law=law, candidates=candidates, bounds=guess.bounds | dict(bounds))


def _laws_with(guess: Guess, numbers: Callable[[Law], Mapping[str, float]], refusal: str) -> list[Law]:
    """The law and the candidates of a guess with other numbers, those that are laws; refused where none is."""
    laws: list[Law] = []
    for law in [guess.law, *guess.candidates]:
        try:
            laws.append(with_values(law, numbers(law)))
        except InputError as error:
            reason = error
    if not laws:
        raise InputError(f"identify: {refusal}: {reason}")
    return laws
