"""What is made of one record of an experiment: motion, friction, break-aways and pictures, in a folder of its own."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip.errors import InputError
from stickslip.files.disk import write_whole
from stickslip.files.netcdf import write_netcdf

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

FILMS = (".avi", ".mp4", ".mkv", ".mov", ".m4v", ".mpg", ".mpeg", ".wmv", ".webm", ".tif", ".tiff", ".trk", ".trz")
"""Endings of what is tracked before it is measured; folders of images are too."""


def measured_record(path: Path, rig: Any, setup: Any, folder: Path, mark: str) -> dict[str, Any]:
    """Measure one record into its folder; its row. Runs in a process of its own, where nothing may stop the others."""
    try:
        return {"state": "measured", "message": "", **_make(path, rig, setup, folder, mark)}
    except InputError as error:
        return {"state": "failed", "message": str(error)}
    except Exception as error:  # noqa: BLE001 a fault of ours in one record must not cost the other fifty-nine
        return {"state": "failed", "message": f"{path}: {type(error).__name__}: {' '.join(str(error).split())}"}


def _make(path: Path, rig: Any, setup: Any, folder: Path, mark: str) -> dict[str, Any]:
    import xarray as xr

    from stickslip.measurement import InstrumentRig, facts, load_rig, measure, motion, notes
    from stickslip.measurement.masses import masses_of
    from stickslip.measurement.summary import texts_and_units

    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.iterdir():
        if old.name in RESULTS or old.name.startswith(("friction-", "motion-")):
            old.unlink()
    record: Any = path
    if path.is_dir() or path.suffix.lower() in FILMS:
        from stickslip.tracking import track

        record = track(path, setup, output=folder / "motion.nc")
    known_rig = load_rig(rig)
    friction = measure(record, known_rig)
    write_netcdf(folder / "friction.nc", friction)
    from stickslip import show  # what draws is loaded for what was measured: it takes as long as all else

    parts = {"": friction} if "notes" in friction.attrs else dict(friction.children)
    for name, part in parts.items():
        end = name.replace("mass_", "-")
        _draw(
            show.friction_record(xr.DataTree(part.to_dataset(), children=dict(part.children)))[0],
            folder / f"friction{end}.png",
        )
    if not isinstance(known_rig, InstrumentRig):
        moved = motion(record, known_rig)
        masses = {f"-{label}": one for label, one in (masses_of(moved) or {}).items()} or {"": moved}
        for end, one in masses.items():
            _draw(show.motion_figure(one)[0], folder / f"motion{end}.png")
    events = _events(parts)
    write_whole(folder / "break_away.csv", lambda draft: events.to_csv(draft, index=False))
    found = {**facts(friction), "notes": " ".join(notes(friction))}
    plain = {name: value if isinstance(value, str) or math.isfinite(value) else None for name, value in found.items()}
    done = {"mark": mark, "facts": plain, "texts": texts_and_units(friction)}
    write_whole(folder / "finished.json", lambda draft: draft.write_text(json.dumps(done)))
    return {**plain, "texts": done["texts"]}


def _draw(ax: Axes, path: Path) -> None:
    """Write the picture that holds these axes, and close it."""
    import matplotlib.pyplot as plt

    whole = ax.get_figure(root=True)
    assert whole is not None
    write_whole(path, lambda draft: whole.savefig(draft, format="png", dpi=110))
    plt.close(whole)


RESULTS = ("motion.nc", "friction.nc", "friction.png", "motion.png", "break_away.csv", "finished.json")
"""What lies in the folder of a record."""


def _events(parts: Mapping[str, Any]) -> pd.DataFrame:
    """The break-aways of all masses, with the units in the heads of the columns."""
    import pandas as pd

    tables = []
    for name, part in parts.items():
        if "break_away" in part.children:
            data = part["break_away"].to_dataset(inherit=False)
            units = {str(key): str(column.attrs.get("units", "")) for key, column in data.variables.items()}
            table = data.to_dataframe().rename(columns=lambda key, units=units: column_head(key, units))
            tables.append(table.assign(mass=name.removeprefix("mass_")) if name else table)
    return pd.concat(tables) if tables else pd.DataFrame()


def column_head(name: str, units: Mapping[str, str]) -> str:
    """The head of a column, with its unit; an error has that of its value."""
    from stickslip.measurement.summary import values_of

    unit = next((units[one] for one in (name, *values_of(name)) if one in units), "")
    return f"{name} [{unit}]" if unit else name
