"""A motion held to its event sequence, and its derivatives: the core's sequences with names."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stickslip import _core
from stickslip.errors import InputError
from stickslip.laws.state_law import StateLaw
from stickslip.model.parameters import document_of, path_in, varied
from stickslip.model.system import Oscillator, System

Floats = NDArray[np.float64]

#: What a contact adds to a state: the line of friction, what the contact remembers, how long it has stuck.
CONTACT = (
    *("offset", "slope", "low", "high"),
    *("anchor_w", "anchor_f", "corner_w", "corner_f", "released_at", "age"),
)
#: The state of one mass with one contact, and how many flags of a contact follow all numbers of a state.
STATE = ("t", "x", "v", *CONTACT)
FLAGS = 3
#: Test functions by their number in the core, and the columns before their derivatives.
BOUNDARIES = tuple(_core.BOUNDARIES)
_HEAD = 5
RELEASE, LOW, HIGH, FALLING, RISING, SECTION, TIME = range(len(_core.ENDINGS))


def check(system: Any, who: str) -> Any:
    """Refuse what this room cannot differentiate."""
    if not isinstance(system, Oscillator | System):
        raise InputError(f"{who}: expected an Oscillator or a System, got {type(system).__name__}")
    contacts = system.contacts if isinstance(system, System) else [system]
    if not contacts:
        raise InputError(f"{who}: the system has no contact, so it has no events")
    for contact in contacts:
        if isinstance(contact.law, StateLaw):
            raise InputError(
                f"{who}: laws with an internal state have no events to follow; take a law of stickslip.laws"
            )
    if isinstance(system, Oscillator) and not isinstance(system.drive_velocity, float):
        raise InputError(f"{who}: drive_velocity must be a number; write a shaken drive as a forcing (see Drive)")
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
    return _layout(system.masses, len(system.contacts)) if isinstance(system, System) else _layout(1, 1)


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
    if "/" not in path[1:]:
        return system.with_number(path[1:], value)
    return varied(document_of(system), [path[1:].replace("/", ".")], [float(value)])[0]


@dataclass(frozen=True)
class Followed:
    """A sequence followed.

    With w numbers a state and p ≥ 1 parameters the shapes are (n, w + flags), (n, w, w + p), (n,) and (tests, w + p + 5).
    """

    states: Floats
    rates: Floats
    durations: Floats
    tests: Floats


@dataclass(frozen=True)
class EventSequence:
    """A start, phases with what ends each of them, and what the contacts do after the last.

    Attributes
    ----------
    start : the numbers of a state (:class:`Layout`) and three flags of each contact.
    phases : rows (direction of slip or 0 while stuck, whether the speed is held) of every contact, ending, duration; that of
        contact c is 7 c more. Shape (n, 2 contacts + 2).
    last : direction and hold of every contact after the last phase.
    """

    system: Any
    start: Floats
    phases: Floats
    last: Floats

    @property
    def layout(self) -> Layout:
        """Where the numbers of a state stand."""
        return layout_of(self.system)

    @property
    def modes(self) -> Floats:
        """What the contacts do, (direction, hold) of each, shape (n, 2 contacts)."""
        return self.phases[:, :-2]

    @property
    def directions(self) -> Floats:
        """The directions of slip, 0 while stuck, shape (n, contacts)."""
        return self.phases[:, :-2:2]

    @property
    def endings(self) -> NDArray[np.int64]:
        """What ends each phase, at whichever contact."""
        return self.phases[:, -2].astype(np.int64) % len(_core.ENDINGS)

    @property
    def ended_by(self) -> NDArray[np.int64]:
        """The contact at which each phase ends."""
        return self.phases[:, -2].astype(np.int64) // len(_core.ENDINGS)

    @classmethod
    def of_run(
        cls, system: Any, t_end: float, x0: Any = None, v0: Any = None, max_events: int = 100_000
    ) -> tuple[EventSequence, list[str], str]:
        """The sequence of a run, the kinds of its events and why it ended."""
        return cls._made(system, lambda core: _core.event_sequence(core, as_list(x0), as_list(v0), t_end, max_events))

    def continued(self, duration: float, max_events: int = 100_000) -> tuple[EventSequence, list[str], str]:
        """What the real motion does from this start, for a duration."""
        modes = np.ascontiguousarray(self.modes[0])
        return self._made(
            self.system, lambda core: _core.event_sequence_from(core, self.start, modes, duration, max_events)
        )

    def from_event(
        self, phase: int, duration: float, followed: Followed | None = None, max_events: int = 100_000
    ) -> tuple[EventSequence, list[str], str]:
        """What the real motion does from the end of a phase on, for a duration."""
        states = (followed or self.follow()).states
        modes = self.modes[phase + 1] if phase + 1 < len(self.phases) else self.last
        start = EventSequence(self.system, states[phase], np.array([[*modes, TIME, 1.0]]), modes)
        return start.continued(duration, max_events)

    @classmethod
    def _made(
        cls, system: Any, run: Callable[[_core.System], tuple[Floats, Floats, list[str], str]]
    ) -> tuple[EventSequence, list[str], str]:
        try:
            start, phases, kinds, stop = run(system.core)
        except ValueError as error:
            raise InputError(f"event sequence: {error}") from None
        rows = phases.reshape(-1, 2 * layout_of(system).contacts + 2)
        return cls(system, start, rows, rows[-1, :-2].copy()), kinds, stop

    def follow(self, *paths: str, reseed: bool = False, tests: bool = False) -> Followed:
        """States, derivatives (the last columns with respect to the numbers at `paths`, zero without) and test functions.

        With `reseed` the derivatives are those of each phase alone.
        """
        phases, last = np.ascontiguousarray(self.phases.ravel()), np.ascontiguousarray(self.last)
        try:
            states, rates, durations, boundaries = _core.follow(
                self.system.core, list(paths), self.start, phases, last, reseed, tests
            )
        except ValueError as error:
            raise InputError(f"event sequence: {error}") from None
        n, width = len(self.phases), self.layout.width
        return Followed(
            states.reshape(n, -1),
            rates.reshape(n, width, -1),
            durations,
            boundaries.reshape(-1, _HEAD + width + max(1, len(paths))),
        )

    def part(self, followed: Followed, first: int, last: int) -> EventSequence:
        """From the end of phase `first` to the end of phase `last`."""
        after = self.modes[last + 1] if last + 1 < len(self.phases) else self.modes[last]
        return EventSequence(
            self.system, followed.states[first].copy(), self.phases[first + 1 : last + 1].copy(), after.copy()
        )

    def cut(self, durations: Sequence[Sequence[float]], endings: Sequence[Sequence[float]]) -> EventSequence:
        """Every phase in parts, with their durations and what ends them (the last as it was)."""
        rows = [
            [*phase[:-2], ending, duration]
            for phase, times, ends in zip(self.phases, durations, endings, strict=True)
            for duration, ending in zip(times, [*ends, phase[-2]], strict=True)
        ]
        return replace(self, phases=np.array(rows))

    def with_sections(self) -> EventSequence:
        """The same with a phase ended at every greatest slip speed of contact 0 inside a phase."""
        # A peak where a phase begins is not inside it: the cuts of one pass lie in the middle of the pieces of the other.
        times = np.sort(np.concatenate([self._peaks(shifted=False), self._peaks(shifted=True)]))
        times = times[np.append(True, np.diff(times) > 1e-6 * self.system.natural_period)[: len(times)]]
        ends = np.cumsum(self.phases[:, -1])
        durations: list[list[float]] = []
        for begin, end in zip(np.concatenate([[0.0], ends[:-1]]), ends, strict=True):
            inside = times[(times > begin) & (times < end)]
            durations.append(np.diff([begin, *inside, end]).tolist())
        return self.cut(durations, [[float(SECTION)] * (len(parts) - 1) for parts in durations])

    def _peaks(self, *, shifted: bool) -> Floats:
        """When the slip speed of contact 0 is greatest inside a phase, from the start."""
        chopped = self._chopped(3.0 * self.system.natural_period / (2 * np.pi), shifted=shifted)
        tests = chopped.follow(tests=True).tests
        begins = np.concatenate([[0.0], np.cumsum(chopped.phases[:, -1])])
        # At a peak the high end is named first, at a trough the low one.
        first = (
            np.append(True, (np.diff(tests[:, :3], axis=0)[:, 1:] != 0).any(axis=1))
            if len(tests)
            else np.zeros(0, bool)
        )
        peaks = tests[first & (tests[:, 0] == BOUNDARIES.index("high"))]
        return np.asarray(begins[peaks[:, 1].astype(int)] + peaks[:, 2], float)

    def _chopped(self, longest: float, *, shifted: bool) -> EventSequence:
        """Phases in equal pieces; shifted: the first and the last are halves."""
        counts = np.maximum(1, np.ceil(self.phases[:, -1] / longest)).astype(int)
        shares = [np.r_[0.5, np.ones(count - 1), 0.5] if shifted else np.ones(count) for count in counts]
        durations = [(d / n * share).tolist() for d, n, share in zip(self.phases[:, -1], counts, shares, strict=True)]
        return self.cut(durations, [[float(TIME)] * (len(parts) - 1) for parts in durations])
