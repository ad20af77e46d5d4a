"""Periodic orbits, multipliers, exponents and branches of laws with an internal state, against scipy's own integration."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import stickslip as ss
from stickslip.dynamics.periodic.state_flow import StateFlow

FORCE = ss.Harmonic(1.5, 0.7)
DAHL = ss.laws.Dahl(stiffness=4.0, kinetic=1.0)
SWING = ss.Oscillator(0.1, 0.0, DAHL, forcing=FORCE)
LUGRE = ss.laws.LuGre(1e3, 10.0, 0.1, kinetic=1.0, break_away=1.5, scale=0.02)


def dahl(t, y):
    """x, w = −ẋ and z of the swing, written without the package: F = z, ż = 4 (w − |w| z)."""
    x, w, z = y
    return [-w, -(1.5 * np.cos(0.7 * t) + 0.1 * w - x + z), 4.0 * (w - abs(w) * z)]


def flown(y, period, rates=dahl):
    return solve_ivp(rates, (0.0, period), y, method="DOP853", rtol=1e-13, atol=1e-14, max_step=0.01).y[:, -1]


@pytest.fixture(scope="module")
def cycle():
    return ss.periodic_orbit(SWING)


def test_a_forced_orbit_of_dahl_closes_under_another_integrator(cycle):
    assert cycle.period == pytest.approx(2 * np.pi / 0.7, abs=1e-14)
    assert cycle.forcing_periods == 1
    assert cycle.stable is True
    t, x, v, _ = cycle.state
    assert t == 0.0
    np.testing.assert_allclose(flown(cycle.start, cycle.period), cycle.start, atol=1e-7)
    np.testing.assert_allclose(cycle.orbit.at(cycle.period), [x, v], atol=1e-7)


def test_its_multipliers_are_those_of_differences_of_another_integrator(cycle):
    columns = []
    for i in range(3):
        step = 1e-5 * np.eye(3)[i] * cycle.flow.sizes[i]
        ends = [flown(cycle.start + sign * step, cycle.period) for sign in (-1, 1)]
        columns.append((ends[1] - ends[0]) / (2 * step[i]))
    found = np.linalg.eigvals(np.stack(columns, axis=1))
    found = found[np.argsort(-np.abs(found))]
    np.testing.assert_allclose(cycle.multipliers, found, atol=1e-6)
    # what it says of its own error holds
    assert np.abs(cycle.multipliers - found).max() < 1e-6 + 10 * cycle.error.max()
    assert cycle.error.max() < 1e-5


@pytest.mark.long
@pytest.mark.parametrize(("stiffness", "damping"), [(0.05, 0.5), (0.01, 0.05)])
def test_exponents_of_steady_slip_under_rate_and_state_are_its_eigenvalues(stiffness, damping):
    a, b, steady = 0.01, 0.015, 0.6
    law = ss.laws.RateState(normal_force=1.0, a=a, b=b, length=1.0, reference_velocity=1.0)
    # About w = 1, ψ = 0: F = a asinh(w/2 exp((μ + b ψ)/a)), ψ̇ = exp(−ψ) − w
    half = np.exp(steady / a) / 2
    by_speed, by_state = a * half / np.sqrt(1 + half**2), b * half / np.sqrt(1 + half**2)
    matrix = [[0, 1, 0], [-stiffness, -damping - by_speed, by_state], [0, 1, -1]]
    known = np.sort(np.linalg.eigvals(matrix).real)[::-1]
    start = a * np.arcsinh(half) / stiffness
    system = ss.Oscillator(damping, 1.0, law, stiffness=stiffness)
    found = ss.lyapunov(system, 800.0, x0=start * 1.00001, v0=0.0)
    np.testing.assert_allclose(found.exponents, known, atol=1.5e-3)


@pytest.mark.parametrize(
    ("speed", "fastest"),
    [pytest.param(0.05, -100.0, marks=pytest.mark.long), pytest.param(1.0, -2000.0, marks=pytest.mark.slow)],
)
def test_a_bristle_forgets_as_fast_as_it_bends(speed, fastest):
    """Far above the Stribeck velocity the rate is −σ₀ w/g; the mass on its spring swings with the damping σ₂ = 0.1."""
    law = ss.laws.LuGre(1e3, 10.0, 0.1, kinetic=0.5, break_away=0.5, scale=0.1)
    found = ss.lyapunov(ss.Oscillator(0.0, speed, law), 30.0, x0=0.5 + 0.1 * speed, v0=0.0)
    np.testing.assert_allclose(found.exponents[2], fastest, rtol=1e-3)
    np.testing.assert_allclose(found.exponents[:2].sum() + found.exponents[2], fastest - 0.1, rtol=1e-4)


@pytest.mark.slow
def test_exponents_of_a_regular_motion_are_those_of_its_multipliers(cycle):
    spectrum = ss.lyapunov(SWING, 60 * cycle.period)
    expected = np.log(np.abs(cycle.multipliers)) / cycle.period
    np.testing.assert_allclose(spectrum.exponents, expected, rtol=2e-2)


@pytest.mark.slow
def test_a_self_excited_orbit_has_the_multiplier_one_and_the_period_of_a_long_run():
    system = ss.Oscillator(0.0, 0.1, LUGRE, stiffness=2.0)
    cycle = ss.periodic_orbit(system)
    maxima = ss.integrate(system, 60, tolerance=1e-11).maxima()
    assert cycle.period == pytest.approx(np.diff(maxima)[-1], rel=1e-6)
    assert cycle.multipliers[0] == 1.0
    assert cycle.stable is True
    # the derivative itself has the 1 too
    _, matrix = cycle.flow.tangents(cycle.start, 0.0, cycle.period, np.eye(3))
    assert np.abs(np.linalg.eigvals(matrix) - 1).min() < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ElastoPlastic", "BoucWen", "Regularised"])
def test_every_law_with_a_state_has_orbits_and_multipliers(name):
    law = getattr(ss.laws, name).example()
    cycle = ss.periodic_orbit(ss.Oscillator(0.1, 0.0, law, forcing=FORCE))
    assert cycle.residual < 1e-8
    assert cycle.stable is True
    assert len(cycle.multipliers) == (2 if name == "Regularised" else 3)
    assert cycle.error.max() < 1e-4


def test_steady_rate_and_state_slip_beyond_its_critical_stiffness_swings():
    # Ruina 1983: k_c = (b − a) N/L = 1; beside it the period is 2π (L/V) √(a/(b − a)).
    law = ss.laws.RateState(normal_force=1.0, a=0.01, b=0.015, length=0.005, reference_velocity=1.0)
    system = ss.Oscillator(0.0, 1.0, law, mass=1e-6, stiffness=1.0)
    flow = StateFlow(system, np.array([1.0, 1.0, 1.0]))
    steady = np.array([0.6, 1.0, 0.0])
    assert np.abs(flow.rates(0.0, steady)).max() < 1e-9
    values = np.linalg.eigvals(flow.jacobians(np.zeros(1), steady[None])[0])
    pair = values[np.abs(values.imag) > 1e-3]
    assert np.abs(pair.real).max() < 1e-2 * np.abs(pair.imag).max()
    assert np.abs(pair.imag).max() == pytest.approx(1 / (0.005 * np.sqrt(2)), rel=2e-2)


@pytest.mark.slow
def test_a_branch_of_orbits_with_states_passes_through_orbits_found_one_by_one(cycle):
    result = ss.continuation(SWING, "forcing.amplitude", (1.3, 1.7), guess=cycle, seeds=0)
    branch = result.branches[0]
    assert branch.values[0] == pytest.approx(1.3)
    assert branch.values[-1] == pytest.approx(1.7)
    middle = branch.orbit(len(branch.values) // 2)
    alone = ss.periodic_orbit(middle.system)
    assert alone.multipliers == pytest.approx(middle.multipliers, abs=1e-5)
    assert np.abs(alone.start - middle.start).max() < 1e-6
    assert all(branch.stable)
    assert branch.multipliers.shape == (len(branch.values), 3)


@pytest.mark.slow
def test_sections_maps_and_diagrams_take_laws_with_a_state(cycle):
    points = ss.section(SWING, t_end=200, transient=0.8)
    assert float(points["x"][-1]) == pytest.approx(cycle.state[1], abs=1e-5)
    diagram = ss.orbit_diagram(SWING, "forcing.amplitude", [1.4, 1.5], periods=30, keep=5)
    assert diagram["period"].values.tolist() == [1, 1]
    assert ss.return_map(points, "x")["after"].size > 2


@pytest.mark.slow
def test_two_masses_under_lugre_have_the_orbit_multipliers_and_exponents_of_another_integrator():
    law = ss.laws.LuGre(20.0, 1.0, 0.1, kinetic=0.5, break_away=0.8, scale=0.2)
    pair = ss.System(
        mass=[1.0, 0.7],
        stiffness=[[1.5, -0.5], [-0.5, 1.2]],
        damping=[0.1, 0.08],
        contacts=[ss.Contact(0, law), ss.Contact(1, law)],
        forcing=[ss.Force(1.5, 0.7, mass=0)],
    )
    mass, stiffness, damping = (np.array(matrix) for matrix in (pair.mass, pair.stiffness, pair.damping))
    cycle = ss.periodic_orbit(pair)
    assert cycle.forcing_periods == 1

    def rates(t, y):
        x, v, z = y[:2], y[2:4], y[4:]
        dz = -v - 20.0 * np.abs(v) * z / (0.5 + 0.3 * np.exp(-((v / 0.2) ** 2)))
        load = 20.0 * z + dz - 0.1 * v + [1.5 * np.cos(0.7 * t), 0.0] - damping @ v - stiffness @ x
        return np.concatenate([v, np.linalg.solve(mass, load), dz])

    def end(y):
        return solve_ivp(rates, (0, cycle.period), y, method="DOP853", rtol=1e-11, atol=1e-12, max_step=0.05).y[:, -1]

    start = np.concatenate(cycle.state[1:])
    np.testing.assert_allclose(end(start), start, atol=1e-8)
    monodromy = np.column_stack([(end(start + h) - end(start - h)) / 2e-5 for h in 1e-5 * np.eye(6)])
    found = np.linalg.eigvals(monodromy)
    # The derivative of |w| jumps, so that differences are good to the step alone.
    np.testing.assert_allclose(cycle.multipliers, found[np.argsort(-np.abs(found))], atol=2e-5)
    exponents = ss.lyapunov(pair, 40 * cycle.period).exponents[:3]
    np.testing.assert_allclose(exponents, np.log(np.abs(cycle.multipliers[:3])) / cycle.period, rtol=0.1)


def test_steady_slip_that_is_spiralled_into_is_no_cycle():
    law = ss.laws.LuGre(100.0, 1.0, 0.1, kinetic=0.5, break_away=0.8, scale=0.1)
    spiral = ss.Oscillator(0.0, 1.0, law)
    with pytest.raises(ss.InputError, match="no cycle here"):
        ss.periodic_orbit(spiral)
    with pytest.raises(ss.InputError, match="no periodic motion to start from"):
        ss.continuation(spiral, "drive_velocity", (0.7, 1.3), seeds=0, most=6)


def test_a_branch_of_orbits_with_states_ends_where_they_shrink_to_steady_slip():
    law = ss.laws.RateState(1.0, a=0.01, b=0.015, length=0.5, reference_velocity=1.0)
    bounds = (0.6, 0.708)
    (branch,) = ss.continuation(ss.Oscillator(0.0, 0.706, law), "drive_velocity", bounds, seeds=0, most=30).branches
    assert branch.ends == ("point", "bounds")
    assert branch.special_points == []
    # Rice & Ruina 1983: steady slip swings where k = (b − a) N/L (1 + m V²/(a L N))
    onset = np.sqrt((0.5 / 0.005 - 1) * 0.01 * 0.5)
    assert branch.values[0] == pytest.approx(onset, abs=1e-5)
    sizes, beyond = np.subtract(branch.x_max, branch.x_min), np.array(branch.values) - onset
    assert sizes[0] < 1e-2
    # small true cycles are kept, and grow with the square root of the distance
    growth = sizes[beyond > 5e-5] / np.sqrt(beyond[beyond > 5e-5])
    assert growth.size > 3
    assert np.ptp(growth) < 0.05 * growth.mean()


def test_what_has_no_cycle_is_said():
    with pytest.raises(ss.InputError, match="no cycle here"):
        ss.periodic_orbit(ss.Oscillator(0.5, 1.0, LUGRE))
    with pytest.raises(ss.InputError, match="guess must be"):
        ss.periodic_orbit(SWING, 3)
    table = ss.Drive.table([0.0, 10.0], [0.1, 0.2])
    with pytest.raises(ss.InputError, match="a drive along a table has no period"):
        ss.periodic_orbit(ss.Oscillator(0.0, table, DAHL, forcing=FORCE))
