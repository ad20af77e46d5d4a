"""A regime map of the forced belt over amplitude and frequency, whole, beside the best compiled peer on points of it."""

from __future__ import annotations

import math
import os
import time
from dataclasses import replace

import numpy as np
from peers import odeint, timed
from problems import PROBLEMS, Problem

import stickslip as ss

BASE = PROBLEMS[-1].system
TRANSIENT = 300
WINDOW = 32
TOLERANCE = 1e-6
POINTS = 40


def compare(side: int) -> list[str]:
    """The table, as lines, of a map of `side` times `side` points."""
    over = {
        "forcing.amplitude": np.linspace(0.02, 1.6, side),
        "forcing.frequency": np.linspace(0.3, 2.3, side),
    }
    begin = time.perf_counter()
    chart = ss.regime_map(BASE, over, transient=TRANSIENT, window=WINDOW)
    taken = time.perf_counter() - begin
    cores = os.cpu_count() or 1
    events = int(chart["events"].sum())

    # The peer runs from the start to the end of the window, and looks at nothing on the way.
    seconds, found = 0.0, 0
    for index in np.linspace(0, side * side - 1, POINTS).astype(int):
        amplitude, frequency = (values[i] for values, i in zip(over.values(), divmod(index, side), strict=True))
        problem = Problem("point", replace(BASE, forcing=ss.Harmonic(amplitude, frequency)), 0.0)
        end = (TRANSIENT + WINDOW) * 2 * math.pi / frequency
        seconds += timed(odeint, problem, end, TOLERANCE)
        found += odeint.run(problem, end, TOLERANCE).size

    def row(name: str, setting: str, points: str, an_event: float) -> str:
        return (
            f"| {name} | {setting} | {points} | {1e9 * an_event:,.0f} | {1 / an_event:,.0f} | {an_event / own:,.0f} |"
        )

    own = taken * cores / events
    return [
        f"{side} × {side} points, each {TRANSIENT} periods of the forcing left out and {WINDOW} looked at: "
        f"{events:,} events in {taken:.1f} s on {cores} cores.",
        "",
        "| solver | setting | points | ns an event and core | events a second and core | ratio |",
        "|---|---|---|---|---|---|",
        row("stickslip, regimes told", "", f"{side * side:,}", own),
        row(odeint.NAME, f"tolerance {TOLERANCE:g}", f"{POINTS}", seconds / found),
    ]
