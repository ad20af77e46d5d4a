"""Readings that come in steps too coarse for the noise to even them out."""

from __future__ import annotations

import numpy as np

from stickslip.files.arrays import Array
from stickslip.files.units import unit_suffix

DITHERED = 0.4
"""Noise of so many steps ahead of the converter makes its error one of noise."""
FEWEST_VALUES = 5
"""Values of a record that show a step."""
EVEN = 1e-3
"""Part of a step by which the distances of values may be off whole numbers of it."""


def coarse_step(readings: Array, noise: float) -> float:
    """The step of a converter that is coarser than the noise ahead of it, in the unit of the readings; 0 where it is not.

    A step q leaves an error of q / sqrt(12) rms. With noise of half a step ahead of the converter that is white noise, and
    the means of many samples lose it. Without, it is the same in each motion that repeats itself, and they do not.

    Parameters
    ----------
    readings : (n,) as the converter gave them.
    noise : standard deviation of a reading, the error of the steps in it.

    Source: Widrow & Kollar, Quantization Noise (2008), chapter 19, https://doi.org/10.1017/CBO9780511754661.

    Examples
    --------
    >>> ramp = np.linspace(0, 1, 999)
    >>> coarse_step(np.round(ramp, 1), 0.03), coarse_step(ramp, 0.03)
    (0.1, 0.0)
    """
    values = np.unique(readings)
    if len(values) < FEWEST_VALUES:
        return 0.0
    apart = np.diff(values)
    apart = apart[apart > 1e-9 * (values[-1] - values[0])]  # what scaling rounds off is no step
    step = float(np.median(apart[apart < 1.5 * apart.min()]))
    counts = apart / step
    if np.abs(counts - np.round(counts)).max() > EVEN * counts.max():
        return 0.0
    ahead = max(noise**2 - step**2 / 12, 0.0) ** 0.5
    return round(step, 12) if ahead < DITHERED * step else 0.0


def note_on_steps(step: float, unit: str, common: float, force: str) -> str:
    """The sentence on steps of this size, and on the error that all forces have in common for them; units of both."""
    return (
        f"the readings come in steps of {step:.3g}{unit_suffix(unit)}, coarser than the noise: lines and creep smaller than "
        f"a step may come of it; the errors of all forces hold {common:.2g}{unit_suffix(force)} for it; "
        "a finer range or noise of half a step evens it out"
    )
