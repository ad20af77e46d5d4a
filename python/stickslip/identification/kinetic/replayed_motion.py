"""A measured motion made ready for the replay of a law: real turning points, stretches with a known memory."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.optimize import isotonic_regression

from stickslip.files.arrays import Array, Indices, Mask
from stickslip.identification.kinetic.displacement_error import DisplacementError, without
from stickslip.identification.records import FrictionRecord
from stickslip.laws import (
    BogaczRyczek,
    Coulomb,
    DwellTime,
    Law,
    LogarithmicDwell,
    StaticKinetic,
    TwoBranch,
)
from stickslip.laws.law import MotionColumns, motion_columns
from stickslip.measurement.signals.noise import noise_level
from stickslip.measurement.signals.sample_runs import runs_of

FEWEST_STRETCH_SAMPLES = 12
"""Indices a stretch must have to be compared."""
SMEARED = 4.0
"""Time constants of a filter after which less than a fiftieth of a jump is left."""
AT_REST = 3.0
"""Slip velocities below that many standard errors."""
SENSE = 4.0
"""Within so many standard errors of rest a record does not tell which way it slides."""
NARROW_CLIMB = 0.045
"""A climb over less than this part of the range of w is shaped by the smoothing of w."""
NUDGE = 1e-3
"""Part of the range of w by which w is moved to see the slope of a law."""
REVERSAL = 0.1
"""A reversal beside a stick whose path is less than this part of the longest run of its slip is noise; the work of a run as
short, beside the longest of the record, is not compared."""

#: Laws whose kinetic force depends on what was before: nothing is compared until the memory is known.
WITH_MEMORY = (BogaczRyczek,)

#: Laws whose friction at a turn of the slip velocity is a reaction that no law gives.
HOLDING = (TwoBranch,)

#: Laws whose kinetic force is one number: the work of each slip says all there is to know about it.
WITHOUT_SHAPE = (Coulomb, StaticKinetic, DwellTime, LogarithmicDwell)


@dataclass
class Motion:
    """A record and what a replay of a law along it needs.

    Attributes
    ----------
    record : with the inner samples of its sticks left out.
    slip_velocity : w with every wiggle below the noise taken out, so that the sense of the acceleration changes only
        where the motion turns.
    force_rate : dF/dt while stuck, shape (n,).
    slips : first and one past the last sample of each slip, which ends where the mass turns.
    turns : for each slip the samples at which w turns.
    stretches : parts of slips in which a law is compared, [first, last).
    """

    record: FrictionRecord
    slip_velocity: Array
    force_rate: Array
    slips: list[tuple[int, int]]
    turns: list[Indices]
    stretches: list[tuple[int, int]]
    law: type[Law]
    latent: DisplacementError | None

    @classmethod
    def of(cls, record: FrictionRecord, law: type[Law]) -> Motion:
        """Prepare a record for replays of one kind of law."""
        compact = record.without_inner_sticks()
        w, slips, turns = without_wiggles(compact)
        stretches: list[tuple[int, int]] = []
        for (first, last), turn in zip(slips, turns, strict=True):
            start = first
            if issubclass(law, WITH_MEMORY) and compact.stuck[:first].all():
                # The first climb begins on a branch that is not known; where it has ended the memory is.
                ends = [int(b) for a, b in pairwise(turn) if _is_minimum(w, int(a), first, last)]
                if not ends:
                    continue
                start = ends[0]
            if issubclass(law, WITHOUT_SHAPE):
                # A long slip is cut at its slowest points: one number for each cycle.
                cuts = [int(i) for i in turn if _is_minimum(w, int(i), first, last)]
                stretches += [(a, b) for a, b in pairwise([first, *cuts, last]) if b > a]
            else:
                unseen = _unresolved(compact, w, turn, first, last)
                if issubclass(law, HOLDING):
                    unseen |= _near_turns(compact, w, turn, first, last)
                stretches += [
                    (start + a, start + b)
                    for a, b in runs_of(~unseen[start - first :])
                    if b - a >= FEWEST_STRETCH_SAMPLES
                ]
        if issubclass(law, WITHOUT_SHAPE):
            # The work of a short run, such as where a record ends while the mass comes to rest, is that of its errors.
            paths = [float(np.abs(w[a:b]).sum()) for a, b in stretches]
            stretches = [part for part, path in zip(stretches, paths, strict=True) if path >= REVERSAL * max(paths)]
        rate = _force_rate(record, compact)
        return cls(compact, w, rate, slips, turns, stretches, law, _latent(compact))

    @property
    def by_work(self) -> bool:
        """Whether one number is compared for each slip, the work done."""
        return issubclass(self.law, WITHOUT_SHAPE)

    @property
    def indirect(self) -> bool:
        """Whether force was measured by the indirect method, with the constants of the oscillator known."""
        return self.latent is not None

    @property
    def _rows_more(self) -> int:
        """Rows of :meth:`misfit` that a stretch has beside its samples: 1 where an error of the last turn is bounded."""
        return int(self.indirect and issubclass(self.law, WITH_MEMORY))

    @cached_property
    def compared(self) -> Mask:
        """Which samples lie in a stretch, shape (n,)."""
        inside = np.zeros(self.record.time.size, dtype=bool)
        for first, last in self.stretches:
            inside[first:last] = True
        return inside

    def replay(self, law: Law) -> Array:
        """Friction force of `law` along the motion, shape (n,)."""
        return law._along(*self._columns)

    def difference(self, law: Law, offset: float = 0.0) -> Array:
        """Measured minus predicted force of every sample, shape (n,)."""
        return np.asarray(self.record.force - self.replay(law) - offset)

    def work_mean(self, force: Array, first: int, last: int) -> float:
        """Mean of a force over the slip path."""
        # Asked of every slip at every step of a fit: NumPy's `average` takes four times as long to check its arguments.
        path, part = self._speed[first:last], force[first:last]
        length = path.sum()
        return float((part * path).sum() / length if length > 0 else part.mean())

    def misfit_error(self) -> Array:
        """What is known of the noise of :meth:`misfit` beforehand, in its unit and shape; 0 where nothing is."""
        if not self.by_work:
            return np.zeros(sum(b - a + self._rows_more for a, b in self.stretches))
        if self.latent is not None:
            return np.array([self._work_error(a, b) for a, b in self.stretches])
        errors = []
        for a, b in self.stretches:
            path = np.abs(self.slip_velocity[a:b])
            weight = path / path.sum() if path.sum() > 0 else np.full(b - a, 1 / (b - a))
            sigma = self.record.force_error[a:b]
            errors.append(min(float(np.sqrt(self._together * np.sum((weight * sigma) ** 2))), float(sigma.max())))
        return np.array(errors)

    @property
    def _together(self) -> float:
        """Indices whose errors go together in a smoothed record: half a period of its cut-off."""
        known = self.record.constants
        return max(0.5 / (known["slip_cutoff"] * self.record.step), 1.0) if "slip_cutoff" in known else 1.0

    def _work_error(self, first: int, last: int) -> float:
        """Standard error of the mean of an indirect force over the path of a stretch.

        With f = m ẍ + D ẋ + k x and w = V − ẋ, integrated by parts, an error ε of the displacement changes the mean f̄ over
        the path L = ∫ w dt by

            L δf̄ = ∫ (k V + 2 D ẍ) ε dt + [(f̄ − f + m ẍ + D w) ε + m w ε̇],

        so little of an error of the acceleration is left. Inside, ε is the white noise σ. At an end that meets a stick w = 0,
        f − m ẍ is the friction f_a of the stick beside it and ε its level's, σ / √n of n samples; at an open end ε and ε̇ are
        what makes the stated error of the force, of a smoothing that passes frequencies up to its cut-off.
        """
        record, w = self.record, self.slip_velocity[first:last]
        known, step = record.constants, record.step
        mass, damping, noise = known["mass"], known.get("damping", 0.0), known["noise"]
        path, mean = step * float(w.sum()), self.work_mean(record.force, first, last)
        if path == 0:
            return float(record.force_error[first:last].max())
        acceleration = -np.gradient(w, step) if w.size > 1 else np.zeros(1)
        inner = known["stiffness"] * known["drive_velocity"] + 2 * damping * acceleration
        variance = (noise * step) ** 2 * float(inner @ inner)
        turn = 2 * math.pi * known["slip_cutoff"]
        for end, beside in ((first, first - 1), (last - 1, last)):
            if 0 <= beside < record.time.size and record.stuck[beside]:
                other = beside + (beside - end)  # only the first and the last sample of a stick are kept
                whole = 0 <= other < record.time.size and record.stuck[other]
                rest = abs(record.time[other] - record.time[beside]) / step + 1 if whole else 1.0
                variance += ((mean - record.force[beside]) * noise) ** 2 / rest
            else:
                shaken = record.force_error[end] / mass
                at = mean - record.force[end] + mass * acceleration[end - first] + damping * w[end - first]
                variance += (at * shaken) ** 2 * 5 / turn**4 + (mass * w[end - first] * shaken) ** 2 * 5 / 3 / turn**2
        return math.sqrt(variance) / abs(path)

    def cycles(self) -> list[int]:
        """Rows of :meth:`misfit` where a cycle begins, and the row after the last.

        A cycle ends with its stretch and at the slowest points within.
        """
        w, rows = self.slip_velocity, [0]
        slowest = [
            int(i)
            for (first, last), turn in zip(self.slips, self.turns, strict=True)
            for i in turn
            if _is_minimum(w, int(i), first, last)
        ]
        for a, b in self.stretches:
            rows += [rows[-1] + i - a for i in slowest if a < i < b] + [rows[-1] + b - a + self._rows_more]
        return rows

    def misfit(self, law: Law, offset: float = 0.0) -> Array:
        """Measured minus predicted, over all stretches.

        An indirect force and its slip velocity have their errors from one displacement. What is compared are the instrument's
        samples and the nearest motion that obeys the law (see :class:`DisplacementError`). A force measured directly is
        compared as it is.

        For a law without a shape over w one number is compared for each slip: the difference of the work done.
        """
        predicted = self.replay(law)
        difference = self.record.force - predicted - offset
        if self.by_work:
            return np.array([self.work_mean(difference, a, b) for a, b in self.stretches])
        if self.latent is None:
            at, _ = self._compared
            return self._weight * difference[at]
        own, carried, prior = self._slopes(law, predicted)
        # The law was replayed along a slip velocity without wiggles, the force has the measured one.
        difference = difference - own * self._wiggles
        at, lengths = self._compared
        found, free = self.latent.solve(difference[at], own[at], None if carried is None else carried[at], lengths)
        return without(free, self._smoothed[at] + found, prior, lengths)

    def shares(self, misfit: Array) -> tuple[Indices, Array]:
        """Of every sample of a force that was measured directly: the row of the misfit that it is in, and its part of it.

        Parameters
        ----------
        misfit : measured minus predicted force of every sample of the record.
        """
        rows = np.repeat(np.arange(len(self.stretches)), [b - a for a, b in self.stretches])
        residuals = np.concatenate([misfit[a:b] for a, b in self.stretches])
        if not self.by_work:
            return np.arange(residuals.size), residuals
        path = np.concatenate([np.abs(self.slip_velocity[a:b]) for a, b in self.stretches])
        return rows, residuals * path / np.maximum(np.bincount(rows, path)[rows], 1e-300)

    def _slopes(self, law: Law, predicted: Array) -> tuple[Array, Array | None, Array]:
        """F'(w) at each sample; change of friction with w at the last turn; what is known beforehand of open motions."""
        w, free = self.slip_velocity, np.full(2, math.inf)
        step, columns = self._nudged
        moved = (law._along(*columns) - predicted) / step
        if not isinstance(law, WITH_MEMORY):
            return moved, None, free
        rise, run = np.diff(predicted), np.diff(w)
        plain = np.flatnonzero(
            (np.abs(run) > np.abs(step[1:]) / 1000) & ~self.record.stuck[1:] & ~self.record.stuck[:-1]
        )
        own = np.interp(np.arange(w.size), plain + 0.5, rise[plain] / run[plain]) if plain.size else moved
        return own, moved - own, np.append(free, velocity_noise(self.record) / self.record.constants["noise"])

    @cached_property
    def _speed(self) -> Array:
        return np.abs(self.slip_velocity)

    @cached_property
    def _weight(self) -> Array:
        """How much less than usual each compared sample of a force that was measured directly counts, by its stated error."""
        error = self.record.force_error[self._compared[0]]
        usual = float(np.median(error))
        return usual / np.maximum(error, usual) if usual > 0 else np.ones_like(error)

    @cached_property
    def _columns(self) -> MotionColumns:
        return motion_columns(self.record.time, self.slip_velocity, self.record.stuck, self.force_rate)

    @cached_property
    def _nudged(self) -> tuple[Array, MotionColumns]:
        """Steps of w by which the slope of a law is seen, and the motion moved by them."""
        step = np.copysign(NUDGE * float(np.ptp(self.slip_velocity)), self.slip_velocity)
        return step, motion_columns(self.record.time, self.slip_velocity + step, self.record.stuck, self.force_rate)

    @cached_property
    def _wiggles(self) -> Array:
        return self.record.slip_velocity - self.slip_velocity

    @cached_property
    def _compared(self) -> tuple[Indices, tuple[int, ...]]:
        """The samples of all stretches, one after the other, and how many each has."""
        samples = [np.arange(a, b) for a, b in self.stretches]
        return np.concatenate(samples), tuple(part.size for part in samples)

    @cached_property
    def _smoothed(self) -> Array:
        """What smoothing took off the instrument's own samples, NaN where one was left out; 0 where these are not known."""
        record = self.record
        if record.recorded is None or record.displacement is None:
            return np.zeros(record.time.size)
        return record.recorded - record.displacement


def velocity_noise(record: FrictionRecord) -> float:
    """Standard error of the slip velocity of a smoothed record; 0 where it is not known.

    White noise σ of a displacement sampled every h, passed up to the frequency f, gives σ_w = σ 2πf √(2 f h / 3).
    """
    known = record.constants
    if "noise" not in known or "slip_cutoff" not in known:
        return 0.0
    cutoff = known["slip_cutoff"]
    return known["noise"] * 2 * math.pi * cutoff * math.sqrt(2 * cutoff * record.step / 3)


def extrapolated_note(slowest: float) -> str:
    """That a break-away force was not measured but goes on from the curve of kinetic friction."""
    return (
        f"The break-away force comes from no stick: it is the kinetic force extrapolated from w = {slowest:.3g} to w = 0, "
        "and its error is that of the curve alone; measure break-aways to know it."
    )


def velocity_error(record: FrictionRecord) -> Array:
    """Standard error of the slip velocity of each sample: as stated, of the smoothing, or from its scatter."""
    if record.slip_velocity_error is not None:
        return record.slip_velocity_error
    return np.full(record.time.size, velocity_noise(record) or noise_level(record.slip_velocity))


def without_wiggles(record: FrictionRecord) -> tuple[Array, list[tuple[int, int]], list[Indices]]:
    """Slip velocity monotone between its turning points, the slips of one sense, and the turning points of each.

    A turning point stands out by four standard errors of w, and by 2 % of its range where the record does not state them.
    """
    from scipy.signal import find_peaks  # loads for half a second

    w = record.slip_velocity.copy()
    if record.slip_velocity_error is None:
        least = max(0.02 * float(np.ptp(w[~record.stuck])), 4 * velocity_noise(record))
    else:
        least = 4 * float(np.median(record.slip_velocity_error))
    sure = np.abs(w) > SENSE * velocity_error(record)
    slips: list[tuple[int, int]] = []
    turns: list[Indices] = []
    for begin, end in record.slips:
        sense = _senses(record, sure, begin, end)
        w[begin:end] = np.where(w[begin:end] * sense < 0, 0.0, w[begin:end])
        w[begin:end] = np.copysign(w[begin:end], sense)
        slips += pairwise([begin, *(np.flatnonzero(np.diff(sense)) + 1 + begin).tolist(), end])
    for first, last in slips:
        sense_here = w[first]
        speed = np.abs(w[first:last])
        peaks = find_peaks(speed, prominence=least)[0]
        dips = find_peaks(-speed, prominence=least)[0]
        inner = _alternating(speed, np.sort(np.concatenate([peaks, dips])))
        turns.append(inner + first)
        edges = [0, *inner.tolist(), len(speed) - 1]
        for low, high in pairwise(edges):
            run = slice(low, high + 1)
            if high - low >= 2:
                smooth = isotonic_regression(speed[run], increasing=bool(speed[high] > speed[low])).x
                speed[run] = smooth
        w[first:last] = np.copysign(speed, sense_here)
    return w, slips, turns


def _senses(record: FrictionRecord, sure: Mask, first: int, last: int) -> Array:
    """Sense of each sample of a slip, 1 or -1, without reversals that are noise.

    Such are those at speeds that are not clear of their errors, and short ones beside a stick, where smoothing rings.
    """
    w = record.slip_velocity[first:last]
    runs = np.split(np.arange(w.size), np.flatnonzero(np.diff(np.signbit(w))) + 1)
    paths = np.array([abs(float(np.sum(w[run]))) for run in runs])
    real = np.array([bool(sure[first:last][run].any()) for run in runs])
    long = np.flatnonzero(paths >= REVERSAL * float(np.max(paths)))
    if first > 0:
        real[: long[0]] = False
    if last < record.time.size:
        real[long[-1] + 1 :] = False
    if not real.any():
        real[np.argmax(paths)] = True
    known = np.flatnonzero(real)
    # a run that is noise takes the sense of the one before it, or of the first that is real
    of = known[np.maximum(np.searchsorted(known, np.arange(len(runs)), side="right") - 1, 0)]
    senses = [math.copysign(1.0, w[runs[own][0]]) for own in of]
    return np.repeat(senses, [run.size for run in runs])


def _unresolved(record: FrictionRecord, w: Array, turns: Indices, first: int, last: int) -> Mask:
    """Where w has turned up and not yet risen by what can be seen: friction may climb there unseen.

    A climb so steep that the noise of w would make more of it than the noise of the force is left out to its top, and so
    is one that takes so little of the range of w that smoothing decides its shape.
    """
    speed, force = np.abs(w), np.abs(record.force)
    noise = velocity_noise(record)
    stated = record.slip_velocity_error
    # Where w is not told apart from rest, whether it slips, and which way, is not known either.
    hidden = np.asarray(speed[first:last] < AT_REST * (noise if stated is None else stated[first:last]))
    # A filter smears the jumps of friction beside the ends of a slip.
    smeared = min(SMEARED * record.constants.get("low_pass", 0.0) / record.step, (last - first) / 3)
    hidden |= np.minimum(np.arange(last - first), np.arange(last - first)[::-1]) < smeared
    if noise == 0:
        return hidden
    climbs: list[tuple[int, int, int]] = []
    for number, i in enumerate(turns.tolist()):
        if _is_minimum(w, i, first, last):
            end = int(turns[number + 1]) if number + 1 < len(turns) else last
            climbs.append((i, i + int(np.argmax(force[i:end])), end))
    # One word for all climbs of a slip, so that the law is not asked for some of them and not for others.
    usual = [(speed[top] - speed[i], np.max(speed[i:end]) - speed[i]) for i, top, end in climbs]
    narrow = bool(usual) and bool(
        np.median([run for run, _ in usual]) < least_climb(noise, [span for _, span in usual])
    )
    for i, top, end in climbs:
        risen = np.flatnonzero(speed[i:end] > speed[i] + 4 * noise)
        until = i + int(risen[0]) if risen.size else end
        slope = (force[top] - force[i]) / max(speed[top] - speed[i], noise)
        steep = slope * noise > float(np.median(record.force_error[i : top + 1]))
        if narrow or steep:
            until = max(until, top)
        hidden[i - first : until - first] = True
    return hidden


def _near_turns(record: FrictionRecord, w: Array, turns: Indices, first: int, last: int) -> Mask:
    """Where w is not told apart from that of a turn beside it."""
    near = np.zeros(last - first, dtype=bool)
    for i in turns.tolist():
        alike = np.abs(w[first:last] - w[i]) <= 4 * velocity_noise(record)
        apart = np.flatnonzero(~alike) + first
        low = int(apart[apart < i].max(initial=first - 1)) + 1
        near[low - first : int(apart[apart > i].min(initial=last)) - first] = True
    return near


def least_climb(noise: float, spans: Sequence[float], share: float = NARROW_CLIMB) -> float:
    """The least change of w over which a climb can be seen, from the noise of w and the ranges of w of the loops."""
    return float(max(6 * noise, share * float(np.median(spans))))


def _alternating(speed: Array, inner: Indices) -> Indices:
    """Of neighbours of one kind keep the farther one out, so that maxima and minima take turns."""
    kept: list[int] = []
    kinds: list[bool] = []
    for i in inner.tolist():
        top = bool(speed[i] >= speed[max(i - 1, 0)] and speed[i] >= speed[min(i + 1, len(speed) - 1)])
        if kinds and kinds[-1] == top:
            if (speed[i] > speed[kept[-1]]) == top:
                kept[-1] = i
            continue
        kept.append(i)
        kinds.append(top)
    return np.array(kept, dtype=int)


def _is_minimum(w: Array, i: int, first: int, last: int) -> bool:
    reach = max((last - first) // 200, 1)
    return bool(abs(w[i]) <= abs(w[max(i - reach, first)]) and abs(w[i]) <= abs(w[min(i + reach, last - 1)]))


def _force_rate(record: FrictionRecord, compact: FrictionRecord) -> Array:
    """D(force)/dt of each stick: from the table of break-aways, else k V, else the slope of the force.

    While the mass slips it is what adhesion would feel, k V, on which static friction without rest may depend; 0 where that
    is not known.
    """
    known = record.constants
    usual = known.get("stiffness", math.nan) * known.get("drive_velocity", math.nan)
    table = record.break_away
    rate = np.full(len(compact.time), usual if math.isfinite(usual) else 0.0)
    for a, b in runs_of(compact.stuck):
        value = usual
        near = np.flatnonzero(np.abs(table["t"].to_numpy() - compact.time[b - 1]) < 1.5 * record.step)
        if near.size and math.isfinite(float(table["force_rate"].iloc[near[0]])):
            value = float(table["force_rate"].iloc[near[0]])
        if not math.isfinite(value):
            i, j = np.searchsorted(record.time, [compact.time[a], compact.time[b - 1]])
            value = float((record.force[j] - record.force[i]) / max(record.time[j] - record.time[i], record.step))
        rate[a:b] = value
    return rate


def _latent(record: FrictionRecord) -> DisplacementError | None:
    """The oscillator behind an indirect force; None where the force was measured directly."""
    known = record.constants
    if not {"mass", "stiffness", "slip_cutoff"} <= set(known) or not known.get("noise", 0.0) > 0:
        return None
    steps = np.concatenate([np.diff(record.time[a:b]) for a, b in record.slips])
    if steps.size == 0 or float(np.ptp(steps)) > 0.05 * record.step:
        return None
    return DisplacementError(record.step, known["mass"], known.get("damping", 0.0), known["stiffness"])
