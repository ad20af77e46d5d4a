"""Laws against limits, closed forms and cases of the literature, through the face of the package."""

import numpy as np
import pytest

import stickslip as ss


def test_s20_branches_by_the_sign_of_the_slip_acceleration():
    # S20 of the validation cases: x″ + x = h sgn(ẇ), set-valued, h = 0.3, A = 1: T = 2π + 4h/(A − h).
    law = ss.laws.TwoBranch(rising=1.3, falling=0.7, break_away=1.3)
    orbit = ss.simulate(ss.Oscillator(damping=0.0, drive_velocity=2.0, law=law), 500, x0=2.0, v0=0.0)
    hold = orbit.events.query("kind == 'hold'")["t"].to_numpy()
    assert hold[2:] - hold[:-2] == pytest.approx(7.997471021465301, rel=1e-11)
    assert set(orbit.events["kind"]) == {"hold", "reversal"}
    assert orbit.regime() == "almost_harmonic"


def test_held_orbit_comes_back_to_the_bit(tmp_path):
    law = ss.laws.TwoBranch(rising=1.3, falling=[(0, 0.7), (1, 0.9)], break_away=1.3)
    orbit = ss.simulate(ss.Oscillator(0.01, 0.8, law, forcing=ss.Harmonic(0.1, 1.4)), 60)
    again = ss.load(orbit.save(tmp_path / "orbit.nc"))
    assert "hold" in set(orbit.events["kind"])
    assert again.events.equals(orbit.events)
    t = np.linspace(0, 60, 999)
    assert (again.at(t)[0] == orbit.at(t)[0]).all()


def test_force_rate_law_is_dwell_time_where_the_rate_does_not_matter():
    dwell = ss.laws.DwellTime(0.5, 0.4, 0.7, 0.6)
    rate = ss.laws.ForceRate(0.5, 0.4, 0.7, force_rate_scale=1e300, exponent=0.6)
    t = np.array([0.0, 0.1, 1.0, 10.0])
    assert (rate.break_away_force(t, 3.0) == dwell.break_away_force(t)).all()
    slow = ss.laws.ForceRate(0.5, 0.4, 0.7, force_rate_scale=0.2, force_rate_exponent=2)
    assert slow.break_away_force(1e9, [0.0, 0.2, 0.4]) == pytest.approx([0.9, 0.7, 0.58])


def test_tabulated_law_goes_through_its_nodes():
    law = ss.laws.Tabulated(kinetic=[(0, 0.8), (0.2, 0.6), (0.5, 0.7)], break_away=[(0, 0.9), (2, 1.0)])
    assert law.kinetic_force([-0.1, 0.2, 0.35, 9.0]) == pytest.approx([-0.7, 0.6, 0.65, 0.7])
    assert law.break_away_force([0, 1, 5]) == pytest.approx([0.9, 0.95, 1.0])
    orbit = ss.simulate(ss.Oscillator(0.05, 0.3, law), 100)
    release = orbit.events.query("kind == 'release'").iloc[2:]
    assert len(release) > 3
    assert law.break_away_force(release["stick_time"]) == pytest.approx(release["force"].to_numpy(), abs=1e-12)
