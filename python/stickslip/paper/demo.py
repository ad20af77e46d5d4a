"""The whole way on what ships with the package: films of the paper's law, tracked, measured, identified, simulated, drawn.

The films are made, so the truth is known: the report lays it beside every result.
"""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip import paper, show
from stickslip.errors import InputError
from stickslip.explorer import content_of_record
from stickslip.files.disk import make_folder, write_whole
from stickslip.files.netcdf import write_netcdf
from stickslip.identification import Agreement, Identification, compare_motion, identify
from stickslip.identification.estimator.result import in_digits
from stickslip.identification.estimator.uncertainty import half_width
from stickslip.identification.trajectory.shooting import fit_trajectories
from stickslip.laws.numbers import value
from stickslip.measurement import Rig, measure, notes
from stickslip.measurement.read import open_motion
from stickslip.report.report import Report
from stickslip.simulation.simulate import simulate

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

#: The paper's law with one f_s(0): that f_s(0, δ) falls with the force rate is not looked for by ``identify``.
MODEL = paper.calibration.CALIBRATIONS["one f_s(0)"]
#: One drive velocity with sticks, two without: together they show every branch of the law.
DRIVE_VELOCITIES = (0.15, 0.28, 0.31)
#: How a film is taken: pictures per unit of time (126 in a period), and fields of `stickslip.tracking.Camera`.
CAMERA: dict[str, Any] = {"frame_rate": 20.0, "width": 240, "height": 72, "marker": 12.0, "noise": 0.1}
SETTLED, DURATION, SEED = 100.0, 60.0, 20190
#: Standard deviation of a tracked place in such a film, in units of length; noise of the records where nothing can be filmed.
NOISE = 2e-4
#: Standard error, in px, of what all places in a film are off by together: marker on its ground, light, edges of pixels.
COMMON_POSITION_ERROR = 0.01


@dataclass(frozen=True)
class Seen:
    """One record and its truth: what was measured, the row of the table that says how well, and the error of its zero."""

    friction: xr.DataTree
    facts: dict[str, float | int]
    zero_error: float


def see(drive_velocity: float, folder: Path, seed: int, filmed: bool) -> Seen:
    """Film the paper's oscillator, track the film, measure friction, and lay it beside the orbit that was filmed.

    With `filmed` False there is no film, and the motion is the orbit with noise as a tracked film has it.
    """
    system = MODEL.oscillator(drive_velocity)
    orbit = simulate(system, SETTLED + DURATION)
    motion, facts = (_track if filmed else _pretend)(orbit, folder / f"film-s{drive_velocity:.2f}.avi", seed)
    rig = Rig.of(system, time_column="time")
    write_whole(folder / f"film-s{drive_velocity:.2f}.rig.toml", lambda draft: draft.write_text(rig.to_toml()))
    friction = measure(motion, rig, mass=0)
    write_netcdf(folder / f"friction-s{drive_velocity:.2f}.nc", friction)
    time = friction["time"].to_numpy()
    force = orbit.to_xarray(SETTLED + time)["force"].to_numpy()
    scatter = float(np.sqrt(np.mean((friction["force"].to_numpy() - force) ** 2)))
    releases = orbit.events.query("kind == 'release' and @SETTLED < t < @SETTLED + @DURATION")["t"].to_numpy() - SETTLED
    found = friction["break_away"]["t"].to_numpy()
    late = [float(np.abs(found - release).min()) for release in releases] if len(found) else []
    facts |= {
        "force off, % of the largest": 100 * scatter / float(np.abs(force).max()),
        "break-aways": len(found),
        "true break-aways": len(releases),
        "break-aways off, pictures": float(np.median(late)) * CAMERA["frame_rate"] if late else float("nan"),
    }
    pixel = json.loads(motion.attrs["calibration"])["coefficients"][1] if filmed else 0.0
    return Seen(friction, facts, COMMON_POSITION_ERROR * pixel)


def _track(orbit: Any, path: Path, seed: int) -> tuple[xr.Dataset, dict[str, float | int]]:
    from stickslip.tracking import film, track

    truth = film(orbit, path, start=SETTLED, duration=DURATION, seed=seed, **CAMERA)
    motion = track(path, tomllib.loads(truth.attrs["setup"]), output=path.with_suffix(".motion.nc"))
    apart = np.stack([motion[name].to_numpy() - truth[name].to_numpy() for name in ("x_px", "y_px")])
    return motion, {"pictures": motion.sizes["time"], "places off, px": float(np.sqrt(np.nanmean(apart**2)))}


def _pretend(orbit: Any, path: Path, seed: int) -> tuple[xr.Dataset, dict[str, float | int]]:
    import xarray as xr

    time = np.arange(0.0, DURATION, 1 / CAMERA["frame_rate"])
    x = orbit.at(SETTLED + time)[0] + NOISE * np.random.default_rng(seed).standard_normal(time.size)
    motion = xr.Dataset({"x": (("time", "mass"), x[:, None], {"units": "1"})}, {"time": time}, {"source": path.stem})
    return motion, {}


def demo(folder: str | Path, progress: Callable[[str, int, int], Any] | None = None) -> Path:
    """Run the whole way and write one self-contained report.

    Parameters
    ----------
    folder : where ``report.html``, the films, motions, friction files and the law file go; made if it is not there.
    progress : called as ``progress(what, done, steps)`` before each step.

    Returns
    -------
    The path of the report.

    Raises
    ------
    InputError
        where the folder cannot be made or written to.
    """
    folder = make_folder(folder)
    tell = progress or (lambda *_: None)
    steps = len(DRIVE_VELOCITIES) + 5
    taken = 0

    def step(what: str) -> None:
        nonlocal taken
        tell(what, taken, steps)
        taken += 1

    missing = _no_films()
    seen: list[Seen] = []
    for number, s in enumerate(DRIVE_VELOCITIES):
        step(f"film, track and measure at s = {s}" if missing is None else f"measure at s = {s}, without a film")
        seen.append(see(s, folder, SEED + number, missing is None))
    frictions = [one.friction for one in seen]
    step("fit the law to the branches of friction")
    branches = identify(frictions, law="BogaczRyczek", fixed={"beta": MODEL.law.beta})
    step("refine it until the motions agree")
    free = dict.fromkeys([*(str(name) for name in branches.parameters.index), "D.w"])
    zero_error = max(one.zero_error for one in seen)
    identification = fit_trajectories(branches, free, settled_after=0.0, zero_error=zero_error)
    identification.save(folder / "law.toml")
    step("simulate with the identified law")
    agreements = [compare_motion(friction, identification) for friction in frictions]
    step("sweep the drive velocity")
    diagram = paper.figures.drive_velocity_diagram()
    step("score the paper's claims")
    scores = paper.score()
    report = _report(seen, missing, branches, identification, agreements, diagram, scores)
    tell("done", steps, steps)
    return report.write(folder / "report.html")


def _no_films() -> str | None:
    """Why no film can be made here, None where one can."""
    from stickslip.tracking.video.vision import vision

    try:
        vision()
    except InputError as error:
        return str(error)
    return None


def against_truth(identification: Identification) -> pd.DataFrame:
    """Identified beside true parameters: value, error, 95 % interval, truth and whether it lies inside.

    A steady motion sticks equally long each time, so of the surface f_s(t_s, δ) it shows one number besides f_s(0, ·): that
    number stands in the place of the growth limit.
    """
    true, found = MODEL.law, identification.law
    table = identification.parameters[["value", "error", "low", "high"]].copy()
    table["true"] = [value(true, str(name)) for name in table.index]
    limit = "static_friction.limit"
    if limit in table.index:
        s = DRIVE_VELOCITIES[0]
        sticks = simulate(replace(MODEL.oscillator(s), law=found), SETTLED).events["stick_time"].dropna()
        held = {"stick_time": float(sticks.iloc[-1]), "force_rate": s}
        start = found.break_away_force(0.0)
        grown = found.break_away_force(**held) - start
        share = grown / table.loc[limit, "value"]
        names, weights = ["static_friction.initial", limit], np.array([1.0, share])
        error = float(np.sqrt(weights @ identification.covariance.loc[names, names].to_numpy() @ weights))
        row = start + grown
        half = half_width(error, math.inf)
        table.loc[limit] = [row, error, row - half, row + half, true.break_away_force(**held)]
        table = table.rename(index={limit: "f_s after a stick"})
    inside = (table["low"] <= table["true"]) & (table["true"] <= table["high"])
    table["inside the 95 % interval"] = np.where(inside, "yes", "no")
    return table


def _report(
    seen: list[Seen],
    missing: str | None,
    branches: Identification,
    identification: Identification,
    agreements: list[Agreement],
    diagram: xr.Dataset,
    scores: pd.DataFrame,
) -> Report:
    import pandas as pd

    frictions = [one.friction for one in seen]
    speeds = ", ".join(f"{s:.2f}" for s in DRIVE_VELOCITIES)
    report = Report("stickslip: the whole way once")
    report.heading("From pictures to coordinates")
    if missing is None:
        report.text(
            f"The paper's oscillator was filmed at the drive velocities s = {speeds}, {CAMERA['frame_rate']:g} pictures per "
            "unit of time, with noise that shifts one pixel's reading of an edge by 0.1 px, and the films were tracked. From "
            "here on only what was tracked is used."
        )
        report.figure(_film_figure(Path(str(frictions[0].attrs["source"]).split(", ")[0])), "A picture of the film.")
    else:
        report.text(
            f"Nothing was filmed: {missing}. The coordinates are those of the paper's oscillator at s = {speeds} with the "
            "noise of a tracked film."
        )
    report.heading("From displacement to friction force")
    report.text("Sticks are found first; between them smooth pieces give velocity and acceleration, and so friction.")
    report.figure(_friction_figure(frictions), "Friction force over slip velocity, measured (points) and true (line).")
    report.text("What was measured, laid beside the orbit that was filmed:")
    report.table(pd.DataFrame([one.facts for one in seen], index=[f"s = {s:.2f}" for s in DRIVE_VELOCITIES]))
    for s, friction in zip(DRIVE_VELOCITIES, frictions, strict=True):
        report.items([f"s = {s:.2f}: {note}" for note in notes(friction)])
    report.heading("From friction force to the law")
    report.text(
        "First the law is replayed with its memory along the measured motion, and least squares fits its branches; then the "
        "motion that the law makes is compared with each record, and the law refined until they agree. β and η are held at "
        "the paper's values."
    )
    table = against_truth(identification)
    held = int((table["inside the 95 % interval"] == "yes").sum())
    compared = sum(len(agreement.table) for agreement in agreements)
    agreed = compared - sum(agreement.disagreements for agreement in agreements)
    verdicts = scores["verdict"].tolist()
    report.summary(
        "A friction law is identified from motion alone. It is compared with the law that made the motion, the records and "
        "the paper.",
        {
            "true numbers within 95 % intervals": f"{held} of {len(table)}",
            "numbers of the motion that agree": f"{agreed} of {compared}",
            "claims of the paper reproduced": f"{verdicts.count('reproduced')} of {len(verdicts)}",
        },
    )
    table.insert(0, "from the branches", against_truth(branches)["value"].reindex(table.index))
    report.table(in_digits(table), mark="inside the 95 % interval")
    report.items(identification.notes)
    report.heading("From the law to the motion, compared with the record")
    for s, agreement, record in zip(DRIVE_VELOCITIES, agreements, identification.records, strict=True):
        live = content_of_record(record, f"record at s = {s:.2f}", identification.law)
        report.figure(
            agreement.plot(), f"Measured and simulated motion at s = {s:.2f}.", live, "law,phase,displacement"
        )
        report.table(agreement.shown())
        report.items(agreement.sentences)
    report.heading("Every drive velocity")
    report.figure(
        paper.figures.phase_portraits()[0].figure, "Phase portraits over the drive velocity (the paper's Fig. 12)."
    )
    report.figure(
        paper.figures.regimes(diagram).figure,
        "Turning points over the drive velocity, with the regimes (the paper's Fig. 14).",
    )
    report.heading("The paper's claims, scored")
    report.table(scores[["section", "claim", "evidence", "basis", "verdict"]], mark="verdict")
    report.heading("To do it again")
    report.code("stickslip demo\n" + identification.command)
    return report


def _film_figure(path: Path) -> Any:
    from stickslip.tracking import tracks_over_film

    return tracks_over_film(open_motion(path.with_suffix(".motion.nc")), path).figure


def _friction_figure(frictions: list[xr.DataTree]) -> Any:
    axes = show.new_axes(1, len(frictions), figsize=(3.2 * len(frictions), 3.4), sharey=True)
    for ax, s, friction in zip(axes, DRIVE_VELOCITIES, frictions, strict=True):
        slipping = ~friction["stuck"].to_numpy()
        w, force = friction["slip_velocity"].to_numpy()[slipping], friction["force"].to_numpy()[slipping]
        ax.plot(w, force, ".", ms=1, color="0.55", rasterized=True)
        show.friction_loop(simulate(MODEL.oscillator(s), DURATION), ax=ax)
        ax.set_title(f"s = {s:.2f}", loc="right", y=0.92)
    return axes[0].figure
