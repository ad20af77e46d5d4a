"""What every closed orbit has, whatever the law: its period, its multipliers, and what they say."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stickslip.files.equality import ByContent
from stickslip.files.notebook import InNotebook
from stickslip.model.system import Oscillator, System
from stickslip.simulation.orbit import Orbit

#: Said where a run ends without a motion that repeats.
STEADY = "periodic_orbit: the motion comes to rest or slips steadily: no cycle here; give another guess"
#: Said where no return of a run comes near an earlier one.
NO_RETURN = (
    "periodic_orbit: no return comes near an earlier one: the motion is not periodic or not settled; simulate longer (t_end) "
    "or give a guess"
)
#: How far from 1 the size of a multiplier lies at most that rounding alone keeps from it.
_MARGINAL = 1e-9


@dataclass(frozen=True, eq=False)
class Cycle(ByContent, InNotebook):
    """What every closed orbit has, of whatever law: its period and its multipliers, and what they say."""

    system: Oscillator | System
    period: float
    forcing_periods: int
    multipliers: NDArray[np.complex128]
    residual: float
    rounds: int
    section: str
    events: tuple[str, ...]

    @property
    def orbit(self) -> Orbit:
        """One period."""
        raise NotImplementedError

    @property
    def sticks(self) -> bool:
        """Whether adhesion is a part of it."""
        raise NotImplementedError

    @property
    def nontrivial(self) -> NDArray[np.complex128]:
        """The multipliers but the 1 of an autonomous orbit."""
        return self.multipliers[0 if self.forcing_periods else 1 :]

    @property
    def largest(self) -> float:
        """The size of the largest multiplier that is not the 1 of an autonomous orbit."""
        return float(np.abs(self.nontrivial).max())

    @property
    def marginal(self) -> bool:
        """Whether small disturbances neither grow nor decay, as around a centre."""
        return abs(self.largest - 1) < _MARGINAL

    @property
    def stable(self) -> bool | None:
        """Whether small disturbances decay; None where they neither decay nor grow."""
        return None if self.marginal else self.largest < 1

    @property
    def _kind(self) -> str:
        return {True: "stable", False: "unstable", None: "marginal"}[self.stable]

    def __repr__(self) -> str:
        return f"<{type(self).__name__} T = {self.period:.12g}, largest multiplier {self.largest:.6g}, {self._kind}>"

    def facts(self) -> dict[str, Any]:
        """What a notebook shows."""
        sizes = [float(size) for size in np.abs(self.multipliers)]
        return {"period": self.period, "stability": self._kind, "sizes of multipliers": sizes, "events": self.events}
