"""A speed or a force that was recorded without its sign."""

from __future__ import annotations

import numpy as np

from stickslip.errors import InputError
from stickslip.files.arrays import Array

TURN_LEVEL = 0.3
"""Of its usual size a force must have on both sides of zero to turn."""
REST = 0.15
"""Of its usual size a speed has at most where it turns."""
TURNS = 4
"""So many turns at least tell a sign."""
TURNS_AT_REST = 0.9
"""Share of the turns of a force at which an unsigned speed is near zero."""
CANCELS = 0.5
"""Share of its own size that the power of a friction has on average where the speed has no sign: it should all be taken."""
SAME = 0.1
"""So much a force without its sign may differ between the two senses of the slip."""


def notes_on_signs(speed: Array, force: Array, source: str) -> list[str]:
    """Refuse a speed without its sign, and say where the force has none.

    A speed is unsigned where the friction turns its sign, the speed never does, and at nine of ten turns the speed is near
    zero, which it is in less than half of the record, and friction would give back about as much energy as it takes. A force
    is where it never turns, the speed does, and the force is the same in both senses to 10 %.

    Parameters
    ----------
    speed, force : (n,) slip velocity and friction.
    source : of the record.

    Raises
    ------
    InputError
        for an unsigned speed.

    Examples
    --------
    >>> t = np.arange(0, 20, 0.01)
    >>> notes_on_signs(np.sin(t), 3 * np.sign(np.sin(t)), "r")
    []
    >>> notes_on_signs(np.abs(np.sin(t)), 3 * np.sign(np.sin(t)), "r")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    stickslip.errors.InputError: r: the force turns its sign 6 times and the speed, near zero at each of them, never does...
    """
    turns, way = _turns(force), _turns(speed)
    usual = float(np.quantile(np.abs(speed), 0.9))
    slow = np.abs(speed) < REST * usual
    one_way = not len(way) and min(abs(float(speed.min())), abs(float(speed.max()))) < REST * usual
    power = force * speed
    gives_back = abs(float(power.sum())) < CANCELS * float(np.abs(power).sum())
    if len(turns) >= TURNS and one_way and slow.mean() < 0.5 and gives_back:
        at_rest = float(np.mean([slow[first : last + 1].any() for first, last in turns]))
        if at_rest >= TURNS_AT_REST:
            raise InputError(
                f"{source}: the force turns its sign {len(turns)} times and the speed, near zero at each of them, never "
                "does: it seems to be recorded without its sign; give a displacement, or the speed with its sign"
            )
    if len(way) >= TURNS and not len(turns):
        forward, backward = (float(np.median(force[sense * speed > 0.5 * usual])) for sense in (1, -1))
        if abs(forward - backward) < SAME * max(abs(forward), abs(backward)):
            return [
                f"the speed turns its sign {len(way)} times and the force never does: it is {forward:.4g} forward and "
                f"{backward:.4g} backward, as a force recorded without its sign is, or one whose zero is off by far more "
                "than friction; friction turns with the slip, so correct the sign or the zero of the force"
            ]
    return []


def _turns(values: Array) -> list[tuple[int, int]]:
    """The last sample clearly on one side of zero and the first clearly on the other, for each change of sides."""
    level = TURN_LEVEL * float(np.quantile(np.abs(values), 0.9))
    clear = np.flatnonzero(np.abs(values) > level)
    change = np.flatnonzero(np.diff(np.sign(values[clear])))
    return [(int(clear[i]), int(clear[i + 1])) for i in change]
