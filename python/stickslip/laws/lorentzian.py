"""The Lorentzian Stribeck curve."""

from __future__ import annotations

from dataclasses import dataclass

from stickslip.laws.law import Law


@dataclass(frozen=True)
class Lorentzian(Law):
    """F = f_k + (f_s − f_k)/(1 + (w/w_s)²) + b|w| in motion, |F| ≤ f_s at rest.

    Parameters
    ----------
    break_away : f_s ≥ f_k.
    kinetic : f_k ≥ 0.
    scale : w_s > 0, the slip speed at which half of the difference is gone.
    viscous : b.

    Source: Hess & Soom, J. Tribology 112 (1990) 147, as Armstrong-Hélouvry, Dupont & Canudas de Wit, Automatica 30 (1994)
    1083, write it.

    >>> Lorentzian(1.0, 0.5, scale=0.1).kinetic_force(0.1)
    0.75
    """

    break_away: float
    kinetic: float
    scale: float
    viscous: float = 0.0
