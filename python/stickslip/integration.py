"""Motion under a law with an internal state: stiff and smooth, integrated by scipy on the core's right-hand side."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from stickslip import _core
from stickslip.documents import did_you_mean, number
from stickslip.errors import InputError
from stickslip.orbit import Work
from stickslip.state_laws import StateLaw
from stickslip.state_orbit import StateOrbit
from stickslip.system import Oscillator

METHODS = ("LSODA", "Radau", "BDF", "DOP853", "RK45")


def integrate(
    system: Oscillator,
    t_end: float,
    x0: ArrayLike | None = None,
    v0: ArrayLike | None = None,
    max_events: int = 10_000_000,
    *,
    state: float | None = None,
    tolerance: float = 1e-10,
    method: str | None = None,
    max_evaluations: int = 2_000_000,
    max_seconds: float | None = None,
) -> StateOrbit:
    """Integrate an oscillator whose law has an internal state, or a smooth sign.

    Parameters
    ----------
    system : the oscillator; its law is one of :mod:`stickslip.state_laws`.
    t_end : time to run > 0.
    x0 : position at t = 0; default 0.
    v0 : velocity at t = 0; default that of the drive.
    max_events : the run ends at so many events of one kind, with ``orbit.stop == "max_events"``.
    state : the law's state at t = 0; default that of steady slip at the slip velocity of the start, and for no slip that
        of a contact that was never loaded.
    tolerance : relative error a step, in [1e-13, 1e-2]; absolute errors are scaled with the drive velocity and the law.
    method : ``"LSODA"``, ``"Radau"``, ``"BDF"`` (stiff), ``"DOP853"``, ``"RK45"`` (where the law is not stiff); default
        LSODA, and Radau where that fails or stalls.
    max_evaluations : most evaluations of the right-hand side, some 100,000 a second.
    max_seconds : time on the clock after which the run ends where it is, with ``orbit.stop == "max_seconds"``; default none.

    Returns
    -------
    StateOrbit, with the dense output of the integrator.

    Raises
    ------
    InputError
        for a law without internal state, for values that make no sense, and where `max_evaluations` did not suffice.

    Limits: no event is certified; where the law creeps instead of sticking, so does the motion. Each step of the integrator
    is kept: some 100 bytes a step.

    >>> from stickslip.laws import LuGre
    >>> law = LuGre(1e5, 316.0, 0.4, kinetic=1.0, break_away=1.5, scale=1e-3)
    >>> orbit = integrate(Oscillator(damping=0.0, drive_velocity=0.1, law=law, stiffness=2.0), 20)
    >>> orbit.regime()
    'stick_slip'
    """
    law = system.law
    if not isinstance(law, StateLaw):
        raise InputError(f"integrate: {type(law).__name__} has no internal state; use stickslip.simulate")
    if method is not None and method not in METHODS:
        raise InputError(f"integrate: method must be one of {', '.join(METHODS)}{did_you_mean(method, METHODS)}")
    if not 1e-13 <= number("tolerance", tolerance, "integrate") <= 1e-2:
        raise InputError(f"integrate: tolerance must lie in [1e-13, 1e-2], got {tolerance}")
    if isinstance(max_events, bool) or not isinstance(max_events, int) or max_events < 1:
        raise InputError(f"integrate: max_events must be a whole number of at least 1, got {max_events!r}")
    end = number("t_end", t_end, "integrate")
    if end <= 0:
        raise InputError(f"integrate: t_end must be greater than 0, got {end:g}")
    x = 0.0 if x0 is None else number("x0", x0, "integrate")
    v = system.drive_velocity if v0 is None else number("v0", v0, "integrate")
    z = law.steady_state(system.drive_velocity - v) if state is None else number("state", state, "integrate")

    core = _core.StateOscillator(system.to_json())
    with_state = law.has_state
    rates = core.rates
    spent = 0
    allowed = max_evaluations

    def slope(t: float, y: NDArray[np.float64]) -> list[float]:
        nonlocal spent
        spent += 1
        if spent > allowed:
            raise _Stalled(t)
        values = rates(t, y[0], y[1], y[2] if with_state else 0.0)
        return list(values if with_state else values[:2])

    up = math.inf
    deadline = math.inf if max_seconds is None else time.monotonic() + max_seconds

    def time_left(t: float, _: NDArray[np.float64]) -> float:
        """Zero at the end of the step in which the time is up."""
        nonlocal up
        if up == math.inf and time.monotonic() >= deadline:
            up = t
        return min(up - t, 1.0)

    time_left.terminal = True  # type: ignore[attr-defined]

    drive = system.drive_velocity
    # The slip velocity is the variable: a stiff law multiplies the rounding of s − v.
    start = [x, drive - v, z] if with_state else [x, drive - v]
    scale = _scales(system, law, x, v)[: len(start)]
    solution: Any = None
    # LSODA is the fastest by far, but may fail at the first step or crawl in its non-stiff half; Radau does neither.
    attempts = ("LSODA", "Radau") if method is None else (method,)
    for attempt in attempts:
        allowed = max_evaluations if attempt == attempts[-1] else max_evaluations // 2
        try:
            with warnings.catch_warnings():
                # LSODA reports its failures as warnings; they come back as the reason of the stop.
                warnings.simplefilter("ignore")
                solution = solve_ivp(
                    slope,
                    (0.0, end),
                    start,
                    method=attempt,
                    dense_output=True,
                    events=time_left,
                    rtol=tolerance,
                    atol=tolerance * scale,
                )  # type: ignore[call-overload, unused-ignore]
        except _Stalled as stalled:
            if attempt == attempts[-1]:
                raise InputError(
                    f"integrate: {attempt} came to t = {stalled.t:g} in {max_evaluations} evaluations: take another method, "
                    "a looser tolerance, or raise max_evaluations"
                ) from None
            continue
        if solution.status >= 0:
            break
    if len(solution.t) < 2:
        raise InputError(
            f"integrate: {attempts[-1]} could not take its first step: take another method or tolerance, or check the units"
        )
    crossings = _roots(solution, lambda y: y[1])
    turns = _roots(solution, lambda y: drive - y[1])
    last, stop = float(solution.t[-1]), {0: "t_end", 1: "max_seconds"}.get(solution.status, "solver")
    for times in (crossings, turns):
        if len(times) >= max_events and times[max_events - 1] < last:
            last, stop = float(times[max_events - 1]), "max_events"
    marks = tuple(times[times <= last] for times in (crossings, turns))
    work = Work(events=sum(map(len, marks)), evaluations=spent)
    return StateOrbit(system, solution.sol, marks, last, stop, work)


class _Stalled(Exception):
    """The evaluations that were allowed are spent."""

    def __init__(self, t: float) -> None:
        self.t = t


def _roots(solution: Any, guard: Callable[[NDArray[np.float64]], Any]) -> NDArray[np.float64]:
    """The times at which a guard changes its sign between steps; two changes within one step are not seen."""
    signs = np.sign(guard(solution.y))
    found = []
    for i in np.flatnonzero(signs[:-1] * signs[1:] < 0):
        low, high = solution.t[i], solution.t[i + 1]
        try:
            found.append(brentq(lambda t: guard(solution.sol(t)), low, high, xtol=1e-15 * high))
        except ValueError:
            # The interpolant misses the step's end by the tolerance, and the sign with it.
            found.append(high)
    return np.array(found)


def _scales(system: Oscillator, law: StateLaw, x: float, v: float) -> NDArray[np.float64]:
    """What counts as small in x, v and the state."""
    speed = max(abs(system.drive_velocity), abs(v), abs(x) * math.sqrt(system.stiffness / system.mass) * 1e-3) or 1.0
    length = max(speed * math.sqrt(system.mass / system.stiffness), 1e-9 * abs(x))
    state = 1.0 if type(law).__name__ == "RateState" else abs(law.steady_state(speed))
    return np.array([length, speed, state])
