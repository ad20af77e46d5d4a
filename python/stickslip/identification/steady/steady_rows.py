"""The rows of a record that are friction over slip velocity: what slides, in a sense that is sure, and fast enough."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr
from scipy.integrate import cumulative_trapezoid

from stickslip.errors import InputError
from stickslip.files.arrays import Array, Mask, taken
from stickslip.identification.kinetic.replayed_motion import SENSE
from stickslip.identification.records import both_senses, stated_units
from stickslip.identification.steady.curves import Rows
from stickslip.identification.steady.single_form_fit import inertia_error
from stickslip.measurement.instruments.errors_of_means import median_and_error
from stickslip.measurement.rigs.rig import SLIDES, TURNS
from stickslip.measurement.signals.noise import noise_level

SLOW = 0.05
"""Below this share of its top speed a record is asked whether friction is a function of the slip velocity at all."""
FEWEST_FOR_MEDIAN = 4
"""Samples of which a median has an error."""
OCTAVE = 2.0
"""Ratio of the ends of a range of speeds in which that is asked."""
CURVED = 12
"""Of a free curve on either side, beside which it is seen whether the force follows the acceleration."""
INERTIA_TOLERANCE = 0.5
"""An inertia that the rig does not give is believed where either half of the speeds has it within so much of it."""
BEHIND = 0.05
"""Share by which friction is less after a turn of the slip, up to which it has built up."""
STROKE = 0.25
"""Share of the usual path between two turns over which friction may build up."""
RANGES = 24
"""Of speed, in which friction is known while a mass slows down."""
LEFT = 0.25
"""Share of the samples of slip that must be left where those beside a stick are not taken."""
LARGEST_NUMBER = 1e60
"""Numbers larger than this are no friction in any unit."""


@dataclass(frozen=True)
class LeftOut:
    """Samples of slip of a record that are no rows.

    Parameters
    ----------
    name : of the record.
    samples : how many slide in it.
    reasons : how many were left out and the highest speed among them, by the reason.
    """

    name: str
    samples: int
    reasons: dict[str, tuple[int, float]]

    @property
    def count(self) -> int:
        """How many were left out."""
        return sum(count for count, _ in self.reasons.values())


def rows_of(tree: xr.DataTree, name: str) -> tuple[Rows, dict[str, str], LeftOut, list[str]]:
    """The rows of a record that slide, the units of force and slip velocity, what is no row, and what else is to be said."""
    root = tree.to_dataset(inherit=False)
    table = tree.children["steady"].to_dataset(inherit=False) if "steady" in tree.children else None
    series = {"time", "slip_velocity", "force"} <= set(map(str, root.variables))
    sampled = series and (table is None or "branch" in table)
    data = root if sampled or table is None else table
    turning = "displacement" in data and data["displacement"].attrs.get("units") == "rad"
    if sampled:
        time, w, force = (_numbers(root, key, name) for key in ("time", "slip_velocity", "force"))
        unknown = np.full(len(w), math.nan)
        position = _numbers(root, "displacement", name) if "displacement" in root else unknown
        rows = Rows(w, force, np.ones(len(w)), unknown, position, np.full(len(w), name), True, turning=turning)
        _check(rows, name, "sample")
        stated = "slip_velocity_error" in root
        error = _numbers(root, "slip_velocity_error", name) if stated else np.full(len(w), noise_level(w))
        rows = replace(rows, blur=float(np.median(error)))
        moving = np.abs(w) > SENSE * error
        slides = ~root["stuck"].to_numpy().astype(bool) if "stuck" in root else np.ones(len(w), dtype=bool)
        cutoff = float(root.attrs.get("cutoff", math.nan)) if table is not None else math.nan
        smoothed = beside_sticks(time, slides, cutoff)
        if np.count_nonzero(moving & slides & ~smoothed) < LEFT * np.count_nonzero(moving & slides):
            smoothed[:] = False
        sliding = moving & slides & ~smoothed
        building = _building_up(time, w, force, sliding)
        rows, inertia, notes = _with_inertia(rows, root, sliding & ~building, name)
        slowest = 0.0 if building.any() else _slowest(w, force - inertia, moving & ~smoothed)
        rare = _against_the_usual_sense(w, sliding & ~building)
        left = _left_out(np.abs(w), slides, smoothed, moving, building, slowest, rare, name)
        moving = sliding & ~building & (np.abs(w) > slowest) & ~rare
    elif table is not None and {"slip_velocity", "force"} <= set(map(str, table)):
        w = _numbers(table, "slip_velocity", name)
        unknown = np.full(len(w), math.nan)

        def column(key: str) -> Array:
            return _numbers(table, key, name) if key in table else unknown

        load = column("pressure" if "pressure" in table else "normal_force")
        source = table["source"].to_numpy().astype(str) if "source" in table else np.full(len(w), name)
        rows = Rows(
            w, column("force"), column("force_error"), load, column("displacement"), source, False, turning=turning
        )
        _check(rows, name, "row")
        moving, left, notes = np.abs(w) > 0, LeftOut(name, len(rows), {}), []
    else:
        raise InputError(f"{name}: holds no friction over slip velocity; measure a record that slides")
    if not moving.any():
        raise InputError(f"{name}: nothing slides in it, so it holds no friction of slip; measure a record that slides")
    units = stated_units(data)
    return taken(rows, moving), {quantity: unit for quantity, unit in units.items() if quantity != "time"}, left, notes


def _with_inertia(rows: Rows, root: xr.Dataset, moving: Mask, name: str) -> tuple[Rows, Array | float, list[str]]:
    """Whether the record contradicts the inertia that was taken off its force: rows, the force that is left of it, a note."""
    subtracted = float(root.attrs.get("subtracted_inertia", math.nan))
    fast = moving & (np.abs(rows.w) > SLOW * float(np.abs(rows.w).max()))
    if math.isnan(subtracted) or np.count_nonzero(fast) < 4 * CURVED or "slip_acceleration" not in root:
        return rows, 0.0, []
    acceleration = _numbers(root, "slip_acceleration", name)
    if not np.ptp(acceleration[fast]) > 0:
        return rows, 0.0, []
    moved = replace(rows, acceleration=acceleration)
    off, error = inertia_error(taken(moved, fast), CURVED)
    if abs(off) < SENSE * error or (subtracted == 0 and not _at_all_speeds(taken(moved, fast), off)):
        return rows, 0.0, []
    unit = (TURNS if root["slip_velocity"].attrs.get("units") == TURNS.speed else SLIDES).mass
    by = f"{off:+.2g} +- {error:.1g} {unit}"
    note = (
        f"{name} contradicts the inertia of its rig, {subtracted:.4g} {unit}, by {by}: what is left of the force follows the "
        "acceleration. Measure the inertia again, or correct it in the rig; here it is fitted, where that predicts better."
        if subtracted > 0
        else f"{name}: the force follows the acceleration by {by}, as an inertia between instrument and contact has it, and "
        "the rig gives none. Set inertia in the rig; here it is fitted, where that predicts better."
    )
    return moved, off * acceleration, [note]


def _at_all_speeds(rows: Rows, inertia: float) -> bool:
    """Whether the slower and the faster half of the rows have this inertia, each by itself, and it is positive.

    Friction that lags behind the speed, or builds up over a distance at each reversal, follows the acceleration too, but
    not by one number.
    """
    speed = np.abs(rows.w)
    slow = speed < np.median(speed)
    halves = [inertia_error(taken(rows, half), CURVED) for half in (slow, ~slow)]
    return all(value > SENSE * error and abs(value - inertia) < INERTIA_TOLERANCE * inertia for value, error in halves)


def beside_sticks(time: Array, slides: Mask, cutoff: float) -> Mask:
    """Samples of slip that are less than a period of the cut-off frequency from a stick.

    The slip acceleration jumps where a stick ends. Smoothing takes the jump for a rise that begins before it, so inertia and
    speed are wrong on both sides.
    """
    if not cutoff > 0 or slides.all() or not slides.any():
        return np.zeros(slides.size, dtype=bool)
    stuck = time[~slides]
    after = np.searchsorted(stuck, time)
    since, until = time - stuck[np.maximum(after - 1, 0)], stuck[np.minimum(after, stuck.size - 1)] - time
    return slides & (np.minimum(np.abs(since), np.abs(until)) < 1 / cutoff)


def _against_the_usual_sense(w: Array, moving: Mask) -> Mask:
    """Samples against the sense in which nearly all slip is: they are too few to tell friction that way."""
    if not moving.any() or both_senses(w[moving]):
        return np.zeros(w.size, dtype=bool)
    usual = bool(np.mean(w[moving] > 0) > 0.5)
    rare: Mask = moving & ((w > 0) != usual)
    return rare


def _left_out(
    speed: Array,
    slides: Mask,
    smoothed: Mask,
    moving: Mask,
    building: Mask,
    slowest: float,
    rare: Mask,
    name: str,
) -> LeftOut:
    """How many samples of slip are no rows, at what speeds, and why."""
    left = slides & ~smoothed
    reasons = {
        "beside a stick, where the acceleration jumps and smoothing takes speed and inertia along": smoothed,
        "not clear of the error of w, so that the sense of the slip is not sure": left & ~moving,
        "so near a turn of the slip that friction still builds up": left & moving & building,
        "where friction differs between speeding up and slowing down, or only one of them was measured": (
            left & moving & (speed <= slowest)
        ),
        "slip against the sense of nearly all of it": rare & (speed > slowest),
    }
    found = {
        reason: (int(np.count_nonzero(which)), float(speed[which].max()))
        for reason, which in reasons.items()
        if which.any()
    }
    return LeftOut(name, int(np.count_nonzero(slides)), found)


def notes_on_left_out(records: Sequence[LeftOut]) -> list[str]:
    """One sentence on the samples of slip that are no rows, of however many records; none where there are no such samples."""
    records = [record for record in records if record.reasons]
    if not records:
        return []
    together: dict[str, tuple[int, float]] = {}
    for record in records:
        for reason, (count, fastest) in record.reasons.items():
            before, faster = together.get(reason, (0, 0.0))
            together[reason] = before + count, max(faster, fastest)
    parts = "; ".join(f"{count} up to w = {fastest:.3g}, {reason}" for reason, (count, fastest) in together.items())
    samples = sum(record.samples for record in records)
    if len(records) == 1:
        return [f"{records[0].name}: of {samples} samples these were left out: {parts}."]
    worst = max(records, key=lambda record: record.count / record.samples)
    return [
        f"{len(records)} records: of {samples} samples these were left out: {parts}. The largest share is that of "
        f"{worst.name}, {100 * worst.count / worst.samples:.0f} %."
    ]


def _building_up(time: Array, w: Array, force: Array, moving: Mask) -> Mask:
    """Samples so near a turn of the slip that friction still builds up from the other sense (presliding, backlash).

    While a mass speeds up after a turn, its friction is laid beside that of the same speed and sense while it slows down, in
    ranges of the path since the turn. Up to the first range in which it is not clearly less any more, samples on either
    side of a turn are no friction of the slip velocity. None are left out where that would be a large part of the stroke.
    """
    path = cumulative_trapezoid(np.abs(w), time, initial=0)
    turns = path[np.flatnonzero(np.diff(np.sign(w)) != 0)]
    none = np.zeros(w.size, dtype=bool)
    if turns.size < FEWEST_FOR_MEDIAN:
        return none
    after = np.searchsorted(turns, path)
    since = path - np.where(after > 0, turns[after - 1], -np.inf)
    until = np.where(after < turns.size, turns[np.minimum(after, turns.size - 1)], np.inf) - path
    farthest = STROKE * float(np.median(np.diff(turns)))
    speeding = np.gradient(np.abs(w)) > 0
    behind = _behind(w, force, moving & ~speeding)
    compared = moving & speeding & np.isfinite(behind)
    builds = False
    for reach in farthest * OCTAVE ** np.arange(-10.0, 1.0):
        lag, error = median_and_error(behind[compared & (since > reach / OCTAVE) & (since <= reach)])
        if not builds:  # it begins on the other side of zero
            builds = lag > max(0.5, SENSE * error)
        elif lag < max(BEHIND, SENSE * error):
            near: Mask = np.minimum(since, until) <= reach
            return near
    return none


def _behind(w: Array, force: Array, slowing: Mask) -> Array:
    """By which share friction is less than that of the same speed and sense while the mass slows down; NaN if not known."""
    behind = np.full(w.size, math.nan)
    for way in (w > 0, w < 0):
        speed, level = np.abs(w[slowing & way]), np.abs(force[slowing & way])
        if speed.size < 4 * FEWEST_FOR_MEDIAN:
            continue
        ranges = np.array_split(np.argsort(speed), min(RANGES, speed.size // FEWEST_FOR_MEDIAN))
        speeds, levels = ([float(np.median(values[part])) for part in ranges] for values in (speed, level))
        if min(levels) > 0:
            behind[way] = 1 - np.sign(w[way]) * force[way] / np.interp(np.abs(w[way]), speeds, levels)
    return behind


def _slowest(w: Array, force: Array, moving: Mask) -> float:
    """Speed below which friction is none of the slip velocity: it differs between speeding up and slowing down.

    After a turn friction builds up over a path (presliding, backlash). Medians of the two are laid beside each other in
    ranges of speed, from `SLOW` of the top speed downwards, as far as either can be told.
    """
    speed, speeding = np.abs(w), np.gradient(np.abs(w)) > 0
    end = SLOW * float(np.quantile(speed, 0.99))
    while True:
        inside = moving & (speed > end / OCTAVE) & (speed <= end)
        for way in (w > 0, w < 0):
            up, down = (force[inside & way & branch] for branch in (speeding, ~speeding))
            if min(up.size, down.size) < FEWEST_FOR_MEDIAN and max(up.size, down.size) > 0:
                return end
            (first, its_error), (second, other_error) = median_and_error(up), median_and_error(down)
            if abs(first - second) > SENSE * math.hypot(its_error, other_error):
                return end
        if not inside.any():
            return end
        end /= OCTAVE


def _numbers(table: xr.Dataset, key: str, name: str) -> Array:
    values = table[key].to_numpy()
    if values.ndim != 1 or values.shape != table["slip_velocity"].shape or values.dtype.kind not in "fiu":
        raise InputError(
            f"{name}: {key} must be one number a row, got {values.dtype} of shape {values.shape}; measure the record first"
        )
    return np.asarray(values, dtype=float)


def _check(rows: Rows, name: str, unit: str) -> None:
    """Refuse what is no number, and what is out of all proportion."""
    for words, values in (("slip velocity", rows.w), ("friction force", rows.force)):
        wrong = np.flatnonzero(~(np.abs(values) < LARGEST_NUMBER))
        if not wrong.size and 0 < np.max(np.abs(values), initial=0.0) < 1 / LARGEST_NUMBER:
            wrong = np.array([int(np.argmax(np.abs(values)))])
        if wrong.size:
            raise InputError(
                f"{name}: {words} is {values[wrong[0]]:g} in {unit} {wrong[0]}, where a number below {LARGEST_NUMBER:g} and "
                f"not all below {1 / LARGEST_NUMBER:g} was expected; remove that {unit} or correct the unit"
            )
    if len(rows) < 4 and unit == "sample":
        raise InputError(
            f"{name}: {len(rows)} samples are too few for friction over slip velocity; give a longer record"
        )
    wrong = np.flatnonzero(rows.error < 0)
    if wrong.size:
        raise InputError(
            f"{name}: force_error is {rows.error[wrong[0]]:g} in {unit} {wrong[0]}, where a standard error was expected; "
            "correct it"
        )


def joined(parts: list[Rows]) -> Rows:
    """The rows of several records, with errors that weigh them."""
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in ("w", "force", "error", "load", "position", "source")
    }
    if any(part.acceleration is not None for part in parts):
        given = [np.zeros(len(part)) if part.acceleration is None else part.acceleration for part in parts]
        columns["acceleration"] = np.concatenate(given)
    columns |= {name: all(getattr(part, name) for part in parts) for name in ("series", "turning")}
    columns["blur"] = max(part.blur for part in parts)
    rows = Rows(**columns)
    if not (np.isfinite(rows.error) & (rows.error > 0)).all():
        return replace(rows, error=np.ones(len(rows)))
    # a row whose scatter happens to be small is not known that much better than the others
    return replace(rows, error=np.maximum(rows.error, np.median(rows.error)))
