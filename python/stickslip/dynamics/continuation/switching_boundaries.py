"""Switching boundaries of an event sequence: which of the four sliding bifurcations ends it and what goes on beyond."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache

import numpy as np

from stickslip.dynamics.continuation.arclength import (
    Family,
    Label,
    Point,
    consistent,
    corrected,
    corrected_at,
    labels,
)
from stickslip.dynamics.continuation.bifurcation_conditions import PARAMETER
from stickslip.dynamics.continuation.branch import extremes
from stickslip.dynamics.periodic.event_sequence import BOUNDARIES, SECTION, EventSequence, with_number
from stickslip.dynamics.periodic.newton_iteration import Lost
from stickslip.dynamics.periodic.periodic_orbits import find, one_period
from stickslip.dynamics.periodic.poincare_map import Return, return_of
from stickslip.errors import InputError

_STICK = BOUNDARIES.index("stick")
#: The share of a period below which a slip between two sticks is about to vanish.
_SHORT = 0.02
#: An orbit of less than this share of the period of one beside it is a point that Newton's method fell into.
_POINT = 1e-3
#: Two boundaries are the same where neither the parameter, relative to its range, nor the period differs by more.
_SAME = 1e-6


def worst(here: Return) -> dict[Label, float]:
    """The test functions by label, finite ones."""
    values = here.tests["value"]
    return {label: float(values[row]) for label, row in labels(here).items() if np.isfinite(values[row])}


def nearest(point: Point, ahead: Point | None, step: float, family: Family) -> tuple[Point, Label] | None:
    """The nearest boundary ahead, on which one test function vanishes and none is negative."""
    now = worst(point.here)
    then = worst(ahead.here) if ahead is not None else {}
    passed = [label for label, value in now.items() if then.get(label, 1.0) < 0 <= value]
    # What was lost was lost over a test function that is small.
    small = _smallest(now)
    low, high = family.ranges[0]
    span = float(family.scales(point.values)[0])
    found: list[tuple[float, Point, Label]] = []

    def consider(boundary: Point, label: Label) -> None:
        distance = abs(boundary.values[0] - point.values[0]) / span
        inside = low <= boundary.values[0] <= high and (boundary.here.durations > -1e-8).all()
        lasts = boundary.here.period > _POINT * point.here.period
        if inside and lasts and distance < 4 * step and min(worst(boundary.here).values(), default=0.0) > -1e-8:
            found.append((distance, boundary, label))

    # A short slip between two sticks is hard to follow to its end; the stick that takes over is not.
    whole = _merged(point, family, _SHORT)
    if whole is not None:
        consider(*whole)
    for boundary, label in _ends(point, family, [*passed, *(small if ahead is None else [])] if not found else []):
        consider(boundary, label)
    if not found:
        return None
    # Of test functions that vanish together the tangency is named.
    _, boundary, label = min(found, key=lambda item: (round(item[0], 9), item[2][:2]))
    return _merged(boundary, family, 1e-3) or (boundary, label)


def _smallest(values: dict[Label, float]) -> list[Label]:
    """The test functions an orbit is likely to end on, the smallest first."""
    return sorted(values, key=lambda label: values[label])[:4]


def _ends(point: Point, family: Family, tests: list[Label]) -> Iterator[tuple[Point, Label]]:
    """The orbits of a curve on which one of some test functions vanishes, where there are."""
    for label in dict.fromkeys(tests):
        boundary = _end(point, family, label)
        if boundary is not None:
            yield boundary, boundary.boundary if isinstance(boundary.boundary, tuple) else label


@lru_cache(maxsize=32)
def _end(point: Point, family: Family, label: Label) -> Point | None:
    """The orbit on a boundary, kept for the shorter steps from the same point that follow; None where there is none."""
    try:
        return on_boundary(point, family, label)
    except Lost:
        return None


def _meets(point: Point, boundary: Point, family: Family) -> bool:
    """Whether the curve of a point ends on the orbit of a boundary, as two curves that go on in one another do there.

    A test function of its own has to vanish at the same value of the parameter, on an orbit of the same period or a
    multiple of it.
    """
    span = float(family.scales(boundary.values)[0])
    whole = _merged(point, family, _SHORT)
    ends = _ends(point, family, _smallest(worst(point.here)))
    for end, _ in itertools.chain([] if whole is None else [whole], ends):
        ratio = end.here.period / boundary.here.period
        if abs(end.values[0] - boundary.values[0]) < _SAME * span and abs(ratio - max(1, round(ratio))) < _SAME:
            return True
    return False


def on_boundary(point: Point, family: Family, boundary: Label) -> Point:
    """The orbit of the curve on which a test function vanishes, by Newton's method from a point beside it.

    The speed of arrival is a root beside the tangency: instead of it the slip speed vanishes where it is least.
    """
    sequence, forcing_periods = point.here.sequence, point.here.forcing_periods
    if boundary.name == "arrival":
        phases = sequence.phases.copy()
        phases["ending"][boundary.phase] = SECTION
        sequence = replace(sequence, phases=phases)
        least = (boundary.contact, BOUNDARIES.index("low"), boundary.phase)
        try:
            found = [label for label in labels(return_of(sequence, forcing_periods, tests=True)) if label[:3] == least]
        except InputError as error:
            raise Lost(str(error)) from None
        if not found:
            raise Lost("the slip speed has no least value there")
        boundary = found[-1]
    return corrected(sequence, forcing_periods, family, point.values, None, boundary)


def _merged(boundary: Point, family: Family, share: float) -> tuple[Point, Label] | None:
    """The boundary seen as one stick that touches its limit, where slips of less than `share` of a period part two sticks."""
    here = boundary.here
    count = len(here.sequence.phases)
    # Of several contacts each would have sticks of its own to join.
    stuck = here.sequence.stuck[:, 0] if here.sequence.layout.contacts == 1 else np.zeros(count, bool)
    short = ~stuck & (here.durations < share * here.period) & np.roll(stuck, 1) & np.roll(stuck, -1)
    if not short.any() or stuck.sum() <= short.sum():
        return None
    # It starts with a stick before a slip that has vanished, so that no stick is cut.
    first = next((i for i in range(count) if short[(i + 1) % count] and not short[i - 1]), None)
    if first is None or not stuck[first]:
        return None
    try:
        sequence = _rotated(here.sequence, first)
    except InputError:
        return None
    gone = np.roll(short, -first)
    kept: list[int] = []
    durations = sequence.durations.copy()
    roots: list[tuple[int, float]] = []
    for index in range(count):
        if gone[index - 1] and index:
            durations[kept[-1]] += durations[index]
        elif gone[index]:
            roots.append((len(kept) - 1, float(durations[kept[-1]])))
        else:
            kept.append(index)
    joined = sequence.lasting(durations)
    sequence = replace(joined, phases=joined.phases[kept])
    try:
        tests = return_of(sequence, here.forcing_periods, tests=True).tests
        phase, tau = roots[0]
        near = tests[(tests["boundary"] == _STICK) & (tests["phase"] == phase)]
        label = Label(0, _STICK, phase, int(np.argmin(np.abs(near["tau"] - tau))))
        return corrected(sequence, here.forcing_periods, family, boundary.values, None, label), label
    except (InputError, Lost, ValueError):
        return None


def _rotated(sequence: EventSequence, first: int) -> EventSequence:
    """The same period from the start of another phase on."""
    if first == 0:
        return sequence
    states = sequence.follow(keep="nothing").states
    start = states[first - 1].copy()
    phases = np.roll(sequence.phases, -first)
    return EventSequence(sequence.system, start, phases, phases["mode"][0].copy())


def name_of(here: Return, boundary: Label) -> str:
    """The bifurcation a boundary is, by which test function vanishes and how the holding force moves there."""
    row = labels(here).get(boundary)
    kind, detail = boundary.name, 0.0 if row is None else float(here.tests["detail"][row])
    if kind in ("low", "high"):
        return "grazing_sliding" if kind == "low" and detail == 0.0 else "grazing_node"
    if kind == "arrival":
        return "grazing_sliding"
    if kind == "stick":
        return "adding_sliding"
    return "crossing_sliding" if detail > 0 else "switching_sliding"


def beyond(boundary: Point, old: Return, family: Family, ways: tuple[float, ...]) -> tuple[Point, float] | None:
    """The first point beside a boundary with another event sequence than the `old` one, and on which side of the parameter.

    None where no motion goes on, or only one that has another limit there, as with f_s > f_k where a grazing orbit is thrown
    far away.
    """
    span = float(family.scales(boundary.values)[0])
    try:
        low_x, high_x = _extent(boundary.here)
    except InputError:
        # On a tangency itself following may lose the event; the last orbit before it has nearly the same range.
        low_x, high_x = _extent(old)
    for offset, sign in itertools.product((1e-3, 3e-3, 1e-2), ways):
        value = float(boundary.values[0]) + sign * offset * span
        tried: list[float] = []
        for sequence, kinds in _probes(boundary, family, value, offset):
            try:
                cut, forcing_periods = find(
                    sequence.system, sequence, kinds, False, boundary.here.forcing_periods or None
                )
                point = corrected_at(cut, forcing_periods, family, value)
            except (InputError, Lost, IndexError):
                continue
            period = point.here.period
            if any(abs(period - before) < 1e-9 * before for before in tried):
                continue
            tried.append(period)
            if not consistent(point.here) or signature(point.here) == signature(old):
                continue
            extent = _extent(point.here)
            reach = 0.02 + 4 * math.sqrt(offset)
            if max(abs(extent[0] - low_x), abs(extent[1] - high_x)) > reach * (high_x - low_x):
                continue
            if not _meets(point, boundary, family):
                continue
            direction = point.direction * math.copysign(1.0, point.direction[PARAMETER]) * sign
            return replace(point, direction=direction), sign
    return None


def signature(here: Return) -> tuple[tuple[int, ...], ...]:
    """The event sequence whatever event it starts with; sections of our own do not count."""
    phases = here.sequence.phases[here.sequence.endings != SECTION]
    rows = [(*map(int, mode), int(ending), int(contact)) for mode, ending, contact, _ in phases]
    turned = [tuple(rows[i:] + rows[:i]) for i in range(len(rows))]
    return min(turned, default=())


def _extent(here: Return) -> tuple[float, float]:
    return extremes(one_period(here, here.period))


def _probes(boundary: Point, family: Family, value: float, offset: float) -> Iterator[tuple[EventSequence, list[str]]]:
    """Runs of the real motion from states beside the orbit on the boundary."""
    here = boundary.here
    system = with_number(here.sequence.system, family.paths[0], value)
    try:
        sectioned = here.sequence.with_sections()
        followed = sectioned.follow()
    except InputError:
        return
    marks = np.flatnonzero(sectioned.endings == SECTION)
    length = (2.3 if here.forcing_periods == 0 else 1.6) * here.period
    # From the greatest slip speed, where a contact remembers least of the boundary, a little faster or slower; else as it is.
    roots = [sectioned.part(followed, int(mark), len(sectioned.phases) - 1) for mark in marks[:1]] + [sectioned]
    for sequence in roots:
        if len(sequence.phases) == 0:
            continue
        coordinates = sequence.layout.v
        speed = max(float(np.abs(sequence.start[coordinates]).max()), 1e-12)
        for shift in (0.0, 1.0, -1.0, 4.0, -4.0):
            start = sequence.start.copy()
            if shift and sequence.stuck[0].all():
                continue
            start[coordinates] += shift * offset * speed
            try:
                run, kinds, stop = replace(sequence, system=system, start=start).continued(length)
            except InputError:
                continue
            if stop == "t_end":
                yield run, kinds
