"""Records of known friction as a newcomer's rig gives them, and what is found in them; writes docs/evidence/first-records.md.

    python docs/evidence/first_records.py [--count N]

The records come from the formulas below, which share no line with the package: sticks by a root of load less limit, slips by
scipy's solve_ivp, joints and slides by their torque along a motion that is given, bristles by Euler steps.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import stickslip as ss

PAGE = Path(__file__).with_name("first-records.md")
COUNT = 8
Array = np.ndarray[Any, np.dtype[np.float64]]

INTRODUCTION = """# First records

Five rigs that a newcomer may have, and {count} records or sets of records of each, with noise of their own. The friction in
them is known. Each is measured with a rig of a few lines and identified without a law asked for, as the tutorials do it.
Named are the forms that were chosen, and how many of the 95 % intervals contain the truth.
Intervals are those of the chosen form. The bristles of the slide lag behind where it slows down, which no form has.
Written by `python docs/evidence/first_records.py`.

"""


class Task(NamedTuple):
    """A rig: what is in its records, and the numbers that are looked for."""

    title: str
    truth: dict[str, float]
    find: Callable[[int], tuple[str, pd.DataFrame]]


def stick_slip(
    mass: float, stiffness: float, damping: float, drive: float, length: float, step: float,
    kinetic: Callable[[float], float], limit: Callable[[float], float],
) -> tuple[Array, Array]:  # fmt: skip
    """Time and extension x of the spring in m x″ + d x′ + k x = F, w = s − x′, from the first break-away on."""

    def slip(_: float, y: Array) -> list[float]:
        return [y[1], (kinetic(max(drive - y[1], 0.0)) - damping * y[1] - stiffness * y[0]) / mass]

    def ends(_: float, y: Array) -> float:
        return float(y[1] - drive)

    ends.terminal, ends.direction = True, 1.0  # type: ignore[attr-defined]
    time = np.arange(0, length, step)
    x, t, begin = np.empty_like(time), 0.0, (limit(1.0) - damping * drive) / stiffness
    while t < length:
        run = solve_ivp(
            slip, (t, t + 10.0), [begin, drive - 1e-12], events=ends, rtol=1e-9, atol=1e-13, dense_output=True
        )
        seen = (time >= t) & (time < run.t[-1])
        x[seen] = run.sol(time[seen])[0]
        t, rest = float(run.t[-1]), float(run.y[0, -1])

        def lacks(since: float, rest: float = rest) -> float:
            return stiffness * (rest + drive * since) + damping * drive - limit(since)

        held = brentq(lacks, 0.0, 1e4)
        seen = (time >= t) & (time < t + held)
        x[seen] = rest + drive * (time[seen] - t)
        t, begin = t + held, rest + drive * held
    return time, x


def _law(records: list[Any]) -> tuple[str, pd.DataFrame]:
    found = ss.identify(records)
    parts = (found.law.static, found.law.kinetic) if isinstance(found.law, ss.laws.Combined) else (found.law,)
    return " with ".join(type(part).__name__ for part in parts), found.parameters


def _curve(records: Any) -> tuple[str, pd.DataFrame]:
    found = ss.identify(records)
    return found.chosen, found.parameters


def pulls() -> Task:
    """A slider that is pulled at three speeds by a spring whose force is read; static friction grows with rest."""
    rig = {"instrument": "spring_force", "column": "force", "unit": "N", "mass": 2.3, "stiffness": "0.85 N/mm"}
    speeds = {1e-3: 200.0, 4e-3: 60.0, 12e-3: 60.0}

    def kinetic(w: float) -> float:
        return float(9 + 2 * np.exp(-w / 0.02) + 33 * w)

    def limit(rest: float) -> float:
        return float(12 + 0.8 * np.log1p(rest / 0.3))

    known = [(v, *stick_slip(2.3, 850.0, 0.0, v, length, 0.005, kinetic, limit)) for v, length in speeds.items()]

    def find(seed: int) -> tuple[str, pd.DataFrame]:
        random = np.random.default_rng(seed)
        return _law([
            ss.measure({"time": t, "force": 850 * x + 0.03 * random.standard_normal(t.size)}, rig | {"drive_velocity": v})
            for v, t, x in known
        ])  # fmt: skip

    truth = {"static.kinetic": 12.0, "static.growth": 0.8, "static.onset": 0.3}
    truth |= {"kinetic.break_away": 11.0, "kinetic.kinetic": 9.0, "kinetic.scale": 0.02, "kinetic.viscous": 33.0}
    return Task("A slider pulled at three speeds, N over m/s", truth, find)


def belt() -> Task:
    """A block on a belt at three speeds, its position read by a laser; static friction is constant."""
    rig = {
        "instrument": "displacement",
        "column": "x",
        "unit": "um",
        "mass": 0.35,
        "stiffness": 5200.0,
        "damping": 1.1,
        "rest": 150,
    }
    known = [
        (v, *stick_slip(0.35, 5200.0, 1.1, v, 4.0, 5e-4, lambda w: 6 + 2.5 * np.exp(-w / 0.04), lambda _: 9.5))
        for v in (0.02, 0.05, 0.12)
    ]

    def find(seed: int) -> tuple[str, pd.DataFrame]:
        random = np.random.default_rng(100 + seed)
        return _law([
            ss.measure({"t": t, "x": 1e6 * x + 150 + 2 * random.standard_normal(t.size)}, rig | {"drive_velocity": v})
            for v, t, x in known
        ])  # fmt: skip

    truth = {"static.break_away": 9.5, "kinetic.break_away": 8.5, "kinetic.kinetic": 6.0, "kinetic.scale": 0.04}
    return Task("A block on a belt at three speeds, N over m/s", truth, find)


def swung(t: Array, sines: list[tuple[float, float, float]]) -> tuple[Array, Array, Array]:
    """Place, speed and acceleration of a sum of sines (amplitude, frequency in Hz, phase)."""
    rates = [(size, 2 * np.pi * frequency, phase) for size, frequency, phase in sines]
    q, v, a = (sum(s * r**n * np.sin(r * t + p + n * np.pi / 2) for s, r, p in rates) for n in range(3))
    return np.asarray(q), np.asarray(v), np.asarray(a)


def bristles(speed: Array, steady: Array, stiffness: float, damping: float, step: float) -> Array:
    """The force s z + d z' of LuGre's bristles along a motion, z' = w - s |w| z / f(w), by Euler steps."""
    z, force = 0.0, np.empty_like(speed)
    for i, (w, level) in enumerate(zip(speed.tolist(), steady.tolist(), strict=True)):
        rate = w - stiffness * abs(w) * z / level
        force[i] = stiffness * z + damping * rate
        z += rate * step
    return force


def arm() -> Task:
    """An arm that swings to and fro, torque and angle read; the rig does not say its inertia."""
    columns = {"time": "t", "displacement": {"column": "q", "unit": "deg"}, "force": {"column": "f", "unit": "N m"}}
    t = np.arange(0, 40, 0.002)
    q, w, a = swung(t, [(np.deg2rad(50), 0.1, 0.0), (np.deg2rad(20), 0.23, 0.4)])
    torque = (
        np.sign(w) * (0.9 + 0.4 * np.exp(-np.abs(w) / 0.08)) + 1.7 * w + 3.1 * np.sin(q) - 0.6 * np.cos(q) + 0.12 * a
    )

    def find(seed: int) -> tuple[str, pd.DataFrame]:
        random = np.random.default_rng(200 + seed)
        seen = {
            "q": np.rad2deg(q) + 0.002 * random.standard_normal(t.size),
            "f": torque + 0.04 * random.standard_normal(t.size),
        }
        return _curve(ss.measure({"t": t} | seen, {"instrument": "direct_force", "columns": columns}))

    truth = {"kinetic": 0.9, "weakening": 0.4, "scale": 0.08, "viscous": 1.7}
    truth |= {"gravity_sine": 3.1, "gravity_cosine": -0.6, "inertia": 0.12}
    return Task("An arm of unknown inertia, N m over rad/s", truth, find)


def slide() -> Task:
    """A slide of 14 kg moved to and fro, with bristles that give way over some 0.1 mm at each turn."""
    columns = {"time": "t", "displacement": {"column": "x", "unit": "um"}, "force": {"column": "f", "unit": "N"}}
    step = 1e-4
    t = np.arange(0, 24, step)
    x, v, a = swung(t, [(0.03, 0.25, 0.0), (0.008, 0.61, 1.0)])
    steady = 20.5 + 8.5 * np.exp(-((v / 0.008) ** 2))
    force = bristles(v, steady, 2e5, 300.0, step) + 180 * v + 14 * a
    t, x, force = t[::10], x[::10], force[::10]

    def find(seed: int) -> tuple[str, pd.DataFrame]:
        random = np.random.default_rng(300 + seed)
        seen = {"x": np.round(1e6 * x + random.uniform(-0.5, 0.5)), "f": force + 0.4 * random.standard_normal(t.size)}
        rig = {"instrument": "direct_force", "columns": columns, "inertia": "14 kg"}
        return _curve(ss.measure({"t": t} | seen, rig))

    truth = {"kinetic": 20.5, "weakening": 8.5, "scale": 0.008, "viscous": 180.0}
    return Task("A slide with bristles, N over m/s", truth, find)


def joint() -> Task:
    """Twelve logs of a loaded joint at constant speeds, motor current and angle read."""
    columns = {
        "time": "t",
        "displacement": {"column": "q", "unit": "rad"},
        "velocity": {"column": "w", "unit": "rad/s"},
        "current": {"column": "i", "unit": "A"},
    }
    rig = {"instrument": "direct_force", "force_per_current": "0.137 N m/A", "columns": columns}

    def find(seed: int) -> tuple[str, pd.DataFrame]:
        random, logs = np.random.default_rng(400 + seed), []
        for speed in (0.05, 0.1, 0.2, 0.4, 0.8, 1.4):
            for sense in (1, -1):
                t = np.arange(0, min(60, 6 / speed), 0.01)
                q = sense * speed * t + (0 if sense > 0 else 6)
                torque = sense * (1.6 + 0.9 * np.exp(-speed / 0.12) + 0.85 * speed)
                torque = torque + 2.4 * np.sin(q) + 0.7 * np.cos(q) + 0.05 * np.sin(100 * q)  # the last of the gear
                noise = random.standard_normal((2, t.size))
                log = {"t": t, "q": q, "w": sense * speed + 0.004 * noise[0], "i": torque / 0.137 + 0.25 * noise[1]}
                logs.append(ss.measure(log, rig))
        return _curve(logs)

    truth = {
        "kinetic": 1.6,
        "weakening": 0.9,
        "scale": 0.12,
        "viscous": 0.85,
        "gravity_sine": 2.4,
        "gravity_cosine": 0.7,
    }
    return Task("A loaded joint at constant speeds, N m over rad/s", truth, find)


TASKS = {task.__name__: task for task in (pulls, belt, arm, slide, joint)}


def lines(task: Task, count: int) -> Iterator[str]:
    """The part of the page on one rig."""
    found = [task.find(seed) for seed in range(count)]
    forms = pd.Series([name for name, _ in found]).value_counts()
    yield f"## {task.title}\n"
    yield "Chosen: " + "; ".join(f"{name} ({times} of {count})" for name, times in forms.items()) + ".\n"
    yield "| number | truth | found in the mean | stated error in the mean | intervals with the truth |"
    yield "|---|---|---|---|---|"
    for name, value in task.truth.items():
        rows = pd.DataFrame([table.loc[name] for _, table in found if name in table.index])
        if rows.empty:
            yield f"| {name} | {value:g} | not found | | 0 of {count} |"
            continue
        held = int(((rows["low"] <= value) & (value <= rows["high"])).sum())
        yield f"| {name} | {value:g} | {rows['value'].mean():.4g} | {rows['error'].mean():.2g} | {held} of {count} |"
    yield ""


if __name__ == "__main__":
    asked = argparse.ArgumentParser()
    asked.add_argument("--count", type=int, default=COUNT)
    count = asked.parse_args().count
    parts = [line for make in TASKS.values() for line in lines(make(), count)]
    PAGE.write_text(INTRODUCTION.format(count=count) + "\n".join(parts), encoding="utf-8")
