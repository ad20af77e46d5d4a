"""Films whose truth is known, drawn by code that shares nothing with the tracker, and what it and others make of them.

python docs/evidence/films.py FOLDER               # draws the films into FOLDER, writes films.md; what is done is kept there
python docs/evidence/films.py FOLDER --only clean  # prints the line of one film

`make films` does that with the packages of `films.lock`: `av` (encoding), and `pyidi` and `trackpy` for their columns.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import islice, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter, map_coordinates, spline_filter
from scipy.special import erf

import stickslip as ss
from stickslip.measurement import Rig, measure

Array = npt.NDArray[np.float64]

PAGE = Path(__file__).with_suffix(".md")
OSCILLATOR = ss.Oscillator(
    mass=1.2, stiffness=600.0, damping=1.0, drive_velocity=0.05, law=ss.laws.StaticKinetic(break_away=6.0, kinetic=3.0)
)
START = 1.0
"""Time of the orbit at the first picture, in s: the motion repeats by then."""
SCALE = 18_000.0
"""Px per m in the plane of motion."""
ROW = 90.0
"""Row of the marker in the plane, in px."""
FEWER = 120
"""Pictures that others are given, the first ones: some are slow."""
LOST = 5.0
"""Px off the truth from which on something else was taken for the marker."""
MARKS = np.array([[40.0, 30.0], [440.0, 30.0], [40.0, 172.0], [440.0, 172.0], [240.0, 172.0], [240.0, 30.0]])
"""Resting marks in the plane, in px, where a film has them."""


@dataclass(frozen=True, kw_only=True)
class Scene:
    """What is filmed and how.

    Lengths are in px, times in s, brightness in grey levels. `rate` pictures a second for `seconds`; `exposure` is the share
    of a picture's time during which the shutter is open, from its stamp on, `line_time` the delay of each row after the one
    above. `dropped` and `jitter` are the share of pictures that are missing and the scatter of the others' moments in shares
    of their distance; the stamps of the file are right. `ground` is the scatter of a resting ground with texture, over
    which the marker moves without a block. `finger` and `impostor` are seconds of a finger before the marker and the contrast
    of a resting dot.
    """

    rate: float = 240.0
    seconds: float = 3.0
    width: int = 480
    height: int = 200
    marker: float = 20.0
    contrast: float = 165.0
    blur: float = 0.9
    noise: float = 2.0
    exposure: float = 0.0
    line_time: float = 0.0
    flicker: float = 0.0
    dropped: float = 0.0
    jitter: float = 0.0
    shake: float = 0.0
    tilt: float = 0.0
    k1: float = 0.0
    ground: float = 0.0
    finger: float = 0.0
    impostor: float = 0.0
    marks: int = 0
    codec: str = "h264"
    quality: int = 0


def place(moment: npt.ArrayLike) -> Array:
    """Where the mass is, in m."""
    return np.asarray(ORBIT.at(np.asarray(moment))[0], float)


ORBIT = ss.simulate(OSCILLATOR, 8.0)
MIDDLE = float(np.mean([np.min(place(np.linspace(1, 8, 4000))), np.max(place(np.linspace(1, 8, 4000)))]))


@dataclass
class View:
    """The camera of a scene: from the plane of motion to its pictures and back."""

    scene: Scene

    def __post_init__(self) -> None:
        scene = self.scene
        turn, far = math.radians(scene.tilt), 2.5 * scene.width
        # a plane that turns about its vertical middle line, seen from `far` px away
        self.matrix = np.array([[math.cos(turn), 0, 0], [0, 1, 0], [math.sin(turn) / far, 0, 1]])
        self.centre = np.array([(scene.width - 1) / 2, (scene.height - 1) / 2])
        self.radius = math.hypot(scene.width, scene.height) / 2

    def to_plane(self, pixels: Array) -> Array:
        """Places in the plane, in px, of pixels (…, 2)."""
        away = pixels - self.centre
        away = away * (1 + self.scene.k1 * (away**2).sum(axis=-1, keepdims=True) / self.radius**2)
        world = np.concatenate([away, np.ones((*away.shape[:-1], 1))], axis=-1) @ np.linalg.inv(self.matrix).T
        return np.asarray(world[..., :2] / world[..., 2:] + self.centre)

    def to_pixels(self, plane: Array) -> Array:
        """Pixels of places in the plane: the inverse, by iteration."""
        found = plane.copy()
        for _ in range(200):
            found = found + 0.9 * (plane - self.to_plane(found))
        return found


def disc(x: Array, y: Array, radius: float, blur: float) -> Array:
    """A disc of brightness 1 seen with a blur that is small beside it, at distances x, y from its middle."""
    soft = math.sqrt(2 * (blur**2 + 1 / 12))
    return np.asarray(0.5 * (1 + erf((radius - np.hypot(x, y)) / soft)))


def strip(x: Array, y: Array, wide: float, high: float, blur: float) -> Array:
    """A rectangle of half sides wide and high, as :func:`disc`."""
    soft = math.sqrt(2 * (blur**2 + 1 / 12))
    sides = [
        0.25 * (erf((half + at) / soft) + 1) * (erf((half - at) / soft) + 1) for at, half in ((x, wide), (y, high))
    ]
    return np.asarray(sides[0] * sides[1])


def part(wanted: npt.NDArray[np.bool_]) -> tuple[slice, slice]:
    """The rectangle of a picture in which something is."""
    rows, columns = (np.flatnonzero(wanted.any(axis=axis)) for axis in (1, 0))
    return slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)


def spot(
    bright: Array, u: Array, v: Array, at: Array, ground: float, radius: float, contrast: float, blur: float
) -> None:
    """A resting dot on a light disc, drawn into a picture."""
    near = part(np.hypot(u - at[0], v - at[1]) < ground + 6)
    x, y = u[near] - at[0], v[near] - at[1]
    bright[near] += disc(x, y, ground, blur) * (205 - bright[near]) - contrast * disc(x, y, radius, blur)


@dataclass
class Film:
    """The pictures of a scene."""

    scene: Scene

    def __post_init__(self) -> None:
        scene = self.scene
        rng = np.random.default_rng(0)
        self.view = View(scene)
        stamps = np.arange(round(scene.seconds * scene.rate)) / scene.rate
        stamps[1:] += scene.jitter / scene.rate * np.clip(rng.standard_normal(len(stamps) - 1), -2, 2)
        keep = rng.uniform(size=len(stamps)) >= scene.dropped
        keep[0] = True
        self.stamps: Array = stamps[keep]
        self.shakes = scene.shake * rng.standard_normal((len(self.stamps), 2))
        grain = [gaussian_filter(rng.standard_normal((256, 1024)), 2.0, mode="wrap") for _ in range(2)]
        self.belt, self.face = grain[0] / grain[0].std(), spline_filter(grain[1] / grain[1].std(), mode="grid-wrap")

    @property
    def zero_is_free(self) -> bool:
        """Whether a constant shift is no error: of texture, after a shake, from marks clicked to the pixel."""
        return not self.scene.contrast or bool(self.scene.shake or self.scene.tilt)

    @property
    def plane_is_free(self) -> bool:
        """Whether a change with x and x² is no error of places: clicked marks leave a doubt in the plane."""
        return bool(self.scene.tilt)

    @property
    def truth(self) -> Array:
        """Where the mass is at the stamps, in m."""
        return place(START + self.stamps)

    def column(self, moment: npt.ArrayLike) -> Array:
        """Column of the marker in the plane."""
        return np.asarray((self.scene.width - 1) / 2 + SCALE * (place(moment) - MIDDLE))

    def pictures(self) -> Iterator[npt.NDArray[np.uint8]]:
        """Grey pictures, (height, width)."""
        scene = self.scene
        rng = np.random.default_rng(1)
        rows, columns = np.mgrid[: scene.height, : scene.width].astype(float)
        still = np.moveaxis(self.view.to_plane(np.stack([columns, rows], axis=-1)), -1, 0)
        light = 1 - 0.25 * columns / scene.width
        moments = (np.arange(9) + 0.5) / 9 * scene.exposure / scene.rate if scene.exposure else np.zeros(1)
        for stamp, shake in zip(self.stamps, self.shakes, strict=True):
            u, v = still - shake[:, None, None]
            delays = scene.line_time * rows
            bright = np.mean([self.draw(u, v, stamp, delays + moment) for moment in moments], axis=0) * light
            bright *= 1 + scene.flicker * math.sin(2 * math.pi * 100 * stamp)
            bright += scene.noise * rng.standard_normal(bright.shape, dtype=np.float32)
            yield np.clip(np.rint(bright), 0, 255).astype(np.uint8)

    def draw(self, u: Array, v: Array, stamp: float, delays: Array) -> Array:
        """The scene at a moment of each pixel."""
        scene, moment = self.scene, START + stamp + delays
        belt = SCALE * OSCILLATOR.drive_velocity * float(moment.flat[0])
        bright = 120 + 14 * map_coordinates(self.belt, [v, u - belt], order=1, mode="grid-wrap")
        if scene.ground:
            bright = 205 + scene.ground * map_coordinates(self.belt, [v, u], order=1, mode="grid-wrap")
        for mark in MARKS[: scene.marks]:
            spot(bright, u, v, mark, 18, 10, 165, scene.blur)
        if scene.impostor:
            spot(bright, u, v, np.array([60.0, 160.0]), 22, 10, scene.impostor, scene.blur)
        way = np.linspace(0, float(np.ptp(moment)) + 1e-9, 200)
        at = np.interp(moment, float(moment.flat[0]) + way, self.column(float(moment.flat[0]) + way))
        near = part(np.abs(u - at) < 55)
        x, y = (u - at)[near], v[near] - ROW
        block = strip(x, y, 34, 34, scene.blur)
        surface: Array | float = 205.0
        if not scene.contrast:
            surface = 150 + 30 * map_coordinates(self.face, [y, x], order=3, mode="grid-wrap", prefilter=False)
        if not scene.ground:
            bright[near] += block * (surface - bright[near])
        bright[near] -= scene.contrast * disc(x, y, scene.marker / 2, scene.blur)
        if scene.finger and 1.0 <= stamp < 1.0 + scene.finger:  # comes from below, stays, goes
            tip = ROW + 55 * abs(2 * (stamp - 1.0) / scene.finger - 1) - 25
            bright += strip(u - 250, v - tip - 200, 30, 200, 2.0) * (135 - bright)
        return np.asarray(bright)

    def write(self, path: Path) -> None:
        """Encode the pictures, with their stamps."""
        import av

        scene = self.scene
        clock = Fraction(1, 90_000)
        with av.open(str(path), "w") as container:
            if scene.codec == "mjpeg":
                stream = container.add_stream("mjpeg", rate=Fraction(scene.rate))
                stream.pix_fmt, stream.color_range = "yuvj420p", 2
                stream.options = {"qmin": str(scene.quality), "qmax": str(scene.quality)}
            else:
                options = {"qp": "0"} if scene.quality == 0 else {"crf": str(scene.quality)}
                stream = container.add_stream(
                    "libx264", rate=Fraction(scene.rate), options={"preset": "fast", **options}
                )
                stream.pix_fmt = "gray" if scene.quality == 0 else "yuv420p"
            stream.width, stream.height = scene.width, scene.height
            stream.time_base = stream.codec_context.time_base = clock
            for stamp, picture in zip(self.stamps, self.pictures(), strict=True):
                frame = av.VideoFrame.from_ndarray(picture, format="gray")
                frame.time_base, frame.pts = clock, round(stamp / clock)
                container.mux(stream.encode(frame))
            container.mux(stream.encode())


SCENES = {
    "clean": Scene(),
    "noise of 8 grey levels": Scene(noise=8.0),
    "marker of 8 px": Scene(marker=8.0),
    "60 pictures a second": Scene(rate=60.0, seconds=6.0),
    "1000 pictures a second": Scene(rate=1000.0, seconds=1.2),
    "rolling shutter, 20 us a row": Scene(line_time=2e-5),
    "flicker of 15 %": Scene(flicker=0.15),
    "MJPEG, scale 5": Scene(codec="mjpeg", quality=5),
    "H.264, crf 18": Scene(quality=18),
    "H.264, crf 28": Scene(quality=28),
    "H.264, crf 36": Scene(quality=36),
    "one picture in ten dropped": Scene(dropped=0.1),
    "variable stamps": Scene(jitter=0.2),
    "plane tilted by 20 degrees": Scene(tilt=20.0),
    "lens, k1 = 0.06": Scene(k1=0.06),
    "shutter open for 90 %": Scene(exposure=0.9),
    "finger": Scene(finger=0.5),
    "shake of 1.5 px": Scene(shake=1.5, marks=2),
    "impostor that rests": Scene(impostor=185.0),
    "texture, no marker": Scene(contrast=0.0),
    "marker over a ground with texture": Scene(ground=8.0),
}


# What is said of each film: px are turned into m by the known scale, seen from where the mass is at rest
def setup_of(scene: Scene, film: Film) -> dict[str, Any]:
    """What a user says of a film: how px become m, which marks rest, how the shutter works."""
    origin = [(scene.width - 1) / 2 - SCALE * MIDDLE, ROW]
    setup: dict[str, Any] = {"calibration": {"scale": SCALE, "origin": origin}}
    if not scene.contrast:
        left = round(float(film.column(START))) - 28
        setup |= {"finder": "template", "templates": [[left, round(ROW) - 28, 57, 57]]}
    if scene.shake:
        setup |= {"masses": 1 + scene.marks, "reference": [0, scene.marks]}
    if scene.tilt:  # four marks seen before, clicked to the pixel
        clicked = np.rint(film.view.to_pixels(MARKS[:4])).tolist()
        flat = (MARKS[:4] - [(scene.width - 1) / 2, ROW]) * [1, -1] / SCALE + [MIDDLE, 0]
        setup["calibration"] = {"marks": clicked, "positions": flat.tolist()}
    if scene.k1:
        centre = list(film.view.centre)
        setup["calibration"]["lens"] = {"k1": scene.k1, "centre": centre, "radius": film.view.radius}
    if scene.exposure:
        setup["exposure"] = scene.exposure / scene.rate
    if scene.line_time:
        setup["line_time"] = scene.line_time
    return setup


@dataclass
class Line:
    """What one program makes of a film: how far off the truth, in px of the plane (NaN where lost), with what errors.

    `rate` is in pictures a second of processor time, `force` the rms error of friction in shares of f_s.
    """

    off: Array
    errors: Array
    rate: float
    force: float = math.nan
    said: list[str] = field(default_factory=list)


def with_stickslip(path: Path, film: Film) -> Line:
    """Tracked and measured by this package."""
    began = time.process_time()
    try:
        motion = ss.track(path, setup_of(film.scene, film))
    except ss.InputError as error:
        return Line(np.full(len(film.stamps), np.nan), np.full(len(film.stamps), np.nan), math.nan, said=[str(error)])
    rate = len(film.stamps) / (time.process_time() - began)
    mass = motion.sizes["mass"] // 2
    x, errors = (SCALE * motion[name].to_numpy()[:, mass] for name in ("x", "x_error"))
    off = x - SCALE * place(START + motion["time"].to_numpy())
    if film.zero_is_free:
        off -= np.nanmean(off)
    if film.plane_is_free:
        seen = np.isfinite(off)
        off -= np.polyval(np.polyfit(x[seen], off[seen], 2), x)
    rig = Rig(
        instrument="displacement", column="x", unit="m", stiffness=600.0, mass=1.2, damping=1.0,
        drive_velocity=OSCILLATOR.drive_velocity, read={"missing": "drop"},
    )  # fmt: skip
    said, force = list(motion.attrs["notes"]), math.nan
    try:
        friction = measure(motion, rig, mass=mass)
        moments = START + friction["time"].to_numpy()
        true = ORBIT.to_xarray(moments)["force"].to_numpy()
        # beside an event one picture more or less on its other side is all of the error
        events = ORBIT.events["t"].to_numpy()
        clear = np.abs(moments[:, None] - events).min(axis=1) > 1.5 / film.scene.rate
        force = float(np.sqrt(np.mean((friction["force"].to_numpy() - true)[clear][3:-3] ** 2))) / 6.0
        said += list(friction.attrs["notes"])
    except ss.InputError as error:
        said.append(str(error))
    return Line(off, errors, rate, force, said)


# The others are given the place of the marker in the first picture and its size; their pixels become m by the true map.
def pictures_of(path: Path) -> list[npt.NDArray[np.uint8]]:
    """The first pictures of a film, grey."""
    import av

    with av.open(str(path)) as container:
        return [frame.to_ndarray(format="gray") for frame in islice(container.decode(video=0), FEWER)]


def with_pyidi(pictures: list[npt.NDArray[np.uint8]], start: Array, size: float) -> Array:
    """Lucas-Kanade of pyidi on a region around the marker."""
    import tempfile

    from pyidi import LucasKanade, VideoReader

    with tempfile.TemporaryDirectory() as folder:
        method = LucasKanade(VideoReader(np.stack(pictures), root=folder))
        method.set_points(np.rint(start[None, ::-1]).astype(int))
        method.configure(roi_size=(2 * round(0.8 * size) + 1,) * 2, pad=12, verbose=0, show_pbar=False)
        found = method.get_displacements(autosave=False)
    return start + np.asarray(found)[0][:, ::-1]


def with_trackpy(pictures: list[npt.NDArray[np.uint8]], start: Array, size: float) -> Array:
    """Trackpy's brightest-centroid finder, the feature nearest to the last one taken."""
    import trackpy

    trackpy.quiet()
    found, last = [], start
    for picture in pictures:
        table = trackpy.locate(255 - picture, 2 * math.ceil(0.6 * size) + 1, engine="python")
        places = table[["x", "y"]].to_numpy()
        apart = np.hypot(*(places - last).T) if len(places) else np.array([np.inf])
        last = places[np.argmin(apart)] if apart.min() < 40 else last
        found.append(last if apart.min() < 40 else np.full(2, np.nan))
    return np.array(found)


def with_optical_flow(pictures: list[npt.NDArray[np.uint8]], start: Array, size: float) -> Array:
    """OpenCV's pyramidal Lucas-Kanade from picture to picture."""
    import cv2

    place, found = start.astype(np.float32).reshape(1, 1, 2), [start]
    window = (2 * round(0.8 * size) + 1,) * 2
    for last, picture in pairwise(pictures):
        place, _, _ = cv2.calcOpticalFlowPyrLK(last, picture, place, None, winSize=window)
        found.append(place.ravel().astype(float))
    return np.array(found)


PEERS: dict[str, Callable[[list[npt.NDArray[np.uint8]], Array, float], Array]] = {
    "pyidi": with_pyidi,
    "trackpy": with_trackpy,
    "OpenCV flow": with_optical_flow,
}


def with_peer(path: Path, film: Film, peer: str) -> Line:
    """What another program makes of a film; it says no errors, and is told the truth about shutter, plane and lens."""
    began = time.process_time()
    pictures = pictures_of(path)
    first = np.array([float(film.column(START)), ROW])
    start = film.view.to_pixels(first[None])[0] + film.shakes[0]
    nothing = np.full(len(pictures), np.nan)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = PEERS[peer](pictures, start, film.scene.marker if film.scene.contrast else 57.0)
    except Exception as error:  # noqa: BLE001 whatever they raise is their result
        return Line(nothing, nothing, math.nan, said=[f"{type(error).__name__}: {error}"])
    rate = len(pictures) / (time.process_time() - began)
    delay = 0.5 * film.scene.exposure / film.scene.rate + film.scene.line_time * ROW
    off = film.view.to_plane(found - film.shakes[: len(found)])[:, 0] - film.column(
        START + film.stamps[: len(found)] + delay
    )
    return Line(off - np.nanmean(off) if film.zero_is_free else off, nothing, rate)


def lost(off: Array) -> int:
    """Pictures without the marker, or with something else taken for it."""
    return int(np.sum(~(np.abs(off) < LOST)))


def rms(off: Array) -> str:
    """Of the pictures in which it is the marker that was found."""
    right = off[np.abs(off) < LOST]
    return f"{np.sqrt(np.mean(right**2)):.4f}" if right.size else "none"


INTRODUCTION = """# Films whose truth is known

Made by `films.py`, which draws the films with code of its own and encodes them by libx264 and the MJPEG encoder of FFmpeg.
The film is that of a mass of 1.2 kg on a spring of 600 N/m that sticks and slips (f_s = 6 N, f_k = 3 N) on a belt of
0.05 m/s; 480 x 200 px, 240 pictures a second and 3 s where nothing else is said; a marker of 20 px, noise of 2 grey levels,
light that falls by a quarter across the picture, a belt with texture. Scale and zero are given, no region, no size. Where
four marks were clicked to the pixel, zero, scale and perspective are fitted to the truth: what marks do to them the
calibration says.

Error: rms off the truth in px. Stated: median of the stated errors. Held: share of the pictures whose 95 % interval holds the
truth. Lost: pictures without a place, or more than 5 px off. Friction: rms error in % of f_s, pictures beside an event left
out. Rate: pictures a second of processor time, decoding included; for a comparison on one machine. Other programs are given
the first place of the marker and its size, say no errors, and are told the true times, plane, lens and
shake, for the first 120 pictures.

The columns of other programs are kept from the run that made them, and other work may have run beside: compare only rates of
one program.

"""


def line(folder: Path, name: str, peers: bool = True) -> dict[str, Any]:
    """What is made of one film: cells of the table, intervals, those that hold, sentences. Kept in the folder."""
    film, path = filmed(folder, name, SCENES[name])
    kept = path.with_suffix(".json")
    found: dict[str, Any] = json.loads(kept.read_text()) if kept.exists() else {}
    if not found:
        own = with_stickslip(path, film)
        known = np.isfinite(own.off)
        inside = np.abs(own.off[known]) < 1.96 * own.errors[known]
        cells = [rms(own.off), f"{np.median(own.errors[known]):.4f}" if known.any() else "none"]
        cells += [f"{100 * inside.mean():.1f}" if known.any() else "none", str(lost(own.off))]
        cells += [f"{100 * own.force:.1f}", f"{own.rate:.0f}"]
        found = {
            "cells": cells,
            "intervals": int(known.sum()),
            "held": int(inside.sum()),
            "said": own.said,
            "peers": {},
        }
    for peer in PEERS if peers else ():
        if peer not in found["peers"]:
            other = with_peer(path, film, peer)
            found["peers"][peer] = [rms(other.off), str(lost(other.off)), f"{other.rate:.0f}"]
            found["said"] += [f"{peer}: {sentence}" for sentence in other.said]
    kept.write_text(json.dumps(found))
    return found


def page(folder: Path, peers: bool = True, kept: bool = False) -> str:
    """The page, of all films or of those that are done."""
    names = [name for name in SCENES if not kept or film_file(folder, name).with_suffix(".json").exists()]
    head = ["film", "error", "stated", "held, %", "lost", "friction, %", "rate"]
    for peer in PEERS:
        head += [f"{peer}: error", "lost", "rate"]
    lines = ["| " + " | ".join(head) + " |", "|---" + "|---:" * (len(head) - 1) + "|"]
    found = {name: line(folder, name, peers and not kept) for name in names}
    for name, one in found.items():
        others = [cell for peer in PEERS for cell in one["peers"].get(peer, ["not run"] * 3)]
        lines.append("| " + " | ".join([name, *one["cells"], *others]) + " |")
    share, count = (sum(one[key] for one in found.values()) for key in ("held", "intervals"))
    lines += [
        "",
        f"All together {100 * share / count:.1f} % of {count} intervals hold the truth.",
        *(["", f"Not run: {'; '.join(left)}."] if (left := [name for name in SCENES if name not in names]) else []),
        "",
        "## What is said",
        "",
    ]
    # The scale was given to all of them.
    said = [
        f"- {name}: {what}".replace(f"{folder}/", "")
        for name, one in found.items()
        for what in one["said"]
        if not what.startswith("Scale given")
    ]
    return INTRODUCTION + "\n".join([*lines, *said]) + "\n"


def film_file(folder: Path, name: str) -> Path:
    """The file of a film."""
    ending = ".mov" if SCENES[name].codec == "mjpeg" else ".mp4"
    return folder / (re.sub(r"[^a-zA-Z0-9.]+", "-", name).strip("-") + ending)


def filmed(folder: Path, name: str, scene: Scene) -> tuple[Film, Path]:
    """A film and its file, drawn where it is not there yet."""
    film, path = Film(scene), film_file(folder, name)
    if not path.exists():
        draft = path.with_stem(path.stem + "-draft")
        film.write(draft)
        draft.rename(path)
    return film, path


if __name__ == "__main__":
    reader = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    reader.add_argument("folder", type=Path)
    reader.add_argument("--only", choices=list(SCENES))
    reader.add_argument("--alone", action="store_true", help="without the other programs")
    reader.add_argument("--kept", action="store_true", help="a page of what is done, nothing new")
    given = reader.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    if given.only:
        print(" | ".join(line(given.folder, given.only, not given.alone)["cells"]))
    else:
        PAGE.write_text(page(given.folder, not given.alone, given.kept))
