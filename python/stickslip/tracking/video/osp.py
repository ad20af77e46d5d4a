"""Import of OSP Tracker: its projects (``.trk``, ``.trz``) and the tables it exports as text."""

from __future__ import annotations

import io
import math
import re
import struct
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np

from stickslip.errors import InputError
from stickslip.files.disk import read_bytes, read_text
from stickslip.tracking.motion import motion_dataset
from stickslip.tracking.scale.calibration import UNITS, Calibration

if TYPE_CHECKING:
    import xarray as xr

PROJECTS = (".trk", ".trz")
TEXTS = (".txt", ".csv", ".tsv", ".dat")

MOST_BYTES = 1 << 28
"""Of a project or a table."""
MOST_FRAMES = 10_000_000

CLICK_ERROR = 0.5
"""Standard error of a point set by hand, in px: a project says nothing of it, a click is a pixel wide."""


def read_osp(path: str | Path, *, click_error: float = CLICK_ERROR) -> xr.Dataset:
    """The motion in a project or text export of OSP Tracker (physlets.org/tracker).

    A project holds image points of each point mass, and the origin (x0, y0), angle θ and scale s (px per unit) of the
    axes; with u = (X − x0)/s and v = (y0 − Y)/s

        x = u cos θ + v sin θ,   y = v cos θ − u sin θ,

    y upwards. Time is start time + (frame − start frame) Δt. Axes that change from frame to frame are followed.

    Parameters
    ----------
    path : ``.trk`` or ``.trz``, or a text table with columns t, x, y (several masses side by side as Tracker writes them).
    click_error : standard error of the points in px; of a text table they are unknown and stay NaN.

    Returns
    -------
    A motion as :func:`stickslip.track` gives it, in m where the file says its unit (a text does not: taken as m).

    Raises
    ------
    InputError
        for a damaged archive, a project without point masses, a table that cannot be understood (with its row).
    """
    path = Path(path)
    if path.suffix.lower() in TEXTS:
        return _read_text(path)
    content = read_bytes(path, "project of OSP Tracker (.trk or .trz) or its text export", MOST_BYTES)
    if path.suffix.lower() == ".trz":
        try:
            with zipfile.ZipFile(io.BytesIO(content)) as archive:
                names = [name for name in archive.namelist() if name.lower().endswith(".trk")]
                if not names:
                    raise InputError(f"{path}: the archive holds no .trk project; save it again in Tracker")
                with archive.open(names[0]) as project:
                    content = project.read(MOST_BYTES)
        except (zipfile.BadZipFile, zlib.error, EOFError, OSError, RuntimeError, ValueError, struct.error) as error:
            raise InputError(f"{path}: not a whole .trz archive ({error}); copy it again") from None
    try:
        root = ElementTree.fromstring(content)
    except (ElementTree.ParseError, ValueError, LookupError) as error:  # the last two for an encoding that there is not
        raise InputError(f"{path}: not a whole Tracker project ({error}); save it again in Tracker") from None
    return _read_project(path, root, click_error)


def _read_project(path: Path, root: ElementTree.Element, click_error: float) -> xr.Dataset:
    panel = next((item for item in root.iter("object") if _kind(item) == "TrackerPanel"), None)
    if panel is None:
        raise InputError(f"{path}: no tracker panel in this project; save it again in Tracker")
    masses = [item for item in panel.iter("object") if _kind(item) == "PointMass"]
    points = [_points(path, mass) for mass in masses]
    kept = [(mass, table) for mass, table in zip(masses, points, strict=True) if table]
    if not kept:
        raise InputError(f"{path}: the project holds no point mass with points; autotrack or mark one in Tracker")
    clip = next((item for item in panel.iter("object") if _kind(item) == "VideoClip"), None)
    start, step = _whole(path, clip, "startframe", 0), max(1, _whole(path, clip, "stepsize", 1))
    control = next((item for item in panel.iter("object") if _kind(item).endswith("ClipControl")), None)
    interval = 1e-3 * _value(control, "delta_t", math.nan)
    notes = []
    if not interval > 0:
        raise InputError(f"{path}: the project says no time between frames (delta_t); save it again with its video")
    begin = 1e-3 * _value(clip, "starttime", 0.0)
    frames = sorted({frame for _, table in kept for frame in table})
    axes = _axes(path, panel)
    if not axes:
        notes.append("The project has no axes: coordinates are pixels from the top left.")
    if (frames[-1] - frames[0]) // step > MOST_FRAMES:
        raise InputError(f"{path}: points from frame {frames[0]} to {frames[-1]}, more than a film has; save it again")
    frames = list(range(frames[0], frames[-1] + 1, step))
    shape = len(frames), len(kept)
    x, y = np.full(shape, np.nan), np.full(shape, np.nan)
    for column, (_, table) in enumerate(kept):
        for row, frame in enumerate(frames):
            x[row, column], y[row, column] = table.get(frame, (np.nan, np.nan))
    lost = np.where(np.isnan(x), "not marked in the project", "").astype(object)
    error = np.where(np.isnan(x), np.nan, click_error)
    times = begin + interval * (np.array(frames) - start)
    unit = _text(panel, "length_unit") or "m"
    if unit not in UNITS:
        notes.append(f"The project's length unit {unit!r} is not known; taken as m.")
        unit = "m"
    factor = UNITS[unit]
    maps = [_calibration(axes, frame, factor) for frame in frames]
    motion = motion_dataset(times, x, y, error, error, lost, maps[0], source=str(path), frame_rate=1 / interval)
    if len(set(maps)) > 1:  # axes that move with the camera
        for row, calibration in enumerate(maps):
            motion["x"][row], motion["y"][row] = calibration.to_world(x[row], y[row])
        notes.append("The axes change from frame to frame; the calibration kept is that of the first.")
    names = [_text(mass, "name") or f"mass {i}" for i, (mass, _) in enumerate(kept)]
    motion = motion.assign_coords(name=("mass", names), frame=("time", frames))
    scale = axes[min(axes)].scale if axes else 1.0
    notes.append(
        f"Scale {scale:.6g} px per {unit} from the project, origin and angle too; a point set by hand is taken to be "
        f"known to {click_error:g} px."
    )
    notes.append("The scale is as good as its author's tape: check it where a known length or a free fall is seen.")
    motion.attrs["notes"] = notes
    return motion


@dataclass(frozen=True)
class _Axes:
    x: float
    y: float
    angle: float
    scale: float
    scale_y: float


def _axes(path: Path, panel: ElementTree.Element) -> dict[int, _Axes]:
    system = next((item for item in panel.iter("object") if _kind(item) == "ImageCoordSystem"), None)
    axes = {}
    for frame, item in _frame_data(system):
        names = ("xorigin", "yorigin", "angle", "xscale", "yscale")
        axes[frame] = _Axes(*(_value(item, name, 1.0 if "scale" in name else 0.0) for name in names))
        if not (axes[frame].scale > 0 and axes[frame].scale_y > 0):
            raise InputError(f"{path}: the scale of frame {frame} must be positive, got {axes[frame].scale:g}")
    return axes


def _calibration(axes: dict[int, _Axes], frame: int, factor: float) -> Calibration:
    if not axes:
        return Calibration(unit="px")
    before = [key for key in axes if key <= frame] or [min(axes)]
    a = axes[max(before)]
    return Calibration(origin=(a.x, a.y), angle=a.angle, coefficients=(0.0, factor / a.scale))


def _points(path: Path, mass: ElementTree.Element) -> dict[int, tuple[float, float]]:
    points = {}
    for frame, item in _frame_data(mass):
        x, y = _value(item, "x", math.nan), _value(item, "y", math.nan)
        if not (math.isfinite(x) and math.isfinite(y)):
            raise InputError(f"{path}: frame {frame} of {_text(mass, 'name')!r} holds no finite point; mark it again")
        points[frame] = (x, y)
    return points


def _frame_data(owner: ElementTree.Element | None) -> list[tuple[int, ElementTree.Element]]:
    """Numbered objects of the property ``framedata``."""
    data = _property(owner, "framedata")
    pairs = []
    for item in [] if data is None else data.findall("property"):
        index = re.fullmatch(r"\[(\d{1,9})\]", item.get("name", ""))
        child = item.find("object")
        if index is not None and child is not None:
            pairs.append((int(index.group(1)), child))
    return pairs


def _kind(item: ElementTree.Element) -> str:
    return item.get("class", "").rsplit(".", 1)[-1]


def _property(owner: ElementTree.Element | None, name: str) -> ElementTree.Element | None:
    if owner is None:
        return None
    return next((item for item in owner.findall("property") if item.get("name") == name), None)


def _text(owner: ElementTree.Element | None, name: str) -> str:
    found = _property(owner, name)
    return (found.text or "").strip() if found is not None else ""


def _value(owner: ElementTree.Element | None, name: str, default: float) -> float:
    try:
        return float(_text(owner, name))
    except ValueError:
        return default


def _whole(path: Path, owner: ElementTree.Element | None, name: str, default: int) -> int:
    value = _value(owner, name, default)
    if not abs(value) < 2**31:
        raise InputError(f"{path}: {name} must be the number of a frame, got {value:g}; save it again in Tracker")
    return int(value)


def _read_text(path: Path) -> xr.Dataset:
    lines = read_text(path, "text export of OSP Tracker", MOST_BYTES).splitlines()
    header, cells, delimiter = -1, [""], "\t"
    for row, line in enumerate(lines):
        for mark in ("\t", ";", ",", None):
            words = [word.strip().strip('"').lower() for word in line.split(mark)]
            if {"t", "x", "y"} <= set(words):
                header, cells, delimiter = row, words, mark or " "
                break
        if header >= 0:
            break
    if header < 0:
        raise InputError(f"{path}: no header line with t, x and y found; export these columns from Tracker")
    xs, ys = ([i for i, word in enumerate(cells) if word == name] for name in "xy")
    if len(xs) != len(ys):
        raise InputError(
            f"{path}: row {header + 1} names {len(xs)} x and {len(ys)} y columns; export both of each mass"
        )
    titles = [word.strip().strip('"') for word in lines[header - 1].split(None if delimiter == " " else delimiter)]
    titles = [] if header == 0 else [word for word in titles if word and not word.startswith("#")]
    names = titles if len(titles) == len(xs) else [f"mass {i}" for i in range(len(xs))]
    rows: list[list[float]] = []
    for row, line in enumerate(lines[header + 1 :], start=header + 2):
        if not line.strip():
            continue
        words = line.split(None if delimiter == " " else delimiter)
        words += [""] * (len(cells) - len(words))
        values = []
        for column in (cells.index("t"), *xs, *ys):
            word = words[column].strip().strip('"')
            if delimiter != ",":
                word = word.replace(",", ".")  # decimal comma of some locales
            try:
                values.append(float(word) if word else math.nan)
            except ValueError:
                raise InputError(
                    f"{path}: row {row}, column {cells[column]!r} must be a number, got {word!r}"
                ) from None
        if not math.isfinite(values[0]):
            raise InputError(f"{path}: row {row} has no finite time; remove the row or export again")
        if rows and values[0] <= rows[-1][0]:
            raise InputError(
                f"{path}: row {row}: time {values[0]:g} s does not follow {rows[-1][0]:g} s; remove the duplicate"
            )
        rows.append(values)
    if not rows:
        raise InputError(f"{path}: a header but no rows; export the table again")
    table = np.array(rows)
    count = len(xs)
    x, y = table[:, 1 : 1 + count], table[:, 1 + count :]
    unknown = np.full(x.shape, np.nan)
    lost = np.where(np.isnan(x) | np.isnan(y), "not in the table", "").astype(object)
    note = "The table says no unit and no errors: lengths are taken as m, errors are unknown."
    motion = motion_dataset(
        table[:, 0], x, y, unknown, unknown, lost, Calibration(notes=(note,)), source=str(path), frame_rate=math.nan
    )
    motion["x"].data, motion["y"].data = x, y  # already world coordinates, y upwards
    return motion.drop_vars(["x_px", "y_px"]).assign_coords(name=("mass", names))
