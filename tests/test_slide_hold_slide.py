"""Slide-hold-slide: the peaks of friction after rests of the drive are its break-aways, and their growth is found."""

import numpy as np
import pytest

import stickslip as ss
from stickslip.measurement import measure

RIG = {
    "instrument": "velocity_steps",
    "columns": {"time": "t", "displacement": "x", "force": {"column": "mu", "unit": "1"}},
}
RESTS = np.array([3.0, 10.0, 30.0, 100.0, 300.0, 1000.0])
V, STEP, SLIDE, LEVEL, GROWTH = 5e-6, 0.1, 60.0, 0.67, 0.01


def record(rests: np.ndarray, *, sharp: bool = False) -> dict[str, np.ndarray]:
    """A drive that slides, rests, and slides on: after a rest friction rises within 2 s, and decays over some 20 um."""
    since = np.arange(0, SLIDE, STEP)
    x, mu = [V * since], [np.full(len(since), LEVEL)]
    for rest in rests.tolist():
        still = np.arange(0, rest, STEP)
        x += [np.full(len(still), x[-1][-1]), x[-1][-1] + V * (since + STEP)]
        low, top = LEVEL - 0.01 * np.log1p(rest), LEVEL + GROWTH * np.log1p(rest)
        if sharp:
            fall = LEVEL + (top - LEVEL) * np.exp(-(since - 2) / 4)
            after = np.where(since < 2, low + (top - low) * since / 2, fall)
        else:
            after = LEVEL + (low - LEVEL) * np.exp(-4 * since**2) + (top - LEVEL) * since / 2 * np.exp(1 - since / 2)
        mu += [LEVEL - 0.01 * np.log1p(still), after]
    friction = np.concatenate(mu)
    friction += 3e-4 * np.random.default_rng(1).standard_normal(len(friction))
    return {"t": np.arange(len(friction)) * STEP, "x": np.concatenate(x), "mu": friction}


def test_the_growth_of_friction_over_rests_is_found() -> None:
    tree = measure(record(RESTS), RIG)
    assert tree.attrs["steps"] == 0
    table = tree["break_away"].to_dataset()
    np.testing.assert_allclose(table["stick_time"], RESTS, atol=2 * STEP)
    for one in (table, measure(record(RESTS, sharp=True), RIG)["break_away"]):
        away = one["force"] - (LEVEL + GROWTH * np.log1p(RESTS))
        assert (np.abs(away) < 3 * one["force_error"]).all()
    assert np.isnan(table["force_rate"]).all()
    note = "6 rests of the drive (3 to 1000 s) between stretches of one speed were found, with 6 peaks of friction"
    assert note in " ".join(tree.attrs["notes"])
    found = ss.identify(tree)
    assert type(found.law) is ss.laws.LogarithmicDwell
    low, high = found.parameters.loc["growth", ["low", "high"]]
    assert low < GROWTH < high
    assert found.law.kinetic == pytest.approx(LEVEL, abs=2e-3)


def test_too_few_peaks_are_named_and_make_no_table() -> None:
    tree = measure(record(RESTS[-2:]), RIG)
    assert tree["break_away"].sizes["event"] == 0
    assert "with 2 peaks of friction after them; 3 peaks make a table" in " ".join(tree.attrs["notes"])


def test_a_drive_that_does_not_rest_is_told_nothing_of_rests() -> None:
    assert "rests" not in " ".join(measure(record(RESTS[:0]), RIG).attrs["notes"])


def test_a_drive_that_slows_down_and_starts_over_a_second_rests_too() -> None:
    data = record(RESTS[1:])
    speed = np.gradient(data["x"], STEP)
    ramp = np.ones(10) / 10  # of one second
    data["x"] = np.cumsum(np.convolve(speed, ramp, mode="same")) * STEP
    tree = measure(data, RIG)
    assert "5 rests of the drive" in " ".join(tree.attrs["notes"])
    np.testing.assert_allclose(tree["break_away"]["stick_time"], RESTS[1:], atol=1.2)
