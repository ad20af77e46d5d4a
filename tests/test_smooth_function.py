"""Smooth laws from functions and tables, against the laws with a formula and against closed forms."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from scipy.optimize import brentq

import stickslip as ss
from stickslip.dynamics.equilibria.criticality import criticality
from stickslip.dynamics.equilibria.hopf_points import hopf_points
from stickslip.dynamics.equilibria.steady_slip import steady_slip
from stickslip.laws import ExponentialStribeck, PiecewisePolynomial, smooth_from_function

SPEED = "/drive_velocity"


def stribeck(w):
    return 0.5 + 0.5 * np.exp(-w / 0.5) + 0.05 * w


def stribeck_slope(w):
    return -np.exp(-w / 0.5) + 0.05


def two_slopes(w):
    return 0.45 + 0.5 / (1 + 3 * w * w) + 0.08 * w + 0.05 * np.exp(-(((w - 1) / 0.3) ** 2))


def two_slopes_slope(w):
    return -3 * w / (1 + 3 * w * w) ** 2 + 0.08 - 0.05 * 2 * (w - 1) / 0.09 * np.exp(-(((w - 1) / 0.3) ** 2))


def two_slopes_third(w, h=1e-3):
    """F″ and F‴ from differences of F′."""
    below, at, above = (two_slopes_slope(w + shift * h) for shift in (-1, 0, 1))
    return (above - below) / (2 * h), (above - 2 * at + below) / h**2


def swing(velocity, amplitudes, periods, steps=60):
    """Amplitudes of ẋ after so many periods of slip, by Runge and Kutta's method with fixed steps."""

    def rates(x, v):
        return np.array([v, two_slopes(velocity - v) - 0.1 * v - x])

    state, h, peaks = np.array([two_slopes(velocity) + 0 * amplitudes, amplitudes]), 2 * np.pi / steps, []
    for _ in range(periods * steps):
        a = rates(*state)
        b = rates(*(state + h / 2 * a))
        c = rates(*(state + h / 2 * b))
        state = state + h / 6 * (a + 2 * b + 2 * c + rates(*(state + h * c)))
        peaks.append(state[1])
    return np.max(peaks[-steps:], axis=0)


BUILT_IN = ExponentialStribeck(1.0, 0.5, scale=0.5, viscous=0.05)
SMOOTH = smooth_from_function(stribeck, 4.0, stribeck_slope)


def test_a_function_has_the_critical_velocity_of_the_law_with_its_formula():
    systems = [ss.Oscillator(0.1, 1.0, law) for law in (BUILT_IN, SMOOTH)]
    (kind, exact), (smooth_kind, found) = (hopf_points(system, SPEED, (0.1, 2.5))[0] for system in systems)
    assert kind == smooth_kind == "hopf"
    assert exact == pytest.approx(0.5 * np.log(1 / 0.15), rel=1e-12)
    assert found == pytest.approx(exact, rel=1e-10)
    # The sign of F‴ there.
    assert criticality(systems[1], SPEED, found) == criticality(systems[0], SPEED, exact) == "subcritical"
    # Linear pieces of the same function have a corner instead.
    pieces = ss.laws.from_function(stribeck, 4.0)
    assert hopf_points(ss.Oscillator(0.1, 1.0, pieces), SPEED, (0.1, 2.5))[0][0] == "nonsmooth_hopf"


@pytest.mark.parametrize("speed", [0.15, 0.6, 1.0])
def test_a_function_has_the_motions_of_the_law_with_its_formula(speed):
    cycles = [ss.periodic_orbit(ss.Oscillator(0.05, speed, law)) for law in (BUILT_IN, SMOOTH)]
    assert cycles[1].period == pytest.approx(cycles[0].period, rel=1e-12)
    events = [ss.simulate(ss.Oscillator(0.05, speed, law), 300).events for law in (BUILT_IN, SMOOTH)]
    assert list(events[1]["kind"]) == list(events[0]["kind"])
    assert events[1]["t"].to_numpy() == pytest.approx(events[0]["t"].to_numpy(), abs=1e-9)


def test_a_function_has_the_multipliers_of_the_law_with_its_formula():
    systems = [ss.Oscillator(0.1, 1.5, law, forcing=ss.Harmonic(0.3, 0.7)) for law in (BUILT_IN, SMOOTH)]
    slips = [ss.periodic_orbit(system, guess=(0.6, 0.1)) for system in systems]
    assert abs(slips[0].multipliers).min() > 0.1
    assert slips[1].multipliers == pytest.approx(slips[0].multipliers, abs=1e-11)


def test_a_power_that_no_taylor_series_has_at_rest_is_met_too():
    law = smooth_from_function(lambda w: 0.5 + 0.5 * np.exp(-((w / 0.3) ** 1.5)), 3.0)
    w = np.concatenate([np.geomspace(1e-12, 3.0, 500), np.linspace(0.01, 3, 999)])
    assert law.kinetic_force(w) == pytest.approx(0.5 + 0.5 * np.exp(-((w / 0.3) ** 1.5)), abs=2e-13)

    def damping(w):
        return 0.1 - 0.75 / 0.3 * (w / 0.3) ** 0.5 * np.exp(-((w / 0.3) ** 1.5))

    found = hopf_points(ss.Oscillator(0.1, 0.5, law), SPEED, (0.2, 1.0))
    assert [kind for kind, _ in found] == ["hopf"]
    assert found[0][1] == pytest.approx(brentq(damping, 0.2, 1.0, xtol=1e-14), abs=1e-9)
    orbit = ss.simulate(ss.Oscillator(0.05, 0.15, law), 100)
    assert orbit.stop == "t_end"
    assert orbit.regime() == "stick_slip"


def test_beyond_the_top_speed_the_tangent_goes_on():
    top = stribeck(4.0), stribeck_slope(4.0)
    assert SMOOTH.kinetic_force([4.0, 5.0, -9.0]) == pytest.approx([top[0], top[0] + top[1], -top[0] - 5 * top[1]])
    fast = steady_slip(ss.Oscillator(0.1, 7.0, SMOOTH))
    assert fast.damping == pytest.approx(0.1 + top[1], abs=1e-10)
    # A motion that goes over the end and back.
    orbit = ss.simulate(ss.Oscillator(0.0, 3.5, SMOOTH), 20, x0=0.6, v0=2.0)
    assert orbit.to_xarray(np.linspace(0, 20, 500))["slip_velocity"].max() > 4.5
    assert orbit.stop == "t_end"


def test_a_table_becomes_a_curve_through_its_rows():
    w = np.linspace(0, 4, 41)
    rows = np.column_stack([w, stribeck(w)])
    law = smooth_from_function(rows, break_away=1.2)
    assert law.break_away == 1.2
    assert law.degree == 3
    assert (law.kinetic_force(w[1:]) == rows[1:, 1]).all()
    between = np.linspace(0.001, 4, 999)
    assert law.kinetic_force(between) == pytest.approx(stribeck(between), abs=1e-4)
    hermite = smooth_from_function(np.column_stack([rows, stribeck_slope(w)]))
    # h⁴ max F⁗/384
    assert np.abs(hermite.kinetic_force(between) - stribeck(between)).max() < 0.1**4 * 8 / 384
    found = hopf_points(ss.Oscillator(0.1, 1.0, hermite), SPEED, (0.3, 2.5))
    assert [kind for kind, _ in found] == ["hopf"]
    assert found[0][1] == pytest.approx(0.5 * np.log(1 / 0.15), abs=1e-3)


def test_it_is_data():
    assert PiecewisePolynomial.from_dict(SMOOTH.to_dict()) == SMOOTH
    assert pickle.loads(pickle.dumps(SMOOTH)) == SMOOTH
    system = ss.Oscillator(0.1, 0.3, SMOOTH)
    again = ss.Oscillator.from_toml(system.to_toml())
    assert again == system


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: smooth_from_function(lambda w: abs(w - 0.3) + 0.1, 1), "not smooth enough near w = 0.3.* use from_function"),
        (lambda: smooth_from_function(np.sqrt, 1), "not smooth enough near w = .*, where a narrow piece"),
        (lambda: smooth_from_function(stribeck, 1, lambda w: w), "expected the derivative of f, which is .* got"),
        (lambda: smooth_from_function(stribeck, 1, lambda _: "a"), "derivative must give a number for a number"),
        (lambda: smooth_from_function(stribeck), "w_max is missing"),
        (lambda: smooth_from_function(stribeck, -1), "w_max must be greater than 0, got -1"),
        (lambda: smooth_from_function(stribeck, 1, error=0), "error must be greater than 0, got 0"),
        (lambda: smooth_from_function(stribeck, 1, break_away=0.5), "at least the kinetic force"),
        (lambda: smooth_from_function([(0, 1), (1, 1)], 1), "are for a function, and f is a table"),
        (lambda: smooth_from_function([(0, 1, 1, 1), (1, 1, 1, 1)]), "two columns .* or three"),
        (lambda: smooth_from_function([(0, 1), (1, np.inf)]), r"table must be finite, got \[1.0, inf\] in row 1"),
        (lambda: PiecewisePolynomial([(0, 1), (1, 1), (2, 1), (3, 1)], 1, degree=2), r"nodes \(3, 5, 7, …\), got 4"),
        (lambda: PiecewisePolynomial([(0, 1), (1, 1)], 1, degree=2), r"nodes \(3, 5, 7, …\), got 2"),
        (lambda: PiecewisePolynomial([(0, 1), (1, 1), (2, 1)], 1, degree=1.5), "degree must be a whole number .*, got 1.5"),
        (lambda: PiecewisePolynomial([(0, 1), (1, 1), (1, 1)], 1, degree=2), "strictly increasing abscissae"),
        (lambda: PiecewisePolynomial([(1, 1), (2, 1), (3, 1)], 1, degree=2), "first node must lie at slip velocity 0"),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused_in_one_sentence(refused, make, sentence):
    refused(sentence, make)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("bounds", "words"),
    [
        ((0.05, 0.09), ["supercritical"]),
        ((0.05, 0.8), ["supercritical", "subcritical"]),
    ],
)
def test_each_hopf_point_has_its_own_criticality(bounds, words):
    # F‴ is +6.3 at the first and −5.7 at the second.
    law = smooth_from_function(two_slopes, 6.0, two_slopes_slope, break_away=1.05)
    system = ss.Oscillator(0.1, 0.12, law)
    found = ss.critical_velocities(system, bounds)
    hopfs = [value for kind, value in found.all if kind == "hopf"]
    assert dict(found.criticalities) == dict(zip(hopfs, words, strict=True))
    assert found.criticality == words[0]
    for hopf, word in found.criticalities:
        _, curvature = two_slopes_third(hopf)
        assert word == ("supercritical" if curvature > 0 else "subcritical")
        # Where averaging has the cycle, y² = −8 (D + F′)/F‴, motions from both sides of it draw near or part.
        side = hopf + 5e-4 * np.sign(-curvature * two_slopes_third(hopf)[0])
        cycle = np.sqrt(-8 * (0.1 + two_slopes_slope(side)) / curvature)
        ends = swing(side, cycle * np.array([0.7, 1.3]), periods=100)
        assert (np.ptp(ends) < np.ptp(cycle * np.array([0.7, 1.3]))) == (word == "supercritical")
