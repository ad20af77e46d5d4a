"""Spectra of a motion: its main line, the whole record, and along time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from stickslip.errors import InputError
from stickslip.files.arrays import Array

STRONG = 0.3
"""A line with that part of the power of the highest is as good a main line."""
NEAR = 0.2
"""A line within that part of a rate is the line of it."""
LEAST_PERIODS = 8
"""Periods of the line that a segment holds, where the record has as many."""


@dataclass(frozen=True)
class Line:
    """A line of a spectrum.

    Attributes
    ----------
    frequency, error : in Hz.
    share : power within two bins of the peak over all power.
    """

    frequency: float
    error: float
    share: float


def main_line(signal: Array, step: float, rate: float = 0.0) -> Line:
    """Highest peak of the spectrum by Welch's method, its top from a parabola through the logarithms of three bins.

    Parameters
    ----------
    signal : (n,) evenly sampled.
    step : sampling interval in s.
    rate : how often the motion repeats itself, such as sticks per second, 0 where it is not known. Where the highest peak is
        a harmonic of it and the peak at the rate itself nearly as strong, the line at the rate is the main one.

    Returns
    -------
    Line; the error is a quarter of a bin, or the scatter of the peak over four stretches of the record if that is more.
    Records of less than 32 periods are too short for the scatter, those of less than eight are taken as one segment.

    Examples
    --------
    >>> t = np.arange(4000) / 1000
    >>> line = main_line(np.sin(2 * np.pi * 15.1 * t), 1e-3)
    >>> round(line.frequency, 1)
    15.1
    """
    first = _peak(signal, step, len(signal))[0]
    periods = len(signal) * step * first if np.isfinite(first) else 0.0
    # Eight segments that overlap by half, but never so short that the line falls among the lowest frequencies.
    length = min(max(int(len(signal) * max(1 / 4.5, LEAST_PERIODS / max(periods, 1.0))), 8), len(signal))
    whole = _peak(signal, step, length)
    if whole[0] > 1.5 * rate > 0:
        lowest = _peak(signal, step, length, (1 - NEAR) * rate, (1 + NEAR) * rate)
        if lowest[1] >= STRONG * whole[1]:
            return Line(lowest[0], 0.25 / (length * step), lowest[1])
    error = 0.25 / (length * step)
    if periods >= 4 * LEAST_PERIODS:
        quarters = [_peak(part, step, len(part))[0] for part in np.array_split(signal, 4)]
        error = max(error, float(np.std(quarters, ddof=1)) / 2)
    return Line(whole[0], error, whole[1])


def _peak(signal: Array, step: float, length: int, least: float = 0.0, most: float = np.inf) -> tuple[float, float]:
    from scipy.signal import welch  # loads for half a second

    frequency, power = welch(signal - np.mean(signal), 1 / step, window="hann", nperseg=length, detrend="constant")
    inside = np.flatnonzero(frequency >= max(least, 1.5 * frequency[1]))
    total = float(power[inside].sum())
    if len(inside) < 3 or total <= 0:
        return float("nan"), 0.0
    looked = inside[frequency[inside] <= most]
    if not len(looked):
        return float("nan"), 0.0
    i = int(looked[np.argmax(power[looked])])
    share = float(power[max(i - 2, 0) : i + 3].sum()) / total
    if i in (0, len(power) - 1):
        return float(frequency[i]), share
    below, top, above = np.log(np.maximum(power[i - 1 : i + 2], 1e-300))
    corner = below - 2 * top + above
    shift = 0.5 * (below - above) / corner if corner < 0 else 0.0
    return float(frequency[i] + np.clip(shift, -0.5, 0.5) * frequency[1]), share


def spectrum(signal: Any, time: Any = None) -> xr.Dataset:
    """Spectrum of a whole record ("total"), of the acceleration for instance.

    Parameters
    ----------
    signal : (n,) values, or a DataArray over `time` such as ``motion["a"]``; its mean is taken off.
    time : (n,) s, evenly spaced; not needed for a DataArray.

    Returns
    -------
    Dataset over `frequency` (Hz): `amplitude` (of a sine, in the unit of the signal, Hann window over the whole record)
    and `power` (density per Hz, Welch's mean over eight segments).

    Examples
    --------
    >>> t = np.arange(4000) / 1000
    >>> total = spectrum(0.5 * np.sin(2 * np.pi * 15 * t), t)
    >>> float(total["frequency"][int(np.argmax(total["amplitude"].values))]), round(float(total["amplitude"].max()), 3)
    (15.0, 0.5)
    """
    values, step, unit = _even(signal, time)
    n = len(values)
    window = np.hanning(n + 1)[:n]
    amplitude = 2 * np.abs(np.fft.rfft((values - values.mean()) * window)) / window.sum()
    frequency = np.fft.rfftfreq(n, step)
    from scipy.signal import welch

    coarse, power = welch(values - values.mean(), 1 / step, nperseg=max(int(n / 4.5), 8), detrend="constant")
    data = xr.Dataset(coords={"frequency": ("frequency", frequency, {"units": "Hz"})})
    data["amplitude"] = ("frequency", amplitude, {"units": unit})
    data["power"] = ("frequency", np.interp(frequency, coarse, power), {"units": f"({unit})^2/Hz"})
    return data


def spectrum_over_time(signal: Any, time: Any = None, window: float | None = None) -> xr.Dataset:
    """Spectrum along time ("actual"): amplitudes in a window that slides over the record.

    Parameters
    ----------
    signal, time : as for `spectrum`.
    window : length in s; default: eight periods of the main line, at most a quarter of the record.

    Returns
    -------
    Dataset over `frequency` (Hz) and `time` (s): `amplitude` of a sine in the unit of the signal (Hann window).

    Raises
    ------
    InputError
        for a window shorter than 8 samples or longer than the record.

    Examples
    --------
    >>> t = np.arange(4000) / 1000
    >>> actual = spectrum_over_time(np.where(t < 2, np.sin(2 * np.pi * 20 * t), np.sin(2 * np.pi * 50 * t)), t, 0.5)
    >>> line = actual["frequency"][actual["amplitude"].argmax("frequency")]
    >>> float(line.sel(time=1.0, method="nearest")), float(line.sel(time=3.0, method="nearest"))
    (20.0, 50.0)
    """
    values, step, unit = _even(signal, time)
    n = len(values)
    if window is None:
        line = main_line(values, step).frequency
        window = min(8 / line, n * step / 4) if line > 0 else n * step / 4
    length = round(window / step)
    if not 8 <= length <= n:
        raise InputError(f"spectrum: the window must be {8 * step:g} to {n * step:g} s long, got {window:g}")
    hop = max(length // 8, 1)
    starts = np.arange(0, n - length + 1, hop)
    shape = np.hanning(length + 1)[:length]
    parts = np.lib.stride_tricks.sliding_window_view(values, length)[starts]
    parts = (parts - parts.mean(axis=1, keepdims=True)) * shape
    amplitude = 2 * np.abs(np.fft.rfft(parts, axis=1)) / shape.sum()
    start = float(signal["time"][0]) if isinstance(signal, xr.DataArray) else 0.0 if time is None else float(time[0])
    data = xr.Dataset(
        coords={
            "frequency": ("frequency", np.fft.rfftfreq(length, step), {"units": "Hz"}),
            "time": ("time", start + (starts + (length - 1) / 2) * step, {"units": "s"}),
        }
    )
    data["amplitude"] = (("frequency", "time"), amplitude.T, {"units": unit})
    data.attrs["window"] = length * step
    return data


def _even(signal: Any, time: Any) -> tuple[Array, float, str]:
    if isinstance(signal, xr.DataArray):
        time = signal["time"].to_numpy() if time is None else time
        unit = str(signal.attrs.get("units", "1"))
    else:
        unit = "1"
    values = np.asarray(signal, dtype=np.float64)
    if time is None:
        raise InputError("spectrum: the time of the samples is missing; give time, or a DataArray over time")
    stamps = np.asarray(time, dtype=np.float64)
    if values.ndim != 1 or values.shape != stamps.shape or len(values) < 16:
        raise InputError(
            f"spectrum: one signal of 16 samples or more was expected with as many times, got {values.shape} and "
            f"{stamps.shape}"
        )
    if not np.isfinite(values).all():
        raise InputError("spectrum: the signal holds NaN or infinity; fit it first (motion) or cut these off")
    steps = np.diff(stamps)
    step = float(np.mean(steps))
    if step <= 0 or float(np.max(np.abs(steps - step))) > 0.1 * step:
        raise InputError("spectrum: evenly spaced samples were expected; resample the record first")
    return values, step, unit
