"""netCDF files, written whole, and read apart from this process: the library beneath them can crash or hang on a damaged one.

What is in a file is said where it is made: of an orbit in `simulation/orbit.py`.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip.errors import InputError
from stickslip.files.child_process import damaged, memory_for, read_apart
from stickslip.files.disk import check_ending, input_file, write_whole

if TYPE_CHECKING:
    import xarray as xr

WHAT = "netCDF file"


def read_tree(path: str | Path, what: str = WHAT) -> xr.DataTree:
    """All groups of a netCDF file that is an input; `what` it should be.

    Raises
    ------
    InputError
        where it is missing, another kind of file or damaged.
    """
    return tree_of(input_file(path, what))


def write_netcdf(path: str | Path, data: xr.Dataset | xr.DataTree) -> Path:
    """Write a netCDF file whole.

    Raises
    ------
    InputError
        where its name does not end in ``.nc`` or the place cannot be written to.
    """
    check_ending(path, ".nc")
    return write_whole(path, lambda draft: data.to_netcdf(draft, engine="h5netcdf"))


def tree_of(path: Path) -> xr.DataTree:
    """All groups of a netCDF file that is there."""
    import xarray as xr

    groups: dict[str, tuple[dict[str, Any], dict[str, Any]]] = read_apart("stickslip.files.netcdf:contents", path, WHAT)
    try:
        return xr.DataTree.from_dict(
            {name: xr.decode_cf(xr.Dataset(variables, attrs=attrs)) for name, (variables, attrs) in groups.items()}
        ).load()
    except Exception as error:  # noqa: BLE001 the conventions of netCDF fail in many ways where names or units are wrong
        raise InputError(damaged(path, WHAT, error)) from None


def contents(path: Path) -> dict[str, tuple[dict[str, Any], dict[str, Any]]]:
    """Variables (name -> dimensions, values, attributes) and attributes by the path of their group."""
    import h5netcdf  # type: ignore[import-untyped]  # it has no types

    groups: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {}
    with h5netcdf.File(path, "r") as file:
        waiting = [("/", file)]
        declared = 0
        while waiting:
            name, group = waiting.pop()
            declared += sum(math.prod(item.shape) * _width(item.dtype) for item in group.variables.values())
            if declared > (most := memory_for(path)):
                raise InputError(
                    f"{path}: declares {declared / 1e9:.3g} GB of numbers, expected at most {most / 1e9:.3g} GB in a file of "
                    f"{path.stat().st_size} bytes: damaged; make or copy it again"
                )
            variables = {
                str(key): (item.dimensions, _text(item[...]), _plain(item.attrs))
                for key, item in group.variables.items()
            }
            groups[name] = variables, _plain(group.attrs)
            waiting += [(f"{name.rstrip('/')}/{key}", item) for key, item in group.groups.items()]
    return groups


def _text(values: Any) -> Any:
    """Words as text: the library gives them as bytes."""
    import numpy as np

    if not (isinstance(values, np.ndarray) and values.dtype.hasobject):
        return values
    words = [word.decode("utf-8") if isinstance(word, bytes) else word for word in values.ravel()]
    return np.array(words, dtype=object).reshape(values.shape)


def _width(dtype: Any) -> int:
    return int(getattr(dtype, "itemsize", 8))


def _plain(attrs: Any) -> dict[str, Any]:
    """Attributes as text, numbers and arrays of them."""
    import numpy as np

    plain = {}
    for name in attrs:
        value = attrs[name]
        if isinstance(value, bytes):
            value = value.decode("utf-8")
        if not isinstance(value, str | int | float | list | np.ndarray | np.generic):
            raise TypeError(f"the attribute {name} is no text and no number")
        plain[str(name)] = value
    return plain
