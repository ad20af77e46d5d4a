"""Branches of steady slip and of periodic orbits in one parameter, with the points where their kind changes."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.documents import number
from stickslip.errors import InputError
from stickslip.stability.cycles import (
    PeriodicOrbit,
    Return,
    amplitude,
    find,
    finished,
    forcing_period,
    multipliers_of,
    one_period,
    periodic_orbit,
    size_of,
)
from stickslip.stability.equilibria import hopf_points, steady_slip
from stickslip.stability.shooting import (
    Family,
    Label,
    Lost,
    Point,
    consistent,
    corrected,
    name_of,
    on_border,
    stepped,
    worst,
)
from stickslip.stability.trail import SECTION, STATE, Trail, check, pointer, read, with_number
from stickslip.system import Oscillator

if TYPE_CHECKING:
    import xarray as xr

_V, _PARAMETER = 2, len(STATE)
_AXIS = np.eye(_PARAMETER + 1)[_PARAMETER]
_SMALLEST, _LARGEST = 1e-5, 0.04


@dataclass(frozen=True)
class SpecialPoint:
    """Where a branch changes: its kind, the value of the parameter there, and the orbit.

    kind is ``"fold"``, ``"flip"``, ``"neimark_sacker"``, ``"branch_point"``, ``"hopf"``, ``"nonsmooth_hopf"``,
    ``"grazing_sliding"``, ``"crossing_sliding"``, ``"switching_sliding"``, ``"adding_sliding"``, ``"grazing_node"``, or
    ``"nonsmooth_fold"``, a border beyond which two orbits of different event sequences are gone together.
    """

    kind: str
    parameter: float
    #: The border that vanishes there, as named above; empty where none does.
    border: str = ""
    #: Position range of the orbit there.
    x: tuple[float, float] = (math.nan, math.nan)
    point: Point | None = field(default=None, repr=False, compare=False)
    label: Label | None = field(default=None, repr=False, compare=False)


@dataclass
class Branch:
    """One curve of motions: a row a point.

    Attributes
    ----------
    kind : ``"steady_slip"`` or ``"cycle"``.
    values : the parameter along the curve, shape (n,).
    stable : shape (n,).
    period, multiplier : NaN on steady slip; the multiplier is the largest that is not the 1 of an autonomous cycle, for
        steady slip the growth rate of small disturbances.
    x_min, x_max : range of the position.
    sticks : whether adhesion is a part of the motion.
    special_points : in the order of the curve.
    """

    kind: str
    values: list[float] = field(default_factory=list)
    stable: list[bool] = field(default_factory=list)
    period: list[float] = field(default_factory=list)
    multiplier: list[float] = field(default_factory=list)
    x_min: list[float] = field(default_factory=list)
    x_max: list[float] = field(default_factory=list)
    sticks: list[bool] = field(default_factory=list)
    special_points: list[SpecialPoint] = field(default_factory=list)

    def add(self, cycle: PeriodicOrbit, value: float) -> None:
        """One more point."""
        worst_one = np.abs(cycle.multipliers[0 if cycle.turns else 1 :]).max()
        low, high = _range(cycle)
        row = (value, cycle.stable, cycle.period, float(worst_one), low, high, cycle.sticks)
        for name, item in zip(_COLUMNS, row, strict=True):
            getattr(self, name).append(item)

    def reversed(self) -> Branch:
        """The same curve from its other end."""
        columns = {name: getattr(self, name)[::-1] for name in _COLUMNS}
        return Branch(self.kind, **columns, special_points=self.special_points[::-1])

    def joined(self, other: Branch) -> Branch:
        """The curve of both, where the other starts at the end of this one."""
        columns = {name: getattr(self, name) + getattr(other, name)[1:] for name in _COLUMNS}
        return Branch(self.kind, **columns, special_points=self.special_points + other.special_points)


#: Columns of a branch, in the order in which a row is made.
_COLUMNS = ("values", "stable", "period", "multiplier", "x_min", "x_max", "sticks")


@dataclass(frozen=True)
class Branches:
    """The branches of a continuation.

    Attributes
    ----------
    system, parameter, bounds : what was asked.
    branches : of :class:`Branch`.
    special_points : of all branches, by parameter.
    """

    system: Oscillator
    parameter: str
    bounds: tuple[float, float]
    branches: tuple[Branch, ...]

    @property
    def special_points(self) -> list[SpecialPoint]:
        """Those of all branches, by parameter."""
        return sorted(
            (item for branch in self.branches for item in branch.special_points), key=lambda item: item.parameter
        )

    def to_xarray(self) -> xr.Dataset:
        """The branches over ``branch`` and ``point`` (NaN where a branch has fewer), the special points over ``special``."""
        import json

        import xarray as xr

        most = max((len(branch.values) for branch in self.branches), default=0)

        def padded(name: str) -> Any:
            rows = [np.asarray(getattr(branch, name), float) for branch in self.branches]
            return ("branch", "point"), np.array(
                [np.pad(row, (0, most - row.size), constant_values=np.nan) for row in rows]
            )

        points = self.special_points
        data: dict[str, Any] = {(self.parameter if name == "values" else name): padded(name) for name in _COLUMNS}
        data |= {
            "special_kind": ("special", np.array([item.kind for item in points], dtype=str)),
            "special_border": ("special", np.array([item.border for item in points], dtype=str)),
            "special_parameter": ("special", np.array([item.parameter for item in points], float)),
            "special_x": (("special", "end"), np.array([item.x for item in points], float).reshape(-1, 2)),
        }
        attrs = {
            "title": "stickslip branches",
            "parameter": self.parameter,
            "system": json.dumps(self.system.to_dict()),
            "kinds": ", ".join(branch.kind for branch in self.branches),
        }
        return xr.Dataset(data, attrs=attrs)

    def __repr__(self) -> str:
        found = ", ".join(f"{item.kind} {item.parameter:.9g}" for item in self.special_points) or "none"
        return f"<Branches over {self.parameter}: {len(self.branches)}, special points: {found}>"


def _range(cycle: PeriodicOrbit) -> tuple[float, float]:
    x = cycle.orbit.at(np.linspace(0.0, cycle.orbit.t_end, 201))[0]
    return float(x.min()), float(x.max())


def continuation(
    system: Oscillator,
    parameter: str,
    bounds: tuple[float, float],
    *,
    guess: Any = None,
    seeds: int = 3,
    most: int = 300,
    progress: Callable[[int, int], Any] | None = None,
) -> Branches:
    """Follow steady slip and periodic orbits, stable or not, over a parameter, and locate where their kind changes.

    Pseudo-arclength continuation of the orbit held to its event sequence; test functions that vanish at the four sliding
    bifurcations, multipliers at +1, −1 and the unit circle, and zeros of the damping of steady slip are found by Newton's
    method or a bracketed root. At a sliding bifurcation the event sequence is switched and the branch goes on, back in the
    parameter where orbits on both sides of the border meet (a nonsmooth fold).

    Parameters
    ----------
    system : an oscillator of one mass; any law without an internal state.
    parameter : a number of the system document, such as ``"drive_velocity"``, ``"forcing.frequency"`` or ``"law.kinetic"``.
    bounds : (low, high) of the parameter.
    guess : as for :func:`stickslip.periodic_orbit`, at the value that the system has; default the motion from rest.
    seeds : at how many values between the bounds the motion from rest is looked at for a further branch.
    most : the most points of one branch.
    progress : called as ``progress(points, most)`` after each point of a branch.

    Returns
    -------
    Branches.

    Raises
    ------
    InputError
        for an unknown parameter, bounds that make no sense, or where no motion to start from is found.

    Limits: a branch ends where its orbit leaves the neighbourhood of the border, as with f_s > f_k where a grazing orbit is
    thrown far away; branches that no run from rest or `guess` reaches are not found.

    Source: Dercole & Kuznetsov, ACM TOMS 31 (2005) 95; Thota & Dankowicz, SIADS 7 (2008) 1283.

    >>> from stickslip.laws import Coulomb
    >>> from stickslip.system import Harmonic
    >>> swing = Oscillator(0.0, 0.0, Coulomb(0.6), forcing=Harmonic(1.0, 0.7))
    >>> [(p.kind, round(p.parameter, 10)) for p in continuation(swing, "law.kinetic", (0.55, 0.75), seeds=0).special_points]
    [('crossing_sliding', 0.7220709759)]
    """
    check(system, "continuation")
    path = pointer(system, parameter, "continuation")
    low, high = (number(name, bound, "continuation") for name, bound in zip(("low", "high"), bounds, strict=True))
    if not low < high:
        raise InputError(f"continuation: bounds must be (low, high) with low < high, got ({low:g}, {high:g})")
    family = Family((path,), ((low, high),))
    branches = []
    if forcing_period(system) is None:
        steady = _steady(system, path, family)
        if steady.values:
            branches.append(steady)
    here = read(system, path)
    starts = [(here, guess)] if low <= here <= high else []
    starts += [(low + (high - low) * (i + 0.5) / seeds, None) for i in range(seeds)]
    for value, start in starts:
        try:
            cycle = periodic_orbit(with_number(system, path, value), start)
        except InputError:
            if start is not None:
                raise
            continue
        if any(lies_on(branch, cycle, value) for branch in branches):
            continue
        branches.append(_both_ways(cycle, value, family, most, progress))
    if not branches:
        raise InputError("continuation: no periodic motion to start from: give a guess (x, v) near one")
    return Branches(system, parameter, (low, high), tuple(branches))


def lies_on(branch: Branch, cycle: PeriodicOrbit, value: float) -> bool:
    """Whether a cycle is one that the branch has already."""
    if branch.kind != "cycle":
        return False
    values = np.asarray(branch.values)
    near = np.flatnonzero((values[:-1] - value) * (values[1:] - value) <= 0)
    low, high = _range(cycle)
    size = max(high - low, 1e-300)
    return any(abs(branch.x_max[i] - high) < 0.1 * size and abs(branch.x_min[i] - low) < 0.1 * size for i in near)


def _steady(system: Oscillator, path: str, family: Family) -> Branch:
    low, high = family.ranges[0]
    branch = Branch("steady_slip")
    for value in np.linspace(low, high, 121):
        state = steady_slip(with_number(system, path, float(value)))
        if state is None:
            continue
        row = (float(value), state.growth < 0, math.nan, state.growth, state.x, state.x, False)
        for name, item in zip(_COLUMNS, row, strict=True):
            getattr(branch, name).append(item)
    for kind, value in hopf_points(system, path, (low, high)) if branch.values else ():
        state = steady_slip(with_number(system, path, value))
        x = math.nan if state is None else state.x
        branch.special_points.append(SpecialPoint(kind, value, x=(x, x)))
    return branch


def _both_ways(cycle: PeriodicOrbit, value: float, family: Family, most: int, progress: Any) -> Branch:
    start = corrected(cycle.closed.trail, cycle.turns, family, np.array([value]), _AXIS)
    halves = []
    for sign in (-1.0, 1.0):
        way = start.direction * math.copysign(1.0, start.direction[_PARAMETER]) * sign
        walk = Walk(cycle.turns, family, most, progress)
        halves.append(walk.go(replace(start, direction=way)))
    return halves[0].reversed().joined(halves[1])


@dataclass
class Walk:
    """One way along a branch of cycles."""

    turns: int
    family: Family
    most: int
    progress: Any = None
    through: bool = True
    branch: Branch = field(default_factory=lambda: Branch("cycle"))

    def go(self, point: Point) -> Branch:
        """From a point until the parameter leaves its bounds, the cycle shrinks to a point or no way goes on."""
        low, high = self.family.ranges[0]
        self._add(point)
        largest = self.branch.x_max[0] - self.branch.x_min[0]
        step = 0.01
        while len(self.branch.values) < self.most:
            if self.progress is not None:
                self.progress(len(self.branch.values), self.most)
            try:
                ahead = stepped(point, self.turns, self.family, step)
            except Lost:
                ahead = None
            if ahead is None or not consistent(ahead.here):
                border = self._border(point, ahead, step)
                if border is not None and step > 1e-3:
                    # Closer first: a fold may lie before it.
                    step /= 4
                    continue
                if border is not None:
                    onward = self._cross(*border) if self.through else None
                    if onward is None:
                        break
                    point, step = onward, 0.003
                    self._add(point)
                    continue
                step /= 2
                if step < _SMALLEST:
                    break
                continue
            turned = float(point.direction[_known(point, ahead)] @ ahead.direction[_known(point, ahead)])
            if turned < 0.9 and step > 20 * _SMALLEST:
                step /= 2
                continue
            self._between(point, ahead, step)
            if not low <= ahead.values[0] <= high:
                bound = low if ahead.values[0] < low else high
                self._finish(point, bound)
                break
            point = ahead
            self._add(point)
            size = self.branch.x_max[-1] - self.branch.x_min[-1]
            if size < 0.02 * largest:
                self._shrunk(point)
                break
            largest = max(largest, size)
            step = min(step * 1.4, _LARGEST)
        return self.branch

    def _add(self, point: Point) -> None:
        self.branch.add(finished(point.here, 0), float(point.values[0]))

    def _special(self, kind: str, point: Point, border: str = "", label: Label | None = None) -> None:
        try:
            x = _range(finished(point.here, 0))
        except InputError:
            x = (self.branch.x_min[-1], self.branch.x_max[-1])
        self.branch.special_points.append(SpecialPoint(kind, float(point.values[0]), border, x, point, label))

    def _finish(self, point: Point, bound: float) -> None:
        try:
            end = corrected(point.here.trail, self.turns, self.family, np.array([bound]), _AXIS)
            if consistent(end.here):
                self._add(end)
        except Lost:
            pass

    def _border(self, point: Point, ahead: Point | None, step: float) -> tuple[Point, Label] | None:
        """The nearest border ahead, on which one test function vanishes and none is negative."""
        now = worst(point.here)
        then = worst(ahead.here) if ahead is not None else {}
        passed = [label for label, value in now.items() if then.get(label, 1.0) < 0 <= value]
        # What was lost was lost over a test function that is small; the smallest first.
        small = sorted(now, key=lambda label: now[label])[:4]
        found: list[tuple[float, Point, Label]] = []
        for label in dict.fromkeys([*passed, *(small if ahead is None else [])]):
            try:
                border = on_border(point, self.turns, self.family, label)
            except Lost:
                continue
            distance = abs(border.values[0] - point.values[0]) / (self.family.ranges[0][1] - self.family.ranges[0][0])
            low, high = self.family.ranges[0]
            inside = low <= border.values[0] <= high and (border.here.durations > -1e-8).all()
            if inside and distance < 4 * step and min(worst(border.here).values(), default=0.0) > -1e-8:
                found.append((distance, border, border.border or label))
        if not found:
            return None
        # Of test functions that vanish together the tangency is named.
        _, border, label = min(found, key=lambda item: (round(item[0], 9), item[2][0]))
        return border, label

    def _cross(self, border: Point, label: Label) -> Point | None:
        """Switch the event sequence at a border; the first point beyond it, None where the branch ends there."""
        name = name_of(border.here, label)
        low, high = self.family.ranges[0]
        old = _sequence(border.here)
        way = (
            math.copysign(1.0, self.branch.values[-1] - self.branch.values[-2]) if len(self.branch.values) > 1 else 1.0
        )
        way = math.copysign(1.0, float(border.values[0] - self.branch.values[-1])) or way
        low_x, high_x = _extent(border.here)
        for offset, sign in itertools.product((1e-3, 3e-3, 1e-2), (way, -way)):
            value = float(border.values[0]) + sign * offset * (high - low)
            for trail, kinds in _probes(border, self.family, value, offset):
                try:
                    cut, turns = find(trail.system, trail, kinds, False, self.turns or None)
                    point = corrected(cut, turns, self.family, np.array([value]), _AXIS)
                except (InputError, Lost, IndexError):
                    continue
                if not consistent(point.here) or _sequence(point.here) == old:
                    continue
                extent = _extent(point.here)
                reach = 0.02 + 4 * math.sqrt(offset)
                if max(abs(extent[0] - low_x), abs(extent[1] - high_x)) > reach * (high_x - low_x):
                    continue
                back = sign != way
                self._special("nonsmooth_fold" if back else name, border, name, label)
                direction = point.direction * math.copysign(1.0, point.direction[_PARAMETER]) * sign
                return replace(point, direction=direction)
        self._special(name, border, name, label)
        return None

    def _between(self, point: Point, ahead: Point, step: float) -> None:
        """Folds, flips and tori between two points of one event sequence."""
        if _sequence(point.here) != _sequence(ahead.here):
            return

        def at(fraction: float) -> Point:
            return stepped(point, self.turns, self.family, fraction * step)

        for kind, test in _TESTS.items():
            before, after = test(point), test(ahead)
            if not (np.isfinite([before, after]).all() and before * after < 0):
                continue
            if kind == "branch_point" and _TESTS["fold"](point) * _TESTS["fold"](ahead) < 0:
                continue
            try:
                special = at(_root(_along(at, test), before, after))
            except Lost:
                continue
            self._special(kind, special)

    def _shrunk(self, point: Point) -> None:
        """The cycle shrinks to a point: where, by its size, which is linear at a corner and a root at a smooth Hopf point."""
        span = self.family.ranges[0][1] - self.family.ranges[0][0]
        pair: list[tuple[float, float]] = []
        expected = math.nan
        try:
            for _ in range(12):
                size = amplitude(finished(point.here, 0))
                if math.isfinite(expected) and abs(size - expected) > 0.05 * expected:
                    return  # no corner; the zero of the damping of steady slip says where
                pair = [*pair, (float(point.values[0]), size)][-2:]
                if len(pair) < 2:
                    target = pair[0][0] + math.copysign(1e-4 * span, point.direction[_PARAMETER])
                else:
                    (a, fa), (b, fb) = pair
                    root = b - fb * (b - a) / (fb - fa)
                    if math.isfinite(expected) and abs(root - b) < 1e-5 * span:
                        x = (self.branch.x_min[-1], self.branch.x_max[-1])
                        self.branch.special_points.append(SpecialPoint("nonsmooth_hopf", root, "", x, point))
                        return
                    target, expected = root + 0.1 * (b - root), 0.1 * fb
                point = corrected(
                    _towards(point, target, self.family), self.turns, self.family, np.array([target]), _AXIS
                )
        except (Lost, InputError):
            return


def _towards(point: Point, target: float, family: Family) -> Trail:
    """The start predicted for another value of the parameter."""
    span = family.ranges[0][1] - family.ranges[0][0]
    start = point.here.trail.start.copy()
    scales = size_of(point.here.trail.system, start, point.here.lanes)
    leap = (target - float(point.values[0])) / span / point.direction[_PARAMETER]
    start[point.here.lanes] += leap * point.direction[point.here.lanes] * scales
    start[point.here.fixed] += point.here.fixed_parameter * (target - float(point.values[0]))
    return replace(point.here.trail, start=start)


def _known(one: Point, other: Point) -> Any:
    return (one.direction != 0) | (other.direction != 0)


def _along(at: Callable[[float], Point], test: Callable[[Point], float]) -> Callable[[float], float]:
    return lambda fraction: test(at(fraction))


def _root(function: Callable[[float], float], before: float, after: float) -> float:
    """A zero in (0, 1) (Illinois)."""
    a, fa, b, fb = 0.0, before, 1.0, after
    for _ in range(60):
        c = (a * fb - b * fa) / (fb - fa)
        fc = function(c)
        if fc == 0 or abs(b - a) < 1e-13 or abs(c - b) < 1e-14:
            return c
        if fc * fb < 0:
            a, fa = b, fb
        else:
            fa /= 2
        b, fb = c, fc
    return b


def _nontrivial(point: Point) -> Any:
    values = multipliers_of(point.here)
    return values[0 if point.here.turns else 1 :]


def _torus(point: Point) -> float:
    values = _nontrivial(point)
    pair = values[np.abs(values.imag) > 1e-9]
    return float(np.abs(pair).max() - 1) if pair.size else math.nan


_TESTS: dict[str, Callable[[Point], float]] = {
    "fold": lambda point: float(point.direction[_PARAMETER]),
    "branch_point": lambda point: float(np.prod(1 - _nontrivial(point)).real),
    "flip": lambda point: float(np.prod(_nontrivial(point) + 1).real),
    "neimark_sacker": _torus,
}


def _sequence(here: Return) -> tuple[tuple[float, ...], ...]:
    """The event sequence whatever event it starts with; sections of our own do not count."""
    rows = [tuple(row[:3]) for row in here.trail.arcs if row[2] != SECTION]
    turned = [tuple(rows[i:] + rows[:i]) for i in range(len(rows))]
    return min(turned, default=())


def _extent(here: Return) -> tuple[float, float]:
    x = one_period(here, here.period)
    values = x.at(np.linspace(0.0, x.t_end, 201))[0]
    return float(values.min()), float(values.max())


def _probes(border: Point, family: Family, value: float, offset: float) -> Iterator[tuple[Trail, list[str]]]:
    """Runs of the real motion from states beside the orbit on the border."""
    here = border.here
    system = with_number(here.trail.system, family.paths[0], value)
    try:
        sectioned = here.trail.with_sections()
        followed = sectioned.follow()
    except InputError:
        return
    marks = np.flatnonzero(sectioned.arcs[:, 2] == SECTION)
    length = (2.3 if here.turns == 0 else 1.6) * here.period
    # From the greatest slip speed, where a contact remembers least of the border, a little faster or slower; else as it is.
    places = [sectioned.part(followed, int(mark), len(sectioned.arcs) - 1) for mark in marks[:1]] + [sectioned]
    for trail in places:
        if len(trail.arcs) == 0:
            continue
        speed = max(abs(float(trail.start[_V])), 1e-12)
        for shift in (0.0, 1.0, -1.0, 4.0, -4.0):
            start = trail.start.copy()
            if trail.arcs[0, 0] == 0 and shift:
                continue
            start[_V] += shift * offset * speed
            try:
                run, kinds, stop = replace(trail, system=system, start=start).onward(length)
            except InputError:
                continue
            if stop == "t_end":
                yield run, kinds
