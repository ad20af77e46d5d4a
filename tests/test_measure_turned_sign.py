"""Records whose force or position counts the other way: friction would drive, so nothing is made of them."""

import functools

import numpy as np
import pytest
import spring_and_block
from scipy.integrate import solve_ivp

from stickslip import InputError
from stickslip.identification import identify
from stickslip.measurement import Rig, measure

STEP = 0.06
KINDS = {"stick_slip": (0.2, 1.2, 0.7), "almost_harmonic": (0.6, 1.0, 0.95)}
"""Kind of motion -> drive velocity, static and kinetic friction."""


def rig(drive, **more):
    numbers = {"stiffness": 1.0, "mass": 1.0, "damping": 0.05, "drive_velocity": drive}
    return Rig(instrument="spring_force", column="f", unit="N", **numbers, **more)


def noisy(x):
    return x + 3e-3 * np.random.default_rng(1).standard_normal(x.size)


@functools.cache
def pulled(kind):
    """The force of the spring in a motion of this kind, and its drive velocity; the harmonic one dies away."""
    drive, limit, kinetic = KINDS[kind]
    x, *_ = spring_and_block.motion(
        lambda _: kinetic, lambda _: limit, drive, damping=0.05, step=STEP, samples=700, skip=0
    )
    return noisy(x), drive


@functools.cache
def swung(stiffness, amplitude, drive):
    """The positions of masses of 1 where a force beside the friction of 1 swings the first: it may also slip backward."""
    t, count = STEP * np.arange(700), len(stiffness)

    def rate(t, y):
        x, v = y[:count], y[count:]
        forcing = np.where(np.arange(count) == 0, amplitude * np.sin(0.7 * t), 0.0)
        return np.concatenate([v, np.tanh((drive - v) / 5e-3) + forcing - 0.05 * v - np.array(stiffness) @ x])

    start = np.concatenate([np.full(count, -6.0), np.zeros(count)])
    return solve_ivp(rate, (0, t[-1]), start, t_eval=t, method="LSODA", rtol=1e-7).y[:count]


def measured(force, drive, **more):
    tree = measure({"t": STEP * np.arange(force.size), "f": force}, rig(drive, **more))
    return tree, [note for note in tree.attrs["notes"] if "friction does work on the slip" in note]


@pytest.mark.parametrize("kind", KINDS)
def test_a_force_with_its_sign_turned_is_of_no_kind_and_what_to_do_is_said(kind):
    force, drive = pulled(kind)
    turned, said = measured(-force, drive)
    assert turned.attrs["regime"] == "unknown"
    assert np.isnan(turned.attrs["slips"])
    assert len(turned["break_away"].t) == 0
    (note,) = said
    assert " N in its sense" in note
    assert "turn the sign of the recorded force or position (rig: scale, negative)" in note
    assert not any("missed" in one or "drive moves at" in one for one in turned.attrs["notes"])
    with pytest.raises(InputError, match=r"friction does work on the slip \(it is -[\d.]+ N in its sense on average\)"):
        identify(turned, law="Coulomb")
    mended, said = measured(-force, drive, scale=-1.0)
    assert (mended.attrs["regime"], said) == (kind, [])


@pytest.mark.parametrize("kind", KINDS)
def test_a_record_without_its_mean_is_of_the_kind_it_was(kind):
    force, drive = pulled(kind)
    tree, said = measured(force - force.mean(), drive)
    assert (tree.attrs["regime"], said) == (kind, [])


@pytest.mark.parametrize(
    ("stiffness", "amplitude", "drive"),
    [
        pytest.param(((1.0,),), 0.3, 0.2, id="forced a little"),
        pytest.param(((1.0,),), 2.0, 0.2, id="forced to and fro"),
        pytest.param(((1.5, -0.5), (-0.5, 0.5)), 0.0, 0.2, id="two masses"),
        pytest.param(((1.0,),), 0.0, 0.15, id="dying away on a slow belt"),
    ],
)
def test_no_motion_of_the_right_sign_is_taken_for_one_of_the_wrong(stiffness, amplitude, drive):
    for x in swung(stiffness, amplitude, drive):
        assert measured(noisy(x), drive)[1] == []
