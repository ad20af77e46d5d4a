"""Noise that is alike from sample to sample is noise, and no creep; a stiffness that the slips contradict is named."""

import functools
import math

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.signal import lfilter

from stickslip.identification import identify
from stickslip.measurement import Rig, measure

STIFFNESS, MASS, DAMPING, DRIVE, LIMIT, KINETIC, RATE = 1000.0, 1.0, 2.0, 0.02, 6.0, 3.0, 1000.0


@functools.cache
def motion(seconds=6.0):
    """Time and extension of sticks and slips in closed form."""
    time = np.arange(0, seconds, 1 / RATE)
    x = np.empty(len(time))
    decay = DAMPING / (2 * MASS)
    rate = math.sqrt(STIFFNESS / MASS - decay**2)
    top, rest = (LIMIT - DAMPING * DRIVE) / STIFFNESS, KINETIC / STIFFNESS
    cosine = top - rest
    sine = (DRIVE + decay * cosine) / rate

    def swing(t):
        return rest + np.exp(-decay * t) * (cosine * np.cos(rate * t) + sine * np.sin(rate * t))

    def speed(t):
        c, s = np.cos(rate * t), np.sin(rate * t)
        return np.exp(-decay * t) * ((rate * sine - decay * cosine) * c - (rate * cosine + decay * sine) * s)

    lasting = brentq(lambda t: speed(t) - DRIVE, math.pi / rate, 1.5 * math.pi / rate)
    bottom = float(swing(lasting))
    cycle = (top - bottom) / DRIVE + lasting
    phase = np.mod(time, cycle)
    x = np.where(phase < cycle - lasting, bottom + DRIVE * phase, swing(phase - cycle + lasting))
    return time, x


def measured(correlation, deviation, seed, stiffness=STIFFNESS):
    time, x = motion()
    steps = np.random.default_rng(seed).standard_normal(len(time) + 500) * math.sqrt(1 - correlation**2)
    noise = deviation * lfilter([1.0], [1.0, -correlation], steps)[500:]
    rig = Rig(
        instrument="displacement", column="x", unit="m", stiffness=stiffness, mass=MASS, damping=DAMPING,
        drive_velocity=DRIVE,
    )  # fmt: skip
    return measure({"t": time, "x": x + noise}, rig)


def named(friction, words):
    return [note for note in friction.attrs["notes"] if words in note]


@pytest.mark.parametrize(
    ("correlation", "deviation", "seed"),
    [
        (0.5, 2e-5, 0),
        pytest.param(0.9, 5e-6, 1, marks=pytest.mark.slow),
        *(pytest.param(0.9, 2e-5, seed, marks=pytest.mark.slow) for seed in range(2, 20)),
    ],
)
def test_coloured_noise_is_no_creep_and_its_errors_hold(correlation, deviation, seed):
    friction = measured(correlation, deviation, seed)
    assert friction.attrs["creeps"] == 0
    assert named(friction, "the noise is coloured")
    assert not named(friction, "ripple of the drive")
    table = friction["break_away"]
    off = table["force"].values - LIMIT
    assert len(off) >= 13
    assert math.sqrt(np.mean((off / table["force_error"].values) ** 2)) < 1.8
    assert abs(off.mean()) < 3 * float(table["force_error"].mean()) / math.sqrt(len(off))


@pytest.mark.long
def test_of_white_noise_no_colour_is_said():
    friction = measured(0.0, 2e-5, 0)
    assert not friction.attrs["notes"]


@pytest.mark.slow
@pytest.mark.parametrize("part", [0.97, 1.03, 1.1])
def test_a_stiffness_that_the_slips_contradict_is_named(part):
    notes = named(measured(0.0, 5e-6, 0, part * STIFFNESS), "the slips swing at")
    assert bool(notes) == (abs(part - 1) > 0.04)
    if notes:
        swing, error = notes[0].split(" swing at ")[1].split(" times")[0].split(" +- ")
        assert float(swing) == pytest.approx(1 / math.sqrt(part), abs=max(4 * float(error), 0.005))


@pytest.mark.slow
def test_break_away_and_kinetic_force_of_a_coloured_record_hold_the_truth():
    found = identify(measured(0.9, 5e-6, 0), law="StaticKinetic").parameters
    for name, true in (("break_away", LIMIT), ("kinetic", KINETIC)):
        assert found.loc[name, "low"] < true < found.loc[name, "high"]
