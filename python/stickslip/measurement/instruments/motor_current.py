"""A cart moved by a motor: friction is current times constant, less mass times acceleration."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import xarray as xr

from stickslip.errors import InputError
from stickslip.measurement.instruments.instrument import Bench, Constant, Instrument, Samples, notes_of
from stickslip.measurement.result import friction_tree
from stickslip.measurement.signals.smooth import Smooth, jerk_spline

Array = npt.NDArray[np.float64]

DELAYS = (-1, 0, 1)
"""Samples by which a log may write the current late or early against the position."""


def _measure(records: list[Samples], bench: Bench) -> xr.DataTree:
    """Friction forward and backward from force_per_current * current(t - delay) = M a + F+ (or - F-).

    Which sample of the current belongs to which position a log does not say, and a drive that switches turns a delay of
    one sample into newtons; so does the mass. All of delay -1, 0, 1 and mass free or as published are fitted for every
    record: the value is the middle of all, the error half their range.
    """
    factor = bench.number("force_per_current")
    published = bench.maybe("mass")
    rows: list[dict[str, float]] = []
    notes = notes_of(records)
    for number, record in enumerate(records):
        smooth = jerk_spline(record.time, record["displacement"])
        step = float(np.median(np.diff(record.time)))
        for delay in DELAYS:
            drive = factor * np.interp(record.time - delay * step, record.time, record["current"])
            for mass in [None] if published is None else [None, published]:
                row = _fit(record, smooth, drive, mass, bench)
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
    free = [m for (_, fixed), m in mean.items() if fixed == 0.0]
    notes.append(
        f"friction hangs on a one-sample delay ({1e3 * step:.3g} ms) and on the mass: {low:.1f} ... {high:.1f} N (mean of "
        "forward and backward); the error covers them all"
    )
    notes.append(
        "by delay (samples), mass free: "
        + "; ".join(
            f"{m['delay']:+.0f}: M = {m['mass']:.2f} kg, forward {m['forward_force']:.2f}, backward "
            f"{m['backward_force']:.2f}, rest {m['residual']:.1f} N rms"
            for m in free
        )
    )
    if published is not None:
        notes.append(f"mass in the rig {published:g} kg, as fitted {best['mass']:.2f} kg")
    units = {"mass": "kg", "delay": "samples", "record": "1", "fixed_mass": "1"}
    choices = xr.Dataset({name: ("choice", values, {"units": units.get(name, "N")}) for name, values in table.items()})
    middle, error = (low + high) / 2, float(np.hypot((high - low) / 2, between))
    forward = [m["forward_force"] for m in mean.values()]
    backward = [m["backward_force"] for m in mean.values()]
    steady = xr.Dataset(
        {
            "slip_velocity": ("row", np.array([best["speed"], -best["speed"]]), {"units": "m/s"}),
            "force": ("row", np.array([sum(forward), -sum(backward)]) / len(mean), {"units": "N"}),
            "force_error": ("row", np.hypot([np.ptp(forward) / 2, np.ptp(backward) / 2], between), {"units": "N"}),
        }
    )
    return friction_tree(
        series=_series(records[0], factor, best, error) if len(records) == 1 else {},
        tables={"steady": steady, "choices": choices},
        source=", ".join(record.source for record in records),
        rig=bench.toml,
        notes=notes,
        facts={
            "force": middle,
            "force_error": error,
            "lowest": low,
            "highest": high,
            "best_delay": best["delay"],
            "forward_force": best["forward_force"],
            "backward_force": best["backward_force"],
            "mass": best["mass"],
            "residual": best["residual"],
            "drive": float(np.median(np.abs(factor * records[0]["current"]))),
        },
    )


def _fit(record: Samples, smooth: Smooth, drive: Array, mass: float | None, bench: Bench) -> dict[str, float]:
    """Least squares over the samples that move and are driven."""
    moving = np.abs(smooth.v) > bench.number("least_speed")
    driven = np.abs(record["current"]) > bench.number("least_current")
    use = moving & driven
    use[:10] = use[-10:] = False  # the smoothing is loose at its ends
    if np.count_nonzero(use) < 20:
        raise InputError(
            f"{record.source}: {np.count_nonzero(use)} samples move faster than least_speed and are driven by more than "
            "least_current; lower these or record longer"
        )
    sides = np.stack([smooth.v > 0, smooth.v < 0], axis=1)[use] * np.array([1.0, -1.0])
    a, force = smooth.a[use], drive[use]
    if mass is None:
        found = np.linalg.lstsq(np.column_stack([sides, a]), force, rcond=None)[0]
        forward, backward, mass = (float(value) for value in found)
    else:
        forward, backward = (float(value) for value in np.linalg.lstsq(sides, force - mass * a, rcond=None)[0])
    rest = force - mass * a - sides @ np.array([forward, backward])
    return {
        "mass": mass,
        "forward_force": forward,
        "backward_force": backward,
        "residual": float(np.sqrt(np.mean(rest**2))),
        "speed": float(np.mean(np.abs(smooth.v[use]))),
    }


def _series(
    record: Samples, factor: float, best: dict[str, float], error: float
) -> dict[str, tuple[npt.NDArray[np.generic], str]]:
    smooth = jerk_spline(record.time, record["displacement"])
    step = float(np.median(np.diff(record.time)))
    drive = factor * np.interp(record.time - best["delay"] * step, record.time, record["current"])
    friction = drive - best["mass"] * smooth.a
    noise = np.hypot(best["residual"], error)
    return {
        "time": (record.time, "s"),
        "slip_velocity": (smooth.v, "m/s"),
        "slip_acceleration": (smooth.a, "m/s^2"),
        "force": (friction, "N"),
        "force_error": (np.full(len(friction), noise), "N"),
        "stuck": (np.zeros(len(friction), dtype=bool), "1"),
        "displacement": (smooth.x, "m"),
    }


MOTOR_CURRENT = Instrument(
    name="motor_current",
    channels={"current": ("current",), "displacement": ("length",)},
    optional={"velocity": ("speed",)},
    constants={
        "force_per_current": Constant(("force_per_current",), needed=True),
        "mass": Constant(("mass",), positive=True),
        "least_speed": Constant(("speed",), 0.02, positive=True),
        "least_current": Constant(("current",), 0.1, positive=True),
    },
    measure=_measure,
)
