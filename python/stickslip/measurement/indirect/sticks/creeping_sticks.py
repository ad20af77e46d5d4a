"""Which intervals are sticks of a mass that creeps: where it moves with the drive, but for a part of its speed."""

from __future__ import annotations

import math

import numpy as np

from stickslip.measurement.indirect.sticks.stick import Stick, ends_of
from stickslip.measurement.signals.presmooth import Presmoothed
from stickslip.measurement.signals.turning_points import Flanks

AT_REST = 0.05
"""A creeping stick must come to rest: to this fraction of the drive velocity, or to within its noise."""
CREEP_LEVEL = 0.5
"""A creeping stick ends where the slip velocity passes this fraction of the drive velocity."""


def _creep_level(presmoothed: Presmoothed, drive_velocity: float) -> float:
    """Slip velocity that bounds the sticks of a mass that creeps: half of V, and four sigmas where the noise asks for it."""
    return max(CREEP_LEVEL * drive_velocity, 4 * presmoothed.rate_error)


def creeping_sticks(presmoothed: Presmoothed, flanks: Flanks, drive_velocity: float) -> list[Stick]:
    """Sticks of a mass that creeps: from where the slip velocity has fallen to half of V to where it passes it again."""
    slip = drive_velocity - presmoothed.rate
    level = _creep_level(presmoothed, drive_velocity)
    slow = max(AT_REST * drive_velocity, 3 * presmoothed.rate_error)
    step = presmoothed.time[1] - presmoothed.time[0]
    acceleration = np.gradient(slip, presmoothed.time)
    sticks: list[Stick] = []
    for first, last in flanks.limits:
        below = np.flatnonzero(slip[first : last + 1] < level)
        if len(below) < 3 or np.min(slip[first : last + 1]) > slow:
            continue
        a, b = first + int(below[0]), first + int(below[-1])
        errors = [
            math.hypot(step / 2, presmoothed.rate_error / max(abs(float(acceleration[i])), 1e-300)) for i in (a, b)
        ]
        longest = (presmoothed.time[b] - presmoothed.time[a]) / 2
        sticks.append(
            Stick(
                start=float(presmoothed.time[a]),
                end=float(presmoothed.time[b]),
                start_error=min(errors[0], longest),
                end_error=min(errors[1], longest),
                starts=a > 0,
                ends=b < len(presmoothed.time) - 1,
            )
        )
    return sticks


def creep_delay(presmoothed: Presmoothed, sticks: list[Stick], drive_velocity: float) -> float:
    """How long after a sudden break-away the slip velocity passes the level that ends a creeping stick: the usual level / w'.

    A mass that only seems to creep, as its positions have an error that is smooth along the way or in time, breaks away
    before the level by that much; one that creeps is said to break away there.
    """
    level = _creep_level(presmoothed, drive_velocity)
    acceleration = np.gradient(drive_velocity - presmoothed.rate, presmoothed.time)
    at = np.searchsorted(presmoothed.time, ends_of(sticks))
    fastest = [float(acceleration[i : i + 3].max()) for i in at]
    delays = [level / fast for fast in fastest if fast > 0]
    return float(np.median(delays)) if delays else 0.0
