"""What an instrument is: named channels, named constants, and a function from samples to friction."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tomli_w
import xarray as xr

from stickslip.errors import InputError
from stickslip.files.arrays import Array, Mask
from stickslip.files.schema import Document, Positive, Says, check_keys, kind_of
from stickslip.files.units import find_unit, si_unit
from stickslip.measurement.formats.table import Table
from stickslip.measurement.read import check_finite, check_increasing, in_window, one_segment, read_table, table_of
from stickslip.measurement.rigs.layout import Layout
from stickslip.measurement.signals.reading_faults import reading_faults

LEAST_SAMPLES = 32
LENGTHS = ("length", "speed")
"""What a film measures that share its scale; an angle has none."""
NOISY = ("N", "N m", "Pa", "A", "1")
"""SI units of what an instrument never reads the same twice, even of a rig at rest; a displacement it does."""


@dataclass(frozen=True)
class Channel(Document):
    """One column of a record: ``{ column = 5, unit = "mm" }`` in the table ``[columns]`` of a rig file.

    Parameters
    ----------
    column : name or number of the column, or a list of names that are joined end to end.
    unit : its unit; default SI.
    sign : +1, or -1 where the instrument counts the other way.
    zero : the reading, in its unit, that means zero.
    valid : [lowest, highest] reading; what lies outside is a drop-out and counts as missing.
    scale : units per count, for readings that are not calibrated yet.
    zero_row : row, from 0, whose reading means zero; in place of `zero`.
    resets : pairs of rows, from 0, between which the instrument was set back: the reading is held and the jump taken out.
    sum : add the readings up, for a column of sampling periods that is to be a time.
    """

    column: Annotated[str | int | tuple[str, ...], Says("a name, a number or a list of names")]
    unit: str = ""
    sign: Annotated[float, Literal[1, -1], Says("1 or -1")] = 1.0
    zero: float = 0.0
    valid: Annotated[tuple[float, float], Says("a list of two readings, [lowest, highest]")] | None = None
    scale: float = 1.0
    zero_row: Annotated[int, Says("the number of a row")] | None = None
    resets: Annotated[tuple[tuple[int, int], ...], Says("a list of pairs of rows, [[first, last], ...]")] = ()
    sum: bool = False

    def calibrated(self, raw: Array, where: str) -> Array:
        """Readings with the resets taken out, from zero, in the channel's unit."""
        values = raw.copy()
        for first, last in self.resets:
            if not 0 <= first < last < len(values):
                raise InputError(
                    f"{where}: resets must be pairs of rows from 0 to {len(values) - 1}, got {[first, last]}"
                )
            jump = values[last] - values[first]
            values[first:last] = values[first]
            values[last:] -= jump
        if self.zero_row is not None:
            if not 0 <= self.zero_row < len(values):
                raise InputError(f"{where}: zero_row must be 0 to {len(values) - 1}, got {self.zero_row}")
            values -= values[self.zero_row]
        values = self.sign * self.scale * (values - self.zero)
        return np.cumsum(values) if self.sum else values


@dataclass(frozen=True)
class Constant:
    """A number of the rig file: its annotation, its default, and whether it has none."""

    hint: Any
    default: float | None = None
    needed: bool = False


@dataclass(frozen=True)
class Samples:
    """The channels of one record in SI, on one clock.

    Attributes
    ----------
    channels : name -> (n,) values.
    units : name -> SI unit.
    source, notes, scale_error : as in a `Record`.
    companion : the channels of a second file, on another clock.
    """

    channels: dict[str, Array]
    units: dict[str, str]
    source: str
    notes: tuple[str, ...] = ()
    companion: Samples | None = None
    scale_error: float = 0.0

    def part(self, rows: Mask) -> Samples:
        """The samples of these rows."""
        return replace(self, channels={name: values[rows] for name, values in self.channels.items()})

    def __getitem__(self, name: str) -> Array:
        return self.channels[name]

    def __contains__(self, name: str) -> bool:
        return name in self.channels

    @property
    def time(self) -> Array:
        """(n,) s."""
        return self.channels["time"]


def notes_of(records: Sequence[Samples]) -> list[str]:
    """What was told while reading; by the names of the files where there are several."""
    if len(records) == 1:
        return list(records[0].notes)
    return [f"{Path(record.source).name}: {note}" for record in records for note in record.notes]


def only(records: Sequence[Samples], instrument: str) -> Samples:
    """The one record that an instrument measures at a time."""
    if len(records) != 1:
        raise InputError(f"{instrument}: one record at a time was expected, got {len(records)}")
    return records[0]


def same_samples(one: Samples, other: Samples) -> bool:
    """Whether two records hold the same samples."""
    return one.channels.keys() == other.channels.keys() and all(
        np.array_equal(values, other[name], equal_nan=True) for name, values in one.channels.items()
    )


def noted(samples: Samples, note: str) -> Samples:
    """The record with a note more."""
    return replace(samples, notes=(*samples.notes, note))


@dataclass(frozen=True)
class InstrumentRig:
    """A rig of any instrument but the spring's, as its file says it.

    Attributes
    ----------
    instrument : its name in `INSTRUMENTS`.
    channels : name -> column and unit.
    constants : name -> number in SI; None where it is optional and not given.
    read : layout of the file.
    companion : file with further channels on another clock, ``{stem}`` standing for the record's name, or "".
    companion_read, companion_channels : how that file is read.
    toml : the document itself.
    """

    instrument: str
    channels: dict[str, Channel]
    constants: dict[str, Any]
    read: Layout = field(default_factory=Layout)
    companion: str = ""
    companion_read: Layout = field(default_factory=Layout)
    companion_channels: dict[str, Channel] = field(default_factory=dict)
    toml: str = ""

    def number(self, name: str) -> float:
        """A constant that is surely there."""
        return float(self.constants[name])

    def maybe(self, name: str) -> float | None:
        """A constant that may be absent."""
        value = self.constants[name]
        return None if value is None else float(value)


@dataclass(frozen=True)
class Instrument:
    """A kind of instrument.

    For developers: give the channels and constants their dimensions and write `measure`; reading, units, windows,
    missing values and error sentences are done by then.

    Attributes
    ----------
    name : as in the rig file, ``instrument = "..."``.
    channels, optional : name -> dimensions one of which it must have.
    constants : name -> annotation and default.
    measure : from the samples of one or more records and the rig to the tree.
    instead : channel -> one of `optional` from which it may be found where it is not given.
    """

    name: str
    channels: Mapping[str, tuple[str, ...]]
    optional: Mapping[str, tuple[str, ...]]
    constants: Mapping[str, Constant]
    measure: Callable[[list[Samples], InstrumentRig], xr.DataTree]
    instead: Mapping[str, str] = field(default_factory=dict)

    def described(self, definitions: dict[str, Any]) -> dict[str, Any]:
        """The JSON Schema of its rig file."""
        either = [{"type": "string"}, {"type": "integer"}, {"type": "array", "items": {"type": "string"}}]
        definitions["Channel"] = {"anyOf": [*either, Channel.described(definitions)]}
        columns = {name: {"$ref": "#/$defs/Channel"} for name in ("time", *self.channels, *self.optional)}
        table = {"type": "object", "properties": columns, "additionalProperties": False}
        read = kind_of(Layout).schema(definitions)
        companion = {"type": "object", "properties": {"file": {"type": "string"}, "read": read, "columns": table}}
        constants = {name: kind_of(constant.hint).schema(definitions) for name, constant in self.constants.items()}
        return {
            "title": self.name,
            "type": "object",
            "properties": {
                "instrument": {"const": self.name},
                "columns": table,
                "read": read,
                "sampling_rate": {"type": "number", "exclusiveMinimum": 0},
                "companion": companion,
                **constants,
            },
            "required": ["instrument", "columns", *(name for name, item in self.constants.items() if item.needed)],
            "additionalProperties": False,
        }

    def rig_of(self, table: Mapping[str, Any], where: str) -> InstrumentRig:
        """Check the table of a rig file; `where` names it."""
        known = ["instrument", "columns", "read", "sampling_rate", "companion", *self.constants]
        check_keys(table, known, ["columns"], where)
        channels = self._channels(table["columns"], where, "[columns]")
        companion = table.get("companion", {})
        others: dict[str, Channel] = {}
        if companion:
            check_keys(companion, ["file", "read", "columns"], ["file", "columns"], f"{where}: [companion]")
            others = self._channels(companion["columns"], where, "[companion.columns]")
        both = {**channels, **others}
        for name in self.channels:
            if name not in both and name != "time" and self.instead.get(name) not in both:
                other = f" or {self.instead[name]}" if name in self.instead else ""
                raise InputError(f"{where}: [columns] lacks {name}{other}; a {self.name} instrument needs it")
        check_keys(table, known, [name for name, constant in self.constants.items() if constant.needed], where)
        constants = {
            name: kind_of(constant.hint).read(table[name], name, where) if name in table else constant.default
            for name, constant in self.constants.items()
        }
        constants["sampling_rate"] = kind_of(Positive | None).read(table.get("sampling_rate"), "sampling_rate", where)
        if constants["sampling_rate"] is None and "time" not in channels:
            raise InputError(f"{where}: [columns] lacks time; name its column or give a sampling_rate")
        try:
            document = tomli_w.dumps(dict(table))
        except (TypeError, ValueError) as error:
            raise InputError(f"{where}: a rig holds text, numbers, lists and tables ({error}); correct that") from None
        return InstrumentRig(
            self.name,
            channels,
            constants,
            Layout.from_dict(table.get("read", {}), f"{where}: read"),
            str(companion.get("file", "")) if companion else "",
            Layout.from_dict(companion.get("read", {}), f"{where}: companion: read") if companion else Layout(),
            others,
            document,
        )

    def _channels(self, table: Any, where: str, part: str) -> dict[str, Channel]:
        if not isinstance(table, Mapping):
            raise InputError(f"{where}: columns must be a table {part}, got {table!r}")
        dimensions = {"time": ("time",), **self.channels, **self.optional}
        check_keys(table, dimensions, [], f"{where}: {part}")
        found: dict[str, Channel] = {}
        for name, value in table.items():
            entry = dict(value) if isinstance(value, Mapping) else {"column": value}
            here = f"{where}: {part} {name}"
            found[name] = Channel.from_dict(entry, here)
            if found[name].unit:
                find_unit(found[name].unit, dimensions[name], here)
            twin = next((other for other in found if other != name and found[other].column == found[name].column), None)
            if twin is not None:
                raise InputError(f"{here}: column {found[name].column!r} is that of {twin} already; name another")
        return found

    def read(self, source: Any, rig: InstrumentRig) -> Samples:
        """The channels of one record in SI."""
        samples = self._read_one(source, rig.channels, rig.read, rig.maybe("sampling_rate"))
        if rig.companion:
            raise InputError(f"{samples.source}: a {self.name} instrument joins no second file; remove [companion]")
        return samples

    def read_companion(self, source: Any, rig: InstrumentRig, least: int = LEAST_SAMPLES) -> Samples:
        """The channels of the second file, on its own clock."""
        if not isinstance(source, str | Path):
            raise InputError("record: a rig with a [companion] needs the path of its record, got arrays")
        path = Path(source)
        file = path.with_name(rig.companion.replace("{stem}", path.stem))
        return self._read_one(file, rig.companion_channels, rig.companion_read, None, least)

    def _read_one(
        self,
        source: Any,
        channels: Mapping[str, Channel],
        layout: Layout,
        rate: float | None,
        least: int = LEAST_SAMPLES,
    ) -> Samples:
        wanted: list[str | int] = []
        for channel in channels.values():
            wanted += channel.column if isinstance(channel.column, tuple) else [channel.column]
        table = read_table(source, layout, wanted) if isinstance(source, str | Path) else table_of(source)
        clock = channels["time"].column if "time" in channels else None
        table = one_segment(table, layout, None if isinstance(clock, tuple) else clock)
        dimensions = {"time": ("time",), **self.channels, **self.optional}
        found: dict[str, _Column] = {}
        lengths, taken = False, []
        for name, channel in channels.items():
            columns = channel.column if isinstance(channel.column, tuple) else (channel.column,)
            names = [table.name_of(column) for column in columns]
            raw = np.concatenate([table.columns[column] for column in names])
            if channel.valid is not None:
                raw = np.where((raw >= channel.valid[0]) & (raw <= channel.valid[1]), raw, np.nan)
            # What a scale turns into the channel's unit has another one in the file.
            stated = table.unit_of(names[0]) if abs(channel.scale) == 1 else table.units.get(names[0])
            if abs(channel.scale) == 1:
                table.refuse_unit(names[0], channel.unit, stated, f'unit = "{{}}" for {name}')
            if not channel.unit and stated and stated != "px" and stated != si_unit(dimensions[name][0]):
                taken.append(
                    f"column {names[0]!r} was read in {stated}, as the record says; the rig gives no unit for {name}"
                )
            unit = channel.unit or stated or si_unit(dimensions[name][0])
            dimension, size = find_unit(unit, dimensions[name], name)
            values = channel.calibrated(raw, f"{table.source}: {name}") * size
            # a drop-out in a channel that is only told about does not cost the others their sample
            core = name not in self.optional or channel.valid is None
            found[name] = _Column(names[0], channel, si_unit(dimension), raw, values, core)
            # the rig states the size of a pixel itself
            lengths = lengths or (dimension in LENGTHS and stated != "px")
        table = replace(table, notes=(*table.notes, *taken))
        samples = _on_clock(found, table, layout, rate, least)
        if not lengths or not table.scale_error:
            return samples
        note = (
            f"all lengths and speeds share a relative standard error of {100 * table.scale_error:.2g} % (scale_error of the "
            "motion), which no interval here includes"
        )
        return replace(samples, notes=(*samples.notes, note), scale_error=table.scale_error)


@dataclass(frozen=True)
class _Column:
    """A channel of one record: the name of its column, its readings, its values in SI, and whether each sample needs one."""

    name: str
    channel: Channel
    unit: str
    readings: Array
    values: Array
    core: bool


def _on_clock(columns: Mapping[str, _Column], table: Table, layout: Layout, rate: float | None, least: int) -> Samples:
    notes = list(table.notes)
    first = next(iter(columns.values()))
    n = len(first.values)
    for column in columns.values():
        if len(column.values) != n:
            raise InputError(
                f"{table.source}: column {column.name!r} has {len(column.values)} rows and {first.name!r} has {n}; "
                "they must agree"
            )
    if "time" in columns:
        time = columns["time"].values
    else:
        assert rate is not None
        table.refuse_faults()  # counted rows must all be samples
        time = np.arange(n) / rate
    inside = in_window(time, layout.window)
    table, time = table.part(inside), time[inside]
    table.refuse_faults()
    columns = {
        name: replace(column, readings=column.readings[inside], values=column.values[inside])
        for name, column in columns.items()
    }
    for column in columns.values():
        if column.channel.valid is None:
            check_finite(column.readings, column.name, table, layout.missing)
    core = [column for column in columns.values() if column.core]
    good = np.all([np.isfinite(values) for values in (time, *(column.values for column in core))], axis=0)
    if not good.all():
        missing = ", ".join(sorted(column.name for column in core if not np.isfinite(column.values).all()))
        count = int(np.count_nonzero(~good))
        what = "row with a missing value was" if count == 1 else "rows with missing values were"
        notes.append(f"{count} {what} left out (column {missing})")
    if np.count_nonzero(good) < least:
        raise InputError(
            f"{table.source}: {np.count_nonzero(good)} usable samples are too short a record, at least {least} are needed"
        )
    if "time" in columns:
        check_increasing(time[good], columns["time"].name, table.part(good))
    for name, column in columns.items():
        if name == "time" or column.channel.resets:  # a reading is held over a reset
            continue
        seen = good & np.isfinite(column.readings)
        faults = reading_faults(column.readings[seen], time[seen], noisy=column.unit in NOISY)
        notes += [f"column {column.name!r}: {fault}" for fault in faults]
    kept = {name: column.values[good] for name, column in columns.items()} | {"time": time[good]}
    return Samples(
        kept, {name: column.unit for name, column in columns.items()} | {"time": "s"}, table.source, tuple(notes)
    )
