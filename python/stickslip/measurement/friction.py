"""The arrow from a record and its rig to a friction record."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from stickslip import _core
from stickslip.errors import InputError
from stickslip.files.checks import each_once
from stickslip.files.units import unit_of
from stickslip.measurement.break_away_table import break_aways
from stickslip.measurement.consistency import (
    at_one_speed,
    check_rise,
    check_sampling,
    few_samples,
    filtered,
    inertia,
    overtaking,
    unlike_stated_noise,
    while_driven,
    without_mains,
)
from stickslip.measurement.disturbances.ripple import Shaken, find_ripple, refined_ripple, said_of, without
from stickslip.measurement.disturbances.zero_drift import said_of_drift, zero_drift
from stickslip.measurement.disturbances.zero_jump import ZeroJump, said_of_jumps, zero_error, zero_jumps
from stickslip.measurement.force import Friction, fit_pieces, friction_force
from stickslip.measurement.hidden_fall import with_hidden_fall
from stickslip.measurement.instruments import INSTRUMENTS, Bench
from stickslip.measurement.instruments.instrument import noted, same_samples
from stickslip.measurement.masses import masses_of, opened
from stickslip.measurement.read import LEAST_SAMPLES, Record, as_record
from stickslip.measurement.recalibration import Draft, another_drive_velocity, most_mistaken, recalibrated, rigid_sticks
from stickslip.measurement.regime import intermittence, nearly_sticks, regime, slow_share, undecided
from stickslip.measurement.rigs.chain import Chain, pull_together
from stickslip.measurement.rigs.rig import TURNS, Rig
from stickslip.measurement.rigs.rig_file import load_rig
from stickslip.measurement.signals.coloured_noise import Colour, noise_colour
from stickslip.measurement.signals.converter_steps import coarse_step
from stickslip.measurement.signals.noise import clipped, impulses, noise_level, stretches
from stickslip.measurement.signals.piecewise_fit import OscillatorConstants, PiecewiseFit
from stickslip.measurement.signals.slip_evidence import SlipModel
from stickslip.measurement.signals.spectra import Line
from stickslip.measurement.stick_limits import BLUR, refine_sticks
from stickslip.measurement.sticks import (
    Presmoothed,
    Stick,
    creep_delay,
    creeping_sticks,
    find_flanks,
    own_period,
    presmooth,
    rigid_candidates,
    rises_before,
    stick_slope,
)

Array = npt.NDArray[np.float64]

LEAST_NOISE = 1e-5
"""Of the range of a record: with less noise each slip would be told from a stick by what the splines of the fit round off."""

LARGE = 0.3
"""Falls of so much of the largest one are slips, whatever the noise."""

UNSEEN = 2.0
"""Break-aways are seen within so many delays of a sudden one, or there was none."""

FELT = 1 / 3
"""Of the scatter of the extensions at which masses break away: a common shift that is less is left out."""

FILTERED = 0.3
"""Noise of which more than this share is coloured came through a filter, as the signal did; the converter's own is white."""

EVENT_DIMENSIONS = {"t": "time", "stick_time": "time", "force_rate": "force time^-1"}
"""Of the columns of a table of break-aways; the others are forces."""
FACTS = ["regime", "slips", "stuck_share", "slow_share", "main_line", "main_line_error", "stiffness", "inertia"]
"""What a summary prints."""


def measure(
    record: Any, rig: Rig | Chain | Bench | str | Path | dict[str, Any], *, mass: int | str | None = None
) -> xr.DataTree:
    """Friction force, slip velocity and break-aways of a record.

    For a mass on a spring friction = k x + D x' + m x'' and w = V - x' (the indirect method). The sticks are found first
    and the derivatives are taken from smooth pieces between them, so that nothing is smeared across an event. Other
    instruments (`stickslip.measurement.INSTRUMENTS`) have their own way to friction; which one, the rig's `instrument` says.

    Parameters
    ----------
    record : path of a MATLAB (v5), CSV/text, JSON, look or netCDF file, or an xarray Dataset, a pandas DataFrame or a
        dict of (n,) arrays that holds the rig's columns. A motion file or Dataset with a dimension `mass` holds several
        records. For instruments that compare runs, a list of these.
    rig : a `Rig`, a `Bench`, the path of a rig TOML, or its table. Where its stiffness is a matrix, the masses pull on
        each other, and the friction on each is taken from the motion of all.
    mass : number (from 0) or label of the mass of a motion file; default: all of them.

    Returns
    -------
    DataTree. For a motion with several masses, one such tree as a child ``mass_<label>`` each. Else the root has
    `slip_velocity`, `slip_acceleration`, `force`, `force_error`, `stuck`, `displacement`, `velocity` over `time` (those
    that the instrument can give), and with the indirect method `recorded`, the displacement before any smoothing, NaN where a
    sample was left out. Child ``break_away``: `t`, `stick_time`, `force_rate`, `force`, `drop` and their ``_error``
    over `event`; other instruments add ``steady``, friction over slip velocity. Attributes of the root: `source`, `rig`
    (TOML), `command`, `version`, `notes` (what was assumed, corrected or found inconsistent, one sentence each), `regime`,
    `main_line` and `main_line_error` (Hz), `slow_share` (of the time with |w| < 0.2 V) and `stuck_share`, and the constants
    that were used: `stiffness`, `mass`, `damping`, `drive_velocity`, `inertia`, `weight`; `break_away_late`, the
    standard error in s by which all break-aways of the record may be early or late together (it is in their errors too);
    `low_pass`, the time constant in s of a filter ahead of the converter that the noise shows, 0 where it shows none;
    `force_common`, the standard error that all forces of the record share (it is in `force_error` too);
    `scale_error`, the relative error that all lengths share, where a motion states one; for other instruments the names
    in `facts`.

    Raises
    ------
    InputError
        one sentence, for a record or rig that cannot be used.

    Notes
    -----
    The drive velocity is constant and the slip in one sense. `force_error` holds the noise and what smoothing leaves
    open, not the errors of the rig's own constants; those that the record contradicts stand in `notes`.

    Examples
    --------
    A free oscillation of a dimensionless oscillator, with some noise: there is no friction to be found.

    >>> from stickslip.measurement import Rig, measure
    >>> t = np.linspace(0, 40, 1001)
    >>> x = 0.7 * np.sin(t)
    >>> rig = Rig(instrument="displacement", column="x", unit="1", stiffness=1, mass=1, drive_velocity=1.0)
    >>> friction = measure({"t": t, "x": x + 1e-3 * np.random.default_rng(0).standard_normal(1001)}, rig)
    >>> friction.attrs["regime"], bool(np.abs(friction["force"]).max() < 0.05)
    ('almost_harmonic', True)
    """
    rig = load_rig(rig)
    if isinstance(rig, Bench):
        instrument = INSTRUMENTS[rig.instrument]
        records = record if isinstance(record, list | tuple) else [record]
        if not records:
            raise InputError("measure: a record or a list of records was expected, got an empty list")
        samples = each_once((instrument.read(one, rig) for one in records), same_samples, lambda one: one.source, noted)
        tree = instrument.measure(samples, rig)
        if scale_error := max(one.scale_error for one in samples):
            tree.attrs["scale_error"] = scale_error
        return tree
    spring = rig.rigs[0] if isinstance(rig, Chain) else rig
    if isinstance(record, list | tuple):
        if len(record) != 1:
            raise InputError(
                f"measure: a {spring.instrument} rig measures one record at a time, got {len(record)}; measure each by itself"
            )
        record = record[0]
    record = opened(record)
    if isinstance(rig, Chain):
        return _measure_chain(record, rig, mass)
    masses = masses_of(record, mass)
    if masses is not None:
        trees = {f"mass_{label}": measure(one, rig) for label, one in masses.items()}
        if len(trees) == 1 or mass is not None:
            return next(iter(trees.values()))
        return xr.DataTree.from_dict({f"/{name}": tree for name, tree in trees.items()})
    if mass is not None:
        raise InputError(
            f"measure: mass = {mass!r} asks for one mass of a motion, and the record has no dimension mass"
        )
    recorded = as_record(record, rig)
    found = _measure(recorded, rig)
    return _tree(recorded, rig, found)


def _measure_chain(record: Any, chain: Chain, mass: int | str | None) -> xr.DataTree:
    wanted = masses_of(record, mass)
    masses = masses_of(record)
    if wanted is None or masses is None or len(masses) != len(chain.rigs):
        count = "a record of one" if masses is None else f"a motion of {len(masses)}"
        raise InputError(f"measure: the rig has {len(chain.rigs)} masses that pull on each other, got {count}")
    trees = {}
    for (label, one), rig in zip(masses.items(), chain.rigs, strict=True):
        recorded = as_record(one, rig)
        trees[f"mass_{label}"] = _tree(recorded, rig, _measure(recorded, rig, alone=False))
    trees = pull_together(trees, chain)
    if mass is not None:
        return trees[f"mass_{next(iter(wanted))}"]
    return xr.DataTree.from_dict({f"/{name}": tree for name, tree in trees.items()})


def measure_record(record: Record, rig: Rig) -> tuple[Friction, list[str]]:
    """Friction of one record of a mass on a spring, with the fit it was taken from, and the notes."""
    found = _measure(record, rig)
    return found.friction, found.notes


@dataclass
class _Found:
    """What the stages hand on."""

    friction: Friction
    sticks: list[Stick]
    rigid: bool
    slow: float
    line: Line
    regime: str
    notes: list[str]
    saturated: int


def _measure(record: Record, rig: Rig, alone: bool = True) -> _Found:
    notes = list(record.notes)
    o = OscillatorConstants(rig.inertia, rig.damping, rig.stiffness, rig.drive_velocity)
    seen = _seen(record, rig, o, notes)
    time, x, weight, noise = record.time, seen.x, seen.weight, seen.noise

    presmoothed = presmooth(time, x, weight, o, noise)
    flanks = find_flanks(presmoothed, 0.0)  # every fall that stands clear of the noise

    check_rise(record, rig, presmoothed, flanks)
    if seen.jumps:
        part, stopped = _between_jumps(record, rig, o, seen.jumps)
    else:
        part, stopped = while_driven(record, o, presmoothed, flanks)
    if not stopped:
        part, stopped = at_one_speed(record, o, x, weight, flanks)
    if stopped:
        weights = None if record.weight is None else record.weight[part]
        driven = replace(record, time=time[part], signal=record.signal[part], weight=weights)
        found = _measure(replace(driven, notes=(*record.notes, *stopped)), rig, alone)
        if seen.jumps:
            found.friction = _with_common(found.friction, o.stiffness * zero_error(seen.jumps))
        return found

    # the spring and the drive as the sticks show them
    stated = Draft(time, x, weight, o, noise, presmoothed, flanks, True)
    pixel = None if record.pixel is None else record.pixel * abs(rig.force_unit) / seen.stiffness
    still, shaken = _without_ripple(stated, rig, pixel)
    trial, slope, rigid = rigid_sticks(still, o.drive_velocity)
    colour = _colour(stated, rig, seen.least)
    if colour is not None and (shaken is not None or not rigid):
        # what looks like a ripple or like creep may be noise that is slow
        stated = _coloured(stated, rig, colour, seen.known_noise, notes)
        still, shaken = _without_ripple(stated, rig, pixel)
        trial, slope, rigid = rigid_sticks(still, o.drive_velocity)
    stated = still
    x, noise, presmoothed, flanks = stated.extension, stated.noise, stated.presmoothed, stated.flanks
    # A mass that does not go with the drive where it seems to rest does not rest; where nothing sticks, or for too few
    # samples to have a slope, nothing shows that it creeps.
    rigid = slope is None or (rigid and abs(slope.value / o.drive_velocity - 1) <= most_mistaken(rig))
    smaller: list[str] = []
    if not rigid:
        flanks = find_flanks(presmoothed, rig.least_drop)
        if flanks.smaller:
            smaller.append(
                f"{flanks.smaller} falls of the spring smaller than {rig.least_drop:g} of the median fall were taken "
                "as creep inside a stick, not as slips (rig: least_drop)"
            )
        slope = stick_slope(time, x, weight, flanks, presmoothed, o.drive_velocity)
    stated = replace(stated, flanks=flanks, rigid=rigid)
    draft, why = (stated, []) if slope is None else recalibrated(stated, slope, trial, rig)
    friction, sticks, (slow, slow_error), word = _fitted(draft)
    if word != "stick_slip" and (sticks or draft is not stated):
        # What is not surely stick-slip has no sticks, and so nothing by which to correct the rig.
        why = [] if draft is not stated else why
        friction, sticks, (slow, slow_error), _ = _fitted(stated, sticking=False)
    if not sticks:
        why = [*another_drive_velocity(stated, rig), *why]
    if shaken is not None:
        friction = shaken.returned(friction, sticks)
        notes.append(said_of(shaken, o, "" if rig.unit == "1" else " m"))
    notes += why
    few = few_samples(record, o) if sticks and rigid else []
    notes += few
    if sticks and not rigid:
        notes += smaller
        delay = creep_delay(presmoothed, sticks, o.drive_velocity)
        notes.append(
            "while stuck the mass creeps by more than the noise, or its positions have an error that is smooth along the way "
            "or in time: sticks are bounded where w passes half of V, and w is measured, not set to zero, inside them; "
            f"a sudden break-away is {delay:.2g} s earlier, which the errors of break-aways hold unless they scatter far more"
        )
    notes += [*overtaking(friction, presmoothed.rate_error), *unlike_stated_noise(friction, record, rig)]
    if sticks:
        per_reading = abs(rig.force_unit) * (o.stiffness / seen.stiffness)
        if coarse := coarse_step(record.signal[weight > 0], friction.noise * o.stiffness / per_reading):
            # each stick meets the same steps, so the error of the level of one is that of all
            stuck = max(np.count_nonzero(friction.stuck) / len(sticks), 1.0)
            common = per_reading * coarse / math.sqrt(12 * stuck)
            friction = _with_common(friction, common)
            notes.append(_said_of_steps(coarse, common, rig))
    if sticks and (drift := zero_drift(presmoothed, flanks)):
        friction = _with_common(friction, o.stiffness * drift.size / 2)
        notes.append(said_of_drift(drift, o.stiffness, "" if rig.unit == "1" else " N"))
    notes += filtered(friction)
    if sticks and colour is not None and colour.share > FILTERED:
        friction = _behind_low_pass(friction, sticks, -record.step / math.log(colour.correlation))
        notes.append(
            f"the noise is alike over {friction.low_pass / record.step:.2g} samples, as behind a low-pass of some "
            f"{1 / (2 * math.pi * friction.low_pass):.2g} Hz ahead of the converter: that shifts break-aways and smears the "
            "force beside them and beside captures, which the errors hold; remove the filter, or set it far above the slips"
        )
    if few:  # so few samples place all break-aways alike
        friction = replace(friction, late=math.hypot(friction.late, BLUR * record.step))
    if sticks and not rigid:
        late = delay / math.sqrt(3)
        levels = np.interp([stick.end for stick in sticks if stick.ends], time, presmoothed.extension)
        # Break-aways that scatter by far more do not feel it.
        if not levels.size or o.drive_velocity * late > FELT * float(np.std(levels)):
            friction = replace(friction, late=math.hypot(friction.late, late))
    if word == "stick_slip" and (missed := intermittence(slow, rigid, len(sticks), len(flanks.limits))):
        notes.append(missed)
    if word == "unknown":
        notes.append(
            undecided(slow, slow_error, presmoothed.rate_error / o.drive_velocity, own_period(o) / record.step)
        )
    if word == "almost_harmonic" and not sticks:
        notes += nearly_sticks(slow, own_period(o) / record.step)
    line = draft.line(friction.slip_acceleration)
    # the pull of other masses has its own lines; of steady slip there is noise
    if alone and word not in ("stable_slip", "at_rest"):
        notes += inertia(friction, rig, slow, line)
    ends = np.array([stick.end for stick in sticks])
    if word == "stick_slip" and ends.size >= 3:
        line = draft.line(friction.slip_acceleration, 1 / float(np.median(np.diff(ends))))
    return _Found(friction, sticks, rigid, slow, line, word, notes, seen.saturated)


@dataclass(frozen=True)
class _Seen:
    """The extension of the spring that a record tells.

    Attributes
    ----------
    x, weight : of each sample, m, and 0 where it is no reading.
    noise : standard deviation of the samples, at least `least`; `known_noise` that of the rig.
    stiffness : force or extension that the readings are, per extension.
    saturated : samples at the end of the range; `jumps` of the zero.
    """

    x: Array
    weight: Array
    noise: float
    least: float
    known_noise: float | None
    stiffness: float
    saturated: int
    jumps: list[ZeroJump]


def _seen(record: Record, rig: Rig, o: OscillatorConstants, notes: list[str]) -> _Seen:
    """The readings as extensions; what is left out of them is said in the notes."""
    signal = (without_mains(record, rig, notes) - rig.rest) * rig.force_unit
    stiffness = o.stiffness if rig.instrument == "spring_force" else 1.0
    x = signal / stiffness
    if float(np.ptp(x)) < 1e-100:
        raise InputError(f"{record.source}: column {rig.column!r} is constant; there is no motion in it to measure")
    check_sampling(record, rig)
    known_noise = None if rig.noise is None else rig.noise * abs(rig.force_unit) / stiffness
    weight = np.ones(len(x)) if record.weight is None else record.weight.copy()
    noise, least = known_noise or noise_level(x, weight), LEAST_NOISE * float(np.ptp(x))
    beyond = clipped(x, max(noise, least))
    if beyond.any():
        weight[beyond] = 0.0
        noise = known_noise or noise_level(x, weight)
        notes.append(
            f"{np.count_nonzero(beyond)} samples ({100 * beyond.mean():.1f} %) stand at the end of the instrument's range: "
            "it was saturated there; they were left out, and break-aways among them are not seen; widen the range"
        )
    if noise < least:
        noise = least
        notes.append(
            f"the samples scatter by less than {LEAST_NOISE:g} of their range, as those of a simulated record do: noise of "
            "that size was taken, and the errors are those it makes"
        )
    spikes = impulses(x, noise)
    lone = spikes & ~np.roll(spikes, 1) & ~np.roll(spikes, -1)  # the two samples beside a jump look like impulses
    turn = math.sqrt(o.stiffness / o.mass) * record.step
    jumps = zero_jumps(x, np.where(lone, 0.0, weight), noise, turn)
    if spikes.any():
        weight[spikes] = 0.0
        notes.append(
            f"{np.count_nonzero(spikes)} isolated impulses ({100 * spikes.mean():.1f} % of the samples) were left out"
        )
    return _Seen(x, weight, noise, least, known_noise, stiffness, int(np.count_nonzero(beyond)), jumps)


def _between_jumps(record: Record, rig: Rig, o: OscillatorConstants, jumps: list[ZeroJump]) -> tuple[slice, list[str]]:
    """The longest part of a record in which the zero stays, and the sentence on the jumps."""
    edges = [0, *(jump.index for jump in jumps), len(record.time)]
    part = max((slice(*pair) for pair in pairwise(edges)), key=lambda one: one.stop - one.start)
    said = said_of_jumps(jumps, record.time, part, o.stiffness, "" if rig.unit == "1" else " N")
    if part.stop - part.start < LEAST_SAMPLES:
        raise InputError(f"{record.source}: {said}; that is too short, give a longer record")
    return part, [said]


def _said_of_steps(coarse: float, common: float, rig: Rig) -> str:
    return (
        f"the readings come in steps of {coarse:.3g} {rig.unit}, coarser than the noise: lines and creep smaller than "
        f"a step may come of it; the errors of all forces hold {common:.2g}{'' if rig.unit == '1' else ' N'} for it; "
        "a finer range or noise of half a step evens it out"
    )


def _with_common(friction: Friction, error: float) -> Friction:
    """The friction with another standard error that all its forces share."""
    return replace(
        friction, common=math.hypot(friction.common, error), force_error=np.hypot(friction.force_error, error)
    )


def _behind_low_pass(friction: Friction, sticks: list[Stick], lasting: float) -> Friction:
    """With errors that hold what a low-pass of the first order with this time constant does.

    It shifts all break-aways alike, and leaves exp(-t / lasting) of a jump of friction after a time t. Captures are placed
    where the smeared motion ends, so as much goes ahead of them.
    """
    slips, ends = ~friction.stuck, [stick.end for stick in sticks if stick.ends]
    smeared = np.zeros(len(friction.time))
    if ends and slips.any():
        events = np.sort([t for stick in sticks for t in (stick.start, stick.end)])
        moments = friction.time[slips]
        beside = np.searchsorted(events, moments)[:, None] - [1, 0]
        away = np.abs(moments[:, None] - events[np.clip(beside, 0, len(events) - 1)]).min(axis=1)
        jump = float(np.median(np.interp(ends, friction.time, friction.force)) - np.median(friction.force[slips]))
        smeared[slips] = jump * np.exp(-away / lasting)
    return replace(
        friction,
        late=math.hypot(friction.late, lasting / math.sqrt(3)),
        force_error=np.hypot(friction.force_error, smeared),
        low_pass=lasting,
    )


def _colour(draft: Draft, rig: Rig, least: float) -> Colour | None:
    """That of the noise in the middle halves of the rises before the large falls, a ripple taken out; None of white noise."""
    x, weight, time, presmoothed = draft.extension, draft.weight, draft.time, draft.presmoothed
    if not len(draft.flanks.drops):
        return None
    rises = rises_before(presmoothed.extension, LARGE * float(draft.flanks.drops.max()))
    stretches = [(a + (b - a) // 4, b - (b - a) // 4) for a, b in rises]
    colour = noise_colour(x, weight, stretches)
    sticks = [Stick(time[a], time[b], 0.0, 0.0) for a, b in rises]
    if colour and (ripple := find_ripple(time, x, weight, sticks, draft.noise, rig.mains_frequency)):
        colour = noise_colour(x - ripple.at(time), weight, stretches)
    return None if colour is None or colour.deviation < least else colour


def _coloured(draft: Draft, rig: Rig, colour: Colour, known_noise: float | None, notes: list[str]) -> Draft:
    """The draft with the density of its noise, and a note."""
    x, weight, time = draft.extension, draft.weight, draft.time
    deviation = known_noise or colour.deviation
    noise = deviation * math.sqrt(colour.count)
    unit = "" if rig.unit == "1" else " m"
    notes.append(
        f"the noise is coloured: samples scatter by {deviation:.2g}{unit}, and neighbours are alike to "
        f"{colour.share * colour.correlation:.2f}, so that {colour.count:.2g} samples count as one in all errors; creep or a "
        "ripple smaller than that noise is not seen"
    )
    presmoothed = presmooth(time, x, weight, draft.oscillator, noise)
    flanks = find_flanks(presmoothed, 0.0)
    return replace(draft, noise=noise, presmoothed=presmoothed, flanks=flanks, together=colour.count)


def _without_ripple(draft: Draft, rig: Rig, pixel: float | None) -> tuple[Draft, Shaken | None]:
    """The draft without a line that all its sticks share, and what was taken; as it is where there is none.

    A line after whose removal masses break away long before they are seen to move is none: such is an error of positions.
    """
    o = draft.oscillator
    guesses = creeping_sticks(draft.presmoothed, draft.flanks, o.drive_velocity)
    found, shaken = _ripple_taken(draft, rig, pixel, guesses)
    if shaken is None:
        return draft, None
    ends = np.array([stick.end for stick in _rigid_fit(found)[0] if stick.ends])
    seen = np.array([stick.end for stick in guesses if stick.ends])
    if ends.size and seen.size:
        early = seen - ends[np.abs(seen[:, None] - ends).argmin(axis=1)]
        if float(np.median(early)) > UNSEEN * creep_delay(draft.presmoothed, guesses, o.drive_velocity):
            return draft, None
    return found, shaken


def _ripple_taken(draft: Draft, rig: Rig, pixel: float | None, guesses: list[Stick]) -> tuple[Draft, Shaken | None]:
    """The same by what the samples say of a line, with first guesses of the sticks."""
    o = draft.oscillator
    samples = draft.time, draft.extension, draft.weight
    ripple = find_ripple(*samples, guesses, draft.noise, rig.mains_frequency, pixel)
    if ripple is None:
        return draft, None
    shaken = Shaken(ripple, True)
    still = without(draft, shaken)
    _, slope, rigid = rigid_sticks(still, o.drive_velocity)
    if slope is None or not rigid or abs(slope.value / o.drive_velocity - 1) > most_mistaken(rig):
        return draft, None
    if not (sticks := _rigid_fit(still)[0]):
        return draft, None
    # the slips tell whether they have it too
    inner = _rigid_fit(without(draft, Shaken(ripple, False, sticks)))[0]
    if not inner:
        return still, shaken
    bridged = Shaken(refined_ripple(ripple, *samples, inner, draft.noise), False, inner)
    joined = without(draft, bridged)
    fits = [_pieces(still, sticks), _pieces(joined, inner)]
    both = [fit.deviance(fit.cutoff) for fit in fits]
    # first guesses that hold parts of slips may share a line that the sticks have not
    if plain := _rigid_fit(draft)[0]:
        fit = _pieces(draft, plain)
        if fit.deviance(fit.cutoff) < min(both):
            return draft, None
    return (still, shaken) if both[0] + ripple.releasing(inner) < both[1] else (joined, bridged)


def _pieces(draft: Draft, sticks: list[Stick]) -> PiecewiseFit:
    o = draft.oscillator
    return fit_pieces(
        draft.time, draft.extension, draft.weight, sticks, True, o, _knots(draft.presmoothed, o), draft.together
    )


def _fitted(draft: Draft, sticking: bool = True) -> tuple[Friction, list[Stick], tuple[float, float], str]:
    """Friction of a draft, its sticks (none where not `sticking`), the share of slow time, its error, the kind of motion."""
    o, presmoothed, flanks = draft.oscillator, draft.presmoothed, draft.flanks
    if sticking and draft.rigid:
        sticks, fit, soft = _rigid_fit(draft)
    else:
        soft = True
        sticks = creeping_sticks(presmoothed, flanks, o.drive_velocity) if sticking else []
        fit = fit_pieces(
            draft.time, draft.extension, draft.weight, sticks, False, o, _knots(presmoothed, o), draft.together
        )
    friction = friction_force(fit, sticks)
    hidden = _hidden(draft)
    sticks = [
        replace(one, sure=one.sure and not any(a - one.end_error <= one.end <= b + one.end_error for a, b in hidden))
        for one in sticks
    ]
    if sticks and not soft:
        friction = with_hidden_fall(friction, sticks)
    lasting = [stick.end - stick.start for stick in sticks]
    slow = slow_share(friction.slip_velocity, o.drive_velocity, draft.noise, draft.step, lasting)
    seen = presmoothed.rate_error / o.drive_velocity
    word = regime(friction.slip_velocity, o.drive_velocity, *slow, seen, draft.rigid, len(sticks), len(flanks.limits))
    return friction, sticks, slow, word


def _hidden(draft: Draft) -> list[tuple[float, float]]:
    """Times between which three samples in a row or more are missing, so that the end of a stick is not seen there."""
    runs = [(draft.time[a], draft.time[b - 1]) for a, b in stretches(draft.weight == 0) if b - a >= 3]
    # What lacks them may place the end as far behind them as they are long.
    return [(before - 2 * draft.step, after + (after - before) + 2 * draft.step) for before, after in runs]


def _knots(presmoothed: Presmoothed, oscillator: OscillatorConstants) -> float:
    step = float((presmoothed.time[-1] - presmoothed.time[0]) / (len(presmoothed.time) - 1))
    return max(min(own_period(oscillator) / 25, 0.2 / presmoothed.cutoff), 2 * step)


def _rigid_fit(draft: Draft) -> tuple[list[Stick], Any, bool]:
    """Alternate between the limits of the sticks and the cut-off of the slips; `soft` as of `refine_sticks`."""
    time, x, weight, presmoothed, o = draft.time, draft.extension, draft.weight, draft.presmoothed, draft.oscillator
    knots = _knots(presmoothed, o)
    sticks = rigid_candidates(presmoothed, draft.flanks, o.drive_velocity, 1 / own_period(o))
    path = o.drive_velocity * (time - time[0]) - x
    cutoff = presmoothed.cutoff
    step = float(time[1] - time[0])
    soft: bool | None = None
    for span in (max(8 * step, 0.06 * own_period(o)), 3 * step):
        model = SlipModel(time, path, weight, o, draft.noise, knots, cutoff)
        sticks, soft = refine_sticks(model, sticks, span, soft)
        fit = fit_pieces(time, x, weight, sticks, True, o, knots, draft.together)
        changed = abs(math.log(fit.cutoff.get("slip", cutoff) / cutoff))
        cutoff = fit.cutoff.get("slip", cutoff)
        if not sticks or (soft and changed < 0.1):
            break
    return sticks, fit, bool(soft)


def _tree(record: Record, rig: Rig, found: _Found) -> xr.DataTree:
    f, o = found.friction, found.friction.fit.oscillator
    time, length, speed, acceleration, force, _ = rig.units
    data = xr.Dataset(coords={"time": ("time", f.time, {"units": time})})
    data["slip_velocity"] = ("time", f.slip_velocity, {"units": speed})
    data["slip_acceleration"] = ("time", f.slip_acceleration, {"units": acceleration})
    data["force"] = ("time", f.force, {"units": force, "long_name": "friction force"})
    data["force_error"] = ("time", f.force_error, {"units": force})
    data["stuck"] = ("time", f.stuck)
    data["displacement"] = ("time", f.extension, {"units": length, "long_name": "extension of the spring"})
    data["velocity"] = ("time", f.velocity, {"units": speed})
    recorded = np.where(f.fit.weight > 0, o.drive_velocity * (f.time - f.time[0]) - f.fit.path, math.nan)
    data["recorded"] = ("time", recorded, {"units": length, "long_name": "extension with the instrument's own noise"})
    events = break_aways(f, found.sticks)
    for name in events:
        kind = EVENT_DIMENSIONS.get(str(name).removesuffix("_error"), "force")
        events[name].attrs["units"] = unit_of(kind, force, length, time)
    data.attrs = {
        "source": record.source,
        "rig": rig.to_toml(),
        "command": "stickslip measure",
        "version": _core.__version__,
        "notes": found.notes,
        "facts": FACTS,
        "regime": found.regime,
        "main_line": found.line.frequency,
        "main_line_error": found.line.error,
        "slow_share": found.slow,
        # of a motion whose kind cannot be told neither is known
        "stuck_share": math.nan if found.regime == "unknown" else float(np.mean(f.stuck)),
        "slips": math.nan if found.regime == "unknown" else sum(stick.ends for stick in found.sticks),
        "creeps": int(not found.rigid),
        "saturated": found.saturated,
        "stiffness": o.stiffness,
        "mass": rig.mass,
        "inertia": o.mass,
        "damping": o.damping,
        "drive_velocity": o.drive_velocity,
        "weight": math.nan if rig.units == TURNS else rig.mass * rig.gravity,
        "noise": f.noise,
        "break_away_late": f.late,
        "low_pass": f.low_pass,
        "force_common": f.common,
        "slip_cutoff": f.cutoff.get("slip", math.nan),
        "creep_cutoff": f.cutoff.get("creep", math.nan),
        **({"scale_error": record.scale_error} if record.scale_error else {}),
    }
    return xr.DataTree.from_dict({"/": data, "/break_away": events})
