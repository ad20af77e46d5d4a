"""A simulated motion read by the rules of the record beside it."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import brentq

import stickslip as ss
from stickslip.identification import friction_of_orbit
from stickslip.identification.prediction.reading import read_motion
from stickslip.identification.records import read_records
from stickslip.measurement.regime import slow_share

STEP = 0.01


def moving(above_kinetic: float) -> ss.Oscillator:
    law = ss.laws.StaticKinetic(break_away=1.0 + above_kinetic, kinetic=1.0)
    return ss.Oscillator(damping=0.0, drive_velocity=1.0, law=law)


def record_of(above_kinetic: float, **attrs: float) -> xr.DataTree:
    tree = friction_of_orbit(ss.simulate(moving(above_kinetic), 120.0), np.arange(0, 120, STEP))
    tree.attrs |= {"noise": 1e-6, "slip_cutoff": 5.0} | attrs
    return tree


@pytest.fixture(scope="module")
def creeping():
    """What measuring says of a mass that creeps, here of one that does not."""
    return read_records(record_of(0.8, creeps=1))[0]


@pytest.mark.parametrize("above", [0.5, 0.8, 1.5])
def test_a_creeping_stick_lasts_from_half_the_drive_velocity_to_half_of_it(creeping, above):
    read = read_motion(creeping, ss.simulate(moving(above), 120.0), 0.3)
    # after the release w = V (1 - cos t) + (f_s - f_k) sin t, before the capture the same turned round
    half = brentq(lambda t: 1 - np.cos(t) + above * np.sin(t) - 0.5, 0, 1)
    assert read.kind == "stick_slip"
    # the rest lasts until the spring is wound up by twice f_s - f_k
    assert read.sticks["stick_time"].median() == pytest.approx(2 * above + 2 * half, abs=2.1 * STEP)
    # from where w passes half of V the spring, at f_k + (f_s - f_k) cos t + V sin t, falls to its least force
    fall = above * np.cos(half) + np.sin(half) + np.hypot(above, 1)
    assert read.sticks["drop"].median() == pytest.approx(fall, rel=0.01)
    assert read.trace["stuck"].mean() > 2 * above / (2 * above + 2 * np.pi)


def test_a_stick_too_short_to_linger_is_no_stick_slip(creeping):
    orbit = ss.simulate(moving(0.1), 120.0)
    assert orbit.regime() == "stick_slip"  # it sticks, for 0.2 of a period of 6.3
    assert read_motion(creeping, orbit, 0.3).kind == "almost_harmonic"


def test_a_motion_without_sticks_is_read_too(creeping):
    steady = ss.Oscillator(damping=0.5, drive_velocity=1.0, law=ss.laws.Coulomb(kinetic=1.0))
    read = read_motion(creeping, ss.simulate(steady, 120.0), 0.5)
    assert (read.kind, len(read.sticks)) == ("stable_slip", 0)


def test_where_a_mass_rests_while_it_sticks_the_exact_sticks_are_told():
    rigid = read_records(record_of(0.8, creeps=0))[0]
    read = read_motion(rigid, ss.simulate(moving(0.5), 120.0), 0.3)
    np.testing.assert_allclose(read.sticks["stick_time"], 1.0, rtol=1e-9)


def test_the_noise_is_not_averaged_over_more_than_a_stick():
    """Noise asks for 30 samples, sticks last 20 of each 50: averaged over 30 nothing would be slow."""
    w = np.tile(np.repeat([0.0, 2.0], [20, 30]), 40)
    step, noise = 1e-3, 0.05 * 0.03**1.5 / np.sqrt(12 * 1e-3)  # the slope's error over 30 samples is 0.05 V
    assert slow_share(w, 1.0, noise, step)[0] < 0.01  # the start of the record
    assert slow_share(w, 1.0, noise, step, [0.02])[0] == pytest.approx(
        16 / 50, abs=0.01
    )  # five samples: two lost at each end
