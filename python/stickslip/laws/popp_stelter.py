"""The law of Popp and Stelter."""

from __future__ import annotations

from dataclasses import dataclass

from stickslip.laws.law import Law


@dataclass(frozen=True)
class PoppStelter(Law):
    """F = (f_s − f_k)/(1 + λ₁|w|) + f_k + λ₂w² in motion, |F| ≤ f_s at rest.

    Parameters
    ----------
    break_away : f_s ≥ f_k.
    kinetic : f_k ≥ 0, the force the hyperbola falls to.
    weakening : λ₁ ≥ 0, in 1/velocity.
    square : λ₂, in force/velocity².

    Source: Popp & Stelter, Phil. Trans. R. Soc. A 332 (1990) 89.

    >>> round(PoppStelter(0.4, 0.1, weakening=1.42, square=0.01).kinetic_force(1.0), 6)
    0.233967
    """

    break_away: float
    kinetic: float
    weakening: float
    square: float = 0.0
