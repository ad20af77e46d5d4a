from collections.abc import Callable
from typing import Any, Protocol, final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "ALIKE",
    "BOUNDARIES",
    "BRANCHES",
    "ENDINGS",
    "KINDS",
    "LEAST_ERROR",
    "REGIMES",
    "RESTART",
    "STOPS",
    "Halt",
    "Law",
    "Orbit",
    "Samples",
    "StateLaw",
    "StateSystem",
    "System",
    "__version__",
    "batch",
    "blurred",
    "displacement_errors",
    "event_sequence",
    "event_sequence_from",
    "follow",
    "halted",
    "law_facts",
    "lyapunov",
    "regime_of_stop",
    "section",
    "slip_evidence",
    "spot_centre",
    "spot_levels",
    "spot_near",
    "static_friction",
    "sweep",
    "without",
]

_Floats = NDArray[np.float64]
_Flags = NDArray[np.bool_]
_Columns = dict[str, NDArray[Any]]

__version__: str
KINDS: list[str]
STOPS: list[str]
BRANCHES: list[str]
REGIMES: list[str]
RESTART: int
BOUNDARIES: list[str]
ENDINGS: list[str]

_Start = tuple[list[float] | None, list[float] | None, float, int]

@final
class System:
    def __new__(cls, document: str) -> System: ...
    def number(self, path: str) -> float | None: ...
    def with_number(self, path: str, value: float) -> System: ...
    def resonates(self) -> bool: ...

@final
class Orbit:
    @staticmethod
    def simulate(system: System, run: _Start, max_seconds: float | None) -> Orbit: ...
    @staticmethod
    def resume(system: System, state: _Floats, contact_modes: _Modes, duration: float) -> Orbit: ...
    @staticmethod
    def restore(
        system: System,
        run: _Start,
        stop: int,
        work: tuple[int, int, int, int],
        segments: _Floats,
        events: _Floats,
    ) -> Orbit: ...
    def segments(self) -> _Floats: ...
    def events(self) -> _Floats: ...
    def states(self, times: _Floats) -> tuple[_Floats, _Floats, _Floats, _Floats, _Floats, _Flags]: ...
    def steady(self, look: str, period: float, surface: str) -> _Columns: ...
    def section(self, surface: str, contact: int, after: float, most: int) -> tuple[_Floats, str]: ...
    @property
    def run(self) -> _Start: ...
    @property
    def t_last(self) -> float: ...
    @property
    def stop(self) -> tuple[int, str, str]: ...
    @property
    def work(self) -> tuple[int, int, int, int]: ...

def batch(
    document: str,
    names: list[str],
    values: _Floats,
    run: tuple[float, float, int],
    section: str | None,
    keep: int,
    workers: int,
    max_seconds: float | None,
    progress: Callable[[int, int], object] | None,
) -> _Columns: ...
def halted() -> bool: ...

@final
class Halt:
    def __new__(cls) -> Halt: ...
    def heed(self) -> None: ...
    def set(self) -> None: ...

@final
class Samples:
    def __new__(cls, columns: list[_Floats], stuck: _Flags, events: int) -> Samples: ...
    def steady(self, look: str, period: float, surface: str) -> _Columns: ...
    def section(self, surface: str, contact: int, after: float, most: int) -> tuple[_Floats, str]: ...

@final
class Law:
    def __new__(cls, document: str) -> Law: ...
    def with_numbers(self, numbers: list[tuple[str, float]]) -> Law: ...
    def break_away(self, stick_time: _Floats, force_rate: _Floats) -> _Floats: ...
    def force_along(self, t: _Floats, w: _Floats, stuck: _Flags, force_rate: _Floats) -> _Floats: ...

@final
class StateLaw:
    def __new__(cls, document: str) -> StateLaw: ...
    @property
    def has_state(self) -> bool: ...
    @property
    def states(self) -> int: ...
    def rates(self, w: _Floats, z: _Floats) -> tuple[_Floats, _Floats]: ...
    def steady(self, w: _Floats) -> _Floats: ...
    def follow(self, t: _Floats, w: _Floats, z: _Floats) -> tuple[_Floats, _Floats]: ...

@final
class StateSystem:
    def __new__(cls, document: str) -> StateSystem: ...
    def start(self, x: _Floats, v: list[float] | None) -> tuple[_Floats, _Floats]: ...
    def rates(self, t: float, y: _Floats) -> _Floats: ...
    @property
    def is_massless(self) -> bool: ...
    @property
    def natural_period(self) -> float: ...
    def balanced(self, y: _Floats) -> _Floats: ...
    @property
    def is_steep(self) -> bool: ...
    def regular(self, y: _Floats) -> list[_Floats]: ...
    def regular_rates(self, t: float, regular: _Floats, least: float) -> _Floats: ...
    def natural(self, regular: _Floats) -> _Floats: ...
    def slopes(self, t: _Floats, y: _Floats) -> _Floats: ...
    def states(self, t: _Floats, y: _Floats) -> list[_Floats]: ...

def law_facts() -> str: ...

ALIKE: float
LEAST_ERROR: float
_Picture = NDArray[np.uint8]
_Spot = tuple[float, float, float, float, float, float, float, float, int, bool, bool]
_Known = tuple[float | None, float | None, float | None]

class _Like(Protocol):
    @property
    def size(self) -> float: ...
    @property
    def contrast(self) -> float: ...
    @property
    def score(self) -> float: ...

def blurred(picture: _Picture, sigma: float) -> _Picture: ...
def spot_centre(
    picture: _Picture, work: _Picture, part: tuple[float, int, int, int, int, int], known: _Known
) -> _Spot | None: ...
def spot_levels(
    picture: _Picture, heights: list[float], areas: tuple[float, float]
) -> list[list[tuple[int, int, int, int, int, int]]]: ...
def spot_near(
    picture: _Picture, work: _Picture, like: _Like, position: tuple[float, float], known: _Known
) -> _Spot | None: ...
def slip_evidence(
    samples: tuple[_Floats, _Floats, _Floats],
    model: tuple[tuple[float, float, float, float], tuple[float, float, float], tuple[float, float]],
    pieces: _Floats,
    limits: tuple[float, float, float],
    joined: str,
    soft: bool,
) -> tuple[float, float, float] | None: ...
def static_friction(
    growth: tuple[float, float, float],
    force_rate_scale: float | None,
    fall: tuple[float, float, float],
    stick_time: _Floats,
    force_rate: _Floats,
) -> _Floats: ...
def displacement_errors(
    oscillator: tuple[float, float, float, float],
    difference: _Floats,
    slope: _Floats,
    carried: _Floats | None,
    lengths: tuple[int, ...],
) -> _Floats: ...
def without(motions: _Floats, residual: _Floats, prior: list[float], lengths: tuple[int, ...]) -> _Floats: ...
def regime_of_stop(stop: str, enough: bool) -> str | None: ...
def section(
    system: System,
    surface: str,
    run: _Start,
    contact: int,
    after: float,
    most: int,
    max_seconds: float | None,
) -> tuple[_Floats, str]: ...
def sweep(
    document: str,
    names: list[str],
    values: _Floats,
    look: str,
    chain: bool,
    start: tuple[list[float], list[float], list[float]] | None,
    before: tuple[list[float], int, float] | None,
    max_seconds: float | None,
) -> _Columns: ...

_Modes = NDArray[np.int8]
_Tests = tuple[NDArray[np.uint8], NDArray[np.uint32], NDArray[np.uint32], _Floats]
_Phases = tuple[_Modes, NDArray[np.uint8], NDArray[np.uint32], _Floats]
_EventSequence = tuple[_Floats, _Phases, list[str], str]

def event_sequence(
    system: System, x0: list[float] | None, v0: list[float] | None, t_end: float, max_events: int
) -> _EventSequence: ...
def event_sequence_from(
    system: System, state: _Floats, contact_modes: _Modes, duration: float, max_events: int
) -> _EventSequence: ...
def follow(
    system: System,
    paths: list[str],
    state: _Floats,
    phases: _Phases,
    last: _Modes,
    keep: str,
    tests: bool,
    origin: tuple[list[float] | None, list[float] | None] | None,
) -> tuple[_Floats, _Floats, _Floats, _Tests]: ...
def lyapunov(
    system: System,
    x0: list[float] | None,
    v0: list[float] | None,
    t_end: float,
    max_events: int,
    transient: float,
    seed: int,
) -> tuple[_Floats, _Floats, int, bool]: ...
