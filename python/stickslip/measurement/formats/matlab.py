"""MATLAB files (v4 to v7): vectors, the rows of matrices, fields of structures, and pieces of a record joined end to end."""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.measurement.formats.table import Table

MATRIX, COMPRESSED = 14, 15
KINDS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
"""Storage of numbers in a file of version 5."""
KINDS_4 = ("f8", "f4", "i4", "i2", "u2", "u1")
"""The same in one of version 4."""
CELL, STRUCTURE, OBJECT = 1, 2, 3
NUMBERS = range(6, 16)
COMPLEX = 0x0800
DEEPEST = 20
"""Cells within cells that a record may have."""
LARGEST = 1 << 30
"""Bytes that a packed variable may unfold to, or `EXPANSION` times the file."""
EXPANSION = 100


class _Damaged(Exception):
    """Bytes that are no MATLAB file, with the reason."""


def matlab_table(path: Path, content: bytes) -> Table:
    """Columns of a MATLAB file.

    A vector keeps its name. The parts of a matrix of up to eight signals are ``"Y(1)"``, ``"Y(2)"``, ..., the fields of a
    structure ``"run.force"``; the cells of a cell array and the elements of an array of structures that hold pieces of one
    record are joined end to end. Read without MATLAB's own library or another: a damaged file is no more than a sentence.

    Raises
    ------
    InputError
        for a file that is damaged, of version 7.3, or without a numeric vector.
    """
    if content[:128].startswith(b"MATLAB 7.3") or content[:8] == b"\x89HDF\r\n\x1a\n":
        raise InputError(f"{path}: this is a MATLAB v7.3 file, which is not read here; save it again with `save -v7`")
    columns: dict[str, Array] = {}
    try:
        for name, value in _variables(content):
            columns |= _columns(name, value)
    except (_Damaged, zlib.error) as error:
        raise InputError(
            f"{path}: not a whole MATLAB v5 file, truncated or damaged ({error}); copy or export it again"
        ) from None
    if not columns:
        raise InputError(f"{path}: holds no numeric column; expected vectors such as t and the instrument")
    return Table(columns, str(path))


def _variables(content: bytes) -> Iterator[tuple[str, Any]]:
    """Name and value of everything in a file: arrays, lists for cells and lists of tables for structures."""
    if 0 in content[:4]:
        yield from _version_4(content)
        return
    mark = content[126:128]
    if len(content) < 128 or mark not in (b"IM", b"MI"):
        raise _Damaged("it has no such header")
    order = "<" if mark == b"IM" else ">"
    largest = max(LARGEST, EXPANSION * len(content))
    for kind, data in _elements(content[128:], order):
        if kind == COMPRESSED:
            unpack = zlib.decompressobj()
            whole = unpack.decompress(data, largest)
            if not unpack.eof:
                raise _Damaged("a packed variable is not whole, or unfolds to more than such a file holds")
            largest -= len(whole)
            inner = list(_elements(whole, order))
            if len(inner) != 1:
                raise _Damaged("a packed variable holds something else")
            kind, data = inner[0]
        if kind == MATRIX and data:
            yield _matrix(data, order, 0)


def _elements(data: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    """Kind and bytes of the elements that follow each other."""
    at = 0
    while at < len(data):
        if len(data) - at < 8:
            raise _Damaged("it ends within an element")
        (word,) = struct.unpack_from(f"{order}I", data, at)
        if word >> 16:  # up to four bytes, in the place of their number
            kind, size, start, end = word & 0xFFFF, word >> 16, at + 4, at + 8
            if size > 4:
                raise _Damaged("an element of four bytes says it has more")
        else:
            kind, (size,) = word, struct.unpack_from(f"{order}I", data, at + 4)
            start = at + 8
            end = start + size if kind == COMPRESSED else start + size + -size % 8
        if start + size > len(data):
            raise _Damaged(f"it ends {start + size - len(data)} bytes before an element does")
        yield kind, data[start : start + size]
        at = end


def _matrix(data: bytes, order: str, depth: int) -> tuple[str, Any]:
    """Name and value of one array; None for text, functions, sparse and complex ones, which are no instruments."""
    if depth > DEEPEST:
        raise _Damaged(f"cells lie within each other more than {DEEPEST} deep")
    elements = _elements(data, order)

    def following(*kinds: int) -> bytes:
        kind, found = next(elements, (0, b""))
        if kind not in kinds:
            raise _Damaged("an array lacks one of its parts")
        return found

    flags = following(6)
    if len(flags) < 4:
        raise _Damaged("an array does not say what it is")
    (flag,) = struct.unpack_from(f"{order}I", flags)
    if flag & 0xFF not in (CELL, STRUCTURE, OBJECT, *NUMBERS) or flag & COMPLEX:
        return "", None
    sizes = np.frombuffer(_whole(following(5), 4), f"{order}i4").tolist()
    if not sizes or min(sizes) < 0:
        raise _Damaged("an array has no size, or a negative one")
    count = math.prod(sizes)
    name = _text(following(1, 2, 16))
    if flag & 0xFF in NUMBERS:
        kind, raw = next(elements, (9, b""))
        if kind not in KINDS:
            raise _Damaged("numbers of a kind that there is not")
        form = np.dtype(order + KINDS[kind])
        if len(raw) != count * form.itemsize:
            raise _Damaged(f"an array of {count} numbers has the bytes of {len(raw) / form.itemsize:g}")
        return name, np.frombuffer(raw, form).reshape(sizes, order="F")
    keys: list[str] = []
    if flag & 0xFF != CELL:
        if flag & 0xFF == OBJECT:
            following(1, 2, 16)
        width = int.from_bytes(following(5)[:4], "little" if order == "<" else "big")
        text = following(1, 2, 16)
        if not 0 < width <= 64 or len(text) % width:
            raise _Damaged("a structure does not name its fields")
        keys = [_text(text[i : i + width]) for i in range(0, len(text), width)]
    values = [_matrix(part, order, depth + 1)[1] if part else None for kind, part in elements if kind == MATRIX]
    if len(values) != count * (len(keys) or 1):
        raise _Damaged(f"{count} cells or structures have {len(values)} values")
    if flag & 0xFF == CELL:
        return name, values
    return name, [
        dict(zip(keys, values[i : i + len(keys)], strict=True)) for i in range(0, len(values), len(keys) or 1)
    ]


def _version_4(content: bytes) -> Iterator[tuple[str, Any]]:
    order = "<" if struct.unpack_from("<I", content.ljust(4, b"\0"))[0] < 5000 else ">"
    at = 0
    while at < len(content):
        if len(content) - at < 20:
            raise _Damaged("it ends within a header")
        kind, rows, columns, imaginary, length = struct.unpack_from(f"{order}5i", content, at)
        precision = kind // 10 % 10
        if not 0 <= kind < 5000 or precision >= len(KINDS_4) or min(rows, columns, length) < 0:
            raise _Damaged("it has no such header")
        form = np.dtype(order + KINDS_4[precision])
        start = at + 20 + length
        size = rows * columns * form.itemsize
        end = start + size * (2 if imaginary else 1)
        if end > len(content):
            raise _Damaged(f"it ends {end - len(content)} bytes before an array does")
        if kind % 10 == 0 and not imaginary:
            values = np.frombuffer(content, form, rows * columns, start)
            yield _text(content[at + 20 : start]), values.reshape((rows, columns), order="F")
        at = end


def _whole(data: bytes, width: int) -> bytes:
    return data[: len(data) - len(data) % width]


def _text(data: bytes) -> str:
    return data.split(b"\0")[0].decode("latin-1")


def _columns(name: str, value: Any) -> dict[str, Array]:
    if isinstance(value, list):
        parts = [_columns(name, cell) for cell in value]
        if not parts or not parts[0] or any(part.keys() != parts[0].keys() for part in parts):
            return {}
        return {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    if isinstance(value, dict):
        fields = [_columns(f"{name}.{key}", item) for key, item in value.items()]
        return {key: column for field in fields for key, column in field.items()}
    if value is None or value.size < 2 or value.ndim > 2:
        return {}
    plain = np.asarray(value, dtype=np.float64)
    if max(plain.shape) == plain.size:
        return {name: np.ascontiguousarray(plain.ravel())}
    signals = plain if plain.shape[0] <= plain.shape[1] else plain.T
    if len(signals) > 8:
        return {}
    return {f"{name}({i})": np.ascontiguousarray(signal) for i, signal in enumerate(signals, start=1)}
