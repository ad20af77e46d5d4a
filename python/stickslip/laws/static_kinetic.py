"""Static friction above a constant kinetic friction."""

from __future__ import annotations

from dataclasses import dataclass

from stickslip.laws.law import Law


@dataclass(frozen=True)
class StaticKinetic(Law):
    """|F| ≤ f_s at rest, F = f_k sgn w in motion.

    Parameters
    ----------
    break_away : break-away force f_s ≥ f_k.
    kinetic : kinetic force f_k ≥ 0.

    With f_s > f_k the motion at the onset of slip is not unique: the automaton chooses adhesion wherever adhesion can bear
    the force.

    >>> StaticKinetic(break_away=0.5, kinetic=0.6)
    Traceback (most recent call last):
    ...
    stickslip.errors.InputError: StaticKinetic: break-away force must be at least the kinetic force at zero slip velocity
    (0.6), got 0.5: raise the break-away force or lower the kinetic one
    """

    break_away: float
    kinetic: float
