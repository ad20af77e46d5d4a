"""One measured motion, and the motion that a law makes under the same drive, compared with it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from stickslip.errors import InputError
from stickslip.files.arrays import Array, Mask
from stickslip.identification.records import FrictionRecord
from stickslip.identification.trajectory.tangent import Tangent, why_differences
from stickslip.laws import Law
from stickslip.measurement.signals.noise import noise_level
from stickslip.model.system import Oscillator
from stickslip.simulation.orbit import Orbit
from stickslip.simulation.simulate import simulate

TRANSIENT = 25.0
"""Natural periods that the simulated motion is given to settle, from a state of the measured one."""
SAMPLES = 4000
"""Samples of a record that are compared, evenly thinned."""
CYCLES = 8
"""Cycles of the simulated motion whose landmarks are averaged."""
CERTAIN = 2.0
"""Cycles of the measured motion that are needed."""
CONSTANTS = ("mass", "damping", "stiffness", "drive_velocity")
STILL = 0.02
"""Of the drive velocity: a range of w below this is steady slip."""


def moving(record: FrictionRecord) -> tuple[partial[Oscillator], Array]:
    """The oscillator of a record for any law, and its displacement; an InputError where either is not known."""
    if record.displacement is None:
        raise InputError(
            f"{record.name}: holds no displacement, so no motion can be compared with it; measure it again"
        )
    for name in CONSTANTS:
        if name not in record.constants:
            raise InputError(f"{record.name}: {name} is not known; measure it with a rig that says it")
    mass, damping, stiffness, drive_velocity = (record.constants[name] for name in CONSTANTS)
    make = partial(Oscillator, damping=damping, drive_velocity=drive_velocity, mass=mass, stiffness=stiffness)
    return make, record.displacement


@dataclass(frozen=True)
class Landmarks:
    """What a steady motion is known by, whatever its phase.

    Attributes
    ----------
    kind : ``"stick_slip"``, ``"almost_harmonic"`` or ``"stable_slip"``.
    period : time from one rise of x through its mean to the next; NaN where it hardly moves.
    turns : mean turning points of x (lowest, highest) and of v, shape (4,).
    stuck : share of the time.
    """

    kind: str
    period: float
    turns: Array
    stuck: float

    @classmethod
    def of(cls, time: Array, x: Array, v: Array, stuck: Mask, drive_velocity: float) -> Landmarks:
        """Read them off a sampled motion."""
        middle, spread = float(np.mean(x)), float(np.std(x))
        rises = _rises(time, x, middle, 0.3 * spread)
        still = float(np.ptp(v)) < STILL * abs(drive_velocity)
        share = float(np.mean(stuck))
        kind = "stick_slip" if share > 0 else "stable_slip" if still else "almost_harmonic"
        if still or rises.size < 2:
            ends = np.array([x.min(), x.max(), v.min(), v.max()])
            return cls(kind, math.nan, ends if not still else np.array([middle, middle, 0.0, 0.0]), share)
        edges = np.searchsorted(time, rises)
        parts = [slice(a, b) for a, b in pairwise(edges) if b > a]
        turns = [[x[p].min(), x[p].max(), v[p].min(), v[p].max()] for p in parts]
        period = float((rises[-1] - rises[0]) / (rises.size - 1))
        return cls(kind, period, np.mean(turns, axis=0), share)


class MotionMisfit:
    """The steady part of one record, and the oscillator that should make it.

    Parameters
    ----------
    record : one that holds a displacement and the constants of its oscillator.
    settled_after : the fraction of the record that is left out as transient.
    """

    def __init__(self, record: FrictionRecord, settled_after: float) -> None:
        self.make, displacement = moving(record)
        self.name = record.name
        known = record.constants
        self.drive_velocity = known["drive_velocity"]
        kept = record.time >= record.settled(settled_after)
        origin = float(record.time[kept][0])
        self._smooth = (record.time[kept] - origin, displacement[kept], record.stuck[kept])
        self._velocity = self.drive_velocity - record.slip_velocity[kept]
        # The instrument's own samples have white noise, which can be told; those of a smoothed record do not.
        self.white = record.recorded is not None
        signal = displacement if record.recorded is None else record.recorded
        good = kept & np.isfinite(signal)
        if good.sum() < 50:
            raise InputError(f"{record.name}: {good.sum()} samples are too few to lay a motion over; take a longer one")
        stride = max(1, int(good.sum()) // SAMPLES)
        self.time = record.time[good][::stride] - origin
        self.displacement = signal[good][::stride]
        self.spread = float(np.std(self.displacement))
        self.noise = noise_level(self.displacement) if self.white else math.nan
        self.seen = Landmarks.of(*self._smooth[:2], self._velocity, self._smooth[2], self.drive_velocity)
        self._mean = float(np.mean(displacement[kept]))
        self._natural = 2 * math.pi * math.sqrt(known["mass"] / known["stiffness"])
        if self.seen.kind != "stable_slip" and not CERTAIN * self.cycle < float(self.time[-1]):
            raise InputError(
                f"{record.name}: {float(self.time[-1]):.4g} of time hold fewer than {CERTAIN:g} cycles, so it cannot be said "
                "that the motion repeats; take a longer record"
            )
        # A state of the measured motion: the simulated one settles from there, on the same attractor.
        start = int(np.argmax(displacement[kept]))
        v0 = float(self._velocity[start])
        # A start that slips by less than the noise is a stick.
        still = abs(self.drive_velocity - v0) < STILL * abs(self.drive_velocity)
        self._start = (float(self._smooth[1][start]), None if still else v0)

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self._points(self._smooth[1], self._velocity))

    @cached_property
    def half(self) -> Array:
        """Half-widths of the measured motion in x and v."""
        low, high = self.seen.turns[[0, 2]], self.seen.turns[[1, 3]]
        return np.maximum((high - low) / 2, 1e-12 * (1 + np.abs(high)))

    def _points(self, x: Array, v: Array) -> Array:
        return np.stack([x / self.half[0], v / self.half[1]], axis=1)

    def transient(self, system: Oscillator) -> float:
        """Time after which the motion counts as settled."""
        return TRANSIENT * system.natural_period

    def orbit(self, law: Law, duration: float) -> tuple[Orbit, float]:
        """The motion of the law for `duration` after it has settled, and the time at which it has."""
        system = self.make(law=law)
        transient = self.transient(system)
        x0, v0 = self._start
        return simulate(system, transient + duration, x0=x0, v0=v0), transient

    def motion(self, law: Law, shift: float, count: int) -> tuple[Array, Array]:
        """Position and velocity at the first `count` samples, of the settled motion.

        In the middle of these samples the motion is `shift` after a rise through the measured mean. Counted from there,
        a change of the period puts both ends a little out of step instead of the far end by much, and what happens
        while the motion settles drops out; a search is straighter for it.
        """
        orbit, _, times = self._clock(law, shift, count)
        x, v = orbit.at(times)
        return np.asarray(x), np.asarray(v)

    def tangent(self, law: Law, names: Sequence[str], shift: float, count: int) -> tuple[Array, dict[str, Array]]:
        """The velocity of :meth:`motion`, and the derivatives of its position by numbers of the law, shape (count,) each.

        What the core cannot differentiate (:mod:`stickslip.identification.trajectory.tangent`) is left out.
        """
        orbit, rise, times = self._clock(law, shift, count)
        v = np.asarray(orbit.at(times)[1])
        if not names or why_differences(type(law)) is not None:
            return v, {}
        x, speed = (float(part) for part in orbit.at(rise))
        # The clock starts at the rise, which moves too; where there is none it is a fixed time.
        moves = speed != 0 and abs(x - self._mean) < 1e-6 * self.spread
        try:
            window = (float(min(times[0], rise)), float(max(times[-1], rise)))
            tangent = Tangent(orbit, self._start, window, rise if moves else None)
        except InputError:
            return v, {}
        return v, {name: by(times) for name, by in tangent.by(names).items()}

    def _clock(self, law: Law, shift: float, count: int) -> tuple[Orbit, float, Array]:
        """An orbit, the rise from which it is counted, and its times that belong to the first `count` samples."""
        half = 0.5 * float(self.time[count - 1])
        orbit, transient = self.orbit(law, 2 * half + 2 * self.reach + abs(shift))
        rise = self._rise(orbit, transient + self.reach + half)
        return orbit, rise, rise - half + shift + self.time[:count]

    @property
    def reach(self) -> float:
        """Time in which a motion like the measured one certainly rises through its mean."""
        return 1.5 * self.cycle

    @property
    def cycle(self) -> float:
        """The measured period, or the natural one where the motion is too small to have one."""
        return self.seen.period if math.isfinite(self.seen.period) else self._natural

    def _rise(self, orbit: Orbit, middle: float) -> float:
        """The first time after `middle` at which x rises through the measured mean, to rounding; else `middle`."""
        times = middle + np.linspace(0.0, self.reach, 60)
        x = np.asarray(orbit.at(times)[0]) - self._mean
        ups = np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
        if not ups.size:
            return middle
        low, high = float(times[ups[0]]), float(times[ups[0] + 1])
        t = low
        for _ in range(20):
            x_t, v_t = orbit.at(t)
            off = float(x_t) - self._mean
            low, high = (t, high) if off < 0 else (low, t)
            ahead = t - off / float(v_t) if v_t else low
            ahead = ahead if low <= ahead <= high else 0.5 * (low + high)
            if abs(ahead - t) < 1e-13 * (1 + abs(t)):
                break
            t = ahead
        return t

    def landmarks(self, law: Law) -> tuple[Landmarks, float]:
        """Landmarks of the law's motion, and the rms distance of its phase trajectory from the measured one.

        The distance is in half-widths of the measured motion, from each simulated point to the nearest measured one.
        """
        orbit, transient = self.orbit(law, CYCLES * self.cycle)
        data = orbit.to_xarray(transient + np.linspace(0.0, CYCLES * self.cycle, 150 * CYCLES))
        time, x, v = (data[name].to_numpy() for name in ("time", "x", "v"))
        found = Landmarks.of(time, x, v, data["stuck"].to_numpy(), self.drive_velocity)
        distance, _ = self._tree.query(self._points(x, v))
        return found, float(np.sqrt(np.mean(np.square(distance))))

    def unlikeness(self, law: Law) -> Array:
        """How far the law's motion is from the measured one in period, turning points, sticks, phase and kind.

        Shape (8,), each about 1 where the two have nothing in common and 0 where they are alike: log ratio of the periods;
        the four turning points in half-widths; share of the time stuck; rms distance of the phase trajectories; 1 where
        the kinds of motion differ.
        """
        found, distance = self.landmarks(law)
        period = 1.0
        if math.isfinite(found.period) and math.isfinite(self.seen.period):
            period = math.log(found.period / self.seen.period)
        turns = (found.turns - self.seen.turns) / self.half[[0, 0, 1, 1]]
        kind = 0.0 if found.kind == self.seen.kind else 1.0
        return np.array([period, *turns, found.stuck - self.seen.stuck, distance, kind])

    def first_shift(self, law: Law, count: int) -> float:
        """The shift of :meth:`motion` with the least misfit in the middle of the first `count` samples."""
        middle = 0.5 * float(self.time[count - 1])
        near = np.flatnonzero(np.abs(self.time - middle) < 0.35 * self.cycle)
        near = near[:: max(1, near.size // 150)]
        grid = np.linspace(-0.6, 0.6, 240) * self.cycle
        orbit, transient = self.orbit(law, 4 * self.reach)
        rise = self._rise(orbit, transient + self.reach)
        x = np.asarray(orbit.at(rise + grid[:, None] + (self.time[near] - middle)[None, :])[0])
        return float(grid[int(np.argmin(np.sum((x - self.displacement[near]) ** 2, axis=1)))])


def _rises(time: Array, x: Array, middle: float, clear: float) -> Array:
    """Times at which x rises through its middle, each after a fall clear below it."""
    state = np.where(x > middle + clear, 1, np.where(x < middle - clear, -1, 0))
    known = np.flatnonzero(state)
    rises = (state[known[1:]] > 0) & (state[known[:-1]] < 0)
    starts, ups = known[:-1][rises], known[1:][rises]
    found = []
    for a, b in zip(starts, ups, strict=True):
        j = a + int(np.argmax(x[a : b + 1] >= middle))
        i = max(j - 1, 0)
        share = (middle - x[i]) / (x[j] - x[i]) if x[j] > x[i] else 0.0
        found.append(float(time[i] + share * (time[j] - time[i])))
    return np.array(found)
