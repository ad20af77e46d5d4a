"""The figures of the law: static friction, the lines and their pencils, the fall after break-away."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.laws import BogaczRyczek
from stickslip.paper.default_calibration import END_OF_OSCILLATION, END_OF_STICK_SLIP, oscillator
from stickslip.paper.figures.motion import TITLE, loop, shades
from stickslip.show import BRANCH_COLOURS, OKABE_ITO, break_away_plot, friction_loop, new_axes
from stickslip.simulation.simulate import simulate

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Point = tuple[float, float]

_LINE = BRANCH_COLOURS
_GREY = OKABE_ITO["grey"]


def static_friction(law: BogaczRyczek | None = None) -> list[Axes]:
    """Fig. 2: the break-away force f_s(t_s, δ) over the stick time and, without rest, over the force rate.

    Parameters
    ----------
    law : default ours.

    >>> axes = static_friction()
    >>> axes[0].get_title()
    'with rest'
    >>> import matplotlib.pyplot as plt; plt.close(axes[0].figure)
    """
    law = law or BogaczRyczek()
    left, right = new_axes(1, 2, figsize=(7.6, 3.2), sharey=True)
    rates = (0.10, 0.25, 0.30, 0.35, 0.40)
    break_away_plot(law, left, force_rates=rates)
    for line, rate, colour in zip(left.lines, rates, shades(len(rates)), strict=True):
        line.set(color=colour, label=f"δ = {rate:.2f}")
    left.legend(fontsize=7, frameon=False, title="force rate", title_fontsize=7.5, ncols=3, loc="lower right")
    left.set_title("with rest", **TITLE)
    delta = np.linspace(0.05, 0.6, 400)
    right.plot(delta, law.break_away_force(0.0, delta), color=OKABE_ITO["blue"], label="$f_s(0, δ)$")
    slope, intercept = law.l
    s = np.linspace(0.33, 0.55, 2)
    right.plot(s, slope * s + intercept, color=_GREY, ls="--", lw=0.9, label="l at w = δ = s")
    for end, what, height in (
        (END_OF_STICK_SLIP, "end of stick-slip", 0.66),
        (END_OF_OSCILLATION, "end of the oscillation", 1.45),
    ):
        right.axvline(end, color=OKABE_ITO["black"], lw=0.6, ls=":")
        _note(right, what, (end, height), (2, 0), va="bottom", rotation=90, fontsize=7.5)
    right.legend(fontsize=8, frameon=False)
    right.margins(x=0)
    right.set(xlabel="force rate δ (dimensionless)", title="without rest")
    right.title.set_fontsize(TITLE["fontsize"])
    return [left, right]


def stick_slip_geometry(law: BogaczRyczek | None = None, ax: Axes | None = None) -> Axes:
    """Fig. 7: the lines after three break-aways, and the pencil B.

    Parameters
    ----------
    law : with B at a point and A and C at infinity, as in the paper; default ours.
    ax : axes to draw into; default a new figure.
    """
    law = law or BogaczRyczek()
    ax = ax or new_axes(figsize=(4.8, 4.2))[0]
    common, end = np.tan(np.radians(law.psi)), 0.62
    held = [law.break_away_force(0.0, 0.40), law.break_away_force(0.0, 0.30), law.break_away_force(4.0, 0.10)]
    for force in held:
        anchor = (law.beta, force - _fall(law, force))
        corner = _corner(law, anchor)
        ax.plot([0, anchor[0]], [force, anchor[1]], color=_LINE["fall"])
        ax.plot(*zip(anchor, corner, strict=True), color=_LINE["upper"])
        ax.plot([corner[0], end], [corner[1], corner[1] + common * (end - corner[0])], color=_LINE["common"])
        slope = (corner[1] - law.B[1]) / (corner[0] - law.B[0])
        at_zero = corner[1] - slope * corner[0]
        ax.plot([0, corner[0]], [at_zero, corner[1]], color=_LINE["lower"])
        ax.plot([law.B[0], 0], [law.B[1], at_zero], color=_LINE["lower"], lw=0.7, ls=":")
    names = ("$f_s(0, 0.40)$", "$f_s(0, 0.30)$", "$f_s(4, 0.10)$")
    for force, name in zip(held, names, strict=True):
        _note(ax, name, (0.0, force), (-4, 3), ha="right", va="bottom")
    w = np.array([0.22, 0.56])
    ax.plot(w, law.l[0] * w + law.l[1], color=_GREY, lw=0.9, ls="--")
    _note(ax, "l", (w[1], law.l[0] * w[1] + law.l[1]), (3, -2))
    _point(ax, law.B, f"B ({law.B[0]:g}; {law.B[1]:g})".replace("-", "−"), (2, 5))
    first = _corner(law, (law.beta, held[0]))
    _note(ax, "corner (w*; f*)", first, (4, -12))
    _note(ax, f"φ = {law.phi:g}°, ẇ > 0".replace("-", "−"), (0.17, held[1] - 0.19), (8, 8), color=_LINE["upper"])
    _note(ax, f"ψ = {law.psi:g}°", (0.46, first[1] + common * (0.46 - first[0])), (2, -12), color=_LINE["common"])
    _note(ax, "through B, ẇ < 0", (-0.29, law.B[1]), (0, -62), ha="center", color=_LINE["lower"])
    _fall_enlarged(law, ax, held[-1])
    ax.axvline(0, color=_GREY, lw=0.6, zorder=0)
    ax.set(xlabel="slip velocity w (dimensionless)", ylabel="friction f (dimensionless)", xlim=(-0.45, 0.66))
    return ax


def _fall_enlarged(law: BogaczRyczek, ax: Axes, force: float) -> None:
    """α and β of one break-away, too narrow to see beside the other lines, in an inset."""
    inset = ax.inset_axes((0.02, 0.70, 0.2, 0.28))
    below = force - _fall(law, force)
    inset.plot([0, law.beta], [force, below], color=_LINE["fall"])
    end = 3 * law.beta
    inset.plot([law.beta, end], [below, below + np.tan(np.radians(law.phi)) * (end - law.beta)], color=_LINE["upper"])
    arrow = {"arrowstyle": "<->", "lw": 0.6, "shrinkA": 0, "shrinkB": 0}
    inset.annotate("", (law.beta, force), (law.beta, below), arrowprops=arrow)
    inset.annotate("", (0, below), (law.beta, below), arrowprops=arrow)
    _note(inset, "α", (law.beta, (force + below) / 2), (4, -3))
    _note(inset, "β", (law.beta / 2, below), (-2, -10))
    inset.set(xlim=(0, end), ylim=(below - 0.35 * (force - below), force + 0.1 * (force - below)))
    inset.set_xticks([0, law.beta], labels=["0", f"{law.beta:g}"], fontsize=7)
    inset.set_yticks([])


def climbs(law: BogaczRyczek | None = None) -> list[Axes]:
    """Fig. 8: climbs towards D a) in successive periods, b) in the first period after different break-aways.

    Parameters
    ----------
    law : with the pencil D at a point; default ours.
    """
    law = law or BogaczRyczek()
    left, right = new_axes(1, 2, figsize=(8.2, 3.9), sharex=True, sharey=True)
    orbit = simulate(oscillator(0.30), 120.0)
    release = float(orbit.events["t"][orbit.events["kind"] == "release"].iloc[0])
    for number, colour in enumerate(shades(4)):
        w, force = loop(0.30, release + 10.8 * number, release + 10.8 * (number + 1))
        left.plot(w, force, color=colour, lw=1.1, label=f"period {number + 1}")
    left.set_title("a) s = 0.30, from rest", **TITLE)
    for x0, colour in zip((-0.6, 0.4, 1.0), shades(3), strict=True):
        start = simulate(oscillator(0.30), 40.0, x0=x0)
        table = start.events[start.events["kind"] == "release"]
        release, stick = float(table["t"].iloc[0]), float(table["stick_time"].iloc[0])
        w, force = loop(0.30, release, release + 12.5, x0=x0)
        right.plot(w, force, color=colour, lw=1.1, label=f"after a stick of {stick:.1f}")
    right.set_title("b) s = 0.30, the first period", **TITLE)
    for ax in (left, right):
        for line in list(ax.lines):
            w, force = (np.asarray(values, float) for values in line.get_data())
            turn = int(np.argmin(np.where(np.arange(w.size) > w.size // 3, w, np.inf)))
            top = turn + int(np.argmax(force[turn:]))
            if law.D is not None and w[top] < law.D[0]:
                ax.plot([w[top], law.D[0]], [force[top], law.D[1]], color=line.get_color(), lw=0.8, ls=":")
        if law.D is not None:
            _point(ax, law.D, f"D ({law.D[0]:.2f}; {law.D[1]:.2f})", (-78, -3))
        ax.legend(fontsize=7.5, frameon=False, loc="upper right")
        ax.set(xlabel="slip velocity w (dimensionless)", ylabel="friction f (dimensionless)")
        ax.label_outer()
    return [left, right]


def steep_climbs(law: BogaczRyczek | None = None, ax: Axes | None = None) -> Axes:
    """Fig. 9: climbs with the angle η, up to the end of the oscillation, and stable slip beyond it.

    Parameters
    ----------
    law : default ours; its η is named.
    ax : axes to draw into; default a new figure.
    """
    law = law or BogaczRyczek()
    ax = ax or new_axes(figsize=(4.6, 3.6))[0]
    for s in (0.36, 0.38, 0.39, 0.45):
        orbit = simulate(oscillator(s), 250.0)
        friction_loop(orbit, ax, transient=0.8, arrows=False, legend=s in (0.36, 0.45))
        w, force = loop(s, 234.0, 250.0)
        _note(ax, f"s = {s:.2f}", (float(w.max()), float(force[np.argmax(w)])), (6, -3), fontsize=7.5)
        if s < END_OF_OSCILLATION:
            turn = int(np.argmin(w))
            text = f"η = {law.eta:g}°" if s > 0.37 else "to D"
            _note(ax, text, (w[turn], force[turn]), (0, -11), ha="center", color=_LINE["climb"], fontsize=7.5)
    handles, names = ax.get_legend_handles_labels()
    named = dict(zip(names, handles, strict=True))
    ax.legend(named.values(), named.keys(), fontsize=8, frameon=False, loc="lower left")
    w = np.array([0.36, 0.46])
    ax.plot(w, law.l[0] * w + law.l[1], color=_GREY, lw=0.9, ls="--")
    _note(ax, "l", (w[1], law.l[0] * w[1] + law.l[1]), (3, -2))
    ax.set(xlabel="slip velocity w (dimensionless)", ylabel="friction f (dimensionless)", xlim=(0.25, 0.55))
    return ax


def fall_after_break_away(law: BogaczRyczek | None = None, ax: Axes | None = None) -> Axes:
    """Fig. 11: α over static friction.

    Parameters
    ----------
    law : default ours.
    ax : axes to draw into; default a new figure.
    """
    law = law or BogaczRyczek()
    ax = ax or new_axes()[0]
    low, high = law.break_away_force(0.0, 0.40), law.break_away_force(30.0, 0.05)
    force = np.linspace(low, high, 301)
    ax.plot(force, [_fall(law, float(f)) for f in force], color=OKABE_ITO["blue"])
    for s in (END_OF_OSCILLATION, END_OF_STICK_SLIP):
        at = law.break_away_force(0.0, s)
        ax.axvline(at, color=_GREY, lw=0.7, ls=":")
        _note(ax, f"$f_s(0, {s:.2f})$", (at, ax.get_ylim()[1]), (-3, -4), ha="right", va="top", rotation=90)
    ax.set(xlabel="static friction $f_s$ (dimensionless)", ylabel="fall α (dimensionless)", xlim=(low - 0.1, None))
    return ax


def _fall(law: BogaczRyczek, force: float) -> float:
    """α(f_s)."""
    if isinstance(law.alpha, float | int):
        return float(law.alpha)
    return float(np.interp(force, *np.transpose(law.alpha)))


def _corner(law: BogaczRyczek, anchor: Point) -> Point:
    falling, (rise, intercept) = np.tan(np.radians(law.phi)), law.l
    w = (anchor[1] - falling * anchor[0] - intercept) / (rise - falling)
    return w, rise * w + intercept


def _point(ax: Axes, at: Point, text: str, offset: Point) -> None:
    ax.plot(*at, "o", ms=4, color=OKABE_ITO["black"], zorder=4)
    _note(ax, text, at, offset)


def _note(ax: Axes, text: str, at: Point, offset: Point, **options: Any) -> None:
    ax.annotate(text, at, offset, textcoords="offset points", **{"fontsize": 8, **options})
