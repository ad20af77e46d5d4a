"""The flow of laws with an internal state and its derivatives: the variational equation along with the motion."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from stickslip import _core
from stickslip.dynamics.periodic.event_sequence import read, with_number
from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.model.drive import Drive
from stickslip.model.system import Oscillator, System
from stickslip.simulation.scipy_solver import USUAL, Counted, Run, solved

#: The relative error of a step, and the step of the differences that make the Jacobian, relative to the size of a variable.
TOLERANCE, STEP = 1e-11, 1e-7
#: So many evaluations a motion may take. What takes more is lost in the rounding of forces over a tiny mass, and would fill
#: the memory, as each of its steps is kept.
_MOST = 200_000
#: The matrices of so many numbers are held at one time.
_MOST_NUMBERS = 4_000_000
#: At so many times a motion is looked at.
_LOOKS = 201
#: Gauss's method of two stages on (0, 1): nodes, weights within a step.
_ROOT = math.sqrt(3.0) / 6
_NODES = np.array([0.5 - _ROOT, 0.5 + _ROOT])
_WITHIN = np.array([[0.25, 0.25 - _ROOT], [0.25 + _ROOT, 0.25]])


@dataclass
class StateFlow:
    """ẏ = f(t, y) in the variables y = (x, q, z) of the core, and its derivatives.

    The motion is integrated by LSODA, the variational equation Φ̇ = (∂f/∂y) Φ along it by Gauss's method of order four on
    the same steps, with ∂f/∂y by central differences.

    Attributes
    ----------
    sizes : what counts as large in each variable, shape (w,).
    path : the number of the system whose derivative comes along; None for none.
    tolerance : relative error of a step; step : of the differences, relative to `sizes`; parts : of each step of the motion
        for the variational equation.
    """

    system: Oscillator | System
    sizes: Array
    path: str | None = None
    tolerance: float = TOLERANCE
    step: float = STEP
    parts: int = 2

    def __post_init__(self) -> None:
        self._core = core_of(self.system)
        self._beside: list[_core.StateSystem] = []
        if self.path is not None:
            value = read(self.system, self.path)
            self._width = 1e-6 * max(abs(value), 1e-6)
            ends = [with_number(self.system, self.path, value + sign * self._width) for sign in (-1.0, 1.0)]
            self._beside = [core_of(system) for system in ends]

    @property
    def width(self) -> int:
        """How many variables."""
        return len(self.sizes)

    def rates(self, t: float, y: Array) -> Array:
        """dy/dt."""
        return self._core.rates(t, np.ascontiguousarray(y))

    def velocities(self, t: float, y: Array) -> Array:
        """Velocities mass by mass."""
        return self._core.states(np.array([t]), np.ascontiguousarray(y))[0]

    def jacobians(self, t: Array, y: Array) -> Array:
        """∂f/∂y along a motion, for states of shape (n, w); shape (n, w, w)."""
        columns = []
        for index, size in enumerate(self.sizes):
            ends = []
            for sign in (-1.0, 1.0):
                moved = y.copy()
                moved[:, index] += sign * self.step * size
                ends.append((moved[:, index], _slopes(self._core, t, moved)))
            columns.append((ends[1][1] - ends[0][1]) / (ends[1][0] - ends[0][0])[:, None])
        return np.stack(columns, axis=2)

    def tangents(self, start: Array, t: float, duration: float, basis: Array) -> tuple[Array, Array]:
        """Where the motion is after a duration, and what becomes of small disturbances there: Φ basis, shape (w, m).

        With a `path` the derivative with respect to its number is one more column.
        """
        run = self._run(start, t, duration)
        taken = np.array(run.times)
        nodes = taken[:-1, None] + np.diff(taken)[:, None] * np.arange(self.parts) / self.parts
        columns, along = basis / self.sizes[:, None], np.zeros(self.width)
        for step in self._steps(run, np.append(nodes, taken[-1])):
            columns = columns + step[:, :-1] @ columns
            along = along + step[:, :-1] @ along + step[:, -1]
        if self._beside:
            columns = np.column_stack([columns, along])
        return run.end, columns * self.sizes[:, None]

    def along(self, start: Array, duration: float) -> Array:
        """The motion from t = 0 on at equal times, shape (n, w)."""
        return np.asarray(self._run(start, 0.0, duration).solution(np.linspace(0.0, duration, _LOOKS)).T)

    def derivatives(self, start: Array, t: float, duration: float, fastest: float) -> tuple[Array, Iterator[Array]]:
        """Where the motion is after a duration, and the derivatives over parts of it, in units of the sizes.

        The parts are so short that no small disturbance grows or shrinks much, but of rates above the `fastest`.
        """
        run = self._run(start, t, duration)
        taken = np.array(run.times)
        states = np.ascontiguousarray(run.solution(taken).T)
        rates = np.abs(np.linalg.eigvals(self._scaled(taken, states))).max(axis=1)
        lengths = np.diff(taken)
        turns = lengths * np.maximum(rates[:-1], rates[1:])
        counts = np.maximum(self.parts, np.ceil(np.minimum(turns, fastest * lengths))).astype(int)
        # Gauss's method knows the decay over a quarter of a turn to 1e-5, and the Jacobian hardly changes within a part.
        halvings = np.ceil(np.log2(np.maximum(4 * turns / counts, 1.0))).astype(int)
        within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        begins = np.repeat(taken[:-1], counts) + within * np.repeat(lengths / counts, counts)
        steps = self._steps(run, np.append(begins, taken[-1]), np.repeat(halvings, counts))
        return run.end, (np.eye(self.width) + step[:, :-1] for step in steps)

    def _scaled(self, t: Array, y: Array) -> Array:
        """Jacobians of disturbances in units of the sizes, so that none is small beside another."""
        return self.jacobians(t, y) * self.sizes / self.sizes[:, None]

    def _steps(self, run: Run, nodes: Array, halvings: Array | None = None) -> Iterator[Array]:
        """What the steps between nodes add to disturbances, and, in the last column, what the path does.

        A step may be that of a part of it, halved so often, taken as often again.
        """
        w, most = self.width, max(1, _MOST_NUMBERS // (2 * self.width) ** 2)
        for first in range(0, len(nodes) - 1, most):
            begins = nodes[first : first + most + 1]
            lengths = np.diff(begins)
            n = len(lengths)
            times = (begins[:-1, None] + lengths[:, None] * _NODES).ravel()
            states = np.ascontiguousarray(run.solution(times).T)
            jacobians = self._scaled(times, states).reshape(n, 2, w, w)
            forces = np.zeros((n, 2, w))
            if self._beside:
                ends = [_slopes(core, times, states) for core in self._beside]
                forces = ((ends[1] - ends[0]) / (2 * self._width) / self.sizes).reshape(n, 2, w)
            halved = np.zeros(n, int) if halvings is None else halvings[first : first + most]
            lengths = lengths / 2.0**halved
            # k_i = J_i (y + h Σ a_ij k_j) + g_i for both stages at once.
            blocks = lengths[:, None, None, None, None] * _WITHIN[:, :, None, None] * jacobians[:, :, None]
            matrix = np.eye(2 * w) - blocks.transpose(0, 1, 3, 2, 4).reshape(n, 2 * w, 2 * w)
            right = np.concatenate([jacobians.reshape(n, 2 * w, w), forces.reshape(n, 2 * w, 1)], axis=2)
            stages = np.linalg.solve(matrix, right).reshape(n, 2, w, w + 1)
            steps = lengths[:, None, None] * stages.sum(axis=1) / 2
            for done in range(halved.max(initial=0)):
                again = halved > done
                steps[again] = 2 * steps[again] + steps[again, :, :-1] @ steps[again]
            yield from steps

    def _run(self, start: Array, t: float, duration: float) -> Run:
        for method in USUAL:
            rates = Counted(self.rates, _MOST)
            run = solved(method, rates, (t, t + duration), start, rtol=self.tolerance, atol=self.tolerance * self.sizes)
            if run.stop == "t_end":
                return run
            why = f"{run.why.rstrip('.').lower()}; take another start"
            if run.stop == "max_evaluations":
                why = f"it takes more than {_MOST} evaluations; take a larger mass, or damping"
        raise InputError(f"the motion could not be integrated from t = {t:g} over {duration:g}: {why}")


def _slopes(core: _core.StateSystem, t: Array, y: Array) -> Array:
    return core.slopes(np.ascontiguousarray(t), np.ascontiguousarray(y).ravel()).reshape(y.shape)


def core_of(system: Oscillator | System) -> _core.StateSystem:
    """The right-hand side of a system."""
    for contact in system.contacts:
        if isinstance(contact.drive_velocity, Drive) and contact.drive_velocity.nodes:
            raise InputError("a drive along a table has no period; take a constant or a harmonic one")
    return _core.StateSystem(system.to_system().to_json())
