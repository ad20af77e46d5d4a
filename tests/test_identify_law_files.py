"""Law files of every way through ``stickslip identify``: the formula that was fitted, its covariance, a law that moves."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import stickslip as ss
from stickslip.cli.main import main
from stickslip.identification import fit_steady, friction_of_orbit
from stickslip.laws.numbers import value, with_values

W = np.concatenate([np.geomspace(0.02, 0.8, 16), -np.geomspace(0.02, 0.8, 16)])
SPEED = np.abs(W)
CURVES = {
    "Coulomb": (0.7 + 0 * SPEED, "Coulomb"),
    "Coulomb + viscous": (0.7 + 0.4 * SPEED, "PiecewiseLinear"),
    "Coulomb + quadratic": (0.7 + 0.5 * SPEED**2, "PoppStelter"),
    "logarithmic": (0.7 + 0.03 * np.log(SPEED / 0.1), "Tabulated"),
    "Stribeck": (0.5 + 0.3 * np.exp(-SPEED / 0.09) + 0.2 * SPEED, "ExponentialStribeck"),
    "Gaussian Stribeck": (0.5 + 0.3 * np.exp(-((SPEED / 0.09) ** 2)) + 0.2 * SPEED, "ExponentialStribeck"),
}


def table(w, force, error=0.003):
    columns = {"slip_velocity": w, "force": force, "force_error": np.full(len(w), error)}
    return xr.DataTree.from_dict({"/steady": xr.Dataset({name: ("row", column) for name, column in columns.items()})})


def moves(law):
    """A law read from a file sets a mass in motion, and friction in it is finite."""
    orbit = ss.simulate(ss.Oscillator(damping=0.1, drive_velocity=0.3, law=law), 20.0)
    assert np.isfinite(orbit.to_xarray(np.linspace(0, 20, 50))["force"]).all()


@pytest.mark.parametrize(
    "form", [pytest.param(form, marks=[pytest.mark.long] if number % 2 else []) for number, form in enumerate(CURVES)]
)
def test_a_curve_is_saved_as_its_formula_with_its_covariance(form: str, tmp_path: Path) -> None:
    force, kind = CURVES[form]
    noise = 0.003 * np.random.default_rng(4).standard_normal(len(W))
    found = fit_steady(table(W, np.sign(W) * force + noise))
    assert found.chosen == form
    path = found.save(tmp_path / "law.toml")
    law, covariance = ss.load_law(path), ss.laws.load_covariance(path)
    assert type(law).__name__ == kind
    # the formula, far beyond the fastest row as well; nodes of a logarithm are joined by straight lines
    w = np.array([0.02, 0.05, 0.3, 0.8, 2.4, 8.0, -8.0])
    np.testing.assert_allclose(law.kinetic_force(w), found.best(w), rtol=2e-4 if kind == "Tabulated" else 1e-9)
    # and its interval, by the numbers of the law alone
    low, high = found.best.interval([0.3])
    slopes = []
    for name in covariance.index:
        step = 1e-6 * (1 if name == "break_away" else -1)  # a law lets no other number up, nor this one down
        slopes.append(
            (with_values(law, {name: value(law, name) + step}).kinetic_force(0.3) - law.kinetic_force(0.3)) / step
        )
    error = np.sqrt(np.array(slopes) @ covariance.to_numpy() @ np.array(slopes))
    reach = found.parameters["high"].iloc[0] - found.parameters["value"].iloc[0]
    assert error * reach / found.parameters["error"].iloc[0] == pytest.approx(
        float(high[0] - low[0]) / 2, rel=1e-2 if kind == "Tabulated" else 1e-3
    )
    moves(law)


def test_a_fit_of_negative_friction_is_no_law_and_says_so(tmp_path: Path, capsys) -> None:
    w = np.linspace(0.1, 1.0, 20)
    found = fit_steady(table(w, 1.0 - 1.5 * w + 1e-3 * np.random.default_rng(0).standard_normal(20)))
    assert found.law is None
    with pytest.raises(
        ss.InputError, match=r"Coulomb \+ viscous with these numbers is no law of friction .* leave -o out"
    ):
        found.save(tmp_path / "law.toml")
    table(w, 1.0 - 1.5 * w).to_netcdf(tmp_path / "f.nc", engine="h5netcdf")
    assert main(["identify", str(tmp_path / "f.nc"), "-o", str(tmp_path / "law.toml")]) == 2
    assert "is no law of friction" in capsys.readouterr().err
    assert not (tmp_path / "law.toml").exists()


def motion():
    law = ss.laws.StaticKinetic(break_away=1.0, kinetic=0.6)
    orbit = ss.simulate(ss.Oscillator(damping=0.1, drive_velocity=0.2, law=law), 60.0)
    return friction_of_orbit(orbit, np.arange(0, 60.0, 0.05), 0.005, seed=1)


# those of steps of the speed lie beside the tests of their fits, as these take long
WAYS = {
    "branches": (motion, ["--law", "StaticKinetic"]),
    "trajectories": (motion, ["--law", "StaticKinetic", "--trajectories"]),
    "laws": (motion, ["--compare", "Coulomb", "StaticKinetic"]),
    "curve": (lambda: table(W, np.sign(W) * CURVES["Stribeck"][0]), []),
}


@pytest.mark.parametrize("way", ["branches", "trajectories", pytest.param("laws", marks=pytest.mark.long), "curve"])
def test_the_law_of_a_way_is_loaded_with_its_covariance_and_moves(way: str, tmp_path: Path, capsys) -> None:
    make, options = WAYS[way]
    make().to_netcdf(tmp_path / "f.nc", engine="h5netcdf")
    assert main(["identify", str(tmp_path / "f.nc"), *options, "-o", str(tmp_path / "law.toml")]) == 0
    capsys.readouterr()
    law, covariance = ss.load_law(tmp_path / "law.toml"), ss.laws.load_covariance(tmp_path / "law.toml")
    assert list(covariance.index) == list(covariance.columns)
    assert all(np.isfinite(value(law, name)) for name in covariance.index)
    assert np.linalg.eigvalsh(covariance).min() > -1e-9 * np.trace(covariance)
    moves(law)
    system = 'mass = 1.0\nstiffness = 1.0\ndamping = 0.1\ndrive_velocity = 0.3\nlaw = "law.toml"\n'
    (tmp_path / "system.toml").write_text(system + "[simulation]\nt_end = 20.0\n")
    assert main(["simulate", str(tmp_path / "system.toml"), "-o", str(tmp_path / "orbit.nc")]) == 0


def test_a_damaged_covariance_is_refused_and_a_law_without_one_has_none(tmp_path: Path) -> None:
    path = tmp_path / "law.toml"
    path.write_text('[law]\ntype = "Coulomb"\nkinetic = 0.5\n')
    assert ss.laws.load_covariance(path).empty
    path.write_text(
        '[law]\ntype = "Coulomb"\nkinetic = 0.5\n[covariance]\nnames = ["kinetic"]\nmatrix = [[1.0, 2.0]]\n'
    )
    with pytest.raises(ss.InputError, match=r"covariance must have the shape \(1,\), one number a name, got \(2,\)"):
        ss.laws.load_covariance(path)
