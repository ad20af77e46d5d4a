"""Parameters of a model: names, limits, and the vector in which they are searched."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stickslip.files.arrays import Array

LARGEST_LOGARITHM = 50.0
"""Largest size of a logarithm that is searched."""


@dataclass(frozen=True)
class Parameter:
    """One number of a model.

    Attributes
    ----------
    name : by which results give it.
    low, high : limits of its value; an interval ends there.
    bounds : narrower limits of the search, None for those of the value.
    logarithmic : whether it is positive and known by its ratio: it is searched, and its interval is symmetric, in its
        logarithm.
    unit : of its value, "" where it is dimensionless or the caller's own.
    fixed : its value where it is not fitted.
    tied_to : name of the parameter whose value it takes (tied), None for one of its own.
    """

    name: str
    low: float = -math.inf
    high: float = math.inf
    logarithmic: bool = False
    unit: str = ""
    bounds: tuple[float, float] | None = None
    fixed: float | None = None
    tied_to: str | None = None

    @property
    def free(self) -> bool:
        """Whether it is a component of the search vector."""
        return self.fixed is None and self.tied_to is None


class Parameters:
    """Parameters in order; the search vector holds the free ones, the logarithmic by their logarithm.

    >>> rate, limit = Parameter("rate", 0.0, logarithmic=True, unit="1/s"), Parameter("limit", 0.0, unit="N")
    >>> both = Parameters([rate, limit])
    >>> both.vector({"rate": 1.0, "limit": 2.0}).tolist()
    [0.0, 2.0]
    """

    def __init__(self, parameters: Sequence[Parameter]) -> None:
        self.all = list(parameters)
        self.free = [parameter for parameter in self.all if parameter.free]
        self.names = [parameter.name for parameter in self.free]
        self.logarithmic = np.array([parameter.logarithmic for parameter in self.free], dtype=bool)

    def vector(self, values: Mapping[str, float]) -> Array:
        """The search vector of these values by name."""
        plain = np.array([values[name] for name in self.names], dtype=float)
        return np.where(self.logarithmic, np.log(np.where(self.logarithmic, plain, 1.0)), plain)

    def plain(self, vector: Array) -> Array:
        """Values of the free parameters."""
        if not self.logarithmic.any():
            return vector
        return np.where(self.logarithmic, np.exp(np.clip(np.where(self.logarithmic, vector, 0.0), -700, 700)), vector)

    def values(self, vector: Array) -> dict[str, float]:
        """Values by name, of the fixed and the tied parameters too."""
        found = dict(zip(self.names, self.plain(vector).tolist(), strict=True))
        found |= {parameter.name: parameter.fixed for parameter in self.all if parameter.fixed is not None}
        tied = {parameter.name: parameter.tied_to for parameter in self.all if parameter.tied_to is not None}
        return found | {name: found[source] for name, source in tied.items() if source in found}

    def units(self, vector: Array) -> Array:
        """∂value/∂vector of each free parameter."""
        return np.where(self.logarithmic, self.plain(vector), 1.0)

    def bounds(self) -> tuple[Array, Array]:
        """Limits of the search vector, each of shape (free parameters,)."""
        pairs = np.array([item.bounds or (item.low, item.high) for item in self.free], dtype=float).reshape(-1, 2)
        pairs[self.logarithmic] = np.log(
            np.clip(pairs[self.logarithmic], math.exp(-LARGEST_LOGARITHM), math.exp(LARGEST_LOGARITHM))
        )
        return pairs[:, 0], pairs[:, 1]
