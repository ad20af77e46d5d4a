"""Static friction that grows with stick time."""

from __future__ import annotations

from dataclasses import dataclass

from stickslip.laws.law import Law


@dataclass(frozen=True)
class DwellTime(Law):
    """f_s(t_s) = f_k + Δ∞ (1 − exp(−γ t_s^m)) at rest, F = f_k sgn w in motion.

    Parameters
    ----------
    kinetic : kinetic force f_k ≥ 0.
    limit : growth of static friction after an infinite rest, Δ∞ ≥ 0.
    rate : γ > 0, in 1/time^m.
    exponent : m > 0; 0.36 to 0.67 in Kato's measurements.

    Source: Kato, Sato & Matsubayashi, Wear 20 (1972) 315.

    >>> DwellTime(kinetic=0.5, limit=0.5, rate=0.4).break_away_force(float(10**6))
    1.0
    """

    kinetic: float
    limit: float
    rate: float
    exponent: float = 1.0
