"""Case S3b, the damped belt oscillator with static and kinetic friction: here and with scipy's solve_ivp, side by side.

Both sides compute the same periods in the same process, in interleaved rounds; the smallest time of a round counts.
"""

from __future__ import annotations

import time

import numpy as np
from scipy.integrate import solve_ivp

import stickslip as ss

BREAK_AWAY, KINETIC, DAMPING, DRIVE = 1.0, 0.6, 0.1, 0.2
PERIOD = 7.634600998573922  # closed form, validation case S3b


def by_stickslip(periods: int) -> np.ndarray:
    """Times of release."""
    law = ss.laws.StaticKinetic(BREAK_AWAY, KINETIC)
    system = ss.Oscillator(damping=DAMPING, drive_velocity=DRIVE, law=law)
    orbit = ss.simulate(system, (periods + 1) * PERIOD)
    return orbit.events["t"].to_numpy()[::2]


def by_solve_ivp(periods: int, rtol: float) -> np.ndarray:
    """Times of release, with the modes written by hand: integrate to the event, switch, go on."""

    def stick(_t: float, _y: np.ndarray) -> list[float]:
        return [DRIVE, 0.0]

    def slip(_t: float, y: np.ndarray) -> list[float]:
        return [y[1], KINETIC - DAMPING * y[1] - y[0]]

    def margin(_t: float, y: np.ndarray) -> float:
        return BREAK_AWAY - (DAMPING * DRIVE + y[0])

    def slip_velocity(t: float, y: np.ndarray) -> float:
        return DRIVE - y[1] if t > start + 1e-6 else 1.0

    margin.terminal = slip_velocity.terminal = True  # type: ignore[attr-defined]
    slip_velocity.direction = -1  # type: ignore[attr-defined]
    start, state, releases = 0.0, [0.0, DRIVE], []
    end = (periods + 1) * PERIOD
    options = {"method": "DOP853", "rtol": rtol, "atol": rtol * 1e-2}
    while True:
        stuck = solve_ivp(stick, (start, end), state, events=margin, **options)
        if not stuck.t_events[0].size:
            return np.array(releases)
        start, state = stuck.t_events[0][0], [stuck.y_events[0][0][0], DRIVE]
        releases.append(start)
        slid = solve_ivp(slip, (start, end), state, events=slip_velocity, **options)
        if not slid.t_events[0].size:
            return np.array(releases)
        start, state = slid.t_events[0][0], [slid.y_events[0][0][0], DRIVE]


def error(releases: np.ndarray) -> float:
    """Relative error of the mean period after the first ones."""
    return abs((releases[-1] - releases[2]) / (releases.size - 3) / PERIOD - 1)


def main(rounds: int = 3) -> list[dict[str, float | str]]:
    """Print and return the table: solver, error of the period, microseconds a period, ratio."""
    solvers = [("stickslip", 100_000, lambda n: by_stickslip(n))]
    solvers += [
        (f"solve_ivp DOP853, rtol {rtol:g}", 20, lambda n, rtol=rtol: by_solve_ivp(n, rtol)) for rtol in (1e-8, 3e-14)
    ]
    best = {name: np.inf for name, *_ in solvers}
    errors = {}
    for _ in range(rounds):
        for name, periods, run in solvers:
            begin = time.perf_counter()
            releases = run(periods)
            best[name] = min(best[name], (time.perf_counter() - begin) / periods)
            errors[name] = error(releases)
    rows = []
    print(f"{'solver':32s}{'error of the period':>22s}{'µs a period':>14s}{'ratio':>10s}")
    for name, *_ in solvers:
        ratio = best[name] / best["stickslip"]
        rows.append({"solver": name, "error": errors[name], "microseconds": best[name] * 1e6, "ratio": ratio})
        print(f"{name:32s}{errors[name]:22.1e}{best[name] * 1e6:14.3f}{ratio:10.0f}")
    return rows


if __name__ == "__main__":
    main()
