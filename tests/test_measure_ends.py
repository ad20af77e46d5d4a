"""Records cut anywhere: what a record's ends hide must not be measured as friction."""

import functools
from types import SimpleNamespace

import numpy as np
import pytest

import stickslip as ss
from stickslip.identification import identify
from stickslip.identification.kinetic.replayed_motion import Motion
from stickslip.identification.records import read_records
from stickslip.measurement import Rig, measure, motion
from stickslip.measurement.indirect.sticks.resting_sticks import FINEST, _OneStick, _peak

LAW = ss.laws.StaticKinetic(break_away=1.2, kinetic=0.7)
DRIVE, DAMPING, STEP = 0.1, 0.05, 2 * np.pi / 60
RIG = Rig(
    instrument="displacement", column="x", unit="1", stiffness=1, mass=1, damping=DAMPING, drive_velocity=DRIVE
)  # fmt: skip


@functools.cache
def orbit():
    return ss.simulate(ss.Oscillator(damping=DAMPING, drive_velocity=DRIVE, law=LAW), 120.0)


def events(kind):  # noqa: ARG001 used in the query
    return orbit().events.query("kind == @kind")["t"].to_numpy()


def record(start, end, noise=3e-3):
    time = np.arange(start, end, STEP)
    x = orbit().at(time)[0] + noise * np.random.default_rng(1).standard_normal(len(time))
    return measure({"t": time - start, "x": x}, RIG)


@pytest.mark.parametrize("into", [0.8, pytest.param(5.0, marks=pytest.mark.long)])
def test_a_record_cut_inside_sticks_is_stuck_from_its_first_sample_to_its_last(into):
    friction = record(events("release")[1] - 4.0, events("capture")[4] + into)
    stuck = friction["stuck"].to_numpy()
    assert stuck[:5].all()
    assert stuck[-5:].all()
    found = identify(friction, law="StaticKinetic").parameters
    assert abs(found.loc["kinetic", "value"] - LAW.kinetic) < 0.005
    assert abs(found.loc["break_away", "value"] - LAW.break_away) < 0.005


def exposed(samples, opened, seed):
    """Friction of five break-aways seen by a shutter open for this share of the time between pictures, and their truth."""
    rng, step, ends = np.random.default_rng(seed), 2 * np.pi / samples, events("release")
    time = np.arange(ends[1] - 3.1 + step * rng.uniform(), ends[5] + 4.0, step)
    x = np.mean([orbit().at(time + opened * part * step)[0] for part in np.linspace(-0.5, 0.5, 21)], axis=0)
    friction = measure({"t": time - time[0], "x": x + 1e-3 * rng.standard_normal(len(time))}, RIG)
    return friction, ends[(ends > time[0]) & (ends < time[-1])] - time[0]


def off_by(friction, true):
    """Errors of the break-aways in stated errors, of times and forces."""
    found = friction["break_away"].to_dataset()
    late = (found["t"].to_numpy() - true) / found["t_error"].to_numpy()
    return late, ((found["force"] - LAW.break_away) / found["force_error"]).to_numpy()


@pytest.mark.parametrize(("samples", "few"), [(19, True), pytest.param(25, False, marks=pytest.mark.long)])
def test_few_pictures_of_a_long_exposure_bring_no_break_away_that_is_surely_wrong(samples, few):
    friction, true = exposed(samples, 0.9, 0)
    assert any("record faster" in note for note in friction.attrs["notes"]) == few
    found = friction["break_away"].to_dataset()
    assert len(found["t"]) == len(true)
    assert np.abs(found["t"].to_numpy() - true).max() < (3 if few else 0.2) * 2 * np.pi / samples
    assert np.abs(off_by(friction, true)).max() < 3  # each of five is beyond 2 in one draw of twenty
    fitted = identify(friction, law="StaticKinetic").parameters.loc["break_away"]
    assert fitted["low"] < LAW.break_away < fitted["high"]


@pytest.mark.slow
@pytest.mark.parametrize(("samples", "opened"), [(25, 0.9), (25, 0.0), (60, 0.0)])
def test_stated_errors_of_break_aways_are_what_they_are_off(samples, opened):
    """Twenty draws: the stick before a slip and the slip itself must not count twice, nor a blur be left out."""
    off = np.array([off_by(*exposed(samples, opened, seed)) for seed in range(20)])
    for kind in off.swapaxes(0, 1):  # times, forces
        assert 0.5 < np.sqrt(np.mean(kind**2)) < 1.25
        assert np.mean(np.abs(kind) < 2) > 0.9


def test_the_work_of_whole_slips_is_known_far_better_than_the_force_at_their_ends():
    """An error of the acceleration is gone from its integral: f_k is known to about the noise over the root of the slips."""
    noise, slips = 3e-3, 5
    friction = record(events("release")[1] - 4.0, events("capture")[slips + 1] + 0.5, noise)
    found = identify(friction, law="StaticKinetic").parameters.loc["kinetic"]
    assert found["low"] < LAW.kinetic < found["high"]
    assert found["high"] - found["low"] < 4 * noise / np.sqrt(slips)


@pytest.fixture(scope="module")
def three_slips():
    """Cut within the first slip, so that one of them is open."""
    return record(events("release")[1] + 0.4, events("capture")[3] + 0.5)


@pytest.mark.slow
def test_the_stated_error_of_the_work_of_a_slip_is_what_the_work_is_off(three_slips):
    friction = [three_slips, record(events("release")[1] - 4.0, events("capture")[7] + 0.5)]
    motions = [Motion.of(one, ss.laws.StaticKinetic) for one in read_records(friction)]
    off = np.concatenate([motion.misfit(LAW) / motion.misfit_error() for motion in motions])
    assert 0.6 < np.sqrt(np.mean(off**2)) < 1.5


def test_three_slips_tell_the_kinetic_force_as_well_as_their_errors_say(three_slips):
    found = identify(three_slips, law="StaticKinetic").parameters.loc["kinetic"]
    assert found["low"] < LAW.kinetic < found["high"]
    assert found["high"] - found["low"] < 0.5 * 3e-3  # of the noise


def test_break_aways_that_are_seen_late_weigh_no_more_than_others():
    """Evidence of single ends is narrower by the noise that made them late; the fit of whole slips knows nothing of that."""
    friction = record(events("release")[1] - 4.0, events("capture")[7] + 0.5)
    errors = friction["break_away"]["t_error"].to_numpy()
    assert len(errors) > 4
    np.testing.assert_allclose(errors, errors[0], rtol=0.1)
    true = events("release")[1:] - (events("release")[1] - 4.0)
    late = friction["break_away"]["t"].to_numpy() - true[: len(errors)]
    assert 0.4 < np.sqrt(np.mean((late / errors) ** 2)) < 1.7


@pytest.mark.parametrize(("width", "skew"), [(0.03, 0.1), (0.03, -0.1), (0.3, 1.0), (1.5, -20.0)])
def test_a_limit_is_found_to_a_part_of_its_error_however_narrow_its_evidence_is(width, skew):
    """The evidence of a break-away in a clear record is a thirtieth of a sample wide, and steeper on one side."""
    true = 4.37

    def deviance(at):
        off = (at - true) / skew
        return 2 * (np.exp(off) - 1 - off) * (skew / width) ** 2

    positions = np.linspace(0, 10, 11)
    search = SimpleNamespace(model=SimpleNamespace(step=1.0))
    found, error = _OneStick._centre(search, deviance, positions, deviance(positions), False)
    assert abs(found - true) < 0.1 * width
    assert 0.8 * max(width, FINEST) < error < 1.25 * max(width, FINEST)


@pytest.fixture(scope="module")
def belt():
    """Times, positions and rig of a mass on a belt, 0.85 kg on 1.9 N/mm at 12 mm/s: 6 slips a second."""
    o = ss.Oscillator(2.2, 0.012, ss.laws.StaticKinetic(3.95, 3.0), mass=0.85, stiffness=1900.0)
    t = np.arange(4000) / 800
    x = ss.simulate(o, t_end=15.0).at(t + 5)[0] + 3e-6 * np.random.default_rng(1).standard_normal(t.size)
    return (
        t,
        x,
        Rig(
            instrument="displacement",
            column="x",
            unit="m",
            stiffness=1900.0,
            mass=0.85,
            damping=2.2,
            drive_velocity=0.012,
        ),
    )


@pytest.fixture(scope="module")
def whole(belt):
    """Friction of the belt's record."""
    t, x, rig = belt
    return measure({"t": t, "x": x}, rig)


@pytest.mark.slow
def test_break_aways_beyond_the_range_of_the_instrument_are_not_invented(belt, whole):
    t, x, rig = belt
    cut = measure({"t": t, "x": np.minimum(x, np.quantile(x, 0.8))}, rig)
    assert not any("range" in note for note in whole.notes)
    assert len(whole["break_away"].t) > 25
    assert any("end of the instrument's range" in note for note in cut.notes)
    assert len(cut["break_away"].t) == 0
    assert cut.attrs["slips"] > 25


@pytest.mark.slow
def test_a_harmonic_of_the_motion_is_not_taken_for_the_mains(belt, whole):
    t, x, rig = belt
    ratio = 50 / (7 * whole.attrs["main_line"])
    assert not any("mains" in note for note in measure({"t": t / ratio, "x": x}, rig).notes)
    hum = 2e-5 * np.sin(2 * np.pi * 50 * t)
    assert any("mains_frequency = 50" in note for note in measure({"t": t, "x": x + hum}, rig).notes)


@pytest.mark.parametrize(
    "moment",
    [
        "stick",
        pytest.param("start", marks=pytest.mark.long),
        *(pytest.param(name, marks=pytest.mark.slow) for name in ("slip", "middle")),
    ],
)
def test_a_drive_that_stops_is_said_and_that_stretch_is_not_measured(moment):
    captures, releases = events("capture"), events("release")
    stop = {"slip": captures[6], "start": captures[2] + 3.0}.get(moment, captures[6] + 3.0)
    time = np.arange(releases[0] - 3.0, 115.0, STEP)
    x = orbit().at(time)[0]
    at, rest = int(np.searchsorted(time, stop)), 600
    level = float(orbit().at(np.array([stop]))[0][0])
    before, after = (x[:0], x[at:]) if moment == "start" else (x[:at], x[at:] if moment == "middle" else x[:0])
    x = np.concatenate([before, np.full(rest, level), after]) + 3e-3 * np.random.default_rng(1).standard_normal(
        len(before) + rest + len(after)
    )
    seen = {"t": STEP * np.arange(len(x)), "x": x}
    friction = measure(seen, RIG)
    np.testing.assert_array_equal(motion(seen, RIG)["time"], friction["time"])
    (said,) = [note for note in friction.attrs["notes"] if note.startswith("the drive seems to stop")]
    longest = max((before, after), key=len)
    assert abs(len(friction["time"]) - len(longest)) < 12
    assert "[read] window" in said
    found = identify(friction, law="StaticKinetic").parameters["value"]
    assert found["kinetic"] == pytest.approx(LAW.kinetic, abs=0.01)
    assert found["break_away"] == pytest.approx(LAW.break_away, abs=0.01)


@pytest.mark.slow
def test_slip_that_becomes_steady_is_no_drive_that_stops():
    fast = ss.Oscillator(damping=DAMPING, drive_velocity=0.6, law=ss.laws.ExponentialStribeck(1.2, 0.7, scale=0.1))
    time = np.arange(0.0, 250.0, STEP)
    x = ss.simulate(fast, 260.0).at(time)[0] + 3e-3 * np.random.default_rng(1).standard_normal(len(time))
    rig = Rig(**{**vars(RIG), "drive_velocity": 0.6})
    assert not any("drive seems to stop" in note for note in measure({"t": time, "x": x}, rig).attrs["notes"])


def test_where_there_is_no_deviance_there_is_no_peak_and_no_warning():
    assert _peak(np.arange(3.0), np.full(3, np.inf)) == (1.0, 0.0)
