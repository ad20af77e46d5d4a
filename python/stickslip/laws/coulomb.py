"""Coulomb friction."""

from __future__ import annotations

from dataclasses import dataclass

from stickslip.laws.law import Law


@dataclass(frozen=True)
class Coulomb(Law):
    """|F| ≤ f_k at rest, F = f_k sgn w in motion.

    Parameters
    ----------
    kinetic : friction force f_k ≥ 0.

    Source: Coulomb (1785); Den Hartog, Trans. ASME 53 (1931) 107.

    >>> Coulomb(kinetic=0.5).break_away_force()
    0.5
    """

    kinetic: float
