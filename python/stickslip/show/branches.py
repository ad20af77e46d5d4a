"""Branches of motions with their stable and unstable parts, and curves of their special points."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.show.canvas import OKABE_ITO, axes, label, units_of, words

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from stickslip.dynamics.continuation.branch import Branches
    from stickslip.dynamics.continuation.loci import Locus

_COLOURS = {"steady_slip": "green", "slip": "blue", "stick_slip": "vermilion"}
_NAMES = {
    "hopf": "H",
    "nonsmooth_hopf": "NH",
    "fold": "F",
    "nonsmooth_fold": "NF",
    "flip": "PD",
    "neimark_sacker": "NS",
    "branch_point": "BP",
    "grazing_sliding": "GS",
    "crossing_sliding": "CS",
    "switching_sliding": "SS",
    "adding_sliding": "AS",
    "grazing_node": "GN",
}


def branches_plot(result: Branches, ax: Axes | None = None, *, units: str | None = None) -> Axes:
    """Draw the range of the position over the parameter: stable parts full, unstable ones dashed, special points named.

    Parameters
    ----------
    result : from :func:`stickslip.continuation`.
    ax : axes to draw into; default a new figure.
    units : ``"dimensionless"`` or ``"SI"``; default by the system.

    Returns
    -------
    The axes. Colours tell steady slip, cycles without and with sticks; the letters are explained in the legend.
    """
    ax = axes(ax)
    named: dict[str, str] = {}
    for branch in result.branches:
        values, stable = np.asarray(branch.values), np.asarray(branch.stable)
        kinds = np.array(
            ["steady_slip"] * len(values)
            if branch.kind == "steady_slip"
            else np.where(np.asarray(branch.sticks), "stick_slip", "slip").tolist()
        )
        change = np.flatnonzero((stable[1:] != stable[:-1]) | (kinds[1:] != kinds[:-1])) + 1
        for start, end in zip([0, *change], [*change, len(values)], strict=True):
            # A part reaches to the first point of the next, so that the curve has no gaps.
            part = slice(start, min(end + 1, len(values)))
            kind = str(kinds[start])
            named[{"steady_slip": "steady slip", "slip": "cycle", "stick_slip": "stick-slip"}[kind]] = _COLOURS[kind]
            for column in (branch.x_max, branch.x_min):
                ax.plot(
                    values[part],
                    np.asarray(column)[part],
                    color=OKABE_ITO[_COLOURS[kind]],
                    ls="-" if stable[start] else (0, (3, 2)),
                    lw=1.5 if stable[start] else 1.1,
                )
    for name, colour in named.items():
        ax.plot([], [], color=OKABE_ITO[colour], label=name)
    if not all(all(branch.stable) for branch in result.branches):
        ax.plot([], [], color=OKABE_ITO["black"], lw=1.1, ls=(0, (3, 2)), label="unstable")
    _mark(result, ax)
    velocity = result.parameter == "drive_velocity"
    which = units_of(result.system, units)
    across = label("drive velocity s", "velocity", which) if velocity else words(result.parameter)
    ax.set(xlabel=across, ylabel=label("greatest and least position x", "position", which), xlim=result.bounds)
    ax.legend(loc="best", fontsize=8, frameon=False)
    return ax


def _mark(result: Branches, ax: Axes) -> None:
    """The special points with their letters; those too near to be told apart share one text, in their order."""
    places: list[tuple[float, float, list[str]]] = []
    width, height = np.ptp(result.bounds), np.ptp(ax.get_ylim())
    for item in result.special_points:
        x = [value for value in dict.fromkeys(item.x) if np.isfinite(value)]
        ax.plot([item.parameter] * len(x), x, "o", ms=4, mfc="white", color=OKABE_ITO["black"], zorder=4)
        if not x:
            continue
        letters = _NAMES.get(item.kind, item.kind)
        for at, top, there in places:
            if abs(at - item.parameter) < 0.04 * width and abs(top - max(x)) < 0.05 * height:
                there += [letters] if letters not in there else []
                break
        else:
            places.append((item.parameter, max(x), [letters]))
    for at, top, there in places:
        ax.annotate(", ".join(there), (at, top), xytext=(3, 4), textcoords="offset points", fontsize=8)
    for kind in dict.fromkeys(item.kind for item in result.special_points):
        text = f"{_NAMES.get(kind, kind)}: {words(kind).replace('hopf', 'Hopf')}"
        ax.plot([], [], "o", ms=4, mfc="white", color=OKABE_ITO["black"], label=text)


def loci_plot(loci: Sequence[Locus], ax: Axes | None = None) -> Axes:
    """Draw curves of special points in the plane of two parameters, one colour a kind.

    Parameters
    ----------
    loci : from :func:`stickslip.locus`, over the same two parameters.
    ax : axes to draw into; default a new figure.

    Returns
    -------
    The axes. A curve that ends inside meets another border there.
    """
    ax = axes(ax)
    colours = [colour for name, colour in OKABE_ITO.items() if name not in ("grey", "yellow")]
    kinds = list(dict.fromkeys(curve.kind for curve in loci))
    for index, kind in enumerate(kinds):
        for number, curve in enumerate(item for item in loci if item.kind == kind):
            text = words(kind).replace("hopf", "Hopf") if number == 0 else None
            ax.plot(*curve.values.T, color=colours[index % len(colours)], lw=1.5, label=text)
    if loci:
        first, second = loci[0].parameters
        (left, right), (low, high) = loci[0].bounds
        ax.set(xlabel=words(first), ylabel=words(second), xlim=(left, right), ylim=(low, high))
        ax.legend(loc="best", fontsize=8, frameon=False)
    return ax
