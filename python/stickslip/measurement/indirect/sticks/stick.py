"""One stick of a record, with the errors of its limits."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from stickslip.files.arrays import Array


@dataclass(frozen=True)
class Stick:
    """One stick; `starts` and `ends` tell whether its limits lie inside the record.

    Its end is `sure` where enough of the slip after it is seen.
    """

    start: float
    end: float
    start_error: float
    end_error: float
    starts: bool = True
    ends: bool = True
    sure: bool = True

    @property
    def middle_half(self) -> tuple[float, float]:
        """Middle half of what is surely the stick: its end may be guessed too late."""
        quarter = max(self.end - self.end_error - self.start, 0.0) / 4
        return self.start + quarter, self.start + 3 * quarter


def ends_of(sticks: Iterable[Stick]) -> Array:
    """When the sticks end that do so inside the record."""
    return np.array([stick.end for stick in sticks if stick.ends], float)
