"""A first smooth reading of a whole record that knows no events: good to find them, not to measure friction."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from stickslip.files.arrays import Array
from stickslip.measurement.signals.piecewise_fit import OscillatorConstants, PiecewiseFit
from stickslip.measurement.signals.sampling import mean_step


@dataclass(frozen=True)
class Presmoothed:
    """A first smooth reading of the record that knows no events: good to find them, not to measure friction.

    Attributes
    ----------
    time : (n,) seconds.
    extension : (n,) x of the spring.
    rate : (n,) x'.
    rate_error : standard error of x' away from events.
    cutoff : of the smoothing in Hz.
    noise : standard deviation of the samples of x.
    """

    time: Array
    extension: Array
    rate: Array
    rate_error: float
    cutoff: float
    noise: float


def presmooth(
    time: Array, extension: Array, weight: Array, oscillator: OscillatorConstants, noise: float
) -> Presmoothed:
    """Smooth the whole record as one slip; the cut-off is the likeliest on stretches spread over the record."""
    period = natural_period(oscillator)
    step = mean_step(time)
    # a short record may be worth a finer look than a long one can afford
    knots = max(period / (50 if len(time) < 50_000 else 25), 2 * step)
    path = oscillator.drive_velocity * (time - time[0]) - extension

    def whole(part: slice) -> PiecewiseFit:
        t = time[part]
        return PiecewiseFit(t, path[part], weight[part], t[[0, -1]], ["slip"], oscillator, knots, knots)

    n, most = len(time), 6000
    starts = [0] if n <= 4 * most else [int(s) for s in np.linspace(0, n - most, 4)]
    parts = [whole(slice(s, s + most) if n > 4 * most else slice(None)) for s in starts]
    limits = cutoff_limits(oscillator, step, knots)

    def deviance(log_frequency: float) -> float:
        return sum(part.deviance({"slip": math.exp(log_frequency)}, noise) for part in parts)

    found = minimize_scalar(
        deviance, bounds=(math.log(limits[0]), math.log(limits[1])), method="bounded", options={"xatol": 0.05}
    )
    cutoff = math.exp(float(found.x))
    middle = parts[len(parts) // 2].solve({"slip": cutoff})
    inside = middle.time[len(middle.time) // 4 : 3 * len(middle.time) // 4 : 7]
    rate_error = float(np.median(middle.deviation(inside, {1: 1.0}, noise)))
    fit = whole(slice(None)).solve({"slip": cutoff})
    rate = oscillator.drive_velocity - fit.evaluate(time, 1)
    smooth = oscillator.drive_velocity * (time - time[0]) - fit.evaluate(time, 0)
    return Presmoothed(time, smooth, rate, rate_error, cutoff, noise)


def natural_period(oscillator: OscillatorConstants) -> float:
    """Period of the free mass on its spring, in s."""
    return 2 * math.pi * math.sqrt(oscillator.mass / oscillator.stiffness)


def cutoff_limits(oscillator: OscillatorConstants, step: float, knots: float) -> tuple[float, float]:
    """Cut-offs (Hz) worth trying for slips: above the free oscillation, below what knots and samples resolve."""
    low = 1.5 / natural_period(oscillator)
    return low, max(min(0.3 / step, 0.5 / knots), 2 * low)
