"""Records without noise, records that a saturated amplifier cut, windows that leave faults out, scales that films state."""

import functools

import numpy as np
import pytest
import xarray as xr
from spring_and_block import motion as block

import stickslip as ss
from stickslip.errors import InputError
from stickslip.identification import identify
from stickslip.measurement import Rig, load_rig, measure
from stickslip.measurement.signals.noise import clipped, impulses, noise_level

LAW = ss.laws.StaticKinetic(break_away=1.2, kinetic=0.7)
DAMPING = 0.05


@functools.cache
def motion(drive, samples=60):
    """Time, x and the true break-aways of an exact motion."""
    orbit = ss.simulate(ss.Oscillator(damping=DAMPING, drive_velocity=drive, law=LAW), 110.0)
    time = np.arange(20, 110, 2 * np.pi / samples)
    ends = orbit.events.query("kind == 'release' and t > 20")["t"].to_numpy()
    return time - 20, orbit.at(time)[0], ends - 20


def rig(drive, instrument="displacement", **more):
    return Rig(
        instrument=instrument, column="x", unit="1", stiffness=1, mass=1, damping=DAMPING, drive_velocity=drive, **more
    )


@pytest.mark.parametrize(
    ("drive", "instrument"),
    [
        (0.09, "displacement"),
        pytest.param(0.4, "spring_force", marks=pytest.mark.long),
        *(pytest.param(drive, "displacement", marks=pytest.mark.slow) for drive in (0.14, 0.4)),
        *(pytest.param(drive, "spring_force", marks=pytest.mark.slow) for drive in (0.09, 0.14)),
    ],
)
def test_a_record_without_noise_has_tiny_errors_that_hold(drive, instrument):
    time, x, true = motion(drive)
    friction = measure({"t": time, "x": x}, rig(drive, instrument))
    found = friction["break_away"].to_dataset()
    late = np.array([t - true[np.abs(true - t).argmin()] for t in found["t"].to_numpy()])
    assert not friction.attrs["creeps"]
    assert len(found["t"]) >= len(true) - 1
    assert np.abs(late).max() < 0.03 * time[1]
    assert (np.abs(late) < 2 * found["t_error"]).all()
    assert (np.abs(found["force"] - LAW.break_away) < 2 * found["force_error"]).all()
    # Most of it is for a fall of friction that the samples cannot show; the forces themselves are right to 2e-5.
    assert found["force_error"].max() < 0.015 * LAW.break_away


def test_what_the_noise_of_a_simulated_record_was_taken_for_is_said():
    time, x, _ = motion(0.09)
    assert any(
        "as those of a simulated record do" in note for note in measure({"t": time, "x": x}, rig(0.09)).attrs["notes"]
    )


def test_flats_and_missing_samples_are_no_samples_without_noise():
    x = np.sin(np.arange(4000) / 50) + 0.01 * np.random.default_rng(1).standard_normal(4000)
    beyond = x > 0.3
    assert noise_level(np.minimum(x, 0.3)) < 0.009
    assert noise_level(np.minimum(x, 0.3), np.where(beyond, 0.0, 1.0)) == pytest.approx(0.01, rel=0.05)


def noisy(drive):
    time, x, true = motion(drive)
    return time, x, 3e-3 * np.random.default_rng(1).standard_normal(len(time)), true


def test_a_mass_does_not_creep_where_its_instrument_was_saturated():
    time, x, noise, _ = noisy(0.1)
    friction = measure({"t": time, "x": np.minimum(x + noise, np.quantile(x, 0.6))}, rig(0.1))
    assert any("it was saturated there" in note for note in friction.attrs["notes"])
    assert not any("creeps" in note for note in friction.attrs["notes"])


@pytest.mark.parametrize("side", [1, pytest.param(-1, marks=pytest.mark.slow)])
def test_the_flats_of_an_amplifier_ahead_of_the_converter_are_not_measured(side):
    """They have the noise of all other readings: break-aways at 1.04 +- 0.01 were read out of them for 1.2."""
    time, x, noise, _ = noisy(0.1)
    flat = side * np.minimum(side * x, np.quantile(side * x, 0.8)) + noise
    friction = measure({"t": time, "x": flat}, rig(0.1))
    assert any("it was saturated there" in note for note in friction.attrs["notes"])
    found = friction["break_away"].to_dataset()
    assert (np.abs(found["force"] - LAW.break_away) < 3 * found["force_error"]).all()


@pytest.mark.parametrize("noise", [1e-3, 1e-2, 3e-2])
def test_rounded_peaks_are_no_flats(noise):
    time = np.arange(4000) / 50
    rng = np.random.default_rng(3)
    for peaks in (np.sin(time), np.sqrt(np.abs(np.sin(time))), motion(0.4)[1], np.abs(np.sin(time))):
        assert not clipped(peaks + noise * rng.standard_normal(len(peaks)), noise).any()


@pytest.mark.parametrize("at", [0, pytest.param(-1, marks=pytest.mark.slow)])
def test_a_first_or_last_reading_of_zero_costs_no_stick(at):
    """As a logger writes it before its first conversion: the motion was then called almost harmonic, without a stick."""
    time, x, noise, true = noisy(0.1)
    x = x + noise
    x[at] = x.min() - 3
    friction = measure({"t": time, "x": x}, rig(0.1))
    assert any("1 isolated impulses" in note for note in friction.attrs["notes"])
    assert friction.attrs["regime"] == "stick_slip"
    assert friction.sizes["time"] == len(time)
    assert len(friction["break_away"]["t"]) >= len(true) - 1
    for start in range(0, 400, 7):  # a record that begins or ends in a slip has no impulse there
        part = slice(start, start + 100)
        assert not impulses(x[10:-10][part], 3e-3)[[0, -1]].any()


BENCH = {
    "instrument": "direct_force", "inertia": 0.5, "stuck_speed": 0.005,
    "columns": {"time": "t", "displacement": {"column": "x", "unit": "m"}, "force": {"column": "F", "unit": "N"}},
}  # fmt: skip


def to_and_fro():
    time = np.arange(0, 20, 0.002)
    rng = np.random.default_rng(2)
    x, v, a = (0.1 * np.sin(time), 0.1 * np.cos(time), -0.1 * np.sin(time))
    force = 3.0 * np.sign(v) + 0.5 * a + 0.02 * rng.standard_normal(len(time))
    return {"t": time, "x": x + 1e-6 * rng.standard_normal(len(time)), "F": force}


@pytest.mark.parametrize(("column", "value"), [("F", np.nan), ("x", np.nan), ("t", np.nan), ("F", 1e300), ("x", 1e300)])
def test_what_lies_outside_of_the_window_refuses_no_record(column, value):
    record = to_and_fro()
    record[column][-50:] = value
    bench = load_rig({**BENCH, "read": {"window": [1.0, 18.0]}})
    found = measure(record, bench)
    assert found.attrs["force"] == pytest.approx(3.0, abs=0.05)
    assert not any("missing" in note for note in found.attrs["notes"])
    with pytest.raises(InputError, match=r"row 99\d\d, column"):
        measure(record, BENCH)
    record[column][5000:5003] = value
    with pytest.raises(InputError, match=rf"row 5000, column '{column}'"):
        measure(record, bench)


def test_a_time_that_is_no_number_outside_of_the_window_refuses_no_record_of_a_spring():
    time, x, noise, _ = noisy(0.1)
    time = time.copy()
    time[-5:] = np.nan
    with pytest.raises(InputError, match="column 't' is NaN"):
        measure({"t": time, "x": x + noise}, rig(0.1))
    assert measure({"t": time, "x": x + noise}, rig(0.1, read={"window": [0, 80]})).attrs["regime"] == "stick_slip"


def test_the_error_of_a_films_scale_goes_with_other_instruments_too():
    record = to_and_fro()
    film = xr.Dataset(
        {name: ("time", record[column], {"units": unit}) for name, column, unit in (("x", "x", "m"), ("F", "F", "N"))},
        coords={"time": record["t"]},
        attrs={"scale_error": 0.02},
    )
    bench = {**BENCH, "columns": {**BENCH["columns"], "time": "time"}}
    found, exact = measure(film, bench), measure(film.assign_attrs(scale_error=0.0), bench)
    assert found.attrs["scale_error"] == 0.02
    assert "scale_error" not in exact.attrs
    assert any("share a relative standard error of 2 %" in note for note in found.attrs["notes"])
    more = np.sqrt(found["force_error"] ** 2 - exact["force_error"] ** 2)
    np.testing.assert_allclose(more, 0.02 * 0.5 * np.abs(found["slip_acceleration"]), atol=1e-6)


def test_an_instrument_without_a_spring_has_none_that_is_slack():
    record = to_and_fro()
    one_way = {name: values[record["t"] < 1.4] for name, values in record.items()}
    said = "\n".join(identify(measure(one_way, {**BENCH, "stuck_speed": 1e-4}), law="Coulomb").notes)
    assert "slack" not in said
    assert "The reading 0 of the instrument is taken as no force" in said
    column = {"column": "F", "unit": "N", "zero": 0.0}
    zeroed = {**BENCH, "stuck_speed": 1e-4, "columns": {**BENCH["columns"], "force": column}}
    assert "taken as no force" not in "\n".join(identify(measure(one_way, zeroed), law="Coulomb").notes)


@pytest.mark.parametrize("top", [0.7, 0.9])
def test_a_force_that_rises_slowly_in_much_noise_is_seen_to_be_clipped(top):
    """The rise of eight samples is below the noise: longer stretches show it."""
    rng = np.random.default_rng(5)
    saw = np.arange(20_000) % 450 / 450.0
    noisy = saw + 0.004 * rng.standard_normal(saw.size)
    assert not clipped(noisy, noise_level(noisy)).any()
    cut = np.minimum(noisy, top)
    found = clipped(cut, noise_level(cut))
    assert (found == (cut == top)).all()


@pytest.mark.parametrize("samples", [18, 20, 23])
def test_break_aways_of_few_samples_a_period_are_off_together(samples):
    step, drive = 2 * np.pi / samples, 0.1
    x, *_ = block(lambda _w: 0.6, lambda _rest: 1.0, drive, step=step, samples=800, damping=DAMPING, inner=200)
    x = x + 0.002 * np.random.default_rng(samples).standard_normal(x.size)
    tree = measure({"t": np.arange(x.size) * step, "x": x}, rig(drive))
    assert tree.attrs["break_away_late"] >= 2.5 * step
    assert any(f"{samples} samples in a period of the free mass" in note for note in tree.attrs["notes"])
    found = identify(tree, law="StaticKinetic").parameters.loc["break_away"]
    assert found["low"] < 1.0 < found["high"]
    assert found["error"] > 2 * drive * step


def test_a_record_that_never_slips_is_one_at_rest():
    x = 0.1 * np.arange(0, 10, 0.1) + 1e-3 * np.random.default_rng(1).standard_normal(100)
    tree = measure({"t": np.arange(0, 10, 0.1), "x": x}, rig(0.1))
    assert tree.attrs["regime"] == "at_rest"
    with pytest.raises(InputError, match=r"goes with the drive throughout .* static friction is above (1\.0|0\.9)"):
        identify(tree)
