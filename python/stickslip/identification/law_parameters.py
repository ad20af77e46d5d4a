"""The numbers of a law as parameters: by name, their limits, and those that are fitted as a search vector."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.identification.estimator.parameters import Parameter, Parameters
from stickslip.identification.estimator.uncertainty import estimate
from stickslip.laws import Law
from stickslip.laws.declarations import Number
from stickslip.laws.numbers import Replacement, numbers, value

FARTHEST_FROM_START = 5000.0
"""In its units no number goes farther from its start: a hundred times its size. One that no motion tells would run away."""


def parameters_of_law(
    law: Law,
    names: Sequence[str],
    bounds: Mapping[str, tuple[float, float]] | None = None,
    ties: Mapping[str, str] | None = None,
) -> Parameters:
    """Free numbers of a law, and those that take the value of a free one (`ties`), each with its limits.

    A name that the law does not have is that of a number without limits.
    """
    known, own = numbers(law), bounds or {}
    free = []
    for name in names:
        number = known.get(name, Number())
        # Nodes may fall below zero on the way: a record whose friction drives is refused, not fitted by a law that does not.
        low = -math.inf if number.part == "f" or name.endswith("].force") else number.low
        free.append(Parameter(name, low, number.high, number.ratio, bounds=own.get(name)))
    tied = [Parameter(name, tied_to=source) for name, source in (ties or {}).items()]
    return Parameters([*free, *tied])


class LawParameters:
    """The free numbers of a law as a vector that begins at 0, in units of a small but visible change of each.

    That is 2 % of the number, of a twentieth of the usual one if that is more, and 0.05 of the logarithm of a ratio.

    Parameters
    ----------
    law : holds the numbers that are not free.
    names : of the free numbers.
    ties : numbers that take the value of a free one.
    bounds : limits that are narrower than those of the number.
    """

    def __init__(
        self,
        law: Law,
        names: Sequence[str],
        ties: Mapping[str, str] | None = None,
        bounds: Mapping[str, tuple[float, float]] | None = None,
    ) -> None:
        self.names, self.ties, self.bounds = list(names), dict(ties or {}), dict(bounds or {})
        self._parameters = parameters_of_law(law, names, bounds, ties)
        at = {name: value(law, name) for name in self.names}
        if any(at[name] <= 0 for name, ratio in zip(names, self._parameters.logarithmic, strict=True) if ratio):
            raise InputError(
                f"{type(law).__name__}: {self.names} hold a ratio that is not positive; give another guess"
            )
        size = np.abs(np.array(list(at.values())))
        size = np.maximum(size, 0.05 * float(np.median(size)) or 1.0)
        self._unit = np.where(self._parameters.logarithmic, 0.05, 0.02 * size)
        self._start = self._parameters.vector(at)
        self._replacement = Replacement(law, self._parameters.values(self._start))
        low, high = self._parameters.bounds()
        self.low = np.maximum((low - self._start) / self._unit, -FARTHEST_FROM_START)
        self.high = np.minimum((high - self._start) / self._unit, FARTHEST_FROM_START)

    def law(self, numbers: Array) -> Law:
        """The law with these free numbers; an InputError where they make no law."""
        return self._replacement(self._parameters.values(self._raw(numbers)).values())

    def _raw(self, numbers: Array) -> Array:
        return np.asarray(self._start + self._unit * numbers)

    def values(self, numbers: Array) -> Array:
        """The free numbers themselves."""
        return self._parameters.plain(self._raw(numbers))

    def units(self, numbers: Array) -> Array:
        """How fast each free number changes with its component of the vector."""
        return np.asarray(self._unit * self._parameters.units(self._raw(numbers)))

    def estimate(self, numbers: Array, covariance: Array, freedom: float) -> tuple[pd.DataFrame, pd.DataFrame]:
        """Value, error and 95 % interval by name, and the covariance, from the covariance of the vector."""
        unit = np.outer(self._unit, self._unit)
        return estimate(self._parameters, self._raw(numbers), covariance * unit, freedom)
