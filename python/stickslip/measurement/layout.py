"""How a record file is laid out, where it is not a plain table with one header line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal

from stickslip.errors import InputError
from stickslip.files.documents import check_keys, did_you_mean

FORMATS = ("text", "matlab", "json", "look", "netcdf")
DELIMITERS = {"tab": "\t", "comma": ",", "semicolon": ";", "blank": None}


@dataclass(frozen=True, kw_only=True)
class Layout:
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
    window : (start, end) in s on the record's own clock; what lies outside is not used.

    Raises
    ------
    InputError
        naming the key.
    """

    format: str = ""
    header: bool = True
    skip_rows: int = 0
    delimiter: str = ""
    decimal: str = "."
    missing: Literal["refuse", "drop"] = "refuse"
    torn_rows: Literal["refuse", "drop"] = "refuse"
    rows: str = "data"
    segment: int | None = None
    window: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        choices: dict[str, tuple[str, ...]] = {
            "format": ("", *FORMATS),
            "delimiter": ("", *DELIMITERS),
            "decimal": (".", ","),
            "missing": ("refuse", "drop"),
            "torn_rows": ("refuse", "drop"),
        }
        for name, known in choices.items():
            value = getattr(self, name)
            if value not in known:
                words = ", ".join(repr(word) for word in known if word)
                raise InputError(f"rig: {name} must be one of {words}, got {value!r}{did_you_mean(str(value), known)}")
        if not isinstance(self.rows, str):
            raise InputError(f"rig: rows must be the key of a JSON file, got {self.rows!r}")
        if not isinstance(self.header, bool):
            raise InputError(f"rig: header must be true or false, got {self.header!r}")
        if isinstance(self.skip_rows, bool) or not isinstance(self.skip_rows, int) or self.skip_rows < 0:
            raise InputError(f"rig: skip_rows must be a count of lines, got {self.skip_rows!r}")
        if self.segment is not None and (type(self.segment) is not int or self.segment < 1):
            raise InputError(f"rig: segment must be the number of a segment from 1, got {self.segment!r}")
        if self.window is not None:
            try:
                start, end = (float(value) for value in self.window)
            except (TypeError, ValueError):
                raise InputError(f"rig: window must be [start, end] in s, got {self.window!r}") from None
            if not start < end:
                raise InputError(f"rig: window must be [start, end] with start < end, got {self.window!r}")
            object.__setattr__(self, "window", (start, end))

    @classmethod
    def from_table(cls, table: Mapping[str, Any], where: str = "rig") -> Layout:
        """From the table ``[read]``; `where` names the file in error messages."""
        if not isinstance(table, Mapping):
            raise InputError(f"{where}: read must be a table [read], got {table!r}")
        check_keys(table, [field.name for field in fields(cls)], [], f"{where}: [read]")
        try:
            return cls(**table)
        except InputError as error:
            raise InputError(str(error).replace("rig:", f"{where}:", 1)) from None

    def to_table(self) -> dict[str, Any]:
        """What differs from the defaults, as `from_table` takes it."""
        plain = {field.name: (getattr(self, field.name), field.default) for field in fields(self)}
        changed = {name: value for name, (value, default) in plain.items() if value != default}
        return {name: list(value) if isinstance(value, tuple) else value for name, value in changed.items()}
