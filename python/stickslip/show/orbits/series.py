"""An orbit over time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from stickslip.errors import InputError
from stickslip.laws.state_law import StateLaw
from stickslip.show.canvas import ABOVE, MASS_COLOURS, OKABE_ITO, label, new_axes, shade_sticks, units_of

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

    from stickslip.model.system import System
    from stickslip.simulation.orbit import Orbit


def time_series(
    orbit: Orbit,
    ax: Axes | Sequence[Axes] | None = None,
    *,
    start: float = 0.0,
    stop: float | None = None,
    units: str | None = None,
) -> list[Axes]:
    """Draw position, velocity and friction force over time, sticks shaded.

    Parameters
    ----------
    orbit : any orbit. Of several masses each has a colour, and friction that of the mass whose contact it is; their sticks
        are thick lines.
    ax : three axes, or one that all three curves share; default a new figure with three under each other.
    start, stop : the span of time; default the whole orbit.
    units : ``"dimensionless"``, ``"SI"`` or ``"torsional"``; default by the system.

    Returns
    -------
    The three axes (the same one three times if they share it).
    """
    stop = orbit.t_end if stop is None else stop
    if not 0 <= start < stop <= orbit.t_end:
        raise InputError(
            f"time_series: start and stop must lie in order in [0, {orbit.t_end:g}], got {start} and {stop}"
        )
    if ax is None:
        panels = new_axes(3, 1, sharex=True, figsize=(5.6, 4.4))
    elif isinstance(ax, Sequence | np.ndarray):
        panels = list(ax)
    else:
        panels = [ax] * 3
    if len(panels) != 3:
        raise InputError(f"time_series: expected three axes or one, got {len(panels)}")
    shared = panels[0] is panels[2]
    # A jump of friction needs both its sides: sample just before each event as well.
    edges = changes(orbit)
    edges = edges[(edges >= start) & (edges <= stop)]
    grid = orbit.times()
    before = np.nextafter(edges, -np.inf)
    times = np.unique(np.concatenate([[start, stop], grid, edges, before[before > 0]]))
    times = times[(times >= start) & (times <= stop)]
    motion = orbit.to_xarray(times)
    which = units_of(orbit.system, units)
    curves = (
        ("x", "position x", "position", "-"),
        ("v", "velocity ẋ", "velocity", "--" if shared else "-"),
        ("force", "friction F", "force", ":" if shared else "-"),
    )
    alone = motion["x"].ndim == 1
    for panel, (key, name, kind, line) in zip(panels, curves, strict=True):
        for curve, values, stuck in columns(orbit, motion, key):
            color = OKABE_ITO["black"] if alone else MASS_COLOURS[curve % len(MASS_COLOURS)]
            text = name if alone else f"mass {curve}" if key == "x" else None
            panel.plot(times, values, color=color, ls=line, lw=1.1, label=text, rasterized=times.size > 20_000)
            if not alone:
                panel.plot(times, np.where(stuck, values, np.nan), color=color, lw=2.6)
        if not shared:
            # Two lines, as three panels are low.
            panel.set_ylabel(label(name, kind, which).replace(" (", "\n("))
    for panel in {id(panel): panel for panel in panels}.values():
        if alone:
            shade_sticks(panel, times, motion["stuck"].to_numpy())
        panel.margins(x=0)
    panels[2].set_xlabel(label("time t", "time", which))
    if shared or not alone:
        panels[0].legend(**ABOVE, ncols=3)
    if shared:
        panels[0].set_ylabel("x, ẋ, F" + (" (dimensionless)" if which == "dimensionless" else " (SI)"))
    return panels


def changes(orbit: Orbit) -> NDArray[np.float64]:
    """The times at which the motion or its friction has a corner or a jump, that of the start among them."""
    contacts = getattr(orbit.system, "contacts", (orbit.system,))
    smooth = any(isinstance(contact.law, StateLaw) for contact in contacts)
    times = orbit.events["t"] if smooth else orbit.segments["t"]
    return np.asarray(times, dtype=float)


def columns(
    orbit: Orbit, motion: xr.Dataset, name: str
) -> Iterator[tuple[int, NDArray[np.float64], NDArray[np.bool_]]]:
    """Each curve of a sampled quantity, with the number of its mass and where that sticks to a drive.

    Parameters
    ----------
    orbit : what was sampled.
    motion : its samples, from ``orbit.to_xarray``.
    name : of a variable; one of contacts (force) belongs to the mass of the contact.
    """
    values: Any = motion[name].to_numpy()
    stuck = motion["stuck"].to_numpy()
    if values.ndim == 1:
        yield 0, values, stuck
        return
    contacts = cast("System", orbit.system).contacts
    drives = {contact.mass: number for number, contact in enumerate(contacts) if contact.other is None}
    free = np.zeros(len(values), dtype=bool)
    masses = [contact.mass for contact in contacts] if "contact" in motion[name].dims else range(values.shape[1])
    for column, mass in enumerate(masses):
        yield mass, values[:, column], stuck[:, drives[mass]] if mass in drives else free
