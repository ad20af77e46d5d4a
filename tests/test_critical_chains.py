"""Critical velocities of chains: closed forms, one mass as the limit, runs on both sides; the drive under all masses."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from evidence import script
from scipy.optimize import brentq

import stickslip as ss
from stickslip.cli.main import main
from stickslip.dynamics.critical import branch_search, runs
from stickslip.dynamics.critical.end_of_run import EndOfRun
from stickslip.dynamics.equilibria.hopf_points import hopf_points
from stickslip.dynamics.equilibria.steady_slip import stability, steady_slip
from stickslip.dynamics.periodic.derivatives import sensitivities
from stickslip.errors import UnfinishedWarning
from stickslip.simulation import time_limit

evidence = script("critical_chains")

FALLING = ss.laws.ExponentialStribeck(1.0, 0.5, 0.3)
STEEP = ss.laws.ExponentialStribeck(1.2, 0.5, 0.4)
TWO = ss.chain(2, [ss.laws.StaticKinetic(1.0, 0.6), ss.laws.StaticKinetic(1.3, 0.6)], 0.3, coupling=0.8, damping=0.05)


def slope(law, w):
    """F′(w) of an ExponentialStribeck law without a rising part."""
    return -(law.break_away - law.kinetic) / law.scale * math.exp(-w / law.scale)


def test_masses_alike_lose_steady_slip_where_one_of_them_does():
    chain = ss.chain(4, FALLING, 0.3, coupling=0.7, damping=0.05)
    # D + F′(s) = 0 for every mode at once
    ((kind, speed),) = hopf_points(chain, "/drive_velocity", (0.9, 1.2))
    assert kind == "hopf"
    assert speed == pytest.approx(0.3 * math.log(0.5 / 0.3 / 0.05), abs=1e-10)


@pytest.mark.slow
def test_masses_unlike_lose_it_where_the_first_eigenvalue_passes():
    chain = ss.chain(3, [FALLING, STEEP, FALLING], 0.3, coupling=0.8, damping=0.05)

    def growth(speed):
        damping = np.array(chain.damping) + np.diag([slope(contact.law, speed) for contact in chain.contacts])
        matrix = np.block([[np.zeros((3, 3)), np.eye(3)], [-np.array(chain.stiffness), -damping]])
        return np.linalg.eigvals(matrix).real.max()

    hopf = brentq(growth, 1.0, 2.0, xtol=1e-13)
    branches = ss.continuation(chain, "drive_velocity", (1.1, 1.8), seeds=0)
    assert branches.branches[0].kind == "steady_slip"
    assert branches.special_points[0].kind == "hopf"
    assert branches.special_points[0].parameter == pytest.approx(hopf, abs=1e-10)
    # The cycle that is born there swings at the frequency of that mode.
    (cycle,) = (branch for branch in branches.branches if branch.kind == "cycle" and branch.period[0] < 4)
    assert cycle.period[0] == pytest.approx(2 * math.pi / steady_slip(evidence.driven(chain, hopf)).frequency, rel=1e-4)
    assert branches.branches[0].stable[0] is False
    assert branches.branches[0].stable[-1] is True


@pytest.mark.slow
def test_steady_slip_over_drives_of_two_speeds_is_a_branch_too():
    two = ss.System([1, 1], [[2, -1], [-1, 2]], 0.05, [ss.Contact(0, FALLING, 1.0), ss.Contact(1, FALLING, 1.3)])
    branches = ss.continuation(two, "contacts.0.drive_velocity", (0.8, 1.4), seeds=0)
    (hopf,) = [point for point in branches.special_points if point.kind == "hopf"]
    slopes = [slope(FALLING, speed) for speed in (hopf.parameter, 1.3)]
    matrix = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.array(two.stiffness), -np.diag(slopes) - 0.05 * np.eye(2)]])
    assert np.linalg.eigvals(matrix).real.max() == pytest.approx(0.0, abs=1e-10)


@pytest.mark.slow
def test_a_chain_without_coupling_ends_as_one_mass_does():
    law, bounds = ss.laws.StaticKinetic(1.0, 0.6), (0.62, 0.7)
    one = ss.critical_velocities(ss.Oscillator(0.05, 0.3, law), bounds)
    two = ss.critical_velocities(ss.chain(2, law, 0.3, coupling=0.0, damping=0.05), bounds)
    # Nothing ties their phases, so no cycle is followed and runs alone tell.
    assert two["end_of_stick_slip"] == pytest.approx(one["end_of_stick_slip"], rel=1e-5)


@pytest.mark.slow
def test_the_end_of_stick_slip_is_the_fold_of_its_cycle_and_runs_show_it():
    found = ss.critical_velocities(TWO, (0.3, 0.6))
    assert dict(found) == {"fold": pytest.approx(0.440946284, abs=1e-8), "end_of_stick_slip": found["fold"]}
    assert found.brackets == ()
    for speed, sticks in ((0.999 * found["fold"], True), (1.001 * found["fold"], False)):
        assert evidence.sticks(TWO, speed, 1500) is sticks


@pytest.mark.slow
def test_neutral_slip_of_a_chain_is_named_and_has_no_critical_velocity():
    # Sticks become ever rarer, and none of the speeds at which the last one was seen is an end.
    chain, _ = evidence.chain(1)
    assert chain.damping == ((0.0,) * 3,) * 3
    found = ss.critical_velocities(chain, (0.1, 2.5))
    assert found.all == ()
    assert found.neutral == ((0.1, 2.5),)
    assert found.brackets == ()


@pytest.mark.parametrize("seed", [5, 3, 4, 504])
@pytest.mark.slow
def test_what_is_reported_is_what_runs_show(seed):
    case = evidence.case(seed)
    assert case.reported
    assert case.unconfirmed == []
    assert case.missed == []


@pytest.mark.slow
def test_a_motion_that_no_start_at_rest_reaches_near_its_end_is_followed_to_it():
    """Six bodies of a drill string: from rest at 0.5 and below a motion begins that lasts to 1.052, from above another."""
    stiffness = np.diag([80.0, 80, 80, 80, 80, 40]) - 40 * (np.eye(6, k=1) + np.eye(6, k=-1))
    contact = ss.Contact(5, ss.laws.StaticKinetic(5.0, 3.0), 0.5)
    drill = ss.System([2.0, 1, 1, 1, 1, 1.5], stiffness, 0.01 * stiffness + 0.02 * np.eye(6), [contact])
    found = ss.critical_velocities(drill)
    assert abs(found["end_of_stick_slip"] - 1.0519666641) < 1e-9
    assert [value for name, value in found.all if name == "end_of_stick_slip"][-1] == found["end_of_stick_slip"]
    # plain runs on both sides, from a state on that motion
    for speed, regime in ((0.9, "stick_slip"), (1.06, "stable_slip")):
        start = [1.35 * (i + 1) / 6 for i in range(6)], [0.0] * 5 + [speed]
        there = replace(drill, contacts=[replace(contact, drive_velocity=speed)])
        assert ss.simulate(there, 2000.0, *start).regime(transient=0.8) == regime


@pytest.mark.slow
def test_runs_that_lose_a_cycle_before_its_end_make_no_second_end():
    stiffness = np.array([[10.0, -5.0], [-5.0, 5.0]])
    contact = ss.Contact(1, ss.laws.StaticKinetic(1.0, 0.5), 0.2)
    found = ss.critical_velocities(ss.System([2.0, 1.0], stiffness, [[0.5, -0.25], [-0.25, 0.25]], [contact]))
    assert [round(value, 9) for name, value in found.all if name == "end_of_stick_slip"] == [0.386121465]
    assert found.brackets == ()


def test_what_runs_do_not_settle_is_a_bracket(monkeypatch):
    """Sticks that end at a speed which depends on the length of the run are given as such, beside where the longest end."""

    def shown(system, cycles, *_, **__):
        share = float(system.drive_velocity < (0.45 if cycles == 3000 and system.drive_velocity > 0.4 else 0.4))
        times, end = (share, share), (None, None)
        return EndOfRun(system.drive_velocity, "t_end", 1.0, 1.0, 0.0, *times, 1.0, False, end, True, *times)

    monkeypatch.setattr(runs, "end_of_run", shown)
    monkeypatch.setattr(branch_search, "_branch", lambda *_: None)
    found = ss.critical_velocities(TWO, (0.2, 0.5))
    ((name, value),) = found.all
    assert name == "end_of_stick_slip"
    assert abs(value - 0.45) < 1e-5
    ((name, low, high),) = found.brackets
    assert name == "end_of_stick_slip"
    assert low < 0.4 <= high < low + 0.01
    assert found.finished


@pytest.mark.slow
def test_a_search_over_a_chain_ends_after_max_seconds(monkeypatch):
    monkeypatch.setattr(time_limit.time, "time", lambda: 0.0)

    def stop(what, *_):
        if what == "cycles":
            monkeypatch.setattr(time_limit.time, "time", lambda: 2.0)

    with pytest.warns(UnfinishedWarning):
        found = ss.critical_velocities(TWO, (0.3, 0.6), max_seconds=1.0, progress=stop)
    assert not found.finished
    ((name, low, high),) = found.brackets
    assert name == "end_of_stick_slip"
    assert low < 0.440946284 < high < low + 0.02


def test_the_look_at_steady_slip_ends_after_max_seconds_too(monkeypatch):
    looks = []

    def clock():
        looks.append(None)
        return 0.0 if len(looks) < 20 else 2.0

    monkeypatch.setattr(time_limit.time, "time", clock)
    with pytest.warns(UnfinishedWarning):
        found = ss.critical_velocities(ss.chain(3, FALLING, 0.3, damping=0.05), (0.3, 1.5), max_seconds=1.0)
    assert not found.finished
    assert found.all == ()
    assert len(looks) == 20


@pytest.mark.parametrize("laws", [FALLING, [FALLING, STEEP, FALLING]])
def test_stability_is_that_of_the_eigenvalues_with_their_modes(laws):
    """Laws alike couple no modes, and each has its own two exponents; laws unlike do."""
    for masses in (1.0, [1.0, 2.0, 0.5]):
        chain = ss.chain(3, laws, 0.9, coupling=0.8, damping=0.05)
        chain = replace(chain, mass=np.diag(np.ones(3) * masses).tolist())
        damping, neutral = stability(chain)
        assert damping == pytest.approx(steady_slip(chain).damping, abs=1e-14)
        assert not neutral


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (
            {"contacts": [ss.Contact(0, FALLING, 0.3), ss.Contact(1, FALLING, other=0)]},
            "must be on one drive of constant",
        ),
        ({"contacts": [ss.Contact(0, FALLING, 0.3), ss.Contact(1, FALLING, 0.2)]}, "must be on one drive of constant"),
        ({"contacts": [ss.Contact(0, FALLING, ss.Drive(0.3))]}, "must be on one drive of constant"),
        ({"forcing": ss.Force(0.1, 1.0)}, "the system is forced"),
        ({"springs": ss.Spring.stop(0.5, 40.0)}, "springs that are not linear"),
        ({"stiffness": [[1.0, -1.0], [-1.0, 1.0]]}, "tie one of them to the ground"),
    ],
)
def test_what_has_no_critical_velocity_is_refused(change, sentence):
    with pytest.raises(ss.InputError, match=sentence):
        ss.critical_velocities(replace(TWO, **change))


@pytest.mark.slow
def test_the_command_takes_a_chain(tmp_path, capsys):
    system = tmp_path / "chain.toml"
    system.write_text(TWO.to_toml())
    assert main(["critical", str(system), "--between", "0.43:0.45"]) == 0
    assert "end of stick slip   0.44094628" in capsys.readouterr().out


def test_the_drive_under_all_masses_is_one_number_of_a_chain():
    chain = ss.chain(3, FALLING, 0.3, coupling=0.8, damping=0.05)
    assert chain.with_number("drive_velocity", 0.9) == evidence.driven(chain, 0.9)
    assert evidence.driven(chain, 0.9).drive_velocity == 0.9
    diagram = ss.orbit_diagram(chain, "drive_velocity", [0.3, 0.9], periods=60, keep=10)
    alone = [
        ss.orbit_diagram(evidence.driven(chain, s), "damping.0.0", [chain.damping[0][0]], periods=60, keep=10)
        for s in (0.3, 0.9)
    ]
    assert diagram["x_end"].values.tolist() == [one["x_end"].values[0].tolist() for one in alone]
    chart = ss.regime_map(chain, {"drive_velocity": [0.3, 3.0]}, transient=100)
    assert chart["regime"].values.tolist() == ["stick_slip", "stable_slip"]
    runs = ss.simulate_many(chain, {"drive_velocity": [0.3, 0.9]}, 60.0)
    ends = [ss.simulate(evidence.driven(chain, s), 60.0).at(60.0)[0] for s in (0.3, 0.9)]
    assert runs["x"].values == pytest.approx(np.array(ends))
    # Its derivative is the sum of those of the contacts.
    names = ["drive_velocity", *(f"contacts.{i}.drive_velocity" for i in range(3))]
    moved = sensitivities(ss.simulate(chain, 20.0, [0.0, 0.1, 0.3]), names)["x_end"].values
    assert moved[:, 0] == pytest.approx(moved[:, 1:].sum(axis=1), rel=1e-9)


def test_a_drive_that_is_not_the_same_everywhere_is_no_number():
    two = ss.System([1, 1], [2, 2], 0.1, [ss.Contact(0, FALLING, 0.2), ss.Contact(1, FALLING, 0.3)])
    assert two.drive_velocity is None
    with pytest.raises(
        ss.InputError, match=r"here they have not the same; name one of them, such as 'contacts\.0\.drive"
    ):
        ss.orbit_diagram(two, "drive_velocity", [0.1])
    with pytest.raises(ss.InputError, match="the system has no number /drive_velocity"):
        two.with_number("drive_velocity", 0.1)
    # Between masses nothing is driven.
    carriage = ss.System([1, 1], [2, 0], 0.1, [ss.Contact(0, FALLING, 0.2), ss.Contact(1, FALLING, other=0)])
    assert carriage.with_number("drive_velocity", 0.5).contacts[1].drive_velocity == 0.0


@pytest.mark.slow
def test_stick_slip_is_followed_beyond_where_a_run_from_rest_loses_it():
    """A brake pad in a caliper: from rest it sticks up to 0.61 m/s, and followed up, by plain runs, beyond 0.75."""
    law = ss.laws.ExponentialStribeck(42.0, 27.0, 0.25, 4.0)
    masses, springs = [0.45, 2.2], [[6500.0, -6500.0], [-6500.0, 15500.0]]

    def brake(speed):
        contact = ss.Contact(mass=0, law=law, drive_velocity=speed)
        return ss.System(mass=masses, stiffness=springs, damping=[[3.0, -3.0], [-3.0, 9.0]], contacts=[contact])

    found = ss.critical_velocities(brake(0.15), (0.3, 1.5))
    assert found["hopf"] < found["end_of_stick_slip_from_rest"] < found["end_of_stick_slip"]
    end = ([0.0, 0.0], [0.0, 0.0])
    for speed in np.linspace(0.5, 0.76, 53):
        orbit = ss.simulate(brake(speed), 40.0, *end)
        end = orbit.at(orbit.t_end)
        sticks = bool((orbit.events.query("t > 30").kind == "capture").any())
        assert sticks == (speed < found["end_of_stick_slip"])


@pytest.mark.slow
def test_steady_slip_that_is_unstable_at_every_speed_is_said(tmp_path, capsys):
    # Two modes that friction couples: K is not symmetric beyond what its difference of diagonals bears, so they flutter.
    stiffness = np.array([[1.0, 0.5], [-0.5, 1.1]])
    system = ss.System([1.0, 1.0], stiffness, 0.01, ss.Contact(0, ss.laws.Coulomb(0.1), 0.3))
    squares = np.linalg.eigvals(-stiffness)
    assert np.sqrt(squares + 0j).real.max() > 0.1
    found = ss.critical_velocities(system, (0.2, 0.6))
    assert found.unstable == (0.2, 0.6)
    assert "steady slip is unstable at every speed from 0.2 to 0.6" in repr(found)
    (tmp_path / "system.toml").write_text(system.to_toml())
    assert main(["critical", str(tmp_path / "system.toml"), "--between", "0.2:0.6"]) == 0
    assert "steady slip is unstable at every speed from 0.2 to 0.6" in capsys.readouterr().out
    assert (
        ss.critical_velocities(
            ss.System([1.0], [[1.0]], 0.1, ss.Contact(0, ss.laws.Coulomb(0.1), 0.3)), (0.2, 0.3)
        ).unstable
        is None
    )
