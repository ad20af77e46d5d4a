"""Periodic orbits by Newton's method on the return map of the event sequence, stable or not."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stickslip import _core
from stickslip.dynamics.periodic.closed_orbit import NO_RETURN, STEADY, Cycle
from stickslip.dynamics.periodic.event_sequence import HOLD, SECTION, STATE, STICK, EventSequence, check, layout_of
from stickslip.dynamics.periodic.poincare_map import (
    Return,
    close,
    forcing_period,
    inconsistency,
    multipliers_of,
    once,
    return_of,
    size_of,
    undecided,
)
from stickslip.dynamics.scales import fastest_drive, reach
from stickslip.errors import InputError, number, whole_number
from stickslip.model.drive import Drive, NormalForce
from stickslip.model.system import Oscillator, System
from stickslip.simulation.orbit import Orbit

if TYPE_CHECKING:
    import pandas as pd

    from stickslip.dynamics.periodic.state_cycles import StateCycle


#: Lengths of the short runs from a guess, in natural periods or those of the forcing.
_FROM_GUESS = (2.5, 6, 15)
_NO_RETURNS = (
    "periodic_orbit: the motion has no two returns: it comes to rest or slips steadily, or the run is too short; "
    "give a guess"
)
#: A slow drive is followed for so many of the longest sticks.
STICKS = 20
#: So near the returns of a short run, in sizes of the motion, is the orbit that they show.
_NEAR = 0.1
#: Only so near 1 rounding may hide on which side of it a multiplier lies.
_NEAR_ONE = 1e-4


@dataclass(frozen=True, repr=False, eq=False)
class PeriodicOrbit(Cycle):
    """A closed orbit and its stability.

    Attributes
    ----------
    period : its time T; `forcing_periods` says how many periods of the forcing that is (0 without forcing).
    multipliers : Floquet multipliers, complex, the largest first; an autonomous orbit has a 1 for the shift in time, and a
        stick brings a 0 (the direction it forgets).
    stable : whether all but the 1 of an autonomous orbit lie inside the unit circle; None where the orbit is marginal.
    marginal : whether the largest of these has size 1, so that neither is decided by it: within 1e-9, or within what rounding
        leaves unknown, as at the edge of a continuum of orbits, where the orbit is a multiple root of the return map.
    residual : end minus start, the largest relative to the motion; `rounds` of Newton's method it took.
    state : t, x, v where the section is, at the event `section`; of a system x and v are of shape (n,).
    events : kinds of the endings of its phases, in order.
    """

    closed: Return

    @cached_property
    def marginal(self) -> bool:
        """Whether small disturbances neither grow nor decay, as around a centre, as far as rounding lets that be told."""
        return super().marginal or (abs(self.largest - 1) < _NEAR_ONE and undecided(self.closed))

    @property
    def state(self) -> tuple[float, Any, Any]:
        """t, x, v at the section."""
        sequence = self.closed.sequence
        x, v = sequence.start[sequence.layout.x], sequence.start[sequence.layout.v]
        if isinstance(self.system, Oscillator):
            return float(sequence.start[0]), float(x[0]), float(v[0])
        return float(sequence.start[0]), x, v

    @property
    def phases(self) -> pd.DataFrame:
        """Its phases in order: duration, the event that ends each, and for every contact its mode.

        A mode is ``"stick"``, ``"forward"`` or ``"backward"`` (the sense of the slip velocity), or ``"hold"`` between two
        branches of a law.
        """
        import pandas as pd

        sequence = self.closed.sequence
        table = pd.DataFrame({"duration": self.closed.durations, "ends_by": self.events})
        for contact in range(sequence.layout.contacts):
            held, stuck = sequence.held[:, contact], sequence.stuck[:, contact]
            modes = np.select([held, stuck, sequence.modes[:, contact] > 0], ["hold", "stick", "forward"], "backward")
            table[f"mode_{contact}" if sequence.layout.contacts > 1 else "mode"] = modes
        return table

    @property
    def sticks(self) -> bool:
        """Whether adhesion is a part of it."""
        return bool(self.closed.sequence.stuck.any())

    @cached_property
    def orbit(self) -> Orbit:
        """One period from the section on, as an orbit that is exact at any time.

        Of a forced system the phase of the forcing is moved so that the section lies at t = 0.
        """
        return one_period(self.closed, self.period)


def from_section(system: Any, t0: float) -> Any:
    """The system whose clock is 0 where that of `system` is `t0`."""
    if not system.swings:
        return system

    def later(harmonic: Any) -> Any:
        return replace(harmonic, phase=harmonic.phase + harmonic.frequency * t0)

    def moved(contact: Any) -> Any:
        varying = {name: getattr(contact, name) for name in ("drive_velocity", "normal_force")}
        return replace(
            contact,
            **{
                name: replace(value, harmonics=tuple(map(later, value.harmonics)))
                for name, value in varying.items()
                if isinstance(value, Drive | NormalForce)
            },
        )

    if isinstance(system, Oscillator):
        return replace(moved(system), forcing=tuple(later(harmonic) for harmonic in system.harmonics) or None)
    contacts = [moved(contact) for contact in system.contacts]
    return replace(system, forcing=tuple(map(later, system.forcing)), contacts=contacts)


def one_period(closed: Return, period: float) -> Orbit:
    """The orbit of a closed orbit, from its section on."""
    sequence = closed.sequence
    t0 = float(sequence.start[0])
    system = from_section(sequence.system, t0)
    if isinstance(system, System) or not system.closed_form:
        start = sequence.start.copy()
        start[0] = 0.0
        moving = _core.Orbit.resume(system.core, start, sequence.modes[0].copy(), period)
        return Orbit(system, moving)
    followed = sequence.follow(keep="nothing")
    states = np.vstack([sequence.start, followed.states])
    stuck, held, direction = sequence.stuck[:, 0], sequence.held[:, 0], np.sign(sequence.modes[:, 0]).astype(float)
    slope = np.where(held, np.inf, np.where(stuck, 0.0, states[:-1, 4]))
    rows = np.column_stack(
        [
            states[:-1, 0] - t0,
            np.zeros(len(slope)),
            states[:-1, 1],
            states[:-1, 2],
            direction,
            np.where(stuck | held, 0.0, states[:-1, 3]),
            slope,
            states[:-1, len(STATE)],
        ]
    )
    kinds = [_core.KINDS.index(kind) for kind in kinds_of(sequence)]
    times, x, v = states[1:, 0] - t0, states[1:, 1], states[1:, 2]
    angles = [harmonic.frequency * times + harmonic.phase for harmonic in system.harmonics]
    driven = sum((f.amplitude * np.cos(a) for f, a in zip(system.harmonics, angles, strict=True)), np.zeros(len(kinds)))
    rate = system.stiffness * v + sum(
        f.amplitude * f.frequency * np.sin(a) for f, a in zip(system.harmonics, angles, strict=True)
    )
    # Just before the event: what holds the mass, or what the line of friction says.
    line = direction * states[:-1, 3] + states[:-1, 4] * (system.drive_velocity - v)
    force = np.where(stuck | held, system.stiffness * x + system.damping * v - driven, line)
    sticking, loading = (np.where(stuck, column, np.nan) for column in (closed.durations, np.sign(force) * rate))
    table = np.column_stack([times, kinds, np.zeros(len(kinds)), x, v, force, sticking, loading])
    core = _core.Orbit.restore(
        system.core,
        ([float(sequence.start[1])], [float(sequence.start[2])], period, 10_000_000),
        _core.STOPS.index("t_end"),
        (len(kinds), 0, 0, 0),
        np.ascontiguousarray(rows.ravel()),
        np.ascontiguousarray(table.ravel()),
    )
    return Orbit(system, core)


def kinds_of(sequence: EventSequence) -> list[str]:
    """The kinds of the events that end the phases."""
    following = np.vstack([sequence.modes[1:], sequence.last])
    kinds = []
    for (mode, ending, contact, _), then in zip(sequence.phases, following, strict=True):
        before, after = mode[contact], then[contact]
        name = _core.ENDINGS[ending]
        if name == "release":
            kinds.append("release")
        elif abs(after) == HOLD:
            kinds.append("hold")
        elif after == STICK:
            kinds.append("capture")
        elif after != np.sign(before):
            kinds.append("crossing")
        else:
            kinds.append("node" if name in ("low", "high") else "reversal")
    return kinds


def find(
    system: Any, sequence: EventSequence, kinds: list[str], settled: bool, periods: int | None
) -> tuple[EventSequence, int]:
    """One period cut out of a run: between two returns that are nearly the same; and how many periods of the forcing."""
    late = kinds[len(kinds) // 2 :]
    wanted = next((kind for kind in ("capture", "crossing", "reversal") if kind in late), None)
    if wanted is None:
        sequence = sequence.with_sections()
        marks = np.flatnonzero(sequence.endings == SECTION)
    else:
        # Of several contacts the one whose event comes last.
        contacts = sequence.phases["contact"][: len(kinds)]
        which = next(c for kind, c in zip(kinds[::-1], contacts[::-1], strict=True) if kind == wanted)
        marks = np.flatnonzero((np.array(kinds) == wanted) & (contacts == which))
    if len(marks) < 2:
        raise InputError(_NO_RETURNS)
    followed = sequence.follow(keep="nothing")
    states, width = followed.states, sequence.layout.width
    if settled and wanted is None and steady(system, states[marks[-len(marks) // 2 :]]):
        raise InputError(STEADY)
    following = np.vstack([sequence.modes[1:], sequence.modes[-1:]])
    force = forcing_period(system)
    coordinates = np.concatenate([sequence.layout.x, sequence.layout.v])
    size = size_of(system, states[marks[-1]], coordinates)

    def distance(a: int, b: int) -> tuple[float, int]:
        # Of one kind are two states whose contacts go on alike, on like branches.
        if (states[a, width:] != states[b, width:]).any() or (following[a] != following[b]).any():
            return math.inf, 0
        gap = float(np.abs((states[a][coordinates] - states[b][coordinates]) / size).max())
        if force is None:
            return gap, 0
        forcing_periods = (states[b, 0] - states[a, 0]) / force
        whole = max(1, round(forcing_periods))
        if periods is not None and whole != periods:
            return math.inf, 0
        return max(gap, abs(forcing_periods - whole) * force / (system.natural_period / (2 * math.pi))), whole

    # From the end of a settled run backwards, from the guess onwards otherwise.
    if settled:
        ends = [(int(a), int(marks[-1])) for a in marks[-2:-202:-1]]
    else:
        ends = [(int(a), int(b)) for i, a in enumerate(marks[:40]) for b in marks[i + 1 : i + 41]]
    pairs = []
    for a, b in ends:
        gap, forcing_periods = distance(a, b)
        pairs.append((gap, b - a, a, b, forcing_periods))
    for tolerance in (1e-7, 1e-5, 1e-3, 3e-2, 0.3):
        near = [pair for pair in pairs if pair[0] < tolerance]
        if near:
            _, _, a, b, forcing_periods = min(near, key=lambda pair: (pair[1], pair[0]))
            return _early(sequence.part(followed, a, b), force), forcing_periods
    raise InputError(NO_RETURN)


def _early(sequence: EventSequence, force: float | None) -> EventSequence:
    """The same in the first period of the forcing, where a change of its frequency moves the phase least."""
    start = sequence.start.copy()
    start[0] -= start[0] if force is None else force * math.floor(start[0] / force)
    return replace(sequence, start=start)


def periodic_orbit(
    system: Oscillator | System,
    guess: Any = None,
    *,
    t_end: float | None = None,
    periods: int | None = None,
    progress: Callable[[], Any] = lambda: None,
) -> PeriodicOrbit | StateCycle:
    """A periodic orbit, stable or not, by Newton's method on its event sequence.

    The unknowns are the state at an event of the orbit (memory of the contact included), and at a forced system the phase;
    the derivative of the return map is that of the core, exact through every event.

    Parameters
    ----------
    system : autonomous or with harmonic forcing, of one mass or several; its drives follow no table. Contacts under laws
        without an internal state must not close a loop.
    guess : None: the motion that a long run from rest on the drive settles on, of several masses where that is refused from
        rest at unlike positions; (x, v): a state near the orbit, for orbits
        that repel or lie apart, numbers or one of each a mass; an :class:`~stickslip.Orbit`: its last state; a
        :class:`PeriodicOrbit`: its event sequence, which `system` must have too (another value of a number moves the orbit).
    t_end : length of the run that is looked at for a return; default 150 natural periods and, where these are not
        enough, 600. From a guess runs of 2.5, 6 and 15 periods are tried first, so that an orbit that repels is found
        before the run has left it, then one of 30, the only one under laws with an internal state. Where a slow drive loads
        a stick for longer, runs of 20 such sticks come last.
    periods : the number of periods of the forcing an orbit must take; default the first that returns.
    progress : called before each run and each round of Newton's method.

    Returns
    -------
    PeriodicOrbit; under laws with an internal state a :class:`~stickslip.dynamics.periodic.state_cycles.StateCycle`, whose
    multipliers come from the variational equation, integrated along with the motion.

    Raises
    ------
    InputError
        where no return is near an earlier one, Newton's method does not converge, or what it converges to is not a motion
        of the system because the event sequence would be another.

    Limits: the time grows with the cube of the number of masses; of 100 an orbit of 200 events takes half a minute of a
    processor and 0.4 GiB.

    Source: shooting with saltation, Leine & Nijmeijer 2004 (LNACM 18), ch. 7; the orbit is exact, so is its derivative.

    >>> from stickslip.laws import DwellTime
    >>> cycle = periodic_orbit(Oscillator(damping=0.0, drive_velocity=0.3, law=DwellTime(0.5, 0.5, 0.4)))
    >>> round(cycle.period, 10), cycle.multipliers.real.round(10).tolist()
    (6.501489988, [1.0, 0.5716763248])
    """
    if isinstance(system, Oscillator | System) and system.integrated:
        from stickslip.dynamics.periodic.state_cycles import state_cycle

        return state_cycle(system, guess, t_end=t_end, periods=periods, progress=progress)
    return event_cycle(system, guess, t_end=t_end, periods=periods, progress=progress)


def event_cycle(
    system: Oscillator | System,
    guess: Any = None,
    *,
    t_end: float | None = None,
    periods: int | None = None,
    progress: Callable[[], Any] = lambda: None,
) -> PeriodicOrbit:
    """A periodic orbit of laws without an internal state; :func:`periodic_orbit` calls it.

    >>> from stickslip.laws import StaticKinetic
    >>> round(event_cycle(Oscillator(0.0, 0.2, StaticKinetic(1.0, 0.6))).period, 12)  # closed form, Andronov 1937
    8.068887871591
    """
    check(system, "periodic_orbit")
    if periods is not None:
        whole_number("periods", periods, "periodic_orbit")
    if isinstance(guess, PeriodicOrbit):
        return moved_to(system, guess)
    start, settles = _start(guess), guess is None
    slowest = max(system.natural_period, forcing_period(system) or 0.0)
    if t_end is not None:
        lengths = [number("t_end", t_end, "periodic_orbit")]
    elif settles:
        lengths = [150 * slowest, 600 * slowest]
    else:
        lengths = [*(slowest * count * (periods or 1) for count in _FROM_GUESS), 30 * slowest]
    usual, sticks = lengths[-1], STICKS * longest_stick(system)
    if t_end is None and sticks > usual:
        lengths.append(sticks)
    # Masses that begin alike may move alike, at the edge of the motions that a disturbance leads to.
    starts = [start, *unlike(system)] if settles else [start]
    for begin in starts:
        refusals: list[InputError] = []
        for length in lengths:
            if length > usual and str(refusals[-1]) not in (_NO_RETURNS, NO_RETURN):
                break
            try:
                cycle, moved = _closed(system, length, begin, settles, periods, progress)
            except InputError as refusal:
                # Where disturbances decay slowly a motion has not settled by the first length; a guess may need a longer one.
                refusals.append(refusal)
                continue
            # A run leaves an orbit that repels: of a guess the first returns count that close near themselves.
            if settles or length >= usual or moved < _NEAR:
                return cycle
    refined = None if settles else _without_events(system, start, periods or 1)
    if refined is not None:
        return _closed(system, _FROM_GUESS[0] * slowest * (periods or 1), refined, False, periods, progress)[0]
    # A motion that has come to rest by the end of a longer run says most.
    clearest = next((one for one in refusals if str(one) == STEADY), refusals[0 if settles else -1])
    if str(clearest) == STEADY and not settles:
        # Near a Hopf point the cycle lies beside the equilibrium, and a guess between them may lead to either.
        raise InputError(
            "periodic_orbit: the guess leads to rest or steady slip; a cycle may lie further from it: give another guess, "
            "or none for the motion from rest"
        )
    if str(clearest) == _NO_RETURNS and not settles:
        raise InputError(
            "periodic_orbit: the run from the guess has no two returns: it leaves the orbit, comes to rest or slips "
            "steadily; give a guess nearer to the orbit, or a longer t_end"
        )
    if settles and "does not end on phase" in str(clearest):
        raise InputError(
            "periodic_orbit: the motion from rest does not settle, and two motions beside each other part too soon to follow "
            "its events: it may be chaotic (lyapunov tells); for an orbit within it give a guess (x, v)"
        )
    if settles and not str(clearest).startswith("periodic_orbit"):
        raise InputError(f"{clearest}: the motion from rest is meant; for an orbit elsewhere give a guess (x, v)")
    raise clearest


def longest_stick(system: Oscillator | System) -> float:
    """How long a constant drive takes at the most to load a contact that carried the static friction the other way.

    0 with forcing, which breaks sticks, and where no drive moves or no spring loads.
    """
    if forcing_period(system) is not None or not fastest_drive(system):
        return 0.0
    stick = 2 * float(reach(system).max()) / fastest_drive(system)
    return stick if math.isfinite(stick) else 0.0


def _without_events(system: Any, start: tuple[Any, Any], periods: int) -> tuple[Any, Any] | None:
    """A state after which a forced motion without events returns after so many periods of the forcing, from one near it.

    Beside a motion that repels strongly a run has left it before it shows a return. Newton's method; None where it fails.
    """
    force = forcing_period(system)
    if force is None:
        return None
    x, v = start
    for _ in range(20):
        try:
            sequence, kinds, stop = EventSequence.of_run(system, force * periods, x, v)
            if kinds or stop != "t_end":
                return None
            followed = sequence.follow(keep="last")
        except InputError:
            return None
        moves = np.concatenate([sequence.layout.x, sequence.layout.v])
        missed = followed.states[-1][moves] - sequence.start[moves]
        rates = followed.rates[-1][np.ix_(moves, moves)]
        try:
            state = sequence.start[moves] + np.linalg.solve(np.eye(len(moves)) - rates, missed)
        except np.linalg.LinAlgError:
            return None
        x, v = np.split(state, 2)
        if isinstance(system, Oscillator):
            x, v = float(x[0]), float(v[0])
        if (np.abs(missed) <= 1e-11 * size_of(system, sequence.start, moves)).all():
            return x, v
    return None


def unlike(system: Oscillator | System) -> list[tuple[Any, Any]]:
    """Starts on the drive in which no two masses are at the same position, for a system of several."""
    if isinstance(system, Oscillator) or system.masses == 1:
        return []
    # Spread evenly, whatever the number of masses, over what a tenth or all of the static friction displaces one of them, and
    # last beside the start on the drive itself.
    shares = np.arange(system.masses) * ((5**0.5 - 1) / 2) % 1.0
    rate = 2 * math.pi / system.natural_period
    displaced = max(
        float(np.max(contact.law.break_away_force())) / (system.mass[contact.mass][contact.mass] * rate**2)
        for contact in system.contacts
    )
    return [(part * displaced * shares, None) for part in (0.1, 1.0, 1e-3)]


def _closed(
    system: Any,
    length: float,
    start: tuple[Any, Any],
    settles: bool,
    periods: int | None,
    progress: Callable[[], Any],
) -> tuple[PeriodicOrbit, float]:
    """The orbit near the returns of a run, and how far from these its start is, in sizes of the motion.

    The returns near the end of the run where it settles, else those near its start.
    """
    progress()
    sequence, kinds = _run(system, length, *start, pieces=4 if settles else 1)
    part, forcing_periods = find(system, sequence, kinds, settles, periods)
    closed, rounds = close(part, forcing_periods, progress=progress)
    moved = np.abs(closed.sequence.start[closed.coordinates] - part.start[closed.coordinates])
    sizes = size_of(system, part.start, closed.coordinates)
    if periods is None:
        closed = once(closed)
    cycle = finished(closed, rounds)
    if amplitude(cycle) < 1e-7 * size_of(system, cycle.closed.sequence.start, np.array([1]))[0]:
        raise InputError(STEADY)
    return cycle, float((moved / sizes).max(initial=0.0))


def steady(system: Any, states: NDArray[np.float64]) -> bool:
    """Whether nothing moves any more where the slip speed is greatest, to 1e-6 of what is large there."""
    v = layout_of(system).v
    return bool((np.abs(states[:, v]) < 1e-6 * size_of(system, states[-1], v)).all())


def _run(system: Any, length: float, x0: Any, v0: Any, pieces: int) -> tuple[EventSequence, list[str]]:
    """The last piece of a run, half of it all, and the kinds of its events.

    Each piece starts from where following the one before it ended, so that what is followed is what was run: two orbits that
    rounding has set apart may part within a transient.
    """
    short = length / (pieces + 2) if pieces > 1 else length
    sequence, kinds, stop = EventSequence.of_run(system, short, x0, v0)
    if pieces > 1 and not kinds and sequence.stuck.all():
        # A slow drive may take longer than a piece to load the first stick.
        sequence, kinds, stop = EventSequence.of_run(system, length, x0, v0)
    for piece in range(1, pieces):
        if stop != "t_end" or not kinds:
            break
        sequence, kinds, stop = sequence.from_event(len(kinds) - 1, short if piece < pieces - 1 else 3 * short)
    if stop != "t_end":
        raise InputError(f"periodic_orbit: the run ended by {stop}; choose another start or another t_end")
    return sequence, kinds


def amplitude(cycle: PeriodicOrbit) -> float:
    """Half the range of x, from 401 points of a period; of several masses the largest."""
    x = cycle.orbit.at(np.linspace(0.0, cycle.orbit.t_end, 401))[0]
    return float(np.ptp(np.asarray(x), axis=0).max()) / 2


def finished(closed: Return, rounds: int) -> PeriodicOrbit:
    """A closed orbit as a result, its consistency checked."""
    cycle = unchecked(closed, rounds)
    reason = inconsistency(cycle.closed)
    if reason is not None:
        raise InputError(
            f"periodic_orbit: Newton's method closed an orbit the motion does not follow ({reason}): its event sequence "
            "is another; give another guess"
        )
    return cycle


def unchecked(closed: Return, rounds: int = 0) -> PeriodicOrbit:
    """A closed orbit as a result, as it is: on a boundary its consistency is a matter of rounding."""
    here = closed
    if not len(here.tests):
        here = return_of(closed.sequence, closed.forcing_periods, tests=True)
    kinds = kinds_of(here.sequence)
    return PeriodicOrbit(
        system=here.sequence.system,
        period=here.period,
        forcing_periods=here.forcing_periods,
        multipliers=multipliers_of(here),
        residual=float(np.abs(here.defect / here.sizes).max(initial=0.0)),
        rounds=rounds,
        section="extremum of the slip velocity" if here.sequence.endings[-1] == SECTION else kinds[-1],
        events=tuple(kinds),
        closed=here,
    )


def moved_to(system: Any, cycle: PeriodicOrbit) -> PeriodicOrbit:
    """The same orbit of a system with other numbers: Newton's method on the event sequence it has."""
    sequence = cycle.closed.sequence
    if layout_of(system) != sequence.layout or (forcing_period(system) is None) != (cycle.forcing_periods == 0):
        raise InputError(
            "periodic_orbit: the guess is an orbit of a system of another kind; give a guess (x, v) or an orbit of this one"
        )
    if len(sequence.phases) == 1 and isinstance(system, Oscillator) and system.law != sequence.system.law:
        # Without an event the line of friction stays that of the law it was found under.
        x, v = cycle.orbit.at(-cycle.state[0] % cycle.period)
        return event_cycle(system, (float(x), float(v)), periods=cycle.forcing_periods or None)
    closed, rounds = close(replace(sequence, system=system), cycle.forcing_periods)
    return finished(closed, rounds)


def _start(guess: Any) -> tuple[Any, Any]:
    if guess is None:
        return None, None
    if isinstance(guess, Orbit):
        x, v = guess.at(guess.t_end)
        return x, v
    try:
        x, v = (np.asarray(part, float) for part in guess)
    except (TypeError, ValueError):
        raise InputError(f"periodic_orbit: guess must be (x, v), an orbit or None, got {guess!r}") from None
    if not (np.isfinite(x).all() and np.isfinite(v).all()):
        raise InputError(f"periodic_orbit: guess must be finite numbers, got {guess!r}")
    return x, v
