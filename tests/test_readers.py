"""Files that are damaged, or made to do harm: nothing but one sentence comes of them; what is whole is read to the bit."""

import struct
import subprocess
import sys
import zlib
from pathlib import Path

import h5netcdf
import numpy as np
import pytest
import xarray as xr
from evidence import script
from scipy.io import loadmat, savemat

import stickslip as ss
from stickslip.files import child_process
from stickslip.files.netcdf import read_tree
from stickslip.measurement import Layout, Rig, load_rig, measure, read_columns
from stickslip.measurement.read import as_record, open_motion
from stickslip.tracking.video.source import read_picture

readers = script("readers")
#: More of what is read quickly; the page of a long run is docs/evidence/readers.md.
GATE = {"motion": 4, "orbit": 4, "friction": 4, "film": 4, "picture": 30, "tracker": 30}


@pytest.mark.parametrize("name", readers.TARGETS)
def test_damaged_inputs_are_read_or_refused_in_one_sentence(name):
    outcomes = []
    readers.several(name, 3, 0, GATE.get(name, 200), lambda *told: outcomes.append(told))
    assert [told for told in outcomes if told[0] not in ("read", "refused")] == []


@pytest.mark.parametrize("name", readers.TARGETS)
def test_whole_inputs_are_read(name, monkeypatch):
    monkeypatch.setattr(readers, "spoil_bytes", lambda data, _: data)
    monkeypatch.setattr(readers, "spoil_document", lambda document, _: document)
    outcomes = []
    readers.several(name, 0, 0, GATE.get(name, 10), lambda *told: outcomes.append(told[0]))
    assert "read" in outcomes


@pytest.mark.slow
def test_a_million_damaged_inputs(tmp_path):
    page = tmp_path / "page.md"
    subprocess.run([sys.executable, readers.__file__, "--each", "45000", "--seed", "4", "-o", page], check=True)
    rows = [line.split("|") for line in page.read_text(encoding="utf-8").splitlines() if line.startswith("| ")][1:]
    assert int(rows[-1][2]) > 1_000_000
    assert [row[1] for row in rows if int(row[5])] == []


def test_the_check_of_readers_can_fail(monkeypatch):
    def broken(*_):
        raise KeyError("unseen")

    monkeypatch.setitem(readers.TARGETS, "look", readers.Target(readers.whole_inputs.looks, ".look", broken))
    outcomes = []
    readers.several("look", 1, 0, 2, lambda *told: outcomes.append(told[0]))
    assert outcomes == ["KeyError", "KeyError"]


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("import os; os.abort()", "it ends the process that reads it"),
        ("import faulthandler; faulthandler._sigsegv()", "it ends the process that reads it"),
        ("import sys; sys.exit()", "it ends the process that reads it"),
        ("raise KeyError('no such thing')", "no such thing"),
        ("__builtins__ = __spec__ = __loader__ = None\nanswer = 42", None),
        pytest.param(
            "bytearray(1 << 40)",
            "more memory than such a file needs",
            marks=pytest.mark.skipif(sys.platform != "linux", reason="only Linux refuses memory to a process"),
        ),
    ],
)
def test_what_a_reader_does_to_its_process_is_a_sentence(code, words, tmp_path):
    (tmp_path / "file").write_text(code)
    for _ in range(2):
        if words is None:
            assert child_process.read_apart("runpy:run_path", tmp_path / "file", "thing")["answer"] == 42
            continue
        with pytest.raises(
            ss.InputError, match=f"file: not a thing, or a truncated or damaged one .*{words}"
        ) as refusal:
            child_process.read_apart("runpy:run_path", tmp_path / "file", "thing")
        assert "\n" not in str(refusal.value)


def test_paths_are_those_of_the_folder_in_which_one_is(tmp_path, monkeypatch):
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "file").write_text(f"__builtins__ = __spec__ = __loader__ = None\nanswer = {name!r}")
        monkeypatch.chdir(tmp_path / name)
        assert child_process.read_apart("runpy:run_path", Path("file"), "thing")["answer"] == name


def test_a_reader_that_hangs_is_ended(tmp_path, monkeypatch):
    monkeypatch.setattr(child_process, "PATIENCE", 0.2)
    (tmp_path / "file").write_text("import time; time.sleep(1000)")
    with pytest.raises(ss.InputError, match=r"not read within 0 s"):
        child_process.read_apart("runpy:run_path", tmp_path / "file", "thing")


def test_a_small_file_that_declares_all_memory_is_refused(tmp_path):
    with h5netcdf.File(tmp_path / "bomb.nc", "w") as file:
        file.dimensions = {"t": 10**11}
        file.create_variable("x", ("t",), "f8", chunks=(1000,))
    assert (tmp_path / "bomb.nc").stat().st_size < 20_000
    with pytest.raises(ss.InputError, match=r"declares 800 GB of numbers, expected at most 1\.07 GB"):
        open_motion(tmp_path / "bomb.nc")


def test_a_small_picture_that_claims_all_memory_is_refused(tmp_path):
    def png(width, height):
        def chunk(kind, data):
            return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

        head = struct.pack(">2I5B", width, height, 1, 0, 0, 0, 0)
        rows = zlib.compress(bytes((width // 8 + 1) * height))
        return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")

    (tmp_path / "large.png").write_bytes(png(16_000, 10_000))
    assert (tmp_path / "large.png").stat().st_size < 109_000
    with pytest.raises(ss.InputError, match="at most 134 million pixels"):
        read_picture(tmp_path / "large.png")
    (tmp_path / "small.png").write_bytes(png(160, 100))
    assert read_picture(tmp_path / "small.png").shape == (100, 160, 3)


def test_what_is_read_apart_is_what_xarray_reads(tmp_path):
    for i, name in enumerate(("orbit", "friction", "motion")):
        path = tmp_path / f"{i}.nc"
        path.write_bytes(readers.inputs_of(name)[-1])
        with xr.open_datatree(path, engine="h5netcdf") as tree:
            xr.testing.assert_identical(read_tree(path), tree.load())


def test_an_orbit_in_which_a_bit_has_changed_is_refused(tmp_path):
    path = ss.simulate(ss.paper.oscillator(0.2), t_end=30).save(tmp_path / "orbit.nc")
    with h5netcdf.legacyapi.Dataset(path, "a") as file:
        x = file["segments"]["x"]
        x[3] = np.nextafter(x[3], 9)
    with pytest.raises(ss.InputError, match="it is not the orbit that was saved"):
        ss.load(path)


MATLAB = {
    "column": np.arange(9.0)[:, None],
    "row": np.arange(9, dtype="i2"),
    "short": np.arange(3, dtype="u1"),
    "signals": np.random.default_rng(1).normal(size=(50, 3)),
    "flags": np.array([True, False, True]),
    "words": "MPa",
}


@pytest.mark.parametrize("options", [{}, {"do_compression": True}, {"format": "4"}, {"long_field_names": True}])
def test_matlab_files_are_read_as_by_the_library(options, tmp_path):
    given = {key: value for key, value in MATLAB.items() if options.get("format") != "4" or key != "flags"}
    savemat(tmp_path / "r.mat", given, **options)
    known, found = loadmat(tmp_path / "r.mat"), read_columns(tmp_path / "r.mat")
    for name in ("column", "row", "short"):
        np.testing.assert_array_equal(found[name], known[name].ravel())
    for i in range(3):
        np.testing.assert_array_equal(found[f"signals({i + 1})"], known["signals"][:, i])
    assert "words" not in found


def test_a_matlab_variable_that_hides_those_behind_it_is_refused(tmp_path):
    savemat(tmp_path / "r.mat", {"t": np.arange(9.0), "x": np.arange(9.0)})
    content = bytearray((tmp_path / "r.mat").read_bytes())
    content[134] = 1  # the first says that it has 65536 bytes more
    (tmp_path / "r.mat").write_bytes(content)
    with pytest.raises(ss.InputError, match=r"r\.mat: not a whole MATLAB v5 file.*it ends within a variable"):
        read_columns(tmp_path / "r.mat")


def test_real_matlab_files_are_read_as_by_the_library(shared_data):
    for path in shared_data.rglob("*.mat"):
        known = loadmat(path)
        for name, column in read_columns(path).items():
            if name in known and known[name].dtype != object:
                np.testing.assert_array_equal(column, known[name].ravel())


def test_fields_of_structures_are_columns_and_segments_are_taken_one_by_one(tmp_path):
    t, x = np.arange(200) / 100, np.sin(np.arange(200) / 10)
    parts = np.array(
        [(t, x, x / 5), (t, 2 * x, x / 5), (t[:100], x[:100], x[:100])], [(n, object) for n in ("t", "x", "mu")]
    )
    savemat(tmp_path / "r.mat", {"run": parts, "info": {"unit": "MPa", "area": 25.0}})
    assert {name: len(column) for name, column in read_columns(tmp_path / "r.mat").items()} == dict.fromkeys(
        ("run.t", "run.x", "run.mu"), 500
    )
    rig = {"instrument": "displacement", "column": "run.x", "time_column": "run.t", "unit": "1"}
    rig |= {"stiffness": 1.0, "mass": 1.0, "drive_velocity": 20.0}
    with pytest.raises(ss.InputError, match=r"goes back in time to 0 .*\[read\] segment = 1 to 3 takes one part"):
        as_record(tmp_path / "r.mat", Rig(**rig))
    record = as_record(tmp_path / "r.mat", Rig(**rig, read=Layout(segment=2)))
    np.testing.assert_array_equal(record.signal, 2 * x)
    np.testing.assert_array_equal(record.time, t)
    with pytest.raises(ss.InputError, match=r"has 3 segment\(s\), and the rig says \[read\] segment = 4"):
        as_record(tmp_path / "r.mat", Rig(**rig, read=Layout(segment=4)))
    columns = {"time": "run.t", "velocity": "run.x", "force": {"column": "run.mu", "unit": "MPa"}}
    bench = {"instrument": "direct_force", "columns": columns, "read": {"segment": 1}}
    friction = measure(tmp_path / "r.mat", load_rig(bench))
    assert friction["force"].attrs["units"] == "Pa"
    assert float(friction["time"][-1]) == t[-1]


def test_a_look_file_of_32_column_heads_is_read_and_other_lengths_are_refused(tmp_path):
    for i, content in enumerate(readers.whole_inputs.looks()):
        path = tmp_path / f"{i}.look"
        path.write_bytes(content)
        columns = read_columns(path, Layout(format="look"))
        np.testing.assert_array_equal(columns["x"], readers.whole_inputs.X.astype("f4"))
        path.write_bytes(content + bytes(4))
        with pytest.raises(
            ss.InputError, match="the header promises columns of 120 rows, 2340 or 3684 bytes with 16 or 32"
        ):
            read_columns(path, Layout(format="look"))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"unit": ["m"]}, r"unit must be a text, got \['m'\]"),
        ({"time_unit": ["s"]}, r"time_unit must be a text, got \['s'\]"),
        ({"mass": 10**400}, "mass must be a finite number, got inf"),
        ({"read": {"rows": ["data"]}}, r"rows must be a text, got \['data'\]"),
        ({"read": {"segment": 0}}, "segment must be a whole number of at least 1, got 0"),
    ],
)
def test_a_rig_with_a_list_for_a_word_is_refused(change, words):
    with pytest.raises(ss.InputError, match=words):
        load_rig(readers.reading.RIG | change)


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (
            {"type": "Cubic", "static": 0.4, "linear": 1e308, "cubic": 0.6},
            "linear must be 0 or lie between 1e-100 and 1e",
        ),
        ({"type": "PiecewiseLinear", "nodes": [[0, 1], [1e-300, 2]], "break_away": 1}, r"nodes\[1\]\[0\] .* 1e-300"),
        ({"type": "Lorentzian", "break_away": 1, "kinetic": 0.5, "scale": 5e-324}, "scale must be 0 or lie"),
    ],
)
def test_numbers_of_which_no_force_can_be_made_are_refused(law, words):
    with pytest.raises(ss.InputError, match=words):
        ss.laws.Law.from_dict(law)
