"""Lyapunov exponents through events. Floquet multipliers of a closed orbit: `poincare_map.py`, `state_cycles.py`."""

from __future__ import annotations

import itertools
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
from stickslip.errors import InputError, fraction, number
from stickslip.files.equality import ByContent
from stickslip.files.notebook import InNotebook
from stickslip.model.system import Oscillator, System
from stickslip.simulation.integration import integrate

#: The derivatives held at one time are of no more numbers: each event of 100 masses has a million and a half.
_MOST_NUMBERS = 20_000_000
#: What shrinks to less of the largest direction is not well known; below the other it is what rounding leaves, and lost.
_SMALL, _LOST = 1e-8, 1e-12
#: In so many pieces a phase is cut in which that happens, and those again, down to so many in a natural period.
_CUTS, _PIECES = 4, 1000
#: Under laws with an internal state decay is followed up to so many times 1/e in a natural period, by parts in which there is
#: little of it; so many of them are taken together.
_FASTEST, _TOGETHER = 100_000, 8
#: Under them so many periods are left out at the least.
_SETTLING = 10


@dataclass(frozen=True, eq=False)
class LyapunovSpectrum(ByContent, InNotebook):
    """Lyapunov exponents of a motion.

    Attributes
    ----------
    exponents : in 1/time, the largest first; −inf for a direction that sticking forgets at once, or that decays thousands of
        times as fast as the masses swing, which no run follows; 0 for the shift in time of an autonomous motion with events.
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

    Limits: a finite average; where sticks are rare, the exponent they bring is −inf all the same. Where no event comes in the
    second half of the average, the average begins after the last one: that is the motion it leads to.

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
    parts = list(_blocks(system, end, x0, v0))
    ends = np.cumsum(np.concatenate([part.durations for part in parts]))
    events = np.flatnonzero(np.concatenate([part.endings for part in parts]) != TIME)
    now = float(ends[events[-1]]) if events.size else 0.0
    # A motion without an event in the second half of the average has left its events, and what they do, for good.
    if eventful := now > (begin + ends[-1]) / 2:
        now = 0.0
    else:
        parts = _after_events(parts)
    # From event to event a shift in time is no direction: its exponent is 0.
    shift = eventful and forcing_period(system) is None
    directions = _Directions(system, 2 * system.masses - shift, seed, parts)
    elapsed, counted = 0.0, 0
    times: list[float] = []
    course: list[NDArray[np.float64]] = []
    for part in parts:
        carried = directions.through(part)
        for duration, ending in zip(part.durations, part.endings, strict=True):
            now += duration
            if now > begin and not times:
                # What the transient forgot may be remembered by the motion it leads to.
                directions.complete()
            next(carried)
            if now > begin:
                elapsed += duration
                counted += int(ending != TIME)
                times.append(elapsed)
                course.append(directions.sums.copy())
    running = np.array(course) / np.array(times)[:, None]
    if shift:
        running = np.concatenate([np.zeros_like(running[:, :1]), running], axis=1)
    running = running[:, np.argsort(running[-1])[::-1]]
    period = forcing_period(system) or system.natural_period
    return LyapunovSpectrum(running[-1], elapsed, counted, np.array(times), running, period)


def _after_events(parts: list[EventSequence]) -> list[EventSequence]:
    """What follows the last event."""
    for index in range(len(parts) - 1, -1, -1):
        part = parts[index]
        events = np.flatnonzero(part.endings != TIME)
        if events.size:
            later = parts[index + 1 :]
            if events[-1] + 1 < len(part.phases):
                later.insert(0, part.part(part.follow(keep="nothing"), events[-1], len(part.phases) - 1))
            return later
    return parts


class _Directions:
    """Directions that a motion carries along, orthonormal, and the logarithms of their growth.

    Attributes
    ----------
    sums : growth of each direction since they were completed; −inf of one that is lost.
    """

    def __init__(self, system: Oscillator | System, most: int, seed: int, parts: list[EventSequence]) -> None:
        layout = layout_of(system)
        self._motion = np.concatenate([layout.x, layout.v])
        # A clock that nothing reads is no direction.
        self._first = 0 if forcing_period(system) is not None else 1
        self._units = _units(system, parts)
        self._shortest = system.natural_period / _PIECES
        self._rng = np.random.default_rng(seed)
        self._basis = np.zeros((layout.width, 0))
        self._kept = np.zeros(most, bool)
        self.complete()

    def complete(self) -> None:
        """Take as many directions as there are, those that are known first, and count from here."""
        others = np.zeros((len(self._basis), int((~self._kept).sum())))
        others[self._motion] = self._rng.standard_normal((len(self._motion), others.shape[1]))
        self._basis = np.linalg.qr(np.concatenate([self._basis, others], axis=1))[0]
        self._kept = np.ones_like(self._kept)
        self.sums = np.zeros(len(self._kept))

    def through(self, part: EventSequence) -> Iterator[None]:
        """Carry them through its phases, one at each step."""
        followed = part.follow(keep="phases")
        rates = followed.rates[:, :, : len(self._units)] * self._units / self._units[:, None]
        rates[:, : self._first] = 0.0
        for phase, duration in enumerate(followed.durations):
            basis, factors = np.linalg.qr(rates[phase] @ self._basis)
            sizes = np.abs(np.diag(factors))
            largest = sizes.max(initial=1.0)
            if duration > self._shortest and (sizes < _SMALL * largest).any():
                # Rounding hides what is small beside the largest: damping gives that in time, a stick at once.
                start = part.start if phase == 0 else followed.states[phase - 1]
                after = part.modes[phase + 1] if phase + 1 < len(part.phases) else part.last
                whole = EventSequence(part.system, start, part.phases[phase : phase + 1], after)
                for _ in self.through(whole.cut([[duration / _CUTS] * _CUTS], TIME)):
                    pass
            else:
                kept = sizes > _LOST * largest
                self._basis = basis[:, kept]
                self.sums[self._kept] += np.log(np.where(kept, sizes, 1.0))
                self._kept[self._kept] = kept
                self.sums[~self._kept] = -math.inf
            yield


def _units(system: Oscillator | System, parts: list[EventSequence]) -> NDArray[np.float64]:
    """The unit of each number of a state: those of time and force are of the system, that of length a power of 1000."""
    layout = layout_of(system)
    states = np.abs(parts[0].follow(keep="nothing").states).max(axis=0)
    time = system.natural_period / (2 * math.pi)
    length = max(states[layout.x].max(), time * states[layout.v].max()) or 1.0
    length = 1000.0 ** round(math.log(length, 1000.0))
    force = np.abs(system.mass).max() * length / time**2
    units = np.ones(layout.width)
    units[[0, *layout.ages]], units[layout.x], units[layout.v] = time, length, length / time
    units[layout.speeds], units[layout.forces] = length / time, force
    units[layout.contact_coordinates(["slope"])] = force * time / length
    return units


def _of_states(
    system: Oscillator | System, end: float, x0: ArrayLike | None, v0: ArrayLike | None, begin: float, seed: int
) -> LyapunovSpectrum:
    """The same under laws with an internal state, orthogonalised as often as the fastest of the disturbances asks."""
    period = forcing_period(system) or system.natural_period
    length = period / max(1, math.ceil(period / system.natural_period))
    orbit = integrate(system, max(begin, _SETTLING * period), x0, v0)
    now, y = orbit.t_end, orbit.variables(np.array([orbit.t_end]))[0]
    # Of a motion that hardly moves differences would be rounding.
    flow = StateFlow(system, np.maximum(sizes_of(orbit), 1e-3 * np.abs(y)))
    basis = np.linalg.qr(np.random.default_rng(seed).standard_normal((flow.width, flow.width)))[0]
    sums = np.zeros(flow.width)
    course: list[NDArray[np.float64]] = []
    # The first of them only turn the directions into those that grow and shrink.
    for count in range(-_SETTLING, math.ceil((end - begin) / length * (1 - 1e-9))):
        y, parts = flow.derivatives(y, now, length, _FASTEST / system.natural_period)
        now += length
        while few := list(itertools.islice(parts, _TOGETHER)):
            for part in few:
                basis = part @ basis
            basis, factors = np.linalg.qr(basis)
            sizes = np.abs(np.diag(factors))
            if count >= 0:
                with np.errstate(divide="ignore"):
                    sums += np.log(np.where(sizes > _LOST * sizes.max(), sizes, 0.0))
        if count >= 0:
            course.append(sums.copy())
    times = np.asarray(length * np.arange(1, len(course) + 1), float)
    running = np.array(course) / times[:, None]
    running = running[:, np.argsort(running[-1])[::-1]]
    return LyapunovSpectrum(running[-1], float(times[-1]), 0, times, running, period)


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
