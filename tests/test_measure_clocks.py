"""A force and a motion on two clocks: the offset is found where there is one to be found, else asked for."""

import functools

import numpy as np
import pytest

from stickslip.errors import InputError
from stickslip.identification import identify
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
    with pytest.raises(InputError, match=r"cannot be determined.*give clock_offset in the rig, or the inertia"):
        measure(path, rig())
    noise = files(tmp_path, lambda w, a, rng: rng.standard_normal(len(w)))  # noqa: ARG005
    with pytest.raises(InputError, match="cannot be determined"):
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


@functools.cache
def bit():
    """Speed and friction of a bit on a string at 1 kHz: 370 kg m^2, 470 N m/rad, 2 pi rad/s, 5000 and 3000 N m."""
    step, twist, speed, stuck, rows = 1e-3, 0.0, 0.0, True, []
    for _ in range(60_000):
        twist += step * (2 * np.pi - speed)
        stuck = stuck and 470 * twist <= 5000
        friction = 470 * twist if stuck else 3000.0
        if not stuck:
            speed += step * (470 * twist - friction) / 370
            stuck = speed <= 0
            speed = max(speed, 0.0)
        rows.append((speed, friction))
    return np.array(rows).T


BIT = {**JOINT, "stuck_speed": "5 rpm"}


def torque_of_bit(lag, seed, torque_noise=20.0):
    """From some time on at 50 Hz, with noise on both, the torque so many milliseconds late."""
    rng = np.random.default_rng(seed)
    speed, friction = bit()
    at = np.arange(8000 + rng.integers(0, 3000), speed.size - 100, 20)
    return {
        "t": (at - at[0]) / 1000,
        "w": speed[at] + 0.05 * rng.standard_normal(at.size),
        "T": friction[at - lag] + torque_noise * rng.standard_normal(at.size),
    }


@pytest.mark.long
@pytest.mark.parametrize("lag", [20, 60, -60, 300])
def test_a_torque_that_is_late_in_stick_slip_is_noticed_and_the_break_aways_hold_it(lag):
    for seed in range(2):
        late = measure(torque_of_bit(lag, seed), BIT)
        (note,) = said_of_a_lag(late)
        value, error = (float(note.split(" by ")[1].split()[i]) for i in (0, 2))
        assert ("late" in note) == (lag > 0)
        assert abs(value - abs(lag) / 1000) < 3 * error < 0.015
        row = identify(late).parameters.loc["break_away"]
        assert abs(row["value"] - 5000) < 2 * row["error"]
        named = float(note.split("clock_offset = ")[1].split()[0])
        right = measure(torque_of_bit(lag, seed), {**BIT, "clock_offset": named})
        assert not said_of_a_lag(right)
        row = identify(right).parameters.loc["break_away"]
        assert abs(row["value"] - 5000) < 2.5 * row["error"] < 100


@pytest.mark.long
def test_a_torque_in_time_in_stick_slip_is_not_called_late_and_its_peaks_are_not_low():
    z = []
    for seed in range(8):
        friction = measure(torque_of_bit(0, seed, torque_noise=5.0 if seed % 2 else 20.0), BIT)
        assert not said_of_a_lag(friction)
        assert friction.attrs["break_away_late"] < 0.5 * 0.02
        row = identify(friction).parameters.loc["break_away"]
        assert row["error"] < 35
        z.append((row["value"] - 5000) / row["error"])
    assert max(np.abs(z)) < 2.5
    assert abs(np.mean(z)) < 1


def test_a_sensor_in_the_spring_does_not_tell_whether_it_is_late():
    speed = bit()[0]
    at = np.arange(8000, speed.size, 20)
    twist = 2 * np.pi * np.arange(speed.size) / 1000 - np.cumsum(speed) / 1000
    for lag in (0, 60):
        rng = np.random.default_rng(lag)
        record = {
            "t": (at - at[0]) / 1000,
            "w": speed[at] + 0.05 * rng.standard_normal(at.size),
            "T": 470 * twist[at - lag] + 20 * rng.standard_normal(at.size),
        }
        friction = measure(record, BIT)
        assert not said_of_a_lag(friction)
        assert friction.attrs["break_away_late"] == pytest.approx(0.02)


def arm(lag, gravity, over=0.0, seed=0):
    """An arm that swings in two sines: Coulomb and viscous friction and gravity; or presliding over an angle."""
    rng = np.random.default_rng(seed)
    time = np.arange(0, 60, 0.01)
    phase = rng.uniform(0, 6)

    def torque(t):
        speed = 0.5 * np.sin(0.7 * t) + 0.2 * np.sin(1.9 * t + phase)
        angle = -0.5 / 0.7 * np.cos(0.7 * t) - 0.2 / 1.9 * np.cos(1.9 * t + phase)
        sense = np.sign(speed)
        if over:
            for i in range(1, len(t)):
                sense[i] = np.clip(sense[i - 1] + 2 * (angle[i] - angle[i - 1]) / over, -1, 1)
        return 0.4 * sense + 0.25 * speed + gravity * np.sin(angle + 0.3) - 0.15, angle, speed

    _, angle, speed = torque(time)
    return {"t": time, "q": angle, "w": speed, "T": torque(time - lag)[0] + 0.02 * rng.standard_normal(time.size)}


ARM = {**JOINT, "columns": {**JOINT["columns"], "displacement": {"column": "q", "unit": "rad"}}}


@pytest.mark.parametrize("with_angle", [True, False])
@pytest.mark.parametrize("gravity", [0.1, 0.8, 3.0])
@pytest.mark.parametrize("lag", [0.02, 0.05, 0.1])
def test_a_torque_that_is_late_is_noticed_under_gravity(lag, gravity, with_angle):
    (note,) = said_of_a_lag(measure(arm(lag, gravity), ARM if with_angle else JOINT))
    value, error = (float(note.split(" by ")[1].split()[i]) for i in (0, 2))
    assert "is late" in note
    assert abs(value - lag) < 2 * error < 0.01


@pytest.mark.parametrize("gravity", [0.0, 0.8])
@pytest.mark.parametrize("over", [0.0, 2e-4, 2e-3, 2e-2])
def test_gravity_is_no_delay_and_presliding_is_named_first(gravity, over):
    for seed in range(2):
        notes = said_of_a_lag(measure(arm(0.0, gravity, over, seed), ARM))
        assert not notes or over > 0
        for note in notes:
            assert note.index("presliding") < note.index("a delay of the channel")
            assert float(note.split("over a path of ")[1].split()[0]) == pytest.approx(over, rel=0.5)


def test_the_remedy_for_a_force_that_follows_the_position_names_the_delay():
    record = arm(0.0, 0.8)
    record["T"] += 0.1 * np.sin(13 * record["q"])
    notes = " ".join(identify(measure(record, ARM)).notes)
    assert "follows the position" in notes
    assert "clock_offset in the rig" in notes
