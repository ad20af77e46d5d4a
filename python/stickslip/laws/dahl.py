"""Dahl's law."""

from __future__ import annotations

from dataclasses import dataclass

from stickslip.laws.state_law import StateLaw


@dataclass(frozen=True)
class Dahl(StateLaw):
    """dF/dx = σ |1 − (F/f_k) sgn w|^i sgn(1 − (F/f_k) sgn w): friction that yields like a strained solid.

    Parameters
    ----------
    stiffness : σ > 0, at F = 0.
    kinetic : f_k > 0, friction of steady slip.
    exponent : i > 0: 1 as a rule, below for brittle, above for ductile contacts.

    The state is F. Rate-independent: time does not matter, only the path.

    Limits: no static friction above kinetic, hence no stick-slip; no drift only for i < 1.

    Source: Dahl, Aerospace Corporation TOR-158(3107-18) (1968).

    >>> Dahl(stiffness=2.0, kinetic=1.0).rates(1.0, 0.5)
    (array(0.5), array(1.))
    """

    stiffness: float
    kinetic: float
    exponent: float = 1.0
