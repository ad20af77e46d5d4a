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
COLUMN_HEADS = 16
"""The table of column headers has always this length."""


def look_table(path: Path, content: bytes) -> Table:
    """Columns of a look file, under the names in its header where these are distinct, else 1, 2, ...

    Layout: 20 bytes name, four int32 (rows, columns, two unused), 16 column headers of 84 bytes, then one float32 array
    a column.

    Raises
    ------
    InputError
        where the length does not fit the counts in the header.
    """
    if len(content) < HEAD + COLUMN_HEADS * COLUMN_HEAD:
        raise InputError(f"{path}: {len(content)} bytes are too few for a look file; copy it again")
    rows, count = struct.unpack(">ii", content[20:28])
    start = HEAD + COLUMN_HEADS * COLUMN_HEAD
    if not (rows > 0 and 0 < count <= COLUMN_HEADS):
        raise InputError(f"{path}: not a look file: its header says {rows} rows and {count} columns")
    heads = [content[HEAD + i * COLUMN_HEAD : HEAD + (i + 1) * COLUMN_HEAD] for i in range(COLUMN_HEADS)]
    lengths = [struct.unpack(">i", head[80:84])[0] for head in heads]
    used = [i for i, length in enumerate(lengths) if length == rows]
    if len(content) < start + 4 * rows * len(used):
        raise InputError(
            f"{path}: the header promises {len(used)} columns of {rows} rows, {start + 4 * rows * len(used)} bytes, "
            f"and the file has {len(content)}: truncated; copy it again"
        )
    names = [head[:13].split(b"\x00")[0].decode("latin-1").strip() for head in (heads[i] for i in used)]
    if len(set(names)) < len(names) or not all(names):
        names = [str(i) for i in range(1, len(used) + 1)]
    table = np.frombuffer(content, dtype=">f4", count=rows * len(used), offset=start).reshape(len(used), rows)
    return Table({name: table[i].astype(np.float64) for i, name in enumerate(names)}, str(path))
