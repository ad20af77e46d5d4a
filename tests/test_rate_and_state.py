"""Rate-and-state friction with two state variables and with other evolution laws, against textbook equations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import lambertw

import stickslip as ss

ONE = ss.laws.RateState(normal_force=1.0, a=0.01, b=0.008, length=1.0, reference_velocity=1.0)
TWO = replace(ONE, second_b=0.006, second_length=0.2)
FORMS = ("aging", "slip", "perrin-rice-zheng")
ROCK = ss.laws.RateState(1e7, 0.01, 0.015, 1e-5, 1e-6)
#: θ̇ over |w|, θ, L, as in Ruina 1983, Perrin, Rice & Zheng 1995, and Kato & Tullis 2001 with V_c = 1e-7.
RATES = {
    "aging": lambda w, theta, length: 1 - w * theta / length,
    "slip": lambda w, theta, length: -w * theta / length * np.log(w * theta / length) if w else 0.0,
    "perrin-rice-zheng": lambda w, theta, length: 1 - (w * theta / (2 * length)) ** 2,
    "composite": lambda w, theta, length: (
        np.exp(-w / 1e-7) - (w * theta / length * np.log(w * theta / length) if w else 0.0)
    ),
}


def law_of(form, **numbers):
    return replace(ROCK, law=form, **({"cutoff_velocity": 1e-7} if form == "composite" else {}), **numbers)


def evolution(law, w, psi):
    """ψ̇ with V₀ = 1, from θ̇."""
    if law.law == "slip":
        return -w * (np.log(max(w, 1e-300)) + psi) / law.length
    share = 2 if law.law == "perrin-rice-zheng" else 1
    theta = np.exp(psi) * share * law.length
    return RATES[law.law](w, theta, law.length) / theta


def in_turns(law, s, d, start, t_end):
    """x, ẋ, ψ of ẍ + d ẋ + x = F with V₀ = N = 1, where w > 0 throughout: times and values, in turns at rest and in slip.

    At rest, w < 1e-12, friction bears the load, which tells w; in slip it is 0.6 + a ln w + b ψ, with ln w as the variable.
    """
    low = np.log(1e-12)

    def creep(x, psi):
        return (x + d * s - 0.6 - law.b * psi) / law.a

    def at_rest(_, y):
        w = np.exp(min(creep(*y), 5.0))
        return [s - w, evolution(law, w, y[1])]

    def in_slip(_, y):
        x, log, psi = y
        w = np.exp(min(log, 5.0))
        return [s - w, (d * (s - w) + x - 0.6 - law.a * log - law.b * psi) / w, evolution(law, w, psi)]

    leaves, stops = (lambda _, y: creep(*y) - low), (lambda _, y: y[1] - low)
    leaves.terminal = stops.terminal = True
    leaves.direction, stops.direction = 1, -1
    t, (x, w, psi), times, rows = 0.0, start, [], []
    while t < t_end:
        rests = w < 2e-12
        y = [x, psi] if rests else [x, np.log(w), psi]
        run = solve_ivp(
            at_rest if rests else in_slip,
            (t, t_end),
            y,
            "LSODA",
            events=leaves if rests else stops,
            rtol=1e-11,
            atol=1e-12,
        )
        assert run.status >= 0, run.message
        x, psi = run.y[0, -1], run.y[-1, -1]
        w, before = (1e-12 * 3 if rests else 1e-12), t
        t = run.t[-1]
        times.append(run.t)
        rows.append([run.y[0], s - np.exp(creep(*run.y) if rests else run.y[1]), run.y[-1]])
        assert t > before
    return np.concatenate(times), np.concatenate(rows, axis=1)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("v0", [None, 0.0], ids=["from rest", "from slip"])
@pytest.mark.parametrize(
    ("a", "b", "length"),
    [
        (0.01, 0.015, 1.0),
        pytest.param(0.01, 0.0, 1.0, marks=pytest.mark.long),
        pytest.param(0.005, 0.01, 0.1, marks=pytest.mark.long),
        (0.0005, 0.001, 0.1),
    ],
)
def test_a_mass_leaves_rest_and_comes_to_rest(form, v0, a, b, length):
    # Friction grows at rest by exp(μ₀/a), 1e26 to 1e521, times the slip velocity.
    law = ss.laws.RateState(1.0, a, b, length, 1.0, law=form)
    orbit = ss.simulate(ss.Oscillator(0.05, 0.2, law), 12.0, v0=v0)
    assert orbit.stop == "t_end"
    t, known = in_turns(law, 0.2, 0.05, (0.0, *((0.0, 0.0) if v0 is None else (0.2, law.steady_state(0.2)))), 12.0)
    np.testing.assert_allclose(orbit.at(t), known[:2], rtol=0, atol=1e-7)
    np.testing.assert_allclose(orbit.state(t), known[2], rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    "tolerance", [pytest.param(1e-6, marks=pytest.mark.long), 1e-8, pytest.param(1e-11, marks=pytest.mark.slow)]
)
def test_rest_is_reached_with_any_tolerance_and_from_either_side(tolerance):
    for form in FORMS:
        for v0 in (-1.0, 0.0, 0.5):
            law = ss.laws.RateState(1.0, 0.01, 0.015, 1.0, 1.0, law=form)
            orbit = ss.integrate(ss.Oscillator(0.05, 0.2, law), 50.0, v0=v0, tolerance=tolerance)
            assert orbit.stop == "t_end"
            assert orbit.work.evaluations < 60_000


def linear(law, speed, mass, stiffness):
    """δ(x, w, ψ₁, ψ₂)' of steady slip on a spring: m δẇ = k δx − δF, δψ̇ᵢ = −(V/Lᵢ) (δψᵢ + δw/V)."""
    rows = [[0.0, -1.0, 0.0, 0.0], [stiffness, -law.a / speed, -law.b, -law.second_b]]
    rows[1] = [value / mass for value in rows[1]]
    for i, length in enumerate((law.length, law.second_length)):
        rows.append([0.0, -1 / length, *(-speed / length if i == j else 0.0 for j in range(2))])
    return np.array(rows)


def critical(law, speed, mass):
    """ω and k at which the roots of (m s² + k) + (N s/V) (a − Σ bᵢ/(1 + s Lᵢ/V)) = 0 are ± i ω, from its two parts."""
    b, times = np.array([law.b, law.second_b]), np.array([law.length, law.second_length]) / speed
    (one, two), (first, second) = times**2, b
    square = np.roots(
        [law.a * one * two, law.a * (one + two) - first * two - second * one, law.a - first - second]
    ).max()
    return np.sqrt(square), square * (mass + np.sum(b * times / (1 + square * times**2)) / speed)


def test_the_critical_stiffness_without_a_second_effect_is_that_of_ruina():
    # k = N (b − a)/L (1 + m V²/(N a L)), as for one state.
    omega, stiffness = critical(replace(TWO, b=0.015, second_b=0.0), 2.0, 0.003)
    assert stiffness == pytest.approx(0.005 * (1 + 0.003 * 4 / 0.01), rel=1e-12)
    assert omega == pytest.approx(2.0 * np.sqrt(0.5), rel=1e-12)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("mass", [1e-5, 0.02], ids=["quasi-static", "with mass"])
def test_steady_slip_with_two_states_loses_stability_where_the_characteristic_polynomial_says(form, mass):
    # Gu, Rice, Ruina & Tse 1984 for the slip law without mass; the linear equations of the other laws are the same.
    law, speed = replace(TWO, law=form), 1.0
    omega, stiffness = critical(law, speed, mass)
    roots = np.linalg.eigvals(linear(law, speed, mass, stiffness))
    np.testing.assert_allclose(roots[np.argsort(-roots.real)][:2].real, 0.0, atol=1e-9)
    np.testing.assert_allclose(np.abs(roots[np.argsort(-roots.real)][:2].imag), omega, rtol=1e-9)
    for factor in (0.9, 1.1):
        root = max(np.linalg.eigvals(linear(law, speed, mass, factor * stiffness)), key=lambda value: value.real)
        assert root.real * (1 - factor) > 0
        slider = ss.Oscillator(0.0, speed, law, mass=mass, stiffness=factor * stiffness)
        x = law.kinetic_force(speed) / slider.stiffness
        # A kick of a thousandth of the speed along the mode that grows or decays least.
        values, modes = np.linalg.eig(linear(law, speed, mass, slider.stiffness))
        mode = modes[:, np.argmax(values.real)]
        kick = 1e-3 * (mode / mode[1]).real
        period = 2 * np.pi / abs(root.imag)
        orbit = ss.integrate(slider, 6 * period, x0=x + kick[0], v0=-kick[1], state=kick[2:], tolerance=1e-12)
        w = speed - orbit.at(np.array([1.0, 5.0]) * period)[1]
        assert np.log((w[1] - speed) / (w[0] - speed)) / (4 * period) == pytest.approx(root.real, rel=0.02)


def test_a_step_of_velocity_fades_over_both_lengths():
    # Slip law at constant V: ψᵢ + ln(V/V₀) = ln(V/V₁) exp(−x/Lᵢ); F/N = μ₀ + a ln(V/V₀) + Σ bᵢ ψᵢ (asinh y = ln 2y here).
    law = replace(TWO, law="slip")
    t = np.linspace(0, 1.5, 301)
    force, state = law.follow(t, np.full_like(t, 3.0), state=law.steady_state(0.5))
    fade = np.log(6.0) * np.exp(-3.0 * t[:, None] / np.array([1.0, 0.2]))
    np.testing.assert_allclose(state, fade - np.log(3.0), rtol=0, atol=1e-13)
    np.testing.assert_allclose(force, 0.6 + 0.01 * np.log(3.0) + state @ np.array([0.008, 0.006]), rtol=0, atol=1e-13)


@pytest.mark.parametrize("form", RATES)
@pytest.mark.parametrize("second", [False, True], ids=["one state", "two states"])
def test_a_state_follows_its_textbook_equation_in_slip_and_at_rest(form, second):
    # A step up, a hold, a slow slip; θ by scipy.
    lengths = [1e-5, 2e-6] if second else [1e-5]
    law = law_of(form, **({"second_b": 0.004, "second_length": 2e-6} if second else {}))
    share = 2 if form == "perrin-rice-zheng" else 1
    speeds, spans = (1e-5, 0.0, 3e-8), (0.7, 300.0, 100.0)
    z = np.atleast_1d(law.steady_state(1e-6))
    steady = np.exp(lambertw(np.exp(-10.0)).real) if form == "composite" else 1.0
    theta = steady * share * np.array(lengths) / 1e-6
    np.testing.assert_allclose(np.exp(z), 1e-6 * theta / (share * np.array(lengths)), rtol=1e-12)
    for w, span in zip(speeds, spans, strict=True):
        run = solve_ivp(
            lambda _, y, w=w: [RATES[form](w, one, length) for one, length in zip(y, lengths, strict=True)],
            (0, span),
            theta,
            method="LSODA",
            rtol=1e-12,
            atol=1e-12 * theta.min(),
        )
        theta = run.y[:, -1]
        force, state = law.follow([0.0, span], [w, w], state=z if second else z[0])
        z = np.atleast_1d(state[-1])
        psi = np.log(1e-6 * theta / (share * np.array(lengths)))
        np.testing.assert_allclose(z, psi, rtol=0, atol=1e-9)
        effects = np.array([0.015, 0.004])[: len(lengths)] @ psi
        assert force[-1] == pytest.approx(1e5 * np.arcsinh(w / 2e-6 * np.exp((0.6 + effects) / 0.01)), rel=1e-6)
        rates = [RATES[form](w, one, length) / one for one, length in zip(theta, lengths, strict=True)]
        np.testing.assert_allclose(np.atleast_1d(law.rates(w, state[-1])[1]), rates, rtol=1e-6, atol=1e-12)


def test_steady_slip_of_other_evolution_laws():
    # θ = 2L/V of Perrin, Rice & Zheng; |w| θ/L = exp W(exp(−|w|/V_c)) of Kato & Tullis.
    w = np.array([1e-9, 1e-7, 1e-5])
    assert law_of("perrin-rice-zheng").kinetic_force(w) == pytest.approx(ROCK.kinetic_force(w), rel=1e-14)
    state = law_of("composite").steady_state(w)
    assert state + np.log(w / 1e-6) == pytest.approx(lambertw(np.exp(-w / 1e-7)).real, abs=1e-13)


@pytest.mark.parametrize("form", FORMS)
def test_a_second_state_without_effect_or_with_the_same_length_changes_no_motion(form):
    one = replace(ONE, b=0.014, law=form)
    slider = ss.Oscillator(0.0, 1.0, one, mass=0.02, stiffness=0.02)
    t = np.linspace(0, 20, 201)
    known = ss.integrate(slider, 20, x0=25.0, v0=0.3, tolerance=1e-12)
    assert np.ptp(known.at(t)[1]) > 0.5
    same = replace(one, b=0.008, second_b=0.006, second_length=1.0)
    for law in (replace(one, second_b=0.0, second_length=0.2), same):
        found = ss.integrate(replace(slider, law=law), 20, x0=25.0, v0=0.3, tolerance=1e-12)
        np.testing.assert_allclose(found.at(t), known.at(t), atol=1e-8)
        np.testing.assert_allclose(found.state(t)[:, 0], known.state(t), atol=1e-8)
    # What is followed without an integrator is the same to the bit where b₂ is 0.
    first, second = one.follow(t, np.cos(t)), replace(one, second_b=0.0, second_length=0.2).follow(t, np.cos(t))
    assert (first[0] == second[0]).all()
    assert (first[1] == second[1][:, 0]).all()


def textbook(t, y, law, mass, stiffness):
    """x, w = 1 − ẋ and ln θᵢ/Lᵢ with the aging law, V₀ = 1 and the force 0.003 cos 0.8 t on the mass."""
    x, w, *psi = y
    friction = law.a * np.arcsinh(w / 2 * np.exp((0.6 + law.b * psi[0] + law.second_b * psi[1]) / law.a))
    rates = [(np.exp(-one) - abs(w)) / length for one, length in zip(psi, (law.length, law.second_length), strict=True)]
    return [1.0 - w, (stiffness * x - friction - 0.003 * np.cos(0.8 * t)) / mass, *rates]


@pytest.mark.slow
def test_a_periodic_orbit_with_two_states_closes_under_another_integrator_and_has_its_multipliers():
    mass = 0.02
    stiffness = 1.3 * critical(TWO, 1.0, mass)[1]
    slider = ss.Oscillator(0.0, 1.0, TWO, mass=mass, stiffness=stiffness, forcing=ss.Harmonic(0.003, 0.8))
    cycle = ss.periodic_orbit(slider, (0.6 / stiffness, 0.0, [0.0, 0.0]), t_end=400.0)
    assert cycle.period == pytest.approx(2 * np.pi / 0.8, rel=1e-12)
    assert np.ptp(cycle.orbit.state(np.linspace(0, cycle.period, 101)), axis=0).min() > 0.1

    def flown(y, law=TWO):
        whole = (0, cycle.period)
        run = solve_ivp(textbook, whole, y, args=(law, mass, stiffness), method="LSODA", rtol=1e-12, atol=1e-13)
        return run.y[:, -1]

    np.testing.assert_allclose(flown(cycle.start), cycle.start, atol=1e-8)
    steps = 1e-4 * np.diag(cycle.flow.sizes)
    matrix = np.stack([(flown(cycle.start + h) - flown(cycle.start - h)) / (2 * h.max()) for h in steps], axis=1)
    found = np.linalg.eigvals(matrix)
    assert len(cycle.multipliers) == 4
    np.testing.assert_allclose(np.sort(np.abs(cycle.multipliers)), np.sort(np.abs(found)), atol=1e-6)
    assert cycle.state[3].shape == (2,)
    np.testing.assert_allclose(cycle.orbit.at(cycle.period), cycle.state[1:3], atol=1e-8)
    (branch,) = ss.continuation(slider, "law.second_b", (0.0055, 0.0065), guess=cycle, seeds=0).branches
    assert (min(branch.values), max(branch.values)) == (0.0055, 0.0065)
    for value, one in list(zip(branch.values, branch.orbits, strict=True))[:: len(branch.values) - 1]:
        np.testing.assert_allclose(flown(one.start, replace(TWO, second_b=value)), one.start, atol=1e-7)


def test_two_states_are_a_last_axis_of_what_an_orbit_says(tmp_path):
    slider = ss.Oscillator(0.0, 1.0, TWO, mass=0.02, stiffness=0.02)
    orbit = ss.simulate(slider, 10, x0=25.0)
    motion = orbit.to_xarray([0.0, 1.0, 2.0])
    assert motion["state"].dims == ("time", "state_variable")
    assert motion["force"].dims == ("time",)
    assert orbit.state(1.0).shape == (2,)
    assert orbit.state([[1.0, 2.0]]).shape == (1, 2, 2)
    force, rate = TWO.rates(motion["slip_velocity"], motion["state"])
    np.testing.assert_allclose(force, motion["force"], rtol=1e-12)
    assert rate.shape == (3, 2)
    np.testing.assert_allclose(
        orbit.events[["state", "second_state"]].to_numpy(), orbit.state(orbit.events["t"].to_numpy()), atol=1e-12
    )
    assert orbit.save(tmp_path / "orbit.nc").exists()
    # It goes on from its own state.
    x, v = orbit.at(4.0)
    rest = ss.integrate(slider, 6, x0=x, v0=v, state=orbit.state(4.0))
    np.testing.assert_allclose(rest.at(6.0), orbit.at(10.0), atol=1e-6)


def test_masses_with_one_and_with_two_states_side_by_side():
    contacts = [ss.Contact(0, TWO, 1.0), ss.Contact(1, ONE, 1.0)]
    apart = ss.System([0.02, 0.02], [[0.02, 0.0], [0.0, 0.02]], 0.0, contacts)
    orbit = ss.simulate(apart, 5, x0=[25.0, 25.0])
    state = orbit.state(3.0)
    assert state.shape == (2, 2)
    assert np.isnan(state).tolist() == [[False, False], [False, True]]
    assert orbit.to_xarray([1.0])["state"].dims == ("time", "contact", "state_variable")
    for i, law in enumerate((TWO, ONE)):
        alone = ss.simulate(ss.Oscillator(0.0, 1.0, law, mass=0.02, stiffness=0.02), 5, x0=25.0)
        assert orbit.at(3.0)[0][i] == pytest.approx(alone.at(3.0)[0], abs=1e-7)
        assert state[i][: law.states] == pytest.approx(np.atleast_1d(alone.state(3.0)), abs=1e-7)
    again = ss.integrate(apart, 2, *orbit.at(3.0), state=state)
    np.testing.assert_allclose(again.at(2.0)[0], orbit.at(5.0)[0], atol=1e-6)
    with pytest.raises(
        ss.InputError, match=r"state must have the shape \(2, 2\), the state variables last, got \(2,\)"
    ):
        ss.integrate(apart, 2, state=[0.0, 0.0])
    with pytest.raises(ss.InputError, match="state must be a finite number, got nan"):
        ss.integrate(apart, 2, state=[[0.0, np.nan], [0.0, np.nan]])


def test_the_second_length_is_measured_by_the_units_of_a_scale():
    slider = ss.Oscillator(0.0, 1.0, replace(TWO, law="composite", cutoff_velocity=0.5), mass=0.02, stiffness=0.02)
    small, scale = ss.dimensionless(slider, force=0.01)
    assert small.law.second_length == pytest.approx(0.2 * scale.stiffness / scale.force, rel=1e-14)
    assert small.law.cutoff_velocity == pytest.approx(0.5 / scale.velocity, rel=1e-14)
    found, known = ss.simulate(small, 5.0 / scale.time, x0=25.0 * 0.02 / 0.01), ss.simulate(slider, 5.0, x0=25.0)
    np.testing.assert_allclose(found.state(5.0 / scale.time), known.state(5.0), atol=1e-7)


def test_a_motion_with_two_states_and_no_event_has_an_empty_table():
    orbit = ss.integrate(ss.Oscillator(0.0, 1.0, TWO), 1e-3, x0=0.6, state=[0.0, 0.0])
    assert orbit.events.empty
    assert list(orbit.events)[-2:] == ["state", "second_state"]


@pytest.mark.parametrize("w", [1e-6, 0.01, 0.3, 1.0, 30.0])
@pytest.mark.parametrize("start", [-30.0, -2.0, 0.0, 3.0, 12.0])
def test_the_composite_law_is_followed_to_its_accuracy_from_any_state(w, start):
    # With u = |w| θ/L over the path in lengths: u' = exp(−|w|/V_c) − u ln u, or φ' = exp(−|w|/V_c − φ) − φ for φ = ln u.
    law, aging = replace(ONE, law="composite", cutoff_velocity=0.5), np.exp(-w / 0.5)
    paths = np.array([0.0, 0.01, 0.3, 2.0, 20.0, 100.0])
    phi, options = start + np.log(w), {"method": "DOP853", "rtol": 1e-13, "t_eval": paths}
    if phi > 0:
        known = solve_ivp(lambda _, phi: aging * np.exp(-phi) - phi, (0, 100), [phi], atol=1e-14, **options).y[0]
    else:
        known = np.log(
            solve_ivp(lambda _, u: aging - u * np.log(u), (0, 100), [np.exp(phi)], atol=1e-25, **options).y[0]
        )
    _, found = law.follow(paths / w, np.full(6, w), state=start)
    np.testing.assert_allclose(found + np.log(w), known, rtol=0, atol=1e-9)


def test_a_diagram_over_two_states_goes_on_from_where_the_motion_before_ended():
    slider = ss.Oscillator(0.0, 1.0, TWO, mass=0.02, stiffness=0.02)
    diagram = ss.orbit_diagram(slider, "stiffness", [0.02, 0.021], direction="up", periods=2, keep=1, x0=25.0)
    assert diagram.sizes["number"] == 2
    assert np.isfinite(diagram["restart"]).all()


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: replace(ONE, second_b=0.1), "RateState: second_b and second_length make a second state: give both"),
        (lambda: replace(ONE, second_length=0.1), "give both of them or none"),
        (lambda: replace(TWO, second_length=0.0), "second_length must be greater than 0, got 0"),
        (lambda: replace(ONE, law="composite"), "the composite law needs its cutoff_velocity"),
        (lambda: replace(ONE, cutoff_velocity=1.0), "only the composite law has a cutoff_velocity"),
        (lambda: TWO.rates([1.0, 2.0, 3.0], [0.0, 0.0, 0.0]), "the 2 numbers of the law as its last axis"),
        (lambda: TWO.follow([0.0, 1.0], [1.0, 1.0], state=[0.0]), r"follow: state must have the shape \(2,\), got \(1,\)"),
        (lambda: ONE.follow([0.0, 1.0], [1.0, 1.0], state=[0.0, 1.0]), r"state must have the shape \(\), got \(2,\)"),
    ],
)  # fmt: skip
def test_what_makes_no_second_state_is_refused_in_one_sentence(refused, make, sentence):
    refused(sentence, make)


def quasi_dynamic_returns(law, stiffness, damping, psi, t_end):
    """When w rises through V₀ = s, and ψ there, without any mass: d ẋ + k x = F(w, ψ) differentiated, in ln w."""

    def rates(_, y):
        w = np.exp(y[0])
        share = 1 / np.sqrt(1 + 4 * np.exp(-2 * (y[0] + (0.6 + law.b * y[1]) / law.a)))
        ageing = np.exp(-y[1]) - w
        return [(stiffness * (1 - w) - law.b * share * ageing) / (law.a * share + damping * w), ageing]

    def passes(_, y):
        return y[0]

    passes.direction = 1
    done = solve_ivp(rates, (0, t_end), [0.0, psi], method="Radau", rtol=1e-8, atol=1e-8, events=passes)
    return done.t_events[0], done.y_events[0][:, 1]


@pytest.mark.slow
def test_a_slider_without_mass_obeys_the_quasi_dynamic_equations():
    # With radiation damping d the critical stiffness is (N (b − a) − d V)/L = 0.004; below it cycles, stable ones here.
    law, damping, stiffness = replace(ONE, b=0.015), 1e-3, 0.0035
    cycles = []
    for mass in (0.0, 1e-8):
        slider = ss.Oscillator(damping, 1.0, law, mass=mass, stiffness=stiffness)
        cycles.append(ss.periodic_orbit(slider, ((law.kinetic_force(1.0) + 0.01) / stiffness, 0.0), t_end=80.0))
    times, psi = quasi_dynamic_returns(law, stiffness, damping, 0.55, 450.0)
    assert cycles[0].period == pytest.approx(np.diff(times)[-1], rel=1e-7)
    assert cycles[1].period == pytest.approx(cycles[0].period, rel=1e-5)
    # A disturbance decays from return to return by the multiplier, here from the sixth to the tenth.
    steps = np.diff(psi)
    assert (steps[10] / steps[6]) ** 0.25 == pytest.approx(cycles[0].largest, rel=5e-3)


@pytest.mark.parametrize("stiffness", [0.0038, 0.0042])
def test_steady_slip_without_mass_loses_its_stability_at_the_known_stiffness(stiffness):
    law = replace(ONE, b=0.015)
    slider = ss.Oscillator(1e-3, 1.0, law, mass=0.0, stiffness=stiffness)
    orbit = ss.integrate(slider, 200.0, law.kinetic_force(1.0) / stiffness, state=1e-3)
    x = orbit.variables(np.linspace(0, 200, 2001))[:, 0]
    # With w = 1 + y, so that ψ̇ = −ψ − y: the balance of forces, once differentiated, is (a + d) ẏ = (b − k) y + b ψ.
    growth = np.linalg.eigvals([[(0.015 - stiffness) / 0.011, 0.015 / 0.011], [-1.0, -1.0]])
    assert np.log(np.ptp(x[1500:]) / np.ptp(x[:500])) == pytest.approx(150 * growth.real.max(), rel=0.05)


@pytest.mark.slow
def test_two_coupled_sliders_without_mass_obey_their_equations():
    law, damping = replace(ONE, b=0.015), 1e-3
    k = np.array([[0.0045, -0.001], [-0.001, 0.0045]])
    second = replace(law, law="slip", a=0.012, second_b=0.004, second_length=0.3)
    contacts = [ss.Contact(0, law, 1.0), ss.Contact(1, second, ss.Drive(1.0, harmonics=ss.Harmonic(0.2, 0.3)))]
    system = ss.System([0.0, 0.0], k, damping, contacts, ss.Force(2e-3, 0.7, mass=0))
    x0 = np.linalg.solve(k, [0.601, 0.6])
    orbit = ss.integrate(system, 40.0, x0)
    # The slip velocities at which the forces balance, by bisection at every evaluation; ψ from there.

    def velocities(t, x, z):
        pushes = [2e-3 * np.cos(0.7 * t), 0.0]
        drives = [1.0, 1.0 + 0.2 * np.cos(0.3 * t)]
        w = np.empty(2)
        for i, one in enumerate((law, second)):
            load = damping * drives[i] + k[i] @ x - pushes[i]
            grown = np.exp((0.6 + one.b * z[i][0] + 0.004 * z[i][1:].sum()) / one.a)

            def excess(w, a=one.a, grown=grown, load=load):
                return a * np.arcsinh(0.5 * w * grown) + damping * w - load

            w[i] = brentq(excess, 1e-9, 1e3, xtol=1e-15)
        return w, np.array(drives) - w

    def rates(t, y):
        x, z = y[:2], (y[2:3], y[3:])
        w, v = velocities(t, x, z)
        slips = [-w[1] * (np.log(w[1]) + z[1][0]), -w[1] / 0.3 * (np.log(w[1]) + z[1][1])]
        return [*v, np.exp(-z[0][0]) - w[0], *slips]

    known = solve_ivp(rates, (0, 40), [*x0, 0.0, 0.0, 0.0], method="Radau", rtol=1e-9, atol=1e-9)
    assert orbit.at(40.0)[0] == pytest.approx(known.y[:2, -1], rel=1e-7)
    _, v = velocities(40.0, known.y[:2, -1], (known.y[2:3, -1], known.y[3:, -1]))
    assert orbit.at(40.0)[1] == pytest.approx(v, abs=1e-5)


@pytest.mark.long
def test_what_has_no_mass_is_refused_where_forces_do_not_balance_in_one_way():
    law = replace(ONE, b=0.015)
    slider = ss.Oscillator(1e-3, 1.0, law, mass=0.0, stiffness=0.0035)
    with pytest.raises(ss.InputError, match="mass must be greater than 0"):
        replace(slider, law=ss.laws.Coulomb(0.5))
    with pytest.raises(ss.InputError, match="mass may be 0 only where every mass rubs once"):
        ss.System([0, 0], [1, 1], 0.1, ss.Contact(0, law, 1.0))
    with pytest.raises(ss.InputError, match=r"balance at the velocity .* leave v0 out"):
        ss.integrate(slider, 10.0, 170.0, 0.9, state=0.1)
    # Without damping slip becomes infinite in a finite time on a spring below the critical one.
    with pytest.raises(ss.InputError, match="may become infinite in a finite time"):
        ss.integrate(replace(slider, damping=0.0), 100.0, 165.0)
    with pytest.raises(ss.InputError, match="give the unit of mass"):
        ss.dimensionless(slider, force=1.0)
    assert type(slider).from_dict(slider.to_dict()) == slider


@pytest.mark.long
def test_exponents_of_a_motion_that_rests_first_are_numbers():
    slider = ss.Oscillator(1e-3, 1.0, replace(ONE, b=0.015), stiffness=0.0035)
    exponents = ss.lyapunov(slider, 500.0).exponents
    assert np.isfinite(exponents).all()
    assert exponents.max() < 0.01
