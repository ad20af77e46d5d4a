"""Whole records compared with the settled motion of a law, one shift of time a record: single shooting."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from itertools import pairwise

import numpy as np
import pandas as pd
from scipy.special import chdtri

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.identification.estimator.least_squares import has_effect, levenberg_marquardt, minimize, robust
from stickslip.identification.estimator.record_scatter import BY_CHANCE
from stickslip.identification.estimator.residual_statistics import correlation_time, recurrence, variance_inflation
from stickslip.identification.estimator.uncertainty import inverse, no_evidence
from stickslip.identification.law_parameters import LawParameters
from stickslip.identification.trajectory.motion_misfit import MotionMisfit
from stickslip.identification.trajectory.search import LIKE_NOISE, Refined, distance
from stickslip.identification.trajectory.tangent import why_differences
from stickslip.laws.law import Law
from stickslip.laws.state_law import StateLaw

SHARES = (0.1, 0.35, 1.0)
"""Shares of each record that are fitted one after the other."""
STEP_OF_LAWS = 1e-4
"""Of a number, in units of a visible change, for differences of orbits that are exact. Where numbers act alike but for a
thousandth of what they do, the slopes must be exact to a part of that: a longer step hides how little is known."""
STEP_OF_STATE_LAWS = 0.02
"""And of orbits that are as exact as their integration."""
CONTRADICTED = 4.0
"""Standard errors by which a number that follows another is wanted elsewhere, beyond which that is said."""
FARTHEST_MOTION = 0.3
"""A motion farther than this from a record, in its standard deviations, is not near it."""
LARGEST_DISTANCE = 1e6
"""No motion counts as farther than so many standard deviations of the record; numbers that make no law are twice as far."""
CLOSE_MOTION = 0.05
"""A motion within that of a record is near it whatever its kind is called."""


class SingleShooting:
    """Records and free numbers: the misfit of the motions, its slopes, and the descent.

    The vector of unknowns is (free numbers, one shift of time a record); `instrument_error` holds the standard errors of the
    instrument's zero (a length) and scale (relative).
    """

    def __init__(
        self,
        misfits: Sequence[MotionMisfit],
        free: LawParameters,
        instrument_error: Sequence[float] | Array = (0.0, 0.0),
    ) -> None:
        self.misfits, self.free, self.instrument_error = list(misfits), free, np.array(instrument_error)
        self.count = len(free.names)
        self.known = all(math.isfinite(misfit.noise) for misfit in misfits)
        #: Standard deviation of the residuals of each record, by which they count.
        self.sigma = np.array([0.02 * o.spread if math.isnan(o.noise) else o.noise for o in misfits])
        self.best: tuple[float, Array] = (math.inf, np.zeros(0))

    def law(self, unknowns: Array) -> Law:
        """The law with these numbers."""
        return self.free.law(unknowns[: self.count])

    def lengths(self, share: float) -> list[int]:
        """Samples of each record that count."""
        return [max(20, int(share * misfit.time.size)) for misfit in self.misfits]

    def residuals(self, unknowns: Array, share: float = 1.0) -> Array:
        """(simulated − measured) / σ of all records one after the other; far off where the numbers make no law."""
        parts = self._parts(unknowns, share)
        if parts is None:
            return np.concatenate([np.full(n, 2 * LARGEST_DISTANCE * o.spread / s) for o, n, s in self._each(share)])
        return np.concatenate(parts)

    def cost(self, unknowns: Array) -> float:
        """The robust sum of squares over the whole records."""
        return robust(self.residuals(unknowns))[0]

    def _each(self, share: float) -> list[tuple[MotionMisfit, int, float]]:
        return list(zip(self.misfits, self.lengths(share), self.sigma.tolist(), strict=True))

    def _parts(self, unknowns: Array, share: float) -> list[Array] | None:
        try:
            law = self.law(unknowns)
            motions = [
                (o.motion(law, shift, n)[0] - o.displacement[:n], LARGEST_DISTANCE * o.spread, s)
                for (o, n, s), shift in zip(self._each(share), unknowns[self.count :], strict=True)
            ]
        except InputError:
            return None
        return [np.clip(np.nan_to_num(rest, nan=far), -far, far) / s for rest, far, s in motions]

    def moves(self, unknowns: Array) -> bool:
        """Whether there is a law with these numbers, and its motions go on to the ends of the records."""
        return self._parts(unknowns, 1.0) is not None

    def slopes(self, unknowns: Array, share: float = 1.0) -> Array:
        """Derivatives of the residuals, shape (samples, unknowns).

        Those by a shift are the velocity; those by a number come from the core's derivatives through events, and from
        :meth:`differences` where it has none.
        """
        law, units = self.law(unknowns), self.free.units(unknowns[: self.count])
        edges = np.cumsum([0, *self.lengths(share)])
        found = np.zeros((int(edges[-1]), unknowns.size))
        together = [
            [name, *(tied for tied, source in self.free.ties.items() if source == name)] for name in self.free.names
        ]
        missing = set()
        for i, (misfit, n, s) in enumerate(self._each(share)):
            names = [name for group in together for name in group]
            velocity, by = misfit.tangent(law, names, float(unknowns[self.count + i]), n)
            rows = slice(edges[i], edges[i + 1])
            found[rows, self.count + i] = velocity / s
            for j, group in enumerate(together):
                if all(name in by for name in group):
                    found[rows, j] = units[j] / s * sum(by[name] for name in group)
                else:
                    missing.add(j)
        for j in missing:
            found[:, j] = self.differences(unknowns, j, share)
        return found

    def differences(self, unknowns: Array, j: int, share: float = 1.0) -> Array:
        """The derivative of the residuals by free number `j`: central differences of orbits, one-sided at a limit."""
        step = STEP_OF_STATE_LAWS if isinstance(self.law(unknowns), StateLaw) else STEP_OF_LAWS
        sides: list[tuple[float, Array]] = []
        for h in (step, -step, 0.0):
            trial = unknowns.copy()
            trial[j] = np.clip(trial[j] + h, self.free.low[j], self.free.high[j])
            parts = None if sides and trial[j] == sides[-1][0] else self._parts(trial, share)
            if parts is not None:
                sides.append((float(trial[j]), np.concatenate(parts)))
            if len(sides) == 2:
                (a, up), (b, down) = sides
                return np.asarray((up - down) / (a - b))
        return np.zeros(sum(self.lengths(share)))

    def bounds(self) -> tuple[Array, Array]:
        """Limits of the unknowns."""
        reach = np.array([misfit.reach for misfit in self.misfits])
        return np.concatenate([self.free.low, -reach]), np.concatenate([self.free.high, reach])

    def reachable(self, numbers: Array) -> Array:
        """The free numbers close by whose motions have the measured landmarks, from which the descent is short.

        What is minimised knows nothing of phase (see :meth:`MotionMisfit.unlikeness`), so it leads from far away.
        """

        def unlike(trial: Array) -> Array:
            try:
                law = self.free.law(trial)
                return np.concatenate([misfit.unlikeness(law) for misfit in self.misfits])
            except InputError:
                return np.full(8 * len(self.misfits), 2.0)

        low, high = self.free.low, self.free.high
        inside = np.clip(numbers, low + 1e-9, high - 1e-9)
        alike = np.ones(inside.size)
        found = minimize(unlike, [inside], (low, high), outlier=0.1, scale=alike, step=1e-3, evaluations=12)
        return found.vector

    def refine(self, numbers: Array) -> float:
        """Least squares of the motions from these free numbers; returns the misfit.

        The misfit is the mean of the squared residuals over the noise, 1 where only noise is left.
        """
        unknowns = numbers
        for share in SHARES:
            # A few cycles first: over many a small error of the period would put the motions out of step.
            law = self.law(unknowns)
            shifts = [misfit.first_shift(law, n) for misfit, n, _ in self._each(share)]
            unknowns = np.concatenate([unknowns[: self.count], shifts])
            unknowns = self.down(unknowns, share, 1.0 if share < 1 else 0.01)
        misfit = float(np.mean(np.square(self.residuals(unknowns))))
        if misfit < self.best[0]:
            self.best = (misfit, unknowns)
        return misfit

    def down(self, unknowns: Array, share: float, enough: float, held: Sequence[int] = ()) -> Array:
        """The least misfit over a share of each record, from near it; `held` numbers stay."""
        residuals, slopes = partial(self.residuals, share=share), partial(self.slopes, share=share)
        return levenberg_marquardt(residuals, slopes, self.bounds(), unknowns, enough, held)

    def scatter(self, unknowns: Array) -> Array:
        """Standard deviation of each record's residuals, in its unit of length."""
        parts = np.split(self.residuals(unknowns), np.cumsum(self.lengths(1.0))[:-1])
        return np.array([s * math.sqrt(np.mean(part**2)) for part, s in zip(parts, self.sigma, strict=True)])

    def without_effect(self, unknowns: Array) -> list[str]:
        """Names of the free numbers that change no motion here."""
        acts = has_effect(self.slopes(unknowns))
        return [name for name, does in zip(self.free.names, acts, strict=False) if not does]

    def covariance(self, unknowns: Array) -> tuple[Array, float]:
        """Of all unknowns, and the degrees of freedom of their errors.

        From what each sample's residual does to each unknown, as far as these go together from sample to sample and from
        one cycle to the next (:func:`variance_inflation`): a misfit that every cycle repeats is the law's, and is not
        averaged down. Where the records draw an unknown farther apart than that lets expect, what sets the records apart
        counts. What an error of the instrument's zero and scale, common to all records, would do to the unknowns is added.
        """
        residuals, slopes = self.residuals(unknowns), self.slopes(unknowns)
        edges = np.cumsum([0, *self.lengths(1.0)])
        parts = [residuals[a:b] for a, b in pairwise(edges)]
        freedoms = [max(part.size - unknowns.size / len(parts), 1.0) for part in parts]
        variances = [float(np.sum(part**2)) / freedom for part, freedom in zip(parts, freedoms, strict=True)]
        excesses = [variance * correlation_time(part) for part, variance in zip(parts, variances, strict=True)]
        bread, moved = self._bread(unknowns, slopes, excesses)
        covariance, independent, summed = np.zeros_like(bread), 0.0, []
        for (a, b), misfit, variance, excess in zip(pairwise(edges), self.misfits, variances, excesses, strict=True):
            influence = bread @ slopes[a:b].T / excess
            period = recurrence(misfit.displacement)
            tau = np.array([variance_inflation(one * residuals[a:b], period) for one in influence])
            covariance += influence @ influence.T * variance * np.sqrt(np.outer(tau, tau))
            independent += (b - a) / float(tau[: self.count].max(initial=1.0))
            summed.append(influence @ residuals[a:b])
        freedom = max(independent - unknowns.size, 1.0)
        if len(summed) > 1:
            between = np.sum(np.square(summed), axis=0)[: self.count] * len(summed) / (len(summed) - 1)
            times = between / np.diag(covariance)[: self.count]
            if (times * (len(summed) - 1)).max() > chdtri(len(summed) - 1, BY_CHANCE):
                wider = np.ones(unknowns.size)
                wider[: self.count] = np.sqrt(np.maximum(times, 1.0))
                covariance *= np.outer(wider, wider)
                freedom = min(freedom, len(summed) - 1.0)
        return np.asarray(covariance + moved @ moved.T), freedom

    def _bread(self, unknowns: Array, slopes: Array, excesses: Sequence[float]) -> tuple[Array, Array]:
        """The inverse of the information, each record's over its excess, and what a standard error of the instrument does."""
        information, scores = np.zeros((unknowns.size, unknowns.size)), np.zeros((unknowns.size, 2))
        edges = np.cumsum([0, *self.lengths(1.0)])
        for (a, b), misfit, sigma, excess in zip(pairwise(edges), self.misfits, self.sigma, excesses, strict=True):
            information += slopes[a:b].T @ slopes[a:b] / excess
            instrument = np.stack([np.ones(b - a), misfit.displacement], axis=1) * self.instrument_error / sigma
            scores += slopes[a:b].T @ instrument / excess
        if (silent := self.without_effect(unknowns)) or not np.diag(information).all():
            raise no_evidence("the motions", ", ".join(silent) or "the shift of a record")
        bread = inverse(information, self.free.names)
        return bread, bread @ scores

    def misses(self, motions: pd.DataFrame) -> bool:
        """Whether more than noise is left of a record, or its noise is not known."""
        return not bool((motions["scatter"] <= LIKE_NOISE**2 * motions["noise"]).all())

    def holding(self, name: str) -> SingleShooting:
        """The same at its best, with one number held there."""
        names = [other for other in self.free.names if other != name]
        return self._with(names, {tied: source for tied, source in self.free.ties.items() if source != name})

    def _with(self, names: Sequence[str], ties: dict[str, str]) -> SingleShooting:
        """The same at its best, with these numbers free and tied."""
        best, unknowns = self.best
        free = LawParameters(self.law(unknowns), names, ties, self.free.bounds)
        other = SingleShooting(self.misfits, free, self.instrument_error)
        other.best = (best, np.concatenate([np.zeros(other.count), unknowns[self.count :]]))
        return other

    def against(self, tied: str) -> float:
        """The root of what the misfit gains where a number need not follow another: standard errors by which it should not.

        By descents from beside the tie: of numbers that act nearly alike the misfit is a bent valley, whose slope at the tie
        may vanish while it falls farther on.
        """
        ties = {name: source for name, source in self.free.ties.items() if name != tied}
        loose = self._with([*self.free.names, tied], ties)
        loose.sigma, at = self.sigma, loose.best[1]
        beside = [at + side * (np.arange(at.size) == loose.count - 1) for side in (-0.1, 0.0, 0.1)]
        least = min(loose.cost(loose.down(start, 1.0, 0.01)) for start in beside if loose.moves(start))
        return math.sqrt(max(loose.cost(at) - least, 0.0))

    def finish(self) -> Refined:
        """The best motions with each record weighed by the scatter that is left, and how well the numbers are known.

        Raises
        ------
        Inseparable
            where two numbers act alike.
        InputError
            where no motion lies near a record.
        """
        unknowns = self.best[1]
        for _ in range(2):
            self.sigma = np.maximum(self.scatter(unknowns), 1e-12)
            unknowns = self.down(unknowns, 1.0, 1e-4)
        self.best = (self.best[0], unknowns)
        scatter = self.scatter(unknowns)
        self._refuse_far(unknowns, scatter)
        motions = pd.DataFrame(
            {
                "record": [misfit.name for misfit in self.misfits],
                "kind": [misfit.seen.kind for misfit in self.misfits],
                "period": [misfit.seen.period for misfit in self.misfits],
                "samples": [misfit.time.size for misfit in self.misfits],
                "shift": unknowns[self.count :],
                "scatter": scatter,
                "noise": [misfit.noise for misfit in self.misfits],
                "distance": [s / misfit.spread for s, misfit in zip(scatter, self.misfits, strict=True)],
            }
        )
        notes = [
            f"Refined by the agreement of the motions: they lie {distance(motions):.2g} of the displacement's standard "
            "deviation apart, with one shift of time for each record."
        ]
        why = why_differences(type(self.law(unknowns)))
        if why is not None:
            notes.append(f"Slopes of the motion are differences of orbits: {why}.")
        notes += [
            f"{misfit.name}: the motion of the law lies {left / misfit.noise:.2g} times the noise from the record, so the "
            "law, or a constant of the rig, is not quite that of the record: intervals from the "
            "motion alone would be too narrow, and are no narrower than those of forces and break-aways."
            for misfit, left in zip(self.misfits, scatter.tolist(), strict=True)
            if left > LIKE_NOISE**2 * misfit.noise
        ]
        for tied, source in self.free.ties.items():
            if (errors := self.against(tied)) > CONTRADICTED:
                notes.append(
                    f"The motions contradict that {tied} follows {source}, by {errors:.2g} standard errors: the intervals "
                    "are those of a law that is not this one; give empty ties (--ties) to fit both."
                )
        return Refined(unknowns[: self.count], *self.covariance(unknowns), motions, notes)

    def _refuse_far(self, unknowns: Array, scatter: Array) -> None:
        law = self.law(unknowns)
        for misfit, left in zip(self.misfits, scatter, strict=True):
            far = left / misfit.spread
            found, _ = misfit.landmarks(law)
            # Close to the end of stick-slip the shortest sticks are not seen: there the word alone does not decide.
            if far > FARTHEST_MOTION or (found.kind != misfit.seen.kind and far > CLOSE_MOTION):
                raise InputError(
                    f"{misfit.name}: no motion of the law lies near this record (distance {far:.2f} of its standard "
                    f"deviation; measured {misfit.seen.kind}, simulated {found.kind}); keep the fit of the branches"
                )
