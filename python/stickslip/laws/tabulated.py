"""A tabulated law."""

from __future__ import annotations

from dataclasses import dataclass

from stickslip.laws.law import Law, Point


@dataclass(frozen=True)
class Tabulated(Law):
    """F(|w|) and f_s(t_s) as they were measured: linear between nodes, constant beyond the last.

    Parameters
    ----------
    kinetic : kinetic force ≥ 0, a number or nodes (slip speed, force), the first at slip speed 0.
    break_away : break-away force, a number or nodes (stick time, force), the first at stick time 0; at least the kinetic
        force at slip speed 0, and never falling, as friction that ages does not.

    >>> law = Tabulated(kinetic=[(0, 0.8), (0.2, 0.6)], break_away=[(0, 0.8), (1, 0.9), (10, 1.0)])
    >>> law.kinetic_force([0.1, 5.0]), law.break_away_force([0.5, 1e9])
    (array([0.7, 0.6]), array([0.85, 1.  ]))
    """

    kinetic: float | tuple[Point, ...]
    break_away: float | tuple[Point, ...]
