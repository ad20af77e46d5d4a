"""Where a branch of twice the period ends: the flip at which its orbit is one of half the period, taken twice."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stickslip.dynamics.continuation.arclength import Family, Point, axis, consistent, corrected
from stickslip.dynamics.periodic.newton_iteration import Lost
from stickslip.dynamics.periodic.poincare_map import Return, return_of
from stickslip.errors import InputError
from stickslip.files.arrays import Array

#: Halves whose durations differ by less, relative to the period, are one orbit taken twice.
_ONE = 1e-7


def period_halving(point: Point, ahead: Point, family: Family) -> tuple[Point, Point] | None:
    """The flip between two points of a branch, once and as the last point of the branch; None where there is none.

    Beyond the flip the orbit of twice the period is itself, shifted by half of it: the parameter goes back, which is no fold,
    and its halves have changed places. So the difference of their durations changes its sign.
    """
    before, after = _apart(point.here), _apart(ahead.here)
    if before is None or after is None or before.shape != after.shape or before @ after >= 0:
        return None
    sequence, leap = point.here.sequence, _leap(point, ahead)
    share = float(np.linalg.norm(before) / (np.linalg.norm(before) + np.linalg.norm(after)))
    half = sequence.phases.reshape(2, -1)
    phases = half[0].copy()
    phases["duration"] = half["duration"].mean(axis=0)
    start = replace(sequence, start=sequence.start + share * leap, phases=phases)
    values = point.values + share * (ahead.values - point.values)
    periods = point.here.forcing_periods // 2
    try:
        flip = corrected(start, periods, family, values, None, "flip")
        flip = corrected(flip.here.sequence, periods, family, flip.values, axis(start))
        twice = replace(flip.here.sequence, phases=np.tile(flip.here.sequence.phases, 2))
        end = return_of(twice, 2 * periods, family.paths[0], tests=True)
    except (Lost, InputError):
        return None
    # Newton's method may have gone to a flip elsewhere.
    if _distance(flip, point, family) > 2 * _distance(ahead, point, family) or not consistent(flip.here):
        return None
    return flip, Point(end, flip.values, point.direction)


def _apart(here: Return) -> Array | None:
    """The durations of the second half of an orbit minus those of its first; None where it has no such halves."""
    phases = here.sequence.phases
    if len(phases) % 2 or here.forcing_periods % 2:
        return None
    first, second = phases.reshape(2, -1)
    if any((first[name] != second[name]).any() for name in ("mode", "ending", "contact")):
        return None
    apart = np.subtract(*here.durations.reshape(2, -1)[::-1])
    return None if np.abs(apart).max() < _ONE * here.period else np.asarray(apart, float)


def _leap(point: Point, ahead: Point) -> Array:
    """From one start to another; what is no number stays as it is."""
    with np.errstate(invalid="ignore"):
        leap = ahead.here.sequence.start - point.here.sequence.start
    return np.where(np.isfinite(leap), leap, 0.0)


def _distance(one: Point, other: Point, family: Family) -> float:
    """How far apart two points are, in sizes of the state and the parameter."""
    state = _leap(other, one)[other.here.coordinates] / other.here.sizes
    return float(np.linalg.norm(np.append(state, (one.values - other.values) / family.scales(other.values))))
