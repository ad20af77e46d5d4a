"""Branches keep their orbits: each can be looked at, drawn and continued; orbits are found near the returns of a section."""

from __future__ import annotations

import importlib

import matplotlib as mpl
import numpy as np
import pytest
from scipy.optimize import brentq

import stickslip as ss
from stickslip.cli.main import main
from stickslip.dynamics.continuation import branches
from stickslip.errors import UnfinishedWarning

mpl.use("Agg")

SLIDER = ss.Oscillator(0.0, 0.3, ss.laws.StaticKinetic(1.0, 0.4), forcing=ss.Harmonic(0.2, 2.0))
CHAOTIC = ss.Oscillator(0.0, 0.1, ss.laws.StaticKinetic(1.0, 0.5), forcing=ss.Harmonic(0.8, 1.3))


@pytest.fixture(scope="module")
def result():
    return ss.continuation(SLIDER, "forcing.amplitude", (0.19, 0.23), seeds=0)


def test_every_point_of_a_branch_has_its_orbit_its_multipliers_and_phases(result):
    branch = result.branches[0]
    assert len(branch.orbits) == len(branch.values)
    for index in (0, len(branch.values) // 2, -1):
        cycle = branch.orbit(index)
        assert cycle.system.forcing.amplitude == pytest.approx(branch.values[index], abs=1e-14)
        assert cycle.period == branch.period[index]
        assert cycle.stable == branch.stable[index]
        np.testing.assert_allclose(branch.multipliers[index], cycle.multipliers)
        start, end = (np.array(cycle.orbit.at(t)) for t in (0.0, cycle.period))
        np.testing.assert_allclose(start, end, atol=1e-9)
        phases = cycle.phases
        assert phases["duration"].sum() == pytest.approx(cycle.period, abs=1e-12)
        assert phases["mode"].tolist() == ["stick", "forward"] * 2
        assert phases["ends_by"].tolist() == ["release", "capture"] * 2


def test_the_orbit_of_a_special_point_is_where_the_multiplier_is_minus_one(result):
    flip = next(point for point in result.special_points if point.kind == "flip")
    assert flip.orbit.multipliers[0] == pytest.approx(-1.0, abs=1e-9)
    assert flip.orbit.stable is None
    assert flip.orbit.system.forcing.amplitude == pytest.approx(flip.parameter, abs=1e-14)


def test_an_unstable_orbit_of_a_branch_is_continued_over_another_number(result):
    branch = result.branches[0]
    unstable = branch.orbit(branch.stable.index(False))
    other = ss.continuation(unstable.system, "drive_velocity", (0.295, 0.305), guess=unstable, seeds=0)
    assert len(other.branches) == 1
    # the branch passes through the orbit it started from
    again = other.branches[0].nearest(0.3)
    moved = ss.periodic_orbit(unstable.system, again)
    assert moved.period == pytest.approx(unstable.period, abs=1e-12)
    assert moved.largest == pytest.approx(unstable.largest, abs=1e-9)
    assert not moved.stable


@pytest.mark.long
def test_what_a_branch_has_not_is_refused_in_one_sentence(result):
    with pytest.raises(ss.InputError, match="orbit must be from 0 to"):
        result.branches[0].orbit(1000)
    steady = ss.continuation(
        ss.Oscillator(0.1, 1.0, ss.laws.ExponentialStribeck(1.0, 0.5, 0.5)), "drive_velocity", (1, 1.3)
    )
    with pytest.raises(ss.InputError, match="steady_slip has no orbits"):
        steady.branches[0].orbit(0)
    hopf = next(point for point in steady.special_points if point.kind == "hopf")
    with pytest.raises(ss.InputError, match="steady slip has no orbit"):
        _ = hopf.orbit
    unstable = result.branches[0].orbit(-1)
    with pytest.raises(ss.InputError, match="the bounds must hold the value of the guess"):
        ss.continuation(unstable.system, "drive_velocity", (0.4, 0.5), guess=unstable)
    with pytest.raises(ss.InputError, match="a system of another kind"):
        ss.periodic_orbit(ss.Oscillator(0.0, 0.3, SLIDER.law), unstable)


def test_marginal_parts_of_a_branch_have_a_line_of_their_own(result):
    branch = result.branches[0]
    axes = ss.show.branches_plot(result)
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert "unstable" in labels
    assert "marginal" not in labels
    branch.stable[3], was = None, branch.stable[3]
    assert "marginal" in [text.get_text() for text in ss.show.branches_plot(result).get_legend().get_texts()]
    branch.stable[3] = was


def test_an_unstable_orbit_is_drawn_dashed_over_one_period(result):
    branch = result.branches[0]
    cycle = branch.orbit(branch.stable.index(False))
    axes = ss.show.phase_plane(cycle)
    assert all(line.is_dashed() for line in axes.lines[:2])
    assert np.ptp(axes.lines[0].get_xdata()) == pytest.approx(branch.x_max[-1] - branch.x_min[-1], rel=0.05)
    assert not any(line.is_dashed() for line in ss.show.phase_plane(branch.orbit(0)).lines[:2])


@pytest.mark.slow
def test_a_locus_of_flips_ends_where_the_stick_splits_and_says_so(result):
    flip = next(point for point in result.special_points if point.kind == "flip")
    curve = ss.locus(flip, ("forcing.amplitude", "drive_velocity"), ((0.2, 0.4), (0.28, 0.35)))
    (end,) = curve.special_points
    assert end.kind == "flip_and_adding_sliding"
    # both hold there: the multiplier, and the slope with which the stick leaves its limit
    assert end.orbit.multipliers[0] == pytest.approx(-1.0, abs=1e-7)
    tests = end.orbit.closed.tests["detail"]
    assert abs(tests[np.isfinite(tests)]).min() < 1e-6


def friction_and_frequency_of_a_turn_of_third_order(damping):
    """Den Hartog's orbit in closed form (Trans. ASME 53 (1931) 107), where its turn has x″ = x‴ = 0.

    There sin φ = 0 and the amplitude is S + 1; that the half cycle ends at rest then asks for the frequency alone.
    """
    natural = np.sqrt(1.0 - damping**2 / 4.0)
    decay = -damping / 2.0 + 1j * natural

    def at_the_end(order, frequency):
        # x − S = Re(response e^{iΩt} + free e^{decay t}): 1 and at rest at t = 0.
        response = 1.0 / (1.0 - frequency**2 + 1j * damping * frequency)
        real = 1.0 - response.real
        free = real - 1j * (frequency * response.imag + damping / 2.0 * real) / natural
        return (free * decay**order * np.exp(decay * np.pi / frequency) - response * (1j * frequency) ** order).real

    frequency = brentq(lambda frequency: at_the_end(1, frequency), 0.45, 0.55, xtol=1e-15)
    return -0.5 * (1.0 + at_the_end(0, frequency)), frequency


def end_of_crossings(damping):
    swing = ss.Oscillator(damping, 0.0, ss.laws.Coulomb(0.6), forcing=ss.Harmonic(1.0, 0.7))
    (point,) = ss.continuation(swing, "law.kinetic", (0.5, 0.8), seeds=0).special_points
    return ss.locus(point, ("law.kinetic", "forcing.frequency"), ((0.1, 0.75), (0.2, 0.71)))


@pytest.mark.long
def test_a_locus_of_crossings_ends_at_the_turn_of_third_order_known_in_closed_form():
    curve = end_of_crossings(0.1)
    (end,) = curve.special_points
    assert end.kind == "crossing_sliding_and_switching_sliding"
    assert end.values == pytest.approx(friction_and_frequency_of_a_turn_of_third_order(0.1), abs=1e-12)
    assert curve.values[0] == pytest.approx(end.values)


@pytest.mark.slow
def test_without_damping_it_ends_at_a_third_and_a_half():
    # A multiplier is 1 there, so that the point itself is a double root: the curve comes near it and does not name it.
    curve = end_of_crossings(0.0)
    assert curve.values[0] == pytest.approx((1 / 3, 1 / 2), abs=1e-4)
    assert (curve.values[:, 1] > 0.5).all()
    assert not curve.special_points


def test_unstable_orbits_are_found_in_a_section_and_in_a_column_of_a_diagram():
    found = ss.periodic_orbits(ss.section(CHAOTIC, t_end=4000), returns=4)
    assert found
    assert all(cycle.stable is False for cycle in found)
    diagram = ss.orbit_diagram(CHAOTIC, "drive_velocity", [0.1, 0.2], periods=400, keep=300, points=300)
    column = ss.periodic_orbits(diagram.isel(drive_velocity=1), returns=4)
    assert column
    for cycle in column:
        assert cycle.system.drive_velocity == 0.2
        assert cycle.largest > 1
        # it is a motion: a run from there comes back
        x, v = ss.simulate(cycle.orbit.system, cycle.period, *cycle.state[1:]).at(cycle.period)
        assert (x, v) == pytest.approx(cycle.state[1:], abs=1e-9)


def test_orbits_are_found_in_a_column_over_a_number_of_the_forcing():
    diagram = ss.orbit_diagram(CHAOTIC, "forcing.amplitude", [0.75, 0.8], periods=1500, keep=600, points=600)
    found = ss.periodic_orbits(diagram.isel({"forcing.amplitude": 1}), returns=4)
    assert [(cycle.forcing_periods, cycle.stable) for cycle in found] == [(4, False)]
    assert found[0].system.forcing.amplitude == 0.8


def test_an_orbit_that_is_passed_several_times_is_found_once():
    belt = ss.Oscillator(0.1, 0.3, ss.laws.StaticKinetic(1.0, 0.4), forcing=ss.Harmonic(0.2, 1.5))
    (cycle,) = ss.periodic_orbits(ss.section(belt, t_end=400), returns=4, tries=3)
    assert cycle.forcing_periods == 2
    assert cycle.largest == pytest.approx(ss.periodic_orbit(belt).largest, abs=1e-9)


def test_returns_that_make_no_sense_are_refused():
    points = ss.section(SLIDER, t_end=100)
    with pytest.raises(ss.InputError, match="returns must be"):
        ss.periodic_orbits(points, returns=0)
    with pytest.raises(ss.InputError, match="near must lie"):
        ss.periodic_orbits(points, near=2.0)
    with pytest.raises(ss.InputError, match="choose one by isel"):
        ss.periodic_orbits(ss.orbit_diagram(SLIDER, "drive_velocity", [0.1, 0.2], periods=20, keep=5))
    with pytest.raises(ss.InputError, match="the data of section"):
        ss.periodic_orbits(points.drop_attrs())


@pytest.fixture(scope="module")
def forced_slider():
    """Its cycle of one forcing period round 1.95 lies on a closed curve over the frequency."""

    def friction(w):
        return 0.3 + 0.2 / (1 + 5 * w) ** 2 + 0.05 * w

    def slope(w):
        return -2.0 / (1 + 5 * w) ** 3 + 0.05

    law = ss.laws.smooth_from_function(friction, w_max=3.0, derivative=slope, break_away=0.55)
    return ss.Oscillator(0.08, 0.35, law, forcing=ss.Harmonic(0.1, 1.95))


@pytest.mark.slow
def test_a_closed_branch_ends_where_it_meets_its_first_point(forced_slider):
    (branch,) = ss.continuation(forced_slider, "forcing.frequency", (1.5, 2.5), seeds=0).branches
    assert branch.closed
    assert not branch.cut
    assert branch.ends == ("closed", "closed")
    assert branch.values[-1] == pytest.approx(branch.values[0], abs=1e-12)
    # Each fold once, the outer two at the ends of the range.
    folds = sorted(point.parameter for point in branch.special_points)
    assert [point.kind for point in branch.special_points] == ["fold"] * 4
    assert min(np.diff(folds)) > 1e-3
    assert (folds[0], folds[-1]) == pytest.approx((1.93452, 1.97512), abs=1e-5)
    assert (min(branch.values), max(branch.values)) == pytest.approx((folds[0], folds[-1]), abs=1e-4)


def test_a_branch_that_is_cut_off_says_by_which_limit(forced_slider):
    with pytest.warns(UnfinishedWarning, match="1 of 1 branches were cut off by most; raise most"):
        (branch,) = ss.continuation(forced_slider, "forcing.frequency", (1.5, 2.5), seeds=0, most=4).branches
    assert branch.cut == "most"
    assert branch.ends == ("most", "most")
    assert not branch.closed
    assert len(branch.values) == 7


@pytest.mark.slow
def test_a_limit_of_time_keeps_what_is_found(forced_slider, monkeypatch):
    clock = iter(range(1000))
    monkeypatch.setattr("stickslip.simulation.time_limit.time.time", lambda: float(next(clock)))
    with pytest.warns(UnfinishedWarning, match="max_seconds and 3 starts were not looked at; raise max_seconds"):
        (branch,) = ss.continuation(forced_slider, "forcing.frequency", (1.5, 2.5), max_seconds=20).branches
    assert branch.cut == "max_seconds"
    assert len(branch.values) > 5


def test_continue_keeps_and_says_what_it_has_found_by_its_limits(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("stickslip.files.progress.BETWEEN_LINES", 0.0)
    system, output = tmp_path / "system.toml", tmp_path / "branches.nc"
    system.write_text(SLIDER.to_toml())
    asked = ["continue", str(system), "--over", "forcing.amplitude=0.19:0.23", "--most", "4", "-o", str(output)]
    assert main(asked) == 0
    said = capsys.readouterr()
    assert said.out.splitlines()[0].endswith("cut off by --most")
    assert "raise most to go on" in said.err
    assert "points: 3 of 4" in said.err
    assert output.exists()


def test_a_search_without_time_ends_in_one_sentence(tmp_path, capsys):
    system = tmp_path / "system.toml"
    system.write_text(SLIDER.to_toml())
    assert main(["continue", str(system), "--over", "forcing.amplitude=0.19:0.23", "--max-seconds", "1e-9"]) == 2
    assert "continue: no motion to start from was found within max_seconds" in capsys.readouterr().err


@pytest.fixture(scope="module")
def doubling_slider():
    """By Runge and Kutta's method with fixed steps its motion from rest has twice the period up to 1.841, one beyond."""

    def friction(w):
        return 0.45 + 0.5 / (1 + 3 * w * w) + 0.08 * w + 0.05 * np.exp(-(((w - 1) / 0.3) ** 2))

    law = ss.laws.smooth_from_function(friction, w_max=6.0, break_away=1.05)
    return ss.Oscillator(0.03, 0.12, law, forcing=ss.Harmonic(0.5, 1.7))


@pytest.mark.slow
def test_a_branch_of_twice_the_period_ends_at_the_flip(doubling_slider):
    result = ss.continuation(doubling_slider, "forcing.frequency", (1.6, 2.0), seeds=3)
    doubled, single = sorted(result.branches, key=lambda branch: -branch.orbits[0].forcing_periods)
    (flip,) = single.special_points
    assert flip.kind == "flip"
    assert flip.parameter == pytest.approx(1.84138, abs=1e-5)
    # Beyond it the orbit would be itself, one period of the forcing later: no fold, and no closed curve.
    assert [point.kind for point in doubled.special_points] == ["flip"]
    assert not doubled.closed
    assert (single.ends, doubled.ends) == (("bounds", "bounds"), ("bounds", "flip"))
    assert ss.switch_branch(result, flip).ends == ("flip", "bounds")
    assert (doubled.values[0], doubled.values[-1]) == pytest.approx((1.6, flip.parameter), abs=1e-9)
    assert all(np.diff(doubled.values) > 0)
    assert doubled.orbit(-1).forcing_periods == 2
    assert doubled.multiplier[-1] == pytest.approx(1.0, abs=1e-8)
    assert doubled.special_points[0].orbit.multipliers[0] == pytest.approx(-1.0, abs=1e-8)
    # Both branches have it.
    assert [point.kind for point in result.special_points] == ["flip"]


@pytest.mark.slow
def test_the_command_line_says_why_a_branch_ends_within_the_bounds(doubling_slider, tmp_path, capsys):
    path = tmp_path / "forced.toml"
    path.write_text(doubling_slider.to_toml())
    main(["continue", str(path), "--over", "forcing.frequency=1.8:1.9"])
    lines = capsys.readouterr().out.splitlines()
    assert [line.split("1.8 … ")[1] for line in lines if line.startswith("cycle")] == [
        "1.84138, ends at 1.84138: flip",
        "1.9",
    ]
    assert sum(line.startswith("flip") for line in lines) == 1


#: Friction falls beside w = 1, rises beside that and falls again to w = 0: a small and a large cycle on a drive of 1.
NESTED = ss.laws.PiecewiseLinear(
    [(0.0, 1.0), (0.2, 0.95), (0.7, 0.65), (0.9, 0.75), (1.1, 0.71), (1.3, 0.81), (1.8, 0.56), (3.0, 0.5)], 1.0
)


def ends_of(nodes, v, t_end=400.0):
    """Least and greatest x over the last quarter of ẍ + x = F(1 − ẋ), |F| <= 1 at w = 0, by small steps in time."""
    speeds, forces = np.array(nodes).T
    x, h, xs = float(np.interp(1.0, speeds, forces)), 2e-3, []
    for step in range(int(t_end / h)):
        w = 1.0 - v
        force = np.sign(w) * np.interp(abs(w), speeds, forces) if abs(w) > 2e-3 else np.clip(x, -1.0, 1.0)
        stuck = abs(w) <= 2e-3 and abs(x) <= 1.0
        v = 1.0 if stuck else v + h * (force - x)
        x += h * v
        if step * h > 0.75 * t_end:
            xs.append(x)
    return min(xs), max(xs)


@pytest.mark.slow
def test_starts_find_a_stable_cycle_beside_that_from_rest():
    belt = ss.Oscillator(0.0, 1.0, NESTED)
    alone = ss.continuation(belt, "damping", (0.0, 0.05), seeds=1, starts=0)
    both = ss.continuation(belt, "damping", (0.0, 0.05), seeds=1)
    assert [branch.kind for branch in alone.branches] == ["steady_slip", "cycle"]
    assert [branch.kind for branch in both.branches] == ["steady_slip", "cycle", "cycle"]
    assert all(branch.sticks[0] == large for branch, large in zip(both.branches[1:], (True, False), strict=True))
    assert both.others == ()
    # Both are motions of small steps in time, from small and from large speeds.
    for branch, v in zip(both.branches[1:], (-1.0, 0.2), strict=True):
        here = branch.values.index(0.0)
        assert branch.stable[here]
        np.testing.assert_allclose((branch.x_min[here], branch.x_max[here]), ends_of(NESTED.nodes, v), atol=0.01)


@pytest.mark.slow
def test_a_motion_that_starts_end_in_and_no_branch_has_is_said(monkeypatch, tmp_path, capsys):
    module = importlib.import_module("stickslip.dynamics.continuation.branches")

    def refused(*_given, **_options):
        raise ss.InputError("no return")

    monkeypatch.setattr(module, "event_cycle", refused)
    belt = ss.Oscillator(0.0, 1.0, NESTED)
    found = ss.continuation(belt, "damping", (0.0, 0.05), seeds=1)
    assert len(found.branches) == 2
    other = found.others[0]
    assert (other.regime, other.repeats, other.value) == ("almost_harmonic", True, 0.0)
    assert repr(found).endswith("motions on no branch: 2>")
    assert found.facts()["motions on no branch"] == ["almost_harmonic at 0", "almost_harmonic at 0.025"]
    file = tmp_path / "belt.toml"
    nodes = ", ".join(f"[{w}, {f}]" for w, f in NESTED.nodes)
    file.write_text(
        "mass = 1.0\nstiffness = 1.0\ndamping = 0.0\ndrive_velocity = 1.0\n"
        f'[law]\ntype = "PiecewiseLinear"\nbreak_away = 1.0\nnodes = [{nodes}]\n'
    )
    assert main(["continue", str(file), "--over", "damping=0:0.05"]) == 0
    assert "other almost harmonic" in capsys.readouterr().out
    assert main(["continue", str(file), "--over", "damping=0:0.05", "--starts", "0"]) == 0
    assert "on no branch" not in capsys.readouterr().out


def stick_slip_period(law, speed):
    """Andronov's cycle of a mass of unit frequency without damping: a stick of 2 A/s, and the slip round f_k."""
    fall = law.break_away - law.kinetic
    return 2 * fall / speed + 2 * np.pi - 2 * np.arctan(fall / speed)


def test_a_slow_drive_has_the_cycle_of_its_long_sticks():
    # A stick of 80 000 time units outlasts any run of some hundred natural periods.
    law = ss.laws.StaticKinetic(10.0, 6.0)
    cycle = ss.periodic_orbit(ss.Oscillator(0.0, 1e-4, law))
    assert cycle.period == pytest.approx(stick_slip_period(law, 1e-4), rel=1e-12)
    assert cycle.stable


def test_a_guess_that_ends_in_a_stick_is_no_part_of_the_cycle():
    # A release forgets where the stick began: the way from the guess has the cycle's events, but its first stick is longer.
    law = ss.laws.StaticKinetic(1.45, 1.27)
    cycle = ss.periodic_orbit(ss.Oscillator(0.0, 0.2, law), (1.7, 0.6))
    assert cycle.period == pytest.approx(stick_slip_period(law, 0.2), rel=1e-12)


def test_stick_slip_beside_steady_slip_is_followed_over_two_decades_of_a_slow_drive():
    law = ss.laws.StaticKinetic(10.0, 6.0)
    found = ss.continuation(ss.Oscillator(0.0, 1e-3, law), "drive_velocity", (1e-4, 0.01), seeds=1, starts=0)
    steady, cycle = found.branches
    assert (steady.kind, cycle.kind, cycle.ends) == ("steady_slip", "cycle", ("bounds", "bounds"))
    speeds = np.array(cycle.values)
    np.testing.assert_allclose(speeds[[0, -1]], (1e-4, 0.01))
    np.testing.assert_allclose(cycle.period, stick_slip_period(law, speeds), rtol=1e-11)
    assert len(speeds) < 60


def test_steady_slip_that_nothing_damps_is_marginal_and_one_that_is_left_for_the_unknown_is_said(monkeypatch):
    undamped = ss.continuation(ss.Oscillator(0.0, 0.3, ss.laws.Coulomb(0.5)), "drive_velocity", (0.2, 0.4), seeds=0)
    assert set(undamped.branches[0].stable) == {None}
    assert "marginal at 121" in repr(undamped.branches[0])
    # F′ = −5 e^(−u/0.1) outweighs D = 0.1 below u = 0.1 ln 50.
    falling = ss.Oscillator(0.1, 1.0, ss.laws.ExponentialStribeck(1.0, 0.5, 0.1))

    def nothing(*_args, **_options):
        raise ss.InputError("periodic_orbit: no return")

    monkeypatch.setattr(branches, "periodic_orbit", nothing)
    with pytest.warns(UnfinishedWarning, match="unstable from 0.01 to 0.1, .* not found"):
        ss.continuation(falling, "drive_velocity", (0.01, 0.1), seeds=1, starts=0)
