"""The numbers of a law as parameters: by name, their limits, and those that are fitted as a search vector."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from stickslip.errors import InputError
from stickslip.files.documents import did_you_mean
from stickslip.identification.estimator.parameters import Parameter, Parameters
from stickslip.laws import Law

Array = npt.NDArray[np.float64]

#: What the two numbers of a pair are called.
PAIRS = {
    "A": ("w", "f"),
    "B": ("w", "f"),
    "C": ("w", "f"),
    "D": ("w", "f"),
    "l": ("slope", "intercept"),
    "alpha": ("f_s", "drop"),
    "nodes": ("slip_velocity", "force"),
    "rising": ("slip_velocity", "force"),
    "falling": ("slip_velocity", "force"),
    "kinetic": ("slip_velocity", "force"),
    "break_away": ("stick_time", "force"),
}

#: Limits by the last part of the name; what is not here is free.
LIMITS = {
    "kinetic": (0.0, math.inf),
    "break_away": (0.0, math.inf),
    "initial": (0.0, math.inf),
    "limit": (0.0, math.inf),
    "rate": (0.0, math.inf),
    "exponent": (0.05, 3.0),
    "scale": (0.0, math.inf),
    "weakening": (0.0, math.inf),
    "stiffness": (0.0, math.inf),
    "width": (0.0, math.inf),
    "length": (0.0, math.inf),
    "force_rate_scale": (0.0, math.inf),
    "force_rate_exponent": (0.05, 10.0),
    "drop": (0.0, math.inf),
    "drop_scale": (0.0, math.inf),
    "drop_exponent": (0.05, 100.0),
    "phi": (-89.99, 89.99),
    "psi": (-89.99, 89.99),
    "eta": (0.01, 89.99),
    "alpha": (0.0, math.inf),
    "beta": (0.0, math.inf),
    "growth": (0.0, math.inf),
    "onset": (0.0, math.inf),
    "a": (0.0, math.inf),
    "b": (0.0, math.inf),
    "reference_friction": (0.0, math.inf),
    "stick_time": (0.0, math.inf),
    "B.w": (-math.inf, 0.0),
    "slip_velocity": (0.0, math.inf),
}

#: Positive numbers known by their ratio: their intervals are symmetric in the logarithm.
BY_RATIO = ("rate", "onset", "force_rate_scale", "drop_scale", "drop_exponent")

Place = tuple[str | int, ...]


def places(law: Law) -> dict[str, Place]:
    """Where each number of a law stands in its document, by name.

    >>> from stickslip.laws import PiecewiseLinear
    >>> list(places(PiecewiseLinear(nodes=[(0, 1), (1, 0.5)], break_away=1)))[:3]
    ['nodes[0].slip_velocity', 'nodes[0].force', 'nodes[1].slip_velocity']
    """
    found: dict[str, Place] = {}
    for key, value in law.to_dict().items():
        if key == "type" or key in law.CHOICES or isinstance(value, str):
            continue
        if isinstance(value, dict):
            # What a table inside the law leaves out, such as the scale of the force rate, has a name all the same.
            found |= {f"{key}.{item.name}": (key, item.name) for item in fields(getattr(law, key))}
        elif isinstance(value, list):
            names = PAIRS[key]
            if isinstance(value[0], list):
                found |= {f"{key}[{i}].{names[j]}": (key, i, j) for i in range(len(value)) for j in range(len(names))}
            else:
                found |= {f"{key}.{names[j]}": (key, j) for j in range(len(names))}
        else:
            found[key] = (key,)
    return found


def value(law: Law, name: str) -> float:
    """One number of a law.

    Raises
    ------
    InputError
        for a name the law does not have, or a number that is not set.

    >>> from stickslip.laws import BogaczRyczek
    >>> value(BogaczRyczek(), "B.f")
    1.33
    """
    found = maybe(law, name)
    if found is None:
        raise InputError(f"{type(law).__name__}: {name} is not set, so it has no value; give it one in fixed")
    return found


def maybe(law: Law, name: str) -> float | None:
    """One number of a law, None where it is not set."""
    here: Any = law.to_dict()
    for key in _place(law, name):
        here = None if isinstance(here, dict) and key not in here else here[key]
    return None if here is None or isinstance(here, str) else float(here)


def with_values(law: Law, values: Mapping[str, float]) -> Law:
    """The law with some of its numbers changed.

    Raises
    ------
    InputError
        for a name the law does not have, or values that do not make a law.

    >>> from stickslip.laws import StaticKinetic
    >>> with_values(StaticKinetic(break_away=1.0, kinetic=0.6), {"kinetic": 0.5})
    StaticKinetic(break_away=1.0, kinetic=0.5)
    """
    document = law.to_dict()
    for name, number in values.items():
        _put(document, _place(law, name), float(number))
    return type(law).from_dict(document, type(law).__name__)


def _put(document: Any, place: Place, number: float) -> None:
    *way, last = place
    for key in way:
        document = document[key]
    document[last] = number


def limits(name: str) -> tuple[float, float]:
    """Within which limits a number makes sense, by its name.

    >>> limits("static_friction.initial")
    (0.0, inf)
    """
    if name in LIMITS:
        return LIMITS[name]
    return LIMITS.get(name.rpartition(".")[2], (-math.inf, math.inf))


def by_ratio(name: str) -> bool:
    """Whether a number is positive and known by its ratio."""
    return name.rpartition(".")[2] in BY_RATIO


def check_names(law: Law, names: Iterable[str]) -> list[str]:
    """The names, each once and each a number of the law."""
    checked = list(dict.fromkeys(names))
    for name in checked:
        _place(law, name)
    return checked


def _place(law: Law, name: str) -> Place:
    known = places(law)
    if name not in known:
        raise InputError(
            f"{type(law).__name__} has no parameter {name!r}{did_you_mean(name, known)}; it has {', '.join(known)}"
        )
    return known[name]


def parameters_of_law(
    names: Sequence[str],
    within: Mapping[str, tuple[float, float]] | None = None,
    same_as: Mapping[str, str] | None = None,
) -> Parameters:
    """Free numbers of a law, and those that take the value of a free one (`same_as`), with limits by their names."""
    own = within or {}
    free = [Parameter(name, *limits(name), logarithmic=by_ratio(name), within=own.get(name)) for name in names]
    tied = [Parameter(name, same_as=source) for name, source in (same_as or {}).items()]
    return Parameters([*free, *tied])


class LawParameters:
    """The free numbers of a law as a vector that begins at 0, in units of a small but visible change of each.

    That is 2 % of the number, of a twentieth of the usual one if that is more, and 0.05 of the logarithm of a ratio.

    Parameters
    ----------
    law : holds the numbers that are not free.
    names : of the free numbers.
    same_as : numbers that take the value of a free one.
    within : limits that are narrower than those the name gives.
    """

    def __init__(
        self,
        law: Law,
        names: Sequence[str],
        same_as: Mapping[str, str] | None = None,
        within: Mapping[str, tuple[float, float]] | None = None,
    ) -> None:
        self.names, self.same_as = list(names), dict(same_as or {})
        self._kind, self._document, self._places = type(law), json.dumps(law.to_dict()), places(law)
        self._parameters = parameters_of_law(names, within, same_as)
        at = {name: value(law, name) for name in self.names}
        if any(at[name] <= 0 for name in self.names if by_ratio(name)):
            raise InputError(
                f"{type(law).__name__}: {self.names} hold a ratio that is not positive; give another guess"
            )
        size = np.abs(np.array(list(at.values())))
        size = np.maximum(size, 0.05 * float(np.median(size)) or 1.0)
        self._unit = np.where(self._parameters.logarithmic, 0.05, 0.02 * size)
        self._start = self._parameters.vector(at)
        low, high = self._parameters.bounds()
        self.low, self.high = (low - self._start) / self._unit, (high - self._start) / self._unit

    def law(self, numbers: Array) -> Law:
        """The law with these free numbers; an InputError where they make no law."""
        document = json.loads(self._document)
        for name, number in self._parameters.values(self._raw(numbers)).items():
            _put(document, self._places[name], number)
        return self._kind.from_dict(document, self._kind.__name__)

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
        return self._parameters.estimate(self._raw(numbers), covariance * unit, freedom)
