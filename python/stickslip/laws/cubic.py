"""Kinetic friction as a cubic of the slip velocity."""

from __future__ import annotations

from dataclasses import dataclass

from stickslip.laws.law import Law


@dataclass(frozen=True)
class Cubic(Law):
    """F = μ_s − k₁|w| + k₃|w|³ in motion, |F| ≤ μ_s at rest.

    Parameters
    ----------
    static : μ_s ≥ 0, also the break-away force.
    linear : k₁, 1.5 (μ_s − μ_m)/v_m for a minimum μ_m at the slip speed v_m.
    cubic : k₃, 0.5 (μ_s − μ_m)/v_m³ for the same.

    Source: Thomsen & Fidlin, Int. J. Non-Linear Mech. 38 (2003) 389.

    >>> round(Cubic(static=0.4, linear=0.45, cubic=0.6).kinetic_force(0.5), 12)
    0.25
    """

    static: float
    linear: float
    cubic: float
