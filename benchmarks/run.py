"""Every problem with every solver, side by side in one run; -o FILE puts the tables into docs/evidence/speed.md."""

from __future__ import annotations

import argparse
import os
import platform
import re
from importlib.metadata import version
from pathlib import Path

import derivatives
import numpy as np
import regimes
import sweep
from peers import numba_switch, odeint, pathsim_events, scipy_events, smoothed_lsoda, stickslip_core, sundae, timed
from problems import PROBLEMS, Problem

PEERS = (stickslip_core, odeint, numba_switch, scipy_events, sundae, pathsim_events, smoothed_lsoda)


def machine() -> str:
    """On what it ran."""
    known = Path("/proc/cpuinfo")
    model = re.search(r"model name\s*:\s*(.*)", known.read_text() if known.exists() else "")
    packages = ("stickslip", "numpy", "scipy", "numba", "scikit-sundae", "pathsim")
    parts = [model.group(1) if model else platform.machine(), f"{os.cpu_count()} cores"]
    parts += [f"Python {platform.python_version()}", *(f"{name} {version(name)}" for name in packages)]
    return ", ".join(parts)


def compare(problem: Problem, rounds: int) -> list[str]:
    """The table of one problem, as lines."""
    exact = odeint.reference(problem, problem.horizon)
    errors, best = {}, {}
    for peer in PEERS:
        for label, setting in peer.SETTINGS.items():
            times = peer.run(problem, problem.horizon, setting)
            if times is None:
                continue
            truth = peer.reference(problem, problem.horizon) if peer is smoothed_lsoda else exact
            same = times.size == truth.size
            errors[peer, label] = (
                f"{np.abs(times - truth).max():.1e}" if same else f"{times.size} of {truth.size} found"
            )
    # Every solver goes the same way, so its seconds are shared out over the events that there are.
    events = exact.size / problem.horizon
    for _ in range(rounds):
        for peer, label in errors:
            end = problem.horizon * getattr(peer, "LONG", 1)
            seconds = timed(peer, problem, end, peer.SETTINGS[label]) / (events * end)
            best[peer, label] = min(seconds, best.get((peer, label), np.inf))
    own = best[stickslip_core, ""]
    lines = ["| solver | setting | error of the event times | ns an event | ratio |", "|---|---|---|---|---|"]
    for (peer, label), error in errors.items():
        seconds = best[peer, label]
        lines.append(f"| {peer.NAME} | {label} | {error} | {1e9 * seconds:,.0f} | {seconds / own:,.0f} |")
    return [f"{exact.size} events in {problem.horizon:g} time units.", "", *lines]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, help="page whose tables are replaced")
    parser.add_argument("--rounds", type=int, default=3, help="interleaved rounds, the best of which counts; default 3")
    parser.add_argument("--side", type=int, default=1000, help="points along each side of the regime map; default 1000")
    options = parser.parse_args()
    lines = [f"Run on {machine()}.", ""]
    tables = [(problem.name, lambda problem=problem: compare(problem, options.rounds)) for problem in PROBLEMS]
    tables.append(("Derivatives through every event", lambda: derivatives.compare(options.rounds)))
    tables.append(("A sweep of 1000 frequencies", lambda: sweep.compare(options.rounds)))
    tables.append(("A regime map", lambda: regimes.compare(options.side)))
    for name, table in tables:
        lines += [f"### {name}", "", *table(), ""]
        print("\n".join(lines[lines.index(f"### {name}") :]), flush=True)
    if options.output:
        before, rest = options.output.read_text(encoding="utf-8").split("<!-- tables -->")
        after = rest.split("<!-- end of tables -->")[1]
        page = [before + "<!-- tables -->", "", *lines, "<!-- end of tables -->" + after]
        options.output.write_text("\n".join(page), encoding="utf-8")


if __name__ == "__main__":
    main()
