import json
import subprocess
import sys

import pytest

import stickslip as ss
from stickslip.cli.main import main


@pytest.fixture
def system(tmp_path):
    path = tmp_path / "system.toml"
    path.write_text(ss.paper.oscillator(0.2).to_toml())
    return path


def test_simulate_writes_what_it_says(system, tmp_path, capsys):
    orbit, picture = tmp_path / "orbit.nc", tmp_path / "orbit.png"
    assert main(["simulate", str(system), "--t-end", "100", "-o", str(orbit), "--plot", str(picture), "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["regime"] == "stick_slip"
    assert ss.load(orbit).regime() == "stick_slip"
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_settings_of_the_document_and_of_the_command(system, capsys):
    system.write_text(system.read_text() + "\n[simulation]\nt_end = 30.0\nx0 = 0.5\n")
    assert main(["simulate", str(system), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["t_end"] == 30.0
    assert main(["simulate", str(system), "--json", "--t-end", "20"]) == 0
    assert json.loads(capsys.readouterr().out)["t_end"] == 20.0


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (("stiffness = 1.0\n", ""), "stiffness is missing"),
        (("stiffness = 1.0", "stiffness = -1.0"), "stiffness must be greater than 0, got -1"),
        (("stiffness", "stifness"), "unknown key 'stifness' (did you mean 'stiffness'?)"),
        (("damping = 0.35", "damping = nan"), "damping must be a finite number, got nan"),
        (("damping = 0.35", "damping = "), "not a TOML document"),
        (("[law.static_friction]", "[law.static_frction]"), "unknown key 'static_frction'"),
        (("[law]", "[forcing]\namplitude = 1\n[law]"), "frequency is missing"),
        (("[law]", "[simulation]\nt_end = -3\n[law]"), "t_end must be a positive number, got -3"),
    ],
)
def test_bad_document_gives_one_sentence(system, capsys, change, sentence):
    system.write_text(system.read_text().replace(*change))
    assert main(["simulate", str(system)]) == 2
    error = capsys.readouterr().err
    assert error.startswith("stickslip: ")
    assert sentence in error
    assert error.count("\n") == 1


def test_missing_file_and_folder(system, tmp_path, capsys):
    assert main(["simulate", str(tmp_path / "nothing.toml")]) == 2
    assert "no such file" in capsys.readouterr().err
    assert main(["simulate", str(system), "-o", str(tmp_path / "nowhere" / "orbit.nc")]) == 2
    assert "does not exist" in capsys.readouterr().err
    assert main(["simulate", str(system), "--plot", str(tmp_path / "orbit.docx")]) == 2
    assert "expected a name that ends in .png, .avif, .eps" in capsys.readouterr().err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["system.toml"]


def test_version_does_not_wait_for_numpy():
    code = "import sys; from stickslip.cli.main import main; main(['--version']); sys.exit('numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert done.stdout.startswith("stickslip 0.")


def test_a_fresh_interpreter_knows_the_laws_that_files_name(system, tmp_path):
    # The laws are known to files before anything has asked for ss.laws.
    orbit = tmp_path / "orbit.nc"
    assert main(["simulate", str(system), "--t-end", "20", "-o", str(orbit)]) == 0
    code = f"import stickslip as ss; print(ss.load({str(orbit)!r}).t_end)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "20.0", done.stderr


@pytest.mark.parametrize(
    ("command", "written"),
    [
        ("simulate SYSTEM -o orbit.pdf", "orbit.nc"),
        ("simulate SYSTEM --plot orbit", "orbit.png"),
        ("measure SYSTEM --rig SYSTEM -o friction.csv", "friction.nc"),
        ("identify SYSTEM -o law.csv", "law.toml"),
        ("identify SYSTEM --report law.pdf", "law.html"),
        ("sweep SYSTEM --over drive_velocity=0.1:0.2:2 -o diagram.csv", "diagram.zarr"),
        ("film SYSTEM -o film.gif", "film.avi"),
    ],
)
def test_a_file_of_another_kind_is_refused_before_any_work(system, capsys, monkeypatch, command, written):
    monkeypatch.chdir(system.parent)
    assert main(command.replace("SYSTEM", system.name).split()) == 2
    error = capsys.readouterr().err
    assert "expected a name that ends in" in error
    assert error.endswith(f"; write {written} for example\n")
    assert [path.name for path in system.parent.iterdir()] == [system.name]


def test_a_motion_beyond_all_numbers_is_no_regime(system, capsys):
    assert main(["simulate", str(system), "--x0", "1e308", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["regime"] == "diverged"


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["-o", "."], "got a folder"),
        (["-o", "/dev/null"], "got a device"),
        (["-o", ""], "got an empty one"),
        (["--max-events", str(2**70)], "max_events must be a whole number"),
        (["--t-end", "nan"], "t_end must be a finite number"),
    ],
)
def test_bad_options_give_one_sentence(system, capsys, arguments, sentence):
    assert main(["simulate", str(system), *arguments]) == 2
    error = capsys.readouterr().err
    assert sentence in error
    assert error.count("\n") == 1


def test_a_start_beyond_all_numbers_is_said(system, capsys):
    assert main(["simulate", str(system), "--x0", "1e308", "--t-end", "10", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["stop"] == "diverged"


def test_a_folder_named_like_a_file_is_refused(tmp_path, capsys):
    assert main(["example", "-o", str(tmp_path / "x.csv")]) == 2
    assert "x.csv: expected the name of a folder, got the ending .csv; write x" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
