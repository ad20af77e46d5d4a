"""The exponential Stribeck curve."""

from __future__ import annotations

from dataclasses import dataclass

from stickslip.laws.law import Law


@dataclass(frozen=True)
class ExponentialStribeck(Law):
    """F = f_k + (f_s − f_k) exp(−(|w|/w_s)ⁿ) + b|w| in motion, |F| ≤ f_s at rest.

    Parameters
    ----------
    break_away : f_s ≥ f_k.
    kinetic : f_k, also below zero, as where a viscous part makes up for it; a fit looks for f_k ≥ 0.
    scale : w_s > 0, the slip speed over which friction falls.
    viscous : b.
    exponent : n, 1 (an exponential) or 2 (a Gaussian); other curves have no Taylor series at rest, see :func:`from_function`.

    Source: n = 1: Tustin, J. IEE 94 (1947) 143; n = 2: Armstrong-Hélouvry, Dupont & Canudas de Wit, Automatica 30 (1994)
    1083, after Bo & Pavelescu, Wear 82 (1982) 277.

    >>> round(ExponentialStribeck(1.0, 0.5, scale=0.5).kinetic_force(0.5), 6)
    0.68394
    """

    break_away: float
    kinetic: float
    scale: float
    viscous: float = 0.0
    exponent: float = 1.0
