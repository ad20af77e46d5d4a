"""What the paper says of the oscillator with a harmonic force (section 8)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from stickslip.paper.claim import NOT, PARTLY, REPRODUCED, CheckResult, Claim, listed
from stickslip.paper.study import FREQUENCIES, Forced, Study


def _forced_summary(motions: list[Forced]) -> str:
    free = [motion for motion in motions if not motion.sticks]
    counts = {p: sum(motion.period == p for motion in free) for p in (1, 2, 0)}
    higher = len(free) - sum(counts.values())
    sentence = f"of {len(motions)} u₀ in 0.005 … 0.400, {len(free)} without sticking: "
    sentence += f"{counts[1]} one-, {counts[2]} two-, {higher} higher-periodic, {counts[0]} without a period up to 32"
    two_loops = [motion.amplitude for motion in free if motion.loops == 2.0]
    return sentence + (f"; two loops per forcing period at u₀ = {listed(two_loops)}" if two_loops else "")


def _two_periodic(s: float, frequency: float) -> Callable[[Study], CheckResult]:
    def check(study: Study) -> CheckResult:
        motions = study.forced(s, frequency)
        found = [motion.amplitude for motion in motions if motion.period == 2 and not motion.sticks]
        nearly = [motion for motion in motions if motion.period == 2 or (motion.period == 1 and motion.loops == 2.0)]
        sentence = _forced_summary(motions) + (f"; period two at u₀ = {listed(found)}" if found else "")
        verdict = REPRODUCED if len(found) > 1 else PARTLY if nearly else NOT
        return CheckResult(verdict, float(len(found)), sentence)

    return check


def _non_periodic(s: float, frequency: float) -> Callable[[Study], CheckResult]:
    def check(study: Study) -> CheckResult:
        motions, found = study.forced(s, frequency), study.non_periodic(s, frequency)
        nearly = [motion for motion in motions if motion.period == 0 or motion.period > 2]
        sentence = _forced_summary(motions) + (
            f"; after 9600 forcing periods no period up to 1000 at u₀ = {listed(found)}" if found else ""
        )
        verdict = REPRODUCED if len(found) > 1 else PARTLY if nearly else NOT
        return CheckResult(verdict, float(len(found)), sentence)

    return check


def _one_amplitude(s: float, slow: float, fast: float) -> Callable[[Study], CheckResult]:
    def check(study: Study) -> CheckResult:
        fast_ones = study.non_periodic(s, fast)
        there = [motion for motion in study.forced(s, slow) if motion.amplitude in fast_ones and not motion.sticks]
        both = [motion.amplitude for motion in there if motion.period == 2]
        near = [motion.amplitude for motion in there if motion.period in (4, 8) or abs(motion.loops - 2) < 0.05]
        if both:
            return CheckResult(REPRODUCED, both[0], f"both at u₀ = {listed(both)}")
        if near:
            return CheckResult(PARTLY, near[0], f"nearly both at u₀ = {listed(near)}")
        sentence = f"where η = {fast} is non-periodic, u₀ = {listed(fast_ones)}, η = {slow} has the periods "
        periods = sorted({motion.period for motion in there})
        sentence += ", ".join(str(p) if p else "none up to 32" for p in periods)
        return CheckResult(
            NOT, np.nan, sentence if fast_ones else f"η = {fast} is nowhere non-periodic without sticking"
        )

    return check


def _kinds(s: float) -> Callable[[Study], CheckResult]:
    def check(study: Study) -> CheckResult:
        best, sentence = -1, ""
        for amplitude in (0.05, 0.10, 0.15):
            found = study.kinds(s, amplitude)
            there = sum(bool(frequencies) for frequencies in found.values())
            if there > best:
                best = there
                counts = ", ".join(f"{len(frequencies)} {kind}" for kind, frequencies in found.items())
                sentence = (
                    f"at u₀ = {amplitude:.2f}, of {len(FREQUENCIES)} η in 0.25 … 2.00, without sticking: {counts}"
                )
                sentence += "periodic"
            if there == len(found):
                break
        return CheckResult(REPRODUCED if best == 4 else PARTLY if best > 1 else NOT, float(best), sentence)

    return check


CLAIMS: tuple[Claim, ...] = (
    Claim(
        "forced-0.30-two-periodic",
        "8",
        "s = 0.30, η = 0.35: two-periodic, nothing sticks.",
        "stroboscopic period and loops per forcing period over 80 forcing amplitudes u₀ ≤ 0.40",
        "period two without a stick at two or more; partly: at one, with sticks, or period one with two loops",
        "calibration: u₀, f_s(0, δ) and d",
        _two_periodic(0.30, 0.35),
    ),
    Claim(
        "forced-0.30-non-periodic",
        "8",
        "s = 0.30, η = 1.25: non-periodic, nothing sticks.",
        "stroboscopic period over 80 forcing amplitudes u₀ ≤ 0.40",
        "after 9600 forcing periods no period ≤ 1000, no stick, at two or more; partly: at one, with sticks, or period > 2",
        "calibration: u₀, f_s(0, δ) and d",
        _non_periodic(0.30, 1.25),
    ),
    Claim(
        "forced-0.30-one-amplitude",
        "8",
        "Both of these at s = 0.30 with one forcing amplitude.",
        "u₀ ≤ 0.40 at which both hold",
        "there is one; partly: the slow one has period 4 or 8, or two loops, there",
        "calibration: u₀, f_s(0, δ) and d",
        _one_amplitude(0.30, 0.35, 1.25),
    ),
    Claim(
        "forced-0.30-kinds",
        "8",
        "s = 0.30, one forcing amplitude: over the frequency one-, two-, higher- and non-periodic motions.",
        "kinds of motion without sticks at 36 η in 0.25 … 2.00, at u₀ = 0.05, 0.10, 0.15",
        "all four kinds at one u₀; partly: two or three of them",
        "calibration: f_s(0, δ) and d",
        _kinds(0.30),
    ),
    Claim(
        "forced-0.40-two-periodic",
        "8",
        "s = 0.40, η = 0.40: two-periodic around the equilibrium.",
        "stroboscopic period and loops per forcing period over 80 forcing amplitudes u₀ ≤ 0.40",
        "period two without a stick at two or more; partly: at one, with sticks, or period one with two loops",
        "calibration: u₀, f_s(0, δ) and d",
        _two_periodic(0.40, 0.40),
    ),
    Claim(
        "forced-0.40-non-periodic",
        "8",
        "s = 0.40, η = 1.60: non-periodic around the equilibrium.",
        "stroboscopic period over 80 forcing amplitudes u₀ ≤ 0.40",
        "after 9600 forcing periods no period ≤ 1000, no stick, at two or more; partly: at one, with sticks, or period > 2",
        "calibration: u₀, f_s(0, δ) and d",
        _non_periodic(0.40, 1.60),
    ),
    Claim(
        "forced-0.40-kinds",
        "8",
        "s = 0.40, one forcing amplitude: over the frequency one-, two-, higher- and non-periodic motions about equilibrium.",
        "kinds of motion without sticks at 36 η in 0.25 … 2.00, at u₀ = 0.05, 0.10, 0.15",
        "all four kinds at one u₀; partly: two or three of them",
        "calibration: f_s(0, δ) and d",
        _kinds(0.40),
        "inferred: one amplitude is said at s = 0.30, and asked here as well",
    ),
)
