"""One starting point after the other, until only noise is left or the best minimum was found twice."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import pandas as pd

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.identification.law_parameters import LawParameters
from stickslip.identification.trajectory.checkpoint import Best, Checkpoint

if TYPE_CHECKING:
    from stickslip.identification.result import Identification

Progress = Callable[[str, int, int], Any]

LIKE_NOISE = 1.05
"""A misfit of all records within this ratio of their noise cannot be improved: no further start is tried."""
TWICE = 1e-3
"""Misfits within this ratio are the same minimum."""
SPREAD = 0.05
"""Starting points lie that far around the first one, relative to its numbers, and twice its standard errors."""


@dataclass(frozen=True)
class Refined:
    """What a search ends with.

    Attributes
    ----------
    numbers : the free numbers as a vector of :class:`~stickslip.identification.law_parameters.LawParameters`.
    covariance : of these and of what else was unknown, in that order.
    freedom : degrees of freedom of the errors.
    motions : a row for each record.
    notes : plain sentences.
    """

    numbers: Array
    covariance: Array
    freedom: float
    motions: pd.DataFrame
    notes: list[str]


class Shooting(Protocol):
    """What motions are shot at the records and how the misfit gets less; `best` is the least misfit and its unknowns."""

    free: LawParameters
    known: bool
    best: Best

    def reachable(self, numbers: Array) -> Array:
        """Free numbers close by from which a descent leads to the records."""

    def refine(self, numbers: Array) -> float:
        """The least misfit in a descent from these numbers, 1 where only noise is left; `best` is kept."""

    def without_effect(self, unknowns: Array) -> list[str]:
        """Names of the free numbers that change nothing here."""

    def finish(self) -> Refined:
        """The best numbers with their uncertainty."""


def search(
    shooting: Shooting,
    first: Identification,
    starts: int,
    random: np.random.Generator,
    memory: Checkpoint,
    progress: Progress,
) -> None:
    """Refine the motions from one starting point after the other; `shooting.best` holds the best.

    Raises
    ------
    InputError
        where none could be compared with the records.
    """
    points = _starts(shooting.free, first, starts, random)
    done, shooting.best = memory.read(shooting.best)
    found: list[float] = []
    for turn in range(done, starts):
        progress("comparing the motions", turn, starts)
        best = shooting.best[0]
        if shooting.known and best < LIKE_NOISE**2:
            break
        # The best found twice, from two sides: there is hardly a better one, unless a number has lost its effect there.
        if sum(misfit < best * (1 + TWICE) for misfit in found) > 1 and not shooting.without_effect(shooting.best[1]):
            break
        try:
            if turn == 0:
                found.append(shooting.refine(points[0]))
                if shooting.known and shooting.best[0] < LIKE_NOISE**2:
                    continue
            found.append(shooting.refine(shooting.reachable(points[turn])))
        except InputError:
            # Not a law there: the next one.
            continue
        finally:
            memory.write(shooting, turn + 1)
    progress("motions compared", starts, starts)
    if not math.isfinite(shooting.best[0]):
        raise InputError(
            "identify: no start gave a motion that could be compared with the records; keep the fit of the branches"
        )


def distance(motions: pd.DataFrame) -> float:
    """Of all records, in standard deviations of the displacement."""
    return math.sqrt(float(np.mean(motions["distance"] ** 2)))


def _starts(free: LawParameters, first: Identification, count: int, random: np.random.Generator) -> Array:
    """Starting points in the vector of the free numbers: the first is that of `first`, the others lie around it.

    They scatter as the first identification says, correlations included: where it knows but a line on which a point lies,
    points beside that line would lead nowhere.
    """
    origin = np.zeros(len(free.names))
    plain, unit = np.maximum(np.abs(free.values(origin)), 1e-12), free.units(origin)
    known = first.covariance.reindex(index=free.names, columns=free.names).to_numpy(dtype=float)
    known = np.nan_to_num(known) / np.outer(unit, unit)
    relative = SPREAD * plain / unit
    size, axes = np.linalg.eigh(0.5 * (known + known.T))
    points = np.zeros((count, len(free.names)))
    points[1:] = 2 * random.standard_normal((count - 1, size.size)) * np.sqrt(np.maximum(size, 0.0)) @ axes.T
    points[1:] += relative * random.standard_normal((count - 1, size.size))
    return np.clip(points, free.low, free.high)
