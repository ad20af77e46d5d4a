"""The loop every general solver needs: integrate to an event, ask `automaton` what follows, go on."""

from __future__ import annotations

import math
from collections.abc import Callable

import automaton as a
import numpy as np
from problems import Problem

# From (t, y) to the first falling guard or the end: (t, y, number of the guard or -1).
Segment = Callable[[float, np.ndarray, float], tuple[float, np.ndarray, int]]


def event_times(problem: Problem, end: float, prepare: Callable[[np.ndarray, np.ndarray], Segment]) -> np.ndarray:
    """Times of all events; `prepare` gets the parameters and the mode, which the loop keeps up to date."""
    p, m = problem.parameters, np.zeros(a.MODE_SIZE)
    segment = prepare(p, m)
    t, y, times = 0.0, np.array([0.0, p[a.DRIVE]]), []
    while True:
        t, y, guard = segment(t, y, end)
        if guard < 0:
            return np.array(times)
        times.append(t)
        _, y[1] = a.follow(guard, t, y[0], y[1], p, m)


def largest_step(p: np.ndarray) -> float:
    """A step a careful user allows at most, so that no break-away hides in one: a fortieth of the faster period."""
    return 2 * math.pi / 40 / max(1.0, p[a.FREQUENCY] if p[a.AMPLITUDE] else 1.0)
