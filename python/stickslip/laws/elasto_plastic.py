"""The elasto-plastic law."""

from __future__ import annotations

from dataclasses import dataclass, field

from stickslip.laws.bristles import Bristles


@dataclass(frozen=True)
class ElastoPlastic(Bristles):
    """ż = w (1 − α z/z∞), F = σ₀ z + σ₁ ż + σ₂ w: LuGre's bristles, purely elastic below a force.

    Parameters
    ----------
    stiffness, damping, viscous, kinetic, break_away, scale, exponent : as for :class:`LuGre`; z∞ = g(w) sgn w/σ₀.
    elastic : by name, the force σ₀ z_e up to which the contact is purely elastic, 0 ≤ elastic < min(f_k, f_s).

    α = 0 where |z| ≤ z_e or z and w differ in sign, 1 where |z| ≥ |z∞|, half a sine wave between.

    Source: Dupont, Hayward, Armstrong & Altpeter, IEEE Trans. Automatic Control 47 (2002) 787.

    >>> law = ElastoPlastic(1e5, 316.0, 0.4, kinetic=1.0, break_away=1.5, scale=1e-3, elastic=0.9)
    >>> law.rates(1e-4, 0.5e-5)[1]
    array(0.0001)
    """

    elastic: float = field(kw_only=True)
