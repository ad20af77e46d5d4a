"""The drive velocities at which the kind of motion changes, found directly."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from stickslip.documents import number
from stickslip.errors import InputError
from stickslip.stability.branch import Branch, SpecialPoint
from stickslip.stability.branches import lies_on
from stickslip.stability.cycles import periodic_orbit
from stickslip.stability.equilibria import criticality, hopf_points
from stickslip.stability.returns import forcing_period
from stickslip.stability.shooting import Family, Lost, axis, corrected
from stickslip.stability.trail import check_one, with_number
from stickslip.stability.walk import Walk
from stickslip.system import Oscillator

_PATH = "/drive_velocity"
_BORDERS = ("grazing_sliding", "crossing_sliding", "switching_sliding", "adding_sliding", "nonsmooth_fold", "fold")
#: Speeds from low to high at which the motion from rest is looked at.
_STARTS = 24


@dataclass(frozen=True)
class CriticalVelocities(Mapping[str, float]):
    """Critical drive velocities by name, the lowest of each; `all` has every one.

    `criticality` says whether the cycle born at a smooth Hopf point is stable.
    """

    all: tuple[tuple[str, float], ...]
    criticality: str | None = None
    special_points: tuple[SpecialPoint, ...] = field(default=(), repr=False)

    def __getitem__(self, name: str) -> float:
        values = [value for kind, value in self.all if kind == name]
        if not values:
            raise KeyError(name)
        return min(values)

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys(kind for kind, _ in self.all))

    def __len__(self) -> int:
        return len({kind for kind, _ in self.all})

    def __repr__(self) -> str:
        return f"<CriticalVelocities {', '.join(f'{kind} {value:.12g}' for kind, value in self.all) or 'none'}>"


def critical_velocities(system: Oscillator, bounds: tuple[float, float] | None = None) -> CriticalVelocities:
    """The drive velocities at which steady slip loses its stability and at which stick-slip and slip cycles end.

    Steady slip: the zeros of D + F′(s), and the corners of a piecewise-linear law at which that changes its sign by a jump.
    Cycles: the motion from rest and the slip cycle are followed over the drive velocity until a test function of a sliding
    bifurcation vanishes, a fold turns them back, or they shrink to a point; each is a root of its own condition by Newton's
    method.

    Parameters
    ----------
    system : an oscillator of one mass without forcing; its own drive velocity does not matter.
    bounds : (low, high) of the drive velocity that is searched; default from a hundredth of F_s/√(k m) to three times that.

    Returns
    -------
    Mapping of the names that exist to drive velocities: ``"hopf"``, ``"nonsmooth_hopf"`` (corner of the law, or a cycle that
    shrinks linearly to a point), ``"end_of_stick_slip"`` (the greatest velocity up to which the stick-slip cycle from rest
    exists), ``"nonsmooth_fold"``, ``"grazing_sliding"``, ``"fold"``. ``.criticality`` says by F‴(s) whether the cycle at the
    smooth Hopf point is stable.

    Raises
    ------
    InputError
        for a forced system or bounds that make no sense.

    Limits: cycles that are reached neither from rest nor from beside steady slip are not looked for.

    Source: Thomsen & Fidlin, Int. J. Non-Linear Mech. 38 (2003) 389; Leine & Nijmeijer 2004 (LNACM 18), ch. 8.

    >>> from stickslip.laws import ExponentialStribeck
    >>> found = critical_velocities(Oscillator(0.1, 1.0, ExponentialStribeck(1.0, 0.5, 0.5)))
    >>> round(found["hopf"], 12), found.criticality, round(found["nonsmooth_fold"], 7)
    (1.151292546497, 'subcritical', 1.836601)
    """
    check_one(system, "critical_velocities")
    if forcing_period(system) is not None:
        raise InputError("critical_velocities: the system is forced; use continuation over drive_velocity")
    scale = system.law.break_away_force() / (system.stiffness * system.mass) ** 0.5
    low, high = bounds if bounds is not None else (0.01 * scale, 3 * scale)
    low, high = number("low", low, "critical_velocities"), number("high", high, "critical_velocities")
    if not 0 < low < high:
        raise InputError(
            f"critical_velocities: bounds must be (low, high) with 0 < low < high, got ({low:g}, {high:g})"
        )
    steady = hopf_points(system, _PATH, (low, high))
    found: list[tuple[str, float]] = list(steady)
    smooth = [value for kind, value in steady if kind == "hopf"]
    nature = criticality(system, _PATH, smooth[-1], high - low) if smooth else None
    family = Family((_PATH,), ((low, high),), relative=True)
    points: list[SpecialPoint] = []
    end = None
    branches: list[Branch] = []
    for value, guess in _starts(system, (low, high), found):
        branch = _branch(with_number(system, _PATH, value), value, guess, family, branches)
        if branch is None:
            continue
        branches.append(branch)
        for point in branch.special_points:
            if all(abs(point.parameter - other.parameter) > 1e-6 * (high - low) for other in points):
                points.append(point)
        sticking = [v for v, sticks in zip(branch.values, branch.sticks, strict=True) if sticks]
        if sticking:
            last = max(sticking)
            ends = [
                p.parameter
                for p in branch.special_points
                if p.kind in _BORDERS and abs(p.parameter - last) < 0.05 * last
            ]
            if ends and last < 0.999 * high:
                end = max([*ends, end or 0.0])
    found += [(p.kind, p.parameter) for p in points if p.kind in (*_BORDERS, "nonsmooth_hopf")]
    if end is not None:
        found.append(("end_of_stick_slip", end))
    return CriticalVelocities(tuple(found), nature, tuple(points))


def _starts(
    system: Oscillator, bounds: tuple[float, float], steady: list[tuple[str, float]]
) -> Iterator[tuple[float, tuple[float, float] | None]]:
    """Drive velocities and starts that lie on different cycles: from rest at low speed, a slip cycle below a Hopf point."""
    low, high = bounds
    # A cycle that exists over a tenth of its speed is met at one of these at least.
    for speed in np.geomspace(max(low, 1e-3 * high), high, _STARTS + 2)[1:-1]:
        yield float(speed), None
    for _, value in steady:
        for share in (0.97, 1.01):
            speed = share * value
            x = float(system.law.kinetic_force(speed)) / system.stiffness
            if low < speed < high:
                yield speed, (x, 0.1 * speed)


def _branch(system: Oscillator, value: float, guess: Any, family: Family, known: list[Branch]) -> Branch | None:
    try:
        cycle = periodic_orbit(system, guess, t_end=None if guess is None else 150 * system.natural_period)
        if any(lies_on(branch, cycle, value) for branch in known):
            return None
        trail = cycle.closed.trail
        start = corrected(trail, cycle.turns, family, np.array([value]), axis(trail))
    except (InputError, Lost):
        return None
    way = start.direction * (1.0 if start.direction[-1] > 0 else -1.0)
    up = Walk(family, 200).go(type(start)(start.here, start.values, way))
    down = Walk(family, 60).go(type(start)(start.here, start.values, -way)) if not cycle.sticks else None
    return up if down is None else down.reversed().joined(up)
