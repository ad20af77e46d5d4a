"""Branches of steady slip and of periodic orbits in one parameter."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from stickslip.dynamics.continuation.arclength import Family, Point, corrected_at
from stickslip.dynamics.continuation.bifurcation_conditions import PARAMETER
from stickslip.dynamics.continuation.branch import (
    COLUMNS,
    Branch,
    Branches,
    OtherMotion,
    SpecialPoint,
    both_ways_of,
    crossings,
    first_of,
    range_of,
    same_motion,
)
from stickslip.dynamics.continuation.coexistence import other_motions
from stickslip.dynamics.continuation.cycle_at_hopf_point import born
from stickslip.dynamics.continuation.state_branches import StateWalk
from stickslip.dynamics.continuation.walk import Walk
from stickslip.dynamics.equilibria.hopf_points import hopf_points
from stickslip.dynamics.equilibria.steady_slip import steady_slip
from stickslip.dynamics.periodic.closed_orbit import Cycle
from stickslip.dynamics.periodic.event_sequence import check, pointer, read, with_number
from stickslip.dynamics.periodic.newton_iteration import Lost
from stickslip.dynamics.periodic.periodic_orbits import (
    STICKS,
    PeriodicOrbit,
    event_cycle,
    longest_stick,
    periodic_orbit,
    unchecked,
)
from stickslip.dynamics.periodic.poincare_map import forcing_period
from stickslip.dynamics.periodic.state_cycles import StateCycle
from stickslip.errors import InputError, Interrupted, UnfinishedWarning, number, whole_number
from stickslip.files.progress import waiting
from stickslip.model.system import Oscillator, System
from stickslip.simulation.time_limit import NO_LIMIT, TimeLimit


def continuation(
    system: Oscillator | System,
    parameter: str,
    bounds: tuple[float, float],
    *,
    guess: Any = None,
    seeds: int = 3,
    starts: int = 3,
    most: int = 300,
    max_seconds: float | None = None,
    progress: Callable[[int, int], Any] | None = None,
) -> Branches:
    """Follow steady slip and periodic orbits, stable or not, over a parameter, and locate where their kind changes.

    Pseudo-arclength continuation of the orbit held to its event sequence; test functions that vanish at the four sliding
    bifurcations, multipliers at +1, −1 and the unit circle, and zeros of the damping of steady slip are found by Newton's
    method or a bracketed root. At a sliding bifurcation the event sequence is switched; where the orbits on both sides have
    one limit there the branch goes on, back in the parameter if that is where they lie (a nonsmooth fold), else it ends.
    From every Hopf point of steady slip the cycle that is born there is followed as a branch of its own.

    Parameters
    ----------
    system : of one mass or several (of which the positions of the first are kept). Steady slip is followed where every
        contact slips, under laws without an internal state; under one with such a state cycles are followed by the map over
        one period, and folds, flips, branch points and tori are located on them.
    parameter : a number of the system document, such as ``"drive_velocity"``, ``"forcing.frequency"`` or ``"law.kinetic"``.
    bounds : (low, high) of the parameter.
    guess : as for :func:`stickslip.periodic_orbit`, at the value that the system has; default the motion from rest. A
        :class:`~stickslip.PeriodicOrbit`, as of ``branch.orbit(i)`` or ``special_point.orbit``, is followed as it is, stable
        or not, at the value that its own system has (with `seeds` 0 nothing else).
    seeds : at how many values between the bounds the motion from rest is looked at for a further branch.
    starts : at each of these values starts at so many positions and velocities, each with each, are run, and the motions
        they end in that are on no branch yet are followed too, of one mass under laws without an internal state; 0 for none,
        as with `seeds` 0.
    most : the most points in each of the two directions of one branch; one that goes on there has ``cut`` ``"most"``, and a
        warning says how many they are.
    max_seconds : time on the clock > 0 after which the search ends, asked before each point and before each start, with a
        warning and with what is found by then; default none.
    progress : called as ``progress(points, most)`` after each point of a branch, and with 0 points while an orbit to start
        from is sought.

    Returns
    -------
    Branches, with a warning where steady slip is unstable and `seeds` find no other motion. A closed curve ends where it
    meets its first point again, one of twice the period at the flip it comes from; ``ends`` of each says why.

    Raises
    ------
    InputError
        for an unknown parameter, bounds that make no sense, or where no motion to start from is found.
    Interrupted
        a KeyboardInterrupt, at Ctrl-C once there is a branch: its ``result`` has the branches found by then, ``cut`` of the
        last one ``"interrupt"``.

    Limits: a branch ends where the orbits on both sides of a boundary have no common limit, as with f_s > f_k where a grazing
    orbit is thrown far away; branches that begin at no Hopf point and that no run from rest, from `starts` or from `guess`
    reaches are not found. Of several masses, and under laws with an internal state, there are no `starts`.

    Source: Dercole & Kuznetsov, ACM TOMS 31 (2005) 95; Thota & Dankowicz, SIADS 7 (2008) 1283.

    >>> from stickslip.laws import Coulomb
    >>> from stickslip.model.drive import Harmonic
    >>> swing = Oscillator(0.0, 0.0, Coulomb(0.6), forcing=Harmonic(1.0, 0.7))
    >>> [(p.kind, round(p.parameter, 10)) for p in continuation(swing, "law.kinetic", (0.55, 0.75), seeds=0).special_points]
    [('crossing_sliding', 0.7220709759)]
    """
    integrated = isinstance(system, Oscillator | System) and system.integrated
    if not integrated:
        check(system, "continuation")
    path = pointer(system, parameter, "continuation")
    low, high = (number(name, bound, "continuation") for name, bound in zip(("low", "high"), bounds, strict=True))
    if not low < high:
        raise InputError(f"continuation: bounds must be (low, high) with low < high, got ({low:g}, {high:g})")
    family = Family((path,), ((low, high),))
    limit = TimeLimit.after(max_seconds, "continuation")
    here = read(guess.system if isinstance(guess, Cycle) else system, path)
    if guess is not None and not low <= here <= high:
        raise InputError(f"continuation: the bounds must hold the value of the guess, {here:g}, got {low:g}:{high:g}")
    begins = [(here, guess)] if low <= here <= high else []
    begins += [(low + (high - low) * (i + 0.5) / seeds, None) for i in range(seeds)]
    whole_number("starts", starts, "continuation", least=0)
    branches: list[Branch] = []
    others: list[OtherMotion] = []
    say = waiting(progress, "continuation")
    try:
        late = _search(system, path, family, begins, branches, most, say, limit)
        if branches and seeds and starts and isinstance(system, Oscillator) and not integrated:
            for value, _ in begins:
                if limit.passed:
                    late = max(late, 1)
                    break
                others += _others(system, path, family, value, branches, starts, most, say, limit)
    except KeyboardInterrupt as stop:
        if isinstance(stop, Interrupted) and stop.result.values:
            branches.append(stop.result)
        if not branches:
            raise KeyboardInterrupt from None
        raise Interrupted(Branches(system, parameter, (low, high), tuple(branches))) from None
    if not branches and late:
        raise InputError("continuation: no motion to start from was found within max_seconds; raise max_seconds")
    if not branches:
        raise InputError("continuation: no periodic motion to start from: give a guess (x, v) near one")
    if seeds:
        _warn_of_the_unfound(branches, others)
    _warn_of_cuts(branches, late)
    return Branches(system, parameter, (low, high), tuple(branches), tuple(others))


def _search(
    system: Oscillator | System,
    path: str,
    family: Family,
    starts: list[tuple[float, Any]],
    branches: list[Branch],
    most: int,
    progress: Callable[[int, int], Any],
    limit: TimeLimit,
) -> int:
    """Add the branches from steady slip, the starts and the Hopf points; how many starts the limit left out."""
    late = 0
    integrated = system.integrated
    if not integrated and forcing_period(system) is None:
        steady = _steady(system, path, family)
        if steady.values:
            branches.append(steady)
    for value, start in starts:
        if limit.passed:
            late += 1
            continue
        try:
            cycle = periodic_orbit(with_number(system, path, value), start, progress=lambda: progress(0, most))
        except InputError:
            if start is not None:
                raise
            continue
        if any(lies_on(branch, cycle, value) for branch in branches):
            continue
        if isinstance(cycle, StateCycle):
            branches.append(StateWalk(path, family.ranges[0], most, progress, limit).both_ways(cycle))
        else:
            try:
                point = corrected_at(cycle.closed.sequence, cycle.forcing_periods, family, value)
            except Lost as lost:
                if start is None:
                    continue
                raise InputError(str(lost)) from None
            branches.append(both_ways(point, family, most, progress, limit))
    for hopf in [item for branch in branches if branch.kind == "steady_slip" for item in branch.special_points]:
        assert hopf.system is not None
        if limit.passed:
            late += 1
            continue
        new = born_branch(hopf.system, hopf.parameter, family, branches, most, progress, limit)
        if new is not None:
            branches.append(new)
    return late


def _others(
    system: Oscillator,
    path: str,
    family: Family,
    value: float,
    branches: list[Branch],
    starts: int,
    most: int,
    progress: Callable[[int, int], Any],
    limit: TimeLimit,
) -> list[OtherMotion]:
    """Add the branches of the motions that a grid of starts ends in; those motions that are on none of them."""
    left = []
    there = with_number(system, path, value)
    assert isinstance(there, Oscillator)
    progress(0, most)
    slowest = max(there.natural_period, forcing_period(there) or 0.0)
    for other in other_motions(there, value, branches, starts):
        try:
            length = max(300 * slowest, STICKS * longest_stick(there))
            cycle = event_cycle(there, other.start, t_end=length, progress=lambda: progress(0, most))
            point = corrected_at(cycle.closed.sequence, cycle.forcing_periods, family, value)
        except (InputError, Lost):
            left.append(other)
            continue
        if not any(lies_on(branch, cycle, value) for branch in branches):
            branches.append(both_ways(point, family, most, progress, limit))
    return left


def _warn_of_the_unfound(branches: list[Branch], others: list[OtherMotion]) -> None:
    """Say where a motion must be that was looked for and not found."""
    steady = branches[0]
    unstable = [value for value, stable in zip(steady.values, steady.stable, strict=True) if stable is False]
    if steady.kind == "steady_slip" and unstable and len(branches) == 1 and not others:
        sentence = (
            f"continuation: steady slip is unstable from {min(unstable):g} to {max(unstable):g}, and the motion that it is "
            "left for was not found: raise seeds or starts, or give a guess (x, v)"
        )
        warnings.warn(sentence, UnfinishedWarning, stacklevel=3)


def _warn_of_cuts(branches: list[Branch], late: int) -> None:
    """Say what goes on beyond the limits."""
    for limit in ("most", "max_seconds"):
        cut = sum(branch.cut == limit for branch in branches)
        unseen = late if limit == "max_seconds" else 0
        if cut or unseen:
            left = f" and {unseen} starts were not looked at" if unseen else ""
            sentence = (
                f"continuation: {cut} of {len(branches)} branches were cut off by {limit}{left}; raise {limit} to go on"
            )
            # At the line that called for the continuation.
            warnings.warn(sentence, UnfinishedWarning, stacklevel=3)


def lies_on(branch: Branch, cycle: Cycle, value: float, family: Family | None = None) -> bool:
    """Whether a cycle is one that the branch has already; with a family, the branch is closed anew at that value."""
    if branch.kind != "cycle":
        return False
    near, _ = crossings(branch, value)
    low, high = range_of(cycle)
    size = max(high - low, 1e-300)
    if any(abs(branch.x_max[i] - high) < 0.1 * size and abs(branch.x_min[i] - low) < 0.1 * size for i in near):
        return True
    return family is not None and any(
        same_motion(cycle, there) for i in near for there in _closed_at(branch, int(i), value, family)
    )


def _closed_at(branch: Branch, index: int, value: float, family: Family) -> list[Cycle]:
    """The orbit of a branch at a value between two of its points, none where it does not close there."""
    cycle = branch.orbit(index)
    if not isinstance(cycle, PeriodicOrbit):
        return []
    try:
        return [unchecked(corrected_at(cycle.closed.sequence, cycle.forcing_periods, family, value).here)]
    except Lost:
        return []


def _steady(system: Oscillator | System, path: str, family: Family) -> Branch:
    low, high = family.ranges[0]
    branch = Branch("steady_slip")
    for value in np.linspace(low, high, 121):
        state = steady_slip(with_number(system, path, float(value)))
        if state is None:
            continue
        x = first_of(state.x)
        row = (float(value), None if state.neutral else state.growth < 0, math.nan, state.growth, x, x, False)
        for name, item in zip(COLUMNS, row, strict=True):
            getattr(branch, name).append(item)
    for kind, value in hopf_points(system, path, (low, high)) if branch.values else ():
        there = with_number(system, path, value)
        state = steady_slip(there)
        x = math.nan if state is None else first_of(state.x)
        branch.special_points.append(SpecialPoint(kind, value, x=(x, x), system=there))
    return branch


def both_ways(
    start: Point,
    family: Family,
    most: int,
    progress: Any = None,
    limit: TimeLimit = NO_LIMIT,
    known: Sequence[Branch] = (),
) -> Branch:
    """The branch of a cycle, from where the parameter falls to where it grows; a closed one from its start.

    It ends where it meets one that is known.
    """

    def met(cycle: Cycle, value: float) -> bool:
        return any(lies_on(branch, cycle, value, family) for branch in known)

    def go(sign: float) -> Branch:
        way = start.direction * math.copysign(1.0, start.direction[PARAMETER]) * sign
        return Walk(family, most, progress, limit, met).go(replace(start, direction=way))

    return both_ways_of(go)


def born_branch(
    system: Oscillator | System,
    value: float,
    family: Family,
    known: list[Branch],
    most: int,
    progress: Any = None,
    limit: TimeLimit = NO_LIMIT,
) -> Branch | None:
    """The branch that begins at a Hopf point; None where there is none or it is known."""
    start = born(system, value, family)
    if start is None or any(lies_on(branch, unchecked(start.here), float(start.values[0])) for branch in known):
        return None
    branch = both_ways(start, family, most, progress, limit, known)
    # Of a known branch only its smallest cycles may be larger than the start.
    middle = len(branch.values) // 2
    if any(lies_on(other, branch.orbit(middle), branch.values[middle]) for other in known):
        return None
    return branch
