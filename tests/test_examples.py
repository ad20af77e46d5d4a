"""The record that ships with the package: made by its script, and its law found again."""

from importlib import resources

import pytest

import stickslip as ss
from stickslip.cli.main import main
from stickslip.errors import InputError
from stickslip.examples import copy_example, make


def test_the_record_is_what_its_script_makes():
    assert make.record() == resources.files("stickslip.examples").joinpath("block.csv").read_text(encoding="utf-8")


def test_a_file_that_exists_is_not_overwritten(tmp_path):
    copy_example(tmp_path / "new")
    with pytest.raises(InputError, match="expected a new file"):
        copy_example(tmp_path / "new")
    assert main(["example", "-o", str(tmp_path / "new")]) == 2


@pytest.mark.slow
def test_the_law_is_found_from_the_record(tmp_path):
    record, rig, system, *_ = copy_example(tmp_path)
    found = ss.identify(ss.measure(record, rig)).parameters
    true = ss.load_system(system).law
    for name in ("break_away", "kinetic"):
        assert found.loc[name, "low"] <= getattr(true, name) <= found.loc[name, "high"]
