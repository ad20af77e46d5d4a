"""What the core declares of every law, read: parameters with their dimensions (units), limits, and an example.

They are declared in the core, in `crates/stickslip/src/law/`, in the file of each law.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from stickslip import _core
from stickslip.files.units import TEXTS


@dataclass(frozen=True)
class Number:
    """One number of a parameter.

    Attributes
    ----------
    part : its name within a pair, such as ``w`` of a point; "" where it is the parameter itself.
    dimension : as in :meth:`stickslip.Scale.unit`, such as ``force velocity^-1``; "" for a pure number.
    low, high : between which values it is searched when it is fitted.
    ratio : whether it is positive and known by its ratio: its interval is symmetric in the logarithm.
    choices : the only values it may have where it chooses a form of the law; it is then never fitted.
    """

    part: str = ""
    dimension: str = ""
    low: float = -math.inf
    high: float = math.inf
    ratio: bool = False
    choices: tuple[float, ...] = ()


@dataclass(frozen=True)
class Parameter:
    """A parameter: one number, the two of a pair (of points and nodes; a single value is the second), words, or a table."""

    numbers: tuple[Number, ...] = ()
    words: tuple[str, ...] = ()
    table: Mapping[str, Parameter] | None = None

    @property
    def dimension(self) -> str:
        """The dimensions of its numbers, with a comma between two; ``law`` for a table or a law within the law."""
        return "law" if self.table is not None else ", ".join(number.dimension for number in self.numbers)

    @property
    def texts(self) -> tuple[tuple[str, ...], ...]:
        """For each of its numbers the dimensions of which it may be a text with a unit, such as "6 N"."""
        return tuple(TEXTS.get(number.dimension, ()) for number in self.numbers)

    @property
    def choices(self) -> tuple[float, ...]:
        """The only values its number may have, where it chooses a form of the law and is never fitted."""
        return self.numbers[-1].choices if self.numbers else ()


@dataclass(frozen=True)
class Facts:
    """What is known of a law: parameters by name, the document of its example, what a document may leave out, smoothness."""

    parameters: Mapping[str, Parameter]
    example: Mapping[str, Any]
    defaults: Mapping[str, Any]
    smooth: bool


def _number(table: Mapping[str, Any]) -> Number:
    low, high = table["search"]
    low, high = -math.inf if low is None else low, math.inf if high is None else high
    return Number(table["part"], table["dimension"], low, high, table["ratio"], tuple(table["choices"]))


def _parameters(items: Sequence[Mapping[str, Any]]) -> dict[str, Parameter]:
    found: dict[str, Parameter] = {}
    for item in items:
        # What a parameter is made of is a word, or a table whose one key says how to read its content.
        kind, content = next(iter(item["kind"].items())) if isinstance(item["kind"], dict) else (item["kind"], ())
        if kind == "Beside":
            found |= _parameters(content)
        elif kind == "Words":
            found[item["name"]] = Parameter(words=tuple(content))
        elif kind in ("Table", "Law"):
            found[item["name"]] = Parameter(table=_parameters(content))
        else:
            found[item["name"]] = Parameter(tuple(_number(number) for number in item["numbers"]))
    return found


#: By the name of the law.
FACTS = {
    item["name"]: Facts(_parameters(item["parameters"]), item["example"], item["defaults"], item["smooth"])
    for item in json.loads(_core.law_facts())
}
