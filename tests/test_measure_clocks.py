"""A force and a motion on two clocks: the offset is found where there is one to be found, else asked for."""

import numpy as np
import pytest

from stickslip.errors import InputError
from stickslip.measurement import measure

FRICTION, MASS, AHEAD = 42.0, 10.0, -0.004


def files(folder, force):
    """A slider driven to and fro, ever faster, at 200 samples/s; its force is on a clock of 250 samples/s."""
    rng = np.random.default_rng(3)
    time, own = np.arange(0, 12, 1 / 200), np.arange(0, 12, 1 / 250)
    phase = lambda t: 6.0 * t + 0.4 * t**2  # noqa: E731
    x = 0.2 * np.sin(phase(time)) + 1e-5 * rng.standard_normal(len(time))
    rate, at = 6.0 + 0.8 * (own - AHEAD), phase(own - AHEAD)
    w = 0.2 * rate * np.cos(at)
    a = 0.2 * (0.8 * np.cos(at) - rate**2 * np.sin(at))
    np.savetxt(
        folder / "force.csv", np.stack([own, force(w, a, rng)], axis=1), delimiter=",", header="t,F", comments=""
    )
    np.savetxt(folder / "motion.csv", np.stack([time, x], axis=1), delimiter=",", header="t,x", comments="")
    return folder / "force.csv"


def rig(**more):
    return {
        "instrument": "direct_force",
        "columns": {"time": "t", "force": "F"},
        "companion": {"file": "motion.csv", "columns": {"time": "t", "displacement": "x"}},
        **more,
    }


def test_where_inertia_makes_most_of_the_force_the_offset_is_that_of_inertia_and_friction(tmp_path):
    path = files(tmp_path, lambda w, a, rng: MASS * a + FRICTION * np.sign(w) + rng.standard_normal(len(w)))
    friction = measure(path, rig(inertia=MASS))
    assert friction.attrs["force"] == pytest.approx(
        FRICTION, rel=0.05
    )  # 450 N of inertia swing: a third of a millisecond is 3 %
    assert any("-0.0043" in note and "inertia and friction" in note for note in friction.attrs["notes"])


def test_a_correlation_that_is_none_is_refused(tmp_path):
    path = files(tmp_path, lambda w, a, rng: MASS * a + FRICTION * np.sign(w) + rng.standard_normal(len(w)))
    with pytest.raises(InputError, match=r"cannot be told.*give clock_offset in the rig, or the inertia"):
        measure(path, rig())
    noise = files(tmp_path, lambda w, a, rng: rng.standard_normal(len(w)))  # noqa: ARG005
    with pytest.raises(InputError, match="cannot be told"):
        measure(noise, rig(inertia=MASS))
    assert measure(noise, rig(inertia=MASS, clock_offset=0.0)).attrs["notes"]
