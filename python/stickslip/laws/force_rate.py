"""Static friction that depends on the force rate, above a constant kinetic friction; the paper's law is `bogacz_ryczek`."""

from __future__ import annotations

from dataclasses import dataclass

from stickslip.laws.law import Law


@dataclass(frozen=True)
class ForceRate(Law):
    """f_s(t_s, δ) = f_k + Δ∞ (1 − exp(−γ t_s^m)) / (1 + (δ/δ₀)^q) at rest, F = f_k sgn w in motion.

    Parameters
    ----------
    kinetic : kinetic force f_k ≥ 0.
    limit : Δ∞ ≥ 0, growth of static friction after an infinite rest at a vanishing force rate.
    rate : γ > 0, in 1/time^m.
    force_rate_scale : δ₀ > 0, the force rate that halves the growth, in force/time.
    exponent : m > 0.
    force_rate_exponent : q > 0.

    Source: that static friction falls with the rate of loading was found by Johannes, Green & Brockley, Wear 24 (1973) 381;
    the form of the fall is our own, with δ₀ → ∞ it is :class:`DwellTime`.

    >>> law = ForceRate(kinetic=0.5, limit=0.5, rate=0.4, force_rate_scale=0.3)
    >>> law.break_away_force(float(10**6), [0.0, 0.3])
    array([1.  , 0.75])
    """

    kinetic: float
    limit: float
    rate: float
    force_rate_scale: float
    exponent: float = 1.0
    force_rate_exponent: float = 1.0
