"""The one shape of every measured friction: a tree of a time series and of tables, with notes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from stickslip import _core
from stickslip.files.units import unit_of

EVENT_COLUMNS = {"t": "time", "stick_time": "time", "force_rate": "force time^-1", "force": "force", "drop": "force"}
"""Of a table of break-aways, with their dimensions."""


def event_table(rows: Sequence[Sequence[float]], force: str = "N", time: str = "s") -> xr.Dataset:
    """Table of break-aways from rows of value, error, value, error, ... in the order of `EVENT_COLUMNS`, in these units."""
    values = np.array(rows, dtype=np.float64).reshape(-1, 2 * len(EVENT_COLUMNS))
    table = xr.Dataset()
    for i, (name, dimension) in enumerate(EVENT_COLUMNS.items()):
        unit = unit_of(dimension, force, time=time)
        table[name] = ("event", values[:, 2 * i], {"units": unit})
        table[f"{name}_error"] = ("event", values[:, 2 * i + 1], {"units": unit})
    return table


def facts_of_runs(sources: Sequence[str], force: Sequence[float]) -> dict[str, float]:
    """Force of each run by the name of its file, for a summary of several.

    >>> facts_of_runs(["a/one.csv", "a/two.csv"], [1.0, 2.0])
    {'force one': 1.0, 'force two': 2.0}
    """
    if len(sources) < 2:
        return {}
    stems = [Path(source).stem for source in sources]
    names = stems if len(set(stems)) == len(stems) else [f"{i}" for i in range(len(stems))]
    return {f"force {name}": float(value) for name, value in zip(names, force, strict=True)}


def friction_tree(
    *,
    series: Mapping[str, tuple[npt.NDArray[Any], str] | tuple[npt.NDArray[Any], str, str]],
    tables: Mapping[str, xr.Dataset],
    source: str,
    rig: str,
    notes: Sequence[str],
    facts: Mapping[str, float | str],
    constants: Mapping[str, float] | None = None,
) -> xr.DataTree:
    """Put a measured friction together.

    Parameters
    ----------
    series : name -> ((n,) values, unit) or ((n,) values, unit, long name), with `time` among them, or empty where the
        instrument gives tables only.
    tables : name of the child -> its table; ``break_away`` is added without rows where it is missing.
    source, rig, notes : provenance: file, rig as TOML, sentences.
    facts : numbers and words of the whole record; they become attributes and are what a summary prints.
    constants : further numbers that become attributes.
    """
    data = xr.Dataset()
    if series:
        data = data.assign_coords(time=("time", series["time"][0], {"units": series["time"][1]}))
        for name, (values, unit, *long_name) in series.items():
            if name != "time":
                named = {"long_name": long_name[0]} if long_name else {}
                data[name] = ("time", values, {} if values.dtype == bool else {"units": unit, **named})
    data.attrs = {
        "source": source,
        "rig": rig,
        "command": "stickslip measure",
        "version": _core.__version__,
        "notes": list(notes),
        "facts": list(facts),
        **facts,
        **(constants or {}),
    }
    children = {"break_away": event_table([]), **tables}
    return xr.DataTree.from_dict({"/": data, **{f"/{name}": table for name, table in children.items()}})


def facts(friction: xr.DataTree) -> dict[str, float | str]:
    """What a summary of a measured friction prints: its numbers and words by name, mass by mass where there are several."""
    if "facts" not in friction.attrs:
        parts = {name.removeprefix("mass_"): facts(child) for name, child in friction.children.items()}
        return {f"{mass} {name}": value for mass, part in parts.items() for name, value in part.items()}
    names = friction.attrs.get("facts", [])
    names = [names] if isinstance(names, str) else list(names)
    found: dict[str, float | str] = {}
    for name in names:
        value = friction.attrs[name]
        if isinstance(value, str):
            found[str(name)] = value
        elif np.isfinite(value):  # what the record does not tell is left out
            found[str(name)] = float(value)
    table = friction["break_away"].to_dataset() if "break_away" in friction.children else xr.Dataset()
    if table.sizes.get("event", 0):
        for name in ("stick_time", "force", "drop"):
            values = table[name].to_numpy()
            if np.isfinite(values).any():
                found[f"median_{name}"] = float(np.nanmedian(values))
    return found


def notes(friction: xr.DataTree) -> list[str]:
    """Everything that was assumed, corrected or found inconsistent, a sentence each, mass by mass."""
    if "notes" not in friction.attrs:
        parts = {name.removeprefix("mass_"): notes(child) for name, child in friction.children.items()}
        return [f"mass {mass}: {note}" for mass, part in parts.items() for note in part]
    return stated_notes(friction.attrs)


def stated_notes(attrs: Mapping[Any, Any]) -> list[str]:
    """The notes among the attributes of one record, of which a file holds a single one as a text."""
    return [str(note) for note in np.atleast_1d(attrs.get("notes", [])) if str(note)]
