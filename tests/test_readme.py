import re
import shlex
from pathlib import Path

import matplotlib.pyplot as plt
import pytest
import xarray as xr

from stickslip import simulate
from stickslip.cli.main import _parser, main
from stickslip.model.system import load_system_document
from stickslip.paper import demo

README = Path(__file__).parents[1] / "README.md"


def test_example_prints_the_number_it_says(tmp_path, monkeypatch, capsys):
    text = README.read_text(encoding="utf-8")
    code = re.search(r"```python\n(.*?)```", text, re.DOTALL).group(1)
    assert len([line for line in code.splitlines() if line.strip()]) <= 15
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "README.md", "exec"), {})
    plt.close("all")
    last = capsys.readouterr().out.strip().splitlines()[-1]
    assert f"`{last}`" in text


def test_files_it_names_are_there():
    links = re.findall(r"\]\(([^)#:]+)\)", README.read_text(encoding="utf-8"))
    assert links
    for link in links:
        assert (README.parent / link).exists(), link


def test_its_system_file_keeps_the_motion_that_it_shows(tmp_path):
    text = README.read_text(encoding="utf-8")
    (tmp_path / "system.toml").write_text(re.search(r"```toml\n(.*?)```", text, re.DOTALL).group(1))
    system, settings = load_system_document(tmp_path / "system.toml")
    assert simulate(system, **settings).regime() == simulate(system, 10 * settings["t_end"]).regime() == "stick_slip"


def commands():
    lines = README.read_text(encoding="utf-8").splitlines()
    return [shlex.split(line)[1:] for line in lines if line.startswith("stickslip ")]


def test_its_commands_are_those_of_the_command_line():
    assert [_parser().parse_args(words).command for words in commands()] == ["measure", "identify", "simulate"]


@pytest.mark.slow
def test_its_commands_run_on_the_record_of_the_demo(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    demo.see(demo.DRIVE_VELOCITIES[0], tmp_path, 1, filmed=False)
    (friction,), (rig,) = tmp_path.glob("friction-*.nc"), tmp_path.glob("*.rig.toml")
    toml = re.search(r"```toml\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL).group(1)
    (tmp_path / "SYSTEM.toml").write_text(toml)
    table = xr.open_datatree(friction, engine="h5netcdf").load().to_dataset()
    table["recorded"].rename("x").to_dataframe().to_csv("RECORD.csv")
    files = {"RECORD.mat": "RECORD.csv", "RIG.toml": rig.name}
    for words in commands():
        assert main([files.get(word, word) for word in words]) == 0
