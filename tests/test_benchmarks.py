"""The solvers of the benchmark solve what the core solves: the same events by another way."""

from __future__ import annotations

import importlib
from pathlib import Path

import numpy as np
import pytest

import stickslip as ss

FOLDER = Path(__file__).parents[1] / "benchmarks"


@pytest.mark.parametrize("number", range(5))
def test_a_state_machine_by_hand_on_scipy_finds_the_events_of_every_problem(number, monkeypatch):
    monkeypatch.syspath_prepend(FOLDER)
    problem = importlib.import_module("problems").PROBLEMS[number]
    times = importlib.import_module("peers.scipy_events").run(problem, 40.0, 1e-9)
    exact = ss.simulate(problem.system, 40.0).events["t"].to_numpy()
    assert exact.size > 5
    np.testing.assert_allclose(times, exact, atol=1e-9)
