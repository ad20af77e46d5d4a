"""Whether two steady motions are on the same attractor."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: What an attractor is described by.
_EXACT = ("regime", "period", "loops")
_NUMBERS = ("x_min", "x_max", "w_min", "w_max", "x_mean", "v_mean")
#: All that says on which attractor a motion is.
ATTRACTOR = (*_EXACT, *_NUMBERS)


def on_one_attractor(one: Mapping[str, Any], other: Mapping[str, Any], same: float, wide: float) -> NDArray[np.bool_]:
    """Which motions are on the same attractor, as :func:`stickslip.basins` says; their rows in columns that broadcast.

    >>> swing = {"regime": np.array("stick_slip"), "period": 2, "x_mean": 0.5, "v_mean": 0.0}
    >>> swing |= {"x_min": 0.0, "x_max": 1.0, "w_min": 0.0, "w_max": 1.0}
    >>> [bool(on_one_attractor(swing, swing | more, 0.01, 1.0)) for more in ({"period": 4}, {"x_mean": 0.6}, {"x_min": 0.1})]
    [True, False, False]
    """
    regime = np.asarray(other["regime"])
    rests = np.isin(regime, ("at_rest", "stable_slip"))
    one_repeats, other_repeats = np.asarray(one["period"]) > 0, np.asarray(other["period"]) > 0
    near = {}
    for name in _NUMBERS:
        kind = "x" if name.startswith("x") else "w"
        extent = np.where(rests, wide, other[f"{kind}_max"] - other[f"{kind}_min"])
        near[name] = np.abs(one[name] - other[name]) <= same * extent
    bounds = near["x_min"] & near["x_max"] & near["w_min"] & near["w_max"]
    # A mean over returns that do not repeat depends on which of them are looked at.
    means = near["x_mean"] & near["v_mean"] | ~(one_repeats & other_repeats)
    shared = np.minimum(one["x_max"], other["x_max"]) - np.maximum(one["x_min"], other["x_min"])
    union = np.maximum(one["x_max"], other["x_max"]) - np.minimum(one["x_min"], other["x_min"])
    scattered = ~(one_repeats | other_repeats) & (shared > 0.5 * union)
    return np.asarray((one["regime"] == regime) & ((regime == "at_rest") | bounds & means | scattered))
