"""What a record may correct of its rig, and what it may not; kind, slips and stuck share agree with each other."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from stickslip.errors import InputError
from stickslip.measurement import facts, measure
from stickslip.measurement.regime import LINGERS, regime

MASS, RATE = 0.0307, 2000.0
"""Of the slider of paper on paper (Colas et al., Phys. Rev. E 2019), in kg, and samples per second."""
WEIGHT = MASS * 9.81


def rig(stiffness: float, drive_velocity: float, **more: object) -> dict[str, object]:
    return {
        "instrument": "spring_force",
        "column": "F",
        "unit": "mg",
        "time_column": "t",
        "sampling_rate": RATE,
        "stiffness": stiffness,
        "mass": MASS,
        "drive_velocity": drive_velocity,
        "mains_frequency": 50.0,
    } | more


def record(
    extension: np.ndarray, time: np.ndarray, stiffness: float, rng: np.random.Generator
) -> dict[str, np.ndarray]:
    """What that instrument makes of an extension: 1.3 um of noise, mains of 0.6 um, friction that drifts by 0.01 weights."""
    drift = gaussian_filter1d(rng.standard_normal(time.size), RATE, mode="wrap")
    seen = extension + 1.3e-6 * rng.standard_normal(time.size) + 0.6e-6 * np.sin(2 * np.pi * 50 * time)
    return {"t": time, "F": stiffness * seen / WEIGHT + 0.3 + 0.01 * drift / drift.std()}


def swinging(
    stiffness: float, drive_velocity: float, part: float, seconds: float, seed: int = 0
) -> dict[str, np.ndarray]:
    """A mass that never sticks: its velocity is `part` of V on average, and drifts by a fifth, at 1.25 sqrt(k/m)/2pi."""
    rng = np.random.default_rng(seed)
    time = np.arange(0, seconds, 1 / RATE)
    frequency = 1.25 * np.sqrt(stiffness / MASS) / (2 * np.pi)
    drift = gaussian_filter1d(rng.standard_normal((2, time.size)), 3 * RATE / frequency, mode="wrap", axis=1)
    drift /= drift.std(axis=1, keepdims=True)
    amplitude = part * drive_velocity / (2 * np.pi * frequency) * (1 + 0.2 * drift[0])
    swing = amplitude * np.sin(2 * np.pi * frequency * time + 0.5 * drift[1])
    return record(swing, time, stiffness, rng)


def sticking(
    stiffness: float, drive_velocity: float, true: float, seed: int = 0, cycle: float = 0.15, seconds: float = 3.0
) -> dict[str, np.ndarray]:
    """Sticks on a spring of `true` times that stiffness, for nine tenths of each cycle, and slips of half a sine."""
    rng = np.random.default_rng(seed)
    time = np.arange(0, seconds, 1 / RATE)
    phase = np.mod(time, cycle) / cycle
    rise = true * drive_velocity * cycle * 0.9
    slip = rise * (0.5 + 0.5 * np.cos(np.pi * (phase - 0.9) / 0.1))
    return record(np.where(phase < 0.9, true * drive_velocity * cycle * phase, slip), time, stiffness, rng)


# Stiffness and speed of runs of that slider; the part is that of V at which the slopes of such a swing crowd.
@pytest.mark.parametrize(
    ("stiffness", "drive_velocity", "part", "seconds"),
    [
        pytest.param(2254.0, 1100e-6, 0.53, 2, marks=pytest.mark.long),
        (2254.0, 4300e-6, 0.64, 2),
        pytest.param(1002.0, 1100e-6, 0.864, 2, marks=pytest.mark.slow),
        pytest.param(1002.0, 4300e-6, 0.95, 2, marks=pytest.mark.long),
    ],
)
def test_a_mass_that_never_sticks_has_no_slips_and_keeps_its_stiffness(stiffness, drive_velocity, part, seconds):
    tree = measure(swinging(stiffness, drive_velocity, part, seconds), rig(stiffness, drive_velocity))
    found = tree.attrs
    assert found["stiffness"] == stiffness
    assert (found["regime"], found["slips"], found["stuck_share"]) == ("almost_harmonic", 0, 0.0)
    assert not tree["stuck"].any()
    assert tree["break_away"].sizes["event"] == 0
    assert not any("stick" in note for note in found["notes"])


@pytest.mark.parametrize("seconds", [2, pytest.param(8, marks=pytest.mark.slow)])
def test_of_a_motion_lost_in_its_noise_the_kind_is_unknown_and_no_slips_are_told(seconds):
    """At 42 um/s the swing of 0.1 um is a tenth of the noise."""
    tree = measure(swinging(2254.0, 42e-6, 0.6, seconds), rig(2254.0, 42e-6))
    told = facts(tree)
    assert told["regime"] == "unknown"
    assert not {"slips", "stuck_share"} & set(told)
    assert told["stiffness"] == 2254
    assert not tree["stuck"].any()
    assert tree["break_away"].sizes["event"] == 0
    assert any("cannot be determined: the slip velocity is known to" in note for note in tree.attrs["notes"])


@pytest.mark.slow
@pytest.mark.parametrize("true", [0.9, 1.12])
def test_sticks_correct_the_stiffness_by_a_fifth_at_most(true):
    tree = measure(sticking(168.0, 1100e-6, true), rig(168.0, 1100e-6))
    assert tree.attrs["regime"] == "stick_slip"
    assert tree.attrs["stiffness"] / 168 == pytest.approx(true, abs=0.03)
    assert any("stiffness re-calibrated from 168" in note for note in tree.attrs["notes"])


def test_sticks_that_ask_for_another_spring_are_not_believed():
    tree = measure(sticking(168.0, 1100e-6, 0.7), rig(168.0, 1100e-6))
    assert tree.attrs["stiffness"] == 168
    (note,) = (note for note in tree.attrs["notes"] if "of the rig was kept" in note)
    assert "over 20 %" in note
    assert "correct stiffness, drive_velocity or unit" in note


@pytest.mark.slow
def test_the_rig_can_forbid_it():
    asked = rig(168.0, 1100e-6, recalibrate=False)
    tree = measure(sticking(168.0, 1100e-6, 1.12), asked)
    assert (tree.attrs["stiffness"], tree.attrs["regime"]) == (168, "stick_slip")
    assert any("of the rig was kept, as the rig asks (recalibrate)" in note for note in tree.attrs["notes"])
    with pytest.raises(InputError, match="rig: recalibrate must be true or false, got 'no'"):
        measure(sticking(168.0, 1100e-6, 1.12), asked | {"recalibrate": "no"})


def test_slow_for_about_as_long_as_divides_the_kinds_is_unknown():
    w = np.tile([0.0, 2.0], 50)
    found = [
        regime(w, 1.0, slow, 0.02, 0.1, resting=False, sticks=40, cycles=50) for slow in (0.2, LINGERS + 0.01, 0.3)
    ]
    assert found == [("almost_harmonic", ""), ("unknown", "limit"), ("stick_slip", "")]
