"""Newton's method as closed orbits need it: steps have a longest length, and one that goes too far is halved.

What is to vanish is said where it is called: `poincare_map.py` (`close`: a closed orbit), `state_cycles.py`, `continuation/`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np

from stickslip.errors import InputError
from stickslip.files.arrays import Array

Unknowns = TypeVar("Unknowns")
Here = TypeVar("Here")

#: So often a step that leads nowhere is halved.
_HALVINGS = 9
#: A step of no less than this part of the smallest before it is held up by rounding.
_HELD_UP = 0.25
#: Where so many rounds do not halve the smallest step nothing comes of more.
_PATIENCE = 7


class Lost(Exception):
    """No orbit of this kind is found near the guess."""


@dataclass(frozen=True)
class Round(Generic[Here]):
    """One round of Newton's method.

    Attributes
    ----------
    here : what was found at the unknowns; `step` what they lack.
    errors : the largest part of the step of each round, in sizes of the motion.
    """

    here: Here
    step: Array
    errors: tuple[float, ...]

    @property
    def error(self) -> float:
        """That of this round."""
        return self.errors[-1]

    def converged(self, exact: float, held_up: float) -> bool:
        """Whether the step is below `exact`, or below `held_up` and at least a quarter of the smallest before.

        >>> Round(None, np.zeros(1), (1e-3, 1e-6, 1e-11, 5e-12)).converged(1e-14, 1e-9)
        True
        """
        best = min(self.errors[:-1], default=math.inf)
        return self.error < exact or (self.error < held_up and self.error >= _HELD_UP * best)

    @property
    def idle(self) -> bool:
        """Whether the last rounds lead nowhere."""
        before = self.errors[:-_PATIENCE]
        return bool(before) and min(self.errors) > 0.5 * min(before)


def newton(
    at: Callable[[Unknowns], tuple[Here, Array, float]],
    moved: Callable[[Here, Array], Unknowns],
    unknowns: Unknowns,
    reach: float,
    most: int,
    progress: Callable[[], Any] = lambda: None,
) -> Iterator[Round[Here]]:
    """The rounds of Newton's method; the caller decides when to stop.

    Parameters
    ----------
    at : what there is at the unknowns, the step that it asks for, and the largest part of it in sizes of the motion.
    moved : the unknowns after a step.
    unknowns : the guess.
    reach : the largest step, in sizes of the motion; a longer one is no correction any more, and is shortened to it.
    most : rounds, halved steps among them; `progress` is called before each.

    Raises
    ------
    Lost, InputError
        by `at`, at the guess or where halved steps do not help.

    >>> root = newton(lambda x: (x, np.array([2 / x - x]) / 2, abs(2 / x - x)), lambda x, step: x + step[0], 1.0, 1.0, 9)
    >>> next(float(done.here) for done in root if done.converged(1e-15, 1e-9))
    1.414213562373095
    """
    last: tuple[Here, Array] | None = None
    halved = 0
    errors: tuple[float, ...] = ()
    for _ in range(most):
        progress()
        try:
            here, step, error = at(unknowns)
        except (Lost, InputError):
            # A step too far: half of it.
            if last is None or halved == _HALVINGS:
                raise
            halved += 1
            last = (last[0], last[1] / 2)
        else:
            errors += (error,)
            yield Round(here, step, errors)
            last, halved = (here, np.asarray(step * min(1.0, reach / max(error, 1e-300)), float)), 0
        unknowns = moved(*last)
