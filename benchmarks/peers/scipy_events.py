"""scipy.integrate.solve_ivp with terminal events."""

from __future__ import annotations

import automaton as a
import numpy as np
from problems import Problem
from scipy.integrate import solve_ivp

from . import by_hand

NAME = "scipy solve_ivp, DOP853 with events"
SETTINGS = {"rtol 1e-8": 1e-8, "rtol 1e-12": 1e-12}


def run(problem: Problem, end: float, tolerance: float) -> np.ndarray:
    def prepare(p: np.ndarray, m: np.ndarray) -> by_hand.Segment:
        def rhs(t: float, y: np.ndarray) -> list[float]:
            stuck = m[a.DIRECTION] == 0.0
            return [p[a.DRIVE] if stuck else y[1], a.acceleration(t, y[0], y[1], p, m)]

        def guard(number: int):
            def value(t: float, y: np.ndarray) -> float:
                return a.guards(t, y[0], y[1], p, m)[number]

            value.terminal, value.direction = True, -1
            return value

        events = [guard(number) for number in range(3)]
        options = {"method": "DOP853", "rtol": tolerance, "atol": 1e-2 * tolerance, "max_step": by_hand.largest_step(p)}

        def segment(t: float, y: np.ndarray, end: float) -> tuple[float, np.ndarray, int]:
            run = solve_ivp(rhs, (t, end), y, events=events, **options)
            for number, (at, state) in enumerate(zip(run.t_events, run.y_events, strict=True)):
                if at.size:
                    return at[-1], state[-1], number
            return end, run.y[:, -1], -1

        return segment

    return by_hand.event_times(problem, end, prepare)
