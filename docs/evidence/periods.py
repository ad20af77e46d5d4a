"""Periods that orbit diagrams give, against an integrator of their own; writes docs/evidence/periods.md.

    python docs/evidence/periods.py [--count N] [--first SEED]

A mass on a spring, shaken and rubbed by a belt under static and kinetic friction: x″ + d x′ + x = u cos Ωt + F, with
F = ± f_k while it slips and |F| ≤ f_s while it sticks. Each column of a diagram goes on from where `stickslip.orbit_diagram`
left it, by the formulas below, which share no line with the core.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import stickslip as ss

PAGE = Path(__file__).with_suffix(".md")
COUNT, COLUMNS = 48, 9
#: Forcing periods that the columns are followed for, and returns of them that are looked at.
FOLLOWED, LOOKED_AT = 1000, 512
#: Returns repeat to this part of their extent: the bound of `orbit_diagram`.
TOLERANCE = 1e-6
#: A guard so small is that of a mode which begins.
BEGINS = 1e-12
Array = np.ndarray[Any, np.dtype[np.float64]]
State = tuple[float, float, float]


class Belt:
    """A forced belt: x″ + d x′ + x = u cos Ωt + F at the speed s, with a closed form between events."""

    def __init__(
        self, damping: float, speed: float, static: float, kinetic: float, amplitude: float, frequency: float
    ) -> None:
        self.damping, self.speed, self.static, self.kinetic = damping, speed, static, kinetic
        self.amplitude, self.frequency = amplitude, frequency
        # The answer to the forcing is a cos Ωt + b sin Ωt.
        detuned, lossy = 1 - frequency**2, damping * frequency
        size = amplitude / (detuned**2 + lossy**2)
        self.a, self.b = size * detuned, size * lossy
        self.own = math.sqrt(1 - damping**2 / 4)

    def forced(self, mode: int, t: float) -> tuple[float, float]:
        """The answer to the forcing and to kinetic friction: position and velocity."""
        c, s = math.cos(self.frequency * t), math.sin(self.frequency * t)
        return self.a * c + self.b * s + mode * self.kinetic, self.frequency * (self.b * c - self.a * s)

    def at(self, mode: int, begin: State, t: float) -> tuple[float, float]:
        """Position and velocity at t of a motion that sticks (mode 0) or slips (sign of w) from the state (t, x, v) on."""
        t0, x0, v0 = begin
        if mode == 0:
            return x0 + self.speed * (t - t0), self.speed
        p0, q0 = self.forced(mode, t0)
        p, q = self.forced(mode, t)
        y, z, half = x0 - p0, v0 - q0, self.damping / 2
        phase, decay = self.own * (t - t0), math.exp(-half * (t - t0))
        c, s = math.cos(phase), math.sin(phase)
        return (
            p + decay * (y * c + (z + half * y) / self.own * s),
            q + decay * (z * c - (y + half * z) / self.own * s),
        )

    def needed(self, t: float, x: float, v: float) -> float:
        """The friction force that keeps the velocity as it is."""
        return x + self.damping * v - self.amplitude * math.cos(self.frequency * t)

    def guard(self, mode: int, begin: State, t: float) -> float:
        """What is positive as long as a mode lasts."""
        x, v = self.at(mode, begin, t)
        return mode * (self.speed - v) if mode else self.static - abs(self.needed(t, x, v))

    def rate(self, mode: int, begin: State, t: float) -> float:
        """The rate of the guard."""
        x, v = self.at(mode, begin, t)
        force = self.needed(t, x, v)
        if mode:
            return mode * force - self.kinetic
        rate = v + self.amplitude * self.frequency * math.sin(self.frequency * t)
        return -math.copysign(1.0, force) * rate

    def mode_at_rest(self, t: float, x: float) -> int:
        """What follows where the slip velocity is 0."""
        force = self.needed(t, x, self.speed)
        return 0 if abs(force) <= self.static else int(math.copysign(1, force))

    def returns(self, x: float, v: float, periods: int, keep: int) -> Array:
        """Positions and velocities at the last `keep` whole periods, shape (2, keep); a velocity that is no number sticks."""
        v = self.speed if math.isnan(v) else v
        mode = self.mode_at_rest(0.0, x) if v == self.speed else int(math.copysign(1, self.speed - v))
        begin = (0.0, x, v)
        span = 2 * math.pi / self.frequency
        # A sixteenth of each of the two swings.
        steps = math.ceil(16 * max(1.0, span / (2 * math.pi)))
        kept = []
        for period in range(periods):
            t = 0.0
            for step in range(1, steps + 1):
                end = span * step / steps
                while (event := self.event(mode, begin, t, end)) is not None:
                    x, v = self.at(mode, begin, event)
                    # A stick ends by slip in the direction of its force.
                    mode = self.mode_at_rest(event, x) if mode else int(math.copysign(1, self.needed(event, x, v)))
                    t, begin = event, (event, x, self.speed)
                t = end
            x, v = self.at(mode, begin, span)
            # Each period counts its own time, so that a long run loses no digits.
            begin = (0.0, x, v)
            if period >= periods - keep:
                kept.append((x, v))
        return np.array(kept).T

    def event(self, mode: int, begin: State, t: float, end: float) -> float | None:
        """When the mode ends between two times less than a sixteenth of a swing apart, or none."""
        low, high = t, end
        ends = self.guard(mode, begin, end) <= 0
        if self.guard(mode, begin, t) <= BEGINS:
            # Slip begins with its guard at 0, which rises first.
            if not ends:
                return None
            low = turn(lambda time: self.rate(mode, begin, time) < 0, t, end)
        elif not ends:
            # A guard that falls and rises again has its least value between.
            if self.rate(mode, begin, t) >= 0 or self.rate(mode, begin, end) <= 0:
                return None
            high = turn(lambda time: self.rate(mode, begin, time) > 0, t, end)
            if self.guard(mode, begin, high) > 0:
                return None
        return turn(lambda time: self.guard(mode, begin, time) <= 0, low, high)


def turn(holds: Callable[[float], bool], low: float, high: float) -> float:
    """From when on a condition holds, by 50 halvings."""
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high


def drawn(seed: int) -> tuple[ss.Oscillator, Array]:
    """A random belt and the amplitudes of its forcing."""
    rng = np.random.default_rng(seed)
    kinetic = rng.uniform(0.3, 1.0)
    static = kinetic + (rng.uniform(0.0, 0.8) if seed % 4 else 0.0)
    damping = 0.0 if rng.random() < 0.3 else 10 ** rng.uniform(-2.5, -0.5)
    speed = 0.0 if rng.random() < 0.25 else rng.uniform(0.05, 1.0)
    frequency = rng.uniform(0.3, 2.5)
    law = ss.laws.StaticKinetic(static, kinetic)
    system = ss.Oscillator(damping, speed, law, forcing=ss.Harmonic(0.1, frequency))
    return system, np.sort(rng.uniform(0.05, 2.5, COLUMNS))


def belt(system: ss.Oscillator, amplitude: float) -> Belt:
    """The system at one amplitude, for the formulas above."""
    law = system.law
    return Belt(system.damping, system.drive_velocity, law.break_away, law.kinetic, amplitude, system.forcing.frequency)


def period_of(returns: Array, extent: float) -> int:
    """After how many returns, of shape (2, n), a motion of this extent repeats; 0 if not within half of them.

    A shorter period that the distances shrink towards is the one that is meant.
    """
    half = returns.shape[1] // 2

    def apart(lag: int) -> Array:
        return np.asarray(np.abs(returns[:, lag:] - returns[:, :-lag]).max(axis=0) / extent)

    period = next((lag for lag in range(1, half) if apart(lag)[-half:].max() < TOLERANCE), 0)
    for part in range(1, period):
        gaps = apart(part)
        if period % part == 0 and gaps[-period:].max() < 0.9 * gaps[:period].max():
            return part
    return period


class Column(NamedTuple):
    """A column of a diagram: the word and the period that it gives, and the period that the formulas above give."""

    seed: int
    amplitude: float
    word: str
    period: int
    judged: int


def columns(seed: int) -> list[Column]:
    """The columns of one random belt."""
    system, amplitudes = drawn(seed)
    diagram = ss.orbit_diagram(system, "forcing.amplitude", amplitudes, decide=500, workers=1)
    found = []
    for index, amplitude in enumerate(amplitudes.tolist()):
        one = diagram.isel({"forcing.amplitude": index})
        returns = belt(system, amplitude).returns(float(one["x_end"]), float(one["v_end"]), FOLLOWED, LOOKED_AT)
        judged = period_of(returns, float(one["x_max"] - one["x_min"]) or 1.0)
        found.append(Column(seed, amplitude, str(one["recurrence"].item()), int(one["period"]), judged))
    return found


def page(found: list[Column]) -> str:
    """The page: a row for each word."""
    lines = [
        "# Periods of orbit diagrams",
        "",
        f"{len(found)} forced belts under static and kinetic friction ({len({one.seed for one in found})} random systems, a",
        "quarter without a belt, three in ten without damping). Each goes on from where `orbit_diagram` left it, for",
        f"{FOLLOWED} periods of the forcing, by an integrator that shares no line with the core. Another period: where it",
        "comes to repeat after another number of periods than was given.",
        "Written by `python docs/evidence/periods.py`.",
        "",
        "| word | columns | the same period | another period |",
        "|---|---|---|---|",
    ]
    for word in ("periodic", "rests", "not_repeating", "chaotic", "undecided"):
        group = [one for one in found if one.word == word]
        same = sum(one.period == one.judged for one in group)
        lines.append(f"| {word} | {len(group)} | {same} | {len(group) - same} |")
    lines += ["", "| seed | amplitude | word | given | after 1000 periods more |", "|---|---|---|---|---|"]
    lines += [
        f"| {one.seed} | {one.amplitude:.6g} | {one.word} | {one.period} | {one.judged} |"
        for one in found
        if one.period != one.judged
    ]
    lines += [
        "",
        "Undecided are motions that settle slowly, as without damping or where it is weak: the word gives no period.",
        "A motion that is `not_repeating` does not repeat within 250 periods; later it may.",
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """The page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=COUNT)
    options = parser.parse_args()
    found = [one for seed in range(options.first, options.first + options.count) for one in columns(seed)]
    PAGE.write_text(page(found), encoding="utf-8")


if __name__ == "__main__":
    main()
