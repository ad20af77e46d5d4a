"""A sweep over the frequency of the forcing: how many columns are wrong, and what an event costs.

Columns that forget their start within rounding, chaotic ones for instance, have no right answer to compare with: those whose
last release moves by more than 1e-8 when the drive velocity changes by 1e-13 of itself are left out.
"""

from __future__ import annotations

import os
import time
from dataclasses import replace
from multiprocessing.pool import ThreadPool

import numpy as np
from peers import numba_switch, odeint, timed
from problems import PROBLEMS, Problem

import stickslip as ss

BASE = PROBLEMS[-1].system
FREQUENCIES = np.linspace(0.2, 2.0, 1000)
END = 2910.0  # as many events as 400 periods of each column have
WRONG = 1e-3  # of the time of the last release
PEERS = ((odeint, "tolerance 1e-6", 1e-6), (odeint, "tolerance 1e-10", 1e-10))
PEERS += ((numba_switch, "h = 0.1", 0.1), (numba_switch, "h = 0.01", 0.01))


def _columns(frequencies: np.ndarray, workers: int = 1, system: ss.Oscillator = BASE) -> tuple[np.ndarray, np.ndarray]:
    """Number of events, and the time of the last release, of every column."""
    runs = ss.simulate_many(
        system,
        {"forcing.frequency": frequencies},
        END,
        transient=0.0,
        section="release",
        keep=1,
        workers=workers,
    )
    return runs["events"].sum("kind").to_numpy(), runs["section_t"].to_numpy()[:, 0]


def _problem(frequency: float) -> Problem:
    return Problem("column", replace(BASE, forcing=ss.Harmonic(BASE.forcing.amplitude, frequency)), END)


def compare(rounds: int) -> list[str]:
    """The table, as lines."""
    seconds = {1: np.inf, 2: np.inf}
    for _ in range(rounds):
        for workers in seconds:
            begin = time.perf_counter()
            events = int(_columns(FREQUENCIES, workers)[0].sum())
            seconds[workers] = min(seconds[workers], time.perf_counter() - begin)
    own = seconds[1] / events

    count, last = _columns(FREQUENCIES)
    nearly = _columns(FREQUENCIES, system=replace(BASE, drive_velocity=BASE.drive_velocity * (1 + 1e-13)))
    steady = (nearly[0] == count) & (np.abs(nearly[1] - last) < 1e-8)
    problems = [_problem(frequency) for frequency in FREQUENCIES[steady]]
    # Each runs in a process of its own, for about a second. Twice this step would be good to 1e-10.
    with ThreadPool(os.cpu_count()) as pool:
        truth = pool.map(lambda problem: odeint.reference(problem, END, step=0.1), problems)
    off = [np.abs(exact - release).min() for exact, release in zip(truth, last[steady], strict=True)]
    # But a slip that just touches zero may do so between two steps: where the two differ, a fine one decides.
    finer = [i for i, distance in enumerate(off) if distance > 1e-9 or truth[i].size != count[steady][i]]
    for i in finer:
        truth[i] = odeint.reference(problems[i], END, step=0.01)
        off[i] = np.abs(truth[i] - last[steady][i]).min()

    def row(name: str, label: str, found: list[tuple[int, float]], an_event: float) -> str:
        pairs = zip(found, truth, strict=True)
        wrong = sum(n != exact.size or np.abs(exact - release).min() > WRONG for (n, release), exact in pairs)
        return f"| {name} | {label} | {wrong} of {len(truth)} | {1e9 * an_event:,.0f} | {an_event / own:,.0f} |"

    lines = [
        f"{events:,} events of 1000 columns in {seconds[1]:.3f} s on one core, "
        f"{seconds[1] / seconds[2]:.2f} times faster on two.",
        f"{steady.sum()} columns are well conditioned. The last release of each is off by {max(off):.1e} at the most; "
        f"the reference took a tenth of its step for {len(finer)} of them.",
        "",
        "| solver | setting | wrong columns | ns an event | ratio |",
        "|---|---|---|---|---|",
        row("stickslip", "", list(zip(count[steady], last[steady], strict=True)), own),
    ]
    for peer, label, setting in PEERS:
        found, taken = [], 0.0
        for problem in problems:
            times = peer.run(problem, END, setting)
            # Releases and captures take turns, the first is a release.
            found.append((times.size, times[-1] if times.size % 2 else times[-2]))
            taken += timed(peer, problem, END, setting)
        lines.append(row(peer.NAME, label, found, taken / sum(exact.size for exact in truth)))
    return lines
