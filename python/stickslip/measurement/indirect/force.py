"""The indirect method: friction force and slip velocity from a record whose sticks are known."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import erfc

from stickslip.files.arrays import Array, Mask
from stickslip.measurement.indirect.sticks.stick import Stick
from stickslip.measurement.signals.piecewise_fit import Part, PiecewiseFit
from stickslip.measurement.signals.sample_runs import runs_of

FEWEST_SLIPS, LEAST_OF_SLIP = 5, 20
"""Slips that tell how they swing, and samples of each."""
MOST_SAMPLES = 30_000
"""Samples from the beginning of a record by which its inertia is judged."""


class Release(NamedTuple):
    """A break-away as the slip after it tells it.

    Attributes
    ----------
    later, error : time in s by which it is later than the end of the stick, and its standard error.
    higher, force_error : force in N by which it is higher than at the end of the stick, and the standard error of the force:
        a stick that is seen too high seems to release too late, so the two errors take from each other.
    """

    later: float
    error: float
    higher: float
    force_error: float


@dataclass(frozen=True)
class Friction:
    """Friction force over time, with what it was computed from.

    force = k x + D x' + m x'' and slip_velocity = V - x', from a fit that is smooth inside every piece between events,
    has one value and one slope across an event, and may jump in x'' there.

    Attributes
    ----------
    time : (n,) seconds.
    extension, velocity : (n,) x and x'.
    slip_velocity, slip_acceleration : (n,) w and w'.
    force, force_error : (n,) friction and its standard error (noise, smoothing and the time of events; not the rig's
        own constants).
    stuck : (n,) whether the sample lies inside a stick.
    noise : residual standard deviation of x; where noise is coloured, of white noise of the same density.
    cutoff : in Hz, of slips and creeping sticks.
    fit : the pieces.
    releases : end of a stick -> its break-away, where the slips tell it better.
    late : standard error in s by which all break-aways may be seen early or late together, beside what sets them apart.
    untold : time in s by which the sticks end later if the force jumps there, where the record does not tell; else 0.
    common : standard error in N that all forces of the record share.
    low_pass : time constant in s of a filter ahead of the converter that the noise shows; 0 where it shows none.
    added : time of a break-away -> force of a ripple of the drive there, which the fit does not hold, and its rate.
    """

    time: Array
    extension: Array
    velocity: Array
    slip_velocity: Array
    slip_acceleration: Array
    force: Array
    force_error: Array
    stuck: Mask
    noise: float
    cutoff: dict[Part, float]
    fit: PiecewiseFit
    releases: dict[float, Release] = field(default_factory=dict)
    late: float = 0.0
    untold: float = 0.0
    common: float = 0.0
    low_pass: float = 0.0
    added: dict[float, tuple[float, float]] = field(default_factory=dict)

    def with_common_error(self, error: float) -> Friction:
        """With another standard error that all its forces share."""
        return replace(self, common=math.hypot(self.common, error), force_error=np.hypot(self.force_error, error))

    def with_late_error(self, error: float) -> Friction:
        """With another standard error that the times of all break-aways share."""
        return replace(self, late=math.hypot(self.late, error))


def friction_force(fit: PiecewiseFit, sticks: list[Stick]) -> Friction:
    """Friction force, slip velocity and their errors at the samples of the fit."""
    o, time = fit.oscillator, fit.time
    w = fit.evaluate(time, 1)
    slip_acceleration = fit.evaluate(time, 2)
    extension = o.drive_velocity * (time - time[0]) - fit.evaluate(time, 0)
    velocity = o.drive_velocity - w
    force = o.stiffness * extension + o.damping * velocity - o.mass * slip_acceleration
    # the error is smooth, so a long record needs it at its knots only
    positions = np.unique(np.concatenate(fit.knots))
    coarse = fit.deviation(positions, {0: o.stiffness, 1: o.damping, 2: o.mass}, fit.noise)
    return Friction(
        time=time,
        extension=extension,
        velocity=velocity,
        slip_velocity=w,
        slip_acceleration=slip_acceleration,
        force=force,
        force_error=np.hypot(np.interp(time, positions, coarse), _misplaced(fit, sticks)),
        stuck=np.array([kind != "slip" for kind in fit.kinds])[fit.piece(time)],
        noise=fit.noise,
        cutoff=fit.cutoff,
        fit=fit,
    )


def _misplaced(fit: PiecewiseFit, sticks: list[Stick]) -> Array:
    """Error of samples that may lie on the other side of an event, where the force jumps: the jump times sqrt(p)."""
    error = np.zeros(len(fit.time))
    events = [(s.start, s.start_error) for s in sticks if s.starts] + [(s.end, s.end_error) for s in sticks if s.ends]
    if not events:
        return error
    at = np.array([event[0] for event in events])
    aside = 1e-6 * fit.step
    jumps = fit.oscillator.mass * np.abs(fit.evaluate(at + aside, 2) - fit.evaluate(at - aside, 2))
    for (position, spread), jump in zip(events, jumps, strict=True):
        spread = max(spread, fit.step / 4)
        near = slice(*np.searchsorted(fit.time, [position - 4 * spread, position + 4 * spread]))
        probability = 0.5 * erfc(np.abs(fit.time[near] - position) / (math.sqrt(2) * spread))
        error[near] = np.hypot(error[near], jump * np.sqrt(probability))
    return error


def restoring_excess(friction: Friction) -> tuple[float, float]:
    """Part of the stiffness that the swing of the slips does not show, with its standard error by the scatter of slips.

    With a stiffness k (1 + e) instead of k the force of a slip is f(w) + e k x. A slip passes each slip velocity twice, at
    two extensions, so e is told from any f: the force is fitted with e k x, a polynomial of degree four in w and a level of
    each slip. An inertia that is wrong by the part -e looks the same.

    Parameters
    ----------
    friction : a measured record; its slips that begin and end in it are used, without a tenth at each end.

    Returns
    -------
    excess, error : 0 and infinity with fewer than `FEWEST_SLIPS` slips of `LEAST_OF_SLIP` samples.
    """
    last = len(friction.stuck)
    spans = [(a, b) for a, b in runs_of(~friction.stuck) if a > 0 and b < last and b - a >= LEAST_OF_SLIP]
    if len(spans) < FEWEST_SLIPS:
        return 0.0, math.inf
    slips = [np.arange(a + (b - a) // 10, b - (b - a) // 10) for a, b in spans]
    fastest = float(max(np.abs(friction.slip_velocity[slip]).max() for slip in slips))
    parts = []
    for slip in slips:
        powers = [(friction.slip_velocity[slip] / fastest) ** power for power in range(1, 5)]
        rows = np.column_stack(
            [friction.fit.oscillator.stiffness * friction.extension[slip], *powers, friction.force[slip]]
        )
        rows = rows - rows.mean(axis=0)
        parts.append(rows.T @ rows)
    products = np.array(parts)

    def excess(of: Array) -> float:
        return float(np.linalg.lstsq(of[:-1, :-1], of[:-1, -1], rcond=None)[0][0])

    whole = products.sum(axis=0)
    without = np.array([excess(whole - one) for one in products])
    count = len(products)
    return excess(whole), math.sqrt((count - 1) / count * float(np.sum((without - without.mean()) ** 2)))


def likeliest_inertia(friction: Friction) -> tuple[float, float]:
    """Inertia in kg under which the friction force of the slips comes out smoothest, with its standard error.

    The fit prefers a friction force that changes little, so the likelihood of the record under it, with the cut-off
    free, tells which inertia leaves the least change; unlike a regression on the third derivative it is not biased by
    noise. A law that changes steeply with velocity shifts it: it is a check on the mass and not a measurement of it.

    Parameters
    ----------
    friction : a measured record.

    Returns
    -------
    inertia, error : NaN where no inertia between 0.25 and 2.5 times the one used is likeliest.
    """
    fit, o = friction.fit, friction.fit.oscillator
    n = min(len(friction.time), MOST_SAMPLES)
    end = friction.time[n - 1]
    count = max(int(np.searchsorted(fit.breaks, end)), 1)
    breaks, kinds = np.append(fit.breaks[:count], end), fit.kinds[:count]
    if "slip" not in kinds:
        return float("nan"), float("nan")
    others: dict[Part, float] = {part: value for part, value in fit.cutoff.items() if part != "slip"}
    limits = (fit.cutoff["slip"] / 2.5, fit.cutoff["slip"] * 2.5)

    def deviance(log_factor: float) -> float:
        trial = replace(o, mass=o.mass * math.exp(log_factor))
        part = PiecewiseFit(
            friction.time[:n],
            fit.path[:n],
            fit.weight[:n],
            breaks,
            kinds,
            trial,
            fit.slip_knots,
            fit.creep_knots,
            fit.together,
        )
        return part.deviance({**others, "slip": part.best_cutoff("slip", limits, others)})

    low, high = math.log(0.25), math.log(2.5)
    found = minimize_scalar(deviance, bounds=(low, high), method="bounded", options={"xatol": 0.01, "maxiter": 14})
    best, h = float(found.x), 0.15
    if min(best - low, high - best) < 0.05:
        return float("nan"), float("nan")
    curvature = (deviance(best - h) + deviance(best + h) - 2 * float(found.fun)) / h**2
    if curvature <= 0:
        return float("nan"), float("nan")
    inertia = o.mass * math.exp(best)
    return inertia, inertia * math.sqrt(2 / curvature)
