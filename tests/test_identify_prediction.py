"""Runs foretold by a law of other runs, and records that differ from one law."""

from __future__ import annotations

import json

import numpy as np
import pytest

import stickslip as ss
from stickslip.cli import main
from stickslip.errors import InputError
from stickslip.identification import friction_of_orbit, identify, predict_motion

KINETIC = 0.6


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


def test_a_law_foretells_kind_and_stick_time_of_another_run(alike):
    found = predict_motion(alike, run(0.2, seed=2))
    row = found.table.iloc[0]
    assert (row["kind"], row["predicted_kind"]) == ("stick_slip", "stick_slip")
    assert row["ratio"] == pytest.approx(1.0, abs=0.02)
    assert 0.9 * row["predicted"] < row["low"] < row["predicted"] < row["high"] < 1.1 * row["predicted"]
    assert "The kind of motion is foretold rightly for the run." in found.sentences


def test_a_run_that_does_not_stick_is_foretold(alike):
    row = predict_motion(alike, run(1.5, damping=0.8, seed=3)).table.iloc[0]
    assert (row["predicted_kind"], np.isnan(row["predicted"]), np.isnan(row["low"])) == ("stable_slip", True, True)


def test_a_kind_that_was_foretold_wrongly_is_said(alike):
    other = run(0.2, seed=3)
    other.attrs["regime"] = "almost_harmonic"
    assert "record 1 is almost_harmonic, foretold was stick_slip." in predict_motion(alike, other).sentences


def test_records_that_differ_count_as_one_observation_each(apart):
    # 5 times as many sticks at 0.3 as at 0.1, and yet the mean of the two
    law = apart.law
    assert law.break_away - law.kinetic == pytest.approx(0.4, abs=0.02)
    scatter = apart.groups.set_index("kind").loc["break-away", "between"]
    assert scatter.to_numpy() == pytest.approx(np.sqrt(2) * 0.1, rel=0.1)  # standard deviation of -0.1 and 0.1


def test_records_that_agree_do_not_scatter(alike):
    assert (alike.groups["between"] == 0).all()


def test_the_interval_holds_that_a_further_run_may_differ_as_much(alike, apart):
    row = predict_motion(apart, run(0.2, seed=2)).table.iloc[0]
    narrow = predict_motion(alike, run(0.2, seed=2)).table.iloc[0]
    assert row["low"] < 0.7 * row["stick_time"] < 1.3 * row["stick_time"] < row["high"]
    assert row["high"] / row["low"] > 5 * narrow["high"] / narrow["low"]


def test_something_that_was_not_identified_is_refused():
    with pytest.raises(InputError, match="expected an identification"):
        predict_motion(ss.laws.StaticKinetic(1.0, 0.6), run(0.2))


def test_the_command_foretells_further_runs(tmp_path, capsys):
    names = []
    for number, velocity in enumerate((0.1, 0.3, 0.2)):
        names.append(str(tmp_path / f"run{number}.nc"))
        run(velocity, seed=number).to_netcdf(names[-1], engine="h5netcdf")
    assert main(["identify", *names[:2], "--law", "StaticKinetic", "--predict", names[2], "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["prediction"]["table"].values()
    assert row["predicted_kind"] == "stick_slip"
    assert row["ratio"] == pytest.approx(1.0, abs=0.02)
