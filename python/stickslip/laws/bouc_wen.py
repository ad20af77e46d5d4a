"""The Bouc–Wen law."""

from __future__ import annotations

from dataclasses import dataclass

from stickslip.laws.state_law import StateLaw


@dataclass(frozen=True)
class BoucWen(StateLaw):
    """ż = A w − β |w| |z|^(n−1) z − γ w |z|^n, F = k z.

    Parameters
    ----------
    stiffness : k > 0.
    beta, gamma : β > 0 in 1/length^n, −β < γ ≤ β.
    exponent : n ≥ 1.
    amplitude : A > 0, 1 as a rule.

    Steady slip has F = k (A/(β + γ))^(1/n). Rate-independent. With n = 1, γ = 0 and β = k/f_k it is :class:`Dahl`.

    Limits: a loop that does not close under small cycles drifts (Thyagarajan & Iwan 1990).

    Source: Bouc (1967) for n = 1; Wen, J. Engineering Mechanics Division ASCE 102 (1976) 249.

    >>> BoucWen(stiffness=2.0, beta=3.0, gamma=1.0, exponent=2).kinetic_force(0.1)
    1.0
    """

    stiffness: float
    beta: float
    gamma: float
    exponent: float = 1.0
    amplitude: float = 1.0
