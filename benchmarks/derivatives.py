"""What the derivatives of a motion through all of its events cost, beside the motion itself."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from problems import PROBLEMS

import stickslip as ss
from stickslip.dynamics.periodic.event_sequence import EventSequence

EVENTS = 150
REPEATS = 20


def _seconds(run: Callable[[], object], rounds: int) -> float:
    best = np.inf
    for _ in range(rounds * REPEATS):
        begin = time.perf_counter()
        run()
        best = min(best, time.perf_counter() - begin)
    return best


def compare(rounds: int) -> list[str]:
    """The table, as lines."""
    lines = [
        f"The first {EVENTS} phases of each oscillator, with the derivatives of every event by the whole state at the start,",
        "and by the damping too.",
        "",
        "| oscillator | motion, µs | derivatives, µs | ratio | by the damping too, µs | ratio |",
        "|---|---|---|---|---|---|",
    ]
    for problem in PROBLEMS:
        whole, _, _ = EventSequence.of_run(problem.system, problem.horizon, max_events=EVENTS + 1)
        sequence = replace(whole, phases=whole.phases[:EVENTS].copy(), last=whole.modes[EVENTS].copy())
        end = float(sequence.phases["duration"].sum())
        runs = (
            lambda system=problem.system, end=end: ss.simulate(system, end),
            lambda sequence=sequence: sequence.follow(),
            lambda sequence=sequence: sequence.follow("/damping"),
        )
        motion, by_start, by_both = (1e6 * _seconds(run, rounds) for run in runs)
        lines.append(
            f"| {problem.name} | {motion:,.0f} | {by_start:,.0f} | {by_start / motion:,.0f} "
            f"| {by_both:,.0f} | {by_both / motion:,.0f} |"
        )
    return lines
