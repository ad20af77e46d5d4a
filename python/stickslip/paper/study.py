"""The simulations that the paper's claims are checked by, each done once."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stickslip.dynamics import sign_changes, steady_motion
from stickslip.model.drive import Harmonic
from stickslip.model.system import Oscillator
from stickslip.simulation.orbit import Orbit
from stickslip.simulation.simulate import simulate

#: An oscillator from a drive velocity and a forcing.
Make = Callable[[float, Harmonic | None], Oscillator]

#: Drive velocities of the almost-harmonic range that are looked at.
ALMOST_HARMONIC = tuple(round(0.26 + 0.01 * i, 2) for i in range(14))

#: Starts in slip: positions, and velocities over the drive velocity.
_STARTS_X, _STARTS_V = np.linspace(-0.5, 2.0, 9), np.array([-2.0, -1.0, -0.3, 0.0, 0.3, 0.7])

#: Forcing amplitudes that are tried, as the paper does not state its u₀.
FORCING_AMPLITUDES = tuple(round(0.005 * i, 3) for i in range(1, 81))

#: Forcing frequencies that are tried where the paper speaks of a changing one.
FREQUENCIES = tuple(round(0.25 + 0.05 * i, 2) for i in range(36))

#: How many times as long as the usual transient a motion is run before it counts as non-periodic.
LASTING = 16


class Forced(NamedTuple):
    """A forced motion: forcing amplitude, stroboscopic period (0: none), maxima of x per forcing period, sticks."""

    amplitude: float
    period: int
    loops: float
    sticks: int


class Study:
    """The simulations that the claims look at, each done once.

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

    def motions(self, s: float) -> list[dict[str, Any]]:
        """The steady motions from rest and from 54 starts in slip."""
        return [self.motion(s)] + [self.motion(s, x0, v0) for x0 in _STARTS_X for v0 in s * _STARTS_V]

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
        return self.last(("stick_slip", "almost_harmonic", "reversing_slip"))

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
            edges = orbit.segments["t"].to_numpy()
            start = orbit.t_end - 3 * period
            # With the corners of the law met exactly, from both sides.
            edges = edges[edges > start]
            times = [np.linspace(start, orbit.t_end, 6001), edges, np.nextafter(edges, -np.inf)]
            motion = orbit.to_xarray(np.unique(np.concatenate(times)))
            w, force, a = (motion[name].to_numpy() for name in ("slip_velocity", "force", "a"))
            found.append((s, w, force, a < 0))
        return found

    def forced(self, s: float, frequency: float) -> list[Forced]:
        """Forced motions over the forcing amplitudes."""
        key = (s, frequency)
        if key not in self._forced:
            with ThreadPoolExecutor(self.workers) as pool:
                short = pool.map(lambda u0: self._force(s, frequency, u0), FORCING_AMPLITUDES)
                self._forced[key] = list(short)
        return self._forced[key]

    def non_periodic(self, s: float, frequency: float) -> list[float]:
        """Forcing amplitudes of a motion that never sticks and, after a long transient, has no period up to 1000."""
        candidates = [m.amplitude for m in self.forced(s, frequency) if m.period == 0 and not m.sticks]
        with ThreadPoolExecutor(self.workers) as pool:
            lasting = list(pool.map(lambda u0: self._never_returns(s, frequency, u0), candidates))
        return [u0 for u0, never in zip(candidates, lasting, strict=True) if never]

    def kinds(self, s: float, amplitude: float) -> dict[str, list[float]]:
        """Forcing frequencies of the motions that never stick, by kind: one-, two-, higher- and non-periodic."""
        with ThreadPoolExecutor(self.workers) as pool:
            motions = list(pool.map(lambda eta: self._force(s, eta, amplitude), FREQUENCIES))
            free = [(eta, m.period) for eta, m in zip(FREQUENCIES, motions, strict=True) if not m.sticks]
            open_ones = [eta for eta, period in free if period == 0]
            lasting = dict(
                zip(open_ones, pool.map(lambda eta: self._never_returns(s, eta, amplitude), open_ones), strict=True)
            )
        found: dict[str, list[float]] = {kind: [] for kind in ("one-", "two-", "higher-", "non-")}
        for eta, period in free:
            kind = {1: "one-", 2: "two-"}.get(period, "non-" if lasting.get(eta) else "higher-")
            # Without a period for long, but not for ever: it may come to any period, and is not counted.
            if period or lasting[eta]:
                found[kind].append(eta)
        return found

    def _force(self, s: float, frequency: float, amplitude: float) -> Forced:
        """Periods, loops and sticks over 128 forcing periods after the transient."""
        system = self.make(s, Harmonic(amplitude, frequency))
        transient, period, count = self.forcing_periods, 2 * np.pi / frequency, 128
        start = transient * period
        orbit = simulate(system, (transient + count) * period)
        turns = sign_changes(lambda t: orbit.at(t)[1], np.linspace(start, orbit.t_end, 100 * count))
        # Every second turning point is a maximum.
        loops = round(turns.size / 2 / count, 2)
        return Forced(amplitude, _period(orbit, period, transient, count, 32), loops, _captures(orbit, start))

    def _never_returns(self, s: float, frequency: float, amplitude: float) -> bool:
        # Chaos may last for thousands of periods before a motion finds its period, and that may be some hundreds long.
        transient, period = LASTING * self.forcing_periods, 2 * np.pi / frequency
        orbit = simulate(self.make(s, Harmonic(amplitude, frequency)), (transient + 2000) * period)
        sticks = _captures(orbit, self.forcing_periods * period)
        return not sticks and _period(orbit, period, transient, 2000, 1000) == 0


def _period(orbit: Orbit, forcing_period: float, first: int, count: int, longest: int) -> int:
    """How many forcing periods, up to `longest`, the motion takes to return, watched over `count` from `first` on; else 0."""
    x, v = orbit.at(np.minimum(forcing_period * np.arange(first, first + count + 1), orbit.t_end))
    returns = (
        p for p in range(1, longest + 1) if max(np.abs(x[p:] - x[:-p]).max(), np.abs(v[p:] - v[:-p]).max()) < 1e-6
    )
    return next(returns, 0)


def _captures(orbit: Orbit, start: float) -> int:
    return int(((orbit.events["kind"] == "capture") & (orbit.events["t"] > start)).sum())
