"""First guess of the paper's law: its lines are read off the loops of friction over slip velocity of each record."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from stickslip.errors import InputError
from stickslip.files.arrays import Array, Indices
from stickslip.identification.guesses.guess_data import Guess, GuessData
from stickslip.identification.kinetic.replayed_motion import Motion, least_climb, velocity_noise
from stickslip.identification.records import FrictionRecord
from stickslip.laws import BogaczRyczek, Law, StaticFriction

FALLS = 0.03
"""A range of the peaks beyond that part of the highest is a fall of f_s(0, δ) with the force rate δ."""
SHARP = (1.0, 2.0, 4.0, 8.0, 16.0)
"""Exponents of that fall that are tried."""

SHORT_CLIMB = 0.03
"""Part of the range of w from which on a climb says where it begins: D is found from two such beginnings."""


@dataclass(frozen=True)
class _Loop:
    """Lines of one record's loop: the corner, slopes below and above it, and the climb from the turning point.

    The peak is f_s(0, δ) where nothing sticks, with the force rate δ = k V that adhesion would feel (NaN: k is not known).
    """

    corner: tuple[float, float]
    lower: float
    common: float
    upper: float
    reversal: tuple[float, float] | None
    peak: tuple[float, float]
    least_climb: float
    force_rate: float


def bogacz_ryczek(data: GuessData) -> Guess:
    """Corners, slopes and climbs of the loops at several drive velocities, and where lines of a kind meet."""
    loops = [loop for record in data.records if (loop := _loop(record)) is not None]
    climbing = [(loop, loop.reversal) for loop in loops if loop.reversal is not None]
    if not climbing:
        raise InputError(
            "identify: BogaczRyczek needs a record without sticks (almost-harmonic motion): f_s(0), D and the climbs "
            "show only there; add one at a higher drive velocity, or ask for PiecewiseLinear"
        )
    velocities = {round(abs(r.constants.get("drive_velocity", i)), 12) for i, r in enumerate(data.records)}
    if len(velocities) < 2:
        raise InputError(
            "identify: the pencils B and D and the line l of BogaczRyczek are where lines of different drive velocities "
            "meet, and all records have one drive velocity: add records at others"
        )
    corners = np.array([loop.corner for loop in loops])
    width, height = float(corners[:, 0].mean()), float(corners[:, 1].mean())
    surface, falling, fall_notes = _fall([loop for loop, _ in climbing])
    initial = surface.initial
    upper = float(np.median([loop.upper for loop in loops]))
    common = float(np.median([loop.common for loop in loops]))
    slopes = [height / width * c for c in (1.0, 2.0)]
    if float(np.ptp(corners[:, 0])) > 0.02 * width:
        measured = float(np.polyfit(corners[:, 0], corners[:, 1], 1)[0])
        slopes.insert(0, measured)
    lower = float(np.median([loop.lower for loop in loops]))
    free = [*falling, "phi", "psi", "l.slope", "l.intercept", "B.w", "B.f"]
    notes = ["Held fixed: beta, eta and alpha of the law.", *fall_notes]
    if len(data.rows) >= 2:
        time = data.rows["stick_time"].to_numpy()
        rates = data.rows["force_rate"].abs().fillna(0.0).to_numpy()
        grown = data.break_away - float(np.median(_at_once(surface, rates)))
        typical = float(np.median(time))
        surface = replace(surface, limit=max(grown, 0.01 * initial) / (1 - math.exp(-1.0)), rate=1 / typical)
        free.append("static_friction.limit")
        low, high = np.quantile(time, [0.1, 0.9])
        if high > 1.5 * low:
            free.append("static_friction.rate")
        else:
            notes.append(
                f"All stick times lie near {typical:.3g}, so the limit and the rate of static friction cannot be "
                f"separated: the rate is held at {1 / typical:.3g}, and static friction is known at that stick time only."
            )
    starts = [w for loop, (w, _) in climbing if loop.peak[0] - w > loop.least_climb]
    # At a turning point beyond D the climb is no longer D's; a climb too narrow to be seen says nothing of that.
    beyond = max(starts, default=min(w for _, (w, _) in climbing))
    points, guessed = _climb_points(climbing, initial), {}
    if len(starts) >= 2 and max(starts) - min(starts) > 0.05 * width:
        free += ["D.w", "D.f"]
    else:
        free.append("D.f")
        # it lies between the turning point and some way beyond
        guessed["D.w"] = 0.5 * max(abs(points[0][0] - beyond), float(np.ptp([w for w, _ in points])))
        notes.append(
            "D is where climbs at different drive velocities meet, and only one climb is wide enough in w to be seen: D "
            "is known to lie on a line, its w is held at a guess. Add an almost-harmonic record close above the end of "
            "stick-slip."
        )
    candidates: list[Law] = []
    for slope in slopes:
        for back in (0.3, 1.0, 3.0):
            for ahead in points:
                try:
                    candidates.append(
                        BogaczRyczek(
                            static_friction=surface,
                            B=(-back * width, height - lower * (1 + back) * width),
                            D=ahead,
                            l=(slope, height - slope * width),
                            phi=math.degrees(math.atan(upper)),
                            psi=math.degrees(math.atan(common)),
                            beta=0.01 * width / 0.3,
                            alpha=0.0,
                        )
                    )
                except InputError:
                    continue
    if not candidates:
        raise InputError(
            "identify: the loops of friction over slip velocity do not look like those of BogaczRyczek (a falling upper and "
            "lower branch that meet, then a rising one): ask for PiecewiseLinear"
        )
    bounds = {"D.w": (beyond, 3 * width)}
    return Guess(candidates[0], free, notes=notes, candidates=candidates[1:], bounds=bounds, guessed=guessed)


def _at_once(surface: StaticFriction, rate: Array) -> Array:
    """f_s(0, δ) of a surface."""
    return np.asarray(surface.initial + surface.drop / (1 + (rate / surface.drop_scale) ** surface.drop_exponent))


def _fall(loops: Sequence[_Loop]) -> tuple[StaticFriction, list[str], list[str]]:
    """f_s(0, δ) from the peaks of loops without sticks, the names of its numbers that these tell, and what is assumed.

    Each force rate gives one point of the curve, so that many numbers are free.
    """
    peaks = np.array([loop.peak[1] for loop in loops])
    rate = np.array([loop.force_rate for loop in loops])
    flat = StaticFriction(initial=float(np.median(peaks)))
    count = len(set(rate.round(12)))
    # It falls, if at all: peaks that rise with the rate are something else.
    falls = np.isfinite(rate).all() and count > 1 and float(np.polyfit(rate, peaks, 1)[0]) < 0
    if not falls or float(np.ptp(peaks)) < FALLS * float(peaks.max()):
        return flat, ["static_friction.initial"], []
    best: tuple[float, StaticFriction] | None = None
    for exponent in SHARP:
        for scale in np.geomspace(0.7 * rate.min(), 1.4 * rate.max(), 29):
            gone = 1 / (1 + (rate / scale) ** exponent)
            columns = np.stack([np.ones_like(gone), gone], axis=1)
            initial, drop = (float(part) for part in np.linalg.lstsq(columns, peaks, rcond=None)[0])
            misfit = float(np.sum((peaks - initial - drop * gone) ** 2))
            if initial > 0 and 0 < drop < 2 * float(peaks.max()) and (best is None or misfit < best[0]):
                best = (
                    misfit,
                    replace(flat, initial=initial, drop=drop, drop_scale=float(scale), drop_exponent=exponent),
                )
    if best is None:
        return flat, ["static_friction.initial"], []
    names = [f"static_friction.{name}" for name in ("initial", "drop", "drop_scale", "drop_exponent")]
    ends = f"from {peaks.max():.3g} to {peaks.min():.3g}"
    said = f"f_s(0, delta) falls with the force rate, {ends} over the motions without sticks"
    if count >= len(names):
        return best[1], names, [f"{said}."]
    held = ", ".join(f"{name} = {getattr(best[1], name.rpartition('.')[2]):.3g}" for name in names[count:])
    return best[1], names[:count], [f"{said}; these hold {count} force rates, so held at a guess is {held}."]


def _climb_points(loops: Sequence[tuple[_Loop, tuple[float, float]]], initial: float) -> list[tuple[float, float]]:
    """Points in which the climbs of loops with their reversals might meet, along the climb of the slowest loop."""
    slowest, reversal = min(loops, key=lambda climb: climb[1])
    rise = max(slowest.peak[1] - reversal[1], 0.01 * initial)
    run = max(slowest.peak[0] - reversal[0], 1e-3 * slowest.corner[0])
    steep = max(rise / run, 0.5 * initial / slowest.corner[0])
    reach = max(loop.corner[0] for loop, _ in loops) - reversal[0]
    return [(reversal[0] + c * reach, reversal[1] + steep * c * reach) for c in (0.7, 0.9, 1.2)]


def _loop(record: FrictionRecord) -> _Loop | None:
    motion = Motion.of(record, BogaczRyczek)
    w, force = np.abs(motion.slip_velocity), np.abs(motion.record.force)
    falling: list[Indices] = []
    rising: list[tuple[Indices, bool]] = []
    for (first, last), turns in zip(motion.slips, motion.turns, strict=True):
        edges = [first, *[int(i) for i in turns], last - 1]
        for i, (a, b) in enumerate(pairwise(edges)):
            if b - a < 8 or (first == 0 and i == 0):
                continue
            run = np.arange(a, b + 1)
            if w[b] < w[a]:
                falling.append(run)
            elif i > 0 or first > 0:
                rising.append((run, i == 0))
    if not falling or not rising:
        return None
    # The beginning of a record is a transient: look at the second half of the runs.
    falling = falling[len(falling) // 2 :]
    rising = rising[len(rising) // 2 :]
    whole = np.concatenate(falling)
    corner, lower, common = _corner(w[whole], force[whole])
    peaks, reversals, upper = [], [], []
    for run, from_rest in rising:
        below = run[w[run] < corner[0]]
        if below.size < 4:
            continue
        top = below[int(np.argmax(force[below]))]
        peaks.append((w[top], force[top]))
        if not from_rest:
            reversals.append((w[run[0]], force[run[0]]))
        if corner[0] > w[top]:
            upper.append((corner[1] - force[top]) / (corner[0] - w[top]))
    if not peaks or not upper:
        return None
    mean = np.median(np.array(peaks), axis=0)
    reversal = np.median(np.array(reversals), axis=0) if reversals else None
    return _Loop(
        corner=corner,
        lower=lower,
        common=common,
        upper=float(np.median(upper)),
        reversal=None if reversal is None else (float(reversal[0]), float(reversal[1])),
        peak=(float(mean[0]), float(mean[1])),
        least_climb=least_climb(velocity_noise(record), [float(w[whole].max() - w[whole].min())], SHORT_CLIMB),
        force_rate=abs(record.constants.get("stiffness", math.nan) * record.constants.get("drive_velocity", math.nan)),
    )


def _corner(w: Array, force: Array) -> tuple[tuple[float, float], float, float]:
    """The bent line closest to the points: its bend, the slopes below and above it."""
    low, high = float(w.min()), float(w.max())

    def bent(corner: float) -> tuple[float, tuple[float, float], float, float]:
        columns = np.stack([np.ones_like(w), np.minimum(w - corner, 0.0), np.maximum(w - corner, 0.0)], axis=1)
        level, below, above = np.linalg.lstsq(columns, force, rcond=None)[0].tolist()
        misfit = float(np.sum((force - columns @ np.array([level, below, above])) ** 2))
        return misfit, (corner, level), below, above

    corners = np.linspace(low + 0.15 * (high - low), high - 0.15 * (high - low), 29).tolist()
    return min(map(bent, corners), key=lambda found: found[0])[1:]
