"""The line of the mains in a record: taken out where the rig names it, else said."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from scipy.ndimage import median_filter, uniform_filter1d

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.files.median_deviation import median_deviation
from stickslip.measurement.read import Record
from stickslip.measurement.rigs.rig import Rig
from stickslip.measurement.signals.sampling import mean_step

MAINS_OFF = 0.005
"""Mains, and the clock of a record, are off their nominal rates by less than this part."""
BLOCK = 4.0
"""Length in s over which amplitude and phase of the mains line are taken as constant."""


def without_mains(record: Record, rig: Rig, notes: list[str]) -> Array:
    """The signal without the mains line that the rig names; a line it does not name is noted."""
    signal = record.signal
    if rig.mains_frequency is not None:
        if rig.mains_frequency * record.step > 0.4:
            raise InputError(
                f"{record.source}: a mains line of {rig.mains_frequency:g} Hz cannot be seen at "
                f"{1 / record.step:g} samples per second; remove mains_frequency from the rig"
            )
        line, frequency = mains_hum(signal, record.time, rig.mains_frequency)
        notes.append(
            f"a mains line at {frequency:.4g} Hz with an amplitude of {math.sqrt(2) * float(np.std(line)):.2g} "
            f"{rig.unit} was subtracted"
        )
        return signal - line
    if rig.unit != "1":  # a dimensionless record has no mains
        for frequency in (50.0, 60.0):
            excess = line_excess(signal, record.step, frequency)
            if excess > 10:
                notes.append(
                    f"the record has a line at {frequency:g} Hz, {excess:.0f} times its neighbourhood; set "
                    f"mains_frequency = {frequency:g} in the rig to take it out"
                )
    return signal


def mains_hum(signal: Array, time: Array, frequency: float) -> tuple[Array, float]:
    """The mains line of a record, as a sine whose amplitude and phase may drift from block to block.

    It is fitted to what is left after a running mean over one period, with the samples near events left out, so it
    rings nowhere; subtract it.

    Parameters
    ----------
    signal : (n,) record.
    time : (n,) of its samples in s.
    frequency : of the line in Hz, below half the sampling rate; the line may be off it by `MAINS_OFF`.

    Returns
    -------
    (n,) the line, and its frequency in Hz.
    """
    n = len(signal)
    step = mean_step(time)
    period = max(round(1 / (frequency * step)), 2)
    trend = uniform_filter1d(uniform_filter1d(signal, period, mode="nearest"), period, mode="nearest")
    residuals = signal - trend
    spread = median_deviation(residuals)
    good = np.abs(residuals) < 4 * max(spread, 1e-300)
    good[: 2 * period] = good[-2 * period :] = False
    frequency = _strongest_near(np.where(good, residuals, 0.0), time, frequency)
    blocks = max(int(n * step / BLOCK), 1)
    edges = np.linspace(0, n, blocks + 1).astype(int)
    phase = 2 * math.pi * frequency * time
    waves = np.stack([np.cos(phase), np.sin(phase)], axis=1)
    amplitudes = np.zeros((blocks, 2))
    for i, (a, b) in enumerate(pairwise(edges.tolist())):
        inside = good[a:b]
        if np.count_nonzero(inside) >= 4 * period:
            amplitudes[i] = np.linalg.lstsq(waves[a:b][inside], residuals[a:b][inside], rcond=None)[0]
    middles = (time[edges[:-1]] + time[np.maximum(edges[1:] - 1, 0)]) / 2
    line = np.zeros(n)
    for column in range(2):
        line += waves[:, column] * np.interp(time, middles, amplitudes[:, column])
    return line, frequency


def _strongest_near(residuals: Array, time: Array, frequency: float) -> float:
    """The frequency within `MAINS_OFF` of the one given at which a record has most power; that one in a short record."""
    length = float(time[-1] - time[0])
    if MAINS_OFF * frequency * length < 1:
        return frequency
    seen = residuals * np.hanning(len(residuals))
    tried = frequency * (1 + MAINS_OFF * np.linspace(-1, 1, 2 * math.ceil(4 * MAINS_OFF * frequency * length) + 1))
    power = [abs(np.sum(seen * np.exp(-2j * math.pi * one * time))) for one in tried.tolist()]
    best = int(np.argmax(power))
    if not 0 < best < len(tried) - 1:
        return frequency
    low, middle, high = np.log(np.maximum(power[best - 1 : best + 2], 1e-300))
    corner = low + high - 2 * middle
    return float(tried[best] + (0.5 * (low - high) / corner if corner < 0 else 0.0) * (tried[1] - tried[0]))


def line_excess(signal: Array, step: float, frequency: float) -> float:
    """Power at this frequency over the median of its neighbourhood.

    1 where there is no line, and where others in its neighbourhood stand out half as far: those are the harmonics of the
    motion, of which it may be one. 0 where it is unseen.
    """
    from scipy.signal import welch

    if frequency > 0.45 / step:
        return 0.0
    length = int(min(len(signal) // 4, round(200 / (frequency * step))))
    if length < 64:
        return 0.0
    frequencies, power = welch(signal, 1 / step, nperseg=length, detrend="constant")
    near = np.abs(frequencies - frequency) <= 1.5 / (length * step)
    around = (np.abs(frequencies - frequency) <= 0.3 * frequency) & ~near
    if not near.any() or np.count_nonzero(around) < 5:
        return 0.0
    level = max(float(np.median(power[around])), 1e-300)
    # A spectrum falls with frequency: each line beside is compared with what lies about itself.
    beside = power / np.maximum(median_filter(power, max(int(around.sum()) // 2, 5)), level * 1e-6)
    wide = (np.abs(frequencies - frequency) <= 0.6 * frequency) & ~near
    excess = float(power[near].max()) / level
    return excess if excess > 2 * float(beside[wide].max()) else 1.0
