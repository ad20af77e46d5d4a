"""The error for input that cannot be used; the command line prints its one sentence and exits with code 2."""


class InputError(ValueError):
    """Input that cannot be used: one sentence with what was expected, what came and what to do."""
