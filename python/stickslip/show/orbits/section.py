"""Sections of a motion and return maps."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np

from stickslip.show.canvas import OKABE_ITO, axes, words

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

_SYMBOLS = {
    "t": "time t",
    "x": "position x",
    "v": "velocity ẋ",
    "slip_velocity": "slip velocity w",
    "phase": "phase θ of the forcing",
    "force": "friction force F",
    "stick_time": "stick time tₛ",
    "force_rate": "force rate δ",
    "interval": "time between returns",
}


def section_plot(
    points: xr.Dataset, ax: Axes | None = None, *, across: str = "x", up: str = "v", colour: str = OKABE_ITO["blue"]
) -> Axes:
    """Draw the points of a section, one of its quantities over another.

    Parameters
    ----------
    points : from :func:`stickslip.section`.
    ax : axes to draw into; default a new figure.
    across, up : variables of the section.
    colour : of the points.

    Returns
    -------
    The axes, titled with what makes the section.
    """
    ax = axes(ax)
    ax.plot(points[across], points[up], "o", ms=1.8, mew=0, color=colour, rasterized=True)
    ax.set(xlabel=_label(points, across), ylabel=_label(points, up))
    ax.set_title(_title(points), fontsize=9)
    return ax


def return_map_plot(pairs: xr.Dataset, ax: Axes | None = None, *, colour: str = OKABE_ITO["blue"]) -> Axes:
    """Draw a return map with its diagonal: where they meet, the motion repeats.

    Parameters
    ----------
    pairs : from :func:`stickslip.return_map` (dots) or :func:`stickslip.release_map` (dots along a curve with gaps).
    ax : axes to draw into; default a new figure.
    colour : of the points.

    Returns
    -------
    The axes, with equal scales.
    """
    ax = axes(ax)
    if "image" in pairs:
        columns, name, unit, lag = ("phase", "image"), "phase", "rad", 1
    else:
        columns, name, lag = ("before", "after"), str(pairs.attrs["quantity"]), int(pairs.attrs["lag"])
        unit = str(pairs["before"].attrs.get("units", "1"))
    before, after = (pairs[column].to_numpy() for column in columns)
    known = np.isfinite(after)
    ends = (
        [0.0, 2 * np.pi]
        if name == "phase"
        else [min(before.min(), after[known].min()), max(before.max(), after[known].max())]
    )
    ax.plot(ends, ends, color=OKABE_ITO["grey"], lw=0.7, zorder=0)
    ax.plot(before, after, "o", ms=1.8, mew=0, color=colour, rasterized=True)
    symbol, unit = _SYMBOLS.get(name, words(name)), "dimensionless" if unit == "1" else unit
    later = "next" if lag == 1 else f"{lag}th next"
    ax.set(xlabel=f"{symbol} ({unit})", ylabel=f"{symbol}, {later} return ({unit})")
    if name == "phase":
        ax.set(xlim=ends, ylim=ends)
    ax.set_aspect("equal", adjustable="box")
    return ax


def _label(points: xr.Dataset, name: str) -> str:
    unit = str(points[name].attrs.get("units", "1"))
    return f"{_SYMBOLS.get(name, words(name))} ({'dimensionless' if unit == '1' else unit})"


def _title(points: xr.Dataset) -> str:
    surface = json.loads(points.attrs["surface"])
    if "strobe" in surface:
        return f"every {surface['strobe']['period']:.4g} time units"
    if "event" in surface:
        return f"at every {words(surface['event'])}"
    plane = surface["plane"]
    if plane["normal"] == [0.0, 1.0, 0.0] and plane["level"] == 0 and plane["direction"]:
        return "at every maximum of x" if plane["direction"] < 0 else "at every minimum of x"
    x, v, _ = plane["normal"]
    return f"where {x:g} x {'+' if v >= 0 else '−'} {abs(v):g} ẋ = {plane['level']:g}"
