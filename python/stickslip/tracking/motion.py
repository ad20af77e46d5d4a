"""What tracking gives: where each mass was, how well that is known, and why it is missing where it is."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from stickslip import _core
from stickslip.files.arrays import Array
from stickslip.files.netcdf import write_netcdf
from stickslip.tracking.scale.calibration import Calibration

if TYPE_CHECKING:
    import xarray as xr


def motion_dataset(
    times: Array,
    x: Array,
    y: Array,
    x_error: Array,
    y_error: Array,
    lost: np.ndarray,
    calibration: Calibration,
    *,
    source: str,
    frame_rate: float,
    diameter: Array | None = None,
) -> xr.Dataset:
    """A motion from places in the picture, all (time, mass); a coordinate that an edge cuts off is taken out here.

    Where the places are the centroids of discs their `diameter` in px is given.
    """
    import xarray as xr

    if calibration.unit == "px":
        world, errors = (x.copy(), y.copy()), (x_error.copy(), y_error.copy())
    else:
        bent = calibration.lens is not None or calibration.homography is not None
        world = (
            calibration.to_world(x, y) if diameter is None or not bent else calibration.discs_to_world(x, y, diameter)
        )
        errors = calibration.errors(x, y, x_error, y_error)
    for axis, position, error in zip("xy", world, errors, strict=True):
        gone = np.array(
            [[reason != "" and (":" not in reason or axis in reason.split(":")[0]) for reason in row] for row in lost]
        )
        gone = gone.reshape(lost.shape)
        position[gone] = np.nan
        error[gone] = np.nan
    unit = {"units": calibration.unit}
    both = ("time", "mass")
    finite = times[np.isfinite(times)]
    steps = np.diff(finite)
    rate = frame_rate if np.isfinite(frame_rate) else (1 / float(np.median(steps)) if steps.size else 0.0)
    return xr.Dataset(
        {
            "x": (both, world[0], unit | {"long_name": "position along the axis"}),
            "y": (both, world[1], unit | {"long_name": "position across the axis"}),
            "x_error": (both, errors[0], unit | {"long_name": "standard error of x"}),
            "y_error": (both, errors[1], unit | {"long_name": "standard error of y"}),
            "lost": (both, lost, {"long_name": "why a coordinate is missing; empty where it is not"}),
            "x_px": (both, x, {"units": "px", "long_name": "place in the picture, to the right"}),
            "y_px": (both, y, {"units": "px", "long_name": "place in the picture, downwards"}),
        },
        coords={
            "time": ("time", times, {"units": "s"}),
            "mass": np.arange(x.shape[1]),
            "frame": ("time", np.arange(len(times))),
        },
        attrs={
            "title": "stickslip motion",
            "stickslip": "motion",
            "source": source,
            "frame_rate": rate,
            "calibration": calibration.to_json(),
            "scale_error": calibration.scale_error,
            "version": _core.__version__,
            "notes": list(calibration.notes),
        },
    )


def save_motion(motion: xr.Dataset, path: str | Path) -> Path:
    """Write a motion file whole or not at all."""
    return write_netcdf(path, motion)
