"""Where a fit begins: each law's numbers read off the data, roughly and without knowing the answer."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import numpy.typing as npt
from scipy.interpolate import lagrange

from stickslip.errors import InputError
from stickslip.identification.guesses.evidence import Evidence, Guess, need_rows
from stickslip.identification.guesses.kinetic_curves import CURVES, curve_of, exponential
from stickslip.identification.guesses.loops import bogacz_ryczek
from stickslip.identification.guesses.state_laws import STATES
from stickslip.identification.static.break_away import NARROW
from stickslip.laws import (
    Asymmetric,
    BogaczRyczek,
    Combined,
    Coulomb,
    DwellTime,
    ExponentialStribeck,
    ForceRate,
    Law,
    LogarithmicDwell,
    PiecewiseLinear,
    PiecewisePolynomial,
    StaticKinetic,
)

Array = npt.NDArray[np.float64]

RATES = 1.5
"""Force rates (10th to 90th percentile) within this ratio say nothing about their effect."""
LEAST_SAMPLES = 10
"""So many samples of slip in a direction say something of its friction."""
CLOSER = 0.8
"""A curve is taken for one direction where its sum of squares is less than this part of that of a constant."""
DEGREE = 4
"""Degree of the polynomial that is first laid through a curve of any shape."""


def first_guess(kind: type[Law], evidence: Evidence) -> Guess:
    """The first guess for a kind of law.

    For developers: a law that can be identified has one function here and a line in `GUESSES`.

    Raises
    ------
    InputError
        where the records cannot identify the law, with the reason.
    """
    if kind not in GUESSES:
        known = ", ".join(law.__name__ for law in GUESSES)
        raise InputError(
            f"identify: there is no first guess for {kind.__name__}: give a law of it with numbers and the names to fit, or "
            f"choose one of {known}"
        )
    return GUESSES[kind](evidence)


def _coulomb(evidence: Evidence) -> Guess:
    return Guess(Coulomb(kinetic=max(evidence.kinetic, 0.0)), ["kinetic"])


def _static_kinetic(evidence: Evidence) -> Guess:
    need_rows(evidence, "StaticKinetic", 2)
    kinetic = max(evidence.kinetic, 0.0)
    if evidence.break_away < kinetic:
        raise InputError(
            f"identify: StaticKinetic needs break-away forces above the kinetic force, got {evidence.break_away:.4g} and "
            f"{kinetic:.4g}: check the rig's mass and stiffness, or ask for Coulomb"
        )
    return Guess(StaticKinetic(break_away=evidence.break_away, kinetic=kinetic), ["break_away", "kinetic"])


def _grown(evidence: Evidence, kind: str) -> tuple[float, float, float]:
    """Kinetic force, usual growth of static friction and usual stick time; refused where none of it is seen to differ."""
    need_rows(evidence, kind, 5)
    time = evidence.rows["stick_time"].to_numpy()
    low, high = np.quantile(time, [0.1, 0.9])
    if high < NARROW * low:
        raise InputError(
            f"identify: {kind} needs stick times that differ, here they lie between {low:.4g} and {high:.4g}: add records "
            "at other drive velocities, or ask for StaticKinetic"
        )
    kinetic = max(evidence.kinetic, 0.0)
    grown = evidence.break_away - kinetic
    if grown <= 0:
        raise InputError(
            f"identify: {kind} needs break-away forces above the kinetic force, got {evidence.break_away:.4g} and "
            f"{kinetic:.4g}: check the rig's mass and stiffness, or ask for Coulomb"
        )
    return kinetic, grown, float(np.median(time))


def _dwell_time(evidence: Evidence, kind: str = "DwellTime") -> Guess:
    kinetic, grown, usual = _grown(evidence, kind)
    rate = 1 / usual
    laws: list[Law] = [
        DwellTime(kinetic=kinetic, limit=grown / (1 - math.exp(-c)), rate=c * rate) for c in (0.3, 1.0, 3.0)
    ]
    if evidence.static is not None:
        table = evidence.static.fits["exponential"].parameters["value"]
        limit, found = float(table.loc["limit"]), float(table.loc["rate"])
        if limit > 0 and 1e-3 * rate < found < 1e3 * rate:
            laws.insert(0, DwellTime(kinetic=kinetic, limit=limit, rate=found))
    return Guess(
        laws[0], ["kinetic", "limit", "rate"], candidates=laws[1:], notes=["The exponent of growth is held at 1."]
    )


def _logarithmic_dwell(evidence: Evidence) -> Guess:
    kinetic, grown, usual = _grown(evidence, "LogarithmicDwell")
    laws: list[Law] = [
        LogarithmicDwell(kinetic, growth=grown / math.log1p(1 / share), onset=share * usual)
        for share in (0.1, 1.0, 10.0)
    ]
    return Guess(laws[0], ["kinetic", "growth", "onset"], candidates=laws[1:])


def _force_rate(evidence: Evidence) -> Guess:
    start = _dwell_time(evidence, "ForceRate")
    rate = evidence.rows["force_rate"].abs().dropna().to_numpy()
    if rate.size < 5:
        raise InputError(
            "identify: ForceRate needs force rates, and the break-aways have none: measure with a rig that knows its "
            "stiffness, or ask for DwellTime"
        )
    low, high = np.quantile(rate, [0.1, 0.9])
    if high < RATES * low:
        raise InputError(
            f"identify: ForceRate needs force rates that differ, here they lie between {low:.4g} and {high:.4g} (one drive "
            "velocity): add records at other drive velocities, or ask for DwellTime"
        )
    laws: list[Law] = []
    for law in (start.law, *start.candidates):
        assert isinstance(law, DwellTime)
        for share in (0.5, 2.0, 10.0):
            scale = share * float(np.median(rate))
            limit = law.limit * (1 + 1 / share)
            laws.append(ForceRate(law.kinetic, limit, law.rate, force_rate_scale=scale))
    notes = [*start.notes, "The exponent of the force rate is held at 1."]
    return Guess(laws[0], ["kinetic", "limit", "rate", "force_rate_scale"], candidates=laws[1:], notes=notes)


def _piecewise_linear(evidence: Evidence) -> Guess:
    speed, force = curve_of(evidence, "PiecewiseLinear")
    inner = np.quantile(speed, np.arange(1, evidence.pieces) / evidence.pieces)
    nodes = np.array([0.0, *inner, float(speed.max())])
    if not (np.diff(nodes) > 0).all():
        raise InputError(f"identify: the slip velocities are too few for {evidence.pieces} pieces; ask for fewer")
    hats = np.stack([np.interp(speed, nodes, unit) for unit in np.eye(len(nodes))], axis=1)
    movable = [f"nodes[{i}].slip_velocity" for i in range(1, len(nodes) - 1)]
    return _through_nodes(PiecewiseLinear, evidence, nodes, hats, force, movable)


def _piecewise_polynomial(evidence: Evidence) -> Guess:
    speed, force = curve_of(evidence, "PiecewisePolynomial")
    nodes = 0.5 * float(speed.max()) * (1 - np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE))
    weights = np.stack([lagrange(nodes, unit)(speed) for unit in np.eye(len(nodes))], axis=1)
    guess = _through_nodes(partial(PiecewisePolynomial, degree=DEGREE), evidence, nodes, weights, force, [])
    guess.notes.append(f"The curve is one polynomial of degree {DEGREE} up to the highest slip speed.")
    return guess


def _one_way(evidence: Evidence) -> Guess:
    """The law of one direction: by its sticks, else with a fall over the speed where that lies closer to the samples."""
    if len(evidence.rows) >= 2 and evidence.break_away > evidence.kinetic:
        return _static_kinetic(evidence)
    flat = _coulomb(evidence)
    try:
        falling = exponential(evidence)
    except InputError:
        return flat
    speed, force = evidence.curve
    misfits = [
        float(np.sum((force - law.kinetic_force(speed)) ** 2)) for law in (flat.law, falling.law, *falling.candidates)
    ]
    return falling if min(misfits[1:]) < CLOSER * misfits[0] else flat


def _asymmetric(evidence: Evidence) -> Guess:
    parts: dict[str, Guess] = {}
    for name, sense in (("forward", 1.0), ("backward", -1.0)):
        one = evidence.toward(sense)
        if one.curve[0].size < LEAST_SAMPLES:
            raise InputError(
                f"identify: Asymmetric needs slip in both directions, and the records hold {one.curve[0].size} samples "
                f"of slip {name}: add a record that goes there, or ask for the law of one direction"
            )
        parts[name] = _one_way(one)
    kinds = " and ".join(type(part.law).__name__ for part in parts.values())
    told = "its own break-aways tell" if len(evidence.rows) else "its kinetic friction tells (there are no break-aways)"
    note = f"The law of each direction is {kinds}, as {told}; give a law of another kind with names to fit."
    free = [f"{name}.{number}" for name, part in parts.items() for number in part.free]
    ways = [[part.law, *part.candidates] for part in parts.values()]
    # both ways have one form
    laws = [Asymmetric(*(way[min(i, len(way) - 1)] for way in ways)) for i in range(max(map(len, ways)))]
    return Guess(laws[0], free, candidates=[*laws[1:]], notes=[note])


def _combined(evidence: Evidence) -> Guess:
    curve = exponential(evidence)
    grown = _dwell_time(evidence, "Combined")
    laws: list[Law] = []
    for kinetic in (curve.law, *curve.candidates):
        assert isinstance(kinetic, ExponentialStribeck)
        for static in (grown.law, *grown.candidates):
            assert isinstance(static, DwellTime)
            # What grows does so from the kinetic force at w = 0.
            limit = max(static.kinetic + static.limit - kinetic.break_away, 0.1 * static.limit)
            laws.append(Combined(replace(static, kinetic=kinetic.break_away, limit=limit), kinetic))
    return Guess(
        laws[0],
        [*(f"kinetic.{name}" for name in curve.free), "static.limit", "static.rate"],
        constraints={"static.kinetic": "kinetic.break_away"},
        candidates=laws[1:],
        notes=[
            *grown.notes,
            "Static friction grows as DwellTime from the kinetic force at w = 0, an ExponentialStribeck.",
        ],
    )


def _through_nodes(
    law: Callable[..., Law], evidence: Evidence, nodes: Array, weights: Array, force: Array, free: Sequence[str]
) -> Guess:
    """A curve that is linear in the forces at its nodes, of which each sample has its `weights`."""
    values = np.maximum(np.linalg.lstsq(weights, force, rcond=None)[0], 0.0)
    free = [*(f"nodes[{i}].force" for i in range(len(nodes))), *free]
    notes, constraints = [], {}
    if len(evidence.rows) >= 2:
        top = max(evidence.break_away, float(values[0]))
        free.append("break_away")
    else:
        top = float(values[0])
        constraints["break_away"] = "nodes[0].force"
        notes.append(
            "The records hold no break-away, so the break-away force was set to the kinetic force at w = 0, which is an "
            "extrapolation."
        )
    pairs = tuple((float(w), float(f)) for w, f in zip(nodes, values, strict=True))
    return Guess(law(nodes=pairs, break_away=top), free, constraints=constraints, notes=notes)


GUESSES: dict[type[Law], Callable[[Evidence], Guess]] = {
    Coulomb: _coulomb,
    StaticKinetic: _static_kinetic,
    DwellTime: _dwell_time,
    LogarithmicDwell: _logarithmic_dwell,
    PiecewiseLinear: _piecewise_linear,
    PiecewisePolynomial: _piecewise_polynomial,
    Asymmetric: _asymmetric,
    Combined: _combined,
    ForceRate: _force_rate,
    BogaczRyczek: bogacz_ryczek,
    **CURVES,
    **STATES,
}
