"""What identification hands on: the law file, the report, the pictures, the motion laid over the measured one."""

from __future__ import annotations

import copy
import pickle
import re
import tomllib
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import stickslip as ss
from stickslip.errors import InputError
from stickslip.identification import compare_motion, friction_of_orbit, identify
from stickslip.report.identification import page

LAW = ss.laws.StaticKinetic(break_away=1.0, kinetic=0.6)
SYSTEM = ss.Oscillator(damping=0.1, drive_velocity=0.2, law=LAW)


@pytest.fixture(scope="module")
def friction():
    return friction_of_orbit(ss.simulate(SYSTEM, 300), np.arange(0, 300, 0.05), 0.01, seed=2)


@pytest.fixture(scope="module")
def found(friction):
    return identify(friction, law="StaticKinetic")


def test_law_file_holds_law_uncertainty_and_source_and_loads_again(found, tmp_path):
    path = found.save(tmp_path / "law.toml")
    assert ss.load_law(path) == found.law
    document = tomllib.loads(path.read_text())
    assert set(document) == {"law", "units", "uncertainty", "covariance", "source"}
    assert document["uncertainty"] == pytest.approx(found.parameters["error"].to_dict(), rel=1e-12)
    pd.testing.assert_frame_equal(ss.laws.load_covariance(path), found.covariance)
    assert document["source"]["version"]
    assert document["source"]["notes"]
    assert "simulated StaticKinetic" in document["source"]["records"][0]["measured_from"]
    assert document["source"]["command"].startswith("stickslip identify")


def test_law_file_is_written_whole_or_not_at_all(found, tmp_path):
    with pytest.raises(InputError, match="does not exist"):
        found.save(tmp_path / "nowhere" / "law.toml")
    assert list(tmp_path.iterdir()) == []


def test_friction_file_gives_the_same_law_as_the_tree_it_was_written_from(friction, found, tmp_path):
    path = tmp_path / "friction.nc"
    friction.to_netcdf(path, engine="h5netcdf")
    assert identify(path, law="StaticKinetic").law == found.law


def test_report_names_the_law_its_numbers_and_what_was_assumed(found):
    text = found.report()
    assert "StaticKinetic from 1 record" in text
    assert "break_away" in text
    assert "kinetic" in text
    assert "one drive velocity" in text


@pytest.mark.slow
def test_a_report_leads_with_numbers_that_are_told_apart_from_zero(found):
    def key(errors):
        parameters = found.parameters.assign(error=found.parameters["value"] * errors)
        shown = page(replace(found, parameters=parameters), simulate=False).html().split("</dl>")[0]
        return re.findall("<dt>(.*?)</dt>", shown)

    assert key([1e-3, 2e-3]) == ["break_away", "kinetic", "rms of the kinetic force"]
    assert key([1e-3, 1.7]) == ["break_away", "rms of the kinetic force"]


def test_covariance_and_errors_agree(found):
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)), found.parameters["error"])


def test_residuals_are_the_noise(found):
    frame = found.residuals()
    assert np.std(frame["force"] - frame["predicted"]) == pytest.approx(0.01, rel=0.1)


def test_picture_of_the_fit_has_data_and_law(found):
    assert len(found.plot().lines) == 2


def test_the_law_that_made_the_motion_agrees_with_it_in_everything(friction):
    agreement = compare_motion(friction, LAW)
    assert agreement.regimes == ("stick_slip", "stick_slip")
    names = ["slips per time", "mean stick time", "median stick time", "mean force drop"]
    np.testing.assert_allclose(agreement.table.loc[names, "ratio"], 1.0, atol=0.01)
    assert agreement.phase_distance < 0.02
    assert set(agreement.table["agrees"]) <= {"within two errors", "within 5 %"}
    assert not [sentence for sentence in agreement.sentences if "disagree" in sentence]


def test_a_wrong_law_is_said_to_disagree(friction):
    weaker = ss.laws.StaticKinetic(break_away=0.8, kinetic=0.6)
    steady = [
        ss.simulate(replace(SYSTEM, law=law), 200).events["stick_time"].dropna().iloc[-1] for law in (weaker, LAW)
    ]
    agreement = compare_motion(friction, weaker)
    stick = next(sentence for sentence in agreement.sentences if sentence.startswith("mean stick time"))
    assert "disagrees" in stick
    assert agreement.table.loc["mean stick time", "agrees"] == "no"
    assert agreement.table.loc["mean stick time", "ratio"] == pytest.approx(steady[0] / steady[1], rel=0.02)


def test_another_kind_of_motion_is_said_first(friction):
    agreement = compare_motion(friction, replace(SYSTEM, law=ss.laws.Coulomb(kinetic=0.6), damping=0.5))
    assert agreement.sentences[0] == "The kinds of motion differ: measured stick_slip, simulated stable_slip."


def test_almost_harmonic_motion_is_compared_by_line_and_phase():
    orbit = ss.simulate(ss.paper.oscillator(0.3), 200)
    agreement = compare_motion(friction_of_orbit(orbit, np.arange(0, 200, 0.05)), ss.paper.oscillator(0.3))
    assert agreement.regimes[1] == "almost_harmonic"
    assert agreement.table.loc["main line of velocity", "ratio"] == pytest.approx(1, abs=0.02)
    assert agreement.phase_distance < 0.01


def test_pictures_of_the_two_motions(friction):
    figure = compare_motion(friction, LAW).plot()
    assert [len(axes.lines) for axes in figure.axes] == [2, 2]


def test_a_record_that_does_not_say_its_mass_asks_for_an_oscillator(friction):
    data = friction.to_dataset(inherit=False)
    del data.attrs["mass"]
    with pytest.raises(InputError, match="does not say its mass"):
        compare_motion(xr.DataTree(data), LAW)


def test_something_that_is_no_law_is_refused(friction):
    with pytest.raises(InputError, match="expected a law, an identification or an oscillator"):
        compare_motion(friction, "StaticKinetic")


def test_an_oscillator_brings_its_own_constants(friction):
    assert compare_motion(friction, replace(SYSTEM, drive_velocity=0.1)).system.drive_velocity == 0.1


def test_a_result_prints_in_a_line_and_in_a_notebook_as_one_table(found):
    assert repr(found).startswith("<Identification: StaticKinetic from 1 record(s)")
    row = found.parameters.loc["kinetic"]
    assert f"kinetic = {row['value']:.5g} ± {row['error']:.2g}" in repr(found)
    for result in (found, found.static):
        assert len(repr(result)) < 400
        assert "\n" not in repr(result)
        assert result._repr_html_().count("<table") == 1
        assert len(result._repr_html_()) < 3000


def test_a_result_survives_a_pickle_and_a_copy_and_compares_by_content(found):
    for result in (found, found.static):
        for again in (pickle.loads(pickle.dumps(result)), copy.deepcopy(result)):
            assert again == result
            assert again.report() == result.report()
    assert pickle.loads(pickle.dumps(found.static)).best(1.0) == found.static.best(1.0)
    assert replace(found, rms=2 * found.rms) != found
    assert found != "an identification"


@pytest.mark.long
def test_friction_that_would_drive_beyond_the_records_is_named():
    law = ss.laws.ExponentialStribeck(break_away=2.9, kinetic=1.9, scale=15.0, viscous=-0.05, exponent=2.0)
    orbit = ss.simulate(ss.Oscillator(0.02, 8.8, law, mass=0.06, stiffness=17.0), 6.0)
    record = friction_of_orbit(orbit, np.arange(0, 6, 2e-3), 0.02)
    found = identify(record, law="ExponentialStribeck")
    (said,) = [note for note in found.notes if "changes its sign near w = " in note]
    near = float(said.split("w = ")[1].split()[0])
    assert found.law.kinetic_force(0.9 * near) > 0 > found.law.kinetic_force(1.1 * near)
    found = identify(record, law="ExponentialStribeck", fixed={"viscous": 0.0})
    assert not any("changes its sign" in note for note in found.notes)
