"""What every reader hands on: named columns, and where each row stood in the file."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from stickslip.errors import InputError, did_you_mean
from stickslip.files.arrays import Array, Mask
from stickslip.files.units import contradicts, of_other_kinds, unit_in_name


def whole_name(column: str | int, names: Collection[str]) -> str | None:
    """The one name that is a column's name with a unit behind it, such as ``Weg [mm]`` of ``Weg``.

    >>> whole_name("Weg", ["t [s]", "Weg [mm]"])
    'Weg [mm]'
    """
    found = [name for name in names if unit_in_name(name) and re.split(r"\s*[\[(]", name)[0] == column]
    return found[0] if len(found) == 1 and column not in names else None


@dataclass(frozen=True)
class Table:
    """Columns of a record.

    Attributes
    ----------
    columns : name -> (n,) floats, in the order of the file; columns of a MATLAB file may differ in length.
    source : of the file, for messages.
    rows : (n,) line (text) or row number of every sample; None where they count from `first_row`.
    first_row : number of the first row as a person counts.
    notes : what was left out while reading.
    units : name -> unit, for the columns of which the file says it.
    scale_error : relative standard error that all lengths share, as a motion states it; 0 where nothing is stated.
    faults : row -> what is wrong in it, of rows that stand as NaN; :meth:`refuse_faults` refuses them where they are used.
    """

    columns: dict[str, Array]
    source: str
    rows: npt.NDArray[np.int64] | None = None
    first_row: int = 1
    notes: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    scale_error: float = 0.0
    faults: Mapping[int, str] = field(default_factory=dict)

    def name_of(self, column: str | int) -> str:
        """The name of a column that is given by its name or its number (from 1)."""
        if isinstance(column, int):
            names = list(self.columns)
            if not 1 <= column <= len(names):
                raise InputError(f"{self.source}: there is no column {column}; the file has {len(names)}")
            return names[column - 1]
        if (whole := whole_name(column, self.columns)) is not None:
            return whole
        if column not in self.columns:
            names = [*self.columns][:40]
            longer = [name for name in names if column in re.split(r"\W+", name)]  # "x" of "x [mm]" or "% x"
            hint = f" (did you mean {longer[0]!r}?)" if len(longer) == 1 else did_you_mean(column, names)
            raise InputError(
                f"{self.source}: there is no column {column!r}{hint}; the columns are {', '.join(names) or 'none'}"
            )
        return column

    def unit_of(self, column: str) -> str | None:
        """The unit that the file says for a column, in its name or beside it."""
        return self.units.get(column) or unit_in_name(column)

    def refuse_unit(self, column: str, unit: str, stated: str | None, write: str) -> None:
        """Refuse a unit of the rig whose size is not that of the one `stated`; `write` is what the rig should say."""
        if contradicts(unit, stated):
            advice = f"write {write.format(stated)} in the rig"
            if stated is not None and of_other_kinds(unit, stated):
                advice = "name another column, correct the unit, or give what a reading is in it as scale"
            raise InputError(f"{self.source}: {column!r} is in {stated} and the rig says {unit}; {advice}")

    def part(self, rows: Mask) -> Table:
        """The table that numbers its rows as those of a part of its samples; its columns stay whole."""
        numbers = np.arange(len(rows)) + self.first_row if self.rows is None else self.rows
        return replace(self, rows=numbers[rows])

    def refuse_faults(self) -> None:
        """Refuse the first of its rows that is no row of numbers."""
        rows = set() if self.rows is None else set(self.rows.tolist())
        for row, fault in self.faults.items():
            if row in rows:
                raise InputError(f"{self.source}: {fault}")

    def row(self, index: int) -> int:
        """Number of a sample's row in the file."""
        return int(index) + self.first_row if self.rows is None else int(self.rows[index])
