"""The core's surface of static friction for numbers that need not make a law, as fits of its parts ask for."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stickslip import _core


def static_surface(
    stick_time: ArrayLike,
    force_rate: ArrayLike,
    growth: tuple[float, float, float] = (0.0, 1.0, 1.0),
    force_rate_scale: float | None = None,
    fall: tuple[float, float, float] = (0.0, 1.0, 1.0),
) -> NDArray[np.float64]:
    """Δ∞ (1 − exp(−γ t_s^m))/(1 + δ/δ₀) + Δ₀/(1 + (δ/δ₁)^p) over stick time t_s and force rate δ, shape (n,).

    Parameters
    ----------
    stick_time, force_rate : shape (n,), or one number for all.
    growth : Δ∞, γ, m.
    force_rate_scale : δ₀; None: the growth does not depend on the force rate.
    fall : Δ₀, δ₁, p.

    >>> static_surface([0.0, 1e9], 0.3, growth=(0.5, 0.4, 1.0), force_rate_scale=0.3).tolist()
    [0.0, 0.25]
    """
    time, rate = np.broadcast_arrays(np.asarray(stick_time, float), np.asarray(force_rate, float))
    return _core.static_friction(growth, force_rate_scale, fall, np.ascontiguousarray(time), np.ascontiguousarray(rate))
