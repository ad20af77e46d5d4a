"""What to look for in a film: the finder, the marker, how many, and how pixels become metres; one small TOML document."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from stickslip.errors import InputError
from stickslip.files.documents import check_keys, number, read_toml
from stickslip.tracking.response_map import CHANNELS, check_marker

FINDERS = ("blob", "template", "fiducial")

Box = tuple[int, int, int, int]


@dataclass(frozen=True, kw_only=True)
class Setup:
    """How a film is tracked. A dark spot on a light ground needs nothing at all.

    Parameters
    ----------
    finder : ``"blob"`` (spots of a brightness or colour), ``"template"`` (pieces of the first picture), ``"fiducial"``
        (square ArUco markers that carry a number).
    masses : how many markers; default 1, or the number of templates or ids given.
    marker : ``"dark"``, ``"bright"``, a colour's name or ``"#rrggbb"``; for blobs.
    channel : ``"grey"``, ``"red"``, ``"green"`` or ``"blue"``: what brightness means.
    size : diameter of a blob in px, to within a factor 2.
    threshold : least contrast of a blob in grey levels.
    level : grey level of a body's outline, where it is known (a dark one is darker than that inside); default: its own.
    opening : things thinner than this many px (strings, rims) are taken off the blobs.
    region : [x, y, width, height] in px: look only here.
    moving : prefer what moves to what rests.
    start : [[x, y], ...]: roughly where each marker is when it is first seen; gives their order too.
    max_jump : px that a marker may jump between two pictures; default: measured on the film.
    templates : [[x, y, width, height], ...]: the pieces of the first picture to follow; for templates.
    dictionary : the ArUco dictionary; for fiducials.
    ids : the numbers of the markers wanted; default the `masses` seen most.
    names : what the masses are called.
    reference : numbers (from 0) of the masses that are marks fixed to the ground: what they move is the camera's, is taken
        from all others, and they are left out of the motion.
    frame_rate : pictures per second of the camera; see `stickslip.tracking.source.Film`.
    times : a file with one time a line.
    calibration : a table, see `stickslip.tracking.calibration.read_calibration`; without it coordinates are pixels.
    folder : where the relative paths of the document begin.

    Raises
    ------
    InputError
        with one sentence that names the key, what it must be and what came.

    Examples
    --------
    >>> Setup(marker="bright", masses=2).masses
    2
    """

    finder: str = "blob"
    masses: int | None = None
    marker: str = "dark"
    channel: str = "grey"
    size: float | None = None
    threshold: float | None = None
    level: float | None = None
    opening: int = 0
    region: Box | None = None
    moving: bool = False
    start: tuple[tuple[float, float], ...] | None = None
    max_jump: float | None = None
    templates: tuple[Box, ...] | None = None
    dictionary: str = "4X4_50"
    ids: tuple[int, ...] | None = None
    names: tuple[str, ...] | None = None
    reference: tuple[int, ...] | None = None
    frame_rate: float | None = None
    times: str | None = None
    calibration: Mapping[str, Any] | None = None
    folder: Path = field(default=Path(), compare=False)

    def __post_init__(self) -> None:
        if self.finder not in FINDERS:
            raise InputError(f"setup: finder must be one of {', '.join(FINDERS)}, got {self.finder!r}")
        check_marker(str(self.marker), "setup")
        if self.channel not in ("grey", *CHANNELS):
            raise InputError(f"setup: channel must be one of grey, {', '.join(CHANNELS)}, got {self.channel!r}")
        for name in ("size", "threshold", "level", "max_jump"):
            value = getattr(self, name)
            if value is not None and number(name, value, "setup") <= 0:
                raise InputError(f"setup: {name} must be a positive number, got {value:g}")
        if self.frame_rate is not None:
            rate = number("frame_rate", self.frame_rate, "setup")
            if rate <= 0:
                raise InputError(
                    f"setup: the frame rate must be a positive number of pictures per second, got {rate:g}; "
                    "leave it out to take the file's own"
                )
        if isinstance(self.opening, bool) or not isinstance(self.opening, int) or self.opening < 0:
            raise InputError(f"setup: opening must be a whole number of px, zero or more, got {self.opening!r}")
        if self.region is not None:
            object.__setattr__(self, "region", _box(self.region, "region"))
        if self.templates is not None:
            boxes = self.templates if isinstance(self.templates, list | tuple) else ()
            object.__setattr__(self, "templates", tuple(_box(box, "templates") for box in boxes))
        if self.start is not None:
            object.__setattr__(self, "start", _places(self.start))
        for name, kind, what in (
            ("ids", int, "the numbers of markers"),
            ("names", str, "texts"),
            ("reference", int, "numbers of masses"),
        ):
            value = getattr(self, name)
            if value is not None:
                if not isinstance(value, list | tuple) or not all(type(one) is kind for one in value):
                    raise InputError(f"setup: {name} must be a list of {what}, got {value!r}")
                object.__setattr__(self, name, tuple(value))
        if self.finder == "template" and not self.templates:
            raise InputError(
                "setup: the template finder needs templates = [[x, y, width, height], ...] of the first picture"
            )
        lists = {"start": self.start, "templates": self.templates, "ids": self.ids, "names": self.names}
        counts = {name: len(value) for name, value in lists.items() if value is not None}
        if self.masses is None:
            object.__setattr__(self, "masses", max(counts.values(), default=1))
        if isinstance(self.masses, bool) or not isinstance(self.masses, int) or self.masses < 1:
            raise InputError(f"setup: masses must be a whole number, 1 or more, got {self.masses!r}")
        for name, count in counts.items():
            if count != self.masses:
                raise InputError(f"setup: {name} has {count} entries for {self.masses} masses; give one for each")

        marks = set(self.reference or ())
        if not marks <= set(range(self.count)) or len(marks) == self.count:
            raise InputError(
                f"setup: reference must hold some of the masses 0 to {self.count - 1}, and leave one that moves, got "
                f"{list(self.reference or ())}; raise masses by the number of marks"
            )

    @property
    def count(self) -> int:
        """How many markers are followed."""
        return self.masses or 1

    @classmethod
    def of(cls, given: Setup | Mapping[str, Any] | str | Path | None, **options: Any) -> Setup:
        """A setup from one, a table, the path of a TOML file or nothing; `options` come last and win."""
        options = {key: value for key, value in options.items() if value is not None}
        known = [item.name for item in fields(cls) if item.name != "folder"]
        if given is None:
            given = {}
        if isinstance(given, Setup):
            check_keys(options, known, (), "setup")
            return replace(given, **options)
        where, folder = "setup", Path()
        if isinstance(given, str | Path):
            where, folder = str(given), Path(given).parent
            given = read_toml(given)
        table = {**given, **options}
        check_keys(table, known, (), where)
        try:
            return cls(**table, folder=folder)
        except InputError as error:
            raise InputError(str(error).replace("setup:", f"{where}:", 1)) from None

    def to_toml(self) -> str:
        """The setup as a TOML document, only what differs from the default."""
        import tomli_w

        table = {}
        for item in fields(self):
            value = getattr(self, item.name)
            if item.name != "folder" and value is not None and value != item.default:
                table[item.name] = _plain(value)
        return tomli_w.dumps(table)


def _plain(value: Any) -> Any:
    if isinstance(value, tuple | list):
        return [_plain(item) for item in value]
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    return value


def _box(value: object, name: str) -> Box:
    if not isinstance(value, list | tuple) or len(value) != 4:
        raise InputError(f"setup: {name} must be [x, y, width, height] in px, got {value!r}")
    x, y, width, height = (math.floor(number(name, part, "setup")) for part in value)
    if width < 1 or height < 1 or x < 0 or y < 0:
        raise InputError(f"setup: {name} must have x, y >= 0 and width, height >= 1, got {list(value)!r}")
    return x, y, width, height


def _places(value: object) -> tuple[tuple[float, float], ...]:
    if not isinstance(value, list | tuple) or not all(
        isinstance(place, list | tuple) and len(place) == 2 for place in value
    ):
        raise InputError(f"setup: start must be a list of pixels [[x, y], ...], got {value!r}")
    return tuple((number("start", x, "setup"), number("start", y, "setup")) for x, y in value)
