"""Numbers at the ends of the range: right where they can be, else a stop with a sentence, and never a silent NaN."""

import json

import numpy as np
import pytest

import stickslip as ss
from stickslip.dynamics.periodic.derivatives import sensitivities
from stickslip.dynamics.sweep import Chunk, Look

STEEP = ss.laws.PiecewiseLinear([(0, 0.9), (1e-10, 0.7), (0.6, 0.7)], 1.0)
FLAT = ss.laws.PiecewiseLinear([(0, 0.7), (0.6, 0.7)], 1.0)


@pytest.mark.parametrize("damping", [0.0, 0.1])
@pytest.mark.parametrize("forcing", [(), ss.Harmonic(0.1, 0.7)])
def test_a_fall_within_hardly_any_slip_is_the_limit_of_a_jump(damping, forcing):
    # The fall takes 1e-10 of the slip velocity, 3e-9 of the time: beyond it both laws are the same.
    steep, flat = (ss.simulate(ss.Oscillator(damping, 0.3, law, forcing=forcing), 60) for law in (STEEP, FLAT))
    assert steep.stop == "t_end"
    for kind in ("release", "capture"):
        times = [orbit.events.loc[orbit.events["kind"] == kind, "t"].to_numpy() for orbit in (steep, flat)]
        assert len(times[0]) == len(times[1]) >= 2
        assert times[0] == pytest.approx(times[1], abs=1e-7)
    t = np.linspace(0, 60, 500)
    assert steep.at(t)[0] == pytest.approx(flat.at(t)[0], abs=1e-7)


@pytest.mark.parametrize("law", [ss.laws.ExponentialStribeck, ss.laws.Lorentzian])
@pytest.mark.parametrize("more", [{}, {"forcing": ss.Harmonic(2.0, 1.3)}])
def test_a_curve_on_which_nothing_falls_has_any_scale(law, more):
    # f_s = f_k is Coulomb's friction, whose motion is in closed form.
    t = np.linspace(0, 60, 200)
    there = np.array(ss.simulate(ss.Oscillator(0.05, 0.1, ss.laws.Coulomb(1.0), **more), 60, x0=3.0).at(t))
    for scale in (1e-15, 1e-21, 1e-30, 1e-99):
        flat = ss.Oscillator(0.05, 0.1, law(1.0, 1.0, scale=scale), **more)
        orbit = ss.simulate(flat, 60, x0=3.0)
        assert orbit.stop == "t_end"
        np.testing.assert_allclose(orbit.at(t), there, atol=1e-10)
        runs = ss.simulate_many(flat, {"drive_velocity": [0.1, 0.2, 0.3, 0.4, 0.5], "x0": 3.0}, 60)
        assert (runs["stop"] == "t_end").all()


STEEPEST = ss.laws.PiecewiseLinear([(0, 0.9), (1e-99, 0.1), (0.6, 0.1)], 1.0)
BEYOND = {
    "a slope": ss.Oscillator(0.1, 0.3, STEEPEST),
    "a slope, forced": ss.Oscillator(0.1, 0.3, STEEPEST, forcing=ss.Harmonic(0.1, 0.7)),
    "a smooth law": ss.Oscillator(0.1, 0.3, ss.laws.Rational(1.0, 1e99)),
    "a mass": ss.Oscillator(0.1, 0.3, ss.laws.StaticKinetic(1.0, 0.6), mass=1e-200),
    "damping": ss.Oscillator(1e200, 0.3, ss.laws.StaticKinetic(1.0, 0.6)),
    "a mass of a system": ss.Oscillator(0.1, 0.3, ss.laws.StaticKinetic(1.0, 0.6), mass=1e-30).to_system(),
    "damping of a system": ss.Oscillator(1e18, 0.3, ss.laws.StaticKinetic(1.0, 0.6)).to_system(),
}


@pytest.mark.parametrize("forcing", [None, ss.Harmonic(0.1, 0.7)])
def test_a_line_shorter_than_the_rounding_of_a_velocity_is_a_stop(forcing):
    for end in (1e-17, 1e-18, 1e-25):
        law = ss.laws.PiecewiseLinear([(0, 0.9), (end, 0.1), (0.6, 0.1)], 1.0)
        oscillator = ss.Oscillator(0.1, 0.3, law, forcing=forcing)
        assert ss.simulate(oscillator, 60, max_events=1000).stop == "not_a_number"
        runs = ss.simulate_many(oscillator, {"drive_velocity": [0.3, 0.4]}, 60, max_events=1000)
        assert (runs["stop"] == "not_a_number").all()


def test_numbers_of_laws_out_of_range_are_refused():
    for law in (lambda: ss.laws.PiecewiseLinear([(0, 0.9), (1e-200, 0.1)], 1.0), lambda: ss.laws.Rational(1.0, 1e200)):
        with pytest.raises(ss.InputError, match="nearer to 1"):
            law()


@pytest.mark.parametrize("name", BEYOND)
def test_numbers_out_of_range_are_a_stop_with_a_sentence(name):
    orbit = ss.simulate(BEYOND[name], 10, max_seconds=20)
    assert orbit.stop == "not_a_number"
    assert "leave the range of double precision" in orbit.stop_sentence
    assert np.isfinite(orbit.at(orbit.t_end)).all()
    assert np.isfinite(orbit.events[["t", "x", "v", "force"]]).all(axis=None)


@pytest.mark.parametrize("name", BEYOND)
def test_so_they_are_in_batches_and_sweeps(name):
    system = BEYOND[name]
    path = "contacts.0.drive_velocity" if isinstance(system, ss.System) else "drive_velocity"
    runs = ss.simulate_many(system, {path: [0.3, 0.4]}, 10, max_seconds=20)
    assert (runs["stop"] == "not_a_number").all()
    assert np.isfinite(runs["x"]).all()
    if "mass" in name:
        # A few of its natural periods are over before anything slips.
        return
    diagram = ss.orbit_diagram(system, path, [0.3, 0.4], periods=4, keep=2)
    assert (diagram["stop"] == "not_a_number").all()
    assert (diagram["regime"] == "unfinished").all()


def test_a_run_that_is_hardly_any_time_is_a_run():
    for law in (ss.laws.StaticKinetic(1.0, 0.6), ss.laws.Rational(1.0, 3.0)):
        for t_end in (5e-324, 1e-300, 1e-30):
            orbit = ss.simulate(ss.Oscillator(0.1, 0.3, law), t_end)
            assert len(orbit.events) == 0
            assert np.isfinite(orbit.at(t_end)).all()
            system = ss.simulate(ss.Oscillator(0.1, 0.3, law).to_system(), t_end)
            assert len(system.events) == 0
            assert system.at(np.zeros(0))[0].shape == (0, 1)


def test_no_integration_steps_on_the_spot():
    for law in (ss.laws.RateState.example(), ss.laws.LuGre.example()):
        oscillator = ss.Oscillator(0.1, 0.3, law)
        for system in (oscillator, oscillator.to_system()):
            assert np.isfinite(ss.simulate(system, 1e-12).at(1e-12)).all()
            # Three numbers lie between 0 and this time: no integrator has room for a step.
            with pytest.raises(ss.InputError, match=r"could not take its first step|came to t = "):
                ss.simulate(system, 1.5e-323)


@pytest.mark.parametrize(
    "law", [ss.laws.RateState.example(), ss.laws.LuGre.example()], ids=lambda law: type(law).__name__
)
def test_a_motion_without_an_event_has_an_empty_table(law):
    for system in (ss.Oscillator(2.0, 0.3, law), ss.Oscillator(2.0, 0.3, law).to_system()):
        orbit = ss.simulate(system, 1e-3)
        assert len(orbit.events) == 0
        assert list(orbit.events)[:4] == ["t", "kind", "contact", "x"]


def test_a_parameter_without_neighbours_has_no_derivative():
    contacts = [ss.Contact(mass=0, drive_velocity=0.2, law=ss.laws.StaticKinetic(1.0, 0.6))]
    matrices = {"stiffness": [[1, 0], [0, 1]], "damping": [[0.1, 0], [0, 0.1]]}
    system = ss.System(mass=[[1, 0.9995], [0.9995, 1]], contacts=contacts, **matrices)
    orbit = ss.simulate(system, 5)
    with pytest.raises(ss.InputError, match=r"mass.0.0 = 1 has no derivative, .*: the mass matrix must be symmetric"):
        sensitivities(orbit, ["mass.0.0"])
    # A damping of zero makes no sense below, but its derivative does.
    undamped = ss.simulate(ss.Oscillator(0.0, 0.2, ss.laws.StaticKinetic(1.0, 0.6)), 20)
    assert np.isfinite(sensitivities(undamped, ["damping"]).to_array()).all()


def test_a_chain_that_goes_on_from_no_regime_is_refused():
    belt = ss.Oscillator(0.1, 0.2, ss.laws.StaticKinetic(1.0, 0.6))
    chunk = Chunk(
        json.dumps(belt.to_dict()), ("drive_velocity",), np.array([[0.2]]), Look(5, 5, 1e-6),
        chain=True, before=([0.2], 7, 1.0),
    )  # fmt: skip
    with pytest.raises(ss.InputError, match="expected the number of a regime, below 7, got 7"):
        chunk.compute()
