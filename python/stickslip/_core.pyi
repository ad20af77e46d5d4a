from typing import final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "BRANCHES",
    "KINDS",
    "Network",
    "Orbit",
    "__version__",
    "break_away",
    "check_law",
    "check_oscillator",
    "check_system",
    "force_along",
]

_Floats = NDArray[np.float64]
_Flags = NDArray[np.bool_]

__version__: str
KINDS: list[str]
BRANCHES: list[str]

@final
class Orbit:
    @staticmethod
    def simulate(document: str, x0: float, v0: float | None, t_end: float, max_events: int) -> Orbit: ...
    @staticmethod
    def restore(
        document: str,
        run: tuple[float, float | None, float, int],
        stop: int,
        work: tuple[int, int],
        segments: _Floats,
        events: _Floats,
    ) -> Orbit: ...
    def segments(self) -> _Floats: ...
    def events(self) -> _Floats: ...
    def states(self, times: _Floats) -> tuple[_Floats, _Floats, _Floats, _Floats, _Flags]: ...
    @property
    def run(self) -> tuple[float, float | None, float, int]: ...
    @property
    def t_last(self) -> float: ...
    @property
    def stop(self) -> tuple[int, str, str]: ...
    @property
    def work(self) -> tuple[int, int]: ...

_Start = tuple[list[float] | None, list[float] | None, float, int]

@final
class Network:
    @staticmethod
    def simulate(document: str, run: _Start) -> Network: ...
    @staticmethod
    def restore(
        document: str, run: _Start, stop: int, work: tuple[int, int], steps: _Floats, events: _Floats
    ) -> Network: ...
    def segments(self) -> _Floats: ...
    def events(self) -> _Floats: ...
    def states(self, times: _Floats) -> tuple[_Floats, _Floats, _Floats, _Floats, _Floats, _Flags]: ...
    @property
    def run(self) -> _Start: ...
    @property
    def t_last(self) -> float: ...
    @property
    def stop(self) -> tuple[int, str, str]: ...
    @property
    def work(self) -> tuple[int, int]: ...

def check_system(document: str) -> None: ...
def check_oscillator(document: str) -> None: ...
def check_law(document: str) -> None: ...
def break_away(document: str, stick_time: _Floats, force_rate: _Floats) -> _Floats: ...
def force_along(document: str, t: _Floats, w: _Floats, stuck: _Flags, force_rate: _Floats) -> _Floats: ...
