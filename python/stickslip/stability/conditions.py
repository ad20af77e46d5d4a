"""What vanishes where the multipliers of a cycle say that its kind changes: folds, branch points, flips and tori."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from stickslip.stability.cycles import Return, multipliers_of
from stickslip.stability.shooting import Lost, Point
from stickslip.stability.trail import STATE

_PARAMETER = len(STATE)


def nontrivial(here: Return) -> Any:
    """The multipliers but the 1 of an autonomous cycle."""
    return multipliers_of(here)[0 if here.turns else 1 :]


def torus(here: Return) -> float:
    """How far the largest pair of complex multipliers lies outside the unit circle; NaN without one."""
    values = nontrivial(here)
    pair = values[np.abs(values.imag) > 1e-9]
    return float(np.abs(pair).max() - 1) if pair.size else math.nan


#: Test functions along a branch; the tangent of the branch tells folds from branch points.
TESTS: dict[str, Callable[[Point], float]] = {
    "fold": lambda point: float(point.direction[_PARAMETER]),
    "branch_point": lambda point: float(np.prod(1 - nontrivial(point.here)).real),
    "flip": lambda point: float(np.prod(nontrivial(point.here) + 1).real),
    "neimark_sacker": lambda point: torus(point.here),
}


def located(at: Callable[[float], Point], kind: str, before: float, after: float) -> Point:
    """The point at(fraction) of a piece of a branch, 0 < fraction < 1, where a test function vanishes.

    Raises
    ------
    Lost
        where a point in between has no orbit.
    """
    return at(_root(lambda fraction: TESTS[kind](at(fraction)), before, after))


def _root(function: Callable[[float], float], before: float, after: float) -> float:
    """A zero in (0, 1) (Illinois)."""
    a, fa, b, fb = 0.0, before, 1.0, after
    for _ in range(60):
        c = (a * fb - b * fa) / (fb - fa)
        fc = function(c)
        if not math.isfinite(fc):
            raise Lost("the test function is gone")
        if fc == 0 or abs(b - a) < 1e-13 or abs(c - b) < 1e-14:
            return c
        if fc * fb < 0:
            a, fa = b, fb
        else:
            fa /= 2
        b, fb = c, fc
    return b


def determinant(kind: str, here: Return) -> float:
    """What vanishes on a curve of folds, flips or Neimark–Sacker points, smooth in the state and the parameters.

    det(M − 1), det(M + 1) and Π (μ_i μ_j − 1) over the pairs of multipliers, with the derivative M of the return map.
    """
    matrix = here.map_jacobian
    if kind != "neimark_sacker":
        return float(np.linalg.det(matrix + (np.eye(len(matrix)) if kind == "flip" else -np.eye(len(matrix)))))
    values = np.linalg.eigvals(matrix).astype(complex)
    first, second = np.triu_indices(len(values), 1)
    return float(np.prod(values[first] * values[second] - 1).real)


#: Kinds of special points that :func:`determinant` knows.
BY_MULTIPLIERS = ("fold", "branch_point", "flip", "neimark_sacker")
