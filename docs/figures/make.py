"""Draw the pictures of the documentation anew: python docs/figures/make.py, or some of them: … make.py laws paper."""

import contextlib
import re
import shutil
import sys
import tempfile
from dataclasses import replace
from itertools import chain
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr

import stickslip as ss
from stickslip import show
from stickslip.examples import copy_example
from stickslip.laws.state_law import StateLaw
from stickslip.show.canvas import ABOVE, MODE_COLOURS, OKABE_ITO

HERE = Path(__file__).parent

#: Amplitude and angular frequency of the motion to and fro that shows a law with a state.
MOTIONS = {"LuGre": (0.1, 5.0), "ElastoPlastic": (0.1, 5.0), "Regularised": (0.5, 1.0)}


def save(ax: plt.Axes, name: str) -> None:
    """Write a picture that is the same, byte for byte, as long as matplotlib is."""
    with plt.rc_context({"svg.hashsalt": "stickslip"}):
        # A date, or a version, would change the file without changing the picture.
        plain = {"Date": None, "Creator": None} if name.endswith(".svg") else {"Software": None}
        ax.get_figure(root=True).savefig(HERE / name, dpi=130, metadata=plain)
    plt.close(ax.get_figure(root=True))


def picture(law: type[ss.laws.Law]) -> str:
    """The name of a law's picture, law-bouc-wen.svg of BoucWen."""
    return f"law-{re.sub('(?<!^)(?=[A-Z])', '-', law.__name__).lower()}.svg"


def _zigzag(ax: plt.Axes, left: float, right: float, y: float) -> None:
    """A spring from left to right."""
    ends = np.array([0.0, 0.15, 0.85, 1.0])
    coil = np.linspace(0.15, 0.85, 9)
    x = np.concatenate([ends[:1], coil, ends[-1:]])
    up = np.concatenate([[0.0, 0.0], np.tile([1.0, -1.0], 4)[:7], [0.0, 0.0]])
    ax.plot(left + (right - left) * x, y + 0.07 * up, color="black", lw=1.2)


def _dashpot(ax: plt.Axes, left: float, right: float, y: float) -> None:
    """A damper from left to right."""
    middle = (left + right) / 2
    ax.plot([left, middle - 0.12], [y, y], color="black", lw=1.2)
    ax.plot(
        [middle + 0.12, middle - 0.12, middle - 0.12, middle + 0.12],
        [y + 0.08, y + 0.08, y - 0.08, y - 0.08],
        "k",
        lw=1.2,
    )
    ax.plot([middle, middle], [y - 0.06, y + 0.06], color="black", lw=2.0)
    ax.plot([middle, right], [y, y], color="black", lw=1.2)


def setups() -> None:
    """The two ways round of one oscillator: a mass on a moving drive, and a slider pulled through its spring."""
    left, right = show.new_axes(1, 2, figsize=(8.4, 3.0))
    for ax, title in ((left, "a mass on a moving drive"), (right, "a slider pulled through its spring")):
        ax.set(xlim=(-0.3, 3.3), ylim=(-0.75, 1.3), title=title)
        ax.set_aspect("equal")
        ax.axis("off")
    arrow = {"arrowstyle": "-|>", "lw": 1.4, "color": MODE_COLOURS["slip_forward"]}
    words = {"color": MODE_COLOURS["slip_forward"], "ha": "center"}
    force = {"arrowstyle": "-|>", "lw": 1.8, "color": OKABE_ITO["green"]}
    for ax, wall, near, far, body in ((left, 0.0, 0.0, 1.3, 1.3), (right, 2.9, 1.3, 2.9, 0.5)):
        ax.plot([wall, wall], [0.12, 0.85], color="black", lw=3)
        _zigzag(ax, near, far, 0.6)
        _dashpot(ax, near, far, 0.25)
        ax.text((near + far) / 2, 0.72, "k", ha="center")
        ax.text((near + far) / 2 + 0.3, 0.31, "D", ha="center")
        ax.add_patch(plt.Rectangle((body, 0.05), 0.8, 0.7, fc="0.9", ec="black", lw=1.2))
        ax.text(body + 0.4, 0.36, "m", ha="center")
    # The wall is fixed, the drive below it moves: hatched is what is at rest, and between the two is a gap.
    left.add_patch(plt.Rectangle((-0.14, 0.12), 0.14, 0.73, fc="none", ec="0.4", hatch="////", lw=0))
    left.text(-0.07, 0.95, "fixed", ha="center")
    left.plot([0.45, 3.2], [0.0, 0.0], color="black", lw=2)
    right.plot([-0.2, 2.6], [0.0, 0.0], color="black", lw=2)
    right.add_patch(plt.Rectangle((-0.2, -0.14), 2.8, 0.14, fc="none", ec="0.4", hatch="////", lw=0))
    left.annotate("", (3.1, -0.2), (2.4, -0.2), arrowprops=arrow)
    left.text(2.75, -0.5, "drive, velocity s", **words)
    left.annotate("", (2.1, 1.0), (1.3, 1.0), arrowprops=arrow)
    left.text(1.7, 1.07, "x", **words)
    right.annotate("", (3.2, 1.0), (2.6, 1.0), arrowprops=arrow)
    right.text(2.7, 1.07, "stage, velocity s", **words)
    right.annotate("", (1.3, 1.0), (0.5, 1.0), arrowprops=arrow)
    right.text(0.9, 1.07, "position X, velocity w", **words)
    right.text(0.1, -0.66, "guideway, at rest", ha="left")
    right.text(2.3, -0.66, "x: stretch of the spring", ha="center")
    # Friction on the mass has the sense of w = s - x': on the drive forwards, on a slider that is pulled forwards backwards.
    left.annotate("", (2.05, -0.2), (1.35, -0.2), arrowprops=force)
    left.text(1.7, -0.5, "F", color=OKABE_ITO["green"], ha="center")
    left.text(1.5, -0.75, "w = s − ẋ", ha="center")
    right.annotate("", (0.55, -0.28), (1.25, -0.28), arrowprops=force)
    right.text(1.4, -0.34, "F", color=OKABE_ITO["green"], ha="left")
    save(left, "setups.svg")


def laws() -> None:
    """One picture per law: its example, and a second panel where it remembers its rest or has a state."""
    for kind in ss.laws.Law.ALL.values():
        law = kind.example()
        if isinstance(law, ss.laws.RateState):
            ax = velocity_steps()
        elif isinstance(law, StateLaw):
            ax = to_and_fro(law)
        else:
            dwells = law.break_away_force(1e9) > law.break_away_force(0.0)
            panels = show.new_axes(1, 2, figsize=(8.4, 2.9)) if dwells else show.new_axes(figsize=(3.8, 2.8))
            ax = show.law_plot(law, panels[0], climbs=() if isinstance(law, ss.laws.TwoBranch) else (0.25, 0.6))
            if dwells:
                show.break_away_plot(law, panels[1])
        save(ax, picture(kind))


def to_and_fro(law: StateLaw) -> plt.Axes:
    """Friction over displacement and over slip velocity in a harmonic motion, and in steady slip."""
    amplitude, frequency = MOTIONS.get(type(law).__name__, (1.0, 1.0))
    t = np.linspace(0, 4 * np.pi / frequency, 40_001)
    x, w = amplitude * np.sin(frequency * t), amplitude * frequency * np.cos(frequency * t)
    force, _ = law.follow(t, w)
    panels = show.new_axes(1, 2, figsize=(8.4, 2.9))
    panels[0].plot(x, force, color="#0072b2")
    panels[0].set(xlabel="displacement $x$ (dimensionless)", ylabel="friction $F$ (dimensionless)")
    panels[1].plot(w, force, color="#0072b2", label="to and fro")
    steady = np.linspace(-w.max(), w.max(), 1000)
    panels[1].plot(steady, law.kinetic_force(steady), color="black", lw=1, ls="--", label="steady slip")
    panels[1].set(xlabel="slip velocity $w$ (dimensionless)", ylabel="friction $F$ (dimensionless)")
    panels[1].legend(**ABOVE, ncols=2)
    return panels[0]


def velocity_steps() -> plt.Axes:
    """Rate and state: steps of the slip velocity from V₀ to 10 V₀ and back, with either evolution of the state."""
    speed = np.repeat([1.0, 10.0, 1.0], 2001)
    slip = np.concatenate([np.linspace(10 * i, 10 * (i + 1), 2001) for i in range(3)])
    t = np.concatenate([[0.0], np.cumsum(np.diff(slip) / speed[1:])])
    ax = show.new_axes(figsize=(4.6, 2.9))[0]
    for law, colour in (("aging", "#0072b2"), ("slip", "#d55e00")):
        friction = replace(ss.laws.RateState.example(), law=law)
        ax.plot(slip, friction.follow(t, speed)[0], color=colour, label=law)
    ax.set(xlabel="slip in units of $L$", ylabel="friction over normal force $F/N$")
    ax.legend(**ABOVE, ncols=2)
    return ax


def branches() -> None:
    """Cycles over the drive velocity, followed through their sliding bifurcations, of two calibrations of the paper's law."""
    panels = show.new_axes(2, 2, figsize=(8.4, 6.4))
    for name, column in zip(("one f_s(0)", "default"), (panels[::2], panels[1::2]), strict=True):
        oscillator = ss.paper.calibration.CALIBRATIONS[name].oscillator(0.2)
        result = ss.continuation(oscillator, "drive_velocity", (0.1, 0.5), seeds=4)
        low, high = (0.2475, 0.2545) if name == "one f_s(0)" else (0.2488, 0.2512)
        for ax, bounds in zip(column, ((0.1, 0.5), (low, high)), strict=True):
            show.branches_plot(replace(result, bounds=bounds), ax)
            ax.legend(fontsize=8, frameon=False, loc="lower right" if name != "default" else "upper right")
        column[1].get_legend().remove()
        column[0].set_title(f"calibration: {name}", fontsize=10)
        column[1].set_title("the same near the end of stick-slip", fontsize=10)
    save(panels[0], "branches.png")


def loci() -> None:
    """Where motions of the forced slider change their kind over amplitude and frequency, and the cubic law's curves."""
    panels = show.new_axes(1, 2, figsize=(8.4, 3.6))
    law, forcing = ss.laws.StaticKinetic(1.0, 0.4), ss.Harmonic(0.35, 1.8)
    slider = ss.Oscillator(damping=0.0, drive_velocity=0.3, law=law, forcing=forcing)
    over, bounds = ("forcing.amplitude", "forcing.frequency"), ((0.05, 0.55), (1.65, 1.9))
    result = ss.continuation(slider, "forcing.amplitude", (0.05, 0.55), seeds=0)
    curves = [ss.locus(point, over, bounds) for point in result.special_points]
    flip = next(point for point in result.special_points if point.kind == "flip")
    curves += [
        ss.locus(point, over, bounds) for point in ss.switch_branch(result, flip).special_points if point.boundary
    ]
    show.loci_plot(curves, panels[0])
    belt = ss.Oscillator(damping=0.1, drive_velocity=0.43, law=ss.laws.Cubic(0.4, 0.45, 0.6))
    over, bounds = ("drive_velocity", "damping"), ((0.25, 0.5), (0.0, 0.3))
    result = ss.continuation(belt, "drive_velocity", (0.39, 0.45), seeds=0)
    curves = [ss.locus(point, over, bounds) for point in result.special_points]
    show.loci_plot(curves, panels[1])
    save(panels[0], "loci.png")


def forced_calibrations() -> None:
    """Periods of the forced motion at s = 0.30 over amplitude and frequency, of two calibrations of the paper's law."""
    over = {"forcing.amplitude": np.linspace(0.005, 0.30, 60), "forcing.frequency": np.linspace(0.30, 1.40, 67)}
    panels = show.new_axes(1, 2, figsize=(8.4, 4.4))
    for name, ax in zip(("default", "one u₀"), panels, strict=True):
        oscillator = ss.paper.calibration.CALIBRATIONS[name].oscillator(0.30, ss.Harmonic(0.1, 1.0))
        show.regime_map_plot(ss.regime_map(oscillator, over, transient=600), ax, quantity="period")
        for frequency in (0.35, 1.25):
            ax.axhline(frequency, color="black", lw=0.8, ls="--")
        ax.set_title(f"calibration: {name}", loc="right", fontsize=9)
    save(panels[0], "paper-forced-calibrations.png")


def trade_offs() -> None:
    """What each calibration of the paper's law shows of its claims."""
    save(ss.paper.figures.trade_offs()[0], "paper-trade-offs.png")


def example() -> tuple[xr.DataTree, ss.Orbit]:
    """The record that ships with the package, as friction, and the motion of the law found from it."""
    with tempfile.TemporaryDirectory() as folder:
        record, rig, system, *_ = copy_example(folder)
        friction = ss.measure(record, rig).load()
        block = replace(ss.load_system(system), law=ss.identify(friction).law)
    return friction, ss.simulate(block, 6.0)


def overview() -> None:
    """The picture of the README: a record, its law, and the motions of that law."""
    friction, orbit = example()
    shaken = replace(orbit.system, drive_velocity=0.067, forcing=ss.Harmonic(3.0, 28.0))
    with plt.rc_context(show.STYLE):
        figure = plt.figure(figsize=(7.6, 5.8), layout="constrained")
        axes = figure.subplot_mosaic(
            [["record", "law"], ["all", "all"]], width_ratios=[1.4, 1.0], height_ratios=[0.7, 1.0]
        )
    record(friction, axes["record"], end=1.3)
    loop(friction, orbit, axes["law"])
    frequencies = np.linspace(25.0, 36.0, 991)
    diagram = ss.orbit_diagram(shaken, "forcing.frequency", frequencies, periods=600, keep=120, decide=1000)
    ax = show.orbit_diagram_plot(diagram, axes["all"], quantity="section", name_regimes=False)
    for points in ax.lines:
        points.set(markersize=1.7, alpha=0.4)  # where a motion is often, its points are dark
    ax.legend(**(ABOVE | {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0)}))
    ax.set_ylabel("position x, once a period (mm)")
    ax.yaxis.set_major_formatter(lambda x, _: f"{1e3 * x:g}")  # as the record above it
    titles = {
        "record": "1  A record; sticks shaded",
        "law": "2  Its law",
        "all": "3  Orbit diagram, forced with 3 N: stick-slip throughout",
    }
    for name, title in titles.items():
        axes[name].set_title(title, loc="left", fontsize=10, fontweight="bold", pad=8)
    save(ax, "overview.png")


def record(friction: xr.DataTree, ax: plt.Axes, end: float) -> plt.Axes:
    """Recorded position over time, sticks shaded."""
    t = friction["time"].to_numpy()
    part = t < end
    show.shade_sticks(ax, t[part], friction["stuck"].to_numpy()[part])
    ax.plot(t[part], 1e3 * friction["recorded"].to_numpy()[part], ".", ms=2, color="0.25")
    ax.set(xlabel="time t (s)", ylabel="position x (mm)", xlim=(0, end))
    return ax


def loop(friction: xr.DataTree, orbit: ss.Orbit, ax: plt.Axes) -> plt.Axes:
    """Measured friction over slip velocity, and that of the identified law."""
    slip = ~friction["stuck"].to_numpy()
    w, force = friction["slip_velocity"].to_numpy()[slip], friction["force"].to_numpy()[slip]
    ax.plot(w, force, ".", ms=2.5, color="0.55", label="measured")
    law = {"colour": show.OKABE_ITO["vermilion"], "name": "motion under the identified law", "arrows": False}
    show.friction_loop(orbit, ax, legend=False, **law)
    ax.legend(fontsize=8, frameon=False, loc="upper right", markerscale=3)
    return ax


def record_and_law() -> None:
    """The record that ships and the law found from it."""
    friction, orbit = example()
    panels = show.new_axes(1, 2, figsize=(8.4, 3.0), width_ratios=[1.5, 1])
    record(friction, panels[0], end=2.0)
    loop(friction, orbit, panels[1])
    save(panels[0], "gallery-record.png")


def concepts() -> None:
    """The pictures of the concepts, each with the name of its function."""
    from concepts import PICTURES

    for drawn in PICTURES:
        save(drawn(), f"concept-{drawn.__name__}.svg")


def orbit() -> None:
    """One orbit in the phase plane and over time."""
    law = ss.laws.StaticKinetic(break_away=1.0, kinetic=0.6)
    motion = ss.simulate(ss.Oscillator(damping=0.05, drive_velocity=0.2, law=law), t_end=60)
    with plt.rc_context(show.STYLE):
        figure = plt.figure(figsize=(8.4, 3.8), layout="constrained")
        left, right = figure.subfigures(1, 2, squeeze=False, width_ratios=[1, 1.4])[0]
        ax = show.phase_plane(motion, left.subplots())
        named = {"slip": ax.plot([], [], color=MODE_COLOURS["slip_forward"])[0]}
        named["stick"] = ax.plot([], [], color=MODE_COLOURS["stick"], lw=3)[0]
        named["ẋ = s"] = ax.plot([], [], color="0.5", lw=0.8, ls="--")[0]
        ax.legend(named.values(), named, **ABOVE, ncols=3)
        show.time_series(motion, right.subplots(3, 1, sharex=True), start=30.0)
    save(ax, "gallery-orbit.png")


def loads() -> None:
    """The oscillator of Feeny and Moon: from one position at rest to the next, and what lies between."""
    forcing, pressed = ss.Harmonic(1.9, 1.25, 5 * np.pi / 8), ss.NormalForce(position=1.5)
    system = ss.Oscillator(0.0, 0.0, ss.laws.Coulomb(1.0), forcing=forcing, normal_force=pressed)
    period = 2 * np.pi / 1.25
    motion = ss.simulate(system, 900 * period, x0=0.5)
    places, _ = motion.at(np.arange(100, 900) * period)
    left, right = show.new_axes(1, 2, figsize=(8.4, 3.4), width_ratios=[1, 1.6])
    left.plot(places[:-1], places[1:], ".", markersize=2)
    left.axline((0.8, 0.8), slope=1, color="0.6", linewidth=0.8)
    left.set(xlabel="position x where it sticks (dimensionless)", ylabel="position x a period later (dimensionless)")
    t = np.linspace(100, 108, 2000) * period
    x, v = motion.at(t)
    right.plot(t / period - 100, x, label="position x")
    right.plot(t / period - 100, pressed.at(t, x, v), label="normal force n")
    right.set(xlabel="time t (periods of the forcing)", ylabel="position, normal force (dimensionless)")
    right.legend(**ABOVE, ncols=2)
    save(left, "loads.png")


def pages() -> None:
    """The pictures of the first page, tutorials and how-to pages with their name: what the block above each draws."""
    sys.path.insert(0, str(HERE.parents[1] / "tests"))
    from pages import blocks, run

    folders = (HERE.parent.glob(f"{folder}/*.md") for folder in ("tutorials", "how-to"))
    for page in [HERE.parent / "start.md", *sorted(chain.from_iterable(folders))]:
        if not any(block.picture.startswith(page.stem) for block in blocks(page)):
            continue
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            for block in run(page):
                if not block.picture.startswith(page.stem):
                    continue
                if block.plots:
                    shutil.copy(block.plots[-1], HERE / block.picture)
                else:
                    save(np.ravel(block.names["ax"])[0], block.picture)


def paper() -> None:
    """The paper's page with its figures."""
    with tempfile.TemporaryDirectory() as folder:
        page = ss.paper.reproduce(folder)
        shutil.copytree(page.parent / "figures", HERE, dirs_exist_ok=True)
        shutil.copy(page.parent / "paper.md", HERE.parent)


if __name__ == "__main__":
    figures = (
        laws, setups, branches, loci, forced_calibrations, trade_offs, concepts, record_and_law, orbit, loads, pages,
        overview, paper,
    )  # fmt: skip
    parts = {part.__name__: part for part in figures}
    for name in sys.argv[1:] or parts:
        parts[name]()
