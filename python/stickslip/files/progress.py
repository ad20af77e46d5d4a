"""What a person sees who waits for a call: how much of the work is done."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

SILENT = 2.0
"""Seconds for which nothing is said of a call that has begun."""
BETWEEN_LINES = 10.0
"""Seconds between two lines on the progress of a command whose stderr is no terminal."""


def waiting(progress: Callable[[int, int], Any] | None, what: str) -> Callable[[int, int], Any]:
    """The function to be called with how much is done and of how much: that of the caller, or a line for a person who waits.

    The line is written to stderr in a terminal or a notebook, two seconds after the call began and then twice a second.
    """
    if progress is not None:
        return progress
    line = waiting_by_stage(None)
    return lambda done, n: line(what, done, n)


def waiting_by_stage(progress: Callable[[str, int, int], Any] | None) -> Callable[[str, int, int], Any]:
    """As :func:`waiting` for work of several stages: called with what is being done, how much is done and of how much."""
    if progress is not None:
        return progress
    if sys.stderr.isatty() or "ipykernel" in sys.modules:
        return _line_for_a_person()
    return lambda *_: None


def _line_for_a_person() -> Callable[[str, int, int], Any]:
    begun = time.monotonic()
    said = begun + SILENT - 0.5
    width = 0

    def say(what: str, done: int, n: int) -> None:
        nonlocal said, width
        now = time.monotonic()
        last = done >= n and said > begun + SILENT - 0.5
        if last or now - said >= 0.5:
            said = now
            text = _text(what, done, n, now - begun)
            sys.stderr.write(f"\r{text:<{width}}{chr(10) if last else ''}")
            sys.stderr.flush()
            width = 0 if last else len(text)

    return say


def lines_in_a_log() -> Callable[[str, int, int], Any]:
    """As :func:`waiting_by_stage` where stderr is a file: a line of its own every ten seconds, for who reads it later."""
    begun = said = time.monotonic()

    def say(what: str, done: int, n: int) -> None:
        nonlocal said
        now = time.monotonic()
        if now - said >= BETWEEN_LINES:
            said = now
            sys.stderr.write(f"{_text(what, done, n, now - begun)}\n")
            sys.stderr.flush()

    return say


def _text(what: str, done: int, n: int, seconds: float) -> str:
    return f"{what}: {done} of {n}, {seconds:.0f} s"
