"""Fits run on one thread of the linear algebra."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, wraps
from typing import ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController  # type: ignore[import-untyped]

P = ParamSpec("P")
R = TypeVar("R")


@cache
def _controller() -> ThreadpoolController:
    return ThreadpoolController()


def one_thread(fit: Callable[P, R]) -> Callable[P, R]:
    """Run a function on one thread of BLAS.

    Its matrices have thousands of rows and a few columns: several threads spend their time waiting for each other. Of a
    fit to 15,000 samples they took four times the processor time and three times as long.

    >>> one_thread(sorted)([2, 1])
    [1, 2]
    """

    @wraps(fit)
    def alone(*arguments: P.args, **options: P.kwargs) -> R:
        with _controller().limit(limits=1, user_api="blas"):
            return fit(*arguments, **options)

    return alone
