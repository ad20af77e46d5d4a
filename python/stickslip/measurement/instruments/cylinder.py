"""A piston moved to and fro: friction is the force beside pressure times area, half the width of its loop."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import xarray as xr

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.files.schema import pair, positive
from stickslip.measurement.instruments.errors_of_means import block_error
from stickslip.measurement.instruments.instrument import Constant, Instrument, InstrumentRig, Samples, notes_of
from stickslip.measurement.result import facts_of_runs, friction_tree
from stickslip.measurement.signals.sample_runs import runs_of
from stickslip.measurement.signals.smooth import jerk_spline


def _measure(records: list[Samples], rig: InstrumentRig) -> xr.DataTree:
    """Level of force - p A on the outward and on the inward strokes, inside the `range` of the stroke.

    The loop is shifted as a whole by any error of the pressure, of the force sensor's zero or of the area, so only half of
    its width is friction; the shift is reported. Strokes of one run repeat better than runs do: with several records the
    error is the scatter between the runs, with one record it is `between_run_error` or, without that, the scatter of
    the strokes, and the notes say so.
    """
    area = math.pi * rig.number("bore") ** 2 / 4
    runs = [_run(record, area, rig) for record in records]
    rows = {name: np.array([run[name] for run in runs]) for name in runs[0]}
    notes = notes_of(records)
    known = rig.maybe("between_run_error")
    half = rows["force"]
    between, repeated = _between_runs(rows["pressure"], rows["slip_velocity"], half)
    deviation = rows["in_run_deviation"][np.isfinite(rows["in_run_deviation"])]
    if repeated:
        within = f", {deviation.mean():.2f} N between the strokes of one run" if deviation.size else ""
        notes.append(
            f"half width of the loop over {repeated} runs repeated at one pressure and one speed: {between:.2f} N between "
            f"runs{within}: the error is that between runs"
        )
    elif known is not None:
        between = known
        notes.append(f"the error is the {known:g} N between runs that the rig states (between_run_error)")
    else:
        notes.append(
            "the error is the scatter within one run; runs repeated with the same seal differ by more: measure "
            "the repetitions together, or state between_run_error in the rig"
        )
    error = rows["in_run_error"] if math.isnan(between) else np.full(len(runs), between)
    units = {"pressure": "Pa", "slip_velocity": "m/s", "outward_velocity": "m/s", "inward_velocity": "m/s"}
    steady = xr.Dataset({name: ("row", values, {"units": units.get(name, "N")}) for name, values in rows.items()})
    steady["force_error"] = ("row", error, {"units": "N"})
    steady["source"] = ("row", [record.source for record in records])
    shift = rows["shift"]
    notes.append(
        f"the loop is shifted by {shift.min():.2f} ... {shift.max():.2f} N (zero of the instruments or error of the area), "
        "so only the half width is friction"
    )
    facts: dict[str, float | str] = {
        "force": float(half.mean()),
        "force_error": float(error.max()),
        "in_run_deviation": float(deviation.mean()) if deviation.size else math.nan,
        "forward_force": float(rows["forward_force"].mean()),
        "backward_force": float(rows["backward_force"].mean()),
        "area": area,
        "strokes": float(rows.pop("strokes").sum()),
    }
    facts |= facts_of_runs([record.source for record in records], half.tolist())
    series = _series(records[0], area, float(error.max())) if len(records) == 1 else {}
    return friction_tree(
        series=series,
        tables={"steady": steady},
        source=", ".join(record.source for record in records),
        rig=rig.toml,
        notes=notes,
        facts=facts,
    )


def _between_runs(pressure: Array, speed: Array, force: Array) -> tuple[float, int]:
    """Standard deviation between runs at one pressure and one speed (within a tenth), pooled, and how many runs gave it."""
    squares, free, runs = 0.0, 0, 0
    kinds = np.stack([_alike(pressure), _alike(speed)])
    for kind in np.unique(kinds, axis=1).T:
        group = force[(kinds == kind[:, None]).all(axis=0)]
        if len(group) > 1:
            squares += float(np.sum((group - group.mean()) ** 2))
            free, runs = free + len(group) - 1, runs + len(group)
    return (math.sqrt(squares / free), runs) if free else (math.nan, 0)


def _alike(values: Array) -> npt.NDArray[np.intp]:
    """One number for all values that follow each other within a tenth."""
    order = np.argsort(values)
    found = np.empty(len(values), dtype=np.intp)
    found[order] = np.cumsum(np.diff(values[order], prepend=values[order[0]]) > 0.1 * np.abs(values[order]))
    return found


def _series(record: Samples, area: float, error: float) -> dict[str, tuple[npt.NDArray[np.generic], str]]:
    smooth = jerk_spline(record.time, record["displacement"])
    friction = record["force"] - area * record["pressure"]
    return {
        "time": (record.time, "s"),
        "slip_velocity": (smooth.v, "m/s"),
        "slip_acceleration": (smooth.a, "m/s^2"),
        "force": (friction, "N"),
        "force_error": (np.full(len(friction), error), "N"),
        "stuck": (np.zeros(len(friction), dtype=bool), "1"),
        "displacement": (record["displacement"], "m"),
    }


def _run(record: Samples, area: float, rig: InstrumentRig) -> dict[str, float]:
    """Levels of one run, stroke by stroke."""
    x, friction = record["displacement"], record["force"] - area * record["pressure"]
    low, high = rig.constants["range"]
    v = jerk_spline(record.time, x).v
    inside = (x >= low) & (x <= high)
    levels: dict[int, list[float]] = {1: [], -1: []}
    errors: dict[int, list[float]] = {1: [], -1: []}
    speeds: dict[int, list[float]] = {1: [], -1: []}
    # a stroke is a stretch inside the range that moves one way from one end of it to the other
    for first, end in runs_of(inside):
        way = float(x[end - 1] - x[first])
        if end - first < 5 or abs(way) < 0.8 * (high - low):
            continue
        part = slice(first, end)
        sense = 1 if way > 0 else -1
        levels[sense].append(float(np.mean(friction[part])))
        errors[sense].append(block_error(friction[part]))
        speeds[sense].append(way / float(record.time[end - 1] - record.time[first]))
    if bool(levels[1]) != bool(levels[-1]):
        raise InputError(
            f"{record.source}: every whole stroke goes {'out' if levels[1] else 'in'}; friction is half of what the force "
            "differs by between the two ways: record a stroke and its return"
        )
    if not levels[1]:
        raise InputError(
            f"{record.source}: no whole stroke lies within range = [{low:g}, {high:g}] m (the record spans {x.min():.4g} "
            f"to {x.max():.4g} m); correct the range"
        )
    forward, backward = float(np.mean(levels[1])), float(np.mean(levels[-1]))
    count = min(len(levels[1]), len(levels[-1]))
    halves = (np.array(levels[1][:count]) - np.array(levels[-1][:count])) / 2
    deviation = float(np.std(halves, ddof=1)) if count > 1 else float("nan")
    return {
        "pressure": float(np.mean(record["pressure"][inside])),
        "slip_velocity": (float(np.mean(speeds[1])) - float(np.mean(speeds[-1]))) / 2,
        "outward_velocity": float(np.mean(speeds[1])),
        "inward_velocity": float(np.mean(speeds[-1])),
        "force": (forward - backward) / 2,
        "forward_force": forward,
        "backward_force": backward,
        "shift": (forward + backward) / 2,
        "in_run_deviation": deviation,
        "in_run_error": deviation / math.sqrt(count) if count > 1 else math.hypot(errors[1][0], errors[-1][0]) / 2,
        "strokes": float(2 * count),
        "velocity_deviation": float(np.std(v[inside])),
    }


CYLINDER = Instrument(
    name="cylinder",
    channels={"displacement": ("length",), "pressure": ("pressure",), "force": ("force",)},
    optional={},
    constants={
        "bore": Constant(positive("length"), needed=True),
        "range": Constant(pair("length"), needed=True),
        "between_run_error": Constant(positive("force")),
    },
    measure=_measure,
)
