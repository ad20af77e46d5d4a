"""Files with odd layouts, units at the border, and what is refused in which words."""

import json
import re
import struct
from pathlib import Path

import numpy as np
import pytest
from real_records import RIGS
from scipy.io import savemat

import stickslip as ss
from stickslip.files.units import find_unit, quantity
from stickslip.measurement import Layout, Rig, load_rig, measure, read_columns
from stickslip.measurement.instruments import INSTRUMENTS
from stickslip.measurement.read import as_record

N = 80
T = np.arange(N) / 10
X = np.round(np.sin(T), 6)


def spring(**changes: object) -> Rig:
    known: dict[str, object] = {
        "instrument": "displacement",
        "column": 2,
        "time_column": 1,
        "read": Layout(header=False),
    }
    return Rig(stiffness=1, mass=1, drive_velocity=1, **(known | changes))  # type: ignore[arg-type]


def rows(mark: str, end: str = "") -> str:
    return "\n".join(f"{t!r}{mark}{x!r}{end}" for t, x in zip(T.tolist(), X.tolist(), strict=True))


@pytest.mark.parametrize(
    ("content", "changes"),
    [
        (rows(","), {}),
        (rows(" "), {}),
        (rows(", "), {}),
        (rows("\t", "\tN1"), {}),  # words in other columns
        (rows(" ", " "), {}),  # a blank at the end of each line
        (rows(";").replace(".", ","), {"read": Layout(header=False, decimal=",")}),
        (rows(" ").replace(".", ","), {"read": Layout(header=False, decimal=",", delimiter="blank")}),
        ("mass_A\nt,x\n" + rows(","), {"read": Layout(skip_rows=1), "column": "x", "time_column": "t"}),
        ("t,x,,\n" + rows(",", ",,"), {"read": Layout(), "column": "x", "time_column": "t"}),  # columns without a name
        (rows(",") + "\n8.0,", {"read": Layout(header=False, missing="drop")}),
        (rows(",") + "\n8.0", {"read": Layout(header=False, torn_rows="drop")}),
    ],
)
def test_odd_text_gives_the_same_record(tmp_path: Path, content: str, changes: dict[str, object]) -> None:
    (tmp_path / "r.txt").write_text(content)
    record = as_record(tmp_path / "r.txt", spring(**changes))
    np.testing.assert_allclose(record.signal[:N], X)
    np.testing.assert_allclose(record.time[:N], T)


def test_units_of_a_rig_are_turned_to_si() -> None:
    rig = spring(unit="mm", time_unit="ms", rest=2.0)
    record = as_record({"1": 1000 * T, "2": X}, rig)
    np.testing.assert_allclose(record.time, T)
    assert rig.force_unit == 1e-3
    assert find_unit("kip", ("force",), "x")[1] == pytest.approx(4448.22, abs=0.01)
    assert quantity("bore", "1 in", ("length",), "x") == pytest.approx(0.0254)
    assert quantity("speed", "60 rpm", ("angular_speed",), "x") == pytest.approx(2 * np.pi)


@pytest.mark.parametrize(
    ("text", "dimension", "size"),
    [
        ("1 kN/m", "stiffness", 1e3),
        ("1 MN/m", "stiffness", 1e6),
        ("1 kN/mm", "stiffness", 1e6),
        ("1 lbf/in", "stiffness", 175.12683524647636),
        ("1 kNm/deg", "torsional_stiffness", 180e3 / np.pi),
        ("1 N/(mm s)", "stiffness", None),
        ("1 mm/s^2", "acceleration", 1e-3),
        ("1 rev/min", "angular_speed", np.pi / 30),
        ("1 g cm2", "inertia", 1e-7),
        ("1 mm", "stiffness", None),
        ("1 1/s", "frequency", None),  # radians or turns?
        ("1 gf", "force", 9.80665e-3),
        ("3.5 mm", "length", 3.5e-3),
    ],
)
def test_a_unit_may_be_made_of_known_parts(text: str, dimension: str, size: float | None) -> None:
    if size is None:
        with pytest.raises(ss.InputError, match="the unit must be one of"):
            quantity("k", text, (dimension,), "rig")
    else:
        assert quantity("k", text, (dimension,), "rig") == pytest.approx(size, rel=1e-15)


def test_a_window_keeps_what_lies_inside() -> None:
    record = as_record({"1": T, "2": X}, spring(read=Layout(window=(1.0, 7.5))))
    assert record.time[0] == 1.0
    assert record.time[-1] < 7.5


@pytest.mark.parametrize("words", ["overload", "-", "", "range error; stopped; see the log"])
def test_words_outside_the_window_are_nobodys_concern(tmp_path: Path, words: str) -> None:
    lines = rows(";").splitlines()
    lines[3] = f"{T[3]!r};{words}"
    lines[5] = "instrument restarted"
    path = tmp_path / "record.txt"

    def record(window: tuple[float, float], **more: object):
        path.write_text("\n".join(lines))
        return as_record(path, spring(read=Layout(header=False, window=window), **more))

    np.testing.assert_array_equal(record((0.6, 8.0)).signal, X[6:])
    for start, said in ((0.2, "row 4"), (0.4, "row 6")):
        with pytest.raises(ss.InputError, match=f"{said}.*(a number was expected|cells)"):
            record((start, 8.0))
    # Without stamps it is not known how many samples the rows stand for.
    with pytest.raises(ss.InputError, match="row 4"):
        record((0.6, 8.0), time_column=None, sampling_rate=10.0)
    bench = load_rig(
        {
            "instrument": "velocity_steps",
            "columns": {
                "time": {"column": 1, "unit": "s"},
                "displacement": {"column": 3, "unit": "m"},
                "force": {"column": 2, "unit": "N"},
            },
            "read": {"header": False, "window": [0.6, 8.0]},
        }
    )
    path.write_text("\n".join(f"{line};1" for line in lines))
    np.testing.assert_array_equal(INSTRUMENTS[bench.instrument].read(path, bench)["force"], X[6:])


def test_a_window_cuts_a_record_at_its_gap_and_at_bad_rows() -> None:
    t, x = (
        1000 * np.delete(np.arange(200) / 10, slice(120, 150)),
        np.sin(np.delete(np.arange(200) / 10, slice(120, 150))),
    )
    with pytest.raises(ss.InputError) as caught:
        as_record({"1": t, "2": x}, spring(time_unit="ms"))
    found = re.search(r"window = \[(.+), (.+)\] \(in s\)", str(caught.value))
    assert found is not None
    window = float(found[1]), float(found[2])
    record = as_record({"1": t, "2": x}, spring(time_unit="ms", read=Layout(window=window)))
    np.testing.assert_allclose(record.time, np.arange(120) / 10)
    # what lies outside is not checked
    t[130], x[140] = t[129], np.nan
    np.testing.assert_array_equal(
        as_record({"1": t, "2": x}, spring(time_unit="ms", read=Layout(window=window))).signal, record.signal
    )
    x[50] = np.nan
    with pytest.raises(ss.InputError, match="row 50, column '2' is NaN \\(1 such in all\\)"):
        as_record({"1": t, "2": x}, spring(time_unit="ms", read=Layout(window=window)))


def test_repeated_stamps_name_a_way_out() -> None:
    rounded = {"t": np.floor(T), "f": X}
    with pytest.raises(ss.InputError, match="give the rig a sampling_rate and no time column"):
        measure(rounded, LOG)
    with pytest.raises(ss.InputError, match="give the rig a sampling_rate and no time column"):
        as_record({"t": np.floor(T), "x": X}, spring(time_column="t", column="x"))
    table = {"instrument": "displacement", "column": "x", "stiffness": 1, "mass": 1, "drive_velocity": 1}
    rig = load_rig({**table, "sampling_rate": 10})
    assert isinstance(rig, Rig)
    np.testing.assert_allclose(as_record({"t": np.floor(T), "x": X}, rig).time, T)


def test_matlab_cells_are_joined(tmp_path: Path) -> None:
    cells = np.empty((2, 1), dtype=object)
    cells[0, 0], cells[1, 0] = np.stack([X[:40], T[:40]]), np.stack([X[40:], T[40:]])
    savemat(tmp_path / "c.mat", {"Y": cells, "M": np.stack([T, X], axis=1)})
    columns = read_columns(tmp_path / "c.mat")
    np.testing.assert_array_equal(columns["Y(1)"], X)
    np.testing.assert_array_equal(columns["Y(2)"], T)
    np.testing.assert_array_equal(columns["M(2)"], X)


def test_json_rows_are_columns_by_number_or_name(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text(json.dumps({"data": [[t, x] for t, x in zip(T, X, strict=True)], "dt": 0.1}))
    np.testing.assert_array_equal(read_columns(tmp_path / "a.json")["2"], X)
    (tmp_path / "b.json").write_text(json.dumps({"rows": [{"t": t, "x": x} for t, x in zip(T, X, strict=True)]}))
    np.testing.assert_array_equal(read_columns(tmp_path / "b.json", Layout(rows="rows"))["x"], X)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("{", "not a JSON document"),
        ('{"rows": []}', "no list of rows under 'data'; the keys are rows"),
        ('{"data": [[1, 2], [3]]}', "row 2 has 1 cells and row 1 2"),
        ('{"data": [[1, 2], [3, "x"]]}', "row 2, column '2': a number was expected, got 'x'"),
    ],
)
def test_bad_json_is_one_sentence(tmp_path: Path, content: str, words: str) -> None:
    (tmp_path / "a.json").write_text(content)
    with pytest.raises(ss.InputError) as caught:
        read_columns(tmp_path / "a.json")
    assert words in str(caught.value)


def look_file(rows: int = N) -> bytes:
    head = b"run".ljust(20, b"\0") + struct.pack(">iiii", rows, 2, 0, 0)
    for i in range(16):
        name = (b"Time", b"Disp")[i] if i < 2 else b"no_val"
        head += name.ljust(26, b"\0") + bytes(54) + struct.pack(">i", rows if i < 2 else 0)
    return head + np.full(rows, 1000.0, dtype=">f4").tobytes() + X[:rows].astype(">f4").tobytes()


def test_look_file_is_read_and_a_cut_one_refused(tmp_path: Path) -> None:
    (tmp_path / "look").write_bytes(look_file())
    np.testing.assert_allclose(read_columns(tmp_path / "look", Layout(format="look"))["Disp"], X, atol=1e-6)
    (tmp_path / "cut").write_bytes(look_file()[:-8])
    with pytest.raises(ss.InputError, match="truncated; copy it again"):
        read_columns(tmp_path / "cut", Layout(format="look"))


def test_a_real_look_run_has_its_length_and_its_friction(shared_data: Path) -> None:
    from dataclasses import replace

    path = shared_data / "rock_biax_p446" / "p446s7tr005l"
    if not path.exists():
        pytest.skip("no rock_biax_p446 among the real records")
    bench = load_rig(RIGS / "rock_biax_p446.toml")
    whole = INSTRUMENTS[bench.instrument].read(path, replace(bench, read=Layout(format="look")))
    assert len(whole.time) == 149058
    assert whole.time[-1] == pytest.approx(7290.0, abs=1e-3)


def test_constants_of_the_wrong_kind_are_refused() -> None:
    base = {"instrument": "cylinder", "bore": "25 mm", "range": ["8 mm", "30 mm"], "columns": {
        "time": 1, "displacement": 2, "pressure": 3, "force": 4,
    }}  # fmt: skip
    load_rig(base)
    for change, words in (
        ({"bore": "25 bar"}, "rig: bore: the unit must be one of m, cm, mm"),
        ({"bore": "25"}, "rig: bore = '25' has no unit"),
        ({"bore": "wide mm"}, "bore must be a number or a text such as \"1.5 m\", got 'wide mm'"),
        ({"range": ["30 mm", "8 mm"]}, "range must be [lowest, highest]"),
        ({"range": 8}, "range must be a list of two"),
        ({"boar": 1}, "unknown key 'boar' (did you mean 'bore'?)"),
        ({"columns": {"time": 1}}, "[columns] lacks displacement; a cylinder instrument needs it"),
        ({"columns": {**base["columns"], "force": {"column": 4, "unit": "bar"}}}, "the unit must be one of N, mN"),
        ({"columns": {**base["columns"], "force": {"column": 4, "units": "N"}}}, "did you mean 'unit'"),
        ({"columns": {"displacement": 2, "pressure": 3, "force": 4}}, "[columns] lacks time; name its column or give"),
        ({"read": {"delimiter": "blanks"}}, "delimiter must be one of tab, comma, semicolon, blank"),
        ({"read": {"window": [2, 1]}}, "window must be [start, end] with start < end"),
        ({"instrument": "cilinder"}, "did you mean 'cylinder'"),
        ({"sampling_rate": 0}, "sampling_rate must be a positive number"),
    ):
        with pytest.raises(ss.InputError) as caught:
            load_rig({**base, **change})
        assert words in str(caught.value)
        assert "\n" not in str(caught.value)


LOG = {"instrument": "force_log", "least_drop": 0.3, "columns": {"time": "t", "force": "f"}}


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"t": T, "f": np.where(T == 3, np.nan, X)}, "row 30, column 'f' is NaN (1 such in all)"),
        ({"t": np.where(T == 3, T[29], T), "f": X}, "row 30, column 't' repeats the time stamp 2.9"),
        ({"t": np.where(T == 3, 0.0, T), "f": X}, "row 30, column 't' goes back in time to 0"),
        ({"t": T, "force": X}, "there is no column 'f'"),
        ({"t": T[:9], "f": X[:9]}, "9 usable samples are too short a record"),
        ({"t": T, "f": X[:-1]}, "column 'f' has 79 rows and 't' has 80"),
    ],
)
def test_bad_records_of_other_gauges_are_one_sentence(columns: dict[str, np.ndarray], words: str) -> None:
    with pytest.raises(ss.InputError) as caught:
        measure(columns, LOG)
    assert words in str(caught.value)


def test_a_list_of_records_needs_a_gauge_that_compares_runs() -> None:
    with pytest.raises(ss.InputError, match="measures one record at a time, got 2"):
        measure([{"x": X}, {"x": X}], spring())
    with pytest.raises(ss.InputError, match="got an empty list"):
        measure([], LOG)
