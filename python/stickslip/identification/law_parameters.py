"""The numbers of a law as parameters: by name, their limits, and those that are fitted as a search vector."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from stickslip.errors import InputError
from stickslip.files.documents import did_you_mean
from stickslip.identification.estimator.parameters import Parameter, Parameters
from stickslip.laws import Law
from stickslip.laws.facts import Number

Array = npt.NDArray[np.float64]

Pointer = tuple[str | int, ...]


def pointers(law: Law) -> dict[str, Pointer]:
    """Where each number of a law stands in its document, by name.

    >>> from stickslip.laws import PiecewiseLinear
    >>> list(pointers(PiecewiseLinear(nodes=[(0, 1), (1, 0.5)], break_away=1)))[:3]
    ['nodes[0].slip_velocity', 'nodes[0].force', 'nodes[1].slip_velocity']
    """
    return {name: pointer for name, (pointer, _) in _numbers(law).items()}


def numbers(law: Law) -> dict[str, Number]:
    """What is known of each number of a law, by name.

    >>> from stickslip.laws import BogaczRyczek
    >>> numbers(BogaczRyczek())["static_friction.initial"].low
    0.0
    """
    return {name: number for name, (_, number) in _numbers(law).items()}


def _numbers(law: Law) -> dict[str, tuple[Pointer, Number]]:
    found: dict[str, tuple[Pointer, Number]] = {}
    for key, value in law.to_dict().items():
        if key == "type" or isinstance(value, str) or law.PARAMETERS[key].choices:
            continue
        pair = law.PARAMETERS[key].numbers
        if isinstance(part := getattr(law, key), Law):
            found |= {f"{key}.{name}": ((key, *pointer), item) for name, (pointer, item) in _numbers(part).items()}
        elif isinstance(value, dict):
            # What a table inside the law leaves out, such as the scale of the force rate, has a name all the same.
            inner = part.PARAMETERS.items()
            found |= {f"{key}.{name}": ((key, name), item.numbers[-1]) for name, item in inner if item.numbers}
        elif not isinstance(value, list):
            found[key] = (key,), pair[-1]
        elif isinstance(value[0], list):
            found |= {
                f"{key}[{i}].{number.part}": ((key, i, j), number)
                for i in range(len(value))
                for j, number in enumerate(pair)
            }
        else:
            found |= {f"{key}.{number.part}": ((key, j), number) for j, number in enumerate(pair)}
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
    for key in _pointer(law, name):
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
        _put(document, _pointer(law, name), float(number))
    return type(law).from_dict(document, type(law).__name__)


def _put(document: Any, pointer: Pointer, number: float) -> None:
    *way, last = pointer
    for key in way:
        document = document[key]
    document[last] = number


def check_names(law: Law, names: Iterable[str]) -> list[str]:
    """The names, each once and each a number of the law."""
    checked = list(dict.fromkeys(names))
    for name in checked:
        _pointer(law, name)
    return checked


def _pointer(law: Law, name: str) -> Pointer:
    known = pointers(law)
    if name not in known:
        raise InputError(
            f"{type(law).__name__} has no parameter {name!r}{did_you_mean(name, known)}; it has {', '.join(known)}"
        )
    return known[name]


def parameters_of_law(
    law: Law,
    names: Sequence[str],
    within: Mapping[str, tuple[float, float]] | None = None,
    same_as: Mapping[str, str] | None = None,
) -> Parameters:
    """Free numbers of a law, and those that take the value of a free one (`same_as`), each with its limits.

    A name that the law does not have is that of a number without limits.
    """
    known, own = numbers(law), within or {}
    free = []
    for name in names:
        number = known.get(name, Number())
        # Nodes may fall below zero on the way: a record whose friction drives is refused, not fitted by a law that does not.
        low = -math.inf if number.part == "f" or name.endswith("].force") else number.low
        free.append(Parameter(name, low, number.high, number.ratio, within=own.get(name)))
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
    within : limits that are narrower than those of the number.
    """

    def __init__(
        self,
        law: Law,
        names: Sequence[str],
        same_as: Mapping[str, str] | None = None,
        within: Mapping[str, tuple[float, float]] | None = None,
    ) -> None:
        self.names, self.same_as = list(names), dict(same_as or {})
        self._kind, self._document, self._pointers = type(law), json.dumps(law.to_dict()), pointers(law)
        self._parameters = parameters_of_law(law, names, within, same_as)
        at = {name: value(law, name) for name in self.names}
        if any(at[name] <= 0 for name, ratio in zip(names, self._parameters.logarithmic, strict=True) if ratio):
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
            _put(document, self._pointers[name], number)
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
