"""Where the search for the numbers of a step of the drive's speed begins, and whether it found them."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np

from stickslip.errors import InputError
from stickslip.files.arrays import Array, Mask

LENGTHS, EFFECTS, STIFFNESSES = (0.1, 0.3, 1.0, 3.0), (0.4, 0.8, 1.0, 1.4), (1.0, 6.0, 40.0)
"""Contacts that are tried before the search: D_c over the path of the decay, b / a, and κ D_c / a."""
KEPT = 2
"""So many of them, of different D_c, are starting points."""
FIRST, EVALUATIONS = 15, 200
"""Most steps of the search from each starting point, and from the best of what they reach."""
RESOLVED = 3.0
"""A length must be so many times the path from sample to sample to show in its samples, not by the form of the law alone."""


def starting_points(response: Callable[[Array], Array], friction: Array, a: float, decay: float) -> list[Array]:
    """Contacts at which a search may begin: those of a grid that lie closest to the record.

    The response to a step is proportional to a where b / a, D_c and κ / a stay, so a follows by linear least squares.

    Parameters
    ----------
    response : of a search vector of `OF_CONTACT`, shape (n,), weighted as the friction is and as free of level and drift; an
        InputError says that there is none.
    friction : shape (n,).
    a, decay : sizes of the direct effect and of the path over which friction decays (m).
    """
    tried: list[tuple[float, float, Array]] = []
    for length, effect, stiffness in product(LENGTHS, EFFECTS, STIFFNESSES):
        size = math.log(a), effect * a, math.log(length * decay), math.log(stiffness * a / (length * decay))
        try:
            found = response(np.array(size))
        except InputError:
            continue
        square = float(found @ found)
        factor = float(np.clip(found @ friction / square, 0.02, 50.0)) if square > 0 else 1.0
        grown = np.array([size[0] + math.log(factor), size[1] * factor, size[2], size[3] + math.log(factor)])
        tried.append((float(np.sum((friction - factor * found) ** 2)), length, grown))
    best: dict[float, Array] = {}
    for _, length, numbers in sorted(tried, key=lambda one: one[0]):
        best.setdefault(length, numbers)
    return list(best.values())[:KEPT]


def is_undetermined(jacobian: Array, residuals: Array, off: Array, reach: Array) -> Mask:
    """Which numbers the record does not determine: they ended at the limit of the search, or act on nothing.

    Parameters
    ----------
    jacobian, residuals : of the fit, shapes (n, p) and (n,).
    off, reach : distance of the search vector from the middle of the search, and the limit of it, shape (p,).
    """
    effect = np.linalg.norm(jacobian, axis=0) * reach
    return np.asarray((np.abs(off) > 0.999 * reach) | (effect < float(np.sqrt(np.mean(residuals**2)))))


def notes_on_convergence(jacobian: Array, residuals: Array, undetermined: Mask) -> list[str]:
    """A sentence where another step of the search would move the determined numbers by a standard error or more."""
    determined = jacobian[:, ~undetermined]
    step = np.linalg.lstsq(determined, residuals, rcond=None)[0]
    gain = float(np.sum((determined @ step) ** 2))
    if gain <= float(np.sum(residuals**2)) / max(len(residuals) - len(step), 1):
        return []
    return ["the search ended before the misfit was least: take the numbers for a guess"]


def with_limits(covariance: Array, reach: Array, undetermined: Mask) -> Array:
    """The covariance where numbers that the record does not determine are known no better than the search went."""
    known = ~undetermined
    return np.asarray(covariance * np.outer(known, known) + np.diag(np.where(undetermined, reach**2, 0.0)))


def notes_on_undetermined(names: list[str], undetermined: Mask, values: Any, sampled: float, jump: float) -> list[str]:
    """What the steps say nothing of, and lengths that are too short for the samples, as plain sentences.

    Parameters
    ----------
    names, undetermined : of the numbers, and which of them are not determined.
    values : by name.
    sampled : path from sample to sample after the step (m), of several steps the least.
    jump : ln(V₂/V₁).
    """
    notes = []
    if unknown := [name for name, one in zip(names, undetermined, strict=True) if one]:
        notes.append(
            f"not determined by the record: {', '.join(unknown)}; the value is where the search ended, the error the range "
            "that was searched"
        )
    lengths = {name: values[name] for name in ("length", "second_length") if name in values}
    for name, length in lengths.items():
        if length < RESOLVED * sampled:
            notes.append(
                f"{name} of {length:.2g} m is not resolved: the drive goes {sampled:.2g} m from sample to sample after a "
                "step, so the decay lies in a few samples and the numbers rest on the form of the law and on the time of "
                "the step; record faster, or step to lower speeds"
            )
    if (loading := values["a"] * abs(jump) / values["stiffness"]) < sampled:
        notes.append(
            f"the stiffness is not resolved: friction rises within {loading:.2g} m of the drive's path, less than the "
            f"{sampled:.2g} m from sample to sample; take it for a lower limit"
        )
    return notes
