"""Curves of periodic orbits and of their boundaries: pseudo-arclength on the return map held to one event sequence.

The curves are branches over one parameter (`walk.py`) and loci of their special points over two (`loci.py`). `trace` goes
along these and along branches of laws with an internal state (`state_branches.py`), with steps of the length that `StepSize`
keeps; each curve says when a step is too long.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from stickslip.dynamics.continuation.bifurcation_conditions import determinant, gradient
from stickslip.dynamics.periodic.event_sequence import BOUNDARIES, EventSequence, with_number
from stickslip.dynamics.periodic.newton_iteration import Lost, newton
from stickslip.dynamics.periodic.poincare_map import Return, inconsistency, moved, multipliers_of, return_of
from stickslip.errors import InputError
from stickslip.files.arrays import Array

#: The largest step of Newton's method, in sizes of the motion and the parameters, and the most rounds of it.
_REACH, _ROUNDS = 0.3, 25
#: Below this a step is rounding, and below the other where rounding holds it up.
_EXACT, _HELD_UP = 1e-14, 1e-8
#: The least cosine of the angle between the directions of a curve at two points that follow each other.
_TURN = 0.9
#: How much longer the next step is than one that succeeded.
_GROWTH = 1.4

Curve = TypeVar("Curve")


class Label(NamedTuple):
    """A test function: of which contact, its number in `BOUNDARIES`, the phase, and which of them there."""

    contact: int
    boundary: int
    phase: int
    order: int

    @property
    def name(self) -> str:
        """That of the boundary."""
        return BOUNDARIES[self.boundary]


#: What vanishes on a curve in two parameters: a test function, or a condition on the multipliers by its name.
Condition = Label | str


@dataclass(frozen=True)
class Family:
    """The numbers of the system that vary, and how far they reach."""

    paths: tuple[str, ...]
    ranges: tuple[tuple[float, float], ...]
    #: Whether steps are measured by the values themselves instead of their ranges.
    relative: bool = False

    def scales(self, values: Array) -> Array:
        """What counts as large in each parameter."""
        spans = np.array([high - low for low, high in self.ranges])
        return np.maximum(np.abs(values), 1e-3 * spans) if self.relative else spans


# Known by itself, so that what was found from it can be kept.
@dataclass(frozen=True, eq=False)
class Point:
    """A closed orbit of a family, the values of its parameters, and the direction in which the curve goes on.

    `direction` is scaled: over the numbers of the state and the parameters, in units of their sizes.
    """

    here: Return
    values: Array
    direction: Array
    boundary: Condition | None = None

    @property
    def nontrivial(self) -> NDArray[np.complex128]:
        """The multipliers but the 1 of an autonomous cycle."""
        return multipliers_of(self.here)[0 if self.here.forcing_periods else 1 :]


def axis(sequence: EventSequence) -> Array:
    """The direction in which the only parameter grows and nothing else moves."""
    return np.append(np.zeros(sequence.layout.width), 1.0)


def labels(here: Return) -> dict[Label, int]:
    """The rows of the test functions by label."""
    found: dict[Label, int] = {}
    for row, (boundary, contact, phase, *_) in enumerate(here.tests.tolist()):
        order = sum(key[:3] == (contact, boundary, phase) for key in found)
        found[Label(contact, boundary, phase, order)] = row
    return found


def evaluate(
    sequence: EventSequence, forcing_periods: int, family: Family, values: Array, boundary: Condition | None
) -> tuple[Return, Array, Array, Array]:
    """The return, what has to vanish, its derivative over the coordinates and the parameters, and that of what is written."""
    system = sequence.system
    try:
        for path, value in zip(family.paths, values, strict=True):
            system = with_number(system, path, float(value))
        sequence = replace(sequence, system=system)
        heres = [return_of(sequence, forcing_periods, path, tests=True) for path in family.paths]
    except InputError as error:
        raise Lost(str(error)) from None
    here = heres[0]
    residual = here.defect
    jacobian = np.column_stack([here.map_jacobian - np.eye(len(here.coordinates)), *(item.parameter for item in heres)])
    if boundary is not None:
        value, slopes = _vanishing(heres, boundary, family, values)
        residual = np.append(residual, value)
        jacobian = np.vstack([jacobian, slopes])
    if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
        raise Lost("the motion leaves the numbers")
    return here, residual, jacobian, np.column_stack([item.fixed_parameter for item in heres])


def _vanishing(heres: list[Return], boundary: Condition, family: Family, values: Array) -> tuple[float, Array]:
    """What vanishes beside the defect, and its derivatives over the coordinates and the parameters."""
    here = heres[0]
    if isinstance(boundary, str):
        try:
            return determinant(boundary, here), gradient(boundary, here, family.paths, list(family.scales(values)))
        except (InputError, ValueError):
            raise Lost("no orbit beside this one has its event sequence") from None
    row = labels(here).get(boundary)
    if row is None:
        raise Lost("the test function is gone")
    slopes = np.concatenate([here.test_rates[row, :-1], [item.test_rates[row, -1] for item in heres]])
    return float(here.tests["value"][row]), slopes


def _scales(here: Return, family: Family, values: Array) -> Array:
    return np.concatenate([here.sizes, family.scales(values)])


def _columns(here: Return, family: Family) -> NDArray[np.int64]:
    """Where coordinates and parameters stand in a full direction."""
    return np.concatenate([here.coordinates, here.sequence.layout.width + np.arange(len(family.paths))])


def tangent(here: Return, jacobian: Array, family: Family, values: Array, along: Array | None) -> Array:
    """The direction of the curve: the null vector of the scaled derivative, turned the way of `along`."""
    scales = _scales(here, family, values)
    _, _, rows = np.linalg.svd(jacobian * scales)
    direction = np.zeros(here.sequence.layout.width + len(family.paths))
    direction[_columns(here, family)] = rows[-1]
    if along is not None and direction @ along < 0:
        direction = -direction
    return direction


def corrected(
    sequence: EventSequence,
    forcing_periods: int,
    family: Family,
    values: Array,
    direction: Array | None,
    boundary: Condition | None = None,
) -> Point:
    """Newton's method: across `direction`, or, where there are as many unknowns as equations, as it is.

    Raises
    ------
    Lost
        where it does not converge.
    """

    def at(unknowns: tuple[EventSequence, Array]) -> tuple[tuple[Return, Array, Array, Array], Array, float]:
        sequence, values = unknowns
        here, residual, jacobian, written = evaluate(sequence, forcing_periods, family, values, boundary)
        scales = _scales(here, family, values)
        matrix, right = jacobian * scales, -residual
        if direction is not None:
            matrix = np.vstack([matrix, direction[_columns(here, family)]])
            right = np.append(right, 0.0)
        step = np.linalg.lstsq(matrix, right, rcond=1e-14)[0]
        return (here, values, jacobian, written), step * scales, float(np.abs(step).max(initial=0.0))

    small = 0
    for done in newton(at, _moved, (sequence, np.asarray(values, float)), _REACH, _ROUNDS):
        here, values, jacobian, _ = done.here
        small += done.converged(_EXACT, _HELD_UP)
        if small and (here.settled or small > 2):
            return Point(here, values, tangent(here, jacobian, family, values, direction), boundary)
        if not np.isfinite(done.error) or done.idle:
            break
    raise Lost(f"Newton's method does not converge, last step {done.error:.1e}")


def corrected_at(sequence: EventSequence, forcing_periods: int, family: Family, value: float) -> Point:
    """The closed orbit of a sequence at a value of the parameter; raises as :func:`corrected`."""
    return corrected(sequence, forcing_periods, family, np.array([value]), axis(sequence))


def _moved(found: tuple[Return, Array, Array, Array], step: Array) -> tuple[EventSequence, Array]:
    here, values, _, written = found
    count = len(here.coordinates)
    sequence = moved(here, step[:count])
    sequence.start[here.fixed] += written @ step[count:]
    return sequence, values + step[count:]


def stepped(point: Point, family: Family, step: float) -> Point:
    """The next point of the curve, `step` along its direction, with the same event sequence."""
    here = point.here
    scales = np.ones(len(point.direction))
    scales[_columns(here, family)] = _scales(here, family, point.values)
    leap = step * point.direction * scales
    sequence = moved(here, leap[here.coordinates])
    values = point.values + leap[here.sequence.layout.width :]
    sequence.start[here.fixed] += here.fixed_parameter * leap[-1] if values.size == 1 else 0.0
    return corrected(sequence, here.forcing_periods, family, values, point.direction, point.boundary)


class ShorterStep(Lost):
    """A step is to be tried again, so many times as short."""

    def __init__(self, parts: int) -> None:
        self.parts = parts


class CurveEnd(Exception):
    """A curve ends, with the reason."""

    def __init__(self, reason: str) -> None:
        self.reason = reason


def turns(before: Array, after: Array) -> bool:
    """Whether the direction of a curve turns by too much from a point to the next."""
    return float(before @ after) < _TURN


@dataclass
class StepSize:
    """The length of the next step along a curve: `now`, and what it stays between."""

    now: float
    smallest: float
    largest: float

    def grow(self) -> None:
        """After a point."""
        self.now = min(_GROWTH * self.now, self.largest)

    def shrink(self, parts: int) -> bool:
        """After a step that was lost; whether it is still long enough."""
        self.now /= parts
        return self.now >= self.smallest

    def restart(self, length: float) -> None:
        """The step after the point that is being added."""
        self.now = length / _GROWTH


def trace(advance: Callable[[Curve, float], Curve], point: Curve, step: StepSize, more: Callable[[], bool]) -> str:
    """Go from point to point of a curve, and say why it ends.

    Parameters
    ----------
    advance : the next point after a step; where it is lost the step is tried at half its length.
    step : the first one, and its bounds: below the smallest the curve is lost.
    more : whether another point is looked for, asked before each try.

    Returns
    -------
    The reason of a `CurveEnd`, ``"lost"``, or nothing where no more points are looked for.
    """
    while more():
        try:
            point = advance(point, step.now)
            step.grow()
        except Lost as lost:
            if not step.shrink(lost.parts if isinstance(lost, ShorterStep) else 2):
                return "lost"
        except CurveEnd as end:
            return end.reason
    return ""


def consistent(here: Return) -> bool:
    """Whether the real motion follows the event sequence."""
    return inconsistency(here) is None
