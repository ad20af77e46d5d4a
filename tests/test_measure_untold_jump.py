"""Break-aways at which noise hides whether friction jumps: what is stated holds both."""

import functools

import numpy as np
import pytest
import spring_and_block

from stickslip.identification import fit_static_friction
from stickslip.measurement import Rig, measure

DRIVE, STEP, NOISE, DAMPING = 1.34, 0.045, 0.02, 0.037


@functools.cache
def friction(limit, fall=0.8, scale=1.07, seed=1):
    """Friction of a record of the tests' own simulator: f_k = 3.4 + fall exp(-w / scale), 140 samples in a free period."""
    x, *_ = spring_and_block.motion(
        lambda w: 3.4 + fall * np.exp(-w / scale),
        lambda _: limit,
        DRIVE,
        damping=DAMPING,
        step=STEP,
        samples=1200,
        inner=20,
    )
    rig = Rig(
        instrument="spring_force", column="f", unit="N", stiffness=1.0, mass=1.0, damping=DAMPING, drive_velocity=DRIVE
    )
    force = x + NOISE * np.random.default_rng(seed).standard_normal(x.size)
    return measure({"t": STEP * np.arange(x.size), "f": force}, rig)


def said(tree):
    return [note for note in tree.attrs["notes"] if "does not tell whether friction jumps" in note]


@pytest.mark.parametrize("limit", [4.35, *(pytest.param(limit, marks=pytest.mark.long) for limit in (4.2, 4.48))])
def test_a_jump_under_the_noise_is_held_by_the_interval_of_static_friction(limit):
    # friction jumps by 0, 0.15 or 0.28 and falls on by 0.8: it was taken not to jump, all break-aways 0.01 to 0.3 too low
    found = friction(limit)
    table = found["break_away"]
    off, error = float(table["force"].mean()) - limit, float(table["force_error"].median())
    assert abs(off) < 1.96 * error < 0.9
    low, high = fit_static_friction(found).fits["constant"].parameters.iloc[0][["low", "high"]]
    assert low < limit < high
    (note,) = said(found)
    assert " N higher and " in note
    # the time goes with the force, and both errors are shared by all break-aways
    late = found.attrs["break_away_late"]
    assert float(table["t_error"].min()) > late > STEP / 2
    assert error > DRIVE * late
    # the break-aways themselves are where they were, so nothing is shifted where friction does not jump
    assert off < 0.05


def test_a_jump_that_is_seen_is_given_as_it_was():
    found = friction(5.0, fall=0.0)
    assert not said(found)
    assert found.attrs["break_away_late"] < STEP / 4
    assert abs(float(found["break_away"]["force"].mean()) - 5.0) < 0.05


@pytest.mark.slow
def test_intervals_hold_small_jumps_over_noises_and_falls():
    # 0 of the 9 whose jump is hidden held before
    hidden = held = 0
    for limit in (4.25, 4.35, 4.48):
        for scale in (0.7, 1.07, 1.6):
            for seed in range(3):
                found = friction(limit, 0.8, scale, seed)
                low, high = fit_static_friction(found).fits["constant"].parameters.iloc[0][["low", "high"]]
                hidden += bool(said(found))
                held += bool(said(found)) and low < limit < high
    assert hidden >= 9
    assert held >= 0.9 * hidden
