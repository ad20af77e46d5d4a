"""Draw the pictures of the documentation anew: python docs/figures/make.py."""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt

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
    "bogacz-ryczek": ss.laws.BogaczRyczek(),
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
        show.law_plot(law, panels[0])
        if dwells:
            show.break_away_plot(law, panels[1])
        save(panels[0], f"law-{name}.svg")


def paper() -> None:
    """The paper's figures and the overview of the README."""
    diagram = figures.drive_velocity_diagram()
    save(figures.overview(diagram)[0], "overview.png")
    save(figures.regimes(diagram), "fig-14-regimes.png")
    for name, draw in figures.FIGURES.items():
        if name != "fig-14-regimes":
            axes = draw()
            save(axes[0] if isinstance(axes, list) else axes, f"{name}.png")


if __name__ == "__main__":
    laws()
    paper()
