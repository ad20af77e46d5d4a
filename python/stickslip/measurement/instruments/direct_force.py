"""An instrument in the line of the friction force: friction is its reading less inertia, over speed a loop."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr
from scipy.special import ndtr

from stickslip.errors import InputError
from stickslip.measurement.instruments.instrument import LEAST_SAMPLES, Bench, Constant, Instrument, Samples
from stickslip.measurement.instruments.scatter import median_and_error
from stickslip.measurement.regime import regime_of_slip
from stickslip.measurement.result import event_table, facts_of_runs, friction_tree
from stickslip.measurement.signals.clocks import (
    FEWEST_SLIPS,
    LEAST_CORRELATION,
    Lag,
    Offset,
    clock_offset,
    inertia_offset,
    lag_at_slips,
    lag_of_force,
)
from stickslip.measurement.signals.noise import lone_spikes, noise_level, stretches
from stickslip.measurement.signals.signs import unsigned
from stickslip.measurement.signals.smooth import jerk_spline
from stickslip.measurement.signals.spectra import main_line

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


OSCILLATOR = ("mass", "stiffness", "damping")
"""What the contact hangs on, where a law is to be set in motion: of a torsional record inertia, N m/rad and N m s/rad."""
QUARTILE = 0.3186
"""Of the size of a normal variable, in standard deviations."""
LEAST_LOAD = 0.01
"""Share of the largest normal force below which friction over normal force is not looked at."""
CLEAR = 3.0
"""Standard deviations of the speed at rest from which on a mass moves; of the force, from which on it falls."""


@dataclass(frozen=True)
class _Run:
    """One record turned into friction."""

    record: Samples
    w: Array
    w_error: Array
    acceleration: Array
    force: Array
    error: Array
    stuck: Mask
    lag: float
    between: float
    unit: str
    speed_unit: str
    notes: list[str]
    facts: dict[str, float | str]


class _DirectForce(Instrument):
    """Reads a second file on another clock where the rig names one, and the current of a motor as its force."""

    def bench(self, table: Mapping[str, Any], where: str) -> Bench:
        found = super().bench(table, where)
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

    def read(self, source: Any, bench: Bench) -> Samples:
        if not bench.companion:
            samples = super().read(source, bench)
            return _without_lag(_force_of_current(samples, samples, bench), bench)
        main = self._read_one(source, bench.channels, bench.read, bench.maybe("sampling_rate"))
        companion = self.read_companion(source, bench)
        return _join(_force_of_current(main, companion, bench), companion, bench)


def _force_of_current(samples: Samples, motion: Samples, bench: Bench) -> Samples:
    """The samples with the force, or the torque of a motor that turns, that the current of a motor stands for."""
    if "current" not in samples:
        return samples
    unit = "N m" if {"rad", "rad/s"} & set(motion.units.values()) else "N"
    force = bench.number("force_per_current") * samples["current"]
    channels = {name: values for name, values in samples.channels.items() if name != "current"} | {"force": force}
    return replace(samples, channels=channels, units={**samples.units, "force": unit})


def _without_lag(samples: Samples, bench: Bench) -> Samples:
    """The force at the times of the motion it belongs to, where the rig says by how much it is written late."""
    lag = bench.maybe("clock_offset")
    if not lag:
        return samples
    force = replace(samples, channels={"time": samples.time, "force": samples["force"]})
    note = f"the force was taken {lag:g} s later than the motion, as the rig says (clock_offset)"
    return replace(samples, channels=_common(force, samples, lag), notes=(*samples.notes, note))


def _common(force: Samples, motion: Samples, offset: float) -> dict[str, Array]:
    """The channels of the motion, and those of the force so much later, where both are there."""
    time = motion.time + offset
    inside = (time >= force.time[0]) & (time <= force.time[-1])
    if np.count_nonzero(inside) < LEAST_SAMPLES:
        raise InputError(
            f"{force.source}: with a clock_offset of {offset:g} s force and motion have {np.count_nonzero(inside)} samples "
            f"in common, at least {LEAST_SAMPLES} are needed; correct clock_offset"
        )
    taken = {name: np.interp(time[inside], force.time, force[name]) for name in force.channels if name != "time"}
    return motion.part(inside).channels | taken


def _join(force: Samples, motion: Samples, bench: Bench) -> Samples:
    """The force on the clock of the motion.

    Where the inertia is given the offset is that under which the force is inertia and friction of the motion: where inertia
    makes most of the force, its size has nothing of that of the speed.
    """
    name = "velocity" if "velocity" in motion else "displacement"
    if name not in motion:
        raise InputError(f"{motion.source}: the companion of a force record must hold displacement or velocity")
    given, inertia = bench.maybe("clock_offset"), bench.number("inertia")
    smooth = jerk_spline(motion.time, motion[name], cutoff=bench.maybe("cutoff"))
    speed, acceleration = (smooth.x, smooth.v) if name == "velocity" else (smooth.v, smooth.a)
    if inertia > 0:
        found = inertia_offset(force.time, force["force"], motion.time, speed, acceleration, inertia)
        alike = "force with inertia and friction"
    else:
        found = clock_offset(force.time, force["force"], motion.time, speed)
        alike = "force and speed"
        if given is None:
            _check_without_inertia(found, force, motion, speed, acceleration)
    if given is None and found.correlation < LEAST_CORRELATION:
        raise InputError(
            f"{force.source}: the offset between the clock of the force and that of {motion.source} cannot be told: the "
            f"correlation of {alike} is {found.correlation:.2f} at best, and {LEAST_CORRELATION:g} is needed; give "
            "clock_offset in the rig" + ("" if inertia > 0 else ", or the inertia between instrument and contact")
        )
    offset = found.value if given is None else given
    notes = [*force.notes, *motion.notes]
    seen = f"{found.value:.3g} +- {found.error:.1g} s by the correlation ({found.correlation:.2f}) of {alike}"
    if given is None:
        notes.append(f"the clock of the force is ahead of that of the motion by {seen}; this was used")
    else:
        notes.append(
            f"the clock of the force is ahead of that of the motion by {given:g} s as the rig says; it is {seen}"
        )
        if abs(given - found.value) > 3 * found.error:
            notes.append("the offset of the rig contradicts the records: look at both")
    units, source = {**motion.units, **force.units}, f"{force.source}, {motion.source}"
    return Samples(_common(force, motion, offset), units, source, tuple(notes), scale_error=motion.scale_error)


def _check_without_inertia(found: Offset, force: Samples, motion: Samples, speed: Array, acceleration: Array) -> None:
    """Refuse an offset that makes inertia pass for friction: a motion to and fro fits either, a part of a period apart."""
    clocks = force.time, force["force"], motion.time, speed, acceleration
    without, free = inertia_offset(*clocks, 0.0), inertia_offset(*clocks, None)
    apart = abs(free.value - found.value) > 3 * math.hypot(free.error, found.error)
    if apart and 1 - free.correlation**2 < 0.5 * (1 - without.correlation**2):
        raise InputError(
            f"{force.source}: the offset between the clock of the force and that of {motion.source} cannot be told: by force "
            f"and speed it is {found.value:.3g} s, but with inertia in the force {free.value:.3g} s fits better; give "
            "clock_offset in the rig, or the inertia between instrument and contact"
        )


def _measure(records: list[Samples], bench: Bench) -> xr.DataTree:
    """Friction over slip velocity, on the way up and on the way down, with the sticks where a speed for them is given.

    friction = force - inertia * acceleration (over the normal force, where there is one). `steady` holds the medians in
    bins of the slip velocity, apart for speeding up and slowing down; their errors come from the scatter over ten
    consecutive stretches of the record.
    """
    runs = [_run(record, bench) for record in records]
    tables = [_loop(run, bench) for run in runs]
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
        children["break_away"] = _break_aways(run)
    series: dict[str, tuple[npt.NDArray[Any], str]] = {}
    if len(runs) == 1:
        series = {
            "time": (run.record.time, "s"),
            "slip_velocity": (run.w, run.speed_unit),
            "slip_velocity_error": (run.w_error, run.speed_unit),
            "slip_acceleration": (run.acceleration, run.speed_unit + "^2"),
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
        rig=bench.toml,
        notes=run.notes
        if len(runs) == 1
        else [f"{Path(run.record.source).name}: {note}" for run in runs for note in run.notes],
        facts=run.facts
        if len(runs) == 1
        else facts_of_runs([run.record.source for run in runs], [float(run.facts["force"]) for run in runs]),
    )


def _run(record: Samples, bench: Bench) -> _Run:
    notes = list(record.notes)
    motion = _motion(record, bench)
    notes.append(f"speed and acceleration are smoothed with a cut-off of {motion.cutoff:.3g} Hz")
    spikes = lone_spikes(record["force"], noise_level(record["force"]), motion.w)
    if spikes.any():
        notes.append(
            f"{np.count_nonzero(spikes)} isolated impulses of the force ({100 * spikes.mean():.2g} % of the samples) "
            "were left out"
        )
        record, motion = record.part(~spikes), motion.part(~spikes)
    force, inertia, unit = record["force"], bench.number("inertia"), record.units["force"]
    notes += _said_of_lag(record, motion, bench)
    friction = force - inertia * motion.acceleration
    notes += unsigned(motion.w, friction, record.source)
    accelerated = np.hypot(motion.acceleration_error, record.scale_error * motion.acceleration)
    error = np.hypot(noise_level(force), inertia * accelerated)
    if inertia == 0.0:
        highest = np.quantile(np.abs(motion.acceleration), 0.99)
        notes.append(
            "inertia is 0: the instrument's reading is taken as friction, so what lies between instrument and contact and is "
            f"accelerated (up to {highest:.3g} {motion.unit[:-2]}/s^2) is in it"
            + ("; the mass in the rig is what swings, and nothing is taken off for it" if bench.maybe("mass") else "")
        )
    if "normal_force" in record:
        pressed = _pressed(record, notes)
        record, motion = record.part(pressed), motion.part(pressed)
        normal = record["normal_force"]
        friction, error, unit = friction[pressed] / normal, error[pressed] / normal, "1"
    level = bench.maybe("stuck_speed")
    stuck = np.zeros(len(motion.w), dtype=bool) if level is None else _stuck(motion.w, level, motion.w_error)
    step = float(np.median(np.diff(record.time)))
    lag = _lag_at_slips(record, motion, stuck)
    offset = bench.maybe("clock_offset") or 0.0
    if lag is not None and abs(lag.value) > max(0.5 * step, 5 * lag.error):
        notes.append(_slip_lag_note(lag, offset))
    # a force that was taken later by no whole number of steps lies between its samples by this share of a step
    between = 0.0 if bench.companion else (offset / step) % 1
    facts = _levels(motion, friction, bench)
    if level is not None:
        facts |= _slow(record.time, motion.w, stuck, level) | {"break_away_late": _late(lag, step)}
    facts |= _given(record, bench, float(facts["force"]), notes)
    return _Run(
        *(record, motion.w, motion.w_error, motion.acceleration, friction, error, stuck),
        *(0.0 if lag is None else lag.value, between, unit, motion.unit, notes, facts),
    )


@dataclass(frozen=True)
class _Motion:
    """Speed and acceleration with their errors, the unit of the speed, and the cut-off of what smoothed them."""

    w: Array
    w_error: Array
    acceleration: Array
    acceleration_error: Array
    unit: str
    cutoff: float

    def part(self, kept: Mask) -> _Motion:
        names = ("w", "w_error", "acceleration", "acceleration_error")
        return replace(self, **{name: getattr(self, name)[kept] for name in names})


def _motion(record: Samples, bench: Bench) -> _Motion:
    """The motion of a record, from its speed or its displacement."""
    name = "velocity" if "velocity" in record else "displacement"
    if name not in record:
        raise InputError(f"{record.source}: a direct_force instrument needs a column of displacement or of velocity")
    smooth, unit = jerk_spline(record.time, record[name], cutoff=bench.maybe("cutoff")), record.units[name]
    if name == "velocity":
        motion = _Motion(smooth.x, smooth.x_error, smooth.v, smooth.v_error, unit, smooth.cutoff)
    else:
        unit = "m/s" if unit == "m" else "rad/s"
        motion = _Motion(smooth.v, smooth.v_error, smooth.a, smooth.a_error, unit, smooth.cutoff)
    if not (np.abs(motion.w) > 0).any():
        raise InputError(
            f"{record.source}: nothing moves in this record, so it holds no friction of slip; take another"
        )
    return motion


def _said_of_lag(record: Samples, motion: _Motion, bench: Bench) -> list[str]:
    """What is said of a force that is late or early against the motion, if it is."""
    position = _of_position(record, motion)
    lag = lag_of_force(record.time, record["force"], motion.w, motion.acceleration, position)
    if lag is None:
        return []
    return [_lag_note(lag, bench.maybe("clock_offset") or 0.0, record.units["force"], motion.unit)]


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
            f"less than {100 * LEAST_LOAD:g} % of the largest, so that friction over normal force says nothing"
        )
    return pressed


def _levels(motion: _Motion, friction: Array, bench: Bench) -> dict[str, float | str]:
    """The friction of fast slip in either sense, and the ranges of speed and friction."""
    w, share = motion.w, bench.number("fast_share")
    fast = bench.maybe("fast_speed")
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


def _slow(time: Array, w: Array, stuck: Mask, level: float) -> dict[str, float | str]:
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


def _given(record: Samples, bench: Bench, force: float, notes: list[str]) -> dict[str, float | str]:
    """What the rig and further columns say, the pull of actuators beside the friction `force`."""
    facts: dict[str, float | str] = {}
    actuators = [record[name] for name in ("actuator_1", "actuator_2") if name in record]
    if actuators:
        pull = float(np.mean(sum(actuators)))
        facts["actuator_force"] = pull
        part = f"; friction is {force / pull:.3g} times that" if pull else ""
        notes.append(f"the actuators pull with {pull:.4g} N together in the mean{part}")
    if "normal_force" not in record:
        facts["subtracted_inertia"] = bench.number("inertia")
    for name in OSCILLATOR:
        if bench.maybe(name):
            facts[name] = bench.number(name)
    if "drive_velocity" in record:
        drive = record["drive_velocity"]
        seen = np.isfinite(drive)
        facts["drive_velocity"] = float(np.median(drive[seen])) if seen.any() else math.nan
        if not seen.all():
            missing = 100 * np.mean(~seen)
            notes.append(f"the drive's speed has drop-outs in {missing:.1f} % of the samples; they are masked")
    return facts


def _path(time: Array, w: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum((w[1:] + w[:-1]) / 2 * np.diff(time))])


def _of_position(record: Samples, motion: _Motion) -> Array:
    """What of the force may follow the position to and fro: a spring, and of an angle the gravity of an arm, (n, 0 to 3)."""
    w = motion.w
    if not ((w > 0).any() and (w < 0).any()):
        return np.empty((len(w), 0))
    position = record["displacement"] if "displacement" in record else _path(record.time, w)
    of_angle = [np.sin(position), np.cos(position)] if motion.unit == "rad/s" else []
    return np.stack([position, *of_angle], axis=1)


def _lag_note(lag: Lag, offset: float, unit: str, speed_unit: str) -> str:
    sense = "late" if lag.value > 0 else "early"
    delay = f"a delay of the channel, which clock_offset = {lag.value + offset:.3g} in the rig takes out"
    shifted = "friction over speed is one curve for speeding up and for slowing down"
    scatter = f"it scatters by {lag.after:.3g} {unit}, now by {lag.before:.3g} {unit}"
    by = f"by {abs(lag.value):.3g} +- {lag.error:.1g} s"
    if math.isnan(lag.distance):
        return (
            f"the force is {sense} against the motion {by}: so shifted, {shifted} ({scatter}). It is {delay}, or friction "
            "that builds up over a distance at each reversal"
        )
    return (
        f"after each reversal the force changes late against the motion {by}, or over a path of {lag.distance:.2g} "
        f"{speed_unit[:-2]}: shifted by either, {shifted} ({scatter}). It is friction that builds up over a distance "
        f"(presliding, a soft mount), or {delay}; this record does not tell one from the other, a motion with accelerations "
        "of other sizes does"
    )


def _lag_at_slips(record: Samples, motion: _Motion, stuck: Mask) -> Offset | None:
    """The lag of the force against the slips between sticks, each with half of the sticks beside it; all one way.

    One whose error is larger than half a step and than a fifth of itself is not told.
    """
    w, sticks = motion.w, stretches(stuck)
    middles = [(first + last) // 2 for first, last in sticks]
    ways = {bool(np.mean(w[one[1] : other[0]]) > 0) for one, other in pairwise(sticks) if one[1] < other[0]}
    if len(middles) <= FEWEST_SLIPS or len(ways) != 1:
        return None
    force = jerk_spline(record.time, record["force"], cutoff=motion.cutoff).x
    accelerations = motion.acceleration, motion.acceleration_error
    lag = lag_at_slips(record.time, force, _path(record.time, w), w, *accelerations, list(pairwise(middles)))
    least = 0.5 * float(np.median(np.diff(record.time)))
    return None if lag is None or lag.error > max(least, 0.2 * abs(lag.value)) else lag


def _slip_lag_note(lag: Offset, offset: float) -> str:
    late, when = ("late", "after") if lag.value > 0 else ("early", "before")
    return (
        f"the force is {late} against the motion by {abs(lag.value):.3g} +- {lag.error:.1g} s: where the mass begins and "
        f"ends to slip, the force changes so long {when} the speed. clock_offset = {lag.value + offset:.3g} in the rig "
        "takes it out; the errors of all break-aways hold what the force may change in that time"
    )


def _late(lag: Offset | None, step: float) -> float:
    """Standard error in s that the time of the force has in common at all break-aways.

    A record whose samples are in step with its slips misses each highest force by the same part of a step.
    """
    return step if lag is None else math.hypot(lag.value, lag.error, step / math.sqrt(12))


def _stuck(w: Array, level: float, error: Array) -> Mask:
    """Slower than `level`, for three samples at least, holes closed where the speed stays below twice the level.

    On a soft spring a mass takes long to reach that speed, so each end moves to where the speed leaves what it scatters by
    at rest.
    """
    slow, near = np.abs(w) < level, np.abs(w) < 2 * level
    stuck = slow.copy()
    for first, last in stretches(near):
        inside = np.flatnonzero(slow[first:last])
        if len(inside):
            stuck[first + inside[0] : first + inside[-1] + 1] = True
    for first, last in stretches(stuck):
        at_rest = max(float(np.quantile(np.abs(w[first:last]), 0.25)) / QUARTILE, float(np.median(error[first:last])))
        resting = first + np.flatnonzero(np.abs(w[first:last]) < CLEAR * at_rest)
        stuck[first:last] = False
        if resting.size:
            stuck[resting[0] : resting[-1] + 1] = True
    for first, last in stretches(stuck):
        if last - first < 3:
            stuck[first:last] = False
    return stuck


def _unseen(w: Array, time: Array, moves: int, way: int) -> float:
    """How long before its first sample `moves` that is seen to move the mass may have moved, time counted in this way.

    Where the speed grows as a power of the time since then, it doubles twice in times that tell it.
    """
    speed = np.abs(w[moves:] if way > 0 else w[moves::-1])
    times = np.abs((time[moves:] if way > 0 else time[moves::-1]) - time[moves])
    reached = [np.flatnonzero(speed >= factor * speed[0]) for factor in (2.0, 4.0)]
    if not all(one.size for one in reached):
        return 0.0
    once, twice = (float(times[one[0]]) for one in reached)
    ratio = (twice - once) / once if once > 0 else 0.0
    return once / (ratio - 1) if ratio > 1 else once


def _excess(force: Array, noise: float) -> float:
    """By how much the highest sample of a stick is expected to lie above its highest force: more the longer it is near that.

    The force is taken from straight lines over an eighth of the stick, the noise as normal and independent.
    """
    from scipy.signal import savgol_filter  # loads for half a second

    if len(force) < 3 or not noise > 0:
        return 0.0
    smooth = savgol_filter(force, max(len(force) // 8, 3), 1)
    top = float(smooth.max())
    level = np.linspace(top - 4 * noise, top + 6 * noise, 200)
    below = np.prod(ndtr((level[:, None] - smooth[smooth > top - 8 * noise]) / noise), axis=1)
    return float(level[-1] - np.trapezoid(below, level)) - top


def _loop(run: _Run, bench: Bench) -> xr.Dataset:
    """Medians in bins of speed, apart for speeding up and slowing down."""
    edges = np.linspace(run.w.min(), run.w.max(), int(bench.number("bins")) + 1)
    speeding = run.acceleration * np.sign(run.w) > 0
    rows: list[tuple[float, float, float, float]] = []
    branch: list[str] = []
    for low, high in pairwise(edges.tolist()):
        inside = (run.w >= low) & (run.w <= high) & ~run.stuck
        for mask, name in ((inside & speeding, "speeding_up"), (inside & ~speeding, "slowing_down")):
            count = int(np.count_nonzero(mask))
            if count < 10:
                continue
            value, error = median_and_error(run.force[mask])
            rows.append((float(np.median(run.w[mask])), value, error, float(count)))
            branch.append(name)
    values = np.array(rows).reshape(-1, 4)
    return xr.Dataset(
        {
            "slip_velocity": ("row", values[:, 0], {"units": run.speed_unit}),
            "force": ("row", values[:, 1], {"units": run.unit}),
            "force_error": ("row", values[:, 2], {"units": run.unit}),
            "samples": ("row", values[:, 3], {"units": "1"}),
            "branch": ("row", branch),
            "source": ("row", [run.record.source] * len(branch)),
        }
    )


def _break_aways(run: _Run) -> xr.Dataset:
    """One row for each stick that ends inside the record: the force is its largest size in the stick, less noise.

    The largest sample lies below the peak by half the height of the triangle that the force may have made between two
    samples, in the mean; one between two samples of a force that was taken later lies lower still.
    """
    time, force = run.record.time, run.force
    noise, scatter = float(np.median(run.error)), noise_level(force)
    sticks = stretches(run.stuck)
    rows: list[list[float]] = []
    for number, (first, last) in enumerate(sticks):
        if last >= len(time):
            continue
        ends = [_unseen(run.w, time, last, 1), _unseen(run.w, time, first - 1, -1) if first > 0 else 0.0]
        step = float(time[last] - time[last - 1])
        inside = force[first : last + 1]
        sense = 1.0 if inside[-1] >= 0 else -1.0
        # a late force begins the stick with that of the slip before it, which is no loading
        t, f = time[first : last + 1] - time[first], np.interp(time[first : last + 1] + run.lag, time, force)
        # nor is the fall behind its highest force
        loaded = int(np.argmax(sense * f)) + 1
        loading = slice(loaded if loaded > max(len(t) // 2, 2) else None)
        rate = float(np.polyfit(t[loading], f[loading], 1)[0])
        top = first + int(np.argmax(sense * inside))
        fall = max(sense * (force[top] - force[min(top + 1, len(force) - 1)]) - CLEAR * scatter, 0.0)
        rise = max(sense * rate * step, 0.0)
        missed = rise * fall / (rise + fall) / 2 if fall > 0 else 0.0
        after = sense * (force[top] - force[min(top + 2, len(force) - 1)])
        missed += min((1 - run.between) * rise, run.between * max(after - CLEAR * scatter, 0.0))
        peak = (float(np.max(sense * inside)) - _excess(sense * inside, scatter) + missed) * sense
        rest = f - np.polyval(np.polyfit(t, f, 1), t)
        following = sticks[number + 1][0] if number + 1 < len(sticks) else len(time)
        drop = abs(peak) - float(np.min(sense * force[last:following]))
        force_error = math.hypot(
            noise, abs(rate) * step / math.sqrt(12), abs(rate) * float(run.facts["break_away_late"])
        )
        stick_time = float(time[last] - time[first]) if first > 0 else math.nan
        spread = float(np.sqrt(np.sum(rest**2) / max(len(t) - 2, 1) / np.sum((t - t.mean()) ** 2)))
        values = (float(time[last]), stick_time, rate, peak, drop)
        late, early = (math.hypot(step, end) for end in ends)
        errors = (late, math.hypot(late, early), spread, force_error, math.sqrt(2) * force_error)
        rows.append([number for pair in zip(values, errors, strict=True) for number in pair])
    return event_table(rows, run.unit)


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
        "force_per_current": Constant(("force_per_current", "torque_per_current")),
        "inertia": Constant(("mass", "inertia"), 0.0),
        "stuck_speed": Constant(("speed", "angular_speed"), positive=True),
        "fast_speed": Constant(("speed", "angular_speed"), positive=True),
        "fast_share": Constant(("ratio",), 0.6, share=True),
        "bins": Constant(("ratio",), 12.0, count=True),
        "cutoff": Constant(("ratio",), positive=True),
        "clock_offset": Constant(("time",)),
        "mass": Constant(("mass", "inertia"), positive=True),
        "stiffness": Constant(("stiffness", "torsional_stiffness"), positive=True),
        "damping": Constant(("damping", "torsional_damping"), 0.0),
    },
    measure=_measure,
    instead={"force": "current"},
)
