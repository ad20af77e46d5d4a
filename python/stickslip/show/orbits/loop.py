"""Friction over slip velocity along an orbit: the loop in which a law with memory is seen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from stickslip import _core
from stickslip.errors import InputError
from stickslip.laws import BogaczRyczek
from stickslip.show.canvas import ABOVE, MODE_COLOURS, OKABE_ITO, SPEED_COLOURS, axes, label, units_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from stickslip.simulation.orbit import Orbit

#: One colour per branch of a law, the same in every picture.
BRANCH_COLOURS = {
    "stick": MODE_COLOURS["stick"],
    "fall": OKABE_ITO["green"],
    "upper": OKABE_ITO["orange"],
    "common": OKABE_ITO["black"],
    "lower": OKABE_ITO["sky"],
    "climb": OKABE_ITO["blue"],
    "steep": OKABE_ITO["purple"],
    **SPEED_COLOURS,
}

# The last segments of an orbit that are drawn: a chaotic loop is full long before.
_MOST = 2000
# Points of a segment.
_POINTS = 120


@dataclass(frozen=True)
class _Trace:
    """A piece of the loop on one branch, in the order of time."""

    name: str
    w: NDArray[np.float64]
    force: NDArray[np.float64]


def friction_loop(
    orbit: Orbit,
    ax: Axes | None = None,
    *,
    transient: float = 0.5,
    show_transient: bool = False,
    arrows: bool = True,
    legend: bool = True,
    colour: str | None = None,
    name: str | None = None,
    units: str | None = None,
) -> Axes:
    """Draw the friction on the mass over the slip velocity in the steady part, coloured by branch, arrows along time.

    Parameters
    ----------
    orbit : any orbit. Laws without branches are coloured by whether |w| grows or falls.
    ax : axes to draw into; default a new figure.
    transient : the fraction of the orbit that is left out, in [0, 1).
    show_transient : whether it is drawn faded; a help where the steady part is one point.
    arrows : whether each branch of the last loop carries an arrow along time.
    legend : whether the branches are named.
    colour : one colour instead of one per branch, to tell several orbits apart.
    name : of the whole loop in the legend, where `colour` is given.
    units : ``"dimensionless"``, ``"SI"`` or ``"torsional"``; default by the system.

    Returns
    -------
    The axes. A steady slip is drawn as a dot. While it sticks, friction is the reaction that holds the mass, at w = 0.
    Of long orbits the last 2000 segments are drawn.

    Source: Figs. 4 to 6 of the paper.
    """
    if not 0 <= transient < 1:
        raise InputError(f"friction_loop: transient must lie in [0, 1), got {transient}")
    ax = axes(ax)
    middle = transient * orbit.t_end
    late = _traces(orbit, middle, orbit.t_end)
    extent = float(np.ptp(orbit.to_xarray()["slip_velocity"].to_numpy()))
    if show_transient and middle > 0:
        for trace in _traces(orbit, 0.0, middle):
            ax.plot(trace.w, trace.force, color=OKABE_ITO["grey"], lw=0.7, alpha=0.7, zorder=1)
    if max(trace.w.max() for trace in late) - min(trace.w.min() for trace in late) < 2e-3 * extent:
        ax.plot(
            late[-1].w[-1],
            late[-1].force[-1],
            "o",
            ms=6,
            color=colour or OKABE_ITO["green"],
            label=name or "steady slip",
            zorder=3,
        )
    else:
        _draw(ax, late, colour, name)
        if arrows:
            _arrows(ax, late, colour)
    ax.axvline(0, color=OKABE_ITO["grey"], lw=0.6, zorder=0)
    if legend:
        ax.legend(**ABOVE, ncols=3, columnspacing=1.0)
    which = units_of(orbit.system, units)
    ax.set(xlabel=label("slip velocity w", "velocity", which), ylabel=label("friction F", "force", which))
    return ax


def _traces(orbit: Orbit, start: float, stop: float) -> list[_Trace]:
    segments = orbit.segments
    begins = segments["t"].to_numpy()
    ends = np.append(begins[1:], orbit.t_end)
    chosen = np.flatnonzero((ends > start) & (begins < stop) & (ends > begins))[-_MOST:]
    has_branches = isinstance(orbit.system.law, BogaczRyczek)
    # Friction jumps at an event: all times of a segment lie just inside it.
    spans = np.clip(
        np.linspace(np.maximum(begins[chosen], start), np.minimum(ends[chosen], stop), _POINTS, axis=1),
        np.nextafter(begins[chosen], np.inf)[:, None],
        np.nextafter(ends[chosen], -np.inf)[:, None],
    )
    motion = orbit.to_xarray(spans.ravel())
    slips, forces = (motion[key].to_numpy().reshape(spans.shape) for key in ("slip_velocity", "force"))
    directions, branches = (segments[key].to_numpy()[chosen] for key in ("direction", "branch"))
    traces = []
    for w, force, direction, branch in zip(slips, forces, directions, branches, strict=True):
        if direction == 0:
            traces.append(_Trace("stick", np.zeros_like(w), force))
        elif has_branches:
            traces.append(_Trace(_core.BRANCHES[int(branch)], w, force))
        else:
            grows = np.diff(np.abs(w)) > 0
            for piece in np.split(np.arange(w.size - 1), np.flatnonzero(np.diff(grows)) + 1):
                points = np.append(piece, piece[-1] + 1)
                traces.append(_Trace("|w| grows" if grows[piece[0]] else "|w| falls", w[points], force[points]))
    return traces


def _draw(ax: Axes, traces: list[_Trace], colour: str | None, name: str | None) -> None:
    if colour:
        _path(ax, traces, colour, name)
        return
    for branch, its_colour in BRANCH_COLOURS.items():
        mine = [trace for trace in traces if trace.name == branch]
        if mine:
            _path(ax, mine, its_colour, branch)


def _path(ax: Axes, traces: list[_Trace], colour: str, name: str | None) -> None:
    """One artist, its pieces parted by gaps."""
    w, force = (np.concatenate([np.append(getattr(t, key), np.nan) for t in traces]) for key in ("w", "force"))
    ax.plot(w, force, color=colour, lw=1.5, label=name, rasterized=w.size > 50_000)


def _arrows(ax: Axes, traces: list[_Trace], colour: str | None) -> None:
    drawn: set[tuple[str, bool]] = set()
    across, up = (
        max(getattr(t, key).max() for t in traces) - min(getattr(t, key).min() for t in traces)
        for key in ("w", "force")
    )
    # The last whole piece of each kind; the very last one may be cut by the end of the orbit.
    for trace in traces[-2::-1]:
        grows = bool(trace.w[-1] > trace.w[0])
        path = np.hypot(np.diff(trace.w) / (across or 1.0), np.diff(trace.force) / (up or 1.0)).cumsum()
        if (trace.name, grows) in drawn or path[-1] < 0.1:
            continue
        drawn.add((trace.name, grows))
        # Both senses run over each other on a common line: part their arrows.
        k = int(np.searchsorted(path, (0.8 if grows else 0.72) * path[-1]))
        back = int(np.searchsorted(path, path[k] - 0.02))
        ax.annotate(
            "",
            xy=(trace.w[k + 1], trace.force[k + 1]),
            xytext=(trace.w[back], trace.force[back]),
            arrowprops={
                "arrowstyle": "-|>,head_width=0.32,head_length=0.75",
                "color": colour or BRANCH_COLOURS[trace.name],
                "lw": 0,
                "mutation_scale": 13,
                "shrinkA": 0,
                "shrinkB": 0,
            },
            zorder=4,
        )
