"""Wrong records and rigs through the command line: one sentence, exit code 2, nothing written."""

import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

import stickslip as ss
from stickslip.cli.main import main
from stickslip.errors import InputError
from stickslip.measurement import Layout, load_rig, measure
from stickslip.measurement.read import read_table

N = 200
T = np.arange(N) / 100
X = np.sin(10 * T)
SPRING = """instrument = "displacement"
column = "x"
unit = "m"
stiffness = 1.0
mass = 1.0
drive_velocity = 20.0
"""
OTHERS = {
    "direct_force": ("", {"time": "t", "velocity": "x", "force": "f"}),
    "cylinder": (
        'bore = "25 mm"\nrange = ["8 mm", "30 mm"]\n',
        {"time": "t", "displacement": "x", "pressure": "p", "force": "f"},
    ),
    "velocity_steps": ("", {"time": "t", "displacement": "x", "force": "f"}),
    "free_decay": ("restoring_torque = 1.0\n", {"time": "t", "angle": "x"}),
    "torque_observer": ("", {"time": "t", "velocity": "x", "torque": "f"}),
    "motor_current": ("force_per_current = 1.0\n", {"time": "t", "current": "f", "displacement": "x"}),
}


def rows(t=T, x=X, mark=",") -> str:
    f, p = np.cos(T[: len(t)]), -np.ones(len(t))
    lines = (f"{a:.6g}{mark}{b:.6g}{mark}{c:.6g}{mark}{d:g}" for a, b, c, d in zip(t, x, f, p, strict=True))
    return mark.join("txfp") + "\n" + "\n".join(lines) + "\n"


def cell(row: int, column: int, text: str) -> bytes:
    lines = rows().splitlines()
    cells = lines[row].split(",")
    cells[column] = text
    lines[row] = ",".join(cells)
    return "\n".join(lines).encode()


def other(instrument: str, **changes: str) -> str:
    constants, columns = OTHERS[instrument]
    given = {name: f'"{column}"' for name, column in columns.items()} | changes
    return f'instrument = "{instrument}"\n{constants}[columns]\n' + "".join(
        f"{name} = {text}\n" for name, text in given.items()
    )


def said(tmp_path: Path, capsys, record: bytes, rig: str, name: str = "r.csv") -> str:
    (tmp_path / name).write_bytes(record)
    (tmp_path / "rig.toml").write_text(rig)
    out = tmp_path / "f.nc"
    assert main(["measure", str(tmp_path / name), "--rig", str(tmp_path / "rig.toml"), "-o", str(out)]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert not out.exists()
    sentence = said.err.strip()
    assert "\n" not in sentence
    assert "Traceback" not in sentence
    return sentence


@pytest.mark.parametrize(
    ("record", "words"),
    [
        (cell(50, 1, "nan"), "r.csv: row 51, column 'x' is NaN"),
        (cell(50, 1, "inf"), "r.csv: row 51, column 'x' is infinity"),
        (cell(50, 1, "1e400"), "r.csv: row 51, column 'x' is infinity"),
        (cell(50, 1, "1e300"), "r.csv: row 51, column 'x' is 1e+300, which no instrument reads"),
        (cell(50, 1, ""), "r.csv: row 51, column 'x': a number was expected, got ''"),
        (cell(50, 1, "abc"), "r.csv: row 51, column 'x': a number was expected, got 'abc'"),
        (cell(50, 1, "1_0"), "r.csv: row 51, column 'x': a number was expected, got '1_0'"),
        (cell(50, 1, '"0.1'), "r.csv: row 51, column 'x': a number was expected, got '\"0.1'"),
        (cell(50, 1, "0.1,5"), "r.csv: row 51 has 5 cells and the header 4"),
        (cell(50, 0, "0.48"), "r.csv: row 51, column 't' repeats the time stamp 0.48"),
        (cell(50, 0, "0.1"), "r.csv: row 51, column 't' goes back in time to 0.1"),
        (
            rows(np.where(T < 0.495, T, T + 3)).encode(),
            "row 52, column 't': a step of 3.01 s where the record has 0.01 s",
        ),
        (rows(10 ** (T - 1)).encode(), "the time stamps leave gaps for "),
        (rows().replace(",", ";").replace(".", ",").encode(), '[read] decimal = "," reads decimal commas'),
        (rows(x=0 * X).encode(), "column 'x' is constant"),
        (rows(T[:20], X[:20]).encode(), "20 samples are too short a record"),
        (rows().replace("x", "y", 1).encode(), "there is no column 'x'; the columns are t, y, f, p"),
        (
            b"Rig 12\n2026\n" + rows().encode(),
            "row 1 was read as the header, and row 3 names t, x; write [read] skip_rows = 2 in the rig",
        ),
        (
            b"Rig 12;2026\n" + rows().replace(",", ";").replace(".", ",").encode(),
            'row 2 names t, x; write [read] skip_rows = 1 and decimal = "," in the rig',
        ),
        (b"sep=,\n" + rows().encode(), "row 2 names t, x; write [read] skip_rows = 1"),
        (rows().replace("x", "x raw", 1).encode(), "there is no column 'x' (did you mean 'x raw'?)"),
        (
            rows(1000 * T).encode(),
            "samples are 10 s apart, and by the rig's stiffness and mass the free mass swings once in",
        ),
        (
            rows(x=1e3 * X).encode(),
            "rises at 7.36e+03 m/s between two falls, and the drive that drags the mass goes at 20",
        ),
        (rows(x=1e90 * X).encode(), "correct the unit, the drive_velocity or the stiffness in the rig"),
        (rows(x=1e-200 * X).encode(), "column 'x' is constant"),
        (b"", "the file is empty"),
        (b"t,x,f,p\n", "a header line and rows of numbers were expected"),
        (bytes(range(256)) * 9, "holds binary bytes"),
        (json.dumps({"data": [[1, 2]] * 99}).encode(), "r.csv"),
    ],
)
def test_a_wrong_record_is_one_sentence_with_its_place(tmp_path, capsys, record: bytes, words: str) -> None:
    assert words in said(tmp_path, capsys, record, SPRING)


@pytest.mark.parametrize("coding", ["utf-8-sig", "utf-16", "utf-16-le", "latin-1"])
def test_other_codings_and_a_row_of_units_are_read(tmp_path, coding: str) -> None:
    plain, named = tmp_path / "r.csv", tmp_path / "u.csv"
    plain.write_text(rows())
    named.write_bytes(rows().replace("\n", "\ns,µm,N,\n", 1).encode(coding))
    layout = Layout()
    read, expected = read_table(named, layout, ["t", "x"]), read_table(plain, layout, ["t", "x"])
    np.testing.assert_array_equal(read.columns["x"], expected.columns["x"])
    assert read.notes == ("row 2 has no number in it (s, µm, N): it was taken for units",)
    assert read.row(0) == 3


@pytest.mark.long
def test_the_position_of_a_pulled_slider_is_no_stretch_of_a_spring() -> None:
    law = ss.laws.StaticKinetic(1.0, 0.6)
    t = np.arange(0, 60, 0.02)
    stretch = ss.simulate(ss.Oscillator(damping=0.0, drive_velocity=0.1, law=law), 60).at(t)[0]
    noise = 1e-4 * np.random.default_rng(4).standard_normal(t.size)
    rig = {"instrument": "displacement", "column": "x", "unit": "1", "mass": 1, "stiffness": 1, "drive_velocity": 0.1}
    notes = ss.measure({"t": t, "x": 0.1 * t - stretch + noise}, rig).attrs["notes"]
    assert any("it is that of a slider that is pulled; record the stretch" in note for note in notes)
    notes = ss.measure({"t": t, "x": stretch + noise}, rig).attrs["notes"]
    assert not any("slider that is pulled" in note for note in notes)


def test_a_mass_that_overtakes_its_drive_is_said() -> None:
    rig = load_rig(tomllib.loads(SPRING) | {"drive_velocity": 5.0, "stiffness": 100.0})
    notes = measure({"t": T, "x": X}, rig).attrs["notes"]
    assert any("the mass overtakes the drive for 35 % of the time, by up to 1 V" in note for note in notes)


@pytest.mark.parametrize("factor", [1000.0, pytest.param(1.5, marks=pytest.mark.long), 0.2])
def test_a_drive_velocity_that_contradicts_the_sticks_is_said(factor: float) -> None:
    t = np.arange(0, 8, 0.004)
    slider = ss.Oscillator(1.0, 0.05, ss.laws.StaticKinetic(6.0, 4.0), mass=1.2, stiffness=600.0)
    noise = 2e-5 * np.random.default_rng(1).standard_normal(t.size)
    sticking = ss.simulate(slider, 10.0).at(2 + t)[0] + noise
    rig = {
        "instrument": "displacement",
        "column": "x",
        "unit": "m",
        "time_column": "t",
        "mass": 1.2,
        "stiffness": 600.0,
    }
    rig |= {"damping": 1.0, "drive_velocity": 0.05 * factor}
    notes = ss.measure({"t": t, "x": sticking}, rig).attrs["notes"]
    found = re.search(r"if the drive moves at (\S+) m/s: correct drive_velocity", notes[0])
    assert float(found[1]) == pytest.approx(0.05, rel=0.01)
    # A sine has a steepest slope too, and rests nowhere.
    swinging = 0.002 * np.sin(22.36 * t) + noise
    assert not any("if the drive moves" in note for note in ss.measure({"t": t, "x": swinging}, rig).attrs["notes"])


@pytest.mark.parametrize(
    ("name", "words"), [("r.mat", "MATLAB v5"), ("r.json", "JSON document"), ("r.nc", "netCDF file")]
)
def test_a_wrong_ending_is_said(tmp_path, capsys, name: str, words: str) -> None:
    assert f"{name}: not a" in (sentence := said(tmp_path, capsys, rows().encode(), SPRING, name))
    assert words in sentence


def test_a_matlab_file_named_csv_is_refused(tmp_path, capsys) -> None:
    savemat(tmp_path / "r.mat", {"t": T, "x": X})
    assert "neither text nor a .mat file" in said(tmp_path, capsys, (tmp_path / "r.mat").read_bytes(), SPRING)


@pytest.mark.parametrize(
    ("rig", "words"),
    [
        (SPRING.replace('"m"', '"bar"'), "unit of a displacement record must be one of m, 1, cm"),
        (SPRING.replace("mass = 1.0", "mass = -1"), "mass must be a positive number, got -1"),
        (
            SPRING.replace("mass = 1.0", 'mass = "1 N"'),
            "mass: the unit must be one of kg, g, lb, kg m^2, kg cm^2, got 'N'",
        ),
        (SPRING + "stifness = 1\n", "unknown key 'stifness' (did you mean 'stiffness'?)"),
        (SPRING.replace('"displacement"', "displacement"), "not a TOML document"),
        ("", "instrument is missing"),
        (other("direct_force", force='{ column = "f", unit = "mm" }'), "force: the unit must be one of N, mN"),
        (other("direct_force", force='{ column = "f", valid = 3 }'), "valid must be a list of two readings"),
        (
            other("direct_force", force='{ column = "f", resets = [1, 2] }'),
            "resets[0] must be a list of 2 whole numbers",
        ),
        (other("direct_force", force='{ column = "f", scale = "big" }'), "scale must be a number, got 'big'"),
        (other("direct_force", force='{ column = "f", zero_row = 1.5 }'), "zero_row must be the number of a row"),
        (other("direct_force", force='{ column = "f", zero_row = 9999 }'), "zero_row must be 0 to 199, got 9999"),
        (other("direct_force", force='"t"'), "column 't' is that of time already"),
        (other("direct_force", force="9"), "there is no column 9; the file has 4"),
        ("bins = 2.5\n" + other("direct_force"), "bins must be a whole number of at least 1, got 2.5"),
        ("cutoff = -1\n" + other("direct_force"), "cutoff must be a positive number, got -1"),
        (other("cylinder").replace("25 mm", "0 mm"), "bore must be a positive number, got '0 mm'"),
        (other("cylinder"), "no whole stroke lies within range = [0.008, 0.03] m"),
        ("settle = 5\n" + other("velocity_steps"), "settle must be a number above 0 and of at most 1, got 5"),
        ("settle = 1\n" + other("torque_observer"), "1 samples are left after settle = 1 of the record"),
        (other("free_decay").replace("1.0", "-1.0"), "restoring_torque must be a positive number, got -1.0"),
    ],
)
def test_a_wrong_rig_is_one_sentence(tmp_path, capsys, rig: str, words: str) -> None:
    assert words in said(tmp_path, capsys, rows().encode(), rig)


@pytest.mark.parametrize(
    ("instrument", "words"),
    [
        ("direct_force", "nothing moves in this record"),
        ("velocity_steps", "no stretch of constant speed"),
        ("torque_observer", "the joint stands still"),
        ("motor_current", "0 samples move faster than least_speed"),
        ("free_decay", "0 turning points are too few for a decay"),
    ],
)
def test_a_record_in_which_nothing_moves_is_refused(tmp_path, capsys, instrument: str, words: str) -> None:
    assert words in said(tmp_path, capsys, rows(x=0 * X).encode(), other(instrument))


def test_pressures_around_zero_are_measured(tmp_path, capsys) -> None:
    # a suction of 1 Pa on every run: neither an endless search for repetitions nor a refusal
    (tmp_path / "rig.toml").write_text(other("cylinder"))
    records = [tmp_path / "r.csv", tmp_path / "s.csv"]
    for path, shift in zip(records, (0.02, 0.0201), strict=True):
        path.write_text(rows(x=shift + 0.015 * X))
    assert main(["measure", *map(str, records), "--rig", str(tmp_path / "rig.toml")]) == 0
    assert "over 2 runs repeated at one pressure" in capsys.readouterr().out


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "latin-1"])
def test_headers_of_older_instruments_are_read(tmp_path, capsys, encoding: str) -> None:
    (tmp_path / "rig.toml").write_text(SPRING)
    (tmp_path / "r.csv").write_bytes(rows().replace("p", "µm", 1).encode(encoding))
    assert main(["measure", str(tmp_path / "r.csv"), "--rig", str(tmp_path / "rig.toml"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["regime"] == "almost_harmonic"


def test_a_spring_rig_takes_its_numbers_with_units(tmp_path, capsys) -> None:
    for stiffness, speed in (("1000.0", "0.02"), ('"1 N/mm"', '"2 cm/s"')):
        rig = SPRING.replace("stiffness = 1.0", f"stiffness = {stiffness}").replace("= 20.0", f"= {speed}")
        (tmp_path / "rig.toml").write_text(rig)
        (tmp_path / "r.csv").write_text(rows(x=1e-3 * X))
        assert main(["measure", str(tmp_path / "r.csv"), "--rig", str(tmp_path / "rig.toml"), "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["stiffness"] == pytest.approx(1000, rel=0.1)


@pytest.mark.parametrize(
    ("content", "words"),
    [(b"", "not a netCDF file"), (b"\x89HDF" * 50, "not a netCDF file"), (b"t,x\n1,2\n", "not a netCDF file")],
)
def test_a_friction_file_that_is_none_is_refused(tmp_path, capsys, content: bytes, words: str) -> None:
    (tmp_path / "f.nc").write_bytes(content)
    assert main(["identify", str(tmp_path / "f.nc")]) == 2
    assert words in capsys.readouterr().err
    assert main(["identify", str(tmp_path)]) == 2
    assert "this is a folder" in capsys.readouterr().err


CHAIN = {"instrument": "displacement", "column": "x", "unit": "1", "mass": 1, "drive_velocity": 0.2}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"stiffness": [[2, -1], [-1]]}, "a square matrix"),
        ({"stiffness": [[2, -1], [-0.5, 2]]}, "must be symmetric"),
        ({"stiffness": [[2, -1], [-1, 2]], "damping": [[0.1]]}, "a 2 x 2 matrix like stiffness"),
        ({"stiffness": [[2, -1], [-1, 2]], "rest": [0, 1, 2]}, "rest must be one number or 2"),
        ({"stiffness": [[2, -1], [-1, 2]], "instrument": "spring_force"}, 'needs instrument = "displacement"'),
        ({"stiffness": [[2, -1], [-1, 2]], "mass": [1, 0]}, "mass must be a positive number"),
    ],
)
def test_a_rig_of_several_masses_that_cannot_be_is_refused(change, said):
    with pytest.raises(InputError, match=said):
        load_rig(CHAIN | change)


def test_a_rig_of_several_masses_needs_the_motion_of_all_of_them():
    time = np.linspace(0, 40, 400)
    rig = CHAIN | {"stiffness": [[2, -1], [-1, 2]]}
    with pytest.raises(InputError, match="the rig has 2 masses that pull on each other, got a record of one"):
        measure({"t": time, "x": np.sin(time)}, rig)
