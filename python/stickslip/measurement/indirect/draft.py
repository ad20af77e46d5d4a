"""A record on its way to friction, between two stages of the indirect method."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from stickslip.files.arrays import Array
from stickslip.measurement.signals.piecewise_fit import OscillatorConstants
from stickslip.measurement.signals.presmooth import Presmoothed, natural_period
from stickslip.measurement.signals.sampling import mean_step
from stickslip.measurement.signals.spectra import Line, main_line
from stickslip.measurement.signals.turning_points import Flanks


@dataclass(frozen=True)
class Draft:
    """A record on its way to friction: its samples, the constants they are read with, and where it may stick.

    Attributes
    ----------
    time, extension, weight : (n,).
    oscillator : m, D, k, V.
    noise : standard deviation of the samples of x.
    presmoothed, flanks : a first smooth reading, and the stretches on which the spring is wound up.
    resting : whether the mass rests while it sticks, to within the noise.
    together : samples that count as one; `noise` is that of white noise of the same density.
    """

    time: Array
    extension: Array
    weight: Array
    oscillator: OscillatorConstants
    noise: float
    presmoothed: Presmoothed
    flanks: Flanks
    resting: bool
    together: float = 1.0

    @property
    def step(self) -> float:
        """Sampling interval in s."""
        return mean_step(self.time)

    @property
    def path(self) -> Array:
        """The slip path V t - x, (n,)."""
        path: Array = self.oscillator.drive_velocity * (self.time - self.time[0]) - self.extension
        return path

    @property
    def knots(self) -> float:
        """Distance in s of the knots in a slip."""
        return max(min(natural_period(self.oscillator) / 25, 0.2 / self.presmoothed.cutoff), 2 * self.step)

    @property
    def blur(self) -> float:
        """Standard error of w at a sample over V, away from events."""
        return self.presmoothed.rate_error / self.oscillator.drive_velocity

    def line(self, acceleration: Array, rate: float = 0.0) -> Line:
        """Main line of an acceleration at the times of the record; `rate` as of :func:`main_line`."""
        even = np.linspace(self.time[0], self.time[-1], len(self.time))
        return main_line(np.interp(even, self.time, acceleration), self.step, rate=rate)

    def with_stiffness(self, ratio: float) -> Draft:
        """The same spring forces by another stiffness."""
        presmoothed = self.presmoothed
        return replace(
            self,
            oscillator=replace(self.oscillator, stiffness=self.oscillator.stiffness * ratio),
            extension=self.extension / ratio,
            noise=self.noise / ratio,
            presmoothed=replace(
                presmoothed,
                extension=presmoothed.extension / ratio,
                rate=presmoothed.rate / ratio,
                rate_error=presmoothed.rate_error / ratio,
                noise=self.noise / ratio,
            ),
        )
