"""The numbers of a law by name: read one, set several, and the limits within which each makes sense."""

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


class Free:
    """The free numbers of a law as a vector that begins at 0, in units of a small but visible change of each.

    That is 2 % of the number, of a twentieth of the usual one if that is more, and 0.05 of the logarithm of a ratio.

    Parameters
    ----------
    law : holds the numbers that are not free.
    names : of the free numbers.
    ties : numbers that follow a free one.
    within : limits that are narrower than those the name gives.
    """

    def __init__(
        self,
        law: Law,
        names: Sequence[str],
        ties: Mapping[str, str] | None = None,
        within: Mapping[str, tuple[float, float]] | None = None,
    ) -> None:
        self.names = list(names)
        self._kind, self._document = type(law), json.dumps(law.to_dict())
        self._places = places(law)
        self.ratios = np.array([by_ratio(name) for name in self.names])
        self.ties = dict(ties or {})
        at = np.array([value(law, name) for name in self.names])
        if (at[self.ratios] <= 0).any():
            raise InputError(
                f"{type(law).__name__}: {self.names} hold a ratio that is not positive; give another guess"
            )
        size = np.maximum(np.abs(at), 0.05 * float(np.median(np.abs(at))) or 1.0)
        self.scale = np.where(self.ratios, 0.05, 0.02 * size)
        self.start = np.where(self.ratios, np.log(np.where(self.ratios, at, 1.0)), at)
        pairs = np.array([(within or {}).get(name, limits(name)) for name in self.names], float).reshape(-1, 2)
        pairs[self.ratios] = np.log(np.clip(pairs[self.ratios], 1e-300, 1e300))
        self.low, self.high = (pairs[:, 0] - self.start) / self.scale, (pairs[:, 1] - self.start) / self.scale

    def law(self, numbers: Array) -> Law:
        """The law with these free numbers; an InputError where they make no law."""
        plain = self.values(numbers)
        found = dict(zip(self.names, plain.tolist(), strict=True))
        tied = {name: found[source] for name, source in self.ties.items() if source in found}
        document = json.loads(self._document)
        for name, number in (found | tied).items():
            _put(document, self._places[name], number)
        return self._kind.from_dict(document, self._kind.__name__)

    def values(self, numbers: Array) -> Array:
        """The free numbers themselves."""
        raw = self.start + self.scale * numbers
        return np.where(self.ratios, np.exp(np.clip(raw, -700, 700)), raw)

    def units(self, numbers: Array) -> Array:
        """How fast each free number changes with its component of the vector."""
        return np.asarray(self.scale * np.where(self.ratios, self.values(numbers), 1.0))

    def table(self, numbers: Array, covariance: Array, reach: float | Array) -> tuple[pd.DataFrame, pd.DataFrame]:
        """Value, error and 95 % interval by name, and the covariance, from the covariance of the vector.

        `reach` is the half-width of the interval in standard errors; an interval is cut at the limits of its number.
        """
        values = self.values(numbers)
        errors = self.scale * np.sqrt(np.diag(covariance))
        half = reach * errors
        low, high = values - half, values + half
        ratio = np.exp(np.minimum(half, 700.0))
        low, high = np.where(self.ratios, values / ratio, low), np.where(self.ratios, values * ratio, high)
        ends = np.array([limits(name) for name in self.names]).reshape(-1, 2)
        units = self.units(numbers)
        table = pd.DataFrame(
            {
                "value": values,
                "error": np.sqrt(np.diag(covariance)) * units,
                "low": np.maximum(low, ends[:, 0]),
                "high": np.minimum(high, ends[:, 1]),
            },
            index=pd.Index(self.names, name="parameter"),
        )
        full = covariance * np.outer(units, units)
        return table, pd.DataFrame(full, index=self.names, columns=self.names)
