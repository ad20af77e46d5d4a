"""Borders of an event sequence: which of the four sliding bifurcations ends it, and the sequence that goes on beyond."""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from stickslip.dynamics.continuation.branch import extremes
from stickslip.dynamics.critical.release_map import Return, turn
from stickslip.dynamics.periodic.cycles import find, one_period
from stickslip.dynamics.periodic.event_sequence import BORDERS, SECTION, Trail, with_number
from stickslip.dynamics.periodic.shooting import (
    Family,
    Label,
    Lost,
    Point,
    axis,
    border_of,
    consistent,
    corrected,
    labels,
)
from stickslip.errors import InputError

#: Where in a direction the parameter stands.
_PARAMETER = -1
_STICK = BORDERS.index("stick")


def worst(here: Return) -> dict[Label, float]:
    """The test functions by label, finite ones."""
    return {label: float(here.tests[row, 4]) for label, row in labels(here).items() if np.isfinite(here.tests[row, 4])}


def nearest(point: Point, ahead: Point | None, step: float, family: Family) -> tuple[Point, Label] | None:
    """The nearest border ahead, on which one test function vanishes and none is negative."""
    now = worst(point.here)
    then = worst(ahead.here) if ahead is not None else {}
    passed = [label for label, value in now.items() if then.get(label, 1.0) < 0 <= value]
    # What was lost was lost over a test function that is small; the smallest first.
    small = sorted(now, key=lambda label: now[label])[:4]
    low, high = family.ranges[0]
    span = float(family.scales(point.values)[0])
    found: list[tuple[float, Point, Label]] = []

    def consider(border: Point, label: Label) -> None:
        distance = abs(border.values[0] - point.values[0]) / span
        inside = low <= border.values[0] <= high and (border.here.durations > -1e-8).all()
        if inside and distance < 4 * step and min(worst(border.here).values(), default=0.0) > -1e-8:
            found.append((distance, border, label))

    # A short slip between two sticks is hard to follow to its end; the stick that takes over is not.
    whole = _merged(point, family, 0.02)
    if whole is not None:
        consider(*whole)
    for label in dict.fromkeys([*passed, *(small if ahead is None else [])]) if not found else ():
        with contextlib.suppress(Lost):
            border = on_border(point, family, label)
            consider(border, border.border if isinstance(border.border, tuple) else label)
    if not found:
        return None
    # Of test functions that vanish together the tangency is named.
    _, border, label = min(found, key=lambda item: (round(item[0], 9), item[2][0]))
    return _merged(border, family, 1e-3) or (border, label)


def on_border(point: Point, family: Family, border: Label) -> Point:
    """The orbit of the curve on which a test function vanishes, by Newton's method from a point beside it.

    The speed of arrival is a root beside the tangency: instead of it the slip speed vanishes where it is least.
    """
    trail, turns = point.here.trail, point.here.turns
    kind, contact = border_of(border)
    if kind == "arrival":
        arcs = trail.arcs.copy()
        arcs[border[1], -2] += SECTION - trail.endings[border[1]]
        trail = replace(trail, arcs=arcs)
        low = len(BORDERS) * contact
        try:
            found = [label for label in labels(turn(trail, turns, tests=True)) if label[:2] == (low, border[1])]
        except InputError as error:
            raise Lost(str(error)) from None
        border = found[-1]
    return corrected(trail, turns, family, point.values, None, border)


def _merged(border: Point, family: Family, share: float) -> tuple[Point, Label] | None:
    """The border seen as one stick that touches its limit, where slips of less than `share` of a period part two sticks."""
    here = border.here
    arcs = here.trail.arcs
    # Of several contacts each would have sticks of its own to join.
    stuck = here.trail.directions[:, 0] == 0 if here.trail.layout.contacts == 1 else np.zeros(len(arcs), bool)
    short = ~stuck & (here.durations < share * here.period) & np.roll(stuck, 1) & np.roll(stuck, -1)
    if not short.any() or stuck.sum() <= short.sum():
        return None
    # It starts with a stick before a slip that has vanished, so that no stick is cut.
    first = next((i for i in range(len(arcs)) if short[(i + 1) % len(arcs)] and not short[i - 1]), None)
    if first is None or arcs[first, 0] != 0:
        return None
    try:
        trail = _rotated(here.trail, first)
    except InputError:
        return None
    gone = np.roll(short, -first)
    rows: list[list[float]] = []
    places: list[tuple[int, float]] = []
    for index, arc in enumerate(trail.arcs):
        if gone[index - 1] and index:
            rows[-1] = [*rows[-1][:3], rows[-1][3] + arc[3]]
        elif gone[index]:
            places.append((len(rows) - 1, rows[-1][3]))
        else:
            rows.append(list(arc))
    trail = replace(trail, arcs=np.array(rows))
    try:
        tests = turn(trail, here.turns, tests=True).tests
        arc, tau = places[0]
        near = tests[(tests[:, 0] == _STICK) & (tests[:, 1] == arc)]
        order = int(np.argmin(np.abs(near[:, 2] - tau)))
        label = (_STICK, arc, order)
        return corrected(trail, here.turns, family, border.values, None, label), label
    except (InputError, Lost, ValueError):
        return None


def _rotated(trail: Trail, first: int) -> Trail:
    """The same period from the start of another arc on."""
    if first == 0:
        return trail
    states = trail.follow().states
    start = states[first - 1].copy()
    arcs = np.vstack([trail.arcs[first:], trail.arcs[:first]])
    return Trail(trail.system, start, arcs, arcs[0, :-2].copy())


def name_of(here: Return, border: Label) -> str:
    """The bifurcation a border is, by which test function vanishes and how the holding force moves there."""
    row = labels(here).get(border)
    kind, detail = border_of(border)[0], 0.0 if row is None else float(here.tests[row, 3])
    if kind in ("low", "high"):
        return "grazing_sliding" if kind == "low" and detail == 0.0 else "grazing_node"
    if kind == "arrival":
        return "grazing_sliding"
    if kind == "stick":
        return "adding_sliding"
    return "crossing_sliding" if detail > 0 else "switching_sliding"


def beyond(border: Point, old: Return, family: Family, ways: tuple[float, ...]) -> tuple[Point, float] | None:
    """The first point beside a border with another event sequence than the `old` one, and on which side of the parameter.

    None where no motion goes on.
    """
    span = float(family.scales(border.values)[0])
    try:
        low_x, high_x = _extent(border.here)
    except InputError:
        # On a tangency itself following may lose the event; the last orbit before it has nearly the same range.
        low_x, high_x = _extent(old)
    for offset, sign in itertools.product((1e-3, 3e-3, 1e-2), ways):
        value = float(border.values[0]) + sign * offset * span
        for trail, kinds in _probes(border, family, value, offset):
            try:
                cut, turns = find(trail.system, trail, kinds, False, border.here.turns or None)
                point = corrected(cut, turns, family, np.array([value]), axis(cut))
            except (InputError, Lost, IndexError):
                continue
            if not consistent(point.here) or sequence(point.here) == sequence(old):
                continue
            extent = _extent(point.here)
            reach = 0.02 + 4 * math.sqrt(offset)
            if max(abs(extent[0] - low_x), abs(extent[1] - high_x)) > reach * (high_x - low_x):
                continue
            direction = point.direction * math.copysign(1.0, point.direction[_PARAMETER]) * sign
            return replace(point, direction=direction), sign
    return None


def sequence(here: Return) -> tuple[tuple[float, ...], ...]:
    """The event sequence whatever event it starts with; sections of our own do not count."""
    rows = [tuple(row) for row in here.trail.arcs[here.trail.endings != SECTION, :-1]]
    turned = [tuple(rows[i:] + rows[:i]) for i in range(len(rows))]
    return min(turned, default=())


def _extent(here: Return) -> tuple[float, float]:
    return extremes(one_period(here, here.period))


def _probes(border: Point, family: Family, value: float, offset: float) -> Iterator[tuple[Trail, list[str]]]:
    """Runs of the real motion from states beside the orbit on the border."""
    here = border.here
    system = with_number(here.trail.system, family.paths[0], value)
    try:
        sectioned = here.trail.with_sections()
        followed = sectioned.follow()
    except InputError:
        return
    marks = np.flatnonzero(sectioned.endings == SECTION)
    length = (2.3 if here.turns == 0 else 1.6) * here.period
    # From the greatest slip speed, where a contact remembers least of the border, a little faster or slower; else as it is.
    places = [sectioned.part(followed, int(mark), len(sectioned.arcs) - 1) for mark in marks[:1]] + [sectioned]
    for trail in places:
        if len(trail.arcs) == 0:
            continue
        lanes = trail.layout.v
        speed = max(float(np.abs(trail.start[lanes]).max()), 1e-12)
        for shift in (0.0, 1.0, -1.0, 4.0, -4.0):
            start = trail.start.copy()
            if shift and not trail.directions[0].any():
                continue
            start[lanes] += shift * offset * speed
            try:
                run, kinds, stop = replace(trail, system=system, start=start).onward(length)
            except InputError:
                continue
            if stop == "t_end":
                yield run, kinds
