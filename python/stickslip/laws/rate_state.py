"""Rate-and-state friction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from stickslip.laws.state_law import StateLaw


@dataclass(frozen=True)
class RateState(StateLaw):
    """F = N a asinh((w/2V₀) exp((μ₀ + b ψ + b₂ ψ₂)/a)), ψ = ln(V₀ θ/L), ψ₂ = ln(V₀ θ₂/L₂): friction of rock.

    Parameters
    ----------
    normal_force : N > 0.
    a : direct effect, > 0.
    b : evolution effect; steady slip weakens with velocity where b > a.
    length : L > 0 (D_c), the slip over which the state evolves.
    reference_velocity : V₀ > 0.
    reference_friction : μ₀ > 0, of steady slip at V₀.
    law : how θ and θ₂ evolve, each with its length. ``"aging"``: θ̇ = 1 − |w| θ/L; ``"slip"``: θ̇ = −(|w| θ/L) ln(|w| θ/L);
        ``"perrin-rice-zheng"``: θ̇ = 1 − (|w| θ/2L)²; ``"composite"``: θ̇ = exp(−|w|/V_c) − (|w| θ/L) ln(|w| θ/L).
    second_b, second_length : b₂, dimensionless, and L₂ > 0 of a second state; neither: one state.
    cutoff_velocity : V_c > 0 of the composite law, above which contacts do not age; of no other law.

    The state is ψ, with a second state (ψ, ψ₂); it is 0 in steady slip at V₀. The law of Perrin, Rice & Zheng has
    θ = 2L/|w| in steady slip, so its ψ is ln(V₀ θ/2L): μ₀ is then the friction at V₀ of all laws but the composite one, whose
    steady ψ is W(exp(−|w|/V_c)) − ln(|w|/V₀) with Lambert's W, up to 0.57 more. For |w| ≫ V₀ exp(−μ₀/a),
    F = N (μ₀ + a ln(|w|/V₀) + b ψ + b₂ ψ₂) sgn w; the inverse hyperbolic sine carries that through w = 0.

    Source: Dieterich, J. Geophysical Research 84 (1979) 2161; Ruina, ibid. 88 (1983) 10359; Rice, Lapusta & Ranjith,
    J. Mechanics and Physics of Solids 49 (2001) 1865. Two states: Gu, Rice, Ruina & Tse, ibid. 32 (1984) 167. Evolution:
    Perrin, Rice & Zheng, ibid. 43 (1995) 1461; Kato & Tullis, Geophysical Research Letters 28 (2001) 1103.

    Limits: steady slip at V on a spring k is unstable for k < N (b − a)/L (1 + m V²/(N a L)), with two states for
    k < (m + (N/V) Σ bᵢ Tᵢ/(1 + ω² Tᵢ²)) ω², Tᵢ = Lᵢ/V, where Σ bᵢ/(1 + ω² Tᵢ²) = a (not for the composite law).

    >>> law = RateState(normal_force=1e7, a=0.01, b=0.015, length=1e-5, reference_velocity=1e-6)
    >>> round(law.kinetic_force(1e-6) / 1e7, 12)
    0.6

    Half a micrometre after a step of the speed to ten times as much, the short of two lengths has faded:

    >>> law = RateState(1.0, 0.01, 0.01, 1e-5, 1e-6, law="slip", second_b=0.005, second_length=1e-7)
    >>> force, state = law.follow([0.0, 0.05], [1e-5, 1e-5], state=[0.0, 0.0])
    >>> state.round(3).tolist()
    [[0.0, 0.0], [-0.112, -2.287]]
    """

    normal_force: float
    a: float
    b: float
    length: float
    reference_velocity: float
    reference_friction: float = 0.6
    law: str = "aging"
    second_b: float | None = None
    second_length: float | None = None
    cutoff_velocity: float | None = None

    def state_scale(self, speed: float) -> Any:
        """1, as the state is a logarithm; of each number."""
        del speed
        return np.ones(self.states) if self.states > 1 else 1.0
