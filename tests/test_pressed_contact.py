"""Records of `direct_force` with a normal force, and what they are called."""

import numpy as np
import pytest

import stickslip as ss

T = np.arange(4000) / 500
COLUMNS = {"time": "t", "velocity": {"column": "w", "unit": "m/s"}, "force": {"column": "f", "unit": "N"}}


def pressed(normal: np.ndarray) -> dict[str, np.ndarray]:
    random = np.random.default_rng(5)
    speed = 0.3 + 0.05 * np.sin(2 * np.pi * T)
    return {"t": T, "w": speed, "f": 0.4 * np.maximum(normal, 0) + 0.02 * random.standard_normal(T.size), "n": normal}


def measured(record: dict[str, np.ndarray]):
    rig = {"instrument": "direct_force", "columns": COLUMNS | {"normal_force": {"column": "n", "unit": "N"}}}
    return ss.measure(record, rig)


def test_samples_without_a_normal_force_are_left_out_and_counted():
    found = measured(pressed(np.clip(20 * (T - 1), 0, 80)))
    said = " ".join(found.attrs["notes"])
    assert "of 4000 samples are left out: their normal force is zero" in said
    assert np.isfinite(found["force"]).all()
    assert abs(found.attrs["force"] - 0.4) < 3 * found.attrs["force_error"] + 1e-4
    assert not [note for note in measured(pressed(np.full(T.size, 30.0))).attrs["notes"] if "left out" in note]
    with pytest.raises(ss.InputError, match=r"normal force is above zero in 0 of 4000 samples.* correct its sign"):
        measured(pressed(np.full(T.size, -30.0)))


@pytest.mark.parametrize(
    ("mean", "swing", "regime"),
    [(0.0, 0.2, "reversing_slip"), (0.3, 0.2, "almost_harmonic"), (0.3, 0.01, "stable_slip"), (0.0, 1e-4, "at_rest")],
)
def test_slip_that_was_measured_itself_has_the_words_of_every_motion(mean, swing, regime):
    speed = mean + swing * np.sin(2 * np.pi * T)
    record = {
        "t": T,
        "w": speed,
        "f": 2 * np.tanh(speed / 1e-3) + 0.02 * np.random.default_rng(6).standard_normal(T.size),
    }
    found = ss.measure(record, {"instrument": "direct_force", "stuck_speed": 0.002, "columns": COLUMNS})
    assert found.attrs["regime"] == regime
