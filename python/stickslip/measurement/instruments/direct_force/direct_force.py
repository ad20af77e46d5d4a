"""An instrument in the line of the friction force: friction is its reading less inertia, over speed a loop."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from stickslip.errors import InputError
from stickslip.files.arrays import Array, Mask, taken
from stickslip.files.schema import Count, Share, any_number, positive
from stickslip.measurement.instruments.direct_force.direct_run import DirectMotion, DirectRun, motion_of
from stickslip.measurement.instruments.direct_force.force_clock import (
    force_of_current,
    on_one_clock,
    without_stated_lag,
)
from stickslip.measurement.instruments.direct_force.force_lag import (
    lag_between_sticks,
    late_error,
    notes_on_lag,
    notes_on_lag_between_sticks,
)
from stickslip.measurement.instruments.direct_force.speed_sticks import break_aways_of, stuck_samples
from stickslip.measurement.instruments.errors_of_means import median_and_error
from stickslip.measurement.instruments.instrument import LEAST_SAMPLES, Constant, Instrument, InstrumentRig, Samples
from stickslip.measurement.regime import regime_of_slip
from stickslip.measurement.result import facts_of_runs, friction_tree
from stickslip.measurement.signals.noise import lone_spikes, noise_level
from stickslip.measurement.signals.reading_faults import saturated
from stickslip.measurement.signals.signs import notes_on_signs
from stickslip.measurement.signals.spectra import main_line

OSCILLATOR = ("mass", "stiffness", "damping")
"""What the contact hangs on, where a law is to be set in motion: of a torsional record inertia, N m/rad and N m s/rad."""
LEAST_LOAD = 0.01
"""Share of the largest normal force below which friction over normal force is not looked at."""


class _DirectForce(Instrument):
    """Reads a second file on another clock where the rig names one, and the current of a motor as its force."""

    def rig_of(self, table: Mapping[str, Any], where: str) -> InstrumentRig:
        found = super().rig_of(table, where)
        named = {**found.channels, **found.companion_channels}
        factor = found.maybe("force_per_current")
        if "current" in named and "force" in named:
            raise InputError(f"{where}: [columns] names both force and current; leave one of them out")
        if ("current" in named) != (factor is not None):
            raise InputError(
                f"{where}: force_per_current is missing; add a line `force_per_current = ...`, such as 0.07 N m/A"
                if factor is None
                else f"{where}: [columns] lacks current, which force_per_current turns into force; name its column"
            )
        return found

    def read(self, source: Any, rig: InstrumentRig) -> Samples:
        if not rig.companion:
            samples = super().read(source, rig)
            return without_stated_lag(force_of_current(samples, samples, rig), rig)
        main = self._read_one(source, rig.channels, rig.read, rig.maybe("sampling_rate"))
        companion = self.read_companion(source, rig)
        return on_one_clock(force_of_current(main, companion, rig), companion, rig)


def _measure(records: list[Samples], rig: InstrumentRig) -> xr.DataTree:
    """Friction over slip velocity, on the way up and on the way down, with the sticks where a speed for them is given.

    friction = force - inertia * acceleration (over the normal force, where there is one). `steady` holds the medians in
    bins of the slip velocity, apart for speeding up and slowing down; their errors come from the scatter over ten
    consecutive stretches of the record.
    """
    runs = [_run(record, rig) for record in records]
    tables = [_loop(run, rig) for run in runs]
    steady = xr.concat(tables, dim="row") if len(tables) > 1 else tables[0]
    names = ["forward_force", "forward_error", "backward_force", "backward_error", "peak_force"]
    if all("actuator_force" in run.facts for run in runs):
        names.append("actuator_force")
    levels = xr.Dataset(
        {name: ("run", np.array([float(run.facts[name]) for run in runs]), {"units": runs[0].unit}) for name in names}
        | {"source": ("run", [run.record.source for run in runs])}
    )
    children = {"steady": steady, "levels": levels}
    run = runs[0]
    if len(runs) == 1:
        children["break_away"] = break_aways_of(run)
    series: dict[str, tuple[npt.NDArray[Any], str]] = {}
    if len(runs) == 1:
        series = {
            "time": (run.record.time, "s"),
            "slip_velocity": (run.motion.w, f"{run.motion.length}/s"),
            "slip_velocity_error": (run.motion.w_error, f"{run.motion.length}/s"),
            "slip_acceleration": (run.motion.acceleration, f"{run.motion.length}/s^2"),
            "force": (run.force, run.unit),
            "force_error": (run.error, run.unit),
            "stuck": (run.stuck, "1"),
        }
        # That of an oscillator is the extension of its spring, which this is not.
        if "displacement" in run.record and "stiffness" not in run.facts:
            series["displacement"] = (run.record["displacement"], run.record.units["displacement"])
    return friction_tree(
        series=series,
        tables=children,
        source="; ".join(run.record.source for run in runs),
        rig=rig.toml,
        notes=run.notes
        if len(runs) == 1
        else [f"{Path(run.record.source).name}: {note}" for run in runs for note in run.notes],
        facts=run.facts
        if len(runs) == 1
        else facts_of_runs([run.record.source for run in runs], [float(run.facts["force"]) for run in runs]),
    )


def _run(record: Samples, rig: InstrumentRig) -> DirectRun:
    notes = list(record.notes)
    motion = motion_of(record, rig)
    notes.append(f"speed and acceleration are smoothed with a cut-off of {motion.cutoff:.3g} Hz")
    beyond = saturated(record["force"])
    if beyond.any():
        if np.count_nonzero(~beyond) < LEAST_SAMPLES:
            raise InputError(
                f"{record.source}: the force stands at the end of its range in {np.count_nonzero(beyond)} of {len(beyond)} "
                "samples, too many; widen the range"
            )
        notes.append(
            f"{np.count_nonzero(beyond)} samples ({100 * beyond.mean():.2g} %) at the end of the range of the force were "
            "left out: friction is larger there than any reading"
        )
        record, motion = record.part(~beyond), taken(motion, ~beyond)
    spikes = lone_spikes(record["force"], noise_level(record["force"]), motion.w)
    if spikes.any():
        notes.append(
            f"{np.count_nonzero(spikes)} isolated impulses of the force ({100 * spikes.mean():.2g} % of the samples) "
            "were left out"
        )
        record, motion = record.part(~spikes), taken(motion, ~spikes)
    force, inertia, unit = record["force"], rig.number("inertia"), record.units["force"]
    clock_offset = rig.maybe("clock_offset") or 0.0
    notes += notes_on_lag(record, motion, clock_offset)
    friction = force - inertia * motion.acceleration
    notes += notes_on_signs(motion.w, friction, record.source)
    accelerated = np.hypot(motion.acceleration_error, record.scale_error * motion.acceleration)
    error = np.hypot(noise_level(force), inertia * accelerated)
    if inertia == 0.0:
        highest = np.quantile(np.abs(motion.acceleration), 0.99)
        notes.append(
            "inertia is 0: the instrument's reading is taken as friction, so what lies between instrument and contact and is "
            f"accelerated (up to {highest:.3g} {motion.length}/s^2) is in it"
            + ("; the mass in the rig is what swings, and nothing is taken off for it" if rig.maybe("mass") else "")
        )
    if "normal_force" in record:
        pressed = _pressed(record, notes)
        record, motion = record.part(pressed), taken(motion, pressed)
        normal = record["normal_force"]
        friction, error, unit = friction[pressed] / normal, error[pressed] / normal, "1"
    level = rig.maybe("stuck_speed")
    stuck = np.zeros(len(motion.w), dtype=bool) if level is None else stuck_samples(motion.w, level, motion.w_error)
    step = float(np.median(np.diff(record.time)))
    lag = lag_between_sticks(record, motion, stuck)
    notes += notes_on_lag_between_sticks(lag, clock_offset, step)
    # a force that was taken later by no whole number of steps lies between its samples by this share of a step
    between = 0.0 if rig.companion else (clock_offset / step) % 1
    facts = _levels(motion, friction, rig)
    if level is not None:
        facts |= _slow_slip(record.time, motion.w, stuck, level) | {"break_away_late": late_error(lag, step)}
    facts |= _stated(record, rig, float(facts["force"]), notes)
    late = 0.0 if lag is None else lag.value
    return DirectRun(record, motion, friction, error, stuck, late, between, unit, notes, facts)


def _pressed(record: Samples, notes: list[str]) -> Mask:
    """The samples whose normal force friction can be divided by; those that are left out are said in the notes."""
    normal = record["normal_force"]
    pressed: Mask = normal > LEAST_LOAD * np.quantile(np.abs(normal), 0.95)
    if np.count_nonzero(pressed) < LEAST_SAMPLES:
        raise InputError(
            f"{record.source}: the normal force is above zero in {np.count_nonzero(pressed)} of {len(normal)} samples, and "
            f"{LEAST_SAMPLES} are needed; correct its sign or its zero in the rig"
        )
    if not pressed.all():
        notes.append(
            f"{np.count_nonzero(~pressed)} of {len(normal)} samples are left out: their normal force is zero, negative or "
            f"less than {100 * LEAST_LOAD:g} % of the largest, so that friction over normal force has no meaning"
        )
    return pressed


def _levels(motion: DirectMotion, friction: Array, rig: InstrumentRig) -> dict[str, float | str]:
    """The friction of fast slip in either sense, and the ranges of speed and friction."""
    w, share = motion.w, rig.number("fast_share")
    fast = rig.maybe("fast_speed")
    fast = share * float(np.max(np.abs(w))) if fast is None else fast
    forward = median_and_error(friction[w > fast])
    backward = median_and_error(friction[w < -fast])
    facts: dict[str, float | str] = {
        "forward_force": forward[0],
        "forward_error": forward[1],
        "backward_force": backward[0],
        "backward_error": backward[1],
        "peak_force": float(np.quantile(np.abs(friction), 0.99)),
        "fast_speed": fast,
        "lowest_speed": float(w.min()),
        "highest_speed": float(w.max()),
        "lowest_force": float(friction.min()),
        "highest_force": float(friction.max()),
        "cutoff": motion.cutoff,
    }
    if not math.isnan(forward[0]) and not math.isnan(backward[0]):
        facts["force"] = (forward[0] - backward[0]) / 2
        facts["offset"] = (forward[0] + backward[0]) / 2
        facts["force_error"] = math.hypot(forward[1], backward[1]) / 2
    else:
        facts["force"], facts["force_error"] = forward if not math.isnan(forward[0]) else backward
    return facts


def _slow_slip(time: Array, w: Array, stuck: Mask, level: float) -> dict[str, float | str]:
    """What slip below the speed of a stick says of the regime."""
    share = float(np.average(stuck[:-1], weights=np.diff(time)))
    line = main_line(w, float(np.mean(np.diff(time))))
    return {
        "stuck_share": share,
        "slow_share": float(np.mean(np.abs(w) < level)),
        "main_line": line.frequency,
        "main_line_error": line.error,
        "regime": regime_of_slip(w, share, share > 0.02, level),
    }


def _stated(record: Samples, rig: InstrumentRig, force: float, notes: list[str]) -> dict[str, float | str]:
    """What the rig and further columns say, the pull of actuators beside the friction `force`."""
    facts: dict[str, float | str] = {}
    actuators = [record[name] for name in ("actuator_1", "actuator_2") if name in record]
    if actuators:
        pull = float(np.mean(sum(actuators)))
        facts["actuator_force"] = pull
        part = f"; friction is {force / pull:.3g} times that" if pull else ""
        notes.append(f"the actuators pull with {pull:.4g} N together in the mean{part}")
    if "normal_force" not in record:
        facts["subtracted_inertia"] = rig.number("inertia")
    for name in OSCILLATOR:
        if rig.maybe(name):
            facts[name] = rig.number(name)
    if "drive_velocity" in record:
        drive = record["drive_velocity"]
        seen = np.isfinite(drive)
        facts["drive_velocity"] = float(np.median(drive[seen])) if seen.any() else math.nan
        if not seen.all():
            missing = 100 * np.mean(~seen)
            notes.append(f"the drive's speed has drop-outs in {missing:.1f} % of the samples; they are masked")
    return facts


def _loop(run: DirectRun, rig: InstrumentRig) -> xr.Dataset:
    """Medians in bins of speed, apart for speeding up and slowing down."""
    w = run.motion.w
    edges = np.linspace(w.min(), w.max(), int(rig.number("bins")) + 1)
    speeding = run.motion.acceleration * np.sign(w) > 0
    rows: list[tuple[float, float, float, float]] = []
    branch: list[str] = []
    for low, high in pairwise(edges.tolist()):
        inside = (w >= low) & (w <= high) & ~run.stuck
        for mask, name in ((inside & speeding, "speeding_up"), (inside & ~speeding, "slowing_down")):
            count = int(np.count_nonzero(mask))
            if count < 10:
                continue
            value, error = median_and_error(run.force[mask])
            rows.append((float(np.median(w[mask])), value, error, float(count)))
            branch.append(name)
    values = np.array(rows).reshape(-1, 4)
    return xr.Dataset(
        {
            "slip_velocity": ("row", values[:, 0], {"units": f"{run.motion.length}/s"}),
            "force": ("row", values[:, 1], {"units": run.unit}),
            "force_error": ("row", values[:, 2], {"units": run.unit}),
            "samples": ("row", values[:, 3], {"units": "1"}),
            "branch": ("row", branch),
            "source": ("row", [run.record.source] * len(branch)),
        }
    )


DIRECT_FORCE = _DirectForce(
    name="direct_force",
    channels={"force": ("force", "torque", "pressure", "ratio")},
    optional={
        "current": ("current",),
        "displacement": ("length", "angle"),
        "velocity": ("speed", "angular_speed"),
        "normal_force": ("force", "pressure"),
        "drive_velocity": ("speed", "angular_speed"),
        "actuator_1": ("force",),
        "actuator_2": ("force",),
    },
    constants={
        "force_per_current": Constant(any_number("force_per_current", "torque_per_current")),
        "inertia": Constant(any_number("mass", "inertia"), 0.0),
        "stuck_speed": Constant(positive("speed", "angular_speed")),
        "fast_speed": Constant(positive("speed", "angular_speed")),
        "fast_share": Constant(Share, 0.6),
        "bins": Constant(Count, 12),
        "cutoff": Constant(positive("ratio")),
        "clock_offset": Constant(any_number("time")),
        "mass": Constant(positive("mass", "inertia")),
        "stiffness": Constant(positive("stiffness", "torsional_stiffness")),
        "damping": Constant(any_number("damping", "torsional_damping"), 0.0),
    },
    measure=_measure,
    instead={"force": "current"},
)
