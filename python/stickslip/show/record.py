"""A measured friction record: what was found in it, at a glance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.show.canvas import OKABE_ITO, new_axes

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

#: Cycles (or break-aways) shown over time; the whole record would be a black band.
CYCLES = 8


def friction_record(friction: xr.DataTree) -> list[Axes]:
    """Draw friction force and slip velocity over time, sticks shaded, and friction over slip velocity.

    Parameters
    ----------
    friction : from :func:`stickslip.measure`.

    Returns
    -------
    Three axes of a new figure: force over time and slip velocity over time, both around the middle of the record, and
    force over slip velocity of the whole record, blue while the slip speeds up and orange while it slows down.
    """
    data = friction.to_dataset()
    time, force = data["time"].to_numpy(), data["force"].to_numpy()
    w, stuck = data["slip_velocity"].to_numpy(), data["stuck"].to_numpy().astype(bool)
    releases = friction["break_away"]["t"].to_numpy() if "break_away" in friction.children else np.array([])
    middle = slice(*np.searchsorted(time, _window(time, releases)))
    unit = "" if data["force"].attrs.get("units", "1") == "1" else f" ({data['force'].attrs['units']})"
    speed_unit = "" if w.size and data["slip_velocity"].attrs.get("units", "1") == "1" else " (m/s)"

    over_time, velocity, loop = new_axes(1, 3, figsize=(12.5, 3.6), layout="constrained")
    for ax, values, name, colour in (
        (over_time, force, "friction F" + unit, OKABE_ITO["vermilion"]),
        (velocity, w, "slip velocity w" + speed_unit, OKABE_ITO["blue"]),
    ):
        ax.plot(time[middle], values[middle], color=colour, lw=0.9)
        ax.fill_between(
            time[middle], 0, 1, where=stuck[middle], transform=ax.get_xaxis_transform(), color="0.5", alpha=0.2, lw=0
        )
        ax.set(xlabel="time t", ylabel=name)
        ax.margins(x=0)
    speeding = data["slip_acceleration"].to_numpy() * np.sign(w) > 0
    stride = max(1, int((~stuck).sum()) // 20_000)
    for which, colour, name in (
        (speeding, OKABE_ITO["blue"], "speeding up"),
        (~speeding, OKABE_ITO["orange"], "slowing down"),
    ):
        rows = np.flatnonzero(which & ~stuck)[::stride]
        loop.plot(w[rows], force[rows], ".", ms=1.5, color=colour, label=name, rasterized=True)
    loop.set(xlabel="slip velocity w" + speed_unit, ylabel="friction F" + unit)
    loop.legend(fontsize=8, frameon=False, markerscale=5)
    return [over_time, velocity, loop]


def _window(time: np.ndarray, releases: np.ndarray) -> tuple[float, float]:
    """The span of some break-aways about the middle of the record, or the middle tenth of it."""
    if releases.size > CYCLES:
        first = (releases.size - CYCLES) // 2
        return float(releases[first]), float(releases[first + CYCLES])
    span = (time[-1] - time[0]) / (10 if releases.size == 0 else 1)
    centre = 0.5 * (time[0] + time[-1])
    return float(centre - 0.5 * span), float(centre + 0.5 * span)
