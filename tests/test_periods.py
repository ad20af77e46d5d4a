"""Periods of orbit diagrams against an integrator that shares no line with the core; a guess beside a Hopf point."""

from __future__ import annotations

import numpy as np
import pytest
from evidence import script

import stickslip as ss

judge = script("periods")


def test_the_integrator_meets_the_closed_form_of_coulomb_decay():
    # Den Hartog, Trans. ASME 53 (1931) 107: turns at 5.3, −4.3, 3.3, … where friction is 0.5, and rest at −0.3.
    x, v = judge.Belt(0.0, 0.0, 0.5, 0.5, 0.0, 0.5).returns(5.3, 0.0, 3, 3)
    assert x == pytest.approx([1.3, -0.3, -0.3], abs=1e-12)
    assert v == pytest.approx(np.zeros(3), abs=1e-12)


@pytest.mark.long
@pytest.mark.parametrize("seed", [3, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (18, 26))])
def test_a_period_that_a_diagram_gives_is_that_of_the_motion(seed):
    found = judge.columns(seed)
    assert [one for one in found if one.word in ("periodic", "rests") and one.period != one.judged] == []
    assert sum(one.word in ("periodic", "rests") for one in found) >= 4


def test_a_guess_that_leads_to_steady_slip_does_not_say_that_there_is_no_cycle():
    # Supercritical Hopf point at 0.8819: the cycle at 0.99 of it has the amplitude 0.25 (another integrator: period 6.3239).
    law = ss.laws.Cubic(1.0, 0.8, 0.3)
    system = ss.Oscillator(0.1, 0.99 * np.sqrt(0.7 / 0.9), law)
    here = float(law.kinetic_force(system.drive_velocity))
    with pytest.raises(ss.InputError, match="a cycle may lie further from it"):
        ss.periodic_orbit(system, guess=(here + 0.05, 0.0))
    assert ss.periodic_orbit(system, guess=(here + 0.2, 0.0)).period == pytest.approx(6.3239171427)


def test_a_long_stick_before_small_slip_is_no_part_of_a_motion_that_repeats():
    # A drive of 1e-4 holds the mass for hundreds of periods, up to x = f; then its slip comes to the velocity of the drive as
    # e^(−D t/2) under Coulomb friction, and it never sticks again. Beside the way of the stick this is so small that its
    # returns seemed to repeat.
    slider = ss.Oscillator(0.05, 1e-4, ss.laws.Coulomb(0.5))
    found = ss.basins(slider, x=[0.1286, 0.5, 0.8789], v=[-0.3725, 0.0026, 0.3778])
    assert set(found["regime"].values.ravel()) == {"stable_slip"}
    assert found["attractor_x_mean"].values == pytest.approx([0.5], abs=1e-6)


def test_a_stick_of_a_thousand_forcing_periods_is_none_either():
    # Once f_s is reached the mass slips a little in each forcing period, as far as the drive goes in it.
    law = ss.laws.Rational(1.9266860485434432, 0.6848130378214567)
    slider = ss.Oscillator(0.01, 1.4482736e-4, law, forcing=ss.Harmonic(0.5976766141382065, 2.1960982808491947))
    row = ss.regime_map(slider, {"x0": [2.67249]}, v0=-0.93248654, transient=200, tolerance=1e-4).isel(x0=0)
    way = slider.drive_velocity * 2 * np.pi / slider.forcing.frequency
    assert row["recurrence"] == "periodic"
    assert row["x_max"] - row["x_min"] < 1.1 * way


def test_a_first_stick_that_outlasts_a_piece_of_the_run_from_rest_is_waited_for():
    # Loading takes f_s/s = 660 time units, more than the pieces in which the run from rest is looked at.
    law = ss.laws.ExponentialStribeck(1.65, 0.92, 0.11, exponent=2.0)
    slider = ss.Oscillator(0.2, 0.0025, law, forcing=ss.Harmonic(0.036, 2.07))
    cycle = ss.periodic_orbit(slider)
    assert (cycle.forcing_periods, cycle.stable) == (1, True)
    # A long run of its own ends on it.
    t, *state = cycle.state
    assert ss.simulate(slider, 1001 * cycle.period).at(1000 * cycle.period + t) == pytest.approx(state, abs=1e-9)
