"""MATLAB files (v4 to v7): vectors, the rows of matrices, fields of structures, and pieces of a record joined end to end."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.files.child_process import damaged, read_apart
from stickslip.measurement.formats.table import Table

WHAT = "whole MATLAB v5 file"


def matlab_table(path: Path, content: bytes) -> Table:
    """Columns of a MATLAB file.

    A vector keeps its name. The parts of a matrix of up to eight signals are ``"Y(1)"``, ``"Y(2)"``, ..., the fields of a
    structure ``"run.force"``; the cells of a cell array and the elements of an array of structures that hold pieces of one
    record are joined end to end. Read apart from this process: SciPy can crash on a damaged file, or ask for all memory.

    Raises
    ------
    InputError
        for a file that is damaged, of version 7.3, or without a numeric vector.
    """
    if content[:128].startswith(b"MATLAB 7.3") or content[:8] == b"\x89HDF\r\n\x1a\n":
        raise InputError(f"{path}: this is a MATLAB v7.3 file, which is not read here; save it again with `save -v7`")
    variables = read_apart("scipy.io:loadmat", path, WHAT)
    if _ends_early(content):
        raise InputError(damaged(path, WHAT, "it ends within a variable"))
    columns: dict[str, Array] = {}
    for name, value in variables.items():
        if name.startswith("__"):  # the head of the file, and the workspace of functions
            continue
        if isinstance(value, str):  # what SciPy says of a variable that it cannot read
            raise InputError(damaged(path, WHAT, value))
        columns |= _columns(name, _plain(value))
    if not columns:
        raise InputError(f"{path}: holds no numeric column; expected vectors such as t and the instrument")
    return Table(columns, str(path))


def _ends_early(content: bytes) -> bool:
    """Whether a variable of a v5 file says that it is longer than what is left: SciPy passes over those that follow it."""
    if 0 in content[:4]:
        return False
    at, order = 128, ">" if content[126:128] == b"MI" else "<"
    while at < len(content):
        at += 8 + struct.unpack_from(f"{order}I", content, at + 4)[0]
    return at > len(content)


def _plain(value: Any) -> Any:
    """Arrays, lists for cells and lists of tables for structures; None for what is no instrument: text, functions, ..."""
    from scipy.io.matlab import MatlabFunction, MatlabOpaque

    if not isinstance(value, np.ndarray) or isinstance(value, MatlabFunction | MatlabOpaque):
        return None
    items = value.ravel(order="F")
    if value.dtype.names:
        return [{name: _plain(item[name]) for name in value.dtype.names} for item in items]
    if value.dtype == object:
        return [_plain(item) for item in items]
    return value if value.dtype.kind in "biuf" else None


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
