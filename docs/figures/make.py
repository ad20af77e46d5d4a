"""Draw the pictures of the documentation anew: python docs/figures/make.py."""

import shutil
import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss
from stickslip import show
from stickslip.paper import figures

HERE = Path(__file__).parent

LAWS = {
    "coulomb": ss.laws.Coulomb(kinetic=0.6),
    "static-kinetic": ss.laws.StaticKinetic(break_away=1.0, kinetic=0.6),
    "piecewise-linear": ss.laws.PiecewiseLinear(nodes=[(0, 0.9), (0.2, 0.6), (0.6, 0.7)], break_away=1.0),
    "rational": ss.laws.Rational(break_away=1.0, weakening=3.0),
    "cubic": ss.laws.Cubic(static=1.0, linear=1.2, cubic=0.9),
    "exponential-stribeck": ss.laws.ExponentialStribeck(break_away=1.0, kinetic=0.5, scale=0.1, viscous=0.2),
    "popp-stelter": ss.laws.PoppStelter(break_away=0.4, kinetic=0.1, weakening=1.42, square=0.01),
    "dwell-time": ss.laws.DwellTime(kinetic=0.5, limit=0.5, rate=0.4),
    "force-rate": ss.laws.ForceRate(kinetic=0.5, limit=0.5, rate=0.4, force_rate_scale=0.3),
    "tabulated": ss.laws.Tabulated(
        kinetic=[(0, 0.9), (0.1, 0.7), (0.3, 0.6), (0.6, 0.65)], break_away=[(0, 0.9), (0.5, 1.0), (2, 1.1), (6, 1.15)]
    ),
    "two-branch": ss.laws.TwoBranch(rising=[(0, 1), (0.6, 0.7)], falling=[(0, 0.6), (0.6, 0.7)], break_away=1.0),
    "bogacz-ryczek": ss.laws.BogaczRyczek(),
}

#: With the amplitude of the motion that shows the law, and its angular frequency.
STATE_LAWS = {
    "dahl": (ss.laws.Dahl(stiffness=4.0, kinetic=1.0), 1.0, 1.0),
    "lu-gre": (ss.laws.LuGre(100.0, 2.0, 0.1, kinetic=1.0, break_away=1.5, scale=0.1), 0.1, 5.0),
    "elasto-plastic": (
        ss.laws.ElastoPlastic(100.0, 2.0, 0.1, kinetic=1.0, break_away=1.5, scale=0.1, elastic=0.8),
        0.1,
        5.0,
    ),
    "bouc-wen": (ss.laws.BoucWen(stiffness=4.0, beta=8.0, gamma=8.0, exponent=2.0), 1.0, 1.0),
    "regularised": (ss.laws.Regularised(ss.laws.Rational(1.0, 3.0), width=0.05), 0.5, 1.0),
}


def save(ax: plt.Axes, name: str) -> None:
    """Write a picture that is the same, byte for byte, as long as matplotlib is."""
    with plt.rc_context({"svg.hashsalt": "stickslip"}):
        # A date, or a version, would change the file without changing the picture.
        plain = {"Date": None, "Creator": None} if name.endswith(".svg") else {"Software": None}
        ax.figure.savefig(HERE / name, dpi=130, metadata=plain)
    plt.close(ax.figure)


def laws() -> None:
    """One picture per law; laws that remember their rest have a second panel."""
    for name, law in LAWS.items():
        dwells = law.break_away_force(1e9) > law.break_away_force(0.0)
        panels = show.new_axes(1, 2, figsize=(8.4, 2.9)) if dwells else show.new_axes(figsize=(3.8, 2.8))
        show.law_plot(law, panels[0], climbs=()) if name == "two-branch" else show.law_plot(law, panels[0])
        if dwells:
            show.break_away_plot(law, panels[1])
        save(panels[0], f"law-{name}.svg")


def state_laws() -> None:
    """Friction over displacement and over slip velocity in a motion to and fro, and in steady slip."""
    for name, (law, amplitude, frequency) in STATE_LAWS.items():
        t = np.linspace(0, 4 * np.pi / frequency, 40_001)
        x, w = amplitude * np.sin(frequency * t), amplitude * frequency * np.cos(frequency * t)
        force, _ = law.follow(t, w)
        panels = show.new_axes(1, 2, figsize=(8.4, 2.9))
        panels[0].plot(x, force, color="#0072b2")
        panels[0].set(xlabel="displacement $x$", ylabel="friction $F$")
        panels[1].plot(w, force, color="#0072b2", label="to and fro")
        steady = np.linspace(-w.max(), w.max(), 1000)
        panels[1].plot(steady, law.kinetic_force(steady), color="black", lw=1, ls="--", label="steady slip")
        panels[1].set(xlabel="slip velocity $w$", ylabel="friction $F$")
        panels[1].legend(fontsize=8, frameon=False)
        save(panels[0], f"law-{name}.svg")


def velocity_steps() -> None:
    """Rate and state: steps of the slip velocity from V₀ to 10 V₀ and back, with either evolution of the state."""
    speed = np.repeat([1.0, 10.0, 1.0], 2001)
    slip = np.concatenate([np.linspace(10 * i, 10 * (i + 1), 2001) for i in range(3)])
    t = np.concatenate([[0.0], np.cumsum(np.diff(slip) / speed[1:])])
    ax = show.new_axes(figsize=(4.6, 2.9))[0]
    for law, colour in (("aging", "#0072b2"), ("slip", "#d55e00")):
        friction = ss.laws.RateState(1.0, 0.01, 0.015, length=1.0, reference_velocity=1.0, law=law)
        ax.plot(slip, friction.follow(t, speed)[0], color=colour, label=law)
    ax.set(xlabel="slip in units of $L$", ylabel="$F/N$")
    ax.legend(fontsize=8, frameon=False)
    save(ax, "law-rate-state.svg")


def paper() -> None:
    """The paper's page with its figures, and the overview of the README."""
    save(figures.overview()[0], "overview.png")
    with tempfile.TemporaryDirectory() as folder:
        page = ss.paper.reproduce(folder)
        shutil.copytree(page.parent / "figures", HERE, dirs_exist_ok=True)
        shutil.copy(page.parent / "paper.md", HERE.parent)


if __name__ == "__main__":
    laws()
    state_laws()
    velocity_steps()
    paper()
