"""Motions that starts in the plane end in, and whether a branch has them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from stickslip.dynamics.basins_of_attraction import basins
from stickslip.dynamics.continuation.branch import Branch, OtherMotion, crossings
from stickslip.model.system import Oscillator

#: How far beyond the motions that are known starts lie, over their extent.
_BEYOND = 1.5
#: Two motions whose extremes differ by less than this share of the larger extent are one.
_SAME = 0.1
#: A motion smaller than this share of the extent of the starts is none.
_REST = 1e-6


def other_motions(system: Oscillator, value: float, branches: Sequence[Branch], starts: int) -> Iterator[OtherMotion]:
    """The motions that a grid of starts ends in and that no branch has, asked of each when it is its turn.

    Parameters
    ----------
    system : at the `value` of the parameter.
    branches : what is known; more may be added in between.
    starts : how many positions and how many velocities, over one and a half times the extent of what is known.
    """
    low, high = _reach(system, branches)
    middle, half = (low + high) / 2, _BEYOND * (high - low) / 2
    grid = np.linspace(-1.0, 1.0, starts) * half
    frequency = 2 * np.pi / system.natural_period
    # Beside symmetries, at which a start may stay where hardly any other does.
    found = basins(system, x=middle + grid + 0.01 * half, v=frequency * (grid + 0.007 * half), progress=lambda *_: None)
    regimes = found["attractor_regime"].values.tolist()
    for number, regime in enumerate(regimes):
        x = (found["attractor_x_min"].values[number].item(), found["attractor_x_max"].values[number].item())
        if regime in ("diverged", "unfinished", "at_rest") or not np.isfinite(x).all():
            continue
        if any(_has(branch, value, x, half) for branch in branches):
            continue
        row, column = np.argwhere(found["label"].transpose("x", "v").values == number)[0]
        start = (found["x"].values[row].item(), found["v"].values[column].item())
        repeats = found["attractor_recurrence"].values[number] == "periodic"
        yield OtherMotion(value, str(regime), x, start, bool(repeats))


def _reach(system: Oscillator, branches: Sequence[Branch]) -> tuple[float, float]:
    """The range of positions of the branches, and of small ones as much as adhesion and the drive can move the mass."""
    low = min(min(branch.x_min) for branch in branches)
    high = max(max(branch.x_max) for branch in branches)
    speed = system.drive_velocity if isinstance(system.drive_velocity, float | int) else 0.0
    least = float(system.law.break_away_force()) / system.stiffness + abs(speed) * system.natural_period / np.pi
    short = max(least - (high - low), 0.0)
    return low - short / 2, high + short / 2


def _has(branch: Branch, value: float, x: tuple[float, float], reach: float) -> bool:
    """Whether a branch has a motion of that range at the value."""
    near, shares = crossings(branch, value)
    size = max(x[1] - x[0], _REST * reach)
    for column, end in ((branch.x_min, x[0]), (branch.x_max, x[1])):
        ends = np.asarray(column)
        at = ends[near] + shares * (ends[near + 1] - ends[near])
        far = np.abs(ends[near + 1] - ends[near])
        near, shares = (part[np.abs(at - end) < _SAME * size + far] for part in (near, shares))
    return bool(near.size)
