"""The page docs/evidence/validation.md of the cases with known numbers, of `known/`: python docs/evidence/validation.py."""

from __future__ import annotations

from pathlib import Path

from known import belts, forced, others, states  # noqa: F401 - each enters its cases, which the page has in this order
from known.case import CASES, rows, spoken, table

__all__ = ["CASES", "PAGE", "page", "rows", "spoken", "table"]

PAGE = Path(__file__).with_suffix(".md")

INTRODUCTION = """# Known numbers

Every number below was known before. It comes from a closed form, in 30 to 60 digits, or from independent integrators.
Those of the cases P come from files and papers of others, to the digits that these have. The public functions of the
package meet all to their digits, less one. Where they do not, the last column says why. The tests compute the table
anew, and `python docs/evidence/validation.py` writes it.

Unless units are given the motion is x″ + d x′ + x = f(w), w = v − x′, with the velocity v of the drive.
"""


def page() -> str:
    """The page, computed anew."""
    return "\n".join([INTRODUCTION, *map(table, CASES)])


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
