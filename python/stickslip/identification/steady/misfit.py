"""What a fitted curve of friction leaves that speed, position or time explain, and intervals that hold it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from stickslip.files.arrays import Array
from stickslip.identification.estimator.hat_functions import hats_at
from stickslip.identification.estimator.least_squares import linear
from stickslip.identification.estimator.residual_statistics import cluster_scores
from stickslip.identification.steady.curves import BLOCKS, FreeCurve, Rows, SteadyFit
from stickslip.identification.steady.single_form_fit import linear_losses

GAIN = 0.02
"""A form whose mean squared misfit of held-back rows is less than this share lower predicts no better, however surely."""
EVIDENCE = 2.0
"""By so much the sum of squared misfits, in units of the stated errors, must differ to tell two forms apart."""
NODES = 6
"""Of a free curve over the speed, on either side, or over the position, by which forms are measured where rows are many."""
TURN = 3
"""Nodes of a free curve over the time: it drifts, and may turn once."""
SURE = 2.0
"""Standard errors by which held-back rows must be predicted better before friction is said to follow position or time."""
PART = 0.1
"""Share of the mean squared misfit that position or time must explain before that is said: less of it moves no number far."""
CLEAR = 8.0
"""Errors of the speed over which a fall of friction must extend: with fewer an exponential is off by 0.8 % of it or more."""
CLUSTERS = 12
"""Ranges of position or time in which what is left of the force goes together."""


def predicts_worse(rows: Rows, losses: Array, best: Array, surely: float = 1.0, by: float = GAIN) -> bool:
    """Whether held-back rows are predicted worse than by the best, by so many standard errors and so that it matters."""
    parts = rows.parts if len(rows.parts) <= BLOCKS or rows.apart else np.array_split(np.arange(len(rows)), BLOCKS)
    means = np.array([float((losses - best)[part].mean()) for part in parts])
    error = float(np.std(means, ddof=1)) / math.sqrt(len(means)) if len(means) > 1 else 0.0
    gain = float(means.mean())
    # rows that are all met to within their errors cannot tell forms apart, however alike they are missed
    decided = not rows.known or float(np.sum(losses - best)) > EVIDENCE
    return gain > surely * error and gain > by * float(best.mean()) and decided


#: What to do about a force that follows something else than the slip velocity.
REMEDIES = {
    "position": "Gravity, run-out and misalignment do so: say them in the rig, or measure a shorter range. So does a force "
    "that is written late against the motion: clock_offset in the rig takes that out.",
    "time": "Heat, wear and a drifting sensor do so: identify windows of the record apart ([read] window in the rig).",
}


def widened(rows: Rows, fit: SteadyFit) -> tuple[SteadyFit, list[str], bool]:
    """The fit with intervals that hold what its form misses, what that is, and whether the intervals are valid.

    A free curve over the speed, and free forces and frictions over the position and over the time of one record, are fitted
    beside the form. Where one predicts held-back rows better, the form does not describe the record. Of a position or a time
    what is left in one of `CLUSTERS` ranges then counts as one residual; of the speed the intervals are widened until they
    hold the free curve at its nodes.

    Limits: a form that misses what no free curve shows, such as a force that all rows have in common, is not seen.
    """
    notes, valid = [], True
    columns = fit.curve.jacobian(rows, fit.numbers) / rows.error[:, None]
    residuals = rows.force - fit.curve.columns(rows) @ fit.numbers
    for words, where, count in _others(rows):
        hats = _hats(where, count)
        free = np.concatenate([hats, np.sign(rows.w)[:, None] * hats], axis=1) / rows.error[:, None]
        if len(rows) < 4 * (columns.shape[1] + free.shape[1]):
            continue
        alone = linear_losses(rows, columns)
        better = linear_losses(rows, np.concatenate([columns, free], axis=1))
        if predicts_worse(rows, alone, better, SURE, PART):
            valid = False
            gain = 100 * (1 - math.sqrt(float(better.mean() / alone.mean())))
            notes.append(
                f"What this form leaves of the force follows the {words}, and no form explains it: a free curve over the "
                f"{words} misses held-back rows {gain:.0f} % less. {REMEDIES[words]} Intervals and any difference between "
                "the two senses of slip are not valid, though the intervals were widened."
            )
            more = _by_cluster(columns, residuals / rows.error, where)
            fit = fit.with_covariance(fit.covariance + more, min(fit.freedom, CLUSTERS - 1))
    gain, factor = _off_at_speeds(rows, fit, residuals)
    if gain > 0:
        notes.append(
            "Friction over slip velocity has another shape than any of these forms: a free curve misses held-back rows "
            f"{gain:.0f} % less. The intervals are those of the nearest curve of this form"
            + (f", widened {factor:.2g} times so that they hold the free curve." if factor > 1 else ".")
        )
        fit = fit.with_covariance(fit.covariance * max(factor, 1.0) ** 2, fit.freedom)
    return fit, notes, valid


def is_blurred(rows: Rows, fit: SteadyFit) -> bool:
    """Whether friction falls over speeds that the error of the speed is not small against."""
    return "weakening" in fit.curve.terms and fit.curve.scale < CLEAR * rows.blur


def with_speed_error(rows: Rows, fit: SteadyFit, others: Iterable[SteadyFit]) -> tuple[SteadyFit, list[str]]:
    """The fit with intervals that hold what the error of the speed does to it, and what is said of that.

    Least squares take the speed for exact. Where the error of it is not small against the speeds over which friction falls,
    the mean force at a measured speed is that of a blurred curve, to which another fall may be the nearest: rows near rest
    are missing, and what is left of one looks like the other. Intervals then hold how far the blur moves the numbers, to
    second order in the error, and those of `others`, forms with the same numbers, that predict about as well.
    """
    if not is_blurred(rows, fit):
        return fit, []
    ahead, behind = (replace(rows, w=rows.w + sign * np.sign(rows.w) * rows.blur) for sign in (1, -1))
    bent = (fit.curve.columns(ahead) + fit.curve.columns(behind)) / 2 - fit.curve.columns(rows)
    jacobian = fit.curve.jacobian(rows, fit.numbers)
    size = np.linalg.norm(jacobian, axis=0)
    falls = [i for i, term in enumerate(fit.curve.terms) if term.startswith("weakening")]
    moves = [linear(jacobian / size, bent[:, falls] @ fit.numbers[falls], rows.error) / size]
    alike = [other for other in others if not predicts_worse(rows, other.losses, fit.losses)]
    moves += [other.vector - fit.vector for other in alike]
    errors = fit.curve.scale / rows.blur
    held = " and ".join(f"{other.form} with a scale of {other.curve.scale:.3g}" for other in alike)
    note = (
        f"The speed has a standard error of {rows.blur:.2g}, and by this form friction falls over {fit.curve.scale:.2g}, "
        f"{errors:.2g} times as much: that blurs the fall, so neither its shape nor friction at rest can be told. The "
        f"intervals hold the blur{f' and {held}, which predicts about as well' if held else ''}; measure the speed with less "
        "noise."
    )
    return fit.with_covariance(fit.covariance + sum(np.outer(one, one) for one in moves), fit.freedom), [note]


def _others(rows: Rows) -> Iterator[tuple[str, Array, int]]:
    """What else than the speed friction may follow: name, values from row to row, nodes."""
    if np.isfinite(rows.position).all() and np.ptp(rows.position) > 0:
        yield "position", rows.position, NODES
    if rows.series and len(rows.records) == 1:
        yield "time", np.arange(len(rows), dtype=float), TURN


def _hats(x: Array, count: int) -> Array:
    """Straight pieces over x with as many rows between any two nodes, shape (rows, nodes)."""
    nodes = np.unique(np.quantile(x, np.linspace(0, 1, count)))
    return hats_at(x, nodes)


def _by_cluster(columns: Array, residuals: Array, where: Array) -> Array:
    """Covariance of the numbers where residuals go together over ranges of `where`."""
    size = np.linalg.norm(columns, axis=0)
    left, singular, right = np.linalg.svd(columns / size, full_matrices=False)
    order = np.argsort(where, kind="stable")
    edges = np.linspace(0, len(order), CLUSTERS + 1).astype(int).tolist()
    moves = cluster_scores(left[order], residuals[order], edges) / singular @ right / size
    return np.asarray(moves.T @ moves)


def _off_at_speeds(rows: Rows, fit: SteadyFit, residuals: Array) -> tuple[float, float]:
    """By what share a free curve over the speed predicts better, in per cent, and by how many half-widths it is off."""
    free = FreeCurve.of(rows, NODES, fit.curve)
    if len(rows) < 4 * free.count:
        return 0.0, 1.0
    columns = free.columns(rows)
    losses = linear_losses(rows, columns / rows.error[:, None])
    if not predicts_worse(rows, fit.losses, losses):
        return 0.0, 1.0
    found = linear(columns, residuals, rows.error)
    w = np.concatenate([free.nodes, -free.nodes])
    seen = np.concatenate([np.full(len(free.nodes), bool((side * rows.w > 0).any())) for side in (1, -1)])
    low, high = fit.interval(w[seen])
    factor = float(np.max(2 * np.abs(found[: w.size][seen]) / np.maximum(high - low, 1e-300)))
    return 100 * (1 - math.sqrt(float(losses.mean() / fit.losses.mean()))), factor
