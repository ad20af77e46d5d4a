"""The error for input that cannot be used (a sentence and exit code 2 on the command line), the warning of unfinished runs."""


class InputError(ValueError):
    """Input that cannot be used: one sentence with what was expected, what came and what to do."""


class UnfinishedWarning(RuntimeWarning):
    """Some runs of many ended at a limit of time that was set, and have no result."""
