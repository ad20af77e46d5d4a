"""When what runs is to end: one limit of time for runs of the core, runs in Python and searches over many of them."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

from stickslip.errors import time_limit


class TimeIsUp(Exception):
    """The limit of time of a search is reached."""


@dataclass(frozen=True)
class TimeLimit:
    """A time on the clock, or none; by the clock of the day, which tasks on other machines have too.

    >>> TimeLimit().left is None, TimeLimit().passed, TimeLimit(0.0).passed
    (True, False, True)
    """

    until: float = math.inf

    @classmethod
    def after(cls, seconds: float | None, where: str) -> TimeLimit:
        """So many seconds > 0 from now on; none for no limit."""
        return cls() if time_limit(seconds, where) is None else cls(time.time() + (seconds or 0.0))

    @property
    def left(self) -> float | None:
        """The seconds that are left for a run, which must be some; None without a limit."""
        return None if self.until == math.inf else max(self.until - time.time(), 1e-9)

    @property
    def passed(self) -> bool:
        """Whether it is reached."""
        return time.time() >= self.until

    def keep(self, *_: int) -> None:
        """Nothing before the limit; from then on TimeIsUp. As what a search reports its progress to."""
        if self.passed:
            raise TimeIsUp


NO_LIMIT = TimeLimit()
