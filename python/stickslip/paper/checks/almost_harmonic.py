"""What the paper says of the almost-harmonic vibration and its friction (section 4)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from stickslip.paper.claim import NOT, PARTLY, REPRODUCED, CheckResult, Claim
from stickslip.paper.study import ALMOST_HARMONIC, Study


def _needs_range(check: Callable[[Study], CheckResult]) -> Callable[[Study], CheckResult]:
    """A check of the almost-harmonic range: not without three motions of it, and no more than partly where some lack."""

    def guarded(study: Study) -> CheckResult:
        there = len(study.almost_harmonic)
        lacking = f"almost-harmonic at {there} of {len(ALMOST_HARMONIC)} values of s"
        if there < 3:
            return CheckResult(NOT, np.nan, lacking)
        checked = check(study)
        if there == len(ALMOST_HARMONIC):
            return checked
        return CheckResult(
            PARTLY if checked.verdict == REPRODUCED else checked.verdict,
            checked.value,
            f"{checked.sentence}; {lacking}",
        )

    return guarded


@_needs_range
def _keeps_slipping(study: Study) -> CheckResult:
    lowest = float(study.column("w_min").min())
    sentence = f"w ≥ {lowest:.4f} at {len(study.almost_harmonic)} values of s"
    return CheckResult(REPRODUCED if lowest > 0 else PARTLY, lowest, sentence)


@_needs_range
def _amplitude(study: Study) -> CheckResult:
    amplitude = study.column("amplitude")
    falling = np.diff(amplitude) < 0
    verdict = REPRODUCED if falling.all() else PARTLY if amplitude[-1] < amplitude[0] else NOT
    sentence = f"amplitude {amplitude[0]:.3f} at s = {study.almost_harmonic[0][0]:.2f} … {amplitude[-1]:.3f} at "
    sentence += f"{study.almost_harmonic[-1][0]:.2f}, falling in {int(falling.sum())} of {falling.size} steps"
    return CheckResult(verdict, float(amplitude[0] - amplitude[-1]), sentence)


@_needs_range
def _turning_slip_velocity(study: Study) -> CheckResult:
    low, high = study.column("w_min"), study.column("w_max")
    grows = [bool((np.diff(values) > 0).all()) for values in (low, high)]
    verdict = REPRODUCED if all(grows) else PARTLY if any(grows) else NOT
    sentence = f"the lower one {low[0]:.3f} … {low[-1]:.3f}, the upper one {high[0]:.3f} … {high[-1]:.3f}"
    return CheckResult(verdict, float(low[-1] - low[0]), sentence)


@_needs_range
def _smallest_slip_velocity(study: Study) -> CheckResult:
    low = study.column("w_min")
    grows = np.diff(low) > 0
    verdict = REPRODUCED if grows.all() else PARTLY if low[-1] > low[0] else NOT
    sentence = f"{low[0]:.3f} at s = {study.almost_harmonic[0][0]:.2f} … {low[-1]:.3f} at "
    sentence += f"{study.almost_harmonic[-1][0]:.2f}, growing in {int(grows.sum())} of {grows.size} steps"
    return CheckResult(verdict, float(low[-1] - low[0]), sentence)


@_needs_range
def _friction_falls(study: Study) -> CheckResult:
    highest = np.array([force.max() for _, _, force, _ in study.loops])
    lowest = np.array([force.min() for _, _, force, _ in study.loops])
    falls = [bool((np.diff(values) < 0).all()) for values in (highest, lowest)]
    verdict = REPRODUCED if all(falls) else PARTLY if any(falls) else NOT
    sentence = f"highest {highest[0]:.3f} … {highest[-1]:.3f}, lowest {lowest[0]:.3f} … {lowest[-1]:.3f} as s grows"
    return CheckResult(verdict, float(lowest[-1] - lowest[0]), sentence)


@_needs_range
def _higher_while_rising(study: Study) -> CheckResult:
    least, most = [], []
    for _, w, force, rising in study.loops:
        grid = np.linspace(w.min(), w.max(), 203)[1:-1]
        up, down = (_along(w[mask], force[mask], grid) for mask in (rising, ~rising))
        least.append(float((up - down).min()))
        most.append(float((up - down).max()))
    # Interpolation between samples across a corner is good to about 1e-4.
    higher = min(most) > 1e-2
    verdict = REPRODUCED if higher and min(least) > -1e-3 else PARTLY if higher else NOT
    sentence = f"f(ẇ > 0) − f(ẇ < 0) at the same w is nowhere below {round(min(least), 4) + 0.0:.4f}; "
    return CheckResult(verdict, min(most), sentence + f"the most of it at one s is {min(most):.3f} … {max(most):.3f}")


def _along(w: NDArray[np.float64], force: NDArray[np.float64], grid: NDArray[np.float64]) -> NDArray[np.float64]:
    order = np.argsort(w)
    return np.interp(grid, w[order], force[order])


@_needs_range
def _equation_7(study: Study) -> CheckResult:
    off = []
    for s, _, force, _ in study.loops:
        limit = float(study.make(s, None).law.break_away_force(0.0, s))
        off.append(abs(float(force.max()) - limit))
    verdict = REPRODUCED if max(off) < 1e-2 else PARTLY if max(off) < 5e-2 else NOT
    return CheckResult(verdict, max(off), f"highest friction differs from f_s(0, s) by up to {max(off):.1e}")


CLAIMS: tuple[Claim, ...] = (
    Claim(
        "amplitude-falls",
        "4",
        "The amplitude of the almost-harmonic vibration falls as the drive gets faster.",
        "half of max x − min x at s = 0.26, 0.27, …, 0.39",
        "falls at every step; partly: falls on the whole",
        "calibration: f_s(0, δ) and d",
        _amplitude,
    ),
    Claim(
        "turning-slip-velocity-grows",
        "4",
        "The slip velocities at which ẇ = 0 grow with the drive velocity.",
        "smallest and largest w of the limit cycle at s = 0.26, …, 0.39",
        "both grow at every step; partly: one does",
        "follows",
        _turning_slip_velocity,
    ),
    Claim(
        "smallest-slip-velocity-grows",
        "5",
        "The smallest slip velocity grows with the drive velocity, up to where the mass slips steadily.",
        "smallest w of the limit cycle at s = 0.26, …, 0.39",
        "grows at every step; partly: grows on the whole",
        "calibration: f_s(0, δ) and d",
        _smallest_slip_velocity,
    ),
    Claim(
        "friction-falls",
        "4",
        "Corresponding values of kinetic friction fall as the drive gets faster.",
        "highest and lowest friction of the limit cycle at s = 0.26, …, 0.39",
        "both fall at every step; partly: one does",
        "calibration: f_s(0, δ) and d",
        _friction_falls,
    ),
    Claim(
        "higher-while-slip-grows",
        "4",
        "Friction is higher while the slip velocity grows than while it falls.",
        "difference of the branches at equal w, s = 0.26, …, 0.39",
        "nowhere below 0, and at each s somewhere above 0.01; partly: the second alone",
        "reading: an upper and a lower branch",
        _higher_while_rising,
    ),
    Claim(
        "always-slipping",
        "4",
        "In the almost-harmonic vibration nothing sticks: w > 0 throughout.",
        "smallest w at s = 0.26, …, 0.39",
        "w > 0 and almost-harmonic at all of them; partly: at three or more",
        "calibration: f_s(0, δ) and d",
        _keeps_slipping,
    ),
    Claim(
        "equation-7",
        "4",
        "While nothing sticks, the highest kinetic friction is the static friction at stick time zero (Eq. 7).",
        "|max f − f_s(0, s)| at s = 0.26, …, 0.39",
        "below 0.01; partly: below 0.05",
        "reading: a climb ends at f_s(0, δ)",
        _equation_7,
    ),
)
