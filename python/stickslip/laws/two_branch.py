"""Two piecewise-linear branches: slip velocity rising and falling."""

from __future__ import annotations

from dataclasses import dataclass

from stickslip.laws.law import Law, Point


@dataclass(frozen=True)
class TwoBranch(Law):
    """F = f₊(|w|) while |w| rises, f₋(|w|) while it falls, each with the sign of w; |F| ≤ f_s at rest.

    Parameters
    ----------
    rising : f₊, a number or nodes (slip speed, force), the first at slip speed 0; constant beyond the last.
    falling : f₋, likewise.
    break_away : f_s, at least both branches at slip speed 0.

    The branches need not meet. Where f₋ < f₊ neither is consistent with a balance of forces between them: there ẇ = 0 and
    friction is the reaction that keeps it so (an event of the kind ``hold``, ended by a ``reversal``). Where f₋ > f₊ both
    are consistent in between; the motion stays on its branch until ẇ vanishes there, then ẇ jumps.

    Source: Hunt, Torbe & Spencer, Wear 8 (1965) 455; Powell & Wiercigroch (1992).

    Limits: |w| alone decides, so nothing is remembered of how far the last turn was. :func:`force_along` keeps the branch
    where the measured w stays constant.

    >>> from stickslip.laws import force_along
    >>> law = TwoBranch(rising=1.0, falling=[(0, 0.8), (0.5, 1.0)], break_away=1.1)
    >>> force_along(law, range(4), [0.0, 0.25, 0.5, 0.25], [True, False, False, False])
    array([1.1, 1. , 1. , 0.9])
    """

    rising: float | tuple[Point, ...]
    falling: float | tuple[Point, ...]
    break_away: float
