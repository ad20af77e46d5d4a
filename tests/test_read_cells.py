"""Text as instruments and spreadsheets write it: dates, times of day, groups of thousands, remarks below the table."""

import datetime

import numpy as np
import pandas as pd
import pytest

import stickslip as ss
from stickslip.measurement import Rig, measure

T = np.arange(0, 40, 0.05).round(3)
FORCE = 1200 + 900 * np.sin(1.3 * T) + np.random.default_rng(1).standard_normal(T.size)
START = datetime.datetime(2024, 3, 5, 23, 59, 50)
RIG = {
    "instrument": "spring_force",
    "column": "F",
    "time_column": "t",
    "unit": "mN",
    "stiffness": 1.7,
    "mass": 1.0,
    "drive_velocity": 5.0,
}


def stamps(pattern, part):
    """Times of the samples as dates, their fraction with `part` digits."""
    moments = [START + datetime.timedelta(seconds=round(float(t), 3)) for t in T]
    return [moment.strftime(pattern) + f"{moment.microsecond:06d}"[:part] for moment in moments]


def written(path, times, forces, mark=",", below=""):
    rows = [f"{t}{mark}{f}" for t, f in zip(times, forces, strict=True)]
    path.write_text("\n".join([f"t{mark}F", *rows]) + "\n" + below, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def plain():
    return measure({"t": T, "F": np.round(FORCE, 2)}, RIG)


@pytest.mark.parametrize(
    "pattern", ["%Y-%m-%d %H:%M:%S.", "%Y-%m-%dT%H:%M:%S.", "%d.%m.%Y %H:%M:%S.", "%m/%d/%Y %H:%M:%S.", "%H:%M:%S,"]
)
def test_stamps_of_a_calendar_are_read_across_midnight(tmp_path, plain, pattern):
    path = written(tmp_path / "r.csv", stamps(pattern, 3), [f"{f:.2f}" for f in FORCE], ";")
    found = measure(path, RIG)
    np.testing.assert_allclose(found["force"], plain["force"], atol=1e-6)
    np.testing.assert_allclose(found["time"], T, atol=1e-9)
    assert any("'t' was read in s since its first stamp, " in note for note in found.attrs["notes"])


def test_stamps_are_seconds_whatever_the_rig_says(tmp_path):
    path = written(tmp_path / "r.csv", stamps("%Y-%m-%d %H:%M:%S.", 3), FORCE.round(2))
    with pytest.raises(ss.InputError, match="'t' is in s and the rig says ms"):
        measure(path, RIG | {"time_unit": "ms"})


def test_a_stamp_that_is_none_is_placed(tmp_path):
    times = stamps("%Y-%m-%d %H:%M:%S.", 3)
    times[7] = "2024-03-05 lunch"
    with pytest.raises(
        ss.InputError, match="row 9, column 't': a date or a time of day was expected, got '2024-03-05 lunch'"
    ):
        measure(written(tmp_path / "r.csv", times, FORCE.round(2)), RIG)


def test_stamps_of_a_frame_are_seconds(plain):
    frame = pd.DataFrame({"t": pd.Timestamp(START) + pd.to_timedelta(T, unit="s"), "F": np.round(FORCE, 2)})
    np.testing.assert_allclose(measure(frame, RIG)["force"], plain["force"], atol=1e-6)


@pytest.mark.parametrize(("decimal", "groups"), [(",", "."), (",", "\u00a0"), (".", ","), (".", "'")])
def test_groups_of_thousands_are_read(tmp_path, plain, decimal, groups):
    swap = str.maketrans({",": groups, ".": decimal})
    times = [f"{t:.2f}".translate(swap) for t in T]
    path = written(tmp_path / "r.csv", times, [f"{f:,.2f}".translate(swap) for f in FORCE], ";")
    found = measure(path, RIG | {"read": {"decimal": decimal}})
    np.testing.assert_allclose(found["force"], plain["force"], atol=1e-6)
    assert "column 'F' was read with groups of thousands" in found.attrs["notes"]


def test_remarks_below_the_table_are_left_out_and_a_torn_row_is_not(tmp_path, plain):
    below = "\nMaximum,2098.1\nEnd of the measurement\n"
    found = measure(written(tmp_path / "r.csv", T.round(2), FORCE.round(2), below=below), RIG)
    np.testing.assert_array_equal(found["force"], plain["force"])
    row = len(T) + 3
    assert f"2 lines below the table, from row {row} ('Maximum,2098.1'), left out" in found.attrs["notes"]
    for torn in ("40.0\n", "40.0,12,5\n"):
        with pytest.raises(ss.InputError, match="the file seems truncated"):
            measure(written(tmp_path / "r.csv", T.round(2), FORCE.round(2), below=torn), RIG)
    with pytest.raises(ss.InputError, match="a number was expected, got 'nothing'"):
        measure(written(tmp_path / "r.csv", T.round(2), FORCE.round(2), below="40.0,nothing\n"), RIG)


def test_a_number_with_a_point_stays_one_where_commas_are_decimal_marks(tmp_path):
    path = written(tmp_path / "r.csv", T.round(2), [f"{f / 1000:.3f}" for f in FORCE], ";")
    found = ss.measurement.read.read_columns(path, Rig(**RIG).read.__class__(decimal=","))
    assert found["F"].max() < 3


@pytest.mark.parametrize("mark", [",", ";", "\t", " "])
@pytest.mark.parametrize("first", [0, 1])
def test_a_header_without_a_name_for_the_row_names_is_refused(tmp_path, mark, first):
    """As R writes a table: every column would be read as the one before it."""
    path = tmp_path / "r.csv"
    rows = [mark.join([str(i), f"{t:.2f}", f"{f:.2f}"]) for i, (t, f) in enumerate(zip(T, FORCE, strict=True), first)]
    path.write_text("\n".join([f"t{mark}F", *rows]) + "\n")
    with pytest.raises(ss.InputError, match="row 2 has 3 cells and the header 2; the first cells count, so they look"):
        measure(path, RIG)
    path.write_text("\n".join([f"row{mark}t{mark}F", *rows]) + "\n")
    assert measure(path, RIG)["force"].size == T.size


def test_decimal_commas_between_commas_are_refused(tmp_path):
    path = written(tmp_path / "r.csv", range(T.size), [f"{f:.2f}".replace(".", ",") for f in FORCE])
    with pytest.raises(
        ss.InputError, match="row 2 has 3 cells and the header 2; if some of its commas are decimal marks"
    ):
        measure(path, RIG)


def test_a_header_longer_than_the_rows_is_refused(tmp_path):
    path = written(tmp_path / "r.csv", T, FORCE.round(2))
    path.write_text(path.read_text().replace("t,F", "t,F,lost", 1))
    with pytest.raises(ss.InputError, match="row 2 has 2 cells and the header 3; look at the header"):
        measure(path, RIG)


@pytest.mark.parametrize(("head", "end"), [("t;F", ";"), ("t;F;", ""), ("t;F;", ";"), ("t;F", ";;")])
@pytest.mark.parametrize("hole", [None, 7])
def test_delimiters_at_the_end_of_rows_are_no_columns(tmp_path, plain, head, end, hole):
    rows = [f"{t:.2f};{'' if i == hole else f'{f:.2f}'}{end}" for i, (t, f) in enumerate(zip(T, FORCE, strict=True))]
    path = tmp_path / "r.csv"
    path.write_text("\n".join([head, *rows]) + "\n")
    found = measure(path, RIG | {"read": {"missing": "drop"}})
    assert found["force"].size == T.size
    np.testing.assert_allclose(found["force"], plain["force"], atol=1e-6 if hole is None else 0.1)


@pytest.mark.parametrize(("decimal", "groups"), [(",", "."), (".", ",")])
def test_whole_numbers_on_both_sides_of_a_thousand_are_read_in_groups(tmp_path, decimal, groups):
    """975 and 1.004 beside each other: 1004 with a decimal comma, where 1.004 would be a fall."""
    whole = np.round(FORCE + 400).astype(int)
    path = written(tmp_path / "r.csv", range(T.size), [f"{f:,}".replace(",", groups) for f in whole], ";")
    found = measure(path, RIG | {"time_unit": "ms", "read": {"decimal": decimal}})
    np.testing.assert_allclose(
        found["force"], measure({"t": np.arange(T.size) / 1e3, "F": whole}, RIG)["force"], rtol=1e-6
    )
    assert "column 'F' was read with groups of thousands" in found.attrs["notes"]
    with pytest.raises(
        ss.InputError, match=rf"column 'F': '.*' seems to be .* thousands; write \[read\] decimal = \"{decimal}\""
    ):
        measure(path, RIG | {"time_unit": "ms", "read": {"decimal": groups}})


def test_points_before_three_digits_beside_a_decimal_comma_are_refused(tmp_path):
    path = written(tmp_path / "r.csv", range(T.size), [f"{f / 1000 + 1.5:.3f}" for f in FORCE], ";")
    with pytest.raises(
        ss.InputError, match=r"row 2, column 'F': '2.70.' may be 270. in groups of .* decimal = \".\" in the rig"
    ):
        measure(path, RIG | {"time_unit": "ms", "read": {"decimal": ","}})
    assert measure(path, RIG | {"time_unit": "ms"})["force"].size == T.size


@pytest.mark.parametrize("form", [".3f", ".4g", ".2f"])
def test_decimals_are_no_groups(tmp_path, form):
    path = written(tmp_path / "r.csv", range(T.size), [f"{f / 1000:{form}}" for f in FORCE], ";")
    for decimal in ".", ",":
        found = measure(path, RIG | {"time_unit": "ms", "read": {"decimal": decimal}})
        assert not any("thousands" in note for note in found.attrs["notes"])
