"""Runs predicted by a law of other runs, and records that differ from one law."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest

import stickslip as ss
from stickslip.cli.main import main
from stickslip.errors import InputError
from stickslip.identification import compare_motion, friction_of_orbit, identify, predict_motion
from stickslip.identification.prediction.agreement import settled
from stickslip.measurement import Rig

KINETIC = 0.6


@pytest.fixture(autouse=True)
def few_draws(monkeypatch):
    """Enough to tell what is asked here, in a quarter of the time."""
    monkeypatch.setattr("stickslip.identification.prediction.prediction.DRAWS", 8)


def run(drive_velocity: float, break_away: float = 1.0, seed: int = 0, damping: float = 0.05):
    law = ss.laws.StaticKinetic(break_away=break_away, kinetic=KINETIC)
    system = ss.Oscillator(damping=damping, drive_velocity=drive_velocity, law=law)
    return friction_of_orbit(ss.simulate(system, 200), np.arange(0, 200, 0.05), force_noise=0.01, seed=seed)


@pytest.fixture(scope="module")
def alike():
    return identify([run(0.1), run(0.3, seed=1)], "StaticKinetic")


@pytest.fixture(scope="module")
def apart():
    """Two runs over surfaces that differ: 0.3 and 0.5 above the kinetic force."""
    return identify([run(0.1, 0.9), run(0.3, 1.1, seed=1)], "StaticKinetic")


def test_a_law_predicts_kind_and_stick_time_of_another_run(alike):
    found = predict_motion(alike, run(0.2, seed=2))
    row = found.table.iloc[0]
    assert (row["kind"], row["predicted_kind"]) == ("stick_slip", "stick_slip")
    assert row["stick_time_predicted"] == pytest.approx(row["stick_time"], rel=0.02)
    for name in ("stick_time", "mean_force", "main_line"):
        value, low, high = (row[f"{name}_{column}"] for column in ("predicted", "low", "high"))
        # that two records agree in their mean force says less of a third than a law of stick time does
        near = 0.2 if name == "mean_force" else 0.1
        assert (1 - near) * value < low < value < high < (1 + near) * value
        assert low < row[name] < high
    assert "The kind of motion is predicted rightly for the run." in found.sentences
    assert name.replace("_", " ") not in " ".join(found.sentences)


@pytest.mark.long
def test_sticks_and_the_highest_force_are_predicted_and_a_begin_that_is_not_steady_does_not_count(alike):
    row = predict_motion(alike, run(0.2, seed=2), duration=100.0)
    for name in ("amplitude", "stick_rate", "max_force"):
        value, low, high = (row.table.iloc[0][f"{name}_{column}"] for column in ("predicted", "low", "high"))
        assert low < row.table.iloc[0][name] < high
        assert 0.8 * value < low < high < 1.2 * value
    count = round(100.0 * float(row.table.iloc[0]["stick_rate_predicted"]))
    assert any(
        f": {count} sticks (" in sentence and "in 100 of steady motion" in sentence for sentence in row.sentences
    )
    with pytest.raises(InputError, match="duration must be positive"):
        predict_motion(alike, run(0.2, seed=2), duration=-1.0)
    # The springs begin wound up the other way, for a third of the record.
    law = ss.laws.StaticKinetic(break_away=1.0, kinetic=KINETIC)
    late = []
    for seed, speed in enumerate((0.1, 0.12)):
        orbit = ss.simulate(ss.Oscillator(damping=0.05, drive_velocity=speed, law=law), 200, x0=-5.0, v0=speed)
        late.append(friction_of_orbit(orbit, np.arange(0, 200, 0.05), force_noise=0.01, seed=seed))
    row = predict_motion(identify(late, "StaticKinetic"), run(0.11, seed=2)).table.iloc[0]
    assert row["mean_force_high"] - row["mean_force_low"] < 0.3 * KINETIC


def test_slip_beyond_the_fastest_of_the_records_is_called_an_extrapolation(alike):
    assert not [one for one in predict_motion(alike, run(0.2, seed=2)).sentences if "extrapolated" in one]
    fast = predict_motion(alike, run(0.9, seed=2)).sentences
    assert any("between them friction is extrapolated by the form of the law" in one for one in fast)
    # A law that does not depend on the slip speed is no extrapolation over it.
    assert not [note for note in alike.notes if "hold slip up to" in note]
    curve = identify([run(0.1), run(0.3, seed=1)], "PiecewiseLinear", pieces=1)
    assert any(note.startswith("The records hold slip up to w = 0.") for note in curve.notes)


def test_a_motion_that_is_not_that_of_its_record_says_what_to_do_next(alike):
    wrong = compare_motion(run(0.2), ss.laws.StaticKinetic(break_away=1.5, kinetic=KINETIC)).sentences
    assert "refine it by the motion (--trajectories, fit_trajectories)" in wrong[-1]
    assert "refine it" not in " ".join(compare_motion(run(0.2), alike).sentences)


@pytest.mark.parametrize(("speed", "length"), [(0.06, 9.0), (0.01, 20.0)])
def test_the_law_of_a_motion_is_not_rejected_for_what_all_break_aways_share(speed, length):
    def law(break_away):
        return ss.laws.ExponentialStribeck(break_away=break_away, kinetic=3.0, scale=0.01, viscous=4.0)

    orbit = ss.simulate(
        ss.Oscillator(mass=1.2, stiffness=600.0, damping=0.0, drive_velocity=speed, law=law(5.0)), length + 2
    )
    t = np.arange(0, length, 0.002)
    force = 600 * orbit.at(2 + t)[0] + 0.02 * np.random.default_rng(0).standard_normal(t.size)
    rig = {
        "instrument": "spring_force",
        "column": "f",
        "unit": "N",
        "time_column": "t",
        "mass": 1.2,
        "stiffness": 600.0,
    }
    friction = ss.measure({"t": t, "f": force}, rig | {"drive_velocity": speed})
    late = friction.attrs["break_away_late"]
    assert late > 0.005
    found = compare_motion(friction, law(5.0))
    assert not found.disagreements
    error = found.table["error"]
    assert error["mean stick time"] == pytest.approx(late, rel=0.01)
    assert error["mean force drop"] == pytest.approx(600 * speed * late, rel=0.01)
    assert error["stuck share"] == pytest.approx(late * found.table.loc["slips per time", "measured"], rel=0.01)
    for off in (4.0, 6.0):  # 20 %
        agrees = compare_motion(friction, law(off)).table["agrees"]
        assert (agrees[["slips per time", "mean stick time", "mean force drop", "stuck share"]] == "no").all()


def test_a_run_that_does_not_stick_is_predicted(alike):
    row = predict_motion(alike, run(1.5, damping=0.8, seed=3)).table.iloc[0]
    assert row["predicted_kind"] == "stable_slip"
    assert np.isnan(row[["stick_time_predicted", "stick_time_low", "main_line_predicted"]].astype(float)).all()
    assert row["mean_force_low"] < KINETIC < row["mean_force_high"]


def test_a_kind_that_was_predicted_wrongly_is_said(alike):
    other = run(0.2, seed=3)
    other.attrs["regime"] = "almost_harmonic"
    (said,) = (one for one in predict_motion(alike, other).sentences if one.startswith("record 1 is"))
    assert said == "record 1 is almost_harmonic, predicted was stick_slip with a probability of 0.75."


def test_records_that_differ_count_as_one_observation_each(apart):
    # 5 times as many sticks at 0.3 as at 0.1, and yet the mean of the two
    law = apart.law
    assert law.break_away - law.kinetic == pytest.approx(0.4, abs=0.02)
    scatter = apart.groups.set_index("kind").loc["break-away", "record_scatter"]
    assert scatter.to_numpy() == pytest.approx(np.sqrt(2) * 0.1, rel=0.1)  # standard deviation of -0.1 and 0.1


def test_records_that_agree_do_not_scatter(alike):
    assert (alike.groups["record_scatter"] == 0).all()


def test_the_interval_holds_that_a_further_run_may_differ_as_much(alike, apart):
    row = predict_motion(apart, run(0.2, seed=2)).table.iloc[0]
    narrow = predict_motion(alike, run(0.2, seed=2)).table.iloc[0]
    assert row["stick_time_low"] < 0.7 * row["stick_time"] < 1.3 * row["stick_time"] < row["stick_time_high"]
    ratios = [one["stick_time_high"] / one["stick_time_low"] for one in (row, narrow)]
    assert ratios[0] > 3 * ratios[1]


def test_of_two_records_the_mean_force_of_a_third_is_known_as_students_t_lets_expect(alike):
    own = predict_motion(alike, [run(0.1), run(0.3, seed=1)]).table
    misfit = np.sqrt(np.mean((own["mean_force"] - own["mean_force_predicted"]) ** 2))
    row = predict_motion(alike, run(0.2, seed=2)).table.iloc[0]
    # t of one degree of freedom where the normal distribution has 2 (tables: 13.97), and √(1 + 1/2) for a new value
    scatter = misfit * np.sqrt(2 / 1) * np.sqrt(1 + 1 / 2)
    assert row["mean_force_high"] - row["mean_force_predicted"] >= 13.96 * scatter > 0


def rig(drive_velocity: float, stiffness: float = 1.0):
    return Rig(
        instrument="displacement",
        column="x",
        unit="1",
        stiffness=stiffness,
        mass=1.0,
        damping=0.05,
        drive_velocity=drive_velocity,
        sampling_rate=20.0,
    )


def test_a_run_of_which_there_is_no_record_is_predicted_from_its_rig(alike):
    measured, alone = predict_motion(alike, [run(0.2, seed=2), rig(0.2)]).table.to_dict("records")
    assert alone["predicted_kind"] == "stick_slip"
    assert pd.isna(alone["kind"])
    assert np.isnan([alone["stick_time"], alone["mean_force"], alone["main_line"]]).all()
    for name in ("stick_time_predicted", "mean_force_predicted", "main_line_predicted", "stick_slip"):
        assert alone[name] == pytest.approx(measured[name], rel=0.05)


def test_the_farther_from_its_records_the_less_a_law_is_believed(alike):
    """A spring or a drive that no record had: the law has the kind of all its records right, and still may not know."""
    table = predict_motion(alike, [rig(0.2), rig(0.2, stiffness=3.0), rig(0.2, stiffness=12.0)]).table
    between, stiff, stiffer = table.to_dict("records")
    assert between["beyond"] == pytest.approx(0.0, abs=1e-6)
    assert stiff["beyond"] == pytest.approx(np.log(3.0), abs=1e-3)
    # two of two records right: 3/4 between them, and one half where they say nothing
    assert between["stick_slip"] == pytest.approx(0.75)
    assert 0.75 > stiff["stick_slip"] > stiffer["stick_slip"] > 0.5
    for row in (between, stiff, stiffer):
        assert row["stick_slip"] + row["almost_harmonic"] + row["stable_slip"] == pytest.approx(1.0)
    width = [row["stick_time_high"] / row["stick_time_low"] for row in (between, stiff, stiffer)]
    assert width[0] < width[1] < width[2]


def test_a_stiffness_that_the_records_corrected_is_predicted_as_stated(alike):
    """The law's records had springs 10 % stiffer than their rigs say; the next rig may be as far off."""
    records = [run(0.1), run(0.3, seed=1)]
    for record in records:
        record.attrs |= {"rig": rig(0.1, stiffness=1 / 1.1).to_toml().replace("drive_velocity = 0.1\n", "")}
    stated = predict_motion(identify(records, "StaticKinetic"), rig(0.2, stiffness=1 / 1.1))
    row, usual = stated.table.iloc[0], predict_motion(alike, rig(0.2)).table.iloc[0]
    assert row["stick_time_predicted"] == pytest.approx(1.1 * usual["stick_time_predicted"], rel=0.02)
    assert row["stick_time_low"] < usual["stick_time_predicted"] < row["stick_time_high"]
    assert any("the stiffness was 10 % off and the drive velocity 0 % (rms)" in one for one in stated.sentences)


def test_something_that_was_not_identified_is_refused():
    with pytest.raises(InputError, match="expected an identification"):
        predict_motion(ss.laws.StaticKinetic(1.0, 0.6), run(0.2))


def test_the_command_predicts_further_runs(tmp_path, capsys):
    names = []
    for number, velocity in enumerate((0.1, 0.3, 0.2)):
        names.append(str(tmp_path / f"run{number}.nc"))
        run(velocity, seed=number).to_netcdf(names[-1], engine="h5netcdf")
    assert main(["identify", *names[:2], "--law", "StaticKinetic", "--predict", names[2], "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["prediction"]["table"].values()
    assert row["predicted_kind"] == "stick_slip"
    assert row["stick_time_predicted"] == pytest.approx(row["stick_time"], rel=0.02)


@pytest.mark.long
def test_the_command_predicts_a_run_from_a_rig_file(tmp_path, capsys):
    law, file = tmp_path / "run.nc", tmp_path / "next.toml"
    run(0.1).to_netcdf(law, engine="h5netcdf")
    file.write_text(rig(0.2).to_toml(), encoding="utf-8")
    assert main(["identify", str(law), "--law", "StaticKinetic", "--no-simulation", "--predict", str(file)]) == 0
    said = capsys.readouterr().out
    assert "Predicted runs" in said
    assert "next.toml: probability of stick_slip" in said
    bench = tmp_path / "bench.toml"
    bench.write_text(
        'instrument = "force_log"\nleast_drop = 0.3\nsampling_rate = 4\n[columns]\nforce = 1\n', encoding="utf-8"
    )
    assert main(["identify", str(law), "--law", "StaticKinetic", "--no-simulation", "--predict", str(bench)]) == 2
    assert "expected the rig of one mass on a spring, got the instrument force_log" in capsys.readouterr().err


def test_a_rig_that_cannot_be_read_is_a_sentence(alike):
    other = run(0.2, seed=3)
    other.attrs["rig"] = "stiffness = = 1"
    with pytest.raises(InputError, match=r"record 1: rig: not a TOML document .*; correct that line"):
        predict_motion(alike, other)


def test_what_dies_away_after_the_start_is_no_motion_of_the_law():
    law = ss.laws.Coulomb(3.1)
    system = ss.Oscillator(damping=1.1, drive_velocity=0.04, law=law, mass=0.9, stiffness=800.0)
    orbit = settled(system, 40 * system.natural_period)
    assert orbit.regime(0.4) == "stable_slip"
    assert ss.simulate(system, 40 * system.natural_period).regime(0.4) == "almost_harmonic"
    sticks = ss.Oscillator(damping=0.1, drive_velocity=0.2, law=ss.laws.StaticKinetic(1.0, 0.6))
    assert settled(sticks, 200.0).regime(0.4) == "stick_slip"
    undamped = ss.Oscillator(damping=0.0, drive_velocity=0.2, law=ss.laws.Coulomb(0.6))
    assert settled(undamped, 200.0).regime(0.4) == "almost_harmonic"
