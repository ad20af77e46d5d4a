"""What is computed: five oscillators, each as our system and as the numbers of `automaton`."""

from __future__ import annotations

import math
from dataclasses import dataclass

import automaton as a
import numpy as np

import stickslip as ss

# The calibration without a fall of f_s(0, δ): `automaton` says no more.
PAPER = ss.paper.calibration.CALIBRATIONS["one f_s(0)"]


@dataclass(frozen=True)
class Problem:
    """One oscillator, and how long it is followed where errors are compared."""

    name: str
    system: ss.Oscillator
    horizon: float = 1000.0

    @property
    def parameters(self) -> np.ndarray:
        """The numbers of `automaton`."""
        osc, law = self.system, self.system.law
        forcing = osc.forcing or ss.Harmonic(0.0, 1.0)
        head = [osc.damping, osc.drive_velocity, forcing.amplitude, forcing.frequency]
        if isinstance(law, ss.laws.StaticKinetic):
            tail = [a.STATIC_KINETIC, law.break_away, law.kinetic]
        elif isinstance(law, ss.laws.Rational):
            tail = [a.RATIONAL, law.break_away, law.weakening]
        else:
            law = law.to_dict()
            static = law["static_friction"]
            slopes = [math.tan(math.radians(law[angle])) for angle in ("phi", "psi", "eta")]
            surface = [static[name] for name in ("initial", "limit", "rate", "force_rate_scale")]
            tail = [a.TWO_BRANCHES, *surface, *slopes, *law["B"], *law["D"], *law["l"], law["beta"]]
        return np.array(head + tail, dtype=float)


PROBLEMS = (
    Problem(
        "S3b: static and kinetic", ss.Oscillator(damping=0.1, drive_velocity=0.2, law=ss.laws.StaticKinetic(1.0, 0.6))
    ),
    Problem("S5: falling 1/(1 + 3w)", ss.Oscillator(damping=0.0, drive_velocity=0.2, law=ss.laws.Rational(1.0, 3.0))),
    Problem("paper, s = 0.2", PAPER.oscillator(0.2)),
    Problem("paper, s = 0.3", PAPER.oscillator(0.3)),
    Problem(
        "forced: static and kinetic + 0.5 cos 0.7t",
        ss.Oscillator(
            damping=0.05, drive_velocity=0.3, law=ss.laws.StaticKinetic(1.0, 0.5), forcing=ss.Harmonic(0.5, 0.7)
        ),
    ),
)
