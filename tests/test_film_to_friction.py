"""The whole way from pictures to friction: filmed, tracked, measured, and laid beside the orbit that was filmed."""

import math
import tomllib

import numpy as np
import pytest

import stickslip as ss
from stickslip.measurement import Rig, measure
from stickslip.tracking import film, track

pytest.importorskip("cv2")

PERIOD = 2 * math.pi
SETTLED = 60.0
SMALL = {"width": 320, "height": 96, "marker": 16.0}


def paper(drive_velocity):
    return ss.paper.calibration.CALIBRATIONS["one f_s(0)"].oscillator(drive_velocity)


def static_kinetic(drive_velocity):
    law = ss.laws.StaticKinetic(break_away=1.0, kinetic=0.6)
    return ss.Oscillator(damping=0.1, drive_velocity=drive_velocity, law=law)


def on_film(path, system, periods, rate, start=SETTLED, **camera):
    """The orbit, its film's truth, and what was tracked in the film (0.1 px of noise); `rate` in pictures a period."""
    duration = periods * PERIOD
    orbit = ss.simulate(system, start + duration + 1.0)
    truth = film(orbit, path, start=start, duration=duration, frame_rate=rate / PERIOD, noise=0.1, **camera)
    return orbit, truth, track(path, tomllib.loads(truth.attrs["setup"]))


def rig(system, drive_velocity, **other):
    return Rig(
        instrument="displacement", column="x", unit="1", stiffness=1, mass=1, damping=system.damping,
        drive_velocity=drive_velocity, **other,
    )  # fmt: skip


def check(friction, time, force, events, what=""):
    """Within 2 % of f_s, events within one frame, no stick missed and none invented; a margin at the film's ends."""
    step = time[1] - time[0]
    # friction jumps at an event, and its time is found to a part of a picture: a picture next to it may lie on either side
    apart = np.abs(time[:, None] - events["t"].to_numpy()).min(axis=1) > step / 10
    # whether a mass gives way in the last pictures nobody can see
    scatter = np.sqrt(np.mean((friction["force"].to_numpy() - force)[apart][:-3] ** 2))
    assert scatter < 0.02 * np.abs(force).max(), what
    found = friction["break_away"].to_dataset()
    ends = found["t"].to_numpy()
    starts = ends - found["stick_time"].to_numpy()
    for kind, seen in (("release", ends), ("capture", starts[np.isfinite(starts)])):
        at = events.query("kind == @kind")["t"].to_numpy()
        # a stick is a row of the table only if it gives way in the film, and that takes some time to be seen
        last = events.query("kind == 'release' and t < @time[-1] - 1")["t"].max()
        at = at[(at > time[0]) & (at < last + step)]
        assert len(seen) == len(at), f"{what} {kind}"
        assert np.abs(seen - at).max() < step, f"{what} {kind}"


# drive velocities over the range in which each oscillator sticks (the paper's ends at 0.28)
CASES = [
    (paper, 0.15),
    (paper, 0.2),
    (paper, 0.25),
    (static_kinetic, 0.1),
    (static_kinetic, 0.2),
    (static_kinetic, 0.3),
]


def from_film_to_friction(path, make, drive_velocity, periods, rate, **camera):
    system = make(drive_velocity)
    orbit, truth, motion = on_film(path, system, periods, rate, **camera)
    assert (motion["lost"] == "").all()
    apart = np.stack([motion[name].values - truth[name].values for name in ("x_px", "y_px")])
    assert np.sqrt(np.mean(apart**2)) < 0.05
    # a film's clock starts with its first picture
    motion = motion.assign_coords(time=motion["time"].values + SETTLED)
    friction = measure(motion, rig(system, drive_velocity), mass=0)
    time = motion["time"].to_numpy()
    force = orbit.to_xarray(time)["force"].to_numpy()
    check(friction, time, force, orbit.events, f"{make.__name__} {drive_velocity}")


@pytest.mark.parametrize(
    ("make", "drive_velocity"),
    [pytest.param(make, s, marks=[] if (make, s) == (paper, 0.2) else [pytest.mark.slow]) for make, s in CASES],
)
def test_friction_from_a_film_is_that_of_the_orbit(tmp_path, make, drive_velocity):
    from_film_to_friction(tmp_path / "film.avi", make, drive_velocity, 3.4, 80, **SMALL)


@pytest.mark.slow
@pytest.mark.parametrize("rate", [60, 120, 200])
@pytest.mark.parametrize(("make", "drive_velocity"), CASES)
def test_friction_from_a_long_film_at_any_usual_rate(tmp_path, make, drive_velocity, rate):
    from_film_to_friction(tmp_path / "film.avi", make, drive_velocity, 8, rate)


@pytest.mark.slow
def test_each_mass_of_a_film_gives_the_friction_of_its_contact(tmp_path):
    law = ss.laws.StaticKinetic(break_away=1.0, kinetic=0.6)
    contacts = [ss.Contact(mass=i, law=law, drive_velocity=0.2) for i in (0, 1)]
    # equal but for damping, so that the two run out of step
    damping = (0.1, 0.25)
    system = ss.System(mass=[1.0, 1.0], stiffness=np.eye(2), damping=np.diag(damping), contacts=contacts)
    orbit, truth, motion = on_film(tmp_path / "film.avi", system, 3.4, 60, width=480, height=96, marker=16.0)
    assert motion.sizes["mass"] == 2
    assert (motion["lost"] == "").all()
    assert np.abs(motion["x_px"].values - truth["x_px"].values).max() < 0.2  # nowhere near the other mass
    # x counts from the first mass's place of rest
    rest = np.median(motion["x"].values - truth["position"].values, axis=0)
    np.testing.assert_allclose(rest[0], 0, atol=1e-3)
    motion["x"] = motion["x"] - rest
    for mass in (0, 1):
        slider = ss.Oscillator(damping=damping[mass], drive_velocity=0.2, law=law)
        alone = ss.simulate(slider, orbit.t_end)
        np.testing.assert_allclose(orbit.at(orbit.t_end)[0][mass], alone.at(orbit.t_end)[0], atol=1e-9)
        time = motion["time"].to_numpy() + SETTLED
        friction = measure(motion.assign_coords(time=time), Rig.of(slider, "time"), mass=mass)
        check(friction, time, alone.to_xarray(time)["force"].to_numpy(), alone.events, f"mass {mass}")


def chain_on_film(path, damping, rate, periods):
    """Masses of a chain whose springs and one damper pull on each other, filmed, tracked, and measured together."""
    n = len(damping)
    links = np.diff(np.eye(n), axis=0)
    stiffness = np.eye(n) + 0.5 * links.T @ links
    dampers = np.diag(damping) + 0.02 * links.T @ links
    law = ss.laws.StaticKinetic(break_away=1.0, kinetic=0.6)
    system = ss.System(
        mass=[1.0] * n,
        stiffness=stiffness,
        damping=dampers,
        contacts=[ss.Contact(mass=i, law=law, drive_velocity=0.1) for i in range(n)],
    )
    orbit, truth, motion = on_film(path, system, periods, rate, width=200 * n, height=84, marker=14.0)
    assert (motion["lost"] == "").all()
    time = motion["time"].to_numpy() + SETTLED
    table = {
        "instrument": "displacement",
        "column": "x",
        "unit": "1",
        "mass": 1.0,
        "drive_velocity": 0.1,
        "stiffness": stiffness.tolist(),
        "damping": dampers.tolist(),
        # the places in which the springs are slack, as a film of the rig at rest would show them
        "rest": np.median(motion["x"].values - truth["position"].values, axis=0).tolist(),
    }
    friction = measure(motion.assign_coords(time=time), table)
    force = orbit.to_xarray(time)["force"].to_numpy()
    for mass in range(n):
        events = orbit.events[orbit.events["contact"] == mass]
        assert (events["kind"] == "release").any()
        check(friction[f"mass_{mass}"], time, force[:, mass], events, f"mass {mass}")


@pytest.mark.slow
def test_masses_that_pull_on_each_other_give_the_friction_on_each(tmp_path):
    chain_on_film(tmp_path / "film.avi", (0.1, 0.25), 60, 4.0)


@pytest.mark.slow
def test_three_masses_that_pull_on_each_other_give_the_friction_on_each(tmp_path):
    chain_on_film(tmp_path / "film.avi", (0.05, 0.1, 0.2), 80, 4.8)
