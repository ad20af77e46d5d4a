"""A ripple of the drive, or a vibration of the base or the instrument: a line that all sticks of a record share."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import minimize_scalar
from scipy.special import i0e

from stickslip.files.arrays import Array
from stickslip.files.units import unit_suffix
from stickslip.measurement.indirect.draft import Draft
from stickslip.measurement.indirect.force import Friction
from stickslip.measurement.indirect.sticks.stick import Stick, ends_of
from stickslip.measurement.rigs.rig import RigUnits
from stickslip.measurement.signals.piecewise_fit import OscillatorConstants
from stickslip.measurement.signals.presmooth import presmooth
from stickslip.measurement.signals.turning_points import find_flanks

LEAST_STICKS = 4
"""Fewer sticks do not show that they share a line."""
MOST_STICKS = 200
"""Of a long record the slow lines are looked for in so many sticks."""
LEAST_SAMPLES = 8
"""Of a stick: fewer are left out."""
MARGIN = 3
"""Samples beside the limits of a stick that may belong to a slip."""
STICK_PARTS = 16
"""Parts of a stick whose means show the slow lines."""
MOST_LINES = 3
"""Lines that are taken from a record: a drive has harmonics."""
LINE_DEVIANCE = 40.0
"""A line must lower the deviance by so much: it is chosen among thousands of frequencies."""
OSCILLATES = 2.0
"""No creep goes to and fro so many times in a stick."""
IN_STEP = 0.8
"""A line that has the same phase as all sticks begin, to this mean resultant, is a part of what all sticks do: of creep."""
MOST_RELEASING = 100.0
"""Most that the phases of break-aways count, in deviance."""
TWO_NUMBERS = 6.0
"""What the mean and the width of those phases cost."""
PIXEL_HARMONICS = 2
"""Of the error within a pixel: in the middle and at the edge it is none."""
FASTEST = 0.4
"""Highest frequency of a line in cycles a sample."""


@dataclass(frozen=True)
class Ripple:
    """A sum of sines, r(t) = sum_j c_j cos(w_j (t - t_0)) + s_j sin(w_j (t - t_0)).

    Attributes
    ----------
    origin : t_0 in s.
    rates : (j,) angular frequencies w in rad/s.
    cosines, sines : (j,) c and s, in the unit of the extension.
    error : standard error of an amplitude.
    """

    origin: float
    rates: Array
    cosines: Array
    sines: Array
    error: float

    @property
    def amplitudes(self) -> Array:
        """Amplitudes of the lines."""
        return np.hypot(self.cosines, self.sines)

    def releasing(self, sticks: list[Stick]) -> float:
        """Deviance by which break-aways speak for a ripple that loads the mass: they come at one phase of its main line.

        That of phases spread evenly less that of a von Mises distribution, at most `MOST_RELEASING`: a motion that repeats
        itself may by chance have a whole number of periods of the line.
        """
        ends = ends_of(sticks)
        if len(ends) < LEAST_STICKS:
            return 0.0
        rate = self.rates[int(np.argmax(self.amplitudes))]
        mean = min(float(abs(np.mean(np.exp(1j * rate * ends)))), 1 - 1e-6)
        narrow = mean * (2 - mean**2) / (1 - mean**2)
        gain = 2 * len(ends) * (narrow * (mean - 1) - math.log(float(i0e(narrow))))
        return float(np.clip(gain - TWO_NUMBERS, 0.0, MOST_RELEASING))

    def at(self, time: Array, derivative: int = 0) -> Array:
        """The ripple at these times, or a derivative of it.

        >>> ripple = Ripple(0.0, np.array([2.0]), np.array([0.0]), np.array([3.0]), 0.1)
        >>> ripple.at(np.array([0.0]), 1)
        array([6.])
        """
        turned = (self.cosines - 1j * self.sines) * (1j * self.rates) ** derivative
        return np.asarray((np.exp(1j * np.outer(np.asarray(time) - self.origin, self.rates)) @ turned).real)


@dataclass(frozen=True)
class RemovedRipple:
    """What was taken from the extension because of a ripple.

    Attributes
    ----------
    ripple : of the sticks.
    everywhere : whether the slips have it too. It is then one of the instrument, or of the end of the spring that is
        pulled; else one of the drive, or of the base, which the mass follows only while it sticks.
    sticks : between which the ripple is bridged by cubics where it is not `everywhere`.
    """

    ripple: Ripple
    everywhere: bool
    sticks: list[Stick] = field(default_factory=list)

    def taken(self, time: Array, derivative: int = 0) -> Array:
        """What was taken from the extension at these times, or a derivative of it."""
        ripple = self.ripple.at(time, derivative)
        if self.everywhere:
            return ripple
        stuck = np.zeros(len(time), dtype=bool)
        for stick in self.sticks:
            stuck[slice(*np.searchsorted(time, [stick.start, stick.end]))] = True
        limits = np.array([limit for stick in self.sticks for limit in (stick.start, stick.end)])
        limits = np.concatenate([[min(time[0], limits[0]) - 1.0], limits, [max(time[-1], limits[-1]) + 1.0]])
        bridge = CubicHermiteSpline(limits, self.ripple.at(limits), self.ripple.at(limits, 1))
        return np.where(stuck, ripple, bridge(time, derivative))

    def taken_from(self, draft: Draft) -> Draft:
        """The draft without the ripple."""
        x = draft.extension - self.taken(draft.time)
        presmoothed = presmooth(draft.time, x, draft.weight, draft.oscillator, draft.noise)
        return replace(draft, extension=x, presmoothed=presmoothed, flanks=find_flanks(presmoothed, 0.0))

    def returned(self, friction: Friction, sticks: list[Stick]) -> Friction:
        """The friction of the extension with what was taken from it, from the one without and its sticks."""
        o, time = friction.fit.oscillator, friction.time
        ends = ends_of(sticks)
        zeros = np.zeros(len(time))
        if not self.everywhere:
            # a base that moves takes the spring with it, so the share of k r is not sure
            held, unsure = (o.stiffness, o.damping, o.mass), o.stiffness * _rms(self.ripple.at(ends))
            moved = [np.where(friction.stuck, 0.0, self.ripple.at(time, d) - self.taken(time, d)) for d in (1, 2)]
            seen = [self.taken(time, d) for d in (0, 1)]
        else:
            held, unsure = (o.stiffness if self._pulled(friction, ends) else 0.0, 0.0, 0.0), 0.0
            moved = [zeros, zeros]
            seen = [self.taken(time, d) if held[0] else zeros for d in (0, 1)]
        fastest = float(self.ripple.rates.max())
        added = [sum(factor * self.ripple.at(ends, d + rate) for d, factor in enumerate(held)) for rate in (0, 1)]
        # limits of one record are early or late alike
        misplaced = np.array([stick.end_error for stick in sticks if stick.ends])
        common = math.hypot(
            unsure, _rms(added[1] * misplaced), self.ripple.error * (held[0] + held[1] * fastest + held[2] * fastest**2)
        )
        return replace(
            friction.with_common_error(common),
            extension=friction.extension + seen[0],
            velocity=friction.velocity + seen[1],
            slip_velocity=friction.slip_velocity + moved[0],
            slip_acceleration=friction.slip_acceleration + moved[1],
            force=friction.force + sum(factor * self.taken(time, d) for d, factor in enumerate(held)),
            added=dict(zip(ends.tolist(), np.transpose(np.array(added)).tolist(), strict=True)),
        )

    def note(self, o: OscillatorConstants, units: RigUnits) -> str:
        """The sentence that names the ripple and what was done."""
        length, force, frequency = (unit_suffix(unit) for unit in (units.length, units.force, units.frequency))
        lines = ", ".join(
            f"{amplitude:.2g}{length} at {rate / (2 * math.pi):.4g}{frequency}"
            for amplitude, rate in zip(self.ripple.amplitudes, self.ripple.rates, strict=True)
        )
        name = f"while stuck the record has a line that is alike in all sticks ({lines})"
        if self.everywhere:
            return (
                f"{name}, and the slips have it too: the instrument shakes, or the end of the spring that is pulled; it was "
                "taken out, and its force on the spring given back where break-aways scatter less with it"
            )
        swing = float(self.ripple.amplitudes @ (o.stiffness + o.mass * self.ripple.rates**2))
        return (
            f"{name}, and the slips do not: a ripple of the drive, or the base vibrates; the mass was taken to follow it "
            f"while stuck, and the friction holds the force of that, up to {swing:.2g}{force}"
        )

    def _pulled(self, friction: Friction, ends: Array) -> bool:
        """Whether the ripple winds up the spring, and is not only seen: break-aways then scatter less with its force."""
        if len(ends) < LEAST_STICKS:
            return False
        fit = friction.fit
        x = fit.oscillator.drive_velocity * ends - fit.evaluate(ends, 0)
        return float(np.std(x + self.ripple.at(ends))) < float(np.std(x))


def _rms(values: Array) -> float:
    return math.sqrt(float(np.mean(values**2))) if len(values) else 0.0


class _Samples:
    """Samples of the middles of sticks, each less its mean, with the slope that all share taken out."""

    def __init__(self, time: Array, values: Array, owner: npt.NDArray[np.int64], weight: Array) -> None:
        self.time, self.owner, self.weight = time, owner, weight
        self.count = np.bincount(owner, weight)
        slope = self.centred((time - time[0])[:, None])[:, 0]
        self.slope = slope / math.sqrt(float(weight @ slope**2))
        self.values = self.cleared(values[:, None])[:, 0]

    def centred(self, columns: Array) -> Array:
        means = [np.bincount(self.owner, self.weight * column)[self.owner] for column in columns.T]
        return columns - (np.array(means) / self.count[self.owner]).T

    def cleared(self, columns: Array) -> Array:
        """Columns less their means over each stick and their part along the shared slope."""
        columns = self.centred(columns)
        return columns - np.outer(self.slope, (self.weight * self.slope) @ columns)

    def left(self, rates: Array, origin: float) -> Array:
        """The values less the lines of these rates."""
        if not len(rates):
            return self.values
        return self.values - self.cleared(self.waves(rates, origin)) @ self.fitted(rates, origin)[0]

    def waves(self, rates: Array, origin: float) -> Array:
        phase = np.outer(self.time - origin, rates)
        return np.concatenate([np.cos(phase), np.sin(phase)], axis=1)

    def fitted(self, rates: Array, origin: float) -> tuple[Array, float]:
        """Amplitudes of the lines of these rates, cosines first, and the sum of squares that they leave."""
        root = np.sqrt(self.weight)
        if not len(rates):
            return rates, float((root * self.values) @ (root * self.values))
        columns = self.cleared(self.waves(rates, origin)) * root[:, None]
        numbers = np.linalg.lstsq(columns, root * self.values, rcond=1e-6)[0]
        residuals = root * self.values - columns @ numbers
        return np.asarray(numbers, np.float64), float(residuals @ residuals)


def find_ripple(
    time: Array,
    extension: Array,
    weight: Array,
    sticks: list[Stick],
    noise: float,
    mains: float | None = None,
    pixel: float | None = None,
) -> Ripple | None:
    """The lines that the middle halves of all sticks share, beside one slope and a level of each; None without any.

    A line must hold its phase over the whole record, and be none of what all sticks do alike: it goes to and fro within a
    stick, or the sticks begin at different phases of it. Creep does neither.

    Parameters
    ----------
    time, extension, weight : (n,) record.
    sticks : first guesses.
    noise : standard deviation of its samples.
    mains : frequency in Hz of a line that was subtracted: what is left of it is no ripple.
    pixel : length of a pixel of a film. Where a marker is seen between two pixels its position is a little wrong, the same in
        each pixel: a line at the rate at which sticks go over pixels, as the frames show it, is the camera's.
    """
    parts = _seen([stick.middle_half for stick in sticks], time, weight)
    if len(parts) < LEAST_STICKS:
        return None
    samples = _samples(parts, time, extension, weight)
    coarse = _coarse(samples)
    step, origin = float(time[1] - time[0]), float(time[0])
    lasting = float(np.median([time[part.stop - 1] - time[part.start] for part in parts]))
    starts = np.array([time[part.start] for part in parts])
    rates = np.zeros(0)
    _, left = samples.fitted(rates, origin)
    variance = max(noise**2, 1e-300)
    no_ripple = [] if mains is None else [mains]
    if pixel is not None:
        speeds = [abs(np.polyfit(time[part], extension[part], 1)[0]) for part in parts]
        crossing = float(np.median(speeds)) / pixel * step * np.arange(1, PIXEL_HARMONICS + 1)  # in pixels a frame
        no_ripple += (np.abs(crossing - np.round(crossing)) / step).tolist()
    while len(rates) < MOST_LINES:
        best, least = 0.0, left
        for rate in _candidates(samples, coarse, rates, origin, step, lasting):
            found, rest = _refined(samples, rates, rate, origin)
            known = any(abs(found / (2 * math.pi) - frequency) < 1 / lasting for frequency in no_ripple)
            if rest < least and not known and _shared(found, lasting, starts):
                best, least = found, rest
        # what is not white beside the line makes it less sure
        scale = max(variance, least / max(float(samples.weight.sum()) - len(parts) - 3, 1.0))
        if not best or (left - least) / scale < LINE_DEVIANCE:
            break
        rates, left = np.append(rates, best), least
    if not len(rates):
        return None
    return _ripple(samples, rates, origin, noise)


def refined_ripple(
    ripple: Ripple, time: Array, extension: Array, weight: Array, sticks: list[Stick], noise: float
) -> Ripple:
    """The ripple by all of the sticks, where their limits are known; the other parameters are those of `find_ripple`."""
    margin = MARGIN * float(time[1] - time[0])
    spans = [(one.start + 2 * one.start_error + margin, one.end - 2 * one.end_error - margin) for one in sticks]
    parts = _seen(spans, time, weight)
    if len(parts) < LEAST_STICKS:
        return ripple
    samples, rates = _samples(parts, time, extension, weight), ripple.rates
    for number in range(len(rates)):
        others = np.delete(rates, number)
        rates = np.insert(others, number, _refined(samples, others, float(rates[number]), ripple.origin)[0])
    return _ripple(samples, rates, ripple.origin, noise)


def _seen(spans: list[tuple[float, float]], time: Array, weight: Array) -> list[slice]:
    """Samples of the spans that have enough of them."""
    parts = [slice(*np.searchsorted(time, span).tolist()) for span in spans]
    return [part for part in parts if weight[part].sum() >= LEAST_SAMPLES]


def _samples(parts: list[slice], time: Array, extension: Array, weight: Array) -> _Samples:
    index = np.concatenate([np.arange(part.start, part.stop) for part in parts])
    owner = np.repeat(np.arange(len(parts)), [part.stop - part.start for part in parts])
    return _Samples(time[index], extension[index], owner, weight[index])


def _ripple(samples: _Samples, rates: Array, origin: float, noise: float) -> Ripple:
    numbers, rest = samples.fitted(rates, origin)
    scale = max(noise**2, rest / max(float(samples.weight.sum()) - len(samples.count) - 3, 1.0))
    error = math.sqrt(2 * scale / float(samples.weight.sum()))
    return Ripple(origin, rates, numbers[: len(rates)], numbers[len(rates) :], error)


def _shared(rate: float, lasting: float, starts: Array) -> bool:
    if rate * 2 * lasting / (2 * math.pi) >= OSCILLATES:  # a middle half is half of a stick
        return True
    return len(starts) > LEAST_STICKS + 1 and abs(np.mean(np.exp(1j * rate * starts))) < IN_STEP


def _coarse(samples: _Samples) -> _Samples:
    """Means of parts of the first sticks, in which slow lines are looked for."""
    n = int(np.searchsorted(samples.owner, MOST_STICKS))
    owner, time = samples.owner[:n], samples.time[:n]
    first = np.searchsorted(owner, np.arange(owner[-1] + 1))
    size = np.bincount(owner)
    part = owner * STICK_PARTS + (np.arange(n) - first[owner]) * STICK_PARTS // size[owner]
    weight: Array = np.bincount(part, samples.weight[:n]).astype(np.float64)
    used = weight > 0
    means = [np.bincount(part, samples.weight[:n] * one[:n])[used] / weight[used] for one in (time, samples.values)]
    return _Samples(means[0], means[1], np.flatnonzero(used) // STICK_PARTS, weight[used])


def _candidates(
    samples: _Samples, coarse: _Samples, rates: Array, origin: float, step: float, lasting: float
) -> list[float]:
    """Angular frequencies at which what the lines of `rates` leave may have another."""
    found: list[float] = []
    # slower than a stick: as they are, the levels of the sticks taken out of each
    span = float(coarse.time[-1] - coarse.time[0])
    slow = 2 * math.pi * np.arange(1.0, 1.5 * span / lasting, 0.25) / span
    rest = coarse.left(rates, origin)
    if len(slow):
        power = np.zeros(len(slow))
        for block in np.array_split(np.arange(len(slow)), max(len(slow) * len(rest) // 1_000_000, 1)):
            columns = coarse.cleared(coarse.waves(slow[block], origin))
            cosines, sines = columns[:, : len(block)], columns[:, len(block) :]
            w = coarse.weight[:, None]
            a, b, c = ((w * p * q).sum(axis=0) for p, q in ((cosines, cosines), (cosines, sines), (sines, sines)))
            p, q = (w * cosines).T @ rest, (w * sines).T @ rest
            determinant = np.maximum(a * c - b * b, 1e-9 * (a + c) ** 2)
            power[block] = (c * p * p - 2 * b * p * q + a * q * q) / determinant
        found += slow[_peaks(power)].tolist()
    # faster: the spectrum of all sticks, zero between them
    position = np.round((samples.time - samples.time[0]) / step).astype(np.int64)
    even = np.bincount(position, samples.weight * samples.left(rates, origin))
    size = 1 << math.ceil(math.log2(4 * len(even)))
    fast = 2 * math.pi * np.fft.rfftfreq(size, step)
    inside = (fast > 2 * math.pi / lasting) & (fast < 2 * math.pi * FASTEST / step)
    power = np.where(inside, np.abs(np.fft.rfft(even, size)) ** 2, 0.0)
    found += fast[_peaks(power)].tolist()
    return found


def _peaks(power: Array) -> list[int]:
    """The three highest peaks."""
    inner = np.flatnonzero((power[1:-1] >= power[:-2]) & (power[1:-1] > power[2:])) + 1
    return [int(i) for i in inner[np.argsort(-power[inner])][:3]]


def _refined(samples: _Samples, rates: Array, rate: float, origin: float) -> tuple[float, float]:
    """The line near a rate that leaves least, and what it leaves."""
    width = 2 * math.pi / float(samples.time[-1] - samples.time[0])

    def left(trial: float) -> float:
        return samples.fitted(np.append(rates, trial), origin)[1]

    bounds = (max(rate - width / 2, width / 4), rate + width / 2)
    found = minimize_scalar(left, bounds=bounds, method="bounded", options={"xatol": 1e-3 * width})
    return float(found.x), float(found.fun)
