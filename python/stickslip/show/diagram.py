"""The orbit diagram: turning points of long runs over a parameter, regimes shaded and named."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.errors import InputError
from stickslip.show.canvas import DIRECTION_COLOURS, OKABE_ITO, REGIME_COLOURS, axes, label, parameter_label, words

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

_QUANTITIES = {
    "x": ("turning_x", "position x at ẋ = 0", "position"),
    "slip_velocity": ("turning_slip_velocity", "slip velocity w at ẇ = 0", "velocity"),
    "section": ("section_x", "position x in the section", "position"),
}
_DIRECTIONS = {"up": "swept up", "down": "swept down", "fresh": "fresh starts"}


def orbit_diagram_plot(
    diagram: xr.Dataset,
    ax: Axes | None = None,
    *,
    quantity: str = "x",
    name_regimes: bool = True,
    units: str | None = None,
) -> Axes:
    """Draw an orbit diagram: the turning points over the parameter.

    Of one direction, regimes are coloured, shaded and named; of several, each direction has its colour, so that motions
    which coexist stand out: where two colours show different points, the motion depends on where it comes from.

    Parameters
    ----------
    diagram : from :func:`stickslip.dynamics.orbit_diagram`.
    ax : axes to draw into; default a new figure.
    quantity : ``"x"`` (position where ẋ = 0), ``"slip_velocity"`` (where ẇ = 0) or ``"section"`` (position at the returns).
    name_regimes : whether the regimes are written above their spans.
    units : ``"dimensionless"`` or ``"SI"``; default what the diagram says.

    Returns
    -------
    The axes. A regime reaches half-way to the next value of the parameter.

    Source: Fig. 14 of the paper.
    """
    if quantity not in _QUANTITIES:
        raise InputError(f"orbit_diagram_plot: quantity must be one of {', '.join(_QUANTITIES)}, got {quantity!r}")
    ax = axes(ax)
    which = units or str(diagram.attrs.get("units", "dimensionless"))
    parameter = str(diagram.attrs["parameter"])
    variable, name, kind = _QUANTITIES[quantity]
    ax.set(xlabel=parameter_label(parameter, which), ylabel=label(name, kind, which))
    if "direction" in diagram.dims:
        return _draw_directions(diagram, parameter, variable, ax)
    values, regimes = diagram[parameter].to_numpy(), diagram["regime"].to_numpy().astype("<U16")
    points = diagram[variable].transpose(parameter, "point").to_numpy()
    across = np.broadcast_to(values[:, None], points.shape)
    colours = np.array([REGIME_COLOURS[regime] for regime in regimes])
    for regime in dict.fromkeys(regimes):
        mine = np.flatnonzero(regimes == regime)
        ax.plot(
            across[mine].ravel(),
            points[mine].ravel(),
            ".",
            ms=2.2,
            mew=0,
            color=colours[mine[0]],
            rasterized=True,
            zorder=2,
        )
    edges = np.concatenate([values[:1], (values[1:] + values[:-1]) / 2, values[-1:]])
    starts = np.flatnonzero(np.append(True, regimes[1:] != regimes[:-1]))
    ends = np.append(starts[1:], len(values))
    for start, end in zip(starts, ends, strict=True):
        low, high = edges[start], edges[end]
        ax.axvspan(low, high, color=REGIME_COLOURS[regimes[start]], alpha=0.09, lw=0, zorder=0)
        if start:
            ax.axvline(low, color=OKABE_ITO["grey"], lw=0.6, zorder=1)
        # A name that is wider than its span would run into the next one.
        if name_regimes and high - low > 0.12 * (edges[-1] - edges[0]):
            ax.annotate(
                words(str(regimes[start])),
                ((low + high) / 2, 1.0),
                xycoords=ax.get_xaxis_transform(),
                xytext=(0, 2),
                textcoords="offset points",
                ha="center",
                va="bottom",
                fontsize=8,
                color=REGIME_COLOURS[regimes[start]],
            )
    ax.set_xlim(edges[0], edges[-1])
    return ax


def _draw_directions(diagram: xr.Dataset, parameter: str, variable: str, ax: Axes) -> Axes:
    """The points of each direction in its colour; the first lie below, and are drawn larger so that they show."""
    directions = [str(direction) for direction in diagram["direction"].to_numpy()]
    values = diagram[parameter].to_numpy()
    for layer, direction in enumerate(directions):
        points = diagram[variable].sel(direction=direction).transpose(parameter, "point").to_numpy()
        ax.plot(
            np.broadcast_to(values[:, None], points.shape).ravel(),
            points.ravel(),
            ".",
            ms=3.4 - 0.9 * layer,
            mew=0,
            color=DIRECTION_COLOURS[direction],
            rasterized=True,
            zorder=2 + layer,
        )
        ax.plot([], [], "o", ms=4, mew=0, color=DIRECTION_COLOURS[direction], label=_DIRECTIONS[direction])
    ax.set_xlim(values[0], values[-1])
    ax.legend(
        loc="lower center",
        bbox_to_anchor=(0.5, 1.0),
        ncols=len(directions),
        handletextpad=0.1,
        fontsize=8,
        frameon=False,
    )
    return ax
