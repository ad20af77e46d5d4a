"""Curves in two parameters on which a motion changes its kind."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.dynamics.continuation.branch import SpecialPoint, extremes
from stickslip.dynamics.continuation.conditions import BY_MULTIPLIERS
from stickslip.dynamics.periodic.cycles import one_period
from stickslip.dynamics.periodic.equilibria import steady_slip
from stickslip.dynamics.periodic.event_sequence import Floats, pointer, read, with_number
from stickslip.dynamics.periodic.shooting import Family, Lost, Point, corrected, stepped
from stickslip.dynamics.periodic.switching_boundaries import worst
from stickslip.errors import InputError
from stickslip.files.documents import number
from stickslip.files.notebook import InNotebook
from stickslip.model.system import Oscillator, System

if TYPE_CHECKING:
    import xarray as xr

_SMALLEST, _LARGEST = 1e-5, 0.1


@dataclass
class Locus(InNotebook):
    """One curve of special points of one kind in the plane of two parameters.

    Attributes
    ----------
    kind : as of :class:`SpecialPoint`.
    parameters : their names.
    values : shape (n, 2), in the order of the curve.
    x_min, x_max : range of the position of the motion there, shape (n,).
    """

    system: Oscillator | System
    kind: str
    parameters: tuple[str, str]
    bounds: tuple[tuple[float, float], tuple[float, float]]
    values: Floats = field(default_factory=lambda: np.empty((0, 2)))
    x_min: Floats = field(default_factory=lambda: np.empty(0))
    x_max: Floats = field(default_factory=lambda: np.empty(0))

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
    return xr.Dataset(data | {"locus_kind": ("locus", np.array([curve.kind for curve in loci], dtype=str))})


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

    Limits: the event sequence is held; the curve ends where another boundary is met (a point of codimension two). A nonsmooth
    Hopf point or a branch point is not followed.

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
    if point.kind == "hopf" and isinstance(system, Oscillator):
        halves = [_hopf_half(system, family, np.array(here), sign, most) for sign in (-1.0, 1.0)]
    else:
        condition = (
            point.kind if point.kind in BY_MULTIPLIERS else None if point.point is None else point.point.boundary
        )
        if condition is None or point.point is None:
            raise InputError(
                f"locus: a {point.kind} is not followed in two parameters; locate it at several values instead"
            )
        sequence, forcing_periods = point.point.here.sequence, point.point.here.forcing_periods
        try:
            start = corrected(sequence, forcing_periods, family, np.array(here), None, condition)
        except Lost as error:
            raise InputError(f"locus: the point is not found again in two parameters: {error}") from None
        walked = 0

        def told(points: int) -> None:
            if progress is not None:
                progress(walked + points, 2 * most)

        halves = []
        for sign in (-1.0, 1.0):
            halves.append(_half(replace(start, direction=sign * start.direction), family, most, told))
            walked += most
    rows = np.array(halves[0][::-1] + halves[1][1:])
    curve.values, curve.x_min, curve.x_max = rows[:, :2], rows[:, 2], rows[:, 3]
    return curve


_Row = tuple[float, float, float, float]


def _half(point: Point, family: Family, most: int, told: Callable[[int], None]) -> list[_Row]:
    """One way along the curve until a bound or another boundary."""
    rows = [_row(point)]
    step = 0.01
    while len(rows) < most and step >= _SMALLEST:
        told(len(rows))
        try:
            ahead = stepped(point, point.here.forcing_periods, family, step)
        except Lost:
            ahead = None
        if ahead is None or not _allowed(ahead) or float(point.direction @ ahead.direction) < 0.9:
            step /= 2
            continue
        outside = _outside(ahead.values, family)
        if outside is not None:
            axis, bound = outside
            direction = np.zeros(len(point.direction))
            direction[axis - 2] = 1.0
            values = point.values + (ahead.values - point.values) * (
                (bound - point.values[axis]) / (ahead.values[axis] - point.values[axis])
            )
            values[axis] = bound
            with contextlib.suppress(Lost):
                end = corrected(
                    point.here.sequence, point.here.forcing_periods, family, values, direction, point.boundary
                )
                rows.append(_row(end))
            break
        point = ahead
        rows.append(_row(point))
        step = min(1.4 * step, _LARGEST)
    return rows


def _row(point: Point) -> _Row:
    orbit = one_period(point.here, point.here.period)
    return float(point.values[0]), float(point.values[1]), *extremes(orbit)


def _allowed(point: Point) -> bool:
    """Whether no other boundary has been passed."""
    return bool((point.here.durations > -1e-8).all()) and min(worst(point.here).values(), default=0.0) > -1e-8


def _outside(values: Floats, family: Family) -> tuple[int, float] | None:
    """The parameter that has left its bounds, and which bound."""
    for axis, (value, (low, high)) in enumerate(zip(values, family.ranges, strict=True)):
        if not low <= value <= high:
            return axis, low if value < low else high
    return None


def _hopf_half(system: Oscillator, family: Family, start: Floats, sign: float, most: int) -> list[_Row]:
    """The curve on which the damping of steady slip vanishes, one way."""
    spans = family.scales(start)

    def placed(values: Floats) -> tuple[float, float]:
        there = system
        for path, value in zip(family.paths, values, strict=True):
            there = with_number(there, path, float(value))
        state = steady_slip(there)
        return (math.nan, math.nan) if state is None else (state.damping, state.x)

    def slopes(values: Floats) -> Floats:
        steps = 1e-5 * np.diag(spans)
        return np.array([(placed(values + h)[0] - placed(values - h)[0]) / 2e-5 for h in steps])

    def solved(values: Floats, along: Floats | None) -> tuple[Floats, Floats] | None:
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
    rows: list[_Row] = []

    def add(values: Floats) -> None:
        x = placed(values)[1]
        rows.append((float(values[0]), float(values[1]), x, x))

    add(values)
    step = 0.01
    while len(rows) < most and step >= _SMALLEST:
        found = solved(values + step * way * spans, way)
        if found is None or found[1] @ way < 0.9:
            step /= 2
            continue
        if _outside(found[0], family) is not None:
            if step > 1e-3:
                step /= 2
                continue
            break
        (values, way), step = found, min(1.4 * step, _LARGEST)
        add(values)
    return rows
