"""A measured friction record: what was found in it, at a glance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib.pyplot as plt
import numpy as np

from stickslip.show.canvas import ABOVE, OKABE_ITO, SPEED_COLOURS, logarithmic_x, new_axes, shade_sticks, styled, unit

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

#: Cycles (or break-aways) shown over time; the whole record would be a black band.
CYCLES = 8


def friction_record(friction: xr.DataTree) -> list[Axes]:
    """Draw friction force and slip velocity over time, sticks shaded, and friction over slip velocity.

    Instruments that give no time series or no velocity show what they give: a table of friction over slip velocity, or
    the break-aways.

    Parameters
    ----------
    friction : from :func:`stickslip.measure`.

    Returns
    -------
    Three axes of a new figure: force over time and slip velocity over time, both around the middle of the record, and
    force over slip velocity of the whole record, orange while slip speeds up and light blue while it slows down, green
    where it breaks away. Of a drive that holds its speeds, the whole record and one point a hold. One or two axes where
    there is less to draw.
    """
    data = friction.to_dataset()
    if "slip_velocity" not in data:
        return _tables(friction)
    time, force = data["time"].to_numpy(), data["force"].to_numpy()
    w, stuck = data["slip_velocity"].to_numpy(), data["stuck"].to_numpy().astype(bool)
    releases = friction["break_away"]["t"].to_numpy() if "break_away" in friction.children else np.array([])
    held = "slip_acceleration" not in data  # a drive that holds its speeds: there is no way up or down
    middle = slice(None) if held else slice(*np.searchsorted(time, _window(time, releases)))
    with styled():
        _, panels = plt.subplot_mosaic(
            [["force", "loop"], ["velocity", "loop"]], figsize=(8.4, 4.2), width_ratios=[1.5, 1]
        )
    over_time, velocity, loop = (panels[name] for name in ("force", "velocity", "loop"))
    friction_force = "friction F" + unit(data["force"])
    slip_velocity = "slip velocity w" + unit(data["slip_velocity"])
    for ax, values, name in ((over_time, force, friction_force), (velocity, w, slip_velocity)):
        ax.plot(time[middle], values[middle], color=OKABE_ITO["black"], lw=0.9)
        shade_sticks(ax, time[middle], stuck[middle])
        ax.set_ylabel(name.replace(" (", "\n("))
        ax.margins(x=0)
    over_time.tick_params(labelbottom=False)
    velocity.set_xlabel("time t" + unit(data["time"]))
    if held:
        _steady(loop, friction["steady"].to_dataset())
        return [over_time, velocity, loop]
    speeding = data["slip_acceleration"].to_numpy() * np.sign(w) > 0
    stride = max(1, int((~stuck).sum()) // 20_000)
    for which, colour, name in (
        (speeding, SPEED_COLOURS["|w| grows"], "|w| grows"),
        (~speeding, SPEED_COLOURS["|w| falls"], "|w| falls"),
    ):
        rows = np.flatnonzero(which & ~stuck)[::stride]
        loop.plot(w[rows], force[rows], ".", ms=1.5, color=colour, label=name, rasterized=True)
    marks = loop.get_lines()
    if releases.size:
        at_rest = friction["break_away"]["force"].to_numpy()
        marks += loop.plot(np.zeros(at_rest.size), at_rest, "o", ms=3.5, color=OKABE_ITO["green"], label="break-away")
    elif np.ptp(force) < 0.2 * np.abs(force).max():  # its scatter would look like a change of friction
        loop.set_ylim(*sorted((0.0, 1.15 * force[np.abs(force).argmax()])))
    loop.set(xlabel=slip_velocity, ylabel=friction_force)
    legend = loop.legend(handles=marks, **ABOVE, ncols=2, columnspacing=1.0)
    for handle in legend.legend_handles:
        handle.set_markersize(6)  # type: ignore[union-attr]
    if stuck[middle].any():
        over_time.legend(handles=over_time.collections, **ABOVE)
    return [over_time, velocity, loop]


def _tables(friction: xr.DataTree) -> list[Axes]:
    """Friction over slip velocity from the table of steady runs, else the break-away force over the stick time."""
    if "steady" in friction.children:
        (ax,) = new_axes()
        _steady(ax, friction["steady"].to_dataset())
        return [ax]
    over_time, law = new_axes(1, 2, figsize=(9, 3.4), layout="constrained")
    data, table = friction.to_dataset(), friction["break_away"].to_dataset()
    of_force = unit(data["force"] if "force" in data else table["force"])
    if "force" in data:
        over_time.plot(data["time"].to_numpy(), data["force"].to_numpy(), color=OKABE_ITO["black"], lw=0.8)
    over_time.plot(table["t"], table["force"], "v", ms=4, color=OKABE_ITO["vermilion"])
    over_time.set(xlabel="time t (s)", ylabel="force" + of_force)
    law.errorbar(
        table["stick_time"], table["force"], table["force_error"], fmt="o", ms=4, color=OKABE_ITO["blue"], capsize=2
    )
    law.set(xlabel="stick time (s)", ylabel="break-away force" + of_force)
    logarithmic_x(law, table["stick_time"])
    return [over_time, law]


def _steady(ax: Axes, table: xr.Dataset) -> None:
    """Friction over slip velocity from a table of steady runs, over its logarithm where it spans more than half a decade."""
    w, force, error = (table[name].to_numpy() for name in ("slip_velocity", "force", "force_error"))
    branch = table["branch"].to_numpy() if "branch" in table else np.full(len(w), "")
    for name, colour in (("", "black"), ("speeding_up", "orange"), ("slowing_down", "sky")):
        rows = np.flatnonzero(branch == name)
        if len(rows):
            ax.errorbar(
                w[rows], force[rows], error[rows], fmt="o", ms=4, color=OKABE_ITO[colour], capsize=2,
                label=name.replace("_", " ") or None,
            )  # fmt: skip
    if "branch" in table:
        ax.legend(**ABOVE, ncols=2)
    ax.set(xlabel="slip velocity w" + unit(table["slip_velocity"]), ylabel="friction F" + unit(table["force"]))
    logarithmic_x(ax, w)
    if len(w) and np.ptp(w) < 1e-3 * np.max(np.abs(w)):  # one speed: its own digits are no axis
        ax.set_xlim(*sorted((0.0, 2 * float(np.mean(w)))))


def _window(time: np.ndarray, releases: np.ndarray) -> tuple[float, float]:
    """The span of some break-aways about the middle of the record, or the middle tenth of it."""
    if releases.size > CYCLES:
        first = (releases.size - CYCLES) // 2
        return float(releases[first]), float(releases[first + CYCLES])
    span = (time[-1] - time[0]) / (10 if releases.size == 0 else 1)
    centre = 0.5 * (time[0] + time[-1])
    return float(centre - 0.5 * span), float(centre + 0.5 * span)
