"""Periodic orbits by Newton's method on the return map of the event sequence, stable or not."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stickslip import _core
from stickslip.documents import number
from stickslip.errors import InputError
from stickslip.orbit import Orbit
from stickslip.simulation import simulate
from stickslip.stability.trail import BORDERS, SECTION, STATE, TIME, Floats, Trail, check
from stickslip.system import Harmonic, Oscillator

_SPEEDS = [STATE.index(name) for name in ("low", "high", "anchor_w", "corner_w")]
_FORCES = [STATE.index(name) for name in ("offset", "anchor_f", "corner_f", "released_at")]
_T, _X, _V, _SINCE = 0, 1, 2, len(STATE) - 1
_PARAMETER = len(STATE)
#: Below this share of the largest a multiplier is the zero that an event brings.
_NOTHING = 1e-11


def forcing_period(system: Oscillator) -> float | None:
    """The period of the forcing; None without one.

    Raises
    ------
    InputError
        where several frequencies have no common period of at most 100 of the slowest.
    """
    frequencies = [harmonic.frequency for harmonic in system.harmonics]
    if not frequencies:
        return None
    slowest = min(frequencies)
    for count in range(1, 101):
        turns = np.array(frequencies) / slowest * count
        if np.abs(turns - np.round(turns)).max() < 1e-9:
            return 2 * math.pi / slowest * count
    raise InputError(f"periodic_orbit: the forcing has no common period, its frequencies are {frequencies}")


@dataclass(frozen=True)
class Return:
    """One turn of a cycle: the return map at its start, differentiated.

    Attributes
    ----------
    defect : the end minus the start, over `lanes`.
    map_jacobian : of the return map over `lanes`.
    parameter : derivative of the end with respect to the parameter, over `lanes`; zero where none was asked for.
    tests : rows of test functions; `test_rates` their derivatives over `lanes` and the parameter.
    fixed : what the orbit writes whatever the start was, such as the velocity of the drive where it is reached;
        `fixed_parameter` its derivatives with respect to the parameter.
    """

    trail: Trail
    turns: int
    lanes: NDArray[np.int64]
    end: Floats
    defect: Floats
    map_jacobian: Floats
    parameter: Floats
    tests: Floats
    test_rates: Floats
    durations: Floats
    fixed: NDArray[np.int64]
    fixed_parameter: Floats

    @property
    def period(self) -> float:
        """How long it took."""
        return float(self.durations.sum())


def lanes_of(system: Oscillator, start: Floats) -> NDArray[np.int64]:
    """The numbers of the state that make the return map: all that are finite; time only where something else keeps time."""
    first = _X if forcing_period(system) is None else _T
    return np.array([lane for lane in range(first, _SINCE) if np.isfinite(start[lane])])


def turn(trail: Trail, turns: int, path: str | None = None, *, tests: bool = False) -> Return:
    """Follow one period; `turns` periods of the forcing."""
    period = forcing_period(trail.system)
    followed = trail.follow(path, tests=tests)
    lanes = lanes_of(trail.system, trail.start)
    end, rates = followed.states[-1], followed.rates[-1].copy()

    def gathered(columns: Floats) -> Floats:
        # A stick begins where the trail does: who moves the start moves the begin of adhesion.
        moved = columns.copy()
        moved[..., _T] += columns[..., _SINCE]
        return moved

    rates = gathered(rates)
    # What nothing along the orbit reads or writes is no part of the map, and what it writes whatever the start was is known.
    within = rates[np.ix_(lanes, lanes)]
    unit = np.eye(len(lanes), dtype=bool)
    alone = ~(np.where(unit, 0.0, within) != 0).any(axis=1) & ~(np.where(unit, 0.0, within) != 0).any(axis=0)
    idle = alone & (np.diag(within) == 1)
    written = ~(within != 0).any(axis=1)
    fixed, lanes = lanes[written], lanes[~idle & ~written]
    defect = end[lanes] - trail.start[lanes]
    # They move with the parameter, and what depends on them with them.
    parameter = rates[lanes, _PARAMETER] + rates[np.ix_(lanes, fixed)] @ rates[fixed, _PARAMETER]
    if period is not None:
        at = int(np.flatnonzero(lanes == _T)[0])
        defect[at] -= turns * period
        if path is not None and path.startswith("/forcing/") and path.endswith("/frequency"):
            parameter[at] += turns * period / trail.system.harmonics[int(path.split("/")[2])].frequency
    borders = followed.tests
    test_rates = gathered(borders[:, 5:])
    return Return(
        trail=replace(trail, arcs=np.column_stack([trail.arcs[:, :3], followed.durations])),
        turns=turns,
        lanes=lanes,
        end=end,
        defect=defect,
        map_jacobian=rates[np.ix_(lanes, lanes)],
        parameter=parameter,
        tests=borders[:, :5],
        test_rates=np.column_stack(
            [test_rates[:, lanes], test_rates[:, _PARAMETER] + test_rates[:, fixed] @ rates[fixed, _PARAMETER]]
        ),
        fixed=fixed,
        fixed_parameter=rates[fixed, _PARAMETER],
        durations=followed.durations,
    )


def moved(here: Return, step: Floats) -> Trail:
    """The trail from a start moved by `step` over its lanes; what is written along the way is taken from its end."""
    start = here.trail.start.copy()
    start[here.lanes] += step
    start[here.fixed] = here.end[here.fixed]
    start[_SINCE] = start[_T]
    return replace(here.trail, start=start)


def size_of(system: Oscillator, start: Floats, lanes: NDArray[np.int64]) -> Floats:
    """What counts as large in each number of the state."""
    time = system.natural_period / (2 * math.pi)
    length = max(abs(start[_X]), time * abs(start[_V]), time * abs(system.drive_velocity), 1e-300)
    sizes = np.maximum(np.abs(start[: len(STATE)]), 1e-300)
    sizes[[_T, _X, _V]] = time, length, length / time
    # A number of the line or the memory that passes zero is no smaller a part of the law than the others of its dimension.
    for lanes_alike in (_SPEEDS, _FORCES):
        sizes[lanes_alike] = np.nanmax(np.where(np.isfinite(sizes[lanes_alike]), sizes[lanes_alike], np.nan))
    return np.asarray(sizes[lanes], float)


def close(trail: Trail, turns: int, rounds: int = 40) -> tuple[Return, int]:
    """Newton's method on the return map; the closed turn and the rounds it took.

    Raises
    ------
    InputError
        where it does not converge.
    """
    best = math.inf
    stalled = 0
    for done in range(rounds):
        here = turn(trail, turns)
        size = size_of(trail.system, here.trail.start, here.lanes)
        jacobian = np.eye(len(here.lanes)) - here.map_jacobian
        step = np.linalg.lstsq(jacobian, here.defect, rcond=1e-14)[0]
        error = float(np.abs(step / size).max(initial=0.0))
        fixed = np.array_equal(here.end[here.fixed], here.trail.start[here.fixed])
        if (error < 1e-14 and fixed) or (done > 2 and error < 1e-9 and error >= 0.25 * best):
            stalled += 1
            if stalled > 1 or (error < 1e-14 and fixed):
                return here, done + 1
        best = min(best, error)
        # A step beyond a fifth of the motion is no correction any more.
        trail = moved(here, np.asarray(step * min(1.0, 0.2 / max(error, 1e-300)), float))
    raise InputError(
        f"periodic_orbit: no periodic orbit of this event sequence near the guess (the last step is {best:.1e} of the "
        "motion): give another guess or simulate longer first"
    )


def _once(closed: Return) -> Return:
    """The orbit taken once: near a flip a run that is not quite settled returns sooner after two periods than after one."""
    arcs = closed.trail.arcs
    for count in range(len(arcs), 1, -1):
        if len(arcs) % count or closed.turns % count:
            continue
        parts = arcs.reshape(count, -1, 4)
        same = (parts[:, :, :3] == parts[0, :, :3]).all()
        if same and np.ptp(closed.durations.reshape(count, -1), axis=0).max() < 1e-7 * closed.period:
            trail = replace(closed.trail, arcs=parts[0], last=(float(arcs[0, 0]), float(arcs[0, 1])))
            return close(trail, closed.turns // count)[0]
    return closed


def inconsistency(here: Return) -> str | None:
    """Why the real motion does not follow the event sequence; None where it does."""
    if (here.durations <= 0).any():
        return f"arc {int(np.argmin(here.durations))} would take no time"
    finite = np.isfinite(here.tests[:, 4])
    scale = 1e-9 * np.abs(here.tests[finite, 4]).max(initial=1e-300)
    for border, arc, _, _, value in here.tests[finite]:
        if value < -scale:
            return f"the test function {BORDERS[int(border)]} of arc {int(arc)} is {value:.2e}"
    return None


def multipliers_of(here: Return) -> NDArray[np.complex128]:
    """Floquet multipliers, the largest first: the 1 of an autonomous cycle, and zero where an event loses a direction."""
    values = np.linalg.eigvals(here.map_jacobian).astype(complex)
    values = values[np.argsort(-np.abs(values), kind="stable")]
    values[np.abs(values) < _NOTHING * max(1.0, float(np.abs(values).max(initial=0.0)))] = 0.0
    if forcing_period(here.trail.system) is None:
        values = np.concatenate([[1.0 + 0.0j], values])
    values = np.append(values, [0.0, 0.0])
    count = max(2, int((values != 0).sum()))
    return np.asarray(values[:count], complex)


@dataclass(frozen=True)
class PeriodicOrbit:
    """A closed orbit and its stability.

    Attributes
    ----------
    period : its time T; `turns` says how many periods of the forcing that is (0 without forcing).
    multipliers : Floquet multipliers, complex, the largest first; an autonomous orbit has a 1 for the shift in time, and a
        stick brings a 0 (the direction it forgets).
    stable : whether all but the 1 of an autonomous orbit lie inside the unit circle.
    residual : end minus start, the largest relative to the motion; `rounds` of Newton's method it took.
    state : t, x, v where the section is, at the event `section`.
    events : kinds of the endings of its arcs, in order.
    """

    system: Oscillator
    period: float
    turns: int
    multipliers: NDArray[np.complex128]
    residual: float
    rounds: int
    section: str
    events: tuple[str, ...]
    closed: Return

    @property
    def stable(self) -> bool:
        """Whether small disturbances decay."""
        others = self.multipliers[0 if self.turns else 1 :]
        return bool((np.abs(others) < 1).all())

    @property
    def state(self) -> tuple[float, float, float]:
        """t, x, v at the section."""
        t, x, v = self.closed.trail.start[:3]
        return float(t), float(x), float(v)

    @property
    def sticks(self) -> bool:
        """Whether adhesion is a part of it."""
        return bool((self.closed.trail.arcs[:, :1] == 0).any())

    @cached_property
    def orbit(self) -> Orbit:
        """One period from the section on, as an orbit that is exact at any time.

        Of a forced system the phase of the forcing is moved so that the section lies at t = 0.
        """
        return one_period(self.closed, self.period)

    def __repr__(self) -> str:
        worst = np.abs(self.multipliers[0 if self.turns else 1 :]).max()
        kind = "stable" if self.stable else "unstable"
        return f"<PeriodicOrbit T = {self.period:.12g}, largest multiplier {worst:.6g}, {kind}>"


def one_period(closed: Return, period: float) -> Orbit:
    """The orbit of a closed turn, from its section on."""
    trail = closed.trail
    t0 = float(trail.start[_T])
    forcing = tuple(Harmonic(h.amplitude, h.frequency, h.phase + h.frequency * t0) for h in trail.system.harmonics)
    system = replace(trail.system, forcing=forcing or None)
    if not system.closed_form:
        v0 = None if trail.arcs[0, 0] == 0 else float(trail.start[_V])
        return simulate(system, period, x0=float(trail.start[_X]), v0=v0)
    followed = trail.follow()
    states = np.vstack([trail.start, followed.states])
    stuck, held = trail.arcs[:, 0] == 0, trail.arcs[:, 1] != 0
    slope = np.where(held, np.inf, np.where(stuck, 0.0, states[:-1, 4]))
    rows = np.column_stack(
        [
            states[:-1, _T] - t0,
            np.zeros(len(slope)),
            states[:-1, _X],
            states[:-1, _V],
            trail.arcs[:, 0],
            np.where(stuck | held, 0.0, states[:-1, 3]),
            slope,
            states[:-1, 13],
        ]
    )
    kinds = [_core.KINDS.index(kind) for kind in _kinds(trail)]
    missing = np.full(len(kinds), np.nan)
    force = system.stiffness * states[1:, _X] * missing
    sticking = np.where(stuck, closed.durations, np.nan)
    table = np.column_stack([states[1:, _T] - t0, kinds, states[1:, _X], states[1:, _V], force, sticking, missing])
    core = _core.Orbit.restore(
        system.to_json(),
        (float(trail.start[_X]), float(trail.start[_V]), period, 10_000_000),
        _core.STOPS.index("t_end"),
        (len(kinds), 0, 0),
        np.ascontiguousarray(rows.ravel()),
        np.ascontiguousarray(table.ravel()),
    )
    return Orbit(system, core)


def _kinds(trail: Trail) -> list[str]:
    """The kinds of the events that end the arcs."""
    following = np.vstack([trail.arcs[1:, :2], trail.last])
    kinds = []
    for (direction, _, ending, _), (after, held) in zip(trail.arcs, following, strict=True):
        name = _core.ENDINGS[int(ending)]
        if name == "release":
            kinds.append("release")
        elif held:
            kinds.append("hold")
        elif after == 0:
            kinds.append("capture")
        elif after != direction:
            kinds.append("crossing")
        else:
            kinds.append("node" if name in ("low", "high") else "reversal")
    return kinds


def _same(one: Floats, other: Floats) -> bool:
    """Whether two states are of one kind: branch, turns, released."""
    return bool((one[len(STATE) :] == other[len(STATE) :]).all())


def find(system: Oscillator, trail: Trail, kinds: list[str], settled: bool, periods: int | None) -> tuple[Trail, int]:
    """One period cut out of a run: between two returns that are nearly the same; and how many periods of the forcing."""
    wanted = next((kind for kind in ("capture", "crossing", "reversal") if kind in kinds[len(kinds) // 2 :]), None)
    if wanted is None:
        trail = trail.with_sections()
        marks = np.flatnonzero(trail.arcs[:, 2] == SECTION)
    else:
        marks = np.array([index for index, kind in enumerate(kinds) if kind == wanted])
    if len(marks) < 2:
        raise InputError(
            "periodic_orbit: the motion has no two returns: it comes to rest or slips steadily, or the run is too short; "
            "give a guess"
        )
    followed = trail.follow()
    states, arcs = followed.states, trail.arcs
    force = forcing_period(system)
    lanes = np.array([_X, _V])
    size = size_of(system, states[marks[-1]], lanes)

    def distance(a: int, b: int) -> tuple[float, int]:
        if (
            not _same(states[a], states[b])
            or (arcs[min(a + 1, len(arcs) - 1), :2] != arcs[min(b + 1, len(arcs) - 1), :2]).any()
        ):
            return math.inf, 0
        gap = float(np.abs((states[a][lanes] - states[b][lanes]) / size).max())
        if force is None:
            return gap, 0
        turns = (states[b, _T] - states[a, _T]) / force
        whole = max(1, round(turns))
        if periods is not None and whole != periods:
            return math.inf, 0
        return max(gap, abs(turns - whole) * force / (system.natural_period / (2 * math.pi))), whole

    # From the end of a settled run backwards, from the guess onwards otherwise.
    if settled:
        ends = [(int(a), int(marks[-1])) for a in marks[-2:-202:-1]]
    else:
        ends = [(int(a), int(b)) for i, a in enumerate(marks[:40]) for b in marks[i + 1 : i + 41]]
    pairs = []
    for a, b in ends:
        gap, turns = distance(a, b)
        pairs.append((gap, b - a, a, b, turns))
    for tolerance in (1e-7, 1e-5, 1e-3, 3e-2, 0.3):
        near = [pair for pair in pairs if pair[0] < tolerance]
        if near:
            _, _, a, b, turns = min(near, key=lambda pair: (pair[1], pair[0]))
            return _early(trail.part(followed, a, b), force), turns
    raise InputError(
        "periodic_orbit: no return comes near an earlier one: the motion is not periodic or not settled; "
        "simulate longer (t_end) or give a guess"
    )


def _early(trail: Trail, force: float | None) -> Trail:
    """The same in the first period of the forcing, where a change of its frequency moves the phase least."""
    start = trail.start.copy()
    start[_T] -= start[_T] if force is None else force * math.floor(start[_T] / force)
    start[_SINCE] = start[_T]
    return replace(trail, start=start)


def periodic_orbit(
    system: Oscillator, guess: Any = None, *, t_end: float | None = None, periods: int | None = None
) -> PeriodicOrbit:
    """A periodic orbit, stable or not, by Newton's method on its event sequence.

    The unknowns are the state at an event of the orbit (memory of the contact included), and at a forced system the phase;
    the derivative of the return map is that of the core, exact through every event.

    Parameters
    ----------
    system : an oscillator of one mass, autonomous or with harmonic forcing; any law without an internal state.
    guess : None: the motion that a long run from rest on the drive settles on; (x, v): a state near the orbit, for orbits
        that repel or lie apart; an :class:`~stickslip.Orbit` or a :class:`PeriodicOrbit`: its last state.
    t_end : length of the run that is looked at for a return; default 150 natural periods, 30 from a guess.
    periods : the number of periods of the forcing an orbit must take; default the first that returns.

    Returns
    -------
    PeriodicOrbit.

    Raises
    ------
    InputError
        where no return is near an earlier one, Newton's method does not converge, or what it converges to is not a motion
        of the system because the event sequence would be another.

    Source: shooting with saltation, Leine & Nijmeijer 2004 (LNACM 18), ch. 7; the orbit is exact, so is its derivative.

    >>> from stickslip.laws import DwellTime
    >>> cycle = periodic_orbit(Oscillator(damping=0.0, drive_velocity=0.3, law=DwellTime(0.5, 0.5, 0.4)))
    >>> round(cycle.period, 10), cycle.multipliers.real.round(12).tolist()
    (6.501489988, [1.0, 0.571676324821])
    """
    check(system, "periodic_orbit")
    if periods is not None and (isinstance(periods, bool) or not isinstance(periods, int) or periods < 1):
        raise InputError(f"periodic_orbit: periods must be a whole number of at least 1, got {periods!r}")
    x0, v0 = _start(guess)
    slowest = max(system.natural_period, forcing_period(system) or 0.0)
    length = number("t_end", t_end, "periodic_orbit") if t_end is not None else slowest * (150 if guess is None else 30)
    trail, kinds = _run(system, length, x0, v0, pieces=1 if guess is not None else 4)
    part, turns = find(system, trail, kinds, guess is None, periods)
    closed, rounds = close(part, turns)
    if periods is None:
        closed = _once(closed)
    cycle = finished(closed, rounds)
    if amplitude(cycle) < 1e-7 * size_of(system, cycle.closed.trail.start, np.array([_X]))[0]:
        raise InputError(
            "periodic_orbit: the motion comes to rest or slips steadily: no cycle here; give another guess"
        )
    return cycle


def _run(system: Oscillator, length: float, x0: float, v0: float | None, pieces: int) -> tuple[Trail, list[str]]:
    """The last piece of a run, half of it all, and the kinds of its events.

    Each piece starts from where following the one before it ended, so that what is followed is what was run: two orbits that
    rounding has set apart may part within a transient.
    """
    short = length / (pieces + 2) if pieces > 1 else length
    trail, kinds, stop = Trail.of_run(system, short, x0, v0)
    for piece in range(1, pieces):
        if stop != "t_end" or not kinds:
            break
        followed = trail.follow()
        phase = (float(trail.arcs[len(kinds), 0]), float(trail.arcs[len(kinds), 1]))
        onward = replace(trail, start=followed.states[len(kinds) - 1], arcs=np.array([[*phase, TIME, 1.0]]), last=phase)
        trail, kinds, stop = onward.onward(short if piece < pieces - 1 else 3 * short)
    if stop != "t_end":
        raise InputError(f"periodic_orbit: the run ended by {stop}; choose another start or another t_end")
    return trail, kinds


def amplitude(cycle: PeriodicOrbit) -> float:
    """Half the range of x, from 401 points of a period."""
    return float(np.ptp(cycle.orbit.at(np.linspace(0.0, cycle.orbit.t_end, 401))[0])) / 2


def finished(closed: Return, rounds: int) -> PeriodicOrbit:
    """A closed turn as a result, its consistency checked."""
    here = closed if len(closed.tests) else turn(closed.trail, closed.turns, tests=True)
    reason = inconsistency(here)
    if reason is not None:
        raise InputError(
            f"periodic_orbit: Newton's method closed an orbit the motion does not follow ({reason}): its event sequence "
            "is another; give another guess"
        )
    size = size_of(here.trail.system, here.trail.start, here.lanes)
    kinds = _kinds(here.trail)
    return PeriodicOrbit(
        system=here.trail.system,
        period=here.period,
        turns=here.turns,
        multipliers=multipliers_of(here),
        residual=float(np.abs(here.defect / size).max(initial=0.0)),
        rounds=rounds,
        section="turn of the slip velocity" if here.trail.arcs[-1, 2] == SECTION else kinds[-1],
        events=tuple(kinds),
        closed=here,
    )


def _start(guess: Any) -> tuple[float, float | None]:
    if guess is None:
        return 0.0, None
    if isinstance(guess, PeriodicOrbit):
        return guess.state[1], guess.state[2]
    if isinstance(guess, Orbit):
        x, v = guess.at(guess.t_end)
        return float(x), float(v)
    try:
        x, v = guess
    except (TypeError, ValueError):
        raise InputError(f"periodic_orbit: guess must be (x, v), an orbit or None, got {guess!r}") from None
    return number("guess x", x, "periodic_orbit"), number("guess v", v, "periodic_orbit")
