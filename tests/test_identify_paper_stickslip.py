"""The spring-pulled paper slider: what its README says, found from the record itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from stickslip.identification import compare_motion, identify
from stickslip.measurement import Rig, measure

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def friction(shared_data):
    rig = Rig(
        gauge="spring_force",
        column="Fnorm",
        unit="mg",
        time_column="t",
        stiffness=168.0,
        mass=0.0307,
        drive_velocity=42e-6,
        mains_frequency=50.0,
    )
    return measure(shared_data / "paper_stickslip" / "k168Nm_v42.mat", rig)


def test_static_friction_grows_by_half_of_what_the_drop_grows_by(friction):
    found = identify(friction, law="DwellTime")
    slope = found.static.fits["logarithmic"].parameters.loc["slope"] / friction.attrs["weight"]
    # README: the drop grows by ~0.03 m g per decade; an undamped slip falls twice as far as friction stands above kinetic.
    assert slope["low"] <= 0.015 <= slope["high"]
    assert slope["low"] > 0
    told = " ".join(found.notes)
    assert "cannot be told apart" in told
    assert "drifts" in told
    assert "loading line" in told


def test_simulated_sticks_are_as_long_as_measured_ones(friction):
    agreement = compare_motion(friction, identify(friction, law="DwellTime"))
    assert agreement.regimes == ("stick_slip", "stick_slip")
    assert agreement.table.loc["mean stick time", "ratio"] == pytest.approx(1.0, abs=0.15)
    assert agreement.table.loc["mean force drop", "ratio"] == pytest.approx(1.0, abs=0.15)
    assert np.isfinite(agreement.table.loc["phase distance (rms)", "simulated"])


def test_a_law_from_two_slow_runs_predicts_two_fast_ones(shared_data):
    rigs = Path(__file__).parents[1] / "examples" / "rigs"

    def run(name):
        stiffness, velocity = name.split("_")
        record = shared_data / "paper_stickslip" / f"{stiffness}Nm_{velocity}.mat"
        return measure(record, rigs / f"paper_slider_{name}.toml")

    # No law is asked for: what the two runs cannot tell (growth with stick time) is not taken.
    found = identify([run("k168_v42"), run("k1002_v42")])
    assert type(found.law).__name__ == "StaticKinetic"
    for name in ("k168_v1100", "k168_v4300"):
        agreement = compare_motion(run(name), found)
        assert agreement.regimes == ("stick_slip", "stick_slip")
        for quantity in ("median stick time", "mean stick time"):
            assert agreement.table.loc[quantity, "ratio"] == pytest.approx(1.0, abs=0.2)
    # k168 V42 itself lies apart from the other three runs, and that is said
    assert any("The records differ from one law of stick time" in note for note in found.notes)
