"""Break-aways of slips in which friction falls: how late they are seen, and what all of a record have in common."""

import functools

import numpy as np
import pytest

import stickslip as ss
from stickslip.identification import fit_static_friction, identify
from stickslip.identification.kinetic import force_fit
from stickslip.laws import Combined, ExponentialStribeck, LogarithmicDwell, StaticKinetic
from stickslip.measurement import Rig, measure

MASS, STIFFNESS, DAMPING = 0.9, 420.0, 1.1
FALLING = Combined(LogarithmicDwell(3.4, 0.25, 0.05), ExponentialStribeck(3.3, 2.4, 0.04, 0.5))


@functools.cache
def measured(law, drive, step, length, noise):
    """Friction of a simulated record, and how late each break-away was seen."""
    oscillator = ss.Oscillator(DAMPING, drive, law, mass=MASS, stiffness=STIFFNESS)
    orbit = ss.simulate(oscillator, 30 + length)
    time = np.arange(30, 30 + length, step)
    x = orbit.at(time)[0] + noise * np.random.default_rng(1).standard_normal(time.size)
    rig = Rig(
        instrument="displacement", column="x", unit="m",
        stiffness=STIFFNESS, mass=MASS, damping=DAMPING, drive_velocity=drive,
    )  # fmt: skip
    friction = measure({"t": time - 30, "x": x}, rig)
    true = orbit.events.query("kind == 'release' and t > 30")["t"].to_numpy() - 30
    seen = friction["break_away"]["t"].to_numpy()
    return friction, seen - true[np.abs(true[:, None] - seen).argmin(axis=0)]


def test_a_force_that_falls_on_is_not_taken_for_a_later_release():
    friction, late = measured(FALLING, 0.025, 0.004, 3.0, 1e-5)
    common = friction.attrs["break_away_late"]
    assert late.size > 5
    assert abs(late.mean()) < 1e-3  # a walk about a constant force sees them 1.4 ms late
    assert 0 < common < 3e-3
    assert abs(late.mean()) < 2 * np.hypot(common, late.std() / np.sqrt(late.size))
    errors = friction["break_away"]["t_error"].to_numpy()
    assert (errors > common).all()
    assert (np.abs(late) < 2.5 * errors).all()


@pytest.mark.long
def test_where_friction_does_not_fall_break_aways_have_little_in_common():
    friction, late = measured(StaticKinetic(4.2, 2.8), 0.025, 0.004, 3.0, 1e-5)
    assert abs(late.mean()) < 2e-4
    assert friction.attrs["break_away_late"] < 2e-4


def test_sticks_of_a_few_samples_are_not_said_to_creep():
    friction, late = measured(StaticKinetic(4.2, 2.8), 0.06, 0.008, 2.0, 3e-6)
    assert not friction.attrs["creeps"]
    assert np.abs(late).max() < 2e-3


@pytest.mark.parametrize("fit", [fit_static_friction, lambda record: identify(record, law="StaticKinetic")])
@pytest.mark.slow
def test_what_all_break_aways_have_in_common_is_not_averaged_down(fit):
    friction = measured(StaticKinetic(4.2, 2.8), 0.06, 0.004, 3.0, 1e-5)[0].copy(deep=True)
    late = 3e-3
    rate = STIFFNESS * 0.06
    friction["break_away"]["force"] += rate * late
    widths = []
    for known in (0.0, late):
        friction.attrs["break_away_late"] = known
        friction["break_away"]["force_error"][:] = np.hypot(2e-3, rate * known)
        found = fit(friction)
        table = found.fits["constant"].parameters if fit is fit_static_friction else found.parameters
        row = table.iloc[0]
        widths.append(row["high"] - row["low"])
        assert (row["low"] < 4.2 < row["high"]) == (known > 0)
    assert 0.9 < widths[1] / (2 * 1.96 * rate * late) < 1.3


@pytest.mark.slow
def test_a_stick_is_not_lost_where_one_slip_differs_from_the_usual_fall():
    friction, late = measured(FALLING, 0.06, 0.004, 12.0, 1e-5)
    oscillator = ss.Oscillator(DAMPING, 0.06, FALLING, mass=MASS, stiffness=STIFFNESS)
    events = ss.simulate(oscillator, 42.0).events
    inside = events["t"][(events["kind"] == "release").to_numpy()].between(30.1, 41.9).sum()
    assert abs(late.size - inside) <= 1
    rest = friction["force"].to_numpy() - FALLING.kinetic_force(np.maximum(friction["slip_velocity"].to_numpy(), 1e-9))
    slips = ~friction["stuck"].to_numpy()
    assert np.abs(rest[slips & (friction["time"].to_numpy() > 0.1)]).max() < 0.8


@pytest.mark.slow
def test_where_no_law_is_asked_for_growth_and_a_curve_of_kinetic_friction_are_both_taken():
    found = identify([measured(FALLING, drive, 0.004, 5.0, 1e-5)[0] for drive in (0.01, 0.025, 0.06)])
    assert isinstance(found.law, Combined)
    table = found.parameters
    assert abs(table.loc["kinetic.kinetic", "value"] - 2.4) < 3 * table.loc["kinetic.kinetic", "error"]
    assert found.rms < 0.1


@pytest.mark.slow
def test_a_search_that_steps_to_where_growth_does_not_act_comes_back(monkeypatch):
    records = [measured(FALLING, drive, 0.004, 5.0, 1e-5)[0] for drive in (0.01, 0.025, 0.06)]
    solve, calls = force_fit._solve, []

    def astray(problem, numbers, *rest):
        """A first step to where the kinetic force at w = 0 hides all growth, as a poor first guess may lead to."""
        found = solve(problem, numbers, *rest)
        calls.append(problem.free)
        if len(calls) == 1:
            found[problem.free.index("kinetic.break_away")] = 4.31
            found[problem.free.index("static.onset")] = 33.0
        return found

    monkeypatch.setattr(force_fit, "_solve", astray)
    table = identify(records, law=FALLING, ties={"static.kinetic": "kinetic.break_away"}).parameters
    assert abs(table.loc["kinetic.scale", "value"] - 0.04) < 3 * table.loc["kinetic.scale", "error"]


@pytest.mark.slow
def test_friction_that_changes_with_slip_speed_has_a_curve_and_a_law_of_one_number_says_so():
    record = measured(FALLING, 0.06, 0.004, 5.0, 1e-5)[0]
    found = identify(record)
    assert isinstance(found.law, Combined)
    scale = found.parameters.loc["kinetic.scale"]
    assert scale["low"] < 0.04 < scale["high"]
    said = "ask for a law with a curve"
    assert any(said in note for note in identify(record, law="StaticKinetic").notes)
    constant = identify(measured(StaticKinetic(4.2, 2.8), 0.06, 0.004, 5.0, 1e-5)[0])
    assert isinstance(constant.law, StaticKinetic)
    assert not any(said in note for note in constant.notes)
