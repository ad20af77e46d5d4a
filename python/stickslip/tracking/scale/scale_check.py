"""A thing that falls freely shows whether a film's scale is right: g is known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stickslip.errors import InputError

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class FreeFall:
    """What a free fall says of the scale.

    Attributes
    ----------
    gravity, gravity_error : downward acceleration with its standard error, m/s².
    drift : velocity across, m/s.
    residual : rms distance of the points from the parabola, m.
    factor : by which all lengths must be multiplied for the expected gravity.
    sentence : all that in words.
    """

    gravity: float
    gravity_error: float
    drift: float
    residual: float
    factor: float
    sentence: str


def free_fall(motion: xr.Dataset, mass: int = 0, gravity: float = 9.81) -> FreeFall:
    """Fit y = y0 + v t − g t²/2 (and x = x0 + u t) and compare g with what it must be.

    Parameters
    ----------
    motion : in m, y upwards; the thing must fall freely throughout.
    mass : which one.
    gravity : what g must be, m/s².

    Raises
    ------
    InputError
        for a motion in px or fewer than five points.
    """
    if motion["y"].attrs.get("units") != "m":
        raise InputError("free fall: the motion must be in m; give the film a calibration")
    one = motion.isel(mass=mass)
    x, y, t = (one[name].to_numpy() for name in ("x", "y", "time"))
    seen = np.isfinite(x) & np.isfinite(y)
    if seen.sum() < 5:
        raise InputError(f"free fall: five points are needed, got {int(seen.sum())}")
    x, y, t = x[seen], y[seen], t[seen] - t[seen].mean()
    curve, covariance = np.polyfit(t, y, 2, cov=True)
    line = np.polyfit(t, x, 1)
    g, error = -2 * float(curve[0]), 2 * float(np.sqrt(covariance[0, 0]))
    residual = float(np.sqrt(np.mean((y - np.polyval(curve, t)) ** 2)))
    off = g / gravity - 1
    sentence = f"The fall gives g = {g:.2f} ± {error:.2f} m/s²"
    if abs(g - gravity) > 3 * error:
        side = "above" if off > 0 else "below"
        sentence += (
            f", {100 * abs(off):.1f} % {side} {gravity:g}: the scale is off, "
            f"lengths should be multiplied by {gravity / g:.4f}."
        )
    else:
        sentence += f", which agrees with {gravity:g}: the scale holds within {100 * error / g:.1f} %."
    return FreeFall(g, error, float(line[0]), residual, gravity / g, sentence)
