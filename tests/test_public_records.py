"""What is known of public records lies in the intervals of the laws found from them, and the page of it is what comes now."""

import pytest
from evidence import script

public_records = script("public_records")


def cells(line):
    return [cell.strip() for cell in line.strip(" |\n").split("|")]


#: The one that is measured and identified in a second; the others take up to a minute each.
QUICK = "robot_joint_kinova"


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name == QUICK else pytest.mark.slow) for name in public_records.RECORDS]
)
def test_known_numbers_lie_in_the_intervals_and_the_page_says_so(name, shared_data):
    if not list(shared_data.glob(f"{'robot_joint' if 'robot' in name else name}*")):
        pytest.skip(f"no {name} among the real records")
    kept = {
        tuple(cells(line)[:3]): cells(line) for line in public_records.PAGE.read_text(encoding="utf-8").splitlines()
    }
    for row in public_records.RECORDS[name](shared_data):
        assert row.inside != bool(row.why), row  # one that is missed says why, and no longer once it is met
        record, law, number, *values = cells(row.line())
        old = kept.get((record, law, number))
        assert old is not None, f"{record}, {law}, {number}: run python docs/evidence/public_records.py"
        assert values[0] == old[3]
        assert float(values[1]) == pytest.approx(float(old[4]), rel=0.01, abs=1e-4 * abs(row.known) + 1e-5)
        assert values[3] == old[6]
