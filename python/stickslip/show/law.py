"""A friction law: its force over slip velocity, and its break-away force over stick time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from stickslip.errors import InputError
from stickslip.laws import (
    Asymmetric,
    BogaczRyczek,
    ForceRate,
    Law,
    PiecewiseLinear,
    PiecewisePolynomial,
    Tabulated,
    TwoBranch,
    force_along,
)
from stickslip.laws.bands import Likely, long_rest
from stickslip.show.canvas import COLOURS, OKABE_ITO, axes, label

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def law_plot(
    law: Law,
    ax: Axes | None = None,
    *,
    w_max: float | None = None,
    climbs: Sequence[float] = (0.25, 0.6),
    legend: bool = True,
    units: str = "dimensionless",
    rests: tuple[float, float] | None = None,
) -> Axes:
    """Draw the friction force over the slip velocity: while |w| grows after a break-away, while it falls, and at rest.

    Parameters
    ----------
    law : any law.
    ax : axes to draw into; default a new figure.
    w_max : the largest slip velocity; default 1.5 times the last node of a table, 0.6 for the paper's law, else 1.
    climbs : where a law with branches is led from the falling back to the rising branch, as fractions of the slip
        velocity where they meet.
    legend : whether the curves are named.
    units : ``"dimensionless"``, ``"SI"`` or ``"torsional"``.
    rests : stick times of the two break-aways; default none and a long one.

    Returns
    -------
    The axes. The dot is the break-away force at stick time zero; a bar above it reaches to the break-away force after
    a long rest at a vanishing force rate, or both are those after `rests`. Of a law with a covariance (from a fit or a
    law file) shades are 95 % bands as of :func:`~stickslip.laws.friction_table`: of the kinetic force at each w
    while |w| grows, and, at w = 0, of the break-away force after the shorter rest.
    """
    ax = axes(ax)
    top = _reach(law) if w_max is None else w_max
    w = np.linspace(0, top, 1201)
    there = np.concatenate([w, w[::-1][1:]])
    replay = _replay(law, there)
    rising, falling = replay[: w.size], replay[w.size - 1 :][::-1]
    # At w = 0 the replay sticks: what follows at once is the kinetic force.
    rising[0], falling[0] = 2 * rising[1] - rising[2], 2 * falling[1] - falling[2]
    likely = _likely(law)
    short, long = (0.0, 10 * long_rest(law)) if rests is None else rests
    second = "" if units == "dimensionless" else " s"
    after = ("no rest", "long rest") if rests is None else (f"rest of {rest:.2g}{second}" for rest in rests)
    after_short, after_long = (f"break-away, {rest}" for rest in after)
    if likely is not None:
        _shade(ax, w[1:], *likely.band(lambda one: _replay(one, w)[1:]))
        low, high = likely.band(lambda one: np.asarray(one.break_away_force(short)))
        ax.plot([0, 0], [low, high], color=OKABE_ITO["green"], lw=6, alpha=0.3, solid_capstyle="butt", clip_on=False)
    apart = np.abs(rising - falling) > 1e-9 * np.abs(rising).max()
    if apart.any():
        ax.plot(w, rising, color=OKABE_ITO["vermilion"], label="ẇ > 0, after break-away")
        ax.plot(w, falling, color=OKABE_ITO["blue"], label="ẇ < 0")
        meet = w[np.flatnonzero(apart)[-1]]
        ax.plot(w[w >= meet], rising[w >= meet], color=OKABE_ITO["black"], label="both")
        for i, fraction in enumerate(climbs):
            low = fraction * meet
            back = np.concatenate([w, w[(w > low) & (w < top)][::-1], w[w >= low]])
            force, count = _replay(law, back), int((w >= low).sum())
            again = force[-count:]
            name = "ẇ > 0, after ẇ < 0" if i == 0 else None
            ax.plot(w[w >= low], again, color=OKABE_ITO["orange"], lw=1.0, ls="--", label=name)
    else:
        ax.plot(w, rising, color=OKABE_ITO["black"], label="kinetic")
    if isinstance(law, Asymmetric):
        back = -law.kinetic_force(-w[1:])
        ax.plot(w[1:], back, color=OKABE_ITO["black"], ls="--", label="kinetic, w < 0, shown as −F(−w)")
        rising = np.maximum(rising, back.max())
        ax.plot(0, law.break_away_force(0.0, -1e-300), "s", color=OKABE_ITO["green"], ms=4, clip_on=False, zorder=3)
    weakest, strongest = law.break_away_force(short), law.break_away_force(long)
    ax.plot(
        [0, 0],
        [0, weakest],
        color=OKABE_ITO["grey"],
        lw=2.2,
        solid_capstyle="butt",
        label="at rest: |F| ≤ $f_s$",
        zorder=1.5,
    )
    if strongest > weakest * (1 + 1e-12):
        ax.plot([0, 0], [weakest, strongest], color=OKABE_ITO["grey"], lw=2.2, ls=(0, (1, 0.6)), zorder=1.5)
        ax.plot(0, strongest, "o", mfc="white", mec=OKABE_ITO["green"], ms=5, clip_on=False, label=after_long)
    ax.plot(0, weakest, "o", color=OKABE_ITO["green"], ms=5, clip_on=False, label=after_short, zorder=3)
    ax.set_xlim(-0.02 * top, top)
    ax.set_ylim(0, 1.08 * max(strongest, rising.max()))
    if legend:
        many = len(ax.get_legend_handles_labels()[0]) > 4
        ax.legend(fontsize=7, frameon=False, ncols=2 if many else 1, columnspacing=0.8, handlelength=1.6)
    ax.set(xlabel=label("slip velocity w", "velocity", units), ylabel=label("friction F", "force", units))
    return ax


def break_away_plot(
    law: Law,
    ax: Axes | None = None,
    *,
    stick_times: Sequence[float] | None = None,
    force_rates: Sequence[float] | None = None,
    units: str = "dimensionless",
) -> Axes:
    """Draw the break-away force over the stick time, one curve per force rate.

    Parameters
    ----------
    law : any law; one without dwell gives a level line.
    ax : axes to draw into; default a new figure.
    stick_times : default a grid over the time in which the law's break-away force grows.
    force_rates : default a few for a law that feels them, else one.
    units : ``"dimensionless"``, ``"SI"`` or ``"torsional"``.

    Returns
    -------
    The axes. Of a law with a covariance (from a fit or a law file) shades are
    95 % bands as of :func:`~stickslip.laws.friction_table`, at each stick time.
    """
    ax = axes(ax)
    surface = law.static_friction if isinstance(law, BogaczRyczek) else law if isinstance(law, ForceRate) else None
    if stick_times is None:
        stick_times = np.linspace(0.0, long_rest(law), 301).tolist()
    scale = None if surface is None else surface.force_rate_scale
    if force_rates is None:
        force_rates = (0.0,) if scale is None else tuple(scale * f for f in (0.2, 0.5, 1.0, 2.0))
    likely = _likely(law)
    times = np.asarray(stick_times, float)

    def at_rest(rate: float) -> Callable[[Law], np.ndarray]:
        return lambda one: np.asarray(one.break_away_force(times, rate))

    for i, rate in enumerate(force_rates):
        name = f"δ = {rate:.3g}" if scale is not None else None
        force = law.break_away_force(np.asarray(stick_times, float), rate)
        ax.plot(stick_times, force, color=COLOURS[i % len(COLOURS)], label=name)
        if likely is not None:
            low, high = likely.band(at_rest(rate))
            _shade(ax, times, low, high, COLOURS[i % len(COLOURS)])
    if scale is not None:
        ax.legend(fontsize=8, frameon=False, title="force rate", title_fontsize=8)
    ax.margins(x=0)
    ax.set(xlabel=label("stick time $t_s$", "time", units), ylabel=label("break-away force $f_s$", "force", units))
    return ax


def _likely(law: Law) -> Likely | None:
    """The laws that may as well be; None where the law has no covariance, or none of which a band can be made."""
    try:
        return Likely.of(law)
    except InputError:
        return None


def _shade(ax: Axes, x: np.ndarray, low: np.ndarray, high: np.ndarray, color: str = OKABE_ITO["black"]) -> None:
    ax.fill_between(x, low, high, color=color, alpha=0.15, lw=0, label="95 % band", zorder=1)


def _reach(law: Law) -> float:
    if isinstance(law, PiecewiseLinear | PiecewisePolynomial):
        return 1.5 * law.nodes[-1][0]
    tables: tuple[object, ...] = ()
    if isinstance(law, Tabulated):
        tables = (law.kinetic,)
    elif isinstance(law, TwoBranch):
        tables = (law.rising, law.falling)
    last = [float(table[-1][0]) for table in tables if isinstance(table, tuple) and table[-1][0] > 0]
    if last:
        return 1.5 * max(last)
    return 0.6 if isinstance(law, BogaczRyczek) else 1.0


def _replay(law: Law, w: np.ndarray) -> np.ndarray:
    """Friction along a slip velocity that starts with a release at stick time zero."""
    stuck = np.arange(w.size) == 0
    force: np.ndarray = force_along(law, np.zeros_like(w), w, stuck)
    return force
