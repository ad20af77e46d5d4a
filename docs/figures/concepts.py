"""Draw the pictures of the concepts: python docs/figures/make.py concepts. Each function gives the axes of one."""

import warnings

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

import stickslip as ss
from stickslip import show
from stickslip.identification import friction_of_orbit
from stickslip.show.canvas import ABOVE, MODE_COLOURS, OKABE_ITO, SPEED_COLOURS


def automaton() -> plt.Axes:
    """The modes of one contact, and what leads from each to the others."""
    (ax,) = show.new_axes(figsize=(7.2, 3.3))
    ax.set(xlim=(0, 10), ylim=(-0.4, 4.4))
    ax.axis("off")
    modes = {
        "stick": (5.0, 3.45, "stick\n$w = 0$"),
        "slip_backward": (1.6, 0.6, "slip backward\n$w < 0$"),
        "slip_forward": (8.4, 0.6, "slip forward\n$w > 0$"),
    }
    for name, (x, y, words) in modes.items():
        box = FancyBboxPatch((x - 1.15, y - 0.45), 2.3, 0.9, boxstyle="round,pad=0.1", fc="white", lw=2.0)
        box.set_edgecolor(MODE_COLOURS[name])
        ax.add_patch(box)
        ax.text(x, y, words, ha="center", va="center", color=MODE_COLOURS[name], weight="bold")
    arrows = (
        ((6.3, 3.4), (8.9, 1.2), -0.25, (8.75, 2.75), "release:\nforce reaches $f_s$", "left"),
        ((7.7, 1.2), (5.7, 2.9), -0.2, (5.0, 2.05), "capture: $w$ reaches 0,\n|F| needed to\nstick ≤ $f_s$", "center"),
        ((3.7, 3.4), (1.1, 1.2), 0.25, (1.25, 2.75), "release:\nforce reaches $-f_s$", "right"),
        ((2.3, 1.2), (4.3, 2.9), 0.2, (5.0, 2.05), "", "center"),
        ((7.1, 0.75), (2.9, 0.75), 0.0, (5.0, 0.95), "crossing: $w$ reaches 0, |F| needed to stick > $f_s$", "center"),
        ((2.9, 0.45), (7.1, 0.45), 0.0, (5.0, 0.05), "", "center"),
    )
    for start, end, bend, (x, y), words, side in arrows:
        way = FancyArrowPatch(start, end, connectionstyle=f"arc3,rad={bend}", arrowstyle="-|>", mutation_scale=12)
        ax.add_patch(way)
        ax.text(x, y, words, ha=side, va="center", fontsize=8)
    return ax


def guard() -> plt.Axes:
    """The search for the first root of a guard: every step is bounded from below, so that none is passed."""

    def of(t: np.ndarray) -> np.ndarray:
        return 0.47 + 0.5 * np.cos(t) + 0.08 * np.cos(3 * t + 0.6)

    def rate(t: float) -> float:
        return -0.5 * np.sin(t) - 0.24 * np.sin(3 * t + 0.6)

    most = 0.5 + 0.72  # of |g''|
    (ax,) = show.new_axes(figsize=(7.2, 3.2))
    t = np.linspace(0.0, 4.6, 800)
    ax.axhline(0, color="0.6", lw=0.8)
    ax.plot(t, of(t), color=OKABE_ITO["black"], label="guard g")
    now = 0.0
    for number in range(40):
        value, slope = of(now), rate(now)
        step = (slope + np.sqrt(slope**2 + 2 * most * value)) / most
        way = np.linspace(0.0, step, 60)
        bound = value + slope * way - most * way**2 / 2
        name = "bound from below" if number == 0 else None
        ax.plot(now + way, bound, color=OKABE_ITO["blue"], lw=1.0, label=name)
        ax.plot([now + step] * 2, [0.0, of(now + step)], ":", color=OKABE_ITO["blue"], lw=0.8)
        now += step
        if of(now) < 5e-3:
            break
    ax.plot(now, 0.0, "o", color=OKABE_ITO["vermilion"], label="first root")
    samples = np.arange(0.0, 4.6, 1.2)
    ax.plot(samples, of(samples), "s", mfc="white", color=OKABE_ITO["grey"], label="samples, all of one sign")
    ax.set(xlabel="time t since the last event (dimensionless)", ylabel="guard g (dimensionless)")
    ax.legend(**ABOVE, ncols=4)
    return ax


def selection() -> plt.Axes:
    """What a contact at w = 0 does under the force that sticking would need, and on two branches."""
    left, right = show.new_axes(1, 2, figsize=(8.4, 3.0))
    for name, low, high in (("slip_backward", -2.0, -1.0), ("stick", -1.0, 1.0), ("slip_forward", 1.0, 2.0)):
        left.axvspan(low, high, color=MODE_COLOURS[name], alpha=0.16, lw=0)
        words = name.replace("_", "s\n").replace("stick", "sticks")
        left.text((low + high) / 2, 0.5, words, ha="center", va="center", color=MODE_COLOURS[name], weight="bold")
    left.set(xlim=(-2, 2), ylim=(0, 1), yticks=[], xlabel="force that sticking needs / $f_s$")
    left.spines["left"].set_visible(False)
    w = np.array([0.0, 1.0])
    for name, first, last in (("|w| grows", 1.0, 0.7), ("|w| falls", 0.75, 0.55)):
        right.plot(w, [first, last], color=SPEED_COLOURS[name], lw=2.0, label=name)
        turn = 1 if name == "|w| grows" else -1
        middle, rise = 0.5, (last - first) * 0.06
        at = first + (last - first) * middle
        right.annotate(
            "", (middle + 0.06 * turn, at + rise * turn), (middle, at),
            arrowprops={"arrowstyle": "-|>", "color": SPEED_COLOURS[name], "mutation_scale": 22},
        )  # fmt: skip
    right.plot([0.8, 0.8], [0.59, 0.76], ":", color="0.4")
    right.text(0.82, 0.675, "ẇ = 0", va="center", fontsize=8)
    right.set(xlabel="slip velocity w (dimensionless)", ylabel="kinetic force (dimensionless)", ylim=(0.4, 1.1))
    right.legend(**ABOVE, ncols=2)
    return left


def memory() -> plt.Axes:
    """Break-aways of one law at several drive velocities: each lies on the curve, at its own stick time."""
    (ax,) = show.new_axes(figsize=(5.6, 3.2))
    law = ss.laws.DwellTime(kinetic=0.5, limit=0.5, rate=0.4)
    rest = np.linspace(0.0, 12.0, 200)
    ax.plot(rest, law.break_away_force(rest), color="black", label="$f_s(t_s)$ of the law")
    for number, s in enumerate((0.1, 0.15, 0.2, 0.3)):
        orbit = ss.simulate(ss.Oscillator(damping=0.05, drive_velocity=s, law=law), 200)
        last = orbit.events.query("kind == 'release'").iloc[-1]
        name = "break-aways at four drive velocities" if number == 0 else None
        ax.plot(last["stick_time"], last["force"], "o", color=OKABE_ITO["green"], label=name)
        ax.annotate(f"s = {s:g}", (last["stick_time"], last["force"]), (8, -10), textcoords="offset points", fontsize=8)
    ax.set(xlabel="stick time $t_s$ (dimensionless)", ylabel="break-away force $f_s$ (dimensionless)", xlim=(0, 12))
    ax.legend(**ABOVE)
    return ax


def intervals() -> plt.Axes:
    """Forty repetitions of one experiment, each with its interval."""
    (ax,) = show.new_axes(figsize=(7.2, 2.8))
    law = ss.laws.StaticKinetic(1.0, 0.6)
    orbit = ss.simulate(ss.Oscillator(damping=0.05, drive_velocity=0.2, law=law), 260)
    time, misses = np.arange(60, 260, 0.2), 0
    for seed in range(40):
        friction = friction_of_orbit(orbit, time, force_noise=0.02, seed=seed)
        with warnings.catch_warnings(action="ignore"):
            row = ss.identify(friction, law="StaticKinetic").parameters.loc["kinetic"]
        holds = row["low"] <= law.kinetic <= row["high"]
        misses += not holds
        colour = OKABE_ITO["blue" if holds else "vermilion"]
        ax.plot([seed + 1] * 2, [row["low"], row["high"]], color=colour)
        ax.plot(seed + 1, row["value"], "o", ms=3, color=colour)
    ax.axhline(law.kinetic, color="black", lw=0.8)
    ax.set(xlabel="repetition", ylabel="kinetic force (dimensionless)")
    ax.set_title(f"{40 - misses} of 40 contain the truth", fontsize=9)
    return ax


PICTURES = (automaton, guard, selection, memory, intervals)
