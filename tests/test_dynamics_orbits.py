"""Periodic orbits whose stability is not decided, near resonance, and what an orbit of one period tells."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from evidence import script

import stickslip as ss

den_hartog = script("stability").den_hartog


@pytest.mark.parametrize("friction", [0.05, 0.1, 0.2, 0.3])
def test_at_half_the_resonance_orbits_are_a_continuum_and_marginal(friction):
    # Without damping, Ω = 1/2 has a family of asymmetric orbits (Csernák & Stépán, J. Sound Vib. 295 (2006) 649); from rest
    # the motion goes to its edge, ever more slowly: there Newton's method meets a double root.
    cycle = ss.periodic_orbit(den_hartog(0.5, friction))
    assert cycle.period == pytest.approx(4 * np.pi, abs=1e-8)
    assert cycle.marginal
    assert cycle.stable is None
    assert repr(cycle).endswith("marginal>")
    # At the edge the turn is at 1 + S.
    assert abs(cycle.state[1]) == pytest.approx(1 + friction, abs=1e-6)


def test_every_start_on_the_continuum_closes_and_is_marginal():
    for start in ((0.0, 0.0), (0.0, 0.5), (1.0, 0.0), (1.0, 0.5), (1.3, 0.0), (2.0, 0.5)):
        cycle = ss.periodic_orbit(den_hartog(0.5, 0.2), start)
        assert cycle.marginal, start
        assert cycle.largest == pytest.approx(1.0, abs=1e-6)


def test_a_branch_along_the_edge_of_the_continuum_is_marginal_too():
    # A multiplier of 1 − 3e-8 there is 1 and rounding: neither stability nor its loss may be said.
    branch = ss.continuation(den_hartog(0.5, 0.3), "law.kinetic", (0.25, 0.32), seeds=0).branches[0]
    assert {cycle.forcing_periods for cycle in branch.orbits} == {1}
    assert branch.stable == [None] * len(branch.values)


@pytest.mark.parametrize("beside", [1e-3, 1e-4, 1e-5])
def test_a_multiplier_that_is_near_one_and_known_decides(beside):
    # Den Hartog's symmetric orbit turns at A = G cos φ, with G Ω sin φ = −S tan(θ/2), θ = π/Ω, G = 1/(1 − Ω²). Half a period
    # turns disturbances by θ, and a turn of the velocity multiplies that of v by r, the accelerations' ratio: λ² −
    # (1 + r) cos θ λ + r = 0, of which one root is 1 − e.
    omega, friction = 0.5 + beside, 0.3
    cycle = ss.periodic_orbit(den_hartog(omega, friction), (2.0, 2.0))
    gain, half = 1 / (1 - omega**2), np.pi / omega / 2
    pull = np.sqrt(1 - (friction * np.tan(half) / gain / omega) ** 2) * (1 - gain)
    ratio = (pull + friction) / (pull - friction)
    at_one = (1 + ratio) * 2 * np.sin(half) ** 2
    slope = 2 - (1 + ratio) * np.cos(2 * half)
    e = (slope - np.sqrt(slope**2 - 4 * at_one)) / 2
    assert cycle.stable is True
    assert 1 - cycle.largest == pytest.approx(2 * e - e**2, rel=1e-5)


def test_a_little_damping_decides_the_stability():
    weak = ss.periodic_orbit(den_hartog(0.5, 0.2, 1e-3))
    assert weak.stable is True
    assert weak.largest == pytest.approx(np.exp(-1e-3 * 2 * np.pi), rel=1e-4)


@pytest.mark.parametrize(
    ("law", "largest"),
    [
        (ss.laws.ExponentialStribeck(1.0, 0.27, 0.89, 0.2), 0.919327),
        (ss.laws.ExponentialStribeck(1.0, 0.63, 1.02, 0.05), 0.963436),
    ],
)
def test_an_orbit_that_attracts_slowly_is_found_by_a_longer_run(law, largest):
    # What 150 natural periods leave of the transient is no guess from which Newton's method converges.
    system = ss.Oscillator(0.1, 1.0, law, forcing=ss.Harmonic(0.3, 0.7))
    with pytest.raises(ss.InputError):
        ss.periodic_orbit(system, t_end=150 * 2 * np.pi / 0.7)
    cycle = ss.periodic_orbit(system)
    assert cycle.forcing_periods == 1
    assert cycle.largest == pytest.approx(largest, abs=1e-6)
    # A long run of its own ends on it.
    t, *state = cycle.state
    assert ss.simulate(system, 700 * cycle.period).at(600 * cycle.period + t) == pytest.approx(state, abs=1e-8)


@pytest.mark.parametrize(
    "system",
    [
        ss.Oscillator(0.1, 0.2, ss.laws.StaticKinetic(1, 0.6)),
        ss.Oscillator(0.1, -0.2, ss.laws.StaticKinetic(1, 0.6)),
        ss.paper.oscillator(0.2),
        ss.Oscillator(0.05, 0.3, ss.laws.TwoBranch(0.5, 0.7, 1.0)),
        ss.Oscillator(0.2, 0.0, ss.laws.Coulomb(0.4), forcing=ss.Harmonic(1.0, 0.2, 0.7)),
    ],
)
def test_events_of_one_period_are_those_of_the_run_that_settles(system):
    cycle = ss.periodic_orbit(system)
    mine = cycle.orbit.events
    run = ss.simulate(system, 60 * cycle.period).events.iloc[-3 * len(mine) :]
    first = np.flatnonzero(
        (run["kind"].to_numpy() == mine["kind"].iloc[0]) & (np.abs(run["x"] - mine["x"].iloc[0]) < 1e-8)
    )[0]
    same = run.iloc[first : first + len(mine)]
    assert same["kind"].tolist() == mine["kind"].tolist()
    for column in ("x", "v", "force", "stick_time", "force_rate"):
        np.testing.assert_allclose(mine[column], same[column], atol=1e-8, err_msg=column)
    assert np.isfinite(mine["force"]).all()


@pytest.mark.parametrize("frequency", [1.0, 1 + 1e-12, 1 - 1e-9])
def test_orbits_and_exponents_at_an_undamped_resonance(frequency):
    system = ss.Oscillator(0.0, 0.3, ss.laws.StaticKinetic(1, 0.5), forcing=ss.Harmonic(0.2, frequency))
    cycle = ss.periodic_orbit(system)
    beside = ss.periodic_orbit(ss.Oscillator(0.0, 0.3, system.law, forcing=ss.Harmonic(0.2, 1 + 1e-6)))
    assert cycle.largest == pytest.approx(beside.largest, abs=1e-5)
    assert cycle.state[1] == pytest.approx(beside.state[1], abs=1e-5)
    # the largest multiplier of a settled motion is its exponent
    spectrum = ss.lyapunov(system, 300.0)
    assert spectrum.exponents[0] == pytest.approx(np.log(cycle.largest) / cycle.period, abs=5e-3)


def test_the_release_map_of_a_smooth_law_predicts_the_releases_of_its_orbit():
    system = ss.Oscillator(0.05, 0.3, ss.laws.ExponentialStribeck(1.0, 0.5, 0.4), forcing=ss.Harmonic(0.5, 0.7))
    points = ss.section(system, "release", t_end=120, transient=0.2)
    phase, forward = points["phase"].to_numpy(), points["force"].to_numpy() > 0
    image = ss.release_map(system, phase[:-1][forward[:-1]])["image"].to_numpy()
    assert len(image) >= 8
    turn = np.exp(1j * (image - phase[1:][forward[:-1]]))
    np.testing.assert_allclose(np.abs(turn - 1), 0, atol=1e-8)


def test_what_has_no_release_map_says_so():
    lugre = ss.Oscillator(0.0, 0.3, ss.laws.LuGre.example(), forcing=ss.Harmonic(0.5, 0.7))
    with pytest.raises(ss.InputError, match="internal state"):
        ss.release_map(lugre, [0.0])


@pytest.mark.parametrize(("position", "kinetic"), [(0.0, 0.8), (2.0, 0.8), (3.0, 0.5)])
def test_forced_slip_without_events_is_found_where_it_attracts_and_where_it_repels(position, kinetic):
    # Linear: m ẍ + D ẋ + (k − p f) x = n₀ f + A cos Ω t, whose multipliers are exp(λ T) of its exponents λ.
    damping, frequency, amplitude = 0.1, 1.3, 0.05
    stiffness = 1.0 - position * kinetic
    system = ss.Oscillator(
        damping,
        1.0,
        ss.laws.Coulomb(kinetic),
        forcing=ss.Harmonic(amplitude, frequency),
        normal_force=ss.NormalForce(constant=np.sign(stiffness), position=position) if position else None,
    )
    place = kinetic / abs(stiffness)
    if position:
        # A saddle: what starts at rest or apart leaves it.
        with pytest.raises(
            ss.InputError, match=r"bodies of contact 0 part .*: the motion from rest .*give a guess \(x, v\)"
        ):
            ss.periodic_orbit(system)
        with pytest.raises(ss.InputError, match="the run from the guess has no two returns: it leaves the orbit"):
            ss.periodic_orbit(system, (place + 0.3, 0.0))
    cycle = ss.periodic_orbit(system, (place, 0.0))
    known = np.exp(np.roots([1.0, damping, stiffness]) * 2 * np.pi / frequency)
    found = sorted(cycle.multipliers, key=lambda one: (one.real, one.imag))
    np.testing.assert_allclose(found, sorted(known, key=lambda one: (one.real, one.imag)), rtol=1e-8)
    assert cycle.period == pytest.approx(2 * np.pi / frequency, rel=1e-10)
    assert cycle.stable is (position == 0.0)
    t, x, v = cycle.state
    wave = amplitude / (stiffness - frequency**2 + 1j * damping * frequency) * np.exp(1j * frequency * t)
    assert (x, v) == pytest.approx((place + wave.real, (1j * frequency * wave).real), abs=1e-9)
    if position == 0.0:
        # Another law has another line of friction.
        slower = replace(system, law=ss.laws.Coulomb(0.7))
        with pytest.raises(ss.InputError, match="slips without events, and nothing passes a change of its law on"):
            ss.continuation(system, "law.kinetic", (0.7, 0.9), guess=cycle, seeds=0)
        assert ss.periodic_orbit(slower, cycle).orbit.at(0.0)[0] == pytest.approx(x - 0.1, abs=1e-9)
        assert ss.periodic_orbit(slower, cycle).multipliers == pytest.approx(cycle.multipliers)
