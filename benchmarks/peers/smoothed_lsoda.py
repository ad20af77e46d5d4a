"""A smoothed sign, tanh(w/ε), integrated by LSODA: what many do to avoid events.

There are no events to compare: what it returns are the times at which x rises through the middle of its range.
"""

from __future__ import annotations

import math

import automaton as a
import numpy as np
from problems import Problem
from scipy.integrate import solve_ivp

import stickslip as ss

NAME = "scipy LSODA, sign smoothed to tanh(w/ε)"
SETTINGS = {"ε = 1e-3": 1e-3, "ε = 1e-5": 1e-5}


def _middle(orbit: ss.Orbit) -> float:
    x, _ = orbit.at(np.linspace(0.5 * orbit.t_end, orbit.t_end, 20_001))
    return 0.5 * (x.min() + x.max())


def reference(problem: Problem, end: float) -> np.ndarray:
    """The same times of the exact orbit."""
    orbit = ss.simulate(problem.system, end)
    middle = _middle(orbit)
    t = np.linspace(0.0, end, int(50 * end))
    x, _ = orbit.at(t)
    low, high = t[:-1][(x[:-1] < middle) & (x[1:] >= middle)], t[1:][(x[:-1] < middle) & (x[1:] >= middle)]
    for _ in range(60):
        half = 0.5 * (low + high)
        below = orbit.at(half)[0] < middle
        low, high = np.where(below, half, low), np.where(below, high, half)
    return high


def run(problem: Problem, end: float, width: float) -> np.ndarray | None:
    p = problem.parameters
    if p[a.LAW] == a.TWO_BRANCHES:
        return None  # a force that depends on the sign of dw/dt and on the stick time is no function of w
    middle = _middle(ss.simulate(problem.system, min(end, 200.0)))
    damping, drive, amplitude, frequency = p[: a.LAW]
    first, second, rational = p[a.FIRST], p[a.SECOND], p[a.LAW] == a.RATIONAL

    def rhs(t: float, y: np.ndarray) -> list[float]:
        w = drive - y[1]
        # The peak of static friction has to be wider than the smoothed sign, or it is never reached.
        if rational:
            force = first / (1.0 + second * abs(w))
        else:
            force = second + (first - second) * math.exp(-((w / (30 * width)) ** 2))
        return [y[1], math.tanh(w / width) * force - damping * y[1] - y[0] + amplitude * math.cos(frequency * t)]

    def rising(_t: float, y: np.ndarray) -> float:
        return y[0] - middle

    rising.direction = 1
    return solve_ivp(rhs, (0.0, end), [0.0, drive], method="LSODA", rtol=1e-9, atol=1e-11, events=rising).t_events[0]
