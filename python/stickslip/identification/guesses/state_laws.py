"""First guesses of laws with an internal state: what a record of the motion tells of them, and what is held."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.identification.guesses.guess_data import Guess, GuessData
from stickslip.identification.guesses.kinetic_curves import NARROW_RANGE, SHAPES, curve_of, exponential, stribeck_of
from stickslip.identification.records import FrictionRecord
from stickslip.laws import BoucWen, Coulomb, Dahl, ElastoPlastic, Law, LuGre, RateState, Regularised
from stickslip.laws.law import force_along

STIFF = 0.01
"""Bristles are first taken to deflect by this part of the range of motion."""
SOFTER = (0.003, 0.03, 0.1, 0.3, 1.0)
"""Other deflections that are tried, over the range of motion."""
SHOWN = 0.7
"""A record shows the stiffness of bristles where others leave less than that part of the mean squared force."""
WIDTH = 1e-3
"""The width of a smooth sign, relative to the highest slip speed."""
SETTLED = 3.0
"""Bristles have settled after that many of their deflections."""
DAMPING = (0.1, 1.0)
"""Damping of bristles that is tried, over the root of stiffness and mass."""
STARTS = 3
"""So many deflections of bristles, those that lie closest to the record, are fitted from."""
NARROW, FALL = 0.3, 1.5
"""A sharp fall of friction, over less than this part of the highest speed and by this ratio, is fitted from too: bristles
that still give way while friction falls hide it from slip that has settled."""
RIGID = 20.0
"""Bristles that have settled that many times over where the samples could show them are rigid to a record."""
DIRECT = 0.015
"""Direct effect a of rate-and-state friction over μ₀, about that of rock."""
DECADES = 0.5
"""Slip speeds (5th to 95th percentile) that span less than that many decades do not show a logarithm."""


def _bristles(
    data: GuessData, force: float, law: Callable[[float, float, float], Law]
) -> tuple[Law, list[str], dict[str, str]]:
    """A law of bristles as stiff as the record shows them: with the names of stiffness and damping to fit, or what is held.

    `law` makes one from stiffness, damping and a factor of all its other forces. Where bristles of another stiffness than the
    stiffest lie clearly closer to the record, it shows how force rises after a reversal.
    """

    def of_deflection(share: float) -> tuple[float, Law]:
        stiffness, damping = _stiffness_and_damping(data, force, share)
        factor = _factor(data, law(stiffness, damping, 1.0))
        closest = law(factor * stiffness, factor * damping, factor)
        return _misfit(data, closest), closest

    usual, *softer = (of_deflection(share) for share in (STIFF, *SOFTER))
    misfit, closest = min(softer, key=lambda found: found[0])
    if misfit < SHOWN * usual[0]:
        return closest, [name for name in ("stiffness", "damping") if name in closest.PARAMETERS], {}
    stiffness, damping = _stiffness_and_damping(data, force, STIFF)
    return law(stiffness, damping, 1.0), [], {"stiffness": _held_stiffness(stiffness)}


def _stiffness_and_damping(data: GuessData, force: float, share: float) -> tuple[float, float]:
    """Of bristles that this force deflects by a share of the range of motion; the damping is √(stiffness · mass)."""
    mass = float(np.median([record.constants.get("mass", 1.0) for record in data.records]))
    stiffness = max(force, 1e-12) / (share * _reach(data))
    return stiffness, math.sqrt(stiffness * mass)


def _replayed(data: GuessData, law: Law) -> Array:
    return np.concatenate([force_along(law, r.time, r.slip_velocity, r.stuck) for r in data.records])


def _measured(data: GuessData) -> Array:
    return np.concatenate([record.force for record in data.records])


def _factor(data: GuessData, law: Law) -> float:
    """By which the forces of a law lie closest to those of the records."""
    along, measured = _replayed(data, law), _measured(data)
    return max(float(along @ measured) / max(float(along @ along), 1e-300), 1e-6)


def _misfit(data: GuessData, law: Law) -> float:
    return float(np.mean((_measured(data) - _replayed(data, law)) ** 2))


def _reach(data: GuessData) -> float:
    """Range of the motion about its mean velocity, above zero."""
    paths = [record.slip_velocity * record.step for record in data.records]
    return max(float(np.median([np.ptp(np.cumsum(path - path.mean())) for path in paths])), 1e-12)


def stiffest(records: Sequence[FrictionRecord]) -> float:
    """The stiffness of bristles above which records cannot tell it: stiffer ones predict the same as rigid ones.

    Such bristles have settled by the second sample after each reversal, as the first may lie anywhere near it, or from sample
    to sample where the slip does not turn; of several reversals and records the usual ones count.
    """
    tops = []
    for record in records:
        w = np.where(record.stuck, 0.0, record.slip_velocity)
        before, after = w[:-1], w[1:]
        # of a step in which the sense changes the part in the new sense
        share = np.where(before * after < 0, after / np.where(after == before, 1.0, after - before), 1.0)
        path = 0.5 * np.abs(np.where(before * after < 0, after, before + after)) * share * np.diff(record.time)
        slips = np.flatnonzero(after)
        turned = slips[1:][np.sign(after[slips[1:]]) != np.sign(after[slips[:-1]])]
        turned = turned[turned + 1 < path.size]
        shown = path[turned] + path[turned + 1] if turned.size else path[slips]
        tops.append(float(np.quantile(np.abs(record.force[~record.stuck]), 0.9)) / max(float(np.median(shown)), 1e-300))
    return RIGID * float(np.median(tops))


def _dahl(data: GuessData) -> Guess:
    kinetic = max(data.kinetic, 1e-12)
    law, free, held = _bristles(data, kinetic, lambda stiffness, _, by: Dahl(stiffness, by * kinetic))
    return Guess(law, ["kinetic", *free], held=held)


def _bouc_wen(data: GuessData) -> Guess:
    # Steady slip has F = k/(β + γ) for n = 1 and A = 1.
    kinetic = max(data.kinetic, 1e-12)
    law, free, held = _bristles(
        data, kinetic, lambda stiffness, _, by: BoucWen(stiffness, beta=stiffness / (by * kinetic), gamma=0.0)
    )
    note = "The exponent is held at 1, the amplitude at 1 and gamma at 0, where steady slip has the force stiffness / beta."
    return Guess(law, ["beta", *free], notes=[note], held=held)


def _lugre(data: GuessData) -> Guess:
    found = _bristles_and_curves(data)
    usual = found[STIFF][0][1]
    closest = sorted(found.values(), key=lambda laws: laws[0][0])
    laws = [law for _, law in closest[0]]
    sharp = next((law for law in laws if law.scale < NARROW * float(data.curve[0].max())), laws[0])
    sharp = replace(sharp, break_away=max(sharp.break_away, FALL * sharp.kinetic))
    return Guess(
        usual,
        ["kinetic", "break_away", "scale", "viscous"],
        wider=["stiffness", "damping"],
        starts=[*(laws[0][1] for laws in closest[:STARTS]), sharp],
        held={"stiffness": _held_stiffness(usual.stiffness)},
    )


def _held_stiffness(stiffness: float) -> str:
    return (
        f"The stiffness of the bristles is held at {stiffness:.3g}, at which they deflect by {STIFF:g} of the range of "
        "motion; give it as free where the record shows the rise of force at a reversal."
    )


def _bristles_and_curves(data: GuessData) -> dict[float, list[tuple[float, LuGre]]]:
    """For each deflection of the bristles, over the range of motion, the misfits of laws and the laws, the least first.

    The curve is that of slip which is so far from its last reversal that the bristles have settled; the fall with the speed
    has several widths, the damping several sizes.
    """
    w, _ = curve_of(data, "LuGre")
    force = float(np.quantile(np.abs(_measured(data)), 0.9))
    reach = _reach(data)
    settled = np.concatenate([_since_reversal(record)[~record.stuck] for record in data.records])
    found = {}
    for share in (STIFF, *SOFTER):
        kept = settled > SETTLED * share * reach
        speed, along = data.curve if np.count_nonzero(kept) < 0.1 * w.size else (w[kept], data.curve[1][kept])
        stiffness, damping = _stiffness_and_damping(data, force, share)
        laws = []
        for shapes in (SHAPES, *SHAPES[::4, None]):
            break_away, kinetic, scale, viscous = stribeck_of(speed, along, 2.0, least_viscous=0.0, shapes=shapes)
            for part in DAMPING:
                law = LuGre(stiffness, part * damping, viscous, max(kinetic, 1e-12), break_away, scale)
                laws.append((_misfit(data, law), law))
        found[share] = sorted(laws, key=lambda law: law[0])
    return found


def _since_reversal(record: FrictionRecord) -> Array:
    """The path of the slip since its sense last changed or it stood, at each sample."""
    w = np.where(record.stuck, 0.0, record.slip_velocity)
    path = np.cumsum(np.abs(w)) * record.step
    begun = np.flatnonzero(np.diff(np.sign(w), prepend=0.0))
    last = np.zeros(w.size, int)
    last[begun] = begun
    return np.asarray(path - path[np.maximum.accumulate(last)])


def _elasto_plastic(data: GuessData) -> Guess:
    start = _lugre(data)

    def whole(law: Law) -> ElastoPlastic:
        assert isinstance(law, LuGre)
        numbers = (law.stiffness, law.damping, law.viscous, law.kinetic, law.break_away, law.scale)
        return ElastoPlastic(*numbers, elastic=0.5 * min(law.kinetic, law.break_away))

    held = {**start.held, "elastic": "Bristles are held elastic up to half of the kinetic force."}
    starts: list[Law] = [whole(law) for law in start.starts]
    return replace(start, law=whole(start.law), wider=[*start.wider, "elastic"], starts=starts, held=held)


def _rate_state(data: GuessData) -> Guess:
    speed, force = data.curve
    moving = speed > 0
    low, middle, high = np.quantile(speed[moving], [0.05, 0.5, 0.95])
    if math.log10(high / low) < DECADES:
        raise InputError(
            "identify: RateState is a logarithm of the slip velocity, and nearly all slip is between "
            f"{low:.4g} and {high:.4g}: add records at drive velocities ten times apart, or measure a step in velocity"
        )
    weights = [record.constants["weight"] for record in data.records if "weight" in record.constants]
    normal = float(np.median(weights)) if weights else 1.0
    inside = moving & (speed > low) & (speed < high)
    slope, level = np.polyfit(np.log(speed[inside] / middle), force[inside] / normal, 1)
    level = max(float(level), 1e-6)
    direct = max(DIRECT * level, 2 * float(slope))
    length = 0.1 * _reach(data)
    notes = [
        f"The normal force is held at {normal:.3g}"
        + ("" if weights else ", as the rig states none: friction is over it")
        + ".",
        f"The reference velocity is held at {middle:.3g}, the usual slip speed; the length is held at {length:.3g}, a tenth "
        "of the range of motion: give it as free where the record shows how friction settles after a change of speed.",
    ]
    law = RateState(normal, direct, max(direct - float(slope), 0.0), length, float(middle), level)
    return Guess(law, ["reference_friction", "a", "b"], notes=notes)


def _regularised(data: GuessData) -> Guess:
    speed, _ = data.curve
    low, high = np.quantile(speed, [0.05, 0.95])
    if high - low < NARROW_RANGE * high:
        inner = Guess(Coulomb(kinetic=max(data.kinetic, 0.0)), ["kinetic"])
    else:
        curve_of(data, "Regularised")
        inner = exponential(data)
    width = WIDTH * float(speed.max())
    note = (
        f"The width of the smooth sign is held at {width:.3g}, {WIDTH:g} of the highest slip speed: it is no number of the "
        "contact, and inside it the law creeps where the contact sticks."
    )
    return Guess(Regularised(inner.law, width), [f"law.{name}" for name in inner.free], notes=[*inner.notes, note])


BRISTLES: tuple[type[Law], ...] = (Dahl, BoucWen, LuGre, ElastoPlastic)
"""Laws of bristles, whose number `stiffness` no record limits from above where the bristles look rigid."""
STATES: dict[type[Law], Callable[[GuessData], Guess]] = {
    Dahl: _dahl,
    BoucWen: _bouc_wen,
    LuGre: _lugre,
    ElastoPlastic: _elasto_plastic,
    RateState: _rate_state,
    Regularised: _regularised,
}
