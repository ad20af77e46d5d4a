"""Motion under a law with an internal state: stiff and smooth, integrated by scipy on the core's right-hand side."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import OdeSolution
from scipy.optimize import brentq

from stickslip import _core
from stickslip.errors import InputError, did_you_mean, number, positive, whole_number
from stickslip.laws.state_law import StateLaw
from stickslip.model.drive import Drive
from stickslip.model.parameters import initial_state
from stickslip.model.system import Oscillator, System
from stickslip.simulation.orbit import Work
from stickslip.simulation.scipy_solver import METHODS, USUAL, Counted, solved
from stickslip.simulation.state_orbit import Mark, StateLayout, StateOrbit, masses_of, state_laws_of
from stickslip.simulation.time_limit import TimeLimit

#: The least relative error that scipy's integrators take, of a variable that has only an absolute one.
_SMALLEST = 100 * float(np.finfo(float).eps)
#: How far v0 may be from the velocity at which forces balance, relative to the speeds of the motion.
_BALANCED = 1e-3
#: A run that came through so many natural periods before its evaluations were spent is kept.
_FAR = 10.0
#: What may be the reason where there is no mass.
_RUNS_AWAY = "; without a mass or damping slip of a soft spring may become infinite in a finite time: give one of them"


def integrate(
    system: Oscillator | System,
    t_end: float,
    x0: ArrayLike | None = None,
    v0: ArrayLike | None = None,
    max_events: int = 10_000_000,
    *,
    state: ArrayLike | None = None,
    tolerance: float = 1e-10,
    method: str | None = None,
    max_evaluations: int = 2_000_000,
    max_seconds: float | None = None,
) -> StateOrbit:
    """Integrate an oscillator or a system of masses whose laws have an internal state, or a smooth sign.

    Parameters
    ----------
    system : the oscillator or system; its laws are :class:`~stickslip.laws.state_law.StateLaw`.
    t_end : time to run > 0.
    x0 : position at t = 0, for a system shape (masses,); default 0.
    v0 : velocity at t = 0, same shape; default that of the drive. Without mass the balance of forces gives the velocity:
        v0 then only tells the slip velocity whose steady state is the default of `state`.
    max_events : the run ends at so many events of one kind at a contact, with ``orbit.stop == "max_events"``.
    state : the law's state at t = 0, for a system shape (contacts,), and where a law has two state variables (2,) or
        (contacts, 2), as :meth:`stickslip.simulation.state_orbit.StateOrbit.state` gives it; default that of steady slip at
        the slip velocity of the start, and for no slip that of a contact that was never loaded.
    tolerance : relative error a step, in [1e-13, 1e-2]; absolute errors are scaled with the drive velocity and the law.
    method : ``"LSODA"``, ``"Radau"``, ``"BDF"`` (stiff), ``"DOP853"``, ``"RK45"`` (where the law is not stiff); default
        LSODA, and Radau where that fails or stalls. Rate-and-state friction is integrated in the variable in which it is
        a line through rest.
    max_evaluations : most evaluations of the right-hand side, some 100,000 a second; of the default methods the first takes
        half of them at most. A run that has by then come through ten natural periods ends there, with
        ``orbit.stop == "max_evaluations"``.
    max_seconds : time on the clock after which the run ends where it is, with ``orbit.stop == "max_seconds"``; default none.

    Returns
    -------
    StateOrbit, with the dense output of the integrator.

    Raises
    ------
    InputError
        for a law without internal state, for values that make no sense, where `max_evaluations` lead nowhere, and where
        there is no mass and v0 and `state` are given but not in balance with x0.

    Limits: no event is certified; where the law creeps instead of sticking, so does the motion. Each step of the integrator
    is kept: some 100 bytes a step.

    >>> from stickslip.laws import LuGre
    >>> law = LuGre(1e5, 316.0, 0.4, kinetic=1.0, break_away=1.5, scale=1e-3)
    >>> orbit = integrate(Oscillator(damping=0.0, drive_velocity=0.1, law=law, stiffness=2.0), 20)
    >>> orbit.regime()
    'stick_slip'
    """
    laws = state_laws_of(system)
    if method is not None and method not in METHODS:
        raise InputError(f"integrate: method must be one of {', '.join(METHODS)}{did_you_mean(method, METHODS)}")
    if not 1e-13 <= number("tolerance", tolerance, "integrate") <= 1e-2:
        raise InputError(f"integrate: tolerance must lie in [1e-13, 1e-2], got {tolerance}")
    whole_number("max_events", max_events, "integrate")
    end = positive("t_end", t_end, "integrate")
    whole = system.to_system()
    at, v = initial_state(whole, x0, v0, "integrate")
    x = np.zeros(whole.masses) if at is None else np.array(at)
    core = _core.StateSystem(whole.to_json())
    begin, slip = core.start(x, v)
    if state is None:
        z = np.hstack([law.steady_state(w) for law, w in zip(laws, slip, strict=True)])
    else:
        z = np.array(StateLayout.of(system).gather(state, "integrate"))
    start = core.balanced(np.concatenate([begin, z]))
    velocities = core.states(np.zeros(1), start)[0]
    scale = _scales(whole, laws, np.concatenate([begin, slip]))
    noise = tolerance * scale[whole.masses]
    if core.is_massless and v is not None:
        if state is not None and np.abs(velocities - np.array(v)).max() > _BALANCED * scale[whole.masses]:
            raise InputError(
                f"integrate: without mass the forces at x0 and state balance at the velocity {velocities.tolist()}, got "
                f"v0 = {v}: leave v0 out"
            )
        v = None
    first, small, share = core.regular(start)
    scale = np.where(share < 1.0, small, scale)
    # A slip velocity within the tolerance, and within what the clock can tell, is at rest.
    finest = noise * max(0.01, 10 * math.ulp(end) * 2 * math.pi / whole.natural_period / tolerance)
    bends = [
        node[0]
        for item in whole.contacts
        if isinstance(item.drive_velocity, Drive)
        for node in item.drive_velocity.nodes
    ]
    edges = [0.0, *sorted({t for t in bends if 0 < t < end}), end]
    slope = Counted(lambda t, y: core.regular_rates(t, y, least), max_evaluations)
    limit = TimeLimit.after(max_seconds, "integrate")
    # At a stop of rate-and-state friction any method may miss a step, and then takes it where the stop is a little longer.
    attempts = [(one, 1) for one in (USUAL if method is None else (method,))]
    if core.is_steep:
        attempts += [(method or "LSODA", factor) for factor in (10, 100)]
    for attempt, factor in attempts:
        least = finest * factor
        slope.most = max_evaluations // 2 if method is None and not slope.spent else max_evaluations
        # The others take one relative error for all variables.
        relative = np.maximum(tolerance * share, _SMALLEST) if attempt == "LSODA" else tolerance
        run = solved(attempt, slope, edges, first, limit, rtol=relative, atol=tolerance * scale)
        last = run.times[-1]
        # From far on another method would not come further either.
        far = last > _FAR * whole.natural_period
        if run.stop in ("t_end", "max_seconds") or (run.stop == "max_evaluations" and far):
            break
        if run.stop != "solver" and ((attempt, factor) == attempts[-1] or slope.spent >= max_evaluations):
            raise InputError(
                f"integrate: {attempt} came to t = {last:g} in {slope.spent} evaluations: take "
                f"another method, a looser tolerance, or raise max_evaluations{_RUNS_AWAY * core.is_massless}"
            )
    if len(run.times) < 2:
        raise InputError(
            f"integrate: {attempts[-1][0]} could not take its first step: take another method or tolerance, or "
            "check the units"
        )
    solution, stop = run.solution, run.stop
    marks = _marks(core, solution, masses_of(system), noise)
    for mark in marks:
        if len(mark.times) >= max_events and mark.times[max_events - 1] < last:
            last, stop = float(mark.times[max_events - 1]), "max_events"
    marks = [replace(mark, times=mark.times[mark.times <= last]) for mark in marks]
    work = Work(events=sum(len(mark.times) for mark in marks), evaluations=slope.spent)
    return StateOrbit(system, core, solution, marks, last, stop, work, start, v)


def _marks(core: _core.StateSystem, solution: OdeSolution, masses: Sequence[int], noise: float) -> list[Mark]:
    """The times at which slip velocities and velocities change their sign; two changes within one step are not seen.

    A velocity within the `noise` of the integration has no sign: where adhesion creeps it changes it with every step.
    """

    def guards(t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Slip velocity of each contact and velocity of its mass, shape (times, 2, contacts)."""
        v, _, w, *_ = core.states(t, core.natural(np.ascontiguousarray(solution(t).T).ravel()))
        return np.stack([w.reshape(t.size, -1), v.reshape(t.size, -1)[:, masses]], axis=1)

    marks = []
    values = guards(solution.ts)
    signs = np.where(np.abs(values) > noise, np.sign(values), 0.0)
    for kind, name in enumerate(("crossing", "turn")):
        for contact in range(len(masses)):
            known = np.flatnonzero(signs[:, kind, contact])
            sign = signs[known, kind, contact]
            found = []
            for i in np.flatnonzero(sign[:-1] != sign[1:]):
                low, high = solution.ts[known[i : i + 2]]
                try:
                    found.append(
                        brentq(
                            lambda t, k=kind, c=contact: guards(np.array([t]))[0, k, c], low, high, xtol=1e-15 * high
                        )
                    )
                except ValueError:
                    # The interpolant misses the step's end by the tolerance, and the sign with it.
                    found.append(high)
            marks.append(Mark(name, contact, np.array(found)))
    return marks


def _scales(system: System, laws: Sequence[StateLaw], start: NDArray[np.float64]) -> NDArray[np.float64]:
    """What counts as small in positions, velocities and states, from the positions and velocities of the start."""
    n, frequency = system.masses, 2 * math.pi / system.natural_period
    drives = [item.drive_velocity for item in system.contacts]
    driven = max(drive.fastest if isinstance(drive, Drive) else abs(drive) for drive in drives)
    far, fast = (float(np.abs(part).max()) for part in (start[:n], start[n:]))
    speed = max(driven, fast, far * frequency * 1e-3) or 1.0
    length = max(speed / frequency, 1e-9 * far)
    return np.hstack([[length] * n, [speed] * n, *(law.state_scale(speed) for law in laws)])
