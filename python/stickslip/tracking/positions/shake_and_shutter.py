"""What the camera does to positions: it shakes, exposes, reads row after row. Its lens is in `scale/calibration.py`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stickslip.files.arrays import Array
from stickslip.tracking.positions.size_changes import FEWEST_PICTURES

if TYPE_CHECKING:
    import xarray as xr


def without_shake(
    reference: tuple[int, ...], x: Array, y: Array, x_error: Array, y_error: Array, lost: np.ndarray
) -> str:
    """Take the motion of the camera, as its resting markers show it, from all places; the sentence says how large it is.

    The shift of a picture is the mean of what the markers seen in it are off their own median places. Its error is that of
    the scatter of several markers about it: their stated ones hold what lies beside a marker, too, which rests with it.
    """
    fixed = list(reference)
    unseen = (lost[:, fixed] != "").all(axis=1)
    size = []
    for position, error in ((x, x_error), (y, y_error)):
        known = np.where(lost[:, fixed] == "", position[:, fixed], np.nan)
        off = np.ma.masked_invalid(known - np.nanmedian(known, axis=0))
        shift = off.mean(axis=1).filled(np.nan)
        own = np.where(np.isfinite(known), error[:, fixed], np.nan) ** 2
        free = int(np.maximum(off.count(axis=1) - 1, 0).sum())
        if free >= FEWEST_PICTURES:
            own = np.full_like(own, float(((off - off.mean(axis=1)[:, None]) ** 2).sum()) / free)
        position -= shift[:, None]
        seen = off.count(axis=1)
        of_shift = np.sqrt(np.where(off.mask, 0, own).sum(axis=1)) / np.maximum(seen, 1)
        error[:] = np.hypot(error, np.where(seen > 0, of_shift, np.nan)[:, None])
        size.append(float(np.nanstd(shift)))
    lost[unseen[:, None] & (lost == "")] = "no reference seen"
    rms = math.hypot(*size)
    return (
        f"The camera moves by {rms:.2g} px rms as {len(fixed)} resting marker(s) show; that was taken from the places."
    )


def without_shutter(motion: xr.Dataset, exposure: float, line_time: float) -> str:
    """Give all places the time of the middle of their exposure, as their rows see it; the sentence says what was done.

    The time is that of the first mass, on whose row it is taken; the others are moved along their own way to it, by cubic
    splines. A picture shows the mean over the exposure T, which is off the middle by ẍ T²/24, with ẍ from every second
    picture of five, whose noise does not show in that.
    """
    from scipy.interpolate import CubicSpline

    rows = motion["y_px"].to_numpy()
    stamps = motion["time"].to_numpy() + 0.5 * exposure
    height = float(np.nanmedian(rows[:, 0]))
    common = stamps + line_time * height
    for name in ("x", "y"):
        for mass in range(rows.shape[1]):
            seen = np.flatnonzero(np.isfinite(motion[name].to_numpy()[:, mass]))
            moments = stamps[seen] + line_time * rows[seen, mass]
            if len(seen) > 4 and (np.diff(moments) > 0).all():
                positions = motion[name].to_numpy()[seen, mass]
                way = CubicSpline(moments, positions)
                speed = (positions[2:] - positions[:-2]) / (moments[2:] - moments[:-2])
                curvature = 2 * (speed[2:] - speed[:-2]) / (moments[4:] - moments[:-4])
                curvature = np.interp(moments, moments[2:-2], curvature)
                motion[name][seen, mass] = way(common[seen]) - curvature * exposure**2 / 24
    motion.coords["time"] = ("time", common, motion["time"].attrs)
    after = 1e3 * (0.5 * exposure + line_time * height)
    return f"Times are those of the middle of the exposure, {after:.4g} ms after the stamps, and of row {height:.0f}."
