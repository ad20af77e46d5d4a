"""The spring-pulled paper slider (Colas et al., Phys. Rev. E 2019): what its README says, found from the records."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from stickslip.identification import compare_motion, fit_static_friction, identify, predict_motion
from stickslip.identification.records import FrictionRecord, read_records
from stickslip.measurement import measure

pytestmark = pytest.mark.slow

RIGS = Path(__file__).parents[1] / "examples" / "rigs"
RUNS = ("k168_v42", "k168_v1100", "k168_v4300", "k1002_v42")


@lru_cache
def run(shared_data: Path, name: str) -> FrictionRecord:
    stiffness, velocity = name.split("_")
    tree = measure(
        shared_data / "paper_stickslip" / f"{stiffness}Nm_{velocity}.mat", RIGS / f"paper_slider_{name}.toml"
    )
    return read_records(tree)[0]


@pytest.fixture
def slow(shared_data):
    return run(shared_data, "k168_v42")


def test_growth_within_one_run_is_said_to_lie_on_the_loading_line(slow):
    assert any("loading line" in note for note in fit_static_friction(slow).notes)


def test_simulated_sticks_are_as_long_as_measured_ones(slow):
    agreement = compare_motion(slow, identify(slow, law="DwellTime"))
    assert agreement.regimes == ("stick_slip", "stick_slip")
    assert agreement.table.loc["mean stick time", "ratio"] == pytest.approx(1.0, abs=0.15)
    assert agreement.table.loc["mean force drop", "ratio"] == pytest.approx(1.0, abs=0.15)
    assert np.isfinite(agreement.table.loc["phase distance (rms)", "simulated"])


# README: the drop grows by ~0.03 m g per decade at 168 N/m and 42 um/s; an undamped slip falls twice as far as friction
# stands above kinetic. The other runs: our own numbers, and the run at 4300 um/s shows no growth.
@pytest.mark.parametrize(
    ("name", "half_of_the_drop", "grows"),
    [("k168_v42", 0.015, True), ("k168_v1100", 0.022, True), ("k168_v4300", 0.01, False), ("k1002_v42", 0.019, True)],
)
def test_static_friction_grows_with_stick_time_whatever_the_threshold_and_the_drift(
    shared_data, name, half_of_the_drop, grows
):
    record = run(shared_data, name)
    found = fit_static_friction(record)
    slope = found.fits["logarithmic"].parameters.loc["slope"] / record.constants["weight"]
    assert slope["low"] < half_of_the_drop < slope["high"]
    assert (slope["low"] > 0) == grows
    assert "drifts" in " ".join(found.notes)
    # at one belt speed the force rate is tied, though creep makes the measured ones differ
    assert any("All break-aways come at nearly one force rate" in note for note in found.notes)
    # the smallest falls left out, and a drift along the track beside the growth: within the interval
    rows, logarithm = found.rows, np.log10(found.rows["stick_time"])
    force = rows["used"] / record.constants["weight"]
    for share in (0.1, 0.25):
        kept = rows["drop"] >= rows["drop"].quantile(share)
        assert slope["low"] < np.polyfit(logarithm[kept], force[kept], 1)[0] < slope["high"]
    columns = np.stack([np.ones(len(rows)), logarithm, rows["t"] - rows["t"].mean()], axis=1)
    assert slope["low"] < np.linalg.lstsq(columns, force, rcond=None)[0][1] < slope["high"]


# The law is chosen by identify itself. Stick times come within 20 % of those in `near`: f_s - f_k of k168 V42 is half of what
# k1002 V42 has, the two others lie between, and no number of the rig says why.
@pytest.mark.parametrize(
    ("names", "near"),
    [
        (("k168_v42", "k1002_v42"), {"k168_v1100", "k168_v4300"}),
        (("k168_v42", "k168_v1100"), {"k168_v4300"}),
        (("k168_v42", "k168_v4300"), {"k168_v1100"}),
        (("k168_v4300", "k1002_v42"), {"k168_v1100"}),
    ],
)
def test_a_law_from_two_runs_foretells_the_others(shared_data, names, near):
    found = identify([run(shared_data, name) for name in names])
    assert type(found.law).__name__ == "StaticKinetic"
    others = [name for name in RUNS if name not in names]
    foretold = predict_motion(found, [run(shared_data, name) for name in others]).table
    assert foretold["predicted_kind"].tolist() == foretold["kind"].tolist() == ["stick_slip", "stick_slip"]
    off = dict(zip(others, np.abs(foretold["ratio"] - 1), strict=True))
    assert {name for name, distance in off.items() if distance < 0.2} == near
