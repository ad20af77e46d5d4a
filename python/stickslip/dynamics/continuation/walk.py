"""One way along a branch of cycles: steps, special points in between, boundaries, its end. Step length: `arclength.py`.

Both ways from an orbit are put together in `branches.py`, a branch that leaves another begins in `branch_switching.py`, and
those of critical velocities in `critical/branch_search.py`.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, NoReturn

import numpy as np

from stickslip.dynamics.continuation import switching_boundaries
from stickslip.dynamics.continuation.arclength import (
    CurveEnd,
    Family,
    Label,
    Point,
    ShorterStep,
    StepSize,
    consistent,
    corrected_at,
    stepped,
    trace,
    turns,
)
from stickslip.dynamics.continuation.bifurcation_conditions import TESTS, root, zeros
from stickslip.dynamics.continuation.branch import Branch, SpecialPoint, range_of, same_motion
from stickslip.dynamics.continuation.period_halving import period_halving
from stickslip.dynamics.critical.vanishing import stick_time, vanishing, vanishing_stick
from stickslip.dynamics.periodic.closed_orbit import Cycle
from stickslip.dynamics.periodic.newton_iteration import Lost
from stickslip.dynamics.periodic.periodic_orbits import finished, one_period, unchecked
from stickslip.dynamics.periodic.poincare_map import Return, size_of
from stickslip.dynamics.scales import fastest_drive
from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.files.progress import waiting
from stickslip.simulation.time_limit import NO_LIMIT, TimeLimit

#: Steps along a curve, in sizes of the motion and of the ranges.
_FIRST, _SMALLEST, _LARGEST = 0.01, 1e-5, 0.04
#: The first step beyond a boundary.
_BEYOND = 0.003
#: The longest step to a boundary or a flip at which a branch may end.
_NEAR = 1e-3
#: Where the next cycle is lost that repels more strongly than by this multiplier a branch ends: smaller steps only creep
#: towards a tangency at which it grows beyond all bounds.
_REPELS = 1e3
#: Values of the parameter that differ by less, relative to its scale, are the same.
_SAME = 1e-8
#: A cycle of less than this share of the largest on the branch is about to be a point.
_POINT = 0.02


class _Vanished(Exception):
    """A cycle is a point on the way."""


@dataclass
class Walk:
    """One way along a branch of cycles.

    Attributes
    ----------
    family : the number that varies and its bounds.
    most : the most points.
    progress : called as ``progress(points, most)``.
    limit : the time after which no further point is looked for.
    met : whether a cycle at a value of the parameter is on a branch that was found before, so that this one ends there.
    """

    family: Family
    most: int
    progress: Callable[[int, int], Any] | None = None
    limit: TimeLimit = NO_LIMIT
    met: Callable[[Cycle, float], bool] = lambda _cycle, _value: False
    branch: Branch = field(default_factory=lambda: Branch("cycle"))

    def __post_init__(self) -> None:
        self._say = waiting(self.progress, "continuation")

    def go(self, point: Point) -> Branch:
        """From a point until the parameter leaves its bounds, the cycle is a point, the curve closes or no way goes on."""
        with self.branch.kept():
            self.branch.ends = ("", self._go(point))
        if self.branch.closed:
            self.branch.ends = ("closed", "closed")
        return self.branch

    def _go(self, point: Point) -> str:
        """Add the points; why they end."""
        self._add(point)
        self._largest = self._size()
        self._step = StepSize(_FIRST, _SMALLEST, _LARGEST)
        return trace(self._next, point, self._step, self._more) or self.branch.cut

    def _more(self) -> bool:
        """Whether another point is looked for."""
        if len(self.branch.values) >= self.most:
            self.branch.cut = "most"
            return False
        self._say(len(self.branch.values), self.most)
        if self.limit.passed:
            self.branch.cut = "max_seconds"
        return not self.branch.cut

    def _next(self, point: Point, step: float) -> Point:
        """Add the next point.

        Raises
        ------
        ShorterStep, CurveEnd
            where a shorter step is to be tried, and where the branch ends.
        """
        try:
            ahead = stepped(point, self.family, step)
        except Lost:
            ahead = None
        if ahead is None or not consistent(ahead.here):
            return self._past_a_boundary(point, ahead, step)
        if self._through_a_point(point, ahead):
            self._end_in_a_point(point, step)
        if turns(point.direction, ahead.direction) and step > 20 * _SMALLEST:
            raise ShorterStep(2)
        halved = period_halving(point, ahead, self.family)
        if halved is not None:
            # Closer first: a fold may lie before it.
            if step > _NEAR:
                raise ShorterStep(4)
            flip, end = halved
            self._special("flip", flip)
            self._add(end)
            raise CurveEnd("flip")
        closing = self._closing(point, ahead, step)
        if closing is not None:
            share, first = closing
            self._between(point, first, share * step)
            self._add(first)
            self.branch.closed = True
            raise CurveEnd("closed")
        if self._between(point, ahead, step):
            self._end_in_a_point(point, step)
        low, high = self.family.ranges[0]
        if not low <= ahead.values[0] <= high:
            self._finish(point, low if ahead.values[0] < low else high)
            raise CurveEnd("bounds")
        try:
            self._add(ahead)
        except InputError:
            # Beside a tangency even the orbit that was just closed may not be followed again.
            raise ShorterStep(2) from None
        if ahead.here.forcing_periods == 0 and self._size() < _POINT * self._usual(ahead):
            self._shrunk(ahead)
            raise CurveEnd("point")
        self._largest = max(self._largest, self._size())
        return ahead

    def _past_a_boundary(self, point: Point, ahead: Point | None, step: float) -> Point:
        """Add the first point beyond what ends the event sequence on the way."""
        if self._size() < 0.1 * self._usual(point) and self._shrunk(point):
            raise CurveEnd("point")
        if self._unstuck(point):
            raise CurveEnd("vanishing_stick")
        boundary = switching_boundaries.nearest(point, ahead, step, self.family)
        if boundary is None:
            raise CurveEnd("lost") if self.branch.multiplier[-1] > _REPELS else ShorterStep(2)
        # Closer first: a fold may lie before it.
        if step > _NEAR:
            raise ShorterStep(4)
        past = self._cross(point, *boundary)
        if past is None or self.met(unchecked(past.here), float(past.values[0])):
            raise CurveEnd(self.branch.special_points[-1].kind)
        try:
            self._add(past)
        except InputError:
            raise CurveEnd("lost") from None
        self._step.restart(_BEYOND)
        return past

    def _end_in_a_point(self, point: Point, step: float) -> NoReturn:
        """The cycle is a point before the end of the step: go closer first, so that the branch reaches to its end."""
        if self._size() > _POINT * self._usual(point) and step > 20 * _SMALLEST:
            raise ShorterStep(4)
        self._shrunk(point)
        raise CurveEnd("point")

    def _closing(self, point: Point, ahead: Point, step: float) -> tuple[float, Point] | None:
        """The first point of the branch where it lies between two points, and at which share of the step."""
        first = self.branch.values[0]
        before, after = float(point.values[0]) - first, float(ahead.values[0]) - first
        if not before * after < 0:
            return None

        def at(fraction: float) -> Point:
            return stepped(point, self.family, fraction * step)

        try:
            share = root(lambda fraction: float(at(fraction).values[0]) - first, before, after)
            there = at(share)
            same = same_motion(finished(there.here, 0), self.branch.orbits[0])
        except (Lost, InputError):
            return None
        return (share, there) if same else None

    def _same(self, value: float, point: Point) -> bool:
        """Whether a value of the parameter is that of a point."""
        return abs(value - float(point.values[0])) < _SAME * float(self.family.scales(point.values)[0])

    def _add(self, point: Point) -> None:
        self.branch.add(finished(point.here, 0), float(point.values[0]))

    def _usual(self, point: Point) -> float:
        """What a cycle that is about to be a point is small beside: the largest of the branch, and the way of the drive.

        A cycle that sticks or nearly does is as fast as the drive, however slow that is.
        """
        if point.here.forcing_periods:
            return self._largest
        way = fastest_drive(point.here.sequence.system) * point.here.period / math.pi
        return min(self._largest, way) if way > 0 else self._largest

    @staticmethod
    def _through_a_point(point: Point, ahead: Point) -> bool:
        """Whether the cycle shrinks to a point and grows again between two points: there it starts half a period later."""
        if point.here.forcing_periods or any(switching_boundaries.signature(one.here) for one in (point, ahead)):
            return False

        def turn(here: Return) -> Array:
            orbit = one_period(here, here.period)
            (_, first), (_, half) = orbit.at(0.0), orbit.at(here.period / 2)
            return np.atleast_1d(first - half)

        return float(turn(point.here) @ turn(ahead.here)) < 0

    def _size(self) -> float:
        return self.branch.x_max[-1] - self.branch.x_min[-1]

    def _special(self, kind: str, point: Point, boundary: str = "", label: Label | None = None) -> None:
        try:
            x = range_of(finished(point.here, 0))
        except InputError:
            x = (self.branch.x_min[-1], self.branch.x_max[-1])
        value = float(point.values[0])
        self.branch.special_points.append(
            SpecialPoint(kind, value, boundary, x, point.here.sequence.system, point, label)
        )

    def _finish(self, point: Point, bound: float) -> None:
        try:
            end = corrected_at(point.here.sequence, point.here.forcing_periods, self.family, bound)
            if consistent(end.here):
                self._add(end)
        except Lost:
            pass

    def _cross(self, last: Point, boundary: Point, label: Label) -> Point | None:
        """Switch the event sequence at a boundary; the first point beyond it, None where the branch ends there."""
        name = switching_boundaries.name_of(boundary.here, label)
        way = math.copysign(1.0, float(boundary.values[0] - self.branch.values[-1]))
        past = switching_boundaries.beyond(boundary, last.here, self.family, (way, -way))
        back = past is not None and past[1] != way
        self._special("nonsmooth_fold" if back else name, boundary, name, label)
        return None if past is None else past[0]

    def _between(self, point: Point, ahead: Point, step: float) -> bool:
        """Folds, flips and tori between two points of one event sequence; whether the cycle is a point on the way.

        At a Hopf point the curve of cycles turns back on itself, half a period later: no fold.
        """
        if switching_boundaries.signature(point.here) != switching_boundaries.signature(ahead.here):
            return False
        largest = max(np.subtract(self.branch.x_max, self.branch.x_min))
        start = point.here.sequence.start
        length = size_of(point.here.sequence.system, start, point.here.sequence.layout.x).max()
        # No cycle much larger than the step vanishes within it.
        small = not point.here.forcing_periods and self._size() < 10 * step * length

        def at(fraction: float) -> Point:
            self._say(len(self.branch.values), self.most)
            found = stepped(point, self.family, fraction * step)
            if small and np.subtract(*range_of(unchecked(found.here))) > -_POINT * self._size():
                raise _Vanished
            return found

        # Where the parameter stands still along the curve, the sign of its direction is rounding.
        folds = [item.parameter for item in self.branch.special_points if item.kind == "fold"]
        still = any(self._same(value, ahead) for value in folds)
        tests = {kind: test for kind, test in TESTS.items() if not (still and kind == "fold")}
        try:
            for kind, found in zeros(tests, point, ahead, at):
                with contextlib.suppress(InputError):
                    low, high = range_of(finished(found.here, 0))
                    if not found.here.forcing_periods and high - low < _POINT * largest:
                        return True
                    self._special(kind, found)
        except _Vanished:
            return True
        return False

    def _shrunk(self, point: Point) -> bool:
        """Whether the cycle shrinks to a point from here on; the zero of the damping says where at a smooth Hopf point."""
        if point.here.forcing_periods:
            return False
        found = vanishing(point, self.family)
        if found is None:
            return False
        kind, value, smallest = found
        if kind == "nonsmooth_hopf":
            x = 2 * (float(np.mean(range_of(finished(smallest.here, 0)))),)
            self.branch.special_points.append(
                SpecialPoint(kind, value, "", (x[0], x[1]), smallest.here.sequence.system, smallest)
            )
        return True

    def _unstuck(self, point: Point) -> bool:
        """Whether the sticks vanish from here on and leave neutral slip, towards which the multiplier goes to 1."""
        if point.here.forcing_periods or self.branch.multiplier[-1] < 0.5:
            return False
        if not 0 < stick_time(point) < 0.1 * point.here.period:
            return False
        found = vanishing_stick(point, self.family)
        if found is None:
            return False
        value, shortest = found
        self._special("vanishing_stick", replace(shortest, values=np.array([value])))
        return True
