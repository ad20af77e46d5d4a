"""The orbit diagram: turning points of long runs over a parameter, regimes shaded and named."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.errors import InputError
from stickslip.show.canvas import OKABE_ITO, REGIME_COLOURS, axes, label, words

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

_QUANTITIES = {"x": ("position x at ẋ = 0", "position"), "slip_velocity": ("slip velocity w at ẇ = 0", "velocity")}
_PARAMETERS = {
    "drive_velocity": ("drive velocity s", "velocity"),
    "damping": ("damping D", ""),
    "mass": ("mass m", ""),
    "stiffness": ("stiffness k", ""),
}


def orbit_diagram_plot(
    diagram: xr.Dataset,
    ax: Axes | None = None,
    *,
    quantity: str = "x",
    name_regimes: bool = True,
    units: str | None = None,
) -> Axes:
    """Draw an orbit diagram: the turning points over the parameter, regimes shaded and named.

    Parameters
    ----------
    diagram : from :func:`stickslip.analysis.orbit_diagram`.
    ax : axes to draw into; default a new figure.
    quantity : ``"x"`` (position where ẋ = 0) or ``"slip_velocity"`` (where ẇ = 0).
    name_regimes : whether the regimes are written above their spans.
    units : ``"dimensionless"`` or ``"SI"``; default what the diagram says.

    Returns
    -------
    The axes. A regime reaches half-way to the next value of the parameter.

    Source: Fig. 14 of the paper.
    """
    if quantity not in _QUANTITIES:
        raise InputError(f"orbit_diagram_plot: quantity must be 'x' or 'slip_velocity', got {quantity!r}")
    ax = axes(ax)
    which = units or str(diagram.attrs.get("units", "dimensionless"))
    parameter = str(diagram.attrs["parameter"])
    values, regimes = diagram[parameter].to_numpy(), diagram["regime"].to_numpy()
    points = diagram[f"turning_{quantity}"].transpose(parameter, "point").to_numpy()
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
    name, kind = _PARAMETERS.get(parameter, (words(parameter), ""))
    across_label = label(name, kind, which) if kind else name
    ax.set(xlabel=across_label, ylabel=label(_QUANTITIES[quantity][0], _QUANTITIES[quantity][1], which))
    return ax
