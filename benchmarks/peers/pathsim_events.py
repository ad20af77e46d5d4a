"""PathSim: a block diagram of one ODE block, with zero-crossing events."""

from __future__ import annotations

import automaton as a
import numpy as np
from pathsim import Simulation
from pathsim.blocks import ODE
from pathsim.events import ZeroCrossingDown
from pathsim.solvers import RKDP87
from problems import Problem

from . import by_hand

NAME = "PathSim, RKDP87 with zero crossings"
SETTINGS = {"rtol 1e-8": 1e-8}


def run(problem: Problem, end: float, tolerance: float) -> np.ndarray:
    p, m, times = problem.parameters, np.zeros(a.MODE_SIZE), []

    def rhs(y: np.ndarray, _u: np.ndarray, t: float) -> np.ndarray:
        return np.array([p[a.DRIVE] if m[a.DIRECTION] == 0.0 else y[1], a.acceleration(t, y[0], y[1], p, m)])

    block = ODE(rhs, np.array([0.0, p[a.DRIVE]]))

    def event(number: int) -> ZeroCrossingDown:
        def value(t: float) -> float:
            x, v = block.engine.state
            return a.guards(t, x, v, p, m)[number]

        def act(t: float) -> None:
            x, v = block.engine.state
            times.append(t)
            block.engine.set(np.array([x, a.follow(number, t, x, v, p, m)[1]]))

        return ZeroCrossingDown(func_evt=value, func_act=act, tolerance=tolerance)

    Simulation(
        [block],
        events=[event(number) for number in range(3)],
        dt=1e-3,
        dt_max=by_hand.largest_step(p),
        Solver=RKDP87,
        tolerance_lte_rel=tolerance,
        tolerance_lte_abs=1e-2 * tolerance,
        log=False,
    ).run(end)
    return np.array(times)
