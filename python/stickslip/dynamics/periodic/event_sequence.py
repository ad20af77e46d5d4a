"""A motion held to its event sequence, and its derivatives: the core's sequences with names."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from stickslip import _core
from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.model.parameters import document_of, path_in
from stickslip.model.system import Oscillator, System

Modes = NDArray[np.int8]
Table = NDArray[np.void]

#: Damping so many times as fast as the masses swing leaves no phase short enough for the steps of derivatives.
_HEAVY = 1e5
#: What a contact adds to a state: the line of friction, what the contact remembers, how long it has stuck.
CONTACT = (
    *("offset", "slope", "low", "high"),
    *("anchor_w", "anchor_f", "corner_w", "corner_f", "released_at", "age"),
)
#: The state of one mass with one contact; three flags of each contact (branch, reverses, released) follow all numbers.
STATE = ("t", "x", "v", *CONTACT)
#: Test functions by their number in the core.
BOUNDARIES = tuple(_core.BOUNDARIES)
RELEASE, LOW, HIGH, FALLING, RISING, SECTION, TIME = range(len(_core.ENDINGS))
#: Of which phases derivatives are kept.
Keep = Literal["all", "last", "nothing"]
#: What a contact does: it sticks, slips or holds its slip velocity; negative in the other direction.
STICK, SLIP, HOLD = range(3)

_COLUMNS = ("mode", "ending", "contact", "duration")
_TEST = np.dtype(
    [("boundary", np.uint8), ("contact", np.uint32), ("phase", np.uint32)]
    + [(name, float) for name in ("tau", "detail", "value")],
    align=True,
)


@lru_cache(maxsize=64)
def _phase(contacts: int) -> np.dtype[np.void]:
    """A row of the table of phases."""
    columns = [("mode", np.int8, (contacts,)), ("ending", np.uint8), ("contact", np.uint32), ("duration", float)]
    return np.dtype(columns, align=True)


def _table(of: np.dtype[np.void], *columns: NDArray[Any]) -> Table:
    """A table from its columns."""
    table = np.empty(len(columns[-1]), of)
    for name, column in zip(of.names or (), columns, strict=True):
        table[name] = column.reshape(table[name].shape)
    return table


def one_phase(mode: Any, duration: float) -> Table:
    """The table of one phase that is ended by time."""
    return np.array([(mode, TIME, 0, duration)], _phase(len(mode)))


def check(system: Any, who: str) -> Any:
    """Refuse what this room cannot differentiate."""
    if not isinstance(system, Oscillator | System):
        raise InputError(f"{who}: expected an Oscillator or a System, got {type(system).__name__}")
    if not system.contacts:
        raise InputError(f"{who}: the system has no contact, so it has no events")
    if system.integrated:
        raise InputError(f"{who}: laws with an internal state have no events to follow; take a law of stickslip.laws")
    if isinstance(system, Oscillator) and not isinstance(system.drive_velocity, float):
        raise InputError(f"{who}: drive_velocity must be a number; write a shaken drive as a forcing (see Drive)")
    if system.springs:
        raise InputError(
            f"{who}: no derivative is known through springs that are not linear; put what is linear into stiffness, or "
            "look at section and orbit_diagram, which take them"
        )
    if isinstance(system, System) and not np.array_equal(system.damping, np.transpose(system.damping)):
        # No slow part is known of such a motion, and steps as short as the damping never come to the end of a phase.
        mass = np.array(system.mass)
        rates = [
            np.abs(np.linalg.solve(mass, np.array(of))).sum(axis=1).max() for of in (system.damping, system.stiffness)
        ]
        if rates[0] > _HEAVY * math.sqrt(rates[1]) > 0:
            raise InputError(
                f"{who}: no derivative is known under damping {rates[0] / math.sqrt(rates[1]):.1e} times as fast as the "
                "masses swing whose matrix is not symmetric; simulate, section and orbit_diagram take it"
            )
    return system


def check_one(system: Any, who: str) -> Oscillator:
    """Refuse what is not one mass on one drive, too."""
    if not isinstance(system, Oscillator):
        raise InputError(
            f"{who}: expected an Oscillator of one mass, got {type(system).__name__}; for several masses "
            "call periodic_orbit or simulate(…).regime() at each value"
        )
    checked: Oscillator = check(system, who)
    return checked


@dataclass(frozen=True)
class Layout:
    """Where the numbers of a state stand: t, positions, velocities, and those of every contact (:data:`CONTACT`)."""

    masses: int
    contacts: int

    @property
    def width(self) -> int:
        """How many numbers."""
        return 1 + 2 * self.masses + len(CONTACT) * self.contacts

    @cached_property
    def x(self) -> NDArray[np.int64]:
        """Of the positions."""
        return np.arange(1, 1 + self.masses)

    @cached_property
    def v(self) -> NDArray[np.int64]:
        """Of the velocities."""
        return self.x + self.masses

    def contact_coordinates(self, names: Sequence[str]) -> NDArray[np.int64]:
        """Of numbers of the contacts by name, shape (contacts, names)."""
        first = 1 + 2 * self.masses + len(CONTACT) * np.arange(self.contacts)
        return np.add.outer(first, [CONTACT.index(name) for name in names]).astype(np.int64)

    @cached_property
    def ages(self) -> NDArray[np.int64]:
        """Of the times of adhesion."""
        return self.contact_coordinates(["age"])[:, 0]

    @cached_property
    def speeds(self) -> NDArray[np.int64]:
        """Of the slip speeds of the contacts."""
        return self.contact_coordinates(["low", "high", "anchor_w", "corner_w"])

    @cached_property
    def forces(self) -> NDArray[np.int64]:
        """Of the forces of the contacts."""
        return self.contact_coordinates(["offset", "anchor_f", "corner_f", "released_at"])


_layout = lru_cache(maxsize=64)(Layout)


def layout_of(system: Any) -> Layout:
    """Of the states of a system."""
    return _layout(system.masses, len(system.contacts))


def as_list(value: Any) -> list[float] | None:
    """Positions or velocities for the core."""
    return None if value is None else np.atleast_1d(np.asarray(value, float)).tolist()


def pointer(system: Oscillator | System, name: str, who: str) -> str:
    """The place of a number in the core's document, such as ``/forcing/0/amplitude`` for ``"forcing.amplitude"``."""
    return "/" + path_in(name, document_of(system), who, starts=False).replace(".", "/")


def read(system: Oscillator | System, path: str) -> float:
    """The number at a place."""
    number = system.core.number(path)
    assert number is not None, path
    return number


def with_number(system: Any, path: str, value: float) -> Any:
    """The system with another number at a place."""
    return system.with_number(path[1:].replace("/", "."), value)


@dataclass(frozen=True)
class Followed:
    """A sequence followed.

    With w numbers a state, p ≥ 1 parameters and k of n derivatives kept the shapes are (n, w + flags), (k, w, w + p), (n,),
    (tests,), (tests, w + p).
    The columns of the test functions are ``boundary``, ``contact``, ``phase``, ``tau``, ``detail`` and ``value``.
    """

    states: Array
    rates: Array
    durations: Array
    tests: Table
    test_rates: Array


@dataclass(frozen=True)
class EventSequence:
    """A start, phases with what ends each of them, and what the contacts do after the last.

    Attributes
    ----------
    start : the numbers of a state (:class:`Layout`) and three flags of each contact.
    phases : a table with the columns ``mode`` (of every contact: 0 sticks, ± 1 slips in that direction, ± 2 holds its slip
        velocity of that sign), ``ending`` and ``contact`` (by what it ends, and at which), ``duration``; shape (n,).
    last : the modes after the last phase, shape (contacts,).
    """

    system: Any
    start: Array
    phases: Table
    last: Modes

    @property
    def layout(self) -> Layout:
        """Where the numbers of a state stand."""
        return layout_of(self.system)

    @property
    def modes(self) -> Modes:
        """What the contacts do, shape (n, contacts)."""
        return self.phases["mode"]

    @property
    def stuck(self) -> NDArray[np.bool_]:
        """Which contacts stick, shape (n, contacts)."""
        return np.asarray(self.modes == STICK)

    @property
    def held(self) -> NDArray[np.bool_]:
        """Which contacts hold their slip velocity, shape (n, contacts)."""
        return np.asarray(np.abs(self.modes) == HOLD)

    @property
    def endings(self) -> NDArray[np.uint8]:
        """What ends each phase, at whichever contact."""
        return self.phases["ending"]

    @property
    def durations(self) -> Array:
        """How long each phase lasts."""
        return self.phases["duration"]

    def lasting(self, durations: Any) -> EventSequence:
        """The same with phases of other durations."""
        phases = self.phases.copy()
        phases["duration"] = durations
        return replace(self, phases=phases)

    @classmethod
    def of_run(
        cls, system: Any, t_end: float, x0: Any = None, v0: Any = None, max_events: int = 100_000
    ) -> tuple[EventSequence, list[str], str]:
        """The sequence of a run, the kinds of its events and why it ended."""
        return cls._made(system, lambda core: _core.event_sequence(core, as_list(x0), as_list(v0), t_end, max_events))

    def continued(self, duration: float) -> tuple[EventSequence, list[str], str]:
        """What the real motion does from this start, for a duration."""
        modes = np.ascontiguousarray(self.modes[0])
        return self._made(
            self.system, lambda core: _core.event_sequence_from(core, self.start, modes, duration, 100_000)
        )

    def from_event(self, phase: int, duration: float) -> tuple[EventSequence, list[str], str]:
        """What the real motion does from the end of a phase on, for a duration."""
        states = self.follow(keep="nothing").states
        modes = self.modes[phase + 1] if phase + 1 < len(self.phases) else self.last
        start = EventSequence(self.system, states[phase], one_phase(modes, 1.0), modes)
        return start.continued(duration)

    @classmethod
    def _made(
        cls, system: Any, run: Callable[[_core.System], tuple[Array, Any, list[str], str]]
    ) -> tuple[EventSequence, list[str], str]:
        try:
            start, columns, kinds, stop = run(system.core)
        except ValueError as error:
            raise InputError(f"event sequence: {error}") from None
        phases = _table(_phase(layout_of(system).contacts), *columns)
        return cls(system, start, phases, phases["mode"][-1].copy()), kinds, stop

    def follow(
        self, *paths: str, keep: Keep = "all", tests: bool = False, origin: tuple[Any, Any] | None = None
    ) -> Followed:
        """States, derivatives (the last columns with respect to the numbers at `paths`, zero without) and test functions.

        `keep` says which derivatives: after ``"all"`` phases or the ``"last"``, each by the start; or ``"nothing"``, without
        test functions: those of one phase of 100 masses take 11 MB. `origin` is x and v of the run that begins at the start:
        the line of friction on which a slip begins then moves with the numbers at `paths`; else the start is held.
        """
        modes, endings, contacts, durations = (np.ascontiguousarray(self.phases[name].ravel()) for name in _COLUMNS)
        try:
            states, rates, durations, columns = _core.follow(
                self.system.core,
                list(paths),
                self.start,
                (modes, endings, contacts, durations),
                self.last,
                keep,
                tests,
                None if origin is None else (as_list(origin[0]), as_list(origin[1])),
            )
        except ValueError as error:
            raise InputError(f"event sequence: {error}") from None
        n, width = len(self.phases), self.layout.width
        boundaries, contacts, within, numbers = columns
        columns_of_one = width + max(1, len(paths))
        numbers = numbers.reshape(len(boundaries), 3 + columns_of_one)
        functions = _table(_TEST, boundaries, contacts, within, *numbers[:, :3].T)
        return Followed(
            states.reshape(n, -1), rates.reshape(-1, width, columns_of_one), durations, functions, numbers[:, 3:]
        )

    def part(self, followed: Followed, first: int, last: int) -> EventSequence:
        """From the end of phase `first` to the end of phase `last`."""
        after = self.modes[last + 1] if last + 1 < len(self.phases) else self.modes[last]
        return EventSequence(
            self.system, followed.states[first].copy(), self.phases[first + 1 : last + 1].copy(), after.copy()
        )

    def cut(self, durations: Sequence[Sequence[float]], ending: int) -> EventSequence:
        """Every phase in parts of these durations; all but the last of them end by `ending`."""
        counts = [len(parts) for parts in durations]
        phases = np.repeat(self.phases, counts)
        phases["duration"] = np.concatenate([*durations, []])
        inner = np.delete(np.arange(len(phases)), np.cumsum(counts) - 1)
        phases["ending"][inner], phases["contact"][inner] = ending, 0
        return replace(self, phases=phases)

    def with_sections(self) -> EventSequence:
        """The same with a phase ended at every greatest slip speed of contact 0 inside a phase."""
        # A peak where a phase begins is not inside it: the cuts of one pass lie in the middle of the pieces of the other.
        times = np.sort(np.concatenate([self._peaks(shifted=False), self._peaks(shifted=True)]))
        times = times[np.append(True, np.diff(times) > 1e-6 * self.system.natural_period)[: len(times)]]
        ends = np.cumsum(self.durations)
        durations: list[list[float]] = []
        for begin, end in zip(np.concatenate([[0.0], ends[:-1]]), ends, strict=True):
            inside = times[(times > begin) & (times < end)]
            durations.append(np.diff([begin, *inside, end]).tolist())
        return self.cut(durations, SECTION)

    def _peaks(self, *, shifted: bool) -> Array:
        """When the slip speed of contact 0 is greatest inside a phase, from the start."""
        chopped = self._chopped(3.0 * self.system.natural_period / (2 * np.pi), shifted=shifted)
        tests = chopped.follow(tests=True).tests
        begins = np.concatenate([[0.0], np.cumsum(chopped.durations)])
        # At a peak the high end is named first, at a trough the low one.
        first = np.append(True, (np.diff(tests["phase"]) != 0) | (np.diff(tests["tau"]) != 0))[: len(tests)]
        high = (tests["boundary"] == BOUNDARIES.index("high")) & (tests["contact"] == 0)
        peaks = tests[first & high]
        return np.asarray(begins[peaks["phase"]] + peaks["tau"], float)

    def _chopped(self, longest: float, *, shifted: bool) -> EventSequence:
        """Phases in equal pieces; shifted: the first and the last are halves."""
        counts = np.maximum(1, np.ceil(self.durations / longest)).astype(int)
        shares = [np.r_[0.5, np.ones(count - 1), 0.5] if shifted else np.ones(count) for count in counts]
        durations = [(d / n * share).tolist() for d, n, share in zip(self.durations, counts, shares, strict=True)]
        return self.cut(durations, TIME)
