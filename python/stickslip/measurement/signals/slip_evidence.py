"""The evidence of a slip: how likely the record makes it that the mass slips between two times."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import numpy.typing as npt
from scipy.interpolate import BSpline
from scipy.linalg import LinAlgError

from stickslip import _core
from stickslip.files.arrays import Array
from stickslip.measurement.signals.piecewise_fit import DEGREE, OscillatorConstants
from stickslip.measurement.signals.sampling import mean_step


@dataclass(frozen=True)
class Evidence:
    """-2 log likelihood of a stretch as a function of the level U it shares with its neighbour: a U^2 - 2 b U + c."""

    square: float
    linear: float
    constant: float

    def __add__(self, other: Evidence) -> Evidence:
        return Evidence(self.square + other.square, self.linear + other.linear, self.constant + other.constant)

    def integrated(self) -> float:
        """The level integrated out."""
        return float(integrated_evidence(self.square, self.linear, self.constant))


def integrated_evidence(square: npt.ArrayLike, linear: npt.ArrayLike, constant: npt.ArrayLike) -> Array:
    """The evidences of :class:`Evidence` with these numbers, the level integrated out."""
    return np.asarray(np.asarray(constant) - np.square(linear) / square + np.log(square))


@dataclass(frozen=True)
class SlipModel:
    """A record's slip path u = V t - x and the prior on its slips.

    A slip is a quintic spline whose friction force does a random walk of the strength that the cut-off says (the
    penalty of `PiecewiseFit` read as a prior), so that slips of different length compare by their evidence.

    Attributes
    ----------
    time, path, weight : (n,) as in `PiecewiseFit`.
    oscillator : m, D, k, V.
    noise : standard deviation of the path's samples.
    knots : distance of knots in s.
    cutoff : of the slips in Hz.
    slope : df/dw right after a break-away in N s/m, about which friction does its random walk: it falls as the slip speeds
        up, in every slip alike, and a walk about a constant would see each release late to make up for the fall.
    decay : of that slope with the time since the break-away, in 1/s.
    """

    time: Array
    path: Array
    weight: Array
    oscillator: OscillatorConstants
    noise: float
    knots: float
    cutoff: float
    slope: float = 0.0
    decay: float = 0.0

    @property
    def step(self) -> float:
        """Sampling interval in s."""
        return mean_step(self.time)

    def slip(self, start: float, end: float, origin: float, joined: str, soft: bool = False) -> Evidence:
        """Evidence of a slip that meets a stick (u = U, u' = 0) at its ``"start"`` or ``"end"``, or ``"nowhere"``.

        A `soft` joint has u'' = 0 too: the friction force does not jump there, and as df/dt = f'(w) w' with w' growing
        from zero, the random walk sets off as w' does while the friction still bears: like sqrt(k/m) t.
        """
        found = _core.slip_evidence(
            (self.time, self.path, self.weight),
            self._numbers,
            _pieces(max(math.ceil((end - start) / self.knots), 2)),
            (start, end, origin),
            joined,
            soft,
        )
        if found is None:
            raise LinAlgError("the samples do not tell the slip")
        return Evidence(*(found if joined != "nowhere" else (1.0, 0.0, found[2])))

    @cached_property
    def _numbers(self) -> tuple[tuple[float, float, float, float], tuple[float, float, float], tuple[float, float]]:
        o = self.oscillator
        system, record = (o.mass, o.damping, o.stiffness, o.drive_velocity), (self.noise, self.cutoff, self.step)
        return system, record, (self.slope, self.decay)


@lru_cache(maxsize=512)
def _pieces(count: int) -> Array:
    """Splines on `count` intervals of length one, as polynomials in each: (count, power, spline)."""
    knots = np.concatenate([np.zeros(DEGREE), np.arange(count + 1.0), np.full(DEGREE, float(count))])
    spline = BSpline(knots, np.eye(count + DEGREE), DEGREE)
    powers = 1 / np.array([math.factorial(p) for p in range(DEGREE + 1)])
    taylor = np.array([spline(np.arange(float(count)), nu=p) for p in range(DEGREE + 1)]) * powers[:, None, None]
    return np.stack([taylor[:, i, i : i + DEGREE + 1] for i in range(count)])
