"""Assemble the page: one HTML file with script, core, laws, presets and a state inside, that asks no network for anything."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip import _core
from stickslip.errors import InputError
from stickslip.explorer import catalogue
from stickslip.explorer.packing import packed, text_of
from stickslip.files.disk import input_file, read_toml
from stickslip.laws import BogaczRyczek, Law, load_law
from stickslip.model.system import Oscillator, System
from stickslip.model.system_file import load_system_document

if TYPE_CHECKING:
    from stickslip.identification.records import FrictionRecord

#: The units of a system in SI.
_SI = {"time": "s", "length": "m", "velocity": "m/s", "force": "N"}
#: Damping and drive of the rig on which a law file is shown.
_RIG = {"mass": 1.0, "stiffness": 1.0, "damping": 0.1, "drive_velocity": 0.2}


def presets() -> dict[str, Any]:
    """The states to begin with, each with its source, by name.

    >>> presets()["stick-slip"]["state"]["system"]["drive_velocity"]
    0.2
    """
    return {
        name: {**{key: row[key] for key in ("title", "group", "source")}, "state": _state(row)}
        for name, row in described_presets().items()
    }


def described_presets() -> dict[str, Any]:
    """What ``presets.json`` says: where a preset names no law it has the paper's, with `change`; `checked` is its motion.

    `units` are those that differ from SI units of a mass that slides.
    """
    described: dict[str, Any] = json.loads(_shipped("presets.json"))
    return described


def _state(row: Mapping[str, Any]) -> dict[str, Any]:
    law = Law.from_dict(row["law"]) if "law" in row else replace(BogaczRyczek(), **row.get("change", {}))
    amplitude, frequency = row.get("forcing", (0.0, 1.0))
    system = {
        "mass": row.get("mass", 1.0),
        "stiffness": row.get("stiffness", 1.0),
        "damping": row["damping"],
        "drive_velocity": row["drive_velocity"],
        "law": catalogue.full(law),
        "forcing": [{"amplitude": amplitude, "frequency": frequency, "phase": 0.0}] if amplitude else [],
        "normal_force": None,
        "springs": [],
    }
    state: dict[str, Any] = {"system": system, "t_end": row.get("t_end", 150.0)}
    if not system["mass"] == system["stiffness"] == 1:
        state["units"] = {**_SI, **row.get("units", {})}
    if "masses" in row:
        state["chain"] = {"masses": row["masses"], "coupling": row.get("coupling", 1.0)}
    if "diagram" in row:
        state["diagram"] = row["diagram"]
    return state


def content_of(path: str | Path, *more: str | Path) -> dict[str, Any]:
    """What :func:`page` takes to show a file: its `state` and, of friction files, their `records`.

    Parameters
    ----------
    path : a law file, a system file of one mass with a constant drive, an orbit of such a system or a friction record
        (netCDF), or a lesson (Markdown, as those in the folder ``lessons`` of this package).
    more : friction records, to be fitted together with the first.

    Raises
    ------
    InputError
        for a file that is none of these, or holds what the page cannot show.
    """
    path = Path(path)
    if more or path.suffix == ".nc":
        from stickslip.files.netcdf import read_tree

        paths = [path, *map(Path, more)]
        trees = [read_tree(one) for one in paths]
        others = [one for one, tree in zip(paths, trees, strict=True) if "break_away" not in tree.children]
        if not others:
            return _measured(paths, trees)
        if more:
            raise InputError(f"{others[0]}: expected a friction record beside others, got another file; give it alone")
        return {"state": _simulated(path)}
    if path.suffix == ".md":
        return {"lessons": [input_file(path, "lesson").read_text(encoding="utf-8")]}
    return {"state": _described(path)}


def _described(path: Path) -> dict[str, Any]:
    document = read_toml(path)
    if "damping" not in document and "law" in document:
        law = load_law(path)
        drive = 0.2
        shown = _shown(Oscillator(_RIG["damping"], drive, law), {}, str(path))
        # The rig is ours, the law may be in any unit.
        return {**shown, "units": dict.fromkeys(_SI, "")} if document.get("units") else shown
    system, settings = load_system_document(path)
    return _shown(system, settings, str(path))


def _simulated(path: Path) -> dict[str, Any]:
    from stickslip.simulation.orbit import load

    orbit = load(path)
    return _shown(orbit.system, {"t_end": float(orbit.t_end), **_start(orbit)}, str(path))


def _measured(paths: Sequence[Path], trees: Sequence[Any]) -> dict[str, Any]:
    from stickslip.explorer.record import record_of
    from stickslip.identification.records import read_records

    found = read_records(list(trees))
    content = content_of_record(found[0], str(paths[0]))
    content["records"] += [record_of(one, str(path)) for one, path in zip(found[1:], paths[1:], strict=True)]
    return content


def content_of_record(found: FrictionRecord, path: str, law: Law | None = None) -> dict[str, Any]:
    """What :func:`page` takes to show a record under a law, on the rig it was measured with; default a law to begin with."""
    from stickslip.explorer.record import first_law, record_of

    record = record_of(found, path)
    rig = {name: float(found.constants.get(name, value)) for name, value in _RIG.items()}
    oscillator = Oscillator(
        rig["damping"], rig["drive_velocity"], law or first_law(record), mass=rig["mass"], stiffness=rig["stiffness"]
    )
    stick = max([time for time, _, _ in record["breaks"]], default=0.0)
    t_end = 25 * oscillator.natural_period + 8 * stick
    state = _shown(oscillator, {"t_end": t_end}, path)
    return {"state": {**state, "units": _units(found.units)}, "records": [record]}


def _units(stated: Mapping[str, str]) -> dict[str, str]:
    """The units of what the page shows, from those that a record states; empty where it states none.

    >>> _units({"time": "s", "slip_velocity": "rad/s", "force": "1"})
    {'time': 's', 'length': 'rad', 'velocity': 'rad/s', 'force': 'dimensionless'}
    """
    velocity = stated.get("slip_velocity", "")
    units = {"time": stated.get("time", ""), "length": velocity.partition("/")[0], "velocity": velocity}
    units["force"] = stated.get("force", "")
    return {name: "dimensionless" if unit == "1" else unit for name, unit in units.items()}


def content_of_system(system: Oscillator, t_end: float) -> dict[str, Any]:
    """What :func:`page` takes to show a system."""
    return {"state": _shown(system, {"t_end": t_end}, "the system")}


def _start(orbit: Any) -> dict[str, Any]:
    x0, v0, _, _ = orbit._core.run
    return {"x0": x0 and x0[0], "v0": v0 and v0[0]}


def _shown(system: Oscillator | System, settings: Mapping[str, Any], where: str) -> dict[str, Any]:
    if isinstance(system, System):
        raise InputError(
            f"{where}: expected a system of one mass, got {system.masses} masses; the page makes chains of two to five "
            "from one mass, and `stickslip simulate` runs any system"
        )
    if not isinstance(system.drive_velocity, float):
        raise InputError(
            f"{where}: expected a constant drive velocity, got one that varies; run it by `stickslip simulate`"
        )
    document = {
        "mass": system.mass,
        "stiffness": system.stiffness,
        "damping": system.damping,
        "drive_velocity": system.drive_velocity,
        "law": catalogue.full(system.law),
        "forcing": [harmonic.to_dict() for harmonic in system.harmonics],
        "normal_force": system.normal_force and catalogue.whole(system.normal_force),
        "springs": [catalogue.whole(spring) for spring in system.springs],
    }
    one = {name: None if settings.get(name) is None else [float(settings[name])] for name in ("x0", "v0")}
    speed = abs(system.drive_velocity)
    t_end = settings.get("t_end", 25 * system.natural_period)
    return {
        "preset": "",
        "system": document,
        "start": one,
        "t_end": float(t_end),
        "units": dict.fromkeys(_SI, "dimensionless") if system.mass == system.stiffness == 1 else _SI,
        "diagram": {"over": "drive_velocity", "low": 0.1 * speed, "high": 3 * speed or 1.0},
    }


def shipped_lessons() -> list[str]:
    """The lessons of the package, in their order.

    >>> len(shipped_lessons())
    7
    """
    folder = files("stickslip.explorer").joinpath("lessons")
    ordered = sorted((item for item in folder.iterdir() if item.name.endswith(".md")), key=lambda item: item.name)
    return [item.read_text(encoding="utf-8") for item in ordered]


def _shipped(name: str) -> str:
    return files("stickslip.explorer").joinpath(name).read_text(encoding="utf-8")


@cache
def _page() -> tuple[str, str, str]:
    """The page without its data and its style, the style of panels, which stands in it, and its own, which it holds packed.

    Both styles are without the spaces that only people read.
    """
    text = _shipped("page.html")
    panels, own = map(_dense, re.findall(r"(?s)<style[^>]*>(.*?)</style>", text))
    # Nothing is seen before its style is there.
    styles = f"<style>{panels}</style><style>body{{visibility:hidden}}</style>"
    return re.sub(r"(?s)<style.*</style>", lambda _: styles, text), panels, own


def _dense(style: str) -> str:
    for spaced, dense in (
        (r"\s*\n\s*", ""),
        (r"([{;]) +", r"\1"),
        (r" +([{}])", r"\1"),
        (r"(?<=[a-z]): +", ":"),
        (r", +", ","),
        (r";\}", "}"),
        (r" *> *", ">"),
        (r"(?<![\d.])0\.(?=\d)", "."),
    ):
        style = re.sub(spaced, dense, style)
    return style


def _json(document: object) -> str:
    """JSON that cannot end the element it stands in."""
    return json.dumps(document, ensure_ascii=False, separators=(",", ":")).replace("<", "\\u003c")


def page(
    state: Mapping[str, Any] | None = None,
    records: Sequence[Mapping[str, Any]] | None = None,
    lessons: Sequence[str] | None = None,
) -> str:
    """The explorer as one HTML page.

    Parameters
    ----------
    state, records, lessons : what it shows first, as :func:`content_of` makes them; default the first preset, no record, and
        the lessons of the package.

    >>> page().startswith("<!doctype html>")
    True
    """
    text, _, style = _page()
    parts = {
        'id="data"><': f'id="data">{_data(lessons or shipped_lessons(), style)}<',
        'id="state">null<': f'id="state">{_json(state)}<',
        'id="records">null<': f'id="records">{_json(records)}<',
        'id="core"><': f'id="core">{_core_packed()}<',
        'id="program"><': f'id="program">{_program_packed()}<',
        'id="boot"><': f'id="boot">{_shipped("boot.js")}<',
    }
    for slot, filled in parts.items():
        text = text.replace(slot, filled, 1)
    return text


def live(content: Mapping[str, Any], panels: str, still: str) -> str:
    """A ``<stick-slip>`` element: where scripts run, a live figure in place of its still picture; see :func:`program`.

    Parameters
    ----------
    content : what it shows, as of :func:`content_of`.
    panels : names of panels, parted by commas: rig, law, phase, displacement, spectrum, surface.
    still : the HTML of the picture that stands there until it is seen, and where scripts are off.
    """
    return (
        f'<stick-slip panels="{panels}"><script type="application/json">{_json(content)}</script>{still}</stick-slip>'
    )


def program() -> str:
    """What a page with elements of :func:`live` needs once, at its end: style, script, core and the laws."""
    return (
        f'<style>{_page()[1]}</style><script type="application/octet-stream" id="data">{_data([])}</script>'
        f'<script type="application/octet-stream" id="core">{_core_packed()}</script>'
        f'<script type="application/octet-stream" id="program">{_program_packed()}</script>'
        f"<script>{_shipped('boot.js')}</script>"
    )


def _data(lessons: Sequence[str], style: str = "") -> str:
    document = {
        "version": _core.__version__,
        "laws": catalogue.laws(),
        "oscillator": catalogue.oscillator(),
        "presets": presets(),
        "lessons": list(lessons),
        "style": style,
    }
    return text_of(packed(_json(document).encode()))


@cache
def _program_packed() -> str:
    return text_of(packed(_shipped("explorer.js").encode()))


@cache
def _core_packed() -> str:
    return text_of(files("stickslip.explorer").joinpath("core.wasm.lzma").read_bytes())
