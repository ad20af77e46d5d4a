"""How far records lie from one law, beyond what the scatter within each lets expect.

Runs of one rig may differ for a reason that no law knows: another place on the track, another day, wear. Then a run counts as
one observation however long it is, and what sets the runs apart belongs into the intervals.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import brentq
from scipy.special import chdtri

from stickslip.files.arrays import Array

BY_CHANCE = 0.01
"""Records whose means would lie so far apart by chance with no more than this probability differ."""


def record_scatter(means: Sequence[float], variances: Sequence[float]) -> float:
    """Standard deviation s from record to record of residuals that one law leaves.

    It makes the squared distances of the means from their weighted mean, Σ (m − m̄)² / (v + s²), as large as their number of
    degrees of freedom.

    Parameters
    ----------
    means : of the residuals of each record, shape (n,).
    variances : of these means, from the scatter within each record, shape (n,).

    Returns
    -------
    s ≥ 0 in the unit of the means; 0 where the records differ by no more than chance would make them.

    Source: Paule & Mandel, J. Res. Natl. Bur. Stand. 87 (1982) 377.

    >>> round(record_scatter([-1.0, 1.0], [1e-6, 1e-6]), 2), record_scatter([-1.0, 1.0], [1.0, 1.0])
    (1.41, 0.0)
    """
    m, v = np.asarray(means, float), np.maximum(np.asarray(variances, float), 1e-300)
    if m.size < 2 or _distance(0.0, m, v) < chdtri(m.size - 1, BY_CHANCE):
        return 0.0
    highest = float(np.ptp(m)) * np.sqrt(m.size)
    return float(brentq(lambda s: _distance(s, m, v) - (m.size - 1), 0.0, highest, xtol=1e-6 * highest))


def _distance(s: float, means: Array, variances: Array) -> float:
    weight = 1 / (variances + s**2)
    return float(np.sum(weight * (means - np.average(means, weights=weight)) ** 2))
