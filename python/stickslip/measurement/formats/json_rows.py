"""JSON files that keep a record as a list of rows under one key."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from stickslip.errors import InputError
from stickslip.measurement.formats.table import Table
from stickslip.measurement.rigs.layout import Layout


def json_table(path: Path, content: bytes, layout: Layout) -> Table:
    """Columns of a JSON file ``{"data": [[...], ...]}``; rows are lists (columns 1, 2, ...) or objects (by name).

    Raises
    ------
    InputError
        with row and column for what is no number.
    """
    try:
        document = json.loads(content)
    except (ValueError, RecursionError) as error:  # also thousands of digits, or of brackets in brackets
        raise InputError(f"{path}: not a JSON document, truncated or damaged ({error}); export it again") from None
    rows = document.get(layout.rows) if isinstance(document, dict) else document
    if not isinstance(rows, list) or not rows:
        keys = ", ".join(document) if isinstance(document, dict) else "none"
        raise InputError(f"{path}: there is no list of rows under {layout.rows!r}; the keys are {keys:.400}")
    for number, row in enumerate(rows, start=1):
        if not isinstance(row, type(rows[0])) or not isinstance(row, list | dict):
            raise InputError(f"{path}: row {number} must be a list or an object as all others, got {row!r:.60}")
    named = isinstance(rows[0], dict)
    names = [str(key) for key in rows[0]] if named else [str(i) for i in range(1, len(rows[0]) + 1)]
    try:
        values = [[row[name] for name in names] for row in rows] if named else rows
        table = np.array(values, dtype=np.float64)  # None becomes NaN
        if table.shape != (len(rows), len(names)):
            raise ValueError
    except (TypeError, ValueError, KeyError, OverflowError):
        for number, row in enumerate(rows, start=1):
            cells = [row.get(name) for name in names] if isinstance(row, dict) else list(row)
            if len(cells) != len(names):
                raise InputError(f"{path}: row {number} has {len(cells)} cells and row 1 {len(names)}") from None
            for name, cell in zip(names, cells, strict=True):
                if cell is not None and (isinstance(cell, bool) or not isinstance(cell, int | float)):
                    raise InputError(
                        f"{path}: row {number}, column {name!r}: a number was expected, got {cell!r}"
                    ) from None
        raise InputError(f"{path}: the rows do not form a table; export it again") from None
    return Table({name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(names)}, str(path))
