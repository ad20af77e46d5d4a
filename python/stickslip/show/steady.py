"""The picture of friction over slip velocity: points, the chosen curve, and those that are as good."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from stickslip.show.canvas import ABOVE, OKABE_ITO, axes, in_units, new_axes

if TYPE_CHECKING:
    from stickslip.identification.steady.steady_result import SteadyFriction

FEWEST_SLOW = 8
"""Fewest rows at low speeds that have a panel of their own."""
VISIBLE_APART = 0.01
"""Curves within this part of the range of forces of the chosen one are not drawn beside it."""


def plot_steady(found: SteadyFriction, ax: Any = None) -> Any:
    """See :meth:`SteadyFriction.plot`."""
    reach = _low_speeds(found) if ax is None else 0.0
    panels = new_axes(1, 2, figsize=(7.2, 3.6)) if reach else [axes(ax)]
    for panel, most in zip(panels, (math.inf, reach), strict=False):
        _draw(found, panel, most)
        panel.set_xlabel("slip velocity w" + in_units(found.stated.get("slip_velocity")))
        panel.locator_params(axis="x", nbins=5 if reach else 8)
    panels[0].set_ylabel("friction force f" + in_units(found.stated.get("force")))
    if ax is None:
        panels[0].figure.legend(
            *panels[-1].get_legend_handles_labels(), loc="outside lower left", ncols=2, frameon=False, fontsize=8
        )
    else:
        ax.legend(**ABOVE)
    return panels[0]


def _low_speeds(found: SteadyFriction) -> float:
    """Up to where low speeds have their own panel: the fall of friction, or a tenth of all; 0 where they need none."""
    speed = found.rows["slip_velocity"].abs().to_numpy()
    fall = found.parameters["value"].get("scale")
    reach = 0.1 * float(speed.max()) if fall is None else 4 * float(fall)
    return reach if reach < 0.5 * speed.max() and np.count_nonzero(speed < reach) >= FEWEST_SLOW else 0.0


def _draw(found: SteadyFriction, axes: Any, most: float) -> None:
    """Points and curves at speeds up to `most`, with medians of many points where that is finite."""
    names = ("slip_velocity", "force", "force_error", "motion_force")
    w, force, error, other = (found.rows[name].to_numpy() for name in names)
    force = force - other
    shown = np.abs(w) <= most
    w, force, error = w[shown], force[shown], error[shown]
    if len(w) > 500:
        axes.plot(w, force, ".", ms=1.5, alpha=0.2, color="0.5", rasterized=True)
        axes.plot([], [], ".", color="0.5", label="measured")  # a point of the cloud is too faint for a legend
    else:
        axes.errorbar(w, force, error, fmt="o", ms=3, color="0.4", label="measured")
    named: set[str] = set()

    def line(name: str, grid: npt.NDArray[np.float64], style: str, **look: Any) -> None:
        axes.plot(grid, found.fits[name](grid), style, label=None if name in named else name, **look)
        named.add(name)

    for side in (1.0, -1.0):
        inside = np.abs(w[w * side > 0])
        if not len(inside):
            continue
        grid = side * np.linspace(inside.min(), inside.max(), 200)
        line(found.chosen, grid, "-", color=OKABE_ITO["blue"], zorder=3)
        axes.fill_between(grid, *found.best.interval(grid), color=OKABE_ITO["blue"], alpha=0.25, lw=0)
        colours = (OKABE_ITO[name] for name in ("vermilion", "green", "purple"))
        for name, colour in zip(found.undecided, colours, strict=False):
            if np.abs(found.fits[name](grid) - found.best(grid)).max() > VISIBLE_APART * np.ptp(found.rows["force"]):
                line(name, grid, "--", lw=1, color=colour)
        if math.isfinite(most) and len(w) > 500:
            bins = np.array_split(np.argsort(inside), 12)
            own = force[w * side > 0]
            middle = [side * float(np.median(inside[part])) for part in bins]
            medians = [float(np.median(own[part])) for part in bins]
            label = "medians in bins of speed" if "medians" not in named else None
            axes.plot(middle, medians, "o", ms=3.5, mfc="white", color=OKABE_ITO["black"], label=label, zorder=4)
            named.add("medians")
