"""Systems of masses under laws with an internal state: independent runs, limits, energy, documents, refusals."""

import json
import tomllib

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, solve_ivp

import stickslip as ss
from stickslip.cli.main import main
from stickslip.laws import Law, Regularised
from stickslip.laws.state_law import StateLaw
from stickslip.simulation.regime_names import REGIMES

BRISTLES = {"stiffness": 1e3, "damping": 10.0, "viscous": 0.2, "kinetic": 0.5, "break_away": 0.8, "scale": 0.05}
SHAKEN = ss.Drive(0.2, (ss.Harmonic(0.1, 1.3, 0.4),))
PAIR = ss.System(
    mass=[[1.0, 0.1], [0.1, 0.7]],
    stiffness=[[2.0, -0.6], [-0.6, 1.5]],
    damping=[[0.1, -0.02], [-0.02, 0.08]],
    contacts=[ss.Contact(0, ss.laws.LuGre(**BRISTLES), SHAKEN), ss.Contact(1, ss.laws.LuGre(**BRISTLES), other=0)],
    forcing=[ss.Force(0.4, 0.9, 0.3, mass=1)],
)


def pair_by_scipy(t):
    """x of the two masses, written out without the package; Radau at 1e-11."""
    mass, stiffness, damping = (np.array(matrix) for matrix in (PAIR.mass, PAIR.stiffness, PAIR.damping))
    p = BRISTLES

    def rates(t, y):
        x, v, z = y[:2], y[2:4], y[4:]
        w = np.array([0.2 + 0.1 * np.cos(1.3 * t + 0.4) - v[0], v[0] - v[1]])
        g = p["kinetic"] + (p["break_away"] - p["kinetic"]) * np.exp(-((w / p["scale"]) ** 2))
        dz = w - p["stiffness"] * np.abs(w) * z / g
        f = p["stiffness"] * z + p["damping"] * dz + p["viscous"] * w
        load = np.array([f[0] - f[1], f[1] + 0.4 * np.cos(0.9 * t + 0.3)]) - damping @ v - stiffness @ x
        return np.concatenate([v, np.linalg.solve(mass, load), dz])

    start = [0.0, 0.0, *[0.2 + 0.1 * np.cos(0.4)] * 2, 0.0, 0.0]
    return solve_ivp(rates, (0, t[-1]), start, t_eval=t, method="Radau", rtol=1e-11, atol=1e-13).y[:2].T


@pytest.mark.slow
def test_two_masses_under_lugre_move_as_an_independent_run_says():
    t = np.linspace(0, 5, 51)
    orbit = ss.simulate(PAIR, 5.0)
    assert orbit.at(t)[0] == pytest.approx(pair_by_scipy(t), abs=2e-8)
    assert orbit.at(3.0)[1].shape == (2,)
    motion = orbit.to_xarray()
    assert motion["force"].dims == motion["state"].dims == ("time", "contact")
    assert {orbit.regime(contact=c) for c in (0, 1)} <= set(REGIMES)
    crossings = orbit.events.query("kind == 'crossing' and contact == 1")
    v = orbit.at(crossings["t"].to_numpy())[1]
    assert len(crossings) > 2
    assert v[:, 0] == pytest.approx(v[:, 1], abs=1e-8)


@pytest.mark.long
def test_energy_of_drives_and_forcing_goes_into_friction_damping_and_what_is_stored():
    orbit = ss.simulate(PAIR, 6.0)
    t = np.linspace(0, 6, 120_001)
    motion = orbit.to_xarray(t)
    x, v, w, force = (motion[name].to_numpy() for name in ("x", "v", "slip_velocity", "force"))
    mass, stiffness, damping = (np.array(matrix) for matrix in (PAIR.mass, PAIR.stiffness, PAIR.damping))
    power = force[:, 0] * SHAKEN.at(t) + 0.4 * np.cos(0.9 * t + 0.3) * v[:, 1] - (force * w).sum(1)
    power -= np.einsum("ti,ij,tj->t", v, damping, v)
    stored = 0.5 * (np.einsum("ti,ij,tj->t", v, mass, v) + np.einsum("ti,ij,tj->t", x, stiffness, x))
    work = cumulative_simpson(power, x=t, initial=0)
    assert work == pytest.approx(stored - stored[0], abs=1e-8)
    assert np.ptp(stored) > 0.1


@pytest.mark.long
def test_stiff_bristles_tend_to_coulomb_friction_on_two_masses():
    # Only the drive of mass 0 feeds the pair; both contacts stick and slip.
    def pair(law):
        contacts = [ss.Contact(0, law(0.5), 0.3), ss.Contact(1, law(0.2), other=0)]
        return ss.System([1.0, 0.5], [[2.0, -0.5], [-0.5, 1.0]], 0.05, contacts, ss.Force(0.4, 0.8, mass=0))

    t = np.linspace(0, 30, 601)
    exact = ss.simulate(pair(ss.laws.Coulomb), 30.0)
    assert {0, 1} <= set(exact.events.query("kind == 'release'")["contact"])
    error = []
    for stiffness in (1e3, 1e4, 1e5):
        soft = pair(lambda f, s=stiffness: ss.laws.LuGre(s, s**0.5, 0.0, kinetic=f, break_away=f, scale=1.0))
        error.append(np.abs(ss.simulate(soft, 30.0).at(t)[0] - exact.at(t)[0]).max())
    # About as the stiffness to the power −1/2.
    assert error[0] > 3 * error[1] > 9 * error[2]
    assert error[2] < 5e-4


# Rock whose friction at rest is not as steep as exp(60): that is beyond any integrator in these variables.
SOFT_ROCK = ss.laws.RateState(1.0, 0.1, 0.08, length=1.0, reference_velocity=1.0)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.long] if name in ("Dahl", "ElastoPlastic", "Regularised") else [])
        for name, kind in Law.ALL.items()
        if issubclass(kind, StateLaw)
    ],
)
def test_every_law_with_a_state_runs_between_masses_and_on_one_mass_as_on_an_oscillator(name):
    law = SOFT_ROCK if name == "RateState" else Law.ALL[name].example()
    oscillator = ss.Oscillator(0.05, 0.2, law, forcing=ss.Harmonic(0.2, 0.9))
    t = np.linspace(0, 10, 101)
    alone, one = ss.simulate(oscillator, 10.0, x0=0.3), ss.simulate(oscillator.to_system(), 10.0, x0=[0.3])
    assert (one.at(t)[0][:, 0] == alone.at(t)[0]).all()
    assert one.events.equals(alone.events)
    # A second mass that nothing but the first touches comes to move with it.
    contacts = [ss.Contact(0, law, 0.2), ss.Contact(1, law, other=0)]
    v = ss.simulate(ss.System([1.0, 0.1], [1.0, 0.0], 0.1, contacts), 60.0, v0=[0.2, 0.0]).to_xarray()
    late = v.where(v["time"] > 55, drop=True)
    assert (
        float(np.abs(late["slip_velocity"][:, 1]).max()) < 0.3 * float(np.abs(late["slip_velocity"][:, 0]).max()) + 1e-3
    )


@pytest.mark.slow
def test_table_of_a_drive_is_not_stepped_over():
    # Nothing happens for 40 units of time, then the drive jerks for a tenth of one.
    drive = ss.Drive(nodes=[(40.0, 0.0), (40.05, 0.4), (40.1, 0.0)])
    law = ss.laws.LuGre(**BRISTLES)
    jerked = ss.simulate(ss.Oscillator(0.3, drive, law), 60.0)
    # The same, begun shortly before and led along by small steps.
    law_only = ss.System([1.0], [1.0], 0.3, [ss.Contact(0, law, ss.Drive(nodes=[(0.5, 0.0), (0.55, 0.4), (0.6, 0.0)]))])
    fine = ss.integrate(law_only, 20.5, method="Radau", tolerance=1e-11)
    t = np.linspace(0.5, 20, 100)
    assert np.abs(fine.at(t)[0]).max() > 1e-3
    assert jerked.at(t + 39.5)[0] == pytest.approx(fine.at(t)[0][:, 0], abs=1e-8)


def test_masses_that_rub_only_on_each_other_keep_their_momentum():
    law = ss.laws.ElastoPlastic(**BRISTLES, elastic=0.3)
    system = ss.System(
        [1.0, 2.0, 0.5], np.zeros((3, 3)), 0.0, [ss.Contact(1, law, other=0), ss.Contact(2, law, other=1)]
    )
    orbit = ss.simulate(system, 20.0, v0=[1.0, 0.0, -0.5])
    t = np.linspace(0, 20, 50)
    assert orbit.at(t)[1] @ [1.0, 2.0, 0.5] == pytest.approx(np.full(50, 0.75), abs=1e-9)
    assert orbit.at(20.0)[1] == pytest.approx([0.75 / 3.5] * 3, abs=1e-6)


def test_system_under_laws_with_a_state_is_a_file_and_a_command(tmp_path, capsys):
    assert ss.System.from_dict(json.loads(json.dumps(PAIR.to_dict()))) == PAIR
    assert ss.System.from_dict(tomllib.loads(PAIR.to_toml())) == PAIR
    path = tmp_path / "system.toml"
    path.write_text(PAIR.to_toml() + "\n[simulation]\nt_end = 5.0\n")
    assert main(["simulate", str(path), "-o", str(tmp_path / "orbit.nc")]) == 0
    assert (tmp_path / "orbit.nc").exists()
    capsys.readouterr()
    small, scale = ss.dimensionless(PAIR, force=2.0)
    t = np.linspace(0, 5, 21)
    twin = scale.restore(ss.simulate(small, 5.0 / scale.time).to_xarray(t / scale.time))
    assert twin["x"].to_numpy() == pytest.approx(ss.simulate(PAIR, 5.0).at(t)[0], abs=1e-7)


MIXED = [ss.Contact(0, ss.laws.LuGre(**BRISTLES), 0.1), ss.Contact(1, ss.laws.Coulomb(0.3), 0.1)]


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: ss.System([1, 1], [1, 1], 0, MIXED), "got Coulomb beside LuGre: give .* such as Regularised.Coulomb"),
        (lambda: ss.simulate_many(PAIR, {"x0.0": [0.0]}, 5.0), "laws with an internal state are integrated one by one"),
        (lambda: ss.simulate(PAIR, 5.0, x0=0.1), r"x0 must have the shape \(2,\), one number a mass, got \(\)"),
        (lambda: ss.integrate(PAIR, 5.0, state=[0.1]), r"state must have the shape \(2,\), one number a contact"),
        (lambda: ss.integrate(ss.chain(2, ss.laws.Coulomb(1), 0.1), 5.0), "Coulomb has no internal state; use"),
        (lambda: ss.simulate(PAIR, 1.0).regime(contact=2), "contact must be a whole number from 0 to 1, got 2"),
        (lambda: ss.simulate(ss.Oscillator(0, 0.1, Regularised.example()), 1).state(0.5), "no law of this system has"),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused_in_one_sentence(refused, make, sentence):
    refused(sentence, make)


def test_the_steady_motion_of_the_second_contact_is_looked_at():
    pair = ss.chain(2, ss.laws.LuGre(1e3, 30.0, 0.4, kinetic=1.0, break_away=1.5, scale=1e-2), 0.1)
    rows = ss.orbit_diagram(pair, "damping.0.0", [0.05, 0.1], periods=20, keep=5, contact=1)
    for value, greatest in zip((0.05, 0.1), rows["x_max"].to_numpy(), strict=True):
        varied = ss.System.from_dict(pair.to_dict() | {"damping": [[value, 0.0], [0.0, pair.damping[1][1]]]})
        end = 20 * pair.natural_period
        orbit = ss.simulate(varied, end)
        t = np.linspace(0.75 * end, end, 4000)
        assert orbit.at(t)[0][:, 1].max() == pytest.approx(greatest, abs=1e-5)
        assert orbit.regime(contact=1) == "stick_slip"
