"""What vanishes where the multipliers of a cycle say that its kind changes: folds, branch points, flips and tori."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Protocol, TypeVar

import numpy as np

from stickslip.dynamics.periodic.event_sequence import read, with_number
from stickslip.dynamics.periodic.newton_iteration import Lost
from stickslip.dynamics.periodic.poincare_map import Return, moved, return_of
from stickslip.errors import InputError
from stickslip.files.arrays import Array

#: Where in a direction the parameter stands.
PARAMETER = -1
#: Kinds of special points that :func:`determinant` knows.
BY_MULTIPLIERS = ("fold", "flip", "neimark_sacker")
#: Steps of the difference, relative to the size of a number.
_STEP = 1e-5


class OnCurve(Protocol):
    """A point of a curve of closed orbits, whatever the law."""

    @property
    def direction(self) -> Array:
        """That of the curve."""

    @property
    def nontrivial(self) -> Any:
        """The multipliers but the 1 of an autonomous cycle."""


Curve = TypeVar("Curve", bound=OnCurve)


def torus(values: Any) -> float:
    """How far the largest pair of complex multipliers lies outside the unit circle; NaN without one."""
    pair = values[np.abs(values.imag) > 1e-9]
    return float(np.abs(pair).max() - 1) if pair.size else math.nan


#: Test functions along a branch; the tangent of the branch tells folds from branch points.
TESTS: dict[str, Callable[[OnCurve], float]] = {
    "fold": lambda point: float(point.direction[PARAMETER]),
    "branch_point": lambda point: float(np.prod(1 - point.nontrivial).real),
    "flip": lambda point: float(np.prod(point.nontrivial + 1).real),
    "neimark_sacker": lambda point: torus(point.nontrivial),
}


#: A parameter that changes by no more than this along a curve stands still: the sign of the change is rounding.
STILL = 1e-11


def zeros(
    tests: Mapping[str, Callable[[Curve], float]],
    point: Curve,
    ahead: Curve,
    between: Callable[[float], Curve],
    near: float = 1e-14,
) -> Iterator[tuple[str, Curve]]:
    """The points from one of a curve to the next at which a test function vanishes, each after its name.

    Parameters
    ----------
    between : the point of the curve after a share of the step; where it is lost, or the test function is, the next is tried.
    near : of the root, as a share of the step.
    """
    for name, test in tests.items():
        before = test(point)
        if name == "fold":
            if abs(before) <= STILL:
                continue
            test = partial(_until_still, before)
        after = test(ahead)
        if not (np.isfinite([before, after]).all() and before * after < 0):
            continue
        # A multiplier is 1 at a fold, too.
        if name == "branch_point" and TESTS["fold"](point) * TESTS["fold"](ahead) < 0:
            continue
        with contextlib.suppress(Lost, InputError):
            found = between(root(partial(_along, test, between), before, after, near))
            yield name, found


def _until_still(before: float, point: OnCurve) -> float:
    """How the parameter changes along the curve, which began with `before`; where it stands still, as if beyond a fold."""
    change = TESTS["fold"](point)
    return change if abs(change) > STILL else -math.copysign(STILL, before)


def _along(test: Callable[[Curve], float], between: Callable[[float], Curve], share: float) -> float:
    return test(between(share))


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


def gradient(kind: str, here: Return, paths: Sequence[str], scales: Sequence[float]) -> Array:
    """The derivatives of :func:`determinant` over the coordinates and the parameters, by central differences.

    They steer Newton's method only: what it converges to is as exact as the determinant.
    """
    sizes = here.sizes
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


def other_multipliers(point: OnCurve, kind: str) -> Any:
    """The multipliers but those that are critical all along a curve of a kind."""
    values = point.nontrivial
    if kind == "neimark_sacker":
        return np.delete(values, critical_pair(values))
    if kind in ("fold", "flip"):
        return np.delete(values, int(np.argmin(np.abs(values - (1 if kind == "fold" else -1)))))
    return values


def critical_pair(values: Any) -> list[int]:
    """The two whose product is nearest to 1."""
    first, second = np.triu_indices(len(values), 1)
    best = int(np.argmin(np.abs(values[first] * values[second] - 1)))
    return [int(first[best]), int(second[best])]


def second_conditions(kind: str) -> dict[str, Callable[[OnCurve], float]]:
    """What vanishes at the points of codimension two on a curve of special points of a kind, by their names."""

    def factors(sign: float) -> Callable[[OnCurve], float]:
        return lambda point: float(np.prod(other_multipliers(point, kind) - sign).real)

    def circle(point: OnCurve) -> float:
        return torus(other_multipliers(point, kind))

    def cosine(level: float) -> Callable[[OnCurve], float]:
        def test(point: OnCurve) -> float:
            values = point.nontrivial
            return float(values[critical_pair(values)].sum().real) / 2 - level

        return test

    names = {"fold": factors(1.0), "flip": factors(-1.0), "neimark_sacker": circle}
    tests = {f"{kind}_{name}": test for name, test in names.items() if not (kind == "flip" and name == "fold")}
    if kind == "flip":
        tests["fold_flip"] = factors(1.0)
    if kind == "fold":
        # The second multiplier at +1 is where folds meet a curve of Neimark–Sacker points.
        tests["resonance_1_1"] = tests.pop("fold_fold")
    if kind == "neimark_sacker":
        angles = {"resonance_1_1": 1.0, "resonance_1_2": -1.0, "resonance_1_3": -0.5, "resonance_1_4": 0.0}
        tests = {name: cosine(level) for name, level in angles.items()} | {
            "fold_neimark_sacker": factors(1.0),
            "flip_neimark_sacker": factors(-1.0),
        }
    return tests


def root(function: Callable[[float], float], before: float, after: float, near: float = 1e-14) -> float:
    """A zero in (0, 1) of a function with known ends (Illinois), until a step is less than `near`.

    Raises
    ------
    Lost
        where the function is not a number in between.
    """
    a, fa, b, fb = 0.0, before, 1.0, after
    for _ in range(60):
        c = (a * fb - b * fa) / (fb - fa)
        fc = function(c)
        if not math.isfinite(fc):
            raise Lost("the test function is gone")
        if fc == 0 or abs(b - a) < 10 * near or abs(c - b) < near:
            return c
        if fc * fb < 0:
            a, fa = b, fb
        else:
            fa /= 2
        b, fb = c, fc
    return b
