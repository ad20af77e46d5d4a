"""What every result of a fit has: one report, a short form for prompts and notebooks, equality by content."""

from __future__ import annotations

import html
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from stickslip.files.disk import write_text
from stickslip.files.equality import ByContent
from stickslip.files.units import to_error

SHOWN = 6
"""Numbers in the short form."""
WIDTH = 100
"""Characters of the heading in the short form."""


class Result(ByContent):
    """A fit's result, a dataclass with `notes` (plain sentences); its numbers are printed by tables with value and error."""

    notes: list[str]

    def heading(self) -> list[str]:
        """What was fitted to what, in a line or two."""
        raise NotImplementedError

    def tables(self) -> list[str]:
        """The tables of the report, that of the parameters first."""
        raise NotImplementedError

    def estimates(self) -> pd.DataFrame:
        """Value, error, low and high (95 %) by name."""
        raise NotImplementedError

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and words."""
        raise NotImplementedError

    def to_toml(self) -> str:
        """The file of the result: a law file where it is of a law."""
        raise NotImplementedError

    def save(self, path: str | Path) -> Path:
        """Write that file; :func:`stickslip.load_law` and :func:`stickslip.laws.load_covariance` read a law file back."""
        text = self.to_toml()
        return write_text(path, text, ".toml")

    def plot(self, ax: Any = None) -> Any:
        """What was fitted and the fit; returns the Axes."""
        raise NotImplementedError

    @property
    def units(self) -> Mapping[str, str]:
        """The unit of each estimate by its name, where it is known; "1" for a pure number."""
        return {}

    def shown(self) -> pd.DataFrame:
        """The estimates, with their units where any are known."""
        table = self.estimates()
        units = [unit if (unit := self.units.get(str(name), "1")) != "1" else "" for name in table.index]
        return table.assign(unit=units) if any(units) else table

    def report(self) -> str:
        """The result in words and tables."""
        lines = self.heading()
        for table in self.tables():
            lines += ["", table]
        return "\n".join([*lines, "", *[f"- {note}" for note in self.notes]])

    def _first_line(self) -> str:
        first = self.heading()[0]
        return first if len(first) <= WIDTH else first[: WIDTH - 1] + "…"

    def __repr__(self) -> str:
        table = self.shown()
        numbers = [
            f"{name} = {row['value']:.5g} ± {row['error']:.2g} {row.get('unit', '')}".rstrip()
            for name, row in table.iloc[:SHOWN].iterrows()
        ]
        more = [f"and {len(table) - SHOWN} more"] if len(table) > SHOWN else []
        return f"<{type(self).__name__}: {self._first_line()}; {', '.join([*numbers, *more])}>"

    def _repr_html_(self) -> str:
        table = in_digits(self.shown()).to_html()
        notes = f"<p>{len(self.notes)} notes: see report()</p>" if self.notes else ""
        return f"<p>{html.escape(self._first_line())}</p>{table}{notes}"


def in_digits(table: pd.DataFrame) -> pd.DataFrame:
    """A table of estimates as texts, each row in the digits that its error allows.

    >>> table = pd.DataFrame({"value": [5.99883], "error": [0.0015245], "low": [5.99578], "high": [6.00188]}, ["kinetic"])
    >>> in_digits(table).loc["kinetic"].to_list()
    ['5.9988', '0.0015', '5.9958', '6.0019']
    """
    numbers = [name for name in ("value", "error", "low", "high") if name in table]
    texts = [
        to_error(row, error) for row, error in zip(table[numbers].to_numpy(float).tolist(), table["error"], strict=True)
    ]
    return table.assign(**dict(zip(numbers, map(list, zip(*texts, strict=True)), strict=True)) if texts else {})
