"""Cells that are no plain number: dates and times of day, groups of thousands, words below the last row of a table."""

from __future__ import annotations

import re
from datetime import datetime, timedelta
from typing import Literal

import numpy as np

from stickslip.files.arrays import Array

STAMP = re.compile(
    r"(?:(?P<date>\d{4}-\d{1,2}-\d{1,2}|\d{4}/\d{1,2}/\d{1,2}|\d{1,2}\.\d{1,2}\.\d{4}|\d{1,2}/\d{1,2}/\d{4})[ T]+)?"
    r"(?P<hour>\d{1,2}):(?P<minute>\d{2}):(?P<second>\d{2})(?:[.,](?P<part>\d+))?(?P<zone>Z|[+-]\d{2}:?\d{2})?"
)
"""A time of day to the second at least, with or without a date before it."""
GROUPED = {
    ",": re.compile(r"[+-]?\d{1,3}(?:[.'\u00a0\u2009\u202f]\d{3})+(?:,\d*)?"),
    ".": re.compile(r"[+-]?\d{1,3}(?:[,'\u00a0\u2009\u202f]\d{3})+(?:\.\d*)?"),
}
"""A number in groups of thousands, for each decimal mark."""
DAY = timedelta(days=1)


def is_stamp(cell: str) -> bool:
    """Whether a cell is a time of day, with or without a date.

    >>> is_stamp("2024-03-05 23:59:50.000"), is_stamp("23:59:50"), is_stamp("12.5")
    (True, True, False)
    """
    return STAMP.fullmatch(cell) is not None


def seconds_of(cells: list[str]) -> Array:
    """Seconds since the first of these stamps, NaN where a cell is none.

    A time of day that falls back by more than half a day is one of the next day. Days and months that are divided by
    slashes may stand in either order: the one under which the stamps span less is taken.

    >>> seconds_of(["23:59:59.5", "00:00:00.5"]).tolist()
    [0.0, 1.0]
    >>> seconds_of(["05/03/2024 23:59:59", "06/03/2024 00:00:01"]).tolist()
    [0.0, 2.0]
    """
    found = [STAMP.fullmatch(cell) for cell in cells]
    orders = [(2, 1, 0), (2, 0, 1)] if any(one and "/" in (one["date"] or "") for one in found) else [(2, 1, 0)]
    spans: list[Array] = []
    for order in orders:
        try:
            spans.append(_since_first(found, order))
        except ValueError:  # no such day
            continue
    if not spans:
        return np.full(len(cells), np.nan)
    return min(spans, key=lambda one: float(np.nanmax(one) - np.nanmin(one)))


def _since_first(found: list[re.Match[str] | None], order: tuple[int, int, int]) -> Array:
    seconds = np.full(len(found), np.nan)
    first: datetime | None = None
    days, last = 0, timedelta(0)
    for i, one in enumerate(found):
        if one is None:
            continue
        of_day = timedelta(hours=int(one["hour"]), minutes=int(one["minute"]), seconds=int(one["second"]))
        if one["date"]:
            numbers = [int(number) for number in re.split(r"[-./]", one["date"])]
            year, month, day = numbers if numbers[0] > 31 else [numbers[i] for i in order]
            whole = datetime(year, month, day) + of_day
            zone = one["zone"] or "Z"
            if zone != "Z":
                whole -= int(zone[0] + "1") * timedelta(hours=int(zone[1:3]), minutes=int(zone[-2:]))
        else:
            days += last - of_day > DAY / 2
            last = of_day
            whole = datetime(2000, 1, 1) + days * DAY + of_day
        first = first or whole
        seconds[i] = (whole - first).total_seconds() + (float(f"0.{one['part']}") if one["part"] else 0.0)
    since: Array = seconds - seconds[np.isfinite(seconds)][:1]
    return since


def is_grouped(cell: str, decimal: str) -> bool:
    """Whether a cell is surely a number in groups of thousands.

    With a decimal comma ``1.234`` may be a number with a point: one group alone says nothing.

    >>> is_grouped("12.352,5", ","), is_grouped("12.352", ","), is_grouped("1'234.5", "."), is_grouped("1.234", ".")
    (True, False, True, False)
    """
    if not GROUPED[decimal].fullmatch(cell):
        return False
    return decimal in cell or not re.fullmatch(r"[+-]?\d+[.,]\d{3}", cell)


def thousands(cells: list[str], mark: str) -> Literal["no", "maybe", "surely"]:
    """Whether a mark in the cells of a column divides thousands: it is followed by exactly three digits wherever it stands.

    Surely, where whole numbers of up to three digits beside it are larger than what those cells would be with a decimal mark:
    a column that goes on from 975 to 1.004 does not fall.

    >>> thousands(["975", "991", "1.004"], "."), thousands(["2.275", "2.401"], "."), thousands(["2", "1.004"], ".")
    ('surely', 'maybe', 'maybe')
    >>> thousands(["0.996", "1.004"], "."), thousands(["2.5", "1.004"], "."), thousands(["2004", "1.004"], ".")
    ('no', 'no', 'no')
    """
    marked = [cell for cell in cells if mark in cell]
    if not marked or not all(re.fullmatch(rf"[+-]?[1-9]\d{{0,2}}{re.escape(mark)}\d{{3}}", cell) for cell in marked):
        return "no"
    whole = [abs(int(cell)) for cell in cells if re.fullmatch(r"[+-]?\d+", cell)]
    if max(whole, default=0) > 999:
        return "no"
    largest = max(abs(float(cell.replace(mark, "."))) for cell in marked)
    return "surely" if max(whole, default=0) > largest + 1 else "maybe"


def without_groups(cell: str, decimal: str) -> str:
    """The number without the marks between its groups, where all of it is in groups of thousands.

    >>> without_groups("12.352,52", ","), without_groups("352,52", ",")
    ('12352,52', '352,52')
    """
    if not GROUPED[decimal].fullmatch(cell):
        return cell
    whole, mark, part = cell.partition(decimal)
    return re.sub(r"[^\d+-]", "", whole) + mark + part


def is_number(cell: str, decimal: str) -> bool:
    """Whether a cell is a number with this decimal mark."""
    try:
        float(cell.replace(decimal, "."))
    except ValueError:
        return False
    return "_" not in cell  # Python's own way to write numbers, nobody else's


def is_remark(row: list[str], width: int, decimal: str, labelled: bool) -> bool:
    """Whether a row says something about a table of `width` columns instead of being one of its rows.

    It begins with a word. Where the rows of the table do so too (`labelled`), it has another number of cells.

    >>> is_remark(["Maximum", "17.3"], 2, ".", False), is_remark(["1.0", "2.0"], 3, ".", False)
    (True, False)
    """
    first = next((cell for cell in row if cell), "")
    if not re.search(r"[^\W\d_]", first) or is_number(first, decimal) or is_stamp(first):
        return False
    return not labelled or len(row) != width
