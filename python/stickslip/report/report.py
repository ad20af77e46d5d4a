"""A self-contained HTML report: headings, sentences, tables and figures in one file that needs nothing else."""

from __future__ import annotations

import base64
import html
import io
import math
from pathlib import Path
from typing import TYPE_CHECKING

from stickslip.files.documents import write_whole

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure, SubFigure

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
h1, h2 { line-height: 1.2; } h2 { margin-top: 2.5rem; border-bottom: 1px solid #ddd; }
figure { margin: 1.5rem 0; } figure img { max-width: 100%; } figcaption { color: #555; font-size: 0.9rem; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 0.9rem; }
th, td { padding: 0.25rem 0.8rem; border-bottom: 1px solid #ddd; text-align: left; vertical-align: top; }
td.number { text-align: right; } .scroll { overflow-x: auto; } pre { background: #f6f6f6; padding: 0.8rem; overflow-x: auto; }
tr.reproduced td:last-child, tr.yes td:last-child { color: #00704f; }
tr.not td:last-child, tr.no td:last-child { color: #b03a00; }
"""


class Report:
    """A report that is put together from top to bottom and written at the end.

    >>> report = Report("A law")
    >>> report.heading("Data")
    >>> report.text("Three records.")
    >>> "<h2>Data</h2>" in report.html()
    True
    """

    def __init__(self, title: str) -> None:
        self.title = title
        self._body: list[str] = []

    def heading(self, text: str) -> None:
        """Start a section."""
        self._body.append(f"<h2>{html.escape(text)}</h2>")

    def text(self, text: str) -> None:
        """Add a paragraph."""
        self._body.append(f"<p>{html.escape(text)}</p>")

    def items(self, texts: list[str]) -> None:
        """Add a list of sentences, if there are any."""
        if not texts:
            return
        self._body.append("<ul>" + "".join(f"<li>{html.escape(text)}</li>" for text in texts) + "</ul>")

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

    def figure(self, figure: Figure | SubFigure | None, caption: str) -> None:
        """Add a picture, drawn into the page, and close it."""
        import matplotlib.pyplot as plt

        whole = figure.get_figure(root=True) if figure is not None else None
        if whole is None:
            raise ValueError("a report shows a figure that has been drawn")
        data = io.BytesIO()
        whole.savefig(data, format="png", dpi=130)
        plt.close(whole)
        source = base64.b64encode(data.getvalue()).decode()
        words = html.escape(caption)
        self._body.append(
            f'<figure><img alt="{words}" src="data:image/png;base64,{source}"><figcaption>{words}</figcaption></figure>'
        )

    def html(self) -> str:
        """The whole page."""
        title = html.escape(self.title)
        head = f'<meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>{title}</title>'
        return f"<!doctype html><html lang=en><head>{head}<style>{_STYLE}</style></head><body><h1>{title}</h1>\n" + (
            "\n".join(self._body) + "\n</body></html>\n"
        )

    def write(self, path: str | Path) -> Path:
        """Write the page, whole or not at all."""
        return write_whole(path, lambda draft: draft.write_text(self.html(), encoding="utf-8"))


def _cell(value: object) -> str:
    if isinstance(value, float):
        return f'<td class="number">{"–" if math.isnan(value) else f"{value:.5g}"}</td>'
    if isinstance(value, int):
        return f'<td class="number">{value}</td>'
    return f"<td>{html.escape(str(value))}</td>"
