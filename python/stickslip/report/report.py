"""A self-contained HTML report: headings, sentences, tables and figures in one file that needs nothing else."""

from __future__ import annotations

import base64
import html
import io
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip.files.disk import write_text

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure, SubFigure

UNFOLDED = 4
"""Sentences of a list that are shown; the others are folded."""

PANELS = 6
"""Inches from which a picture has several panels, which a phone shows at a readable size."""

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*(e[-+]\d+)?|inf)|–")
"""A text that is a number, or stands for one that is not known."""

_STYLE = """
:root { color-scheme: light dark; --text: #222; --soft: #5a5a5a; --line: #ddd; --back: #fff; --card: #f5f6f8;
  --good: #00704f; --bad: #b03a00; --link: #0072b2; }
@media (prefers-color-scheme: dark) { :root { --text: #e6e6e6; --soft: #a8a8a8; --line: #3a3d42; --back: #16181c;
  --card: #22252b; --good: #4cc9a0; --bad: #ff9a6b; --link: #6bb8ea; } }
* { box-sizing: border-box; }
body { font: 16px/1.55 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; color: var(--text);
  background: var(--back); overflow-wrap: anywhere; }
a { color: var(--link); } h1, h2 { line-height: 1.2; }
h2 { margin-top: 2.5rem; border-bottom: 1px solid var(--line); padding-bottom: 0.2rem; }
.summary { font-size: 1.15rem; }
.key { display: flex; flex-wrap: wrap; gap: 0.8rem; margin: 1.2rem 0; padding: 0; }
.key div { flex: 1 1 12rem; background: var(--card); border-radius: 8px; padding: 0.8rem 1rem; }
.key dt { color: var(--soft); font-size: 0.85rem; }
.key dd { margin: 0; font-size: 1.35rem; font-variant-numeric: tabular-nums; }
nav ol { columns: 14rem; column-gap: 2.5rem; padding-left: 1.2rem; }
figure { margin: 1.5rem 0; } figure img { max-width: 100%; border-radius: 6px; background: #fff; }
figcaption { color: var(--soft); font-size: 0.9rem; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 0.9rem; }
th, td { min-width: 4rem; padding: 0.25rem 0.8rem 0.25rem 0;
  border-bottom: 1px solid var(--line); text-align: left; vertical-align: top; }
td.number { text-align: right; } .scroll { overflow-x: auto; } .scroll table { overflow-wrap: normal; }
pre { background: var(--card); padding: 0.8rem; overflow-x: auto; border-radius: 6px; }
details { margin: 1rem 0; } summary { cursor: pointer; color: var(--link); }
tr.reproduced td:last-child, tr.yes td:last-child { color: var(--good); }
tr.not td:last-child, tr.no td:last-child { color: var(--bad); }
@media (max-width: 30rem) { figure.wide { overflow-x: auto; } figure.wide > img { max-width: none; width: 40rem; }
  body { margin: 1rem auto; font-size: 15px; } h1 { font-size: 1.5rem; } }
"""


class Report:
    """A report that is put together from top to bottom and written at the end.

    >>> report = Report("A law")
    >>> report.heading("Data")
    >>> report.text("Three records.")
    >>> '<h2 id="s1">Data</h2>' in report.html()
    True
    """

    def __init__(self, title: str) -> None:
        self.title = title
        self._summary = ""
        self._headings: list[str] = []
        self._body: list[str] = []
        self._live = False

    def summary(self, sentence: str, numbers: Mapping[str, str]) -> None:
        """Set what a reader should know first: one sentence and a few numbers, each with its name."""
        cards = "".join(
            f"<div><dt>{html.escape(name)}</dt><dd>{html.escape(number)}</dd></div>" for name, number in numbers.items()
        )
        self._summary = f'<p class="summary">{_prose(sentence)}</p><dl class="key">{cards}</dl>'

    def heading(self, text: str) -> None:
        """Start a section, which the contents name."""
        self._headings.append(text)
        self._body.append(f'<h2 id="s{len(self._headings)}">{html.escape(text)}</h2>')

    def text(self, text: str) -> None:
        """Add a paragraph."""
        self._body.append(f"<p>{_prose(text)}</p>")

    def items(self, texts: list[str]) -> None:
        """Add a list of sentences, if there are any; those after the first few are folded."""
        shown, folded = texts[:UNFOLDED], texts[UNFOLDED:]
        if shown:
            self._body.append(_list(shown))
        if folded:
            self._body.append(f"<details><summary>{len(folded)} more</summary>{_list(folded)}</details>")

    def code(self, text: str) -> None:
        """Add a block as it is typed."""
        self._body.append(f"<pre>{html.escape(text)}</pre>")

    def table(self, frame: pd.DataFrame, mark: str | None = None) -> None:
        """Add a table, its index as the first column; the first word of column `mark` becomes the class of a row."""
        head = "".join(
            f"<th>{html.escape(str(name))}</th>"
            for name in ("" if frame.index.name is None else frame.index.name, *frame.columns)
        )
        rows = []
        for label, values in zip(frame.index, frame.itertuples(index=False), strict=True):
            cells = f"<th>{html.escape(str(label))}</th>" + "".join(_cell(value) for value in values)
            word = str(frame.loc[label, mark]).split(" ")[0] if mark else ""
            rows.append(f'<tr class="{html.escape(word)}">{cells}</tr>')
        self._body.append(f'<div class="scroll"><table><tr>{head}</tr>{"".join(rows)}</table></div>')

    def figure(
        self,
        figure: Figure | SubFigure | None,
        caption: str,
        live: Mapping[str, Any] | None = None,
        panels: str = "rig,law,phase",
    ) -> None:
        """Add a picture, drawn into the page, and close it.

        With `live`, what :mod:`stickslip.explorer` is to show, it becomes a motion where scripts run: the law can be moved.
        """
        import matplotlib.pyplot as plt

        whole = figure.get_figure(root=True) if figure is not None else None
        if whole is None:
            raise ValueError("a report shows a figure that has been drawn")
        width, _ = whole.get_size_inches()
        kind = ' class="wide"' if width > PANELS else ""
        data = io.BytesIO()
        whole.savefig(data, format="png", dpi=130)
        plt.close(whole)
        source = base64.b64encode(data.getvalue()).decode()
        words = html.escape(caption)
        picture = f'<img alt="{words}" src="data:image/png;base64,{source}">'
        if live is not None:
            from stickslip import explorer

            self._live = True
            picture = explorer.live(live, panels, picture)
        self._body.append(f"<figure{kind}>{picture}<figcaption>{words}</figcaption></figure>")

    def html(self) -> str:
        """The whole page."""
        title = html.escape(self.title)
        view = '<meta name="viewport" content="width=device-width, initial-scale=1">'
        head = f'<meta charset="utf-8">{view}<title>{title}</title>'
        entries = "".join(
            f'<li><a href="#s{number}">{html.escape(text)}</a></li>' for number, text in enumerate(self._headings, 1)
        )
        contents = f'<nav aria-label="Contents"><ol>{entries}</ol></nav>' if entries else ""
        parts = [f"<h1>{title}</h1>", self._summary, contents, *self._body]
        if self._live:
            from stickslip import explorer

            parts.append(explorer.program())
        body = "\n".join(part for part in parts if part)
        head += f"<style>{_STYLE}</style>"
        return f"<!doctype html><html lang=en><head>{head}</head><body>{body}\n</body></html>\n"

    def write(self, path: str | Path) -> Path:
        """Write the page, whole or not at all."""
        return write_text(path, self.html(), ".html", ".htm")


def _prose(text: str) -> str:
    """A sentence as HTML; what stands between backquotes is code.

    >>> _prose("`--law` is < 2")
    '<code>--law</code> is &lt; 2'
    """
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", html.escape(text))


def _list(texts: list[str]) -> str:
    return "<ul>" + "".join(f"<li>{_prose(text)}</li>" for text in texts) + "</ul>"


def _cell(value: object) -> str:
    if isinstance(value, float):
        return f'<td class="number">{"–" if math.isnan(value) else f"{value:.5g}"}</td>'
    if isinstance(value, int):
        return f'<td class="number">{value}</td>'
    kind = ' class="number"' if _NUMBER.fullmatch(str(value)) else ""
    return f"<td{kind}>{html.escape(str(value))}</td>"
