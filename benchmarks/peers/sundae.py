"""scikit-sundae: CVODE of SUNDIALS with its root functions."""

from __future__ import annotations

import automaton as a
import numpy as np
from problems import Problem
from sksundae.cvode import CVODE

from . import by_hand

NAME = "scikit-sundae, CVODE Adams with roots"
SETTINGS = {"rtol 1e-8": 1e-8, "rtol 1e-11": 1e-11}


def run(problem: Problem, end: float, tolerance: float) -> np.ndarray:
    def prepare(p: np.ndarray, m: np.ndarray) -> by_hand.Segment:
        def rhs(t: float, y: np.ndarray, yp: np.ndarray) -> None:
            yp[0] = p[a.DRIVE] if m[a.DIRECTION] == 0.0 else y[1]
            yp[1] = a.acceleration(t, y[0], y[1], p, m)

        def guards(t: float, y: np.ndarray, values: np.ndarray) -> None:
            values[:] = a.guards(t, y[0], y[1], p, m)

        guards.terminal, guards.direction = [True] * 3, [-1] * 3
        options = {
            "method": "Adams",
            "rtol": tolerance,
            "atol": 1e-2 * tolerance,
            "max_step": by_hand.largest_step(p),
            "max_num_steps": 1_000_000,
        }
        solver = CVODE(rhs, eventsfn=guards, num_events=3, **options)

        def segment(t: float, y: np.ndarray, end: float) -> tuple[float, np.ndarray, int]:
            run = solver.solve(np.array([t, end]), y)
            if run.status != 2:  # not an event; `t_events` keeps those of earlier segments
                return end, run.y[-1], -1
            return run.t_events[-1], np.array(run.y_events[-1]), int(np.argmin(run.i_events[-1]))

        return segment

    return by_hand.event_times(problem, end, prepare)
