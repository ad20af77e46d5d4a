"""The known numbers of stability, their table, and the motion on both sides of each kind of point."""

from __future__ import annotations

import numpy as np
import pytest
from evidence import script

import stickslip as ss

numbers = script("stability")


#: Half of the time of all: runs and cycles to twelve digits.
LONG = {"by_multipliers", "sliding"}


@pytest.mark.parametrize(
    "compute",
    [
        pytest.param(one, id=one.__name__, marks=[pytest.mark.slow] if one.__name__ in LONG else [])
        for one in numbers.CASES
    ],
)
def test_known_numbers_are_met_to_their_digits(compute):
    for row in compute():
        assert row.met, str(row)
        assert str(row) in numbers.PAGE.read_text(encoding="utf-8"), "run python docs/evidence/stability.py"


@pytest.mark.slow
def test_the_table_of_known_numbers_is_current():
    assert numbers.page() == numbers.PAGE.read_text(encoding="utf-8"), "run python docs/evidence/stability.py"


def settled(system: ss.Oscillator, periods: int = 600) -> ss.Orbit:
    period = 2 * np.pi / system.harmonics[0].frequency
    return ss.simulate(system, periods * period)


def kinds_of_a_period(system: ss.Oscillator) -> list[str]:
    orbit = settled(system)
    last = orbit.t_end - 2 * np.pi / system.harmonics[0].frequency
    return orbit.events["kind"][orbit.events["t"] > last].to_list()


def test_switching_sliding_changes_where_the_stick_is_entered():
    # Below it the mass slips back for a moment before it sticks.
    assert kinds_of_a_period(numbers.den_hartog(0.4, 0.132, 0.1)).count("crossing") == 2
    assert kinds_of_a_period(numbers.den_hartog(0.4, 0.134, 0.1)).count("crossing") == 0


def test_adding_sliding_splits_the_stick():
    assert kinds_of_a_period(numbers.den_hartog(0.2, 0.425)).count("release") == 4
    assert kinds_of_a_period(numbers.den_hartog(0.2, 0.428)).count("release") == 2


def returns_after(system: ss.Oscillator, periods: int) -> float:
    orbit = settled(system, 3000)
    period = 2 * np.pi / system.harmonics[0].frequency
    x = orbit.at(orbit.t_end - period * np.arange(20.0 * periods))[0]
    return float(np.abs(x[periods:] - x[:-periods]).max())


def test_at_a_flip_a_branch_of_twice_the_period_begins_and_runs_follow_it():
    # The point lies at u = 0.398862436; the doubled motion is stable up to its own grazing-sliding.
    assert returns_after(numbers.slider(0.37, 1.8), 2) < 1e-9
    assert returns_after(numbers.slider(0.405, 1.8), 2) > 1e-3
    assert returns_after(numbers.slider(0.405, 1.8), 4) < 1e-9
    result = ss.continuation(numbers.slider(0.39, 1.8), "forcing.amplitude", (0.385, 0.405), seeds=0)
    (flip,) = [item for item in result.special_points if item.kind == "flip"]
    doubled = ss.switch_branch(result, flip)
    assert doubled.values[0] == pytest.approx(flip.parameter, abs=1e-4)
    assert doubled.values[-1] == 0.405
    assert all(doubled.stable)
    assert doubled.period[-1] == pytest.approx(4 * 2 * np.pi / 1.8, abs=1e-12)
    orbit = settled(numbers.slider(0.405, 1.8), 3000)
    x = orbit.at(np.linspace(orbit.t_end - doubled.period[-1], orbit.t_end, 5000))[0]
    assert [doubled.x_min[-1], doubled.x_max[-1]] == pytest.approx([x.min(), x.max()], abs=1e-3)


def test_a_subcritical_flip_opens_an_unstable_branch_and_runs_jump():
    result = ss.continuation(numbers.slider(0.21), "forcing.amplitude", (0.2, 0.23), seeds=0)
    (flip,) = [item for item in result.special_points if item.kind == "flip"]
    doubled = ss.switch_branch(result, flip, most=10)
    assert doubled.values[-1] < flip.parameter - 1e-4
    assert not any(doubled.stable)
    assert returns_after(numbers.slider(0.224), 10) > 1e-3


def test_beyond_a_boundary_the_other_event_sequence_is_followed():
    result = ss.continuation(numbers.den_hartog(0.2, 0.44), "law.kinetic", (0.42, 0.45), seeds=0)
    (adding,) = [item for item in result.special_points if item.kind == "adding_sliding"]
    beyond = ss.switch_branch(result, adding)
    assert max(beyond.values) <= adding.parameter
    cycle = ss.periodic_orbit(numbers.den_hartog(0.2, 0.42))
    assert cycle.events.count("release") == 4
    assert beyond.values[-1] == 0.42
    assert beyond.multiplier[-1] == pytest.approx(np.abs(cycle.multipliers).max(), abs=1e-9)


@pytest.mark.slow
def test_loci_pass_through_points_located_one_by_one():
    system = numbers.den_hartog(0.2, 0.44)
    (adding,) = ss.continuation(system, "law.kinetic", (0.4, 0.46), seeds=0).special_points
    curve = ss.locus(adding, ("law.kinetic", "forcing.frequency"), ((0.38, 0.48), (0.19, 0.21)))
    (flip,) = [
        p for p in numbers.specials(numbers.slider(0.35, 1.8), "forcing.amplitude", (0.3, 0.42)) if p.kind == "flip"
    ]
    other = ss.locus(flip, ("forcing.amplitude", "forcing.frequency"), ((0.3, 0.42), (1.78, 1.81)))
    for found, parameter, made in (
        (curve, "law.kinetic", lambda value, omega: numbers.den_hartog(omega, value + 0.005)),
        (other, "forcing.amplitude", lambda value, omega: numbers.slider(value - 0.005, omega)),
    ):
        assert found.kind in ("adding_sliding", "flip")
        for value, omega in found.values[[1, len(found.values) // 2, -2]]:
            bounds = (value - 0.01, value + 0.01)
            alone = ss.continuation(made(value, omega), parameter, bounds, seeds=0).special_points
            assert [p.parameter for p in alone if p.kind == found.kind] == pytest.approx([value], abs=1e-9)


def test_the_hopf_locus_of_the_cubic_law_is_its_closed_form():
    # d = k1 − 3 k3 v² (Thomsen & Fidlin 2003): k1 = 0.45, k3 = 0.6.
    found = numbers.specials(numbers.thomsen_fidlin(0.43), "drive_velocity", (0.39, 0.45))
    (hopf,) = [item for item in found if item.kind == "hopf"]
    curve = ss.locus(hopf, ("drive_velocity", "damping"), ((0.3, 0.49), (0.01, 0.3)))
    assert len(curve.values) > 5
    assert curve.values[:, 1] == pytest.approx(0.45 - 1.8 * curve.values[:, 0] ** 2, abs=1e-12)


def test_at_a_neimark_sacker_point_a_torus_begins():
    # The point lies at u = 0.014016663.
    for amplitude, locked in ((0.016, True), (0.012, False)):
        system = numbers.thomsen_fidlin(0.43, ss.Harmonic(amplitude, 1.05))
        period = 2 * np.pi / 1.05
        orbit = ss.simulate(system, 5000 * period, x0=0.3, v0=0.0)
        x = orbit.at(orbit.t_end - period * np.arange(40.0))[0]
        assert bool(np.ptp(x) < 1e-6) is locked
