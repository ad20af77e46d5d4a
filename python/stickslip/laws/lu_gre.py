"""The LuGre law."""

from __future__ import annotations

from dataclasses import dataclass

from stickslip.laws.bristles import Bristles


@dataclass(frozen=True)
class LuGre(Bristles):
    """ż = w − σ₀ |w| z/g(w), F = σ₀ z + σ₁ ż + σ₂ w, g(w) = f_k + (f_s − f_k) exp(−|w/w_s|^n).

    Parameters
    ----------
    stiffness, damping : σ₀ > 0 and σ₁ ≥ 0 of the bristles.
    viscous : σ₂ ≥ 0.
    kinetic, break_away : f_k, f_s > 0, friction of fast and of vanishing steady slip.
    scale : w_s > 0.
    exponent : n > 0, 2 as a rule.

    The state z is the mean deflection of the bristles. For σ₀ → ∞ it is static and kinetic friction with Stribeck's curve.

    Limits: a stuck contact drifts under loads that oscillate below break-away (:class:`ElastoPlastic` does not); with a
    constant σ₁ the model feeds energy at high slip velocities (Barabanov & Ortega, IEEE TAC 45 (2000) 675).

    Source: Canudas de Wit, Olsson, Åström & Lischinsky, IEEE Trans. Automatic Control 40 (1995) 419.

    >>> law = LuGre(1e5, 316.0, 0.4, kinetic=1.0, break_away=1.5, scale=1e-3)
    >>> round(law.kinetic_force(1e-9), 6), round(law.kinetic_force(0.1), 6)
    (1.5, 1.04)
    """
