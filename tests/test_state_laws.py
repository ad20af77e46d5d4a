"""Laws with an internal state against cases of the literature and against their limits."""

import copy
import pickle
import tracemalloc

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import stickslip as ss
from stickslip.laws import Law

LUGRE = ss.laws.LuGre(1e5, 316.22776601683796, 0.4, kinetic=1.0, break_away=1.5, scale=1e-3)
LAWS = [
    ss.laws.Dahl(2.0, 1.0),
    ss.laws.Dahl(2.0, 1.0, 1.5),
    LUGRE,
    ss.laws.ElastoPlastic(1e5, 316.0, 0.4, kinetic=1.0, break_away=1.5, scale=1e-3, elastic=0.9),
    ss.laws.BoucWen(2.0, 3.0, 1.0, exponent=2),
    ss.laws.RateState(1e7, 0.01, 0.015, 1e-5, 1e-6),
    ss.laws.RateState(1e7, 0.01, 0.015, 1e-5, 1e-6, law="slip"),
    ss.laws.Regularised(ss.laws.Rational(1.0, 3.0), 1e-3),
    ss.laws.Regularised(ss.laws.PiecewiseLinear([(0, 1), (0.2, 0.6)], 1.0), 1e-3, shape="tanh"),
    ss.laws.RateState(1e7, 0.01, 0.015, 1e-5, 1e-6, second_b=0.004, second_length=2e-6),
    ss.laws.RateState(1e7, 0.01, 0.015, 1e-5, 1e-6, law="perrin-rice-zheng"),
    ss.laws.RateState(1e7, 0.01, 0.015, 1e-5, 1e-6, law="composite", cutoff_velocity=1e-7),
]


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_every_law_with_a_state_is_a_document_that_comes_back(law):
    law.rates(0.1, 0.0)
    assert Law.from_dict(law.to_dict()) == law
    assert pickle.loads(pickle.dumps(law)) == law == copy.deepcopy(law)
    oscillator = ss.Oscillator(0.0, 0.1, law)
    assert ss.Oscillator.from_dict(oscillator.to_dict()) == oscillator


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_steady_state_rests_and_the_two_directions_are_alike(law):
    w = np.array([1e-7, 1e-3, 0.3])
    force, rate = law.rates(w, law.steady_state(w))
    assert np.abs(rate).max() <= 1e-12 * max(1.0, np.abs(law.rates(w, 0.0)[1]).max())
    assert law.kinetic_force(-w) == pytest.approx(-force)
    assert (force > 0).all()


@pytest.mark.parametrize("law", LAWS[:7], ids=lambda law: type(law).__name__)
def test_state_along_a_motion_obeys_its_rate(law):
    # dz/dt of the followed state, by differences, is the law's own rate.
    speed = 1e-6 if isinstance(law, ss.laws.RateState) else 0.02
    start = law.steady_state(0.5 * speed) * 0.3
    span = 1e-7 if law in (LUGRE, LAWS[3]) else 1e-5
    t = np.linspace(0, span / speed, 2001)
    _, z = law.follow(t, np.full_like(t, speed), state=start)
    slope = np.gradient(z, t)[1:-1]
    rate = law.rates(speed, z)[1][1:-1]
    assert slope == pytest.approx(rate, rel=1e-5, abs=1e-8 * np.abs(rate).max())


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: ss.laws.Dahl(-1, 1), "stiffness must be greater than 0, got -1"),
        (lambda: ss.laws.LuGre(1, -1, 0, 1, 1, 1), "damping must not be negative, got -1"),
        (lambda: ss.laws.ElastoPlastic(1, 0, 0, 1, 1.5, 1, elastic=1.2), r"elastic must be less than .* \(1\), got 1.2"),
        (lambda: ss.laws.BoucWen(1, 1, 2), "gamma must lie in .*, got 2"),
        (lambda: ss.laws.BoucWen(1, 1, 0, exponent=0.5), "exponent must be at least 1, got 0.5"),
        (lambda: ss.laws.RateState(1, 0.01, 0.015, 1, 1, law="agin"), "law must be one of aging, slip, .* mean 'aging'"),
        (lambda: ss.laws.Regularised(ss.laws.Coulomb(1), 0), "width must be greater than 0, got 0"),
        (lambda: ss.laws.Regularised(ss.laws.BogaczRyczek(), 1e-3), "law must be memoryless"),
        (lambda: ss.laws.Regularised(ss.laws.DwellTime(1, 1, 1), 1e-3), "law must be memoryless"),
        (lambda: ss.laws.Regularised(LUGRE, 1e-3), "law must be a memoryless friction law"),
        (lambda: ss.laws.Regularised(ss.laws.Coulomb(1), 1, "arctg"), "shape must be one of arctan, tanh"),
        (lambda: LUGRE.break_away_force(), "LuGre: has no break-away force"),
        (lambda: LUGRE.follow([0, 1], [0]), "same length, got 2 and 1"),
        (lambda: LUGRE.follow([1, 0], [0, 0]), "t must not fall"),
        (lambda: LUGRE.follow([0, 1], [0, np.nan]), "w must be finite, got nan"),
        (lambda: ss.integrate(ss.paper.oscillator(0.3), 10), "BogaczRyczek has no internal state; use stickslip.simulate"),
        (lambda: ss.integrate(ss.Oscillator(0, 0.1, LUGRE), 10, method="radau"), "method must be one of .* mean 'Radau'"),
        (lambda: ss.integrate(ss.Oscillator(0, 0.1, LUGRE), 10, tolerance=1e-20), "tolerance must lie in"),
        (lambda: ss.integrate(ss.Oscillator(0, 0.1, LUGRE), -1), "t_end must be greater than 0, got -1"),
        (lambda: ss.integrate(ss.Oscillator(0, 0.1, LUGRE), 10, max_evaluations=99), "Radau came to t = .* in 99"),
        (lambda: ss.simulate(ss.Oscillator(0, 0.1, LUGRE), 1).at(2), r"t must lie in \[0, 1\]"),
        (lambda: ss.simulate(ss.Oscillator(0, 0.1, LUGRE), 1).segments, "under a law with an internal state is smooth"),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused_in_one_sentence(refused, make, sentence):
    refused(sentence, make)


def _upcrossings(orbit, w):
    t = np.linspace(0, orbit.t_end, 40_001)
    speed = orbit.system.drive_velocity - orbit.at(t)[1]
    up = np.flatnonzero((speed[:-1] < w) & (speed[1:] >= w))
    return [brentq(lambda t: orbit.system.drive_velocity - orbit.at(t)[1] - w, t[i], t[i + 1], xtol=1e-13) for i in up]


@pytest.mark.slow
def test_lugre_with_stiff_bristles_is_stribeck_friction_with_adhesion():
    # σ₀ → ∞ with σ₁ = √σ₀: the period tends to that of the law with true adhesion, about as σ₀ to the power −1/2.
    sharp = ss.laws.ExponentialStribeck(break_away=1.5, kinetic=1.0, scale=0.05, viscous=0.4)
    orbit = ss.simulate(ss.Oscillator(0.0, 0.1, sharp, stiffness=2.0), 60)
    limit = orbit.events.query("kind == 'release'")["t"].diff().iloc[-1]
    error = []
    for stiffness in (1e4, 1e6):
        law = ss.laws.LuGre(stiffness, stiffness**0.5, 0.4, 1.0, 1.5, 0.05, exponent=1)
        orbit = ss.simulate(ss.Oscillator(0.0, 0.1, law, stiffness=2.0), 60)
        error.append(limit - np.diff(_upcrossings(orbit, 0.05))[-1])
    assert 0 < error[1] < 0.1 * error[0] < 0.02


def test_regularised_law_tends_to_the_law_itself():
    # S5 is the limit of S6: the error of the period falls about as the width does to the power 2/3.
    exact = 12.00103129483058
    error = [exact - period for period in (9.70968083, 11.29815066, 11.80799363, 11.95188006, 11.98920011)]
    slope = np.diff(np.log(error)) / np.log(0.1)
    assert (slope > 0.5).all()
    assert (slope < 0.7).all()


@pytest.mark.slow
def test_s17_slip_law_runs_away_beyond_its_separatrix():
    # At the critical stiffness, with u = φ + ψ, the quasi-static slip law runs away beyond the invariant line
    # u = 1 − (1 − a/b) e^(−φ), for ψ = 0 from φ = 0.858774 on (substitute the line into φ′, ψ′). Below it the peak is that of
    # the quasi-static equations (DOP853 at 1e-12); above it inertia alone ends the run.
    law = ss.laws.RateState(1e7, 0.01, 0.015, 1e-5, 1e-6, law="slip")
    peaks = []
    for phi in (0.85, 0.86):
        w = 1e-6 * np.exp(phi)
        oscillator = ss.Oscillator(0.0, 1e-6, law, mass=1e-3, stiffness=5e9)
        orbit = ss.integrate(
            oscillator, 15, x0=float(law.rates(w, 0.0)[0]) / 5e9, v0=1e-6 - w, state=0.0, tolerance=1e-9
        )
        low, high = 0.0, orbit.t_end
        for _ in range(6):
            t = np.linspace(low, high, 20_001)
            w = 1e-6 - orbit.at(t)[1]
            top = int(np.argmax(w))
            low, high = t[max(top - 5, 0)], t[min(top + 5, 20_000)]
        peaks.append(np.log(w.max() / 1e-6))
    assert peaks[0] == pytest.approx(8.266959, abs=1e-4)
    assert peaks[1] > 18


@pytest.mark.parametrize("mass", [10.0, 1e12])
def test_s17_critical_stiffness(mass):
    # Linear stability: k_c = N (b − a)/L (1 + m V₀²/(N a L)), 5e9 without inertia and 1e10 for 1e12 kg; period 2π/ω_c =
    # 88.857 s at k_c. Small motions grow below and decay above.
    law = ss.laws.RateState(normal_force=1e7, a=0.01, b=0.015, length=1e-5, reference_velocity=1e-6)
    critical = {10.0: 5e9, 1e12: 1e10}[mass]
    grown = []
    for factor in (0.95, 1.05):
        oscillator = ss.Oscillator(0.0, 1e-6, law, mass=mass, stiffness=factor * critical)
        x = law.kinetic_force(1e-6) / (factor * critical)
        orbit = ss.integrate(oscillator, 600, x0=x * (1 + 1e-6), v0=0.0, state=0.0)
        w = np.abs(orbit.at(np.linspace(0, 600, 6001))[1])
        grown.append(w[-1000:].max() / w[1000:2000].max())
        turns = orbit.events.query("kind == 'turn'")["t"].to_numpy()
        assert np.mean(turns[4:] - turns[2:-2]) == pytest.approx(88.85765876316732, rel=0.04)
    assert grown[0] > 1.1
    assert grown[1] < 0.9


def test_bouc_wen_of_exponent_one_is_dahl():
    # β = k/f_k, γ = 0, A = 1; one is followed by Runge-Kutta, the other exactly.
    t = np.linspace(0, 30, 3001)
    w = np.sin(t) + 0.4 * np.sin(2.7 * t)
    dahl = ss.force_along(ss.laws.Dahl(stiffness=2.0, kinetic=0.8), t, w)
    bouc = ss.force_along(ss.laws.BoucWen(stiffness=2.0, beta=2.5, gamma=0.0), t, w)
    assert bouc == pytest.approx(dahl, abs=1e-9)


@pytest.mark.slow
def test_elasto_plastic_contact_does_not_drift_where_lugre_does():
    # Below break-away: the same small oscillating load around a mean, Dupont et al. 2002, Fig. 5.
    drift = {}
    for law in (LUGRE, ss.laws.ElastoPlastic(1e5, 316.0, 0.4, 1.0, 1.5, 1e-3, elastic=0.95)):
        oscillator = ss.Oscillator(0.0, 0.0, law, stiffness=1e-3, forcing=ss.Harmonic(0.4, 5.0))
        orbit = ss.integrate(oscillator, 60, x0=-400.0, v0=0.0, tolerance=1e-8)
        period = 2 * np.pi / 5
        x = orbit.at(np.array([10, 40]) * period)[0]
        drift[type(law).__name__] = abs(x[1] - x[0])
    assert drift["LuGre"] > 1e-8
    assert drift["ElastoPlastic"] < 1e-2 * drift["LuGre"]


def test_brittle_and_ductile_dahl_agree_with_their_rate():
    for exponent in (0.5, 2.0):
        law = ss.laws.Dahl(2.0, 1.0, exponent)
        t = np.linspace(0, 0.3, 3001)
        force, _ = law.follow(t, np.ones_like(t))
        assert np.gradient(force, t)[1:-1] == pytest.approx(law.rates(1.0, force)[1][1:-1], rel=1e-5)


def test_orbit_of_a_law_with_a_state_answers_as_others_do(tmp_path):
    oscillator = ss.Oscillator(damping=0.0, drive_velocity=0.1, law=LUGRE, stiffness=2.0)
    orbit = ss.simulate(oscillator, 30)
    motion = orbit.to_xarray()
    assert {"x", "v", "a", "slip_velocity", "force", "stuck", "state"} <= set(motion)
    rest = motion["a"] + 2.0 * motion["x"] - motion["force"]
    assert float(np.abs(rest).max()) < 1e-12
    exact = ss.simulate(ss.Oscillator(0.1, 0.1, ss.laws.StaticKinetic(1.5, 1.0)), 30).events
    assert list(orbit.events) == [*exact, "state"]
    assert set(orbit.events["kind"]) <= {"crossing", "turn"}
    assert orbit.stop == "t_end"
    assert orbit.regime() == "stick_slip"
    assert orbit.work.evaluations < 60_000
    assert orbit.save(tmp_path / "orbit.nc").exists()
    short = ss.simulate(oscillator, 30, max_events=2)
    assert short.stop == "max_events"
    assert short.t_end < 30


def test_adhesion_that_creeps_within_the_error_of_the_integration_makes_no_events():
    # From slip to rest at t = 0.3475, where friction changes by exp(60) times the slip velocity, and a long rest after it.
    slider = ss.Oscillator(0.1, 0.2, ss.laws.RateState.example())
    orbit = ss.simulate(slider, 0.5, v0=0.0)
    assert orbit.stop == "t_end"
    assert len(orbit.events) == 0
    assert 0 < orbit.to_xarray([0.45])["slip_velocity"].item() < 1e-20


@pytest.mark.long
@pytest.mark.parametrize(
    "node", [pytest.param(3.0, marks=pytest.mark.slow), pytest.param(3.4, marks=pytest.mark.slow), 5.0]
)
def test_a_step_shorter_than_the_clock_can_tell_ends_no_run(node):
    # ṡ jumps at the node, after which the state moves faster than LSODA expects: its first step does not change t.
    law = ss.laws.RateState(
        normal_force=0.9, a=0.46, b=0.48, length=0.026, reference_friction=10.5, reference_velocity=0.118,
        law="perrin-rice-zheng", second_b=0.69, second_length=0.0101,
    )  # fmt: skip
    oscillator = ss.Oscillator(
        0.0, ss.Drive(-0.43, nodes=[[node, 0.0], [node + 4.5, 0.48]]), law, stiffness=1.98, mass=1.64
    )
    ends = [
        ss.integrate(oscillator, node + 2, 0.97, 0.0, tolerance=1e-10, method=method).at(node + 2)
        for method in ("LSODA", "Radau")
    ]
    np.testing.assert_allclose(ends[0], ends[1], rtol=0, atol=1e-7)


def test_rate_and_state_friction_that_is_almost_viscous_is_as_exact_as_other_friction():
    """u of friction N a u is below 1e-3 here: an error of 1e-10 of u would be one of 1e-7 of the slip velocity."""
    a, b, length, reference, bulk, s, damping = 0.05, 0.15, 0.3, 0.01, 0.1, 1.0, 0.02
    law = ss.laws.RateState(1.0, a, b, length, reference, reference_friction=bulk)
    t = np.linspace(0.0, 20.0, 101)

    def rates(_, y):
        x, w, psi = y
        friction = a * np.arcsinh(w / (2 * reference) * np.exp((bulk + b * psi) / a))
        return [s - w, x + damping * (s - w) - friction, (reference * np.exp(-psi) - abs(w)) / length]

    start = [0.3, s - 0.2, -np.log((s - 0.2) / reference)]
    own = solve_ivp(rates, (0.0, 20.0), start, "DOP853", t, rtol=1e-13, atol=1e-15).y
    orbit = ss.simulate(ss.Oscillator(damping, s, law), 20.0, 0.3, 0.2)
    assert np.abs(orbit.to_xarray(t).slip_velocity.to_numpy() - own[1]).max() < 5e-8


def test_a_long_run_that_spends_its_evaluations_is_kept():
    slider = ss.Oscillator(
        damping=0.0, drive_velocity=0.1, law=ss.laws.LuGre(1e5, 316.0, 0.4, 1.0, 1.5, 1e-3), stiffness=2
    )
    short = ss.integrate(slider, 100.0, max_evaluations=60_000)
    assert short.stop == "max_evaluations"
    assert 50 < short.t_end < 100
    # The first of two methods takes half of them, and no step twice.
    assert short.work.evaluations == 30_000
    assert short.regime() == "stick_slip"
    assert "stickslip.integrate takes more" in short.stop_sentence
    whole = ss.integrate(slider, 60.0)
    assert abs(short.at(50.0)[0] - whole.at(50.0)[0]) < 1e-6


@pytest.mark.parametrize("start", [0.1, 2.0])
@pytest.mark.parametrize(
    "law",
    [
        ss.laws.LuGre(100.0, 1.0, 0.1, kinetic=0.5, break_away=0.8, scale=0.1),
        ss.laws.Regularised(ss.laws.Coulomb(0.5), 1e-2),
    ],
    ids=lambda law: type(law).__name__,
)
def test_a_mass_at_rest_on_a_drive_that_stands_still_is_at_rest(law, start):
    slider = ss.Oscillator(0.05, 0.0, law)
    orbit = ss.simulate(slider, 2000.0, x0=start)
    assert orbit.regime() == "at_rest"
    if law.has_state:
        # from where it rests there is not even a way to rest; a smooth sign only creeps on towards x = 0
        x, v = orbit.at(2000.0)
        assert ss.integrate(slider, 100.0, x, v, state=orbit.state(2000.0)).regime() == "at_rest"


def test_a_mass_that_a_force_shakes_is_not_at_rest():
    law = ss.laws.LuGre(100.0, 1.0, 0.1, kinetic=0.5, break_away=0.8, scale=0.1)
    shaken = ss.Oscillator(0.05, 0.0, law, forcing=ss.Harmonic(0.1, 0.7))
    assert ss.simulate(shaken, 200.0, x0=2.0).regime() != "at_rest"


def test_the_regime_of_a_long_creep_costs_no_more_than_its_integration():
    # 10 000 natural periods of creep would be two million looks, but the integration takes some thousand steps.
    slider = ss.Oscillator(0.1, 1e-4, ss.laws.LuGre(1e3, 3.0, 0.0, 0.5, 1.0, 0.1))
    orbit = ss.simulate(slider, 60_000.0)
    tracemalloc.start()
    try:
        assert orbit.regime() == "stable_slip"
        assert tracemalloc.get_traced_memory()[1] < 3e7
    finally:
        tracemalloc.stop()
