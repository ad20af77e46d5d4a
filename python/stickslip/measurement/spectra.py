"""The main line of a motion's spectrum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.signal import welch

Array = npt.NDArray[np.float64]


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


def main_line(signal: Array, step: float, least: float = 0.0) -> Line:
    """Highest peak of the spectrum by Welch's method, its top from a parabola through the logarithms of three bins.

    Parameters
    ----------
    signal : (n,) evenly sampled.
    step : sampling interval in s.
    least : frequencies below are not looked at, Hz.

    Returns
    -------
    Line; the error is the scatter of the peak over four stretches of the record, or a quarter of a bin if that is more.

    Examples
    --------
    >>> t = np.arange(4000) / 1000
    >>> line = main_line(np.sin(2 * np.pi * 15.1 * t), 1e-3)
    >>> round(line.frequency, 1)
    15.1
    """
    length = max(int(len(signal) / 4.5), 8)  # eight segments that overlap by half
    whole = _peak(signal, step, length, least)
    quarters = [_peak(part, step, len(part), least)[0] for part in np.array_split(signal, 4)]
    scatter = float(np.std(quarters, ddof=1)) / 2
    bin_width = 1 / (length * step)
    return Line(whole[0], max(scatter, bin_width / 4), whole[1])


def _peak(signal: Array, step: float, length: int, least: float) -> tuple[float, float]:
    frequency, power = welch(signal - np.mean(signal), 1 / step, window="hann", nperseg=length, detrend="constant")
    inside = np.flatnonzero(frequency >= max(least, 1.5 * frequency[1]))
    total = float(power[inside].sum())
    if len(inside) < 3 or total <= 0:
        return float("nan"), 0.0
    i = int(inside[np.argmax(power[inside])])
    share = float(power[max(i - 2, 0) : i + 3].sum()) / total
    if i in (0, len(power) - 1):
        return float(frequency[i]), share
    below, top, above = np.log(np.maximum(power[i - 1 : i + 2], 1e-300))
    bend = below - 2 * top + above
    shift = 0.5 * (below - above) / bend if bend < 0 else 0.0
    return float(frequency[i] + np.clip(shift, -0.5, 0.5) * frequency[1]), share
