"""Branches of motions with their stable and unstable parts, and curves of their special points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.show.canvas import ABOVE, LINES, OKABE_ITO, axes, label, parameter_label, units_of, words

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from stickslip.dynamics.continuation.branch import Branches
    from stickslip.dynamics.continuation.loci import Locus

_COLOURS = {"steady_slip": "green", "slip": "blue", "stick_slip": "vermilion"}
#: Letters, marker and colour of each kind of special point.
_NAMES = {
    "hopf": ("H", "o", "green"),
    "nonsmooth_hopf": ("NH", "D", "green"),
    "fold": ("F", "s", "vermilion"),
    "nonsmooth_fold": ("NF", "h", "vermilion"),
    "flip": ("PD", "^", "purple"),
    "neimark_sacker": ("NS", "*", "blue"),
    "branch_point": ("BP", "P", "black"),
    "grazing_sliding": ("GS", "v", "orange"),
    "crossing_sliding": ("CS", ">", "sky"),
    "switching_sliding": ("SS", "<", "sky"),
    "adding_sliding": ("AS", "d", "orange"),
    "grazing_node": ("GN", "p", "grey"),
}
#: A kind that has no name of its own here.
_OTHER = ("", "o", "black")


def branches_plot(result: Branches, ax: Axes | None = None, *, units: str | None = None) -> Axes:
    """Draw the range of the position over the parameter: stable parts full, unstable ones dashed, marginal ones dotted.

    Parameters
    ----------
    result : from :func:`stickslip.continuation`.
    ax : axes to draw into; default a new figure.
    units : ``"dimensionless"``, ``"SI"`` or ``"torsional"``; default by the system.

    Returns
    -------
    The axes. Colours tell steady slip, cycles without and with sticks; the letters of special points are explained in the
    legend.
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
                    ls=LINES[stable[start]],
                    lw=1.5 if stable[start] else 1.1,
                )
    for name, colour in named.items():
        ax.plot([], [], color=OKABE_ITO[colour], label=name)
    for state, text in ((False, "unstable"), (None, "marginal")):
        if any(state is value for branch in result.branches for value in branch.stable):
            ax.plot([], [], color=OKABE_ITO["black"], lw=1.1, ls=LINES[state], label=text)
    _mark(result, ax)
    which = units_of(result.system, units)
    ax.set(
        xlabel=parameter_label(result.parameter, which),
        ylabel=label("greatest and least position x", "position", which),
        xlim=result.bounds,
    )
    ax.legend(**ABOVE, ncols=2, columnspacing=1.2)
    return ax


def _mark(result: Branches, ax: Axes) -> None:
    """The special points with their letters; those too near to be told apart share one text, in their order."""
    positions: list[tuple[float, float, list[str]]] = []
    width, height = np.ptp(result.bounds), np.ptp(ax.get_ylim())
    for item in result.special_points:
        x = [value for value in dict.fromkeys(item.x) if np.isfinite(value)]
        ax.plot([item.parameter] * len(x), x, zorder=4, **_marker(item.kind))
        if not x:
            continue
        letters = _NAMES.get(item.kind, _OTHER)[0] or item.kind
        for at, top, there in positions:
            if abs(at - item.parameter) < 0.04 * width and abs(top - max(x)) < 0.05 * height:
                there += [letters] if letters not in there else []
                break
        else:
            positions.append((item.parameter, max(x), [letters]))
    for at, top, there in positions:
        ax.annotate(", ".join(there), (at, top), xytext=(3, 4), textcoords="offset points", fontsize=8)
    for kind in dict.fromkeys(item.kind for item in result.special_points):
        text = f"{_NAMES.get(kind, _OTHER)[0] or kind}: {_kind(kind)}"
        ax.plot([], [], label=text, **_marker(kind))


def _marker(kind: str) -> dict[str, Any]:
    """The look of a special point."""
    _, marker, colour = _NAMES.get(kind, _OTHER)
    return {"marker": marker, "ls": "", "ms": 5, "mfc": "white", "color": OKABE_ITO[colour], "mew": 1.3}


def _kind(kind: str) -> str:
    """The kind of a special point, or of a curve of them, as the literature spells it."""
    spelled = words(kind).replace("hopf", "Hopf").replace("neimark sacker", "Neimark–Sacker")
    return spelled.replace(" sliding", "-sliding")


def loci_plot(loci: Sequence[Locus], ax: Axes | None = None, *, units: str = "dimensionless") -> Axes:
    """Draw curves of special points in the plane of two parameters, one colour a kind.

    Parameters
    ----------
    loci : from :func:`stickslip.locus`, over the same two parameters.
    ax : axes to draw into; default a new figure.
    units : ``"dimensionless"``, ``"SI"`` or ``"torsional"``.

    Returns
    -------
    The axes. A curve that ends inside meets another boundary there.
    """
    ax = axes(ax)
    named: set[str] = set()
    for curve in loci:
        line = "--" if curve.kind.endswith("_sliding") else "-"
        text = None if curve.kind in named else _kind(curve.kind)
        ax.plot(*curve.values.T, color=OKABE_ITO[_NAMES.get(curve.kind, _OTHER)[2]], ls=line, lw=1.5, label=text)
        named.add(curve.kind)
    if loci:
        first, second = loci[0].parameters
        (left, right), (low, high) = loci[0].bounds
        ax.set(
            xlabel=parameter_label(first, units),
            ylabel=parameter_label(second, units),
            xlim=(left, right),
            ylim=(low, high),
        )
        ax.legend(**ABOVE, ncols=2, columnspacing=1.2)
    return ax
