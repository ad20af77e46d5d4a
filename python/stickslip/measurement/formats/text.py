"""CSV and other text: headers or none, blanks or commas, words between the numbers, lines torn off."""

from __future__ import annotations

import csv
import io
import itertools
import math
import re
from collections.abc import Callable, Collection
from dataclasses import replace
from pathlib import Path

import numpy as np

from stickslip.errors import InputError
from stickslip.files.units import unit_in_name
from stickslip.measurement.formats.cells import (
    is_grouped,
    is_number,
    is_remark,
    is_stamp,
    seconds_of,
    thousands,
    without_groups,
)
from stickslip.measurement.formats.table import Table, whole_name
from stickslip.measurement.rigs.layout import DELIMITERS, Layout

HEADER_LINES = 60
"""So far down a header is looked for where the first line is none."""
FOOTER_LINES = 20
"""So many lines below the last row of numbers may be remarks."""
BINARY = re.compile(r"[^\t\n\f\r\x20-\x7e\xa0-\U0010ffff]")
"""Control characters, which no text holds."""


def text_table(path: Path, content: bytes, layout: Layout, wanted: Collection[str | int] | None = None) -> Table:
    """Columns of a text file.

    Parameters
    ----------
    path, content : name, for messages, and bytes of the file.
    layout : header, delimiter, decimal mark, what to do with torn rows and missing cells. With a window what is wrong in
        a row is kept beside it, to be refused where it is used.
    wanted : columns that must be numbers, if they are there; the others may hold words and come out empty. None: all of
        them.

    Raises
    ------
    InputError
        with row and column for a cell that is no number or a row that is too short, where there is no window.
    """
    text = _decoded(path, content)
    lines = text.splitlines()
    rows = [
        (number, line)
        for number, line in enumerate(lines, start=1)
        if number > layout.skip_rows and line.strip() and not line.startswith("#")
    ]
    least = 2 if layout.header else 1
    if len(rows) < least:
        what = "a header line and rows of numbers were" if layout.header else "rows of numbers were"
        raise InputError(f"{path}: {what} expected, got {len(rows)} line(s)")
    delimiter = DELIMITERS[layout.delimiter] if layout.delimiter else _delimiter(rows[0][1], layout.decimal)

    def cells(line: str) -> list[str]:
        if delimiter is None:
            return line.split()
        try:
            return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter, strict=True))]
        except csv.Error:  # a quotation mark that is not closed
            return [cell.strip() for cell in line.split(delimiter)]

    header = cells(rows[0][1])
    if layout.header and all(is_number(name, layout.decimal) for name in header):
        # as numpy's savetxt writes it: the names behind the comment mark
        above = [line for line in lines[layout.skip_rows : rows[0][0] - 1] if line.strip()]
        words = cells(above[-1].lstrip("# \t")) if above else []
        if len(words) == len(header) > 1 and not any(is_number(word, layout.decimal) for word in words):
            header, rows = words, [(rows[0][0] - 1, above[-1]), *rows]
    notes: tuple[str, ...] = ()
    units: dict[str, str] = {}
    if layout.header:
        first_row, rows = rows[0][0], rows[1:]
        if all(is_number(name, layout.decimal) for name in header if name):
            raise InputError(
                f"{path}: row {first_row} holds numbers where a header line with column names was expected; "
                "a rig says [read] header = false for a file without one"
            )
        named = [name for name in header if name]
        if len(set(named)) < len(named):
            raise InputError(f"{path}: row {first_row} names a column twice ({', '.join(header)}); rename one")
        # a column without a name keeps its number, so that the others keep theirs
        header = [name or str(i) for i, name in enumerate(header, start=1)]
        if wanted is not None:
            wanted = [whole_name(column, header) or column for column in wanted]
            rows, units, notes = _below_header(path, first_row, header, rows, wanted, cells, layout.decimal)
        unnamed = {i for i, name in enumerate(header) if name == str(i + 1)}
        # columns that are given by their numbers are the right ones under any header
        by_name = wanted is None or any(column in header for column in wanted)
    else:
        header = [str(i) for i in range(1, len(header) + 1)]
        unnamed = set()
        by_name = False
    # a header that ends in delimiters has columns without a name at its end, which the rows may lack
    least = len(header)
    while least - 1 in unnamed and least > 1:
        least -= 1
    if wanted is None:
        use = [i for i in range(len(header)) if i not in unnamed]
    else:
        names = {*header, *range(1, len(header) + 1)}
        use = sorted({c - 1 if isinstance(c, int) else header.index(c) for c in wanted if c in names})
        if not use:  # who asked will say what is missing
            return Table({name: np.zeros(0) for name in header}, str(path))
    rows, remarks = _above_footer(rows, header, cells, layout.decimal)
    notes += remarks
    body = "\n".join(line for _, line in rows)
    grouped = False
    if layout.decimal == ",":
        # a point would be read as a decimal mark too
        grouped = "." in body and _refuse_doubtful_groups(path, rows, header, use, cells, layout.decimal)
        body = body.replace(",", ".")
    numbers = np.array([number for number, _ in rows], dtype=np.int64)
    try:
        table = np.loadtxt(io.StringIO(body), delimiter=delimiter, ndmin=2, comments=None, usecols=use)
    except ValueError:
        table = None
    # loadtxt does not mind rows that are too long, nor a header that is too short
    if table is not None and not grouped and _rows_fit(rows, least, len(header), delimiter, by_name):
        # the text is looked at again only where the numbers leave room for doubt
        if any(_may_be_grouped(values) for values in table.T):
            _refuse_doubtful_groups(path, rows, header, use, cells, layout.decimal)
        columns = {header[i]: np.ascontiguousarray(table[:, j]) for j, i in enumerate(use)}
        return Table(_in_order(columns, header), str(path), numbers, notes=notes, units=units)
    walked = _walk(path, rows, header, use, cells, delimiter, least, layout)
    return replace(walked, notes=notes + walked.notes, units={**units, **walked.units})


def _rows_fit(rows: list[tuple[int, str]], least: int, most: int, delimiter: str | None, by_name: bool) -> bool:
    """Whether all rows have the cells that the header names; where no name is used, whether they have equally many."""
    if not by_name:
        return delimiter is None or all(line.count(delimiter) == rows[0][1].count(delimiter) for _, line in rows)
    if delimiter is None:
        # words with blanks between them may follow the numbers of some rows
        return least <= min(len(line.split()) for _, line in rows) <= most
    # what lies beyond the header is empty where rows end in delimiters
    return all(
        least <= count <= most or (count > most and not any(cell.strip() for cell in line.split(delimiter)[most:]))
        for count, line in ((line.count(delimiter) + 1, line) for _, line in rows)
    )


def _may_be_grouped(values: np.ndarray) -> bool:
    """Whether these may be thousands that were read as decimals, of which :func:`~.cells.thousands` would be sure."""
    finite = np.abs(values[np.isfinite(values)])
    whole = finite == np.floor(finite)
    if whole.all() or not whole.any() or not 1 < finite[~whole].max() + 1 < finite[whole].max() < 1000:
        return False
    return bool(np.all(np.abs(1000 * finite - np.round(1000 * finite)) < 1e-6))


def _refuse_doubtful_groups(
    path: Path,
    rows: list[tuple[int, str]],
    header: list[str],
    use: list[int],
    cells: Callable[[str], list[str]],
    decimal: str,
) -> bool:
    """Refuse a column whose decimal marks seem to divide thousands; whether in one the other mark surely does."""
    split = [(number, row) for number, line in rows if len(row := cells(line)) >= len(header)]
    other = "." if decimal == "," else ","
    any_grouped = False
    for i in use:
        column = [row[i] for _, row in split]
        groups = thousands(column, other)
        any_grouped |= groups == "surely"
        if thousands(column, decimal) == "surely":
            mark = decimal
            advice = f'seems to be {{}} in groups of thousands; write [read] decimal = "{other}" in the rig'
        elif groups == "maybe" and decimal == ",":
            mark = other
            advice = (
                "may be {} in groups of thousands or have a decimal point: if it has one, write [read] "
                'decimal = "." in the rig, and if not, export it without groups'
            )
        else:
            continue
        number, cell = next((number, row[i]) for number, row in split if mark in row[i])
        said = advice.format(cell.replace(mark, ""))
        raise InputError(f"{path}: row {number}, column {header[i]!r}: {cell!r} {said}")
    return any_grouped


def _fitted(row: list[str], least: int, most: int) -> list[str]:
    """The cells of a row as the header counts them: without empty ones beyond it, with those that no name asks for."""
    if len(row) > most and not any(row[most:]):
        return row[:most]
    return row + [""] * (most - len(row)) if least <= len(row) < most else row


def _look_at(rows: list[list[str]], header: list[str], delimiter: str | None) -> str:
    """What to look at where the first of these rows has another number of cells than the header."""
    if len(rows[0]) > len(header):
        if delimiter == "," and all(re.fullmatch(r"[+-]?\d+", cell) for row in rows for cell in row):
            return "if some of its commas are decimal marks, export it with another delimiter"
        first = [row[0] for row in rows]
        counted = len(first) > 1 and all(len(row) == len(header) + 1 and row[0].isdecimal() for row in rows)
        if counted and all(int(b) - int(a) == 1 for a, b in itertools.pairwise(first)):
            return "the first cells count, so they look like row names: write a name for them before the others"
    return "look at the header"


def _above_footer(
    rows: list[tuple[int, str]], header: list[str], cells: Callable[[str], list[str]], decimal: str
) -> tuple[list[tuple[int, str]], tuple[str, ...]]:
    """The rows above remarks at the end of a file, and a note that names these."""
    end = len(rows)
    first = next((cell for cell in cells(rows[0][1]) if cell), "")
    labelled = not (is_number(first, decimal) or is_stamp(first))
    while end > max(1, len(rows) - FOOTER_LINES) and is_remark(cells(rows[end - 1][1]), len(header), decimal, labelled):
        end -= 1
    if end == len(rows):
        return rows, ()
    left = rows[end:]
    number = "1 line" if len(left) == 1 else f"{len(left)} lines"
    return rows[:end], (f"{number} below the table, from row {left[0][0]} ({left[0][1].strip()[:40]!r}), left out",)


def _below_header(
    path: Path,
    first_row: int,
    header: list[str],
    rows: list[tuple[int, str]],
    wanted: Collection[str | int],
    cells: Callable[[str], list[str]],
    decimal: str,
) -> tuple[list[tuple[int, str]], dict[str, str], tuple[str, ...]]:
    """The rows of numbers below a header line; where the first of them held units, those that are known, and a note."""
    names = {name for name in wanted if isinstance(name, str)}
    if not names & set(header):
        for at, (number, line) in enumerate(rows[:HEADER_LINES]):
            if found := names & set(re.split(r"[\t;,\s]+", line)):
                rest = "\n".join(line for _, line in rows[at + 1 : at + 1 + HEADER_LINES])
                comma = decimal == "." and re.search(r"[;\t]", rest) and re.search(r"\d,\d", rest)
                commas = ' and decimal = ","' if comma else ""
                raise InputError(
                    f"{path}: row {first_row} was read as the header, and row {number} names {', '.join(sorted(found))}; "
                    f"write [read] skip_rows = {number - 1}{commas} in the rig"
                )
    below = cells(rows[0][1])
    if len(rows) > 1 and len(below) == len(header) and not any(any(c.isdigit() for c in cell) for cell in below):
        unlike = [cell for cell in below if cell and cell.lower() not in ("nan", "inf", "-inf")]
        if len(unlike) > 1:
            words = {name: cell.strip(" []()") for name, cell in zip(header, below, strict=True) if cell in unlike}
            units = {name: unit for name, word in words.items() if (unit := unit_in_name(f"[{word}]"))}
            note = f"row {rows[0][0]} has no number in it ({', '.join(unlike)}): it was taken for units"
            if strange := [word for name, word in words.items() if name not in units and name in names]:
                note += f"; {', '.join(strange)} is none that is known, so give the unit of that column in the rig"
            return rows[1:], units, (note,)
    return rows, {}, ()


def _walk(
    path: Path,
    rows: list[tuple[int, str]],
    header: list[str],
    use: list[int],
    cells: Callable[[str], list[str]],
    delimiter: str | None,
    least: int,
    layout: Layout,
) -> Table:
    """Row by row, to drop what the layout says may be dropped and to say where the rest is wrong."""
    kept: list[int] = []
    values: list[list[float]] = []
    torn = 0
    last = rows[-1][0]
    faults: dict[int, str] = {}
    split = [(number, _fitted(cells(line), least, len(header))) for number, line in rows]
    texts = {i: [row[i] for _, row in split if len(row) == len(header)] for i in use}
    stamps = {i: iter(seconds_of(cells)) for i, cells in texts.items() if cells and is_stamp(cells[0])}
    other = "." if layout.decimal == "," else ","
    grouped = {
        i
        for i, cells in texts.items()
        if any(is_grouped(cell, layout.decimal) for cell in cells) or thousands(cells, other) == "surely"
    }

    def fault(number: int, what: str) -> None:
        """Refuse a row, or keep what is wrong in it until it is known whether it lies in the window."""
        if layout.window is None:
            raise InputError(f"{path}: {what}")
        faults[number] = what

    for number, row in split:
        whole = len(row) == len(header)
        if not whole:
            if layout.torn_rows == "drop":
                torn += 1
                continue
            where = "look at the last row, so the file seems truncated"
            if number != last:
                where = _look_at(
                    [row, *(other for at, other in split[:HEADER_LINES] if at > number)], header, delimiter
                )
            fault(number, f"row {number} has {len(row)} cells and the header {len(header)}; {where}")
            row = [""] * len(header)
        value: list[float] = []
        for i in use:
            cell = without_groups(row[i], layout.decimal) if i in grouped else row[i]
            cell = cell.replace(",", ".") if layout.decimal == "," else cell
            seconds = next(stamps[i]) if whole and i in stamps else math.nan
            if math.isfinite(seconds):
                value.append(float(seconds))
            elif i not in stamps and is_number(cell, "."):
                value.append(float(cell))
            elif layout.missing == "drop" or number in faults:
                value.append(float("nan"))
            else:
                comma = is_number(row[i], ",") and '; [read] decimal = "," reads decimal commas'
                wanted = "a date or a time of day" if i in stamps else "a number"
                fault(number, f"row {number}, column {header[i]!r}: {wanted} was expected, got {row[i]!r}{comma or ''}")
                value.append(float("nan"))
        kept.append(number)
        values.append(value)
    if not values:
        raise InputError(f"{path}: the rows do not form a table of {len(header)} columns; export it again")
    table = np.array(values)
    columns = {header[i]: np.ascontiguousarray(table[:, j]) for j, i in enumerate(use)}
    notes = [f"{torn} rows without {len(header)} cells were left out"] if torn else []
    notes += [f"column {header[i]!r} was read in s since its first stamp, {texts[i][0]}" for i in stamps]
    notes += [f"column {header[i]!r} was read with groups of thousands" for i in sorted(grouped)]
    return Table(
        _in_order(columns, header),
        str(path),
        np.array(kept, dtype=np.int64),
        notes=tuple(notes),
        units={header[i]: "s" for i in stamps},
        faults=faults,
    )


def _in_order(columns: dict[str, np.ndarray], header: list[str]) -> dict[str, np.ndarray]:
    """Keep the numbers of the columns: those that were not read stand as empty ones."""
    if len(columns) == len(header):
        return columns
    empty = np.zeros(0)
    return {name: columns.get(name, empty) for name in header}


def _delimiter(line: str, decimal: str) -> str | None:
    marks = ("\t", ";") if decimal == "," else ("\t", ";", ",")
    return next((mark for mark in marks if mark in line), None)


def _decoded(path: Path, content: bytes) -> str:
    """Text in UTF-8, UTF-16 (with its mark, or little-endian), or the Latin-1 in which older instruments write units."""
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        encodings = ["utf-16"]
    else:
        encodings = ["utf-16-le" if content[1:2] == b"\0" else "utf-8-sig", "latin-1"]
    for encoding in encodings:
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        if not BINARY.search(text):
            return text
    raise InputError(
        f"{path}: holds binary bytes, neither text nor a .mat file; export the record as CSV with a header line"
    )
