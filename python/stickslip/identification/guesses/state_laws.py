"""First guesses of laws with an internal state: what a record of the motion tells of them, and what is held."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from stickslip.errors import InputError
from stickslip.identification.guesses.evidence import Evidence, Guess
from stickslip.identification.guesses.kinetic_curves import NARROW_RANGE, curve_of, exponential, stribeck
from stickslip.laws import BoucWen, Coulomb, Dahl, ElastoPlastic, Law, LuGre, RateState, Regularised

STIFF = 0.01
"""Bristles are first taken to bend by this part of the range of motion."""
WIDTH = 1e-3
"""The width of a smooth sign, relative to the highest slip speed."""
DIRECT = 0.015
"""Direct effect a of rate-and-state friction over μ₀, about that of rock."""
DECADES = 0.5
"""Slip speeds (5th to 95th percentile) that span less than that many decades do not show a logarithm."""


def _bristles(evidence: Evidence, force: float) -> tuple[float, float, str]:
    """Stiffness and damping of bristles that are too stiff to be seen, and the sentence that says so."""
    stiffness = max(force, 1e-12) / (STIFF * max(_reach(evidence), 1e-12))
    mass = float(np.median([record.constants.get("mass", 1.0) for record in evidence.records]))
    note = (
        f"The stiffness of the bristles is held at {stiffness:.3g}, at which they bend by {STIFF:g} of the range of motion; "
        "give it as free where the record shows the rise of force at a reversal."
    )
    return stiffness, float(np.sqrt(stiffness * mass)), note


def _reach(evidence: Evidence) -> float:
    """Range of the motion about its mean velocity."""
    paths = [record.slip_velocity * record.step for record in evidence.records]
    return float(np.median([np.ptp(np.cumsum(path - path.mean())) for path in paths]))


def _dahl(evidence: Evidence) -> Guess:
    kinetic = max(evidence.kinetic, 1e-12)
    stiffness, _, note = _bristles(evidence, kinetic)
    return Guess(Dahl(stiffness=stiffness, kinetic=kinetic), ["kinetic"], notes=[note])


def _bouc_wen(evidence: Evidence) -> Guess:
    # Steady slip has F = k/(β + γ) for n = 1 and A = 1.
    kinetic = max(evidence.kinetic, 1e-12)
    stiffness, _, note = _bristles(evidence, kinetic)
    held = "The exponent is held at 1, the amplitude at 1 and gamma at 0, where steady slip has the force stiffness / beta."
    return Guess(BoucWen(stiffness=stiffness, beta=stiffness / kinetic, gamma=0.0), ["beta"], notes=[note, held])


def _lugre(evidence: Evidence) -> Guess:
    break_away, kinetic, scale, viscous = stribeck(evidence, "LuGre", 2.0, least_viscous=0.0)
    stiffness, damping, note = _bristles(evidence, break_away)
    law = LuGre(stiffness, damping, viscous, max(kinetic, 1e-12), break_away, scale)
    return Guess(law, ["kinetic", "break_away", "scale", "viscous"], notes=[note])


def _elasto_plastic(evidence: Evidence) -> Guess:
    start = _lugre(evidence)
    law = start.law
    assert isinstance(law, LuGre)
    numbers = (law.stiffness, law.damping, law.viscous, law.kinetic, law.break_away, law.scale)
    whole = ElastoPlastic(*numbers, elastic=0.5 * law.kinetic / law.stiffness)
    return Guess(
        whole, start.free, notes=[*start.notes, "The elastic reach of the bristles is held at half their bend."]
    )


def _rate_state(evidence: Evidence) -> Guess:
    speed, force = evidence.curve
    moving = speed > 0
    low, middle, high = np.quantile(speed[moving], [0.05, 0.5, 0.95])
    if math.log10(high / low) < DECADES:
        raise InputError(
            "identify: RateState is a logarithm of the slip velocity, and nearly all slip is between "
            f"{low:.4g} and {high:.4g}: add records at drive velocities ten times apart, or measure a step in velocity"
        )
    weights = [record.constants["weight"] for record in evidence.records if "weight" in record.constants]
    normal = float(np.median(weights)) if weights else 1.0
    inside = moving & (speed > low) & (speed < high)
    slope, level = np.polyfit(np.log(speed[inside] / middle), force[inside] / normal, 1)
    level = max(float(level), 1e-6)
    direct = max(DIRECT * level, 2 * float(slope))
    length = 0.1 * max(_reach(evidence), 1e-12)
    notes = [
        f"The normal force is held at {normal:.3g}"
        + ("" if weights else ", as the rig states none: friction is over it")
        + ".",
        f"The reference velocity is held at {middle:.3g}, the usual slip speed; the length is held at {length:.3g}, a tenth "
        "of the range of motion: give it as free where the record shows how friction settles after a change of speed.",
    ]
    law = RateState(normal, direct, max(direct - float(slope), 0.0), length, float(middle), level)
    return Guess(law, ["reference_friction", "a", "b"], notes=notes)


def _regularised(evidence: Evidence) -> Guess:
    speed, _ = evidence.curve
    low, high = np.quantile(speed, [0.05, 0.95])
    if high - low < NARROW_RANGE * high:
        inner = Guess(Coulomb(kinetic=max(evidence.kinetic, 0.0)), ["kinetic"])
    else:
        curve_of(evidence, "Regularised")
        inner = exponential(evidence)
    width = WIDTH * float(speed.max())
    note = (
        f"The width of the smooth sign is held at {width:.3g}, {WIDTH:g} of the highest slip speed: it is no number of the "
        "contact, and inside it the law creeps where the contact sticks."
    )
    return Guess(Regularised(inner.law, width), [f"law.{name}" for name in inner.free], notes=[*inner.notes, note])


STATES: dict[type[Law], Callable[[Evidence], Guess]] = {
    Dahl: _dahl,
    BoucWen: _bouc_wen,
    LuGre: _lugre,
    ElastoPlastic: _elasto_plastic,
    RateState: _rate_state,
    Regularised: _regularised,
}
