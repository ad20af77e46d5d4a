"""How a record file is laid out, where it is not a plain table with one header line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from stickslip.files.schema import Count, Document, Limits, Says

DELIMITERS = {"tab": "\t", "comma": ",", "semicolon": ";", "blank": None}


@dataclass(frozen=True, kw_only=True)
class Layout(Document):
    """The table ``[read]`` of a rig file.

    Parameters
    ----------
    format : one of ``"text"``, ``"matlab"``, ``"json"``, ``"look"``, ``"netcdf"``; default: by the ending of the name.
    header : whether a text file has a line of column names; without one, columns are the numbers 1, 2, ...
    skip_rows : lines of a text file before the header (or before the first row of numbers).
    delimiter : ``"tab"``, ``"comma"``, ``"semicolon"`` or ``"blank"``; default: what the first line holds.
    decimal : ``"."`` or ``","``.
    missing : ``"refuse"`` (NaN, infinity, empty cells end the reading with one sentence) or ``"drop"`` (such samples
        are left out and counted in the notes).
    torn_rows : ``"refuse"`` or ``"drop"``, for rows with too few cells, as a log that was cut off has.
    rows : key under which a JSON file keeps its rows.
    segment : of a record whose clock starts again, as where several were joined, the one that is used, from 1; default: the
        clock must not start again.
    window : (start, end) in s on the record's own clock, in seconds also where its time column has another unit; what lies
        outside is neither used nor checked, so a window cuts off what is bad there, and a record at its gaps.

    Raises
    ------
    InputError
        naming the key.
    """

    TITLE: ClassVar[str] = "rig: read"

    format: Annotated[str, Literal["", "text", "matlab", "json", "look", "netcdf"]] = ""
    header: bool = True
    skip_rows: Annotated[int, Limits(least=0)] = 0
    delimiter: Annotated[str, Literal["", "tab", "comma", "semicolon", "blank"]] = ""
    decimal: Annotated[str, Literal[".", ","]] = "."
    missing: Literal["refuse", "drop"] = "refuse"
    torn_rows: Literal["refuse", "drop"] = "refuse"
    rows: str = "data"
    segment: Count | None = None
    window: Annotated[tuple[float, float], Says("[start, end] in s")] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.window is not None and not self.window[0] < self.window[1]:
            self.refuse(f"window must be [start, end] with start < end, got {list(self.window)}")
