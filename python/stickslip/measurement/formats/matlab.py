"""MATLAB files (v5): vectors, the rows of matrices, and cell arrays joined end to end."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from stickslip.errors import InputError
from stickslip.measurement.formats.table import Table

Array = npt.NDArray[np.float64]


def matlab_table(path: Path, content: bytes) -> Table:
    """Columns of a MATLAB file.

    A vector keeps its name. The parts of a matrix of up to eight signals are ``"Y(1)"``, ``"Y(2)"``, ...; the cells of
    a cell array that hold pieces of one record are joined end to end under the name of the array.

    Raises
    ------
    InputError
        for a file that is damaged, of version 7.3, or without a numeric vector.
    """
    from scipy.io import loadmat

    if content[:128].startswith(b"MATLAB 7.3") or content[:8] == b"\x89HDF\r\n\x1a\n":
        raise InputError(f"{path}: this is a MATLAB v7.3 file, which is not read here; save it again with `save -v7`")
    try:
        variables: dict[str, Any] = loadmat(io.BytesIO(content))  # type: ignore[arg-type]  # the stubs know paths only
    except Exception as error:  # noqa: BLE001 the reader raises some ten types on damaged bytes
        reason = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
        raise InputError(
            f"{path}: not a whole MATLAB v5 file, truncated or damaged ({reason}); copy or export it again"
        ) from None
    columns: dict[str, Array] = {}
    for name, value in variables.items():
        if not name.startswith("__") and isinstance(value, np.ndarray):
            columns |= _columns(name, value)
    if not columns:
        raise InputError(f"{path}: holds no numeric column; expected vectors such as t and the gauge")
    return Table(columns, str(path))


def _columns(name: str, value: npt.NDArray[Any]) -> dict[str, Array]:
    if value.dtype == object:
        parts = [_columns(name, np.asarray(cell)) for cell in value.ravel()]
        if not parts or not parts[0] or any(part.keys() != parts[0].keys() for part in parts):
            return {}
        return {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    if value.dtype.kind not in "fiu" or value.size < 2 or value.ndim > 2:
        return {}
    plain = np.asarray(value, dtype=np.float64)
    if max(plain.shape) == plain.size:
        return {name: np.ascontiguousarray(plain.ravel())}
    signals = plain if plain.shape[0] <= plain.shape[1] else plain.T
    if len(signals) > 8:
        return {}
    return {f"{name}({i})": np.ascontiguousarray(signal) for i, signal in enumerate(signals, start=1)}
