"""What vanishes where the multipliers of a cycle say that its kind changes: folds, branch points, flips and tori."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.dynamics.periodic.event_sequence import Floats, read, with_number
from stickslip.dynamics.periodic.return_map import Return, moved, multipliers_of, return_of, size_of

if TYPE_CHECKING:
    from stickslip.dynamics.periodic.shooting import Point

#: Where in a direction the parameter stands.
_PARAMETER = -1
#: Kinds of special points that :func:`determinant` knows.
BY_MULTIPLIERS = ("fold", "flip", "neimark_sacker")
#: Steps of the difference, relative to the size of a number.
_STEP = 1e-5


def nontrivial(here: Return) -> Any:
    """The multipliers but the 1 of an autonomous cycle."""
    return multipliers_of(here)[0 if here.forcing_periods else 1 :]


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


def gradient(kind: str, here: Return, paths: Sequence[str], scales: Sequence[float]) -> Floats:
    """The derivatives of :func:`determinant` over the coordinates and the parameters, by central differences.

    They steer Newton's method only: what it converges to is as exact as the determinant.
    """
    sizes = size_of(here.sequence.system, here.sequence.start, here.coordinates)
    slopes = []
    for coordinate, size in enumerate(sizes):
        step = np.zeros(len(sizes))
        step[coordinate] = _STEP * size
        ends = [determinant(kind, return_of(moved(here, sign * step), here.forcing_periods)) for sign in (-1.0, 1.0)]
        slopes.append((ends[1] - ends[0]) / (2 * step[coordinate]))
    for path, scale in zip(paths, scales, strict=True):
        value, width = read(here.sequence.system, path), _STEP * scale
        ends = []
        for sign in (-1.0, 1.0):
            system = with_number(here.sequence.system, path, value + sign * width)
            ends.append(determinant(kind, return_of(replace(here.sequence, system=system), here.forcing_periods)))
        slopes.append((ends[1] - ends[0]) / (2 * width))
    return np.array(slopes)
