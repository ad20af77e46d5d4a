"""Maps over two parameters or starts: regimes, periods, amplitudes and basins of attraction. Colours: `canvas.py`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm, to_hex, to_rgb
from matplotlib.patches import Patch

from stickslip.errors import InputError
from stickslip.show.canvas import ABOVE, OKABE_ITO, REGIME_COLOURS, axes, label, parameter_label, words

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

# Periods 1 to 6, longer ones, and motions that do not repeat.
_PERIODS = ["#F7F7F7", "#0072B2", "#56B4E9", "#009E73", "#F0E442", "#E69F00", "#CC79A7", "#999999"]
_BASINS = [OKABE_ITO[name] for name in ("sky", "orange", "green", "purple", "yellow", "blue", "vermilion", "grey")]
_TINT = 0.55  # of a basin's colour in white, so that attractors and manifolds stand out in it


def regime_map_plot(
    chart: xr.Dataset, ax: Axes | None = None, *, quantity: str = "regime", units: str | None = None
) -> Axes:
    """Draw a map over two parameters, each kind of motion in its named colour.

    Parameters
    ----------
    chart : from :func:`stickslip.regime_map`, over two parameters: the first goes across.
    ax : axes to draw into; default a new figure.
    quantity : ``"regime"``, ``"period"`` (returns to the section after which the motion repeats) or ``"amplitude"``.
    units : ``"dimensionless"``, ``"SI"`` or ``"torsional"``; default what the map says.

    Returns
    -------
    The axes, with a legend above of what occurs, or a colour bar.
    """
    ax = axes(ax)
    if len(chart["regime"].dims) != 2:
        raise InputError(
            f"regime_map_plot: needs a map over two parameters, got {', '.join(map(str, chart['regime'].dims))}"
        )
    which = units or str(chart.attrs.get("units", "dimensionless"))
    across, up = (str(dim) for dim in chart["regime"].dims)
    grid = (chart[across].to_numpy(), chart[up].to_numpy())
    if quantity == "regime":
        words_there = chart["regime"].to_numpy().astype("<U16").T
        names = [name for name in REGIME_COLOURS if (words_there == name).any()]
        codes = np.select([words_there == name for name in names], range(len(names)), -1)
        _draw_codes(ax, grid, codes, [_area(name) for name in names], [words(name) for name in names])
    elif quantity == "period":
        period = chart["period"].to_numpy().T
        codes = np.where(period == 0, 0, np.minimum(period, 7))
        there = np.unique(codes)
        names = ["does not repeat", *(f"period {n}" for n in range(1, 7)), "longer"]
        ranks = np.searchsorted(there, codes)
        _draw_codes(ax, grid, ranks, [_PERIODS[code] for code in there], [names[code] for code in there])
    elif quantity == "amplitude":
        amplitude = chart["amplitude"].to_numpy().T
        seen = amplitude[np.isfinite(amplitude) & (amplitude > 0)]
        # A resonance would hide all else; what lies below a thousandth of the largest is drawn as that.
        top = float(seen.max()) if seen.size else 1.0
        low = max(float(seen.min()), 1e-3 * top) if seen.size else 0.1
        scale = LogNorm(low, top) if top > 10 * low else None
        shown = np.clip(amplitude, low, None) if scale else amplitude
        mesh = ax.pcolormesh(*grid, shown, shading="nearest", cmap="cividis", norm=scale, rasterized=True)
        bar = ax.figure.colorbar(mesh, ax=ax)
        bar.set_label(label("amplitude of x", "position", which), fontsize=9)
        bar.ax.tick_params(labelsize=8)
    else:
        raise InputError(f"regime_map_plot: quantity must be regime, period or amplitude, got {quantity!r}")
    ax.set(xlabel=parameter_label(across, which), ylabel=parameter_label(up, which))
    return ax


def basins_plot(result: xr.Dataset, ax: Axes | None = None, *, most: int = 8, units: str | None = None) -> Axes:
    """Draw basins of attraction, each in a tint of its regime's colour, with the share of the starts in the legend.

    Parameters
    ----------
    result : from :func:`stickslip.basins`.
    ax : axes to draw into; default a new figure.
    most : attractors with a colour of their own, up to 8; the others are white.
    units : ``"dimensionless"``, ``"SI"`` or ``"torsional"``; default what the result says.

    Returns
    -------
    The axes; a cross marks the mean of the returns to the section of each attractor that lies in the range of starts. Starts
    whose run diverged or ended before its time have colours and shares of their own.
    """
    ax = axes(ax)
    if not 1 <= most <= len(_BASINS):
        raise InputError(f"basins_plot: most must lie from 1 to {len(_BASINS)}, got {most}")
    which = units or str(result.attrs.get("units", "dimensionless"))
    x, v = result["x"].to_numpy(), result["v"].to_numpy()
    labels = result["label"].transpose("v", "x").to_numpy()
    count = min(most, result.sizes["attractor"])
    names, own = [], _basin_colours([str(regime) for regime in result["attractor_regime"].to_numpy()[:count]])
    for index in range(count):
        attractor = result.isel(attractor=index)
        period = int(attractor["attractor_period"])
        regime = str(attractor["attractor_regime"].item())
        recurrence = words(str(attractor["attractor_recurrence"].item()))
        repeats = "" if regime in ("stable_slip", "at_rest") else f", period {period}" if period else f", {recurrence}"
        names.append(f"{words(regime)}{repeats} ({100 * float(attractor['fraction']):.3g} %)")
    codes, colours = np.where(labels < count, labels, -1), [_tint(colour) for colour in own]
    # Starts without an attractor are no part of one.
    regimes = result["regime"].astype("<U16").transpose("v", "x").to_numpy()
    for regime in ("unfinished", "diverged"):
        mine = regimes == regime
        if mine.any():
            codes = np.where(mine, len(colours), codes)
            colours = [*colours, _area(regime)]
            names.append(f"{words(regime)} ({100 * mine.mean():.3g} %)")
    _draw_codes(ax, (x, v), codes, colours, names)
    for index in range(count):
        position = (float(result["attractor_x_mean"][index]), float(result["attractor_v_mean"][index]))
        if x[0] <= position[0] <= x[-1] and v[0] <= position[1] <= v[-1]:
            ax.plot(*position, "X", ms=7, color=own[index], mec=OKABE_ITO["black"], mew=0.8)
    ax.set(xlabel=parameter_label("x", which), ylabel=parameter_label("v", which))
    return ax


def _basin_colours(regimes: list[str]) -> list[str]:
    """The colour of its regime for the first attractor of each; further ones take colours that are left."""
    first = {regime: regimes.index(regime) for regime in regimes}
    left = [colour for colour in _BASINS if colour not in {REGIME_COLOURS.get(regime) for regime in first}]
    return [
        REGIME_COLOURS[regime] if first[regime] == index and regime in REGIME_COLOURS else left.pop(0)
        for index, regime in enumerate(regimes)
    ]


def _area(regime: str) -> str:
    """The colour of an area in which a motion is of this regime; what is no motion to the end stands out."""
    colour = REGIME_COLOURS[regime]
    return colour if regime in ("unfinished", "diverged") else _tint(colour)


def _tint(colour: str) -> str:
    red, green, blue = (1 - _TINT * (1 - part) for part in to_rgb(colour))
    return to_hex((red, green, blue))


def _draw_codes(
    ax: Axes,
    grid: tuple[np.ndarray, np.ndarray],
    codes: np.ndarray,
    colours: list[str],
    names: list[str],
) -> None:
    """A mesh of whole numbers in named colours; what has none stays white."""
    norm = BoundaryNorm(np.arange(len(colours) + 1) - 0.5, max(1, len(colours)))
    masked = np.ma.masked_less(codes, 0)
    ax.pcolormesh(*grid, masked, shading="nearest", cmap=ListedColormap(colours), norm=norm, rasterized=True)
    patches = [
        Patch(facecolor=colour, edgecolor=OKABE_ITO["grey"], linewidth=0.4, label=name)
        for colour, name in zip(colours, names, strict=True)
    ]
    ax.legend(
        handles=patches,
        **ABOVE,
        ncols=2 if max(map(len, names), default=0) < 34 else 1,
        handlelength=1.2,
        columnspacing=1.2,
    )
