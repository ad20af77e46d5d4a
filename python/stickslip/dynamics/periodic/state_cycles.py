"""Periodic orbits of laws with an internal state and Floquet multipliers: Newton's method on the map over one period."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from stickslip.dynamics.periodic.closed_orbit import NO_RETURN, STEADY, Cycle
from stickslip.dynamics.periodic.newton_iteration import newton
from stickslip.dynamics.periodic.poincare_map import eigenvalues, forcing_period
from stickslip.dynamics.periodic.state_flow import StateFlow
from stickslip.errors import InputError, number, whole_number
from stickslip.files.arrays import Array
from stickslip.model.system import Oscillator
from stickslip.simulation.integration import integrate
from stickslip.simulation.state_orbit import StateLayout, StateOrbit, state_laws_of

#: Newton's method ends at steps below this part of the motion, or where rounding and the integration stop it below the other.
_SETTLED, _STALLED = 1e-10, 1e-7
#: The largest step, in sizes of the variables, and the most rounds.
_REACH, _ROUNDS = 0.2, 20
#: How near a return is to an earlier one, relative to the motion, for a guess; the first that any reaches.
_NEAR = (1e-6, 1e-4, 1e-2, 0.1, 0.3)
_RETURNS = 12
#: What moves less over a period, in sizes of the variables, or than the integration's error so many times, is an equilibrium:
#: it closes after any time.
_POINT, _ERRORS = 1e-5, 100
#: How many periods a run settles for, and how exact it is, as Newton's method does the rest.
_SETTLING, _ROUGH = 30, 1e-8


class Steady(InputError):
    """What closes is an equilibrium and no cycle."""


@dataclass(frozen=True, repr=False, eq=False)
class StateCycle(Cycle):
    """A closed orbit of laws with an internal state, and its stability.

    Attributes
    ----------
    period, forcing_periods, multipliers, stable, marginal, residual, rounds : as of a :class:`~stickslip.PeriodicOrbit`;
        there is one multiplier for each position, velocity and state.
    error : of each multiplier, as it changes when the integration is ten times, its differences four times and the steps of
        the variational equation twice as coarse.
    state : t, x, v, z where it starts: a greatest position, or where the clock of the forcing is zero; of a system (n,)
        and, for z, (contacts,) numbers; z has a last axis where a law has two state variables.
    """

    start: Array
    flow: StateFlow = field(compare=False)

    @property
    def marginal(self) -> bool:
        """Whether the largest multiplier has size 1 within its error."""
        return abs(self.largest - 1) < max(1e-9, 3 * float(self.error.max()))

    @cached_property
    def error(self) -> Array:
        """How far each multiplier is known."""
        rough = replace(self.flow, tolerance=10 * self.flow.tolerance, step=4 * self.flow.step, parts=1)
        _, matrix = rough.tangents(self.start, 0.0, self.period, np.eye(rough.width))
        return np.asarray(np.abs(_multipliers(self.system, matrix, self.forcing_periods) - self.multipliers))

    @property
    def state(self) -> tuple[float, Any, Any, Any]:
        """t, x, v and z at the start."""
        v = self.flow.velocities(0.0, self.start)
        n = self.system.masses
        x, z = self.start[:n], StateLayout.of(self.system).spread(self.start[2 * n :])
        if isinstance(self.system, Oscillator):
            return 0.0, float(x[0]), float(v[0]), z if z.ndim else float(z)
        return 0.0, x, v, z

    @cached_property
    def orbit(self) -> StateOrbit:
        """One period."""
        _, x, v, z = self.state
        return integrate(self.system, self.period, x, v, state=z, tolerance=max(self.flow.tolerance, 1e-12))

    @property
    def sticks(self) -> bool:
        """Whether it comes as near to sticking as these laws do (:meth:`stickslip.Orbit.regime`)."""
        return self.orbit.regime(0.0) == "stick_slip"


def _multipliers(system: Any, matrix: Array, forcing_periods: int) -> Any:
    # A smooth sign has no state: what stands in its place stays as it is.
    each = np.concatenate([[law.has_state] * law.states for law in state_laws_of(system)])
    states = np.concatenate([np.ones(len(matrix) - len(each), bool), each])
    values = eigenvalues(matrix[np.ix_(states, states)])
    if forcing_periods:
        return values
    # The shift in time is known to be 1.
    return np.append(1.0 + 0.0j, np.delete(values, int(np.argmin(np.abs(values - 1)))))


def state_cycle(
    system: Any,
    guess: Any = None,
    *,
    t_end: float | None = None,
    periods: int | None = None,
    progress: Callable[[], Any] = lambda: None,
) -> StateCycle:
    """A periodic orbit, stable or not; :func:`stickslip.periodic_orbit` calls it for laws with an internal state.

    Newton's method on y(T; y₀) − y₀ = 0 with the fundamental matrix Φ(T) of the variational equation Φ̇ = (∂f/∂y) Φ; without
    forcing T is unknown too and the step is across the motion.

    Source: shooting, Seydel, Practical Bifurcation and Stability Analysis (2010), ch. 7.

    >>> from stickslip.laws import LuGre
    >>> law = LuGre(1e5, 1e5**0.5, 0.4, kinetic=1.0, break_away=1.5, scale=1e-3)
    >>> cycle = state_cycle(Oscillator(damping=0.0, drive_velocity=0.1, law=law, stiffness=2.0))
    >>> round(cycle.period, 7), cycle.stable  # Canudas de Wit et al. 1995; two implicit integrators
    (6.3627198, True)
    """
    if periods is not None:
        whole_number("periods", periods, "periodic_orbit")
    force = forcing_period(system)
    if isinstance(guess, StateCycle):
        return closed_state(system, guess.start, guess.period, guess.forcing_periods, guess.flow.sizes, progress)
    slowest = max(system.natural_period, force or 0.0)
    length = (
        number("t_end", t_end, "periodic_orbit")
        if t_end is not None
        else slowest * (_SETTLING if guess is None else _SETTLING / 2)
    )
    progress()
    orbit = _run(system, guess, length)
    start, time, sizes = _guess(orbit, force, periods, settled=guess is None)
    count = 0 if force is None else max(1, round(time / force))
    return closed_state(system, start, time, count, sizes, progress)


def _run(system: Any, guess: Any, length: float) -> StateOrbit:
    if isinstance(guess, StateOrbit):
        x, v = guess.at(guess.t_end)
        states = guess.variables(np.array([guess.t_end]))[0]
        z = StateLayout.of(system).spread(states[2 * np.size(x) :])
        return integrate(system, length, x, v, state=z, tolerance=_ROUGH)
    if guess is None:
        return integrate(system, length, tolerance=_ROUGH)
    try:
        x, v, *state = guess
    except (TypeError, ValueError):
        raise InputError(
            f"periodic_orbit: guess must be (x, v), (x, v, state), an orbit or None, got {guess!r}"
        ) from None
    return integrate(system, length, x, v, state=state[0] if state else None, tolerance=_ROUGH)


def _guess(orbit: StateOrbit, force: float | None, periods: int | None, *, settled: bool) -> tuple[Array, float, Array]:
    """A start, a time after which it nearly comes back, and the sizes of the variables."""
    if orbit.stop != "t_end":
        raise InputError(f"periodic_orbit: the run ended by {orbit.stop}; choose another start or another t_end")
    variables = orbit.variables
    after = 0.5 * orbit.t_end if settled else 0.0
    sizes = sizes_of(orbit, after)
    if sizes[0] < 1e-5 * max(abs(float(variables(np.array([orbit.t_end]))[0, 0])), 1e-300):
        raise InputError(STEADY)
    strobe = np.arange(0.0, orbit.t_end * (1 + 1e-9), force) if force is not None else None
    times = orbit.maxima() if strobe is None else strobe
    times = times[times >= after]
    if times.size < 2:
        raise InputError(STEADY)
    states = variables(times)
    ends = [len(times) - 1] if settled else range(len(times) - 1, 0, -1)
    counts = range(1, _RETURNS + 1) if periods is None or force is None else [periods]
    pairs = [
        (float(np.abs((states[end] - states[end - count]) / sizes).max()), count, end)
        for end in ends
        for count in counts
        if end - count >= 0
    ]
    for near in _NEAR:
        found = [pair for pair in pairs if pair[0] < near]
        if found:
            _, count, end = min(found, key=lambda pair: (pair[1], pair[0]))
            return states[end - count], float(times[end] - times[end - count]), sizes
    raise InputError(NO_RETURN)


def closed_state(
    system: Any,
    start: Array,
    time: float,
    forcing_periods: int,
    sizes: Array,
    progress: Callable[[], Any] = lambda: None,
) -> StateCycle:
    """Newton's method from a start and a time.

    Raises
    ------
    InputError
        where it does not converge, or to an equilibrium.
    """
    flow, force = StateFlow(system, sizes), forcing_period(system)

    def at(unknowns: tuple[Array, float]) -> tuple[StateReturn, Array, float]:
        here = StateReturn.of(flow, *unknowns, flow.rates(0.0, unknowns[0]) if force is None else None)
        step = np.asarray(np.linalg.lstsq(here.jacobian, -here.defect, rcond=1e-14)[0], float)
        return here, step, float(np.abs(step).max())

    time = time if force is None else forcing_periods * force
    stalled = 0
    for done in newton(at, StateReturn.moved, (start, time), _REACH, _ROUNDS, progress):
        stalled += done.converged(0.0, _STALLED)
        if done.error < _SETTLED or stalled > 1:
            return finished(flow, done.here, forcing_periods, len(done.errors))
    raise InputError(
        f"periodic_orbit: no periodic orbit near the guess (the last step is {done.error:.1e} of the motion): give another "
        "guess or simulate longer first"
    )


@dataclass(frozen=True)
class StateReturn:
    """One period from a start: what it lacks to be closed, and its derivative.

    Attributes
    ----------
    defect : the end minus the start, in sizes of the variables, and 0 for the condition that fixes the phase.
    jacobian : its derivative over the start, in sizes, and the logarithm of the time.
    matrix : Φ over the period, with one more column where the flow has a path.
    slope : of the end over the logarithm of the time, in sizes.
    """

    start: Array
    time: float
    sizes: Array
    defect: Array
    jacobian: Array
    matrix: Array
    slope: Array

    @classmethod
    def of(cls, flow: StateFlow, start: Array, time: float, along: Array | None) -> StateReturn:
        """Integrated; steps are across the motion where `along` is its rate, None where the forcing gives the time."""
        width, sizes = flow.width, flow.sizes
        end, matrix = flow.tangents(start, 0.0, time, np.eye(width))
        slope = flow.rates(time, end) / sizes * time
        jacobian = np.zeros((width + 1, width + 1))
        jacobian[:width, :width] = matrix[:, :width] * sizes / sizes[:, None] - np.eye(width)
        if along is None:
            jacobian[width, width] = 1.0
        else:
            jacobian[:width, width] = slope
            jacobian[width, :width] = along / sizes
        return cls(start, time, sizes, np.append((end - start) / sizes, 0.0), jacobian, matrix, slope)

    def moved(self, step: Array) -> tuple[Array, float]:
        """The start and the time after a step."""
        return self.start + step[: len(self.sizes)] * self.sizes, self.time * (1 + float(step[len(self.sizes)]))


def finished(flow: StateFlow, here: StateReturn, forcing_periods: int, rounds: int) -> StateCycle:
    """A closed orbit as a result.

    Raises
    ------
    Steady
        where it is an equilibrium.
    """
    if not forcing_periods and _rests(flow, here):
        raise Steady(STEADY)
    return StateCycle(
        system=flow.system,
        period=here.time,
        forcing_periods=forcing_periods,
        multipliers=_multipliers(flow.system, here.matrix[:, : flow.width], forcing_periods),
        residual=float(np.abs(here.defect).max()),
        rounds=rounds,
        section="strobe" if forcing_periods else "maximum",
        events=(),
        start=here.start,
        flow=replace(flow, path=None),
    )


def _rests(flow: StateFlow, here: StateReturn) -> bool:
    """Whether a motion without forcing that closes is an equilibrium within what Newton's method and the integration know."""
    values = flow.along(here.start, here.time)
    least = np.maximum(_POINT * flow.sizes, _ERRORS * flow.tolerance * np.abs(values).max(axis=0))
    return bool((np.ptp(values, axis=0) < least).all())


def sizes_of(orbit: StateOrbit, after: float = 0.0) -> Array:
    """What counts as large in each variable: its range along a motion, or, of one that does not change, its size.

    Of a motion at rest, which may slip later, slip velocities count by the speed of the masses.
    """
    times = np.linspace(after, orbit.t_end, 2001)
    values = orbit.variables(times)
    sizes = np.maximum(np.ptp(values, axis=0), 1e-6 * np.abs(values).max(axis=0))
    v = orbit.to_xarray(times)["v"].to_numpy().reshape(times.size, -1)
    velocities = slice(v.shape[1], 2 * v.shape[1])
    sizes[velocities] = np.maximum(sizes[velocities], 1e-3 * np.abs(v).max())
    return np.where(sizes == 0, 1.0, sizes)
