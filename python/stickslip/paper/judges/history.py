"""What the paper says of the way to the steady motion and of what the start decides (sections 7 and 9)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.analysis import sign_changes
from stickslip.paper.statement import NOT, PARTLY, REPRODUCED, Seen, Statement, listed
from stickslip.paper.study import Study
from stickslip.simulation import simulate

if TYPE_CHECKING:
    from stickslip.orbit import Orbit


def _single_cycle(study: Study) -> Seen:
    several, values = [], (0.10, 0.20, 0.25, 0.26, 0.30, 0.36, 0.39)
    starts = [(x0, v0) for x0 in (-0.5, 0.5, 1.0, 1.5) for v0 in (-0.3, 0.0, 0.15)]
    oscillates = False
    for s in values:
        motions = [study.motion(s), *(study.motion(s, x0, v0) for x0, v0 in starts)]
        # Alike: the same regime and the same amplitude within 2 % of the largest.
        largest = max(motion["amplitude"] for motion in motions)
        kinds = {(motion["regime"], round(motion["amplitude"] / max(largest, 1e-9) * 50)) for motion in motions}
        oscillates |= largest > 1e-3
        if len(kinds) > 1:
            several.append(s)
    if not oscillates:
        return Seen(NOT, np.nan, "no limit cycle at all")
    alone = len(values) - len(several)
    sentence = f"one motion from {len(starts) + 1} starts at {alone} of {len(values)} drive velocities"
    if several:
        sentence += f", several at s = {listed(several, 2)}"
        later = study.last(("stick_slip",), x0=1.0, v0=0.0)
        if later is not None and study.end_of_stick_slip is not None:
            sentence += (
                f" (stick-slip ends at {later:.4f} from a start in slip, {study.end_of_stick_slip:.4f} from rest)"
            )
    return Seen(REPRODUCED if not several else PARTLY if alone else NOT, float(alone), sentence)


def _passage(study: Study) -> Seen:
    end = study.end_of_stick_slip
    if end is None:
        return Seen(NOT, np.nan, "no end of stick-slip")
    most, cycles, where = 0, 0.0, np.nan
    for off in (0.0001, 0.0002, 0.0005, 0.001, 0.002, 0.005, 0.01):
        s = end + off
        if study.motion(s)["regime"] != "almost_harmonic":
            continue
        system = study.make(s, None)
        orbit = simulate(system, study.periods * system.natural_period)
        releases = int((orbit.events["kind"] == "release").sum())
        if releases > most:
            most, cycles, where = releases, _cycles_until_settled(orbit), s
    if most == 0:
        return Seen(NOT, np.nan, "no almost-harmonic motion just above the end of stick-slip")
    verdict = REPRODUCED if most >= 3 and cycles >= 5 else PARTLY if most >= 2 else NOT
    sentence = (
        f"at s = {where:.4f}: {most} releases, then no more; within 1 % of the limit cycle after {cycles:.1f} cycles"
    )
    return Seen(verdict, float(most), sentence)


def _cycles_until_settled(orbit: Orbit) -> float:
    """Cycles until the swing of x stays within 1 % of its last value."""
    turns = sign_changes(lambda t: orbit.at(t)[1], orbit.times())
    swing = np.abs(np.diff(orbit.at(turns)[0]))
    away = np.flatnonzero(np.abs(swing / swing[-1] - 1) > 0.01)
    return float(away[-1] + 1) / 2 if away.size else 0.0


def _first_break_away(study: Study) -> Seen:
    values, above = (0.20, 0.30, 0.45), []
    sentences = []
    for s in values:
        system = study.make(s, None)
        events = simulate(system, 5 * system.natural_period).events
        releases = events[events["kind"] == "release"]
        if releases.empty:
            continue
        first, later = float(releases["force"].iloc[0]), float(system.law.break_away_force(0.0, s))
        above.append(first > later + 1e-9)
        sentences.append(f"{first:.3f} at s = {s:.2f}")
    if not above:
        return Seen(NOT, np.nan, "nothing sticks")
    verdict = REPRODUCED if all(above) and len(above) == len(values) else PARTLY if any(above) else NOT
    return Seen(
        verdict, float(sum(above)), "first break-away force " + ", ".join(sentences) + f"; f_s(0) = {later:.3f}"
    )


STATEMENTS: tuple[Statement, ...] = (
    Statement(
        "single-limit-cycle",
        "7",
        "One stable motion is reached from any start.",
        "kind and amplitude of the motion from 13 starts at s = 0.10, 0.20, 0.25, 0.26, 0.30, 0.36, 0.39",
        "one at each of them; partly: at some",
        "follows",
        _single_cycle,
    ),
    Statement(
        "passage",
        "7, 9",
        "Just above the threshold the motion starts with stick-slip and passes through a non-stationary stage.",
        "releases, and cycles until within 1 % of the limit cycle, 0.0001 … 0.01 above the end of stick-slip",
        "at least three releases, then none, and five cycles; partly: two releases",
        "calibrated: α(f_s) and the growth of f_s(t_s, δ)",
        _passage,
    ),
    Statement(
        "first-break-away",
        "7",
        "Static friction decides the first stage of the motion whatever vibration follows.",
        "force of the first break-away against f_s(0, ·) at s = 0.20, 0.30, 0.45",
        "above it at all of them; partly: at some",
        "calibrated: growth of f_s(t_s, δ)",
        _first_break_away,
    ),
)
