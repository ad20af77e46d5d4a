"""The types of arrays: of numbers, of truth values, of indices, of anything; and some of the rows of several."""

from dataclasses import fields, replace
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.int_]
AnyArray = npt.NDArray[Any]
T = TypeVar("T")


def taken(item: T, which: Any) -> T:
    """A dataclass with some of the rows of its arrays; what is no array stays."""
    columns = {field.name: getattr(item, field.name) for field in fields(item)}  # type: ignore[arg-type]
    rows = {name: column[which] for name, column in columns.items() if isinstance(column, np.ndarray)}
    return replace(item, **rows)  # type: ignore[type-var]
