"""The error for input that cannot be used, which the command line ends with, and what says that a result is not whole."""

from __future__ import annotations

from typing import Any


class InputError(ValueError):
    """Input that cannot be used: one sentence with what was expected, what came and what to do."""


class UnfinishedWarning(RuntimeWarning):
    """Some runs of many ended at a limit of time that was set, and have no result."""


class Interrupted(KeyboardInterrupt):
    """Ctrl-C ended a search; `result` is what it had found by then, of the type that the search returns."""

    def __init__(self, result: Any) -> None:
        super().__init__()
        self.result = result
