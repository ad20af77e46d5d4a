"""Kinetic friction in linear pieces."""

from __future__ import annotations

from dataclasses import dataclass

from stickslip.laws.law import Law, Point


@dataclass(frozen=True)
class PiecewiseLinear(Law):
    """F(|w|) linear between nodes (w_i, f_i), the last slope going on beyond the last; |F| ≤ f_s at rest.

    Parameters
    ----------
    nodes : two or more pairs (slip speed, force), the first at slip speed 0, slip speeds increasing.
    break_away : break-away force f_s ≥ f_0.

    >>> PiecewiseLinear(nodes=[(0, 1), (0.2, 0.6), (0.3, 0.61)], break_away=1).kinetic_force([0.1, 0.5])
    array([0.8 , 0.63])
    """

    nodes: tuple[Point, ...]
    break_away: float
