"""What the bristle laws have in common."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from stickslip.laws.state_law import StateLaw


@dataclass(frozen=True)
class Bristles(StateLaw, family=True):
    """The parameters of laws whose contacts are bristles; :class:`LuGre` says what they are."""

    EXAMPLE: ClassVar[dict[str, Any]] = {
        "stiffness": 100.0, "damping": 2.0, "viscous": 0.1, "kinetic": 1.0, "break_away": 1.5, "scale": 0.1,
    }  # fmt: skip
    UNITS: ClassVar[dict[str, str]] = {
        "stiffness": "stiffness", "damping": "damping", "viscous": "damping", "kinetic": "force", "break_away": "force",
        "scale": "velocity", "exponent": "",
    }  # fmt: skip

    stiffness: float
    damping: float
    viscous: float
    kinetic: float
    break_away: float
    scale: float
    exponent: float = 2.0
