"""What the bristle laws have in common."""

from __future__ import annotations

from dataclasses import dataclass

from stickslip.laws.state_law import StateLaw


@dataclass(frozen=True)
class Bristles(StateLaw, family=True):
    """The parameters of laws whose contacts are bristles; :class:`LuGre` says what they are."""

    stiffness: float
    damping: float
    viscous: float
    kinetic: float
    break_away: float
    scale: float
    exponent: float = 2.0
