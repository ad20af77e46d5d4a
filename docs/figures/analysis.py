"""Draw the pictures of docs/how-to/diagrams.md and that of manifolds anew, all or some: python docs/figures/analysis.py maps.

All take some minutes.
"""

import sys

import matplotlib

matplotlib.use("Agg")

import numpy as np
from make import save

import stickslip as ss
from stickslip import show
from stickslip.show.canvas import ABOVE

MASS = ss.Oscillator(
    damping=0.05, drive_velocity=0.3, law=ss.laws.StaticKinetic(1.0, 0.5), forcing=ss.Harmonic(0.5, 1.3)
)
FALLING = ss.laws.PiecewiseLinear(nodes=[(0.0, 1.0), (1.0, 0.6), (2.0, 0.8)], break_away=1.0)


def sections() -> None:
    """A chaotic motion in three sections of different kinds."""
    period = 2 * np.pi / 1.3
    panels = show.new_axes(1, 3, figsize=(9.2, 3.3))
    show.section_plot(ss.section(MASS, t_end=20_000 * period, transient=0.1), panels[0])
    releases = ss.section(MASS, "release", t_end=10_000 * period, transient=0.1)
    show.section_plot(releases, panels[1], across="phase", up="stick_time")
    show.return_map_plot(ss.release_map(MASS, np.linspace(0, 2 * np.pi, 3000)), panels[2], colour=show.OKABE_ITO["sky"])
    show.return_map_plot(ss.return_map(releases, "phase"), panels[2], colour=show.OKABE_ITO["vermilion"])
    dots = [line for line in panels[2].lines if line.get_marker() == "o"]
    panels[2].legend(dots, ["release map", "visited"], **ABOVE, ncols=2, markerscale=3)
    save(panels[0], "analysis-sections.png")


def diagrams() -> None:
    """The paper's oscillator and the forced belt, swept both ways and from fresh starts."""
    panels = show.new_axes(1, 2, figsize=(8.4, 3.8))
    around = ss.orbit_diagram(
        ss.paper.oscillator(0.3),
        "drive_velocity",
        np.linspace(0.20, 0.45, 251),
        direction=("up", "down", "fresh"),
        periods=400,
        keep=40,
    )
    show.orbit_diagram_plot(around, panels[0])
    forced = ss.orbit_diagram(
        MASS,
        "forcing.frequency",
        np.linspace(0.4, 2.2, 451),
        direction=("up", "down", "fresh"),
        periods=360,
        keep=60,
    )
    show.orbit_diagram_plot(forced, panels[1], quantity="section")
    save(panels[0], "analysis-diagrams.png")


def maps() -> None:
    """Regime, period and amplitude of the forced belt."""
    over = {"forcing.amplitude": np.linspace(0.0, 1.6, 161), "forcing.frequency": np.linspace(0.3, 2.3, 161)}
    chart = ss.regime_map(MASS, over, transient=200)
    panels = show.new_axes(1, 3, figsize=(8.4, 3.8))
    for ax, quantity in zip(panels, ("regime", "period", "amplitude"), strict=True):
        show.regime_map_plot(chart, ax, quantity=quantity)
    save(panels[0], "analysis-maps.png")


def basins() -> None:
    """Two basins that coexist: slip that rests and stick-slip around it."""
    belt = ss.Oscillator(damping=0.0, drive_velocity=1.2, law=FALLING)
    result = ss.basins(belt, x=np.linspace(-1.5, 2.8, 215), v=np.linspace(-2.2, 2.2, 221), transient=200)
    save(show.basins_plot(result), "analysis-basins.png")


def manifolds() -> None:
    """A saddle between stick-slip and slip of a forced belt, and its manifolds."""
    law = ss.laws.ExponentialStribeck(break_away=1.0, kinetic=0.5, scale=0.3, viscous=0.1)
    belt = ss.Oscillator(damping=0.1, drive_velocity=1.0, law=law, forcing=ss.Harmonic(0.1, 0.9))
    branches = ss.continuation(belt, "forcing.frequency", (0.8, 0.96), seeds=0).branches
    saddle = max((orbit for branch in branches for orbit in branch.orbits), key=lambda orbit: orbit.largest)
    ax = show.basins_plot(
        ss.basins(saddle.system, x=np.linspace(-1.5, 2.5, 101), v=np.linspace(-2, 2, 101), transient=100)
    )
    curves = [ss.manifold(saddle, side, length=length) for side, length in (("stable", 8.0), ("unstable", 4.0))]
    save(show.manifold_plot(curves, ax), "manifolds.png")


if __name__ == "__main__":
    parts = {part.__name__: part for part in (sections, diagrams, maps, basins, manifolds)}
    for name in sys.argv[1:] or parts:
        parts[name]()
