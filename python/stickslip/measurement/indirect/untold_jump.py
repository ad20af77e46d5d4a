"""What follows where a record does not tell whether friction jumps as a mass breaks away: how late its break-aways may be.

Whether it tells is decided in `sticks/resting_sticks.py`.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from stickslip.files.units import unit_suffix
from stickslip.measurement.indirect.force import Friction
from stickslip.measurement.indirect.sticks.stick import Stick, ends_of
from stickslip.measurement.rigs.rig import RigUnits


def with_untold_jump(friction: Friction, sticks: list[Stick], untold: float) -> Friction:
    """The friction with errors that hold break-aways with a jump of friction, where it was taken not to jump.

    Where friction jumps by less than the noise shows, all of its fall is read as one that begins at rest, and the break-away
    as earlier, where the spring bears less by the jump. Where friction is taken to be constant in motion, its fall is read as
    part of the jump, and the break-away as later. Any place between the two is as likely as the next: `late` holds their root
    mean square distance from the first, where the break-aways stay. Until the later one the mass may still rest, so friction
    beside a break-away may be what the spring bears.

    Parameters
    ----------
    friction : of a record whose sticks end where the force does not jump.
    sticks : those sticks.
    untold : by how much later they end if it does, in s.
    """
    o, error = friction.fit.oscillator, friction.force_error.copy()
    borne = o.stiffness * friction.extension + o.damping * o.drive_velocity
    for end in ends_of(sticks):
        near = slice(*np.searchsorted(friction.time, [end, end + untold]).tolist())
        rests = 1 - (friction.time[near] - end) / untold
        error[near] = np.hypot(error[near], np.abs(borne - friction.force)[near] * np.sqrt(rests))
    return replace(friction, force_error=error, untold=untold).with_late_error(untold / math.sqrt(3))


def notes_on_untold_jump(friction: Friction, units: RigUnits) -> list[str]:
    """Whether the record leaves open if the force jumps at break-aways, and what is stated of them then."""
    o, untold = friction.fit.oscillator, friction.untold
    if not untold:
        return []
    return [
        "the record does not tell whether friction jumps as the mass breaks away: it was taken not to, and if it does all "
        f"break-aways are up to {o.stiffness * o.drive_velocity * untold:.2g}{unit_suffix(units.force)} higher and "
        f"{untold:.2g}{unit_suffix(units.time)} later, hardly lower or earlier; their errors hold that; to tell, record with "
        "less noise or faster"
    ]
