"""Where a record and its rig contradict each other: refused where nothing could be measured, else said."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from stickslip.errors import InputError
from stickslip.files.units import unit_suffix
from stickslip.measurement.indirect.force import Friction, likeliest_inertia, restoring_excess
from stickslip.measurement.indirect.stick_limits import BLUR, FEW_PER_PERIOD
from stickslip.measurement.read import LEAST_SAMPLES, Record
from stickslip.measurement.rigs.rig import Rig, RigUnits
from stickslip.measurement.signals.noise import MAD_TO_SIGMA, line_excess, mains_hum
from stickslip.measurement.signals.piecewise_fit import OscillatorConstants
from stickslip.measurement.signals.presmooth import Presmoothed, natural_period
from stickslip.measurement.signals.sample_runs import runs_of
from stickslip.measurement.signals.spectra import Line
from stickslip.measurement.signals.turning_points import Flanks

Array = npt.NDArray[np.float64]

MOSTLY_SLOW = 0.4
"""Share of slow time below which the main line of a record is that of the oscillator."""

LEAST_PER_PERIOD = 6
"""Samples that the free mass must give in a period for its acceleration to be seen."""

STANDS, DRIVEN = 0.1, 0.5
"""Parts of its speed below which a drive that stops is seen to move the spring, and above which it does just before."""
LASTING = 1.5
"""A drive that stops does so for longer than that many cycles of the motion."""
FEWEST_OF_RISE, FEWEST_RISES = 6, 3
"""Fewest samples of a rise that tell its slope, and rises that tell a speed of the drive."""
SWING_OFF, SWING_ERRORS = 0.02, 4.0
"""Part by which the frequency of the slips must lie from sqrt(k/m)/2pi to be named, and standard errors."""
CHANGES, APART = 0.1, 6.0
"""Speeds of a drive differ by that part, and by so many times what the slopes of rises scatter."""
TRAVELS, LONG = 0.1, 5.0
"""A position that moves on with the drive, to that part, for more periods of the free mass is no stretch of a spring."""
RISES = 30.0
"""No mass that a drive drags along rises so many times faster than the drive."""


def check_sampling(record: Record, rig: Rig) -> None:
    """Refuse samples too far apart for the free mass of the rig, as with stamps in another unit of time."""
    if record.step * rig.natural_frequency * LEAST_PER_PERIOD > 1:
        raise InputError(
            f"{record.source}: samples are {record.step:.3g} s apart, and by the rig's stiffness and mass the free mass "
            f"swings once in {1 / rig.natural_frequency:.3g} s; at least {LEAST_PER_PERIOD} samples a swing are needed: "
            "correct time_unit, stiffness or mass, or sample faster"
        )


def notes_on_few_samples(record: Record, oscillator: OscillatorConstants, units: RigUnits) -> list[str]:
    """Whether the samples are too few for break-aways to be placed to less than a sample."""
    period = natural_period(oscillator)
    if period >= FEW_PER_PERIOD * record.step:
        return []
    return [
        f"{period / record.step:.0f} samples in a period of the free mass: with fewer than {FEW_PER_PERIOD} a break-away may "
        f"be seen some {BLUR:g} samples ({BLUR * record.step:.2g}{unit_suffix(units.time)}) too early, its force too low by "
        "as much loading, and the friction of slow slip beside it too high; the errors of the break-aways hold that; record "
        "faster"
    ]


def check_rise(record: Record, rig: Rig, presmoothed: Presmoothed, flanks: Flanks) -> None:
    """Refuse an extension that rises far faster than the drive can pull it, as in another unit of length."""
    x, time = presmoothed.extension, presmoothed.time
    rise = max(((x[b] - x[a]) / (time[b] - time[a]) for a, b in flanks.limits), default=0.0)
    if rise > RISES * rig.drive_velocity:
        raise InputError(
            f"{record.source}: column {rig.column!r} rises at {rise:.3g}{unit_suffix(rig.units.speed)} between two falls, "
            f"and the drive that drags the mass goes at {rig.drive_velocity:g}; correct the unit, the drive_velocity or the "
            "stiffness in the rig; or leave out drop-outs to a fixed reading, which rise as steeply: [read] valid = [lowest, "
            "highest]"
        )


def part_while_driven(
    record: Record, oscillator: OscillatorConstants, presmoothed: Presmoothed, flanks: Flanks
) -> tuple[slice, list[str]]:
    """The longest part of the record in which the drive does not stop, and a sentence where there are several.

    The spring of a mass that rests keeps its length where the drive stops. One that slips at the speed of the drive does so
    too, but it swings until then: here the spring moves at half the speed of the drive less than half a period of the free
    mass before and after.
    """
    o, rate, time = oscillator, presmoothed.rate, record.time
    slow, fast = max(STANDS * o.drive_velocity, 4 * presmoothed.rate_error), DRIVEN * o.drive_velocity
    if len(flanks.limits) < 3 or slow > fast / 2:
        return slice(None), []
    cycle = float(np.median(np.diff([time[last] for _, last in flanks.limits])))
    near = max(round((natural_period(o) / 2 + 0.2 / presmoothed.cutoff) / record.step), 2)
    stops: list[tuple[int, int]] = []
    for first, last in runs_of(np.abs(rate) < slow):
        sides = ([rate[max(first - near, 0) : first]] if first > 0 else []) + (
            [rate[last : last + near]] if last < len(rate) else []
        )
        lasts = time[last - 1] - time[first] > max(LASTING * cycle, 2 * natural_period(o))
        if lasts and sides and all(np.abs(side).max() > fast for side in sides):
            stops.append((first, last))
    if not stops:
        return slice(None), []
    driven = np.concatenate([[0], np.ravel(stops), [len(time)]]).reshape(-1, 2)
    first, last = driven[np.argmax(driven[:, 1] - driven[:, 0])].tolist()
    said = ", ".join(f"{time[a]:.4g} to {time[b - 1]:.4g}" for a, b in stops)
    why = f"the drive seems to stop: the spring keeps its length from {said}, as it does where mass and drive rest"
    if last - first < LEAST_SAMPLES:
        raise InputError(f"{record.source}: {why}, and what is left is too short; give a longer record")
    return slice(first, last), [
        f"{why}; only {time[first]:.4g} to {time[last - 1]:.4g} was measured ([read] window in the rig takes another part)"
    ]


def part_at_one_speed(
    record: Record, oscillator: OscillatorConstants, extension: Array, weight: Array, flanks: Flanks
) -> tuple[slice, list[str]]:
    """The part of the record in which the drive keeps one speed, and a sentence where it has several.

    The spring is wound up at the speed of the drive while the mass sticks: its slope over the middle half of a rise then
    changes from one cycle to the next and stays so. Of several parts that is taken which has the speed of the rig, or else
    the longest.
    """
    time = record.time
    slopes, where = [], []
    for first, last in flanks.limits:
        quarter = (last - first) // 4
        part = slice(first + quarter, last - quarter)
        if first > 0 and last < len(time) - 1 and np.count_nonzero(weight[part]) >= FEWEST_OF_RISE:
            line = np.polyfit(time[part] - time[first], extension[part], 1, w=weight[part])
            slopes.append(float(line[0]))
            where.append((first, last))
    speeds = np.array(slopes)
    parts = _parts(np.log(speeds)) if len(speeds) and speeds.min() > 0 else []
    if len(parts) < 2:
        return slice(None), []
    level = [float(np.median(speeds[a:b])) for a, b in parts]
    limits = [0, *(where[b - 1][1] for _, b in parts[:-1]), len(time)]
    spans = list(pairwise(limits))
    near = [i for i, one in enumerate(level) if abs(math.log(one / oscillator.drive_velocity)) < CHANGES]
    chosen = max(near or range(len(spans)), key=lambda i: spans[i][1] - spans[i][0])
    first, last = spans[chosen]
    said = ", ".join(
        f"{one:.3g} from {time[a]:.4g} to {time[b - 1]:.4g}" for one, (a, b) in zip(level, spans, strict=True)
    )
    if last - first < LEAST_SAMPLES:
        return slice(None), []
    return slice(first, last), [
        f"the drive seems to run at several speeds, as the spring is wound up at {said}; only {time[first]:.4g} to "
        f"{time[last - 1]:.4g} was measured ([read] window and drive_velocity in the rig take another part)"
    ]


def _parts(values: Array) -> list[tuple[int, int]]:
    """Runs of values about one level each: levels stand clear of one another, and none lasts for a cycle or two only."""
    order = np.sort(values)
    groups = np.split(order, np.flatnonzero(np.diff(order) > CHANGES) + 1)
    levels = np.array([float(np.median(group)) for group in groups if len(group) >= FEWEST_RISES])
    if len(levels) < 2:
        return [(0, len(values))]
    nearest = np.argmin(np.abs(values[:, None] - levels), axis=1)
    off = np.abs(values - levels[nearest])
    edges = [0, *(np.flatnonzero(np.diff(nearest)) + 1).tolist(), len(values)]
    runs = list(pairwise(edges))
    shortest = min(b - a for a, b in runs)
    clear = APART * MAD_TO_SIGMA * float(np.median(off)) < float(np.diff(levels).min())
    return runs if clear and shortest >= FEWEST_RISES else [(0, len(values))]


def without_mains(record: Record, rig: Rig, notes: list[str]) -> Array:
    """The signal without the mains line that the rig names; a line it does not name is noted."""
    signal = record.signal
    if rig.mains_frequency is not None:
        if rig.mains_frequency * record.step > 0.4:
            raise InputError(
                f"{record.source}: a mains line of {rig.mains_frequency:g} Hz cannot be seen at "
                f"{1 / record.step:g} samples per second; remove mains_frequency from the rig"
            )
        line, frequency = mains_hum(signal, record.time, rig.mains_frequency)
        notes.append(
            f"a mains line at {frequency:.4g} Hz with an amplitude of {math.sqrt(2) * float(np.std(line)):.2g} "
            f"{rig.unit} was subtracted"
        )
        return signal - line
    if rig.unit != "1":  # a dimensionless record has no mains
        for frequency in (50.0, 60.0):
            excess = line_excess(signal, record.step, frequency)
            if excess > 10:
                notes.append(
                    f"the record has a line at {frequency:g} Hz, {excess:.0f} times its neighbourhood; set "
                    f"mains_frequency = {frequency:g} in the rig to take it out"
                )
    return signal


def notes_on_overtaking(friction: Friction, rate_error: float) -> list[str]:
    """Whether the mass runs ahead of the drive by more than the noise, as the position of a slider that is pulled does."""
    o = friction.fit.oscillator
    drive = o.drive_velocity
    share = float(np.mean(friction.slip_velocity < -max(0.1 * drive, 4 * rate_error)))
    if share < 0.02:
        return []
    lasts = float(friction.time[-1] - friction.time[0])
    travels = 1 - float(np.mean(friction.slip_velocity)) / drive
    if abs(travels - 1) < TRAVELS and lasts > LONG * 2 * math.pi * math.sqrt(o.mass / o.stiffness):
        return [
            f"the recorded position moves with {travels:.2f} of the drive velocity throughout, where the stretch of a spring "
            "stays bounded: it is that of a slider that is pulled; record the stretch, drive_velocity times t less this "
            "position, or the force of the spring"
        ]
    return [
        f"the mass overtakes the drive for {100 * share:.0f} % of the time, by up to "
        f"{-float(friction.slip_velocity.min()) / drive:.2g} V: w < 0 there, or a unit, a sign or the drive_velocity of the "
        "rig is wrong"
    ]


def notes_on_stated_noise(friction: Friction, record: Record, rig: Rig) -> list[str]:
    """Whether the samples scatter otherwise than the file says they do."""
    if not record.error:
        return []
    spring = rig.instrument == "spring_force"
    stated = record.error * abs(rig.force_unit) / (friction.fit.oscillator.stiffness if spring else 1.0)
    scatter = friction.noise / math.sqrt(friction.fit.together)
    if 0.5 < scatter / max(stated, 1e-300) < 2:
        return []
    return [
        f"the record says its samples are good to {stated:.2g}{unit_suffix(rig.units.length)}, they scatter by "
        f"{scatter:.2g}{unit_suffix(rig.units.length)} about the fit: the scatter was believed"
    ]


def notes_on_inertia(friction: Friction, rig: Rig, slow: float, line: Line) -> list[str]:
    """Whether the resonance, or the smoothness of friction, speaks for another inertia than the rig's."""
    notes: list[str] = []
    o, hertz = friction.fit.oscillator, unit_suffix(rig.units.frequency)
    own = math.sqrt(o.stiffness / o.mass) / (2 * math.pi)
    nominal = math.sqrt(rig.stiffness / o.mass) / (2 * math.pi)
    # A slider that is slow most of the time sounds at the rate of its slips, not at its resonance.
    if slow < MOSTLY_SLOW and line.frequency > 0:
        ratio = line.frequency / own
        if abs(ratio - 1) > max(0.05, 3 * line.error / own):
            notes.append(
                f"the resonance line at {line.frequency:.3g} +- {line.error:.2g}{hertz} is {ratio:.2f} times sqrt(k/m)/2pi "
                f"= {own:.3g}{hertz} ({line.frequency / nominal:.2f} times the {nominal:.3g}{hertz} of the nominal "
                "stiffness): friction that depends on velocity shifts it, or the effective inertia is "
                f"{1 / ratio**2:.2f} of the mass {o.mass:g}"
            )
    excess, excess_error = restoring_excess(friction)
    if abs(excess) > max(SWING_ERRORS * excess_error, 2 * SWING_OFF):
        swing = math.sqrt(max(1 - excess, 0.0))
        notes.append(
            f"the slips swing at {swing:.3f} +- {excess_error / (2 * max(swing, 0.1)):.1g} times sqrt(k/m)/2pi, whatever "
            "friction does with the slip velocity: friction has branches or a memory, or the stiffness "
            f"{o.stiffness:.4g} or the inertia {o.mass:g} is wrong by some {100 * abs(excess):.0f} %; an error of the "
            "stiffness is in all forces k x and in no error given here"
        )
    likeliest, error = likeliest_inertia(friction)
    if math.isfinite(likeliest) and abs(likeliest - o.mass) > max(3 * error, 0.15 * o.mass):
        notes.append(
            f"the inertia that makes the friction force of the slips smoothest is {likeliest / o.mass:.2f} +- "
            f"{error / o.mass:.2f} times the {o.mass:g}{unit_suffix(rig.units.mass)} used here (a law that is steep in w "
            f"shifts this; rig: effective_mass sets another)"
        )
    return notes
