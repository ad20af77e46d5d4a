"""Lyapunov exponents through events. Floquet multipliers of a closed orbit: `poincare_map.py`, `state_cycles.py`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stickslip.dynamics.periodic.event_sequence import TIME, EventSequence, check, layout_of
from stickslip.dynamics.periodic.periodic_orbits import unlike
from stickslip.dynamics.periodic.poincare_map import forcing_period
from stickslip.dynamics.periodic.state_cycles import sizes_of
from stickslip.dynamics.periodic.state_flow import StateFlow
from stickslip.errors import InputError
from stickslip.files.checks import fraction, number
from stickslip.files.equality import ByContent
from stickslip.files.notebook import InNotebook
from stickslip.model.system import Oscillator, System
from stickslip.simulation.integration import integrate

#: The derivatives held at one time are of no more numbers: each event of 100 masses has a million and a half.
_MOST_NUMBERS = 20_000_000
#: A direction that shrinks to less of the largest one is lost: it is what rounding leaves.
_LOST = 1e-12


@dataclass(frozen=True, eq=False)
class LyapunovSpectrum(ByContent, InNotebook):
    """Lyapunov exponents of a motion.

    Attributes
    ----------
    exponents : in 1/time, the largest first; −inf for a direction that sticking forgets at once, 0 for the shift in time of
        an autonomous motion.
    t : time over which they are averaged.
    events : events in it.
    times, running : what the averages were on the way: times, shape (n,), and the exponents found from the first of the run
        up to them, shape (n, number of exponents).
    period : of the forcing, or the natural one.
    """

    exponents: NDArray[np.float64]
    t: float
    events: int
    times: NDArray[np.float64] = field(repr=False, compare=False)
    running: NDArray[np.float64] = field(repr=False, compare=False)
    period: float = field(repr=False, compare=False)

    @property
    def errors(self) -> NDArray[np.float64]:
        """Standard error of each exponent, from its averages over 20 parts of the run; NaN for −inf."""
        edges = np.linspace(0.0, self.t, 21)
        parts = np.diff(self._sums(edges), axis=0) / np.diff(edges)[:, None]
        errors: NDArray[np.float64] = np.std(parts, axis=0, ddof=1) / math.sqrt(20)
        return errors

    def by_period(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The averages up to the end of each period: times, shape (n,), and values, shape (n, number of exponents).

        Within a period stretching and contraction alternate, and the averages swing with them.
        """
        ends = np.asarray(self.period * np.arange(1, int(self.t / self.period * (1 + 1e-9)) + 1), float)
        return ends, np.asarray(self._sums(ends) / ends[:, None], float)

    def _sums(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Growth from the first of the run up to times, ln of its factor; NaN for an exponent of −inf."""
        sums = self.running * self.times[:, None]
        begin = np.append(0.0, self.times)
        columns = [
            np.interp(times, begin, np.append(0.0, column))
            if np.isfinite(column).all()
            else np.full(times.shape, math.nan)
            for column in sums.T
        ]
        return np.stack(columns, axis=1)

    def facts(self) -> dict[str, Any]:
        """What a notebook shows."""
        errors = self.errors
        return {"exponents": self.exponents, "errors": errors, "time": self.t}

    def __repr__(self) -> str:
        values = ", ".join(f"{value:.5g}" for value in self.exponents)
        return f"<LyapunovSpectrum {values} over t = {self.t:g}>"


def lyapunov(
    system: Oscillator | System,
    t_end: float,
    x0: ArrayLike | None = None,
    v0: ArrayLike | None = None,
    *,
    transient: float = 0.1,
    seed: int = 0,
) -> LyapunovSpectrum:
    """The Lyapunov exponents of a motion: its derivative from event to event, memory included, orthogonalised at each.

    λ_i = lim (1/t) Σ ln |R_ii| with the QR factors of the derivatives between events; jumps at events are in them.

    Parameters
    ----------
    system : of one mass or several. Contacts under laws without an internal state must not close a loop; under laws with one
        the variational equation is integrated along with the motion, and each state has an exponent too.
    t_end : time to run; some thousand periods give two digits.
    x0, v0 : start, as for :func:`stickslip.simulate`; by default several masses for which rest at one position does not do
        start at unlike positions.
    transient : the fraction of the run that is left out, in [0, 1).
    seed : of the directions that are followed.

    Returns
    -------
    LyapunovSpectrum of 2 n exponents for n masses (of a forced system without the 0 of its clock).

    Raises
    ------
    InputError
        for a value that makes no sense, or a run that ends early.

    Limits: a finite average; where sticks are rare, the exponent they bring is −inf all the same.

    Source: Müller, Chaos Solitons Fractals 5 (1995) 1671; Gottwald & Melbourne, SIAM J. Appl. Dyn. Syst. 8 (2009) 129.

    >>> from stickslip.laws import StaticKinetic
    >>> lyapunov(Oscillator(0.1, 0.2, StaticKinetic(1.0, 0.6)), 500.0).exponents.tolist()
    [0.0, -inf]
    """
    fraction("transient", transient, "lyapunov")
    end = number("t_end", t_end, "lyapunov")
    if isinstance(system, Oscillator | System) and system.integrated:
        return _of_states(system, end, x0, v0, transient * end, seed)
    check(system, "lyapunov")
    starts: list[tuple[Any, Any]] = [(x0, v0)]
    if x0 is None and v0 is None:
        # Masses that begin alike may move alike, at the edge of the motions that a disturbance leads to; the least one first.
        starts += reversed(unlike(system))
    refusals = []
    for x, v in starts:
        try:
            return _through_events(system, end, x, v, transient * end, seed)
        except InputError as refusal:
            refusals.append(refusal)
    raise refusals[0]


def _through_events(
    system: Oscillator | System, end: float, x0: ArrayLike | None, v0: ArrayLike | None, begin: float, seed: int
) -> LyapunovSpectrum:
    """Exponents under laws without an internal state, orthogonalised at every event."""
    forced = forcing_period(system) is not None
    layout = layout_of(system)
    motion = np.concatenate([layout.x, layout.v])
    directions = len(motion) - (0 if forced else 1)
    # A clock that nothing reads is no direction.
    coordinates = np.arange(0 if forced else 1, layout.width)
    rng = np.random.default_rng(seed)
    basis = np.zeros((layout.width, directions))
    basis[motion] = rng.standard_normal((len(motion), directions))
    if forced:
        basis[0] = rng.standard_normal(directions)
    # What is not orthonormal at the start would count as growth.
    basis = np.linalg.qr(basis)[0]
    sums, elapsed, counted, now = np.zeros(directions), 0.0, 0, 0.0
    lost = np.zeros(directions, bool)
    times: list[float] = []
    course: list[NDArray[np.float64]] = []
    for sequence in _blocks(system, end, x0, v0):
        followed = sequence.follow(keep="phases")
        for ending, rates, duration in zip(sequence.endings, followed.rates, followed.durations, strict=True):
            full = np.zeros_like(basis)
            full[coordinates] = rates[np.ix_(coordinates, coordinates)] @ basis[coordinates]
            # A direction once lost stays lost: its factor is 0 for good.
            basis, factors = np.linalg.qr(full)
            now += duration
            sizes = np.abs(np.diag(factors))
            if now <= begin:
                lost |= sizes < _LOST * sizes.max()
            else:
                if lost.any():
                    # What the transient forgot may be remembered by the motion it leads to.
                    basis[np.ix_(motion, lost)] = rng.standard_normal((len(motion), lost.sum()))
                    basis, lost = np.linalg.qr(basis)[0], np.zeros(directions, bool)
                    continue
                with np.errstate(divide="ignore"):
                    # What rounding leaves of a direction that a stick forgets is nothing.
                    sums += np.log(np.where(sizes < _LOST * sizes.max(), 0.0, sizes))
                elapsed += duration
                counted += int(ending != TIME)
                times.append(elapsed)
                course.append(sums.copy())
    running = np.array(course) / np.array(times)[:, None]
    if not forced:
        # The shift in time, or, in a motion without events, the exponent it shares with the last.
        other = np.zeros_like(running[:, :1]) if counted else running[:, -1:]
        running = np.concatenate([other, running], axis=1)
    running = running[:, np.argsort(running[-1])[::-1]]
    period = forcing_period(system) or system.natural_period
    return LyapunovSpectrum(running[-1], elapsed, counted, np.array(times), running, period)


def _of_states(
    system: Oscillator | System, end: float, x0: ArrayLike | None, v0: ArrayLike | None, begin: float, seed: int
) -> LyapunovSpectrum:
    """The same under laws with an internal state, orthogonalised after every period of the forcing or natural period."""
    length = forcing_period(system) or system.natural_period
    orbit = integrate(system, max(begin, 10 * length), x0, v0)
    now, y = orbit.t_end, orbit.variables(np.array([orbit.t_end]))[0]
    flow = StateFlow(system, sizes_of(orbit))
    basis = np.linalg.qr(np.random.default_rng(seed).standard_normal((flow.width, flow.width)))[0] * flow.sizes[:, None]
    sums, elapsed = np.zeros(flow.width), 0.0
    times: list[float] = []
    course: list[NDArray[np.float64]] = []
    while elapsed < (end - begin) * (1 - 1e-9):
        y, moved = flow.tangents(y, now, length, basis)
        basis, factors = np.linalg.qr(moved / flow.sizes[:, None])
        basis = basis * flow.sizes[:, None]
        with np.errstate(divide="ignore"):
            sums += np.log(np.abs(np.diag(factors)))
        now, elapsed = now + length, elapsed + length
        times.append(elapsed)
        course.append(sums.copy())
    running = np.array(course) / np.array(times)[:, None]
    running = running[:, np.argsort(running[-1])[::-1]]
    return LyapunovSpectrum(running[-1], elapsed, 0, np.array(times), running, length)


def _blocks(
    system: Oscillator | System, end: float, x0: ArrayLike | None, v0: ArrayLike | None
) -> Iterator[EventSequence]:
    """The motion in parts that end at events.

    Each is run from the end of the one before, so that a chaotic motion and its derivative do not part; a long mode without
    events comes in parts short enough that no derivative underflows.
    """
    length = 20 * system.natural_period
    most = max(2, _MOST_NUMBERS // layout_of(system).width ** 2)
    sequence, kinds, stop = EventSequence.of_run(system, min(length, end), x0, v0, most)
    now = 0.0
    while True:
        if stop not in ("t_end", "max_events"):
            raise InputError(f"lyapunov: the run ended by {stop}; choose another start or a shorter t_end")
        over = now + float(sequence.durations.sum()) >= end * (1 - 1e-12)
        if not over and not kinds and sequence.stuck[0].all():
            # Stuck beyond this part: a stick must be followed from its begin.
            length *= 2
            sequence, kinds, stop = sequence.continued(min(length, end - now), most)
            continue
        # A run of the most events stops before what follows the last of them is known.
        count = len(sequence.phases) if over or not kinds else len(kinds) - (stop == "max_events")
        modes = sequence.modes[count] if count < len(sequence.phases) else sequence.last
        part = replace(sequence, phases=sequence.phases[:count], last=modes)
        if part.endings[-1] == TIME:
            pieces = max(1, math.ceil(part.durations[-1] / system.natural_period))
            last = np.repeat(part.phases[-1:], pieces)
            last["duration"] /= pieces
            part = replace(part, phases=np.concatenate([part.phases[:-1], last]))
        yield part
        if over:
            return
        followed = part.follow(keep="nothing")
        now += float(followed.durations.sum())
        sequence, kinds, stop = part.from_event(
            count - 1 if len(part.phases) == count else -1, min(length, end - now), followed, most
        )
