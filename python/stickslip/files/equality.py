"""Results are equal where their contents are, whatever arrays and tables they hold."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import fields, is_dataclass
from typing import Any, TypeVar

import numpy as np

T = TypeVar("T")


class ByContent:
    """A dataclass with ``eq=False`` whose values are equal where :func:`alike` says so."""

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and alike(self, other)

    __hash__ = None  # type: ignore[assignment]


def alike(one: Any, other: Any) -> bool:
    """Whether two values are the same in content: tables, arrays and NaN compare as a whole.

    >>> alike({"a": np.array([1.0, np.nan])}, {"a": np.array([1.0, np.nan])}), alike([1.0], [2.0])
    (True, False)
    """
    if one is other:
        return True
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return one.shape == other.shape and bool(((one == other) | ((one != one) & (other != other))).all())
    if hasattr(one, "equals"):  # tables of pandas, without loading pandas
        return bool(one.equals(other))
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(alike(one[key], other[key]) for key in one)
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(map(alike, one, other))
    if is_dataclass(one):
        return all(alike(getattr(one, item.name), getattr(other, item.name)) for item in fields(one) if item.compare)
    return bool(one == other) or (one != one and other != other)


def each_once(
    records: Iterable[T], alike: Callable[[T, T], bool], name: Callable[[T], str], add: Callable[[T, str], T]
) -> list[T]:
    """The records without those that hold the samples of another: counted twice they would make errors too small.

    Parameters
    ----------
    alike : whether two hold the same samples; name : of a record.
    add : a record with a note more; the first of those that are alike gets one.

    >>> each_once(["a", "b", "A"], lambda one, other: one == other.lower(), str, lambda one, note: f"{one} ({note})")
    ['a (A holds the same samples: they count once)', 'b']
    """
    kept: list[T] = []
    for record in records:
        for i, one in enumerate(kept):
            if alike(one, record):
                kept[i] = add(one, f"{name(record)} holds the same samples: they count once")
                break
        else:
            kept.append(record)
    return kept
