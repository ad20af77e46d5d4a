"""The whole way on a real record, by its own commands: measure, identify, simulate, compare."""

import contextlib
import io
import json

import numpy as np
import pytest
from real_records import RIGS

from stickslip.cli.main import main


def run(capsys, *arguments):
    assert main([str(argument) for argument in (*arguments, "--json")]) == 0
    return json.loads(capsys.readouterr().out)


@pytest.fixture(scope="module")
def slow(shared_data, tmp_path_factory):
    """The friction file of the slow slider and what the command said of it."""
    # k = 168 N/m, V = 42 µm/s: Colas et al., Phys. Rev. E 2019; the numbers are those of the data set's own description.
    folder = tmp_path_factory.mktemp("slow")
    record, rig = shared_data / "paper_stickslip" / "k168Nm_v42.mat", RIGS / "paper_slider_k168_v42.toml"
    friction, said = folder / "friction.nc", io.StringIO()
    with contextlib.redirect_stdout(said):
        command = ["measure", record, "--rig", rig, "-o", friction, "--plot", folder / "a.png", "--json"]
        assert main([str(word) for word in command]) == 0
    return friction, json.loads(said.getvalue())


@pytest.mark.slow
def test_slow_slider_slips_as_often_as_it_should(slow):
    _, seen = slow
    assert seen["regime"] == "stick_slip"
    assert 200 <= seen["slips"] <= 230
    assert 1.6 <= seen["median_stick_time"] <= 1.7
    notes = " ".join(seen["notes"])
    assert "stiffness re-calibrated" in notes
    assert "inertia" in notes


@pytest.mark.slow
def test_law_of_the_slow_slider_sticks_as_long(slow, tmp_path, capsys):
    law = tmp_path / "law.toml"
    seen = run(capsys, "identify", slow[0], "--law", "DwellTime", "-o", law, "--plot", tmp_path / "b.png")
    table = seen["agreement"]["table"]
    assert table["mean stick time"]["simulated"] == pytest.approx(table["mean stick time"]["measured"], rel=0.15)
    # Static friction, and with it the force drop, grows with the logarithm of the stick time.
    assert seen["parameters"]["limit"]["low"] > 0
    assert any("per decade" in note for note in seen["notes"])
    assert any("disagree" in sentence for sentence in seen["agreement"]["sentences"])
    assert law.exists()


@pytest.mark.slow
def test_force_drop_of_the_slow_slider_grows_with_the_logarithm_of_the_stick_time(slow):
    import xarray as xr

    with xr.open_datatree(slow[0], engine="h5netcdf") as tree:
        rows = tree["break_away"].to_dataset(inherit=False)
        weight = float(tree.attrs["weight"])
        rows = rows.isel(event=np.isfinite(rows["stick_time"] * rows["drop"]).to_numpy())
        decades, drop = np.log10(rows["stick_time"].to_numpy()), rows["drop"].to_numpy() / weight
    slope = np.polyfit(decades, drop, 1)[0]
    assert 0.015 < slope < 0.045
    assert np.corrcoef(decades, drop)[0, 1] > 0.2


@pytest.mark.slow  # the same record is measured in test_measure_paper_slider.py
def test_fast_slider_is_told_apart(shared_data, capsys):
    record, rig = shared_data / "paper_stickslip" / "k168Nm_v4300.mat", RIGS / "paper_slider_k168_v4300.toml"
    seen = run(capsys, "measure", record, "--rig", rig)
    assert seen["regime"] == "stick_slip"
    assert seen["slow_share"] < 0.4
    assert seen["main_line"] == pytest.approx(15.1, abs=0.3)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (("stiffness = 168.0", ""), "stiffness is missing"),
        (("stiffness = 168.0", "stiffness = -168.0"), "stiffness must be a positive number, got -168.0"),
        (('column = "Fnorm"', 'column = "force"'), "force"),
        (("stiffness", "stifness"), "unknown key 'stifness' (did you mean 'stiffness'?)"),
    ],
)
def test_bad_rig_gives_one_sentence(tmp_path, capsys, change, sentence):
    record = tmp_path / "record.csv"
    rows = "\n".join(f"{i / 2000},{0.3 + 0.01 * (i % 100) / 100}" for i in range(2000))
    record.write_text("t,Fnorm\n" + rows)
    rig = tmp_path / "rig.toml"
    rig.write_text((RIGS / "paper_slider_k168_v42.toml").read_text().replace(*change, 1))
    assert main(["measure", str(record), "--rig", str(rig), "-o", str(tmp_path / "out.nc")]) == 2
    error = capsys.readouterr().err
    assert error.startswith("stickslip: ")
    assert sentence in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out.nc").exists()


def test_bad_record_gives_one_sentence(tmp_path, capsys, shared_data):
    rig = RIGS / "paper_slider_k168_v42.toml"
    broken = tmp_path / "nan.csv"
    broken.write_text("t,Fnorm\n" + "\n".join(f"{i / 2000},{'nan' if i == 700 else 0.3}" for i in range(2000)))
    torn = tmp_path / "torn.mat"
    torn.write_bytes((shared_data / "paper_stickslip" / "k168Nm_v4300.mat").read_bytes()[:20_000])
    for record, word in ((broken, "row 70"), (torn, "torn.mat"), (tmp_path / "nothing.mat", "nothing.mat")):
        assert main(["measure", str(record), "--rig", str(rig)]) == 2
        error = capsys.readouterr().err
        assert word in error
        assert error.count("\n") == 1
