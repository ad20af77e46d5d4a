"""The Hopf points of steady slip over a parameter: where small disturbances of it begin to grow."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from stickslip.dynamics.equilibria.steady_slip import stability
from stickslip.dynamics.periodic.event_sequence import with_number
from stickslip.errors import InputError
from stickslip.model.system import Oscillator, System

#: In so many parts of a range changes of steady slip are looked for.
_SCAN = 400


def hopf_points(system: Oscillator | System, path: str, bounds: tuple[float, float]) -> list[tuple[str, float]]:
    """Where the damping of steady slip changes its sign over a parameter.

    Through zero it is a ``"hopf"`` point, by a jump at a corner of the law a ``"nonsmooth_hopf"`` point, also where the
    damping jumps to or from zero, as it does without damping at the ends of a level piece of the law.

    >>> from stickslip.laws import ExponentialStribeck
    >>> belt = Oscillator(0.1, 1.0, ExponentialStribeck(1.0, 0.5, 0.5))
    >>> [(kind, round(value, 12)) for kind, value in hopf_points(belt, "/drive_velocity", (0.1, 2.0))]
    [('hopf', 1.151292546497)]
    """
    return steady_changes(system, path, bounds)[0]


def steady_changes(
    system: Oscillator | System,
    path: str,
    bounds: tuple[float, float],
    keep: Callable[[], Any] = lambda: None,
) -> tuple[list[tuple[str, float]], list[tuple[float, float]]]:
    """The Hopf points of steady slip (:func:`hopf_points`), and the ranges of the parameter in which it is neutral.

    `keep` is called before each look at one value: what it raises ends the search.

    >>> from stickslip.laws import Coulomb
    >>> steady_changes(Oscillator(0.0, 1.0, Coulomb(0.5)), "/drive_velocity", (0.1, 2.0))
    ([], [(0.1, 2.0)])
    """

    def damping(value: float, exact: bool = False) -> float:
        keep()
        try:
            damping, neutral = stability(with_number(system, path, value))
        except InputError:
            return math.nan
        return 0.0 if neutral and not exact else damping

    values = np.linspace(*bounds, _SCAN + 1)
    samples = np.array([damping(float(value)) for value in values])
    signs = np.sign(samples)
    scale = np.abs(samples[np.isfinite(samples)]).max(initial=0.0)
    points: list[tuple[str, float]] = []
    neutral: list[tuple[float, float]] = []
    begin = bounds[0] if signs[0] == 0 else None
    for index in np.flatnonzero(np.isfinite(np.diff(signs)) & (np.diff(signs) != 0)):
        low, high = float(values[index]), float(values[index + 1])
        f_low, f_high = float(samples[index]), float(samples[index + 1])
        # A zero that is passed is found exactly; the end of a neutral range is where the damping is not zero any more.
        exact = f_low * f_high != 0
        for _ in range(200):
            # Bisection with the secant's guess: a jump converges as surely as a zero.
            guess = (low * f_high - high * f_low) / (f_high - f_low)
            for middle in (guess, (low + high) / 2):
                if not low < middle < high:
                    continue
                f = damping(middle, exact)
                if np.sign(f) == np.sign(f_low):
                    low, f_low = middle, f
                else:
                    high, f_high = middle, f
            if high - low <= 4e-16 * max(abs(low), abs(high)) or f_low == f_high:
                break
        small, large = sorted((abs(f_low), abs(f_high)))
        root = low if abs(f_low) < abs(f_high) else high
        if not exact and f_low == 0:
            neutral.append((bounds[0] if begin is None else begin, low))
            begin = None
        elif not exact:
            begin = high
        # Where the damping only fades away there is no speed at which it ends.
        if exact or large > 1e-9 * scale:
            points.append(("hopf" if exact and small < 1e-9 * scale else "nonsmooth_hopf", root))
    if begin is not None:
        last = np.flatnonzero(signs == 0)[-1]
        neutral.append((begin, float(values[last])))
    return points, neutral
