"""Files to records: a time axis and named columns, checked before anything is computed from them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.errors import InputError
from stickslip.files.arrays import Array, Mask
from stickslip.files.disk import read_bytes
from stickslip.files.netcdf import read_tree
from stickslip.files.units import FARTHEST, find_unit
from stickslip.measurement.formats.json_rows import json_table
from stickslip.measurement.formats.look import look_table
from stickslip.measurement.formats.matlab import matlab_table
from stickslip.measurement.formats.table import Table, whole_name
from stickslip.measurement.formats.text import text_table
from stickslip.measurement.rigs.layout import Layout
from stickslip.measurement.rigs.rig import Rig
from stickslip.measurement.signals.sampling import mean_step

LEAST_SAMPLES = 64
"""Shorter records hold no cycle that could be measured."""

UNEVEN = 0.5
"""Steps that differ from their median by less than this share are jitter, and need no note."""

RECORD = "record file (.mat, .csv, .txt, .json or .nc)"
MOST_BYTES = 2 << 30
"""Of a record file: it is read into memory as a whole."""

FORMAT_OF_ENDING = {".mat": "matlab", ".json": "json", ".nc": "netcdf"}
"""All other endings are text, unless the rig says otherwise."""


@dataclass(frozen=True)
class Record:
    """One instrument over time.

    Attributes
    ----------
    time : (n,) seconds, increasing; about evenly spaced.
    signal : (n,) the instrument in its own unit.
    source : where it came from, for messages and provenance.
    notes : what was found worth telling while reading.
    weight : (n,) 0 for a sample that is missing (its signal is a line between its neighbours) and 1 for all others; None
        where none is missing.
    error : standard error of a sample as the file states it (``x_error`` of a motion), in the unit of the signal, or None.
    scale_error : relative standard error that all its lengths share, as a motion states it; 0 where nothing is stated.
    pixel : length of a pixel in the unit of the signal, of a motion that was seen in pictures; else None.
    """

    time: Array
    signal: Array
    source: str
    notes: tuple[str, ...] = ()
    weight: Array | None = None
    error: float | None = None
    scale_error: float = 0.0
    pixel: float | None = None

    @property
    def step(self) -> float:
        """Sampling interval in seconds."""
        return mean_step(self.time)


def read_columns(path: str | Path, layout: Layout | None = None) -> dict[str, Array]:
    """Named columns of a MATLAB (v5), CSV/text, JSON, look or netCDF file.

    Parameters
    ----------
    path : of the file.
    layout : what is unusual about it; default: text with one header line, other kinds by the ending of the name.

    Returns
    -------
    dict of (n,) float arrays in the order of the file.

    Raises
    ------
    InputError
        if the file is missing, truncated, of another kind, or holds a cell that is no number (file, row, column).
    """
    return read_table(path, layout).columns


def read_table(path: str | Path, layout: Layout | None = None, wanted: Collection[str | int] | None = None) -> Table:
    """`read_columns` with the row numbers; only the columns that are `wanted` must be numbers."""
    path, layout = Path(path), layout or Layout()
    kind = layout.format or FORMAT_OF_ENDING.get(path.suffix.lower(), "text")
    if kind == "netcdf":
        return replace(table_of(open_motion(path)), source=str(path))
    content = read_bytes(path, RECORD, MOST_BYTES)
    if not content:
        raise InputError(f"{path}: the file is empty; export the record again")
    match kind:
        case "matlab":
            return matlab_table(path, content)
        case "json":
            return json_table(path, content, layout)
        case "look":
            return look_table(path, content)
        case _:
            return text_table(path, content, layout, wanted)


def open_motion(path: str | Path) -> Any:
    """The xarray Dataset of a netCDF file, in memory."""
    return read_tree(path).to_dataset()


def as_record(source: Any, rig: Rig) -> Record:
    """The rig's instrument out of a file or of arrays in memory, checked.

    Parameters
    ----------
    source : path of a file, or a mapping name -> (n,) array, an xarray Dataset, or a pandas DataFrame that holds the
        rig's `column` and its `time_column` (a coordinate `time` or `t`, or an unnamed index, also serves as time).
    rig : names the columns and, where there is no time, the sampling rate.

    Raises
    ------
    InputError
        for a wrong column, NaN or infinity (row and column), stamps that repeat, run backwards or leave gaps in which a slip
        could hide, a sampling rate that contradicts the stamps, a record that is too short.
    """
    if isinstance(source, Record):
        return source
    if isinstance(source, str | Path):
        wanted = [rig.column] if rig.time_column is None else [rig.column, rig.time_column, "time"]
        table = read_table(source, rig.read, wanted)
    else:
        table = table_of(source)
    time_column = rig.time_column
    if time_column == "t" and not {"t", whole_name("t", table.columns)} & {*table.columns}:
        # the default name; "time" is what our own data sets call it
        time_column = "time" if "time" in table.columns else whole_name("time", table.columns) or "t"
    table = one_segment(table, rig.read, time_column)
    column = table.name_of(rig.column)
    _check_unit(source, column, rig, table)
    signal = table.columns[column]
    notes = list(table.notes)
    if len(signal) < LEAST_SAMPLES:
        raise InputError(
            f"{table.source}: {len(signal)} samples are too short a record, at least {LEAST_SAMPLES} are needed"
        )
    time, stamped = _time(table, time_column, rig, len(signal), notes)
    if stamped is None:  # counted rows must all be samples
        table.refuse_faults()
    inside = in_window(time, rig.read.window)
    table, time, signal = table.part(inside), time[inside], signal[inside]
    table.refuse_faults()
    if len(signal) < LEAST_SAMPLES:
        raise InputError(
            f"{table.source}: {len(signal)} samples lie in the window {list(rig.read.window or ())} s, at least "
            f"{LEAST_SAMPLES} are needed"
        )
    if stamped is not None:
        check_finite(time, stamped, table, "refuse")
    check_finite(signal, column, table, rig.read.missing)
    if stamped is not None:
        _check_stamps(time, stamped, table, rig)
    good = np.isfinite(signal)
    if not good.any():
        raise InputError(f"{table.source}: column {column!r} holds no number; name another column")
    weight = None
    if not good.all():
        count = int(np.count_nonzero(~good))
        if count > len(signal) / 2:
            raise InputError(f"{table.source}: {count} of {len(signal)} samples of {column!r} are missing, too many")
        signal = np.interp(time, time[good], signal[good])
        weight = good.astype(np.float64)
        notes.append(f"{count} missing samples of {column!r} were left out ({100 * count / len(good):.1f} %)")
    time, signal, weight = _bridged(time, signal, weight, table.source, notes)
    stated = table.columns.get(f"{column}_error", np.zeros(0))
    stated = stated[inside & np.isfinite(stated)] if len(stated) == len(inside) else np.zeros(0)
    error = float(np.median(stated)) if len(stated) else None
    # of pixels the rig states the size, and a force is no length
    scale_error = table.scale_error if rig.instrument == "displacement" and table.unit_of(column) != "px" else 0.0
    if scale_error:
        notes.append(
            f"all lengths share a relative standard error of {100 * scale_error:.2g} % (scale_error of the motion), and so "
            "do the forces k x; force_error does not hold it, and of the intervals only those of --trajectories do"
        )
    pixel = _pixel(table, column)
    return Record(time, signal, table.source, tuple(notes), weight, error, scale_error, pixel)


def _pixel(table: Table, column: str) -> float | None:
    """Length of a pixel in the unit of a column, None where the table does not have the column in pixels too."""
    seen = table.columns.get(f"{column}_px")
    if seen is None or len(seen) != len(table.columns[column]):
        return 1.0 if table.unit_of(column) == "px" else None
    good = np.isfinite(seen) & np.isfinite(table.columns[column])
    spread = seen[good] - seen[good].mean()
    pixel = abs(float(spread @ table.columns[column][good])) / max(float(spread @ spread), 1e-300)
    return pixel if pixel > 0 else None


def in_window(time: Array, window: tuple[float, float] | None) -> Mask:
    """The rows of a record from the first to the last stamp in [first, end) s; all where there is no window.

    A row between these whose stamp is no number is among them, to be refused; what lies outside is nobody's concern.
    """
    rows = np.arange(len(time))
    if window is None:
        return rows >= 0
    outside = (time < window[0]) | (time >= window[1])
    seen = np.flatnonzero(np.isfinite(time) & ~outside)
    return (rows >= seen[0]) & (rows <= seen[-1]) & ~outside if len(seen) else rows < 0


def table_of(source: Any) -> Table:
    """Columns of arrays in memory; rows count from 0."""
    attributes = getattr(source, "attrs", {})
    attributes = attributes if isinstance(attributes, Mapping) else {}
    name = attributes.get("source", "record")
    if not hasattr(source, "data_vars"):
        return Table(_columns_of(source), str(name), first_row=0)
    stated = attributes.get("scale_error", 0.0)
    scale_error = float(stated) if isinstance(stated, int | float | np.floating) and 0 < stated < np.inf else 0.0
    parts = _parts_of(source)
    units = {part: str(value.attrs["units"]) for part, value in parts.items() if "units" in value.attrs}
    columns = _columns_of({part: value.values for part, value in parts.items()})
    return Table(columns, str(name), first_row=0, units=units, scale_error=scale_error)


def _parts_of(source: Any) -> dict[str, Any]:
    """The variables of a Dataset; of one for several masses a part a mass: ``x(block)``, or ``x(0)`` without names."""
    parts: dict[str, Any] = {}
    for name, value in source.variables.items():
        if "mass" in value.dims and len(value.dims) == 2:
            labels = source["name" if "name" in source else "mass"].values
            parts |= {f"{name}({label})": value.isel(mass=i) for i, label in enumerate(labels)}
            if len(labels) > 1:
                continue
        parts[str(name)] = value
    return parts


def _columns_of(source: Any) -> dict[str, Array]:
    if isinstance(source, Mapping):
        items = {str(name): source[name] for name in source}
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
            plain = np.asarray(values)
            if plain.dtype.kind == "M" and plain.size:  # stamps of a calendar: s since the first
                plain = (plain - plain.ravel()[0]) / np.timedelta64(1, "s")
            array = np.asarray(plain, dtype=np.float64)
        except (TypeError, ValueError):
            continue  # labels and dates are no instruments
        if array.ndim <= 1 or max(array.shape) == array.size:
            columns[name] = array.ravel()
    return columns


def _check_unit(source: Any, column: str, rig: Rig, table: Table) -> None:
    """Refuse a motion that is labelled with another unit than the rig's; pixels are not metres."""
    unit = table.unit_of(column)
    if abs(rig.scale) == 1:
        table.refuse_unit(column, rig.unit, unit, 'unit = "{}"')
    if hasattr(source, "data_vars") and unit is not None and unit != rig.unit:
        what = "track it with a calibration" if unit == "px" else f'write unit = "{unit}" in the rig'
        raise InputError(f"{table.source}: {column!r} is in {unit} and the rig says {rig.unit}; {what}")


def check_finite(values: Array, column: str, table: Table, missing: str) -> None:
    """Refuse what is too large, and NaN and infinity unless what is `missing` is dropped; with the row of the first."""
    bad = np.flatnonzero(~np.isfinite(values))
    if len(bad) and missing == "refuse":
        what = "NaN" if np.isnan(values[bad[0]]) else "infinity"
        raise InputError(
            f"{table.source}: row {table.row(bad[0])}, column {column!r} is {what} ({len(bad)} such in all); "
            'cut them off, or write [read] missing = "drop" in the rig to leave them out; they are not filled in'
        )
    huge = np.flatnonzero((np.abs(values) > FARTHEST) & np.isfinite(values))
    if len(huge):
        raise InputError(
            f"{table.source}: row {table.row(huge[0])}, column {column!r} is {values[huge[0]]:.3g}, "
            "which no instrument reads; correct it"
        )


def _time(table: Table, wanted: str | int | None, rig: Rig, n: int, notes: list[str]) -> tuple[Array, str | None]:
    """Times in s as they stand in the record, and the column they stand in, None where they were counted."""
    name = table.source
    if wanted is None:
        if rig.sampling_rate is None:
            raise InputError(f"{name}: the rig names no time_column; give it a sampling_rate")
        return np.arange(n) / rig.sampling_rate, None
    if wanted == "t" and wanted not in table.columns and rig.sampling_rate is not None:
        notes.append(f"there is no time column: time was counted from the sampling rate of {rig.sampling_rate:g} Hz")
        return np.arange(n) / rig.sampling_rate, None
    try:
        wanted = table.name_of(wanted)
    except InputError as error:
        if wanted != "t":
            raise
        raise InputError(f"{error}; name the one of time by time_column, or give a sampling_rate") from None
    table.refuse_unit(wanted, rig.time_unit, table.unit_of(wanted), 'time_unit = "{}"')
    time = table.columns[wanted] * find_unit(rig.time_unit, ("time",), "rig: time_unit")[1]
    if len(time) != n:
        raise InputError(f"{name}: column {wanted!r} has {len(time)} rows and {rig.column!r} has {n}; they must agree")
    return time, wanted


def _check_stamps(time: Array, column: str, table: Table, rig: Rig) -> None:
    """Refuse stamps that do not increase, that leave gaps in which a slip could hide, or that contradict the stated rate."""
    name = table.source
    check_increasing(time, column, table)
    steps = np.diff(time)
    step = float(np.median(steps))
    # a free mass slips for half its own period, so a slip cannot hide in a gap of a quarter
    most = max(1.5 * step, 0.25 / rig.natural_frequency)
    gaps = np.flatnonzero(steps > most)
    if len(gaps):
        row = gaps[0] + 1
        middles = (time[gaps] + time[gaps + 1]) / 2
        limits = np.concatenate([[time[0] - step], middles, [time[-1] + step]])
        longest = int(np.argmax(np.diff(limits)))
        raise InputError(
            f"{name}: row {table.row(row)}, column {column!r}: a step of {steps[gaps[0]]:g} s where the record has "
            f"{step:g} s ({len(gaps)} such in all), and a slip could hide in {most:.3g} s; measure each part between gaps by "
            f"itself: [read] window = [{limits[longest]:.7g}, {limits[longest + 1]:.7g}] (in s) in the rig takes the longest"
        )
    if rig.sampling_rate is not None and abs(rig.sampling_rate * step - 1) > 0.01:
        raise InputError(
            f"{name}: the time stamps give {1 / step:g} samples per second and the rig says sampling_rate = "
            f"{rig.sampling_rate:g}; correct one"
        )


def _bridged(
    time: Array, signal: Array, weight: Array | None, source: str, notes: list[str]
) -> tuple[Array, Array, Array | None]:
    """Samples of no weight in the gaps of uneven stamps, so that neighbours stand about one step apart."""
    steps = np.diff(time)
    step = float(np.median(steps))
    uneven = np.abs(steps - step) > UNEVEN * step
    if not uneven.any():
        return time, signal, weight
    extra = np.maximum(np.round(steps / step).astype(np.int64) - 1, 0)
    added = int(extra.sum())
    if added > len(time):
        raise InputError(
            f"{source}: the time stamps leave gaps for {added} samples among {len(time)} (a median step of {step:g} s, "
            f"{steps.max():g} s at most); export the record with even stamps, or at its true rate"
        )
    owner = np.repeat(np.arange(len(extra)), extra)
    within = np.arange(added) - np.repeat(np.cumsum(extra) - extra, extra) + 1
    filled = time[owner] + steps[owner] * within / (extra[owner] + 1)
    order = np.argsort(np.concatenate([time, filled]), kind="stable")
    weight = np.ones(len(time)) if weight is None else weight
    notes.append(
        f"the time stamps are uneven: steps of {steps.min():.3g} to {steps.max():.3g} s, {step:.3g} s in the median; the "
        f"stamps were believed, and {added} places in gaps count as missing samples"
    )
    return (
        np.concatenate([time, filled])[order],
        np.concatenate([signal, np.interp(filled, time, signal)])[order],
        np.concatenate([weight, np.zeros(added)])[order],
    )


def one_segment(table: Table, layout: Layout, column: str | int | None) -> Table:
    """The rows between two starts of the clock in a column that the layout names; all where it names none."""
    if layout.segment is None:
        return table
    if column is None:
        raise InputError(
            f"{table.source}: [read] segment needs a clock that starts again; name the time_column in the rig"
        )
    time = table.columns[table.name_of(column)]
    bounds = [0, *(np.flatnonzero(np.diff(time) < 0) + 1).tolist(), len(time)]
    if layout.segment >= len(bounds):
        raise InputError(
            f"{table.source}: column {column!r} has {len(bounds) - 1} segment(s), and the rig says [read] segment = "
            f"{layout.segment}; name one of them"
        )
    part = slice(bounds[layout.segment - 1], bounds[layout.segment])
    columns = {name: values[part] if len(values) == len(time) else values for name, values in table.columns.items()}
    rows = np.arange(len(time)) + table.first_row if table.rows is None else table.rows
    return replace(table, columns=columns, rows=rows[part])


def check_increasing(time: Array, column: str, table: Table) -> None:
    """Refuse stamps that repeat or run backwards, with the row of the first."""
    steps = np.diff(time)
    bad = np.flatnonzero(steps <= 0)
    if len(bad):
        row = bad[0] + 1
        what = "repeats the time stamp" if steps[bad[0]] == 0 else "goes back in time to"
        starts = int(np.count_nonzero(steps < 0)) + 1
        remedy = (
            f"if the clock starts again there, [read] segment = 1 to {starts} takes one part"
            if starts > 1
            else "remove rows written twice; where stamps are rounded, give the rig a sampling_rate and no time column"
        )
        raise InputError(
            f"{table.source}: row {table.row(row)}, column {column!r} {what} {time[row]:g} ({len(bad)} such in all); "
            f"time stamps must increase; {remedy}"
        )
