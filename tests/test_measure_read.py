"""Records that are read, and records that are refused with the place of the fault."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy.io import savemat

from stickslip.errors import InputError
from stickslip.measurement import Rig, load_rig, measure, read_columns
from stickslip.measurement.read import as_record

RIG = Rig(instrument="displacement", column="x", unit="m", stiffness=1, mass=1, drive_velocity=1)
T = np.arange(200) / 100
X = np.sin(T)


def columns(**changes: object) -> dict[str, object]:
    return {"t": T.copy(), "x": X.copy(), **changes}


def with_value(values: np.ndarray, row: int, value: float) -> np.ndarray:
    changed = values.copy()
    changed[row] = value
    return changed


def test_all_kinds_of_source_give_the_same_record(tmp_path: Path) -> None:
    savemat(tmp_path / "r.mat", {"t": T[:, None], "x": X[:, None], "name": "slider"})
    frame = pd.DataFrame({"t": T, "x": X})
    frame.to_csv(tmp_path / "comma.csv", index=False)
    frame.to_csv(tmp_path / "tab.txt", index=False, sep="\t")
    (tmp_path / "space.txt").write_text("# a rig\nt x\n" + "\n".join(f"{a!r} {b!r}" for a, b in zip(T, X, strict=True)))
    (tmp_path / "space.txt").write_text(
        (tmp_path / "space.txt").read_text().replace("np.float64(", "").replace(")", "")
    )
    data = xr.Dataset({"x": ("t", X)}, coords={"t": T})
    sources = [tmp_path / name for name in ("r.mat", "comma.csv", "tab.txt", "space.txt")]
    for source in [*sources, str(sources[0]), frame, frame.set_index("t"), data, columns()]:
        record = as_record(source, RIG)
        np.testing.assert_array_equal(record.signal, X)
        np.testing.assert_allclose(record.time, T)


def test_names_behind_a_comment_mark_are_the_header(tmp_path: Path) -> None:
    table = np.stack([T, X], axis=1)
    np.savetxt(tmp_path / "numpy.csv", table, delimiter=",", header="a rig\nt,x")
    np.testing.assert_array_equal(as_record(tmp_path / "numpy.csv", RIG).signal, X)
    np.savetxt(tmp_path / "words.txt", table, delimiter=";", header="t (s); the slide (mm)")
    assert list(read_columns(tmp_path / "words.txt")) == ["t (s)", "the slide (mm)"]
    np.savetxt(tmp_path / "note.csv", table, delimiter=",", header="two, columns, of numbers")
    with pytest.raises(InputError, match="row 2 holds numbers where a header line with column names was expected"):
        read_columns(tmp_path / "note.csv")


def test_a_unit_behind_a_name_is_no_part_of_it_and_must_be_that_of_the_rig(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    pd.DataFrame({"Zeit [ms]": 1000 * T, "Weg [mm]": X, "Weg roh [A]": X}).to_csv(path, index=False)

    def rig(**changes: object) -> Rig:
        given = {"column": "Weg", "unit": "mm", "time_column": "Zeit", "time_unit": "ms"} | changes
        return Rig(instrument="displacement", stiffness=1, mass=1, drive_velocity=1, **given)  # type: ignore[arg-type]

    record = as_record(path, rig())
    np.testing.assert_array_equal(record.signal, X)
    np.testing.assert_allclose(record.time, T)
    with pytest.raises(InputError, match=r"'Weg \[mm\]' is in mm and the rig says m; write unit = \"mm\" in the rig"):
        as_record(path, rig(unit="m"))
    with pytest.raises(InputError, match=r"'Zeit \[ms\]' is in ms and the rig says s; write time_unit = \"ms\""):
        as_record(path, rig(time_unit="s"))
    # A reading in ampere has another unit than what a scale makes of it.
    np.testing.assert_array_equal(as_record(path, rig(column="Weg roh", scale=2.0)).signal, X)
    np.testing.assert_array_equal(as_record({"time [s]": T, "x [m]": X}, RIG).time, T)


def test_a_channel_without_a_unit_has_that_of_its_name(tmp_path: Path) -> None:
    path, rig = tmp_path / "log.csv", tmp_path / "rig.toml"
    speed = np.linspace(0.01, 0.1, 200)
    pd.DataFrame({"t (s)": T, "v (mm/s)": 1000 * speed, "F (kN)": np.full(200, 0.003)}).to_csv(path, index=False)
    rig.write_text('instrument = "direct_force"\n[columns]\ntime = "t"\nvelocity = "v"\nforce = "F"\n')
    data = measure(path, load_rig(rig))
    np.testing.assert_allclose(data["force"], 3.0)
    np.testing.assert_allclose(data["slip_velocity"], speed)
    rig.write_text(rig.read_text().replace('"F"', '{ column = "F", unit = "N" }'))
    with pytest.raises(InputError, match=r"'F \(kN\)' is in kN and the rig says N; write unit = \"kN\" for force"):
        measure(path, load_rig(rig))


def test_time_from_the_sampling_rate() -> None:
    rig = Rig(
        instrument="displacement", column="x", stiffness=1, mass=1, drive_velocity=1, time_column=None, sampling_rate=50
    )
    assert as_record({"x": X}, rig).step == pytest.approx(0.02)


@pytest.mark.parametrize(
    ("record", "words"),
    [
        (columns(x=with_value(X, 7, np.nan)), "row 7, column 'x' is NaN"),
        (columns(x=with_value(X, 7, np.inf)), "row 7, column 'x' is infinity"),
        (columns(t=with_value(T, 9, T[8])), "row 9, column 't' repeats the time stamp 0.08"),
        (columns(t=with_value(T, 9, 0.0)), "row 9, column 't' goes back in time"),
        (columns(t=np.where(np.arange(200) > 50, T + 3, T)), "row 51, column 't': a step of 3.01 s"),
        (columns(x=np.full(200, np.nan)), "row 0, column 'x' is NaN (200 such in all)"),
        (columns(t=T[:-1]), "column 't' has 199 rows and 'x' has 200"),
        ({"t": T, "y": X}, "there is no column 'x'; the columns are t, y"),
        (
            {"x": X},
            "there is no column 't'; the columns are x; name the one of time by time_column, or give a sampling_rate",
        ),
        ({"t": T[:20], "x": X[:20]}, "20 samples are too short a record"),
        (3.0, "a path, a Dataset, a DataFrame or a dict of arrays was expected, got float"),
    ],
)
def test_bad_record_is_one_sentence(record: object, words: str) -> None:
    with pytest.raises(InputError) as caught:
        as_record(record, RIG)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_sampling_rate_is_checked_against_the_stamps() -> None:
    rig = Rig(instrument="displacement", column="x", stiffness=1, mass=1, drive_velocity=1, sampling_rate=2000)
    with pytest.raises(InputError, match="100 samples per second and the rig says sampling_rate = 2000"):
        as_record(columns(), rig)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("empty.csv", b"", "the file is empty"),
        ("short.csv", b"t,x\n0,1\n1", "row 3 has 1 cells and the header 2; look at the last row"),
        ("word.csv", b"t,x\n0,1\n1,two\n2,3\n", "row 3, column 'x': a number was expected, got 'two'"),
        ("bare.csv", b"0,1\n1,2\n", "row 1 holds numbers where a header line"),
        ("twice.csv", b"x,x\n0,1\n1,2\n", "names a column twice"),
        ("binary.csv", bytes(range(256)), "neither text nor a .mat file"),
        ("junk.mat", b"not a matlab file" * 20, "not a whole MATLAB v5 file"),
        ("new.mat", b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(600), "MATLAB v7.3"),
    ],
)
def test_bad_file_is_one_sentence(tmp_path: Path, name: str, content: bytes, words: str) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_columns(path)
    assert words in str(caught.value)
    assert name in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 0.999])
def test_truncated_matlab_file_is_refused(tmp_path: Path, share: float) -> None:
    savemat(tmp_path / "r.mat", {"t": T[:, None], "x": X[:, None]})
    content = (tmp_path / "r.mat").read_bytes()
    (tmp_path / "cut.mat").write_bytes(content[: int(share * len(content))])
    with pytest.raises(InputError, match=r"cut\.mat"):
        as_record(tmp_path / "cut.mat", RIG)


def test_nan_in_a_file_is_placed_by_its_row(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    pd.DataFrame({"t": T, "x": with_value(X, 7, np.nan)}).to_csv(path, index=False, na_rep="nan")
    with pytest.raises(InputError, match=r"r\.csv: row 9, column 'x' is NaN"):
        as_record(path, RIG)


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        as_record(tmp_path / "none.mat", RIG)
