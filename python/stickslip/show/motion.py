"""A measured motion: x, v and a over time with the sticks shaded, its phase plane, its spectra."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np

from stickslip.errors import InputError
from stickslip.show.canvas import OKABE_ITO, axes, new_axes, shade_sticks, styled, unit

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

NAMES = {"x": "displacement x", "v": "velocity v", "a": "acceleration a"}
MOST = 20_000
"""Points drawn of one curve."""


def motion_plot(
    motion: xr.Dataset, ax: list[Axes] | None = None, *, window: tuple[float, float] | None = None
) -> list[Axes]:
    """Draw x, v and a over time with their error bands, sticks shaded.

    Parameters
    ----------
    motion : from :func:`stickslip.measurement.motion`, of one mass.
    ax : three axes, default a new figure.
    window : (start, end) in s; default the whole record.

    Returns
    -------
    The three axes.
    """
    motion = _one_mass(motion)
    panels = new_axes(3, 1, sharex=True, figsize=(7, 5.2)) if ax is None else list(ax)
    if len(panels) != 3:
        raise InputError(f"motion_plot: three axes were expected, got {len(panels)}")
    time = motion["time"].to_numpy()
    start, end = (time[0], time[-1]) if window is None else window
    inside = slice(*np.searchsorted(time, [start, end]))
    if inside.stop - inside.start < 2:
        raise InputError(
            f"motion_plot: window = {(start, end)} holds no samples; the record spans {time[0]} to {time[-1]}"
        )
    inside = slice(inside.start, inside.stop, max(1, (inside.stop - inside.start) // MOST))
    t, stuck = time[inside], motion["stuck"].to_numpy().astype(bool)[inside]
    for panel, name in zip(panels, NAMES, strict=True):
        values, error = motion[name].to_numpy()[inside], motion[f"{name}_error"].to_numpy()[inside]
        panel.fill_between(t, values - error, values + error, color=OKABE_ITO["black"], alpha=0.25, lw=0)
        panel.plot(t, values, color=OKABE_ITO["black"], lw=0.9)
        shade_sticks(panel, t, stuck)
        panel.set_ylabel(NAMES[name] + unit(motion[name]))
        panel.margins(x=0)
    panels[-1].set_xlabel("time t" + unit(motion["time"]))
    return panels


def motion_phase(motion: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw velocity over displacement, sticks thick."""
    motion = _one_mass(motion)
    ax = axes(ax)
    stride = max(1, motion.sizes["time"] // MOST)
    x, v = motion["x"].to_numpy()[::stride], motion["v"].to_numpy()[::stride]
    stuck = motion["stuck"].to_numpy().astype(bool)[::stride]
    ax.plot(x, v, color=OKABE_ITO["blue"], lw=0.7, rasterized=len(x) > 5000)
    if stuck.any():
        ax.plot(np.where(stuck, x, np.nan), np.where(stuck, v, np.nan), color=OKABE_ITO["vermilion"], lw=2.2)
    ax.set(xlabel=NAMES["x"] + unit(motion["x"]), ylabel=NAMES["v"] + unit(motion["v"]))
    return ax


def spectra_plot(
    signal: Any, ax: list[Axes] | None = None, *, highest: float | None = None, window: float | None = None
) -> list[Axes]:
    """Draw the spectrum of a whole record, and that of each part over time.

    Parameters
    ----------
    signal : DataArray over `time`, such as ``motion["a"]``.
    ax : two axes, default a new figure.
    highest : frequency up to which is drawn, Hz; default a little above where 97 % of the power lies.
    window : of the spectrum along time in s, as in :func:`stickslip.measurement.spectrum_over_time`.

    Returns
    -------
    The two axes.
    """
    from stickslip.measurement import spectrum, spectrum_over_time

    panels = new_axes(1, 2, figsize=(8, 3.2)) if ax is None else list(ax)
    if len(panels) != 2:
        raise InputError(f"spectra_plot: two axes were expected, got {len(panels)}")
    total, actual = spectrum(signal), spectrum_over_time(signal, window=window)
    frequency, amplitude = total["frequency"].to_numpy(), total["amplitude"].to_numpy()
    if highest is None:
        power = np.cumsum(amplitude**2)
        highest = float(min(1.3 * frequency[np.searchsorted(power, 0.97 * power[-1])], frequency[-1]))
    seen = frequency <= highest
    # a dimensionless record has dimensionless time
    dimensionless = getattr(signal, "coords", {}).get("time", total["frequency"]).attrs.get("units") == "1"
    hertz, seconds = ("", "") if dimensionless else (" (Hz)", " (s)")
    panels[0].plot(frequency[seen], amplitude[seen], lw=0.8)
    panels[0].set(xlabel="frequency" + hertz, ylabel="amplitude" + unit(total["amplitude"]), xlim=(0, highest))
    panels[0].set_title("spectrum of the record", fontsize=9)
    rows = actual["frequency"].to_numpy() <= highest
    image = panels[1].pcolormesh(
        actual["time"].to_numpy(), actual["frequency"].to_numpy()[rows], actual["amplitude"].to_numpy()[rows],
        shading="auto", cmap="viridis", rasterized=True,
    )  # fmt: skip
    panels[1].set(xlabel="time" + seconds, ylabel="frequency" + hertz)
    panels[1].set_title("spectrum over time", fontsize=9)
    figure = panels[1].figure
    figure.colorbar(image, ax=panels[1], label="amplitude" + unit(total["amplitude"]))
    return panels


def motion_figure(motion: xr.Dataset) -> list[Axes]:
    """Draw a measured motion on one page: x, v and a over time, the phase plane, the spectra of the acceleration.

    Parameters
    ----------
    motion : from :func:`stickslip.measurement.motion`, of one mass.

    Returns
    -------
    The six axes of a new figure. Spectra are left out of a record with gaps or fewer than 16 samples.
    """
    with styled():
        figure = plt.figure(figsize=(11, 7.5))
        grid = figure.add_gridspec(1, 2, width_ratios=(1.3, 1))
        over_time = grid[0, 0].subgridspec(3, 1).subplots(sharex=True, squeeze=False).ravel()
        beside = grid[0, 1].subgridspec(3, 1).subplots(squeeze=False).ravel()
    motion_plot(motion, list(over_time))
    motion_phase(motion, beside[0])
    try:
        spectra_plot(_one_mass(motion)["a"], list(beside[1:]))
    except InputError as error:
        beside[1].set_axis_off()
        beside[2].text(0.5, 0.5, str(error), ha="center", va="center", wrap=True, fontsize=8)
        beside[2].set_axis_off()
    return [*over_time, *beside]


def _one_mass(motion: xr.Dataset) -> xr.Dataset:
    if "mass" in motion.dims:
        raise InputError(f"motion: one mass was expected, got {motion.sizes['mass']}; choose with motion.isel(mass=0)")
    return motion.dropna("time", subset=["x"])
