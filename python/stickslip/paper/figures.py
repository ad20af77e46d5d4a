"""The paper's figures, drawn from our model.

Every function returns its axes; ``FIGURES`` maps the numbers of the paper's figures to them. The paper's own figures
are not available to us: where a curve of the paper is lost, the picture shows our calibration and says so.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import ArrayLike, NDArray

from stickslip.analysis import orbit_diagram
from stickslip.laws import BogaczRyczek
from stickslip.paper import END_OF_OSCILLATION, END_OF_STICK_SLIP, oscillator
from stickslip.show import (
    BRANCH_COLOURS,
    OKABE_ITO,
    REGIME_COLOURS,
    break_away_plot,
    friction_loop,
    new_axes,
    orbit_diagram_plot,
    phase_plane,
)
from stickslip.show.canvas import words
from stickslip.simulation import simulate
from stickslip.system import Harmonic

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

Point = tuple[float, float]

_LINE = BRANCH_COLOURS

# Titles take the size of the caller's style, not of ours.
_TITLE: Any = {"fontsize": 9}


def static_friction(law: BogaczRyczek | None = None, ax: Axes | None = None) -> Axes:
    """Fig. 2: the break-away force f_s(t_s, δ) over the stick time, for several force rates. Our calibration.

    >>> ax = static_friction()
    >>> ax.get_title()
    'our calibration of f_s(t_s, δ)'
    >>> plt.close(ax.figure)
    """
    ax = break_away_plot(law or BogaczRyczek(), ax, force_rates=(0.05, 0.1, 0.2, 0.3, 0.4))
    ax.set_title("our calibration of f_s(t_s, δ)", **_TITLE)
    return ax


def friction_loops(drive_velocities: Sequence[float] = (0.20, 0.30, 0.45)) -> list[Axes]:
    """Figs. 4 to 6: friction over slip velocity in stick-slip, almost-harmonic vibration and stable slip.

    The transient from rest is drawn faded.

    Parameters
    ----------
    drive_velocities : one panel each.
    """
    count = len(drive_velocities)
    panels = new_axes(1, count, figsize=(3.4 * count, 3.1), sharex=True, sharey=True)
    for ax, s in zip(panels, drive_velocities, strict=True):
        orbit = simulate(oscillator(s), 150.0)
        friction_loop(orbit, ax, show_transient=True, transient=0.6)
        ax.set_title(f"s = {s:.2f}: {words(orbit.regime())}", **_TITLE)
        ax.label_outer()
    panels[0].set_ylim(0.62, 1.32)
    return panels


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
    for s, colour in zip(drive_velocities, _shades(len(drive_velocities)), strict=True):
        w, force = _loop(s)
        ax.plot(w, force, color=colour, label=f"s = {s:.2f}")
    ax.axhline(BogaczRyczek().break_away_force(), color=OKABE_ITO["grey"], lw=0.7, ls="--", zorder=0)
    ax.annotate("$f_s(0)$", (0.995, BogaczRyczek().break_away_force()), (0, 2), **_ON_THE_RIGHT)
    ax.legend(fontsize=8, frameon=False, loc="lower right")
    ax.set(xlabel="slip velocity w (dimensionless)", ylabel="friction f (dimensionless)")
    return ax


def law_geometry(law: BogaczRyczek | None = None) -> list[Axes]:
    """Figs. 6 to 9: the lines of the law, their pencils and angles, in stick-slip and in almost-harmonic vibration.

    Parameters
    ----------
    law : with the pencils B and D at points and A and C at infinity, as in the paper; default ours.

    Left: break-away without rest and two after rest, and the falling lines through B. Right: three turns of ẇ from −
    to + and the climbs towards D, the last one so near to D that it takes the angle η.
    """
    law = law or BogaczRyczek()
    left, right = new_axes(1, 2, figsize=(8.6, 4.4), gridspec_kw={"width_ratios": (1.15, 1)})
    _stick_slip_geometry(law, left)
    _almost_harmonic_geometry(law, right)
    for ax in (left, right):
        ax.axvline(0, color=OKABE_ITO["grey"], lw=0.6, zorder=0)
        ax.set(xlabel="slip velocity w (dimensionless)", ylabel="friction f (dimensionless)")
    return [left, right]


def _corner(law: BogaczRyczek, anchor: Point) -> Point:
    falling, (rise, intercept) = np.tan(np.radians(law.phi)), law.l
    w = (anchor[1] - falling * anchor[0] - intercept) / (rise - falling)
    return w, rise * w + intercept


def _stick_slip_geometry(law: BogaczRyczek, ax: Axes) -> None:
    common, end = np.tan(np.radians(law.psi)), 0.55
    for force in (law.static_friction.initial, 1.2, 1.33):
        anchor = (law.beta, force)
        corner = _corner(law, anchor)
        ax.plot([0, anchor[0]], [force, force], color=_LINE["fall"])
        ax.plot(*zip(anchor, corner, strict=True), color=_LINE["upper"])
        ax.plot([corner[0], end], [corner[1], corner[1] + common * (end - corner[0])], color=_LINE["common"])
        slope = (corner[1] - law.B[1]) / (corner[0] - law.B[0])
        ax.plot([0, corner[0]], [corner[1] - slope * corner[0], corner[1]], color=_LINE["lower"])
        ax.plot([law.B[0], 0], [law.B[1], corner[1] - slope * corner[0]], color=_LINE["lower"], lw=0.7, ls=":")
    w = np.array([0.2, 0.42])
    ax.plot(w, law.l[0] * w + law.l[1], color=OKABE_ITO["grey"], lw=0.9, ls="--")
    _note(ax, "l", (w[1], law.l[0] * w[1] + law.l[1]), (3, -2))
    _point(ax, law.B, f"B ({law.B[0]:g}; {law.B[1]:g})".replace("-", "−"), (4, 5))
    _note(ax, "$f_s(t_s, δ)$", (0.0, 1.33), (-4, 0), ha="right", va="center")
    _note(ax, "$f_s(0)$", (0.0, law.static_friction.initial), (-4, 4), ha="right", va="center")
    corner = _corner(law, (law.beta, law.static_friction.initial))
    _note(ax, "corner (w*; f*)", corner, (-8, -6), ha="right")
    _note(ax, f"φ = {law.phi:g}°, ẇ > 0".replace("-", "−"), (0.12, 1.2), (4, 4), color=_LINE["upper"])
    _note(ax, f"ψ = {law.psi:g}°", (0.47, 0.72 + common * 0.1), (6, -8), color=_LINE["common"])
    _note(ax, "through B, ẇ < 0", (-0.22, 1.02), (0, 0), ha="center", color=_LINE["lower"])
    ax.set(xlim=(-0.45, 0.6), ylim=(0.55, 1.45))
    ax.set_title("after break-away (Fig. 7)", **_TITLE)


def _almost_harmonic_geometry(law: BogaczRyczek, ax: Axes) -> None:
    top = law.static_friction.initial
    steepest = np.tan(np.radians(law.eta))
    for s, last in ((0.27, False), (0.31, False), (0.36, True)):
        w, force = _loop(s)
        friction_loop(simulate(oscillator(s), 200.0), ax, arrows=False, legend=False)
        turn = int(np.argmin(w))
        start = (float(w[turn]), float(force[turn]))
        if law.D is not None and not last:
            ax.plot(*zip(start, law.D, strict=True), color=_LINE["climb"], lw=0.7, ls=":")
        _note(ax, f"s = {s:.2f}", (float(w.max()), float(force[np.argmax(w)])), (3, 0), va="center", fontsize=7.5)
    _note(ax, f"η = {law.eta:g}°", (0.325, 1.13), (6, 4), color=_LINE["climb"])
    ax.plot([0.3228, 0.3228 + 0.35 / steepest], [1.09, 1.44], color=_LINE["climb"], lw=0.7, ls=":")
    w = np.array([0.28, 0.5])
    ax.plot(w, law.l[0] * w + law.l[1], color=OKABE_ITO["grey"], lw=0.9, ls="--")
    _note(ax, "l", (w[1], law.l[0] * w[1] + law.l[1]), (3, -2))
    if law.D is not None:
        _point(ax, law.D, f"D ({law.D[0]:g}; {law.D[1]:g})", (6, -3))
    ax.axhline(top, color=OKABE_ITO["grey"], lw=0.6, ls="--", zorder=0)
    _note(ax, "Eq. (7): $f_s(0)$", (0.005, top), (0, 2), va="bottom")
    ax.set(xlim=(-0.02, 0.6), ylim=(0.6, 2.55))
    ax.set_title("after a turn of ẇ from − to + (Figs. 8, 9)", **_TITLE)


def phase_portraits(
    drive_velocities: Sequence[float] = (0.10, 0.20, 0.25, 0.2525, 0.26, 0.30, 0.35, 0.45), columns: int = 4
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
        ax.set_title(f"s = {s:g}: {words(orbit.regime(transient=0.75))}", **_TITLE)
        ax.label_outer()
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
    for s, colour in zip(drive_velocities, _shades(len(drive_velocities)), strict=True):
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
    diagram : from :func:`stickslip.analysis.orbit_diagram`; default 151 drive velocities from 0.05 to 0.50.
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
    """Our model's orbit diagram over the drive velocity; `options` as in :func:`stickslip.analysis.orbit_diagram`."""
    grid = np.linspace(0.05, 0.50, 151) if values is None else values
    return orbit_diagram(oscillator(0.30), "drive_velocity", grid, **options)


def forced_motions(
    cases: Sequence[tuple[float, float, float]] = (
        (0.30, 0.35, 0.09),
        (0.30, 1.25, 0.03),
        (0.40, 0.40, 0.10),
        (0.40, 1.60, 0.10),
    ),
) -> list[Axes]:
    """Fig. 13: forced motions in the phase plane, one point per forcing period marked.

    Parameters
    ----------
    cases : (s, η, u₀), one panel each; the paper does not state its u₀.
    """
    panels = new_axes(1, len(cases), figsize=(2.6 * len(cases), 2.7))
    for ax, (s, eta, u0) in zip(panels, cases, strict=True):
        period = 2 * np.pi / eta
        orbit = simulate(oscillator(s, Harmonic(u0, eta)), 664 * period)
        times = np.linspace(600 * period, orbit.t_end, 64 * 300)
        ax.plot(*orbit.at(times), color=OKABE_ITO["blue"], lw=0.5, rasterized=True)
        ax.plot(*orbit.at(period * np.arange(600, 664)), ".", ms=5, color=OKABE_ITO["vermilion"], zorder=3)
        ax.set_title(f"s = {s:.2f}, η = {eta:.2f}, $u_0$ = {u0:.2f}", **_TITLE)
        ax.set(xlabel="position x (dimensionless)", ylabel="velocity ẋ (dimensionless)")
    for ax in panels[1:]:
        ax.set_ylabel("")
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
    ax.set_ylim(top=1.35)
    limit_cycles(ax=panels[1])
    regimes(diagram, panels[2])
    return panels


_ON_THE_RIGHT: Any = {
    "xycoords": ("axes fraction", "data"),
    "textcoords": "offset points",
    "ha": "right",
    "va": "bottom",
    "fontsize": 8,
}


def _shades(count: int) -> list[Any]:
    return [plt.get_cmap("viridis")(f) for f in np.linspace(0.0, 0.85, count)]


def _loop(s: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Slip velocity and friction over the last loop or two, closed at the events."""
    orbit = simulate(oscillator(s), 200.0)
    start = orbit.t_end - 16.0
    edges = orbit.segments["t"].to_numpy()
    edges = edges[edges > start]
    times = np.unique(np.concatenate([np.linspace(start, orbit.t_end, 4001), edges, np.nextafter(edges, -np.inf)]))
    motion = orbit.to_xarray(times)
    return motion["slip_velocity"].to_numpy(), motion["force"].to_numpy()


def _point(ax: Axes, at: Point, text: str, offset: Point) -> None:
    ax.plot(*at, "o", ms=4, color=OKABE_ITO["black"], zorder=4)
    _note(ax, text, at, offset)


def _note(ax: Axes, text: str, at: Point, offset: Point, **options: Any) -> None:
    ax.annotate(text, at, offset, textcoords="offset points", **{"fontsize": 8, **options})


#: The paper's figures by number.
FIGURES: dict[str, Callable[[], Axes | list[Axes]]] = {
    "fig-02-static-friction": static_friction,
    "fig-05-friction-over-drive-velocity": friction_over_drive_velocity,
    "fig-06-friction-loops": friction_loops,
    "fig-07-law-geometry": law_geometry,
    "fig-12-phase-portraits": phase_portraits,
    "fig-13-forced-motions": forced_motions,
    "fig-14-regimes": regimes,
}
