"""The other branch at a special point: of twice the period at a flip, through a branch point, beyond a boundary."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from stickslip.dynamics.continuation.arclength import Family, Point, consistent, corrected, evaluate
from stickslip.dynamics.continuation.bifurcation_conditions import PARAMETER
from stickslip.dynamics.continuation.branch import Branch, Branches, SpecialPoint
from stickslip.dynamics.continuation.switching_boundaries import beyond
from stickslip.dynamics.continuation.walk import Walk
from stickslip.dynamics.periodic.event_sequence import pointer
from stickslip.dynamics.periodic.newton_iteration import Lost
from stickslip.dynamics.periodic.poincare_map import Return, moved
from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.simulation.time_limit import TimeLimit

#: How far beside the special point the other branch is looked for, in sizes of the motion.
_ASIDE = (1e-3, 3e-3, 1e-2, 3e-4)


def switch_branch(
    result: Branches,
    point: SpecialPoint,
    *,
    most: int = 300,
    max_seconds: float | None = None,
    progress: Callable[[int, int], Any] | None = None,
) -> Branch:
    """Follow the branch that a special point of a branch opens.

    At a flip the orbit is taken twice and moved along the eigenvector of the multiplier −1; at a branch point it is moved
    along the second null vector of the derivative of the closed orbit; at a sliding bifurcation motion beside the boundary
    shows the event sequence that takes over (:func:`stickslip.continuation` goes on with it by itself, this is it alone).

    Parameters
    ----------
    result : from :func:`stickslip.continuation`; its parameter and bounds are kept.
    point : one of its special points.
    most : the most points.
    max_seconds : time on the clock > 0 after which no further point is looked for; default none. The ``cut`` of the branch
        says which of these limits ended it.
    progress : called as ``progress(points, most)``.

    Returns
    -------
    Branch from the special point on; ``dataclasses.replace(result, branches=(*result.branches, new))`` has it in the picture.

    Raises
    ------
    InputError
        at a kind that opens no branch (a fold), or where none is found beside the point.

    Source: Kuznetsov, Elements of Applied Bifurcation Theory, ch. 10.

    >>> import stickslip as ss
    >>> slider = ss.Oscillator(0.0, 0.3, ss.laws.StaticKinetic(1.0, 0.4), forcing=ss.Harmonic(0.2, 2.0))
    >>> result = ss.continuation(slider, "forcing.amplitude", (0.19, 0.23), seeds=0)
    >>> flip = next(item for item in result.special_points if item.kind == "flip")
    >>> doubled = ss.switch_branch(result, flip, most=5)
    >>> round(doubled.period[-1] / result.branches[0].period[-1], 9)
    2.0
    """
    if point.point is None:
        raise InputError(f"switch_branch: a {point.kind} has no orbit to go on from")
    limit = TimeLimit.after(max_seconds, "switch_branch")
    family = Family((pointer(result.system, result.parameter, "switch_branch"),), (result.bounds,))
    if point.label is not None:
        found = beyond(point.point, point.point.here, family, (1.0, -1.0))
        start = None if found is None else found[0]
    elif point.kind in ("flip", "branch_point"):
        start = _aside(point.point, family, double=point.kind == "flip")
    else:
        raise InputError(
            f"switch_branch: no branch begins at a {point.kind}; take a flip, a branch point or a boundary"
        )
    if start is None:
        raise InputError(f"switch_branch: no other branch is found beside the {point.kind} at {point.parameter:.9g}")
    branch = Walk(family, most, progress, limit).go(start)
    return branch if branch.closed else replace(branch, ends=(point.kind, branch.ends[1]))


def _aside(point: Point, family: Family, *, double: bool) -> Point | None:
    """The first point of the other branch."""
    here = point.here
    across = _across(here, family, point, double=double)
    sequence, forcing_periods = here.sequence, here.forcing_periods * (2 if double else 1)
    if double:
        sequence = replace(sequence, phases=np.tile(sequence.phases, 2))
    sizes = here.sizes
    span = float(family.scales(point.values)[0])
    for size in _ASIDE:
        for sign in (1.0, -1.0):
            leap = sign * size * across
            start = replace(sequence, start=moved(here, leap[here.coordinates] * sizes).start)
            try:
                found = corrected(start, forcing_periods, family, point.values + leap[PARAMETER] * span, sign * across)
            except (Lost, InputError):
                continue
            apart = np.abs(found.here.sequence.start[here.coordinates] - here.sequence.start[here.coordinates]) / sizes
            if consistent(found.here) and apart.max() > 0.1 * size:
                return found
    return None


def _across(here: Return, family: Family, point: Point, *, double: bool) -> Array:
    """The direction of the other branch: scaled, over the state and the parameter."""
    sizes = here.sizes
    across = np.zeros(len(point.direction))
    if double:
        scaled = here.map_jacobian * sizes / sizes[:, None]
        values, vectors = np.linalg.eig(scaled)
        across[here.coordinates] = vectors[:, int(np.argmin(np.abs(values + 1)))].real
        return np.asarray(across / np.linalg.norm(across), float)
    _, _, jacobian, _ = evaluate(here.sequence, here.forcing_periods, family, point.values, None)
    columns = [*here.coordinates, len(across) - 1]
    scales = np.concatenate([sizes, family.scales(point.values)])
    _, _, rows = np.linalg.svd(jacobian * scales / sizes[:, None])
    null, along = rows[-2:], point.direction[columns]
    # Of the plane of null vectors the one across the branch.
    shares = null @ along
    across[columns] = shares[1] * null[0] - shares[0] * null[1]
    return np.asarray(across / np.linalg.norm(across), float)
