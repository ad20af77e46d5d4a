"""Friction over slip velocity alone: which form, with what numbers, and whether the known ones lie in the intervals."""

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from real_records import measured
from scipy.optimize import curve_fit
from scipy.signal import lfilter

import stickslip as ss
from stickslip.files.arrays import taken
from stickslip.identification import fit_static_friction, fit_steady
from stickslip.identification.steady.curves import Rows
from stickslip.identification.steady.single_form_fit import fit_form
from stickslip.measurement import measure


def curve(w, force, error, **more):
    columns = {"slip_velocity": w, "force": force, "force_error": np.full(len(w), error), **more}
    return xr.DataTree.from_dict({"/steady": xr.Dataset({name: ("row", values) for name, values in columns.items()})})


def inside(parameters, name, value):
    return parameters.loc[name, "low"] <= value <= parameters.loc[name, "high"]


W = np.concatenate([np.geomspace(0.01, 1, 15), -np.geomspace(0.01, 1, 15)])
SENSE, SPEED = np.sign(W), np.abs(W)
TRUTHS = {
    "Coulomb": (SENSE * 0.4, {"kinetic": 0.4}),
    "Coulomb, offset": (SENSE * 0.4 - 0.17, {"kinetic": 0.4, "offset": -0.17}),
    "Coulomb + viscous, offset": (SENSE * 0.4 + 0.2 * W - 0.17, {"kinetic": 0.4, "viscous": 0.2, "offset": -0.17}),
    "Coulomb + quadratic": (SENSE * (0.4 + 0.3 * SPEED**2), {"kinetic": 0.4, "quadratic": 0.3}),
    "logarithmic": (SENSE * (0.4 + 0.02 * np.log(SPEED / 0.1)), {"kinetic": 0.4, "logarithm": 0.02}),
    "Stribeck": (
        SENSE * (0.4 + 0.2 * np.exp(-SPEED / 0.1) + 0.1 * SPEED),
        {"kinetic": 0.4, "weakening": 0.2, "scale": 0.1, "viscous": 0.1},
    ),
}


@pytest.mark.parametrize("repetitions", [1, pytest.param(20, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "form", [pytest.param(form, marks=[pytest.mark.long] if number % 2 else []) for number, form in enumerate(TRUTHS)]
)
def test_the_form_is_found_and_its_numbers_lie_in_their_intervals(form: str, repetitions: int) -> None:
    force, truth = TRUTHS[form]
    held, found = 0, 0
    rng = np.random.default_rng(5)
    for _ in range(repetitions):
        fit = fit_steady(curve(W, force + 0.004 * rng.standard_normal(30), 0.004))
        found += fit.chosen == form
        parameters = fit.fits[form].parameters
        held += sum(inside(parameters, name, value) for name, value in truth.items())
    assert found >= 0.8 * repetitions
    assert held >= 0.75 * repetitions * len(truth)  # at 95 % fewer than 15 of 20 come by chance once in 3000


@pytest.mark.parametrize("hold", [0, 20])
def test_a_single_run_up_shows_its_curve_however_long_the_run_after_it(hold: int) -> None:
    # Held back as a whole, the first stretch would have to be foretold from speeds at which friction falls no more.
    rng, t = np.random.default_rng(hold), np.arange(0, 10 + hold, 0.02)
    w = np.minimum(10 * t, 100.0)
    torque = 0.5 + 0.8 * np.exp(-w / 8) + 0.01 * w + 0.02 * rng.standard_normal(t.size)
    record = {"t": t, "w": w + 0.05 * rng.standard_normal(t.size), "torque": torque}
    columns = {"time": "t", "velocity": {"column": "w", "unit": "rad/s"}, "force": {"column": "torque", "unit": "N m"}}
    found = ss.identify(ss.measure(record, {"instrument": "direct_force", "columns": columns}))
    assert found.chosen == "Stribeck"
    for name, truth in {"kinetic": 0.5, "weakening": 0.8, "scale": 8.0, "viscous": 0.01}.items():
        value, error = found.parameters.loc[name, ["value", "error"]]
        assert abs(value - truth) < 3 * error, name


def test_load_and_drift_are_told_from_velocity() -> None:
    rng = np.random.default_rng(0)
    w = np.tile(np.concatenate([np.geomspace(1e-6, 1e-4, 6), np.geomspace(1e-4, 1e-6, 6)]), 2)
    load, place = np.repeat([5.0, 10.0], 12), np.arange(24.0)
    force = 0.6 + 0.001 * np.log(w) + 0.002 * load + 0.0005 * place + 2e-4 * rng.standard_normal(24)
    found = fit_steady(curve(w, force, 2e-4, normal_force=load, displacement=place))
    assert found.chosen == "logarithmic, load, drift"
    for name, value in (("logarithm", 0.001), ("load", 0.002), ("drift", 0.0005)):
        assert inside(found.parameters, name, value)


@pytest.mark.slow
def test_a_force_of_the_place_is_told_from_friction() -> None:
    rng = np.random.default_rng(0)
    place = np.sin(np.linspace(0, 12, 40))
    w = np.cos(np.linspace(0, 12, 40))
    force = 0.4 * np.sign(w) - 0.17 - 0.5 * (place - place.mean()) + 0.004 * rng.standard_normal(40)
    found = fit_steady(curve(w, force, 0.004, displacement=place))
    assert found.chosen == "Coulomb, offset, restoring"
    assert all(inside(found.parameters, *known) for known in (("kinetic", 0.4), ("offset", -0.17), ("restoring", -0.5)))
    assert found.law == ss.laws.Coulomb(kinetic=found.parameters.loc["kinetic", "value"])


@pytest.mark.long
def test_the_law_has_the_chosen_form_without_its_offset(tmp_path: Path) -> None:
    found = fit_steady(curve(W, TRUTHS["Coulomb + viscous, offset"][0], 0.004))
    assert found.law is not None
    np.testing.assert_allclose(found.law.kinetic_force([0.01, 0.5, -0.5]), [0.402, 0.5, -0.5], rtol=1e-9)
    found.save(tmp_path / "law.toml")
    assert ss.laws.load_law(tmp_path / "law.toml") == found.law
    stribeck = fit_steady(curve(W, TRUTHS["Stribeck"][0], 0.004), law="ExponentialStribeck").law
    assert isinstance(stribeck, ss.laws.ExponentialStribeck)
    assert stribeck.scale == pytest.approx(0.1, rel=1e-3)


@pytest.mark.long
def test_the_pictures_axes_say_what_is_drawn() -> None:
    found = fit_steady(curve(W, TRUTHS["Coulomb, offset"][0], 0.004))
    axes = found.plot()
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("slip velocity w", "friction force f")
    assert "Coulomb, offset" in [text.get_text() for text in axes.figure.legends[0].get_texts()]


@pytest.mark.parametrize(
    ("friction", "law", "words"),
    [
        (xr.DataTree(), None, "holds no friction over slip velocity"),
        (curve(W[:2], W[:2], 1.0), None, "2 points of friction over slip velocity are too few for any form"),
        (
            curve(W, W * np.nan, 1.0),
            None,
            "record 1: friction force is nan in row 0, where a number below 1e+60",
        ),
        (curve(np.where(W > 0.9, np.inf, W), W, 1.0), None, "slip velocity is inf in row 14"),
        (curve(1e-200 * W, W, 1.0), None, "not all below 1e-60 was expected; remove that row or correct the unit"),
        (curve(0 * W, W, 1.0), None, "nothing slides in it"),
        (curve(W, W, -1.0), None, "force_error is -1 in row 0, where a standard error was expected"),
        (
            curve(np.full(9, 0.3), np.ones(9), 1.0),
            "ExponentialStribeck",
            "9 points at the one slip velocity of 0.3 show no curve",
        ),
        (curve(W[:1], W[:1], 1.0), None, "1 point of friction over slip velocity is too few for any form"),
        (
            curve(np.array(["a", "b"]), np.ones(2), 1.0),
            None,
            "slip_velocity must be one number a row, got <U1 of shape (2,)",
        ),
        (curve(W, W, 1.0), "DwellTime", "DwellTime is not a curve over slip velocity alone"),
        ([], None, "expected at least one friction record"),
        ("friction", None, "no such file"),
        (7, None, "expected a friction file or a DataTree from measure, got int"),
    ],
)
def test_what_holds_no_curve_is_refused(friction, law, words) -> None:
    with pytest.raises(ss.InputError) as caught:
        fit_steady(friction, law)
    assert words in str(caught.value)


# --- real records, with the numbers that are known of them


@pytest.mark.slow
def test_the_offset_of_a_robots_torque_is_found_by_the_comparison(shared_data: Path) -> None:
    found = fit_steady(measured(shared_data, "robot_joint_nnfm", "robot_joint_nnfm/franka*.csv"))
    # the rigid-body model that was taken off leaves some 0.5 kg m^2 at all speeds
    assert found.chosen.endswith("offset, restoring, inertia")
    # Coulomb .40, viscous, offset -.17 fitted by hand: rms .148; laws without an offset .23 to .28 as published
    assert inside(found.parameters, "kinetic", 0.40)
    assert inside(found.parameters, "offset", -0.17)
    three = found.fits["Coulomb + viscous, offset"]
    assert three.rms == pytest.approx(0.148, abs=0.003)
    assert found.best.rms < 0.119  # the second best of the published, a network
    assert three.parameters.loc["kinetic", "low"] < 0.40 < three.parameters.loc["kinetic", "high"]
    # friction that differs by the sense has an offset in it, and so has gravity over a small angle
    constant = {"offset", "asymmetric", "gravity"}
    assert all(
        fit.rms > 0.2 for name, fit in found.fits.items() if not {*constant, "restoring"} & set(name.split(", "))
    )
    assert all(constant & set(name.split(", ")) for name in found.undecided)
    assert "that keeps its sign when the motion turns" in " ".join(found.notes)


@pytest.mark.slow
def test_a_slow_robot_joint_is_fitted_as_well_as_published(shared_data: Path) -> None:
    found = fit_steady(measured(shared_data, "robot_joint_fairino", "robot_joint_nnfm/fairino*.csv"))
    assert found.chosen == "logarithmic, asymmetric"  # torque grows with speed one way and hardly the other
    assert found.fits["Coulomb, offset"].rms == pytest.approx(1.570, abs=0.002)  # 1.562 with the turns
    # rms of published laws: Coulomb + viscous 1.97, Stribeck 1.92, LuGre 11.3
    assert found.best.rms < 1.92


def test_a_robot_joint_has_its_torques_in_the_interval(shared_data: Path) -> None:
    found = fit_steady(measured(shared_data, "robot_joint_kinova", "robot_joint_kinova/velocity_*.csv"))
    speed = found.rows["slip_velocity"].to_numpy()
    low, high = found.best.interval(speed)
    known = np.array([1.69, 1.79, 1.79, 2.10, 2.56])
    assert ((low <= known) & (known <= high)).all()
    assert inside(found.parameters, "viscous", (2.56 - 1.79) / 1.0)  # growth from .3 to 1.3 rad/s
    assert "an offset of the instrument or of gravity cannot be separated" in " ".join(found.notes)


@pytest.mark.slow
def test_seal_friction_grows_with_the_pressure(shared_data: Path) -> None:
    ring = fit_steady(
        measured(shared_data, "pneumatic_seal_o_ring", "pneumatic_seal/O-ring257_*.csv", "pneumatic_seal/rerun*.csv")
    )
    kdn = fit_steady(measured(shared_data, "pneumatic_seal_kdn", "pneumatic_seal/KDN_*.csv"))
    for found, known in ((ring, [4.75, 5.95, 7.25, 8.04]), (kdn, [5.63, 5.74, 6.29, 7.02])):
        assert found.chosen == "Coulomb, load"
        load = 1e5 * np.array([1, 3, 5, 7])
        middle = float(found.best.formula.split("N - ")[1].rstrip(")"))
        values = found.parameters["value"]
        # 1 N between runs
        np.testing.assert_allclose(values["kinetic"] + values["load"] * (load - middle), known, atol=1.0)
        assert inside(found.parameters, "kinetic", np.mean(known))
    # pressure slows the piston, so the two cannot be told apart
    assert "Load and slip velocity are tied" in " ".join(ring.notes)


def test_a_log_of_peaks_gives_static_friction_that_is_confounded(shared_data: Path) -> None:
    found = fit_static_friction(measured(shared_data, "spring_slider_camera", "spring_slider_camera/Force7_rows*.txt"))
    slope = found.fits["logarithmic"].parameters.loc["slope"]
    assert 0 < slope["low"] <= 2.8 <= slope["high"]
    assert "stick time and force rate cannot be separated" in " ".join(found.notes)


def test_a_list_of_rock_slips_gives_strength_over_waiting_time(shared_data: Path) -> None:
    found = fit_static_friction(measured(shared_data, "rock_4m_events", "rock_4m_events/Macroscopic*.csv"))
    slope = found.fits["logarithmic"].parameters.loc["slope"]
    assert slope["low"] > 0
    assert "Stick time and force rate are tied" in " ".join(found.notes)


def test_a_row_that_stands_out_is_named_and_so_is_a_law_that_is_not_seen() -> None:
    force = TRUTHS["Coulomb"][0] + 0.004 * np.random.default_rng(1).standard_normal(30)
    force[7] = 4.0
    assert "Row 7 (w = 0.1, f = 4) lies " in " ".join(fit_steady(curve(W, force, 0.004)).notes)
    straight = fit_steady(curve(W, TRUTHS["Coulomb"][0], 0.004), law="ExponentialStribeck")
    assert straight.notes[0].startswith("ExponentialStribeck was requested; Coulomb + viscous, its limit,")


def test_the_command_fits_tables_and_refuses_a_law_of_motion(tmp_path: Path, capsys) -> None:
    from stickslip.cli.main import main

    curve(W, TRUTHS["Coulomb, offset"][0], 0.004).to_netcdf(tmp_path / "f.nc", engine="h5netcdf")
    assert main(["identify", str(tmp_path / "f.nc"), "-o", str(tmp_path / "law.toml")]) == 0
    told = capsys.readouterr().out
    assert "Friction over slip velocity: Coulomb, offset" in told
    assert (tmp_path / "law.toml").exists()
    assert main(["identify", str(tmp_path / "f.nc"), "--law", "DwellTime"]) == 2
    assert "not a curve over slip velocity alone" in capsys.readouterr().err


TRUE = {"kinetic": 0.4, "viscous": 0.2, "offset": -0.17}


def _noise(kind: str, t: np.ndarray, x: np.ndarray, w: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    if kind == "waves of 0.4 s":
        return 0.1 * lfilter([np.sqrt(1 - 0.95**2)], [1, -0.95], rng.standard_normal(len(t) + 500))[500:]
    if kind == "a ripple along the path":  # the same at every passage: no average over passages removes it
        return 0.14 * np.sin(x * rng.uniform(30, 60) + rng.uniform(0, 7))
    passage = np.cumsum(np.diff(np.sign(w), prepend=np.sign(w[0])) != 0)
    return 0.1 * rng.standard_normal(passage.max() + 1)[passage] + 0.02 * rng.standard_normal(len(t))


@pytest.mark.parametrize("kind", ["waves of 0.4 s", "a ripple along the path", "another level at every passage"])
def test_intervals_hold_the_truth_where_residuals_go_together(kind: str) -> None:
    rng = np.random.default_rng(3)
    t = np.arange(0, 60, 0.02)
    held = dict.fromkeys(("kinetic", "viscous", "offset"), 0)
    for _ in range(40):
        w = np.sin(2 * np.pi * t / 5 + rng.uniform(0, 7))
        x = np.cumsum(w) * 0.02
        force = 0.4 * np.sign(w) + 0.2 * w - 0.17 + _noise(kind, t, x, w, rng)
        unknown = np.full(len(t), np.nan)
        rows = Rows(w, force, np.ones(len(t)), unknown, unknown, np.full(len(t), "r"), True)
        rows = taken(rows, np.abs(w) > 0.05)
        fit = fit_form(rows, "Coulomb + viscous, offset", ("kinetic", "viscous", "offset"))
        held = {name: count + inside(fit.parameters, name, TRUE[name]) for name, count in held.items()}
    # 95 % of 40 is 38; below 34 once in a hundred. Counting each sample alone held the offset under a ripple in 56 of 100.
    assert min(held.values()) >= 34


# --- records that disagree, forms that cannot be told, numbers that stand for others


def runs(levels, rng, slope=0.0, noise=0.01, count=12):
    """Friction over speeds of a run each, at its own level."""
    found = []
    for level in levels:
        w = rng.uniform(0.05, 0.5, count)
        found.append(curve(w, level + slope * w + noise * rng.standard_normal(count), noise))
    return found


def test_runs_that_disagree_are_named_and_each_counts_as_one() -> None:
    rng = np.random.default_rng(11)
    levels = 0.55 + 0.08 * rng.standard_normal(16)
    found = fit_steady(runs(levels, rng))
    assert found.notes[0].startswith("The 16 records do not lie on one curve: their friction is off from it by ")
    assert "look whether they are of one contact" in found.notes[0]
    row = found.parameters.loc["kinetic"]
    # that of the mean of sixteen levels, not of 192 rows, which would be 0.0007
    assert row["error"] == pytest.approx(np.std(levels, ddof=1) / 4, rel=0.3)
    alike = fit_steady(runs(np.full(16, 0.55), rng))
    assert not any("do not lie on one curve" in note for note in alike.notes)
    assert alike.parameters.loc["kinetic", "error"] < 0.001


def test_two_campaigns_far_apart_are_no_one_curve() -> None:
    rng = np.random.default_rng(2)
    low, high = runs([6.0, 10.5], rng, noise=0.3, count=24)
    found = fit_steady([low, high])
    assert "The 2 records do not lie on one curve" in found.notes[0]
    assert "-2.2 (record 1), +2.2 (record 2)" in found.notes[0]
    assert any("% of its mean" in note for note in found.notes)
    row = found.parameters.loc["kinetic"]
    assert row["low"] < 6.0 < 10.5 < row["high"]


def test_single_rows_that_scatter_beyond_their_errors_are_named() -> None:
    rng = np.random.default_rng(3)
    w = np.linspace(0.1, 1.0, 16)
    found = fit_steady(curve(w, 0.6 + 0.07 * rng.standard_normal(16), 0.004))
    assert "times their stated errors off the curve, more than chance makes" in found.notes[0]
    calm = fit_steady(curve(w, 0.6 + 0.004 * rng.standard_normal(16), 0.004))
    assert not any("stated errors" in note for note in calm.notes)


@pytest.mark.parametrize("slowest", [0.01, 0.08])
def test_the_break_away_of_a_gaussian_fall_is_found_or_said_to_be_an_extrapolation(slowest: float) -> None:
    rng = np.random.default_rng(8)
    w = np.geomspace(slowest, 1.0, 24)
    w = np.concatenate([w, -w])
    truth = np.sign(w) * (1.9 + 1.1 * np.exp(-((w / 0.1) ** 2))) + 0.6 * w
    found = fit_steady(curve(w, truth + 0.02 * rng.standard_normal(48), 0.02))
    value, low, high = found.best.at_rest(slowest)
    if slowest < 0.05:
        assert found.chosen == "Gaussian Stribeck"
        assert found.law.exponent == 2.0
        assert low < 3.0 < high
        assert value == pytest.approx(3.0, abs=0.1)
    else:  # half of the fall was not measured
        said = next(note for note in found.notes if note.startswith(f"Nothing was measured below w = {slowest}"))
        assert float(said.split("anything from ")[1].split(" upwards")[0]) < 3.0 < found.at_rest[2]
        assert "the break-away force of the law is an extrapolation" in said


@pytest.mark.parametrize("seed", range(6))
def test_a_fall_that_is_nearly_over_at_the_slowest_speed_leaves_the_break_away_open(seed: int) -> None:
    speed = np.geomspace(0.15, 1.5, 24)
    w = np.concatenate([speed, -speed])
    force = np.sign(w) * (1.9 + 1.1 * np.exp(-((w / 0.12) ** 2))) + 0.6 * w
    found = fit_steady(curve(w, force + 0.02 * np.random.default_rng(seed).standard_normal(48), 0.02))
    value, low, high = found.at_rest
    assert low <= 3.0 <= high
    assert high - low > 0.3 * value
    assert any("The break-away force cannot be determined" in note for note in found.notes)


@pytest.mark.parametrize("width", [0.0, 0.12])
def test_a_fall_that_is_over_at_the_slowest_speed_leaves_the_break_away_open_upwards(width: float) -> None:
    speed = np.geomspace(0.3, 3.0, 24)
    w = np.concatenate([speed, -speed])
    fall = 1.1 * np.exp(-((w / width) ** 2)) if width else 0.0
    force = np.sign(w) * (1.9 + fall) + 0.6 * w
    found = fit_steady(curve(w, force + 0.02 * np.random.default_rng(5).standard_normal(48), 0.02))
    value, low, high = found.at_rest
    assert low < value < 2.0
    assert high == np.inf
    said = next(note for note in found.notes if note.startswith("Nothing was measured below w = 0.3"))
    assert "may be larger by any amount; measure break-aways" in said


def test_speed_and_load_that_are_one_are_not_both_in_the_form() -> None:
    rng = np.random.default_rng(6)
    load = np.repeat([1e5, 3e5, 5e5, 7e5], 3)
    w = 0.013 * np.exp(-0.09 * (load / 1e5 - 1)) * (1 + 0.002 * rng.standard_normal(12))
    found = fit_steady(curve(w, 4.5 + 5e-6 * load + 0.15 * rng.standard_normal(12), 0.15, pressure=load))
    assert found.chosen == "Coulomb, load"
    said = next(note for note in found.notes if note.startswith("Load and slip velocity are tied"))
    assert "correlation -1.00" in said
    assert "Instead of load it may be " in said
    assert "logarithm -" in said


@pytest.mark.slow
def test_friction_that_differs_by_the_sense_is_told_from_an_offset(tmp_path: Path) -> None:
    rng = np.random.default_rng(9)
    w = np.concatenate([np.linspace(0.05, 1, 20), -np.linspace(0.05, 1, 20)])
    force = np.where(w > 0, 0.8 + 0.5 * w, -0.5 + 0.2 * w) + 0.01 * rng.standard_normal(40)
    found = fit_steady(curve(w, force, 0.01))
    assert found.chosen == "Coulomb + viscous, asymmetric"
    truth = {"kinetic": 0.65, "viscous": 0.35, "kinetic_by_sense": 0.15, "viscous_by_sense": 0.15}
    assert all(inside(found.parameters, *item) for item in truth.items())
    said = next(note for note in found.notes if note.startswith("Friction differs by the sense of the slip"))
    assert "A zero of the instrument cannot be separated from that" in said
    law = found.law
    assert isinstance(law, ss.laws.Asymmetric)
    np.testing.assert_allclose(law.kinetic_force(w), found.best(w), rtol=1e-12)
    names = [str(name) for name in found.covariance.index]
    assert {name.split(".")[0] for name in names} == {"forward", "backward"}
    low, high = found.best.interval([0.3, -0.3])
    drawn = np.array([one.kinetic_force([0.3, -0.3]) for one in law.sample(200, seed=1)])
    np.testing.assert_allclose(2 * 1.96 * drawn.std(axis=0), high - low, rtol=0.2)
    again = ss.load_law(found.save(tmp_path / "joint.toml"))
    assert again == law
    np.testing.assert_allclose(ss.laws.load_covariance(tmp_path / "joint.toml"), law.covariance)
    # a constant difference is an offset by another name, and is not called no friction
    plain = fit_steady(curve(w, np.where(w > 0, 0.8, -0.5) + 0.01 * rng.standard_normal(40), 0.01))
    assert plain.chosen == "Coulomb, offset"
    assert re.search(
        r"or friction that is 0\.(30|29)\d* larger for w [<>] 0; speed alone cannot show", " ".join(plain.notes)
    )


@pytest.mark.slow
def test_a_stribeck_curve_and_a_logarithm_that_differ_by_the_sense_are_laws() -> None:
    rng = np.random.default_rng(2)
    w = np.concatenate([np.geomspace(0.01, 1, 40), -np.geomspace(0.01, 1, 40)])
    part = np.where(w > 0, 1.0, 1.3) * np.sign(w)
    force = {
        "Gaussian Stribeck": part * (0.35 + 0.25 * np.exp(-((w / 0.08) ** 2))) + 0.06 * w,
        "logarithmic": part * (0.4 + 0.02 * np.log(np.abs(w) / 0.1)),
    }
    for shape, values in force.items():
        found = fit_steady(curve(w, values + 0.001 * rng.standard_normal(80), 0.001))
        assert found.chosen == f"{shape}, asymmetric"
        assert isinstance(found.law, ss.laws.Asymmetric)
        # a logarithm is a table, whose straight lines lie off it by a little
        np.testing.assert_allclose(found.law.kinetic_force(w), found.best(w), atol=2e-4)


def test_a_curve_that_no_form_has_is_named() -> None:
    rng = np.random.default_rng(12)
    w = rng.permutation(np.linspace(0.02, 1.0, 120))
    bump = 0.6 + 0.2 * np.exp(-(((w - 0.5) / 0.08) ** 2))
    found = fit_steady(curve(w, bump + 0.01 * rng.standard_normal(120), 0.01))
    assert any("has another shape than any of these forms" in note for note in found.notes)


@pytest.mark.slow
@pytest.mark.parametrize("between", [0.0, 0.05])
@pytest.mark.parametrize("records", [4, 16])
def test_intervals_hold_the_truth_whether_records_differ_or_not(between: float, records: int) -> None:
    rng = np.random.default_rng(21)
    held = dict.fromkeys(("kinetic", "viscous"), 0)
    for _ in range(100):
        levels = 0.6 + between * rng.standard_normal(records)
        found = fit_steady(runs(levels, rng, slope=0.3), law="ExponentialStribeck")
        fit = found.fits["Coulomb + viscous"].parameters
        held = {name: held[name] + inside(fit, name, true) for name, true in (("kinetic", 0.6), ("viscous", 0.3))}
    # 95 % of 100, three standard errors either way; above it where few records leave few degrees of freedom
    assert all(88 <= count <= 100 for count in held.values()), held


def test_a_peak_at_low_speed_is_found() -> None:
    # 29.6 N at rest falls to 20 N within a thirtieth of the top speed
    rng = np.random.default_rng(0)
    t = np.arange(0, 20, 0.01)
    w = 0.3 * np.cos(2 * t)
    force = np.sign(w) * (20 + 9.6 * np.exp(-np.abs(w) / 0.01) + 5 * np.abs(w)) + 0.1 * rng.standard_normal(t.size)
    record = {"t": t, "x": 0.15 * np.sin(2 * t) + 3e-5 * rng.standard_normal(t.size), "f": force}
    columns = {"time": "t", "displacement": {"column": "x", "unit": "m"}, "force": {"column": "f", "unit": "N"}}
    found = fit_steady(ss.measure(record, {"instrument": "direct_force", "columns": columns}))
    assert found.chosen == "Stribeck"
    rest, error = found.parameters.loc[["kinetic", "weakening"]][["value", "error"]].to_numpy().T
    assert rest.sum() == pytest.approx(29.6, abs=3 * float(np.hypot(*error)))
    assert isinstance(found.law, ss.laws.ExponentialStribeck)


def test_the_scale_of_a_fall_is_that_of_least_squares_however_many_samples_there_are():
    # a scale that is searched to a thousandth of itself is ten errors off where there are 20,000 samples
    random = np.random.default_rng(11)
    w = np.concatenate([np.linspace(0.026, 0.157, 10_000), np.linspace(0.157, 0.52, 10_000)])
    force = 0.38 + 0.24 * np.exp(-((w / 0.08) ** 2)) + 0.003 * random.standard_normal(w.size)
    root = {"time": ("time", np.arange(w.size) / 500), "slip_velocity": ("time", w), "force": ("time", force)}
    found = fit_steady(xr.DataTree(xr.Dataset(root)))
    assert found.chosen == "Gaussian Stribeck"

    def form(w, kinetic, weakening, scale, viscous):
        return kinetic + weakening * np.exp(-((w / scale) ** 2)) + viscous * w

    best, covariance = curve_fit(form, w, force, [0.4, 0.2, 0.1, 0.0])
    values = found.parameters["value"].reindex(["kinetic", "weakening", "scale", "viscous"]).to_numpy()
    assert np.all(np.abs(values - best) < 0.01 * np.sqrt(np.diag(covariance)))


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow), pytest.param(3, marks=pytest.mark.slow)])
def test_a_fall_that_the_error_of_the_speed_blurs_is_said_to_be_unknown(seed: int) -> None:
    # a fall over 5 mm/s, seen from 6 mm/s on as the speed has an error of 1.5: a Gaussian fall over 9.7 fits as well
    rng, t = np.random.default_rng(seed), np.arange(0, 60, 0.02)
    w = 0.05 * np.sin(np.pi * t)
    force = np.sign(w) * (3 + 2 * np.exp(-np.abs(w) / 0.005)) + 0.05 * rng.standard_normal(t.size)
    rig = {
        "instrument": "direct_force",
        "columns": {"time": "t", "velocity": "v", "force": {"column": "F", "unit": "N"}},
    }
    found = fit_steady(measure({"t": t, "v": w + 0.006 * rng.standard_normal(t.size), "F": force}, rig))
    truth = {"kinetic": 3.0, "viscous": 0.0, "weakening": 2.0, "scale": 0.005}
    assert all(inside(found.parameters, name, value) for name, value in truth.items())
    assert found.at_rest[1:] == (0.0, np.inf)
    assert "blurs the fall, so neither its shape nor friction at rest can be told" in found.notes[0]
    assert not any("at rest (" in note for note in found.notes)
    clear = fit_steady(measure({"t": t, "v": w, "F": force}, rig))
    assert clear.chosen.startswith("Stribeck")
    assert not any("blur" in note for note in clear.notes)
    assert clear.best.at_rest(0.003)[1] < 5.0 < clear.best.at_rest(0.003)[2]
