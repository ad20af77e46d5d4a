"""First guesses of laws whose kinetic force is one curve over the slip velocity: linear least squares on a grid of shapes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from scipy.optimize import lsq_linear

from stickslip.errors import InputError
from stickslip.files.arrays import Array, Indices
from stickslip.identification.estimator.hat_functions import hats_at
from stickslip.identification.guesses.guess_data import Guess, GuessData
from stickslip.identification.kinetic.replayed_motion import without_wiggles
from stickslip.laws import (
    Cubic,
    ExponentialStribeck,
    Law,
    Lorentzian,
    PoppStelter,
    Rational,
    Tabulated,
    TwoBranch,
)

NARROW_RANGE = 0.1
"""A range of slip speeds (5th to 95th percentile) within this part of the highest shows no curve."""
NARROW_TIMES = 1.25
"""Stick times (10th to 90th percentile) within this ratio are one."""
STATIC_NODES = 5
"""The most nodes of the break-away force beyond that at stick time 0."""
LEAST_DROP = 0.01
"""Friction is first taken to fall with the speed by at least that part of the highest."""
SHAPES = np.geomspace(0.02, 3.0, 25)
"""Slip speeds, relative to the highest, over which a curve may bend."""


def curve_of(data: GuessData, kind: str) -> tuple[Array, Array]:
    """Slip speed and kinetic force of all samples; refused where they show no curve."""
    speed, force = data.curve
    low, high = np.quantile(speed, [0.05, 0.95])
    if high - low < NARROW_RANGE * high:
        raise InputError(
            f"identify: {kind} is a curve over the slip velocity, and nearly all slip is between {low:.4g} and {high:.4g}: "
            "add records at other drive velocities, or one that oscillates, or ask for Coulomb"
        )
    return speed, force


def nodes_over(speed: Array, pieces: int) -> Array:
    """The ends of so many pieces with equally many samples each, from 0 to the highest speed."""
    nodes = np.array([0.0, *np.quantile(speed, np.arange(1, pieces) / pieces), float(speed.max())])
    if not (np.diff(nodes) > 0).all():
        raise InputError(f"identify: the slip velocities are too few for {pieces} pieces; ask for fewer")
    return nodes


def _least(
    speed: Array, force: Array, basis: Callable[[float], list[Array]], low: Sequence[float], shapes: Array = SHAPES
) -> tuple[float, list[float]]:
    """The shape on the grid and the numbers, none below its `low`, with the least squares."""

    def fitted(shape: float) -> tuple[float, float, list[float]]:
        turned, triangle = np.linalg.qr(np.stack(basis(shape), axis=1))
        found = lsq_linear(triangle, turned.T @ force, bounds=(np.array(low, float), np.inf))
        return float(found.cost), shape, found.x.tolist()

    _, shape, numbers = min(map(fitted, (shapes * float(speed.max())).tolist()), key=lambda found: found[0])
    return shape, numbers


def _with_fall(
    w: Array, force: Array, fall: Callable[[float], Law], beside: Array, least: float = -np.inf, shapes: Array = SHAPES
) -> tuple[float, float, float, float]:
    """Break-away, kinetic, scale and number of `beside` of f_k + (f_s − f_k) fall(w) + number · beside through samples.

    `fall` gives for a scale the law that falls from 1 to 0; the number of `beside` is no less than `least`.
    """
    low = [0.0, LEAST_DROP * float(np.abs(force).max()), least]
    scale, (kinetic, drop, number) = _least(
        w, force, lambda s: [np.ones_like(w), fall(s).kinetic_force(w), beside], low, shapes
    )
    return kinetic + drop, kinetic, scale, number


def stribeck_of(
    w: Array, force: Array, exponent: float, least_viscous: float = -np.inf, shapes: Array = SHAPES
) -> tuple[float, float, float, float]:
    """Break-away, kinetic, scale and viscous of f_k + (f_s − f_k) exp(−(w/w_s)^exponent) + b w through these samples."""
    fall = partial(ExponentialStribeck, 1.0, 0.0, exponent=exponent)
    return _with_fall(w, force, fall, w, least_viscous, shapes)


def exponential(data: GuessData) -> Guess:
    """A fall and a line, the fall an exponential or a Gaussian, of the likeliest width and of others.

    Beside sticks measured friction is smoothed into them, and the samples there may ask for a fall that is none.
    """
    choices = ExponentialStribeck.PARAMETERS["exponent"].choices
    curve = curve_of(data, "ExponentialStribeck")
    laws: list[Law] = [
        ExponentialStribeck(*stribeck_of(*curve, n, shapes=shapes), exponent=n)
        for shapes in (SHAPES, *SHAPES[::4, None])
        for n in choices
    ]
    return Guess(laws[0], ["break_away", "kinetic", "scale", "viscous"], candidates=laws[1:])


def _lorentzian(data: GuessData) -> Guess:
    w, force = curve_of(data, "Lorentzian")
    law = Lorentzian(*_with_fall(w, force, partial(Lorentzian, 1.0, 0.0), w))
    return Guess(law, ["break_away", "kinetic", "scale", "viscous"])


def _popp_stelter(data: GuessData) -> Guess:
    w, force = curve_of(data, "PoppStelter")
    break_away, kinetic, scale, square = _with_fall(w, force, lambda s: Rational(1.0, 1 / s), w**2)
    law = PoppStelter(break_away, kinetic, 1 / scale, square)
    return Guess(law, ["break_away", "kinetic", "weakening", "square"])


def _rational(data: GuessData) -> Guess:
    w, force = curve_of(data, "Rational")
    scale, (break_away,) = _least(w, force, lambda s: [Rational(1.0, 1 / s).kinetic_force(w)], [0.0])
    return Guess(Rational(break_away, 1 / scale), ["break_away", "weakening"])


def _cubic(data: GuessData) -> Guess:
    w, force = curve_of(data, "Cubic")
    columns = np.stack([np.ones_like(w), -w, w**3], axis=1)
    static, linear, cubic = (float(number) for number in np.linalg.lstsq(columns, force, rcond=None)[0])
    return Guess(Cubic(max(static, 0.0), linear, cubic), ["static", "linear", "cubic"])


def _spread(time: Array) -> list[Indices]:
    """Rows at stick times that are spread over their range, both ends among them, however many sticks lie where."""
    groups: list[list[int]] = []
    for row in np.argsort(time):
        if not groups or time[row] > NARROW_TIMES * time[groups[-1][0]]:
            groups.append([])
        groups[-1].append(int(row))
    # Between the ends a single stick is no place for a node.
    groups = [group for k, group in enumerate(groups) if k in (0, len(groups) - 1) or len(group) > 1]
    chosen = dict.fromkeys(np.linspace(0, len(groups) - 1, STATIC_NODES).round().astype(int))
    return [np.array(groups[k]) for k in chosen]


def _tabulated(data: GuessData) -> Guess:
    w, force = curve_of(data, "Tabulated")
    nodes = np.linspace(0.0, float(np.quantile(w, 0.95)), data.pieces + 1)
    hats = hats_at(w, nodes)
    values = np.maximum(np.linalg.lstsq(hats, force, rcond=None)[0], 0.0)
    kinetic = tuple(zip(nodes.tolist(), values.tolist(), strict=True))
    free = [f"kinetic[{i}].force" for i in range(nodes.size)]
    if len(data.rows) < 2:
        note = "The records hold no break-away, so static friction is the kinetic force at w = 0, an extrapolation."
        law = Tabulated(kinetic, kinetic[0][1])
        return Guess(law, free, ties={"break_away": "kinetic[0].force"}, notes=[note])
    time = data.rows["stick_time"].to_numpy()
    limit = data.rows["force"].to_numpy()
    low, high = np.quantile(time, [0.1, 0.9])
    if len(data.rows) < 5 or high < NARROW_TIMES * low:
        top = max(data.break_away, 1.001 * kinetic[0][1])
        return Guess(Tabulated(kinetic, top), [*free, "break_away"])
    static = [(0.0, kinetic[0][1])]
    for part in _spread(time):
        static.append((float(np.median(time[part])), max(float(np.median(limit[part])), static[-1][1])))
    note = "The break-away force at stick time 0 was set to the kinetic force at w = 0, which is an extrapolation."
    return Guess(
        Tabulated(kinetic, tuple(static)),
        [*free, *(f"break_away[{i}].force" for i in range(1, len(static)))],
        ties={"break_away[0].force": "kinetic[0].force"},
        notes=[note],
    )


def _two_branch(data: GuessData) -> Guess:
    w, _ = curve_of(data, "TwoBranch")
    rising: list[Array] = []
    falling: list[Array] = []
    for record in data.records:
        smooth = np.abs(without_wiggles(record)[0])
        force = np.copysign(1.0, record.slip_velocity) * record.force
        sense = np.gradient(smooth)
        for part, keep in ((rising, sense > 0), (falling, sense < 0)):
            part.append(np.stack([smooth, force])[:, keep & ~record.stuck])
    nodes = nodes_over(w, data.pieces)
    branches = []
    for part in (rising, falling):
        speed, force = np.concatenate(part, axis=1)
        if speed.size < 10 * nodes.size:
            raise InputError(
                "identify: TwoBranch needs slip that speeds up and slip that slows down, the records hold hardly any of one "
                "of them: add a record that oscillates"
            )
        hats = hats_at(speed, nodes)
        ridge = 1e-6 * np.eye(nodes.size) * speed.size
        values = np.linalg.solve(hats.T @ hats + ridge, hats.T @ force + ridge @ np.full(nodes.size, np.mean(force)))
        branches.append(tuple(zip(nodes.tolist(), np.maximum(values, 0.0).tolist(), strict=True)))
    up, down = branches
    free = [f"{name}[{i}].force" for name in ("rising", "falling") for i in range(nodes.size)]
    free += [f"{name}[{i}].slip_velocity" for name in ("rising", "falling") for i in range(1, nodes.size - 1)]
    top = max(up[0][1], down[0][1], data.break_away if len(data.rows) >= 2 else 0.0)
    if len(data.rows) >= 2:
        free.append("break_away")
    return Guess(TwoBranch(rising=up, falling=down, break_away=1.001 * top), free)


CURVES: dict[type[Law], Callable[[GuessData], Guess]] = {
    ExponentialStribeck: exponential,
    PoppStelter: _popp_stelter,
    Rational: _rational,
    Cubic: _cubic,
    TwoBranch: _two_branch,
    Lorentzian: _lorentzian,
    Tabulated: _tabulated,
}
