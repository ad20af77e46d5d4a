"""Kinetic friction that falls as 1/(1 + λw)."""

from __future__ import annotations

from dataclasses import dataclass

from stickslip.laws.law import Law


@dataclass(frozen=True)
class Rational(Law):
    """F = f_s/(1 + λ|w|) in motion, |F| ≤ f_s at rest.

    Parameters
    ----------
    break_away : f_s ≥ 0.
    weakening : λ ≥ 0, in 1/velocity.

    Source: Leine, van Campen, de Kraker & van den Steen, Nonlinear Dynamics 16 (1998) 41.

    >>> Rational(break_away=1.0, weakening=3.0).kinetic_force(1.0)
    0.25
    """

    break_away: float
    weakening: float
