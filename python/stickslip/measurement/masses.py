"""Motions with several masses: each is a record of its own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from stickslip.errors import InputError
from stickslip.measurement.read import open_motion


def opened(source: Any) -> Any:
    """The Dataset of a netCDF file, with its path as `source`; anything else as it is."""
    if isinstance(source, str | Path) and Path(source).suffix.lower() == ".nc":
        return open_motion(source).assign_attrs(source=str(source))
    return source


def masses_of(source: Any, mass: int | str | None = None) -> dict[str, xr.Dataset] | None:
    """The records in a motion, by the label of their mass; None for anything without a dimension ``mass``.

    Parameters
    ----------
    source : Dataset (dims `time`, `mass`), or the path of a netCDF file of it.
    mass : number or label of one; None for all.
    """
    source = opened(source)
    if not isinstance(source, xr.Dataset) or "mass" not in source.dims:
        return None
    labels = [str(label) for label in source["mass"].values] if "mass" in source.coords else []
    labels = labels or [str(i) for i in range(source.sizes["mass"])]
    if mass is None:
        chosen = list(range(len(labels)))
    elif isinstance(mass, int):
        if not 0 <= mass < len(labels):
            raise InputError(f"measure: mass must be 0 to {len(labels) - 1}, got {mass}")
        chosen = [mass]
    elif mass in labels:
        chosen = [labels.index(mass)]
    else:
        raise InputError(f"measure: mass must be one of {', '.join(labels)}, got {mass!r}")
    found: dict[str, xr.Dataset] = {}
    for i in chosen:
        name = f"{source.attrs.get('source', 'motion')}, mass {labels[i]}"
        found[labels[i]] = _seen(source.isel(mass=i, drop=True).assign_attrs(source=name))
    return found


def _seen(motion: xr.Dataset) -> xr.Dataset:
    """From the first to the last time the mass was seen at all; lost points in between stay missing."""
    if "x" not in motion:
        return motion
    seen = np.flatnonzero(np.isfinite(motion["x"].to_numpy()))
    return motion.isel(time=slice(int(seen[0]), int(seen[-1]) + 1)) if len(seen) else motion
