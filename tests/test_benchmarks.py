"""The benchmarks run, and their solvers solve what the core solves: the same events by another way."""

from __future__ import annotations

import importlib
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from browser import chromium

import stickslip as ss

FOLDER = Path(__file__).parents[1] / "benchmarks"


@pytest.fixture(autouse=True)
def _on_the_path(monkeypatch):
    monkeypatch.syspath_prepend(FOLDER)


@pytest.mark.parametrize("number", range(5))
def test_a_state_machine_by_hand_on_scipy_finds_the_events_of_every_problem(number):
    problem = importlib.import_module("problems").PROBLEMS[number]
    times = importlib.import_module("peers.scipy_events").run(problem, 40.0, 1e-9)
    exact = ss.simulate(problem.system, 40.0).events["t"].to_numpy()
    assert exact.size > 5
    np.testing.assert_allclose(times, exact, atol=1e-9)


@pytest.mark.slow
def test_every_table_of_the_benchmark_is_made_at_its_smallest_size(monkeypatch, tmp_path, capsys):
    # The peers that `make bench` installs or compiles are absent: the core stands in for them, and so for the reference.
    problems, core = (importlib.import_module(name) for name in ("problems", "peers.stickslip_core"))
    monkeypatch.setattr(core, "LONG", 1)
    for name in ("odeint", "numba_switch", "sundae", "pathsim_events"):
        absent = ModuleType(name)
        absent.NAME, absent.SETTINGS, absent.run = name, {"": None}, core.run
        absent.reference = lambda problem, end, **_: core.run(problem, end, None)
        monkeypatch.setitem(sys.modules, f"peers.{name}", absent)
        monkeypatch.setattr(importlib.import_module("peers"), name, absent, raising=False)
    monkeypatch.setattr(problems, "PROBLEMS", tuple(replace(problem, horizon=60.0) for problem in problems.PROBLEMS))
    run, derivatives, regimes, sweep = map(importlib.import_module, ("run", "derivatives", "regimes", "sweep"))
    monkeypatch.setattr(run, "version", lambda _: "none")
    monkeypatch.setattr(derivatives, "EVENTS", 5)
    monkeypatch.setattr(derivatives, "REPEATS", 1)
    monkeypatch.setattr(regimes, "POINTS", 2)
    monkeypatch.setattr(sweep, "FREQUENCIES", sweep.FREQUENCIES[:20])
    page = tmp_path / "speed.md"
    page.write_text("before\n<!-- tables -->\nFORMER\n<!-- end of tables -->\nafter\n", encoding="utf-8")
    monkeypatch.setattr(sys, "argv", ["run.py", "--rounds", "1", "--side", "4", "-o", str(page)])
    run.main()
    made = page.read_text(encoding="utf-8")
    assert made.startswith("before")
    assert made.endswith("after\n")
    assert "FORMER" not in made
    tables = capsys.readouterr().out.split("### ")[1:]
    assert len(tables) == len(problems.PROBLEMS) + 3
    for table in tables:
        rows = [line for line in table.splitlines() if line.startswith("|")]
        assert len(rows) > 3, table
        assert len({row.count("|") for row in rows}) == 1, table
        assert table.strip() in made
    # Solvers that are the core itself make no error.
    assert all(" 0.0e+00 " in table for table in tables[: len(problems.PROBLEMS)])


@pytest.mark.slow
def test_the_benchmark_of_the_explorer_prints_a_line_a_preset(monkeypatch, capsys):
    chromium()
    explorer = importlib.import_module("explorer")
    monkeypatch.setattr(explorer, "PRESETS", explorer.PRESETS[:1])
    explorer.main()
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 1
    assert lines[0].startswith(f"{explorer.PRESETS[0]}: slider to plots")
