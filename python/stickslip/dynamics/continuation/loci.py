"""Curves in two parameters on which a motion changes its kind."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.dynamics.continuation.arclength import (
    CurveEnd,
    Family,
    Point,
    ShorterStep,
    StepSize,
    corrected,
    labels,
    stepped,
    trace,
    turns,
)
from stickslip.dynamics.continuation.bifurcation_conditions import BY_MULTIPLIERS, root, second_conditions, zeros
from stickslip.dynamics.continuation.branch import SpecialPoint, extremes, first_of
from stickslip.dynamics.continuation.switching_boundaries import name_of, worst
from stickslip.dynamics.equilibria.steady_slip import steady_slip
from stickslip.dynamics.periodic.event_sequence import pointer, read, with_number
from stickslip.dynamics.periodic.newton_iteration import Lost
from stickslip.dynamics.periodic.periodic_orbits import PeriodicOrbit, one_period, unchecked
from stickslip.errors import InputError, Interrupted, number
from stickslip.files.arrays import Array
from stickslip.files.equality import ByContent
from stickslip.files.notebook import InNotebook
from stickslip.model.system import Oscillator, System

if TYPE_CHECKING:
    import xarray as xr

#: Steps along a curve, in sizes of the motion and of the ranges.
_FIRST, _SMALLEST, _LARGEST = 0.01, 1e-5, 0.1
#: How near a curve of Hopf points comes to its bounds.
_NEAR = 1e-3
#: A direction this much shorter than that before it has vanished.
_STILL = 1e-3
#: A multiplier this close to 1 is 1: the orbit is known to the square root of rounding.
_DOUBLE = 1e-6


@dataclass(frozen=True)
class CodimensionTwo:
    """A point of a curve in two parameters at which a second condition holds.

    kind is, on a curve of folds, flips or Neimark–Sacker points, ``"cusp"`` (the curve of folds turns back),
    ``"fold_flip"``, ``"fold_neimark_sacker"``, ``"flip_neimark_sacker"``, ``"flip_flip"`` or the strong resonances
    ``"resonance_1_1"`` to ``"resonance_1_4"`` (the angle of the critical multipliers is 0, π, 2π/3, π/2); on a boundary of
    sticking, where a multiplier passes +1, −1 or the unit circle, its name with ``"_fold"``, ``"_flip"`` or
    ``"_neimark_sacker"``; where a curve ends on a boundary of another kind or becomes one, both names with ``"_and_"``.
    """

    kind: str
    values: tuple[float, float]
    point: Point = field(repr=False, compare=False)

    @property
    def orbit(self) -> PeriodicOrbit:
        """The closed orbit there."""
        return unchecked(self.point.here)


@dataclass(eq=False)
class Locus(ByContent, InNotebook):
    """One curve of special points of one kind in the plane of two parameters.

    Attributes
    ----------
    kind : as of :class:`SpecialPoint`.
    parameters : their names.
    values : shape (n, 2), in the order of the curve.
    x_min, x_max : range of the position of the motion there, shape (n,).
    special_points : points of codimension two, in the order of the curve.
    cut : ``"interrupt"`` where Ctrl-C ended the curve though it goes on, else empty.
    """

    system: Oscillator | System
    kind: str
    parameters: tuple[str, str]
    bounds: tuple[tuple[float, float], tuple[float, float]]
    values: Array = field(default_factory=lambda: np.empty((0, 2)))
    x_min: Array = field(default_factory=lambda: np.empty(0))
    x_max: Array = field(default_factory=lambda: np.empty(0))
    special_points: list[CodimensionTwo] = field(default_factory=list)
    cut: str = ""

    def to_xarray(self) -> xr.Dataset:
        """Both parameters and the range of the position over ``point``."""
        import json

        import xarray as xr

        data = {name: ("point", self.values[:, i]) for i, name in enumerate(self.parameters)}
        data |= {"x_min": ("point", self.x_min), "x_max": ("point", self.x_max)}
        attrs = {"title": "stickslip locus", "kind": self.kind, "system": json.dumps(self.system.to_dict())}
        return xr.Dataset(data, attrs=attrs)

    def facts(self) -> dict[str, Any]:
        """What a notebook shows."""
        return {"kind": self.kind, "parameters": self.parameters, "points": len(self.values)}

    def __repr__(self) -> str:
        return f"<Locus of {self.kind} over {' and '.join(self.parameters)}: {len(self.values)} points>"


def together(loci: list[Locus]) -> xr.Dataset:
    """Curves over the same parameters side by side, over ``locus`` and ``locus_point`` (NaN where one has fewer points)."""
    import xarray as xr

    most = max(len(curve.values) for curve in loci)
    names = [f"locus_{name}" for name in (*loci[0].parameters, "x_min", "x_max")]
    rows = [np.column_stack([curve.values, curve.x_min, curve.x_max]) for curve in loci]
    padded = np.array([np.pad(row, ((0, most - len(row)), (0, 0)), constant_values=np.nan) for row in rows])
    data: dict[str, Any] = {name: (("locus", "locus_point"), padded[:, :, i]) for i, name in enumerate(names)}
    for name in ("kind", "cut"):
        data[f"locus_{name}"] = ("locus", np.array([getattr(curve, name) for curve in loci], dtype=str))
    return xr.Dataset(data)


def locus(
    point: SpecialPoint,
    over: tuple[str, str],
    bounds: tuple[tuple[float, float], tuple[float, float]],
    *,
    most: int = 200,
    progress: Callable[[int, int], Any] | None = None,
) -> Locus:
    """Follow a special point of a branch over two parameters.

    Pseudo-arclength on the closed orbit together with what vanishes at it: the test function of a sliding bifurcation,
    det(M − 1) at a fold, det(M + 1) at a flip, Π (μ_i μ_j − 1) at a Neimark–Sacker point, the damping of steady slip at a
    smooth Hopf point. Each point solves both to rounding.

    Parameters
    ----------
    point : of ``continuation(…).special_points``.
    over : two numbers of the system document, such as ``("drive_velocity", "forcing.amplitude")``.
    bounds : (low, high) of each.
    most : the most points in each of the two directions.
    progress : called as ``progress(points, 2 * most)``.

    Returns
    -------
    Locus.

    Raises
    ------
    InputError
        for unknown parameters, bounds that make no sense or leave the point out, or a kind that is no curve to follow.
    Interrupted
        a KeyboardInterrupt, at Ctrl-C once there is a point: its ``result`` has the curve as far as it was followed.

    Limits: the event sequence is held; the curve ends where another boundary is met (a point of codimension two). Where a
    multiplier is 1 there, or a stick of no duration is followed, it ends beside that point without its name. A nonsmooth Hopf
    point or a branch point is not followed.

    Source: Dercole & Kuznetsov, ACM TOMS 31 (2005) 95; Kuznetsov, Elements of Applied Bifurcation Theory, ch. 10.

    >>> import stickslip as ss
    >>> swing = ss.Oscillator(0.0, 0.0, ss.laws.Coulomb(0.6), forcing=ss.Harmonic(1.0, 0.7))
    >>> found = ss.continuation(swing, "law.kinetic", (0.55, 0.75), seeds=0).special_points[0]
    >>> curve = ss.locus(found, ("law.kinetic", "forcing.frequency"), ((0.5, 0.8), (0.65, 0.75)))
    >>> curve.kind, round(float(np.interp(0.7, curve.values[:, 1], curve.values[:, 0])), 3)
    ('crossing_sliding', 0.722)
    """
    if point.system is None:
        raise InputError("locus: expected a special point of a continuation, which knows its system")
    system = point.system
    names = (str(over[0]), str(over[1]))
    paths = tuple(pointer(system, name, "locus") for name in names)
    ranges = tuple((number("low", low, "locus"), number("high", high, "locus")) for low, high in bounds)
    here = [read(system, path) for path in paths]
    for name, value, (low, high) in zip(names, here, ranges, strict=True):
        if not low <= value <= high:
            raise InputError(
                f"locus: the bounds of {name} must hold the value of the point, {value:g}, got {low:g}:{high:g}"
            )
    family = Family(paths, ranges)
    curve = Locus(system, point.kind, names, (ranges[0], ranges[1]))
    halves: tuple[list[_Row], list[_Row]] = ([], [])
    second: tuple[list[CodimensionTwo], list[CodimensionTwo]] = ([], [])
    try:
        _follow(point, family, np.array(here), most, progress, halves, second)
    except KeyboardInterrupt:
        if not halves[0]:
            raise
        curve.cut = "interrupt"
        raise Interrupted(_filled(curve, halves, second)) from None
    return _filled(curve, halves, second)


def _filled(
    curve: Locus,
    halves: tuple[list[_Row], list[_Row]],
    second: tuple[list[CodimensionTwo], list[CodimensionTwo]],
) -> Locus:
    """The curve of both halves, each of which begins at the point that was followed."""
    rows = np.array(halves[0][::-1] + halves[1][1:])
    curve.values, curve.x_min, curve.x_max = rows[:, :2], rows[:, 2], rows[:, 3]
    curve.special_points = second[0][::-1] + second[1]
    return curve


def _follow(
    point: SpecialPoint,
    family: Family,
    here: Array,
    most: int,
    progress: Callable[[int, int], Any] | None,
    halves: tuple[list[_Row], list[_Row]],
    second: tuple[list[CodimensionTwo], list[CodimensionTwo]],
) -> None:
    """Add the points of both halves of the curve, and those of codimension two on them, to the lists."""
    if point.kind == "hopf":
        assert point.system is not None
        for sign, rows in zip((-1.0, 1.0), halves, strict=True):
            _hopf_half(point.system, family, here, sign, most, rows)
        return
    condition = point.kind if point.kind in BY_MULTIPLIERS else None if point.point is None else point.point.boundary
    if condition is None or point.point is None:
        raise InputError(
            f"locus: a {point.kind} is not followed in two parameters; locate it at several values instead"
        )
    sequence, forcing_periods = point.point.here.sequence, point.point.here.forcing_periods
    try:
        start = corrected(sequence, forcing_periods, family, here, None, condition)
    except Lost as error:
        raise InputError(f"locus: the point is not found again in two parameters: {error}") from None
    walked = 0

    def notify(points: int) -> None:
        if progress is not None:
            progress(walked + points, 2 * most)

    for sign, rows, found in zip((-1.0, 1.0), halves, second, strict=True):
        _half(replace(start, direction=sign * start.direction), family, most, notify, point.kind, rows, found)
        walked += most


_Row = tuple[float, float, float, float]


def _half(
    point: Point,
    family: Family,
    most: int,
    notify: Callable[[int], None],
    kind: str,
    rows: list[_Row],
    found: list[CodimensionTwo],
) -> None:
    """Add the points one way along the curve until a bound or another boundary, and those of codimension two on it."""
    rows.append(_row(point))
    # What vanishes at the end of the curve, with the last point that has it.
    ended: tuple[Point, Point, float] | None = None

    def more() -> bool:
        if len(rows) < most:
            notify(len(rows))
        return len(rows) < most

    def advance(point: Point, step: float) -> Point:
        nonlocal ended
        ahead = stepped(point, family, step)
        if not _allowed(ahead):
            ended = (point, ahead, step)
            raise ShorterStep(2)
        if turns(point.direction, ahead.direction):
            raise ShorterStep(2)
        outside = _outside(ahead.values, family)
        if outside is not None:
            axis, bound = outside
            direction = np.zeros(len(point.direction))
            direction[axis - 2] = 1.0
            values = point.values + (ahead.values - point.values) * (
                (bound - point.values[axis]) / (ahead.values[axis] - point.values[axis])
            )
            values[axis] = bound
            here = point.here
            with contextlib.suppress(Lost):
                end = corrected(here.sequence, here.forcing_periods, family, values, direction, point.boundary)
                rows.append(_row(end))
            raise CurveEnd("bounds")
        if _name(ahead) != _name(point):
            # Where the boundary becomes another kind no motion follows the event sequence any more.
            end = _isolated(_between(point, step, family, _detail, (_detail(point), _detail(ahead))))
            rows.append(_row(end))
            found.append(_codimension_two(f"{kind}_and_{_name(ahead)}", end))
            raise CurveEnd("boundary")
        found.extend(_second(point, ahead, step, family, kind))
        ended = None
        rows.append(_row(ahead))
        return ahead

    if trace(advance, point, StepSize(_FIRST, _SMALLEST, _LARGEST), more) == "lost" and ended is not None:
        found += _last(*ended, family, kind)


def _between(
    point: Point, step: float, family: Family, test: Callable[[Point], float], ends: tuple[float, float]
) -> Point:
    """The point of a step at which a test function vanishes.

    Raises
    ------
    Lost
        where a point in between has no orbit.
    """
    share = root(lambda share: test(stepped(point, family, share * step)), *ends)
    return stepped(point, family, share * step)


def _isolated(point: Point) -> Point:
    """The same point.

    Raises
    ------
    Lost
        where a multiplier is 1: the orbit may be one of many there, and Newton's method finds any of them.
    """
    if np.abs(np.linalg.eigvals(point.here.map_jacobian) - 1.0).min(initial=1.0) < _DOUBLE:
        raise Lost("a multiplier is 1")
    return point


def _second(point: Point, ahead: Point, step: float, family: Family, kind: str) -> list[CodimensionTwo]:
    """Points of codimension two by the multipliers, between two points of a curve."""
    found = []
    along = point.direction[-2:]
    tests = second_conditions(kind)
    if kind == "fold":
        # At a cusp the curve turns back: its direction in the plane of the parameters vanishes.
        tests["cusp"] = lambda there: float(there.direction[-2:] @ along)
    for name, there in zeros(tests, point, ahead, lambda share: stepped(point, family, share * step)):
        if name != "cusp" or np.linalg.norm(there.direction[-2:]) < _STILL * np.linalg.norm(along):
            found.append(_codimension_two(name, there))
    return found


def _last(point: Point, beyond: Point, step: float, family: Family, kind: str) -> list[CodimensionTwo]:
    """The boundary at which a curve ends, where the test function that vanishes there is known on both sides."""
    before, after = worst(point.here), worst(beyond.here)
    passed = [label for label, value in after.items() if value < 0 < before.get(label, -1.0)]
    if not passed:
        return []
    label = min(passed, key=lambda label: after[label])

    def test(there: Point) -> float:
        return worst(there.here).get(label, math.nan)

    try:
        there = _isolated(_between(point, step, family, test, (before[label], after[label])))
    except Lost:
        return []
    return [_codimension_two(f"{kind}_and_{name_of(there.here, label)}", there)]


def _name(point: Point) -> str | None:
    """The bifurcation of the boundary that vanishes on the curve; None on a curve of multipliers."""
    return name_of(point.here, point.boundary) if isinstance(point.boundary, tuple) else None


def _detail(point: Point) -> float:
    """How the holding force moves on the boundary: its sign is what tells two bifurcations of one test function apart."""
    assert isinstance(point.boundary, tuple)
    return float(point.here.tests["detail"][labels(point.here)[point.boundary]])


def _codimension_two(kind: str, there: Point) -> CodimensionTwo:
    return CodimensionTwo(kind, (float(there.values[0]), float(there.values[1])), there)


def _row(point: Point) -> _Row:
    orbit = one_period(point.here, point.here.period)
    return float(point.values[0]), float(point.values[1]), *extremes(orbit)


def _allowed(point: Point) -> bool:
    """Whether no other boundary has been passed."""
    return bool((point.here.durations > -1e-8).all()) and min(worst(point.here).values(), default=0.0) > -1e-8


def _outside(values: Array, family: Family) -> tuple[int, float] | None:
    """The parameter that has left its bounds, and which bound."""
    for axis, (value, (low, high)) in enumerate(zip(values, family.ranges, strict=True)):
        if not low <= value <= high:
            return axis, low if value < low else high
    return None


def _hopf_half(
    system: Oscillator | System, family: Family, start: Array, sign: float, most: int, rows: list[_Row]
) -> None:
    """Add the points of the curve on which the damping of steady slip vanishes, one way."""
    spans = family.scales(start)

    def placed(values: Array) -> tuple[float, float]:
        there = system
        for path, value in zip(family.paths, values, strict=True):
            there = with_number(there, path, float(value))
        state = steady_slip(there)
        return (math.nan, math.nan) if state is None else (state.damping, first_of(state.x))

    def slopes(values: Array) -> Array:
        steps = 1e-5 * np.diag(spans)
        return np.array([(placed(values + h)[0] - placed(values - h)[0]) / 2e-5 for h in steps])

    def solved(values: Array, along: Array | None) -> tuple[Array, Array] | None:
        for _ in range(20):
            try:
                value, slope = placed(values)[0], slopes(values)
            except InputError:
                return None
            if not np.isfinite([value, *slope]).all() or not slope.any():
                return None
            leap = -value * slope / (slope @ slope)
            values = values + leap * spans
            if np.abs(leap).max() < 1e-14:
                break
        if np.abs(leap).max() > 1e-9:
            return None
        way = np.array([-slope[1], slope[0]]) / np.hypot(*slope)
        return values, way if along is None or way @ along > 0 else -way

    found = solved(start, None)
    if found is None:
        raise InputError("locus: the damping of steady slip does not depend on these numbers")
    values, way = found
    way = sign * way

    def add(values: Array) -> None:
        x = placed(values)[1]
        rows.append((float(values[0]), float(values[1]), x, x))

    def advance(point: tuple[Array, Array], step: float) -> tuple[Array, Array]:
        values, way = point
        ahead = solved(values + step * way * spans, way)
        if ahead is None or turns(way, ahead[1]):
            raise ShorterStep(2)
        if _outside(ahead[0], family) is not None:
            if step > _NEAR:
                raise ShorterStep(2)
            raise CurveEnd("bounds")
        add(ahead[0])
        return ahead

    add(values)
    trace(advance, (values, way), StepSize(_FIRST, _SMALLEST, _LARGEST), lambda: len(rows) < most)
