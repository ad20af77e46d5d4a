"""What the sub-commands share: results to stdout, progress to stderr, pictures and files written whole."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

Commands = argparse._SubParsersAction


def say(line: str) -> None:
    """Write one line of the result to stdout."""
    sys.stdout.write(line + "\n")


def say_json(document: Any) -> None:
    """Write the result to stdout for machines."""
    json.dump(document, sys.stdout, indent=2, default=float)
    say("")


def say_value(name: str, value: object) -> None:
    """Write one named value of the result, the values below each other."""
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    say(f"{name.replace('_', ' '):19s} {text}")


def say_written(*paths: str | Path | None) -> None:
    """Name the files that were written."""
    for path in paths:
        if path:
            say_value("written", path)


def partial(path: str | None) -> str | None:
    """The name under which a result that is not whole is written, so that it never stands for a whole one.

    >>> partial("out/branches.nc"), partial(None)
    ('out/branches.partial.nc', None)
    """
    return path and str(Path(path).with_suffix(f".partial{Path(path).suffix}"))


def save_figure(figure: Any, path: str) -> None:
    """Write a picture whole, its kind by the ending."""
    from stickslip.files.disk import write_whole

    kind = Path(path).suffix.lstrip(".").lower()
    write_whole(path, lambda draft: figure.savefig(draft, format=kind, dpi=150))


class Bar:
    """Progress on stderr, a bar in a terminal, else a line now and then: call it with what, how much of it, of how much.

    With `lines` each call writes a line that stays, in a terminal above the bar.
    """

    def __init__(self, lines: bool = False) -> None:
        self._lines = lines

    def __enter__(self) -> Bar:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

        from stickslip.files.progress import lines_in_a_log

        columns = (BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("{task.description}"))
        console = Console(stderr=True)
        self._progress = Progress(*columns, console=console, disable=not console.is_terminal, transient=True)
        self._progress.start()
        self._task = self._progress.add_task("start", total=None)
        self._log = None if console.is_terminal else lines_in_a_log()
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def __call__(self, what: str, done: int, total: int) -> None:
        """Show that `done` of `total` is done, and what it is."""
        if self._lines:
            self._progress.console.print(f"{done} of {total}: {what}", markup=False, highlight=False, soft_wrap=True)
        elif self._log is not None:
            self._log(what, done, total)
        self._progress.update(self._task, description=what, completed=done, total=total)
