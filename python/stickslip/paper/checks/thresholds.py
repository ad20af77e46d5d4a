"""What the paper says of the motions that follow each other as the drive gets faster (sections 4, 7 and 9)."""

from __future__ import annotations

import numpy as np

from stickslip.paper.claim import NOT, PARTLY, REPRODUCED, CheckResult, Claim
from stickslip.paper.default_calibration import END_OF_OSCILLATION, END_OF_STICK_SLIP
from stickslip.paper.study import Study


def _relaxation(study: Study) -> CheckResult:
    values = (0.05, 0.10, 0.15, 0.20)
    there = [s for s in values if study.motion(s)["regime"] == "stick_slip"]
    verdict = REPRODUCED if len(there) == len(values) else PARTLY if there else NOT
    return CheckResult(
        verdict, float(len(there)), f"stick-slip at {len(there)} of {len(values)} drive velocities up to 0.20"
    )


def _threshold(found: float | None, stated: float, what: str) -> CheckResult:
    if found is None:
        return CheckResult(NOT, np.nan, f"no {what} between s = 0.05 and 0.60")
    off = abs(found - stated)
    verdict = REPRODUCED if off <= 0.005 else PARTLY if off <= 0.03 else NOT
    return CheckResult(verdict, found, f"{what} at s = {found:.4f}")


def _end_of_stick_slip(study: Study) -> CheckResult:
    checked = _threshold(study.end_of_stick_slip, END_OF_STICK_SLIP, "end of stick-slip")
    if study.end_of_stick_slip is None:
        return checked
    above = study.motion(study.end_of_stick_slip + 0.005)["regime"].replace("_", " ")
    verdict = checked.verdict if above == "almost harmonic" else NOT
    return CheckResult(verdict, checked.value, f"{checked.sentence}; {above} 0.005 above it")


def _hopf(study: Study) -> CheckResult:
    end = study.end_of_oscillation
    if end is None:
        return CheckResult(NOT, np.nan, "no end of the limit cycle")
    far, near = (study.motion(round(end - off, 6))["amplitude"] for off in (0.04, 0.001))
    if not far > 0:
        return CheckResult(NOT, np.nan, "no limit cycle below its end")
    above = study.motions(round(end + 0.005, 6))
    steady = sum(motion["regime"] == "stable_slip" for motion in above)
    sentence = f"amplitude {far:.3f} at 0.04 below the end, {near:.4f} at 0.001; "
    sentence += f"0.005 above it stable slip from {steady} of {len(above)} starts"
    shrinks = near < 0.1 * far
    whole = shrinks and steady == len(above)
    return CheckResult(REPRODUCED if whole else PARTLY if shrinks else NOT, float(near / far), sentence)


def _square_root(study: Study) -> CheckResult:
    end = study.end_of_oscillation
    if end is None:
        return CheckResult(NOT, np.nan, "no end of the limit cycle")
    distances = np.array([0.04, 0.02, 0.01])
    amplitude = np.array([study.motion(round(end - float(off), 6))["amplitude"] for off in distances])
    if (amplitude <= 0).any():
        return CheckResult(NOT, np.nan, "no limit cycle below its end")
    exponent = float(np.polyfit(np.log(distances), np.log(amplitude), 1)[0])
    sentence = (
        f"amplitude {amplitude[0]:.3f}, {amplitude[1]:.3f}, {amplitude[2]:.3f} at 0.04, 0.02, 0.01 below the end: "
    )
    sentence += f"grows as the distance to the power {exponent:.2f}"
    verdict = REPRODUCED if abs(exponent - 0.5) < 0.15 else PARTLY if exponent > 0.2 else NOT
    return CheckResult(verdict, exponent, sentence)


def _steady_slip(study: Study) -> CheckResult:
    values = [round(0.41 + 0.03 * i, 2) for i in range(14)]
    there = [s for s in values if study.motion(s)["regime"] == "stable_slip"]
    verdict = REPRODUCED if there == values else PARTLY if there else NOT
    sentence = f"stable slip at {len(there)} of {len(values)} drive velocities from 0.41 to 0.80"
    return CheckResult(verdict, len(there) / len(values), sentence)


CLAIMS: tuple[Claim, ...] = (
    Claim(
        "hopf",
        "4, 9",
        "The limit cycle shrinks into a stable fixed point, and none is left beyond: it is supercritical.",
        "amplitude 0.04 and 0.001 below the end of the limit cycle; regime from rest and 54 starts in slip 0.005 above it",
        "the nearer below a tenth of the farther one, and stable slip from every start; partly: the first alone",
        "follows",
        _hopf,
    ),
    Claim(
        "hopf-square-root",
        "4, 9",
        "It is one like a smooth Hopf bifurcation: its amplitude grows as a square root.",
        "exponent of the amplitude over the distance of s from the end of the limit cycle",
        "0.5 ± 0.15 as in a smooth Hopf bifurcation; partly: another one above 0.2",
        "follows",
        _square_root,
        "inferred: it is said to be characteristic of a Hopf bifurcation, not how the amplitude grows",
    ),
    Claim(
        "stick-slip-at-small-s",
        "7, 9",
        "At small drive velocities there are relaxation stick-slip oscillations.",
        "regime from the stuck start at s = 0.05, 0.10, 0.15, 0.20",
        "stick-slip at all of them; partly: at some",
        "follows",
        _relaxation,
    ),
    Claim(
        "end-of-stick-slip",
        "9",
        "Above s ≈ 0.25 stick-slip gives way to almost-harmonic vibration.",
        "drive velocity where stick-slip ends, from the stuck start, by bisection, and the regime 0.005 above it",
        "0.25 ± 0.005 and almost-harmonic above it; partly: ± 0.03",
        "calibration: d",
        _end_of_stick_slip,
    ),
    Claim(
        "end-of-oscillation",
        "9",
        "Above s ≈ 0.40 the self-excited vibration vanishes.",
        "drive velocity where the limit cycle ends, from the stuck start, by bisection",
        "0.40 ± 0.005; partly: ± 0.03",
        "calibration: f_s(0, δ)",
        lambda study: _threshold(study.end_of_oscillation, END_OF_OSCILLATION, "end of the limit cycle"),
    ),
    Claim(
        "stable-slip",
        "9",
        "Above the end of the vibration the mass slips steadily at the drive velocity.",
        "regime from the stuck start at s = 0.41, 0.44, …, 0.80",
        "stable slip at all of them; partly: at some",
        "follows",
        _steady_slip,
    ),
)
