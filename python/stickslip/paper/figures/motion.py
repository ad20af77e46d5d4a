"""The figures of motions: friction loops, phase portraits, forced motions, the orbit diagram."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike, NDArray

from stickslip.dynamics import orbit_diagram
from stickslip.errors import InputError
from stickslip.laws import BogaczRyczek
from stickslip.model.drive import Harmonic
from stickslip.paper.default_calibration import END_OF_OSCILLATION, END_OF_STICK_SLIP, oscillator
from stickslip.show import (
    BRANCH_COLOURS,
    OKABE_ITO,
    REGIME_COLOURS,
    friction_loop,
    new_axes,
    orbit_diagram_plot,
    phase_plane,
)
from stickslip.show.canvas import words
from stickslip.simulation.simulate import simulate

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

# Titles take the size of the caller's style, not of ours.
TITLE: Any = {"fontsize": 9}


def general_shape(ax: Axes | None = None) -> Axes:
    """Fig. 6: the law in stick-slip (full lines), in almost-harmonic vibration (broken) and in stable slip (a point).

    Marked are the slip velocities at which ẇ = 0: w_k in stick-slip, w_h1 and w_h3 in almost-harmonic vibration.

    Parameters
    ----------
    ax : axes to draw into; default a new figure.
    """
    ax = ax or new_axes(figsize=(5.6, 3.9))[0]
    friction_loop(simulate(oscillator(0.20), 150.0), ax, transient=0.7)
    w, force = loop(0.30, 178.0)
    # One round that ends where it meets its begin: a broken line drawn over itself would look full.
    start = int(np.argmax(w[: w.size // 2]))
    top = start + int(np.argmax(force[start : start + w.size // 2]))
    stop = top + int(np.argmin(force[top : start + w.size // 2])) + 1
    w, force = w[start:stop], force[start:stop]
    ax.plot(w, force, color=OKABE_ITO["black"], lw=1.0, ls=(0, (4, 2)), label="s = 0.30")
    ax.plot(0.45, loop(0.45)[1][-1], "o", ms=5, color=OKABE_ITO["green"], label="s = 0.45")
    sticking = loop(0.20)
    ends = (("h1", w, force, np.argmin(w)), ("h3", w, force, np.argmax(w)), ("k", *sticking, np.argmax(sticking[0])))
    for name, at, height, i in ends:
        ax.plot([at[i], at[i]], [0.62, height[i]], color=OKABE_ITO["grey"], lw=0.7, ls=":", zorder=0)
        ax.annotate(f"$w_{{{name}}}$", (at[i], 0.62), (2, 1), textcoords="offset points", fontsize=8)
    handles, names = ax.get_legend_handles_labels()
    whose = [f"s = 0.20, {name}" if name in BRANCH_COLOURS else name for name in names]
    ax.legend(handles, whose, fontsize=8, frameon=False, loc="upper right")
    ax.set(ylabel="friction f (dimensionless)", ylim=(0.6, None))
    return ax


def friction_over_drive_velocity(
    drive_velocities: Sequence[float] = (0.26, 0.29, 0.32, 0.35, 0.38), ax: Axes | None = None
) -> Axes:
    """Fig. 5: the loops of almost-harmonic vibration for several drive velocities over each other.

    Parameters
    ----------
    drive_velocities : one loop each.
    ax : axes to draw into; default a new figure.
    """
    ax = ax or new_axes()[0]
    for s, colour in zip(drive_velocities, shades(len(drive_velocities)), strict=True):
        w, force = loop(s)
        ax.plot(w, force, color=colour, label=f"s = {s:.2f}")
    ax.legend(fontsize=8, frameon=False, loc="upper right")
    ax.set(xlabel="slip velocity w (dimensionless)", ylabel="friction f (dimensionless)")
    return ax


def phase_portraits(
    drive_velocities: Sequence[float] = (0.10, 0.20, 0.25, 0.26, 0.30, 0.35, 0.38, 0.45), columns: int = 4
) -> list[Axes]:
    """Fig. 12: phase portraits from rest for several drive velocities; transients faded, sticks thick.

    Parameters
    ----------
    drive_velocities : one panel each.
    columns : panels in a row.
    """
    rows = -(-len(drive_velocities) // columns)
    panels = new_axes(rows, columns, figsize=(2.35 * columns, 2.3 * rows), sharex=True, sharey=True)
    for ax in panels[len(drive_velocities) :]:
        ax.remove()
    for ax, s in zip(panels, drive_velocities, strict=False):
        orbit = simulate(oscillator(s), 200.0)
        phase_plane(orbit, ax, transient=0.75)
        ax.set_title(f"s = {s:.2f}: {words(orbit.regime(transient=0.75))}", **TITLE)
        ax.label_outer()
    looks: dict[str, dict[str, Any]] = {
        "stick": {"color": OKABE_ITO["vermilion"], "lw": 2.6},
        "slip": {"color": OKABE_ITO["blue"]},
        "transient from rest": {"color": OKABE_ITO["grey"], "lw": 0.8},
        "ẋ = s": {"color": OKABE_ITO["grey"], "lw": 0.8, "ls": "--"},
    }
    handles = [Line2D([], [], label=name, **look) for name, look in looks.items()]
    figure = panels[0].get_figure(root=True)
    assert figure is not None
    figure.legend(handles=handles, fontsize=8, frameon=False, ncols=len(handles), loc="outside lower center")
    return panels[: len(drive_velocities)]


def limit_cycles(
    drive_velocities: Sequence[float] = (0.15, 0.20, 0.25, 0.26, 0.30, 0.34, 0.38), ax: Axes | None = None
) -> Axes:
    """Fig. 12 in one picture: the limit cycles over each other.

    Parameters
    ----------
    drive_velocities : one curve each.
    ax : axes to draw into; default a new figure.
    """
    ax = ax or new_axes()[0]
    for s, colour in zip(drive_velocities, shades(len(drive_velocities)), strict=True):
        orbit = simulate(oscillator(s), 200.0)
        times = np.linspace(orbit.t_end - 25, orbit.t_end, 4000)
        ax.plot(*orbit.at(times), color=colour, lw=1.2, label=f"{s:.2f}")
    ax.legend(fontsize=7.5, frameon=False, title="s", title_fontsize=8, loc="center left")
    ax.set_xlim(left=0.34)
    ax.set(xlabel="position x (dimensionless)", ylabel="velocity ẋ (dimensionless)")
    return ax


def regimes(diagram: xr.Dataset | None = None, ax: Axes | None = None, *, quantity: str = "x") -> Axes:
    """Fig. 14: the orbit diagram over the drive velocity with its regimes, from rest.

    The paper's thresholds are dashed.

    Parameters
    ----------
    diagram : from :func:`stickslip.dynamics.orbit_diagram`; default 151 drive velocities from 0.05 to 0.50.
    ax : axes to draw into; default a new figure.
    quantity : ``"x"`` or ``"slip_velocity"``.
    """
    if diagram is None:
        diagram = drive_velocity_diagram()
    ax = orbit_diagram_plot(diagram, ax, quantity=quantity)
    for s in (END_OF_STICK_SLIP, END_OF_OSCILLATION):
        ax.axvline(s, color=OKABE_ITO["black"], lw=0.8, ls="--", zorder=1)
    return ax


def drive_velocity_diagram(values: ArrayLike | None = None, **options: Any) -> xr.Dataset:
    """Our model's orbit diagram over the drive velocity; `options` as in :func:`stickslip.dynamics.orbit_diagram`."""
    grid = np.linspace(0.05, 0.50, 151) if values is None else values
    return orbit_diagram(oscillator(0.30), "drive_velocity", grid, **options)


def forced_motions(
    cases: Sequence[tuple[float, float, float]] = (
        (0.30, 0.35, 0.12),
        (0.30, 1.25, 0.03),
        (0.40, 0.40, 0.08),
        (0.40, 1.60, 0.37),
    ),
) -> list[Axes]:
    """Fig. 13: forced motions in the phase plane, and their position once per forcing period over the periods.

    Parameters
    ----------
    cases : (s, η, u₀), one column each; the paper does not state its u₀.
    """
    panels = new_axes(2, len(cases), figsize=(2.6 * len(cases), 4.6), height_ratios=(1.5, 1))
    first, count = 600, 100
    for ax, below, (s, eta, u0) in zip(panels, panels[len(cases) :], cases, strict=False):
        period = 2 * np.pi / eta
        orbit = simulate(oscillator(s, Harmonic(u0, eta)), (first + count) * period)
        x, v = orbit.at(np.linspace(first * period, orbit.t_end, 300 * count))
        ax.plot(x, v, color=OKABE_ITO["blue"], lw=0.5, rasterized=True)
        x, v = orbit.at(period * np.arange(first, first + count))
        ax.plot(x, v, ".", ms=4, color=OKABE_ITO["vermilion"], zorder=3)
        ax.set_title(f"s = {s:.2f}, η = {eta:.2f}, $u_0$ = {u0:.2f}", **TITLE)
        ax.set(xlabel="position x (dimensionless)")
        below.plot(np.arange(count), x, ".", ms=3, color=OKABE_ITO["vermilion"])
        below.margins(y=0.25)
        below.set(xlabel="forcing period")
    panels[0].set_ylabel("velocity ẋ (dimensionless)")
    panels[len(cases)].set_ylabel("position x once a period\n(dimensionless)")
    return panels


def overview(diagram: xr.Dataset | None = None) -> list[Axes]:
    """Three panels that say what the model does: friction loops, limit cycles, regimes.

    Parameters
    ----------
    diagram : as in :func:`regimes`.
    """
    panels = new_axes(1, 3, figsize=(11.4, 3.5))
    ax = panels[0]
    for s in (0.20, 0.30, 0.45):
        orbit = simulate(oscillator(s), 200.0)
        regime = orbit.regime()
        friction_loop(orbit, ax, colour=REGIME_COLOURS[regime], name=f"s = {s:.2f}: {words(regime)}")
    limit_cycles(ax=panels[1])
    regimes(diagram, panels[2])
    return panels


def translation_of_d(ax: Axes | None = None, drive_velocity: float = 0.30, shift: float = 0.03) -> Axes:
    """Fig. 10: the limit cycle with the pencil D where it is, and nearer and farther in w.

    Parameters
    ----------
    ax : axes to draw into; default a new figure.
    drive_velocity : of an almost-harmonic vibration whose climbs aim at D.
    shift : of D along w, either way.
    """
    ax = ax or new_axes(figsize=(4.4, 3.4))[0]
    ours = oscillator(drive_velocity)
    law = ours.law
    if not isinstance(law, BogaczRyczek) or law.D is None:
        raise InputError("translation_of_d: the law needs a pencil D at a point; give it one")
    for w, name, colour in zip((-shift, 0.0, shift), ("nearer", "$D_0$", "farther"), shades(3), strict=True):
        moved = replace(ours, law=replace(law, D=(law.D[0] + w, law.D[1])))
        orbit = simulate(moved, 200.0)
        label = f"{name} ({law.D[0] + w:.2f}; {law.D[1]:.2f})"
        ax.plot(*orbit.at(np.linspace(170.0, 200.0, 4000)), color=colour, lw=1.2, label=label)
    ax.legend(fontsize=7.5, frameon=False, title="D", title_fontsize=8)
    ax.set(xlabel="position x (dimensionless)", ylabel="velocity ẋ (dimensionless)")
    ax.set_title(f"s = {drive_velocity:.2f}", **TITLE)
    return ax


def shades(count: int) -> list[Any]:
    """Colours for something that grows."""
    return [plt.get_cmap("viridis")(f) for f in np.linspace(0.0, 0.85, count)]


def loop(
    s: float, start: float = 184.0, end: float = 200.0, x0: float | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Slip velocity and friction from `start` to `end`, the corners at the events met exactly."""
    orbit = simulate(oscillator(s), end, x0=x0)
    edges = orbit.segments["t"].to_numpy()
    edges = edges[edges > start]
    times = np.unique(np.concatenate([np.linspace(start, end, 4001), edges, np.nextafter(edges, -np.inf)]))
    motion = orbit.to_xarray(times)
    return motion["slip_velocity"].to_numpy(), motion["force"].to_numpy()
