"""Other instruments on real records: each rig that ships as an example gives the numbers known for its data."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from real_records import RIGS, measured

import stickslip as ss
from stickslip.measurement import INSTRUMENTS, facts, load_rig, measure, summary

KIP = 4448.2216
RPM = np.pi / 30


def notes(friction: xr.DataTree) -> str:
    return "\n".join(friction.attrs["notes"])


def test_pendulum_loses_a_constant_angle_per_cycle(shared_data: Path) -> None:
    f = measured(shared_data, "single_pendulum", "single_pendulum/*.mat")
    cycle = f["cycle"].to_dataset()
    amplitude, loss = cycle["amplitude"].values, cycle["loss"].values
    assert amplitude[0] == pytest.approx(1.62, abs=0.01)
    assert amplitude[-1] == pytest.approx(0.25, abs=0.03)
    for at, expected in ((1.6, 0.052), (1.2, 0.030), (0.93, 0.0219), (0.72, 0.0166), (0.55, 0.0137), (0.25, 0.012)):
        near = np.argsort(np.abs(amplitude - at))[:3]
        assert loss[near].mean() == pytest.approx(expected, rel=0.1)
    # tau_c = 5.9e-4 N m; a viscous term would do nearly as well with half of it
    assert f.attrs["force"] == pytest.approx(5.9e-4, rel=0.1)
    assert 1e-4 < f.attrs["force_error"] < 4e-4
    assert "Coulomb torque by model" in notes(f)


def test_pendulum_on_a_cart_has_coulomb_friction(shared_data: Path) -> None:
    f = measured(shared_data, "cart_pendulum_decay", "cart_pendulum/test1pend1.csv")
    # published .0041 N m with a viscous term; our total loss per cycle corresponds to .0055 to .0067 N m
    assert abs(f.attrs["force"] - 0.0041) < 2 * f.attrs["force_error"]
    middle = (f["cycle"]["amplitude"].values < 1.7) & (f["cycle"]["amplitude"].values > 0.7)
    assert 0.0053 < np.median(f["steady"]["force"].values[middle]) < 0.0067


def test_cart_friction_hangs_on_one_sample_and_says_so(shared_data: Path) -> None:
    f = measured(shared_data, "cart_pendulum", "cart_pendulum/cartTest2_0m*.csv")
    assert f.attrs["best_delay"] == pytest.approx(-0.00667, abs=1e-5)
    assert f.attrs["mass"] == pytest.approx(6.9, rel=0.06)
    assert f.attrs["forward_force"] == pytest.approx(0.7, abs=0.2)
    assert f.attrs["backward_force"] == pytest.approx(1.1, abs=0.2)
    assert f.attrs["drive"] == pytest.approx(13.3, abs=0.1)
    assert f.attrs["force"] - f.attrs["force_error"] == pytest.approx(0.8, abs=0.2)
    assert f.attrs["force"] + f.attrs["force_error"] == pytest.approx(2.7, abs=0.2)
    assert "friction hangs on a one-sample delay (6.67 ms) and on the mass" in notes(f)


def test_crane_joins_the_clocks_of_camera_and_gauge(shared_data: Path) -> None:
    f = measured(shared_data, "crane_trolley", "crane_trolley/x_friction_slow.csv")
    assert f.attrs["force"] == pytest.approx(20, abs=1)
    assert float(f["slip_velocity"].quantile(0.5)) == pytest.approx(0.15, abs=0.05)
    assert "14 s as the rig says; it is 13." in notes(f)


def test_crane_clocks_are_joined_without_being_told(shared_data: Path, tmp_path: Path) -> None:
    text = (RIGS / "crane_trolley.toml").read_text().splitlines()
    rig = tmp_path / "rig.toml"
    rig.write_text("\n".join(line for line in text if not line.startswith("clock_offset")))
    f = measure(shared_data / "crane_trolley" / "x_friction_slow.csv", rig)
    assert "this was used" in notes(f)
    assert f.attrs["force"] == pytest.approx(20, abs=1)


@pytest.mark.slow
def test_seal_friction_is_half_the_loop(shared_data: Path) -> None:
    f = measured(shared_data, "pneumatic_seal_o_ring", "pneumatic_seal/O-ring257_*.csv", "pneumatic_seal/rerun*.csv")
    steady = f["steady"].to_dataset()
    np.testing.assert_allclose(steady["forward_force"][:4], [5.97, 7.82, 9.42, 9.97], atol=0.02)
    np.testing.assert_allclose(steady["backward_force"][:4], [-3.53, -4.08, -5.07, -6.11], atol=0.02)
    np.testing.assert_allclose(steady["force"], [4.75, 5.95, 7.25, 8.04, 5.16, 5.78, 7.14], atol=0.02)
    np.testing.assert_allclose(steady["outward_velocity"][[0, 3]], [13.4e-3, 6.7e-3], atol=1e-4)
    assert ((steady["inward_velocity"] < -13.8e-3) & (steady["inward_velocity"] > -15e-3)).all()
    np.testing.assert_allclose(steady["pressure"][:4] / 1e5, [1, 3, 5, 7], rtol=0.03)
    # the error is the one between runs, not the one within
    np.testing.assert_allclose(steady["force_error"], 1.0, atol=0.1)
    assert f.attrs["in_run_deviation"] == pytest.approx(0.3, abs=0.05)
    kdn = measured(shared_data, "pneumatic_seal_kdn", "pneumatic_seal/KDN_*.csv")
    np.testing.assert_allclose(kdn["steady"]["force"], [5.63, 5.74, 6.29, 7.02], atol=0.01)


def test_drill_string_sticks_and_has_a_loop(shared_data: Path) -> None:
    f = measured(shared_data, "drillstring", "drillstring/*.csv")
    assert f.attrs["regime"] == "stick_slip"
    assert f.attrs["main_line"] == pytest.approx(2.69, abs=0.05)
    assert f.attrs["stuck_share"] == pytest.approx(0.13, abs=0.01)
    late = f["time"].values >= 25
    slow = np.abs(f["slip_velocity"].values) < 5 * np.pi / 30
    assert slow[late].mean() == pytest.approx(0.38, abs=0.01)
    # a stick is over before the bit is that fast again
    assert 0.35 < f["stuck"].values[late].mean() < slow[late].mean()
    assert f.attrs["lowest_speed"] / RPM == pytest.approx(-4, abs=1)
    assert f.attrs["highest_speed"] / RPM == pytest.approx(200, abs=1)
    assert (f.attrs["lowest_force"], f.attrs["highest_force"]) == (
        pytest.approx(0.45, abs=0.01),
        pytest.approx(3.97, abs=0.01),
    )
    assert f.attrs["forward_force"] == pytest.approx(1.5, abs=0.1)
    assert 2.8 < float(f["break_away"]["force"].median()) < 3.9
    assert "drop-outs in 3.6 %" in notes(f)
    loop = f["steady"].to_dataset()
    up, down = loop["branch"].values == "speeding_up", loop["branch"].values == "slowing_down"
    fast = loop["slip_velocity"].values > 5
    assert loop["force"].values[up & fast].mean() - loop["force"].values[down & fast].mean() > 0.3
    # velocity weakening
    assert np.polyfit(loop["slip_velocity"].values[up], loop["force"].values[up], 1)[0] < 0


def test_robot_joint_survives_inf_and_gives_its_stribeck_curve(shared_data: Path) -> None:
    f = measured(shared_data, "robot_joint_kinova", "robot_joint_kinova/velocity_*.csv")
    steady = f["steady"].to_dataset()
    np.testing.assert_allclose(steady["force"], [-1.69, -1.79, -1.79, -2.10, -2.56], atol=0.02)
    assert steady["force_deviation"].values[0] == pytest.approx(0.28, abs=0.01)
    assert (steady["force_deviation"].values[2:] < 0.16).all()
    assert list(steady["regime"].values) == ["stick_slip", "almost_harmonic"] + ["stable_slip"] * 3
    assert "1 row with a missing value was left out (column 7)" in notes(f)


def test_inf_without_leave_is_refused_with_its_place(shared_data: Path, tmp_path: Path) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text((RIGS / "robot_joint_kinova.toml").read_text().replace('missing = "drop"', ""))
    with pytest.raises(ss.InputError, match=r"readings\.csv: row 1, column '7' is infinity \(1 such in all\)"):
        measure(shared_data / "robot_joint_kinova" / "velocity_0.030000readings.csv", rig)


def test_robot_torque_has_an_offset(shared_data: Path) -> None:
    f = measured(shared_data, "robot_joint_nnfm", "robot_joint_nnfm/franka*.csv")
    assert f.attrs["offset"] == pytest.approx(-0.17, abs=0.02)
    assert f.attrs["force"] == pytest.approx(0.36, abs=0.08)


@pytest.mark.slow
def test_friction_damper_in_inches_and_kips(shared_data: Path) -> None:
    f = measured(shared_data, "friction_damper", "friction_damper/dataset1_*.json")
    levels = f["levels"].to_dataset()
    np.testing.assert_allclose(levels["forward_force"] / KIP, [1.03, 2.13, 2.44, 2.43], atol=0.015)
    np.testing.assert_allclose(levels["backward_force"] / KIP, [-0.84, -1.97, -2.11, -2.36], atol=0.06)
    np.testing.assert_allclose(levels["peak_force"][1:] / KIP, 2.9, atol=0.35)
    # friction goes with what the actuators pull, not with the tension in the files' names (20, 35, 35 and 70 lb)
    half = (levels["forward_force"] - levels["backward_force"]) / 2
    np.testing.assert_allclose(half / levels["actuator_force"], 2.95, rtol=0.12)
    nominal = half.values / [20, 35, 35, 70]
    assert np.ptp(nominal) > 0.5 * nominal.mean()
    # at one speed the force differs between speeding up and slowing down
    loop = f["steady"].to_dataset()
    assert set(loop["branch"].values) == {"speeding_up", "slowing_down"}


def test_slow_force_log_gives_its_break_aways(shared_data: Path) -> None:
    f = measured(shared_data, "spring_slider_camera", "spring_slider_camera/Force7_rows*.txt")
    table = f["break_away"].to_dataset()
    assert table.sizes["event"] == pytest.approx(70, abs=2)
    # the README states what was read, before what the log misses at 4 Hz is added
    missed = table["force_rate"].clip(min=0).values / 4
    force, drop = table["force"].values - missed / 2, table["drop"].values - missed
    assert force.mean() == pytest.approx(11.43, abs=0.05)
    assert force.std(ddof=1) == pytest.approx(0.84, abs=0.03)
    assert drop.mean() == pytest.approx(3.04, abs=0.02)
    assert drop.std(ddof=1) == pytest.approx(1.35, abs=0.03)
    assert f.attrs["recurrence"] == pytest.approx(7.06, abs=0.02)
    assert f.attrs["force_rate"] == pytest.approx(0.485, abs=0.01)
    known = np.isfinite(table["stick_time"].values)
    logarithm = np.log10(table["stick_time"].values[known] - 1 / 4)
    assert np.polyfit(logarithm, force[known], 1)[0] == pytest.approx(2.8, abs=0.1)
    assert f.attrs["force_per_decade"] == pytest.approx(2.8, abs=0.2 * f.attrs["force_per_decade_error"])
    assert f.attrs["correlation"] == pytest.approx(0.43, abs=0.02)
    # the drops seen on the film
    np.testing.assert_allclose(table["t"].values[:2], [37.75, 42.5], atol=0.3)


@pytest.mark.parametrize("period", [20.0001, 20.37])
def test_a_slow_log_adds_what_it_misses_of_each_peak(period: float) -> None:
    rng = np.random.default_rng(5)
    found = []
    for _ in range(20):
        t = np.arange(rng.uniform(), 380, 1.0)
        force = 0.3 * ((t + rng.uniform(0, 20)) % period) + 0.02 * rng.standard_normal(t.size)
        rig = {"instrument": "force_log", "least_drop": 1.0, "columns": {"time": "t", "force": "f"}}
        f = measure({"t": t, "f": force}, rig)
        assert "force_per_decade" not in f.attrs  # the sticks are equal
        table = f["break_away"].to_dataset()
        constant = ss.identify(f).fits["constant"].parameters.iloc[0]
        means = [float(np.nanmean(table[name])) for name in ("drop", "stick_time")]
        found.append([constant["value"], constant["low"], constant["high"], *means])
    value, low, high, drop, stick_time = np.transpose(found)
    truth = 0.3 * period
    assert np.count_nonzero((low < truth) & (truth < high)) >= 18
    assert np.median(high - low) < 0.45
    assert value.mean() == pytest.approx(truth, abs=0.06)
    assert drop.mean() == pytest.approx(truth, abs=0.02)
    assert stick_time.mean() == pytest.approx(period, abs=0.1)


def test_the_film_of_a_spring_is_joined_to_the_log_of_its_force(shared_data: Path, tmp_path: Path) -> None:
    folder = shared_data / "spring_slider_camera"
    if not folder.exists():
        pytest.skip("no spring_slider_camera")
    pytest.importorskip("cv2")
    log = tmp_path / "Force7_rows0000-2119.txt"
    log.write_bytes((folder / log.name).read_bytes())
    ss.track(
        folder / "frames", RIGS.parent / "tracks" / "spring_slider_camera.toml", output=tmp_path / f"{log.stem}_film.nc"
    )
    f = measure(log, RIGS / "spring_slider_film.toml")
    # README: the clocks agree within ~0.5 s, the spring has about 4.7 N/cm (all the pull over all the instrument's way)
    assert f.attrs["clock_offset"] == pytest.approx(-1.37, abs=0.08)
    assert 0.05 < f.attrs["clock_offset_error"] < 0.15
    assert f.attrs["spring_stiffness"] == pytest.approx(470, rel=0.15)
    assert f.attrs["spring_residual"] < 0.06
    # the slip between 36 and 38 s
    start, end = 37.75, 38.0
    assert f["break_away"]["t"].values[0] == start
    slip = f["film"].to_dataset(inherit=False)
    before = int(np.searchsorted(slip["t"].values, start)) - 1
    assert 36 < slip["t"].values[before] < start < end < slip["t"].values[before + 1] < 39
    assert float(slip["displacement"][before + 1] - slip["displacement"][before]) == pytest.approx(0.56e-2, abs=0.02e-2)
    assert "the slip at 37.75 to 38 s is on the film between the pictures of 36.63 and 38.63 s" in notes(f)


def test_a_log_wants_both_ends_of_its_spring_in_metres(tmp_path: Path) -> None:
    t = np.arange(0, 60, 0.25)
    (tmp_path / "log.txt").write_text("\n".join(f"{0.3 * s - 2.0 * (s > 41):.4f}" for s in t))
    film = np.arange(0.0, 50, 2)
    x = np.stack([0.004 * (film > 42.1), 0.001 * film], axis=1)
    pixels = {"units": "px"}
    motion = xr.Dataset({"x": (("time", "mass"), x, pixels)}, {"time": film, "mass": [0, 1]})
    motion.to_netcdf(tmp_path / "film.nc", engine="h5netcdf")
    rig = {
        "instrument": "force_log",
        "least_drop": 0.3,
        "sampling_rate": 4,
        "read": {"header": False},
        "columns": {"force": 1},
        "companion": {"file": "film.nc", "columns": {"time": "time", "displacement": "x(0)"}},
    }
    with pytest.raises(ss.InputError, match=r"displacement .*got 'px'|'px'"):
        measure(tmp_path / "log.txt", load_rig(rig))
    motion["x"].attrs["units"] = "m"
    motion.to_netcdf(tmp_path / "film.nc", engine="h5netcdf")
    with pytest.raises(ss.InputError, match="must hold the spring's two ends"):
        measure(tmp_path / "log.txt", load_rig(rig))
    rig["companion"]["columns"]["drive_displacement"] = "x(1)"
    f = measure(tmp_path / "log.txt", load_rig(rig))
    assert f.attrs["clock_offset"] == pytest.approx(-1.1, abs=2 * f.attrs["clock_offset_error"])
    rig["clock_offset"] = "-20 s"
    assert "contradicts the records" in notes(measure(tmp_path / "log.txt", load_rig(rig)))
    rig["companion"]["columns"] |= {"displacement": "x(1)", "drive_displacement": "x(0)"}
    with pytest.raises(ss.InputError, match="grows with its extension at no offset"):
        measure(tmp_path / "log.txt", load_rig(rig))


@pytest.mark.parametrize(
    ("ratio", "words"), [(1.13, "which no creep explains"), (0.85, "is creep and small slips"), (1.0, "velocity")]
)
def test_a_loading_rate_is_laid_beside_the_rig(ratio: float, words: str) -> None:
    t = np.arange(0, 400, 0.25)
    noise = 0.002 * np.random.default_rng(0).standard_normal(t.size)
    rig = {"instrument": "force_log", "least_drop": 0.3, "stiffness": "470 N/m", "drive_velocity": "1.2 mm/s"}
    record = {"t": t, "f": 5 + ratio * 0.47 * 1.2 * (t % 9) + noise}
    f = measure(record, load_rig(rig | {"columns": {"time": "t", "force": "f"}}))
    said = next(note for note in f.attrs["notes"] if "loading rate" in note)
    assert words in said
    assert (ratio == 1.0) == said.endswith(words)  # nothing is explained where nothing is missing
    assert f.attrs["stiffness"] == 470


def test_rock_is_measured_at_every_speed_and_load(shared_data: Path) -> None:
    f = measured(shared_data, "rock_biax_p446", "rock_biax_p446/p446s7tr005l")
    holds = f["steady"].to_dataset(inherit=False)
    load = holds["normal_force"].values / 1e6
    for normal in (4.96, 9.96, 14.96, 19.95):
        here = np.flatnonzero(np.abs(load - normal) < 0.02)
        assert len(here) == 12  # the run-in at 10 um/s, then eleven speeds
        speed = holds["slip_velocity"].values[here[1:]] * 1e6
        np.testing.assert_allclose(speed, [1, 3, 10, 30, 100, 300, 100, 30, 10, 3, 1], rtol=0.025)
        if normal == 9.96:
            known = [0.5764, 0.5779, 0.5775, 0.5785, 0.5809, 0.5824, 0.5798, 0.5806, 0.5813, 0.5812, 0.5802]
            apart = np.abs(holds["force"].values[here[1:]] - known)
            assert (apart < 2.5 * holds["force_error"].values[here[1:]]).all()
            assert apart.max() < 0.002
    # velocity strengthening by ~ .001 per e-fold, with a slow drift
    assert 0.0005 < f.attrs["a_minus_b"] < 0.0015
    # every step up in speed jumps up at first, every step down down
    assert (f["step"]["direct_effect"].values > 0).all()


def test_basalt_jumps_and_comes_back(shared_data: Path) -> None:
    f = measured(shared_data, "rock_velocity_steps", "rock_velocity_steps/*.txt")
    step = f["step"].to_dataset(inherit=False).isel(step=0)
    assert float(step["velocity_before"]) * 1e6 == pytest.approx(3.00, abs=0.01)
    assert float(step["velocity_after"]) * 1e6 == pytest.approx(10.01, abs=0.1)
    at = np.interp(float(step["t"]), f["time"].values, f["displacement"].values)
    assert at * 1e6 == pytest.approx(8714, abs=5)
    assert float(step["force_before"]) == pytest.approx(0.6085, abs=0.001)
    assert float(step["peak_force"]) == pytest.approx(0.619, abs=0.0015)
    assert float(step["force_after"]) == pytest.approx(0.6084, abs=0.0005)
    assert float(step["a_minus_b"]) == pytest.approx(0.0, abs=0.0005)
    assert abs(float(step["a_minus_b"])) < 2 * float(step["a_minus_b_error"])
    # .0105 over ln(10.01 / 3.00)
    assert abs(float(step["direct_effect"]) - 0.0105 / np.log(10.01 / 3)) < 2 * float(step["direct_effect_error"])


def test_a_list_of_slips_gives_strength_over_waiting_time(shared_data: Path) -> None:
    f = measured(shared_data, "rock_4m_events", "rock_4m_events/Macroscopic*.csv")
    table = f["break_away"].to_dataset()
    assert table.sizes["event"] == 56
    assert float(table["t"][-1] - table["t"][0]) == pytest.approx(216, abs=1)
    assert (f.attrs["lowest_force"] / 1e6, f.attrs["highest_force"] / 1e6) == (
        pytest.approx(0.643, abs=0.001),
        pytest.approx(0.687, abs=0.001),
    )
    assert float(table["drop"].median()) / 1e6 == pytest.approx(0.019, abs=0.0005)
    assert (float(table["drop"].min()) / 1e6, float(table["drop"].max()) / 1e6) == (
        pytest.approx(0.014, abs=0.0005),
        pytest.approx(0.055, abs=0.0005),
    )
    assert (f.attrs["lowest_slip"] * 1e3, f.attrs["highest_slip"] * 1e3) == (
        pytest.approx(0.029, abs=0.0006),
        pytest.approx(0.095, abs=0.0005),
    )
    # stronger the longer it waited
    assert f.attrs["force_per_decade"] > 3 * f.attrs["force_per_decade_error"]


def test_holds_at_constant_speed_are_found_and_their_friction_is_unbiased() -> None:
    rng = np.random.default_rng(3)
    speeds = np.repeat([2.0, 10.0, 5.0], 400)
    time = 0.05 * np.arange(1200)
    x = np.cumsum(0.05 * speeds) + 0.01 * rng.standard_normal(1200)
    since = np.concatenate([np.arange(400)] * 3) * 0.05 * speeds  # path since the step
    jump = 0.02 * np.log(np.concatenate([np.ones(400), np.full(400, 5.0), np.full(400, 0.5)]))
    friction = 0.6 + 0.005 * np.log(speeds) + jump * np.exp(-since / 12) + 5e-4 * rng.standard_normal(1200)
    rig = {
        "instrument": "velocity_steps",
        "columns": {"time": "t", "displacement": "x", "force": {"column": "f", "unit": "1"}},
    }
    f = measure({"t": time, "x": x, "f": friction}, rig)
    np.testing.assert_allclose(f["steady"]["slip_velocity"], [2, 10, 5], rtol=0.01)
    np.testing.assert_allclose(f["step"]["a_minus_b"], 0.005, atol=4e-4)
    np.testing.assert_allclose(f["step"]["direct_effect"], 0.025, atol=0.005)


@pytest.mark.parametrize(
    ("columns", "changes", "words"),
    [
        ({"x": np.zeros(64)}, {}, "no stretch of constant speed above least_speed = 0"),
        ({"n": np.linspace(1, -1, 64)}, {}, "the normal force is -0.01587 at 3.2 s, where it must be positive"),
        ({}, {"instrument": "event_list"}, "an event_list needs a column of drop or of force_after"),
    ],
)
def test_what_holds_and_lists_cannot_use_is_refused(
    columns: dict[str, np.ndarray], changes: dict[str, object], words: str
) -> None:
    record = {"t": np.arange(64) / 10, "x": np.arange(64.0), "f": np.ones(64), "n": np.ones(64)} | columns
    named = {"time": "t", "displacement": "x", "force": {"column": "f", "unit": "N"}, "normal_force": "n"}
    if changes:
        named = {"time": "t", "force": "f"}
    with pytest.raises(ss.InputError) as caught:
        measure(record, {"instrument": "velocity_steps", "columns": named} | changes)
    assert words in str(caught.value)


def test_every_gauge_has_an_example_rig() -> None:
    text = "\n".join(path.read_text() for path in RIGS.glob("*.toml"))
    for name in INSTRUMENTS:
        assert f'instrument = "{name}"' in text


def test_a_measured_gauge_survives_a_file(shared_data: Path, tmp_path: Path) -> None:
    f = measured(shared_data, "drillstring", "drillstring/*.csv")
    f.to_netcdf(tmp_path / "f.nc", engine="h5netcdf")
    with xr.open_datatree(tmp_path / "f.nc", engine="h5netcdf") as back:
        np.testing.assert_array_equal(back["force"], f["force"])
        assert facts(back) == facts(f)
        assert list(back["steady"]["branch"].values) == list(f["steady"]["branch"].values)


def test_runs_of_a_cylinder_at_unlike_speeds_are_no_repetitions(tmp_path: Path) -> None:
    """Friction that depends on speed is no scatter between runs, and one stroke and its return have an error too."""
    (tmp_path / "rig.toml").write_text(
        'instrument = "cylinder"\nbore = 0.05\nrange = [0.01, 0.09]\n[columns]\n'
        + "".join(f'{name} = "{name}"\n' for name in ("time", "displacement", "pressure", "force"))
    )
    rig = load_rig(tmp_path / "rig.toml")

    def run(speed: float, back: bool = True) -> dict[str, np.ndarray]:
        way = np.linspace(0, 2 if back else 0.98, 400)
        force = np.where(way < 1, 1.0, -1.0) * (100 + 1000 * speed) + np.random.default_rng(1).normal(0, 1, way.size)
        return {
            "time": way * 0.1 / speed,
            "displacement": 0.1 * (1 - abs(1 - way)),
            "pressure": 0 * way,
            "force": force,
        }

    one = measure([run(speed) for speed in (0.01, 0.02, 0.04)], rig)
    assert np.allclose(one["steady"].force, [110, 120, 140], atol=0.5)
    assert (one["steady"].force_error < 0.5).all()
    two = measure([run(speed) for speed in (0.01, 0.0101, 0.04)], rig)
    assert any("over 2 runs repeated at one pressure and one speed" in note for note in ss.measurement.notes(two))
    with pytest.raises(ss.InputError, match="every whole stroke goes out"):
        measure(run(0.01, back=False), rig)


def swinging(sign: float, one_way: bool) -> dict[str, np.ndarray]:
    """Position and motor current of a mass of 5 under friction of 6, whose motor gives 2 a unit of current."""
    t = np.arange(0, 20, 0.01)
    x = 0.2 * t - 0.05 * np.cos(2 * t) if one_way else 0.3 * np.sin(1.3 * t)
    v, a = np.gradient(x, t), np.gradient(np.gradient(x, t), t)
    noise = 0.02 * np.random.default_rng(3).standard_normal(t.size)
    return {"t": t, "x": x, "i": sign * ((5 * a + 6 * np.sign(v)) / 2 + noise)}


def test_motor_current_of_one_direction_or_of_the_wrong_sign_is_refused() -> None:
    columns = {"time": "t", "displacement": "x", "current": "i"}
    rig = {"instrument": "motor_current", "force_per_current": 2.0, "least_speed": 0.01, "columns": columns}
    good = ss.measure(swinging(1.0, False), rig)
    assert good.attrs["force"] == pytest.approx(6, abs=0.2)
    with pytest.raises(
        ss.InputError, match="100 % of the motion is one way, so friction and inertia cannot be separated"
    ):
        ss.measure(swinging(1.0, True), rig)
    with pytest.raises(ss.InputError, match="give the column of one of them sign = -1"):
        ss.measure(swinging(-1.0, False), rig)


def test_a_list_of_slips_whose_force_rises_is_refused() -> None:
    columns = {"time": "t", "force": {"column": "f", "unit": "N"}, "drop": {"column": "d", "unit": "N"}}
    record = {"t": np.arange(40.0), "f": np.full(40, 5.0), "d": np.full(40, 1.0) - 2.0 * (np.arange(40) == 3)}
    with pytest.raises(ss.InputError, match="slip 4 has a drop of -1, and 1 of 40 are not above 0"):
        ss.measure(record, {"instrument": "event_list", "columns": columns})


def decay(kinetic: float, viscous: float, scale: float = 1.0, quadratic: float = 0.0) -> dict[str, np.ndarray]:
    """A pendulum of m g l = 0.2 N m and I = 0.005 kg m^2 that swings out from 1.5 rad, by steps of Runge and Kutta."""
    step, inner = 0.01, 10
    state, rows = np.array([1.5, 0.0]), []

    def rate(s: np.ndarray) -> np.ndarray:
        friction = np.sign(s[1]) * (kinetic + quadratic * s[1] ** 2) + viscous * s[1]
        return np.array([s[1], (-0.2 * np.sin(s[0]) - friction) / 0.005])

    for _ in range(1500):
        rows.append(state[0])
        for _ in range(inner):
            h = step / inner
            a = rate(state)
            b = rate(state + h / 2 * a)
            c = rate(state + h / 2 * b)
            state = state + h / 6 * (a + 2 * b + 2 * c + rate(state + h * c))
    angle = np.array(rows) + 1e-4 * np.random.default_rng(0).standard_normal(1500)
    return {"t": step * np.arange(1500), "a": scale * angle}


DECAY = {"instrument": "free_decay", "restoring_torque": 0.2, "columns": {"time": "t", "angle": "a"}}


@pytest.mark.parametrize(
    ("kinetic", "words"), [(0.0, "rad per cycle, which is not told from zero"), (3e-3, "not to zero")]
)
def test_a_decay_says_whether_its_loss_is_told_from_zero(kinetic: float, words: str) -> None:
    found = ss.measure(decay(kinetic, 2e-4), DECAY)
    told = next(note for note in found.attrs["notes"] if "it tends to" in note)
    assert told.endswith(words)
    assert abs(found.attrs["force"] - kinetic) < 2 * found.attrs["force_error"] + 1e-4


def test_a_decay_tells_the_drag_of_its_model_in_units_of_a_torque() -> None:
    found = ss.measure(decay(1e-3, 0.0, quadratic=2e-4), DECAY)
    assert found.attrs["model"] == "Coulomb + quadratic drag"
    told = summary(found)
    assert "viscous" not in told
    assert told["quadratic"].endswith(" N m s^2/rad^2")
    assert told["force"].endswith(" N m")
    assert told["greatest_torque"].endswith(" N m")
    viscous = ss.measure(decay(1e-3, 1e-3), DECAY)
    assert summary(viscous)["viscous"].endswith(" N m s/rad")
    assert "quadratic" not in viscous.attrs


def test_the_drag_of_a_decay_is_found_from_means_over_swings() -> None:
    found = ss.identify(ss.measure(decay(1e-3, 0.0, quadratic=2e-4), DECAY)).parameters.loc["quadratic"]
    assert found["low"] < 2e-4 < found["high"]
    assert found["value"] == pytest.approx(2e-4, rel=0.01)  # <w^2> is 8 % more than <|w|>^2


def test_swings_beyond_half_a_turn_ask_for_the_unit() -> None:
    record = decay(3e-3, 2e-4, scale=180 / np.pi)
    with pytest.raises(ss.InputError, match=r"larger than half a turn, .* is the angle in degrees\?"):
        ss.measure(record, DECAY)
    found = ss.measure(record, DECAY | {"columns": {"time": "t", "angle": {"column": "a", "unit": "deg"}}})
    assert found.attrs["force"] == pytest.approx(3e-3, rel=0.1)
