"""Positions whose error is smooth along the way, as over a textured ground: break-aways are seen late, and said to be."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

import stickslip as ss

SLIDER = ss.Oscillator(0.5, 0.03, ss.laws.StaticKinetic(1.6, 1.0), mass=1.0, stiffness=40.0)
RIG = {
    "instrument": "displacement", "column": "x", "unit": "m",
    "mass": 1.0, "stiffness": 40.0, "damping": 0.5, "drive_velocity": 0.03,
}  # fmt: skip


def record(rate: float, size: float, seed: int) -> dict[str, np.ndarray]:
    """Twenty seconds of the slider with an error of the position of this size in m, alike nearby."""
    rng = np.random.default_rng(seed)
    along = gaussian_filter1d(rng.standard_normal(4000), 20)
    time = np.arange(0.0, 20.0, 1 / rate)
    x = ss.simulate(SLIDER, 30.0).at(time + 5.0)[0]
    error = size * np.interp(4000 * (x - x.min()), 0.1 * np.arange(4000), along / along.std())
    return {"t": time, "x": x + error + 1e-6 * rng.standard_normal(len(time))}


@pytest.mark.parametrize(
    ("rate", "size", "seed"),
    [
        (60.0, 4e-6, 100),
        (90.0, 4e-6, 102),
        (120.0, 8e-6, 103),
        *(pytest.param(rate, 8e-6, seed, marks=pytest.mark.slow) for rate in (60.0, 90.0) for seed in range(101, 105)),
    ],
)
def test_break_aways_seen_late_have_an_error_that_holds_it(rate, size, seed):
    friction = ss.measure(record(rate, size, seed), RIG)
    row = ss.identify(friction, law="StaticKinetic").parameters.loc["break_away"]
    assert row["low"] < 1.6 < row["high"], row
    assert row["high"] - row["low"] < 0.1
    if any("creeps by more than the noise" in note for note in friction.attrs["notes"]):
        # (f_s - f_k)/m takes the slip velocity to half of the drive's within 25 ms
        assert 0.3 * 0.025 < friction.attrs["break_away_late"] < 0.025
