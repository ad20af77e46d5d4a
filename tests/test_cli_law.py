"""``stickslip law``: what a law file holds."""

import numpy as np
import pandas as pd
import pytest

import stickslip as ss
from stickslip.cli import law as cli_law
from stickslip.cli.main import main
from stickslip.identification import friction_of_orbit, identify


@pytest.fixture
def file(tmp_path):
    names = ["break_away", "kinetic"]
    covariance = pd.DataFrame([[4e-4, 0.0], [0.0, 1e-4]], index=names, columns=names)
    law = ss.laws.StaticKinetic(1.0, 0.6).with_covariance(covariance)
    return law.save(tmp_path / "law.toml", units={"break_away": "N", "kinetic": "N"})


def test_numbers_come_with_units_and_errors(file, capsys):
    assert main(["law", str(file)]) == 0
    said = capsys.readouterr().out
    assert "StaticKinetic" in said
    assert "1.000 ± 0.020 N" in said
    assert "0.600 ± 0.010 N" in said


def test_picture_table_and_code_are_those_of_the_law(file, tmp_path):
    written = {option: tmp_path / name for option, name in (("plot", "l.png"), ("table", "l.csv"), ("code", "l.py"))}
    given = [part for option, path in written.items() for part in (f"--{option}", str(path))]
    assert main(["law", str(file), "--speed", "2", *given]) == 0
    table = pd.read_csv(written["table"]).set_index("slip_velocity (m/s)")
    assert table.loc[2.0, "force (N)"] == 0.6
    assert table.loc[2.0, "low (N)"] == pytest.approx(0.6 - 1.96 * 0.01, abs=0.002)
    assert table.loc[0.0, "force (N)"] == 1.0
    names = {}
    exec(written["code"].read_text(encoding="utf-8"), names)
    assert (names["friction"](-1.0, 0.0), names["friction"](0.0, 5.0)) == (-0.6, 1.0)
    assert written["plot"].stat().st_size > 1000


@pytest.mark.long
def test_a_fitted_law_says_and_draws_what_was_measured(tmp_path, capsys, monkeypatch):
    systems = [ss.Oscillator(0.1, s, ss.laws.DwellTime(0.5, 0.5, 0.4)) for s in (0.1, 0.2)]
    times = np.arange(40.0, 100.0, 0.05)
    frictions = [friction_of_orbit(ss.simulate(system, 100.0), times, 0.01) for system in systems]
    found = identify(frictions, law="DwellTime")
    fastest = max(float(friction["slip_velocity"].max()) for friction in frictions)
    rests = [t for friction in frictions for t in friction["break_away"]["stick_time"].to_numpy()]
    file = found.save(tmp_path / "law.toml")
    drawn = []
    monkeypatch.setattr(cli_law, "save_figure", lambda figure, _: drawn.append(figure.axes[0]))
    assert main(["law", str(file), "--plot", "l.png"]) == 0
    said = f"fitted to slip velocities up to {fastest:.3g} and rests of {min(rests):.3g} to {max(rests):.3g}\n"
    assert said in capsys.readouterr().out
    assert drawn[0].get_xlim()[1] == pytest.approx(fastest)
    assert f"break-away, rest of {max(rests):.2g}" in drawn[0].get_legend_handles_labels()[1]
    assert main(["law", str(file), "--plot", "l.png", "--speed", "2"]) == 0
    assert drawn[1].get_xlim()[1] == 2.0


def test_axes_have_units_that_no_number_of_the_law_has(file, tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(cli_law, "save_figure", lambda figure, _: drawn.append(figure.axes[0]))
    assert main(["law", str(file), "--plot", "l.png"]) == 0
    assert (drawn[0].get_xlabel(), drawn[0].get_ylabel()) == ("slip velocity w (m/s)", "friction force f (N)")
    orbit = ss.simulate(ss.Oscillator(0.1, 0.2, ss.laws.StaticKinetic(1.0, 0.6)), 100.0)
    friction = friction_of_orbit(orbit, np.arange(40.0, 100.0, 0.05), 0.01)
    for name, unit in (("slip_velocity", "m/s"), ("force", "1")):
        friction[name].attrs["units"] = unit
    fitted = identify(friction, law="StaticKinetic").save(tmp_path / "fitted.toml")
    assert main(["law", str(fitted), "--plot", "l.png"]) == 0
    assert (drawn[1].get_xlabel(), drawn[1].get_ylabel()) == (
        "slip velocity w (m/s)",
        "friction force f (dimensionless)",
    )


@pytest.mark.parametrize("measured", ['"fast"', "[1]", '{ slip_velocity = ["a", "b"], stick_time = 3 }'])
def test_a_measured_range_that_is_none_is_left_out(file, measured, capsys):
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace("[source]", f"[source]\nmeasured = {measured}"), encoding="utf-8")
    assert main(["law", str(file)]) == 0
    assert "fitted to" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--table", "l.csv"], "--table and --code need the largest slip velocity; give it with --speed"),
        (["--stick-time", "3"], "--stick-time goes with --code"),
        (["--code", "l.m", "--speed", "1"], "the file must end in .c or .py, got l.m"),
    ],
)
def test_what_cannot_be_done_is_said_before_anything_is_printed(file, options, sentence, capsys):
    assert main(["law", str(file), *options]) == 2
    said = capsys.readouterr()
    assert sentence in said.err
    assert said.out == ""
