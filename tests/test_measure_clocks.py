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


@pytest.mark.slow
def test_where_inertia_makes_most_of_the_force_the_offset_is_that_of_inertia_and_friction(tmp_path):
    path = files(tmp_path, lambda w, a, rng: MASS * a + FRICTION * np.sign(w) + rng.standard_normal(len(w)))
    friction = measure(path, rig(inertia=MASS))
    assert friction.attrs["force"] == pytest.approx(
        FRICTION, rel=0.05
    )  # 450 N of inertia swing: a third of a millisecond is 3 %
    assert any("-0.0043" in note and "inertia and friction" in note for note in friction.attrs["notes"])


@pytest.mark.slow
def test_a_correlation_that_is_none_is_refused(tmp_path):
    path = files(tmp_path, lambda w, a, rng: MASS * a + FRICTION * np.sign(w) + rng.standard_normal(len(w)))
    with pytest.raises(InputError, match=r"cannot be told.*give clock_offset in the rig, or the inertia"):
        measure(path, rig())
    noise = files(tmp_path, lambda w, a, rng: rng.standard_normal(len(w)))  # noqa: ARG005
    with pytest.raises(InputError, match="cannot be told"):
        measure(noise, rig(inertia=MASS))
    assert measure(noise, rig(inertia=MASS, clock_offset=0.0)).attrs["notes"]


def joint(lag=0.0, noise=0.1, inertia=0.0, over=0.0, motion="two"):
    """A joint moved to and fro, with Stribeck friction or one that builds up over an angle; its torque is late by `lag`."""
    rng = np.random.default_rng(0)
    time = np.arange(0, 40, 0.01)

    def speed(t):
        return np.sin(1.3 * t) if motion == "one" else np.sin(t) + 0.6 * np.sin(2.3 * t) + 2.0 * (motion == "one way")

    def torque(t):
        w = speed(t)
        sense = np.sign(w)
        if over:
            sense[0] = 0.0
            for i in range(1, len(w)):
                sense[i] = np.clip(sense[i - 1] + 0.01 * w[i] / over * (1 - sense[i - 1] * np.sign(w[i])), -1, 1)
        return (5 + 3 * np.exp(-np.abs(w) / 0.1)) * sense + 2 * w + inertia * np.gradient(w, t)

    return {
        "t": time,
        "w": speed(time) + 2e-3 * rng.standard_normal(len(time)),
        "T": torque(time - lag) + noise * rng.standard_normal(len(time)),
    }


JOINT = {"instrument": "direct_force", "columns": {"time": "t", "velocity": {"column": "w", "unit": "rad/s"},
         "force": {"column": "T", "unit": "N m"}}}  # fmt: skip


def said_of_a_lag(friction):
    return [note for note in friction.attrs["notes"] if "against the motion" in note]


@pytest.mark.parametrize("motion", ["one", "two"])
@pytest.mark.parametrize("more", [{}, {"noise": 1.0}, {"inertia": 3.0}])
@pytest.mark.parametrize("lag", [0.03, 0.06, -0.05])
def test_a_torque_that_is_late_is_noticed(lag, more, motion):
    (note,) = said_of_a_lag(measure(joint(lag, motion=motion, **more), JOINT))
    value, error = (float(note.split(" by ")[1].split()[i]) for i in (0, 2))
    assert ("late" in note) == (lag > 0)
    assert abs(value - abs(lag)) < 2 * error < 0.01


@pytest.mark.parametrize("motion", ["one", "two", "one way"])
@pytest.mark.parametrize("more", [{}, {"noise": 1.0}, {"inertia": 3.0}])
def test_a_torque_in_time_is_not_called_late(more, motion):
    assert not said_of_a_lag(measure(joint(motion=motion, **more), JOINT))


def test_friction_that_builds_up_over_an_angle_is_no_delay():
    assert not said_of_a_lag(measure(joint(over=0.1), JOINT))


def test_the_lag_that_the_rig_says_is_taken_out():
    late, right = measure(joint(0.06), JOINT), measure(joint(), JOINT)
    mended = measure(joint(0.06), {**JOINT, "clock_offset": 0.06})
    assert not said_of_a_lag(mended)
    near = np.abs(right["slip_velocity"]) < 0.3
    common = slice(0, mended.sizes["time"])
    scatter = [float(np.std((other["force"] - right["force"])[common][near[common]])) for other in (late, mended)]
    assert scatter[1] < 0.2 < 10 * scatter[1] < scatter[0] * 5
    with pytest.raises(InputError, match="correct clock_offset"):
        measure(joint(), {**JOINT, "clock_offset": 41.0})
