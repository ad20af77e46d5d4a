"""The orbit diagram: turning points of long runs over a parameter, regimes shaded and named."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stickslip.errors import InputError
from stickslip.show.canvas import (
    ABOVE,
    DIRECTION_COLOURS,
    OKABE_ITO,
    REGIME_COLOURS,
    axes,
    label,
    parameter_label,
    words,
)
from stickslip.simulation.attractor import ATTRACTOR, on_one_attractor
from stickslip.simulation.quantities import QUANTITIES

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

#: A ring for fresh starts: what lies below it, the sweep that reaches the same motion, is seen through it.
_LOOKS: dict[str, dict[str, Any]] = {
    "up": {"marker": "^", "ms": 3.2, "mew": 0, "color": DIRECTION_COLOURS["up"]},
    "down": {"marker": "v", "ms": 2.5, "mew": 0, "color": DIRECTION_COLOURS["down"]},
    "fresh": {"marker": "o", "ms": 4.0, "mew": 0.6, "mfc": "none", "mec": DIRECTION_COLOURS["fresh"]},
}
#: Height of the strip above the axis that marks runs without a result, of that of the axes.
_STRIP = 0.03
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
    quantity : ``"x"`` (position where ẋ = 0), ``"slip_velocity"`` (where ẇ = 0), ``"section"`` (position at the
        returns) or ``"amplitude"`` (half of the range of x, one point a motion).
    name_regimes : whether the regimes are written above their spans.
    units : ``"dimensionless"``, ``"SI"`` or ``"torsional"``; default what the diagram says.

    Returns
    -------
    The axes. A regime reaches half-way to the next value of the parameter. Values at which a run ended before its time or did
    not repeat and may still change have a strip along the lower edge, which a legend names.

    Source: Fig. 14 of the paper.
    """
    if quantity not in QUANTITIES:
        raise InputError(f"orbit_diagram_plot: quantity must be one of {', '.join(QUANTITIES)}, got {quantity!r}")
    ax = axes(ax)
    which = units or str(diagram.attrs.get("units", "dimensionless"))
    parameter = str(diagram.attrs["parameter"])
    variable, name, kind = QUANTITIES[quantity]
    ax.set(xlabel=parameter_label(parameter, which), ylabel=label(name, kind, which))
    if diagram.sizes.get("direction", 1) > 1:
        return _draw_directions(diagram, parameter, _points(diagram, variable), ax)
    diagram = diagram.squeeze("direction") if "direction" in diagram.dims else diagram
    values, regimes = diagram[parameter].to_numpy(), diagram["regime"].to_numpy().astype("<U16")
    points = _points(diagram, variable).transpose(parameter, "point").to_numpy()
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
    for start, low, high in _spans(values, regimes):
        if start:
            ax.axvline(low, color=OKABE_ITO["grey"], lw=0.6, zorder=1)
        if regimes[start] == "unfinished":
            continue
        ax.axvspan(low, high, color=REGIME_COLOURS[regimes[start]], alpha=0.09, lw=0, zorder=0)
        # A name that is wider than its span would run into the next one.
        if name_regimes and high - low > 0.12 * (values[-1] - values[0]):
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
    ax.set_xlim(values[0], values[-1])
    if _mark_unfinished(diagram, parameter, ax):
        raised = 1.06 if name_regimes else 1.0  # above the names of the regimes
        ax.legend(**(ABOVE | {"bbox_to_anchor": (0.0, raised)}), ncols=2)
    return ax


def _spans(values: NDArray[np.float64], kinds: NDArray[Any]) -> list[tuple[int, float, float]]:
    """Where neighbouring values are of one kind: the first of them, and from where to where, half-way to the next value."""
    edges = np.concatenate([values[:1], (values[1:] + values[:-1]) / 2, values[-1:]])
    starts = np.flatnonzero(np.append(True, kinds[1:] != kinds[:-1]))
    ends = np.append(starts[1:], len(values))
    return [(int(start), edges[start], edges[end]) for start, end in zip(starts, ends, strict=True)]


def _mark_unfinished(diagram: xr.Dataset, parameter: str, ax: Axes) -> bool:
    """Strips where a run ended before its time or still changed, with names for the legend; whether there are any."""
    ended = _where(diagram, "regime", "unfinished", parameter)
    changes = _where(diagram, "recurrence", "undecided", parameter) & ~ended
    for row, (word, runs, colour) in enumerate(
        (("unfinished", ended, OKABE_ITO["black"]), ("undecided", changes, REGIME_COLOURS["unfinished"]))
    ):
        look: dict[str, Any] = {"facecolor": colour, "lw": 0, "zorder": 6}
        look |= {"ymin": row * _STRIP, "ymax": (row + 1) * _STRIP}
        missing = np.asarray(runs.any(axis=0))
        name = f"{words(word)} ({int(runs.sum())} of {runs.size} runs)"
        for start, low, high in _spans(diagram[parameter].to_numpy(), missing):
            if missing[start]:
                ax.axvspan(low, high, label=name, **look)
                name = "_"
    any_run = bool((ended | changes).any())
    if any_run:  # the strips lie below all points
        low, high = ax.get_ylim()
        ax.set_ylim(low - 2 * _STRIP * (high - low), high)
    return any_run


def _where(diagram: xr.Dataset, name: str, word: str, parameter: str) -> NDArray[np.bool_]:
    """Which runs have a word, shape (directions, values)."""
    if name not in diagram:
        return np.zeros((1, diagram.sizes[parameter]), bool)
    found = (diagram[name].astype("<U16") == word).transpose(..., parameter).to_numpy()
    return np.asarray(found.reshape(-1, found.shape[-1]))


def alike_everywhere(diagram: xr.Dataset, parameter: str) -> NDArray[np.bool_]:
    """At which values all directions reach the same attractor, as :func:`stickslip.basins` tells them apart.

    >>> from stickslip import orbit_diagram, paper
    >>> both = orbit_diagram(paper.oscillator(0.3), "drive_velocity", [0.2, 0.3], direction=("up", "down"))
    >>> alike_everywhere(both, "drive_velocity").tolist()
    [False, True]
    """
    rows = {name: diagram[name].transpose("direction", parameter).to_numpy() for name in ATTRACTOR}
    wide = float(np.fmax.reduce(rows["x_max"], axis=None) - np.fmin.reduce(rows["x_min"], axis=None))
    first = {name: column[0] for name, column in rows.items()}
    return np.asarray(on_one_attractor(rows, first, 1e-2, wide).all(axis=0))


def _points(diagram: xr.Dataset, variable: str) -> xr.DataArray:
    """What is drawn, with the dimension ``point``."""
    drawn = diagram[variable]
    return drawn if "point" in drawn.dims else drawn.expand_dims("point")


def _draw_directions(diagram: xr.Dataset, parameter: str, drawn: xr.DataArray, ax: Axes) -> Axes:
    """What all directions share in grey; where they differ, the points of each in its colour and with its marker."""
    directions = [str(direction) for direction in diagram["direction"].to_numpy()]
    values = diagram[parameter].to_numpy()
    points = drawn.transpose("direction", parameter, "point").to_numpy()
    one = alike_everywhere(diagram, parameter)
    across = np.broadcast_to(values[:, None], points.shape[1:])
    shared: dict[str, Any] = {"marker": ".", "ls": "", "ms": 2.4, "mew": 0, "color": OKABE_ITO["grey"]}
    ax.plot(across[one].ravel(), points[0][one].ravel(), rasterized=True, zorder=2, **shared)
    if one.any():
        ax.plot([], [], label="the same in all sweeps", **(shared | {"ms": 7}))
    for layer, direction in enumerate(directions):
        look = {"ls": "", **_LOOKS[direction]}
        if direction == "fresh":  # of many values rings would touch: they shrink to dots
            look["ms"] = min(4.0, max(1.2, 240 / len(values)))
        ax.plot(across[~one].ravel(), points[layer][~one].ravel(), rasterized=True, zorder=3 + layer, **look)
        ax.plot([], [], label=_DIRECTIONS[direction], **(look | {"ms": 5}))
    ax.set_xlim(values[0], values[-1])
    _mark_unfinished(diagram, parameter, ax)
    ax.legend(**ABOVE, ncols=2, columnspacing=1.0)
    return ax
