"""Each goal of speed beside what this machine needs: processor time, of interleaved rounds the best.

Others may keep the cores busy: what is read is the time that this process was on one. The rest, which needs no Python, is
`cargo run --release --example cost`.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from problems import PAPER, PROBLEMS
from regimes import TRANSIENT, WINDOW

import stickslip as ss
from stickslip.dynamics.periodic.event_sequence import EventSequence

BRANCHES = ss.laws.PiecewiseLinear([(0, 1), (0.2, 0.6), (0.3, 0.61)], 1.0)
#: What is measured, the call, what its time is divided by, and what is wanted in ns: with AVX-512, and with AVX2.
Goal = tuple[str, Callable[[], object], float, float, float]


def orbit(system: ss.Oscillator, events: int = 10_000) -> tuple[Callable[[], object], float]:
    """A run of about so many events, and how many it has."""
    end = 100.0 * events / len(ss.simulate(system, 100.0).events)
    return lambda: ss.simulate(system, end), float(ss.simulate(system, end).work.events)


def goals(side: int) -> list[Goal]:
    """What is measured, in ns each."""
    static, smooth, _, _, forced = (problem.system for problem in PROBLEMS)
    p1 = replace(forced, forcing=())
    branches = replace(p1, law=BRANCHES)
    found: list[Goal] = []
    for name, system, wanted in (
        ("static and kinetic, an event", static, 125),
        ("the same, P1 = (1, 0.5), d = 0.05, s = 0.3", p1, 125),
        ("two linear branches, an event", branches, 160),
        ("forced, an event", forced, 250),
        ("paper's law, s = 0.2, an event", PAPER.oscillator(0.2), 230),
        ("paper's law, s = 0.3, an event", PAPER.oscillator(0.3), 230),
        ("1/(1 + 3w), an event", smooth, 6000),
        (
            "exponential Stribeck, an event (11,800 before)",
            replace(p1, law=ss.laws.ExponentialStribeck(1.0, 0.5, 0.1, 0.2)),
            np.nan,
        ),
    ):
        run, events = orbit(system)
        found.append((name, run, events, wanted, wanted))

    # Ten events of a run from Python, its table, and samples.
    short = 10.0 * 40.0 / len(ss.simulate(static, 40.0).events)
    found.append(("`simulate` of ten events", lambda: ss.simulate(static, short), 1.0, 8000, 8000))
    fresh = iter([ss.simulate(static, short) for _ in range(4000)])
    found.append(("`orbit.events` of ten", lambda: next(fresh).events, 1.0, 20_000, 20_000))
    long = ss.simulate(static, 1000.0)
    times = np.linspace(0.0, 1000.0, 100_000)
    found.append(("`orbit.at`, unforced, a time", lambda: long.at(times), times.size, 40, 40))

    # Derivatives by the 13 numbers of the start and seven of the document, all of which are unknowns of one pass.
    numbers = ["/mass", "/stiffness", "/damping", "/drive_velocity"]
    for name, system, law in (
        ("forced", forced, ["/forcing/0/amplitude", "/law/break_away", "/law/kinetic"]),
        ("paper's law", PAPER.oscillator(0.3), ["/law/B/1", "/law/D/1", "/law/static_friction/limit"]),
    ):
        whole, _, _ = EventSequence.of_run(system, 1000.0, max_events=151)
        sequence = replace(whole, phases=whole.phases[:150].copy(), last=whole.modes[150].copy())
        unknowns = numbers + law
        found.append(
            (
                f"derivatives, {name}, a phase and unknown",
                lambda sequence=sequence, unknowns=unknowns: sequence.follow(*unknowns),
                150.0 * (sequence.layout.width + len(unknowns)),
                100,
                100,
            )
        )

    over = {"forcing.frequency": np.linspace(0.2, 2.0, 1000)}
    # As many events as 400 periods of each column have.
    columns = lambda: ss.simulate_many(forced, over, 2910.0, transient=0.0, section="release", keep=1, workers=1)  # noqa: E731
    found.append(("sweep of 1000 frequencies, an event", columns, float(columns()["events"].sum()), 45, 75))
    curved = replace(forced, law=ss.laws.ExponentialStribeck(1.0, 0.5, 0.1, 0.2))
    fewer = {"forcing.frequency": np.linspace(0.2, 2.0, 96)}
    curves = lambda: ss.simulate_many(curved, fewer, 291.0, transient=0.0, section="release", keep=1, workers=1)  # noqa: E731
    found.append(
        ("sweep under exponential Stribeck, an event", curves, float(curves()["events"].sum()), np.nan, np.nan)
    )
    ranges = {"forcing.amplitude": np.linspace(0.02, 1.6, side), "forcing.frequency": np.linspace(0.3, 2.3, side)}
    chart = lambda: ss.regime_map(forced, ranges, transient=TRANSIENT, window=WINDOW, workers=1)  # noqa: E731
    events = float(chart()["events"].sum())
    # A map of a million points on two cores: 30 s, 45 s.
    share = 1e9 * 2 / events * side * side / 1e6
    found.append((f"map, {side} × {side}, an event", chart, events, 30 * share, 45 * share))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--rounds", type=int, default=20, help="interleaved rounds, the best of which counts; default 20"
    )
    parser.add_argument("--side", type=int, default=60, help="points along each side of the regime map; default 60")
    options = parser.parse_args()
    found = goals(options.side)
    best = [np.inf] * len(found)
    for _ in range(options.rounds):
        for i, (_, run, share, *_) in enumerate(found):
            for _ in range(3):
                begin = time.process_time_ns()
                run()
                best[i] = min(best[i], (time.process_time_ns() - begin) / share)
    print("| what | ns | wanted with AVX-512 (AVX2) |\n|---|---:|---:|")
    for (name, _, _, wide, narrow), least in zip(found, best, strict=True):
        print(f"| {name} | {least:,.1f} | {wide:,.0f} ({narrow:,.0f}) |")


if __name__ == "__main__":
    main()
