"""The whole way on what ships with the package: noisy records of the paper's law, measured, identified, simulated, drawn.

The records are made, so the truth is known: the report lays the identified parameters beside the true ones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip import paper, show
from stickslip.documents import write_whole
from stickslip.errors import InputError
from stickslip.identification import Agreement, Identification, compare_motion, identify
from stickslip.identification.parameters import value
from stickslip.identification.trajectory import fit_trajectories
from stickslip.laws import BogaczRyczek
from stickslip.measurement import Rig, measure, notes
from stickslip.report import Report
from stickslip.simulation import simulate

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

#: One drive velocity with sticks, two without: together they show every branch of the law.
DRIVE_VELOCITIES = (0.15, 0.28, 0.31)
#: Standard deviation of the noise of the displacement: 0.3 % to 0.7 % of that of the motion.
NOISE = 0.001
SETTLED, DURATION, STEP, SEED = 100.0, 120.0, 0.02, 20190


def make_record(drive_velocity: float, folder: Path, seed: int) -> tuple[Path, Path]:
    """Write a noisy displacement record of the paper's oscillator as CSV, and its rig file; returns both paths."""
    system = paper.oscillator(drive_velocity)
    t = np.arange(0.0, DURATION, STEP)
    x, _ = simulate(system, SETTLED + DURATION).at(SETTLED + t)
    noisy = x + NOISE * np.random.default_rng(seed).standard_normal(t.size)
    record = folder / f"displacement-s{drive_velocity:.2f}.csv"
    columns = np.column_stack([t, noisy])
    write_whole(record, lambda draft: np.savetxt(draft, columns, "%.9g", ",", header="time,displacement", comments=""))
    rig = Rig(
        gauge="displacement",
        column="displacement",
        unit="1",
        time_column="time",
        stiffness=system.stiffness,
        mass=system.mass,
        damping=system.damping,
        drive_velocity=drive_velocity,
    )
    return record, write_whole(record.with_suffix(".rig.toml"), lambda draft: draft.write_text(rig.to_toml()))


def demo(folder: str | Path, progress: Callable[[str, int, int], Any] | None = None) -> Path:
    """Run the whole way and write one self-contained report.

    Parameters
    ----------
    folder : where ``report.html``, the records, friction files and the law file go; made if it is not there.
    progress : called as ``progress(what, done, steps)`` before each step.

    Returns
    -------
    The path of the report.

    Raises
    ------
    InputError
        where the folder cannot be made or written to.
    """
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made ({error.strerror}); choose another folder") from None
    tell = progress or (lambda *_: None)
    steps = 2 * len(DRIVE_VELOCITIES) + 5
    taken = 0

    def step(what: str) -> None:
        nonlocal taken
        tell(what, taken, steps)
        taken += 1

    frictions: list[xr.DataTree] = []
    for number, s in enumerate(DRIVE_VELOCITIES):
        step(f"make the record at s = {s}")
        record, rig = make_record(s, folder, SEED + number)
        step(f"measure friction at s = {s}")
        friction = measure(record, rig)
        path = folder / f"friction-s{s:.2f}.nc"
        write_whole(path, partial(friction.to_netcdf, engine="h5netcdf"))
        frictions.append(friction)
    step("fit the law to the branches of friction")
    branches = identify(frictions, law="BogaczRyczek", fixed={"beta": BogaczRyczek().beta})
    step("sharpen it by laying the motions over each other")
    free = dict.fromkeys([*(str(name) for name in branches.parameters.index), "D.w"])
    identification = fit_trajectories(branches, free, settled_after=0.0)
    identification.save(folder / "law.toml")
    step("simulate with the identified law")
    agreements = [compare_motion(friction, identification) for friction in frictions]
    step("sweep the drive velocity")
    diagram = paper.figures.drive_velocity_diagram()
    step("score the paper's statements")
    scores = paper.score()
    report = _report(frictions, branches, identification, agreements, diagram, scores)
    tell("done", steps, steps)
    return report.write(folder / "report.html")


def against_truth(identification: Identification) -> pd.DataFrame:
    """Identified beside true parameters: value, error, 95 % interval, truth and whether it lies inside.

    A steady motion sticks equally long each time, so of the surface f_s(t_s, δ) it shows one number besides f_s(0, ·): that
    number stands in the place of the growth limit.
    """
    true, found = BogaczRyczek(), identification.law
    table = identification.parameters[["value", "error", "low", "high"]].copy()
    table["true"] = [value(true, str(name)) for name in table.index]
    limit = "static_friction.limit"
    if limit in table.index:
        s = DRIVE_VELOCITIES[0]
        sticks = simulate(replace(paper.oscillator(s), law=found), SETTLED).events["stick_time"].dropna()
        held = {"stick_time": float(sticks.iloc[-1]), "force_rate": s}
        start = found.break_away_force(0.0)
        grown = found.break_away_force(**held) - start
        share = grown / table.loc[limit, "value"]
        row = start + share * table.loc[limit, ["value", "low", "high"]].to_numpy(float)
        table.loc[limit] = [row[0], share * table.loc[limit, "error"], row[1], row[2], true.break_away_force(**held)]
        table = table.rename(index={limit: "f_s after a stick"})
    inside = (table["low"] <= table["true"]) & (table["true"] <= table["high"])
    table["inside the 95 % interval"] = np.where(inside, "yes", "no")
    return table


def _report(
    frictions: list[xr.DataTree],
    branches: Identification,
    identification: Identification,
    agreements: list[Agreement],
    diagram: xr.Dataset,
    scores: pd.DataFrame,
) -> Report:
    speeds = ", ".join(f"{s:.2f}" for s in DRIVE_VELOCITIES)
    report = Report("stickslip: the whole way once")
    report.text(
        f"The paper's oscillator was run at the drive velocities s = {speeds}, its settled displacement sampled every {STEP} "
        f"time units with noise of the standard deviation {NOISE}. From here on only these records are used."
    )
    report.heading("From displacement to friction force")
    report.text("Sticks are found first; between them smooth pieces give velocity and acceleration, and so friction.")
    report.figure(_friction_figure(frictions), "Friction force over slip velocity, measured (points) and true (line).")
    for s, friction in zip(DRIVE_VELOCITIES, frictions, strict=True):
        report.items([f"s = {s:.2f}: {note}" for note in notes(friction)])
    report.heading("From friction force to the law")
    report.text(
        "First the law is replayed with its memory along the measured motion, and least squares fits its branches; then the "
        "motion that the law makes is laid over each record, and the law sharpened until they agree. β and η are held at the "
        "paper's values."
    )
    table = against_truth(identification)
    table.insert(0, "from the branches", against_truth(branches)["value"].reindex(table.index))
    report.table(table, mark="inside the 95 % interval")
    report.items(identification.notes)
    report.heading("From the law to the motion, laid over the record")
    for s, agreement in zip(DRIVE_VELOCITIES, agreements, strict=True):
        report.figure(agreement.plot(), f"Measured and simulated motion at s = {s:.2f}.")
        report.table(agreement.table)
        report.items(agreement.sentences)
    report.heading("Every drive velocity")
    report.figure(
        paper.figures.phase_portraits()[0].figure, "Phase portraits over the drive velocity (the paper's Fig. 12)."
    )
    report.figure(
        paper.figures.regimes(diagram).figure,
        "Turning points over the drive velocity, with the regimes (the paper's Fig. 14).",
    )
    report.heading("The paper's statements, scored")
    report.table(scores[["section", "statement", "seen", "basis", "verdict"]], mark="verdict")
    report.heading("To do it again")
    report.code("stickslip demo\n" + identification.command)
    return report


def _friction_figure(frictions: list[xr.DataTree]) -> Any:
    axes = show.new_axes(1, len(frictions), figsize=(4 * len(frictions), 3.6), sharey=True)
    for ax, s, friction in zip(axes, DRIVE_VELOCITIES, frictions, strict=True):
        slipping = ~friction["stuck"].to_numpy()
        w, force = friction["slip_velocity"].to_numpy()[slipping], friction["force"].to_numpy()[slipping]
        ax.plot(w, force, ".", ms=1, color="0.55", rasterized=True)
        show.friction_loop(simulate(paper.oscillator(s), DURATION), ax=ax)
        ax.set_title(f"s = {s:.2f}")
    return axes[0].figure
