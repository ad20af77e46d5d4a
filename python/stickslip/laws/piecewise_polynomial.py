"""Kinetic friction as any smooth function of the slip speed, in pieces of polynomials."""

from __future__ import annotations

from dataclasses import dataclass

from stickslip.laws.law import Law, Point


@dataclass(frozen=True)
class PiecewisePolynomial(Law):
    """F(|w|) is the polynomial through n + 1 nodes on each piece, its tangent goes on beyond the last; |F| ≤ f_s at rest.

    A smooth law: one curve for all slip speeds, as the laws with a formula. :func:`smooth_from_function` makes one from a
    function, with its nodes at Chebyshev points.

    Parameters
    ----------
    nodes : pairs (slip speed, force), the first at slip speed 0, slip speeds increasing; degree times the number of pieces
        and one more, as the last node of a piece is the first of the next.
    break_away : break-away force f_s ≥ f_0.
    degree : n, a whole number from 2 to 16.

    Limits: through nodes that are evenly spaced a polynomial of a high degree swings between them (Runge); choose Chebyshev
    points.

    >>> law = PiecewisePolynomial(nodes=[(0, 1), (0.5, 0.7), (1, 0.6)], break_away=1, degree=2)
    >>> law.kinetic_force([0.25, 1.0, 2.0]).round(6)  # 1 − 0.8 w + 0.4 w², whose slope at 1 is 0
    array([0.825, 0.6  , 0.6  ])
    """

    nodes: tuple[Point, ...]
    break_away: float
    degree: float = 16.0
