"""Files to records: a time axis and named columns, checked before anything is computed from them."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from stickslip.errors import InputError
from stickslip.measurement.rig import Rig

Array = npt.NDArray[np.float64]

LEAST_SAMPLES = 64
"""Shorter records hold no cycle that could be measured."""


@dataclass(frozen=True)
class Record:
    """One gauge over time.

    Attributes
    ----------
    time : (n,) seconds, evenly spaced and increasing.
    signal : (n,) the gauge in its own unit.
    source : where it came from, for messages and provenance.
    notes : what was found worth telling while reading.
    """

    time: Array
    signal: Array
    source: str
    notes: tuple[str, ...] = ()

    @property
    def step(self) -> float:
        """Sampling interval in seconds."""
        return float((self.time[-1] - self.time[0]) / (len(self.time) - 1))


def read_columns(path: str | Path) -> dict[str, Array]:
    """Named columns of a MATLAB (v5) or CSV/text file with one header line.

    Returns
    -------
    dict of (n,) float arrays in the order of the file.

    Raises
    ------
    InputError
        if the file is missing, truncated, of another kind, or holds a cell that is no number (file, row, column).
    """
    path = Path(path)
    if not path.exists():
        raise InputError(f"{path}: no such file; give the path of a .mat, .csv or .txt record")
    if path.is_dir():
        raise InputError(f"{path}: a record file was expected, this is a folder; name a file in it")
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: the file cannot be read ({error.strerror}); check its permissions") from None
    if not content:
        raise InputError(f"{path}: the file is empty; export the record again")
    if path.suffix.lower() == ".mat":
        return _matlab_columns(path, content)
    return _text_columns(path, content)


def _matlab_columns(path: Path, content: bytes) -> dict[str, Array]:
    from scipy.io import loadmat

    if content[:128].startswith(b"MATLAB 7.3") or content[:8] == b"\x89HDF\r\n\x1a\n":
        raise InputError(f"{path}: this is a MATLAB v7.3 file, which is not read here; save it again with `save -v7`")
    try:
        variables: dict[str, Any] = loadmat(io.BytesIO(content))  # type: ignore[arg-type]  # the stubs know paths only
    except Exception as error:  # noqa: BLE001 the reader raises some ten types on damaged bytes
        reason = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
        raise InputError(
            f"{path}: not a whole MATLAB v5 file, truncated or damaged ({reason}); copy or export it again"
        ) from None
    columns = {
        name: np.ascontiguousarray(value, dtype=np.float64).ravel()
        for name, value in variables.items()
        if not name.startswith("__")
        and isinstance(value, np.ndarray)
        and value.dtype.kind in "fiu"
        and value.size > 1
        and max(value.shape) == value.size
    }
    if not columns:
        raise InputError(f"{path}: holds no numeric column; expected vectors such as t and the gauge")
    return columns


def _text_columns(path: Path, content: bytes) -> dict[str, Array]:
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{path}: neither text nor a .mat file; export the record as CSV with a header line") from None
    if "\x00" in text:
        raise InputError(f"{path}: holds binary bytes, not text; export the record as CSV with a header line")
    lines = text.splitlines()
    rows = [(number, line) for number, line in enumerate(lines, start=1) if line.strip() and not line.startswith("#")]
    if len(rows) < 2:
        raise InputError(f"{path}: a header line and rows of numbers were expected, got {len(rows)} line(s)")
    delimiter = next((mark for mark in ("\t", ";", ",") if mark in rows[0][1]), None)

    def cells(line: str) -> list[str]:
        if delimiter is None:
            return line.split()
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter))]

    header = cells(rows[0][1])
    if all(_is_number(name) for name in header):
        raise InputError(f"{path}: row {rows[0][0]} holds numbers where a header line with column names was expected")
    if len(set(header)) < len(header):
        raise InputError(f"{path}: row {rows[0][0]} names a column twice ({', '.join(header)}); rename one")
    body = "\n".join(line for _, line in rows[1:])
    try:
        table = np.loadtxt(io.StringIO(body), delimiter=delimiter, ndmin=2, comments=None)
        if table.shape[1] == len(header):
            return {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(header)}
    except ValueError:
        pass
    # something is wrong: walk the rows to say where
    last = rows[-1][0]
    for number, line in rows[1:]:
        row = cells(line)
        if len(row) != len(header):
            where = "the last row, so the file seems truncated" if number == last else "the header"
            raise InputError(f"{path}: row {number} has {len(row)} cells and the header {len(header)}; look at {where}")
        for name, cell in zip(header, row, strict=True):
            if not _is_number(cell):
                raise InputError(f"{path}: row {number}, column {name!r}: a number was expected, got {cell!r}")
    raise InputError(f"{path}: the rows do not form a table of {len(header)} columns; export it again")


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def as_record(source: Any, rig: Rig) -> Record:
    """The rig's gauge out of a file or of arrays in memory, checked.

    Parameters
    ----------
    source : path of a file, or a mapping name -> (n,) array, an xarray Dataset, or a pandas DataFrame that holds the
        rig's `column` and its `time_column` (a coordinate `time` or `t`, or an unnamed index, also serves as time).
    rig : names the columns and, where there is no time, the sampling rate.

    Raises
    ------
    InputError
        for a wrong column, NaN or infinity (row and column), stamps that repeat, run backwards or are uneven, a
        sampling rate that contradicts the stamps, a record that is too short.
    """
    if isinstance(source, Record):
        return source
    if isinstance(source, str | Path):
        columns, name, first_row = read_columns(source), str(source), _first_row(Path(source))
    else:
        columns, name, first_row = _columns_of(source), "record", 0
    signal = _column(columns, rig.column, name)
    _check_finite(signal, rig.column, name, first_row)
    if len(signal) < LEAST_SAMPLES:
        raise InputError(f"{name}: {len(signal)} samples are too short a record, at least {LEAST_SAMPLES} are needed")
    notes: list[str] = []
    time = _time(columns, rig, name, first_row, len(signal), notes)
    return Record(time, signal, name, tuple(notes))


def _first_row(path: Path) -> int:
    """Row number of the first sample as a person counts: MATLAB rows from 1, text rows after the header."""
    return 1 if path.suffix.lower() == ".mat" else 2


def _columns_of(source: Any) -> dict[str, Array]:
    if isinstance(source, Mapping) and not hasattr(source, "data_vars"):
        items = {str(name): source[name] for name in source}
    elif hasattr(source, "data_vars"):  # xarray.Dataset
        items = {str(name): source[name].values for name in source.variables}
    elif hasattr(source, "columns"):  # pandas.DataFrame
        items = {str(name): source[name].to_numpy() for name in source.columns}
        index_name = source.index.name
        if index_name is not None:
            items.setdefault(str(index_name), source.index.to_numpy())
    else:
        raise InputError(
            f"record: a path, a Dataset, a DataFrame or a dict of arrays was expected, got {type(source).__name__}"
        )
    columns: dict[str, Array] = {}
    for name, values in items.items():
        try:
            array = np.asarray(values, dtype=np.float64)
        except (TypeError, ValueError):
            continue  # labels and dates are no gauges
        if array.ndim <= 1 or max(array.shape) == array.size:
            columns[name] = array.ravel()
    return columns


def _column(columns: dict[str, Array], wanted: str, name: str) -> Array:
    if wanted not in columns:
        raise InputError(f"{name}: there is no column {wanted!r}; the columns are {', '.join(columns) or 'none'}")
    return columns[wanted]


def _check_finite(values: Array, column: str, name: str, first_row: int) -> None:
    bad = np.flatnonzero(~np.isfinite(values))
    if len(bad):
        what = "NaN" if np.isnan(values[bad[0]]) else "infinity"
        raise InputError(
            f"{name}: row {bad[0] + first_row}, column {column!r} is {what} ({len(bad)} such in all); "
            "cut them off or record again, they are not filled in"
        )


def _time(columns: dict[str, Array], rig: Rig, name: str, first_row: int, n: int, notes: list[str]) -> Array:
    if rig.time_column is None:
        if rig.sampling_rate is None:
            raise InputError(f"{name}: the rig names no time_column; give it a sampling_rate")
        return np.arange(n) / rig.sampling_rate
    wanted = rig.time_column
    if wanted not in columns and wanted == "t" and "time" in columns:
        wanted = "time"  # the default name; "time" is what our own data sets call it
    if wanted not in columns and rig.sampling_rate is not None and rig.time_column == "t":
        notes.append(f"there is no time column: time was counted from the sampling rate of {rig.sampling_rate:g} Hz")
        return np.arange(n) / rig.sampling_rate
    time = _column(columns, wanted, name)
    _check_finite(time, wanted, name, first_row)
    if len(time) != n:
        raise InputError(f"{name}: column {wanted!r} has {len(time)} rows and {rig.column!r} has {n}; they must agree")
    steps = np.diff(time)
    bad = np.flatnonzero(steps <= 0)
    if len(bad):
        row = bad[0] + 1
        what = "repeats the time stamp" if steps[bad[0]] == 0 else "goes back in time to"
        raise InputError(
            f"{name}: row {row + first_row}, column {wanted!r} {what} {time[row]:g} ({len(bad)} such in all); "
            "time stamps must increase"
        )
    step = float(np.median(steps))
    uneven = np.flatnonzero(np.abs(steps - step) > 0.5 * step)
    if len(uneven):
        row = uneven[0] + 1
        raise InputError(
            f"{name}: row {row + first_row}, column {wanted!r}: a step of {steps[uneven[0]]:g} s where the record has "
            f"{step:g} s ({len(uneven)} such in all); cut the record at its gaps"
        )
    if rig.sampling_rate is not None and abs(rig.sampling_rate * step - 1) > 0.01:
        raise InputError(
            f"{name}: the time stamps give {1 / step:g} samples per second and the rig says sampling_rate = "
            f"{rig.sampling_rate:g}; correct one"
        )
    return time
