"""Rate-and-state friction from many steps in velocity: known numbers come back with what differs between the steps."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from real_records import RIGS
from scipy.integrate import solve_ivp
from test_identify_velocity_step import RIG

import stickslip as ss
from stickslip.cli.main import main
from stickslip.identification import fit_velocity_steps
from stickslip.measurement import measure

A, B, LENGTH, STIFFNESS, LEVEL = 0.010, 0.008, 1e-5, 1e4, 0.6
SPEEDS = 1e-6 * np.array([1, 3, 10, 30, 10, 3, 1, 3])


def steps_record(form: str, seed: int, noise: float = 3e-4, wave: float = 0.0) -> dict[str, np.ndarray]:
    """A contact pulled through a spring at one speed after the other, 250 um each; friction from the core's own law."""
    law = ss.laws.RateState(
        normal_force=1.0, a=A, b=B, length=LENGTH, reference_velocity=SPEEDS[0], reference_friction=LEVEL, law=form
    )
    rng = np.random.default_rng(seed)
    t, x, f = [np.zeros(1)], [np.zeros(1)], [np.full(1, LEVEL)]
    state = np.array([LEVEL, 0.0])
    for speed in SPEEDS:

        def rates(_: float, y: np.ndarray, speed: float = speed) -> list[float]:
            w = 2 * SPEEDS[0] * np.exp(-(LEVEL + B * y[1]) / A) * np.sinh(y[0] / A)
            return [STIFFNESS * (speed - w), float(law.rates(w, y[1])[1])]

        path = np.arange(1, 1001) * 2.5e-7
        found = solve_ivp(
            rates, (0, path[-1] / speed), state, "LSODA", np.minimum(path / speed, path[-1] / speed), rtol=1e-7
        )
        state = found.y[:, -1]
        # a wave of the servo, whose phase differs from step to step
        swing = wave * np.sin(path / 6e-6 + rng.uniform(0, 2 * np.pi))
        t.append(t[-1][-1] + found.t)
        x.append(x[-1][-1] + path)
        f.append(found.y[0] + swing)
    friction = np.concatenate(f)
    friction = friction + noise * rng.standard_normal(len(friction)) + 2.0 * np.concatenate(x)  # and a drift
    return {"t": np.concatenate(t), "x": np.concatenate(x), "f": friction}


@pytest.mark.parametrize(
    ("form", "wave"),
    [
        pytest.param("aging", 0.0, marks=pytest.mark.slow),
        pytest.param("slip", 0.0, marks=pytest.mark.slow),
        ("aging", 2e-3),
    ],
)
def test_known_numbers_lie_in_their_intervals(form: str, wave: float) -> None:
    fit = fit_velocity_steps(measure(steps_record(form, seed=1, wave=wave), RIG))
    assert len(fit.steps) == 7
    assert fit.law.law == form
    for name, value in {"a": A, "b": B, "length": LENGTH, "stiffness": STIFFNESS, "a_minus_b": A - B}.items():
        row = fit.parameters.loc[name]
        assert row["low"] <= value <= row["high"], name
    assert fit.parameters.loc["a", "error"] < 0.1 * A
    # the first sample after a step lies 0.25 um from it; what is nearer is rounding
    assert 1e-7 < fit.plot().get_xlim()[0] < 2.5e-7
    # level at the mean logarithm of the speeds of all steps
    known = LEVEL + (A - B) * np.log(fit.law.reference_velocity / SPEEDS[0])
    assert fit.law.reference_friction == pytest.approx(known, abs=4e-3)  # the drift adds up to 2 / m times 2 mm


@pytest.mark.slow
def test_errors_grow_with_what_differs_between_the_steps() -> None:
    calm, wavy = (fit_velocity_steps(measure(steps_record("aging", 2, wave=wave), RIG)) for wave in (0.0, 2e-3))
    assert wavy.parameters.loc["a", "error"] > 3 * calm.parameters.loc["a", "error"]


@pytest.mark.long
def test_the_command_takes_all_steps(tmp_path: Path, capsys) -> None:
    measure(steps_record("aging", 3), RIG).to_netcdf(tmp_path / "f.nc", engine="h5netcdf")
    law, picture = tmp_path / "law.toml", tmp_path / "fit.png"
    assert main(["identify", str(tmp_path / "f.nc"), "--law", "RateState", "-o", str(law), "--plot", str(picture)]) == 0
    assert capsys.readouterr().out.startswith("RateState, aging law, from 7 steps")
    found = ss.laws.load_law(law)
    assert isinstance(found, ss.laws.RateState)
    assert list(ss.laws.load_covariance(law).index) == ["a", "b", "length"]
    system = ss.Oscillator(damping=0.0, stiffness=2e4, drive_velocity=2 * found.reference_velocity, law=found)
    assert ss.simulate(system, 1.0, x0=found.reference_friction / 2e4).t_end == 1.0
    assert picture.stat().st_size > 10_000


def test_too_few_steps_are_refused() -> None:
    record = {name: values[:3001] for name, values in steps_record("aging", 4).items()}
    with pytest.raises(ss.InputError, match="2 steps are too few to tell their scatter, at least 4 are needed"):
        fit_velocity_steps(measure(record, RIG))
    with pytest.raises(ss.InputError, match="holds no step of the drive's speed"):
        fit_velocity_steps(xr.DataTree())


@pytest.mark.slow
def test_a_layer_of_till_strengthens_with_velocity_at_all_its_steps(shared_data: Path) -> None:
    path = shared_data / "rock_biax_p446" / "p446s7tr005l"
    if not path.exists():
        pytest.skip("no rock_biax_p446 among the real records")
    fit = fit_velocity_steps(measure(path, RIGS / "rock_biax_p446.toml"))
    np.testing.assert_allclose(fit.loads["normal_force"] / 1e6, [4.96, 9.96, 14.96, 19.95], atol=0.02)
    assert list(fit.loads["steps"]) == [11, 11, 11, 11]
    assert fit.parameters.loc["a_minus_b", "low"] > 0
    ten = fit.loads.loc[1]
    assert ten["a_minus_b_low"] <= 0.001 <= ten["a_minus_b_high"]  # "~ +.001 per e-fold" at 10 MPa


def test_the_ramp_from_one_speed_to_the_next_is_no_hold() -> None:
    # 30 um/s, then 300 um/s by way of a twentieth of a second at 100 um/s, sampled at 1 kHz
    speed = np.concatenate([np.full(12000, 30e-6), np.full(50, 100e-6), np.full(1200, 300e-6)])
    record = {"t": np.arange(len(speed)) * 1e-3, "x": np.cumsum(speed) * 1e-3, "f": 0.6 + 0 * speed}
    record["f"] += 1e-4 * np.random.default_rng(0).standard_normal(len(speed))
    friction = measure(record, {**RIG, "tolerance": 5e-7})
    np.testing.assert_allclose(friction["steady"]["slip_velocity"], [30e-6, 300e-6], rtol=0.01)
    assert friction["step"].sizes["step"] == 1
