"""Other solvers on the same problems.

A peer is a module with ``NAME``, ``SETTINGS`` (label -> what ``run`` takes) and ``run(problem, end, setting)``, which returns
the times of all events from 0 to the end; a fast one says in ``LONG`` how much longer a run has to be to be timed, and one
that knows its own time has ``seconds(problem, end, setting)``.
"""

from __future__ import annotations

import time
from types import ModuleType
from typing import Any

from problems import Problem


def timed(peer: ModuleType, problem: Problem, end: float, setting: Any) -> float:
    """Seconds of one run."""
    if hasattr(peer, "seconds"):
        return peer.seconds(problem, end, setting)
    begin = time.perf_counter()
    peer.run(problem, end, setting)
    return time.perf_counter() - begin
