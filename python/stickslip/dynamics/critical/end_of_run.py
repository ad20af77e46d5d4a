"""What plain runs show at a drive velocity, and whether two of them show different kinds of motion."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from stickslip.dynamics.scales import drive_of, reach, slowest_period
from stickslip.model.system import Oscillator, System
from stickslip.simulation.simulate import simulate

#: A stick of less than this share of a natural period is none, a motion of less than this share of v/ω steady slip.
_NO_STICK, _STEADY = 1e-6, 1e-9
#: The last tenth of a run is looked at, and for the trend the tenth that ends at this share of it.
_WINDOW, _BEFORE = 0.1, 0.6
#: Several masses whose slip is neutral stick now and then, ever less: below this share of the time that is no stick-slip.
_LEAST_SHARE = 1e-4
#: A motion repeats, as far as two windows of it tell, where its size and mean stick time differ by no more.
_REPEATS = 1e-3
#: Motions at one speed are the same where these differ by no more.
_RESEMBLES = 1e-2
#: By which factor two runs differ in size, in the number of their events or in stick time to be of different kinds.
_SIZE, _COUNT, _STICK = 1.1, 1.1, 1.5


@dataclass(frozen=True)
class EndOfRun:
    """The end of a run.

    Attributes
    ----------
    speed : the drive velocity.
    stop : why it ended.
    size : half the range of x in the last tenth, of several masses the largest, and `size_before` some time earlier;
        `growth` its logarithmic rate between.
    stick_time : mean duration of the sticks in the last tenth, 0 without any, and `stick_before` some time earlier.
    events : captures, crossings and holds in the last tenth, those of a natural period.
    short : whether its sticks are hardly longer than what counts as one.
    end : x and v, of a motion that sticks at the last capture, as nothing before that is remembered.
    several : whether there are several masses, whose motion may never repeat.
    stuck, stuck_before : the share of the time that a contact sticks, the mean of all of them, then and before.
    """

    speed: float
    stop: str
    size: float
    size_before: float
    growth: float
    stick_time: float
    stick_before: float
    events: float
    short: bool
    end: tuple[Any, Any]
    several: bool = False
    stuck: float = 0.0
    stuck_before: float = 0.0

    def start_at(self, speed: float) -> tuple[Any, Any]:
        """Where it ended, as the start of a run at another drive velocity: what is stuck goes with the drive there too."""
        x, v = self.end
        return x, np.where(np.asarray(v) == self.speed, speed, v)[()]

    @property
    def sticks(self) -> bool:
        """Whether adhesion is a part of the motion that lasts: its sticks do not become ever shorter."""
        if self.several:
            return bool(self.stuck > max(0.5 * self.stuck_before, _LEAST_SHARE))
        return self.stick_time > 0.9 * self.stick_before and self.stick_time > 0

    @property
    def lasts(self) -> bool:
        """Whether there is a motion that does not die away."""
        return self.stop == "t_end" and 0 < (0.5 if self.several else 0.9) * self.size_before < self.size

    @property
    def decided(self) -> bool:
        """Whether the run was long enough to tell sticks that last from those that fade."""
        return self.several or not 0.8 < self.stick_time / max(self.stick_before, 1e-300) < 0.97

    @property
    def repeats(self) -> bool:
        """Whether two windows are so alike that the motion may be taken to repeat."""
        pairs = ((self.size, self.size_before), (self.stick_time, self.stick_before))
        return all(abs(late - early) <= _REPEATS * late for late, early in pairs)

    def resembles(self, other: EndOfRun) -> bool:
        """Whether the two may be one motion, as those must be taken for that do not repeat."""
        if not (self.repeats and other.repeats):
            return True
        pairs = ((self.size, other.size), (self.stick_time, other.stick_time))
        return all(abs(one - two) <= _RESEMBLES * max(one, two) for one, two in pairs)

    def differs(self, other: EndOfRun) -> bool:
        """Whether the two are motions of different kinds, as far as runs tell.

        Windows of one motion of several masses that does not repeat differ in all that is counted and measured.
        """
        if (self.several or other.several) and (self.sticks or other.sticks) and not (self.repeats and other.repeats):
            return self.stop != other.stop or self.sticks != other.sticks or self.lasts != other.lasts

        def apart(a: float, b: float, factor: float) -> bool:
            return max(a, b) > factor * min(a, b)

        return (
            self.stop != other.stop
            or apart(self.size, other.size, _SIZE)
            or apart(self.stick_time, other.stick_time, _STICK)
            or apart(self.events, other.events, _COUNT)
        )


def end_of_run(
    system: Oscillator | System,
    cycles: float,
    x0: ArrayLike | None = None,
    v0: ArrayLike | None = None,
    *,
    max_seconds: float | None = None,
) -> EndOfRun:
    """The end of a run over a number of natural periods, and of 30 loadings of the spring; default start: :func:`rest`.

    Of several masses it is the slowest natural period that counts.

    >>> from stickslip.laws import StaticKinetic
    >>> end_of_run(Oscillator(0.0, 0.2, StaticKinetic(1.0, 0.6)), 50).stick_time
    4.0
    """
    masses, contacts = system.masses, len(system.contacts)
    several = isinstance(system, System)
    if several and x0 is None:
        x0 = rest(system)
    speed, period = drive_of(system), system.natural_period
    slowest = slowest_period(system)
    t_end = cycles * slowest + min(cycles, 30) * 2 * reach(system).max() / speed
    orbit = simulate(system, t_end, x0, v0, int(100 * cycles * masses * slowest / period), max_seconds)
    least = _STEADY * speed * period
    table = orbit.events
    times, sticks = table["t"].to_numpy(), table["stick_time"].to_numpy()
    # Whole arrays from here on: asking the table itself takes longer than the run.
    kinds = np.asarray(table["kind"], str)
    count = int(40 * np.clip(_WINDOW * t_end / period, 1, 50))
    sizes: list[float] = []
    means: list[float] = []
    counts: list[float] = []
    shares: list[float] = []
    for end in (_BEFORE * orbit.t_end, orbit.t_end):
        begin = end - _WINDOW * t_end
        x = orbit.at(np.linspace(max(begin, 0.0), end, count))[0]
        sizes.append(float(np.ptp(x, axis=0).max()) / 2)
        late = (times > begin) & (times <= end)
        held = sticks[late & (kinds == "release")]
        held = held[held > _NO_STICK * period]
        means.append(float(held.mean()) if held.size else 0.0)
        shares.append(float(held.sum()) / (_WINDOW * t_end * contacts))
        counts.append(float((late & np.isin(kinds, ("capture", "crossing", "hold"))).sum()) if held.size else 0.0)
    sizes = [size if size > least else 0.0 for size in sizes]
    captures = times[(kinds == "capture") & (times > orbit.t_end - _WINDOW * t_end)]
    last = orbit.at(captures[-1] if captures.size else orbit.t_end)
    short = 0 < means[1] < 2 * _NO_STICK * period
    return EndOfRun(
        speed,
        orbit.stop,
        sizes[1],
        sizes[0],
        math.log(sizes[1] / sizes[0]) / ((1 - _BEFORE) * t_end) if all(sizes) else -math.inf,
        means[1],
        means[0],
        counts[1] * period / (_WINDOW * t_end),
        short,
        last,
        several,
        shares[1],
        shares[0],
    )


def rest(system: Oscillator | System, share: float = 0.1) -> Any:
    """Where masses start on the drive: one at 0, several apart by a share of their reach, as equal ones stay alike."""
    if isinstance(system, Oscillator):
        return 0.0
    # Spread evenly, whatever the number of masses.
    return share * reach(system).max() * (np.arange(system.masses) * (5**0.5 - 1) / 2 % 1.0)
