"""What a fit of a law is asked for beside records and law."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from stickslip.errors import InputError
from stickslip.identification.records import FrictionRecord
from stickslip.identification.requested_law import kind_of
from stickslip.laws import Law


@dataclass(frozen=True)
class Options:
    """What :func:`stickslip.identify` is asked for beside records and law; see there."""

    free: Sequence[str] | None = None
    fixed: Mapping[str, float] = field(default_factory=dict)
    pieces: int | Literal["auto"] | None = None
    offset: bool = False
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    ties: Mapping[str, str] | None = None

    def __post_init__(self) -> None:
        def refuse(name: str, expected: str, got: Any) -> None:
            raise InputError(f"identify: expected {name} as {expected}, got {got!r}")

        def is_number(given: Any) -> bool:
            return hasattr(given, "__float__") and not isinstance(given, bool)

        if isinstance(self.free, str) or any(not isinstance(name, str) for name in self.free or ()):
            refuse("free", "a list of names such as ['scale']", self.free)
        for name, given in (("fixed", self.fixed), ("bounds", self.bounds), ("ties", self.ties or {})):
            if not isinstance(given, Mapping):
                refuse(name, "a dictionary by the names of numbers", given)
        for name, number in self.fixed.items():
            if not is_number(number):
                refuse(f"fixed[{name!r}]", "a number", number)
        for name, pair in self.bounds.items():
            ends = list(pair) if isinstance(pair, Iterable) else []
            if len(ends) != 2 or not all(map(is_number, ends)):
                refuse(f"bounds[{name!r}]", "a pair (low, high) of numbers, which may be infinite", pair)

    def command(self, records: Sequence[FrictionRecord], law: str | type[Law] | Law) -> str:
        """What to type to do it again."""
        files = [
            f"FRICTION-{i}.nc" if record.name == f"record {i}" else record.name for i, record in enumerate(records, 1)
        ]
        parts = ["stickslip", "identify", *files, "--law", law if isinstance(law, str) else kind_of(law).__name__]
        if self.free is not None:
            parts += ["--free", *self.free]
        if self.fixed:
            parts += ["--fixed", *(f"{name}={value:g}" for name, value in self.fixed.items())]
        if self.pieces is not None:
            parts += ["--pieces", str(self.pieces)]
        if self.offset:
            parts.append("--offset")
        if self.bounds:
            parts += ["--bounds", *(f"{name}={low:g}:{high:g}" for name, (low, high) in self.bounds.items())]
        if self.ties is not None:
            parts += ["--ties", *(f"{name}={source}" for name, source in self.ties.items())]
        return shlex.join(parts)
