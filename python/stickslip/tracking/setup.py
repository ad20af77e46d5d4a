"""What to look for in a film: the finder, the marker, how many, and how pixels become metres; one small TOML document."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from stickslip.errors import InputError, number
from stickslip.files.disk import read_toml
from stickslip.files.schema import Document, Kind, Limits, Positive, Says, check_keys, kinds
from stickslip.tracking.finding.response_map import check_marker
from stickslip.tracking.video.raw import Raw
from stickslip.tracking.video.source import Film, Picture

Box = tuple[int, int, int, int]


class _Rectangle(Kind):
    what, many = "[x, y, width, height] in px", "rectangles [[x, y, width, height], ...] in px"

    def takes(self, value: Any) -> bool:
        return isinstance(value, list | tuple) and len(value) == 4

    def made(self, value: Any, name: str, where: str) -> Any:
        x, y, width, height = (math.floor(number(name, part, where)) for part in value)
        if width < 1 or height < 1 or x < 0 or y < 0:
            raise InputError(f"{where}: {name} must have x, y >= 0 and width, height >= 1, got {list(value)!r}")
        return x, y, width, height

    def schema(self, definitions: dict[str, Any]) -> dict[str, Any]:
        del definitions
        return {"type": "array", "items": {"type": "number"}, "minItems": 4, "maxItems": 4}


@dataclass(frozen=True, kw_only=True)
class Setup(Document):
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
    bodies : [[mass, mass, ...], ...]: masses that are points of one body; the motion is then that of the bodies, with their
        angles, see `stickslip.tracking.rigid_body`. Masses of no body are left out.
    frame_rate : pictures per second of the camera; see `stickslip.tracking.video.source.Film`.
    times : a file with one time a line.
    raw : a table that says how the bare grey levels of a machine camera lie in its files, see
        `stickslip.tracking.video.raw.Raw`.
    exposure : s that the shutter is open, from the stamp of a picture on; its places are those of the middle.
    line_time : s from a row of a picture to the next one, of a rolling shutter; negative where it begins at the bottom.
    calibration : a table, see `stickslip.tracking.scale.calibration.read_calibration`; without it coordinates are pixels.
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

    TITLE: ClassVar[str] = "setup"

    finder: Annotated[str, Literal["blob", "template", "fiducial"]] = "blob"
    masses: Annotated[int, Limits(least=1), Says("a whole number, 1 or more")] | None = None
    marker: str = "dark"
    channel: Annotated[str, Literal["grey", "red", "green", "blue"]] = "grey"
    size: Positive | None = None
    threshold: Positive | None = None
    level: Positive | None = None
    opening: Annotated[int, Limits(least=0), Says("a whole number of px, zero or more")] = 0
    region: Annotated[Box, _Rectangle()] | None = None
    moving: bool = False
    start: Annotated[tuple[tuple[float, float], ...], Says("a list of pixels [[x, y], ...]")] | None = None
    max_jump: Positive | None = None
    templates: tuple[Annotated[Box, _Rectangle()], ...] | None = None
    dictionary: str = "4X4_50"
    ids: Annotated[tuple[int, ...], Says("a list of the numbers of markers")] | None = None
    names: tuple[str, ...] | None = None
    reference: Annotated[tuple[int, ...], Says("a list of numbers of masses")] | None = None
    bodies: Annotated[tuple[tuple[int, ...], ...], Says("lists of the numbers of masses [[0, 1], ...]")] | None = None
    frame_rate: Annotated[float, Limits(above=0), Says("a positive number of pictures per second")] | None = None
    times: str | None = None
    raw: Raw | None = None
    exposure: Positive | None = None
    line_time: float | None = None
    calibration: Mapping[str, Any] | None = None
    folder: Path = field(default=Path(), compare=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_marker(self.marker, "setup")
        if self.finder == "template" and not self.templates:
            self.refuse("the template finder needs templates = [[x, y, width, height], ...] of the first picture")
        lists = {"start": self.start, "templates": self.templates, "ids": self.ids, "names": self.names}
        counts = {name: len(value) for name, value in lists.items() if value is not None}
        if self.masses is None:
            object.__setattr__(self, "masses", max(counts.values(), default=1))
        for name, count in counts.items():
            if count != self.masses:
                self.refuse(f"{name} has {count} entries for {self.masses} masses; give one for each")
        marks = set(self.reference or ())
        if not marks <= set(range(self.count)) or len(marks) == self.count:
            self.refuse(
                f"reference must hold some of the masses 0 to {self.count - 1}, and leave one that moves, got "
                f"{list(self.reference or ())}; raise masses by the number of marks"
            )

        for body in self.bodies or ():
            if len(set(body)) < max(2, len(body)) or not set(body) <= set(range(self.count)) - marks:
                self.refuse(
                    f"each of bodies must name two or more of the masses 0 to {self.count - 1} that are no reference, got "
                    f"{list(body)}; correct bodies or masses"
                )

    @property
    def count(self) -> int:
        """How many markers are followed."""
        return self.masses or 1

    @property
    def grey(self) -> bool:
        """Whether the colours of a picture are not needed."""
        return self.channel == "grey" and (self.finder != "blob" or self.marker in ("dark", "bright"))

    def film(self, source: str | Path | list[Path]) -> Film:
        """The pictures of a source, with the times and in the colours that the setup asks for."""
        times = self.folder / self.times if self.times is not None else None
        return Film(source, self.frame_rate, times, grey=self.grey, raw=self.raw)

    def box(self, picture: Picture, name: str) -> tuple[slice, slice]:
        """The part of the pictures of a film of this `name` that is looked at, rows and columns.

        Raises
        ------
        InputError
            where the region begins outside of them.
        """
        height, width = picture.shape[:2]
        left, top, wide, high = self.region or (0, 0, width, height)
        if left >= width or top >= height:
            raise InputError(
                f"{name}: the region begins at ({left}, {top}), outside of pictures of {width} x {height} px"
            )
        return slice(top, min(height, top + high)), slice(left, min(width, left + wide))

    @classmethod
    def of(cls, given: Setup | Mapping[str, Any] | str | Path | None, **options: Any) -> Setup:
        """A setup from one, a table, the path of a TOML file or nothing; `options` come last and win."""
        options = {key: value for key, value in options.items() if value is not None}
        if isinstance(given, Setup):
            check_keys(options, kinds(cls), (), "setup")
            return replace(given, **options)
        if not isinstance(given, str | Path):
            return cls.from_dict({**(given or {}), **options})
        setup = cls.from_dict({**read_toml(given), **options}, str(given))
        return replace(setup, folder=Path(given).parent)

    def to_toml(self) -> str:
        """The setup as a TOML document, only what differs from the default."""
        import tomli_w

        return tomli_w.dumps(self.changed())
