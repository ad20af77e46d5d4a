"""The figures of measurements, from synthetic records of our model."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from stickslip.files.arrays import Array
from stickslip.identification.estimator.hat_functions import hats_at
from stickslip.measurement import Rig, measure
from stickslip.measurement.signals.turning_points import turning_points
from stickslip.paper.default_calibration import oscillator
from stickslip.paper.figures.motion import TITLE
from stickslip.show import BRANCH_COLOURS, OKABE_ITO, new_axes
from stickslip.show.canvas import words
from stickslip.simulation.simulate import simulate

_NOISE, _STEP, _SEED = 1e-3, 0.02, 20190


def measured_displacement(drive_velocities: Sequence[float] = (0.15, 0.30, 0.45)) -> list[Axes]:
    """Fig. 3: displacement over time at several drive velocities, sampled from our model with noise.

    Parameters
    ----------
    drive_velocities : one panel each.
    """
    panels = new_axes(len(drive_velocities), 1, figsize=(6.4, 1.35 * len(drive_velocities)), sharex=True, sharey=True)
    for ax, s in zip(panels, drive_velocities, strict=True):
        t, x, regime = _record(s, 0.0, 70.0)
        ax.plot(t, x, color=OKABE_ITO["blue"], lw=0.8)
        ax.set_title(f"s = {s:.2f}: {words(regime)}, synthetic", **TITLE)
        ax.set_ylabel("position x\n(dimensionless)")
    panels[-1].set_xlabel("time t (dimensionless)")
    panels[0].margins(x=0)
    return panels


def measured_friction(drive_velocities: Sequence[float] = (0.27, 0.30, 0.34)) -> list[Axes]:
    """Fig. 4: friction over slip velocity from synthetic records, and piecewise-linear least squares by the sign of ẇ.

    Parameters
    ----------
    drive_velocities : of almost-harmonic vibration, one panel each.
    """
    columns = len(drive_velocities)
    panels = new_axes(1, columns, figsize=(3.3 * columns, 3.0), sharex=True, sharey=True)
    for ax, s in zip(panels, drive_velocities, strict=True):
        t, x, _ = _record(s, 100.0, 80.0)
        friction = measure({"t": t, "x": x}, Rig.of(oscillator(s)))
        w, force = friction["slip_velocity"].to_numpy(), friction["force"].to_numpy()
        inner = slice(w.size // 20, -w.size // 20)
        w, force = w[inner], force[inner]
        rising = _rising(w)
        # Three lines up, the climb, the upper and the common one; two down.
        ax.plot(w, force, ".", ms=1, color=OKABE_ITO["grey"], rasterized=True, label="record")
        for mask, count, name, dashes, label in (
            (rising, 4, "upper", "-", "ẇ > 0"),
            (~rising, 3, "lower", "--", "ẇ < 0"),
        ):
            nodes, values = fit_lines(w[mask], force[mask], count)
            ax.plot(nodes, values, color=BRANCH_COLOURS[name], lw=1.6, ls=dashes, label=label)
        ax.set_title(f"s = {s:.2f}, synthetic", **TITLE)
        ax.set(xlabel="slip velocity w (dimensionless)", ylabel="friction f (dimensionless)")
        ax.label_outer()
    panels[-1].legend(fontsize=8, frameon=False, markerscale=6)
    return panels


def _rising(w: Array) -> NDArray[np.bool_]:
    """Whether w goes from a valley to a peak: its slope at one sample has the sign of the noise near a turn."""
    valleys, peaks = turning_points(w, 0.5 * float(np.ptp(w)))
    turns = sorted(valleys + peaks)
    first_rises = bool(turns) and turns[0] in peaks
    rises: NDArray[np.bool_] = (np.searchsorted(turns, np.arange(w.size), side="right") % 2 == 0) == first_rises
    return rises


def fit_lines(w: Array, force: Array, nodes: int) -> tuple[Array, Array]:
    """Continuous piecewise-linear least squares with the inner nodes where they fit best.

    By descent from nodes even in w and from nodes even in the number of points, the better of the two.

    Parameters
    ----------
    w, force : points, shape (n,).
    nodes : how many, the ends of w included.

    Returns
    -------
    Abscissae and ordinates of the nodes.

    >>> w = np.linspace(0, 1, 101)
    >>> at, values = fit_lines(w, np.abs(w - 0.3), 3)
    >>> at.round(3).tolist()
    [0.0, 0.3, 1.0]
    """

    def misfit(at: Array) -> tuple[float, Array]:
        hats = hats_at(w, at)
        values: Array = np.asarray(np.linalg.lstsq(hats, force, rcond=None)[0], float)
        return float(np.square(hats @ values - force).sum()), values

    def descend(at: Array) -> tuple[float, Array, Array]:
        best, values = misfit(at)
        width = 0.25 * float(np.ptp(w))
        while width > 5e-4 * np.ptp(w):
            moved = False
            for i in range(1, nodes - 1):
                for step in (width, -width):
                    trial = at.copy()
                    trial[i] += step
                    if all(b - a > 1e-3 * np.ptp(w) for a, b in pairwise(trial)):
                        found, ordinates = misfit(trial)
                        if found < best:
                            at, best, values, moved = trial, found, ordinates, True
            width = width if moved else width / 2
        return best, at, values

    even = np.linspace(0, 1, nodes)
    starts = (np.quantile(w, even), float(w.min()) + float(np.ptp(w)) * even)
    return min((descend(start) for start in starts), key=lambda found: found[0])[1:]


def _record(s: float, start: float, duration: float) -> tuple[Array, Array, str]:
    """Time, noisy position and regime."""
    orbit = simulate(oscillator(s), max(start + duration, 200.0))
    t = np.arange(0.0, duration, _STEP)
    x = orbit.at(start + t)[0]
    return t, x + _NOISE * np.random.default_rng(_SEED).standard_normal(t.size), orbit.regime()
