"""The fit of one form of friction over slip velocity: its scale by search, all other numbers by linear least squares.

Which of the forms is taken is decided in `form_choice`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from stickslip.files.arrays import Array
from stickslip.identification.estimator.least_squares import linear
from stickslip.identification.estimator.record_scatter import record_scatter
from stickslip.identification.estimator.residual_statistics import correlation_time, recurrence
from stickslip.identification.estimator.uncertainty import correlated_covariance
from stickslip.identification.steady.curves import (
    BY_SENSE,
    EXPONENTS,
    FEW_ROWS,
    FORMULAS,
    GRAVITY,
    Curve,
    FreeCurve,
    Rows,
    SteadyFit,
    table_of,
)

TOO_NEAR = 1e-13
"""Columns whose products leave less than this of each other are one and the same."""
SCALE_TOLERANCE = 1e-3
"""Of the logarithm of a scale: within this of each other two values are near enough to go on from, by steps of at most it."""
SAME = 1e-9
"""Of the logarithm of a scale, below which a step changes nothing."""
HIDDEN = 0.3
"""A hidden fall of friction is searched for down to this part of the slowest speed."""


def fit_form(rows: Rows, form: str, terms: tuple[str, ...], *, hidden: bool = False) -> SteadyFit | None:
    """Fit one form; None where there are too few rows for it, or where two of its numbers do the same on these rows.

    `hidden`: a fall of friction whose scale lies below the slowest speed, of which rows show the end alone; else those
    that show the fall.
    """
    names = list(terms)
    if "weakening" in terms:
        names.insert(names.index("weakening") + 1, "scale")
    if len(rows) < len(names) + 2:
        return None
    blank = Curve(terms, rows.reference, rows.middle, EXPONENTS.get(form.split(", ")[0], 1.0))
    scales = (
        _scales(rows, blank, HIDDEN if hidden else 1.0) if "scale" in names else [blank.scale] * (1 + len(rows.parts))
    )
    curve, *others = (replace(blank, scale=scale) for scale in scales)
    curve, numbers, residuals = _polished(rows, curve, names.index("scale") if "scale" in names else None)
    if "scale" in names and not _falls(rows, curve, numbers, hidden):
        return None
    jacobian = curve.jacobian(rows, numbers)
    values = numbers.tolist()
    if "scale" in names:
        values.insert(names.index("scale"), curve.scale)
    size = np.linalg.norm(jacobian / rows.error[:, None], axis=0)
    if not (size > 0).all():
        return None
    scaled = jacobian / rows.error[:, None] / size
    singular = np.linalg.svd(scaled, compute_uv=False)
    if singular[-1] < 1e-6 * singular[0]:
        return None  # two of its terms are one and the same on these rows
    covariance, freedom = _covariance(rows, scaled, residuals)
    covariance /= np.outer(size, size)
    losses = _held_back(rows, others if "scale" in names else [curve])
    plain = losses * rows.error**2
    side = [FORMULAS[term.removesuffix(BY_SENSE)].replace(term.removesuffix(BY_SENSE), term, 1) for term in terms]
    power = "|w| / scale" if curve.exponent == 1 else f"(|w| / scale)^{curve.exponent:g}"
    marks = {"reference": rows.reference, "load": rows.middle[0], "position": rows.middle[1], "power": power}
    return SteadyFit(
        form=form,
        formula="f(w > 0) = " + " + ".join(side).format(**marks),
        parameters=table_of(names, np.array(values), covariance, freedom),
        covariance=covariance,
        rms=float(np.sqrt(np.mean(residuals**2))),
        held_back=float(np.sqrt(np.average(plain, weights=1 / rows.error**2))),
        losses=losses,
        freedom=freedom,
        curve=curve,
        numbers=numbers,
    )


def _falls(rows: Rows, curve: Curve, numbers: Array, hidden: bool) -> bool:
    """Whether it is a Stribeck curve: one that falls, over speeds that were measured.

    One bent over all speeds is a polynomial by another name, one whose fall is over at the slowest an extrapolation.
    """
    speed = np.abs(rows.w)
    fast, slow = 0.5 * float(speed.max()), 1.001 * float(speed.min())
    return bool(min(numbers[:2]) >= 0 and (curve.scale <= slow if hidden else slow < curve.scale <= fast))


def _covariance(rows: Rows, scaled: Array, residuals: Array) -> tuple[Array, float]:
    """Covariance of the numbers of the scaled columns, and its degrees of freedom."""
    count, free = scaled.shape
    sense = np.sign(rows.w)
    levels = (
        np.stack([np.isin(np.arange(count), part) * sense for part in rows.records], axis=1) if rows.apart else None
    )
    if levels is not None:
        whole, residuals = residuals, residuals - levels @ (levels.T @ residuals / np.sum(levels**2, axis=0))
    z = residuals / rows.error
    chi = float(np.sum(z**2)) / (count - free)
    period = recurrence(rows.w) if rows.series and count > FEW_ROWS else 0
    # stated errors are believed unless the scatter is larger
    covariance, freedom = correlated_covariance(
        scaled, z, max(chi, 1.0) if rows.known else chi, period, count / (free + 2) if count > FEW_ROWS else 1.0
    )
    if levels is not None:
        record_scatter, left = record_scatter_of(rows, whole, scaled)
        moves = np.linalg.pinv(scaled) @ (levels / rows.error[:, None])
        covariance += record_scatter**2 * moves @ moves.T
        freedom = min(freedom, left)
    return covariance, freedom


def record_scatter_of(rows: Rows, residuals: Array, columns: Array) -> tuple[float, float]:
    """Standard deviation of friction from record to record, 0 where chance makes it, and its degrees of freedom.

    Parameters
    ----------
    rows, rest : the points and their distances from a curve fitted to them.
    columns : of the fit; what they take up of the levels of the records is no longer seen in `rest`.
    """
    off, weight = np.sign(rows.w) * residuals, 1 / rows.error**2
    parts = rows.records
    if not 1 < len(parts) < len(rows):
        return 0.0, math.inf
    means = np.array([np.average(off[part], weights=weight[part]) for part in parts])
    inner = np.concatenate([(off[part] - mean) / rows.error[part] for part, mean in zip(parts, means, strict=True)])
    within = float(inner @ inner) / (len(rows) - len(parts))
    tau = np.array([correlation_time(off[part]) if rows.series else 1.0 for part in parts])
    variances = within * tau / np.array([weight[part].sum() for part in parts])
    found = record_scatter(means.tolist(), variances.tolist())
    base = np.linalg.qr(columns)[0]
    level = np.sign(rows.w) / rows.error
    taken = sum(float(np.sum((base[part].T @ level[part]) ** 2) / np.sum(level[part] ** 2)) for part in parts)
    left = max(len(parts) - taken, 1.0)
    return found * math.sqrt((len(parts) - 1) / left), left


def inertia_error(rows: Rows, nodes: int) -> tuple[float, float]:
    """By how much the inertia taken off the force is too small, and its standard error.

    It is the slope of the force over the acceleration, beside a free curve over the speed and a force of the place.
    """
    of_position = ("restoring", *(GRAVITY if rows.turning else ())) if np.isfinite(rows.position).all() else ()
    columns = FreeCurve.of(rows, nodes, Curve((*of_position, "inertia"), rows.reference, rows.middle)).columns(rows)
    columns = columns[:, (columns != 0).any(axis=0)]
    size = np.linalg.norm(columns, axis=0)
    scaled = columns / size
    numbers = linear(scaled, rows.force, np.ones(len(rows)))
    covariance, _ = _covariance(replace(rows, error=np.ones(len(rows))), scaled, rows.force - scaled @ numbers)
    return float(numbers[-1] / size[-1]), float(np.sqrt(covariance[-1, -1]) / size[-1])


def linear_losses(rows: Rows, columns: Array) -> Array:
    """Squared misfit of every row, predicted by a sum of columns fitted to the rows of the other parts.

    Parameters
    ----------
    columns : in units of the errors, shape (n, p).
    """
    both = np.column_stack([columns, rows.force / rows.error])
    grams = np.stack([both[part].T @ both[part] for part in rows.parts])
    numbers, _ = _least(_without_each(rows, grams)[1:])
    losses = np.zeros(len(rows))
    for part, each in zip(rows.parts, numbers, strict=True):
        losses[part] = (both[part, -1] - both[part, :-1] @ each) ** 2
    return losses


def _held_back(rows: Rows, curves: Sequence[Curve]) -> Array:
    """Squared misfit of every row in units of its error, predicted by a fit to the others: one curve for each part or all."""
    if len(curves) == 1:
        return linear_losses(rows, curves[0].columns(rows) / rows.error[:, None])
    losses = np.zeros(len(rows))
    for part, curve in zip(rows.parts, curves, strict=True):
        # the fit to the others has a scale of its own
        columns = curve.columns(rows) / rows.error[:, None]
        losses[part] = linear_losses(rows, columns)[part]
    return losses


def _without_each(rows: Rows, grams: Array) -> Array:
    """Products of columns summed over all parts, then over all but each: sums, so that what is 0 stays 0."""
    count = len(rows.parts)
    return np.asarray(np.tensordot(np.concatenate([np.ones((1, count)), 1 - np.eye(count)]), grams, axes=1))


def _least(grams: Array) -> tuple[Array, Array]:
    """Numbers and sums of squares of linear fits from the products of their columns, the target the last; stacked."""
    size = np.sqrt(np.diagonal(grams, axis1=1, axis2=2))
    size = np.where(size > 0, size, 1.0)
    scaled = grams / size[:, :, None] / size[:, None, :]
    # The pseudo-inverse by its eigenvectors: NumPy's own takes three times as long to sort them first.
    values, vectors = np.linalg.eigh(scaled[:, :-1, :-1])
    known = np.abs(values) > TOO_NEAR * np.abs(values).max(axis=1, keepdims=True)
    along = np.swapaxes(vectors, 1, 2) @ scaled[:, :-1, -1:]
    numbers = vectors @ (np.where(known, 1 / np.where(known, values, 1.0), 0.0)[:, :, None] * along)
    cost = size[:, -1] ** 2 * (1 - np.sum(scaled[:, :-1, -1] * numbers[:, :, 0], axis=1))
    return numbers[:, :, 0] * size[:, -1:] / size[:, :-1], cost


def _polished(rows: Rows, curve: Curve, scale: int | None) -> tuple[Curve, Array, Array]:
    """The curve, its linear numbers and what they leave, its scale at the minimum: by Gauss and Newton from near there.

    `scale` says which of its numbers that is; None: it has none.
    """

    def tried(curve: Curve) -> tuple[float, Array, Array]:
        numbers = linear(columns := curve.columns(rows), rows.force, rows.error)
        residuals = rows.force - columns @ numbers
        return float(np.sum((residuals / rows.error) ** 2)), numbers, residuals

    cost, numbers, residuals = tried(curve)
    for _ in range(0 if scale is None else 20):
        jacobian = curve.jacobian(rows, numbers)
        size = np.linalg.norm(jacobian, axis=0)
        if not (size > 0).all():
            break
        step = float(linear(jacobian / size, residuals, rows.error)[scale] / size[scale]) / curve.scale
        near = replace(curve, scale=curve.scale * math.exp(float(np.clip(step, -SCALE_TOLERANCE, SCALE_TOLERANCE))))
        least, others, left = tried(near)
        if not least < cost:
            break
        curve, cost, numbers, residuals = near, least, others, left
        if abs(step) < SAME:
            break
    return curve, numbers, residuals


def _scales(rows: Rows, blank: Curve, below: float) -> list[float]:
    """The scale of the fall of friction by least squares: of all rows, then of all but each part.

    It is searched for from the slowest speed, times `below`, to the fastest.

    What is seen at one scale is seen of all these fits at once; each is searched on from what the others have seen.
    """
    speed = np.abs(rows.w)
    falls = tuple(term for term in blank.terms if term.startswith("weakening"))
    beside = replace(blank, terms=tuple(term for term in blank.terms if term not in falls))
    weight = 1 / rows.error[:, None]
    fixed = np.column_stack([beside.columns(rows), rows.force]) * weight
    few, count = len(falls), len(falls) + fixed.shape[1]
    parts = [(part, fixed[part]) for part in rows.parts]
    grams = np.empty((len(parts), count, count))
    for gram, (_, own) in zip(grams, parts, strict=True):
        gram[few:, few:] = own.T @ own

    def costs(log_scales: Array) -> Array:
        summed = []
        for log_scale in log_scales:
            fall = replace(blank, terms=falls, scale=math.exp(log_scale)).columns(rows) * weight
            for gram, (part, own) in zip(grams, parts, strict=True):
                falling = fall[part]
                gram[:few, :few] = falling.T @ falling
                gram[:few, few:] = falling.T @ own
                gram[few:, :few] = gram[:few, few:].T
            summed.append(_without_each(rows, grams))
        return _least(np.concatenate(summed))[1].reshape(len(log_scales), -1)

    # a fall that is over at the slowest rows would be an extrapolation many times its size
    grid = np.linspace(math.log(below * float(speed.min())), math.log(float(speed.max())), 13)
    seen = dict(zip(grid.tolist(), costs(grid), strict=True))

    def lowest(number: int) -> float:
        found = math.nan
        for _ in range(12):
            x = np.array(sorted(seen))
            y = np.array([seen[float(at)][number] for at in x])
            best = int(np.argmin(y))
            a = min(max(best, 1), x.size - 2)
            left, right = x[a] - x[a - 1], x[a + 1] - x[a]
            turn = (y[a + 1] - y[a]) / right - (y[a] - y[a - 1]) / left
            slope = ((y[a + 1] - y[a]) / right * left + (y[a] - y[a - 1]) / left * right) / (left + right)
            vertex = x[a] - slope * (left + right) / (2 * turn) if turn > 0 else x[best]
            found = float(np.clip(vertex, x[max(best - 1, 0)], x[min(best + 1, x.size - 1)]))
            if np.min(np.abs(x - found)) < SCALE_TOLERANCE:
                break
            seen[found] = costs(np.array([found]))[0]
        return math.exp(found)

    return [lowest(number) for number in range(1 + len(rows.parts))]
