"""Static friction over stick time and force rate: the surface of the paper's law."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from stickslip.files.schema import Document
from stickslip.laws.declarations import FACTS, Parameter


@dataclass(frozen=True)
class StaticFriction(Document):
    """The surface f_s(t_s, δ) = f_0 + Δ₀/(1 + (δ/δ₁)^p) + Δ₂/(1 + (δ/δ₂)^r) + Δ∞ (1 − exp(−γ t_s^m)) / (1 + (δ/δ₀)^q).

    Parameters
    ----------
    initial : f_0 = f_s(0, δ → ∞) > 0, and f_s(0, ·) without a drop.
    limit : Δ∞ ≥ 0, growth after an infinite rest at a vanishing force rate.
    rate, exponent : γ > 0 and m > 0.
    force_rate_scale : δ₀ > 0, the force rate that halves the growth; None: no dependence on the force rate.
    force_rate_exponent : q > 0.
    drop : Δ₀ ≥ 0, what f_s(0, δ) falls by from a vanishing to an infinite force rate.
    drop_scale, drop_exponent : δ₁ > 0, the force rate at which half of that is gone, and p > 0.
    second_drop, second_drop_scale, second_drop_exponent : Δ₂ ≥ 0, δ₂ > 0 and r > 0 of a second step of that fall.

    The growth with rest is Kato's; static friction falling with the force rate is the finding of Johannes, Green &
    Brockley, Wear 24 (1973) 381, in a form of our own.
    """

    PARAMETERS: ClassVar[Mapping[str, Parameter]] = FACTS["BogaczRyczek"].parameters["static_friction"].table or {}

    @classmethod
    def dimensions(cls, name: str) -> tuple[tuple[str, ...], ...]:
        """Those that the core declares of the numbers."""
        return cls.PARAMETERS[name].texts if name in cls.PARAMETERS else ()

    initial: float
    limit: float = 0.0
    rate: float = 1.0
    exponent: float = 1.0
    force_rate_scale: float | None = None
    force_rate_exponent: float = 1.0
    drop: float = 0.0
    drop_scale: float = 1.0
    drop_exponent: float = 1.0
    second_drop: float = 0.0
    second_drop_scale: float = 1.0
    second_drop_exponent: float = 1.0
