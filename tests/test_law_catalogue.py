"""Laws against limits, closed forms and cases of the literature, through the face of the package."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import stickslip as ss
from stickslip.dynamics.equilibria.steady_slip import steady_slip
from stickslip.laws import Law
from stickslip.model.parameters import document_of, varied


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
    rate = ss.laws.ForceRate(0.5, 0.4, 0.7, force_rate_scale=1e100, exponent=0.6)
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


def test_friction_of_two_branches_is_always_on_one_or_between_them():
    # Random tables, drives, forcings and starts: friction lies on the branch that the sign of ẇ asks for, or between the
    # branches where ẇ = 0, and every run comes to its end.
    random = np.random.default_rng(1)

    def table():
        return [(0.0, random.uniform(0.2, 1.5))] + [
            (w, random.uniform(0.2, 1.5)) for w in np.sort(random.uniform(0.05, 2, random.integers(0, 4)))
        ]

    held = 0
    for _ in range(200):
        rising, falling = table(), table()
        law = ss.laws.TwoBranch(rising, falling, max(rising[0][1], falling[0][1]) + random.uniform(0, 0.5))
        forcing = ss.Harmonic(random.uniform(0, 1), random.uniform(0.3, 3)) if random.random() < 0.5 else None
        oscillator = ss.Oscillator(random.uniform(0, 0.3), random.uniform(-1, 1), law, forcing=forcing)
        orbit = ss.simulate(oscillator, 60, x0=random.normal(), v0=random.normal(), max_events=20_000)
        assert orbit.stop == "t_end"
        motion = orbit.to_xarray(np.linspace(0, 60, 2001))
        w = motion["slip_velocity"].to_numpy()
        force, growth = motion["force"].to_numpy() * np.sign(w), -motion["a"].to_numpy() * np.sign(w)
        up, down = (np.interp(np.abs(w), *np.array(branch).T) for branch in (rising, falling))
        slips = ~motion["stuck"].to_numpy() & (np.abs(w) > 1e-6)
        moving, still = slips & (np.abs(growth) > 1e-7), slips & (growth == 0)
        assert np.abs(force - np.where(growth > 0, up, down))[moving].max(initial=0) < 1e-8
        assert np.maximum(down - force, force - up)[still].max(initial=0) < 1e-8
        held += still.sum()
    assert held > 1000


def test_law_with_a_state_comes_from_a_system_file(tmp_path):
    law = ss.laws.Regularised(ss.laws.Coulomb(0.5), width=1e-3)
    path = tmp_path / "system.toml"
    path.write_text(ss.Oscillator(0.1, 0.2, law).to_toml())
    system = ss.load_system(path)
    assert system.law == law
    assert ss.simulate(system, 300).regime() == "stable_slip"


def test_gaussian_weakening_is_that_curve_and_the_limit_of_its_table():
    law = ss.laws.ExponentialStribeck(1.0, 0.5, scale=0.2, viscous=0.1, exponent=2)
    w = np.array([0.0, 0.1, 0.2, 0.7])
    assert law.kinetic_force(w) == pytest.approx(0.5 + 0.5 * np.exp(-((w / 0.2) ** 2)) + 0.1 * w, rel=1e-15)
    nodes = [(u, law.kinetic_force(u)) for u in np.linspace(0, 2, 4001)]
    table = ss.laws.PiecewiseLinear(nodes, break_away=1.0)
    smooth, pieces = (ss.simulate(ss.Oscillator(0.05, 0.1, each), 60).events for each in (law, table))
    periods = [events["t"][events["kind"] == "release"].diff().iloc[-1] for events in (smooth, pieces)]
    assert periods[0] == pytest.approx(periods[1], rel=1e-6)
    with pytest.raises(ss.InputError, match=r"exponent must be 1 or 2, .*, got 1\.5"):
        ss.laws.ExponentialStribeck(1.0, 0.5, 0.2, exponent=1.5)


@pytest.mark.parametrize("kinetic", [-0.4, 0.0, 0.4])
def test_an_exponential_law_has_any_sign_of_its_kinetic_part(kinetic):
    # F = f_k + (1 − f_k) exp(−w/0.3) + 0.2 w, for f_k = −0.4 below zero from w = 0.46 to 2; motion by scipy.
    law = ss.laws.ExponentialStribeck(1.0, kinetic, scale=0.3, viscous=0.2)
    assert law.kinetic_force(0.6) == pytest.approx(kinetic + (1 - kinetic) * np.exp(-2.0) + 0.12, rel=1e-14)
    system = ss.Oscillator(0.05, 0.6, law)
    orbit = ss.simulate(system, 6.0, x0=0.1, v0=0.3)

    def rates(_, y):
        w = 0.6 - y[1]
        return [y[1], kinetic + (1 - kinetic) * np.exp(-w / 0.3) + 0.2 * w - 0.05 * y[1] - y[0]]

    end = orbit.events["t"].iloc[0] if len(orbit.events) else 6.0
    known = solve_ivp(rates, (0, end), [0.1, 0.3], method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    assert end > 0.4
    assert orbit.at(end) == pytest.approx(known, abs=1e-10)
    slope = 0.2 - (1 - kinetic) * np.exp(-2.0) / 0.3
    assert steady_slip(system).damping == pytest.approx(0.05 + slope, abs=1e-12)


def test_lorentzian_weakening_is_that_curve_and_the_limit_of_its_table():
    law = ss.laws.Lorentzian(1.0, 0.5, scale=0.2, viscous=0.1)
    w = np.array([0.0, 0.1, 0.2, 0.7])
    assert law.kinetic_force(w) == pytest.approx(0.5 + 0.5 / (1 + (w / 0.2) ** 2) + 0.1 * w, rel=1e-15)
    table = ss.laws.from_function(law.kinetic_force, w_max=2.0, error=1e-7)
    smooth, pieces = (ss.simulate(ss.Oscillator(0.05, 0.1, each), 60).events for each in (law, table))
    periods = [events["t"][events["kind"] == "release"].diff().iloc[-1] for events in (smooth, pieces)]
    assert periods[0] == pytest.approx(periods[1], rel=1e-6)


def test_undamped_stick_under_logarithmic_dwell_lasts_as_its_closed_form_says():
    # Slip on a constant force is half an ellipse: from f_s to 2 f_k − f_s, so that k s t = 2 (f_s(t) − f_k). Here k s = 0.1.
    law = ss.laws.LogarithmicDwell(kinetic=0.5, growth=0.2, onset=0.5)
    expected = brentq(lambda t: 0.1 * t - 2 * 0.2 * np.log1p(t / 0.5), 1.0, 100.0, xtol=1e-15)
    release = ss.simulate(ss.Oscillator(0.0, 0.1, law), 2000).events.query("kind == 'release'")
    assert release["stick_time"].iloc[-1] == pytest.approx(expected, rel=1e-12)
    # Beyond k s = 2 A/t_c = 0.8 there is no such time.
    assert ss.simulate(ss.Oscillator(0.05, 0.9, law), 2000).regime() == "stable_slip"


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: ss.laws.Lorentzian(0.4, 0.5, 0.1), r"at least the kinetic force .* \(0\.5\), got 0\.4"),
        (lambda: ss.laws.Lorentzian(1.0, 0.5, 0.0), "scale must be greater than 0, got 0"),
        (lambda: ss.laws.Lorentzian(1.0, -0.5, 0.1), "kinetic must not be negative, got -0.5"),
        (lambda: ss.laws.LogarithmicDwell(0.5, -0.1, 1.0), "growth must not be negative, got -0.1"),
        (lambda: ss.laws.LogarithmicDwell(0.5, 0.1, 0.0), "onset must be greater than 0, got 0"),
    ],
)
def test_what_makes_no_sense_is_refused(make, sentence):
    with pytest.raises(ss.InputError, match=sentence):
        make()


def _places(node, at=""):
    """Every number of a document by its path."""
    if isinstance(node, float):
        yield at[1:], node
    for key, part in node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ():
        yield from _places(part, f"{at}.{key}")


def test_a_number_changed_in_place_is_the_number_of_a_new_document():
    refused = 0
    for law in Law.ALL.values():
        system = ss.Oscillator(0.1, ss.Drive(0.2, ss.Harmonic(0.1, 2.0)), law.example(), forcing=ss.Harmonic(0.1, 1.2))
        document = document_of(system)
        for path, number in _places(document):
            value = 1.01 * number + 0.001
            try:
                anew = varied(document, [path], [value])[0]
            except ss.InputError:
                refused += 1
                with pytest.raises(ss.InputError):
                    system.with_number(path, value)
                continue
            changed = system.with_number(path, value)
            assert changed == anew
            assert changed.core.number("/" + path.replace(".", "/")) == value
    assert refused < 40
