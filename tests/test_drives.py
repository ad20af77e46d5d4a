"""Drives of every kind against closed forms: a stuck mass rides them, and leaves them when the force it takes is too much."""

import numpy as np
import pytest

import stickslip as ss

GLUE = ss.laws.Coulomb(100.0)


def ridden(drive, t_end=12.0):
    orbit = ss.simulate(ss.Oscillator(0.1, drive, GLUE), t_end)
    t = np.linspace(0, t_end, 241)
    assert len(orbit.events) == 0
    assert orbit.at(t)[1] == pytest.approx(drive.at(t) if isinstance(drive, ss.Drive) else drive, abs=1e-13)
    return t, orbit.at(t)[0]


def test_a_stuck_mass_rides_a_constant_drive():
    t, x = ridden(0.3)
    assert x == pytest.approx(0.3 * t, abs=1e-14)


def test_a_stuck_mass_rides_several_harmonics():
    waves = (ss.Harmonic(0.2, 1.3, 0.4), ss.Harmonic(0.1, 3.7, -1.0))
    t, x = ridden(ss.Drive(0.3, waves))
    swings = sum(w.amplitude / w.frequency * (np.sin(w.frequency * t + w.phase) - np.sin(w.phase)) for w in waves)
    assert x == pytest.approx(0.3 * t + swings, abs=1e-13)


def test_a_stuck_mass_rides_a_ramp_and_stays_at_its_end():
    t, x = ridden(ss.Drive.ramp(0.1, 0.5, duration=8.0))
    slow = np.minimum(t, 8.0)
    assert x == pytest.approx(0.1 * slow + 0.025 * slow**2 + 0.5 * (t - slow), abs=1e-13)


def test_a_stuck_mass_rides_a_table():
    nodes_t, nodes_s = np.array([0.0, 2.0, 3.0, 7.0]), np.array([0.2, 0.4, -0.3, 0.1])
    t, x = ridden(ss.Drive.table(nodes_t, nodes_s))
    # The trapezoidal rule is exact between nodes, all of which are among the samples; beyond the last the drive is constant.
    s = np.interp(t, nodes_t, nodes_s)
    assert x == pytest.approx(np.concatenate([[0], np.cumsum(0.5 * (s[1:] + s[:-1]) * np.diff(t))]), abs=1e-13)


def test_release_from_a_ramp():
    # s = r t from rest: F = k x + m r with x = r t²/2.
    oscillator = ss.Oscillator(0.0, ss.Drive.ramp(0.0, 2.0, duration=20.0), ss.laws.Coulomb(0.5))
    release = ss.simulate(oscillator, 10.0).events.iloc[0]
    assert release["t"] == pytest.approx(np.sqrt(2 * (0.5 / 0.1 - 1)), rel=1e-14)
    assert release["force_rate"] == pytest.approx(0.1 * release["t"], rel=1e-13)


def test_release_from_a_shaken_drive():
    # Eq. (8) with S₁ = 0: s = Ω U₀ cos Ωτ, x = U₀ sin Ωτ, F = (k − m Ω²) U₀ sin Ωτ.
    oscillator = ss.Oscillator(0.0, ss.Drive.shaken(0.0, 1.5, 0.6), ss.laws.Coulomb(0.5))
    release = ss.simulate(oscillator, 10.0).events.iloc[0]
    assert release["t"] == pytest.approx(np.arcsin(0.5 / (1.5 * (1 - 0.36))) / 0.6, rel=1e-14)


def test_slip_under_a_constant_force_does_not_feel_how_the_drive_varies():
    # x″ + x = f while w > 0: a circle about f, whatever the drive does above it.
    oscillator = ss.Oscillator(0.0, ss.Drive(3.0, ss.Harmonic(0.5, 2.2)), ss.laws.Coulomb(0.4))
    orbit = ss.simulate(oscillator, 30.0, x0=1.0, v0=0.0)
    t = np.linspace(0, 30, 301)
    assert orbit.at(t)[0] == pytest.approx(0.4 + 0.6 * np.cos(t), abs=1e-12)


@pytest.mark.parametrize("detuning", [0, 1e-12, -1e-12, 1e-9, -1e-9, 1e-6, -1e-6, 9e-4, -9e-4, 1.2e-3])
def test_forcing_at_an_undamped_resonance_grows_with_time(detuning):
    # Slip that never ends under constant friction: x'' + x = f_k + A cos Ωt, of which A t sin(t)/2 is the limit Ω -> 1.
    amplitude, kinetic, frequency = 0.3, 0.5, 1 + detuning
    oscillator = ss.Oscillator(0, 20.0, ss.laws.Coulomb(kinetic), forcing=ss.Harmonic(amplitude, frequency))
    orbit = ss.simulate(oscillator, 100, x0=0.2, v0=0.0)
    assert len(orbit.events) == 0
    t = np.linspace(0, 100, 1001)
    half = 0.5 * (frequency - 1) * t
    beat = amplitude * t * np.sinc(half / np.pi) * np.sin(0.5 * (frequency + 1) * t) / (frequency + 1)
    assert orbit.at(t)[0] == pytest.approx(kinetic + (0.2 - kinetic) * np.cos(t) + beat, abs=2e-12)


def test_a_batch_passes_through_the_resonance():
    frequency = np.array([0.999, 1 - 1e-7, 1.0, 1 + 1e-7, 1.001])
    oscillator = ss.Oscillator(0, 0.3, ss.laws.StaticKinetic(1.0, 0.6), forcing=ss.Harmonic(0.2, 0.9))
    rows = ss.simulate_many(oscillator, {"forcing.0.frequency": frequency}, 30)
    for index, value in enumerate(frequency):
        alone = ss.simulate(ss.Oscillator(0, 0.3, oscillator.law, forcing=ss.Harmonic(0.2, value)), 30)
        x, _ = alone.at(30.0)
        assert float(rows["x"][index]) == pytest.approx(float(x), abs=1e-12)


def test_a_law_of_branches_is_asked_for_its_slopes_at_a_resonance():
    for law in ss.laws.Law.ALL.values():
        oscillator = ss.Oscillator(0.25, 0.2, law.example(), forcing=ss.Harmonic(0.1, 1.0))
        # The slopes of BogaczRyczek come from the motion: any may cancel the damping.
        assert oscillator.closed_form == (not law.SMOOTH and law is not ss.laws.BogaczRyczek)
    falling = ss.laws.PiecewiseLinear([(0, 1), (0.2, 0.8), (0.4, 0.75)], 1.0)
    forced = ss.Harmonic(0.1, 1.0)
    assert not ss.Oscillator(0.25, 0.2, falling, forcing=forced).closed_form
    assert ss.Oscillator(0.24, 0.2, falling, forcing=forced).closed_form
