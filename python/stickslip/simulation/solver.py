"""One run of a scipy integrator on a right-hand side of the core: counted, interruptible, without warnings."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import LSODA, solve_ivp

from stickslip import _core

#: LSODA is the fastest by far, but may fail at the first step or crawl in its non-stiff half; Radau does neither.
USUAL = ("LSODA", "Radau")
#: So many steps at one time lead nowhere.
_IDLE = 1000


class Stalled(Exception):
    """The evaluations that were allowed are spent, or steps lead nowhere."""

    def __init__(self, t: float) -> None:
        self.t = t


class Counted:
    """A right-hand side f(t, y) that may be evaluated `most` times.

    Raises
    ------
    Stalled
        by the evaluation after the last.
    KeyboardInterrupt
        after Ctrl-C.
    """

    def __init__(self, rates: Callable[[float, NDArray[np.float64]], NDArray[np.float64]], most: int) -> None:
        self.rates, self.most, self.spent = rates, most, 0

    def __call__(self, t: float, y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Evaluate f, and count it."""
        self.spent += 1
        if _core.halted():
            # Signals come to the main thread alone, and this is another.
            raise KeyboardInterrupt
        if self.spent > self.most:
            raise Stalled(t)
        return self.rates(t, np.ascontiguousarray(y))


def solved(method: str, rates: Counted, span: tuple[float, float], start: NDArray[np.float64], **options: Any) -> Any:
    """What `scipy.integrate.solve_ivp` gives, with the dense output."""
    with warnings.catch_warnings():
        # LSODA reports its failures as warnings; they come back as the reason of the stop.
        warnings.simplefilter("ignore")
        chosen: Any = _LSODA if method == "LSODA" else method
        return solve_ivp(rates, span, start, method=chosen, dense_output=True, **options)


class _LSODA(LSODA):
    """LSODA without the steps that are shorter than its clock can tell, which scipy refuses to join."""

    def _step_impl(self) -> tuple[bool, str | None]:
        begun = self.t
        for _ in range(_IDLE):
            success, message = super()._step_impl()  # type: ignore[misc]
            if not success or self.t != begun:
                return success, message
        raise Stalled(begun)
