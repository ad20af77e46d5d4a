"""stickslip itself: closed form, certified events."""

from __future__ import annotations

import time

import numpy as np
from problems import Problem

import stickslip as ss

NAME = "stickslip"
SETTINGS = {"": None}
LONG = 50  # a run that is timed is so many times longer: of ten thousand events


def run(problem: Problem, end: float, _setting: None) -> np.ndarray:
    return ss.simulate(problem.system, end).events["t"].to_numpy()


def seconds(problem: Problem, end: float, _setting: None) -> float:
    """Seconds of the call that computes the orbit; the table of its events is made when it is asked for."""
    begin = time.perf_counter()
    ss.simulate(problem.system, end)
    return time.perf_counter() - begin
