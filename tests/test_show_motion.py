"""Pictures of measured motions and of instruments: they draw what is there and refuse what is not."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import stickslip as ss
from stickslip.cli.main import main
from stickslip.measurement import Rig, measure, motion

T = np.arange(0, 40, 0.05)
RIG = Rig(instrument="displacement", column="x", unit="1", stiffness=1, mass=1, drive_velocity=0.5)


def moved() -> object:
    x = 0.4 * np.sin(T) + 1e-3 * np.random.default_rng(0).standard_normal(len(T))
    return motion({"t": T, "x": x}, RIG, method="spline")


def test_motion_is_drawn_with_its_bands() -> None:
    axes = ss.show.motion_plot(moved(), window=(5, 20))
    names = ["displacement x", "velocity v", "acceleration a"]
    assert [ax.get_ylabel() for ax in axes] == [f"{name} (dimensionless)" for name in names]
    assert len(axes[0].lines[0].get_xdata()) == 300
    assert ss.show.motion_phase(moved()).get_xlabel() == "displacement x (dimensionless)"
    total, actual = ss.show.spectra_plot(moved()["a"])
    assert (total.get_title(), actual.get_title()) == ("spectrum of the record", "spectrum over time")
    assert (total.get_xlabel(), actual.get_xlabel()) == ("frequency", "time")  # the record has no units
    with pytest.raises(ss.InputError, match="holds no samples"):
        ss.show.motion_plot(moved(), window=(50, 60))
    with pytest.raises(ss.InputError, match="one mass was expected, got 1"):
        ss.show.motion_phase(moved().expand_dims("mass"))


def test_a_motion_is_drawn_on_one_page() -> None:
    axes = ss.show.motion_figure(moved())
    assert len({ax.figure for ax in axes}) == 1
    names = ["displacement x", "velocity v", "acceleration a", "velocity v"]
    assert [ax.get_ylabel() for ax in axes[:4]] == [f"{name} (dimensionless)" for name in names]
    short = moved().isel(time=slice(0, 10))
    assert "16 samples" in ss.show.motion_figure(short)[-1].texts[0].get_text()


def test_measure_writes_and_draws_the_motion(tmp_path: Path) -> None:
    np.savetxt(
        tmp_path / "record.csv", np.stack([T, 0.4 * np.sin(T)], axis=1), delimiter=",", header="t,x", comments=""
    )
    (tmp_path / "rig.toml").write_text(RIG.to_toml())
    argv = ["measure", tmp_path / "record.csv", "--rig", tmp_path / "rig.toml", "--method", "spline"]
    argv += ["--motion", tmp_path / "motion.nc", "--plot-motion", tmp_path / "motion.png"]
    assert main([str(word) for word in argv]) == 0
    with xr.open_dataset(tmp_path / "motion.nc", engine="h5netcdf") as found:
        np.testing.assert_allclose(found["a"][50:-50], -0.4 * np.sin(T)[50:-50], atol=0.01)
    assert (tmp_path / "motion.png").stat().st_size > 20_000


def test_gauges_without_velocity_are_drawn_as_tables() -> None:
    force = np.where(T % 5 < 4, T % 5, 0.2)
    log = measure(
        {"t": T, "f": force}, {"instrument": "force_log", "least_drop": 0.3, "columns": {"time": "t", "force": "f"}}
    )
    _, law = ss.show.friction_record(log)
    assert law.get_xscale() == "linear"  # rests of one length
    observer = {"instrument": "torque_observer", "columns": {"time": "t", "velocity": "w", "torque": "q"}}
    runs = [{"t": T, "w": np.full(len(T), w) + 1e-3 * np.sin(9 * T), "q": np.sin(T) + w} for w in (0.1, 0.3)]
    (ax,) = ss.show.friction_record(measure(runs, observer))
    assert "rad/s" in ax.get_xlabel()


@pytest.mark.slow
def test_several_masses_get_a_picture_each(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    law, t = ss.laws.StaticKinetic(break_away=1.0, kinetic=0.6), np.arange(0, 25, 0.1)
    x = [ss.simulate(ss.Oscillator(damping=d, drive_velocity=0.3, law=law), 25.0).at(t)[0] for d in (0.05, 0.2)]
    both = xr.Dataset({"x": (("time", "mass"), np.stack(x, axis=1), {"units": "1"})}, {"time": t, "mass": [0, 1]})
    both.to_netcdf(tmp_path / "motion.nc", engine="h5netcdf")
    (tmp_path / "rig.toml").write_text(
        'instrument = "displacement"\ncolumn = "x"\nunit = "1"\nstiffness = 1\nmass = 1\ndrive_velocity = 0.3\n'
    )
    given = [str(tmp_path / "motion.nc"), "--rig", str(tmp_path / "rig.toml")]
    drawn = ["--plot", str(tmp_path / "force.png"), "--plot-motion", str(tmp_path / "motion.png")]
    assert main(["measure", *given, *drawn]) == 0
    names = ["force-0.png", "force-1.png", "motion-0.png", "motion-1.png"]
    assert sorted(path.name for path in tmp_path.glob("*.png")) == names
    said = capsys.readouterr().out
    assert all(name in said for name in names)
    assert main(["measure", *given, "--mass", "1", "--plot", str(tmp_path / "one.png")]) == 0
    assert (tmp_path / "one.png").exists()


def test_a_drive_that_holds_its_speeds_is_drawn_by_its_holds() -> None:
    speed = np.repeat([1.0, 20.0], [len(T) // 2, len(T) - len(T) // 2])
    record = {"t": T, "x": np.cumsum(speed) * T[1], "f": 0.6 + 0.01 * np.log(speed) + 1e-4 * np.sin(9 * T)}
    columns = {"time": "t", "displacement": {"column": "x", "unit": "um"}, "force": {"column": "f", "unit": "1"}}
    over_time, _, holds = ss.show.friction_record(measure(record, {"instrument": "velocity_steps", "columns": columns}))
    assert over_time.get_xlim() == (T[0], T[-1])
    assert holds.get_xscale() == "log"
    np.testing.assert_allclose(holds.lines[0].get_xdata(), [1e-6, 20e-6], rtol=0.02)
    same = measure({**record, "x": 3.0 * T}, {"instrument": "velocity_steps", "columns": columns})
    low, high = ss.show.friction_record(same)[2].get_xlim()
    assert low == 0
    assert high == pytest.approx(6e-6)
