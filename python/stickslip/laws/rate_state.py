"""Rate-and-state friction."""

from __future__ import annotations

from dataclasses import dataclass

from stickslip.laws.state_law import StateLaw


@dataclass(frozen=True)
class RateState(StateLaw):
    """F = N a asinh((w/2V₀) exp((μ₀ + b ψ)/a)), ψ = ln(V₀ θ/L): friction of rock.

    Parameters
    ----------
    normal_force : N > 0.
    a, b : direct and evolution effect, a > 0; steady slip weakens with velocity where b > a.
    length : L > 0 (D_c), the slip over which the state evolves.
    reference_velocity : V₀ > 0.
    reference_friction : μ₀ > 0, of steady slip at V₀.
    law : ``"aging"``: θ̇ = 1 − |w| θ/L; ``"slip"``: θ̇ = −(|w| θ/L) ln(|w| θ/L).

    The state is ψ, 0 in steady slip at V₀. For |w| ≫ V₀ exp(−μ₀/a), F = N (μ₀ + a ln(|w|/V₀) + b ψ) sgn w; the inverse
    hyperbolic sine carries that through w = 0.

    Source: Dieterich, J. Geophysical Research 84 (1979) 2161; Ruina, ibid. 88 (1983) 10359; Rice, Lapusta & Ranjith,
    J. Mechanics and Physics of Solids 49 (2001) 1865.

    Limits: steady slip on a spring k is unstable for k < N (b − a)/L (1 + m V₀²/(N a L)).

    >>> law = RateState(normal_force=1e7, a=0.01, b=0.015, length=1e-5, reference_velocity=1e-6)
    >>> round(law.kinetic_force(1e-6) / 1e7, 12)
    0.6
    """

    normal_force: float
    a: float
    b: float
    length: float
    reference_velocity: float
    reference_friction: float = 0.6
    law: str = "aging"

    def state_scale(self, speed: float) -> float:
        """1, as the state is a logarithm."""
        del speed
        return 1.0
