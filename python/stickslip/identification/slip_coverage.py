"""How often the 95 % intervals by slips hold the truth: each stick of a record has a break-away of its own.

``python -m stickslip.identification.slip_coverage -n 40 -o FOLDER`` does it for the laws of `CASES` and goes on where it was
stopped; it prints the table of ``docs/evidence/identification.md``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from stickslip.identification import coverage
from stickslip.identification.records import read_records
from stickslip.identification.result import Identification
from stickslip.identification.synthetic import friction_of_sticks
from stickslip.identification.trajectory.shooting import fit_trajectories
from stickslip.laws import BogaczRyczek, DwellTime, ExponentialStribeck, StaticFriction, StaticKinetic
from stickslip.model.system import Oscillator

FORCE_NOISE = 0.01
"""Of the friction force, from which only the branch fit is made."""


@dataclass(frozen=True)
class Scattered(coverage.Case):
    """A truth whose number of static friction differs from stick to stick.

    Attributes
    ----------
    scatter : standard deviation of that number, relative to it.
    """

    scatter: float = 0.15

    def frictions(self, seed: int) -> list[xr.DataTree]:
        """Records with other sticks and other noise for each seed."""
        times = np.arange(0.0, self.duration, self.step)
        found = []
        for number, s in enumerate(self.drive_velocities):
            system = Oscillator(self.damping, s, self.law)
            own = seed * len(self.drive_velocities) + number
            spread = float(np.std(friction_of_sticks(system, times, self.scatter, seed=own)["displacement"]))
            found.append(friction_of_sticks(system, times, self.scatter, FORCE_NOISE, own, self.noise * spread))
        return found

    def first(self, seed: int) -> Identification:
        """The fit of the branches to the records of one seed."""
        return self.fitted(self.frictions(seed))

    def again(self, first: Identification, seed: int) -> Identification:
        """The law identified from the records of another seed, the search begun at the first identification."""
        begun = replace(first, records=read_records(self.frictions(seed)))
        return fit_trajectories(begun, self.free, settled_after=0.0, shooting="slips", seed=seed)


CASES = {
    "StaticKinetic": Scattered(StaticKinetic(break_away=1.0, kinetic=0.6), (0.03, 0.06, 0.1), 0.1, duration=300.0),
    "DwellTime": Scattered(DwellTime(kinetic=0.5, limit=0.5, rate=0.3), (0.04, 0.1, 0.16), 0.05, duration=400.0),
    "ExponentialStribeck": Scattered(
        ExponentialStribeck(break_away=1.0, kinetic=0.6, scale=0.2, viscous=0.1),
        (0.03, 0.06, 0.1),
        0.05,
        duration=300.0,
    ),
    # Its first guess asks for a motion without sticks, so it is given one.
    "BogaczRyczek": Scattered(
        BogaczRyczek(static_friction=StaticFriction(1.084, limit=0.3, rate=0.3, force_rate_scale=0.5), alpha=0.0),
        (0.03, 0.06, 0.12),
        0.1,
        fixed=coverage.CASES["BogaczRyczek"].fixed,
        # Stick-slip alone does not tell the other numbers apart.
        free=("static_friction.initial", "static_friction.limit", "phi", "psi"),
        duration=300.0,
        guess=BogaczRyczek(
            static_friction=StaticFriction(1.1, limit=0.28, rate=0.3, force_rate_scale=0.5),
            alpha=0.0,
            phi=-57.0,
            psi=40.0,
        ),
    ),
}
"""The truths of the published table: three drive velocities each, 0.5 % noise, 15 % scatter from stick to stick."""

if __name__ == "__main__":
    coverage.main(cases=CASES)
