"""Damage whole files and documents in every way and read them: nothing but `InputError` may come of it.

python docs/evidence/readers.py --each 10000          # writes readers.md beside this file
python docs/evidence/readers.py --only matlab --each 1000000 --seed 2 -o page.md
python docs/evidence/readers.py --again matlab:1:4711 # one input of the page, with its traceback
"""

from __future__ import annotations

import argparse
import collections
import copy
import functools
import io
import itertools
import json
import math
import os
import random
import signal
import struct
import subprocess
import sys
import tempfile
import time
import tomllib
import traceback
import warnings
import zipfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import stickslip as ss
from stickslip.laws import Law

PAGE = Path(__file__).with_suffix(".md")
ROOT = Path(__file__).parents[2]
LONGEST = 100
"""Seconds after which an input counts as one that hangs: more than a reader grants a file, on a machine that is busy."""
MEMORY = 4 << 30
"""Bytes that the process which reads may have: an input that asks for more fails."""
CHUNK = 20_000
"""Inputs of one process."""

N = 120
T = np.arange(N) / 50
X = np.sin(6 * T) + 0.3 * np.sin(17 * T)
RIG = {"instrument": "displacement", "column": "x", "unit": "m", "stiffness": 40.0, "mass": 1.0, "drive_velocity": 10.0}
WORDS = [
    *("nan", "inf", "-1", "0", "1e999", "-1e-320", "1" * 5000, "[" * 3000, '"', "'", "=", ",", ";", "\n", "\t", "", "_"),
    *("true", "{}", "\0", "µ", "\ufeff", "1e308", "2026-01-01", "#", "$x$", "..", "0x7fffffff", "9223372036854775808"),
]  # fmt: skip
VALUES: list[Any] = [
    *(None, True, -1, 0, 3, 1e308, -1e308, 5e-324, 1e-300, 1e150, math.nan, math.inf, 10**400, "", "x", "1 m", "nan m", "\0"),
    *(b"x", [], {}, [[]], [None], [1, 2], [1, 2, 3], [[0, 1], [1, 2]], [[0, 1], [1e-300, 2]], [["a"]], {"type": "Coulomb"}),
]  # fmt: skip


@dataclass(frozen=True)
class Target:
    """A reader: whole inputs, how their files end, and what reads them and looks at what was read."""

    inputs: Callable[[], list[Any]]
    ending: str
    read: Callable[[Path | Any, random.Random], object]


# --- damage -------------------------------------------------------------------------------------------------------


def spoil_bytes(data: bytes, rng: random.Random) -> bytes:
    """A copy with one to eight pieces changed, lost, doubled, moved or cut off."""
    spoilt = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 3, 8))):
        at = rng.randrange(len(spoilt) + 1)
        end = min(len(spoilt), at + rng.choice((1, 1, 2, 4, 8, 100)))
        match rng.randrange(8):
            case 0 if at < len(spoilt):
                spoilt[at] ^= 1 << rng.randrange(8)
            case 1:
                spoilt[at:end] = rng.randbytes(end - at)
            case 2:
                spoilt[at:end] = rng.choice((b"\0", b"\xff", b"\x7f", b"\x80")) * (end - at)
            case 3:
                del spoilt[at:end]
            case 4:
                spoilt[at:at] = spoilt[at:end]
            case 5:
                word = rng.choice(WORDS).encode()
                spoilt[at : min(end, at + len(word))] = word
            case 6 if rng.random() < 0.3:
                del spoilt[at:]
            case _ if len(spoilt) >= 8:
                at = rng.randrange(len(spoilt) - 7)
                number = rng.choice((0, 1, -1, 2**31 - 1, -(2**31), rng.getrandbits(31), rng.randrange(300)))
                spoilt[at : at + 4] = struct.pack(rng.choice("<>") + "i", number)
    return bytes(spoilt)


def spoil_document(document: Any, rng: random.Random) -> Any:
    """A copy with one to three of its values replaced, scaled, lost or doubled under a new name."""
    document = copy.deepcopy(document)
    for _ in range(rng.choice((1, 1, 2, 3))):
        places = list(_places(document))
        if not places:
            return document
        owner, key = rng.choice(places)
        match rng.randrange(5):
            case 0 | 1:
                owner[key] = copy.deepcopy(rng.choice(VALUES))
            case 2 if isinstance(owner[key], float | int) and abs(owner[key]) < 1e300:
                owner[key] = float(owner[key]) * rng.choice((-1.0, 0.0, 1e-300, 1e-30, 1e30, 1e150, 1e300))
            case 3:
                del owner[key]
            case _ if isinstance(owner, dict):
                owner[f"{key}{rng.choice(('', 's', '_', '.x'))}"] = owner.pop(key)
    return document


def _places(document: Any) -> Iterator[tuple[Any, Any]]:
    items = (
        document.items() if isinstance(document, dict) else enumerate(document) if isinstance(document, list) else ()
    )
    for key, value in list(items):
        yield document, key
        yield from _places(value)


# --- whole inputs -------------------------------------------------------------------------------------------------


def _file(write: Callable[[Path], object], ending: str) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"whole{ending}"
        write(path)
        return path.read_bytes()


def texts() -> list[bytes]:
    """Tables with a header, with commas, tabs, blanks or semicolons."""
    marks = (",", "\t", " ", ";")
    rows = [[f"{t:.4g}{mark}{x:.5g}" for t, x in zip(T, X, strict=True)] for mark in marks]
    plain = ["\n".join([f"t{mark}x", *lines]) for mark, lines in zip(marks, rows, strict=True)]
    decimal = plain[3].replace(".", ",")
    return [text.encode() for text in (*plain, decimal)] + [decimal.encode("utf-16")]


def json_rows() -> list[bytes]:
    """Rows as lists and as objects."""
    rows = [[float(f"{t:.4g}"), float(f"{x:.5g}")] for t, x in zip(T, X, strict=True)]
    named = [{"t": t, "x": x} for t, x in rows]
    return [json.dumps(document).encode() for document in ({"data": rows}, {"data": named}, rows)]


def looks() -> list[bytes]:
    """Two columns under 16 and under 32 heads."""
    files = []
    for heads in (16, 32):
        head = b"p001".ljust(20, b"\0") + struct.pack(">4i", N, 2, 0, 0)
        for i in range(heads):
            name = (b"t", b"x")[i] if i < 2 else b"no_val"
            head += (
                name.ljust(13, b"\0")
                + b"s".ljust(13, b"\0")
                + bytes(4)
                + bytes(50)
                + struct.pack(">i", N if i < 2 else 0)
            )
        files.append(head + np.array([T, X], ">f4").tobytes())
    return files


def matlabs() -> list[bytes]:
    """Vectors, matrices, cells, structures and words, of version 4 and 5, packed or not."""
    from scipy.io import savemat

    cells = np.empty((1, 3), object)
    cells[0] = [T[:40, None], T[40:80, None], T[80:, None]]
    structures = np.array([(T[:60], X[:60]), (T[60:], X[60:])], [("t", object), ("x", object)])
    contents: list[tuple[dict[str, Any], dict[str, Any]]] = [
        ({"t": T, "x": X, "name": "slider"}, {}),
        ({"t": T, "x": X}, {"format": "4"}),
        ({"t": cells, "x": X.astype("f4"), "k": np.arange(N, dtype="u1")}, {}),
        ({"run": {"t": T, "x": X, "note": "MPa"}, "Y": np.array([T, X])}, {"do_compression": True}),
        ({"segments": structures, "z": X + 1j, "flag": np.array([True])}, {}),
    ]
    return [_file(lambda path, a=a, b=b: savemat(path, a, **b), ".mat") for a, b in contents]


def motions() -> list[bytes]:
    """Motions of one and of two masses."""
    import xarray as xr

    time = {"t": ("t", T, {"units": "s"})}
    one = xr.Dataset(
        {"x": ("t", X, {"units": "m"}), "note": ("t", ["on belt"] * N)}, coords=time, attrs={"source": "film"}
    )
    two = xr.Dataset({"x": (("time", "mass"), np.array([X, 2 * X]).T)}, coords={"time": T, "mass": [0, 1]})
    return [_file(lambda path, data=data: data.to_netcdf(path, engine="h5netcdf"), ".nc") for data in (one, two)]


def orbits() -> list[bytes]:
    """One in closed form, one of two masses, one of a smooth law."""
    static = ss.laws.StaticKinetic(1.0, 0.6)
    systems = (
        ss.paper.oscillator(0.2),
        ss.chain(2, static, 0.2),
        ss.Oscillator(0.1, 0.2, ss.laws.Lorentzian(1.0, 0.5, 0.3)),
    )
    return [_file(ss.simulate(system, t_end=30).save, ".nc") for system in systems]


def frictions() -> list[bytes]:
    """A measured record, and a table of break-aways alone."""
    from stickslip.identification.synthetic import friction_of_orbit

    tree = friction_of_orbit(
        ss.simulate(ss.paper.oscillator(0.2), t_end=60), np.arange(20, 60, 0.25), displacement_noise=1e-3
    )
    alone = tree["break_away"].to_dataset(inherit=False)
    import xarray as xr

    table = xr.DataTree.from_dict({"/": xr.Dataset(attrs=tree.attrs), "/break_away": alone})
    return [_file(lambda path, part=part: part.to_netcdf(path, engine="h5netcdf"), ".nc") for part in (tree, table)]


def rigs() -> list[bytes]:
    """Those of the examples."""
    return [path.read_bytes() for path in sorted((ROOT / "python" / "stickslip" / "examples" / "rigs").glob("*.toml"))]


def law_documents() -> list[dict[str, Any]]:
    """An example of every law."""
    return [kind.example().to_dict() for kind in Law.ALL.values()]


def system_documents() -> list[dict[str, Any]]:
    """Oscillators under every law, one under a moved drive, and a chain."""
    drive = ss.Drive(0.1, ss.Harmonic(1, 1), [(0, 1), (1, 2)])
    coulomb = ss.laws.Coulomb(1.0)
    systems = [ss.Oscillator(0.1, 0.2, kind.example(), forcing=ss.Harmonic(0.1, 1.25)) for kind in Law.ALL.values()]
    systems += [ss.Oscillator(0.1, drive, coulomb, forcing=[ss.Harmonic(1, 1), ss.Harmonic(1, 2)])]
    contacts = [ss.Contact(0, coulomb, drive), ss.Contact(1, coulomb, other=0)]
    return [
        *(one.to_dict() for one in systems),
        ss.System([1, 1], [[2, -1], [-1, 2]], 0.1, contacts, ss.Force(1, 1)).to_dict(),
    ]


def toml(documents: Callable[[], list[dict[str, Any]]], wrap: str = "") -> list[bytes]:
    """Documents as the text of their files."""
    import tomli_w

    return [tomli_w.dumps({wrap: document} if wrap else document).encode() for document in documents()]


def setups() -> list[bytes]:
    """What to look for in a film."""
    text = """finder = "blob"
masses = 2
marker = "#ff8800"
size = 12.5
region = [0, 0, 100.0, 80]
start = [[10, 20], [30.5, 40]]
names = ["a", "b"]
frame_rate = 25
[calibration]
points = [[10, 20], [110, 20.5]]
length = 0.3
unit = "m"
lens = { k1 = 0.01, centre = [60, 40], radius = 70 }
"""
    other = """finder = "template"
templates = [[5, 5, 20, 20]]
[calibration]
marks = [[0, 1], [10, 1], [20, 1.5], [30, 1]]
positions = [0, 1, 2, 3.0]
order = 2
"""
    return [
        text.encode(),
        other.encode(),
        (ROOT / "python/stickslip/examples/tracks/spring_slider_camera.toml").read_bytes(),
    ]


def trackers() -> list[bytes]:
    """Text exports of OSP Tracker."""
    rows = "\n".join(f"{t:.4g}\t{x:.5g}\t{-x:.5g}" for t, x in zip(T, X, strict=True))
    return [f"mass A\t\t\nt\tx\ty\n{rows}\n".encode(), f"t,x,y\n{rows}\n".replace("\t", ",").encode()]


def projects() -> list[bytes]:
    """Projects of OSP Tracker, bare and in an archive."""
    point = '<property name="[{0}]" type="object"><object class="org.opensourcephysics.cabrillo.tracker.PointMass$FrameData">'
    point += '<property name="n" type="int">{0}</property><property name="x" type="double">{1}</property>'
    point += '<property name="y" type="double">{2}</property></object></property>'
    frames = "".join(point.format(i, 10 + 3 * i, 50 - i) for i in range(12))
    package = "org.opensourcephysics.cabrillo.tracker"
    text = f"""<?xml version="1.0" encoding="UTF-8"?><object class="{package}.TrackerPanel">
<property name="videoclip" type="object"><object class="org.opensourcephysics.media.core.VideoClip">
<property name="startframe" type="int">0</property><property name="stepsize" type="int">1</property></object></property>
<property name="clipcontrol" type="object"><object class="org.opensourcephysics.media.core.ClipControl">
<property name="delta_t" type="double">40.0</property></object></property>
<property name="tracks" type="collection"><property name="item" type="object"><object class="{package}.PointMass">
<property name="name" type="string">mass A</property><property name="framedata" type="array">{frames}</property>
</object></property></property></object>"""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("project.trk", text)
    return [text.encode(), packed.getvalue()]


def pictures() -> list[bytes]:
    """One picture in every kind of file."""
    import cv2

    grey = np.add.outer(np.arange(24), np.arange(32)).astype(np.uint8)
    deep = cv2.merge([grey.astype(np.uint16) * 40] * 3)
    kinds = [(kind, cv2.merge([grey] * 3)) for kind in (".png", ".jpg", ".tif", ".bmp", ".webp", ".ppm")]
    kinds += [(".png", deep), (".tif", deep)]
    return [_file(lambda path, picture=picture: cv2.imwrite(str(path), picture), kind) for kind, picture in kinds]


def films() -> list[bytes]:
    """A short film."""
    from stickslip.tracking.video.writing import write_pictures

    frames = [np.full((48, 64, 3), 20 * i, np.uint8) for i in range(8)]
    return [_file(lambda path: write_pictures(path, frames, 25.0, lossless=False), end) for end in (".avi", ".mp4")]


# --- what reads them ----------------------------------------------------------------------------------------------


def read_record(path: Path, rng: random.Random) -> None:
    """A record under a layout."""
    from stickslip.measurement import Layout, Rig
    from stickslip.measurement.read import as_record

    layout = {"missing": rng.choice(("refuse", "drop")), "torn_rows": rng.choice(("refuse", "drop"))}
    if path.suffix == ".csv":
        layout |= {"decimal": rng.choice("...,"), "header": rng.random() < 0.9, "skip_rows": int(rng.random() < 0.1)}
    if path.suffix == ".look":
        layout |= {"format": "look"}
    column, time_column = rng.choice(
        [("x", "t"), ("x", "t"), (2, 1), (2, 1), ("run.x", "run.t"), ("segments.x", "segments.t")]
    )
    record = as_record(path, Rig(**RIG | {"column": column, "time_column": time_column, "read": Layout(**layout)}))
    assert np.isfinite(record.signal).all()
    assert (np.diff(record.time) > 0).all()


def read_motion(path: Path, _: random.Random) -> None:
    """The masses of a motion, each a record."""
    from stickslip.measurement import Rig
    from stickslip.measurement.masses import masses_of
    from stickslip.measurement.read import as_record

    for part in (masses_of(path) or {"": path}).values():
        record = as_record(part, Rig(**RIG))
        assert np.isfinite(record.signal).all()


def read_orbit(path: Path, _: random.Random) -> None:
    """An orbit is refused, or the same as what was saved."""
    orbit = ss.load(path)
    found = (
        type(orbit.system).__name__,
        np.array(orbit.at(np.linspace(0, orbit.t_end, 7))).tobytes(),
        len(orbit.events),
    )
    assert found in _whole_orbits(), "another orbit"


@functools.cache
def _whole_orbits() -> list[tuple[str, bytes, int]]:
    found = []
    for content in whole_inputs("orbit"):
        with tempfile.NamedTemporaryFile(suffix=".nc") as file:
            Path(file.name).write_bytes(content)
            orbit = ss.load(file.name)
            states = np.array(orbit.at(np.linspace(0, orbit.t_end, 7)))
            found.append((type(orbit.system).__name__, states.tobytes(), len(orbit.events)))
    return found


def read_friction(path: Path, _: random.Random) -> None:
    """A friction record, as identification takes it."""
    from stickslip.identification.records import read_records

    (record,) = read_records(path)
    assert np.isfinite(record.force).all()
    _ = (record.slips, record.step, record.own_slip(), record.both_senses())


def read_rig(source: Any, _: random.Random) -> None:
    """A rig of any instrument."""
    from stickslip.measurement import load_rig

    load_rig(source)


def read_law(source: Any, _: random.Random) -> None:
    """A law whose forces are numbers."""
    law = ss.load_law(source) if isinstance(source, Path) else Law.from_dict(source)
    forces = [law.break_away_force([0.0, 1e-3, 1.0, 1e6], rate) for rate in (0.0, 1e-6, 1.0, 1e6)]
    forces += [law.kinetic_force([1e-9, 0.01, 0.1, 1.0, 10.0])]
    assert np.isfinite(forces[0]).all(), f"{law}: break-away force is {forces[0]}"
    assert all(np.isfinite(force).all() for force in forces), f"{law}: force is {forces}"


def read_system(source: Any, _: random.Random) -> None:
    """An oscillator or a system of masses."""
    from stickslip.model.system import load_system, system_from_dict

    _ = load_system(source) if isinstance(source, Path) else system_from_dict(source)


def read_setup(source: Any, _: random.Random) -> None:
    """A setup and its calibration."""
    from stickslip.tracking.scale.calibration import read_calibration
    from stickslip.tracking.setup import Setup

    setup = Setup.of(source)
    if setup.calibration is not None:
        read_calibration(setup.calibration, ROOT, 12.0)


def read_tracker(path: Path, _: random.Random) -> None:
    """A motion of OSP Tracker."""
    from stickslip.tracking.video.osp import read_osp

    read_osp(path)


def read_image(path: Path, _: random.Random) -> None:
    """A picture of 8 bits."""
    from stickslip.tracking.video.source import read_picture

    assert read_picture(path).dtype == np.uint8


def read_film(path: Path, _: random.Random) -> None:
    """All pictures of a film."""
    from stickslip.tracking.video.source import Film

    for _time, _picture in Film(path):
        pass


TARGETS = {
    "text": Target(texts, ".csv", read_record),
    "JSON": Target(json_rows, ".json", read_record),
    "look": Target(looks, ".look", read_record),
    "matlab": Target(matlabs, ".mat", read_record),
    "motion": Target(motions, ".nc", read_motion),
    "orbit": Target(orbits, ".nc", read_orbit),
    "friction": Target(frictions, ".nc", read_friction),
    "rig file": Target(rigs, ".toml", read_rig),
    "rig": Target(lambda: [tomllib.loads(text.decode()) for text in rigs()], "", read_rig),
    "law file": Target(lambda: toml(law_documents, "law"), ".toml", read_law),
    "law": Target(law_documents, "", read_law),
    "system file": Target(lambda: toml(system_documents), ".toml", read_system),
    "system": Target(system_documents, "", read_system),
    "setup file": Target(setups, ".toml", read_setup),
    "setup": Target(lambda: [tomllib.loads(text.decode()) for text in setups()], "", read_setup),
    "tracker text": Target(trackers, ".txt", read_tracker),
    "tracker": Target(projects, ".trz", read_tracker),
    "picture": Target(pictures, ".png", read_image),
    "film": Target(films, ".avi", read_film),
}
SLOW = {"motion": 0.03, "orbit": 0.03, "friction": 0.03, "film": 0.01, "picture": 0.1, "tracker": 0.1}
QUICK = dict.fromkeys(("law", "law file", "system", "system file", "setup", "setup file"), 3.0)
SHARES = SLOW | QUICK
"""Of the inputs of the others, by the time that one takes."""


class Hangs(Exception):
    """An input that takes too long."""


def attempt(name: str, seed: int, index: int, folder: Path) -> tuple[str, str]:
    """What became of one input: ``"read"``, ``"refused"`` or what else, and why."""
    target, rng = TARGETS[name], random.Random(f"{name}:{seed}:{index}")
    whole = whole_inputs(name)[rng.randrange(len(whole_inputs(name)))]
    source: Any
    if isinstance(whole, bytes):
        ending = target.ending
        if name == "tracker":
            ending = ".trz" if whole[:2] == b"PK" else ".trk"
        source = folder / f"input{ending}"
        source.write_bytes(spoil_bytes(whole, rng))
    else:
        source = spoil_document(whole, rng)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            target.read(source, rng)
    except ss.InputError as error:
        sentence = str(error)
        return ("refused", "") if "\n" not in sentence else ("lines", sentence)
    except Hangs:
        return "hangs", ""
    except BaseException as error:  # a panic of the core is no Exception
        if isinstance(error, KeyboardInterrupt):
            raise
        return type(error).__name__, "".join(traceback.format_exception(error)[-3:])
    return "read", ""


@functools.cache
def whole_inputs(name: str) -> list[Any]:
    """Of a reader, made once."""
    return TARGETS[name].inputs()


def several(name: str, seed: int, first: int, count: int, tell: Callable[[str, int, str], None]) -> None:
    """`count` inputs of one reader; `tell` hears what became of each."""

    def late(*_: object) -> None:
        raise Hangs

    before = signal.signal(signal.SIGALRM, late)
    room = "/dev/shm" if Path("/dev/shm").is_dir() else None
    try:
        with tempfile.TemporaryDirectory(dir=room) as folder:
            for index in range(first, first + count):
                signal.alarm(LONGEST)
                kind, why = attempt(name, seed, index, Path(folder))
                signal.alarm(0)
                tell(kind, index, why)
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def serve(name: str, seed: int, first: int, count: int) -> None:
    """The work of one process: a line for each input."""
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    several(name, seed, first, count, lambda *told: print(json.dumps(told), flush=True))


def run(name: str, seed: int, count: int) -> tuple[collections.Counter[str], list[str]]:
    """Outcomes of `count` inputs and the failures among them, each as ``kind reader:seed:index why``."""
    outcomes: collections.Counter[str] = collections.Counter()
    failures = []
    at, start = 0, time.monotonic()
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    while at < count:
        arguments = [sys.executable, __file__, "--serve", f"{name}:{seed}:{at}", "--each", str(min(CHUNK, count - at))]
        child = subprocess.run(arguments, capture_output=True, text=True, check=False, env=environment)
        for line in child.stdout.splitlines():
            if not line.startswith('["'):
                failures.append(f"prints {name}:{seed}:{at} {line}")
                continue
            kind, index, why = json.loads(line)
            outcomes[kind] += 1
            at = index + 1
            if kind not in ("read", "refused"):
                failures.append(f"{kind} {name}:{seed}:{index} {why}")
        if child.returncode > 0:
            raise RuntimeError(child.stderr)
        if child.returncode:
            outcomes["ends the process"] += 1
            failures.append(f"ends the process {name}:{seed}:{at} {child.returncode} {child.stderr[-300:]}")
            at += 1
    print(name, count, dict(outcomes), f"{time.monotonic() - start:.0f} s", flush=True)
    return outcomes, failures


Row = tuple[int, int, int]


def page(rows: dict[str, Row], each: int, seed: int) -> str:
    """The table of a run: inputs, read and refused of each reader."""
    lines = [
        "# Readers of damaged files and documents",
        "",
        "Whole inputs of every reader are changed, cut, doubled and moved in one to eight positions each. Then they are",
        "read, and what was read is checked. A record must be finite and its time increase. A law's forces must be",
        "numbers. An orbit must be the one that was saved. *Read* counts what was accepted, *refused* an `InputError` of",
        "one line. *Else* counts another exception, a force that is no number, a process that ended, more than 4 GB, or",
        "more than 100 s.",
        "",
        f"Made by `python docs/evidence/readers.py --each {each} --seed {seed}`. `--only` makes some readers anew.",
        "",
        "| reader | inputs | read | refused | else |",
        "|---|---:|---:|---:|---:|",
    ]
    inputs, read, refused = (sum(column) for column in zip(*rows.values(), strict=True))
    for name, (count, *found) in [*rows.items(), ("**all**", (inputs, read, refused))]:
        lines.append(f"| {name} | {count} | {found[0]} | {found[1]} | {count - sum(found)} |")
    return "\n".join(lines) + "\n"


def rows_of(path: Path) -> dict[str, Row]:
    """The rows of a page that is there."""
    found: dict[str, Row] = {}
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
        name, *cells = (cell.strip() for cell in line.strip("|").split("|"))
        if name in TARGETS:
            count, read, refused, _ = map(int, cells)
            found[name] = count, read, refused
    return found


def main() -> None:
    """The whole run, or one input again."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--each", type=int, default=1000, help="inputs of each reader; fewer of those that take longer")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2, help="readers at once")
    parser.add_argument("--only", nargs="+", default=list(TARGETS), choices=list(TARGETS))
    parser.add_argument("--again", metavar="READER:SEED:INDEX")
    parser.add_argument("--serve", metavar="READER:SEED:INDEX", help=argparse.SUPPRESS)
    parser.add_argument("-o", "--output", type=Path, default=PAGE)
    options = parser.parse_args()
    if options.again or options.serve:
        name, seed, index = (options.again or options.serve).split(":")
        if options.serve:
            serve(name, int(seed), int(index), options.each)
        else:
            with tempfile.TemporaryDirectory() as folder:
                print(*attempt(name, int(seed), int(index), Path(folder)), sep="\n")
        return
    rows = rows_of(options.output)
    counts = [max(1, round(options.each * SHARES.get(name, 1.0))) for name in options.only]
    with ThreadPoolExecutor(options.jobs) as pool:
        found = pool.map(run, options.only, itertools.repeat(options.seed), counts)
        for name, count, (outcomes, failures) in zip(options.only, counts, found, strict=True):
            rows[name] = count, outcomes["read"], outcomes["refused"]
            for failure in {" ".join(failure.split()[-12:]): failure for failure in failures}.values():
                print("   ", failure, flush=True)
            kept = {reader: rows[reader] for reader in TARGETS if reader in rows}
            options.output.write_text(page(kept, options.each, options.seed), encoding="utf-8")


if __name__ == "__main__":
    main()
