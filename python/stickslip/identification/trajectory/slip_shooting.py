"""Slips compared with those that a law makes, each begun anew from its own break-away.

It is multiple shooting without matching conditions: nothing joins the end of a slip to the beginning of the next. How late
and how far off each slip begins are unknowns of its own, and so is the level of its friction where levels scatter. What ties
the ends of sticks to the static friction of the law is in `first_passage`. Whole records are shot in `single_shooting`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from scipy.sparse import csr_array

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.identification.estimator.least_squares import OUTLIER, levenberg_marquardt
from stickslip.identification.estimator.residual_statistics import correlation_time, robust_scale
from stickslip.identification.estimator.uncertainty import inverse, no_evidence
from stickslip.identification.law_parameters import LawParameters
from stickslip.identification.records import FrictionRecord
from stickslip.identification.trajectory.first_passage import (
    NUMBER_STEP,
    Passage,
    Sticks,
    own_number,
    passage,
    solve,
    varying_number,
)
from stickslip.identification.trajectory.search import Refined, distance
from stickslip.identification.trajectory.slip import Slip, slips_of
from stickslip.laws import Law
from stickslip.laws.numbers import with_values
from stickslip.laws.state_law import StateLaw
from stickslip.measurement.signals.noise import noise_level

if TYPE_CHECKING:
    from stickslip.identification.result import Identification

FEWEST_SLIPS_PER_NUMBER = 5
"""Slips for each free number that are needed."""
FEWEST_CYCLES = 5
"""Cycles that can be said to scatter."""
SCATTERING = 0.03
"""Cycles whose lengths scatter by more than that do not repeat."""
QUIET = 1e-3
"""A number that moves no slip by that part of its noise does not act on slips."""
VISIBLE_BEGINNING = 0.02
"""Of the duration and the depth of a slip: the units of where it begins."""
LEVELS = 0.125
"""Slips whose middles scatter by more than that part of their depth have a level of friction each of their own."""
FARTHEST_SLIPS = 0.3
"""Slips farther than this from the measured ones, in the standard deviations of these, are not near them."""


def scattering(first: Identification, settled_after: float) -> str | None:
    """What says that the cycles of a record scatter, None where they repeat or the law could not be shot by slips."""
    if isinstance(first.law, StateLaw) or varying_number(first.law) is None:
        return None
    for record in first.records:
        settled = record.settled(settled_after)
        cycles = np.diff(record.break_away["t"][record.break_away["t"] >= settled])
        if cycles.size < FEWEST_CYCLES or record.displacement is None:
            continue
        usual = float(np.median(cycles))
        apart = robust_scale(cycles - usual) / usual
        if apart > SCATTERING:
            return (
                f"the cycles of {record.name} scatter by {100 * apart:.0f} %, so it has no one motion to be laid over"
            )
    return None


class SlipShooting:
    """Slips and free numbers: the misfit of the slips, its slopes, and the descent.

    The vector of unknowns is (free numbers, how late each slip begins, how far off, and the level of its friction), the
    latter three in parts of the slip; `instrument_error` holds the standard errors of the instrument's zero (a length) and
    scale (relative).

    A level is a force by which static and kinetic friction are higher together than the law has them, as they are along a
    real track. Where the slips' middles show that levels scatter, they are unknowns too, held to zero by their own scatter
    (a random effect); else they are zero.
    """

    def __init__(
        self,
        records: Sequence[FrictionRecord],
        settled_after: float,
        free: LawParameters,
        instrument_error: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        self.records, self.free, self.instrument_error = list(records), free, np.array(instrument_error)
        self.count = len(free.names)
        law = free.law(np.zeros(self.count))
        if isinstance(law, StateLaw):
            raise InputError(
                f"fit_trajectories: {type(law).__name__} has an inner state and no break-away to begin a slip at: shoot by "
                "records"
            )
        self.own = own_number(law)
        self.slips = [slip for i, record in enumerate(records) for slip in slips_of(record, i, settled_after)]
        if len(self.slips) < FEWEST_SLIPS_PER_NUMBER * max(self.count, 1):
            raise InputError(
                f"fit_trajectories: {len(self.slips)} slips that follow a whole stick and end in one are too few for "
                f"{self.count} numbers, {FEWEST_SLIPS_PER_NUMBER} for each are needed: take longer records, or shoot "
                "by records"
            )
        self.best: tuple[float, Array] = (math.inf, np.zeros(0))
        noise = [
            math.nan if record.recorded is None else noise_level(record.recorded[np.isfinite(record.recorded)])
            for record in records
        ]
        self.noise = np.array(noise)[[slip.record for slip in self.slips]]
        self.known = bool(np.isfinite(self.noise).all())
        #: Standard deviation of the residuals of each slip's record, by which they count.
        self.sigma = np.where(np.isfinite(self.noise), self.noise, 0.02 * np.array([s.depth for s in self.slips]))
        self._edges = np.cumsum([0, *(slip.time.size + 1 for slip in self.slips)])
        middle = np.array([slip.position + 0.5 * (slip.x.max() + slip.x.min()) for slip in self.slips])
        depth = np.array([slip.depth for slip in self.slips])
        #: First guess of each slip's level as a displacement, and the scatter of the levels; 0 where all are alike.
        self.level = middle - np.median(middle)
        self.level_scatter = robust_scale(self.level)
        if self.level_scatter < LEVELS * float(np.median(depth)):
            self.level, self.level_scatter = np.zeros(middle.size), 0.0
        known = [record.constants for record in records]
        self._known = [known[slip.record] for slip in self.slips]

    def _split(self, unknowns: Array) -> tuple[Array, Array, Array, Array]:
        """The free numbers, how late and how far off the place each slip begins, and its level as a displacement."""
        late, off, level = np.split(unknowns[self.count :], 3)
        reach = VISIBLE_BEGINNING * np.array([(slip.duration, slip.depth) for slip in self.slips]).T
        return unknowns[: self.count], late * reach[0], off * reach[1], self.level + level * reach[1]

    def sticks(self, unknowns: Array) -> Sticks:
        """How the slips begin, their force above their level."""
        _, late, off, level = self._split(unknowns)
        known, slips = self._known, self.slips
        drive = np.array([item["drive_velocity"] for item in known])
        stiffness, damping = (np.array([item[name] for item in known]) for name in ("stiffness", "damping"))
        spring = stiffness * (np.array([slip.position for slip in slips]) + off - level)
        stick_time = np.array([slip.stick_time for slip in slips]) + late
        return Sticks(stick_time, stiffness * np.abs(drive), np.sign(drive) * spring + damping * np.abs(drive))

    def _traces(self, unknowns: Array) -> list[tuple[Array, Array] | None]:
        """What :meth:`Slip.trace` gives for each slip, with a law of its own that ends its stick where it begins."""
        numbers, late, off, level = self._split(unknowns)
        try:
            law = self.free.law(numbers)
            own = self.sticks(unknowns).own(law)[0]
        except InputError:
            return [None] * len(self.slips)
        return [self._trace(*each, law) for each in zip(self.slips, own, late, off, level, strict=True)]

    def _trace(
        self, slip: Slip, own: float, late: float, off: float, level: float, law: Law
    ) -> tuple[Array, Array] | None:
        try:
            its = with_values(law, {self.own: own})
        except InputError:
            return None
        return slip.trace(its, late, off, level)

    def residuals(self, unknowns: Array) -> Array:
        """(simulated − measured) / σ of all slips one after the other, each with its level over the scatter of levels.

        Far off for a slip that the law does not make.
        """
        parts: list[Array] = []
        levels = self._split(unknowns)[3] / (self.level_scatter or 1.0)
        for slip, sigma, trace, level in zip(self.slips, self.sigma, self._traces(unknowns), levels, strict=True):
            off = np.full(slip.x.size, slip.depth) if trace is None else trace[0] - slip.x
            parts.append(np.append(np.clip(off, -10 * slip.depth, 10 * slip.depth) / sigma, level))
        return np.concatenate(parts)

    def slopes(self, unknowns: Array) -> Any:
        """Derivatives of the residuals, sparse, shape (samples, unknowns), by differences of exact orbits.

        Those by how late a slip begins are minus the velocity. Of a number that acts on no slip they are exactly zero.
        """
        base, count, slips = self._traces(unknowns), self.count, len(self.slips)
        # One block of columns a slip: the free numbers, then late, off and level of that slip.
        blocks = np.zeros((self._edges[-1], count + 3))
        _, high = self.bounds()
        owns = count + np.arange(3 * slips).reshape(3, slips)
        for j in (*range(count), count + 1, *([count + 2] if self.level_scatter else [])):
            trial = unknowns.copy()
            moved = np.full(slips, j) if j < count else owns[j - count]
            step = np.where(unknowns[moved] + NUMBER_STEP <= high[moved], NUMBER_STEP, -NUMBER_STEP)
            trial[moved] = unknowns[moved] + step
            for i, (beside, here) in enumerate(zip(self._traces(trial), base, strict=True)):
                if beside is not None and here is not None:
                    blocks[self._edges[i] : self._edges[i + 1] - 1, j] = (beside[0] - here[0]) / step[i] / self.sigma[i]
        for i, (slip, here) in enumerate(zip(self.slips, base, strict=True)):
            if here is not None:
                unit = VISIBLE_BEGINNING * slip.duration / self.sigma[i]
                blocks[self._edges[i] : self._edges[i + 1] - 1, count] = -unit * here[1]
            if self.level_scatter:
                blocks[self._edges[i + 1] - 1, count + 2] = VISIBLE_BEGINNING * slip.depth / self.level_scatter
        quiet = np.max(np.abs(blocks[:, :count]), axis=0, initial=0.0) < QUIET
        blocks[:, :count][:, quiet] = 0.0
        number = np.repeat(np.arange(slips), np.diff(self._edges))
        columns = np.concatenate([np.tile(np.arange(count), (number.size, 1)), owns[:, number].T], axis=1)
        ends = np.arange(number.size + 1) * (count + 3)
        return csr_array((blocks.ravel(), columns.ravel(), ends), shape=(number.size, unknowns.size))

    def bounds(self) -> tuple[Array, Array]:
        """Limits of the unknowns."""
        reach = np.array([(slip.reach[0] / slip.duration, slip.reach[1] / slip.depth) for slip in self.slips])
        around = np.append(reach.T.ravel(), np.full(len(self.slips), 10.0)) / VISIBLE_BEGINNING
        return np.concatenate([self.free.low, -around]), np.concatenate([self.free.high, around])

    def reachable(self, numbers: Array) -> Array:
        """The numbers: a slip is short, so a descent converges from far."""
        return numbers

    def refine(self, numbers: Array) -> float:
        """Least squares of the slips from these free numbers, then the sticks; returns the misfit of the slips."""
        unknowns = np.concatenate([numbers, np.zeros(3 * len(self.slips))])
        unknowns = self._with_sticks(self._down(unknowns, 1.0))
        misfit = float(np.mean(np.square(self.residuals(unknowns))))
        if misfit < self.best[0]:
            self.best = (misfit, unknowns)
        return misfit

    def _down(self, unknowns: Array, enough: float) -> Array:
        return levenberg_marquardt(self.residuals, self.slopes, self.bounds(), unknowns, enough)

    def _static(self, unknowns: Array) -> list[int]:
        """The free numbers that act on no slip once its beginning is given: those of static friction."""
        return [j for j, size in enumerate(abs(self.slopes(unknowns)).sum(axis=0)[: self.count]) if size == 0]

    def _with_sticks(self, unknowns: Array) -> Array:
        static = self._static(unknowns)
        if not static:
            return unknowns
        found = unknowns.copy()
        found[: self.count] = solve(self.sticks(unknowns), self.free, unknowns[: self.count], static)
        return found

    def without_effect(self, unknowns: Array) -> list[str]:
        """Names of the free numbers that act neither on slips nor on where sticks end."""
        static = self._static(unknowns)
        by = passage(self.sticks(unknowns), self.free, unknowns[: self.count], static).by
        return [self.free.names[j] for j in static if not by[:, j].any()]

    def scatter(self, unknowns: Array) -> Array:
        """Robust standard deviation of the residuals of each slip's record, shape (slips,), in its unit of length."""
        residuals = np.split(self.residuals(unknowns), self._edges[1:-1])
        of = np.array([slip.record for slip in self.slips])
        found = np.zeros(of.size)
        for number in np.unique(of):
            rows = np.flatnonzero(of == number)
            found[rows] = robust_scale(np.concatenate([self.sigma[i] * residuals[i][:-1] for i in rows]))
        return found

    def finish(self) -> Refined:
        """The best slips with each record weighed by the scatter that is left, and how well the numbers are known.

        Raises
        ------
        InputError
            where the law makes no slips like the measured ones, or the numbers cannot be told apart.
        """
        unknowns = self.best[1]
        for enough in (0.1, 0.01):
            self.sigma = np.maximum(self.scatter(unknowns), 1e-12)
            if self.level_scatter:
                self.level_scatter = robust_scale(self._split(unknowns)[3])
            unknowns = self._down(unknowns, enough)
        unknowns = self._with_sticks(unknowns)
        self.best = (self.best[0], unknowns)
        static = self._static(unknowns)
        ends = passage(self.sticks(unknowns), self.free, unknowns[: self.count], static)
        covariance, freedom = self._covariance(unknowns, ends, static)
        motions = self._motions(unknowns)
        notes = [
            f"Refined by the agreement of {len(self.slips)} slips, each begun at its own break-away: they lie "
            f"{distance(motions):.2g} of the displacement's standard deviation apart. The intervals come from how the slips "
            "differ from each other.",
            f"Each stick has its own {self.own}: they scatter by {robust_scale(ends.own - np.median(ends.own)):.3g} about "
            f"{np.median(ends.own):.4g}.",
        ]
        if self.level_scatter:
            notes.append(
                "Friction as a whole is higher in one slip than in the other: each has a level of its own, by which static "
                f"and kinetic friction are shifted together, with a scatter of {self.level_scatter:.3g} in the displacement."
            )
        made = sum(trace is not None for trace in self._traces(unknowns))
        if made < len(self.slips):
            notes.append(f"{len(self.slips) - made} of {len(self.slips)} slips are none that the law can make.")
        used = {slip.record for slip in self.slips}
        notes += [
            f"{record.name}: holds no slip that follows a whole stick and ends in one, and is not used."
            for i, record in enumerate(self.records)
            if i not in used
        ]
        return Refined(unknowns[: self.count], covariance, freedom, motions, notes)

    def _motions(self, unknowns: Array) -> pd.DataFrame:
        scatter, traces, force = self.scatter(unknowns), self._traces(unknowns), self.sticks(unknowns).force
        rows = []
        for number, record in enumerate(self.records):
            of = [i for i, slip in enumerate(self.slips) if slip.record == number]
            if not of:
                continue
            spread = float(np.median([np.std(self.slips[i].x) for i in of]))
            drive = record.constants["drive_velocity"]
            stuck = [trace is not None and bool(abs(trace[1][-1] - drive) < 1e-9 * abs(drive)) for trace in traces]
            ended = sum(stuck[i] for i in of)
            far = float(scatter[of[0]]) / spread
            if far > FARTHEST_SLIPS or 2 * ended < len(of):
                raise InputError(
                    f"{record.name}: the law makes no slips like the measured ones (distance {far:.2f} of their standard "
                    f"deviation, {ended} of {len(of)} end in a stick): take another law, or keep the fit of the branches"
                )
            rows.append(
                {
                    "record": record.name,
                    "slips": len(of),
                    "samples": sum(self.slips[i].x.size for i in of),
                    "end stuck": ended,
                    "break-away": float(np.median(force[of])),
                    "break-away scatter": robust_scale(force[of] - np.median(force[of])),
                    "scatter": float(scatter[of[0]]),
                    "noise": float(self.noise[of[0]]),
                    "distance": far,
                }
            )
        return pd.DataFrame(rows)

    def _covariance(self, unknowns: Array, ends: Passage, static: list[int]) -> tuple[Array, float]:
        """Of the free numbers, by leaving out one slip after the other, and the degrees of freedom.

        Where a slip begins and its level are unknowns of its own and drop out with it. How alike neighbouring slips are is
        taken into account; what an error of the instrument's zero and scale, common to all, would do is added.
        """
        if silent := self.without_effect(unknowns):
            raise no_evidence("the slips", ", ".join(silent))
        moving = [j for j in range(self.count) if j not in static]
        order = [*moving, *static]
        residuals, slopes = self.residuals(unknowns), self.slopes(unknowns)
        root = np.sqrt(1 + (residuals / OUTLIER) ** 2)
        size, slips = len(moving), len(self.slips)
        scores, gives = np.zeros((slips, self.count)), np.zeros((slips, self.count, self.count))
        instrument = np.zeros((self.count, 2))
        for i, (slip, sigma, known) in enumerate(zip(self.slips, self.sigma, self._known, strict=True)):
            rows = slice(self._edges[i], self._edges[i + 1])
            part = slopes[rows]
            shared = part[:, moving].toarray()
            beginning = part[:, self.count + i + slips * np.arange(3)].toarray()
            heavy = (root[rows] ** -3)[:, None]
            onto = np.linalg.pinv(beginning.T @ (heavy * beginning)) @ (beginning.T @ (heavy * shared))
            freed = shared - beginning @ onto
            zero = np.zeros((residuals[rows].size, 2))
            zero[:-1] = np.stack([np.ones(slip.x.size), slip.x + slip.position], axis=1) * self.instrument_error / sigma
            scores[i, :size] = freed.T @ (residuals[rows] / root[rows])
            gives[i, :size, :size] = freed.T @ (heavy * shared)
            instrument[:size] += freed.T @ (heavy * zero)
            lever = ends.give[i] * ends.instruments[i]
            scores[i, size:] = ends.score[i] * ends.instruments[i]
            gives[i, size:] = np.outer(lever, ends.by[i, order])
            force = known["stiffness"] * np.array([1.0, slip.position]) * np.sign(known["drive_velocity"])
            instrument[size:] -= np.outer(lever, ends.by_force[i] * force * self.instrument_error)
        whole = gives.sum(axis=0)
        for part in (slice(0, size), slice(size, None)):
            inverse(whole[part, part], [self.free.names[j] for j in order[part]])
        away = np.stack([np.linalg.solve(whole - give, score) for give, score in zip(gives, scores, strict=True)])
        alike = np.sqrt([correlation_time(column) for column in away.T])
        away *= alike * math.sqrt((slips - 1) / slips)
        by_instrument = np.linalg.solve(whole, instrument)
        covariance = np.zeros((self.count, self.count))
        covariance[np.ix_(order, order)] = away.T @ away + by_instrument @ by_instrument.T
        return covariance, float(slips - self.count) / float(np.max(alike, initial=1.0) ** 2)
