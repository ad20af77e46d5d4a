"""A law sharpened by the agreement of whole motions: the steady motion it makes, laid over each measured one."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.optimize import least_squares
from scipy.stats import norm

from stickslip.documents import number
from stickslip.errors import InputError
from stickslip.identification.checkpoint import Checkpoint
from stickslip.identification.overlay import Overlay
from stickslip.identification.parameters import Free, check_names
from stickslip.identification.tangent import why_differences
from stickslip.identification.uncertainty import correlation_time

if TYPE_CHECKING:
    from stickslip.identification.fit import Identification

Array = npt.NDArray[np.float64]
Progress = Callable[[str, int, int], Any]

SHARES = (0.1, 0.35, 1.0)
"""Shares of each record that are fitted one after the other."""
ITERATIONS = 60
"""The most steps of one way down."""
PATIENCE = 4
"""Steps in a row that gain hardly anything, where a kink in the misfit holds the way down."""
OUTLIER = 3.0
"""Residuals beyond that many standard deviations lose weight."""
LIKE_NOISE = 1.15
"""A misfit of all records within this ratio of their noise cannot be improved: no further start is tried."""
TWICE = 1e-3
"""Misfits within this ratio are the same minimum."""
FAR = 0.3
"""A motion farther than this from a record, in its standard deviations, is not near it."""
CLOSE = 0.05
"""A motion within that of a record is near it whatever its kind is called."""
SPREAD = 0.05
"""Starting points lie that far around the first one, relative to its numbers, and twice its standard errors."""


class Fit:
    """Records and free numbers: the misfit of the motions, its slopes, and the way down.

    The vector of unknowns is (free numbers, one shift of time a record); `gauge_error` holds the standard errors of the
    gauge's zero (a length) and scale (relative).
    """

    def __init__(self, overlays: Sequence[Overlay], free: Free, gauge_error: tuple[float, float] = (0.0, 0.0)) -> None:
        self.overlays, self.free, self.gauge_error = list(overlays), free, np.array(gauge_error)
        self.count = len(free.names)
        #: Standard deviation of the residuals of each record, by which they count.
        self.sigma = np.array([0.02 * o.spread if math.isnan(o.noise) else o.noise for o in overlays])
        self.best: tuple[float, Array] = (math.inf, np.zeros(0))

    def lengths(self, share: float) -> list[int]:
        """Samples of each record that count."""
        return [max(20, int(share * overlay.time.size)) for overlay in self.overlays]

    def residuals(self, unknowns: Array, share: float = 1.0) -> Array:
        """(simulated − measured) / σ of all records one after the other; far off where the numbers make no law."""
        parts = self._parts(unknowns, share)
        if parts is None:
            far = [np.full(n, o.spread / s) for o, n, s in self._each(share)]
            return np.concatenate(far)
        return np.concatenate(parts)

    def cost(self, unknowns: Array) -> float:
        """The robust sum of squares over the whole records."""
        return _robust(self.residuals(unknowns))[0]

    def _each(self, share: float) -> list[tuple[Overlay, int, float]]:
        return list(zip(self.overlays, self.lengths(share), self.sigma.tolist(), strict=True))

    def _parts(self, unknowns: Array, share: float) -> list[Array] | None:
        try:
            law = self.free.law(unknowns[: self.count])
            return [
                (o.motion(law, shift, n)[0] - o.displacement[:n]) / s
                for (o, n, s), shift in zip(self._each(share), unknowns[self.count :], strict=True)
            ]
        except InputError:
            return None

    def slopes(self, unknowns: Array, share: float = 1.0) -> Array:
        """Derivatives of the residuals, shape (samples, unknowns).

        Those by a shift are the velocity; those by a number come from the core's derivatives through events, and from
        :meth:`differences` where it has none.
        """
        law, units = self.free.law(unknowns[: self.count]), self.free.units(unknowns[: self.count])
        edges = np.cumsum([0, *self.lengths(share)])
        found = np.zeros((int(edges[-1]), unknowns.size))
        together = [
            [name, *(tied for tied, source in self.free.ties.items() if source == name)] for name in self.free.names
        ]
        missing = set()
        for i, (overlay, n, s) in enumerate(self._each(share)):
            names = [name for group in together for name in group]
            velocity, by = overlay.tangent(law, names, float(unknowns[self.count + i]), n)
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

    def differences(self, unknowns: Array, j: int, share: float = 1.0, step: float = 0.02) -> Array:
        """The derivative of the residuals by free number `j`: central differences of exact orbits, one-sided at a limit."""
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
        reach = np.array([overlay.reach for overlay in self.overlays])
        return np.concatenate([self.free.low, -reach]), np.concatenate([self.free.high, reach])

    def near(self, numbers: Array) -> tuple[float, Array]:
        """The free numbers close by whose motions have the measured landmarks, and how unlike the motions are still.

        What is minimised knows nothing of phase (see :meth:`Overlay.unlikeness`), so it leads from far away.
        """

        def unlike(trial: Array) -> Array:
            try:
                law = self.free.law(trial)
                return np.concatenate([overlay.unlikeness(law) for overlay in self.overlays])
            except InputError:
                return np.full(8 * len(self.overlays), 2.0)

        low, high = self.free.low, self.free.high
        inside = np.clip(numbers, low + 1e-9, high - 1e-9)
        found = least_squares(
            unlike,
            inside,
            bounds=(low, high),
            loss="soft_l1",
            f_scale=0.1,
            diff_step=np.full(inside.size, 1e-3),
            max_nfev=12,
        )
        return float(found.cost), found.x

    def lay(self, numbers: Array) -> tuple[float, Array]:
        """Least squares of the motions from these free numbers; returns the misfit and all unknowns.

        The misfit is the mean of the squared residuals over the noise, 1 where only noise is left.
        """
        unknowns = numbers
        for share in SHARES:
            # A few cycles first: over many a small error of the period would put the motions out of step.
            law = self.free.law(unknowns[: self.count])
            shifts = [overlay.first_shift(law, n) for overlay, n, _ in self._each(share)]
            unknowns = np.concatenate([unknowns[: self.count], shifts])
            unknowns = self.down(unknowns, share, 1.0 if share < 1 else 0.01)
        misfit = float(np.mean(np.square(self.residuals(unknowns))))
        if misfit < self.best[0]:
            self.best = (misfit, unknowns)
        return misfit, unknowns

    def down(self, unknowns: Array, share: float, enough: float, held: Sequence[int] = ()) -> Array:
        """Robust least squares over a share of each record, by Levenberg and Marquardt; `held` numbers stay.

        Normal equations, as the samples are many and the unknowns few. It ends where no step could lower the sum of
        squares, in units of the noise, by more than `enough`. A step after which a number has no effect any more is not
        taken: from such a plateau nothing leads back.
        """
        low, high = self.bounds()
        at = np.clip(unknowns, low, high)
        rest, slopes = self.residuals(at, share), self.slopes(at, share)
        cost, damping, slow = _robust(rest)[0], 1e-3, 0
        for _ in range(ITERATIONS):
            weight = _robust(rest)[1]
            gradient = slopes.T @ (weight * rest)
            curvature = slopes.T @ (weight[:, None] * slopes)
            outward = ((at <= low) & (gradient > 0)) | ((at >= high) & (gradient < 0))
            outward[list(held)] = True
            loose = np.flatnonzero(~outward & (np.diag(curvature) > 0))
            inner = curvature[np.ix_(loose, loose)]
            if float(gradient[loose] @ np.linalg.lstsq(inner, gradient[loose], rcond=1e-14)[0]) < enough:
                break
            while damping < 1e10:
                push = np.linalg.solve(inner + damping * np.diag(np.diag(inner)), -gradient[loose])
                trial = at.copy()
                trial[loose] = np.clip(at[loose] + push, low[loose], high[loose])
                ahead = self.residuals(trial, share)
                lower = _robust(ahead)[0]
                if lower <= cost:
                    steep = self.slopes(trial, share)
                    if not (slopes.any(axis=0) & ~steep.any(axis=0)).any():
                        break
                damping *= 5
            else:
                return at
            slow = slow + 1 if cost - lower < enough else 0
            at, rest, slopes, cost, damping = trial, ahead, steep, lower, max(damping / 10, 1e-12)
            if slow == PATIENCE:
                break
        return at

    def scatter(self, unknowns: Array) -> Array:
        """Standard deviation of each record's residuals, in its unit of length."""
        parts = np.split(self.residuals(unknowns), np.cumsum(self.lengths(1.0))[:-1])
        return np.array([s * math.sqrt(np.mean(part**2)) for part, s in zip(parts, self.sigma, strict=True)])

    def silent(self, unknowns: Array) -> list[str]:
        """Names of the free numbers that change no motion here."""
        return [name for name, slope in zip(self.free.names, self.slopes(unknowns).T, strict=False) if not slope.any()]

    def covariance(self, unknowns: Array) -> Array:
        """Of all unknowns, from the slopes, the scatter of each record and its correlation from sample to sample.

        What an error of the gauge's zero and scale, common to all records, would do to the unknowns is added.
        """
        residuals, slopes = self.residuals(unknowns), self.slopes(unknowns)
        edges = np.cumsum([0, *self.lengths(1.0)])
        information = np.zeros((unknowns.size, unknowns.size))
        pulls = np.zeros((unknowns.size, 2))
        for (a, b), overlay, sigma in zip(pairwise(edges), self.overlays, self.sigma, strict=True):
            part = residuals[a:b]
            freedom = max(part.size - unknowns.size / len(self.overlays), 1.0)
            excess = float(np.sum(part**2)) / freedom * correlation_time(part)
            information += slopes[a:b].T @ slopes[a:b] / excess
            gauge = np.stack([np.ones(b - a), overlay.displacement], axis=1) * self.gauge_error / sigma
            pulls += slopes[a:b].T @ gauge / excess
        length = np.sqrt(np.diag(information))
        if (length == 0).any():
            silent = ", ".join(self.silent(unknowns)) or "the shift of a record"
            raise InputError(
                f"identify: the motions say nothing about {silent}: leave it out of the free parameters, or add records in "
                "which it acts"
            )
        scaled = information / np.outer(length, length)
        if np.linalg.cond(scaled) > 1e13:
            weak = np.linalg.eigh(scaled)[1][: self.count, 0]
            mixed = [n for n, part in zip(self.free.names, weak, strict=True) if abs(part) > 0.3]
            raise InputError(
                f"identify: {' and '.join(mixed) or 'the free numbers'} cannot be told apart by these motions: hold one of "
                "them fixed, or add records at other drive velocities"
            )
        covariance = np.linalg.inv(scaled) / np.outer(length, length)
        moved = covariance @ pulls
        return np.asarray(covariance + moved @ moved.T)


def _robust(rest: Array) -> tuple[float, Array]:
    """Σ ρ(r) and the weights ρ'(r)/r, with ρ(r) = 2 c² (√(1 + (r/c)²) − 1): squares near zero, straight far out."""
    root = np.sqrt(1 + (rest / OUTLIER) ** 2)
    return float(2 * OUTLIER**2 * np.sum(root - 1)), 1 / root


def fit_trajectories(
    first: Identification,
    free: Iterable[str] | None = None,
    settled_after: float = 0.4,
    *,
    starts: int = 8,
    profile: bool = False,
    zero_error: float = 0.0,
    scale_error: float = 0.0,
    seed: int = 0,
    progress: Progress | None = None,
    checkpoint: str | Path | None = None,
) -> Identification:
    """Sharpen an identified law until the motion it makes lies over the measured motion.

    Minimised is Σ ρ((x_simulated(t + φ_r; law) − x_measured(t)) / σ_r) over all records r, where x_simulated is the settled
    motion under the record's drive, φ_r a shift of time and σ_r the noise of the record. Each start is led near first by
    what does not depend on φ: period, turning points, time stuck, distance of the phase trajectories, kind of motion. A
    motion of another kind than the measured one is never taken.

    Parameters
    ----------
    first : an identification whose records hold a displacement and whose motion is steady in each; any law.
    free : names of the numbers to fit; default those of `first`.
    settled_after : the fraction of each record that is left out as transient, in [0, 1).
    starts : the most starting points that are tried; the first is that of `first`, the others lie around it. The search
        ends where only noise is left.
    profile : intervals by the profile of the likelihood instead of the curvature at its top.
    zero_error, scale_error : standard errors of the zero (a length) and the scale (relative) of the gauge, the same for all
        records. They do not show in a record, and at low noise they are most of what is not known.
    seed : of the starting points.
    progress : called as ``progress(what, done, of)``.
    checkpoint : a law file that holds the best so far from start to start, and after an interruption; where it exists
        and is from the same records and numbers, the search goes on from it. It is removed at the end.

    Returns
    -------
    Identification with the sharpened law, its parameters and covariance; ``rms`` is that of the displacement, in standard
    deviations of the motion; ``motions`` has a row for each record.

    Raises
    ------
    InputError
        for a record without displacement or with unknown constants, or where no motion lies near the record.
    KeyboardInterrupt
        after the best so far was written to `checkpoint`.

    Limits: for steady, repeating motions. A record whose cycles scatter (most real sticks do) has no one motion to be
    laid over; there the fit of the branches is what the record can tell. The covariance takes the correlation of the
    residuals from sample to sample into account, not errors of the rig's mass, stiffness, damping and drive velocity.
    Slopes go through all events by the core's derivatives; of a smooth law, or one with an internal state, they are central
    differences of exact orbits, and `notes` says so.

    Source: the criterion of identification of the paper's Section 6, agreement of phase trajectories.
    """
    if not 0 <= settled_after < 1:
        raise InputError(f"fit_trajectories: settled_after must lie in [0, 1), got {settled_after}")
    if isinstance(starts, bool) or not isinstance(starts, int) or starts < 1:
        raise InputError(f"fit_trajectories: starts must be a whole number of at least 1, got {starts!r}")
    overlays = [Overlay(record, settled_after) for record in first.records]
    names = check_names(first.law, first.parameters.index if free is None else free)
    for name, size in (("zero_error", zero_error), ("scale_error", scale_error)):
        if number(name, size, "fit_trajectories") < 0:
            raise InputError(f"fit_trajectories: {name} must not be negative, got {size}")
    fit = Fit(overlays, Free(first.law, names, first.ties, first.within), (zero_error, scale_error))
    memory = Checkpoint(checkpoint, first, names, settled_after, seed)
    search(fit, first, starts, np.random.default_rng(seed), memory, progress or (lambda *_: None))
    unknowns = _polished(fit)
    _refuse_far(fit, unknowns)
    result = _result(first, fit, unknowns, profile, progress)
    memory.remove()
    return result


def search(
    fit: Fit,
    first: Identification,
    starts: int,
    random: np.random.Generator,
    memory: Checkpoint,
    progress: Progress,
) -> None:
    """Lay the motions from one starting point after the other until only noise is left; `fit.best` holds the best."""
    points = _starts(fit.free, first, starts, random)
    done, fit.best = memory.read(fit.best)
    known = all(math.isfinite(overlay.noise) for overlay in fit.overlays)
    found: list[float] = []
    for turn in range(done, starts):
        progress("laying the motions over each other", turn, starts)
        best = fit.best[0]
        if known and best < LIKE_NOISE**2:
            break
        # The best found twice, from two sides: there is hardly a better one, unless a number has lost its effect there.
        if sum(misfit < best * (1 + TWICE) for misfit in found) > 1 and not fit.silent(fit.best[1]):
            break
        try:
            if turn == 0:
                found.append(fit.lay(points[0])[0])
                if known and fit.best[0] < LIKE_NOISE**2:
                    continue
            found.append(fit.lay(fit.near(points[turn])[1])[0])
        except InputError:
            # Not a law there: the next one.
            continue
        finally:
            memory.write(fit, turn + 1)
    progress("laid over each other", starts, starts)


def _starts(free: Free, first: Identification, count: int, random: np.random.Generator) -> Array:
    """Starting points in the vector of the free numbers: the first is that of `first`, the others lie around it.

    They scatter as the first identification says, correlations included: where it knows but a line on which a point lies,
    points beside that line would lead nowhere.
    """
    plain = np.maximum(np.abs(free.values(np.zeros(len(free.names)))), 1e-12)
    unit = free.scale * np.where(free.ratios, plain, 1.0)
    known = first.covariance.reindex(index=free.names, columns=free.names).to_numpy(dtype=float)
    known = np.nan_to_num(known) / np.outer(unit, unit)
    relative = SPREAD * plain / unit
    size, axes = np.linalg.eigh(0.5 * (known + known.T))
    points = np.zeros((count, len(free.names)))
    points[1:] = 2 * random.standard_normal((count - 1, size.size)) * np.sqrt(np.maximum(size, 0.0)) @ axes.T
    points[1:] += relative * random.standard_normal((count - 1, size.size))
    return np.clip(points, free.low, free.high)


def _polished(fit: Fit) -> Array:
    """The best unknowns, with each record weighed by the scatter that is left."""
    if not fit.best[1].size:
        raise InputError(
            "identify: no start gave a motion that could be laid over the records; keep the fit of the branches"
        )
    unknowns = fit.best[1]
    for _ in range(2):
        fit.sigma = np.maximum(fit.scatter(unknowns), 1e-12)
        unknowns = fit.down(unknowns, 1.0, 1e-4)
    return unknowns


def _refuse_far(fit: Fit, unknowns: Array) -> None:
    law = fit.free.law(unknowns[: fit.count])
    for overlay, scatter in zip(fit.overlays, fit.scatter(unknowns), strict=True):
        far = scatter / overlay.spread
        found, _ = overlay.landmarks(law)
        # Close to the end of stick-slip the shortest sticks are not seen: there the word alone does not decide.
        if far > FAR or (found.kind != overlay.seen.kind and far > CLOSE):
            raise InputError(
                f"{overlay.name}: no motion of the law lies near this record (distance {far:.2f} of its standard deviation; "
                f"measured {overlay.seen.kind}, simulated {found.kind}); keep the fit of the branches"
            )


def _result(
    first: Identification, fit: Fit, unknowns: Array, profile: bool, progress: Progress | None
) -> Identification:
    covariance = fit.covariance(unknowns)
    numbers = unknowns[: fit.count]
    parameters, full = fit.free.table(numbers, covariance[: fit.count, : fit.count], float(norm.ppf(0.975)))
    notes, gauge = [], []
    for name, size in zip(("zero", "scale"), fit.gauge_error.tolist(), strict=True):
        if size:
            gauge.append(f"--{name}-error {size:g}")
            notes.append(f"An error of {size:.3g} of the gauge's {name}, common to all records, is in the intervals.")
    if profile:
        from stickslip.identification.profile import profile_intervals

        parameters[["low", "high"]], open_ends = profile_intervals(fit, unknowns, covariance, progress)
        notes.append("Intervals are those of the profile likelihood.")
        notes += open_ends
    why = why_differences(type(first.law))
    if why is not None:
        notes.append(f"Slopes of the motion are differences of orbits: {why}.")
    scatter = fit.scatter(unknowns)
    motions = pd.DataFrame(
        {
            "record": [overlay.name for overlay in fit.overlays],
            "kind": [overlay.seen.kind for overlay in fit.overlays],
            "period": [overlay.seen.period for overlay in fit.overlays],
            "samples": [overlay.time.size for overlay in fit.overlays],
            "shift": unknowns[fit.count :],
            "scatter": scatter,
            "noise": [overlay.noise for overlay in fit.overlays],
            "distance": [s / overlay.spread for s, overlay in zip(scatter, fit.overlays, strict=True)],
        }
    )
    distance = math.sqrt(float(np.mean(motions["distance"] ** 2)))
    notes.append(
        f"Sharpened by the agreement of the motions: they lie {distance:.2g} of the displacement's standard deviation apart, "
        "with one shift of time for each record."
    )
    notes += [
        f"{overlay.name}: the motion of the law lies {left / overlay.noise:.2g} times the noise from the record, so the law, "
        "or a constant of the rig, is not quite that of the record, and the intervals are too narrow."
        for overlay, left in zip(fit.overlays, scatter.tolist(), strict=True)
        if left > LIKE_NOISE**2 * overlay.noise
    ]
    return replace(
        first,
        law=fit.free.law(numbers),
        parameters=parameters,
        covariance=full,
        rms=distance,
        motions=motions,
        command=" ".join([first.command, "--trajectories", *(["--profile"] if profile else []), *gauge]),
        notes=[*first.notes, *notes],
    )
