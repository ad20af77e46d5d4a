"""Forms that one law may have, by numbers that choose and are never fitted, and which of them is the likeliest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stickslip.identification.guesses.guess_data import Guess
from stickslip.identification.kinetic.force_fit import ForceFit, fit_forces
from stickslip.identification.kinetic.force_residuals import Problem
from stickslip.laws import Law
from stickslip.laws.numbers import value, with_values

DECISIVE = 10.0
"""Difference of two logarithms of likelihoods, of rows that may be correlated, that decides between forms of a law."""
FREE_LEVEL, FALL = "static.kinetic", ("kinetic.break_away", "kinetic.kinetic", "kinetic.scale")
"""Names in a `Combined` law of the level from which static friction grows, and of a fall of kinetic friction."""
WIDE = 0.25
"""Width of the fall that is tried beside the guessed one, over the fastest slip."""


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


def forms_of_law(guess: Guess) -> list[Guess]:
    """A guess for each form of the law among the first guesses, as numbers that choose a form are never fitted."""
    laws = [guess.law, *guess.candidates]
    forms = [[law for law in laws if _choices(law) == choices] for choices in map(_choices, laws)]
    return [replace(guess, law=form[0], candidates=form[1:]) for i, form in enumerate(forms) if form not in forms[:i]]


def wider_forms(guess: Guess) -> list[Guess]:
    """Guesses with more numbers free, one for each law that the fit of them begins with."""
    free = [*guess.free, *guess.wider]
    return [replace(guess, law=law, free=free, candidates=[]) for law in guess.starts] if guess.wider else []


def likeliest_fit(problem: Problem) -> ForceFit:
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
    return min(found, wide, key=negative_log_likelihood)


def negative_log_likelihood(found: ForceFit) -> float:
    """Minus the logarithm of the likelihood by what was fitted; the force residual would judge what smoothing rounds."""
    scale = np.maximum(found.groups["scale"].to_numpy(float), 1e-300)
    return float(np.sum(found.groups["rows"].to_numpy(float) * np.log(scale)))


def notes_on_form(law: Law, guess: Guess, costs: list[float]) -> list[str]:
    """Which form of a law that has several was taken, and whether the records tell, by the `costs` of all, least first."""
    if len(forms_of_law(guess)) < 2:
        return []
    said = ", ".join(f"{name} = {number:g}" for name, number in _choices(law).items())
    form = f"the form of {type(law).__name__} with {said}"
    if len(costs) < 2:
        return [f"Of several forms {form} was taken; the others cannot be fitted to these records."]
    if costs[1] - costs[0] < DECISIVE:
        return [f"Of several forms {form} was taken, but these records hardly determine which it is."]
    return [f"Of several forms {form} lies closest to the records; it was taken."]
