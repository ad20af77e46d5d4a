"""Records of known friction as a newcomer's rig gives them: docs/evidence/first_records.py, one record of each."""

from __future__ import annotations

import pytest
from evidence import script

first_records = script("first_records")


@pytest.mark.long
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name == "slide" else pytest.mark.slow) for name in first_records.TASKS]
)
def test_the_numbers_of_a_newcomers_record_are_found(name):
    task = first_records.TASKS[name]()
    _, found = task.find(0)
    for number, truth in task.truth.items():
        row = found.loc[number]
        # the fall of a slide with bristles is less where it slows down: see the page
        unsure = 0.06 * truth if (name, number) == ("slide", "weakening") else 0.0
        assert abs(row["value"] - truth) < 3.5 * row["error"] + unsure, number
