"""A cart or a joint moved by a motor: friction is current times constant, less inertia times acceleration."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import xarray as xr

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.files.schema import any_number, positive
from stickslip.measurement.instruments.instrument import Constant, Instrument, InstrumentRig, Samples, notes_of
from stickslip.measurement.result import friction_tree
from stickslip.measurement.rigs.rig import SLIDES, TURNS, RigUnits
from stickslip.measurement.signals.smooth import Smooth, jerk_spline

DELAYS = (-1, 0, 1)
"""Samples by which a log may write the current late or early against the position."""
ONE_WAY = 0.02
"""Share of the motion that either direction must have."""
SURE = 5.0
"""Standard errors by which an inertia must lie below zero to be none."""
STRETCHES = 10
"""Consecutive parts of a record, each left out in turn, from which the fitted inertia has its error."""


def _units(records: list[Samples], rig: InstrumentRig) -> RigUnits:
    """Those of the displacement; refused where the rig names the inertia of the other kind of motion."""
    units, other = (TURNS, SLIDES) if records[0].units["displacement"] == TURNS.length else (SLIDES, TURNS)
    if rig.maybe(other.inertia) is not None:
        raise InputError(
            f"motor_current: expected {units.inertia} in {units.mass} for a displacement in {units.length}, got "
            f"{other.inertia} in {other.mass}; write {units.inertia} in the rig, or correct the unit of displacement"
        )
    return units


def _measure(records: list[Samples], rig: InstrumentRig) -> xr.DataTree:
    """Friction forward and backward from force_per_current * current(t - delay) = M a + F+ (or - F-).

    Which sample of the current belongs to which position a log does not say, and a drive that switches turns a delay of
    one sample into newtons; so does the inertia. All of delay -1, 0, 1 and inertia free or as published are fitted for every
    record: the value is the middle of all, the error half their range. Friction is one level forward and one backward;
    `direct_force` takes the same current for friction over speed.
    """
    factor = rig.number("force_per_current")
    units = _units(records, rig)
    published = rig.maybe(units.inertia)
    rows: list[dict[str, float]] = []
    notes = notes_of(records)
    for number, record in enumerate(records):
        smooth = jerk_spline(record.time, record["displacement"])
        step = float(np.median(np.diff(record.time)))
        for delay in DELAYS:
            drive = factor * np.interp(record.time - delay * step, record.time, record["current"])
            for mass in [None] if published is None else [None, published]:
                row = _fit(record, smooth, drive, mass, rig)
                rows.append(
                    {"record": float(number), "delay": float(delay), "fixed_mass": float(mass is not None)} | row
                )
    table = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    mean = {}
    for delay in DELAYS:
        for fixed in (0.0, 1.0) if published is not None else (0.0,):
            here = (table["delay"] == delay) & (table["fixed_mass"] == fixed)
            mean[delay, fixed] = {name: float(table[name][here].mean()) for name in table}
    levels = [(m["forward_force"] + m["backward_force"]) / 2 for m in mean.values()]
    low, high = min(levels), max(levels)
    per_record = [
        float(np.mean((table["forward_force"] + table["backward_force"])[table["record"] == i])) / 2
        for i in range(len(records))
    ]
    between = float(np.std(per_record, ddof=1)) if len(records) > 1 else 0.0
    best = min(mean.values(), key=lambda m: m["residual"])
    inertia, inertia_error = _inertia(table, best["delay"])
    if inertia < -SURE * inertia_error:
        if best["forward_force"] + best["backward_force"] < 0:
            raise InputError(
                f"{records[0].source}: the {units.inertia} comes out at {inertia:.3g} {units.mass} and friction drives the "
                "motion: current and displacement count in opposite directions; give the column of one of them sign = -1"
            )
        negative = (
            f"the {units.inertia} comes out at {inertia:.3g} +- {inertia_error:.2g} {units.mass}, which none can be: part of "
            "the current follows the position, as gravity on an arm or a spring makes it, and is taken for friction; take "
            "the instrument direct_force, which fits such forces, with the same columns"
        )
        if published is None:
            raise InputError(f"{records[0].source}: {negative}")
        notes.append(negative)
    free = [m for (_, fixed), m in mean.items() if fixed == 0.0]
    notes.append(
        f"friction hangs on a one-sample delay ({1e3 * step:.3g} ms) and on the {units.inertia}: {low:.4g} ... {high:.4g} "
        f"{units.force} (mean of forward and backward); the error covers them all"
    )
    notes.append(
        f"by delay (samples), {units.inertia} free: "
        + "; ".join(
            f"{m['delay']:+.0f}: {units.inertia} {m['mass']:.4g} {units.mass}, forward {m['forward_force']:.4g}, backward "
            f"{m['backward_force']:.4g}, rest {m['residual']:.3g} {units.force} rms"
            for m in free
        )
    )
    notes.append(
        "forward and backward friction are one level each, the mean over all speeds; for a curve over the speed take the "
        "instrument direct_force, with the same column current and the same force_per_current"
    )
    if published is not None:
        notes.append(
            f"{units.inertia} in the rig {published:g} {units.mass}, as fitted {inertia:.4g} +- {inertia_error:.2g} "
            f"{units.mass}"
        )
    others = {"mass": units.mass, "mass_error": units.mass, "speed": units.speed}
    others |= {"delay": "samples", "record": "1", "fixed_mass": "1"}
    choices = xr.Dataset(
        {name: ("choice", values, {"units": others.get(name, units.force)}) for name, values in table.items()}
    )
    middle, error = (low + high) / 2, float(np.hypot((high - low) / 2, between))
    forward = [m["forward_force"] for m in mean.values()]
    backward = [m["backward_force"] for m in mean.values()]
    steady = xr.Dataset(
        {
            "slip_velocity": ("row", np.array([best["speed"], -best["speed"]]), {"units": units.speed}),
            "force": ("row", np.array([sum(forward), -sum(backward)]) / len(mean), {"units": units.force}),
            "force_error": (
                "row",
                np.hypot([np.ptp(forward) / 2, np.ptp(backward) / 2], between),
                {"units": units.force},
            ),
        }
    )
    return friction_tree(
        series=_series(records[0], factor, best, error, units) if len(records) == 1 else {},
        tables={"steady": steady, "choices": choices},
        source=", ".join(record.source for record in records),
        rig=rig.toml,
        notes=notes,
        facts={
            "force": middle,
            "force_error": error,
            "lowest": low,
            "highest": high,
            "best_delay": best["delay"] * step,
            "forward_force": best["forward_force"],
            "backward_force": best["backward_force"],
            units.inertia: best["mass"],
            f"fitted_{units.inertia}": inertia,
            f"fitted_{units.inertia}_error": inertia_error,
            "residual": best["residual"],
            "drive": float(np.median(np.abs(factor * records[0]["current"]))),
        },
    )


def _fit(record: Samples, smooth: Smooth, drive: Array, mass: float | None, rig: InstrumentRig) -> dict[str, float]:
    """Least squares over the samples that move and are driven."""
    moving = np.abs(smooth.v) > rig.number("least_speed")
    driven = np.abs(record["current"]) > rig.number("least_current")
    use = moving & driven
    use[:10] = use[-10:] = False  # the smoothing is loose at its ends
    if np.count_nonzero(use) < 20:
        raise InputError(
            f"{record.source}: {np.count_nonzero(use)} samples move faster than least_speed and are driven by more than "
            "least_current; lower these or record longer"
        )
    forward_share = float(np.mean(smooth.v[use] > 0))
    if not ONE_WAY < forward_share < 1 - ONE_WAY:
        raise InputError(
            f"{record.source}: {100 * max(forward_share, 1 - forward_share):.3g} % of the motion is one way, so friction and "
            "inertia cannot be separated; record both directions, or give the inertia and take the instrument direct_force"
        )
    sides = np.stack([smooth.v > 0, smooth.v < 0], axis=1)[use] * np.array([1.0, -1.0])
    a, force = smooth.a[use], drive[use]
    mass_error = 0.0
    if mass is None:
        columns = np.column_stack([sides, a])
        found = np.linalg.lstsq(columns, force, rcond=None)[0]
        forward, backward, mass = (float(value) for value in found)
        mass_error = _left_out(columns, force)
    else:
        forward, backward = (float(value) for value in np.linalg.lstsq(sides, force - mass * a, rcond=None)[0])
    residuals = force - mass * a - sides @ np.array([forward, backward])
    return {
        "mass": mass,
        "mass_error": mass_error,
        "forward_force": forward,
        "backward_force": backward,
        "residual": float(np.sqrt(np.mean(residuals**2))),
        "speed": float(np.mean(np.abs(smooth.v[use]))),
    }


def _left_out(columns: Array, force: Array) -> float:
    """Standard error of the last number of a least-squares fit, by leaving out each of ten stretches in turn (jackknife)."""
    found = []
    for part in np.array_split(np.arange(len(force)), STRETCHES):
        kept = np.delete(np.arange(len(force)), part)
        found.append(np.linalg.lstsq(columns[kept], force[kept], rcond=None)[0][-1])
    return float(np.sqrt((STRETCHES - 1) * np.var(found)))


def _inertia(table: dict[str, Array], delay: float) -> tuple[float, float]:
    """The fitted inertia at one delay, the mean of the records, and its standard error."""
    here = (table["delay"] == delay) & (table["fixed_mass"] == 0)
    values, errors = table["mass"][here], table["mass_error"][here]
    between = float(np.var(values, ddof=1)) if values.size > 1 else 0.0
    return float(values.mean()), float(np.sqrt(max(np.mean(errors**2), between) / values.size))


def _series(
    record: Samples, factor: float, best: dict[str, float], error: float, units: RigUnits
) -> dict[str, tuple[npt.NDArray[np.generic], str]]:
    smooth = jerk_spline(record.time, record["displacement"])
    step = float(np.median(np.diff(record.time)))
    drive = factor * np.interp(record.time - best["delay"] * step, record.time, record["current"])
    friction = drive - best["mass"] * smooth.a
    noise = np.hypot(best["residual"], error)
    return {
        "time": (record.time, "s"),
        "slip_velocity": (smooth.v, units.speed),
        "slip_acceleration": (smooth.a, units.acceleration),
        "force": (friction, units.force),
        "force_error": (np.full(len(friction), noise), units.force),
        "stuck": (np.zeros(len(friction), dtype=bool), "1"),
        "displacement": (smooth.x, units.length),
    }


MOTOR_CURRENT = Instrument(
    name="motor_current",
    channels={"current": ("current",), "displacement": ("length", "angle")},
    optional={"velocity": ("speed", "angular_speed")},
    constants={
        "force_per_current": Constant(any_number("force_per_current", "torque_per_current"), needed=True),
        "mass": Constant(positive("mass")),
        "inertia": Constant(positive("inertia")),
        "least_speed": Constant(positive("speed", "angular_speed"), 0.02),
        "least_current": Constant(positive("current"), 0.1),
    },
    measure=_measure,
)
