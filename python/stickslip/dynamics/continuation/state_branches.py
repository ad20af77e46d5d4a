"""Branches of periodic orbits of laws with an internal state: pseudo-arclength on the map over one period."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from stickslip.dynamics.continuation.arclength import CurveEnd, ShorterStep, StepSize, trace, turns
from stickslip.dynamics.continuation.bifurcation_conditions import TESTS, zeros
from stickslip.dynamics.continuation.branch import Branch, SpecialPoint, both_ways_of, range_of
from stickslip.dynamics.periodic.event_sequence import read, with_number
from stickslip.dynamics.periodic.newton_iteration import Lost, newton
from stickslip.dynamics.periodic.poincare_map import forcing_period
from stickslip.dynamics.periodic.state_cycles import StateCycle, StateReturn, Steady, finished
from stickslip.dynamics.periodic.state_flow import StateFlow
from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.simulation.time_limit import NO_LIMIT, TimeLimit

#: Steps along a curve, in sizes of the variables and of the bounds.
_FIRST, _SMALLEST, _LARGEST = 0.02, 1e-3, 0.1
#: A step of Newton's method below which the orbit is closed, and that below which rounding may stop it.
_CLOSED, _STALLED = 1e-9, 1e-6
#: The largest step, in sizes of the variables and of the bounds, and the most rounds.
_REACH, _ROUNDS = 1.0, 12


@dataclass(frozen=True)
class _Point:
    """A closed orbit, the parameter, and the direction of the curve over all of them, in units of their sizes."""

    cycle: StateCycle
    value: float
    direction: Array

    @property
    def nontrivial(self) -> NDArray[np.complex128]:
        """The multipliers but the 1 of an autonomous cycle."""
        return self.cycle.nontrivial

    @cached_property
    def shape(self) -> Array:
        """One period around its mean, in units of the sizes."""
        cycle = self.cycle
        values = cycle.flow.along(cycle.start, cycle.period) / cycle.flow.sizes
        return np.asarray((values - values.mean(axis=0)).ravel())


#: A return, its flow, the parameter, and the derivative of what vanishes over the start, the time and the parameter.
_Found = tuple[StateReturn, StateFlow, float, Array]


@dataclass
class StateWalk:
    """One way along a branch.

    Attributes
    ----------
    path : the number that varies; bounds : how far.
    most : the most points; progress : called as ``progress(points, most)``.
    limit : the time after which no further point is looked for.
    """

    path: str
    bounds: tuple[float, float]
    most: int
    progress: Callable[[int, int], Any] | None = None
    limit: TimeLimit = NO_LIMIT

    def both_ways(self, cycle: StateCycle) -> Branch:
        """The branch through an orbit."""
        start = self._corrected(cycle, read(cycle.system, self.path), None)
        upwards = start.direction * math.copysign(1.0, start.direction[-1])
        return both_ways_of(lambda sign: self._go(replace(start, direction=sign * upwards)))

    def _go(self, point: _Point) -> Branch:
        branch = Branch("cycle")

        def more() -> bool:
            if len(branch.values) >= self.most or self.limit.passed:
                branch.cut = "most" if len(branch.values) >= self.most else "max_seconds"
            elif self.progress is not None:
                self.progress(len(branch.values), self.most)
            return not branch.cut

        with branch.kept():
            branch.add(point.cycle, point.value)
            reason = trace(partial(self._next, branch), point, StepSize(_FIRST, _SMALLEST, _LARGEST), more)
            branch.ends = ("", reason or branch.cut)
        return branch

    def _next(self, branch: Branch, point: _Point, step: float) -> _Point:
        """Add the next point."""
        low, high = self.bounds
        try:
            ahead = self._stepped(point, step)
        except Steady:
            self._end_in_a_point(step)
        except InputError:
            raise ShorterStep(2) from None
        # Beyond a point the curve comes back, half a period later: no fold.
        if not point.cycle.forcing_periods and point.shape @ ahead.shape < 0:
            self._end_in_a_point(step)
        if turns(point.direction, ahead.direction):
            raise ShorterStep(2)
        branch.special_points += self._between(point, ahead, step)
        if not low <= ahead.value <= high:
            bound = low if ahead.value < low else high
            fraction = (bound - point.value) / (ahead.value - point.value)
            with contextlib.suppress(Lost, InputError):
                end = self._corrected(*self._predicted(point, fraction * step, bound), None)
                branch.add(end.cycle, bound)
            raise CurveEnd("bounds")
        branch.add(ahead.cycle, ahead.value)
        return ahead

    def _end_in_a_point(self, step: float) -> NoReturn:
        """The cycle is a point before the end of the step: go closer first, so that the branch reaches to its end."""
        if step >= 2 * _SMALLEST:
            raise ShorterStep(2)
        raise CurveEnd("point")

    def _predicted(self, point: _Point, step: float, value: float | None = None) -> tuple[StateCycle, float]:
        cycle, width = point.cycle, point.cycle.flow.width
        if value is None:
            value = point.value + step * float(point.direction[-1]) * self._span
        system = with_number(cycle.system, self.path, value)
        start = cycle.start + step * point.direction[:width] * cycle.flow.sizes
        period = cycle.period * (1 + step * float(point.direction[width]))
        return replace(cycle, system=system, start=start, period=period), value

    def _stepped(self, point: _Point, step: float) -> _Point:
        return self._corrected(*self._predicted(point, step), point.direction)

    @property
    def _span(self) -> float:
        return self.bounds[1] - self.bounds[0]

    def _corrected(self, cycle: StateCycle, value: float, along: Array | None) -> _Point:
        """Newton's method across `along`, or at a fixed value of the parameter without it.

        Raises
        ------
        Lost
            where it does not converge.
        """
        sizes, force = cycle.flow.sizes, forcing_period(cycle.system)
        width, across = len(sizes), None if force is not None else cycle.flow.rates(0.0, cycle.start)

        def at(unknowns: tuple[Array, float, float]) -> tuple[_Found, Array, float]:
            start, time, value = unknowns
            system = with_number(cycle.system, self.path, value)
            if force is not None:
                # The period is that of the forcing, which the parameter may be.
                time = cycle.forcing_periods * (forcing_period(system) or 0.0)
            flow = StateFlow(system, sizes, path=self.path)
            here = StateReturn.of(flow, start, time, across)
            column = here.matrix[:, width] / sizes * self._span
            if self.path.endswith("/frequency"):
                column -= here.slope * self._span / value
            rows = np.column_stack([here.jacobian, np.append(column, 0.0)])
            matrix = np.vstack([rows, np.eye(width + 2)[-1] if along is None else along])
            step = np.linalg.lstsq(matrix, -np.append(here.defect, 0.0), rcond=1e-14)[0]
            return (here, flow, value, rows), step, float(np.abs(step).max())

        def moved(found: _Found, step: Array) -> tuple[Array, float, float]:
            here, _, value, _ = found
            return *here.moved(step), value + float(step[-1]) * self._span

        for done in newton(at, moved, (cycle.start, cycle.period, value), _REACH, _ROUNDS):
            here, flow, value, rows = done.here
            if done.converged(_CLOSED, _STALLED):
                direction = np.linalg.svd(rows)[2][-1]
                sign = 1.0 if along is None or direction @ along >= 0 else -1.0
                return _Point(finished(flow, here, cycle.forcing_periods, len(done.errors)), value, sign * direction)
            if done.error > _REACH:
                break
        raise Lost(f"Newton's method does not converge, last step {done.error:.1e}")

    def _between(self, point: _Point, ahead: _Point, step: float) -> list[SpecialPoint]:
        """Folds, flips and tori between two points."""
        found = zeros(TESTS, point, ahead, lambda share: self._stepped(point, share * step), 1e-8)
        return [
            SpecialPoint(kind, there.value, x=range_of(there.cycle), system=there.cycle.system, cycle=there.cycle)
            for kind, there in found
        ]
