"""Whether the law that lies closest to the records is one that they obey: lack of fit, said or refused."""

from __future__ import annotations

import math

import numpy as np

from stickslip.errors import InputError
from stickslip.files.arrays import Array, Mask
from stickslip.identification.kinetic.force_residuals import Problem
from stickslip.identification.kinetic.replayed_motion import Motion
from stickslip.identification.steady.curves import Rows
from stickslip.identification.steady.misfit import PART, SURE, predicts_worse
from stickslip.identification.steady.single_form_fit import linear_losses
from stickslip.identification.steady.steady_rows import beside_sticks
from stickslip.laws import Law

APART = 0.1
"""Records whose mean friction differs from the law by more than that part of it do not obey one law."""
DRIVEN = 0.2
"""A law that pushes with the slip over more than that part of its path is no friction."""
MOSTLY = 0.5
"""Share of the mean squared misfit of a law that a force of the position must explain before the law is refused."""
NOISY = 3.0
"""A misfit that many times the instrument's noise is no noise."""
CHANGE_OVER_HALVES, CHANGE_SHARE, FEWEST_SPEED_SAMPLES = 5.0, 0.03, 20
"""Friction changes with slip speed by so many times what halves of a record differ by, and by that share of it; both known
from no fewer samples than that."""


def lack_of_fit(problem: Problem, law: Law, offset: float = 0.0) -> list[str]:
    """What the fitted law leaves of the records that noise cannot have made, as plain sentences.

    Raises
    ------
    InputError
        where the law pushes with the slip, as no friction does.
    """
    kind = type(law).__name__
    off, levels, driven, noisy, curved = [], [], [], [], list[str]()
    for motion in problem.motions:
        record, predicted = motion.record, motion.replay(law)
        moving = ~record.stuck
        path = np.abs(motion.slip_velocity[moving])
        weight = path / path.sum() if path.sum() > 0 else np.full(path.size, 1 / path.size)
        sense = np.where(motion.slip_velocity[moving] < 0, -1.0, 1.0)
        residuals = sense * (record.force - predicted - offset)[moving]
        off.append(float(weight @ residuals))
        levels.append(float(weight @ np.abs(record.force[moving])))
        driven.append(float(weight @ (sense * predicted[moving] < 0)))
        ranges = _speed_ranges(motion)
        if ranges and (found := _change_with_speed(path, sense * record.force[moving], *ranges)):
            change, slow, fast = found
            curved.append(
                f"{record.name}: friction is {'higher' if change > 0 else 'lower'} by {abs(change):.2g} at slip speeds about "
                f"{fast:.2g} than about {slow:.2g}, and {kind} has one number for all: ask for a law with a curve, as "
                "ExponentialStribeck or Combined."
            )
        if motion.indirect and not motion.by_work and motion.stretches:
            left = float(np.sqrt(np.mean(motion.misfit(law, offset) ** 2)))
            noisy.append(left / record.constants["noise"])
    if max(driven) > DRIVEN:
        raise InputError(
            f"identify: the {kind} closest to the records pushes with the slip over {100 * max(driven):.0f} % of its path, "
            "which no friction does: check the signs of displacement and drive velocity, the rest position and the mass"
        )
    notes = [*curved, *_force_of_the_position(problem, law, offset)]
    names = [motion.record.name for motion in problem.motions]
    if len(off) > 1 and max(map(abs, off)) > APART * float(np.mean(levels)):
        each = ", ".join(f"{value:+.2g} ({name})" for value, name in zip(off, names, strict=True))
        notes.append(
            f"The records do not obey one {kind}: their mean friction is {np.mean(levels):.3g} and off from it by {each}; "
            "look whether they are of one contact. The intervals do not hold for each of them."
        )
    if noisy and max(noisy) > NOISY:
        notes.append(
            f"{kind} leaves up to {max(noisy):.3g} times the noise of the instrument: the contact obeys another law, or the "
            "rig's mass, damping or stiffness is wrong; the intervals are of the nearest law of this form."
        )
    return notes


def _speed_ranges(motion: Motion) -> tuple[Array, Mask] | None:
    """Six ends of five parts of the slip speeds in which friction is looked at, and the samples of slip that show it.

    Of speeds that follow from a displacement the slowest sixth is left out: what is measured there is smoothed into the
    sticks beside it. A force that was measured is shown by samples that are clear of sticks, down to the slowest. None where
    the law has a curve.
    """
    if not motion.by_work:
        return None
    record = motion.record
    moving = ~record.stuck
    speed = np.abs(motion.slip_velocity[moving])
    clear = ~beside_sticks(record.time, moving, float(record.attrs.get("cutoff", math.nan)))[moving] & (speed > 0)
    if motion.indirect or "slip_cutoff" in record.constants or not clear.any():
        return speed.max(initial=1e-300) * np.arange(1, 7) / 6, np.ones(speed.size, dtype=bool)
    return np.geomspace(np.quantile(speed[clear], 0.02), speed.max(), 6), clear


def _change_with_speed(speed: Array, friction: Array, ends: Array, clear: Mask) -> tuple[float, float, float] | None:
    """Of friction between two slip speeds the greatest change, and both speeds, slow and fast; None where it is not clear.

    The odd and the even tenths of the record, each for itself, tell what is clear.
    """
    part = np.where(clear, np.minimum(np.searchsorted(ends, speed, side="right"), 5), 0)
    odd = np.arange(len(speed)) * 10 // len(speed) % 2 == 1
    cells = [(part == k) & (odd == half) for half in (False, True) for k in range(1, 6)]
    if min(map(np.count_nonzero, cells)) < FEWEST_SPEED_SAMPLES:
        return None
    levels = np.array([friction[cell].mean() for cell in cells]).reshape(2, 5)
    level, apart = levels.mean(axis=0), float(np.abs(np.diff(levels, axis=0)).max())
    slow, fast = sorted((int(level.argmin()), int(level.argmax())))
    change = float(level[fast] - level[slow])
    if abs(change) < max(CHANGE_OVER_HALVES * apart, CHANGE_SHARE * float(np.abs(level).mean())):
        return None
    return change, float(np.median(speed[part == slow + 1])), float(np.median(speed[part == fast + 1]))


def _force_of_the_position(problem: Problem, law: Law, offset: float) -> list[str]:
    """That a force measured to and fro holds one of gravity or a spring beside the law, whose numbers it moves."""
    notes = []
    for motion in problem.motions:
        record, clear = motion.record, ~motion.record.stuck
        if motion.indirect or record.displacement is None or not record.both_senses():
            continue
        w, x = motion.slip_velocity[clear], record.displacement[clear]
        residuals = motion.difference(law, offset)[clear]
        sense, none = np.where(w < 0, -1.0, 1.0), np.full(w.size, np.nan)
        turning = record.units.get("slip_velocity") == "rad/s"
        rows = Rows(w, residuals, np.ones(w.size), none, x, np.full(w.size, record.name), True, turning=turning)
        levels = np.stack([sense, np.ones(w.size)], axis=1)
        of_position = np.stack([np.sin(x), np.cos(x)] if turning else [x - x.mean()], axis=1)
        alone, beside = (linear_losses(rows, part) for part in (levels, np.hstack([levels, of_position])))
        if not predicts_worse(rows, alone, beside, SURE, PART):
            continue
        share = 1 - float(beside.mean() / alone.mean())
        force = (
            "sine and cosine of the angle, as the weight of an arm does"
            if turning
            else "the position, as a spring does"
        )
        said = (
            f"{record.name}: {100 * share:.0f} % of what {type(law).__name__} misses of the force follows {force}, and "
            "the law has no such force: it moves the numbers. Fit friction over slip velocity with that force beside it "
            "(--steady, fit_steady; --law Asymmetric for numbers of their own each way), or take that force off the record."
        )
        if share > MOSTLY:
            raise InputError(f"identify: {said}")
        notes.append(said)
    return notes
