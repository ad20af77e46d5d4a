"""A page on which markers, scale, marks and region are chosen by looking, and that gives the setup file."""

from __future__ import annotations

import json
from base64 import b64encode
from pathlib import Path

from stickslip.errors import InputError
from stickslip.files.disk import write_text
from stickslip.tracking.video.source import Film
from stickslip.tracking.video.vision import vision

PAGE = Path(__file__).with_name("choose.html")


def write_choice(source: str | Path | list[Path], path: str | Path, frame_rate: float | None = None) -> Path:
    """Write one page, complete in itself, with the first picture of a film.

    On it markers (with their size), a known length, marks of the plane of motion and a region are drawn with the mouse; it
    shows the TOML document that says so, to be copied or saved for ``stickslip track FILM --setup TRACK.toml``.

    Parameters
    ----------
    source : a video file, a folder of images or a list of images.
    path : where the page goes (``.html``).
    frame_rate : pictures per second, where it is known; needed later by images.

    Raises
    ------
    InputError
        where no picture can be read, or the page cannot be written.
    """
    film = Film(source, frame_rate, None if frame_rate else _any_times(source))
    first = next((picture for _, picture in film if picture is not None), None)
    if first is None:
        raise InputError(f"{film.name}: no picture can be read; copy the film again")
    _, png = vision().imencode(".png", first)
    shown = {"name": film.name, "rate": frame_rate, "picture": "data:image/png;base64," + b64encode(png).decode()}
    # a name may hold what ends a script
    text = PAGE.read_text(encoding="utf-8").replace("/*FILM*/null", json.dumps(shown).replace("<", "\\u003c"), 1)
    return write_text(path, text)


def _any_times(source: str | Path | list[Path]) -> list[float] | None:
    """Times that do for looking at images, which carry none; a video has its own."""
    try:
        Film(source)
    except InputError:
        return [float(number) for number in range(len(Film(source, 1.0)))]
    return None
