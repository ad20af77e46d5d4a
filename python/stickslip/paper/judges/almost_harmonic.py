"""What the paper says of the almost-harmonic vibration and its friction (section 4)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from stickslip.paper.statement import NOT, PARTLY, REPRODUCED, Seen, Statement
from stickslip.paper.study import ALMOST_HARMONIC, Study


def _needs_range(look: Callable[[Study], Seen]) -> Callable[[Study], Seen]:
    """A look at the almost-harmonic range, which needs one."""

    def guarded(study: Study) -> Seen:
        if len(study.almost_harmonic) < 3:
            return Seen(
                NOT, np.nan, f"almost-harmonic at {len(study.almost_harmonic)} of {len(ALMOST_HARMONIC)} values of s"
            )
        return look(study)

    return guarded


@_needs_range
def _keeps_slipping(study: Study) -> Seen:
    count, lowest = len(study.almost_harmonic), float(study.column("w_min").min())
    verdict = REPRODUCED if count == len(ALMOST_HARMONIC) and lowest > 0 else PARTLY
    return Seen(verdict, lowest, f"w ≥ {lowest:.4f}; almost-harmonic at {count} of {len(ALMOST_HARMONIC)} values of s")


@_needs_range
def _amplitude(study: Study) -> Seen:
    amplitude = study.column("amplitude")
    falling = np.diff(amplitude) < 0
    verdict = REPRODUCED if falling.all() else PARTLY if amplitude[-1] < amplitude[0] else NOT
    sentence = f"amplitude {amplitude[0]:.3f} at s = {study.almost_harmonic[0][0]:.2f} … {amplitude[-1]:.3f} at "
    sentence += f"{study.almost_harmonic[-1][0]:.2f}, falling in {int(falling.sum())} of {falling.size} steps"
    return Seen(verdict, float(amplitude[0] - amplitude[-1]), sentence)


@_needs_range
def _turning_slip_velocity(study: Study) -> Seen:
    low, high = study.column("w_min"), study.column("w_max")
    grows = [bool((np.diff(values) > 0).all()) for values in (low, high)]
    verdict = REPRODUCED if all(grows) else PARTLY if any(grows) else NOT
    sentence = f"the lower one {low[0]:.3f} … {low[-1]:.3f}, the upper one {high[0]:.3f} … {high[-1]:.3f}"
    return Seen(verdict, float(low[-1] - low[0]), sentence)


@_needs_range
def _friction_falls(study: Study) -> Seen:
    highest = np.array([force.max() for _, _, force, _ in study.loops])
    lowest = np.array([force.min() for _, _, force, _ in study.loops])
    falls = [bool((np.diff(values) < 0).all()) for values in (highest, lowest)]
    verdict = REPRODUCED if all(falls) else PARTLY if any(falls) else NOT
    sentence = f"highest {highest[0]:.3f} … {highest[-1]:.3f}, lowest {lowest[0]:.3f} … {lowest[-1]:.3f} as s grows"
    return Seen(verdict, float(lowest[-1] - lowest[0]), sentence)


@_needs_range
def _higher_while_rising(study: Study) -> Seen:
    least, most = np.inf, -np.inf
    for _, w, force, rising in study.loops:
        grid = np.linspace(w.min(), w.max(), 203)[1:-1]
        up, down = (_along(w[mask], force[mask], grid) for mask in (rising, ~rising))
        least, most = min(least, float((up - down).min())), max(most, float((up - down).max()))
    least = round(least, 5) + 0.0
    # Interpolation between samples across a corner is good to about 1e-4.
    verdict = REPRODUCED if most > 1e-2 and least > -1e-3 else PARTLY if most > 1e-2 else NOT
    return Seen(
        verdict,
        most,
        f"f(ẇ > 0) − f(ẇ < 0) at the same w lies between {least:.4f} and {most:.4f}",
    )


def _along(w: NDArray[np.float64], force: NDArray[np.float64], grid: NDArray[np.float64]) -> NDArray[np.float64]:
    order = np.argsort(w)
    return np.interp(grid, w[order], force[order])


@_needs_range
def _equation_7(study: Study) -> Seen:
    off = []
    for s, _, force, _ in study.loops:
        limit = float(study.make(s, None).law.break_away_force(0.0, s))
        off.append(abs(float(force.max()) - limit))
    # The peak is a corner between samples.
    verdict = REPRODUCED if max(off) < 1e-2 else PARTLY if max(off) < 5e-2 else NOT
    return Seen(verdict, max(off), f"highest friction differs from f_s(0, s) by up to {max(off):.4f}")


STATEMENTS: tuple[Statement, ...] = (
    Statement(
        "amplitude-falls",
        "4",
        "The amplitude of the almost-harmonic vibration falls as the drive gets faster.",
        "half of max x − min x at s = 0.26, 0.27, …, 0.39",
        "falls at every step; partly: falls on the whole",
        "calibrated: f_s(0, δ) and d",
        _amplitude,
    ),
    Statement(
        "turning-slip-velocity-grows",
        "4",
        "The slip velocities at which ẇ = 0 grow with the drive velocity.",
        "smallest and largest w of the limit cycle at s = 0.26, …, 0.39",
        "both grow at every step; partly: one does",
        "follows",
        _turning_slip_velocity,
    ),
    Statement(
        "friction-falls",
        "4",
        "Corresponding values of kinetic friction fall as the drive gets faster.",
        "highest and lowest friction of the limit cycle at s = 0.26, …, 0.39",
        "both fall at every step; partly: one does",
        "calibrated: f_s(0, δ) and d",
        _friction_falls,
    ),
    Statement(
        "higher-while-slip-grows",
        "4",
        "Friction is higher while the slip velocity grows than while it falls.",
        "difference of the branches at equal w, s = 0.26, …, 0.39",
        "never below 0 and somewhere above 0.01",
        "built in",
        _higher_while_rising,
    ),
    Statement(
        "always-slipping",
        "4",
        "In the almost-harmonic vibration nothing sticks: w > 0 throughout.",
        "smallest w at s = 0.26, …, 0.39",
        "w > 0 and almost-harmonic at all of them; partly: at some",
        "calibrated: f_s(0, δ) and d",
        _keeps_slipping,
    ),
    Statement(
        "equation-7",
        "4",
        "While nothing sticks, the highest kinetic friction is the static friction at stick time zero (Eq. 7).",
        "|max f − f_s(0, s)| at s = 0.26, …, 0.39",
        "below 0.01; partly: below 0.05",
        "built in",
        _equation_7,
    ),
)
