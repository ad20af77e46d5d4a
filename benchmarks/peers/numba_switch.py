"""A compiled switch model: Runge-Kutta of order four with a fixed step in Numba, events located inside the step."""

from __future__ import annotations

import importlib.util
import inspect

import automaton as a
import numba
import numpy as np
from problems import Problem

NAME = "Numba, RK4 with a fixed step, events located"
SETTINGS = {"h = 0.01": 0.01, "h = 0.001": 0.001}


def _compiled_automaton():
    """Return a second copy of `automaton` whose functions Numba compiles, also where they call each other."""
    spec = importlib.util.find_spec("automaton")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for name, function in inspect.getmembers(module, inspect.isfunction):
        setattr(module, name, numba.njit(function))
    return module


_a = _compiled_automaton()
_acceleration, _guards, _follow = _a.acceleration, _a.guards, _a.follow


@numba.njit
def _step(t, x, v, h, p, m):
    if m[a.DIRECTION] == 0.0:
        return x + p[a.DRIVE] * h, v
    a1 = _acceleration(t, x, v, p, m)
    v2 = v + 0.5 * h * a1
    a2 = _acceleration(t + 0.5 * h, x + 0.5 * h * v, v2, p, m)
    v3 = v + 0.5 * h * a2
    a3 = _acceleration(t + 0.5 * h, x + 0.5 * h * v2, v3, p, m)
    v4 = v + h * a3
    a4 = _acceleration(t + h, x + h * v3, v4, p, m)
    return x + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4), v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)


@numba.njit
def _locate(t, x, v, h, guard, p, m):
    """Length of the step at whose end the guard is zero, by the Illinois rule."""
    low, high = 0.0, h
    g_low = _guards(t, x, v, p, m)[guard]
    end = _step(t, x, v, h, p, m)
    g_high = _guards(t + h, end[0], end[1], p, m)[guard]
    for _ in range(60):
        if g_low <= 0.0 or high - low < 1e-14:
            break
        middle = high - g_high * (high - low) / (g_high - g_low)
        end = _step(t, x, v, middle, p, m)
        g = _guards(t + middle, end[0], end[1], p, m)[guard]
        if abs(g) < 1e-15:
            return middle
        if g < 0.0:
            high, g_high, g_low = middle, g, 0.5 * g_low if g_high < 0.0 else g_low
        else:
            low, g_low, g_high = middle, g, 0.5 * g_high
    return high


@numba.njit
def _run(p, end, h, times):
    m = np.zeros(a.MODE_SIZE)
    t, x, v, count = 0.0, 0.0, p[a.DRIVE], 0
    before = _guards(t, x, v, p, m)
    while t < end and count < times.size:
        x1, v1 = _step(t, x, v, h, p, m)
        after = _guards(t + h, x1, v1, p, m)
        first, length = -1, 2.0 * h
        for guard in range(3):
            if before[guard] > 0.0 and after[guard] <= 0.0:
                at = _locate(t, x, v, h, guard, p, m)
                if at < length:
                    first, length = guard, at
        if first < 0:
            t, x, v, before = t + h, x1, v1, after
            continue
        x, v = _step(t, x, v, length, p, m)
        t += length
        times[count] = t
        count += 1
        v = _follow(first, t, x, v, p, m)[1]
        before = _guards(t, x, v, p, m)
    return times[:count]


def run(problem: Problem, end: float, step: float) -> np.ndarray:
    times = _run(problem.parameters, end, step, np.empty(int(10 * end) + 100))
    return times[times <= end]
