"""A drive that goes at one speed, then at another: friction of every hold, and of every step between two."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import xarray as xr
from scipy.ndimage import median_filter

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.files.schema import Share, any_number, positive
from stickslip.measurement.instruments.errors_of_means import block_error
from stickslip.measurement.instruments.instrument import Constant, Instrument, InstrumentRig, Samples, only
from stickslip.measurement.result import event_table, friction_tree
from stickslip.measurement.signals.noise import noise_level

SAME_SPEED = 1.2
"""Neighbouring stretches whose speeds differ by less than this ratio are one hold."""
SAME_LOAD = 0.02
"""Normal forces that differ by less than this share of their mean are one load."""
STEP_COLUMNS = (
    *("t", "begin", "end", "velocity_before", "velocity_after", "force_before", "peak_force", "force_after"),
    *("jump", "jump_error", "direct_effect", "direct_effect_error", "a_minus_b", "a_minus_b_error"),
)
"""Columns of the table of steps."""
LEAST_HOLD_SAMPLES = 16
"""Samples a hold must have."""
LEAST_PATH = 10
"""Tolerances that a hold must be long: less is a piece of the ramp from one speed to the next."""
COVERED = 0.95
"""Share of the path that must lie in holds, each of another speed than the next, for a tolerance to be one."""
LADDER = 1.5
"""Ratio of the tolerances that are tried, from twelve times the noise of the displacement on."""
AT_REST = 0.01
"""Share of the speed of the holds about a rest below which the drive rests."""
FEWEST_RESTS = 3
"""Rests with a peak of friction after them that make a table of break-aways."""
PIECES = 4
"""Most pieces that a ramp between two holds is cut into."""
GAP = 0.25
"""Ramp between two holds, as a part of the shorter one, above which they are no step."""


@dataclass(frozen=True)
class _Hold:
    """A stretch at constant speed, samples [first, last)."""

    first: int
    last: int
    speed: float


def _measure(records: list[Samples], rig: InstrumentRig) -> xr.DataTree:
    """Friction after settling in every hold, and before, at the peak of and after every step of the speed.

    The displacement is cut into straight lines (Douglas & Peucker): a cut is made wherever a line misses the displacement
    by more than `tolerance`; neighbouring lines of nearly one speed are one hold. Where the rig gives no tolerance it is
    the smallest, from twelve times the noise on, at which holds cover the path and no two neighbours are of one speed: one
    above what the drive sways by, however long the record. The level of a hold is the mean friction over its last `settle`
    share, its error that of a mean of samples that follow each other, with the drift over that share. At a step from V1 to
    V2 friction jumps by peak - before; the direct effect is a = (peak - before) / ln(V2/V1), and
    a - b = (after - before) / ln(V2/V1). The machine's compliance takes something off the peak, and noise adds to it, by a
    third of the stated error where five samples, over which a running median is taken, are short against the decay; the
    error of a - b covers the drift along the hold. A drive takes its time to change its speed: the time of a step is where
    the lines of the two holds cross.

    Sources: Douglas & Peucker, Cartographica 10 (1973) 112; Dieterich, J. Geophys. Res. 84 (1979) 2161.
    """
    record = only(records, "velocity_steps")
    time, x, friction = record.time, record["displacement"], record["force"]
    unit = record.units["force"]
    notes = list(record.notes)
    load = record["normal_force"] if "normal_force" in record else np.full(len(time), math.nan)
    if "normal_force" in record:
        if not (load > 0).all():
            at = int(np.argmin(load > 0))
            raise InputError(
                f"{record.source}: the normal force is {load[at]:.4g} at {time[at]:.6g} s, where it must be positive; choose "
                "a window (rig: [read] window) in which the sample is loaded"
            )
        friction, unit = friction / load, "1"
    least_speed, given = rig.number("least_speed"), rig.maybe("tolerance")
    tolerance = _tolerance(time, x, least_speed) if given is None else given
    holds, covered = _holds(time, x, tolerance, least_speed)
    if not holds:
        raise InputError(
            f"{record.source}: no stretch of constant speed above least_speed = {least_speed:g} was found whose path is ten "
            f"times the tolerance of {tolerance:.3g}; lower least_speed or tolerance, or give the displacement sign = -1 "
            "where it falls"
        )
    if covered < COVERED:
        notes.append(
            f"only {100 * covered:.0f} % of the path lie in stretches of constant speed: the displacement sways by more than "
            f"the tolerance of {tolerance:.3g}, or the speed changes slowly; look at the holds, and give the rig a tolerance"
        )
    found = len(holds)
    holds = _without_ramps(time, holds)
    if len(holds) < found:
        notes.append(
            f"{found - len(holds)} short stretches between two speeds are the drive's ramp from one to the other, not holds "
            "of their own: the step is counted at the crossing of the lines of both holds"
        )
    rows = [_level(record, friction, load, hold, rig.number("settle")) for hold in holds]
    table = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    length = record.units["displacement"]
    speed_unit = f"{length}/s"
    units = {"slip_velocity": speed_unit, "t": "s", "displacement": length, "duration": "s", "drift": f"{unit}/s"}
    if "normal_force" in record:
        units["normal_force"] = record.units["normal_force"]
    else:
        del table["normal_force"]
    steady = xr.Dataset({name: ("row", values, {"units": units.get(name, unit)}) for name, values in table.items()})
    steps = _steps(time, x, friction, holds, rows, unit, speed_unit)
    notes.append(
        f"{len(holds)} stretches of constant speed were found (the displacement lies within {tolerance:.3g} {length} of "
        f"straight lines); friction is the mean over the last {rig.number('settle'):g} of each"
    )
    facts: dict[str, float | str] = {
        "holds": float(len(holds)),
        "steps": float(steps.sizes["step"]),
        "lowest_speed": float(table["slip_velocity"].min()),
        "highest_speed": float(table["slip_velocity"].max()),
        "force": float(np.median(table["force"])),
        "force_error": float(np.median(table["force_error"])),
    }
    if steps.sizes["step"]:
        weight = 1 / steps["a_minus_b_error"].to_numpy() ** 2
        values = steps["a_minus_b"].to_numpy()
        mean = float(np.average(values, weights=weight))
        spread = math.sqrt(float(np.average((values - mean) ** 2, weights=weight)) / max(len(values) - 1, 1))
        facts["a_minus_b"] = mean
        facts["a_minus_b_error"] = max(1 / math.sqrt(float(weight.sum())), spread)
        for name in ("jump", "jump_error", "direct_effect", "direct_effect_error"):
            facts[name] = float(np.median(np.abs(steps[name].to_numpy())))
        facts["peak_force"] = float(steps["peak_force"].max())
        notes.append(
            "the machine's compliance rounds the peak of a step off, so the direct effect a is at least what is given here, "
            "but for the noise that its error states"
        )
    speed = np.zeros(len(time))
    for hold in holds:
        speed[hold.first : hold.last] = hold.speed
    rests = _rests(time, x, friction, holds, rows)
    if rests:
        lasted = [rest[2] for rest in rests]
        peaks = [rest for rest in rests if rest[8] > 3 * rest[9]]
        many = len(peaks) >= FEWEST_RESTS
        notes.append(
            f"{len(rests)} rests of the drive ({min(lasted):.4g} to {max(lasted):.4g} s) between stretches of one speed were "
            f"found, with {len(peaks)} peaks of friction after them; "
            + (
                "the table of break-aways holds these peaks over the length of the rest; friction that decays from a peak is "
                "no steady friction, and no force rate is given"
                if many
                else f"{FEWEST_RESTS} peaks make a table of break-aways, these are not measured"
            )
        )
        rests = peaks if many else []
    for rest in rests:  # up to the peak the sample is loaded, and hardly slips
        speed[slice(*np.searchsorted(time, [rest[0] - rest[2], rest[0]]))] = 0.0
    loads = {"normal_force": (load, record.units["normal_force"])} if "normal_force" in record else {}
    return friction_tree(
        series={
            "time": (time, "s"),
            "slip_velocity": (speed, speed_unit),
            "force": (friction, unit),
            "force_error": (np.full(len(time), noise_level(friction)), unit),
            "stuck": (speed == 0, "1"),
            "displacement": (x, length),
            **loads,
        },
        tables={"steady": steady, "step": steps, "break_away": event_table(rests, unit)},
        source=record.source,
        rig=rig.toml,
        notes=notes,
        facts=facts,
    )


def _tolerance(time: Array, x: Array, least_speed: float) -> float:
    """The smallest at which holds cover the path and each is of another speed than the next, or a rest is between them."""
    noise, path = noise_level(x), float(np.ptp(x))
    trial = max(12 * noise, 1e-6 * path)
    while trial * LEAST_PATH < path:
        holds, covered = _holds(time, x, trial, least_speed)
        if covered >= COVERED and all(
            _ratio(a.speed, b.speed) >= SAME_SPEED or _rest_between(time, x, a, b) for a, b in pairwise(holds)
        ):
            return trial
        trial *= LADDER
    return max(12 * noise, 1e-3 * path)


def _holds(time: Array, x: Array, tolerance: float, least_speed: float) -> tuple[list[_Hold], float]:
    """Stretches over which the displacement is a straight line to within the tolerance, and their share of the path."""
    marks = {0, len(time) - 1}
    left = [(0, len(time) - 1)]
    while left:
        first, last = left.pop()
        if last - first < 2:
            continue
        t = time[first : last + 1]
        chord = x[first] + (x[last] - x[first]) * (t - t[0]) / (t[-1] - t[0])
        away = np.abs(x[first : last + 1] - chord)
        worst = int(np.argmax(away))
        if away[worst] > tolerance:
            marks.add(first + worst)
            left += [(first, first + worst), (first + worst, last)]
    edges = sorted(marks)
    parts = [_Hold(a, b, float(x[b] - x[a]) / float(time[b] - time[a])) for a, b in pairwise(edges)]
    joined: list[_Hold] = []
    for part in parts:
        before = joined[-1] if joined else None
        if before and min(before.speed, part.speed) > 0 and _ratio(before.speed, part.speed) < SAME_SPEED:
            whole = float(x[part.last] - x[before.first]) / float(time[part.last] - time[before.first])
            joined[-1] = _Hold(before.first, part.last, whole)
        else:
            joined.append(part)
    moving = [(part, float(x[part.last] - x[part.first])) for part in joined if part.speed > least_speed]
    holds = [
        (part, path)
        for part, path in moving
        if part.last - part.first >= LEAST_HOLD_SAMPLES and path >= LEAST_PATH * tolerance
    ]
    return [part for part, _ in holds], sum(path for _, path in holds) / max(sum(path for _, path in moving), 1e-300)


def _without_ramps(time: Array, holds: list[_Hold]) -> list[_Hold]:
    """The holds without the pieces of a drive's ramp from one speed to the next: short ones of speeds in between."""
    kept, k = holds[:1], 1
    while k < len(holds):
        old = kept[-1]
        for n in range(min(k + PIECES, len(holds) - 1), k, -1):
            new = holds[n]
            change = np.diff([old.speed, *(piece.speed for piece in holds[k:n]), new.speed])
            shorter = min(float(time[hold.last] - time[hold.first]) for hold in (old, new))
            if abs(np.sign(change).sum()) == len(change) and time[new.first] - time[old.last] <= GAP * shorter:
                k = n
                break
        kept.append(holds[k])
        k += 1
    return kept


def _rest_between(time: Array, x: Array, old: _Hold, new: _Hold) -> bool:
    """Whether the drive rests from one hold to the next: in the middle half, as it slows down before and starts after it."""
    quarter = (new.first - old.last) // 4
    begin, end = old.last + quarter, new.first - quarter
    return abs(float(x[end] - x[begin])) < AT_REST * old.speed * float(time[end] - time[begin])


def _ratio(a: float, b: float) -> float:
    return max(a / b, b / a)


def _unlike(before: dict[str, float], after: dict[str, float]) -> bool:
    """Whether two holds are under different loads, where these are known."""
    loads = before["normal_force"], after["normal_force"]
    return math.isfinite(loads[0]) and abs(loads[1] - loads[0]) > SAME_LOAD * sum(loads) / 2


def _level(record: Samples, friction: Array, load: Array, hold: _Hold, settle: float) -> dict[str, float]:
    time, x = record.time, record["displacement"]
    begin = time[hold.first] + (1 - settle) * (time[hold.last] - time[hold.first])
    late = slice(int(np.searchsorted(time, begin)), hold.last)
    part = friction[late]
    t = time[late] - time[late].mean()
    drift = float(np.sum(t * part) / np.sum(t * t))
    return {
        "t": float(time[late].mean()),
        "slip_velocity": hold.speed,
        "force": float(part.mean()),
        "force_error": math.hypot(block_error(part, 6), drift * float(t[-1] - t[0]) / math.sqrt(12)),
        "drift": drift,
        "normal_force": float(load[late].mean()),
        "displacement": float(x[late].mean()),
        "duration": float(time[hold.last] - time[hold.first]),
    }


def _rests(
    time: Array, x: Array, friction: Array, holds: list[_Hold], rows: list[dict[str, float]]
) -> list[list[float]]:
    """A row of the table of break-aways for each rest of the drive between two holds of one speed under one load."""
    found: list[list[float]] = []
    for old, new, before, after in zip(holds, holds[1:], rows, rows[1:], strict=False):
        lasted = float(time[new.first] - time[old.last])
        if _ratio(old.speed, new.speed) >= SAME_SPEED or _unlike(before, after) or not _rest_between(time, x, old, new):
            continue
        calm = median_filter(friction[new.first : new.last], 5, mode="nearest")
        later = calm[: max(len(calm) // 2, 3)]
        top = int(np.argmax(later))
        noise = noise_level(friction[new.first : new.last])
        # the highest of so many samples about the peak stands that far out by itself
        near = np.count_nonzero(later > later[top] - 3 * noise)
        # and the running median takes two steps of the slower side off a sharp peak, which it leaves flat
        cut = float(later[top] - max(later[max(top - 4, 0)], later[min(top + 4, len(later) - 1)]))
        error = math.hypot(noise * math.sqrt(1 + 2 * math.log(near)), cut)
        step = float(np.median(np.diff(time[new.first : new.last])))
        at, drop = float(time[new.first + top]), float(later[top]) - after["force"]
        drop_error = math.hypot(error, after["force_error"])
        found.append(
            [at, near * step / 2, lasted, step, math.nan, math.nan, float(later[top]), error, drop, drop_error]
        )
    return found


def _crossing(time: Array, x: Array, old: _Hold, new: _Hold) -> float:
    """Time at which the line of the later half of a hold crosses that of the earlier half of the next."""
    at = float(time[new.first])
    halves = slice((old.first + old.last) // 2, old.last), slice(new.first, (new.first + new.last) // 2 + 1)
    (slow, a), (fast, b) = (np.polyfit(time[half] - at, x[half], 1) for half in halves)
    least, most = time[(old.first + old.last) // 2] - at, time[(new.first + new.last) // 2] - at
    return at + float(np.clip((a - b) / (fast - slow), least, most)) if fast != slow else at


def _steps(
    time: Array, x: Array, friction: Array, holds: list[_Hold], rows: list[dict[str, float]], unit: str, speed_unit: str
) -> xr.Dataset:
    """One row for each pair of holds of two speeds that follow each other under one load."""
    found: list[dict[str, float]] = []
    for i in range(1, len(holds)):
        old, new, before, after = holds[i - 1], holds[i], rows[i - 1], rows[i]
        apart = float(time[new.first] - time[old.last])
        same = _ratio(old.speed, new.speed) < SAME_SPEED
        if same or _unlike(before, after) or apart > GAP * min(before["duration"], after["duration"]):
            continue
        # friction just before the step, and its extreme just after it; a running median keeps single samples out
        calm = median_filter(friction[old.first : new.last], 5, mode="nearest")
        step = _crossing(time, x, old, new)
        at = int(np.searchsorted(time, step)) - old.first
        level, level_error = float(calm[at // 2 : at].mean()), block_error(calm[at // 2 : at], 6)
        way = 1.0 if new.speed > old.speed else -1.0
        later = calm[at : at + max((len(calm) - at) // 3, 3)]
        peak = way * float(np.max(way * later))
        # the extreme of so many samples of noise stands that far out by itself
        noise = float(np.std(np.diff(calm[at // 2 : at]))) / math.sqrt(2)
        stands_out = noise * math.sqrt(2 * math.log(len(later)))
        # friction that drifts along the hold cannot be told from what the step did
        drift = abs(after["drift"]) * (after["t"] - step) / math.sqrt(3)
        logarithm = abs(math.log(new.speed / old.speed))
        jump_error = math.hypot(level_error, stands_out)
        found.append(
            {
                "t": step,
                "begin": float(time[old.first]),
                "end": float(time[new.last]),
                "velocity_before": old.speed,
                "velocity_after": new.speed,
                "force_before": level,
                "peak_force": peak,
                "force_after": after["force"],
                "jump": peak - level,
                "jump_error": jump_error,
                "direct_effect": way * (peak - level) / logarithm,
                "direct_effect_error": jump_error / logarithm,
                "a_minus_b": way * (after["force"] - level) / logarithm,
                "a_minus_b_error": math.hypot(level_error, after["force_error"], drift) / logarithm,
            }
        )
    units = dict.fromkeys(("t", "begin", "end"), "s") | dict.fromkeys(("velocity_before", "velocity_after"), speed_unit)
    return xr.Dataset(
        {
            name: ("step", np.array([row[name] for row in found]), {"units": units.get(name, unit)})
            for name in STEP_COLUMNS
        }
    )


VELOCITY_STEPS = Instrument(
    name="velocity_steps",
    channels={"displacement": ("length", "angle"), "force": ("force", "torque", "pressure", "ratio")},
    optional={"normal_force": ("force", "pressure")},
    constants={
        "tolerance": Constant(positive("length", "angle")),
        "least_speed": Constant(any_number("speed", "angular_speed"), 0.0),
        "settle": Constant(Share, 0.5),
    },
    measure=_measure,
)
