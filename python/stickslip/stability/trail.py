"""A motion held to its event sequence, and its derivatives: the core's trails with names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stickslip import _core
from stickslip.errors import InputError
from stickslip.parameters import document_of, path_in, varied
from stickslip.state_laws import StateLaw
from stickslip.system import Oscillator

Floats = NDArray[np.float64]

#: What a state is made of: time, position, velocity; the line of friction; what the contact remembers; when it stuck.
STATE = (
    *("t", "x", "v", "offset", "slope", "low", "high"),
    *("anchor_w", "anchor_f", "corner_w", "corner_f", "released_at", "stuck_since"),
)
#: Where the flag stands that the law follows the sense of the slip acceleration.
TURNS = len(STATE) + 1
#: Test functions by their number in the core, and the derivative columns behind their values.
BORDERS = ("low", "high", "entry", "crossing", "stick", "arrival")
_HEAD = 5
RELEASE, LOW, HIGH, FALLING, RISING, SECTION, TIME = range(len(_core.ENDINGS))


def check(system: Any, who: str) -> Oscillator:
    """Refuse what this room cannot differentiate."""
    if not isinstance(system, Oscillator):
        raise InputError(f"{who}: expected an Oscillator of one mass, got {type(system).__name__}")
    if isinstance(system.law, StateLaw):
        raise InputError(f"{who}: laws with an internal state have no events to follow; take a law of stickslip.laws")
    if not isinstance(system.drive_velocity, float):
        raise InputError(f"{who}: drive_velocity must be a number; write a shaken drive as a forcing (see Drive)")
    return system


def pointer(system: Oscillator, name: str, who: str) -> str:
    """The place of a number in the core's document, such as ``/forcing/0/amplitude`` for ``"forcing.amplitude"``."""
    return "/" + path_in(name, document_of(system), who, starts=False).replace(".", "/")


def read(system: Oscillator, path: str) -> float:
    """The number at a place."""
    place: Any = document_of(system)
    for key in path[1:].split("/"):
        place = place[int(key)] if isinstance(place, list) else place[key]
    return float(place)


def with_number(system: Oscillator, path: str, value: float) -> Oscillator:
    """The system with another number at a place."""
    if "/" not in path[1:]:
        # The law, which is checked anew when it is made, stays as it is.
        changes: Any = {path[1:]: float(value)}
        return replace(system, **changes)
    changed: Oscillator = varied(document_of(system), [path[1:].replace("/", ".")], [float(value)])[0]
    return changed


@lru_cache(maxsize=8)
def _document(system: Oscillator) -> str:
    """What the core reads; Newton's method asks for it again and again."""
    return system.to_json()


@dataclass(frozen=True)
class Followed:
    """What following a trail gave: shapes (arcs, 16), (arcs, 13, 14), (arcs,), (tests, 19)."""

    states: Floats
    rates: Floats
    durations: Floats
    tests: Floats


@dataclass(frozen=True)
class Trail:
    """A start, arcs with what ends each of them, and what the contact does after the last.

    Attributes
    ----------
    start : 13 numbers (:data:`STATE`) and three flags of the law.
    arcs : rows (direction of slip or 0 while stuck, whether the speed is held, ending, duration), shape (n, 4).
    last : direction and hold after the last arc.
    """

    system: Oscillator
    start: Floats
    arcs: Floats
    last: tuple[float, float]

    @classmethod
    def of_run(
        cls, system: Oscillator, t_end: float, x0: float = 0.0, v0: float | None = None, max_events: int = 100_000
    ) -> tuple[Trail, list[str], str]:
        """The trail of a run, the kinds of its events and why it ended."""
        try:
            start, arcs, kinds, stop = _core.trail(_document(system), x0, v0, t_end, max_events)
        except ValueError as error:
            raise InputError(f"trail: {error}") from None
        rows = arcs.reshape(-1, 4)
        return cls(system, start, rows, (rows[-1, 0], rows[-1, 1])), kinds, stop

    def onward(self, duration: float, max_events: int = 100_000) -> tuple[Trail, list[str], str]:
        """What the real motion does from this start, for a duration."""
        phase = (float(self.arcs[0, 0]), float(self.arcs[0, 1]))
        try:
            start, arcs, kinds, stop = _core.trail_from(_document(self.system), self.start, phase, duration, max_events)
        except ValueError as error:
            raise InputError(f"trail: {error}") from None
        rows = arcs.reshape(-1, 4)
        return Trail(self.system, start, rows, (rows[-1, 0], rows[-1, 1])), kinds, stop

    def follow(self, path: str | None = None, *, reseed: bool = False, tests: bool = False) -> Followed:
        """States, derivatives (the last column with respect to the number at `path`) and test functions.

        With `reseed` the derivatives are those of each arc alone.
        """
        arcs = np.ascontiguousarray(self.arcs.ravel())
        try:
            states, rates, durations, borders = _core.follow(
                _document(self.system), path, self.start, arcs, self.last, reseed, tests
            )
        except ValueError as error:
            raise InputError(f"trail: {error}") from None
        n = len(self.arcs)
        return Followed(
            states.reshape(n, -1), rates.reshape(n, len(STATE), -1), durations, borders.reshape(-1, _HEAD + 14)
        )

    def part(self, followed: Followed, first: int, last: int) -> Trail:
        """From the end of arc `first` to the end of arc `last`."""
        after = self.arcs[last + 1, :2] if last + 1 < len(self.arcs) else self.arcs[last, :2]
        arcs = self.arcs[first + 1 : last + 1]
        return Trail(self.system, followed.states[first].copy(), arcs.copy(), (float(after[0]), float(after[1])))

    def with_sections(self) -> Trail:
        """The same with an arc ended at every greatest slip speed inside an arc."""
        chopped = self._chopped(3.0 * self.system.natural_period / (2 * np.pi))
        tests = chopped.follow(tests=True).tests
        begins = np.concatenate([[0.0], np.cumsum(chopped.arcs[:, 3])])
        # At a peak the high end is named first, at a trough the low one.
        first = np.append(True, (np.diff(tests[:, 1:3], axis=0) != 0).any(axis=1)) if len(tests) else np.zeros(0, bool)
        peaks = tests[first & (tests[:, 0] == BORDERS.index("high"))]
        times = np.sort(begins[peaks[:, 1].astype(int)] + peaks[:, 2])
        rows: list[Sequence[float]] = []
        begin = 0.0
        for direction, hold, ending, duration in self.arcs:
            end = begin + duration
            for time in times[(times > begin) & (times < end)]:
                rows.append((direction, hold, SECTION, time - begin))
                begin = time
            rows.append((direction, hold, ending, end - begin))
            begin = end
        return replace(self, arcs=np.array(rows))

    def _chopped(self, longest: float) -> Trail:
        rows: list[Sequence[float]] = []
        for direction, hold, ending, duration in self.arcs:
            count = max(1, int(np.ceil(duration / longest)))
            rows += [(direction, hold, TIME, duration / count)] * (count - 1)
            rows.append((direction, hold, ending, duration / count))
        return replace(self, arcs=np.array(rows))
