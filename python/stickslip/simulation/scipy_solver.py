"""One run of a scipy integrator on a right-hand side of the core: counted, interruptible, without warnings."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import BDF, DOP853, LSODA, RK45, OdeSolution, Radau

from stickslip import _core
from stickslip.simulation.time_limit import NO_LIMIT, TimeLimit

#: LSODA is the fastest by far, but may fail at the first step or crawl in its non-stiff half; Radau does neither.
USUAL = ("LSODA", "Radau")
#: So many steps at one time lead nowhere.
_IDLE = 1000


class Spent(Exception):
    """The evaluations that were allowed are spent."""


class Stalled(Exception):
    """Steps lead nowhere."""


class Counted:
    """A right-hand side f(t, y) that may be evaluated `most` times.

    Raises
    ------
    Spent
        by the evaluation after the last.
    KeyboardInterrupt
        after Ctrl-C.
    """

    def __init__(self, rates: Callable[[float, NDArray[np.float64]], NDArray[np.float64]], most: int) -> None:
        self.rates, self.most, self.spent = rates, most, 0

    def __call__(self, t: float, y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Evaluate f, and count it."""
        if _core.halted():
            # Signals come to the main thread alone, and this is another.
            raise KeyboardInterrupt
        if self.spent >= self.most:
            raise Spent
        self.spent += 1
        return self.rates(t, np.ascontiguousarray(y))


@dataclass
class Run:
    """The steps of an integrator.

    Attributes
    ----------
    times : the ends of the steps, from the start on; `end` the state at the last, `interpolants` the motion within each.
    stop : ``"t_end"``, ``"max_seconds"``, ``"max_evaluations"``, ``"solver"`` where a step failed, or ``"stalled"`` where
        steps lead nowhere; `why` is the word of the integrator.
    """

    method: str
    times: list[float]
    end: NDArray[np.float64]
    interpolants: list[Any] = field(default_factory=list)
    stop: str = "t_end"
    why: str = ""

    @property
    def solution(self) -> OdeSolution:
        """The motion at any time."""
        return OdeSolution(np.array(self.times), self.interpolants, alt_segment=self.method in ("BDF", "LSODA"))


def solved(
    method: str,
    rates: Counted,
    edges: Sequence[float],
    start: NDArray[np.float64],
    limit: TimeLimit = NO_LIMIT,
    **options: Any,
) -> Run:
    """The steps of one of `METHODS` from the first of the edges to the last, begun anew at each between."""
    run = Run(method, [edges[0]], start)
    with warnings.catch_warnings():
        # LSODA reports its failures as warnings; they come back as the reason of the stop.
        warnings.simplefilter("ignore")
        try:
            for low, high in itertools.pairwise(edges):
                # What changes at an edge changes beyond it, which the step to the edge must not see.
                before = np.nextafter(high, low)
                solver = METHODS[method](
                    lambda t, y, last=before: rates(min(t, last), y), low, run.end, high, **options
                )
                while solver.status == "running":
                    run.why = solver.step() or ""
                    # LSODA may come to what is no number, and call that a success.
                    if solver.status == "failed" or not np.isfinite(solver.y).all():
                        run.stop = "solver"
                        return run
                    run.times.append(solver.t)
                    run.interpolants.append(solver.dense_output())
                    run.end = solver.y
                    if limit.passed and solver.status == "running":
                        run.stop = "max_seconds"
                        return run
        except Spent:
            run.stop = "max_evaluations"
        except (Stalled, ValueError) as stalled:
            # A ValueError is of Radau and BDF, which solve no equations of what is no number.
            run.stop, run.why = "stalled", str(stalled)
    return run


class _LSODA(LSODA):
    """LSODA without the steps that are shorter than its clock can tell, which scipy refuses to join."""

    def _step_impl(self) -> tuple[bool, str | None]:
        begun = self.t
        for _ in range(_IDLE):
            success, message = super()._step_impl()  # type: ignore[misc]
            if not success or self.t != begun:
                return success, message
        raise Stalled("its steps lead nowhere")


METHODS: dict[str, Any] = {"LSODA": _LSODA, "Radau": Radau, "BDF": BDF, "DOP853": DOP853, "RK45": RK45}
