"""Whole files and documents of every kind that a reader takes."""

from __future__ import annotations

import io
import json
import struct
import tempfile
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import stickslip as ss
from stickslip.laws import Law

EXAMPLES = Path(ss.__file__).parent / "examples"
N = 120
T = np.arange(N) / 50
X = np.sin(6 * T) + 0.3 * np.sin(17 * T)


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
    return [path.read_bytes() for path in sorted((EXAMPLES / "rigs").glob("*.toml"))]


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
        (EXAMPLES / "tracks" / "spring_slider_camera.toml").read_bytes(),
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
