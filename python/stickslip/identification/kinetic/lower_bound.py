"""The least value of a number that records limit from below alone, such as the stiffness of bristles that look rigid."""

from __future__ import annotations

import math

import numpy as np

from stickslip.identification.estimator.least_squares import minimize
from stickslip.identification.kinetic.force_fit import ForceFit
from stickslip.identification.kinetic.force_residuals import Problem

GAIN = 1.92
"""Half of the gain in the sum of squares at an end of a 95 % interval of one number: half of 1.96²."""
STEPS = 15
"""The most evaluations of a fit of the other numbers."""
LOWEST = 1e-6
"""The bound is looked for down to that part of the greatest value."""
FINE = 0.1
"""It is found to that part of itself."""


def lower_bound(problem: Problem, found: ForceFit, name: str, greatest: float, wanted: bool = True) -> float | None:
    """The end of the 95 % interval of a number from below; None where the records limit it from above too.

    By the profile of the misfit: with the number held the others are fitted again. That is because a number which hardly acts
    any more has no error by its slope.

    Parameters
    ----------
    problem, found : of the fit in which the number is free, with the weights of its rows.
    name : of the number.
    greatest : the greatest value that the samples can tell from an infinite one.
    wanted : whether the end itself is of interest; if not, it is zero, which takes no search.
    """
    j = problem.free.index(name)
    best = problem.numbers(found.law)
    if found.offset is not None:
        best[-1] = float(found.offset["value"])
    low, high = (np.delete(ends, j) for ends in problem.parameters.bounds())
    others = np.delete(best, j)

    def misfit(number: float) -> float:
        def column(rest: np.ndarray) -> np.ndarray:
            return np.asarray(problem.column(np.insert(rest, j, number)) * found.weights)

        if not others.size:
            return 0.5 * float(np.sum(column(others) ** 2))
        return minimize(column, [others], (low, high), step=1e-6, evaluations=STEPS).cost

    at_best, at_greatest = misfit(float(best[j])), misfit(greatest)
    if at_greatest > at_best + GAIN:
        return None
    if not wanted:
        return 0.0
    enough = min(at_best, at_greatest) + GAIN
    inside = math.log(min(float(best[j]), greatest)) if at_best <= enough else math.log(greatest)
    outside = math.log(LOWEST * greatest)
    while inside - outside > FINE:
        middle = 0.5 * (inside + outside)
        if misfit(math.exp(middle)) > enough:
            outside = middle
        else:
            inside = middle
    return math.exp(outside)
