"""Where a fit begins: each law's numbers read off the data, roughly and without knowing the answer."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from scipy.interpolate import lagrange

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.identification.estimator.hat_functions import hats_at
from stickslip.identification.guesses.bogacz_ryczek_guess import bogacz_ryczek
from stickslip.identification.guesses.guess_data import Guess, GuessData, need_rows
from stickslip.identification.guesses.kinetic_curves import CURVES, curve_of, exponential, nodes_over
from stickslip.identification.guesses.state_laws import STATES
from stickslip.identification.static.caveats import NARROW
from stickslip.identification.static.forms import ONSET, OWN_LEVEL
from stickslip.laws import (
    Asymmetric,
    BogaczRyczek,
    Combined,
    Coulomb,
    DwellTime,
    ForceRate,
    Law,
    LogarithmicDwell,
    PiecewiseLinear,
    PiecewisePolynomial,
    StaticKinetic,
)
from stickslip.laws.numbers import value, with_values

LEVELLED: dict[type[Law], str] = {DwellTime: "limit", LogarithmicDwell: "growth", ForceRate: "limit"}
"""Laws whose static friction grows from a level, their number `kinetic`, and the number that says by how much."""
RATES = 1.5
"""Force rates (10th to 90th percentile) within this ratio say nothing about their effect."""
LEAST_SAMPLES = 10
"""So many samples of slip in a direction say something of its friction."""
CLOSER = 0.8
"""A curve is taken for one direction where its sum of squares is less than this part of that of a constant."""
DEGREE = 4
"""Degree of the polynomial that is first laid through a curve of any shape."""


def first_guess(kind: type[Law], data: GuessData) -> Guess:
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
    return GUESSES[kind](data)


def _coulomb(data: GuessData) -> Guess:
    return Guess(Coulomb(kinetic=max(data.kinetic, 0.0)), ["kinetic"])


def _static_kinetic(data: GuessData) -> Guess:
    need_rows(data, "StaticKinetic", 2)
    kinetic = max(data.kinetic, 0.0)
    if data.break_away < kinetic:
        raise InputError(
            f"identify: StaticKinetic needs break-away forces above the kinetic force, got {data.break_away:.4g} and "
            f"{kinetic:.4g}: check the rig's mass and stiffness, or ask for Coulomb"
        )
    return Guess(StaticKinetic(break_away=data.break_away, kinetic=kinetic), ["break_away", "kinetic"])


def _grown(data: GuessData, kind: str) -> tuple[float, float, float]:
    """Kinetic force, usual growth of static friction and usual stick time; refused where none of it is seen to differ."""
    need_rows(data, kind, 5)
    time = data.rows["stick_time"].to_numpy()
    low, high = np.quantile(time, [0.1, 0.9])
    if high < NARROW * low:
        raise InputError(
            f"identify: {kind} needs stick times that differ, here they lie between {low:.4g} and {high:.4g}: add records "
            "at other drive velocities, or ask for StaticKinetic"
        )
    kinetic = max(data.kinetic, 0.0)
    grown = data.break_away - kinetic
    if grown <= 0:
        raise InputError(
            f"identify: {kind} needs break-away forces above the kinetic force, got {data.break_away:.4g} and "
            f"{kinetic:.4g}: check the rig's mass and stiffness, or ask for Coulomb"
        )
    return kinetic, grown, float(np.median(time))


def _dwell_time(data: GuessData, kind: str = "DwellTime") -> Guess:
    kinetic, grown, usual = _grown(data, kind)
    rate = 1 / usual
    laws: list[Law] = [
        DwellTime(kinetic=kinetic, limit=grown / (1 - math.exp(-c)), rate=c * rate) for c in (0.3, 1.0, 3.0)
    ]
    for form in ("exponential", "exponential" + OWN_LEVEL):
        found = _numbers(data, form)
        if found and found["limit"] > 0 and 1e-3 * rate < found["rate"] < 1e3 * rate:
            laws.insert(0, DwellTime(found.get("f0", kinetic), found["limit"], found["rate"]))
    return Guess(
        laws[0], ["kinetic", "limit", "rate"], candidates=laws[1:], notes=["The exponent of growth is held at 1."]
    )


def _logarithmic_dwell(data: GuessData) -> Guess:
    kinetic, grown, usual = _grown(data, "LogarithmicDwell")
    laws: list[Law] = [
        LogarithmicDwell(kinetic, growth=grown / math.log1p(1 / share), onset=share * usual)
        for share in (0.1, 1.0, 10.0)
    ]
    found = _numbers(data, ONSET)
    if found and found["growth"] > 0 and 1e-3 * usual < found["onset"] < 1e3 * usual:
        laws.insert(0, LogarithmicDwell(found["f0"], found["growth"], found["onset"]))
    return Guess(laws[0], ["kinetic", "growth", "onset"], candidates=laws[1:])


def _numbers(data: GuessData, form: str) -> dict[str, float]:
    """The numbers of a form of static friction that was fitted to the break-aways; none where it was not."""
    fits = {} if data.static is None else data.static.fits
    found = fits[form].parameters["value"].to_dict() if form in fits else {}
    return {str(name): float(number) for name, number in found.items() if found.get("f0", 0.0) >= 0}


def _force_rate(data: GuessData) -> Guess:
    start = _dwell_time(data, "ForceRate")
    rate = data.rows["force_rate"].abs().dropna().to_numpy()
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


def _piecewise_linear(data: GuessData) -> Guess:
    speed, force = curve_of(data, "PiecewiseLinear")
    nodes = nodes_over(speed, data.pieces)
    hats = hats_at(speed, nodes)
    movable = [f"nodes[{i}].slip_velocity" for i in range(1, len(nodes) - 1)]
    return _through_nodes(PiecewiseLinear, data, nodes, hats, force, movable)


def _piecewise_polynomial(data: GuessData) -> Guess:
    speed, force = curve_of(data, "PiecewisePolynomial")
    nodes = 0.5 * float(speed.max()) * (1 - np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE))
    weights = np.stack([lagrange(nodes, unit)(speed) for unit in np.eye(len(nodes))], axis=1)
    guess = _through_nodes(partial(PiecewisePolynomial, degree=DEGREE), data, nodes, weights, force, [])
    guess.notes.append(f"The curve is one polynomial of degree {DEGREE} up to the highest slip speed.")
    return guess


def _one_way(data: GuessData) -> Guess:
    """The law of one direction: by its sticks, else with a fall over the speed where that lies closer to the samples."""
    if len(data.rows) >= 2 and data.break_away > data.kinetic:
        return _static_kinetic(data)
    flat = _coulomb(data)
    try:
        falling = exponential(data)
    except InputError:
        return flat
    speed, force = data.curve
    misfits = [
        float(np.sum((force - law.kinetic_force(speed)) ** 2)) for law in (flat.law, falling.law, *falling.candidates)
    ]
    return falling if min(misfits[1:]) < CLOSER * misfits[0] else flat


def _asymmetric(data: GuessData) -> Guess:
    parts: dict[str, Guess] = {}
    for name, sense in (("forward", 1.0), ("backward", -1.0)):
        one = data.toward(sense)
        if one.curve[0].size < LEAST_SAMPLES:
            raise InputError(
                f"identify: Asymmetric needs slip in both directions, and the records hold {one.curve[0].size} samples "
                f"of slip {name}: add a record that goes there, or ask for the law of one direction"
            )
        parts[name] = _one_way(one)
    kinds = " and ".join(type(part.law).__name__ for part in parts.values())
    reason = "its own break-aways tell" if len(data.rows) else "its kinetic friction tells (there are no break-aways)"
    note = f"The law of each direction is {kinds}, as {reason}; give a law of another kind with names to fit."
    free = [f"{name}.{number}" for name, part in parts.items() for number in part.free]
    ways = [[part.law, *part.candidates] for part in parts.values()]
    # both ways have one form
    laws = [Asymmetric(*(way[min(i, len(way) - 1)] for way in ways)) for i in range(max(map(len, ways)))]
    return Guess(laws[0], free, candidates=[*laws[1:]], notes=[note])


def _combined(data: GuessData) -> Guess:
    """Parts as asked for or as the law given says, else growth as the break-aways show and a fall with the slip speed."""
    static_kind, curve = _dwell_kind(data), None
    if isinstance(data.start, Combined):
        static_kind = type(data.start.static)
        curve = first_guess(type(data.start.kinetic), replace(data, start=data.start.kinetic))
    elif len(data.parts) > 1:
        curve = first_guess(data.parts[1], data)
    else:
        try:
            curve = exponential(data)
        except InputError:  # hardly any range of slip speeds: no curve over them
            curve = _coulomb(data)
    static_kind = data.parts[0] if data.parts else static_kind
    grown = first_guess(static_kind, data)
    speeds = np.linspace(0.0, float(data.curve[0].max()), 20)
    slides = [name for name in curve.free if _acts(curve.law, name, lambda law: law.kinetic_force(speeds))]
    own_level = data.static is not None and data.static.own_level
    follows = next((name for name in slides if _acts(curve.law, name, lambda law: law.kinetic_force(0.0))), None)
    names = [name for name in grown.free if name != "kinetic"]
    ties, free_level, notes = {}, [], []
    parts = f"static friction grows as {static_kind.__name__}"
    if static_kind in LEVELLED and (own_level or follows is None):
        free_level = ["static.kinetic"]
        notes.append(
            f"static.kinetic, from which {parts}, is fitted as a number of its own, as the break-aways begin above the "
            f"kinetic force; to set it to the kinetic force at w = 0 give ties: static.kinetic=kinetic.{follows}."
        )
    elif static_kind in LEVELLED:
        ties = {"static.kinetic": f"kinetic.{follows}"}
        notes.append(
            f"static.kinetic, from which {parts}, follows kinetic.{follows}, the kinetic force at w = 0 of "
            f"{type(curve.law).__name__}; to fit it as a number of its own give empty ties."
        )
    laws: list[Law] = []
    for kinetic in (curve.law, *curve.candidates):
        for static in (grown.law, *grown.candidates):
            laws += _joined(static, kinetic, own_level)
    if not laws:
        raise InputError(
            "identify: no growth of static friction and curve of kinetic friction that these records show make one law, as "
            "friction would rise from rest to slip; ask for another one, such as StaticKinetic"
        )
    return Guess(
        laws[0],
        [*(f"kinetic.{name}" for name in slides), *free_level, *(f"static.{name}" for name in names)],
        ties=ties,
        candidates=laws[1:],
        notes=[*grown.notes, *curve.notes, *notes],
    )


def _dwell_kind(data: GuessData) -> type[Law]:
    """The law of growth with rest whose form the break-aways show."""
    bounded = data.static is None or data.static.chosen.startswith(("exponential", "Kato", "constant"))
    return DwellTime if bounded else LogarithmicDwell


def _acts(law: Law, name: str, answer: Callable[[Law], Any]) -> bool:
    """Whether a number of the law changes what it answers."""
    return not np.array_equal(answer(law), answer(with_values(law, {name: 1.01 * value(law, name) + 1e-6})))


def _joined(static: Law, kinetic: Law, own_level: bool) -> list[Law]:
    """The law of these parts; what grows begins at the kinetic force at w = 0 unless it has a level of its own."""
    if type(static) in LEVELLED and not own_level:
        top, grows = float(kinetic.kinetic_force(0.0)), LEVELLED[type(static)]
        grown = value(static, grows)
        change = {"kinetic": top, grows: max(value(static, "kinetic") + grown - top, 0.1 * grown)}
        static = with_values(static, change)
    try:
        return [Combined(static, kinetic)]
    except InputError:
        return []


def _through_nodes(
    law: Callable[..., Law], data: GuessData, nodes: Array, weights: Array, force: Array, free: Sequence[str]
) -> Guess:
    """A curve that is linear in the forces at its nodes, of which each sample has its `weights`."""
    values = np.maximum(np.linalg.lstsq(weights, force, rcond=None)[0], 0.0)
    free = [*(f"nodes[{i}].force" for i in range(len(nodes))), *free]
    notes, ties = [], {}
    if len(data.rows) >= 2:
        top = max(data.break_away, float(values[0]))
        free.append("break_away")
    else:
        top = float(values[0])
        ties["break_away"] = "nodes[0].force"
        notes.append(
            "The records hold no break-away, so the break-away force was set to the kinetic force at w = 0, which is an "
            "extrapolation."
        )
    pairs = tuple(zip(nodes.tolist(), values.tolist(), strict=True))
    return Guess(law(nodes=pairs, break_away=top), free, ties=ties, notes=notes)


GUESSES: dict[type[Law], Callable[[GuessData], Guess]] = {
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
