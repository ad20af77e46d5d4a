"""The numbers of a law by name: read one, set several, and the limits within which each makes sense."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import Any

from stickslip.documents import did_you_mean
from stickslip.errors import InputError
from stickslip.laws import Law

#: What the two numbers of a pair are called.
PAIRS = {
    "A": ("w", "f"),
    "B": ("w", "f"),
    "C": ("w", "f"),
    "D": ("w", "f"),
    "l": ("slope", "intercept"),
    "alpha": ("f_s", "drop"),
    "nodes": ("slip_velocity", "force"),
}

#: Limits by the last part of the name; what is not here is free.
LIMITS = {
    "kinetic": (0.0, math.inf),
    "break_away": (0.0, math.inf),
    "initial": (0.0, math.inf),
    "limit": (0.0, math.inf),
    "rate": (0.0, math.inf),
    "exponent": (0.05, 3.0),
    "force_rate_scale": (0.0, math.inf),
    "force_rate_exponent": (0.05, 10.0),
    "phi": (-89.99, 89.99),
    "psi": (-89.99, 89.99),
    "eta": (0.01, 89.99),
    "alpha": (0.0, math.inf),
    "beta": (0.0, math.inf),
    "B.w": (-math.inf, 0.0),
    "slip_velocity": (0.0, math.inf),
}

#: Positive numbers known by their ratio: their intervals are symmetric in the logarithm.
BY_RATIO = ("rate", "force_rate_scale")

Place = tuple[str | int, ...]


def places(law: Law) -> dict[str, Place]:
    """Where each number of a law stands in its document, by name.

    >>> from stickslip.laws import PiecewiseLinear
    >>> list(places(PiecewiseLinear(nodes=[(0, 1), (1, 0.5)], break_away=1)))[:3]
    ['nodes[0].slip_velocity', 'nodes[0].force', 'nodes[1].slip_velocity']
    """
    found: dict[str, Place] = {}
    for key, value in law.to_dict().items():
        if key == "type" or isinstance(value, str):
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
    here: Any = law.to_dict()
    for key in _place(law, name):
        here = None if isinstance(here, dict) and key not in here else here[key]
    if here is None:
        raise InputError(f"{type(law).__name__}: {name} is not set, so it has no value; give it one in fixed")
    return float(here)


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
        *way, last = _place(law, name)
        here: Any = document
        for key in way:
            here = here[key]
        here[last] = float(number)
    return type(law).from_dict(document, type(law).__name__)


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
