"""Which intervals are sticks of a mass that does not creep, and where each begins and ends: where the record is likeliest.

Also whether friction jumps as it ends, and whether the record tells.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
from scipy.linalg import LinAlgError
from scipy.optimize import minimize, minimize_scalar

from stickslip.files.arrays import Array
from stickslip.measurement.indirect.sticks.stick import Stick
from stickslip.measurement.signals.presmooth import Presmoothed, natural_period
from stickslip.measurement.signals.slip_evidence import Evidence, SlipModel, integrated_evidence
from stickslip.measurement.signals.turning_points import Flanks

Joint = Literal["before", "hard", "soft"]
"""The slip that a capture ends; the slip after a break-away where the friction force jumps, or does not."""

CUTOFF_RATIO = 1.5
ENOUGH_STICKS = 8
"""Cut-offs beside a joint are tried in this ratio, on so many sticks."""

MARGIN = 6
"""Samples that a slip beside a stick must have for its evidence to count."""

SURE = MARGIN + 2
"""So many samples of the last slip of a record tell when it began: with fewer it may be later than it is looked for."""

LATEST = 4
"""Where pictures are few, a first guess may be so many samples off."""

FEW_PER_PERIOD = 24
"""With fewer samples in a period of the free mass, the pieces beside a stick cannot tell rest from the first of the slip."""

BLUR = 2.5
"""A break-away is then known to so many samples only, and mostly seen too early."""

ERROR_RATIO = 2.0
"""Errors of limits within this ratio of the usual one differ by their noise."""

FINEST = 0.06
"""No limit is known to less than this part of a sample: what the shutter blurs moves it by as much, and no noise shows it."""

WIDTHS = 4
"""The evidence of a limit is looked at as far as so many of its standard errors on each side, in halves of them."""

USUAL_DECAY = 1.5
"""The slope of friction after a break-away dies away so many times as fast as the phase of the free mass goes on, roughly."""

PRIOR = np.array([1.5, 1.0, 1.0])
STEPS = np.array([-0.5, -0.4, 0.5])
STEEP = np.array([-0.7, -0.8, 0.0])
"""Standard deviations beforehand of the logarithm of the cut-off, of the slope in sqrt(k m), and of the logarithm of its
decay; first steps of their search, and a second starting point of it."""

ROUNDS = 4
"""Most parabolas through the evidence of a release, each narrower than the one before."""

EFFORT = 100
"""Most evaluations of that search."""

JUMP_DEVIANCE = 20.0
"""A force that jumps and falls on looks much like one that does not jump, and each slip repeats what is not quite true of
either: it must be likelier by so much in deviance."""

LIMIT_COST = 3.0
"""What a free limit costs in deviance: it is known to about a sample and was looked for over some ten."""


def resting_candidates(
    presmoothed: Presmoothed, flanks: Flanks, drive_velocity: float, own_frequency: float
) -> list[Stick]:
    """Where a mass that does not creep may stick: the slip velocity vanishes within its error."""
    slip = drive_velocity - presmoothed.rate
    level = max(0.1 * drive_velocity, 4 * presmoothed.rate_error)
    step = float(presmoothed.time[1] - presmoothed.time[0])
    # nearer to the ends of the record the presmoothed bends by itself: such a limit is not seen
    edge = max(round(0.1 / (own_frequency * step)), 3)
    # where friction does not jump at the break-away, w = (omega t)^2 V / 2 passes the level as late as this
    late = math.sqrt(2 * level / drive_velocity) / (2 * math.pi * own_frequency)
    sticks: list[Stick] = []
    for first, last in flanks.limits:
        below = np.flatnonzero(np.abs(slip[first : last + 1]) < level)
        if len(below) < 2:
            continue
        a, b = first + int(below[0]), first + int(below[-1])
        sticks.append(
            Stick(
                float(presmoothed.time[a]),
                float(presmoothed.time[b]),
                step,
                late,
                a >= edge,
                b < len(presmoothed.time) - edge,
            )
        )
    return sticks


class RefinedSticks(NamedTuple):
    """Sticks with their limits where the record puts them.

    Attributes
    ----------
    sticks : those that the record needs.
    soft : whether the force does not jump at the break-away.
    untold : where that was asked, and it does not: by how much later, in s, the sticks usually end if it does.
    """

    sticks: list[Stick]
    soft: bool
    untold: float


def refine_sticks(model: SlipModel, sticks: list[Stick], span: float, soft: bool | None = None) -> RefinedSticks:
    """Move the limits of each stick to where the record puts them, and drop sticks the record does not need.

    A stretch of at most a quarter of the own period on each side is taken as slip, rest, slip, each joint with its
    likeliest cut-off: farther away friction changes in another way, and would speak for another limit. A limit
    is where its evidence over time is greatest, or the mean of that evidence where the force does not jump and the
    peak is flat and skewed; its error is the spread of the evidence. A stick stays if it is likelier than a slip
    without it by more than its limits cost. Whether the friction force jumps when a stick gives way is decided once for
    all sticks, by the evidence of those that lie wholly in the record. A small jump that noise hides is not seen so: a
    release without one is then placed earlier, where the force is lower by the jump. If friction is constant in motion
    the release is latest, so the truth lies between the two.

    Parameters
    ----------
    model : the record, and the prior on its slips; with fewer than `FEW_PER_PERIOD` samples in a period the errors of
        break-aways are `BLUR` samples at least.
    sticks : first guesses.
    span : how far to look on each side of a guess, in s.
    soft : whether the force does not jump at a break-away where that is known already; where it jumps, it is then asked too
        whether friction falls as the slip speeds up.
    """
    reach = max(natural_period(model.oscillator) / 4, (MARGIN + LATEST) * model.step)
    stretches: list[_OneStick] = []
    for number, stick in enumerate(sticks):
        low, high = float(model.time[0]), float(model.time[-1])
        if number > 0:
            low = (sticks[number - 1].end + stick.start) / 2
        if number + 1 < len(sticks):
            high = (stick.end + sticks[number + 1].start) / 2
        stretches.append(_OneStick(model, stick, max(low, stick.start - reach), min(high, stick.end + reach), span))
    # friction changes fastest just before a capture: of two equally likely cut-offs the stiffer would push it late
    before = replace(model, cutoff=CUTOFF_RATIO * _likeliest(model, stretches, "before"))

    def outcome(joint: Joint, falls: bool) -> tuple[float, list[Stick], Array]:
        """Deviance and sticks under the likeliest prior of this kind, and the ends of all, also of those not needed."""
        after, total = replace(model, cutoff=_likeliest(model, stretches, joint)), 0.0
        if falls:
            after, total = _falling(after, stretches)
        refined = []
        for one in stretches:
            try:
                found, deviance = one.refined(joint == "soft", before, after)
            except LinAlgError:
                found, deviance = one.stick, 0.0
            total += deviance if one.whole else 0.0
            if found is not None:
                refined.append(found)
        return total, refined, np.array([one.last for one in stretches if one.whole])

    untold = 0.0
    if soft is None:
        best, other = outcome("hard", False), outcome("soft", False)
        soft = other[0] < best[0]
        if soft:
            later = best[2] - other[2]
            best = outcome("hard", True)
            soft = other[0] < best[0] + JUMP_DEVIANCE
            untold = max(float(np.median(later)), 0.0) if soft and later.size else 0.0
        best = other if soft else best
    else:
        best = outcome("soft" if soft else "hard", not soft)
    return RefinedSticks(_with_usual_errors(best[1]), soft, untold)


def _with_usual_errors(sticks: list[Stick]) -> list[Stick]:
    """The sticks with one error for all starts and one for all ends in the record, where these are alike."""
    starts = _usual([stick.start_error for stick in sticks], [stick.starts for stick in sticks])
    ends = _usual([stick.end_error for stick in sticks], [stick.ends for stick in sticks])
    return [
        replace(stick, start_error=start, end_error=end) for stick, start, end in zip(sticks, starts, ends, strict=True)
    ]


def _usual(errors: list[float], seen: list[bool]) -> list[float]:
    """Errors of limits, those that are `seen` and within a factor of `ERROR_RATIO` of their median by their root mean square.

    The evidence of a limit is narrower or wider by the same noise that shifts its peak (limits of one record that are seen
    later have narrower ones, with correlations down to -0.8), so a mean weighed by its widths would be off by more than its
    error. Only what differs by more than that noise does is the limit's own.
    """
    found = np.array(errors)
    alike = np.array(seen, bool)
    if alike.any():
        alike &= np.abs(np.log(found / np.median(found[alike]))) < math.log(ERROR_RATIO)
        found[alike] = math.sqrt(float(np.mean(found[alike] ** 2)))
    return [float(error) for error in found]


def _likeliest(model: SlipModel, stretches: list[_OneStick], joint: Joint) -> float:
    """Cut-off of the slips beside this joint under which the record is likeliest.

    One cut-off serves a whole slip, but friction may change faster or slower near its ends, where a slip that is too
    lax would pass for rest and one that is too stiff would push the limit away.
    """
    some = _some(stretches)

    def deviance(step: int) -> float:
        return math.fsum(one.least(joint, model.cutoff * CUTOFF_RATIO**step) for one in some)

    best, least = 0, deviance(0)
    for direction in (1, -1):
        while abs(best + direction) <= 5 and (value := deviance(best + direction)) < least:
            best, least = best + direction, value
        if best:
            break
    return float(model.cutoff * CUTOFF_RATIO**best)


def _some(stretches: list[_OneStick]) -> list[_OneStick]:
    """Sticks enough to choose by, spread over those that lie wholly in the record."""
    free = [one for one in stretches if one.whole]
    return [free[i] for i in np.unique(np.linspace(0, len(free) - 1, ENOUGH_STICKS).astype(int))] if free else []


def _falling(model: SlipModel, stretches: list[_OneStick]) -> tuple[SlipModel, float]:
    """The likeliest prior of the slips after a break-away where the force jumps, from one under which friction does not fall.

    Cut-off, slope and its decay are one for all slips.

    Returns
    -------
    the model with that prior, and its cost in deviance. Friction falls where that is likelier, its cost counted.
    """
    some = _some(stretches)
    if not some:
        return model, 0.0
    o = model.oscillator
    rate, unit = math.sqrt(o.stiffness / o.mass), math.sqrt(o.stiffness * o.mass)
    usual = np.array([math.log(model.cutoff), 0.0, math.log(USUAL_DECAY * rate)])

    def at(numbers: Array) -> SlipModel:
        cutoff, slope, decay = numbers.tolist()
        return replace(model, cutoff=math.exp(cutoff), slope=slope * unit, decay=math.exp(decay))

    def deviance(numbers: Array) -> float:
        """Deviance with the prior of the numbers."""
        off = (numbers - usual) / PRIOR
        return math.fsum(one.near_last(at(numbers)) for one in some) + float(off @ off)

    try:
        deviance(usual)  # the positions near which releases are looked for
        flat = minimize_scalar(
            lambda cutoff: deviance(usual + np.array([cutoff, 0.0, 0.0])),
            bounds=(-2.0, 1.0),
            method="bounded",
            options={"maxiter": 12},
        )
        start = usual + np.array([float(flat.x), 0.0, 0.0])
        level = deviance(start)
        start = min((start, usual + STEEP), key=deviance)
        simplex = start + np.vstack([np.zeros(3), np.diag(STEPS)])
        options: Any = {"initial_simplex": simplex, "maxfev": EFFORT, "fatol": 0.3, "xatol": 0.05}
        found = minimize(deviance, start, method="Nelder-Mead", options=options)
        least = deviance(found.x)
        cost = _laplace(deviance, found.x, least)
    except LinAlgError:
        return model, 0.0
    return (at(found.x), cost) if level - least > cost else (model, 0.0)


def _laplace(deviance: Callable[[Array], float], best: Array, least: float) -> float:
    """The cost in deviance of choosing all numbers of the prior but the cut-off, at their best.

    Source: Tierney & Kadane, J. Am. Stat. Assoc. 81 (1986) 82, to first order.
    """
    each, steps = np.diag(PRIOR), np.full(len(best), 0.1)
    for _ in range(2):  # the second time with steps that raise the deviance by about one
        used = steps
        ups = np.array([deviance(best + step * axis) for step, axis in zip(used, each, strict=True)])
        downs = np.array([deviance(best - step * axis) for step, axis in zip(used, each, strict=True)])
        rises = np.maximum((ups + downs) / 2 - least, 0.01)
        steps = np.clip(used / np.sqrt(rises), 0.003, 0.7)
    curvature = np.diag(2 * rises / used**2)
    for i in range(len(best)):
        for j in range(i):
            both = deviance(best + used[i] * each[i] + used[j] * each[j])
            curvature[i, j] = curvature[j, i] = (both - ups[i] - ups[j] + least) / (used[i] * used[j])
    own = math.log(max(curvature[0, 0], 2.0) / 2)  # of the cut-off, which is chosen in any case
    values = np.maximum(np.linalg.eigvalsh(curvature), 2.0)  # no less is known than beforehand
    return float(np.sum(np.log(values / 2))) - own


class _OneStick:
    """The search for the limits of one stick between two times."""

    def __init__(self, model: SlipModel, stick: Stick, low: float, high: float, span: float) -> None:
        self.model, self.stick, self.low, self.high, self.span = model, stick, low, high, span
        self.kept: dict[tuple[Joint, float, float, float, float], Evidence] = {}
        self.first: float | None = None
        self.last = stick.end
        self.sure = stick.sure and self._sure(stick.end)
        part = slice(*np.searchsorted(model.time, [low, high]))
        self.inside, y, w = model.time[part], model.path[part], model.weight[part] / model.noise**2
        # the level of the stick, near enough to tell cut-offs apart
        a, b = np.searchsorted(self.inside, stick.middle_half)
        self.middle = sum(stick.middle_half) / 2
        self.origin = float(
            np.average(y[a:b], weights=w[a:b]) if w[a:b].any() else np.interp(self.middle, self.inside, y)
        )
        y = y - self.origin
        self.sums = np.concatenate([np.zeros((3, 1)), np.cumsum([w, w * y, w * y * y], axis=1)], axis=1)

    @property
    def whole(self) -> bool:
        """Whether both limits lie in the record and are sure: of a piece of a stick at its edge little is known."""
        return self.stick.starts and self.stick.ends and self.sure

    def rest(self, start: float, end: float) -> Evidence:
        """Evidence of the samples between two times if the mass rests there."""
        a, b = np.searchsorted(self.inside, [start, end])
        return Evidence(*(self.sums[:, b] - self.sums[:, a]).tolist())

    def beside(self, joint: Joint, position: float, model: SlipModel) -> Evidence:
        """Evidence of the slip before or after the stick if it meets it at `position`."""
        key = (joint, position, model.cutoff, model.slope, model.decay)
        if key not in self.kept:
            if joint == "before":
                self.kept[key] = model.slip(self.low, position, self.origin, "end")
            else:
                self.kept[key] = model.slip(position, self.high, self.origin, "start", joint == "soft")
        return self.kept[key]

    def value(self, joint: Joint, model: SlipModel, at: float) -> float:
        """Deviance with one limit there, the level of the stick held."""
        return (self.rest(*sorted((at, self.middle))) + self.beside(joint, at, model)).constant

    @cached_property
    def ends(self) -> Array:
        """Where a release is looked for."""
        return self.positions()[1]

    def near_last(self, model: SlipModel) -> float:
        """Least deviance over the positions of a release, near the first that was found so.

        Beyond where releases are looked for, a prior that lets the slip run through the stick would win.
        """

        def value(at: float) -> float:
            return self.value("hard", model, at)

        step = 0.5 * self.model.step
        if self.first is None:
            self.first = min(self.ends.tolist(), key=value)
        lowest = max(self.middle + 2 * step, float(self.ends[0]))
        highest = min(self.high - MARGIN * self.model.step - 2 * step, float(self.ends[-1]))
        at = float(np.clip(self.first, lowest, highest))
        left, here, right = (value(at + side) for side in (-step, 0.0, step))
        while left < here and at - step > lowest:
            at, left, here, right = at - step, value(at - 2 * step), left, here
        while right < here and at + step < highest:
            at, left, here, right = at + step, here, right, value(at + 2 * step)
        for _ in range(ROUNDS):
            corner = left + right - 2 * here
            if not corner > 0:
                return here
            shift = float(np.clip(0.5 * (left - right) / corner, -1, 1))
            lowest_value, position = here - 0.5 * shift**2 * corner, at + shift * step
            if corner < 2:
                break
            # the valley is narrower than the points are apart, and steeper on one side
            step, at = max(step * math.sqrt(2 / corner), 0.1 * step), position
            left, here, right = (value(at + side) for side in (-step, 0.0, step))
        return lowest_value

    def least(self, joint: Joint, cutoff: float) -> float:
        """Least deviance over the positions of one limit, the level of the stick held."""
        model = replace(self.model, cutoff=cutoff)

        def value(at: float) -> float:
            return self.value(joint, model, at)

        starts, ends = self.positions()
        positions = starts[starts <= self.middle] if joint == "before" else ends[ends >= self.middle]
        if len(positions) < 2:
            return 0.0
        try:
            best = min(positions.tolist(), key=value)
            # a hard limit between two samples would ask for a laxer slip if it were left on one
            spacing = float(positions[1] - positions[0])
            return min(value(at) for at in np.linspace(best - 0.8 * spacing, best + 0.8 * spacing, 9).tolist())
        except LinAlgError:
            return math.inf

    def positions(self) -> tuple[Array, Array]:
        """Where the limits are looked for."""
        # the valley of a hard capture is a few samples wide and has hills beside it, so look everywhere first
        stick, step = self.stick, self.model.step
        margin = MARGIN * step
        return (
            self._positions(
                stick.start, stick.starts, self.low + margin, self.high - (2 * margin if stick.ends else 3 * step), 0.0
            ),
            self._positions(
                stick.end,
                stick.ends,
                self.low + (2 * margin if stick.starts else 3 * step),
                self.high - margin,
                stick.end_error,
            ),
        )

    def values(self, starts: Array, ends: Array) -> Array:
        """The deviance of each pair of limits, (starts, ends); infinite where they leave no stick."""
        longer = ends - starts[:, None] > self.model.step
        first, last = (np.searchsorted(self.inside, one) for one in (starts, ends))
        square, linear, constant = self.sums[:, None, last] - self.sums[:, first, None]
        if self.stick.starts:
            for row in np.flatnonzero(longer.any(axis=1)):
                slip = self.beside("before", float(starts[row]), self.before)
                square[row] += slip.square
                linear[row] += slip.linear
                constant[row] += slip.constant
        if self.stick.ends:
            for column in np.flatnonzero(longer.any(axis=0)):
                slip = self.beside("soft" if self.soft else "hard", float(ends[column]), self.after)
                square[:, column] += slip.square
                linear[:, column] += slip.linear
                constant[:, column] += slip.constant
        longer &= square > 0  # where nothing is seen of a stick and the slips beside it, there is no evidence
        found = np.full(longer.shape, np.inf)
        found[longer] = integrated_evidence(square[longer], linear[longer], constant[longer])
        return found

    def refined(self, soft: bool, before: SlipModel, after: SlipModel) -> tuple[Stick | None, float]:
        """The stick with its limits and errors, or None, and the deviance of the stretch, under these cut-offs."""
        self.soft, self.before, self.after, self.last = soft, before, after, self.stick.end
        stick, step = self.stick, self.model.step
        starts, ends = self.positions()
        table = self.values(starts, ends)
        best = float(np.min(table))
        if not math.isfinite(best):
            return None, 0.0
        row, column = divmod(int(np.argmin(table)), len(ends))
        start, end = float(starts[row]), float(ends[column])
        start_error, end_error = stick.start_error, stick.end_error
        if len(starts) > 1:
            start, start_error = self._centre(
                lambda to: self.values(to, ends[[column]]).ravel(), starts, table[:, column], False
            )
        if len(ends) > 1:
            end, end_error = self._centre(
                lambda to: self.values(np.array([start]), to).ravel(), ends, table[row], self.soft
            )
            if natural_period(self.model.oscillator) < FEW_PER_PERIOD * step:
                end_error = math.hypot(end_error, BLUR * step)
        self.last = end
        best = min(best, self.values(np.array([start]), np.array([end])).item())
        # no slip looks like rest for as long as the free mass takes to swing to and fro
        if (stick.starts or stick.ends) and end - start < natural_period(self.model.oscillator):
            without = min(
                model.slip(self.low, self.high, self.origin, "nowhere").integrated()
                for model in (self.model, before, after)
            )
            needed = best
            if after.slope:
                # A slip that is any other than the usual fall must not make up for it by having no stick at all.
                self.after = replace(self.model, slope=0.0)
                needed = min(best, float(np.min(self.values(starts, ends))))
            if without - needed < LIMIT_COST * (stick.starts + stick.ends):
                return None, without
        if end - start < step:
            return None, best
        sure = self.sure and self._sure(end)
        return replace(stick, start=start, end=end, start_error=start_error, end_error=end_error, sure=sure), best

    def _sure(self, end: float) -> bool:
        """Whether enough of the slip after a stick with this end is seen."""
        return bool(self.high < self.model.time[-1] or end < self.high - SURE * self.model.step)

    def _positions(self, at: float, free: bool, lowest: float, highest: float, early: float) -> Array:
        a, b = max(at - self.span - early, lowest), min(at + self.span, highest)
        if not free or b - a < FINEST * self.model.step:
            return np.array([at])
        return np.linspace(a, b, max(math.ceil((b - a) / self.model.step), 2) + 1)

    def _centre(
        self, value: Callable[[Array], Array], positions: Array, values: Array, soft: bool
    ) -> tuple[float, float]:
        """Place and spread of a limit under its evidence, on a grid fine enough for it."""
        wide = np.flatnonzero(values < values.min() + 15)
        spacing = float(positions[1] - positions[0])
        a, b = float(positions[wide[0]]) - spacing, float(positions[wide[-1]]) + spacing
        a, b = max(a, float(positions[0])), min(b, float(positions[-1]))
        fine = np.linspace(a, b, int(np.clip(math.ceil(5 * (b - a) / spacing), 2, 16)) + 1)
        deviances = _deviances(value, fine)
        best, width = _peak(fine, deviances)
        # a parabola through points farther apart than the peak is wide misses it: the peak is steeper on one side
        if 0 < WIDTHS * width < len(fine) / 2 * (fine[1] - fine[0]) and fine[0] < best < fine[-1]:
            fine = np.linspace(max(best - WIDTHS * width, a), min(best + WIDTHS * width, b), 4 * WIDTHS + 1)
            deviances = _deviances(value, fine)
            best, _ = _peak(fine, deviances)
        likelihood = np.exp(-0.5 * (deviances - deviances.min()))
        likelihood /= likelihood.sum()
        mean = float(likelihood @ fine)
        spread = math.sqrt(float(likelihood @ (fine - mean) ** 2))
        return (mean if soft else best), max(spread, FINEST * self.model.step)


def _deviances(value: Callable[[Array], Array], positions: Array) -> Array:
    """Deviances at some positions, infinite where there is none; 0 where the positions are one."""
    found = value(positions) if positions[-1] > positions[0] else np.zeros(len(positions))
    return np.where(np.isfinite(found), found, np.inf)


def _peak(positions: Array, deviances: Array) -> tuple[float, float]:
    """Place of the least deviance by a parabola, and its standard error; 0 where it has no curvature."""
    i = int(np.clip(np.argmin(deviances), 1, len(positions) - 2))
    left, lowest, right = deviances[i - 1 : i + 2].tolist()
    corner = left + right - 2 * lowest
    if not 0 < corner < np.inf:
        return float(positions[i]), 0.0
    spacing = float(positions[1] - positions[0])
    shift = float(np.clip(0.5 * (left - right) / corner, -1, 1))
    return float(positions[i]) + shift * spacing, spacing * math.sqrt(2 / corner)
