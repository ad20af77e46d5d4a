"""First guesses of laws whose kinetic force is one curve over the slip velocity: linear least squares on a grid of shapes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from stickslip.errors import InputError
from stickslip.identification.motion import without_wiggles
from stickslip.identification.seen import Guess, Seen
from stickslip.laws import (
    Cubic,
    Dahl,
    ElastoPlastic,
    ExponentialStribeck,
    Law,
    LuGre,
    PoppStelter,
    Rational,
    TwoBranch,
)

Array = npt.NDArray[np.float64]

NARROW_RANGE = 0.1
"""A range of slip speeds (5th to 95th percentile) within this part of the highest shows no curve."""
SHAPES = np.geomspace(0.02, 3.0, 25)
"""Slip speeds, relative to the highest, over which a curve may bend."""
STIFF = 0.01
"""Bristles are first taken to bend by this part of the range of motion."""


def curve_of(seen: Seen, kind: str) -> tuple[Array, Array]:
    """Slip speed and kinetic force of all samples; refused where they show no curve."""
    speed, force = seen.curve
    low, high = np.quantile(speed, [0.05, 0.95])
    if high - low < NARROW_RANGE * high:
        raise InputError(
            f"identify: {kind} is a curve over the slip velocity, and nearly all slip is between {low:.4g} and {high:.4g}: "
            "add records at other drive velocities, or one that oscillates, or ask for Coulomb"
        )
    return speed, force


def _least(speed: Array, force: Array, basis: Callable[[float], list[Array]]) -> tuple[float, Array]:
    """The shape on the grid and the numbers with the least squares."""
    best: tuple[float, float, Array] | None = None
    for shape in SHAPES * float(speed.max()):
        columns = np.stack(basis(float(shape)), axis=1)
        numbers = np.asarray(np.linalg.lstsq(columns, force, rcond=None)[0], float)
        misfit = float(np.sum((force - columns @ numbers) ** 2))
        if best is None or misfit < best[0]:
            best = (misfit, float(shape), numbers)
    assert best is not None
    return best[1], best[2]


def _stribeck(seen: Seen, kind: str, exponent: float) -> tuple[float, float, float, float]:
    """Break-away, kinetic, scale and viscous of f_k + (f_s − f_k) exp(−(w/w_s)^exponent) + b w."""
    w, force = curve_of(seen, kind)
    scale, (kinetic, drop, viscous) = _least(w, force, lambda s: [np.ones_like(w), np.exp(-((w / s) ** exponent)), w])
    kinetic = max(float(kinetic), 0.0)
    return kinetic + max(float(drop), 0.01 * float(np.abs(force).max())), kinetic, scale, float(viscous)


def _exponential(seen: Seen) -> Guess:
    break_away, kinetic, scale, viscous = _stribeck(seen, "ExponentialStribeck", 1.0)
    law = ExponentialStribeck(break_away, kinetic, scale, viscous)
    return Guess(law, ["break_away", "kinetic", "scale", "viscous"])


def _popp_stelter(seen: Seen) -> Guess:
    w, force = curve_of(seen, "PoppStelter")
    scale, (kinetic, drop, square) = _least(w, force, lambda s: [np.ones_like(w), 1 / (1 + w / s), w**2])
    kinetic = max(float(kinetic), 0.0)
    law = PoppStelter(kinetic + max(float(drop), 0.0), kinetic, 1 / scale, float(square))
    return Guess(law, ["break_away", "kinetic", "weakening", "square"])


def _rational(seen: Seen) -> Guess:
    w, force = curve_of(seen, "Rational")
    scale, (break_away,) = _least(w, force, lambda s: [1 / (1 + w / s)])
    return Guess(Rational(max(float(break_away), 0.0), 1 / scale), ["break_away", "weakening"])


def _cubic(seen: Seen) -> Guess:
    w, force = curve_of(seen, "Cubic")
    columns = np.stack([np.ones_like(w), -w, w**3], axis=1)
    static, linear, cubic = (float(number) for number in np.linalg.lstsq(columns, force, rcond=None)[0])
    return Guess(Cubic(max(static, 0.0), linear, cubic), ["static", "linear", "cubic"])


def _bristles(seen: Seen, force: float) -> tuple[float, float, str]:
    """Stiffness and damping of bristles that are too stiff to be seen, and the sentence that says so."""
    paths = [record.slip_velocity * record.step for record in seen.records]
    reach = float(np.median([np.ptp(np.cumsum(path - path.mean())) for path in paths]))
    stiffness = max(force, 1e-12) / (STIFF * max(reach, 1e-12))
    mass = float(np.median([record.constants.get("mass", 1.0) for record in seen.records]))
    note = (
        f"The stiffness of the bristles is held at {stiffness:.3g}, at which they bend by {STIFF:g} of the range of motion; "
        "give it as free where the record shows the rise of force at a reversal."
    )
    return stiffness, float(np.sqrt(stiffness * mass)), note


def _dahl(seen: Seen) -> Guess:
    kinetic = max(seen.kinetic, 1e-12)
    stiffness, _, note = _bristles(seen, kinetic)
    return Guess(Dahl(stiffness=stiffness, kinetic=kinetic), ["kinetic"], notes=[note])


def _lugre(seen: Seen) -> Guess:
    break_away, kinetic, scale, viscous = _stribeck(seen, "LuGre", 2.0)
    stiffness, damping, note = _bristles(seen, break_away)
    law = LuGre(stiffness, damping, viscous, max(kinetic, 1e-12), break_away, scale)
    return Guess(law, ["kinetic", "break_away", "scale", "viscous"], notes=[note])


def _elasto_plastic(seen: Seen) -> Guess:
    start = _lugre(seen)
    law = start.law
    assert isinstance(law, LuGre)
    numbers = (law.stiffness, law.damping, law.viscous, law.kinetic, law.break_away, law.scale)
    whole = ElastoPlastic(*numbers, elastic=0.5 * law.kinetic / law.stiffness)
    return Guess(
        whole, start.free, notes=[*start.notes, "The elastic reach of the bristles is held at half their bend."]
    )


def _two_branch(seen: Seen) -> Guess:
    w, _ = curve_of(seen, "TwoBranch")
    rising: list[Array] = []
    falling: list[Array] = []
    for record in seen.records:
        smooth = np.abs(without_wiggles(record)[0])
        force = np.copysign(1.0, record.slip_velocity) * record.force
        sense = np.gradient(smooth)
        for part, keep in ((rising, sense > 0), (falling, sense < 0)):
            part.append(np.stack([smooth, force])[:, keep & ~record.stuck])
    nodes = np.linspace(0.0, float(w.max()), seen.pieces + 1)
    branches = []
    for part in (rising, falling):
        speed, force = np.concatenate(part, axis=1)
        if speed.size < 10 * nodes.size:
            raise InputError(
                "identify: TwoBranch needs slip that speeds up and slip that slows down, the records hold hardly any of one "
                "of them: add a record that oscillates"
            )
        hats = np.stack([np.interp(speed, nodes, unit) for unit in np.eye(nodes.size)], axis=1)
        ridge = 1e-6 * np.eye(nodes.size) * speed.size
        values = np.linalg.solve(hats.T @ hats + ridge, hats.T @ force + ridge @ np.full(nodes.size, np.mean(force)))
        branches.append(tuple((float(a), float(b)) for a, b in zip(nodes, np.maximum(values, 0.0), strict=True)))
    up, down = branches
    free = [f"{name}[{i}].force" for name in ("rising", "falling") for i in range(nodes.size)]
    top = max(up[0][1], down[0][1], seen.break_away if len(seen.rows) >= 2 else 0.0)
    if len(seen.rows) >= 2:
        free.append("break_away")
    return Guess(TwoBranch(rising=up, falling=down, break_away=1.001 * top), free)


CURVES: dict[type[Law], Callable[[Seen], Guess]] = {
    ExponentialStribeck: _exponential,
    PoppStelter: _popp_stelter,
    Rational: _rational,
    Cubic: _cubic,
    TwoBranch: _two_branch,
    Dahl: _dahl,
    LuGre: _lugre,
    ElastoPlastic: _elasto_plastic,
}
