"""The motion of a law laid over a record: recovery, many starts, intervals, interruption and resumption."""

from __future__ import annotations

import re
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from evidence import script

import stickslip as ss
from stickslip.cli.main import main
from stickslip.errors import InputError
from stickslip.identification import fit_trajectories, friction_of_orbit, identify, sensitivity
from stickslip.identification.law_fit_notes import notes_on_uncertain_numbers
from stickslip.identification.law_parameters import LawParameters
from stickslip.identification.records import read_records
from stickslip.identification.trajectory import single_shooting
from stickslip.identification.trajectory.motion_misfit import Landmarks, MotionMisfit
from stickslip.identification.trajectory.profile import why_no_parabola
from stickslip.identification.trajectory.single_shooting import SingleShooting
from stickslip.laws.numbers import pointers, value
from stickslip.measurement import Rig

CASES, coverage = script("interval_coverage").CASES, script("interval_coverage").coverage
LAW = ss.laws.StaticKinetic(break_away=1.0, kinetic=0.6)
NOISE = 0.005


def record(law=LAW, s=0.2, damping=0.1, seed=1, t_end=160.0):
    """The settled motion with white noise of half a per cent on the displacement and a noisy force."""
    orbit = ss.simulate(ss.Oscillator(damping=damping, drive_velocity=s, law=law), t_end)
    t = np.arange(100.0, t_end, 0.05)
    spread = float(np.std(orbit.at(t)[0]))
    return friction_of_orbit(orbit, t, 0.01, seed=seed, displacement_noise=NOISE * spread)


@pytest.fixture(scope="module")
def friction():
    return [record(s=s) for s in (0.1, 0.2, 0.3)]


@pytest.fixture(scope="module")
def first(friction):
    return identify(friction, law="StaticKinetic")


@pytest.fixture(scope="module")
def refined(first):
    return fit_trajectories(first, settled_after=0.0)


def test_the_truth_is_found_within_its_errors_and_only_noise_is_left(refined):
    table = refined.parameters
    for name, true in (("break_away", 1.0), ("kinetic", 0.6)):
        assert abs(table.loc[name, "value"] - true) < 3 * table.loc[name, "error"]
        assert table.loc[name, "error"] < 1e-4
    np.testing.assert_allclose(refined.motions["distance"], NOISE, rtol=0.1)
    np.testing.assert_allclose(refined.motions["scatter"] / refined.motions["noise"], 1.0, atol=0.1)
    np.testing.assert_allclose(np.sqrt(np.diag(refined.covariance)), table["error"])


@pytest.mark.slow
def test_intervals_hold_the_truth_in_a_small_sample():
    # The published table has 200 repetitions of five laws. Of 12 fewer than 9 come by chance once in 400 at 95 %.
    table = coverage(CASES["StaticKinetic"], repetitions=12, fresh=12)
    assert (table["repetitions"] == 12).all()
    assert (table["inside"] >= 9).all(), table
    assert (abs(table["stated"] / table["scatter"] - 1) < 0.6).all(), table


@pytest.mark.slow
@pytest.mark.parametrize("name", list(CASES))
def test_intervals_hold_the_truth(name):
    # At 95 % fewer than 34 of 40 come by chance once in a hundred.
    table = coverage(CASES[name], repetitions=40, fresh=20)
    assert (table["inside"] >= 34).all(), table


@pytest.mark.long
def test_repetitions_go_on_from_their_file(tmp_path):
    path, case = tmp_path / "coverage.csv", replace(CASES["StaticKinetic"], drive_velocities=(0.3,), duration=15.0)
    short = coverage(case, repetitions=1, path=path)
    before = path.read_text()
    told = []
    longer = coverage(case, repetitions=2, path=path, progress=lambda done, of: told.append((done, of)))
    assert path.read_text().startswith(before)
    assert (short["repetitions"] == 1).all()
    assert (longer["repetitions"] == 2).all()
    assert told == [(0, 2), (1, 2)]


def test_a_far_first_guess_is_led_to_the_motion(first, refined):
    far = replace(first, law=ss.laws.StaticKinetic(break_away=1.15, kinetic=0.55))
    found = fit_trajectories(far, settled_after=0.0)
    np.testing.assert_allclose(found.parameters["value"], refined.parameters["value"], rtol=1e-6)


def test_profile_and_curvature_agree_where_the_misfit_is_a_parabola(first, refined):
    profiled = fit_trajectories(first, settled_after=0.0, profile=True)
    for side in ("low", "high"):
        half = refined.parameters["error"]
        np.testing.assert_array_less(abs(profiled.parameters[side] - refined.parameters[side]), 0.15 * half)
    assert "profile" in " ".join(profiled.notes)


@pytest.mark.parametrize("name", ["StaticKinetic", "DwellTime", "PiecewiseLinear", "BogaczRyczek"])
def test_slopes_through_events_are_those_of_differences(name, monkeypatch):
    case = CASES[name]
    records = read_records([record(case.law, s, case.damping) for s in case.drive_velocities])
    misfits = [MotionMisfit(item, 0.0) for item in records]
    free = case.free or [item for item in pointers(case.law) if item not in ("exponent", "nodes[0].slip_velocity")]
    ties = {"break_away": "kinetic"} if name == "StaticKinetic" else {}
    fit = SingleShooting(misfits, LawParameters(case.law, [item for item in free if item not in ties], ties))
    shifts = [record_misfit.first_shift(case.law, record_misfit.time.size) for record_misfit in misfits]
    at = np.concatenate([np.zeros(fit.count), shifts])
    expected = np.stack([fit.differences(at, j) for j in range(fit.count)], axis=1)
    monkeypatch.setattr(SingleShooting, "differences", lambda *_: pytest.fail("no derivative of the core"))
    found = fit.slopes(at)[:, : fit.count]
    # Samples at which one of the two sides of a difference has passed an event are off by more, hence the norm.
    assert (np.linalg.norm(found - expected, axis=0) < 1e-4 * np.linalg.norm(expected, axis=0)).all()


def test_differences_tell_numbers_apart_that_act_nearly_alike(monkeypatch):
    # Growth, onset and level of static friction differ by a thousandth of what each does: slopes are exact to a part of that.
    case = CASES["Combined"]
    misfit = MotionMisfit(read_records([record(case.law, 0.14, case.damping)])[0], 0.0)
    names = ["static.kinetic", "static.growth", "static.onset"]
    fit = SingleShooting([misfit], LawParameters(case.law, names))
    at = np.append(np.zeros(3), misfit.first_shift(case.law, misfit.time.size))
    found = fit.slopes(at)
    monkeypatch.setattr(single_shooting, "STEP_OF_LAWS", 1e-5)
    np.testing.assert_allclose(fit.slopes(at), found, atol=1e-5 * np.linalg.norm(found, axis=0).max())


@pytest.mark.parametrize(("factor", "rise"), [(1.0, None), (4.0, 0.49), (0.25, 7.8)])
def test_slopes_that_the_misfit_contradicts_are_not_trusted(first, monkeypatch, factor, rise):
    misfits = [MotionMisfit(item, 0.0) for item in first.records]
    fit = SingleShooting(misfits, LawParameters(first.law, ["break_away", "kinetic"]))
    fit.refine(np.zeros(2))
    fit.finish()
    slopes = fit.slopes
    monkeypatch.setattr(fit, "slopes", lambda at, share=1.0: factor * slopes(at, share))
    sentence = why_no_parabola(fit, fit.best[1], fit.covariance(fit.best[1])[0])
    if rise is None:
        assert sentence is None
    else:
        said = re.search(r"by what belongs to ([\d.]+), so the intervals are not to be trusted", sentence)
        assert float(said[1]) == pytest.approx(rise, rel=0.2)


def test_where_slopes_are_differences_the_reason_is_said():
    law = ss.laws.ExponentialStribeck(break_away=1.0, kinetic=0.6, scale=0.2)
    found = fit_trajectories(identify(record(law), law=law, free=["break_away"]), settled_after=0.0, starts=1)
    assert found.law.break_away == pytest.approx(1.0, abs=1e-3)
    assert "Slopes of the motion are differences of orbits: along a smooth law" in " ".join(found.notes)


def test_errors_of_the_gauge_are_in_the_intervals_as_theory_has_them(first, refined):
    # A zero off by z moves the mean of x, which is f_k / k here but for the damping, and f_s with it, both by z.
    widened = fit_trajectories(first, settled_after=0.0, zero_error=1e-3, scale_error=0.0)
    np.testing.assert_allclose(widened.parameters["error"], 1e-3, rtol=0.02)
    np.testing.assert_allclose(widened.parameters["value"], refined.parameters["value"], rtol=1e-7)
    # A scale that is off by s scales every force, if the drive velocity is known to scale too: here it is not.
    scaled = fit_trajectories(first, settled_after=0.0, scale_error=1e-3)
    assert scaled.parameters.loc["kinetic", "error"] == pytest.approx(6e-4, rel=0.5)
    assert "--scale-error 0.001" in scaled.command


def test_a_record_of_less_than_two_cycles_is_refused(first):
    short = replace(first, records=[first.records[1].part(0, 200)])
    with pytest.raises(InputError, match=r"hold fewer than 2 cycles.*take a longer record"):
        fit_trajectories(short, settled_after=0.0)


@pytest.mark.slow
def test_another_kind_of_motion_is_refused(first):
    still = replace(first, law=ss.laws.Coulomb(0.6), parameters=first.parameters.loc[["kinetic"]])
    with pytest.raises(
        InputError, match=r"no motion of the law lies near this record .* measured stick_slip, simulated"
    ):
        fit_trajectories(still, settled_after=0.0, starts=1)


def test_records_without_displacement_or_constants_are_refused(first):
    bare = replace(first, records=[replace(first.records[0], displacement=None)])
    with pytest.raises(InputError, match="holds no displacement"):
        fit_trajectories(bare)
    light = replace(first, records=[replace(first.records[0], constants={"mass": 1.0})])
    with pytest.raises(InputError, match="damping is not known"):
        fit_trajectories(light)


@pytest.mark.parametrize(
    ("options", "sentence"), [({"settled_after": 1.0}, "settled_after"), ({"starts": 0}, "starts")]
)
def test_options_that_make_no_sense_are_refused(first, options, sentence):
    with pytest.raises(InputError, match=sentence):
        fit_trajectories(first, **options)


def test_an_interrupted_search_leaves_its_best_law_and_goes_on_from_it(first, refined, tmp_path, monkeypatch):
    path = tmp_path / "law.unfinished.toml"
    refine = SingleShooting.refine

    def stop_after_one(self, numbers):
        refine(self, numbers)
        raise KeyboardInterrupt

    monkeypatch.setattr(SingleShooting, "refine", stop_after_one)
    with pytest.raises(KeyboardInterrupt):
        fit_trajectories(first, settled_after=0.0, checkpoint=path)
    best = ss.load_law(path)
    assert best.kinetic == pytest.approx(0.6, abs=1e-3)
    assert "Unfinished" in tomllib.loads(path.read_text())["source"]["notes"][0]
    # Going on takes the start that is done from the file: nothing is refined anew, as only noise was left.
    monkeypatch.setattr(SingleShooting, "refine", lambda *_: pytest.fail("begun anew"))
    found = fit_trajectories(first, settled_after=0.0, checkpoint=path)
    np.testing.assert_allclose(found.parameters["value"], refined.parameters["value"], rtol=1e-7)
    assert not path.exists()


def test_command_says_where_an_interrupted_search_is_kept(friction, tmp_path, monkeypatch, capsys):
    path, law = tmp_path / "friction.nc", tmp_path / "law.toml"
    friction[1].to_netcdf(path, engine="h5netcdf")
    refine = SingleShooting.refine

    def stop_after_one(self, numbers):
        refine(self, numbers)
        raise KeyboardInterrupt

    monkeypatch.setattr(SingleShooting, "refine", stop_after_one)
    assert main(["identify", str(path), "--law", "StaticKinetic", "--trajectories", "-o", str(law)]) == 130
    assert "law.unfinished.toml; the same command goes on from it" in capsys.readouterr().err
    assert [item.name for item in tmp_path.glob("*.toml")] == ["law.unfinished.toml"]


def test_a_file_of_another_search_is_not_gone_on_from(first, tmp_path):
    path = tmp_path / "law.unfinished.toml"
    path.write_text("[law]\ntype = 'Coulomb'\nkinetic = 1.0\n[source.search]\nfingerprint = 'other'\n")
    assert fit_trajectories(first, settled_after=0.0, checkpoint=path).law.kinetic == pytest.approx(0.6, abs=1e-3)


def test_landmarks_of_a_sine_are_its_period_and_turns():
    t = np.linspace(0.0, 30.0, 3000)
    found = Landmarks.of(t, 2 + np.sin(3 * t), 3 * np.cos(3 * t), np.zeros(t.size, bool), 4.0)
    assert found.kind == "almost_harmonic"
    assert found.period == pytest.approx(2 * np.pi / 3, rel=1e-4)
    np.testing.assert_allclose(found.turns, [1, 3, -3, 3], atol=1e-3)


def test_a_law_is_unlike_a_record_in_proportion_to_its_error():
    record_misfit = MotionMisfit(read_records(record())[0], 0.0)
    errors = [np.linalg.norm(record_misfit.unlikeness(replace(LAW, break_away=1.0 + d))) for d in (0.0, 0.05, 0.1)]
    assert errors[0] < 0.05
    assert errors[1] > 3 * errors[0]
    assert errors[2] == pytest.approx(2 * errors[1], rel=0.35)


def test_sensitivity_of_stick_slip_is_that_of_its_closed_form(refined):
    # Undamped, the amplitude is sqrt((f_s − f_k)² + m s²/k) about f_k/k; damping d = 0.1 changes little of that.
    table = sensitivity(refined, record=1).table
    amplitude = np.hypot(0.4, 0.2)
    by_break_away = 100 * 0.01 * 1.0 * (0.4 / amplitude) / amplitude
    assert table.loc["break_away", "x high"] == pytest.approx(by_break_away, rel=0.25)
    assert table.loc["kinetic", "x low"] > 0
    lines = sensitivity(refined).plot("break_away").lines
    assert len(lines) == 3
    # The slips are curves, however short they are beside the sticks.
    assert all(np.abs(np.diff(line.get_ydata())).max() < 0.1 * np.ptp(line.get_ydata()) for line in lines)


def test_command_writes_law_and_page(friction, tmp_path, capsys):
    names = []
    for number, tree in enumerate(friction[1:]):
        names.append(str(tmp_path / f"friction-{number}.nc"))
        tree.to_netcdf(names[-1], engine="h5netcdf")
    law, page = tmp_path / "law.toml", tmp_path / "report.html"
    options = ["--law", "StaticKinetic", "--trajectories", "-o", str(law), "--report", str(page)]
    assert main(["identify", *names, *options]) == 0
    assert "Refined by the agreement of the motions" in capsys.readouterr().out
    assert ss.load_law(law).kinetic == pytest.approx(0.6, abs=1e-3)
    text = page.read_text(encoding="utf-8")
    for heading in ("Data", "uncertainty", "Residuals", "From the law to the motion", "assumed", "To do it again"):
        assert heading in text
    assert text.count("data:image/png;base64,") >= 6
    assert 'src="http' not in text
    assert sorted(path.name for path in tmp_path.iterdir() if path.suffix != ".nc") == ["law.toml", "report.html"]


def test_options_that_need_each_other_are_said(tmp_path, capsys):
    assert main(["identify", "x.nc", "--profile"]) == 2
    assert "add --trajectories" in capsys.readouterr().err
    assert main(["identify", "x.nc", "--compare", "--trajectories"]) == 2
    assert "compare first" in capsys.readouterr().err
    assert main(["identify", "x.nc", "--law", "Coulomb", "--report", str(tmp_path / "no" / "r.html")]) == 2
    assert "does not exist" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "options"),
    [
        (LAW, {}),
        (
            ss.laws.PiecewiseLinear(nodes=((0.0, 1.0), (0.2, 0.6), (0.6, 0.75)), break_away=1.05),
            {"fixed": {"nodes[2].slip_velocity": 0.6}, "pieces": 2},
        ),
    ],
    ids=["StaticKinetic", "PiecewiseLinear"],
)
def test_law_is_recovered_from_films(law, options, tmp_path):
    pytest.importorskip("cv2")
    frictions = []
    for s in (0.1, 0.2, 0.3):
        slider = ss.Oscillator(damping=0.1, drive_velocity=s, law=law)
        orbit = ss.simulate(slider, 131)
        path = tmp_path / f"film-{s}.avi"
        truth = ss.film(orbit, path, start=100.0, duration=30.0, frame_rate=25.0)
        setup = tomllib.loads(truth.attrs["setup"])
        frictions.append(ss.measure(ss.track(path, setup), Rig.of(slider, "time")))
    # The tracker finds places to some hundredths of a pixel (test_track_films.py); that part of it which is common to all
    # pictures no record shows.
    zero = 0.01 / setup["calibration"]["scale"]
    first = identify(frictions, law=type(law), **options)
    table = fit_trajectories(first, settled_after=0.0, zero_error=zero, scale_error=1e-4).parameters
    for name in table.index:
        assert table.loc[name, "low"] <= value(law, name) <= table.loc[name, "high"], name
        assert table.loc[name, "error"] < 0.005


@pytest.mark.slow
def test_a_profile_ends_where_there_is_no_law_beyond():
    # no jump at the release: the break-away force lies on the edge of what makes a law, where trials lie on either side
    law = ss.laws.PiecewiseLinear(nodes=[(0, 1.0), (0.25, 0.6), (1.0, 0.8)], break_away=1.0)
    free = ["nodes[0].force", "nodes[1].force", "break_away"]
    sharp = fit_trajectories(identify(record(law), law=law, free=free), starts=1, profile=True)
    assert (sharp.parameters["low"] <= sharp.parameters["value"]).all()
    assert (sharp.parameters["value"] <= sharp.parameters["high"]).all()
    assert any("beyond it there is no law" in note for note in sharp.notes)


def test_a_number_that_the_motion_does_not_tell_from_another_is_held():
    # with one stick time a limit and a rate are one number
    law = ss.laws.DwellTime(kinetic=0.6, limit=0.5, rate=0.3)
    first = identify(record(law, 0.1, 0.02), law=law, free=["kinetic"])
    sharp = fit_trajectories(first, ["kinetic", "limit", "rate"], starts=1)
    assert list(sharp.parameters.index) == ["kinetic", "limit"]
    assert sharp.law.rate == pytest.approx(0.3, rel=1e-3)
    assert "limit and rate cannot be separated by these motions: rate is held at 0.3" in " ".join(sharp.notes)


def test_a_number_that_the_motion_hardly_tells_does_not_run_away():
    # the motion never comes near w = 0, where the first node is
    law = ss.laws.PiecewiseLinear(nodes=[(0, 1.0), (0.1, 0.8), (0.4, 0.7), (0.8, 0.9)], break_away=1.0)
    free = LawParameters(law, ["nodes[0].force"])
    assert free.values(free.low)[0] == pytest.approx(-99.0)
    assert free.values(free.high)[0] == pytest.approx(101.0)


def test_numbers_that_make_no_law_are_farther_than_any_motion():
    law = ss.laws.PiecewiseLinear(nodes=[(0, 0.9), (0.25, 0.6), (1.0, 0.8)], break_away=1.0)
    record_misfit = MotionMisfit(read_records(record(law, 0.2, 0.1))[0], 0.0)
    fit = SingleShooting([record_misfit], LawParameters(law, ["break_away", "nodes[1].slip_velocity"]))
    here, shift = np.zeros(2), record_misfit.first_shift(law, record_misfit.time.size)
    barred, wild = np.array([-50.0, 0.0, shift]), np.array([0.0, 100.0, shift])
    assert fit.moves(np.append(here, shift))
    assert not fit.moves(barred)
    assert fit.cost(np.append(here, shift)) < fit.cost(wild) < fit.cost(barred) < np.inf


def test_what_a_fit_of_motions_tells_is_no_longer_called_undecided(first):
    alike = first.covariance.copy()
    alike.iloc[0, 1] = alike.iloc[1, 0] = 0.995 * np.sqrt(np.diag(alike)).prod()
    told = notes_on_uncertain_numbers(first.parameters, alike)
    found = fit_trajectories(replace(first, covariance=alike, notes=[*told, "kept"]), settled_after=0.0, starts=1)
    assert len(told) == 1
    assert "can hardly be separated (correlation 0.995)" in told[0]
    assert "kept" in found.notes
    assert not set(told) & set(found.notes)
    assert re.search(r"rms distance of the motions: 0.0049\d* of the displacement's standard deviation", found.report())


@pytest.mark.long
@pytest.mark.parametrize(("level", "said"), [pytest.param(0.9, False, marks=pytest.mark.slow), (0.95, True)])
def test_a_tie_that_the_motions_contradict_is_named(level, said):
    law = ss.laws.Combined(ss.laws.LogarithmicDwell(level, 0.08, 0.3), ss.laws.ExponentialStribeck(0.9, 0.7, 0.1, 0.05))
    items = read_records([record(law, s, 0.05, t_end=200.0) for s in (0.1, 0.3)])
    names, ties = ["kinetic.break_away", "static.growth"], {"static.kinetic": "kinetic.break_away"}
    fit = SingleShooting([MotionMisfit(item, 0.0) for item in items], LawParameters(law, names, ties))
    fit.refine(np.zeros(2))
    notes = " ".join(fit.finish().notes)
    assert ("The motions contradict that static.kinetic follows kinetic.break_away" in notes) == said
