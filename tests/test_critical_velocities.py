"""Critical velocities where slip is neutral, against closed forms, and random oscillators against plain runs."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from evidence import script
from scipy.optimize import brentq

import stickslip as ss
from stickslip.cli.main import main
from stickslip.dynamics.continuation.arclength import Family, axis, corrected
from stickslip.dynamics.continuation.branch import Branch
from stickslip.dynamics.critical import branch_search, runs
from stickslip.dynamics.critical.critical_velocities import CriticalVelocities
from stickslip.dynamics.critical.vanishing import vanishing
from stickslip.dynamics.equilibria.hopf_points import hopf_points
from stickslip.dynamics.equilibria.steady_slip import steady_slip
from stickslip.errors import UnfinishedWarning
from stickslip.simulation import time_limit

evidence = script("critical_velocities")

LOGARITHMIC = ss.laws.LogarithmicDwell(0.5, 0.05, 1.0)
DWELL = ss.laws.DwellTime(0.5, 0.5, 0.4)
RATE = ss.laws.ForceRate(0.5, 0.5, 0.4, 0.3)

# Undamped slip under constant friction ends as far below f_k as it began above: k v t = 2 (f_s(t) − f_k) in a cycle, and for
# vanishing stick time t the greatest velocity is 2 f_s′(0)/k.


@pytest.mark.parametrize(
    ("law", "bounds", "end"),
    [
        (LOGARITHMIC, None, 2 * 0.05 / 1.0),
        pytest.param(LOGARITHMIC, (0.05, 0.3), 2 * 0.05 / 1.0, marks=pytest.mark.slow),
        pytest.param(DWELL, (0.2, 0.8), 2 * 0.4 * 0.5, marks=pytest.mark.long),
        # f_s′(0) falls with the force rate k v here.
        pytest.param(
            RATE,
            (0.1, 1.0),
            brentq(lambda v: v * (1 + v / 0.3) - 2 * 0.4 * 0.5, 0.0, 1.0, xtol=1e-15),
            marks=pytest.mark.long,
        ),
    ],
)
def test_stick_slip_over_neutral_slip_ends_where_its_stick_time_vanishes(law, bounds, end):
    found = ss.critical_velocities(ss.Oscillator(0.0, 0.3, law), bounds)
    assert dict(found) == {"end_of_stick_slip": pytest.approx(end, abs=1e-9)}
    low, high = bounds or (0.005, 1.5)
    assert found.neutral == ((pytest.approx(low), pytest.approx(high)),)
    for velocity, sticks in ((0.99 * end, True), (1.01 * end, False)):
        orbit = ss.simulate(ss.Oscillator(0.0, velocity, law), 6000.0)
        releases = orbit.events[(orbit.events["kind"] == "release") & (orbit.events["t"] > 5000)]
        assert bool((releases["stick_time"] > 1e-3).any()) is sticks


@pytest.mark.parametrize(
    ("seed", "found"),
    [
        # Static friction that grows faster than time at first: sticks become ever shorter with the speed and never end.
        (20, {}),
        # Stick-slip goes on above the Hopf point, over a range in which steady slip is stable too. From the fold to the Hopf
        # point a cycle without sticks attracts beside it: runs from beside steady slip end on it at 2.8099, not at 2.8095.
        pytest.param(
            584,
            {
                "nonsmooth_hopf": 2.978587507,
                "fold": 2.809717969,
                "nonsmooth_fold": 3.077614022,
                "end_of_stick_slip": 3.077614022,
            },
            marks=pytest.mark.slow,
        ),
        # An unstable cycle grazes at 0.95: the start of a run leaves one basin for another, and no motion changes.
        pytest.param(501, {"fold": 1.188411090, "end_of_stick_slip": 1.188411090}, marks=pytest.mark.slow),
        # Between 1.3888 and 1.3915 a cycle without sticks attracts beside stick-slip and steady slip.
        pytest.param(
            39,
            {"nonsmooth_hopf": 1.026944043, "fold": 1.388758633, "nonsmooth_fold": 1.61361617, "end_of_stick_slip": 1.613616},
            marks=pytest.mark.slow,
        ),
    ],
)  # fmt: skip
def test_what_runs_on_both_sides_show_is_reported_and_nothing_else(seed, found):
    assert dict(ss.critical_velocities(*evidence.oscillator(seed))) == pytest.approx(found, abs=1e-6)


@pytest.mark.parametrize("law", [LOGARITHMIC, ss.laws.Coulomb(0.5)], ids=["LogarithmicDwell", "Coulomb"])
@pytest.mark.parametrize("bounds", [(0.2, 0.8), (0.3, 1.0)])
def test_neutral_slip_is_named_and_has_no_critical_velocity(law, bounds):
    found = ss.critical_velocities(ss.Oscillator(0.0, 0.3, law), bounds)
    assert found.all == ()
    assert found.neutral == (bounds,)
    assert f"neutral slip from {bounds[0]:g} to {bounds[1]:g}" in repr(found)


@pytest.mark.long
def test_slip_that_becomes_neutral_or_ceases_to_be_is_a_corner():
    level = ss.laws.PiecewiseLinear([(0.0, 1.0), (0.2, 0.6), (0.6, 0.6), (1.2, 0.7)], 1.0)
    found = ss.critical_velocities(ss.Oscillator(0.0, 0.3, level), (0.1, 0.8))
    assert [value for kind, value in found.all if kind == "nonsmooth_hopf"] == pytest.approx([0.2, 0.6], abs=1e-12)
    assert found.neutral == ((pytest.approx(0.2, abs=1e-12), pytest.approx(0.6, abs=1e-12)),)
    # Beside steady slip motion grows, stays and decays.
    growth = []
    for velocity in (0.19, 0.21, 0.59, 0.61):
        orbit = ss.simulate(ss.Oscillator(0.0, velocity, level), 20.0, x0=float(level.kinetic_force(velocity)), v0=1e-3)
        sizes = [max(abs(orbit.at(t)[1]) for t in (start, start + math.pi)) for start in (0.0, 4 * math.pi)]
        growth.append(sizes[1] / sizes[0])
    assert growth[0] > 1.1
    assert growth[1:3] == pytest.approx([1.0, 1.0], abs=1e-9)
    assert growth[3] < 0.9


def test_damping_of_steady_slip_on_a_steep_law_is_no_rounding():
    law = ss.laws.Cubic(0.0816, 1.52, 924.5)
    for velocity in (0.05, 0.2, 1.0, 10.0):
        state = steady_slip(ss.Oscillator(0.0878, velocity, law))
        assert state.damping == pytest.approx(0.0878 - 1.52 + 3 * 924.5 * velocity**2, rel=1e-12)
    # where it was taken for growth that came and went, a cycle was looked for at each speed
    assert [kind for kind, _ in hopf_points(ss.Oscillator(0.0878, 0.1, law), "/drive_velocity", (0.01, 0.2))] == [
        "hopf"
    ]


def test_a_cycle_around_a_centre_is_marginal():
    cycle = ss.periodic_orbit(ss.Oscillator(0.0, 0.7, ss.laws.Coulomb(0.5)), guess=(0.5, 0.07))
    assert cycle.marginal
    assert not cycle.stable
    assert repr(cycle).endswith("marginal>")


def test_the_command_names_neutral_slip(tmp_path, capsys):
    system = tmp_path / "system.toml"
    system.write_text(ss.Oscillator(0.0, 0.3, ss.laws.Coulomb(0.5)).to_toml())
    assert main(["critical", str(system), "--between", "0.2:0.8"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "none in this range",
        "neutral slip        from 0.2 to 0.8: small disturbances neither grow nor decay",
    ]


@pytest.mark.slow
def test_the_command_gives_intervals_of_a_fitted_law(tmp_path, capsys):
    names, system = ["break_away", "kinetic"], tmp_path / "system.toml"
    covariance = pd.DataFrame(np.diag([1e-4, 1e-4]), index=names, columns=names)
    ss.laws.StaticKinetic(1.0, 0.6).with_covariance(covariance).save(tmp_path / "law.toml")
    system.write_text('mass = 1.0\nstiffness = 1.0\ndamping = 0.1\ndrive_velocity = 0.3\nlaw = "law.toml"\n')
    command = ["critical", str(system), "--between", "0.2:0.8"]
    assert main([*command, "--samples", "10", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    low, high, laws = found["intervals"]["end_of_stick_slip"]
    value = dict(found["critical_velocities"])["end_of_stick_slip"]
    assert laws == 10
    # under this law the speed is proportional to what friction falls by
    drawn = [value / 0.4 * (one.break_away - one.kinetic) for one in ss.load_law(tmp_path / "law.toml").sample(10, 0)]
    assert [low, high] == pytest.approx(np.quantile(drawn, [0.025, 0.975]), rel=1e-6)
    assert main([*command, "--samples", "12", "--max-seconds", "5"]) == 2
    assert "--samples does not go with --max-seconds" in capsys.readouterr().err
    system.write_text(ss.Oscillator(0.1, 0.3, ss.laws.StaticKinetic(1.0, 0.6)).to_toml())
    assert main([*command, "--samples", "12"]) == 2
    assert "has no covariance" in capsys.readouterr().err


def test_the_command_ends_after_max_seconds_with_one_line(tmp_path, capsys):
    system = tmp_path / "system.toml"
    system.write_text(ss.Oscillator(0.0, 0.3, DWELL).to_toml())
    assert main(["critical", str(system), "--between", "0.2:0.8", "--max-seconds", "1e-6"]) == 0
    out, err = capsys.readouterr()
    assert out.splitlines()[0] == "none confirmed so far"
    assert err == (
        "stickslip: critical: the search ended after max_seconds and is unfinished; raise max_seconds to go on\n"
    )


@pytest.mark.parametrize("seed", evidence.FEW)
def test_what_is_reported_is_what_runs_show(seed):
    case = evidence.case(seed, 25)
    assert case.unconfirmed == []
    assert case.missed == []


@pytest.mark.slow
def test_the_table_of_random_oscillators_finds_none_wrong(tmp_path):
    cases = evidence.cases(range(evidence.COUNT), tmp_path / "results.jsonl")
    assert len(cases) == evidence.COUNT
    assert [case.seed for case in cases if case.wrong] == []


def test_a_small_cycle_is_followed_down_to_the_hopf_point():
    # A step too far ends on steady slip, whose size is rounding: no cycle of half the size.
    belt, bounds = ss.Oscillator(0.1, 1.152, ss.laws.ExponentialStribeck(1.0, 0.5, 0.5)), (1.1, 1.25)
    cycle = ss.periodic_orbit(belt, guess=(float(belt.law.kinetic_force(1.152)), 0.055))
    family = Family(("/drive_velocity",), (bounds,), relative=True)
    point = corrected(cycle.closed.sequence, 0, family, np.array([1.152]), axis(cycle.closed.sequence))
    kind, value, _ = vanishing(replace(point, direction=-point.direction), family)
    assert kind == "hopf"
    assert value == pytest.approx(belt.law.scale * math.log(0.5 / 0.5 / 0.1), abs=1e-10)


@pytest.mark.long
def test_rounding_in_the_return_map_makes_no_branch_creep():
    # A stick forgets all: the derivative of the return map is zero, of which rounding leaves some 1e-17, or nothing.
    system, bounds = evidence.oscillator(26)
    (branch,) = (
        item for item in ss.continuation(system, "drive_velocity", bounds, seeds=1).branches if item.kind == "cycle"
    )
    assert min(branch.values) == pytest.approx(bounds[0])
    assert max(branch.values) == pytest.approx(bounds[1])
    assert len(branch.values) < 100


def test_a_fold_is_found_once_where_the_parameter_stands_still_along_the_branch():
    system, _ = evidence.oscillator(6)
    start = ss.periodic_orbit(system.with_number("drive_velocity", 0.2))
    found = ss.continuation(start.system, "drive_velocity", (0.18, 0.3), guess=start, seeds=0)
    assert all(item.parameter == pytest.approx(0.274884517637, abs=1e-9) for item in found.special_points)
    # Undamped, a stick of time t takes 2 (f_s(t) − f_k) = k s t: at the fold any t up to the first node of the table does.
    (low, at_once), (node, grown) = system.law.break_away[:2]
    (fold,) = [item for item in found.special_points if item.kind == "fold"]
    assert fold.parameter == pytest.approx(2 * (grown - at_once) / (system.stiffness * (node - low)), abs=1e-10)
    widest = np.hypot((grown - at_once) / system.stiffness, fold.parameter * np.sqrt(system.mass / system.stiffness))
    assert np.ptp(fold.x) / 2 == pytest.approx(widest, abs=3e-4)
    # Undamped and under constant friction all cycles of one speed are harmonic: they begin to touch w = 0 at x̂ = s/ω. The
    # parameter stands still there, so rounding decides whether that point is named.
    half = 0.274884517637 * np.sqrt(system.mass / system.stiffness)
    assert all(np.ptp(item.x) / 2 == pytest.approx(half, abs=1e-8) for item in found.special_points if item is not fold)


@pytest.mark.long
def test_no_cycle_is_looked_for_where_a_motion_decays_slowly(monkeypatch):
    system, _ = evidence.oscillator(50)
    tried = []
    event_cycle = branch_search.event_cycle
    monkeypatch.setattr(branch_search, "event_cycle", lambda *run, **how: tried.append(1) or event_cycle(*run, **how))
    assert dict(ss.critical_velocities(system, (0.04, 1.0))) == pytest.approx(
        {"fold": 0.054037256492, "end_of_stick_slip": 0.054037256492}, abs=1e-9
    )
    assert len(tried) < 4  # one for the stick-slip; a try at every speed beyond would be 20 more


@pytest.mark.slow
def test_the_judge_finds_a_motion_that_only_starts_on_the_drive_reach():
    system, _ = evidence.oscillator(582)
    assert evidence.confirmed(system, "adding_sliding", 0.0392662028948521, 0.0027)
    assert not evidence.confirmed(system, "adding_sliding", 0.0388, 0.0005)


@pytest.mark.long
def test_a_search_says_how_far_it_is():
    said = []
    ss.critical_velocities(
        ss.Oscillator(0.0, 0.3, DWELL), (0.3, 0.5), progress=lambda what, done, n: said.append((what, done, n))
    )
    assert list(dict.fromkeys(what for what, _, _ in said)) == ["runs", "cycles", "confirmation"]
    for stage in ("runs", "cycles", "confirmation"):
        counts = list(dict.fromkeys((done, n) for what, done, n in said if what == stage))
        assert [done for done, _ in counts] == sorted({done for done, _ in counts})
        assert counts[0][0] == 0
        assert counts[-1] == (counts[0][1], counts[0][1])


@pytest.mark.long
def test_a_search_says_that_it_goes_on_before_each_run_and_each_point(monkeypatch):
    silent, most, add = {"runs": 0, "points": 0}, {"runs": 0, "points": 0}, Branch.add

    def counted(kind, of):
        def call(*given, **options):
            silent[kind] += 1
            most[kind] = max(most[kind], silent[kind])
            return of(*given, **options)

        return call

    monkeypatch.setattr(runs, "end_of_run", counted("runs", runs.end_of_run))
    monkeypatch.setattr(Branch, "add", counted("points", add))
    law = ss.laws.PiecewiseLinear([(0.0, 1.0), (0.2, 0.6), (0.6, 0.6), (1.2, 0.7)], 1.0)
    ss.critical_velocities(
        ss.Oscillator(0.0, 0.3, law), (0.1, 0.8), progress=lambda *_: silent.update(runs=0, points=0)
    )
    assert most["runs"] == 1
    assert 0 < most["points"] <= 3


@pytest.mark.long
def test_a_search_ends_after_max_seconds_with_what_it_has_confirmed(monkeypatch):
    system = ss.Oscillator(0.0, 0.3, ss.laws.PiecewiseLinear([(0.0, 1.0), (0.2, 0.6), (0.6, 0.6), (1.2, 0.7)], 1.0))
    # A clock that stops after the first of several velocities is confirmed.
    monkeypatch.setattr(time_limit.time, "time", lambda: 0.0)
    whole = ss.critical_velocities(system, (0.1, 0.8), max_seconds=1.0)
    assert whole.finished
    assert whole.brackets == ()
    assert len(whole.all) > 1

    def stop(what, done, _):
        if (what, done) == ("confirmation", 1):
            monkeypatch.setattr(time_limit.time, "time", lambda: 2.0)

    with pytest.warns(
        UnfinishedWarning, match="critical_velocities: the search ended after max_seconds and is unfinished"
    ):
        found = ss.critical_velocities(system, (0.1, 0.8), max_seconds=1.0, progress=stop)
    assert found.all == whole.all[:1]
    assert not found.finished
    assert repr(found).endswith("unfinished>")
    with pytest.raises(ss.InputError, match="max_seconds must be greater than 0"):
        ss.critical_velocities(system, max_seconds=0)


def test_a_search_that_ends_early_gives_the_brackets_of_its_runs(monkeypatch, tmp_path, capsys):
    # Stick-slip ends at 0.54904631 and steady slip is stable everywhere.
    system, ends = ss.Oscillator(0.1, 0.3, ss.laws.StaticKinetic(1.0, 0.5)), 0.54904631

    def search(stage):
        """A clock that stops at the begin of a stage."""
        monkeypatch.setattr(time_limit.time, "time", lambda: 0.0)

        def stop(what, *_):
            if what == stage:
                monkeypatch.setattr(time_limit.time, "time", lambda: 2.0)

        with pytest.warns(UnfinishedWarning):
            return ss.critical_velocities(system, (0.1, 0.8), max_seconds=1.0, progress=stop)

    found = search("cycles")
    ((name, low, high),) = found.brackets
    assert (name, found.all) == ("end_of_stick_slip", ())
    assert low < ends < high < low + 0.02
    assert "end_of_stick_slip between" in repr(found)
    (tmp_path / "system.toml").write_text(system.to_toml())
    monkeypatch.setattr("stickslip.dynamics.critical.critical_velocities.critical_velocities", lambda *_, **__: found)
    assert main(["critical", str(tmp_path / "system.toml"), "--max-seconds", "1"]) == 0
    assert f"end of stick slip   between {low:.12g} and {high:.12g} (not confirmed)" in capsys.readouterr().out


def test_the_command_line_has_the_word_of_each_hopf_point(tmp_path, monkeypatch, capsys):
    words = ((0.2, "supercritical"), (0.7, "subcritical"))
    found = CriticalVelocities((("hopf", 0.7), ("fold", 0.5), ("hopf", 0.2)), words)
    assert found.criticality == "supercritical"
    monkeypatch.setattr("stickslip.dynamics.critical.critical_velocities.critical_velocities", lambda *_, **__: found)
    path = tmp_path / "free.toml"
    path.write_text(ss.Oscillator(0.1, 1.0, ss.laws.ExponentialStribeck(1.0, 0.5, 0.5)).to_toml())
    main(["critical", str(path)])
    assert [line.split()[1:] for line in capsys.readouterr().out.splitlines()] == [
        ["0.7,", "subcritical"],
        ["0.5"],
        ["0.2,", "supercritical"],
    ]
    main(["critical", str(path), "--json"])
    said = json.loads(capsys.readouterr().out)
    assert said["criticality"] == "supercritical"
    assert said["criticalities"] == [list(word) for word in words]


def test_stick_slip_that_outlasts_the_search_is_said():
    # Without damping Andronov's cycle, which a stick closes, is there at every speed; damping ends it.
    law = ss.laws.StaticKinetic(1.0, 0.6)
    undamped = ss.critical_velocities(ss.Oscillator(0.0, 1.0, law), (0.1, 2.0))
    assert (dict(undamped), undamped.beyond) == ({}, 2.0)
    assert "stick-slip goes on beyond 2" in repr(undamped)
    damped = ss.critical_velocities(ss.Oscillator(0.1, 1.0, law), (0.1, 2.0))
    assert damped["end_of_stick_slip"] < 0.5
    assert damped.beyond is None
