"""What the paper says of the way to the steady motion and of what the start decides (sections 7 and 9)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.analysis import sign_changes
from stickslip.paper.statement import NOT, PARTLY, REPRODUCED, Seen, Statement
from stickslip.paper.study import Study
from stickslip.simulation import simulate

if TYPE_CHECKING:
    from stickslip.orbit import Orbit

#: Starts in slip: positions, and velocities over the drive velocity.
_STARTS_X, _STARTS_V = np.linspace(-0.5, 2.0, 9), np.array([-2.0, -1.0, -0.3, 0.0, 0.3, 0.7])


def _single_cycle(study: Study) -> Seen:
    values = (0.10, 0.20, 0.25, 0.26, 0.30, 0.36, 0.39)
    several, oscillates = [], False
    for s in values:
        motions = [study.motion(s)] + [study.motion(s, x0, v0) for x0 in _STARTS_X for v0 in s * _STARTS_V]
        amplitude = np.array([motion["amplitude"] for motion in motions])
        oscillates |= bool(amplitude[0] > 1e-3)
        # Alike: the same regime, and the amplitude of the motion from rest within 2 %.
        other = np.abs(amplitude - amplitude[0]) > 0.02 * amplitude[0]
        other |= np.array([motion["regime"] != motions[0]["regime"] for motion in motions])
        if other.any():
            several.append(f"{s:.2f} ({100 * other.mean():.0f} % of them)")
    if not oscillates:
        return Seen(NOT, np.nan, "no limit cycle at all")
    alone, starts = len(values) - len(several), 1 + _STARTS_X.size * _STARTS_V.size
    sentence = f"one motion from {starts} starts at {alone} of {len(values)} drive velocities"
    if several:
        sentence += f", another one at s = {', '.join(several)}"
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
    decided, sentences = [], []
    for s in (0.20, 0.30, 0.45):
        system = study.make(s, None)
        first = []
        for x0 in (-0.6, 0.4):
            events = simulate(system, 8 * system.natural_period, x0=x0).events
            releases = events["force"][events["kind"] == "release"]
            first.append(float(releases.iloc[0]) if releases.size else np.nan)
        # A longer stick holds more, and any holds more than there is without rest.
        decided.append(first[0] > 1.005 * first[1] and first[1] > system.law.break_away_force(0.0, s) + 1e-9)
        sentences.append(f"{first[0]:.3f} and {first[1]:.3f} at s = {s:.2f}")
    verdict = REPRODUCED if all(decided) else PARTLY if any(decided) else NOT
    return Seen(verdict, float(sum(decided)), f"first break-away force from x = −0.6 and 0.4: {', '.join(sentences)}")


STATEMENTS: tuple[Statement, ...] = (
    Statement(
        "single-limit-cycle",
        "7",
        "One stable motion is reached from any start.",
        "kind and amplitude (2 %) from rest and from 54 starts in slip at s = 0.10, 0.20, 0.25, 0.26, 0.30, 0.36, 0.39",
        "one from all of them at each s; partly: at some s",
        "follows",
        _single_cycle,
    ),
    Statement(
        "passage",
        "7, 9",
        "Just above the threshold the motion starts with stick-slip and passes through a non-stationary stage.",
        "releases, and cycles until within 1 % of the limit cycle, 0.0001 … 0.01 above the end of stick-slip",
        "at least three releases, then none, and five cycles; partly: two releases",
        "calibration: α(f_s) and the growth of f_s(t_s, δ)",
        _passage,
    ),
    Statement(
        "first-break-away",
        "7",
        "Static friction decides the first stage of the motion whatever vibration follows.",
        "force of the first break-away from two stuck starts at s = 0.20, 0.30, 0.45, one in each kind of motion",
        "by 0.5 % larger after the longer stick, and both above f_s(0, s), at all of them; partly: at some",
        "calibration: growth of f_s(t_s, δ)",
        _first_break_away,
    ),
)
