"""Position, velocity and acceleration from samples, by smoothers that know nothing of events.

They are what a direct instrument needs, and the yardstick for the piecewise fits: across a break-away they smear the jump of
the acceleration over one over their cut-off, which costs the indirect friction force about a tenth of its range there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.measurement.signals.noise import noise_level
from stickslip.measurement.signals.piecewise_fit import OscillatorConstants, PiecewiseFit, deepest_valley
from stickslip.measurement.signals.sampling import mean_step

ORDER = 3
"""Of the local polynomials."""


@dataclass(frozen=True)
class Smooth:
    """A smoothed signal with its derivatives and their standard errors.

    Attributes
    ----------
    x, v, a : (n,) the signal, its first and second derivative.
    x_error, v_error, a_error : (n,) standard errors; of the noise and of what the smoothing leaves open, not of events.
    cutoff : frequency in Hz of which half of the amplitude passes.
    noise : standard deviation of the samples about x.
    """

    x: Array
    v: Array
    a: Array
    x_error: Array
    v_error: Array
    a_error: Array
    cutoff: float
    noise: float


def jerk_spline(time: Array, signal: Array, weight: Array | None = None, cutoff: float | None = None) -> Smooth:
    """Quintic spline with a penalty on its third derivative; the cut-off is the likeliest unless one is given.

    Minimised is sum_i a_i (y_i - u(t_i))^2 + lambda * integral of (u''')^2, lambda = 1/(step (2 pi cutoff)^6).

    Parameters
    ----------
    time : (n,) s, increasing, may be uneven.
    signal : (n,) in any unit.
    weight : (n,) 0 for samples to leave out.
    cutoff : Hz.

    Examples
    --------
    >>> t = np.linspace(0, 10, 1001)
    >>> smooth = jerk_spline(t, np.sin(t) + 1e-3 * np.random.default_rng(0).standard_normal(1001))
    >>> bool(np.abs(smooth.a + np.sin(t))[50:-50].max() < 0.1)
    True
    """
    step = mean_step(time)
    still = OscillatorConstants(mass=1.0, damping=0.0, stiffness=1.0, drive_velocity=0.0)
    ones = np.ones(len(time)) if weight is None else weight

    def whole(part: slice, knots: float) -> PiecewiseFit:
        t = time[part]
        return PiecewiseFit(t, signal[part], ones[part], t[[0, -1]], ["creep"], still, knots, knots)

    n, most = len(time), 8000
    if cutoff is None:
        middle = slice(None) if n <= most else slice((n - most) // 2, (n + most) // 2)
        trial = whole(middle, 3 * step)
        cutoff = trial.best_cutoff("creep", (2 / (n * step), 0.16 / step), {})
    # more knots than the cut-off can tell apart cost time only
    fit = whole(slice(None), float(np.clip(0.15 / cutoff, 2 * step, (time[-1] - time[0]) / 8))).solve({"creep": cutoff})
    positions = np.unique(np.concatenate([fit.knots[0], time[[0, -1]]]))
    x, v, a = (fit.evaluate(time, d) for d in range(3))
    errors = [np.interp(time, positions, fit.deviation(positions, {d: 1.0}, fit.noise)) for d in range(3)]
    return Smooth(x, v, a, errors[0], errors[1], errors[2], cutoff, fit.noise)


def savitzky_golay(time: Array, signal: Array, cutoff: float) -> Smooth:
    """Local polynomials of `ORDER` over a window whose half-amplitude frequency is `cutoff` (Hz).

    A window of 2 M + 1 samples passes half of the power at (order + 1)/(3.2 M - 4.6) of the Nyquist frequency
    (R. W. Schafer, IEEE Signal Process. Mag. 28 (4), 2011, eq. 12). Its errors are those of the noise alone: what such a
    window cuts off a bend is not in them.

    Examples
    --------
    >>> t = np.linspace(0, 10, 1001)
    >>> bool(np.abs(savitzky_golay(t, np.sin(t), 3.0).v - np.cos(t))[50:-50].max() < 1e-2)
    True
    """
    step = _even_step(time)
    half = max(round(((ORDER + 1) / (2 * cutoff * step) + 4.6) / 3.2), ORDER // 2 + 1)
    if 2 * half + 1 > len(signal):
        raise InputError(
            f"motion: a cut-off of {cutoff:g} Hz needs {2 * half + 1} samples, the record has {len(signal)}"
        )
    window = 2 * half + 1
    noise = noise_level(signal)
    from scipy.signal import savgol_coeffs, savgol_filter  # loads for half a second

    x, v, a = (np.asarray(savgol_filter(signal, window, ORDER, deriv=d, delta=step)) for d in range(3))
    errors = [
        np.full(len(signal), noise * math.sqrt(float(np.sum(savgol_coeffs(window, ORDER, deriv=d, delta=step) ** 2))))
        for d in range(3)
    ]
    return Smooth(x, v, a, errors[0], errors[1], errors[2], cutoff, noise)


def kalman(time: Array, signal: Array, cutoff: float | None = None, weight: Array | None = None) -> Smooth:
    """Kalman filter and Rauch-Tung-Striebel smoother for a motion whose jerk is white noise.

    State (x, v, a); the ratio of jerk to measuring noise is (2 pi cutoff)^6 step, by maximum likelihood where no cut-off
    is given. The noise is profiled. Time stamps may be uneven.

    Examples
    --------
    >>> t = np.linspace(0, 10, 501)
    >>> smooth = kalman(t, np.sin(t) + 1e-3 * np.random.default_rng(0).standard_normal(501))
    >>> bool(np.abs(smooth.a + np.sin(t))[50:-50].max() < 0.1)
    True
    """
    steps = np.diff(time)
    step = float(np.mean(steps))
    use = np.ones(len(time)) if weight is None else weight
    scale = float(np.std(signal)) or 1.0
    y = (signal - signal[0]) / scale
    if cutoff is None:
        most = min(len(time), 2000)

        def deviance(log_cutoff: float) -> float:
            return _filter(y[:most], steps[: most - 1], use[:most], math.exp(log_cutoff), step)[-1]

        cutoff = math.exp(deepest_valley(deviance, math.log(2 / (len(time) * step)), math.log(0.3 / step), 0.05))
    ahead, ahead_cov, means, covs, noise, _ = _filter(y, steps, use, cutoff, step)
    for i in range(len(y) - 2, -1, -1):
        gain = covs[i] @ _transition(steps[i]).T @ np.linalg.inv(ahead_cov[i + 1])
        means[i] += gain @ (means[i + 1] - ahead[i + 1])
        covs[i] += gain @ (covs[i + 1] - ahead_cov[i + 1]) @ gain.T
    values = means * scale
    errors = noise * scale * np.sqrt(np.maximum(np.einsum("ijj->ij", covs), 0.0))
    x = values[:, 0] + signal[0]
    return Smooth(x, values[:, 1], values[:, 2], errors[:, 0], errors[:, 1], errors[:, 2], cutoff, noise * scale)


def _transition(step: float) -> Array:
    return np.array([[1.0, step, step**2 / 2], [0.0, 1.0, step], [0.0, 0.0, 1.0]])


def _filter(
    y: Array, steps: Array, use: Array, cutoff: float, step: float
) -> tuple[Array, Array, Array, Array, float, float]:
    """Means and covariances before and after each sample, in units of the noise; noise and deviance."""
    n = len(y)
    strength = (2 * math.pi * cutoff) ** 6 * step
    ahead, ahead_cov = np.zeros((n, 3)), np.zeros((n, 3, 3))
    means, covs = np.zeros((n, 3)), np.zeros((n, 3, 3))
    mean = np.zeros(3)
    omega = 2 * math.pi * cutoff
    # as good as unknown at the start, yet within reach of the arithmetic
    cov = np.diag([1e6, 1e6 * omega**2, 1e6 * omega**4])
    misfit = log_sum = 0.0
    count = 0
    cached = -1.0
    move = noise = np.zeros((3, 3))
    for i in range(n):
        if i:
            h = float(steps[i - 1])
            if h != cached:
                cached, move = h, _transition(h)
                noise = strength * np.array(
                    [
                        [h**5 / 20, h**4 / 8, h**3 / 6],
                        [h**4 / 8, h**3 / 3, h**2 / 2],
                        [h**3 / 6, h**2 / 2, h],
                    ]
                )
            mean = move @ mean
            cov = move @ cov @ move.T + noise
        ahead[i], ahead_cov[i] = mean, cov
        if use[i]:
            spread = cov[0, 0] + 1.0
            surprise = y[i] - mean[0]
            gain = cov[:, 0] / spread
            mean = mean + gain * surprise
            cov = cov - np.outer(gain, cov[0])
            if i >= 3:
                misfit += surprise**2 / spread
                log_sum += math.log(spread)
                count += 1
        means[i], covs[i] = mean, cov
    variance = max(misfit / max(count, 1), 1e-300)
    return ahead, ahead_cov, means, covs, math.sqrt(variance), count * math.log(variance) + log_sum


def _even_step(time: Array) -> float:
    steps = np.diff(time)
    step = float(np.mean(steps))
    if float(np.max(np.abs(steps - step))) > 0.1 * step:
        raise InputError(
            "motion: Savitzky-Golay needs evenly spaced samples, and here steps differ by more than a tenth; use "
            'method = "kalman" or "pieces"'
        )
    return step
