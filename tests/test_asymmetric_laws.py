"""Friction that differs between the directions: where it is symmetric friction and a constant force, and where it is not."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import stickslip as ss
from stickslip.dynamics.equilibria.hopf_points import hopf_points
from stickslip.dynamics.periodic.derivatives import sensitivities
from stickslip.identification import friction_of_orbit, identify
from stickslip.laws import (
    Asymmetric,
    BogaczRyczek,
    Combined,
    DwellTime,
    ExponentialStribeck,
    ForceRate,
    LogarithmicDwell,
    LuGre,
    PiecewiseLinear,
    StaticKinetic,
    smooth_from_function,
)

SHIFT = 0.2
# Friction that is larger forward by 2 c than backward is friction in the middle and the constant force c, which moves the
# equilibrium by c/k.
PAIRS = {
    "StaticKinetic": (StaticKinetic(1.2, 0.8), StaticKinetic(0.8, 0.4), StaticKinetic(1.0, 0.6)),
    "PiecewiseLinear": tuple(
        PiecewiseLinear([(0, 0.9 + c), (0.2, 0.6 + c), (0.6, 0.7 + c)], 1.0 + c) for c in (SHIFT, -SHIFT, 0)
    ),
    "DwellTime": tuple(DwellTime(0.5 + c, 0.5, 0.4) for c in (SHIFT, -SHIFT, 0)),
    "ForceRate": tuple(ForceRate(0.5 + c, 0.5, 0.4, 0.3) for c in (SHIFT, -SHIFT, 0)),
    "ExponentialStribeck": tuple(ExponentialStribeck(1.0 + c, 0.5 + c, 0.2, 0.1) for c in (SHIFT, -SHIFT, 0)),
    "Combined": tuple(
        Combined(DwellTime(1.0 + c, 0.5, 0.4), ExponentialStribeck(1.0 + c, 0.5 + c, 0.2, 0.1)) for c in (SHIFT, -SHIFT, 0)
    ),
}  # fmt: skip
DRIVES = {
    "unforced": (0.15, ()),
    "forced": (0.15, ss.Harmonic(0.9, 0.7)),
    "shaken": (ss.Drive.shaken(0.05, 0.3, 0.8), ()),
}


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("name", PAIRS)
def test_a_constant_difference_is_a_constant_force(name, drive):
    forward, backward, middle = PAIRS[name]
    velocity, forcing = DRIVES[drive]
    both, plain = (
        ss.Oscillator(0.05, velocity, law, stiffness=2.0, forcing=forcing)
        for law in (Asymmetric(forward, backward), middle)
    )
    # Swings that go through both directions, and sticks on either side.
    shifted = ss.simulate(both, 60, x0=-3.0 + SHIFT / 2.0, v0=0.0)
    orbit = ss.simulate(plain, 60, x0=-3.0, v0=0.0)
    assert len(orbit.events) > 5
    assert orbit.segments["direction"].min() == -1
    assert list(shifted.events["kind"]) == list(orbit.events["kind"])
    assert shifted.events["t"].to_numpy() == pytest.approx(orbit.events["t"].to_numpy(), abs=1e-9)
    assert shifted.events["x"].to_numpy() - SHIFT / 2.0 == pytest.approx(orbit.events["x"].to_numpy(), abs=1e-9)
    assert shifted.events["force"].to_numpy() - SHIFT == pytest.approx(orbit.events["force"].to_numpy(), abs=1e-9)


@pytest.mark.parametrize("name", ["StaticKinetic", "ForceRate", "ExponentialStribeck"])
def test_derivatives_are_those_of_the_constant_force_too(name):
    forward, backward, middle = PAIRS[name]
    systems = [
        ss.Oscillator(0.05, 0.1, law, forcing=ss.Harmonic(0.9, 0.7)) for law in (Asymmetric(forward, backward), middle)
    ]
    orbits = [ss.simulate(system, 30, x0=x0, v0=0.0) for system, x0 in zip(systems, (-3 + SHIFT, -3.0), strict=True)]
    assert set(orbits[1].segments["direction"]) == {-1, 0, 1}
    one, two = (sensitivities(orbit, ["damping", "forcing.amplitude"]) for orbit in orbits)
    for key in ("t", "x", "v"):
        assert one[key].to_numpy()[:-1] == pytest.approx(two[key].to_numpy()[:-1], rel=1e-6, abs=1e-7)


def test_masses_in_a_row_feel_the_constant_force_each():
    forward, backward, middle = PAIRS["DwellTime"]
    one, two = (ss.chain(3, law, 0.2) for law in (Asymmetric(forward, backward), middle))
    orbit = ss.simulate(two, 60, x0=[-2.0, 0.5, 1.0])
    away = np.linalg.solve(np.asarray(two.stiffness), np.full(3, SHIFT))
    shifted = ss.simulate(one, 60, x0=np.array([-2.0, 0.5, 1.0]) + away)
    assert len(orbit.events) > 20
    assert shifted.events["t"].to_numpy() == pytest.approx(orbit.events["t"].to_numpy(), abs=1e-8)


@pytest.mark.parametrize("forward", [StaticKinetic(1.4, 0.9), ExponentialStribeck(1.4, 0.6, 0.3, 0.2)])
def test_one_direction_with_a_curve_and_the_other_without_follow_an_integration(forward):
    # The drive rests, so the directions alternate: every half swing is integrated with its own law, until w = 0.
    backward = PiecewiseLinear([(0, 0.3), (0.5, 0.1), (3.0, 0.2)], 0.5)
    orbit = ss.simulate(ss.Oscillator(0.02, 0.0, Asymmetric(forward, backward)), 40, x0=6.0, v0=0.0)
    stops = orbit.events["t"].to_numpy()
    x, v, t = 6.0, 0.0, 0.0
    found = []
    # ẋ > 0 is w < 0.
    while True:
        w = 1.0 if x > 0 else -1.0
        law = forward if w > 0 else backward
        if abs(x) <= law.break_away_force():
            break

        def slip(_, y, w=w, law=law):
            friction = float(law.kinetic_force(max(-w * y[1], 1e-300)))
            return [y[1], -y[0] - 0.02 * y[1] + w * friction]

        def still(_, y, w=w):
            return -w * y[1] + 1e-13

        still.terminal, still.direction = True, -1.0
        run = solve_ivp(slip, (0, 10), [x, v], events=still, rtol=1e-10, atol=1e-12, method="DOP853", first_step=1e-3)
        t += run.t_events[0][0]
        x, v = float(run.y[0, -1]), 0.0
        found.append(t)
    ends = orbit.events.query("kind in ('crossing', 'capture')")["t"].to_numpy()
    assert len(found) >= 4
    # It starts with a release, and ends stuck at once after the last half swing.
    assert ends == pytest.approx(found, abs=1e-7)
    assert orbit.at(40.0)[0] == pytest.approx(x, abs=1e-7)
    assert stops[-1] == ends[-1]


def test_the_critical_velocity_is_that_of_the_law_of_its_direction():
    curve = ExponentialStribeck(1.0, 0.5, 0.5)
    law = Asymmetric(curve, StaticKinetic(2.0, 1.5))
    found = hopf_points(ss.Oscillator(0.1, 1.0, law), "/drive_velocity", (0.2, 2.0))
    assert found == [("hopf", pytest.approx(0.5 * np.log(10), rel=1e-10))]
    turned = Asymmetric(StaticKinetic(2.0, 1.5), curve)
    assert hopf_points(ss.Oscillator(0.1, 1.0, turned), "/drive_velocity", (0.2, 2.0)) == []


def test_force_along_a_motion_has_the_law_of_each_direction():
    law = Asymmetric(StaticKinetic(1.2, 0.7), DwellTime(0.4, 0.5, 0.4))
    t, w = np.arange(6.0), np.array([0.0, 0.3, -0.2, 0.0, 0.0, -0.1])
    force = ss.force_along(law, t, w, force_rate=[1, 0, 0, -1, -1, 0])
    grown = DwellTime(0.4, 0.5, 0.4).break_away_force(1.0)
    assert force == pytest.approx([1.2, 0.7, -0.4, -0.4, -grown, -0.4])
    assert law.kinetic_force([[0.1, -0.1], [0.2, 0.0]]).tolist() == [[0.7, -0.4], [0.7, 0.7]]
    assert law.break_away_force([0.0, 1.0], [1e-9, -1e-9]) == pytest.approx([1.2, grown])


def test_a_combination_takes_each_part_from_its_law():
    curve = smooth_from_function(lambda w: 0.6 + 0.4 * np.exp(-w / 0.3), 3.0)
    dwell = DwellTime(1.0, 0.5, rate=0.4, exponent=0.7)
    law = Combined(dwell, curve)
    t, w = np.geomspace(0.01, 100, 20), np.linspace(0.01, 4, 30)
    assert (law.break_away_force(t) == dwell.break_away_force(t)).all()
    assert (law.kinetic_force(w) == curve.kinetic_force(w)).all()
    release = ss.simulate(ss.Oscillator(0.05, 0.1, law), 100).events.query("kind == 'release'")
    assert len(release) > 3
    assert release["force"].to_numpy() == pytest.approx(dwell.break_away_force(release["stick_time"]), abs=1e-10)
    # The same law by its own formula.
    whole = ForceRate(0.5, 0.4, 0.3, 0.2)
    events = [
        ss.simulate(ss.Oscillator(0.05, 0.1, one, forcing=ss.Harmonic(0.2, 0.7)), 60).events
        for one in (whole, Combined(whole, StaticKinetic(0.5, 0.5)))
    ]
    assert events[0].equals(events[1])


@pytest.mark.long
def test_friction_that_differs_between_the_directions_is_found_from_a_record():
    law = Asymmetric(StaticKinetic(1.3, 0.8), StaticKinetic(0.9, 0.4))
    orbit = ss.simulate(ss.Oscillator(0.05, 0.0, law, forcing=ss.Harmonic(1.6, 0.35)), 200)
    assert set(orbit.segments["direction"]) == {-1, 0, 1}
    record = friction_of_orbit(orbit, np.arange(0, 200, 0.05), 0.005, seed=1)
    found = identify(record, law="Asymmetric")
    assert isinstance(found.law.forward, StaticKinetic)
    for side, true in (("forward", law.forward), ("backward", law.backward)):
        for number in ("break_away", "kinetic"):
            row = found.parameters.loc[f"{side}.{number}"]
            assert abs(row["value"] - getattr(true, number)) < 4 * row["error"] + 0.01, (side, number)
    # A symmetric law leaves the difference to an offset.
    plain = identify(record, law="StaticKinetic", offset=True)
    assert float(plain.offset["value"]) == pytest.approx(0.2, abs=0.02)
    one_way = ss.simulate(ss.Oscillator(0.05, 0.2, law), 100)
    with pytest.raises(ss.InputError, match=r"Asymmetric needs slip in both directions, .* 0 samples of slip backward"):
        identify(friction_of_orbit(one_way, np.arange(0, 100, 0.1), 0.005, seed=1), law="Asymmetric")


@pytest.mark.slow
def test_a_curve_with_a_memory_is_found_from_records():
    law = Combined(DwellTime(1.0, 0.4, 0.3), ExponentialStribeck(1.0, 0.6, 0.3, 0.1))
    records = []
    for seed, speed in enumerate((0.04, 0.1, 0.2)):
        orbit = ss.simulate(ss.Oscillator(0.05, speed, law), 150)
        records.append(friction_of_orbit(orbit, np.arange(0, 150, 0.1), 0.003, seed=seed))
    found = identify(records, law="Combined").law
    w, t = np.array([0.1, 0.3, 0.6]), np.array([2.0, 5.0, 10.0])
    assert found.kinetic_force(w) == pytest.approx(law.kinetic_force(w), rel=0.03)
    assert found.break_away_force(t) == pytest.approx(law.break_away_force(t), rel=0.03)


@pytest.mark.slow
def test_static_friction_that_begins_above_the_kinetic_force_is_found_without_asking_for_a_law():
    law = Combined(LogarithmicDwell(1.0, 0.06, 10.0), ExponentialStribeck(0.75, 0.6, 0.3, 0.05))
    records = []
    for seed, speed in enumerate((0.02, 0.06, 0.16)):
        orbit = ss.simulate(ss.Oscillator(0.05, speed, law), 300 if speed < 0.05 else 150)
        records.append(friction_of_orbit(orbit, np.arange(0, orbit.t_end, 0.15), 0.002, seed=seed))
    found = ss.identify(records)
    assert isinstance(found.law, Combined)
    assert isinstance(found.law.static, LogarithmicDwell)
    for name, true in {"static.kinetic": 1.0, "static.growth": 0.06, "kinetic.break_away": 0.75}.items():
        assert found.parameters.loc[name, "low"] < true < found.parameters.loc[name, "high"], name
    assert "static.kinetic, from which static friction grows as LogarithmicDwell" in " ".join(found.notes)
    # Whether the level follows the kinetic force is the user's choice, and the law given says what is fitted.
    tied = ss.identify(records, found.law, ties={"static.kinetic": "kinetic.break_away"})
    assert tied.law.static.kinetic == tied.law.kinetic.break_away
    assert "static.onset" in tied.parameters.index
    assert "As asked, static.kinetic follows kinetic.break_away." in tied.notes
    with pytest.raises(ss.InputError, match="leave it out of free or out of ties"):
        ss.identify(records, found.law, free=["static.kinetic"], ties={"static.kinetic": "kinetic.break_away"})


def test_they_are_data():
    law = Asymmetric(Combined(DwellTime(1.0, 0.5, 0.4), StaticKinetic(1.0, 0.6)), StaticKinetic(0.8, 0.5))
    assert pickle.loads(pickle.dumps(law)) == law
    system = ss.Oscillator(0.1, 0.3, law)
    assert ss.Oscillator.from_toml(system.to_toml()) == system


def test_parts_of_one_break_away_force_go_together_where_their_sums_round_apart():
    # 0.08 + (0.23 - 0.08) is more than 0.23 by a rounding.
    curve = ExponentialStribeck(0.23, 0.08, 0.1)
    law = Combined(DwellTime(0.23, 0.1, 0.4), curve)
    assert curve.kinetic_force(0.0) > law.break_away_force()
    assert ss.simulate(ss.Oscillator(0.05, 0.1, law), 60.0).regime() == "stick_slip"


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Asymmetric(Asymmetric.example(), StaticKinetic(1, 1)), "each be the law of one direction"),
        (lambda: Asymmetric(StaticKinetic(1, 1), LuGre.example()), "backward must be a friction law with true adhesion"),
        (lambda: Asymmetric(StaticKinetic(1, 1), 0.5), "backward must be a friction law with true adhesion .* got 0.5"),
        (lambda: Combined(StaticKinetic(1, 1), BogaczRyczek()), "got BogaczRyczek: change its static_friction"),
        (lambda: Combined(Asymmetric.example(), StaticKinetic(1, 1)), "alike in both directions"),
        (lambda: Combined(LuGre.example(), StaticKinetic(1, 1)), "static must be a friction law with true adhesion"),
        (lambda: Combined(StaticKinetic(0.5, 0.5), StaticKinetic(1, 0.8)), "at least the kinetic force"),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused_in_one_sentence(refused, make, sentence):
    refused(sentence, make)
