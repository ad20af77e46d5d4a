"""The error for input that cannot be used, checks that raise it, and what says that a result is not whole."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

#: The most numbers that one result may hold: 4 GiB.
MOST_NUMBERS = 2**29


class InputError(ValueError):
    """Input that cannot be used: one sentence with what was expected, what came and what to do."""


class UnfinishedWarning(RuntimeWarning):
    """Some runs of many ended at a limit of time that was set, and have no result."""


class Interrupted(KeyboardInterrupt):
    """Ctrl-C ended a search; `result` is what it had found by then, of the type that the search returns."""

    def __init__(self, result: Any) -> None:
        super().__init__()
        self.result = result


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return " (did you mean 'x'?)" where a known word is close to `word`, else nothing.

    >>> did_you_mean("stifness", ["mass", "stiffness"])
    " (did you mean 'stiffness'?)"
    """
    import difflib

    close = difflib.get_close_matches(word, list(known), n=1)
    return f" (did you mean {close[0]!r}?)" if close else ""


def number(name: str, value: object, where: str) -> float:
    """`value` as a float; anything but a finite number is refused."""
    if isinstance(value, bool) or not hasattr(value, "__float__"):
        raise InputError(f"{where}: {name} must be a number, got {value!r}")
    try:
        result = float(value)
    except (OverflowError, ValueError, TypeError):
        result = math.inf
    if not math.isfinite(result):
        raise InputError(f"{where}: {name} must be a finite number, got {result}")
    return result


def positive(name: str, value: object, where: str) -> float:
    """`value` as a float, if it is a finite number above 0."""
    result = number(name, value, where)
    if result <= 0:
        raise InputError(f"{where}: {name} must be greater than 0, got {result:g}")
    return result


def fraction(name: str, value: float, where: str) -> float:
    """`value`, if it lies in [0, 1)."""
    if not 0 <= value < 1:
        raise InputError(f"{where}: {name} must lie in [0, 1), got {value}")
    return value


def numbers(name: str, value: Any, count: int, where: str, one_a: str, *, finite: bool = True) -> list[float]:
    """`value` as `count` floats, a single number where one is enough; `one_a` says what each belongs to.

    Those that are not finite are refused, unless they may be.

    >>> numbers("x0", 0.5, 1, "simulate", "mass")
    [0.5]
    """
    import numpy as np

    try:
        values = np.asarray(value, float)
    except (TypeError, ValueError):
        raise InputError(f"{where}: {name} must be numbers, got {value!r}") from None
    if values.shape not in [(count,), *([()] if count == 1 else [])]:
        raise InputError(f"{where}: {name} must have the shape ({count},), one number a {one_a}, got {values.shape}")
    return [number(name, item, where) if finite else item for item in values.ravel().tolist()]


def whole_number(name: str, value: object, where: str, least: int = 1, most: int | None = None) -> int:
    """`value`, if it is a whole number of at least `least` and at most `most`, and the core can count to it.

    >>> whole_number("keep", 32, "simulate_many")
    32
    """
    end = 2**63 - 1 if most is None else most
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= end:
        limits = f"of at least {least}" if most is None else f"from {least} to {most}"
        raise InputError(f"{where}: {name} must be a whole number {limits}, got {value!r}")
    return value


def time_limit(value: float | None, where: str) -> float | None:
    """The seconds on the clock after which a run ends where it is, greater than 0; none for no limit."""
    return None if value is None else positive("max_seconds", value, where)


def fits(count: float, where: str, advice: str) -> None:
    """Refuse a result of so many numbers that it would fill the memory of the machine; `advice` says what to lower."""
    if count > MOST_NUMBERS:
        most, size = (numbers * 8 / 2**30 for numbers in (MOST_NUMBERS, count))
        raise InputError(f"{where}: expected a result of at most {most:g} GiB, got one of {size:.3g} GiB; {advice}")
