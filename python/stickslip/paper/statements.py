"""What the paper states about its system, as data, and how much of it our model shows.

Each statement is a fact of the paper in our words. Whether a model shows it is measured by simulation and scored
``reproduced``, ``partly`` or ``not reproduced``. `basis` says what stands behind a success: ``calibrated`` (a free
number was chosen so that this comes out), ``built in`` (our reading of the law says so by construction) or ``follows``
(nothing was chosen for it).
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stickslip.analysis import sign_changes, steady_motion
from stickslip.paper import END_OF_OSCILLATION, END_OF_STICK_SLIP
from stickslip.paper import oscillator as paper_oscillator
from stickslip.simulation import simulate
from stickslip.system import Harmonic, Oscillator

if TYPE_CHECKING:
    import pandas as pd

    from stickslip.orbit import Orbit

#: An oscillator from a drive velocity and a forcing.
Make = Callable[[float, Harmonic | None], Oscillator]

REPRODUCED, PARTLY, NOT = "reproduced", "partly", "not reproduced"

#: Drive velocities of the almost-harmonic range that are looked at.
ALMOST_HARMONIC = tuple(round(0.26 + 0.01 * i, 2) for i in range(14))

#: Forcing amplitudes that are tried, as the paper does not state its u₀.
FORCING_AMPLITUDES = tuple(round(0.005 * i, 3) for i in range(1, 41))


class Seen(NamedTuple):
    """A verdict, its main number and a sentence with all numbers."""

    verdict: str
    value: float
    sentence: str


@dataclass(frozen=True)
class Statement:
    """A statement of the paper: where it stands, what it says, how it is measured and when it counts as reproduced."""

    id: str
    section: str
    sentence: str
    measured: str
    threshold: str
    basis: str
    look: Callable[[Study], Seen] = field(repr=False)


class Forced(NamedTuple):
    """A forced motion: forcing amplitude, stroboscopic period (0: none), maxima of x per forcing period, sticks."""

    amplitude: float
    period: int
    loops: float
    sticks: int


class Study:
    """The simulations that the statements look at, each done once.

    Parameters
    ----------
    make : the oscillator at a drive velocity and a forcing.
    periods : natural periods of a run; the last tenth of it is looked at.
    tolerance : width to which thresholds of the drive velocity are bisected.
    forcing_periods : transient of forced runs; 128 more are looked at.
    workers : threads for the forced runs.
    """

    def __init__(self, make: Make, periods: int, tolerance: float, forcing_periods: int, workers: int) -> None:
        self.make, self.periods, self.tolerance = make, periods, tolerance
        self.forcing_periods, self.workers = forcing_periods, workers
        self._motions: dict[tuple[float, float | None, float | None], dict[str, Any]] = {}
        self._forced: dict[tuple[float, float], list[Forced]] = {}

    def motion(self, s: float, x0: float | None = None, v0: float | None = None) -> dict[str, Any]:
        """The steady motion at one drive velocity from one start."""
        key = (s, x0, v0)
        if key not in self._motions:
            system = self.make(s, None)
            orbit = simulate(system, self.periods * system.natural_period, x0=x0, v0=v0)
            self._motions[key] = steady_motion(orbit, 0.1)
        return self._motions[key]

    def last(self, regimes: tuple[str, ...], x0: float | None = None, v0: float | None = None) -> float | None:
        """The drive velocity up to which the motion is of `regimes`; None where there is none or no end of it."""
        grid = np.linspace(0.05, 0.60, 12)
        there = [self.motion(float(s), x0, v0)["regime"] in regimes for s in grid]
        if not any(there) or there[-1]:
            return None
        i = int(np.flatnonzero(there)[-1])
        low, high = float(grid[i]), float(grid[i + 1])
        while high - low > self.tolerance:
            middle = (low + high) / 2
            low, high = (middle, high) if self.motion(middle, x0, v0)["regime"] in regimes else (low, middle)
        return (low + high) / 2

    @cached_property
    def end_of_stick_slip(self) -> float | None:
        """From the stuck start."""
        return self.last(("stick_slip",))

    @cached_property
    def end_of_oscillation(self) -> float | None:
        """From the stuck start."""
        return self.last(("stick_slip", "almost_harmonic", "back_and_forth"))

    @cached_property
    def almost_harmonic(self) -> list[tuple[float, dict[str, Any]]]:
        """Those drive velocities of the almost-harmonic range at which the motion is almost-harmonic."""
        pairs = [(s, self.motion(s)) for s in ALMOST_HARMONIC]
        return [(s, motion) for s, motion in pairs if motion["regime"] == "almost_harmonic"]

    def column(self, name: str) -> NDArray[np.float64]:
        """A number of the almost-harmonic motions, in the order of s."""
        return np.array([motion[name] for _, motion in self.almost_harmonic], dtype=float)

    @cached_property
    def loops(self) -> list[tuple[float, NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]]:
        """(s, w, friction, whether ẇ > 0) over the last two loops of the almost-harmonic motions."""
        found = []
        for s, _ in self.almost_harmonic:
            system = self.make(s, None)
            period = system.natural_period
            orbit = simulate(system, self.periods * period)
            motion = orbit.to_xarray(np.linspace(orbit.t_end - 3 * period, orbit.t_end, 6001))
            w, force, a = (motion[name].to_numpy() for name in ("slip_velocity", "force", "a"))
            found.append((s, w, force, a < 0))
        return found

    def forced(self, s: float, frequency: float) -> list[Forced]:
        """Forced motions over the forcing amplitudes."""
        key = (s, frequency)
        if key not in self._forced:
            with ThreadPoolExecutor(self.workers) as pool:
                short = pool.map(lambda u0: self._force(s, frequency, u0, self.forcing_periods), FORCING_AMPLITUDES)
                self._forced[key] = list(short)
        return self._forced[key]

    def non_periodic(self, s: float, frequency: float) -> list[float]:
        """Forcing amplitudes of a motion without a period that never sticks, also in a run five times as long."""
        candidates = [m.amplitude for m in self.forced(s, frequency) if m.period == 0 and not m.sticks]
        with ThreadPoolExecutor(self.workers) as pool:
            longer = list(pool.map(lambda u0: self._force(s, frequency, u0, 5 * self.forcing_periods), candidates))
        return [motion.amplitude for motion in longer if motion.period == 0 and not motion.sticks]

    def _force(self, s: float, frequency: float, amplitude: float, transient: int) -> Forced:
        """Periods and loops over 128 forcing periods after `transient`, sticks from the usual transient on."""
        system = self.make(s, Harmonic(amplitude, frequency))
        period, count = 2 * np.pi / frequency, 128
        start = transient * period
        orbit = simulate(system, (transient + count) * period)
        x, v = orbit.at(np.minimum(start + period * np.arange(count + 1), orbit.t_end))
        returns = (p for p in range(1, 33) if max(np.abs(x[p:] - x[:-p]).max(), np.abs(v[p:] - v[:-p]).max()) < 1e-6)
        turns = sign_changes(lambda t: orbit.at(t)[1], np.linspace(start, orbit.t_end, 100 * count))
        events = orbit.events
        sticks = int(((events["kind"] == "capture") & (events["t"] > self.forcing_periods * period)).sum())
        # Every second turning point is a maximum.
        return Forced(amplitude, next(returns, 0), round(turns.size / 2 / count, 2), sticks)


def _listed(values: list[float], digits: int = 3) -> str:
    """A few of the values, and how many there are."""
    texts = [f"{value:.{digits}f}" for value in values]
    return ", ".join(texts) if len(texts) <= 5 else f"{texts[0]} … {texts[-1]} ({len(texts)} values)"


def _relaxation(study: Study) -> Seen:
    values = (0.05, 0.10, 0.15, 0.20)
    there = [s for s in values if study.motion(s)["regime"] == "stick_slip"]
    verdict = REPRODUCED if len(there) == len(values) else PARTLY if there else NOT
    return Seen(verdict, float(len(there)), f"stick-slip at {len(there)} of {len(values)} drive velocities up to 0.20")


def _threshold(found: float | None, stated: float, what: str) -> Seen:
    if found is None:
        return Seen(NOT, np.nan, f"no {what} between s = 0.05 and 0.60")
    off = abs(found - stated)
    verdict = REPRODUCED if off <= 0.005 else PARTLY if off <= 0.03 else NOT
    return Seen(verdict, found, f"{what} at s = {found:.4f}")


def _end_of_stick_slip(study: Study) -> Seen:
    return _threshold(study.end_of_stick_slip, END_OF_STICK_SLIP, "end of stick-slip")


def _end_of_oscillation(study: Study) -> Seen:
    return _threshold(study.end_of_oscillation, END_OF_OSCILLATION, "end of the limit cycle")


def _needs_range(look: Callable[[Study], Seen]) -> Callable[[Study], Seen]:
    """A look at the almost-harmonic range, which needs one."""

    def guarded(study: Study) -> Seen:
        if len(study.almost_harmonic) < 3:
            return Seen(
                NOT, np.nan, f"almost-harmonic at {len(study.almost_harmonic)} of {len(ALMOST_HARMONIC)} values of s"
            )
        return look(study)

    return guarded


@_needs_range
def _keeps_slipping(study: Study) -> Seen:
    count, lowest = len(study.almost_harmonic), float(study.column("w_min").min())
    verdict = REPRODUCED if count == len(ALMOST_HARMONIC) and lowest > 0 else PARTLY
    return Seen(verdict, lowest, f"w ≥ {lowest:.4f}; almost-harmonic at {count} of {len(ALMOST_HARMONIC)} values of s")


@_needs_range
def _amplitude(study: Study) -> Seen:
    amplitude = study.column("amplitude")
    falling = np.diff(amplitude) < 0
    verdict = REPRODUCED if falling.all() else PARTLY if amplitude[-1] < amplitude[0] else NOT
    sentence = f"amplitude {amplitude[0]:.3f} at s = {study.almost_harmonic[0][0]:.2f} … {amplitude[-1]:.3f} at "
    sentence += f"{study.almost_harmonic[-1][0]:.2f}, falling in {int(falling.sum())} of {falling.size} steps"
    return Seen(verdict, float(amplitude[0] - amplitude[-1]), sentence)


@_needs_range
def _turning_slip_velocity(study: Study) -> Seen:
    low, high = study.column("w_min"), study.column("w_max")
    grows = [bool((np.diff(values) > 0).all()) for values in (low, high)]
    verdict = REPRODUCED if all(grows) else PARTLY if any(grows) else NOT
    sentence = f"the lower one {low[0]:.3f} … {low[-1]:.3f}, the upper one {high[0]:.3f} … {high[-1]:.3f}"
    return Seen(verdict, float(low[-1] - low[0]), sentence)


@_needs_range
def _friction_falls(study: Study) -> Seen:
    highest = np.array([force.max() for _, _, force, _ in study.loops])
    lowest = np.array([force.min() for _, _, force, _ in study.loops])
    falls = [bool((np.diff(values) < 0).all()) for values in (highest, lowest)]
    verdict = REPRODUCED if all(falls) else PARTLY if any(falls) else NOT
    sentence = f"highest {highest[0]:.3f} … {highest[-1]:.3f}, lowest {lowest[0]:.3f} … {lowest[-1]:.3f} as s grows"
    return Seen(verdict, float(lowest[-1] - lowest[0]), sentence)


@_needs_range
def _higher_while_rising(study: Study) -> Seen:
    least, most = np.inf, -np.inf
    for _, w, force, rising in study.loops:
        grid = np.linspace(w.min(), w.max(), 203)[1:-1]
        up, down = (_along(w[mask], force[mask], grid) for mask in (rising, ~rising))
        least, most = min(least, float((up - down).min())), max(most, float((up - down).max()))
    least = round(least, 5) + 0.0
    # Interpolation between samples across a corner is good to about 1e-4.
    verdict = REPRODUCED if most > 1e-2 and least > -1e-3 else PARTLY if most > 1e-2 else NOT
    return Seen(
        verdict,
        most,
        f"f(ẇ > 0) − f(ẇ < 0) at the same w lies between {least:.4f} and {most:.4f}",
    )


def _along(w: NDArray[np.float64], force: NDArray[np.float64], grid: NDArray[np.float64]) -> NDArray[np.float64]:
    order = np.argsort(w)
    return np.interp(grid, w[order], force[order])


@_needs_range
def _equation_7(study: Study) -> Seen:
    off = []
    for s, _, force, _ in study.loops:
        limit = float(study.make(s, None).law.break_away_force(0.0, s))
        off.append(abs(float(force.max()) - limit))
    # The peak is a corner between samples.
    verdict = REPRODUCED if max(off) < 1e-2 else PARTLY if max(off) < 5e-2 else NOT
    return Seen(verdict, max(off), f"highest friction differs from f_s(0, s) by up to {max(off):.4f}")


def _hopf(study: Study) -> Seen:
    end = study.end_of_oscillation
    if end is None:
        return Seen(NOT, np.nan, "no end of the limit cycle")
    distances = np.array([0.04, 0.02, 0.01])
    amplitude = np.array([study.motion(round(end - float(off), 6))["amplitude"] for off in distances])
    if (amplitude <= 0).any():
        return Seen(NOT, np.nan, "no limit cycle below its end")
    exponent = float(np.polyfit(np.log(distances), np.log(amplitude), 1)[0])
    sentence = (
        f"amplitude {amplitude[0]:.3f}, {amplitude[1]:.3f}, {amplitude[2]:.3f} at 0.04, 0.02, 0.01 below the end: "
    )
    sentence += f"grows as the distance to the power {exponent:.2f}"
    if exponent < 0.2:
        return Seen(NOT, exponent, sentence + ", a jump")
    return Seen(REPRODUCED if abs(exponent - 0.5) < 0.15 else PARTLY, exponent, sentence)


def _steady_slip(study: Study) -> Seen:
    values = [round(0.41 + 0.03 * i, 2) for i in range(14)]
    there = [s for s in values if study.motion(s)["regime"] == "stable_slip"]
    verdict = REPRODUCED if there == values else PARTLY if there else NOT
    sentence = f"stable slip at {len(there)} of {len(values)} drive velocities from 0.41 to 0.80"
    return Seen(verdict, len(there) / len(values), sentence)


def _single_cycle(study: Study) -> Seen:
    several, values = [], (0.10, 0.20, 0.25, 0.26, 0.30, 0.36, 0.39)
    starts = [(x0, v0) for x0 in (-0.5, 0.5, 1.0, 1.5) for v0 in (-0.3, 0.0, 0.15)]
    oscillates = False
    for s in values:
        motions = [study.motion(s), *(study.motion(s, x0, v0) for x0, v0 in starts)]
        # Alike: the same regime and the same amplitude within 2 % of the largest.
        largest = max(motion["amplitude"] for motion in motions)
        kinds = {(motion["regime"], round(motion["amplitude"] / max(largest, 1e-9) * 50)) for motion in motions}
        oscillates |= largest > 1e-3
        if len(kinds) > 1:
            several.append(s)
    if not oscillates:
        return Seen(NOT, np.nan, "no limit cycle at all")
    alone = len(values) - len(several)
    sentence = f"one motion from {len(starts) + 1} starts at {alone} of {len(values)} drive velocities"
    if several:
        sentence += f", several at s = {_listed(several, 2)}"
        later = study.last(("stick_slip",), x0=1.0, v0=0.0)
        if later is not None and study.end_of_stick_slip is not None:
            sentence += (
                f" (stick-slip ends at {later:.4f} from a start in slip, {study.end_of_stick_slip:.4f} from rest)"
            )
    return Seen(REPRODUCED if not several else PARTLY if alone else NOT, float(alone), sentence)


def _passage(study: Study) -> Seen:
    end = study.end_of_stick_slip
    if end is None:
        return Seen(NOT, np.nan, "no end of stick-slip")
    most, cycles, where = 0, 0.0, np.nan
    for off in (0.0001, 0.0002, 0.0005, 0.001, 0.002, 0.005, 0.01):
        s = end + off
        if study.motion(s)["regime"] != "almost_harmonic":
            continue
        system = study.make(s, None)
        orbit = simulate(system, study.periods * system.natural_period)
        releases = int((orbit.events["kind"] == "release").sum())
        if releases > most:
            most, cycles, where = releases, _cycles_until_settled(orbit), s
    if most == 0:
        return Seen(NOT, np.nan, "no almost-harmonic motion just above the end of stick-slip")
    verdict = REPRODUCED if most >= 3 and cycles >= 5 else PARTLY if most >= 2 else NOT
    sentence = (
        f"at s = {where:.4f}: {most} releases, then no more; within 1 % of the limit cycle after {cycles:.1f} cycles"
    )
    return Seen(verdict, float(most), sentence)


def _cycles_until_settled(orbit: Orbit) -> float:
    """Cycles until the swing of x stays within 1 % of its last value."""
    turns = sign_changes(lambda t: orbit.at(t)[1], orbit.times())
    swing = np.abs(np.diff(orbit.at(turns)[0]))
    away = np.flatnonzero(np.abs(swing / swing[-1] - 1) > 0.01)
    return float(away[-1] + 1) / 2 if away.size else 0.0


def _first_break_away(study: Study) -> Seen:
    values, above = (0.20, 0.30, 0.45), []
    sentences = []
    for s in values:
        system = study.make(s, None)
        events = simulate(system, 5 * system.natural_period).events
        releases = events[events["kind"] == "release"]
        if releases.empty:
            continue
        first, later = float(releases["force"].iloc[0]), float(system.law.break_away_force(0.0, s))
        above.append(first > later + 1e-9)
        sentences.append(f"{first:.3f} at s = {s:.2f}")
    if not above:
        return Seen(NOT, np.nan, "nothing sticks")
    verdict = REPRODUCED if all(above) and len(above) == len(values) else PARTLY if any(above) else NOT
    return Seen(
        verdict, float(sum(above)), "first break-away force " + ", ".join(sentences) + f"; f_s(0) = {later:.3f}"
    )


def _forced_summary(motions: list[Forced]) -> str:
    free = [motion for motion in motions if not motion.sticks]
    counts = {p: sum(motion.period == p for motion in free) for p in (1, 2, 0)}
    higher = len(free) - sum(counts.values())
    sentence = f"of {len(motions)} u₀ in 0.005 … 0.200, {len(free)} without sticking: "
    sentence += f"{counts[1]} one-, {counts[2]} two-, {higher} higher-, {counts[0]} non-periodic"
    two_loops = [motion.amplitude for motion in free if motion.loops == 2.0]
    return sentence + (f"; two loops per forcing period at u₀ = {_listed(two_loops)}" if two_loops else "")


def _two_periodic(s: float, frequency: float) -> Callable[[Study], Seen]:
    def look(study: Study) -> Seen:
        motions = study.forced(s, frequency)
        found = [motion.amplitude for motion in motions if motion.period == 2 and not motion.sticks]
        nearly = [motion for motion in motions if motion.period == 2 or (motion.period == 1 and motion.loops == 2.0)]
        sentence = _forced_summary(motions) + (f"; period two at u₀ = {_listed(found)}" if found else "")
        verdict = REPRODUCED if len(found) > 1 else PARTLY if nearly else NOT
        return Seen(verdict, float(len(found)), sentence)

    return look


def _non_periodic(s: float, frequency: float) -> Callable[[Study], Seen]:
    def look(study: Study) -> Seen:
        motions, found = study.forced(s, frequency), study.non_periodic(s, frequency)
        nearly = [motion for motion in motions if motion.period == 0 or motion.period > 2]
        sentence = _forced_summary(motions) + (
            f"; still so after five times as long at u₀ = {_listed(found)}" if found else ""
        )
        verdict = REPRODUCED if len(found) > 1 else PARTLY if nearly else NOT
        return Seen(verdict, float(len(found)), sentence)

    return look


def _one_amplitude(s: float, slow: float, fast: float) -> Callable[[Study], Seen]:
    def look(study: Study) -> Seen:
        fast_ones = study.non_periodic(s, fast)
        there = [motion for motion in study.forced(s, slow) if motion.amplitude in fast_ones and not motion.sticks]
        both = [motion.amplitude for motion in there if motion.period == 2]
        near = [motion.amplitude for motion in there if motion.period in (4, 8) or abs(motion.loops - 2) < 0.05]
        if both:
            return Seen(REPRODUCED, both[0], f"both at u₀ = {_listed(both)}")
        if near:
            return Seen(PARTLY, near[0], f"nearly both at u₀ = {_listed(near)}")
        seen = f"where η = {fast} is non-periodic, u₀ = {_listed(fast_ones)}, η = {slow} has the periods "
        periods = sorted({motion.period for motion in there})
        seen += ", ".join(str(p) if p else "none up to 32" for p in periods)
        return Seen(NOT, np.nan, seen if fast_ones else f"η = {fast} is nowhere non-periodic without sticking")

    return look


#: Every statement that is scored, in the order of the paper.
STATEMENTS: tuple[Statement, ...] = (
    Statement(
        "amplitude-falls",
        "4",
        "The amplitude of the almost-harmonic vibration falls as the drive gets faster.",
        "half of max x − min x at s = 0.26, 0.27, …, 0.39",
        "falls at every step; partly: falls on the whole",
        "follows",
        _amplitude,
    ),
    Statement(
        "turning-slip-velocity-grows",
        "4",
        "The slip velocities at which ẇ = 0 grow with the drive velocity.",
        "smallest and largest w of the limit cycle at s = 0.26, …, 0.39",
        "both grow at every step; partly: one does",
        "follows",
        _turning_slip_velocity,
    ),
    Statement(
        "friction-falls",
        "4",
        "Corresponding values of kinetic friction fall as the drive gets faster.",
        "highest and lowest friction of the limit cycle at s = 0.26, …, 0.39",
        "both fall at every step; partly: one does",
        "follows",
        _friction_falls,
    ),
    Statement(
        "higher-while-slip-grows",
        "4",
        "Friction is higher while the slip velocity grows than while it falls.",
        "difference of the branches at equal w, s = 0.26, …, 0.39",
        "never below 0 and somewhere above 0.01",
        "built in",
        _higher_while_rising,
    ),
    Statement(
        "always-slipping",
        "4",
        "In the almost-harmonic vibration nothing sticks: w > 0 throughout.",
        "smallest w at s = 0.26, …, 0.39",
        "w > 0 and almost-harmonic at all of them; partly: at some",
        "follows",
        _keeps_slipping,
    ),
    Statement(
        "equation-7",
        "4",
        "While nothing sticks, the highest kinetic friction is the static friction at stick time zero (Eq. 7).",
        "|max f − f_s(0, s)| at s = 0.26, …, 0.39",
        "below 0.01; partly: below 0.05",
        "built in",
        _equation_7,
    ),
    Statement(
        "hopf",
        "4, 9",
        "The limit cycle shrinks into a stable fixed point as in a supercritical Hopf bifurcation.",
        "exponent of the amplitude over the distance of s from the end of the limit cycle",
        "0.5 ± 0.15, the square root of a smooth Hopf bifurcation; partly: continuous with another exponent",
        "follows",
        _hopf,
    ),
    Statement(
        "stick-slip-at-small-s",
        "7, 9",
        "At small drive velocities there are relaxation stick-slip oscillations.",
        "regime from the stuck start at s = 0.05, 0.10, 0.15, 0.20",
        "stick-slip at all of them; partly: at some",
        "follows",
        _relaxation,
    ),
    Statement(
        "end-of-stick-slip",
        "9",
        "Above s ≈ 0.25 stick-slip gives way to almost-harmonic vibration.",
        "drive velocity where stick-slip ends, from the stuck start, by bisection",
        "0.25 ± 0.005; partly: ± 0.03",
        "calibrated: d and the growth of f_s(t_s, δ)",
        _end_of_stick_slip,
    ),
    Statement(
        "end-of-oscillation",
        "9",
        "Above s ≈ 0.40 the self-excited vibration vanishes.",
        "drive velocity where the limit cycle ends, from the stuck start, by bisection",
        "0.40 ± 0.005; partly: ± 0.03",
        "calibrated: f_s(0, ·)",
        _end_of_oscillation,
    ),
    Statement(
        "stable-slip",
        "9",
        "Above the end of the vibration the mass slips steadily at the drive velocity.",
        "regime from the stuck start at s = 0.41, 0.44, …, 0.80",
        "stable slip at all of them; partly: at some",
        "follows",
        _steady_slip,
    ),
    Statement(
        "single-limit-cycle",
        "7",
        "One stable motion is reached from any start.",
        "kind and amplitude of the motion from 13 starts at s = 0.10, 0.20, 0.25, 0.26, 0.30, 0.36, 0.39",
        "one at each of them; partly: at some",
        "follows",
        _single_cycle,
    ),
    Statement(
        "passage",
        "7, 9",
        "Just above the threshold the motion starts with stick-slip and passes through a non-stationary stage.",
        "releases, and cycles until within 1 % of the limit cycle, 0.0001 … 0.01 above the end of stick-slip",
        "at least three releases, then none, and five cycles; partly: two releases",
        "follows",
        _passage,
    ),
    Statement(
        "first-break-away",
        "7",
        "Static friction decides the first stage of the motion whatever vibration follows.",
        "force of the first break-away against f_s(0, ·) at s = 0.20, 0.30, 0.45",
        "above it at all of them; partly: at some",
        "calibrated: growth of f_s(t_s, δ)",
        _first_break_away,
    ),
    Statement(
        "forced-0.30-two-periodic",
        "8",
        "s = 0.30, η = 0.35: two-periodic, nothing sticks.",
        "stroboscopic period and loops per forcing period over 40 forcing amplitudes u₀ ≤ 0.20",
        "period two without a stick at two or more; partly: at one, with sticks, or period one with two loops",
        "calibrated: u₀",
        _two_periodic(0.30, 0.35),
    ),
    Statement(
        "forced-0.30-non-periodic",
        "8",
        "s = 0.30, η = 1.25: non-periodic, nothing sticks.",
        "stroboscopic period over 40 forcing amplitudes u₀ ≤ 0.20",
        "no period ≤ 32, no stick, also in runs five times as long, at two or more; partly: sticks, or period > 2",
        "calibrated: u₀",
        _non_periodic(0.30, 1.25),
    ),
    Statement(
        "forced-0.30-one-amplitude",
        "8",
        "Both of these at s = 0.30 with one forcing amplitude.",
        "u₀ ≤ 0.20 at which both hold",
        "there is one; partly: the slow one has period 4 or 8, or two loops, there",
        "calibrated: u₀",
        _one_amplitude(0.30, 0.35, 1.25),
    ),
    Statement(
        "forced-0.40-two-periodic",
        "8",
        "s = 0.40, η = 0.40: two-periodic around the equilibrium.",
        "stroboscopic period and loops per forcing period over 40 forcing amplitudes u₀ ≤ 0.20",
        "period two without a stick at two or more; partly: at one, with sticks, or period one with two loops",
        "calibrated: u₀",
        _two_periodic(0.40, 0.40),
    ),
    Statement(
        "forced-0.40-non-periodic",
        "8",
        "s = 0.40, η = 1.60: non-periodic around the equilibrium.",
        "stroboscopic period over 40 forcing amplitudes u₀ ≤ 0.20",
        "no period ≤ 32, no stick, also in runs five times as long, at two or more; partly: sticks, or period > 2",
        "calibrated: u₀",
        _non_periodic(0.40, 1.60),
    ),
)


def score(
    oscillator: Make = paper_oscillator,
    *,
    only: tuple[str, ...] | None = None,
    periods: int = 200,
    tolerance: float = 2e-4,
    forcing_periods: int = 600,
    workers: int = 2,
    progress: Callable[[int, int], Any] | None = None,
) -> pd.DataFrame:
    """Score the paper's statements against a model.

    Parameters
    ----------
    oscillator : the model, called with a drive velocity and a forcing (or None); default ours.
    only : ids of the statements to score; default all.
    periods : natural periods of each run; the last tenth is looked at.
    tolerance : width to which thresholds of the drive velocity are bisected.
    forcing_periods : transient of the forced runs.
    workers : threads for the forced runs.
    progress : called as ``progress(done, n)`` after each statement.

    Returns
    -------
    DataFrame indexed by id: section, statement, measured, threshold, verdict (``reproduced``, ``partly``,
    ``not reproduced``), value, seen, basis (``calibrated: …``, ``built in``, ``follows``).

    Raises
    ------
    InputError
        for an unknown id.

    The whole table takes some seconds. Finer: longer `periods` and `forcing_periods`, smaller `tolerance`. Verdicts on
    forced motion next to a window's edge may change with the length of the transient.

    >>> score(only=("amplitude-falls",))["verdict"].item()
    'reproduced'
    """
    import pandas as pd

    from stickslip.documents import did_you_mean
    from stickslip.errors import InputError

    known = {statement.id: statement for statement in STATEMENTS}
    for name in only or ():
        if name not in known:
            raise InputError(f"score: unknown statement {name!r}{did_you_mean(name, known)}")
    chosen = [statement for statement in STATEMENTS if only is None or statement.id in only]
    study = Study(oscillator, periods, tolerance, forcing_periods, workers)
    rows = []
    for done, statement in enumerate(chosen, start=1):
        seen = statement.look(study)
        rows.append(
            {
                "id": statement.id,
                "section": statement.section,
                "statement": statement.sentence,
                "measured": statement.measured,
                "threshold": statement.threshold,
                "verdict": seen.verdict,
                "value": seen.value,
                "seen": seen.sentence,
                "basis": statement.basis,
            }
        )
        if progress is not None:
            progress(done, len(chosen))
    return pd.DataFrame(rows).set_index("id")
