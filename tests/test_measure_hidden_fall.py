"""Break-aways into friction that falls faster than smoothing can follow: how wide what is stated must be."""

import functools

import numpy as np
import pytest

import stickslip as ss
from stickslip.laws import Combined, Coulomb, ExponentialStribeck, LogarithmicDwell, StaticKinetic
from stickslip.measurement import Rig, measure

MASS, STIFFNESS, DAMPING, STEP = 2.0, 5200.0, 4.0, 0.002
GROWING = LogarithmicDwell(9.0, 0.8, 0.2)
STEEP = Combined(GROWING, ExponentialStribeck(8.6, 7.2, 0.006, 25.0))
STEEPER = Combined(GROWING, ExponentialStribeck(8.6, 7.2, 0.002, 25.0))
LEVEL = [StaticKinetic(10.0, 7.5), Combined(GROWING, Coulomb(7.5))]


@functools.cache
def orbit(law, drive, length):
    oscillator = ss.Oscillator(DAMPING, drive, law, mass=MASS, stiffness=STIFFNESS)
    return ss.simulate(oscillator, 5 + length)


@functools.cache
def measured(law, drive, length, seed):
    """Friction of a simulated record of the spring's force, and how late and how high its break-aways were seen."""
    motion, time = orbit(law, drive, length), np.arange(5, 5 + length, STEP)
    force = STIFFNESS * motion.at(time)[0] + 0.02 * np.random.default_rng(seed).standard_normal(time.size)
    rig = Rig(
        instrument="spring_force", column="F", unit="N",
        stiffness=STIFFNESS, mass=MASS, damping=DAMPING, drive_velocity=drive,
    )  # fmt: skip
    friction = measure({"t": time - 5, "F": force}, rig)
    true = motion.events.query("kind == 'release' and t > 5")["t"].to_numpy()
    seen = friction["break_away"]["t"].to_numpy() + 5
    true = true[np.abs(true[:, None] - seen).argmin(axis=0)]
    held = STIFFNESS * motion.at(true)[0] + DAMPING * drive
    return friction, seen - true, friction["break_away"]["force"].to_numpy() - held


def low(friction, law):
    """Errors made and stated of friction at slip speeds of 1 to 4 mm/s."""
    w = friction["slip_velocity"].to_numpy()
    some = ~friction["stuck"].to_numpy() & (w > 1e-3) & (w < 4e-3)
    return friction["force"].to_numpy()[some] - law.kinetic_force(w[some]), friction["force_error"].to_numpy()[some]


@pytest.mark.parametrize(
    ("drive", "length"),
    [(2e-3, 10.0), *(pytest.param(*case, marks=pytest.mark.slow) for case in ((0.5e-3, 20.0), (8e-3, 5.0)))],
)
@pytest.mark.parametrize("law", [STEEP, pytest.param(STEEPER, marks=pytest.mark.slow)])
def test_a_fall_that_smoothing_hides_widens_what_is_stated(law, drive, length):
    friction, late, above = measured(law, drive, length, 0)
    assert late.mean() > 0.1 * STEP  # a release is seen late still
    assert abs(late.mean()) < 2 * friction.attrs["break_away_late"]
    errors = friction["break_away"]["force_error"].to_numpy()
    assert np.mean(np.abs(above) < 2 * errors) > 0.9
    off, stated = low(friction, law)
    assert np.sqrt(np.mean(off**2)) > 0.2
    assert np.mean(np.abs(off) < 2 * stated) > 0.7  # was 0.02 to 0.4 under the first law


@pytest.mark.long
@pytest.mark.parametrize(("drive", "length"), [(2e-3, 10.0), pytest.param(8e-3, 5.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize("law", [LEVEL[0], pytest.param(LEVEL[1], marks=pytest.mark.long)])
def test_where_friction_is_constant_in_motion_nothing_large_is_thought_hidden(law, drive, length):
    friction, late, above = measured(law, drive, length, 0)
    assert friction.attrs["break_away_late"] < 0.1 * STEP
    assert abs(late.mean()) < 2 * np.hypot(friction.attrs["break_away_late"], late.std() / np.sqrt(late.size))
    assert np.mean(np.abs(above) < 2 * friction["break_away"]["force_error"].to_numpy()) > 0.9
    off, stated = low(friction, law)
    assert np.median(stated) < 0.1
    assert np.mean(np.abs(off) < 2 * stated) > 0.75


@pytest.mark.slow
def test_intervals_hold_the_truth_over_many_noises():
    # 54 of 440 held under the steep fall before hidden falls were thought of; a fall over 2 mm/s is over within a sample
    for law, least in ((STEEP, 0.93), (STEEPER, 0.8), (LEVEL[0], 0.93)):
        held = []
        for seed in range(20):
            friction, _, above = measured(law, 2e-3, 10.0, seed)
            held += list(np.abs(above) < 1.96 * friction["break_away"]["force_error"].to_numpy())
        assert np.mean(held) > least


@pytest.mark.long
def test_where_friction_is_constant_in_motion_releases_are_those_of_the_slips():
    law, drive, rng = StaticKinetic(1.2, 0.8), 0.1, np.random.default_rng(0)
    oscillator = ss.Oscillator(0.05, drive, law)
    motion = ss.simulate(oscillator, 500.0)
    time = np.arange(20.0, 400.0, 0.08)
    record = {"t": time - 20, "x": motion.at(time)[0] + 0.003 * rng.standard_normal(time.size)}
    table = measure(record, Rig.of(oscillator))["break_away"]
    true = motion.events.query("kind == 'release'")["t"].to_numpy() - 20
    late = table["t"].to_numpy() - true[np.abs(true[:, None] - table["t"].to_numpy()).argmin(axis=0)]
    assert late.size > 10
    assert late.std() < 0.05 * 0.08  # the ends of the sticks scatter by a tenth of a sample
    assert 0.6 < np.sqrt(np.mean((late / table["t_error"].to_numpy()) ** 2)) < 1.6
    off = table["force"].to_numpy() - 1.2
    assert 0.5 < np.sqrt(np.mean((off / table["force_error"].to_numpy()) ** 2)) < 1.5
