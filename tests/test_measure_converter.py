"""What lies between the instrument and the file: a filter, the steps of a converter, a zero that jumps."""

import numpy as np
import pytest

import stickslip as ss
from stickslip.identification import identify
from stickslip.measurement import Rig, measure
from stickslip.measurement.disturbances.zero_jump import zero_jumps

LIMIT, KINETIC, RATE, NOISE, COUNT = 3.95, 3.0, 800, 3e-6, 1600
BELT = ss.Oscillator(2.2, 0.012, ss.laws.StaticKinetic(LIMIT, KINETIC), mass=0.85, stiffness=1900.0)
RIG = Rig(
    instrument="displacement", column="x", unit="m", stiffness=1900.0, mass=0.85, damping=2.2, drive_velocity=0.012
)  # fmt: skip


@pytest.fixture(scope="module")
def orbit():
    return ss.simulate(BELT, t_end=8.0)


def seen(orbit, through=lambda x: x):
    """The record of two seconds, at ten times the rate `through` what lies before the converter."""
    fine = orbit.at(np.arange(3 * RATE * 10, 5 * RATE * 10) / (10 * RATE))[0]
    x = through(fine)[-10 * COUNT :: 10]
    return x + NOISE * np.random.default_rng(1).standard_normal(COUNT)


def measured(x):
    return measure({"t": np.arange(len(x)) / RATE, "x": x}, RIG)


def low_pass(frequency):
    def through(x):
        out, share = np.empty_like(x), 1 - np.exp(-2 * np.pi * frequency / (10 * RATE))
        level = x[0]
        for i, one in enumerate(x):
            level += share * (one - level)
            out[i] = level
        return out

    return through


def held(friction):
    found = identify(friction, law="StaticKinetic").parameters
    return [
        found.loc[name, "low"] < at < found.loc[name, "high"]
        for name, at in (("break_away", LIMIT), ("kinetic", KINETIC))
    ]


def said(friction, words):
    return [note for note in friction.attrs["notes"] if words in note]


@pytest.mark.long
def test_a_record_as_it_is_has_no_such_note(orbit):
    friction = measured(seen(orbit))
    assert not friction.attrs["notes"]
    assert friction.attrs["force_common"] == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("frequency", [40, 15])
def test_a_low_pass_before_the_converter_is_said_and_held_by_the_errors(orbit, frequency):
    friction = measured(seen(orbit, low_pass(frequency)))
    (note,) = said(friction, "low-pass")
    assert float(note.split("low-pass of some ")[1].split()[0]) == pytest.approx(frequency, rel=0.3)
    assert held(friction)[0]


@pytest.mark.parametrize("seed", [1, 2])
def test_a_low_pass_that_only_the_noise_shows_is_held_and_makes_no_law(orbit, seed):
    rng = np.random.default_rng(seed)
    x = seen(orbit, lambda fine: low_pass(40)(fine + 1e-4 * rng.standard_normal(fine.size)))
    friction = measured(x)
    (note,) = said(friction, "the noise is alike over")
    assert float(note.split("low-pass of some ")[1].split()[0]) == pytest.approx(45, rel=0.6)
    law = identify(friction)
    assert type(law.law).__name__ == "StaticKinetic"  # what the filter makes of the jumps is no curve of friction
    assert law.parameters.loc["break_away", "low"] < LIMIT < law.parameters.loc["break_away", "high"]
    assert law.parameters.loc["kinetic", "value"] == pytest.approx(KINETIC, rel=0.002)


@pytest.mark.slow
@pytest.mark.parametrize("steps", [20, 50])
def test_steps_coarser_than_the_noise_are_said_and_in_what_all_forces_share(orbit, steps):
    x = seen(orbit)
    step = float(np.ptp(x)) / steps
    friction = measured(step * np.round(x / step))
    (note,) = said(friction, "come in steps of")
    assert float(note.split("steps of ")[1].split()[0]) == pytest.approx(step, rel=0.01)
    assert held(friction) == [True, True]


@pytest.mark.slow
def test_steps_that_noise_evens_out_are_no_fault(orbit):
    x = seen(orbit)
    friction = measured(NOISE * np.round(x / NOISE))
    assert not friction.attrs["notes"]
    assert held(friction) == [True, True]


@pytest.mark.long
@pytest.mark.parametrize(
    ("at", "share"), [(500, 0.1), *(pytest.param(*one, marks=pytest.mark.slow) for one in ((1000, 0.1), (500, -0.4)))]
)
def test_a_jump_of_the_zero_is_said_with_its_size_and_held_by_the_errors(orbit, share, at):
    x = seen(orbit)
    size = share * float(np.ptp(x))
    x[at:] += size
    friction = measured(x)
    (note,) = said(friction, "jumps between two samples")
    assert float(note.split(" by ")[1].split()[0]) == pytest.approx(1900.0 * size, rel=0.1)
    assert len(friction["time"]) == max(at, COUNT - at)
    assert friction.attrs["force_common"] == pytest.approx(1900.0 * abs(size) / np.sqrt(2), rel=0.1)
    assert held(friction) == [True, True]


def test_impulses_and_events_are_no_jumps(orbit):
    x = seen(orbit)
    assert not zero_jumps(x, np.ones(COUNT), NOISE, 0.06)
    x[700:702] += 3e-4
    assert not zero_jumps(x, np.ones(COUNT), NOISE, 0.06)
    x[1000:] -= 3e-4
    (jump,) = zero_jumps(x, (np.arange(COUNT) // 2 != 350).astype(float), NOISE, 0.06)
    assert jump.index == 1000
    assert jump.size == pytest.approx(-3e-4, rel=0.1)
