"""Records cut anywhere: what a record's ends hide must not be measured as friction."""

import functools

import numpy as np
import pytest

import stickslip as ss
from stickslip.identification import identify
from stickslip.measurement import Rig, measure

LAW = ss.laws.StaticKinetic(break_away=1.2, kinetic=0.7)
DRIVE, DAMPING, STEP = 0.1, 0.05, 2 * np.pi / 60
RIG = Rig(
    gauge="displacement", column="x", unit="1", stiffness=1, mass=1, damping=DAMPING, drive_velocity=DRIVE
)  # fmt: skip


@functools.cache
def orbit():
    return ss.simulate(ss.Oscillator(damping=DAMPING, drive_velocity=DRIVE, law=LAW), 120.0)


def events(kind):
    return orbit().events.query("kind == @kind")["t"].to_numpy()


def record(start, end, noise=3e-3):
    time = np.arange(start, end, STEP)
    x = orbit().at(time)[0] + noise * np.random.default_rng(1).standard_normal(len(time))
    return measure({"t": time - start, "x": x}, RIG)


@pytest.mark.parametrize("into", [0.8, 5.0])
def test_a_record_cut_inside_sticks_is_stuck_from_its_first_sample_to_its_last(into):
    friction = record(events("release")[1] - 4.0, events("capture")[4] + into)
    stuck = friction["stuck"].to_numpy()
    assert stuck[:5].all()
    assert stuck[-5:].all()
    found = identify(friction, law="StaticKinetic").parameters
    assert abs(found.loc["kinetic", "value"] - LAW.kinetic) < 0.005
    assert abs(found.loc["break_away", "value"] - LAW.break_away) < 0.005
