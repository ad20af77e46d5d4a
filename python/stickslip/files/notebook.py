"""How values look at a prompt and in a notebook."""

from __future__ import annotations

import html
from collections.abc import Mapping
from typing import Any

import numpy as np

SHORT = 6
"""Items of a list up to which all are shown."""
LONG = 160
"""Characters from which on a tuple is shortened."""


class InNotebook:
    """What a notebook shows as a table of facts; a subclass says which by `facts`."""

    def facts(self) -> Mapping[str, Any]:
        """What there is to see, by name."""
        raise NotImplementedError

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><th style='text-align:left'>{html.escape(name.replace('_', ' '))}</th>"
            f"<td style='text-align:left'>{html.escape(brief(value))}</td></tr>"
            for name, value in self.facts().items()
        )
        return f"<b>{type(self).__name__}</b><table>{rows}</table>"


class OfTable:
    """A result whose contents are a table and sentences: one line at a prompt, the table in a notebook."""

    table: Any

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and words: the rows of the table by their names, None for what is missing, and the sentences."""
        table = self.table.astype(object).where(self.table.notna(), None)
        return {"table": table.to_dict("index"), "sentences": list(getattr(self, "sentences", ()))}

    def __repr__(self) -> str:
        more = ": see report()" if hasattr(self, "report") else ""
        return f"<{type(self).__name__} of {brief(list(map(str, self.table.index)))}{more}>"

    def _repr_html_(self) -> str:
        sentences = "".join(f"<li>{html.escape(line)}</li>" for line in getattr(self, "sentences", ())[:SHORT])
        return f"{self.table.to_html(float_format=lambda number: f'{number:.5g}')}<ul>{sentences}</ul>"


def brief(value: Any) -> str:
    """A value in one line: numbers to six digits, of a long list the ends and how many there are.

    >>> brief([1.0, 2.0]), brief(tuple(range(50)))
    ('1, 2', '0, 1, ..., 49 (50 in all)')
    """
    if isinstance(value, float | np.floating):
        return f"{value:.6g}"
    if isinstance(value, list | tuple | np.ndarray):
        some = [brief(item) for item in (value if len(value) <= SHORT else (*value[:2], value[-1]))]
        if len(value) > SHORT:
            return f"{some[0]}, {some[1]}, ..., {some[2]} ({len(value)} in all)"
        return ", ".join(
            f"({one})" if isinstance(item, list | tuple) else one for one, item in zip(some, value, strict=True)
        )
    return str(value)


def shortened(value: Any) -> str:
    """The repr of a value, of a long tuple the ends and how many there are.

    >>> shortened(tuple(range(100)))
    '(0, 1, ..., 99; 100 in all)'
    """
    text = repr(value)
    if isinstance(value, tuple) and len(value) > 3 and len(text) > LONG:
        first, second, last = map(shortened, (value[0], value[1], value[-1]))
        return f"({first}, {second}, ..., {last}; {len(value)} in all)"
    return text
