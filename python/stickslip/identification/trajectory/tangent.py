"""How the motion of a law moves with its numbers, through all events: the core's derivatives along a held event sequence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from stickslip.dynamics.periodic.event_sequence import STATE, TIME, EventSequence
from stickslip.errors import InputError
from stickslip.files.arrays import Array, Indices
from stickslip.laws import Law
from stickslip.laws.numbers import pointers
from stickslip.laws.state_law import StateLaw
from stickslip.simulation.orbit import Orbit

KNOTS = 16
"""Knots in a natural period; between them a derivative is the cubic through its values and slopes, good to 10⁻⁴ of itself."""
FEWEST_KNOTS = 6
"""Knots in every phase: the short ones, such as a steep climb, are the quick ones."""
BESIDE = 1e-7
"""A knot lies on either side of each event, that part of a natural period away, as the derivative of v jumps there."""


def why_differences(kind: type[Law]) -> str | None:
    """Why the slopes of a law's motion are differences of orbits, None where they come from the core's derivatives.

    >>> from stickslip.laws import LuGre, StaticKinetic
    >>> why_differences(StaticKinetic), why_differences(LuGre)
    (None, 'a law with an internal state has no events to follow')
    """
    if issubclass(kind, StateLaw):
        return "a law with an internal state has no events to follow"
    if kind.SMOOTH:
        return "along a smooth law a derivative of the core takes five times as long as the two orbits of a difference"
    return None


class Tangent:
    """The event sequence of an orbit with knots in a window of time, and what numbers of the law do to it there.

    Derivatives are those at a fixed time after the motion passes a position: at a fixed time τ after the passage at c,

        dx(c + τ)/dp = ∂x/∂p − v · ∂x(c)/∂p / v(c).

    What a change of the period has added up until c drops out at the knots already: interpolated first, it would leave an
    error of 10⁻⁴ of a part that is a hundred times what remains.

    Parameters
    ----------
    orbit : of an oscillator of one mass whose law has no inner state.
    start : position and velocity at t = 0, the velocity None on the drive.
    window : first and last time at which derivatives are asked for.
    passage : the time c inside the window; None for derivatives at fixed time.
    """

    def __init__(
        self,
        orbit: Orbit,
        start: tuple[float, float | None],
        window: tuple[float, float],
        passage: float | None = None,
    ) -> None:
        system = orbit.system
        sequence, _, _ = EventSequence.of_run(system, orbit.t_end, *start)
        self._pointers, self._start = pointers(system.law), start
        period = system.natural_period
        self._sequence, self._knots, self.times = _with_knots(
            sequence, window, period / KNOTS, BESIDE * period, passage
        )
        self._passage = None if passage is None else int(np.argmin(np.abs(self.times - passage)))
        if passage is not None:
            motion = orbit.to_xarray(self.times)
            self._v, self._a = (motion[name].to_numpy()[:, None] for name in ("v", "a"))

    def by(self, names: Sequence[str]) -> dict[str, CubicHermiteSpline]:
        """The derivatives of x by numbers of the law, as functions of time inside the window.

        A number is left out by which the motion has no derivative.
        """
        try:
            paths = ("/law/" + "/".join(map(str, self._pointers[name])) for name in names)
            followed = self._sequence.follow(*paths, origin=self._start)
        except InputError:
            # One of them has none: which?
            return {} if len(names) < 2 else {name: by for one in names for name, by in self.by([one]).items()}
        x, v = (followed.rates[self._knots, STATE.index(of), -len(names) :] for of in ("x", "v"))
        if self._passage is not None:
            late = x[self._passage] / self._v[self._passage]
            x, v = x - self._v * late, v - self._a * late
        smooth = np.all(np.isfinite(x + v), axis=0).tolist()
        return {name: CubicHermiteSpline(self.times, x[:, j], v[:, j]) for j, name in enumerate(names) if smooth[j]}


def _with_knots(
    sequence: EventSequence, window: tuple[float, float], spacing: float, beside: float, passage: float | None
) -> tuple[EventSequence, Indices, Array]:
    """The sequence with phases cut at knots, the phases that end at one, and the times of these; a knot lies at `passage`."""
    low, high = window
    durations: list[list[float]] = []
    knots: list[int] = []
    times: list[float] = []
    begin, count = 0.0, 0
    for end in np.cumsum(sequence.durations).tolist():
        first, last = max(begin + beside, low), min(end - beside, high)
        fewest = max(FEWEST_KNOTS, 2 + int((last - first) / spacing))
        inside = np.linspace(first, last, fewest).tolist() if last > first else []
        if passage is not None and inside and begin <= passage < end:
            inside = np.unique([*inside, np.clip(passage, first, last)]).tolist()
        knots += range(count, count + len(inside))
        times += inside
        durations.append(np.diff([begin, *inside, end]).tolist())
        begin, count = end, count + len(inside) + 1
    return sequence.cut(durations, TIME), np.array(knots, int), np.array(times)
