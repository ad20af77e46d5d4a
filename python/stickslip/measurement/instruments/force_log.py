"""A slow log of the force of a spring that pulls a block: a table of break-aways, nothing in between is resolved."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from stickslip.errors import InputError
from stickslip.files.schema import any_number, positive
from stickslip.measurement.instruments.errors_of_means import straight_line
from stickslip.measurement.instruments.instrument import Constant, Instrument, InstrumentRig, Samples, only
from stickslip.measurement.result import event_table, friction_tree
from stickslip.measurement.signals.clocks.clock_offset import LEAST_SAMPLES as LEAST_PICTURES
from stickslip.measurement.signals.clocks.clock_offset import spring_offset
from stickslip.measurement.signals.turning_points import turning_points

AS_STATED = 0.02
"""A loading rate that differs from stiffness x drive velocity by less than this part is as the rig says."""
DISTINCT = 4
"""Steps of the log over which the middle four fifths of the stick times must spread before a growth with them is looked for:
sampling alone makes equal sticks differ by up to two, and a peak that is sampled later is also higher."""


class _ForceLog(Instrument):
    """Takes along a film of the spring's two ends, on another clock."""

    def read(self, source: Any, rig: InstrumentRig) -> Samples:
        if not rig.companion:
            return super().read(source, rig)
        log = super().read(source, replace(rig, companion=""))
        film = self.read_companion(source, rig, LEAST_PICTURES)
        return replace(log, companion=film, scale_error=film.scale_error)


def _measure(records: list[Samples], rig: InstrumentRig) -> xr.DataTree:
    """Peaks of the force from which it falls by more than `least_drop`.

    A slip is over between two samples of such a log: its stick ends up to one step after the highest sample, and the next
    one begins up to one step before the lowest. So the highest sample is too low by 0 to rate * step, by half of that on
    average, which is added; the rest, rate * step / √12, is the standard error. Likewise a drop is too small by rate * step
    on average, and a stick time too short by one step. `t` is left at the highest sample. Where sticks are equal, all are
    missed alike, and `force_common` holds what a mean over them does not take out (:func:`_missed_alike`). While the block
    sticks the spring's force is the friction force.
    """
    record = only(records, "force_log")
    time, force = record.time, record["force"]
    least = rig.number("least_drop")
    valleys, peaks = turning_points(force, least)
    step = float(np.median(np.diff(time)))
    resolution = float(np.min(np.diff(np.unique(force)))) if len(np.unique(force)) > 1 else 0.0
    rows: list[list[float]] = []
    rates: list[float] = []
    misses: list[float] = []
    stuck = np.zeros(len(time), dtype=bool)
    for peak in peaks:
        before = [valley for valley in valleys if 0 < valley < peak]  # at 0 the stick began before the record
        after = [valley for valley in valleys if valley > peak]
        start = before[-1] if before else 0
        low = after[0] if after else peak + int(np.argmin(force[peak:]))
        drop = float(force[peak] - force[low])
        if drop < least:
            continue
        stuck[start : peak + 1] = True
        t, f = time[start : peak + 1], force[start : peak + 1]
        rate, rate_error = straight_line(t, f)
        rates.append(rate)
        missed = max(rate, 0.0) * step if np.isfinite(rate) else 0.0
        force_error = float(np.hypot(missed, resolution) / np.sqrt(12))
        misses.append(missed)
        rows.append(
            [
                float(time[peak]),
                step / 2,
                float(time[peak] - time[start]) + step if before else float("nan"),
                step / np.sqrt(6),
                rate,
                rate_error,
                float(force[peak]) + missed / 2,
                force_error,
                drop + missed,
                float(np.sqrt(2)) * force_error,
            ]
        )
    notes = [
        *record.notes,
        f"a fall of the force counts as a slip from {least:g} N on (least_drop); slips shorter than the sampling interval "
        f"of {step:.3g} s are jumps between two samples, so friction while slipping is not measured",
    ]
    drive, stiffness = rig.maybe("drive_velocity"), rig.maybe("stiffness")
    rate = float(np.nanmedian(rates)) if rates else float("nan")
    if drive is not None and stiffness is not None and np.isfinite(rates).any():
        ratio = rate / (drive * stiffness)
        # the standard error of a median is 1.25 times that of a mean
        error = 1.25 * float(np.nanstd(rates)) / np.sqrt(np.count_nonzero(np.isfinite(rates))) / (drive * stiffness)
        words = f"median loading rate {rate:.3g} N/s is {ratio:.2f} ± {error:.2g} times stiffness x drive velocity"
        if ratio > 1 + max(2 * error, AS_STATED):
            words += (
                ", which no creep explains: stiffness or drive velocity of the rig is too small, or the drive uneven"
            )
        elif ratio < 1 - max(2 * error, AS_STATED):
            words += ": what is missing is creep and small slips within a stick, or the rig is wrong by that"
        notes.append(words)
    unit = record.units["force"]
    events = event_table(rows, unit)
    facts: dict[str, float | str] = {"slips": float(len(rows))}
    facts |= {name: value for name, value in (("stiffness", stiffness), ("drive_velocity", drive)) if value is not None}
    if len(rows) > 2:
        facts["regime"] = "stick_slip"
    if rows:
        values = np.array(rows)
        facts |= {
            "force": float(values[:, 6].mean()),
            "force_error": float(values[:, 6].std(ddof=1)) if len(rows) > 1 else float("nan"),
            "mean_drop": float(values[:, 8].mean()),
            "recurrence": float(np.mean(np.diff(values[:, 0]))) if len(rows) > 1 else float("nan"),
            "force_rate": rate,
        }
        both = np.isfinite(values[:, 2]) & (values[:, 2] > 0)
        logarithm = np.log10(values[both, 2])
        if logarithm.size > 5 and np.subtract(*np.quantile(values[both, 2], [0.9, 0.1])) > DISTINCT * step:
            slope, error = straight_line(logarithm, values[both, 6])
            facts |= {"force_per_decade": slope, "force_per_decade_error": error}
            facts["correlation"] = float(np.corrcoef(logarithm, values[both, 6])[0, 1])
    tables = {"break_away": events}
    if record.companion is not None:
        tables["film"] = _join(record, record.companion, rig, events, notes, facts)
    series: dict[str, tuple[npt.NDArray[np.generic], str]] = {
        "time": (time, "s"),
        "force": (force, unit),
        "force_error": (np.full(len(force), resolution / np.sqrt(12)), unit),
        "stuck": (stuck, "1"),
    }
    return friction_tree(
        series=series,
        tables=tables,
        source=record.source,
        rig=rig.toml,
        notes=notes,
        facts=facts,
        constants={"force_common": float(np.median(misses)) * _missed_alike(np.array(rows)[:, 0], step)}
        if rows
        else {},
    )


def _missed_alike(times: npt.NDArray[np.float64], step: float) -> float:
    """Standard error, in parts of rate * step, that peaks at these times have in common.

    Each is missed by a part that is uniform between 0 and 1. Only waits of different numbers of steps show that this part
    differs from peak to peak: it counts as drawn anew as often as they do.

    >>> _missed_alike(np.array([0.0, 3.0, 7.0, 9.0]), 1.0) < _missed_alike(np.array([0.0, 3.0, 6.0, 9.0]), 1.0)
    True
    """
    waits = np.diff(times)
    if not waits.size:
        return 0.0
    drawn = 1 + np.count_nonzero(np.abs(waits - np.median(waits)) > step / 2)
    return math.sqrt(max(1 / drawn - 1 / len(times), 0.0) / 12)


def _join(
    log: Samples, film: Samples, rig: InstrumentRig, events: xr.Dataset, notes: list[str], facts: dict[str, float | str]
) -> xr.Dataset:
    """What the film shows on the clock of the log; offset, spring and common slips go to the notes and facts."""
    if not {"displacement", "drive_displacement"} <= set(film.channels):
        raise InputError(
            f"{film.source}: the companion of a force_log must hold the spring's two ends; name displacement and "
            "drive_displacement in [companion.columns]"
        )
    block, extension = film["displacement"], film["drive_displacement"] - film["displacement"]
    found = spring_offset(log.time, log["force"], film.time, extension, taut=rig.maybe("taut"))
    stiffness_error = math.hypot(found.stiffness_error, film.scale_error * found.stiffness)
    given = rig.maybe("clock_offset")
    offset = found.value if given is None else given
    notes += [
        *film.notes,
        f"the clock of the log is ahead of the film's by {found.value:.2f} +- {found.error:.2f} s, where force and extension "
        f"are one spring of {found.stiffness:.4g} +- {stiffness_error:.2g} N/m to {found.residual:.2g} N rms; "
        + ("this was used" if given is None else f"the rig says {given:g} s, which was used"),
    ]
    if given is not None:
        notes += found.contradiction(given)
    time = film.time + offset
    step = float(np.median(np.diff(log.time)))
    for start in events["t"].to_numpy():
        # the pictures between which the log's fall lies, their own clock being known to `found.error`
        last = int(np.searchsorted(time, start + step / 2)) - 1
        if 0 <= last < len(time) - 1:
            notes.append(
                f"the slip at {start:.4g} to {start + step:.4g} s is on the film between the pictures of {time[last]:.4g} "
                f"and {time[last + 1]:.4g} s, in which the block moves by {block[last + 1] - block[last]:.3g} m"
            )
    facts |= {
        "clock_offset": offset,
        "clock_offset_error": found.error if given is None else 0.0,
        "spring_stiffness": found.stiffness,
        "spring_stiffness_error": stiffness_error,
        "spring_residual": found.residual,
    }
    length, unit = film.units["displacement"], log.units["force"]
    seen = np.interp(time, log.time, log["force"], np.nan, np.nan)
    return xr.Dataset(
        {
            "displacement": ("picture", block, {"units": length}),
            "extension": ("picture", extension, {"units": length}),
            "force": ("picture", seen, {"units": unit}),
        },
        coords={"t": ("picture", time, {"units": "s"})},
    )


FORCE_LOG = _ForceLog(
    name="force_log",
    channels={"force": ("force", "torque")},
    optional={"displacement": ("length", "angle"), "drive_displacement": ("length", "angle")},
    constants={
        "least_drop": Constant(positive("force"), needed=True),
        "stiffness": Constant(positive("stiffness")),
        "drive_velocity": Constant(positive("speed")),
        "clock_offset": Constant(any_number("time")),
        "taut": Constant(positive("force", "torque")),
    },
    measure=_measure,
)
