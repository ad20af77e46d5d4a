"""The table of break-aways: how long each stick lasted, how fast it was loaded, at what force it gave way."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from stickslip.measurement.indirect.force import Friction, Release
from stickslip.measurement.indirect.sticks.stick import Stick, ends_of
from stickslip.measurement.result import event_table
from stickslip.measurement.rigs.rig import RigUnits


def break_aways(friction: Friction, sticks: list[Stick], units: RigUnits) -> xr.Dataset:
    """One row for each stick whose end lies inside the record and is sure, in these units.

    Returns
    -------
    Dataset over `event`, each variable with its ``_error``, which holds what all break-aways of the record have in common:
        t : end of the stick, s.
        stick_time : length of the stick, s; NaN where its start lies before the record.
        force_rate : slope of the friction force over the stick, N/s; NaN for sticks of fewer than four samples.
        force : friction force when it gives way, N.
        drop : fall of the spring force k x from there to its lowest value before the next stick, N; NaN where the
            record ends before that.
    """
    o, time = friction.fit.oscillator, friction.time
    rows: list[list[float]] = []
    ends = ends_of(stick for stick in sticks if stick.sure)
    if len(ends) == 0:
        return event_table([], units.force, units.time)
    terms = {0: -o.stiffness, 1: -o.damping}
    level_error = friction.fit.deviation(ends, terms, friction.noise)
    path, slip = friction.fit.evaluate(ends, 0), friction.fit.evaluate(ends, 1)
    forces = o.stiffness * (o.drive_velocity * (ends - time[0]) - path) + o.damping * (o.drive_velocity - slip)
    row = -1
    for number, stick in enumerate(sticks):
        if not (stick.ends and stick.sure):
            continue
        row += 1
        a, b = np.searchsorted(time, [stick.start, stick.end])
        rate, rate_error = _slope(friction, int(a), int(b))
        known_rate = rate if math.isfinite(rate) else 0.0
        release = friction.releases.get(stick.end)
        if release is None:
            own_error = math.hypot(float(level_error[row]), known_rate * stick.end_error)
            release = Release(0.0, stick.end_error, 0.0, own_error)
        end_error = math.hypot(release.error, friction.late)
        following = sticks[number + 1].start if number + 1 < len(sticks) else time[-1]
        c = int(np.searchsorted(time, following, side="right"))
        drop = float("nan")
        if number + 1 < len(sticks) and c > b:
            drop = o.stiffness * (float(np.interp(stick.end, time, friction.extension)) - friction.extension[b:c].min())
        stick_time = stick.end + release.later - stick.start if stick.starts else float("nan")
        extra, extra_rate = friction.added.get(stick.end, (0.0, 0.0))
        # the drive loads a stick that late, also where what creeps rises more slowly
        shared = math.hypot(o.stiffness * o.drive_velocity * friction.late, friction.common)
        force_error = math.hypot(release.force_error, extra_rate * release.error, shared)
        rows.append(
            [
                stick.end + release.later,
                end_error,
                stick_time,
                math.hypot(stick.start_error, end_error),
                rate,
                rate_error,
                float(forces[row]) + extra + release.higher + extra_rate * release.later,
                force_error,
                drop,
                math.sqrt(2) * force_error,
            ]
        )
    return event_table(rows, units.force, units.time)


def _slope(friction: Friction, a: int, b: int) -> tuple[float, float]:
    """Straight-line slope of the friction force over samples a to b and its error, creep included."""
    if b - a < 4:
        return float("nan"), float("nan")
    t = friction.time[a:b] - friction.time[a:b].mean()
    f = friction.force[a:b]
    square = float(np.sum(t * t))
    slope = float(np.sum(t * f)) / square
    noise = friction.fit.oscillator.stiffness * friction.noise
    # what bends away from the line counts once per stick, not once per sample
    corner = float(np.std(f - f.mean() - slope * t)) / (t[-1] - t[0])
    return slope, math.hypot(noise / math.sqrt(square), corner)
