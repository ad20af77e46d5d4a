"""A joint that turns to and fro without a stick, its torque and angle recorded: from the record to a law with its errors."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from evidence import script
from scipy.signal import lfilter

import stickslip as ss
from stickslip.cli.main import main
from stickslip.identification import fit_steady
from stickslip.identification.steady.steady_rows import LeftOut, notes_on_left_out, rows_of

first_records = script("first_records")

INERTIA, NOISE, RATE = 0.021, 0.008, 250.0
"""kg m^2, N m and Hz."""
FORWARD = ss.laws.ExponentialStribeck(break_away=0.60, kinetic=0.35, scale=0.08, viscous=0.06, exponent=2.0)
BACKWARD = ss.laws.ExponentialStribeck(break_away=0.648, kinetic=0.378, scale=0.08, viscous=0.06, exponent=2.0)
JOINT = ss.laws.Asymmetric(forward=FORWARD, backward=BACKWARD)
NAMES = [f"{way}.{name}" for way in ("forward", "backward") for name in ("break_away", "kinetic", "scale", "viscous")]
RIG = {
    "instrument": "direct_force",
    "inertia": "0.021 kg m^2",
    "columns": {
        "time": "t",
        "displacement": {"column": "q", "unit": "rad"},
        "force": {"column": "torque", "unit": "N m"},
    },
}


def recorded(law: ss.laws.Law, seconds: float = 18.0, zero: float = 0.0) -> dict[str, np.ndarray]:
    """Angle and torque of three sines together, so that some runs of one sense are far shorter than others."""
    rng, t = np.random.default_rng(77), np.arange(0, seconds, 1 / RATE)
    q, speed, acceleration = first_records.swung(t, [(0.9, 0.12, 0.0), (0.35, 0.31, 1.0), (0.12, 0.83, 2.0)])
    torque = INERTIA * acceleration + law.kinetic_force(speed) + zero + NOISE * rng.standard_normal(t.size)
    return {"t": t, "q": q + 2e-5 * rng.standard_normal(t.size), "torque": torque}


@pytest.fixture(scope="module")
def joint() -> xr.DataTree:
    return ss.measure(recorded(JOINT), RIG)


def by_hand(friction: xr.DataTree, law: ss.laws.Law, offset: float = 0.0) -> float:
    """Rms of measured less predicted torque over the samples whose sense is clear."""
    data = friction.to_dataset(inherit=False)
    w = data["slip_velocity"].to_numpy()
    clear = np.abs(w) > 4 * data["slip_velocity_error"].to_numpy()
    return float(np.sqrt(np.mean((data["force"].to_numpy() - law.kinetic_force(w) - offset)[clear] ** 2)))


@pytest.mark.long
def test_a_law_asked_for_gets_the_numbers_that_friction_over_speed_gives(joint: xr.DataTree) -> None:
    found = ss.identify(joint, law=JOINT, free=NAMES)
    truth = ss.laws.numbers.value
    for name, row in found.parameters.iterrows():
        assert row["low"] - row["error"] <= truth(JOINT, name) <= row["high"] + row["error"], name
    steady = fit_steady(joint, law="ExponentialStribeck").fits["Gaussian Stribeck, asymmetric"]
    w = np.array([-1.0, -0.3, -0.03, 0.03, 0.3, 1.0])
    low, high = steady.interval(w)
    np.testing.assert_allclose(found.law.kinetic_force(w), steady(w), atol=2 * float(np.max(high - low)))
    assert found.rms == pytest.approx(by_hand(joint, found.law), rel=0.02)
    assert found.rms < 1.3 * NOISE
    assert any(note.startswith("The break-away force comes from no stick: it is") for note in found.notes)


def test_an_offset_of_a_reversing_record_is_found_beside_a_law() -> None:
    friction = ss.measure(recorded(FORWARD, zero=0.03), RIG)
    start = ss.laws.ExponentialStribeck(0.55, 0.4, 0.12, 0.04, exponent=2.0)
    found = ss.identify(friction, law=start, free=["break_away", "kinetic", "scale", "viscous"], offset=True)
    assert found.offset["low"] <= 0.03 <= found.offset["high"]
    for name, row in found.parameters.iterrows():
        assert row["low"] - row["error"] <= getattr(FORWARD, name) <= row["high"] + row["error"], name
    assert found.rms == pytest.approx(by_hand(friction, found.law, found.offset["value"]), rel=0.02)


def test_a_short_reversal_is_a_slip_of_its_own() -> None:
    t = np.arange(0, 10, 0.01)
    w = np.where((t > 4.0) & (t < 4.4), -0.3, 1.0)  # the path back is a fiftieth of that before
    force = np.sign(w) * 0.5
    tree = xr.DataTree.from_dict(
        {"/": xr.Dataset({"slip_velocity": ("time", w), "force": ("time", force)}, {"time": t})}
    )
    found = ss.identify(tree, law=ss.laws.ExponentialStribeck(0.6, 0.4, 0.1), free=["kinetic"])
    assert found.parameters.loc["kinetic", "value"] == pytest.approx(0.5, abs=1e-3)
    assert found.rms < 0.02


def test_a_motor_current_over_an_angle_is_a_torque() -> None:
    data = recorded(JOINT)
    columns = {
        "time": "t",
        "displacement": {"column": "q", "unit": "rad"},
        "current": {"column": "i", "unit": "A"},
    }
    rig = {
        "instrument": "motor_current",
        "force_per_current": "0.118 N m/A",
        "inertia": "210 kg cm^2",
        "columns": columns,
    }
    record = {"t": data["t"], "q": data["q"], "i": data["torque"] / 0.118}
    found = ss.measure(record, rig)
    units = {
        name: found[name].attrs["units"] for name in ("force", "slip_velocity", "slip_acceleration", "displacement")
    }
    assert units == {"force": "N m", "slip_velocity": "rad/s", "slip_acceleration": "rad/s^2", "displacement": "rad"}
    said = " ".join(found.attrs["notes"])
    assert not re.search(r" N (?!m)", said)
    assert "inertia in the rig 0.021 kg m^2, as fitted 0.0" in said
    assert " +- " in said
    low, high = (float(number) for number in said.split("on the inertia: ")[1].split(" N m")[0].split(" ... "))
    assert 0.3 < low < high < 0.7
    fitted, error = found.attrs["fitted_inertia"], found.attrs["fitted_inertia_error"]
    assert abs(fitted - INERTIA) < 3 * error < INERTIA
    with pytest.raises(ss.InputError, match="expected inertia in kg m\\^2 for a displacement in rad, got mass in kg"):
        ss.measure(record, {**{key: value for key, value in rig.items() if key != "inertia"}, "mass": 0.021})


def test_options_that_clash_are_refused_before_the_fit(joint: xr.DataTree, tmp_path, monkeypatch, capsys) -> None:
    joint.to_netcdf(tmp_path / "joint.nc")
    for name in ("fit_steady", "identify"):
        monkeypatch.setattr(f"stickslip.identification.{name}", None)
    friction = str(tmp_path / "joint.nc")
    assert main(["identify", friction, "--predict", friction]) == 2
    assert "--predict does not go with" in capsys.readouterr().err


@pytest.mark.long
def test_friction_over_speed_is_drawn_where_no_motion_can_be_simulated(joint: xr.DataTree, tmp_path, capsys) -> None:
    joint.to_netcdf(tmp_path / "joint.nc")
    picture = tmp_path / "law.png"
    assert main(["identify", str(tmp_path / "joint.nc"), "--law", "Coulomb", "--plot", str(picture)]) == 0
    assert "does not say its mass, stiffness, drive_velocity" in capsys.readouterr().out
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.long
def test_the_picture_of_a_joint_shows_its_low_speeds(joint: xr.DataTree) -> None:
    found = fit_steady(joint, law="ExponentialStribeck")
    assert found.rows["force_error"].isna().all()  # no point has bars of an error that is not stated
    axes = found.plot()
    axes.figure.canvas.draw()
    whole, slow = axes.figure.axes
    assert axes is whole
    assert 0.2 < np.abs(slow.get_xlim()).max() < 0.5  # the fall is over at 0.16 rad/s
    # axes keep most of the figure, and no curve lies upon another
    assert all(panel.get_position().height > 0.55 and panel.get_position().width > 0.35 for panel in (whole, slow))
    labels = [text.get_text() for text in axes.figure.legends[0].get_texts()]
    assert labels == ["measured", "Gaussian Stribeck, asymmetric", "medians in bins of speed"]


@pytest.mark.slow
@pytest.mark.parametrize("given", [0.0189, 0.0231])
def test_a_wrong_inertia_is_named_and_no_spring_is_invented(given: float) -> None:
    found = fit_steady(ss.measure(recorded(JOINT), {**RIG, "inertia": given}), law="ExponentialStribeck")
    said = next(note for note in found.notes if "contradicts the inertia" in note)
    off, error = (float(number) for number in re.search(r"by ([-+.\de]+) \+- ([-.\de]+) kg m\^2", said).groups())
    assert abs(off - (INERTIA - given)) < 3 * error < 0.001
    assert found.chosen == "Gaussian Stribeck, asymmetric, inertia"
    row = found.parameters.loc["inertia"]
    assert row["low"] - row["error"] <= INERTIA - given <= row["high"] + row["error"]
    assert found.rows["slip_velocity"].abs().min() < 0.02
    np.testing.assert_allclose(found.law.kinetic_force([-0.5, 0.5]), JOINT.kinetic_force([-0.5, 0.5]), atol=0.003)


@pytest.mark.long
def test_a_right_inertia_is_not_contradicted_and_samples_left_out_are_counted(joint: xr.DataTree) -> None:
    notes = fit_steady(joint, law="ExponentialStribeck").notes
    assert not any("contradicts" in note for note in notes)
    assert re.search(r"from no stick: it is the kinetic force extrapolated from w = 0\.00\d+ to w = 0", " ".join(notes))
    said = next(note for note in notes if "were left out" in note)
    assert re.search(r"of 4500 samples these were left out: \d+ up to w = 0\.00", said)


def test_samples_left_out_of_several_records_are_one_sentence(joint: xr.DataTree) -> None:
    slow = joint.copy(deep=True)
    slow["slip_velocity_error"][:] *= 10
    lost = [rows_of(tree, name)[2] for name, tree in {"one": joint, "two": slow, "three": joint}.items()]
    (said,) = notes_on_left_out(lost)
    assert said.startswith("3 records: of 13500 samples these were left out: ")
    assert sum(map(int, re.findall(r"(\d+) up to w = ", said))) == sum(record.count for record in lost)
    assert "The largest share is that of two, " in said
    assert notes_on_left_out([LeftOut("one", 7, {})]) == []


def test_a_joint_without_sticks_gets_curves_each_way_by_the_name_of_the_law(joint: xr.DataTree) -> None:
    found = ss.identify(joint, law="Asymmetric")
    assert isinstance(found.law.forward, ss.laws.ExponentialStribeck)
    assert sorted(found.parameters.index) == sorted(NAMES)
    w = np.array([-1.0, -0.2, -0.03, 0.03, 0.2, 1.0])
    np.testing.assert_allclose(found.law.kinetic_force(w), JOINT.kinetic_force(w), atol=0.01)
    said = " ".join(found.notes)
    assert (
        "ExponentialStribeck and ExponentialStribeck, as its kinetic friction tells (there are no break-aways)" in said
    )


def test_numbers_of_a_given_law_that_are_not_fitted_are_named(joint: xr.DataTree) -> None:
    start = ss.laws.PiecewiseLinear(
        nodes=((0, 0.6), (0.1, 0.45), (0.2, 0.37), (1.0, 0.42), (1.9, 0.48)), break_away=0.6
    )
    found = ss.identify(joint, law=start)
    said = next(note for note in found.notes if note.startswith("Held as in the law that was given: "))
    assert "nodes[4].force = 0.48; name them in free" in said
    assert "nodes[1].force" not in said


# --- an arm in gravity, moved at constant speeds to and fro

W_LEVELS = np.array([0.05, 0.2, 0.6, 1.5])


def arm(
    seed: int,
    weight: tuple[float, float] = (0.05, 0.3),
    larger: float = 1.12,
    extra: float = 0.0,
    exponent: float = 2.0,
    drift: float = 0.0,
) -> xr.DataTree:
    """Friction of an arm with gravity weight[0] sin(q + weight[1]), `larger` times as strong backward.

    `extra`: a torque of the position that is no gravity; `drift`: growth of friction from the first to the last sample.
    """
    rng, step = np.random.default_rng(seed), 0.01
    speeds = np.concatenate([[s, -s, -s, s] for s in rng.permutation(np.tile(W_LEVELS, 3))])
    w = np.repeat(speeds, 60)
    w = np.convolve(np.pad(w, 4, mode="edge"), np.ones(9) / 9, mode="valid")
    t = step * np.arange(w.size)
    q = np.cumsum(w) * step - 0.4
    speed = np.abs(w)
    friction = 0.11 + 0.08 * np.exp(-((speed / 0.15) ** exponent))
    torque = np.sign(w) * (friction * np.where(w < 0, larger, 1.0) + 0.06 * speed) * (1 + drift * t / t[-1])
    torque += weight[0] * np.sin(q + weight[1]) + extra * np.sin(7 * q) + 0.0042 * np.gradient(w, step)
    rows = np.abs(w) > 0.02
    table = {
        "time": t,
        "slip_velocity": w,
        "displacement": q,
        "force": torque - 0.0042 * np.gradient(w, step) + 0.004 * rng.standard_normal(t.size),
    }
    units = {"time": "s", "slip_velocity": "rad/s", "displacement": "rad", "force": "N m"}
    columns = {name: ("time", values[rows], {"units": units[name]}) for name, values in table.items()}
    return xr.DataTree(xr.Dataset(columns))


@pytest.mark.long
def test_gravity_is_not_passed_over_for_a_spring_of_unknown_zero() -> None:
    found = fit_steady(arm(101, exponent=1.4), law="ExponentialStribeck")
    assert "gravity" in found.chosen
    low, high = found.best.interval([0.6, -0.6])
    part = 0.11 + 0.08 * np.exp(-(4.0**1.4))
    truth = np.array([part + 0.036, -1.12 * part - 0.036])
    assert ((low <= truth) & (truth <= high)).all()


@pytest.mark.parametrize(
    ("weight", "larger"), [((0.05, 0.3), 1.12), pytest.param((0.2, -1.1), 0.9, marks=pytest.mark.long)]
)
def test_gravity_of_the_arm_is_told_from_friction_that_differs_by_the_sense(weight, larger) -> None:
    found = fit_steady(arm(1, weight, larger))
    assert "gravity" in found.chosen
    truth = {"gravity_sine": weight[0] * np.cos(weight[1]), "gravity_cosine": weight[0] * np.sin(weight[1])}
    for name, value in truth.items():
        row = found.parameters.loc[name]
        assert row["low"] - row["error"] <= value <= row["high"] + row["error"], name
    law = found.law
    assert isinstance(law, ss.laws.Asymmetric)
    forward, backward = law.kinetic_force(0.6), -law.kinetic_force(-0.6)
    assert forward == pytest.approx(0.146, abs=0.004)
    assert backward == pytest.approx(0.11 * larger + 0.036, abs=0.004)
    said = next(note for note in found.notes if note.startswith("Friction differs by the sense"))
    assert (float(re.search(r"it is ([\d.]+) forward", said)[1]) > float(re.search(r"([\d.]+) backward", said)[1])) == (
        larger < 1
    )
    assert not any("not valid" in note for note in found.notes)
    assert found.valid


def test_code_of_a_joint_holds_the_offset_and_the_gravity_too(tmp_path, capsys) -> None:
    record = arm(1, larger=1.0)
    record["force"] = record["force"] + 0.1
    found = fit_steady(record)
    assert {"offset", "gravity_sine", "gravity_cosine"} <= set(found.beside)
    law, code = found.save(tmp_path / "law.toml"), tmp_path / "friction.py"
    assert main(["law", str(law), "--speed", "2", "--code", str(code)]) == 0
    assert f"beside friction: offset = {found.beside['offset']}" in capsys.readouterr().out
    names: dict = {}
    exec(code.read_text(encoding="utf-8"), names)
    for w, x in ((0.6, 0.3), (-0.6, -0.4)):
        whole = names["friction"](w, 0.0) + names["beside_friction"](x, 0.0)
        assert whole == pytest.approx(found.best([w], position=[x])[0], abs=1e-4)


def test_an_offset_that_was_fitted_is_in_the_law_file(tmp_path) -> None:
    found = ss.identify(ss.measure(recorded(FORWARD, zero=0.03), RIG), law="Coulomb", offset=True)
    code = tmp_path / "friction.py"
    assert main(["law", str(found.save(tmp_path / "law.toml")), "--speed", "2", "--code", str(code)]) == 0
    names: dict = {}
    exec(code.read_text(encoding="utf-8"), names)
    assert names["beside_friction"](0.0, 0.0) == found.offset["value"]


@pytest.mark.slow
def test_a_law_of_the_motion_is_refused_where_gravity_makes_its_numbers_and_the_curve_each_way_has_both() -> None:
    t = np.arange(0, 40, 0.02)
    w = 0.5 * np.sin(0.7 * t) + 0.2 * np.sin(1.9 * t)
    q = 0.5 / 0.7 * (1 - np.cos(0.7 * t)) + 0.2 / 1.9 * (1 - np.cos(1.9 * t))
    friction = np.where(w > 0, 0.5, -0.3) + np.where(w > 0, 0.25, 0.35) * w
    noise = 0.02 * np.random.default_rng(2).standard_normal(t.size)
    rig = {**RIG, "inertia": 0.0, "columns": {**RIG["columns"], "velocity": {"column": "dq", "unit": "rad/s"}}}

    def record(gravity: float) -> xr.DataTree:
        return ss.measure({"t": t, "q": q, "dq": w, "torque": friction + gravity * np.sin(q + 0.3) + noise}, rig)

    for law in ("Asymmetric", "Coulomb"):
        with pytest.raises(ss.InputError, match="follows sine and cosine of the angle"):
            ss.identify(record(0.3), law=law)
    found = fit_steady(record(0.3), law="Asymmetric")
    np.testing.assert_allclose(found.law.kinetic_force([-0.5, 0.5]), [-0.475, 0.625], atol=0.02)
    assert found.parameters.loc["gravity_sine", "value"] == pytest.approx(0.3 * np.cos(0.3), abs=0.02)
    without = ss.identify(record(0.0), law="Asymmetric")
    np.testing.assert_allclose(without.law.kinetic_force([-0.5, 0.5]), [-0.475, 0.625], atol=0.02)
    assert not any("follows sine" in note for note in without.notes)


def test_a_curve_each_way_needs_slip_both_ways() -> None:
    record = recorded(FORWARD)
    one_way = {**record, "q": 3 * record["t"]}
    with pytest.raises(ss.InputError, match="Asymmetric needs slip in both senses"):
        fit_steady(ss.measure(one_way, RIG), law="Asymmetric")


def test_an_arm_without_gravity_is_given_none() -> None:
    found = fit_steady(arm(3, (0.0, 0.0)))
    assert "gravity" not in found.chosen


@pytest.mark.slow
@pytest.mark.parametrize(("extra", "drift", "words"), [(0.03, 0.0, "position"), (0.0, 0.4, "time")])
def test_a_force_that_no_form_has_is_said_first_and_makes_the_intervals_wider(extra, drift, words) -> None:
    found = fit_steady(arm(2, extra=extra, drift=drift))
    assert found.notes[0].startswith(f"What this form leaves of the force follows the {words}, and no form explains it")
    assert "not valid" in found.notes[0]
    assert not found.valid
    assert found.to_dict()["valid"] is False
    assert "not valid" in found.to_toml()
    true = fit_steady(arm(2))
    # the same scatter without its cause would count as noise and be averaged over all rows
    errors = found.parameters["error"].reindex(true.parameters.index).dropna() / true.parameters["error"]
    assert errors.dropna().median() > 2


@pytest.mark.slow
def test_intervals_hold_the_curve_where_the_form_is_another() -> None:
    held, count = 0, 0
    for seed in range(12):
        found = fit_steady(arm(100 + seed, exponent=1.4), law="ExponentialStribeck")
        w = np.array([0.05, 0.2, 0.6, 1.5])
        low, high = found.best.interval(np.r_[w, -w])
        truth = 0.11 + 0.08 * np.exp(-((w / 0.15) ** 1.4))
        truth = np.r_[truth + 0.06 * w, -(1.12 * truth + 0.06 * w)]
        held += int(np.sum((low <= truth) & (truth <= high)))
        count += truth.size
    assert held >= 0.9 * count


def test_a_law_is_a_table_of_friction_with_bands(joint: xr.DataTree, tmp_path, capsys) -> None:
    joint.to_netcdf(tmp_path / "joint.nc", engine="h5netcdf")
    law, table = tmp_path / "law.toml", tmp_path / "friction.csv"
    command = ["identify", str(tmp_path / "joint.nc"), "--steady", "--law", "ExponentialStribeck"]
    assert main([*command, "-o", str(law), "--table", str(table)]) == 0
    assert f"written             {table}" in capsys.readouterr().out
    found = pd.read_csv(table)
    assert list(found) == [
        *("slip_velocity (rad/s)", "stick_time (s)"),
        *("force (N m)", "low (N m)", "high (N m)"),
    ]
    loaded = ss.load_law(law)
    again = ss.laws.friction_table(loaded, found["slip_velocity (rad/s)"][:-1], [0.0])
    np.testing.assert_allclose(again.to_numpy(), found.to_numpy(), rtol=1e-9)
    low, force, high = (again[name] for name in ("low", "force", "high"))
    assert ((low < force) & (force < high)).all()
    near, truth = ss.laws.friction_table(loaded, [0.5, -0.5]), JOINT.kinetic_force([0.5, -0.5])
    assert (np.abs(near["force"] - truth) < near["high"] - near["low"]).all()
    with pytest.raises(ss.InputError, match="has no covariance"):
        ss.laws.friction_table(FORWARD, [0.1])
    with pytest.raises(ss.InputError, match="not 0"):
        ss.laws.friction_table(loaded, [0.0])


def test_the_current_of_a_motor_is_a_force_by_its_constant(joint: xr.DataTree) -> None:
    record = recorded(JOINT)
    record["current"] = 1e3 * record.pop("torque") / 0.071
    current = {"column": "current", "unit": "mA"}
    columns = {"time": "t", "displacement": RIG["columns"]["displacement"], "current": current}
    rig = {
        "instrument": "direct_force",
        "inertia": RIG["inertia"],
        "force_per_current": "0.071 N m/A",
        "columns": columns,
    }
    found = ss.measure(record, rig)
    assert found["force"].attrs["units"] == "N m"
    np.testing.assert_allclose(found["force"], joint["force"], atol=1e-12)
    table = found["steady"]
    assert (table["slip_velocity"] > 0).sum() > 4 < (table["slip_velocity"] < 0).sum()
    no_constant = {name: value for name, value in rig.items() if name != "force_per_current"}
    with pytest.raises(ss.InputError, match="force_per_current is missing"):
        ss.measure(record, no_constant)
    with pytest.raises(ss.InputError, match="lacks current, which force_per_current turns into force"):
        ss.measure(recorded(JOINT), RIG | {"force_per_current": 0.071})
    with pytest.raises(ss.InputError, match="names both force and current"):
        ss.measure(record, rig | {"columns": columns | {"force": "t2"}})
    with pytest.raises(ss.InputError, match="lacks force or current"):
        ss.measure(record, no_constant | {"columns": {"time": "t", "displacement": "q"}})


def test_two_levels_of_a_motor_are_said_to_be_no_curve() -> None:
    record = recorded(JOINT)
    record["current"] = record.pop("torque") / 0.071
    rig = {
        "instrument": "motor_current",
        "force_per_current": "0.071 N m/A",
        "inertia": RIG["inertia"],
        "columns": {"time": "t", "displacement": RIG["columns"]["displacement"], "current": "current"},
    }
    found = ss.measure(record, rig)
    assert found["steady"].sizes["row"] == 2
    said = " ".join(found.attrs["notes"])
    assert "one level each" in said
    assert "direct_force" in said


def swinging_arm(friction) -> xr.DataTree:
    """An arm of 0.12 kg m^2 or none and its weight, beside a friction over time and speed; the rig gives no inertia."""
    rng, t = np.random.default_rng(5), np.arange(0, 40, 0.004)
    q, speed, acceleration = first_records.swung(t, [(0.87, 0.1, 0.0), (0.35, 0.23, 0.4)])
    torque = friction(t, speed, acceleration) + 3.1 * np.sin(q) - 0.6 * np.cos(q) + 0.03 * rng.standard_normal(t.size)
    record = {"t": t, "q": q + 3e-5 * rng.standard_normal(t.size), "torque": torque}
    return ss.measure(record, {key: value for key, value in RIG.items() if key != "inertia"})


@pytest.mark.long
def test_an_inertia_that_the_rig_does_not_give_is_fitted_and_said() -> None:
    numbers = {"kinetic": 0.9, "viscous": 1.7, "gravity_sine": 3.1, "gravity_cosine": -0.6, "inertia": 0.12}
    found = fit_steady(swinging_arm(lambda _, w, a: 0.9 * np.sign(w) + 1.7 * w + 0.12 * a))
    assert found.chosen == "Coulomb + viscous, gravity, inertia"
    assert found.parameters.index.tolist() == list(numbers)
    truth, rows = np.array([*numbers.values()]), found.parameters
    assert (np.abs(rows["value"] - truth) < 3 * rows["error"]).all()
    assert rows.loc["inertia", "error"] < 0.003
    assert found.units["inertia"] == "kg m^2"
    assert sum("the rig gives none. Set inertia in the rig" in note for note in found.notes) == 1


@pytest.mark.long
def test_friction_that_lags_behind_the_speed_is_no_inertia() -> None:
    # A fall of friction that comes 20 ms late adds a force along the acceleration, but at low speed only.
    def late(t, w, _):
        speed, step = np.abs(w), t[1] - t[0]
        followed = lfilter([step / 0.02], [1, step / 0.02 - 1], speed)
        return np.sign(w) * (0.9 + 1.2 * np.exp(-followed / 0.2)) + 0.2 * w

    found = fit_steady(swinging_arm(late))
    assert "inertia" not in found.chosen
    assert not any("the rig gives none" in note for note in found.notes)


@pytest.mark.long
@pytest.mark.parametrize("stiffness", [2e5, pytest.param(8e4, marks=pytest.mark.slow)])
def test_friction_that_still_builds_up_after_a_turn_is_no_friction_of_the_speed(stiffness: float) -> None:
    # Bristles give way over some 0.1 mm, so that friction is less than the fall has it where the slide speeds up from rest.
    t = np.arange(0, 24, 1e-4)
    x, v, _ = first_records.swung(t, [(0.03, 0.25, 0.0), (0.008, 0.61, 1.0)])
    force = first_records.bristles(v, 20 + 9 * np.exp(-((v / 0.01) ** 2)), stiffness, 0.0, 1e-4) + 180 * v
    seen, random = slice(None, None, 10), np.random.default_rng(3)
    record = {"t": t[seen], "x": x[seen] + 3e-7 * random.standard_normal(t[seen].size), "f": force[seen]}
    record["f"] = record["f"] + 0.4 * random.standard_normal(t[seen].size)
    columns = {"time": "t", "displacement": {"column": "x", "unit": "m"}, "force": {"column": "f", "unit": "N"}}
    found = fit_steady(ss.measure(record, {"instrument": "direct_force", "columns": columns}))
    assert found.chosen == "Gaussian Stribeck"
    numbers = found.parameters["value"]
    assert numbers["kinetic"] == pytest.approx(20.0, abs=0.1)
    assert numbers["viscous"] == pytest.approx(180.0, abs=1.5)
    assert numbers["weakening"] == pytest.approx(9.0, abs=1.2)  # was not seen at all
    assert any("so near a turn of the slip that friction still builds up" in note for note in found.notes)
