"""Systems of masses against an independent solver, drives against the force they amount to, documents and refusals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import stickslip as ss
from stickslip.laws.state_law import StateLaw

Floats = NDArray[np.float64]


def belt_by_scipy(system: ss.System, x0: Floats, t_end: float) -> list[tuple[float, int, str]]:
    """Coulomb friction of every mass on one belt (M diagonal): DOP853 from event to event, written without the package."""
    mass = np.diag(np.array(system.mass))
    stiffness, damping = np.array(system.stiffness), np.array(system.damping)
    belt = system.contacts[0].drive_velocity
    limit = np.array([contact.law.kinetic for contact in system.contacts])
    n = len(mass)

    def applied(x: Floats, v: Floats) -> Floats:
        return stiffness @ x + damping @ v

    x, v = x0.copy(), np.full(n, belt)
    mode = np.where(np.abs(applied(x, v)) <= limit, 0.0, np.sign(applied(x, v)))
    t = 0.0
    events: list[tuple[float, int, str]] = []
    while t < t_end:

        def rate(_: float, y: Floats, mode: Floats = mode) -> Floats:
            a = np.where(mode == 0, 0.0, (mode * limit - applied(y[:n], y[n:])) / mass)
            return np.concatenate([y[n:], a])

        def guard(i: int, mode: Floats = mode):  # type: ignore[no-untyped-def]
            def value(_: float, y: Floats) -> float:
                if mode[i] != 0:
                    return float(mode[i] * (belt - y[n + i]))
                return float(limit[i] - abs(applied(y[:n], y[n:])[i]))

            value.terminal, value.direction = True, -1  # type: ignore[attr-defined]
            return value

        run = solve_ivp(
            rate, (t, t_end), np.concatenate([x, v]), method="DOP853", rtol=1e-12, atol=1e-13, max_step=0.05,
            events=[guard(i) for i in range(n)],
        )  # fmt: skip
        t, (x, v) = run.t[-1], np.split(run.y[:, -1], 2)
        hits = [i for i in range(n) if run.t_events[i].size]
        if not hits:
            break
        mode = mode.copy()
        for i in hits:
            pull = applied(x, v)[i]
            if mode[i] == 0:
                mode[i] = np.sign(pull)
                events.append((t, i, "release"))
                continue
            v[i] = belt
            mode[i] = 0.0 if abs(applied(x, v)[i]) <= limit[i] else np.sign(applied(x, v)[i])
            events.append((t, i, "capture" if mode[i] == 0 else "crossing"))
    return events


@pytest.mark.parametrize(("n", "t_end"), [(2, 60.0), (10, 15.0)])
def test_belt_of_coulomb_masses_agrees_with_scipy(n: int, t_end: float) -> None:
    # Limits that differ, so that nothing happens by symmetry; a start that is far from the steady sliding state.
    laws = [ss.laws.Coulomb(0.5 + 0.03 * i) for i in range(n)]
    system = ss.chain(n, laws, 0.2, coupling=0.8)
    x0 = 2.0 * np.cos(1.0 + 2.0 * np.arange(n))
    orbit = ss.simulate(system, t_end, x0=x0)
    expected = belt_by_scipy(system, x0, t_end)
    assert len(expected) > 10
    got = orbit.events
    assert list(zip(got["contact"], got["kind"], strict=True)) == [(i, kind) for _, i, kind in expected]
    np.testing.assert_allclose(got["t"], [t for t, *_ in expected], atol=2e-9)


def test_shaken_drive_is_a_constant_drive_and_a_force() -> None:
    """The relation of the paper's Eqs. (8) and (10), exact for any frequency: see Drive."""
    speed, shift, omega, d = 0.3, 0.2, 1.7, 0.05
    law = ss.laws.StaticKinetic(1.0, 0.6)
    shaken = ss.Oscillator(damping=d, drive_velocity=ss.Drive.shaken(speed, shift, omega), law=law)
    # −U₀[(k − mΩ²) sin Ωt + DΩ cos Ωt] as two harmonics A cos(Ωt + φ)
    forces = (
        ss.Harmonic(shift * (1 - omega**2), omega, np.pi / 2),
        ss.Harmonic(-shift * d * omega, omega),
    )
    forced = ss.Oscillator(damping=d, drive_velocity=speed, law=law, forcing=forces)
    one = ss.simulate(shaken, 100.0, x0=0.1, v0=0.4)
    other = ss.simulate(forced, 100.0, x0=0.1, v0=0.4 - shift * omega)
    t = np.linspace(0, 100, 3001)
    x, v = one.at(t)
    y, u = other.at(t)
    np.testing.assert_allclose(x - shift * np.sin(omega * t), y, atol=1e-10)
    np.testing.assert_allclose(v - shift * omega * np.cos(omega * t), u, atol=1e-10)
    assert list(one.events["kind"]) == list(other.events["kind"])
    assert one.regime() == other.regime() == "stick_slip"


def test_ramp_and_table() -> None:
    law = ss.laws.Coulomb(0.5)
    ramp = ss.Oscillator(damping=0.1, drive_velocity=ss.Drive.ramp(0.0, 0.4, duration=8.0), law=law)
    orbit = ss.simulate(ramp, 8.0)
    # Stuck on the drive x = 0.025 t²: adhesion x + 0.1 ẋ + ẍ reaches 0.5 where t² + 0.2 t + 2 = 20.
    expected = -0.1 + np.sqrt(0.01 + 18.0)
    assert orbit.events["t"][0] == pytest.approx(expected, abs=1e-13)
    x, v = orbit.at(2.0)
    assert x == pytest.approx(0.1, abs=1e-15)
    assert v == pytest.approx(0.1, abs=1e-15)
    # A table that starts faster than friction can accelerate the mass: it slips from the start, until it has caught up.
    table = ss.Drive.table([0.0, 0.5, 1.0], [0.0, 0.45, 0.45])
    jerked = ss.simulate(ss.Oscillator(damping=0.0, drive_velocity=table, law=law), 20.0)
    assert not jerked.to_xarray([0.1])["stuck"].item()
    assert jerked.events["kind"][0] == "capture"
    assert jerked.events["t"][0] > 0.5
    np.testing.assert_allclose(ss.Drive.table([0, 1], [2, 4]).at([0.5, 3.0]), [3.0, 4.0])


def test_mass_on_mass_sticks_and_moves_as_one() -> None:
    """A block on a driven carriage: below the limit they are one mass on one spring."""
    system = ss.System(
        mass=[1.0, 0.5],
        stiffness=[[2.0, 0.0], [0.0, 0.0]],
        damping=0.0,
        contacts=[ss.Contact(mass=1, law=ss.laws.StaticKinetic(0.4, 0.3), other=0)],
    )
    orbit = ss.simulate(system, 50.0, x0=[0.5, 0.5], v0=[0.0, 0.0])
    t = np.linspace(0, 50, 501)
    x, _ = orbit.at(t)
    assert x.shape == (501, 2)
    np.testing.assert_allclose(x[:, 0], 0.5 * np.cos(np.sqrt(2 / 1.5) * t), atol=1e-12)
    np.testing.assert_allclose(x[:, 1], x[:, 0], atol=1e-12)
    assert orbit.events.empty
    # The block feels 0.5 · (2/1.5) · 0.9 = 0.6 > 0.4: it slips.
    orbit = ss.simulate(system, 50.0, x0=[0.9, 0.9], v0=[0.0, 0.0])
    assert orbit.events["kind"].isin(["capture", "release"]).any()
    # Friction between them and nothing else: momentum of the block changes by the friction force alone.
    late = orbit.to_xarray(t)
    np.testing.assert_allclose(late["a"].isel(mass=1) * 0.5, late["force"].isel(contact=0), atol=1e-12)


def test_two_contacts_between_the_same_bodies_bear_what_both_bear() -> None:
    both = ss.System(
        [1], [1], [0], [ss.Contact(0, ss.laws.Coulomb(0.2), 0.1), ss.Contact(0, ss.laws.Coulomb(0.6), 0.1)]
    )
    one = ss.System([1], [1], [0], [ss.Contact(0, ss.laws.Coulomb(0.8), 0.1)])
    a, b = ss.simulate(both, 60.0), ss.simulate(one, 60.0)
    assert a.events["t"].min() == pytest.approx(b.events["t"].min(), abs=1e-12)
    np.testing.assert_allclose(a.at(np.linspace(0, 60, 200))[0], b.at(np.linspace(0, 60, 200))[0], atol=1e-10)


@pytest.mark.parametrize(
    "law",
    [kind.example() for kind in ss.laws.Law.ALL.values() if kind.SMOOTH and not issubclass(kind, StateLaw)],
    ids=lambda law: type(law).__name__,
)
def test_smooth_law_behaves_like_any_other(law: ss.laws.Law, tmp_path: Path) -> None:
    oscillator = ss.Oscillator(damping=0.05, drive_velocity=0.2, law=law)
    orbit = ss.simulate(oscillator, 100.0)
    assert orbit.regime() == "stick_slip"
    t = np.linspace(0, 100, 1001)
    x, _ = orbit.at(t)
    sampled = orbit.to_xarray(t)
    slip = ~sampled["stuck"].to_numpy()
    w = sampled["slip_velocity"].to_numpy()
    assert x.shape == t.shape
    np.testing.assert_allclose(sampled["force"].to_numpy()[slip], law.kinetic_force(w[slip]), atol=1e-13)
    again = ss.load(orbit.save(tmp_path / "orbit.nc"))
    assert np.array_equal(again.at(t), orbit.at(t))
    assert again.events.equals(orbit.events)
    assert again.system == oscillator
    assert ss.laws.Law.from_dict(law.to_dict()) == law


def test_system_documents(tmp_path: Path) -> None:
    system = ss.System(
        mass=[1.0, 2.0],
        stiffness=[[2, -1], [-1, 2]],
        damping=0.1,
        contacts=[
            ss.Contact(mass=0, law=ss.laws.BogaczRyczek(), drive_velocity=ss.Drive.shaken(0.3, 0.1, 1.1)),
            ss.Contact(mass=1, law=ss.laws.Coulomb(0.2), other=0),
        ],
        forcing=[ss.Force(0.1, 1.25, mass=1)],
    )
    path = tmp_path / "system.toml"
    path.write_text(system.to_toml())
    assert ss.load_system(path) == system
    orbit = ss.simulate(system, 30.0)
    again = ss.load(orbit.save(tmp_path / "orbit.nc"))
    t = np.linspace(0, 30, 301)
    assert np.array_equal(again.at(t), orbit.at(t))
    assert set(orbit.to_xarray(t).dims) == {"time", "mass", "contact"}
    assert orbit.regime(contact=1)


@pytest.mark.parametrize(
    ("build", "sentence"),
    [
        (lambda: ss.System([1, -1], [1, 1], 0, []), "mass matrix must be symmetric and positive definite"),
        (lambda: ss.System([1, 1], [1], 0, []), "stiffness must be a 2 by 2 matrix"),
        (
            lambda: ss.System([1], [1], 0, [ss.Contact(1, ss.laws.Coulomb(1))]),
            "contact 0 must name masses from 0 to 0, got 1",
        ),
        (
            lambda: ss.System([1], [1], 0, [ss.Contact(0, ss.laws.Coulomb(1), other=0)]),
            "must join two masses, got 0 twice",
        ),
        (lambda: ss.Contact(0, 0.5), "law must be a friction law"),
        (lambda: ss.chain(0, ss.laws.Coulomb(1), 0.1), "whole number of at least 1"),
        (lambda: ss.chain(3, [ss.laws.Coulomb(1)], 0.1), "one law or 3 of them"),
        (lambda: ss.simulate(ss.chain(2, ss.laws.Coulomb(1), 0.1), 1.0, x0=[1.0]), "must have the shape"),
        (lambda: ss.laws.ExponentialStribeck(0.4, 0.5, 0.1), "break-away force must be at least the kinetic force"),
        (lambda: ss.laws.Rational(1.0, -1.0), "weakening must not be negative"),
        (lambda: ss.Drive.table([0, 0], [1, 2]), ""),
    ],
)
def test_refusals(build: object, sentence: str) -> None:
    if not sentence:
        with pytest.raises(ss.InputError, match="strictly increasing"):
            ss.Oscillator(damping=0, drive_velocity=build(), law=ss.laws.Coulomb(1))  # type: ignore[operator]
        return
    with pytest.raises(ss.InputError, match=sentence):
        build()  # type: ignore[operator]


def test_friction_that_falls_without_end_is_named() -> None:
    orbit = ss.simulate(ss.Oscillator(damping=0.0, drive_velocity=0.2, law=ss.laws.Cubic(0.4, 2.0, -1.0)), 1000.0)
    assert orbit.stop == "diverged"
    assert "the motion runs away" in orbit.stop_sentence


def test_branches_that_do_not_meet_hold_the_slip_speed_in_a_system_as_in_the_closed_form():
    law = ss.laws.TwoBranch(rising=[(0, 1.2), (1, 1.0)], falling=[(0, 0.7), (1, 0.9)], break_away=1.3)
    oscillator = ss.Oscillator(0.01, 0.8, law, forcing=ss.Harmonic(0.1, 1.4))
    one, other = ss.simulate(oscillator, 60).events, ss.simulate(oscillator.to_system(), 60).events
    assert {"hold", "reversal"} < set(one["kind"])
    assert one["kind"].tolist() == other["kind"].tolist()
    assert other["t"].to_numpy() == pytest.approx(one["t"].to_numpy(), abs=1e-10)
    # Two of them on one mass and one drive rub like one of twice the force.
    twice = ss.laws.TwoBranch(rising=[(0, 0.6), (1, 0.5)], falling=[(0, 0.35), (1, 0.45)], break_away=0.65)
    pair = ss.System([1.0], [1.0], 0.01, [ss.Contact(0, twice, 0.8)] * 2, ss.Force(0.1, 1.4))
    t = np.linspace(0, 60, 601)
    assert ss.simulate(pair, 60).at(t)[0][:, 0] == pytest.approx(ss.simulate(oscillator, 60).at(t)[0], abs=1e-9)


def test_a_motion_too_stiff_for_its_steps_ends_with_a_sentence():
    # Friction that grows as the cube of a speed that the other mass, on friction that falls without end, drives up.
    falls = ss.laws.PiecewiseLinear([(0, 1.0), (0.1, 0.5)], break_away=1.0)
    cubic = ss.laws.Cubic(static=0.5, linear=0.4, cubic=0.3)
    system = ss.System([1, 1], [[2, -1], [-1, 2]], 0.0, [ss.Contact(0, falls, 0.2), ss.Contact(1, cubic, 0.2)])
    orbit = ss.simulate(system, 1000, x0=[1.0, 0.0])
    assert orbit.stop in ("stiff", "diverged")
    assert orbit.stop_sentence.startswith("the run stopped")


@pytest.mark.parametrize("damping", [3e3, 1e6])
@pytest.mark.parametrize(
    "law",
    [
        ss.laws.StaticKinetic(1.0, 0.6),
        ss.laws.Coulomb(0.6),
        ss.laws.PiecewiseLinear([(0.0, 1.0), (0.2, 0.6), (1.0, 0.7)], 1.0),
    ],
    ids=lambda law: type(law).__name__,
)
def test_under_heavy_damping_a_mass_of_several_moves_as_the_closed_form_of_one(law, damping):
    drive = 0.3 / damping
    one = ss.simulate(ss.Oscillator(damping, drive, law, forcing=ss.Harmonic(1.4, 0.9)), 60.0, x0=0.3)
    contacts = [ss.Contact(0, law, drive), ss.Contact(1, law, drive)]
    pair = ss.System([1, 1], [1, 1], [damping, damping], contacts, ss.Force(1.4, 0.9))
    both = ss.simulate(pair, 60.0, x0=[0.3, 0.7])
    t = np.linspace(0, 60, 2001)
    (x, v), (xs, vs) = one.at(t), both.at(t)
    assert np.abs(xs[:, 0] - x).max() < 1e-14
    assert np.abs(vs[:, 0] - v).max() < 1e-13 * np.abs(v).max()
    events = both.events[both.events["contact"] == 0]
    assert events["kind"].tolist() == one.events["kind"].tolist()
    assert len(events) > 10
    assert events["t"].to_numpy() == pytest.approx(one.events["t"].to_numpy(), abs=1e-12)
    # Steps as short as 4/δ would be 45,000 and 15,000,000.
    assert both.work.evaluations < 400


@pytest.mark.parametrize("smooth", [pytest.param(True, marks=pytest.mark.long), False])
def test_dampers_between_masses_may_be_heavy(smooth):
    """Three masses that dampers hold together against an implicit integrator: their common motion stays light."""
    mass, stiffness = np.array([1.0, 1.3, 0.8]), np.diag([1.0, 0.7, 0.4])
    damping = 1e6 * np.array([[1, -1, 0], [-1, 2, -1], [0, -1, 1]]) + 0.05 * np.eye(3)
    if smooth:
        law, speed = ss.laws.ExponentialStribeck(1.0, 0.6, 0.3, 0.1), 3.0
    else:
        law, speed = ss.laws.StaticKinetic(0.7, 0.6), 9.0
    contacts = [ss.Contact(i, law, speed) for i in range(3)]
    system = ss.System(mass.tolist(), stiffness.tolist(), damping.tolist(), contacts, ss.Force(0.5, 1.1, mass=1))
    start = [0.1, 0.4, -0.2]
    orbit = ss.simulate(system, 30.0, x0=start, v0=[0.0, 0.0, 0.0])

    def rates(t, y):
        slip = speed - y[3:]
        friction = 0.6 + (0.4 * np.exp(-slip / 0.3) + 0.1 * slip if smooth else 0.0)
        load = friction + np.array([0.0, 0.5 * np.cos(1.1 * t), 0.0]) - stiffness @ y[:3] - damping @ y[3:]
        return np.concatenate([y[3:], load / mass])

    known = solve_ivp(rates, (0, 30), [*start, 0, 0, 0], method="Radau", rtol=1e-9, atol=1e-12).y[:, -1]
    assert len(orbit.events) == 0
    assert np.concatenate(orbit.at(30.0)) == pytest.approx(known, abs=2e-8)
    assert orbit.work.evaluations < 100


def test_damping_that_takes_millions_of_steps_ends_with_a_sentence():
    law = ss.laws.StaticKinetic(1.0, 0.6)
    # A matrix that is not symmetric has no modes to part what is slow from what is not.
    for skew, stop in ((0.0, "t_end"), (1.0, "stiff")):
        dampers = [[1e6, skew], [0, 0.1]]
        contacts = [ss.Contact(0, law, 0.2), ss.Contact(1, law, 0.2)]
        orbit = ss.simulate(ss.System([1, 1], [[2, -1], [-1, 2]], dampers, contacts), 20.0)
        assert orbit.stop == stop
        # 100,000 of the natural time in which that shows, and those of the time before.
        assert orbit.work.evaluations < (200_000 if skew else 300)
    assert "damping is so large" in orbit.stop_sentence


def test_a_stuck_mass_that_is_only_pushed_does_not_diverge():
    # Nothing moves at the start and nothing will: there is no speed to measure errors by but that of the push.
    system = ss.System([1, 1], [1, 1], 0.0, ss.Contact(0, ss.laws.Rational(1.0, 1.0)), ss.Force(0.2, 1.9))
    orbit = ss.simulate(system, 20)
    assert (orbit.stop, len(orbit.events)) == ("t_end", 0)


def test_an_exponential_that_no_coefficient_shows_is_seen_at_the_end_of_the_step():
    # The slip speed has just begun to fall from 64 times the scale of the law: there its exponential is 1e-28.
    law = ss.laws.ExponentialStribeck(1.0926598232579716, 0.2560183704568639, 0.0701377285243902, 0.13161284635407566)
    orbit = ss.simulate(ss.Oscillator(0.001, -0.00995875, law, mass=0.5, stiffness=5.0), 3.0, x0=-1.533080867520737)
    motion = orbit.to_xarray(np.linspace(0.01, 0.97, 500))
    assert law.kinetic_force(motion["slip_velocity"]) == pytest.approx(motion["force"].to_numpy(), abs=1e-12)


@pytest.mark.parametrize("n", [1, 3])
def test_a_touch_of_zero_slip_is_a_graze_for_one_mass_and_for_many(n: int) -> None:
    # With f_s = f_k and no damping slip goes round x = f_k on a circle of radius s: it meets w = 0 every 2π, tangentially.
    law = ss.laws.Coulomb(0.5)
    chain = ss.simulate(ss.chain(n, law, 0.2), 100.0)
    touches = int((100.0 - 0.5 / 0.2) / (2 * np.pi))
    assert list(chain.events["kind"]) == ["release"] * n
    assert chain.work.grazes == n * touches
    single = ss.simulate(ss.Oscillator(0.0, 0.2, law), 100.0)
    assert list(single.events["kind"]) == ["release"]
    assert single.work.grazes > 0
    np.testing.assert_allclose(chain.at(90.0)[0], np.full(n, single.at(90.0)[0]), atol=1e-12)


def test_a_long_stick_is_one_step_whatever_its_length() -> None:
    # A drive so slow that a stick lasts 10⁶ natural times: nothing happens on the way, and nothing is done.
    law = ss.laws.ExponentialStribeck(1.0, 0.6, 0.1)
    chain = ss.chain(3, law, 1e-6)
    orbit = ss.simulate(chain, 1e7)
    assert (orbit.events["kind"] == "release").sum() > 20
    assert orbit.work.evaluations < 60 * len(orbit.events)
    assert orbit.events["t"][0] == pytest.approx(1e6, rel=1e-12)


def stack() -> ss.System:
    """Three blocks on one another, shaken from below."""
    contacts = [ss.Contact(0, ss.laws.Coulomb(0.5), ss.Drive.shaken(0.0, 1.0, 1.0))]
    contacts += [ss.Contact(i, ss.laws.Coulomb(0.05), 0.0, i - 1) for i in (1, 2)]
    return ss.System([1.0] * 3, np.diag([1.0, 0.0, 0.0]), 0.0, contacts)


def between_belts(law: ss.laws.Law) -> ss.System:
    """A mass between two belts that move apart: held by both, or by one at the limit of the other."""
    return ss.System([1.0], [1.0], 0.0, [ss.Contact(0, law, 0.2), ss.Contact(0, law, -0.2)])


@pytest.mark.parametrize(
    "system",
    [stack(), between_belts(ss.laws.Coulomb(0.5)), between_belts(ss.laws.Rational(1.0, 3.0)),
     ss.chain(3, ss.laws.TwoBranch([(0, 1.0), (1, 0.5)], [(0, 0.9), (1, 0.4)], 1.0), 0.3),
     ss.chain(3, ss.laws.TwoBranch([(0, 0.9), (1, 0.4)], [(0, 1.0), (1, 0.5)], 1.0), 0.3)],
    ids=["stack", "two belts", "two belts, weakening", "branches that switch", "branches that hold"],
)  # fmt: skip
def test_contacts_that_take_turns_do_not_chatter_without_end(system: ss.System) -> None:
    for amplitude in (0.1, 0.3, 1.5, 3.0):
        start = amplitude * np.cos(np.arange(system.masses))
        orbit = ss.simulate(system, 200.0, x0=start, v0=0.1 * start, max_seconds=60)
        assert orbit.stop == "t_end", orbit.stop_sentence
        assert orbit.work.evaluations < 5000


def test_a_contact_on_a_mass_that_another_holds_changes_its_branch_once_at_each_turn_of_its_drive():
    # The mass sticks to one drive; what slips on the shaken one follows that drive alone, whatever its friction does.
    held = ss.Contact(0, ss.laws.Coulomb(2.0), 0.0)
    shaken = ss.Contact(0, ss.laws.TwoBranch(0.5, 0.4, 0.5), ss.Drive(1.0, (ss.Harmonic(0.4, 1.0, 0.5),)))
    orbit = ss.simulate(ss.System([[1.0]], [[1.0]], [[0.0]], (held, shaken)), 60.0)
    assert orbit.stop == "t_end"
    turns = orbit.events[orbit.events["kind"] == "reversal"]
    assert (turns["contact"] == 1).all()
    assert np.diff(turns["t"]) == pytest.approx(np.pi, abs=1e-9)
    assert len(turns) == 19


def test_a_contact_pinned_against_the_load_of_another_time_bears_its_share_of_a_new_one() -> None:
    # The weaker one is pinned at -0.31 by the load at the start; as that turns, both can bear it until it is 0.91 + 0.31.
    contacts = [ss.Contact(0, ss.laws.StaticKinetic(*law), 0.2) for law in ((0.91, 0.72), (0.31, 0.09))]
    system = ss.System([1.2], [1.0], 0.0, contacts, forcing=ss.Force(1.2, 1.2))
    events = ss.simulate(system, 60.0, [0.0], max_seconds=60).events
    first = events.iloc[:2]
    load = first["x"] - 1.2 * np.cos(1.2 * first["t"])
    assert list(first["kind"]) == ["release", "release"]
    assert sorted(first["contact"]) == [0, 1]
    np.testing.assert_allclose(load, 0.91 + 0.31, rtol=1e-12)
    assert events["t"].max() > 50


def test_flutter_that_runs_away_is_no_regime():
    """Two coupled coordinates whose friction feeds their swing: eigenvalues 0.2156 ± 1.45i of steady slip."""
    stiffness = [[2.0, 0.2], [-2.2, 2.1]]
    contacts = [ss.Contact(0, ss.laws.Coulomb(0.3), 0.16), ss.Contact(1, ss.laws.Coulomb(0.2), 0.16)]
    system = ss.System([1.0, 1.0], stiffness, [0.02, 0.03], contacts)
    orbit = ss.simulate(system, 1000.0)
    assert (orbit.stop, orbit.regime()) == ("diverged", "diverged")
    assert orbit.t_end < 400


def test_a_mass_matrix_that_is_singular_within_rounding_is_refused():
    contacts = [ss.Contact(0, ss.laws.StaticKinetic(1.0, 0.6), 0.2)]
    with pytest.raises(
        ss.InputError, match=r"singular within rounding: beside the others only 2\.0e-12 of mass 0 is left"
    ):
        ss.System([[1, 1 - 1e-12], [1 - 1e-12, 1]], [2.0, 1.0], 0.01, contacts)
    # By hand: the second mass stays at rest, so the first breaks away at (1 - 0.01 * 0.2) / (2 * 0.2).
    near = ss.System([[1, 1 - 1e-7], [1 - 1e-7, 1]], [2.0, 1.0], 0.01, contacts)
    assert abs(ss.simulate(near, 2.6).events["t"][0] - 2.495) < 1e-8
