"""Branches of periodic orbits of laws with an internal state: pseudo-arclength on the map over one period."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from stickslip.dynamics.continuation.branch import Branch, SpecialPoint, both_ways_of, range_of
from stickslip.dynamics.continuation.conditions import TESTS_OF_MULTIPLIERS, root
from stickslip.dynamics.periodic.event_sequence import Floats, read, with_number
from stickslip.dynamics.periodic.poincare_map import Lost, forcing_period
from stickslip.dynamics.periodic.state_cycles import StateCycle, finished
from stickslip.dynamics.periodic.state_flow import StateFlow
from stickslip.errors import InputError
from stickslip.model.system import Oscillator, System
from stickslip.simulation.time_limit import NO_LIMIT, TimeLimit

_SMALLEST, _LARGEST = 1e-3, 0.1
#: A step of Newton's method below which the orbit is closed, and that below which rounding may stop it.
_CLOSED, _STALLED = 1e-9, 1e-6


@dataclass(frozen=True)
class _Point:
    """A closed orbit, the parameter, and the direction of the curve over all of them, in units of their sizes."""

    cycle: StateCycle
    value: float
    direction: Floats


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
        with branch.kept():
            branch.ends = ("", self._follow(point, branch))
        return branch

    def _follow(self, point: _Point, branch: Branch) -> str:
        """Add the points; why they end."""
        step = 0.02
        low, high = self.bounds
        branch.add(point.cycle, point.value)
        while step >= _SMALLEST:
            if len(branch.values) >= self.most or self.limit.passed:
                branch.cut = "most" if len(branch.values) >= self.most else "max_seconds"
                return branch.cut
            if self.progress is not None:
                self.progress(len(branch.values), self.most)
            try:
                ahead = self._stepped(point, step)
            except (Lost, InputError):
                step /= 2
                continue
            if float(ahead.direction @ point.direction) < 0.9:
                step /= 2
                continue
            branch.special_points += self._between(point, ahead, step)
            if not low <= ahead.value <= high:
                bound = low if ahead.value < low else high
                fraction = (bound - point.value) / (ahead.value - point.value)
                try:
                    end = self._corrected(*self._predicted(point, fraction * step, bound), None)
                    branch.add(end.cycle, bound)
                except (Lost, InputError):
                    pass
                return "bounds"
            branch.add(ahead.cycle, ahead.value)
            point, step = ahead, min(1.5 * step, _LARGEST)
        return "lost"

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

    def _corrected(self, cycle: StateCycle, value: float, along: Floats | None) -> _Point:
        """Newton's method across `along`, or at a fixed value of the parameter without it.

        Raises
        ------
        Lost
            where it does not converge.
        """
        system: Oscillator | System = cycle.system
        start, time, sizes = cycle.start, cycle.period, cycle.flow.sizes
        width, best, reference = len(start), math.inf, cycle.flow.rates(0.0, cycle.start)
        for done in range(12):
            flow = StateFlow(system, sizes, path=self.path)
            force = forcing_period(system)
            if force is not None:
                time = cycle.forcing_periods * force
            end, rates = flow.tangents(start, 0.0, time, np.eye(width))
            matrix = np.zeros((width + 2, width + 2))
            matrix[:width, :width] = rates[:, :width] * sizes / sizes[:, None] - np.eye(width)
            slope = flow.rates(time, end) / sizes * time
            matrix[:width, -1] = rates[:, width] / sizes * self._span
            defect = np.append((end - start) / sizes, [0.0, 0.0])
            if force is None:
                matrix[:width, width] = slope
                matrix[width, :width] = reference / sizes
            else:
                # The period is that of the forcing, which the parameter may be.
                matrix[width, width] = 1.0
                if self.path.endswith("/frequency"):
                    matrix[:width, -1] -= slope * self._span / value
            residual = float(np.abs(defect).max())
            matrix[-1] = np.eye(width + 2)[-1] if along is None else along
            step = np.linalg.lstsq(matrix, -defect, rcond=1e-14)[0]
            error = float(np.abs(step).max())
            if error < _CLOSED or (done > 2 and error < _STALLED and error > 0.3 * best):
                closed = finished(
                    system,
                    replace(flow, path=None),
                    start,
                    time,
                    cycle.forcing_periods,
                    rates[:, :width],
                    residual,
                    done,
                )
                _, _, rows = np.linalg.svd(matrix[:-1])
                direction = rows[-1]
                if along is not None and direction @ along < 0:
                    direction = -direction
                return _Point(closed, value, np.asarray(direction))
            best = min(best, error)
            if error > 1.0:
                break
            start = start + step[:width] * sizes
            time *= 1 + float(step[width])
            value += float(step[-1]) * self._span
            system = with_number(system, self.path, value)
        raise Lost(f"Newton's method does not converge, last step {best:.1e}")

    def _between(self, point: _Point, ahead: _Point, step: float) -> list[SpecialPoint]:
        """Folds, flips and tori between two points."""
        tests: dict[str, Callable[[_Point], float]] = {"fold": lambda there: float(there.direction[-1])}
        for kind, test in TESTS_OF_MULTIPLIERS.items():
            tests[kind] = _of_cycle(test)
        found = []
        for kind, test in tests.items():
            before, after = test(point), test(ahead)
            if not (np.isfinite([before, after]).all() and before * after < 0):
                continue
            if kind == "branch_point" and point.direction[-1] * ahead.direction[-1] < 0:
                continue

            def along(part: float, test: Callable[[_Point], float] = test) -> float:
                return test(self._stepped(point, part * step))

            try:
                there = self._stepped(point, step * root(along, before, after, 1e-8))
            except (Lost, InputError):
                continue
            cycle = there.cycle
            found.append(SpecialPoint(kind, there.value, x=range_of(cycle), system=cycle.system, cycle=cycle))
        return found


def _of_cycle(test: Callable[[Any], float]) -> Callable[[_Point], float]:
    """The test of the multipliers of a point's cycle, less the one that is 1 where nothing forces it."""
    return lambda point: test(point.cycle.multipliers[0 if point.cycle.forcing_periods else 1 :])
