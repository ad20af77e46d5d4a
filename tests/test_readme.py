"""The first page: its example and its system file; test_docs.py runs all of it."""

import re
from pathlib import Path

import matplotlib.pyplot as plt

from stickslip import simulate
from stickslip.model.system_file import load_system_document

TEXT = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")


def test_example_prints_the_numbers_below_it(tmp_path, monkeypatch, capsys):
    code, printed = re.search(r"```python\n(.*?)```\n\n```text\n(.*?)```", TEXT, re.DOTALL).groups()
    assert len([line for line in code.splitlines() if line.strip()]) <= 15
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "README.md", "exec"), {})
    plt.close("all")
    assert capsys.readouterr().out == printed


def test_its_system_file_keeps_the_motion_that_it_shows(tmp_path):
    (tmp_path / "system.toml").write_text(re.search(r"```toml\n(.*?)```", TEXT, re.DOTALL).group(1), encoding="utf-8")
    system, settings = load_system_document(tmp_path / "system.toml")
    assert simulate(system, **settings).regime() == simulate(system, 10 * settings["t_end"]).regime() == "stick_slip"
