"""Motion between events and motion files with several masses, against orbits whose truth is known."""

from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import stickslip as ss
from stickslip.identification import fit_trajectories
from stickslip.measurement import Rig, facts, measure, motion, notes, spectrum, spectrum_over_time
from stickslip.measurement.signals.smooth import jerk_spline, kalman

DRIVES = (0.2, 0.3)
STEP = 0.04
END = 26.0
RIG = Rig(instrument="displacement", column="x", unit="1", stiffness=1, mass=1, damping=0.1, drive_velocity=DRIVES[0])


@lru_cache
def orbit(drive: float) -> ss.Orbit:
    law = ss.laws.StaticKinetic(break_away=1.0, kinetic=0.6)
    return ss.simulate(ss.Oscillator(damping=0.1, drive_velocity=drive, law=law), 60.0)


@lru_cache
def film() -> xr.Dataset:
    """Two masses seen by one camera: noise, a lost point, one mass seen later than the other."""
    time = np.arange(0, END, STEP)
    rng = np.random.default_rng(5)
    x = np.stack([orbit(drive).at(time)[0] for drive in (DRIVES[0], DRIVES[0])], axis=1)
    x = x + 5e-4 * rng.standard_normal(x.shape)
    x[300:304, 0] = np.nan
    x[:50, 1] = np.nan
    data = xr.Dataset({"x": (("time", "mass"), x, {"units": "1"})}, {"time": time, "mass": ["left", "right"]})
    data["x_error"] = (("time", "mass"), np.full(x.shape, 5e-4), {"units": "1"})
    data.attrs["source"] = "film.mp4"
    return data


#: The paper's law with one f_s(0), whatever the force rate.
PAPER = ss.paper.calibration.CALIBRATIONS["one f_s(0)"]


def dropping() -> Rig:
    from dataclasses import replace

    from stickslip.measurement import Layout

    return replace(RIG, read=Layout(missing="drop"))


@pytest.mark.long
def test_all_masses_of_a_motion_are_measured(tmp_path: Path) -> None:
    film().to_netcdf(tmp_path / "motion.nc", engine="h5netcdf")
    tree = measure(tmp_path / "motion.nc", dropping())
    assert set(tree.children) == {"mass_left", "mass_right"}
    releases = orbit(DRIVES[0]).events.query("kind == 'release'")["t"].to_numpy()
    for name, first in (("mass_left", 0.0), ("mass_right", 2.0)):
        table = tree[name]["break_away"].to_dataset()
        expected = releases[(releases > first) & (releases < END - 0.5)]
        assert table.sizes["event"] == len(expected)
        np.testing.assert_allclose(table["t"], expected, atol=2 * STEP)
        np.testing.assert_allclose(table["force"], 1.0, atol=0.01)
        assert name.removeprefix("mass_") in tree[name].attrs["source"]
    assert "mass left: 4 missing samples of 'x' were left out (0.6 %)" in notes(tree)
    assert facts(tree)["right regime"] == "stick_slip"
    alone = measure(film(), dropping(), mass="right")
    np.testing.assert_array_equal(alone["force"], tree["mass_right"]["force"])


def test_lost_points_are_refused_unless_the_rig_lets_them_go() -> None:
    with pytest.raises(ss.InputError, match=r"film\.mp4, mass left: row 300, column 'x' is NaN \(4 such in all\)"):
        measure(film(), RIG, mass=0)


@pytest.mark.parametrize(
    ("mass", "words"), [(2, "mass must be 0 to 1, got 2"), ("top", "one of left, right, got 'top'")]
)
def test_a_mass_that_is_not_there_is_named(mass: int | str, words: str) -> None:
    with pytest.raises(ss.InputError, match=words):
        measure(film(), RIG, mass=mass)


def test_a_motion_in_pixels_is_no_motion_in_metres() -> None:
    pixels = film().assign(x=film()["x"].assign_attrs(units="px"))
    with pytest.raises(ss.InputError, match="'x' is in px and the rig says 1; track it with a calibration"):
        measure(pixels, dropping())


def test_an_error_that_the_scatter_contradicts_is_told() -> None:
    boasting = film().assign(x_error=film()["x_error"] / 10)
    tree = measure(boasting, dropping(), mass="left")
    assert any("good to 5e-05" in note and "the scatter was believed" in note for note in tree.attrs["notes"])


@pytest.mark.long
def test_the_error_of_the_scale_goes_from_the_film_to_the_law(tmp_path: Path) -> None:
    stated = film().assign_attrs(scale_error=1.4e-3)
    stated.to_netcdf(tmp_path / "motion.nc", engine="h5netcdf")
    tree = measure(tmp_path / "motion.nc", dropping(), mass="left")
    said = "all lengths share a relative standard error of 0.14 % (scale_error of the motion)"
    assert any(said in note for note in notes(tree))
    found = ss.identify(tree, law="StaticKinetic")
    assert any(said in note for note in found.notes)
    widened, given = fit_trajectories(found, starts=1), fit_trajectories(found, starts=1, scale_error=1.4e-3)
    assert "--scale-error 0.0014" in widened.command
    np.testing.assert_array_equal(widened.parameters["error"], given.parameters["error"])
    alone = fit_trajectories(found, starts=1, scale_error=0.0)
    assert alone.parameters.loc["kinetic", "error"] < widened.parameters.loc["kinetic", "error"]
    # nothing is said where nothing is stated
    assert not any("scale_error" in note for note in notes(measure(film(), dropping(), mass="left")))


def test_motion_of_all_masses_is_one_data_set() -> None:
    moved = motion(film(), dropping())
    assert moved["a"].dims == ("time", "mass")
    assert list(moved["mass"].values) == ["left", "right"]
    assert moved["v"].attrs["units"] == "1"
    assert np.isnan(moved["x"].sel(mass="right").values[:50]).all()


@pytest.mark.slow
def test_pieces_keep_the_jump_that_smoothers_smear() -> None:
    drive = DRIVES[0]
    time = np.arange(0, 60, STEP)
    x, v = orbit(drive).at(time)
    rng = np.random.default_rng(1)
    record = {"t": time, "x": x + 1e-3 * rng.standard_normal(len(x))}
    truth = orbit(drive).to_xarray(time)["force"].to_numpy()
    events = orbit(drive).events.query("kind in ('release', 'capture')")["t"].to_numpy()
    near = np.abs(time[:, None] - events).min(axis=1) < 0.5  # a twelfth of the own period to either side
    near[:25] = near[-25:] = False
    error, beside = {}, {}
    for method in ("pieces", "savitzky_golay", "kalman", "spline"):
        moved = motion(record, RIG, method=method)
        friction = moved["x"] + 0.1 * moved["v"] + moved["a"]
        error[method] = float(np.sqrt(np.mean((friction.values[25:-25] - truth[25:-25]) ** 2)))
        beside[method] = float(np.sqrt(np.mean((friction.values[near] - truth[near]) ** 2)))
        assert moved.attrs["cutoff"] > 0
        assert moved.attrs["method"] == method
        np.testing.assert_allclose(moved["v"].values[25:-25], v[25:-25], atol=0.08)
    assert error["pieces"] < 0.02
    # the table in docs/evidence/measuring.md: f_s is 1
    assert beside["pieces"] < 0.02
    assert 0.05 < min(beside[method] for method in beside if method != "pieces") < max(beside.values()) < 0.1
    # the generic smoothers leave much more, all of it near events
    assert min(error["savitzky_golay"], error["kalman"], error["spline"]) > 2.5 * error["pieces"]
    # and the spline is the Kalman smoother by other means
    assert error["kalman"] == pytest.approx(error["spline"], rel=0.1)


def test_a_given_cutoff_is_used_and_pieces_refuse_one() -> None:
    time = np.arange(0, 20, STEP)
    record = {"t": time, "x": orbit(DRIVES[0]).at(time)[0]}
    assert motion(record, RIG, method="savitzky_golay", cutoff=2.0).attrs["cutoff"] == 2.0
    with pytest.raises(ss.InputError, match="chooses its own cut-off"):
        motion(record, RIG, cutoff=2.0)
    with pytest.raises(ss.InputError, match="did you mean 'kalman'"):
        motion(record, RIG, method="kalmann")


@pytest.mark.parametrize("drive", [0.2, *(pytest.param(s, marks=pytest.mark.slow) for s in (0.15, 0.25))])
def test_a_film_gives_the_friction_of_the_papers_law(drive: float) -> None:
    # 63 frames a period and a tenth of a pixel where the mass moves over 200
    made = ss.simulate(PAPER.oscillator(drive), 110.0)
    time = np.arange(60, 110, 0.1)
    x = made.at(time)[0]
    noise = 1e-3 * np.ptp(x) / 2 * np.random.default_rng(0).standard_normal(len(x))
    rig = Rig(instrument="displacement", column="x", unit="1", stiffness=1, mass=1, damping=0.28, drive_velocity=drive)
    friction = measure({"t": time, "x": x + noise}, rig)
    truth = made.to_xarray(time)["force"].to_numpy()
    assert np.sqrt(np.mean((friction["force"].values - truth) ** 2)) < 0.02 * np.max(truth)
    releases = made.events.query("kind == 'release' and 60.5 < t < 109.5")
    found = friction["break_away"].to_dataset()
    found = found.isel(event=(found["t"].values > 60.5) & (found["t"].values < 109.5))
    assert found.sizes["event"] == len(releases)
    np.testing.assert_allclose(found["t"], releases["t"], atol=0.1)
    assert np.nanmedian(np.abs(found["stick_time"].values - releases["stick_time"].to_numpy())) < 0.05


@pytest.mark.parametrize("per_period", [12, 16, 25, 30, 40, 60])
def test_few_samples_per_period_do_not_make_the_motion_noise(per_period: int) -> None:
    """The likelihood of a cut-off has a valley of its own where all of the motion counts as noise."""
    phase = 2 * np.pi * np.arange(3000) / per_period
    x = np.sin(phase) + 1e-3 * np.random.default_rng(0).standard_normal(3000)
    smooth = jerk_spline(np.arange(3000) * 0.02, x)
    # a spline of knots two samples apart passes 1/(1 + (f/cutoff)^6): 0.98 of a sine of 12 samples at 0.16/step
    assert np.std(smooth.x) == pytest.approx(np.sqrt(0.5), rel=0.021)
    assert np.median(np.abs(smooth.x - np.sin(phase)) / smooth.x_error) < 1


@pytest.mark.parametrize("per_period", [12, 25])
def test_the_kalman_smoother_keeps_a_motion_of_few_samples_per_period(per_period: int) -> None:
    phase = 2 * np.pi * np.arange(600) / per_period
    x = np.sin(phase) + 1e-3 * np.random.default_rng(0).standard_normal(600)
    assert np.std(kalman(np.arange(600) * 0.02, x).x) == pytest.approx(np.sqrt(0.5), rel=0.01)


def test_a_law_of_few_samples_per_period_is_that_of_the_motion() -> None:
    """A reciprocating contact of 3 + 2 v at 25 samples a period; smoothed away, its speed was a constant."""
    t = np.arange(3000) * 0.02
    v = 0.1 + 0.05 * np.sin(2 * np.pi * 2 * t)
    random = np.random.default_rng(3)
    record = {
        "t": t,
        "v": v + 1e-3 * random.standard_normal(3000),
        "F": 3 + 2 * v + 0.02 * random.standard_normal(3000),
    }
    rig = {
        "instrument": "direct_force",
        "columns": {"time": "t", "velocity": "v", "force": {"column": "F", "unit": "N"}},
    }
    found = measure(record, rig).dataset
    slope, kinetic = np.polyfit(found.slip_velocity, found.force, 1)
    assert (kinetic, slope) == (pytest.approx(3, abs=0.02), pytest.approx(2, abs=0.1))


def test_spectra_total_and_actual() -> None:
    time = np.arange(0, 40, 0.01)
    sound = xr.DataArray(
        np.where(time < 20, np.sin(2 * np.pi * 3 * time), 0.5 * np.sin(2 * np.pi * 8 * time)),
        dims="time", coords={"time": time}, attrs={"units": "m/s^2"},
    )  # fmt: skip
    total = spectrum(sound)
    assert total["amplitude"].attrs["units"] == "m/s^2"
    lines = total["frequency"].values[total["amplitude"].values > 0.15]
    assert {round(float(line)) for line in lines} == {3, 8}
    actual = spectrum_over_time(sound, window=4.0)
    early = actual["amplitude"].sel(time=10, method="nearest")
    late = actual["amplitude"].sel(time=30, method="nearest")
    assert float(actual["frequency"].values[int(early.argmax("frequency"))]) == pytest.approx(3)
    assert float(late.max()) == pytest.approx(0.5, rel=0.02)
    with pytest.raises(ss.InputError, match="the window must be"):
        spectrum_over_time(sound, window=100.0)
