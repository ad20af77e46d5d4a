"""Stability: Floquet multipliers in the complex plane, manifolds of saddles, Lyapunov exponents as they converge."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.errors import InputError
from stickslip.show.canvas import ABOVE, COLOURS, LINES, OKABE_ITO, axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from stickslip.dynamics.periodic.lyapunov_exponents import LyapunovSpectrum
    from stickslip.dynamics.periodic.manifold import Manifold
    from stickslip.dynamics.periodic.periodic_orbits import PeriodicOrbit


def multipliers_plot(
    cycles: PeriodicOrbit | Sequence[PeriodicOrbit],
    ax: Axes | None = None,
    *,
    values: Sequence[float] | None = None,
    name: str = "",
    colour: str = OKABE_ITO["blue"],
) -> Axes:
    """Draw the Floquet multipliers of a periodic orbit, or of several along a branch, with the unit circle.

    Parameters
    ----------
    cycles : from :func:`stickslip.periodic_orbit`.
    ax : axes to draw into; default a new figure.
    values : the parameter of each of several cycles: they are coloured by it, shape (n,).
    name : of that parameter, beside its scale.
    colour : of the multipliers where there are no values.

    Returns
    -------
    The axes. Those outside the circle belong to directions in which disturbances grow; a cycle of an autonomous system has
    one at 1.

    Raises
    ------
    InputError
        where there are not as many values as cycles, or what is given is no periodic orbit.
    """
    several = list(cycles) if isinstance(cycles, Sequence) else [cycles]
    for cycle in several:
        if not hasattr(cycle, "multipliers"):
            raise InputError(
                f"multipliers_plot: expected periodic orbits, such as branch.orbit(i), got {type(cycle).__name__}"
            )
    if values is not None and len(values) != len(several):
        raise InputError(
            f"multipliers_plot: values must be as many as cycles, got {len(values)} for {len(several)}; give one for each"
        )
    ax = axes(ax)
    angle = np.linspace(0.0, 2 * np.pi, 361)
    ax.plot(np.cos(angle), np.sin(angle), color=OKABE_ITO["grey"], lw=0.8)
    every = np.concatenate([cycle.multipliers for cycle in several])
    if values is None:
        ax.plot(every.real, every.imag, "o", ms=5, color=colour)
    else:
        of_each = np.repeat(np.asarray(values, float), [len(cycle.multipliers) for cycle in several])
        dots = ax.scatter(every.real, every.imag, c=of_each, s=16, cmap="viridis", zorder=2)
        ax.get_figure(root=True).colorbar(dots, ax=ax, label=name, shrink=0.8)  # type: ignore[union-attr]
    ax.axhline(0, color=OKABE_ITO["grey"], lw=0.5, zorder=0)
    ax.axvline(0, color=OKABE_ITO["grey"], lw=0.5, zorder=0)
    ax.set(xlabel="real part of the multiplier", ylabel="imaginary part", aspect="equal")
    return ax


def manifold_plot(manifolds: Manifold | Sequence[Manifold], ax: Axes | None = None, mass: int = 0) -> Axes:
    """Draw stable and unstable manifolds in their section, with a cross at the orbit.

    Parameters
    ----------
    manifolds : from :func:`stickslip.manifold`, one or several.
    ax : axes to draw into, such as those of :func:`basins_plot` or :func:`section_plot`, whose limits and legend stay;
        default a new figure.
    mass : whose position and velocity are drawn.

    Returns
    -------
    The axes. The stable manifold of a saddle bounds basins; a chaotic motion lies along the unstable one.
    """
    over = ax is not None
    ax = axes(ax)
    limits = ax.axis()
    several = list(manifolds) if isinstance(manifolds, Sequence) else [manifolds]
    known = ax.get_legend()
    for item in several:
        columns = [mass, len(item.fixed_point) // 2 + mass]
        ax.plot(
            *item.points[:, columns].T,
            color=OKABE_ITO["black"],
            ls=LINES[item.side == "stable"],
            lw=1.0,
            label=f"{item.side} manifold",
        )
        ax.plot(*np.array(item.fixed_point)[columns], "x", ms=7, mew=1.6, color=OKABE_ITO["black"])
    if over:
        ax.axis(limits)
    else:
        ax.set(xlabel="position x", ylabel="velocity ẋ")
    lines = {str(line.get_label()): line for line in ax.get_lines() if str(line.get_label()).endswith(" manifold")}
    patches: list[Any] = [] if known is None else list(known.legend_handles)
    names = [] if known is None else [text.get_text() for text in known.get_texts()]
    ax.legend([*patches, *lines.values()], [*names, *lines], **ABOVE, ncols=2, columnspacing=1.2)
    return ax


def lyapunov_plot(spectrum: LyapunovSpectrum, ax: Axes | None = None) -> Axes:
    """Draw the Lyapunov exponents over the time they are averaged over, a value a period, with their standard errors.

    Parameters
    ----------
    spectrum : from :func:`stickslip.lyapunov`.
    ax : axes to draw into; default a new figure.

    Returns
    -------
    The axes. An exponent of −inf has no curve but is named.
    """
    ax = axes(ax)
    times, running = spectrum.by_period()
    drawn = []
    for i, (value, error) in enumerate(zip(spectrum.exponents, spectrum.errors, strict=True)):
        colour = COLOURS[i % len(COLOURS)]
        text = f"$λ_{{{i + 1}}}$ = {value:.3g}".replace("-inf", "−∞").replace("-", "−")
        if not np.isfinite(value):
            ax.plot([], [], ls="", label=f"not drawn: {text}")
            continue
        ax.plot(times, running[:, i], color=colour, lw=1.0, label=f"{text} ± {error:.1g}")
        ax.axhspan(value - error, value + error, color=colour, alpha=0.2, lw=0)
        late = running[times > 0.05 * spectrum.t, i]
        drawn += [*late, value - error, value + error]
    # The first averages, of a few events, are far off.
    if drawn:
        margin = 0.15 * (max(drawn) - min(drawn)) or 0.1
        ax.set_ylim(min(drawn) - margin, max(drawn) + margin)
    ax.axhline(0, color=OKABE_ITO["grey"], lw=0.6, ls="--", zorder=0)
    ax.set(xlabel="time averaged over", ylabel="Lyapunov exponents (1/time)", xlim=(0, spectrum.t))
    ax.legend(**ABOVE)
    return ax
