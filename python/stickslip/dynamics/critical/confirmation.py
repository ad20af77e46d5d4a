"""What plain runs show at a drive velocity, and whether two of them show different kinds of motion."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stickslip.model.system import Oscillator
from stickslip.simulation.simulate import simulate

#: A stick of less than this share of a natural period is none, a motion of less than this share of v/ω steady slip.
_NO_STICK, _STEADY = 1e-6, 1e-9
#: The last tenth of a run is looked at, and for the trend the tenth that ends at this share of it.
_WINDOW, _BEFORE = 0.1, 0.6
#: By which factor two runs differ in size, in the number of their events or in stick time to be of different kinds.
_SIZE, _COUNT, _STICK = 1.1, 1.1, 1.5


@dataclass(frozen=True)
class Shown:
    """The end of a run.

    Attributes
    ----------
    speed : the drive velocity.
    stop : why it ended.
    size : half the range of x in the last tenth, and `size_before` some time earlier; `growth` its logarithmic rate between.
    stick_time : mean duration of the sticks in the last tenth, 0 without any, and `stick_before` some time earlier.
    events : captures, crossings and holds in the last tenth, those of a natural period.
    short : whether its sticks are hardly longer than what counts as one.
    end : x and v, of a motion that sticks at the last capture, as nothing before that is remembered.
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
    end: tuple[float, float]

    @property
    def sticks(self) -> bool:
        """Whether adhesion is a part of the motion that lasts: its sticks do not become ever shorter."""
        return self.stick_time > 0.9 * self.stick_before and self.stick_time > 0

    @property
    def lasts(self) -> bool:
        """Whether there is a motion that does not die away."""
        return self.stop == "t_end" and 0 < 0.9 * self.size_before < self.size

    @property
    def decided(self) -> bool:
        """Whether the run was long enough to tell sticks that last from those that fade."""
        return not 0.8 < self.stick_time / max(self.stick_before, 1e-300) < 0.97

    def differs(self, other: Shown) -> bool:
        """Whether the two are motions of different kinds, as far as runs tell."""

        def apart(a: float, b: float, factor: float) -> bool:
            return max(a, b) > factor * min(a, b)

        return (
            self.stop != other.stop
            or apart(self.size, other.size, _SIZE)
            or apart(self.stick_time, other.stick_time, _STICK)
            or apart(self.events, other.events, _COUNT)
        )


def shown(
    system: Oscillator,
    cycles: float,
    x0: float | None = None,
    v0: float | None = None,
    *,
    max_seconds: float | None = None,
) -> Shown:
    """The end of a run over a number of natural periods, and of 30 loadings of the spring; default start: rest.

    >>> from stickslip.laws import StaticKinetic
    >>> shown(Oscillator(0.0, 0.2, StaticKinetic(1.0, 0.6)), 50).stick_time
    4.0
    """
    speed = abs(system.drive_velocity)
    loading = 2 * system.law.break_away_force() / (system.stiffness * speed)
    period = system.natural_period
    t_end = cycles * period + min(cycles, 30) * loading
    orbit = simulate(system, t_end, x0, v0, int(100 * cycles), max_seconds)
    least = _STEADY * speed * period
    table = orbit.events
    times, sticks = table["t"].to_numpy(), table["stick_time"].to_numpy()
    # Whole arrays from here on: asking the table itself takes longer than the run.
    kinds = np.asarray(table["kind"], str)
    count = int(40 * np.clip(_WINDOW * t_end / period, 1, 50))
    sizes: list[float] = []
    means: list[float] = []
    counts: list[float] = []
    for end in (_BEFORE * orbit.t_end, orbit.t_end):
        begin = end - _WINDOW * t_end
        x = orbit.at(np.linspace(max(begin, 0.0), end, count))[0]
        sizes.append(float(np.ptp(x)) / 2)
        late = (times > begin) & (times <= end)
        held = sticks[late & (kinds == "release")]
        held = held[held > _NO_STICK * period]
        means.append(float(held.mean()) if held.size else 0.0)
        counts.append(float((late & np.isin(kinds, ("capture", "crossing", "hold"))).sum()) if held.size else 0.0)
    sizes = [size if size > least else 0.0 for size in sizes]
    captures = times[(kinds == "capture") & (times > orbit.t_end - _WINDOW * t_end)]
    last = orbit.at(captures[-1] if captures.size else orbit.t_end)
    short = 0 < means[1] < 2 * _NO_STICK * period
    return Shown(
        system.drive_velocity,
        orbit.stop,
        sizes[1],
        sizes[0],
        math.log(sizes[1] / sizes[0]) / ((1 - _BEFORE) * t_end) if all(sizes) else -math.inf,
        means[1],
        means[0],
        counts[1] * period / (_WINDOW * t_end),
        short,
        last,
    )
