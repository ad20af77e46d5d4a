"""What is said of several records: each beside its own motion, and steps of the speed that a fit does not use."""

from __future__ import annotations

import json
import math

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from spring_and_block import record
from test_identify_options import steps

import stickslip as ss
from stickslip.cli.main import main
from stickslip.errors import InputError
from stickslip.files.disk import input_file
from stickslip.identification import fit_static_friction, fit_steady, friction_of_orbit, identify
from stickslip.identification.prediction import prediction
from stickslip.identification.prediction.agreement import compare_motion
from stickslip.identification.prediction.prediction import columns
from stickslip.identification.records import read_records


def kinetic(_w):
    return 0.6


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Three records, the last with a stiffness that is not its own."""
    folder, found = tmp_path_factory.mktemp("records"), []
    for number, drive in enumerate((0.1, 0.15, 0.2)):
        tree = record(kinetic, lambda _rest: 1.0, drive, seed=number, samples=1500)
        if number == 2:
            tree.attrs["stiffness"] = 2.0
        tree.to_netcdf(folder / f"{number}.nc", engine="h5netcdf")
        found.append(str(folder / f"{number}.nc"))
    return found


@pytest.mark.slow
def test_every_record_is_laid_beside_its_motion_and_the_worst_comes_first(files, capsys, tmp_path):
    assert main(["identify", *files, "--law", "StaticKinetic", "--plot", str(tmp_path / "a.png")]) == 0
    said = capsys.readouterr().out
    assert f"\n{files[2]}\n\n" in said
    assert "This is the worst of 3 records" in said
    assert all(f"  - {name}: both stick_slip, and all quantities agree." in said for name in files[:2])
    main(["identify", *files, "--law", "StaticKinetic", "--json"])
    found = json.loads(capsys.readouterr().out)
    assert found["agreement"]["record"] == files[2]
    assert {one["record"] for one in found["agreements"]} == set(files)


def test_a_fit_of_levels_says_what_fits_the_steps_between_them(tmp_path, capsys):
    tree = steps(5)
    assert any("--law RateState (fit_velocity_steps)" in note for note in fit_steady(tree).notes)
    tree.to_netcdf(tmp_path / "steps.nc", engine="h5netcdf")
    main(["identify", str(tmp_path / "steps.nc")])
    assert "--law RateState" in capsys.readouterr().out


def test_break_aways_that_a_saturated_instrument_cannot_show_are_told_by_a_number():
    w = 0.3 + 0.2 * np.sin(np.arange(0, 40, 0.05))
    data = xr.Dataset({"slip_velocity": ("time", w), "force": ("time", 0.6 + 0 * w)}, {"time": np.arange(0, 40, 0.05)})
    data.attrs["saturated"] = 17
    with pytest.raises(ss.InputError, match="17 samples stand at the end of the instrument's range"):
        identify(xr.DataTree(data), law="StaticKinetic")


def test_an_experiment_file_has_its_article(tmp_path):
    with pytest.raises(ss.InputError, match="give the path of an experiment file"):
        input_file(tmp_path / "none.toml", "experiment file")


def test_many_records_share_one_name_in_a_picture():
    law = ss.laws.StaticKinetic(break_away=1.0, kinetic=0.6)
    orbits = [ss.simulate(ss.Oscillator(damping=0.05, drive_velocity=0.1 + 0.01 * n, law=law), 60.0) for n in range(8)]
    found = ss.identify(
        [friction_of_orbit(orbit, np.arange(0, 60, 0.1), 0.01, seed=n) for n, orbit in enumerate(orbits)]
    )
    labels = [text.get_text() for text in found.plot().get_legend().get_texts()]
    assert labels == ["8 records", "law"]


@pytest.mark.parametrize(
    ("limit", "static"),
    [(lambda _rest: 1.0, "PiecewiseLinear"), (lambda rest: 1.3 - 0.5 * np.exp(-0.4 * rest), "Combined")],
)
def test_kinetic_friction_that_is_a_straight_line_is_fitted_by_one(limit, static):
    """A Stribeck curve has numbers that such records do not hold."""
    drives = (0.08, 0.12, 0.16) if static == "Combined" else (0.1,)
    trees = [record(lambda w: 0.6 + 0.15 * w, limit, drive, seed=i, samples=1500) for i, drive in enumerate(drives)]
    found = identify(trees)
    assert type(found.law).__name__ == static
    assert ": the line 0." in found.notes[0]
    kinetic = found.law if static == "PiecewiseLinear" else found.law.kinetic
    assert len(kinetic.nodes) == 2
    low, high = (found.parameters.filter(regex=r"nodes\[1\].force$", axis=0)[key].item() for key in ("low", "high"))
    assert low < 0.6 + 0.15 * kinetic.nodes[1][0] < high


def test_a_few_samples_against_the_usual_direction_are_no_slip_that_way():
    tree = record(lambda w: 0.6 - 0.1 * w, lambda _rest: 1.0, 0.3, seed=4, samples=1500)
    w = tree["slip_velocity"].to_numpy()
    w[np.flatnonzero(w > 0.2)[::50]] *= -1  # errors of a differentiated position
    found = fit_steady(tree)
    assert not {"offset", "asymmetric"} & set(found.chosen.split(", "))
    assert any("slip against the sense of nearly all of it" in note for note in found.notes)
    assert abs(found.parameters.loc["kinetic", "value"] - 0.6) < 0.01


def test_static_friction_is_fitted_to_a_plain_table():
    rest = np.geomspace(1, 100, 12)
    table = pd.DataFrame({"stick_time": rest, "force": 0.6 + 0.05 * np.log10(rest)})
    assert fit_static_friction(table).fits["logarithmic"].parameters.loc["slope", "value"] == pytest.approx(
        0.05, abs=1e-6
    )
    with pytest.raises(InputError, match="columns stick_time and force, got none named force among stick_time, peak"):
        fit_static_friction(table.rename(columns={"force": "peak"}))


def test_a_run_whose_drawn_laws_do_not_stick_is_predicted_without_an_interval():
    numbers = {name: math.nan for of in ("stick_rate", "min_force", "max_force") for name in columns(of)}
    run = pd.DataFrame([numbers | {"stick_rate_predicted": 3.0}], index=["run"])
    assert prediction._counts(run, [2.0]) == [
        "run: 6 sticks in 2 of steady motion by the law itself; none of the laws drawn from its uncertainty sticks there, so "
        "there is no interval."
    ]


def test_what_was_said_of_a_record_is_said_of_its_curve_too():
    tree = record(lambda w: 0.6 - 0.1 * w, lambda _rest: 1.0, 0.3, seed=4, samples=1500)
    tree.attrs["notes"] = ["12 readings equal the largest value, 5: saturated?"]
    assert fit_steady(tree).notes[-1] == "record 1: 12 readings equal the largest value, 5: saturated?"


def test_slips_whose_break_away_is_not_sure_count_in_the_rate():
    tree = record(kinetic, lambda _rest: 1.0, 0.1, samples=1500)
    whole = compare_motion(read_records(tree)[0], ss.laws.StaticKinetic(1.0, 0.6)).table
    tree["break_away"] = xr.DataTree(tree["break_away"].to_dataset(inherit=False).isel(event=slice(None, None, 2)))
    half = compare_motion(read_records(tree)[0], ss.laws.StaticKinetic(1.0, 0.6)).table
    assert half.loc["slips per time", "agrees"] == whole.loc["slips per time", "agrees"] != "no"
    assert half.loc["slips per time", "measured"] == pytest.approx(whole.loc["slips per time", "measured"], rel=0.02)
