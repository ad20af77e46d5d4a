"""A friction record as identification needs it: checked columns, its slips, and the constants it was measured with."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from stickslip.errors import InputError
from stickslip.files.arrays import Array, Mask, taken
from stickslip.files.disk import toml_table
from stickslip.files.equality import each_once
from stickslip.files.netcdf import read_tree
from stickslip.files.notebook import InNotebook
from stickslip.measurement.result import stated_notes
from stickslip.measurement.signals.sample_runs import runs_of

ROWS = ("t", "stick_time", "force_rate", "force", "drop")
"""Columns of the table of break-aways; each has one named ``<column>_error`` beside it."""
FEWEST_SAMPLES = 10
OF_RECORDS = (".csv", ".txt", ".dat", ".tsv", ".mat", ".json")
"""Endings of records as instruments write them."""
SENSES = 0.05
"""A sense of slip has at least this share of the samples that slip."""


def both_senses(w: Array) -> bool:
    """Whether slip is for a good part in either sense; rebounds and errors of w are no slip the other way."""
    return SENSES < float(np.mean(w > 0)) < 1 - SENSES


@dataclass(frozen=True, repr=False)
class FrictionRecord(InNotebook):
    """Friction force and slip velocity over time, and the break-aways in it.

    Attributes
    ----------
    name : what sentences call it.
    time, slip_velocity, force, force_error : shape (n,).
    stuck : shape (n,).
    break_away : table with `ROWS` and their errors, one row per break-away; may be empty. Its forces count in the sense of
        the slip that follows.
    constants : what is known of ``mass`` (the inertia), ``damping``, ``stiffness``, ``drive_velocity``, ``weight``, and
        ``late``, the standard error by which all its break-aways may be seen early or late together, ``common``, that which
        all its forces share, and ``low_pass``, the time constant of a filter ahead of the converter.
    attrs : the provenance of the record.
    displacement : of the mass, shape (n,), where it is known.
    recorded : the displacement as the instrument gave it, its noise white, shape (n,), NaN where a sample was left out; where
        it is known.
    units : of ``force``, ``time`` and ``slip_velocity``, where the record says them.
    slip_velocity_error : standard error of each slip velocity, shape (n,), where the record states it.
    """

    name: str
    time: Array
    slip_velocity: Array
    force: Array
    force_error: Array
    stuck: Mask
    break_away: pd.DataFrame
    constants: Mapping[str, float]
    attrs: Mapping[str, Any]
    displacement: Array | None = None
    recorded: Array | None = None
    units: Mapping[str, str] = field(default_factory=dict)
    slip_velocity_error: Array | None = None

    @property
    def notes(self) -> list[str]:
        """What was said where it was measured."""
        return stated_notes(self.attrs)

    def facts(self) -> dict[str, Any]:
        """What a notebook shows."""
        span = f"{self.time[0]:.6g} to {self.time[-1]:.6g}"
        counts = {"samples": self.time.size, "time": span, "break_aways": len(self.break_away)}
        return {
            "name": self.name,
            **counts,
            **self.constants,
            "units": [f"{one}: {of}" for one, of in self.units.items()],
        }

    def __repr__(self) -> str:
        return f"<FrictionRecord {self.name}: {self.time.size} samples, {len(self.break_away)} break-aways>"

    @cached_property
    def slips(self) -> list[tuple[int, int]]:
        """First and one past the last sample of each slip."""
        return runs_of(~self.stuck)

    @property
    def rig(self) -> dict[str, Any]:
        """What the record was taken with, as its rig says it; empty where nothing is said."""
        return toml_table(str(self.attrs.get("rig", "")), f"{self.name}: rig")

    @cached_property
    def step(self) -> float:
        """Sampling interval."""
        return float(np.median(np.diff(self.time)))

    def settled(self, share: float) -> float:
        """The time at which so large a share of the record is over."""
        return float(self.time[0] + share * (self.time[-1] - self.time[0]))

    def force_rates(self) -> pd.Series:
        """How fast each stick was loaded.

        Where the mass creeps, the measured rates fall short of k V by its own creep, most in the shortest sticks; that is no
        rate at which it was loaded, and all are k V.
        """
        rates = self.break_away["force_rate"]
        if self.attrs.get("creeps") and {"stiffness", "drive_velocity"} <= set(self.constants):
            return pd.Series(self.constants["stiffness"] * self.constants["drive_velocity"], index=rates.index)
        return rates

    def own_slip(self) -> list[tuple[int, int] | None]:
        """For each break-away the slip that follows it, or None where the record holds none."""
        slips = self.slips
        starts = self.time[[a for a, _ in slips]]
        found: list[tuple[int, int] | None] = []
        for t in self.break_away["t"]:
            i = int(np.searchsorted(starts, t - 1.5 * self.step))
            near = i < len(slips) and starts[i] - t < 1.5 * self.step
            found.append(slips[i] if near else None)
        return found

    def slip_level(self, first: int, last: int) -> float:
        """The constant kinetic force that would do the same work over these samples, ∫ f w dt / ∫ |w| dt."""
        w, sense = self.slip_velocity[first:last], self.sense(first, last)
        path = np.maximum(w * sense, 0.0)
        return float(np.average(sense * self.force[first:last], weights=path if path.sum() > 0 else None))

    def sense(self, first: int, last: int) -> float:
        """Sense of a slip: 1 or -1."""
        return -1.0 if float(np.sum(self.slip_velocity[first:last])) < 0 else 1.0

    def sense_of(self, slip: tuple[int, int] | None) -> float:
        """Sense of a slip, that of the drive where there is none."""
        drive = -1.0 if self.constants.get("drive_velocity", 1.0) < 0 else 1.0
        return drive if slip is None else self.sense(*slip)

    def both_senses(self) -> bool:
        """Whether the record slips for a good part in either sense."""
        return both_senses(self.slip_velocity[~self.stuck])

    def part(self, first: int, last: int) -> FrictionRecord:
        """The samples [first, last) with the break-aways in them."""
        inside = (self.break_away["t"] >= self.time[first]) & (self.break_away["t"] <= self.time[last - 1])
        return replace(taken(self, slice(first, last)), break_away=self.break_away[inside].reset_index(drop=True))

    def every(self, stride: int) -> FrictionRecord:
        """Every `stride`-th sample."""
        return taken(self, slice(None, None, stride))

    def facing_slip(self) -> FrictionRecord:
        """The record with each break-away force counted in the sense of the slip that follows."""
        senses = np.array([self.sense_of(slip) for slip in self.own_slip()])
        return replace(self, break_away=self.break_away.assign(force=self.break_away["force"] * senses))

    def without_inner_sticks(self) -> FrictionRecord:
        """The record with only the first and the last sample of every stick: all a law with memory asks of it."""
        inner = self.stuck.copy()
        inner[1:] &= self.stuck[:-1]
        inner[:-1] &= self.stuck[1:]
        inner[[0, -1]] = False
        return taken(self, ~inner)


def read_records(friction: Any) -> list[FrictionRecord]:
    """Friction records from a DataTree, the path of a friction file, a table of break-aways, or a list of them.

    Equal ones count once.

    Raises
    ------
    InputError
        where a variable is missing, holds NaN, or the record never slips.
    """
    records = [_read(item, number) for number, item in enumerate(some_of(friction), start=1)]
    check_same_units((record.name, record.units) for record in records)
    return each_once(records, _same_samples, lambda one: one.name, _noted)


def items_of(friction: Any) -> list[Any]:
    """Those of a list, or the one that is given alone."""
    return list(friction) if isinstance(friction, list | tuple) else [friction]


def some_of(friction: Any) -> list[Any]:
    """One record or more; none is refused."""
    if items := items_of(friction):
        return items
    raise InputError("identify: expected at least one friction record, got none: give a file, a DataTree or a list")


def loaded(item: Any) -> Any:
    """The friction file that a path names, in memory; what is no path as it is."""
    return opened(Path(item)) if isinstance(item, str | Path) else item


def tree_of(item: Any) -> xr.DataTree:
    """A friction record as a tree of tables, from a file or as it is."""
    tree = loaded(item)
    if not isinstance(tree, xr.DataTree):
        raise InputError(f"identify: expected a friction file or a DataTree from measure, got {type(tree).__name__}")
    return tree


def _same_samples(one: FrictionRecord, other: FrictionRecord) -> bool:
    alike = np.array_equal(one.force, other.force) and np.array_equal(one.slip_velocity, other.slip_velocity)
    return alike and one.break_away.equals(other.break_away)


def _noted(record: FrictionRecord, note: str) -> FrictionRecord:
    return replace(record, attrs={**record.attrs, "notes": [*record.notes, note]})


def stated_units(data: xr.Dataset) -> dict[str, str]:
    """The units of time, force and slip velocity that a friction record or table states."""
    names = {"t": "time", "time": "time", "force": "force", "slip_velocity": "slip_velocity"}
    columns = {of: data[name] for name, of in names.items() if name in data.variables}
    return {of: str(column.attrs["units"]) for of, column in columns.items() if "units" in column.attrs}


def check_same_units(units: Iterable[tuple[str, Mapping[str, str]]]) -> None:
    """Refuse records that do not join: forces in N beside friction coefficients, or m/s beside rad/s."""
    seen: dict[str, tuple[str, str]] = {}
    for name, stated in units:
        for quantity, unit in stated.items():
            other, wanted = seen.setdefault(quantity, (name, unit))
            if unit != wanted:
                shown = [f"in {one}" if one != "1" else "dimensionless" for one in (unit, wanted)]
                raise InputError(
                    f"{name}: expected the {quantity.replace('_', ' ')} {shown[1]}, as in {other}, got it {shown[0]}; "
                    "measure both with one unit (a normal_force in the rig makes friction a coefficient), or identify each "
                    "by itself"
                )


def _read(item: Any, number: int) -> FrictionRecord:
    if isinstance(item, FrictionRecord):
        return item
    if isinstance(item, str | Path):
        return _from_tree(opened(Path(item)), str(item))
    if isinstance(item, pd.DataFrame):
        item = _of_table(item)
    if isinstance(item, xr.Dataset):
        item = xr.DataTree(item)
    if isinstance(item, xr.DataTree):
        return _from_tree(item, f"record {number}")
    raise InputError(
        f"identify: expected a friction file or a DataTree from measure, got {type(item).__name__}: run measure first"
    )


def _of_table(table: pd.DataFrame) -> xr.DataTree:
    """A plain table of break-aways as a friction file holds it."""
    if missing := sorted({"stick_time", "force"} - set(table)):
        raise InputError(
            f"identify: expected a table of break-aways with the columns stick_time and force, got none named "
            f"{' and '.join(missing)} among {', '.join(map(str, table.columns))}"
        )
    columns = {"t": np.arange(1.0, len(table) + 1)} | {name: table[name].to_numpy() for name in table}
    rows = xr.Dataset({str(name): ("event", values) for name, values in columns.items()})
    return xr.DataTree.from_dict({"/": xr.Dataset(), "/break_away": rows})


def opened(path: Path) -> xr.DataTree:
    """A friction file, in memory.

    Raises
    ------
    InputError
        where it is missing, damaged or an orbit.
    """
    if path.exists() and path.suffix.lower() in OF_RECORDS:
        raise InputError(
            f"{path}: expected a friction file (.nc), got a record; measure it first: stickslip measure {path} --rig RIG.toml"
        )
    loaded = read_tree(path, "friction file")
    if loaded.attrs.get("stickslip") == "orbit":
        raise InputError(f"{path}: expected a friction file, got a simulated orbit; measure a record first")
    return loaded


def _from_tree(tree: xr.DataTree, name: str) -> FrictionRecord:
    data = tree.to_dataset(inherit=False)
    if "slip_velocity" not in data and len(_table(tree, name)):
        return _slips_alone(tree, name)
    masses = sorted(child for child in tree.children if child.startswith("mass_"))
    if "slip_velocity" not in data and masses:
        raise InputError(
            f"{name}: holds the friction of {len(masses)} masses ({', '.join(masses)}), each with a law of its own; measure "
            f"one at a time: stickslip measure MOTION --rig RIG.toml --mass {masses[0].removeprefix('mass_')}, or in Python "
            f"give tree[{masses[0]!r}]"
        )
    columns: dict[str, Array] = {}
    for column in ("time", "slip_velocity", "force"):
        columns[column] = _column(data, column, name)
    count = len(columns["time"])
    if count < FEWEST_SAMPLES:
        raise InputError(f"{name}: a friction record needs at least {FEWEST_SAMPLES} samples, got {count}")
    step = np.diff(columns["time"])
    if not (step > 0).all():
        row = int(np.argmax(step <= 0)) + 1
        raise InputError(f"{name}: time must increase, but sample {row} does not come after the one before; sort it")
    errors = {column: _error(data, column, name) for column in ("force_error", "slip_velocity_error")}
    error = np.zeros(count) if errors["force_error"] is None else errors["force_error"]
    stuck = data["stuck"].to_numpy().astype(bool) if "stuck" in data else np.zeros(count, dtype=bool)
    for column, values in (*columns.items(), ("force_error", error), ("stuck", stuck)):
        if values.shape != (count,):
            raise InputError(f"{name}: {column} must have {count} samples, got the shape {values.shape}; measure again")
    if stuck.all():
        raise InputError(
            f"{name}: the record holds no slip, so nothing can be said about friction; take one in which the mass moves"
        )
    record = FrictionRecord(
        name=name,
        time=columns["time"],
        slip_velocity=columns["slip_velocity"],
        force=columns["force"],
        force_error=error,
        stuck=stuck,
        break_away=_table(tree, name),
        constants=_constants(data.attrs),
        attrs=dict(data.attrs),
        displacement=_column(data, "displacement", name) if "displacement" in data else None,
        recorded=data["recorded"].to_numpy().astype(float) if "recorded" in data else None,
        units=stated_units(data),
        slip_velocity_error=errors["slip_velocity_error"],
    )
    return record.facing_slip()


def _slips_alone(tree: xr.DataTree, name: str) -> FrictionRecord:
    """A record that is a table of break-aways and nothing else: its samples are those, all of them stuck.

    It says how static friction grows, and nothing of the friction of slip.
    """
    table = _table(tree, name)
    count = len(table)
    return FrictionRecord(
        name=name,
        time=table["t"].to_numpy(),
        slip_velocity=np.zeros(count),
        force=table["force"].to_numpy(),
        force_error=table["force_error"].to_numpy(),
        stuck=np.ones(count, dtype=bool),
        break_away=table,
        constants=_constants(tree.attrs),
        attrs={str(key): value for key, value in tree.attrs.items()},
        units=stated_units(tree.children["break_away"].to_dataset(inherit=False)),
    )


def _error(data: xr.Dataset, column: str, name: str) -> Array | None:
    """A column of standard errors, None where there is none."""
    if column not in data:
        return None
    error = _column(data, column, name)
    if error.shape != data["slip_velocity"].shape:
        raise InputError(f"{name}: {column} must have as many samples as slip_velocity; measure again")
    if not (error >= 0).all():
        raise InputError(f"{name}: {column} must not be negative, got {error.min():g}; measure again")
    return error


def _column(data: xr.Dataset, column: str, name: str) -> Array:
    if column not in data.variables:
        known = ", ".join(str(key) for key in data.variables) or "none"
        raise InputError(f"{name}: expected the variable {column!r}, found {known}; measure the record first")
    values = data[column].to_numpy()
    if values.ndim != 1:
        raise InputError(f"{name}: {column} must have the one dimension time, got shape {values.shape}")
    values = values.astype(float)
    if not np.isfinite(values).all():
        row = int(np.argmin(np.isfinite(values)))
        raise InputError(f"{name}: {column} is {values[row]} at sample {row}; remove or interpolate such samples")
    return values


def _table(tree: xr.DataTree, name: str) -> pd.DataFrame:
    # The child inherits the root's time: taken along it would make a table of events × samples.
    child = tree.children["break_away"].to_dataset(inherit=False) if "break_away" in tree.children else xr.Dataset()
    columns: dict[str, Array] = {}
    length = int(child.sizes.get("event", 0))
    for column in ROWS:
        columns[column] = child[column].to_numpy().astype(float) if column in child else np.full(length, np.nan)
        key = f"{column}_error"
        columns[key] = child[key].to_numpy().astype(float) if key in child else np.zeros(length)
    for key, values in columns.items():
        if values.shape != (length,):
            raise InputError(
                f"{name}: break_away: {key} must have {length} rows, got the shape {values.shape}; measure again"
            )
    table = pd.DataFrame(columns)
    if length and not np.isfinite(table["force"]).all():
        row = int(np.argmin(np.isfinite(table["force"].to_numpy())))
        raise InputError(f"{name}: break_away: force is not a number in row {row}; remove that row")
    return table


def _constants(attrs: Mapping[Any, Any]) -> dict[str, float]:
    known: dict[str, float] = {}
    for name, keys in {
        "mass": ("inertia", "mass"),
        "damping": ("damping",),
        "stiffness": ("stiffness",),
        "drive_velocity": ("drive_velocity",),
        "weight": ("weight",),
        "noise": ("noise",),
        "slip_cutoff": ("slip_cutoff",),
        "late": ("break_away_late",),
        "common": ("force_common",),
        "low_pass": ("low_pass",),
    }.items():
        for key in keys:
            try:
                value = float(attrs.get(key, np.nan))
            except (TypeError, ValueError):
                raise InputError(
                    f"friction record: {key} must be a number, got {attrs[key]!r:.60}; measure the record again"
                ) from None
            if np.isfinite(value):
                known[name] = value
                break
    return known
