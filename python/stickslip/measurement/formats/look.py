"""The binary "look" files of rock-mechanics laboratories, big-endian, with the rows in columns."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from stickslip.errors import InputError
from stickslip.measurement.formats.table import Table

HEAD = 36
"""Bytes: a name of 20, rows, columns and two unused, as int32."""
COLUMN_HEAD = 84
"""Bytes: name 13, unit 13, padding, gain, comment 50, rows."""
COLUMN_HEADS = (16, 32)
"""The tables of column headers there are; which of them a file has, its length says."""


def look_table(path: Path, content: bytes) -> Table:
    """Columns of a look file, under the names in its header where these are distinct, else 1, 2, ...

    Layout: 20 bytes name, four int32 (rows, columns, two unused), 16 or 32 column headers of 84 bytes, then one float32
    array a column.

    Raises
    ------
    InputError
        where the length does not fit the counts in the header.
    """
    if len(content) < HEAD + COLUMN_HEADS[0] * COLUMN_HEAD:
        raise InputError(f"{path}: {len(content)} bytes are too few for a look file; copy it again")
    rows, count = struct.unpack(">ii", content[20:28])
    if not (rows > 0 and 0 < count <= COLUMN_HEADS[-1]):
        raise InputError(f"{path}: not a look file: its header says {rows} rows and {count} columns")
    promised = []
    for heads in COLUMN_HEADS:
        start = HEAD + heads * COLUMN_HEAD
        table = [content[at : at + COLUMN_HEAD] for at in range(HEAD, min(start, len(content)), COLUMN_HEAD)]
        used = [head for head in table if head[80:] == content[20:24]]
        promised.append(start + 4 * rows * len(used))
        if promised[-1] == len(content):
            break
    else:
        raise InputError(
            f"{path}: the header promises columns of {rows} rows, {' or '.join(map(str, promised))} bytes with "
            f"{' or '.join(map(str, COLUMN_HEADS))} column heads, and the file has {len(content)}: damaged or truncated; "
            "copy it again"
        )
    if not used:
        raise InputError(f"{path}: no column of this look file has the {rows} rows of its header; copy it again")
    names = [head[:13].split(b"\x00")[0].decode("latin-1").strip() for head in used]
    if len(set(names)) < len(names) or not all(names):
        names = [str(i) for i in range(1, len(used) + 1)]
    columns = np.frombuffer(content, dtype=">f4", count=rows * len(used), offset=start).reshape(len(used), rows)
    return Table({name: column.astype(np.float64) for name, column in zip(names, columns, strict=True)}, str(path))
