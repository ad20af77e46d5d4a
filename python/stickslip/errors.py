"""The error for input that cannot be used, which the command line ends with, and the warning of runs without a result."""


class InputError(ValueError):
    """Input that cannot be used: one sentence with what was expected, what came and what to do."""


class UnfinishedWarning(RuntimeWarning):
    """Some runs of many ended at a limit of time that was set, and have no result."""
