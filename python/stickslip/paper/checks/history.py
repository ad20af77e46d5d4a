"""What the paper says of the way to the steady motion and of what the start decides (sections 7 and 9)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.dynamics import sign_changes
from stickslip.paper.claim import NOT, PARTLY, REPRODUCED, CheckResult, Claim
from stickslip.paper.study import Study
from stickslip.simulation.simulate import simulate

if TYPE_CHECKING:
    from stickslip.simulation.orbit import Orbit


def _single_cycle(study: Study) -> CheckResult:
    values = (0.10, 0.20, 0.25, 0.26, 0.30, 0.36, 0.39)
    several, oscillates = [], False
    for s in values:
        motions = study.motions(s)
        amplitude = np.array([motion["amplitude"] for motion in motions])
        oscillates |= bool(amplitude[0] > 1e-3)
        # Alike: the same regime, and the amplitude of the motion from rest within 2 %.
        other = np.abs(amplitude - amplitude[0]) > 0.02 * amplitude[0]
        other |= np.array([motion["regime"] != motions[0]["regime"] for motion in motions])
        if other.any():
            kinds = sorted({motions[i]["regime"].replace("_", " ") for i in np.flatnonzero(other)})
            several.append(f"{s:.2f} ({', '.join(kinds)} from {100 * other.mean():.0f} % of them)")
    if not oscillates:
        return CheckResult(NOT, np.nan, "no limit cycle at all")
    alone, starts = len(values) - len(several), len(motions)
    sentence = f"one motion from {starts} starts at {alone} of {len(values)} drive velocities"
    if several:
        sentence += f", another one at s = {', '.join(several)}"
        later = study.last(("stick_slip",), x0=1.0, v0=0.0)
        if later is not None and study.end_of_stick_slip is not None:
            sentence += (
                f" (stick-slip ends at {later:.4f} from a start in slip, {study.end_of_stick_slip:.4f} from rest)"
            )
    return CheckResult(REPRODUCED if not several else PARTLY if alone else NOT, float(alone), sentence)


def _passage(study: Study) -> CheckResult:
    end = study.end_of_stick_slip
    if end is None:
        return CheckResult(NOT, np.nan, "no end of stick-slip")
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
        return CheckResult(NOT, np.nan, "no almost-harmonic motion just above the end of stick-slip")
    verdict = REPRODUCED if most >= 3 and cycles >= 5 else PARTLY if most >= 2 else NOT
    sentence = (
        f"at s = {where:.4f}: {most} releases, then no more; within 1 % of the limit cycle after {cycles:.1f} cycles"
    )
    return CheckResult(verdict, float(most), sentence)


def _cycles_until_settled(orbit: Orbit) -> float:
    """Cycles until the swing of x stays within 1 % of its last value."""
    turns = sign_changes(lambda t: orbit.at(t)[1], orbit.times())
    swing = np.abs(np.diff(orbit.at(turns)[0]))
    away = np.flatnonzero(np.abs(swing / swing[-1] - 1) > 0.01)
    return float(away[-1] + 1) / 2 if away.size else 0.0


def _first_break_away(study: Study) -> CheckResult:
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
    return CheckResult(
        verdict, float(sum(decided)), f"first break-away force from x = −0.6 and 0.4: {', '.join(sentences)}"
    )


def _memory(study: Study) -> CheckResult:
    differs, parted = [], []
    for s in (0.20, 0.30, 0.45):
        system = study.make(s, None)
        rising = []
        for x0 in (-0.6, 0.4):
            orbit = simulate(system, 8 * system.natural_period, x0=x0)
            release = orbit.events["t"][orbit.events["kind"] == "release"]
            if release.empty:
                return CheckResult(NOT, np.nan, f"no break-away at s = {s:.2f}")
            # The first slip while w grows.
            start = float(release.iloc[0])
            motion = orbit.to_xarray(np.linspace(start, min(start + system.natural_period, orbit.t_end), 2001))
            w, force = (motion[name].to_numpy() for name in ("slip_velocity", "force"))
            turn = int(np.argmax(np.append(np.diff(w[1:]) < 0, True))) + 1
            rising.append((w[1:turn], force[1:turn]))
        grid = np.linspace(0.02, 0.9 * min(float(w[-1]) for w, _ in rising), 101)
        one, other = (np.interp(grid, w, force) for w, force in rising)
        parted.append(float(np.abs(one - other).max()))
        differs.append(parted[-1] > 0.005 * float(np.abs(one).max()))
    verdict = REPRODUCED if all(differs) else PARTLY if any(differs) else NOT
    sentence = "friction at one w in the first slip after two sticks differs by up to "
    sentence += ", ".join(f"{value:.3f} at s = {s:.2f}" for value, s in zip(parted, (0.20, 0.30, 0.45), strict=True))
    return CheckResult(verdict, min(parted), sentence)


CLAIMS: tuple[Claim, ...] = (
    Claim(
        "single-limit-cycle",
        "7",
        "One stable motion is reached from any start.",
        "kind and amplitude (2 %) from rest and from 54 starts in slip at s = 0.10, 0.20, 0.25, 0.26, 0.30, 0.36, 0.39",
        "one from all of them at each s; partly: at some s",
        "follows",
        _single_cycle,
        "inferred: it is said of stick-slip, and asked here of almost-harmonic vibration as well",
    ),
    Claim(
        "passage",
        "7, 9",
        "Just above the threshold the motion starts with stick-slip and passes through a non-stationary stage.",
        "releases, and cycles until within 1 % of the limit cycle, 0.0001 … 0.01 above the end of stick-slip",
        "at least three releases, then none, and five cycles; partly: two releases",
        "calibration: α(f_s) and the growth of f_s(t_s, δ)",
        _passage,
    ),
    Claim(
        "first-break-away",
        "7",
        "Static friction decides the first stage of the motion whatever vibration follows.",
        "force of the first break-away from two stuck starts at s = 0.20, 0.30, 0.45, one in each kind of motion",
        "by 0.5 % larger after the longer stick, and both above f_s(0, s), at all of them; partly: at some",
        "calibration: growth of f_s(t_s, δ)",
        _first_break_away,
    ),
    Claim(
        "history",
        "7, 9",
        "The motion depends on its history: friction remembers the last stick.",
        "friction over growing w in the first slip from two stuck starts at s = 0.20, 0.30, 0.45, one in each kind of motion",
        "at one w more than 0.5 % apart at all of them; partly: at some",
        "calibration: growth of f_s(t_s, δ)",
        _memory,
    ),
)
