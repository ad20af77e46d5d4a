"""A torsional record (speed and torque of a bit, speed of the drive) from file to law to simulation."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
import xarray as xr

import stickslip as ss
from stickslip.cli.main import main
from stickslip.identification import fit_steady

INERTIA, STIFFNESS, SPEED = 0.005, 2.0, 2.0
"""kg m^2, N m/rad and rad/s."""
LAW = ss.laws.StaticKinetic(break_away=3.0, kinetic=2.0)

RIG = """
instrument = "direct_force"
stuck_speed = "0.3 rad/s"
{more}
[columns]
time = "time"
velocity = {{ column = "bit", unit = "rad/s" }}
force = {{ column = "torque", unit = "N m" }}
drive_velocity = {{ column = "top", unit = "rad/s" }}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The file of a record of 6 s at 500 Hz, with some noise on the torque."""
    folder = tmp_path_factory.mktemp("torsional")
    system = ss.Oscillator(damping=0.0, drive_velocity=SPEED, law=LAW, mass=INERTIA, stiffness=STIFFNESS)
    time = np.arange(0, 6, 2e-3)
    motion = ss.simulate(system, 6).to_xarray(time)
    rng = np.random.default_rng(0)
    torque = motion["force"].to_numpy() + 0.02 * rng.standard_normal(time.size)
    bit = motion["slip_velocity"].to_numpy() + 0.01 * rng.standard_normal(time.size)
    rows = np.stack([time, bit, torque, np.full(time.size, SPEED)], axis=1)
    np.savetxt(folder / "record.csv", rows, "%.9g", ",", header="time,bit,torque,top", comments="")
    return folder


def measured(folder, name: str, more: str) -> str:
    rig, friction = folder / f"{name}.toml", folder / f"{name}.nc"
    rig.write_text(RIG.format(more=more), encoding="utf-8")
    assert main(["measure", str(folder / "record.csv"), "--rig", str(rig), "-o", str(friction)]) == 0
    return str(friction)


@pytest.mark.long
def test_a_torsional_record_becomes_a_law_and_a_simulation(folder, capsys):
    friction = measured(folder, "known", 'mass = "50 kg cm^2"\nstiffness = "2 N m/rad"')
    law = folder / "law.toml"
    plot = folder / "agreement.png"
    assert main(["identify", friction, "--law", "StaticKinetic", "-o", str(law), "--plot", str(plot)]) == 0
    said = capsys.readouterr().out
    found = tomllib.loads(law.read_text(encoding="utf-8"))["law"]
    assert found["break_away"] == pytest.approx(LAW.break_away, rel=0.02)
    assert found["kinetic"] == pytest.approx(LAW.kinetic, rel=0.02)
    assert "Both motions are stick_slip." in said
    system = folder / "system.toml"
    system.write_text(
        f'mass = {INERTIA}\nstiffness = {STIFFNESS}\ndamping = 0.0\ndrive_velocity = {SPEED}\nlaw = "law.toml"\n',
        encoding="utf-8",
    )
    assert main(["simulate", str(system)]) == 0
    assert "stick_slip" in capsys.readouterr().out


def test_the_picture_of_a_torsional_record_has_its_units(folder):
    friction = measured(folder, "units", "mass = 0.005\nstiffness = 2.0")
    agreement = ss.identification.compare_motion(friction, LAW)
    axes = agreement.plot_phase()
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("velocity ẋ (rad/s)", "spring force k x (N m)")
    # and the period of the simulated motion is that of the record
    assert agreement.table.loc["main line of velocity", "ratio"] == pytest.approx(1.0, abs=0.03)


@pytest.mark.slow
def test_where_the_rig_does_not_say_what_swings_the_law_is_found_and_the_remedy_named(folder, capsys):
    friction = measured(folder, "unknown", "")
    law = folder / "alone.toml"
    capsys.readouterr()
    assert main(["identify", friction, "--law", "StaticKinetic", "-o", str(law)]) == 0
    assert "does not say its mass, stiffness" in capsys.readouterr().out
    assert ss.load_law(law).kinetic == pytest.approx(LAW.kinetic, rel=0.02)
    # Without a motion the picture has friction over slip velocity.
    assert main(["identify", friction, "--law", "StaticKinetic", "--plot", str(folder / "friction.png")]) == 0
    said = capsys.readouterr().out
    assert "does not say its mass, stiffness" in said
    assert "direct_force: mass, stiffness" in said
    assert (folder / "friction.png").stat().st_size > 1000
    assert main(["identify", friction, "--law", "StaticKinetic", "--predict", friction]) == 2
    assert "does not say its mass, stiffness" in capsys.readouterr().err


def test_a_torsional_stiffness_has_its_own_unit(folder, capsys):
    rig = folder / "wrong.toml"
    rig.write_text(RIG.format(more='stiffness = "2 rpm"'), encoding="utf-8")
    assert main(["measure", str(folder / "record.csv"), "--rig", str(rig)]) == 2
    assert "N m/rad" in capsys.readouterr().err


SPRING = {
    "spring_force": ("torque", "N m", STIFFNESS),
    "displacement": ("angle", "deg", 180 / np.pi),
}


@pytest.mark.slow
@pytest.mark.parametrize("instrument", ["displacement", "spring_force"])
def test_a_mass_that_turns_is_measured_by_its_spring(instrument, folder, capsys):
    # The same motion twice: as the torque of the shaft, and as its twist in degrees.
    column, unit, size = SPRING[instrument]
    system = ss.Oscillator(damping=0.002, drive_velocity=SPEED, law=LAW, mass=INERTIA, stiffness=STIFFNESS)
    time = np.arange(2, 8, 2e-3)
    twist = ss.simulate(system, 8).at(time)[0] + 2e-4 * np.random.default_rng(0).standard_normal(time.size)
    rows = np.stack([time, size * twist], axis=1)
    record, rig = folder / f"{column}.csv", folder / f"{column}.toml"
    np.savetxt(record, rows, "%.9g", ",", header=f"t,{column}", comments="")
    rig.write_text(
        f'instrument = "{instrument}"\ncolumn = "{column}"\nunit = "{unit}"\nstiffness = "2 N m/rad"\nmass = "50 kg cm^2"\n'
        'damping = "0.002 N m s/rad"\ndrive_velocity = 2.0\n',
        encoding="utf-8",
    )
    friction, law = folder / f"{column}.nc", folder / f"{column}-law.toml"
    assert main(["measure", str(record), "--rig", str(rig), "-o", str(friction)]) == 0
    assert main(["identify", str(friction), "--law", "StaticKinetic", "-o", str(law)]) == 0
    said = capsys.readouterr().out
    assert "2 N m/rad" in said
    assert "0.005 kg m^2" in said
    found = tomllib.loads(law.read_text(encoding="utf-8"))
    assert found["units"] == {"break_away": "N m", "kinetic": "N m"}
    assert found["law"]["break_away"] == pytest.approx(LAW.break_away, rel=0.01)
    assert found["law"]["kinetic"] == pytest.approx(LAW.kinetic, rel=0.01)
    tree = xr.open_datatree(friction)
    events = tree["break_away"].to_dataset(inherit=False)
    assert {name: events[name].attrs["units"] for name in ("t", "force_rate", "drop_error")} == {
        "t": "s", "force_rate": "N m/s", "drop_error": "N m",
    }  # fmt: skip
    assert tree["velocity"].attrs["units"] == "rad/s"
    assert ss.measurement.motion(record, ss.measurement.Rig.load(rig))["a"].attrs["units"] == "rad/s^2"


MIXED = {
    "a torque and a stiffness in a line": (
        {"unit": "N m", "stiffness": "2 N/m"},
        "unit = 'N m' is of a mass that turns",
    ),
    "a force and an angular speed": (
        {"unit": "kN", "drive_velocity": "2 rpm"},
        "drive_velocity = '2 rpm' is of a mass that",
    ),
    "no unit and an inertia": ({"unit": "1", "mass": "2 kg m^2"}, 'unit = "1" is of a rig without units'),
}


@pytest.mark.parametrize(("more", "said"), MIXED.values(), ids=MIXED)
def test_units_of_both_kinds_are_refused(more, said):
    numbers = {"instrument": "spring_force", "column": "force", "stiffness": 2.0, "mass": 0.005, "drive_velocity": 2.0}
    with pytest.raises(ss.InputError, match=said):
        ss.measurement.Rig.from_dict(numbers | more)


def test_without_a_unit_of_the_record_that_of_the_numbers_decides():
    numbers = {"instrument": "spring_force", "column": "force", "mass": 0.005, "drive_velocity": 2.0}
    assert ss.measurement.Rig.from_dict(numbers | {"stiffness": "2 N m/rad"}).unit == "N m"
    assert ss.measurement.Rig.from_dict(numbers | {"stiffness": "2 N/m"}).unit == "N"


def test_on_a_soft_string_sticks_end_where_the_mass_moves_off_and_not_where_it_is_fast():
    # friction that falls with the speed from its static value: the torque that is left over grows from zero
    law = ss.laws.ExponentialStribeck(4.0, 1.5, scale=3.0)
    rig = tomllib.loads(RIG.format(more="")) | {"stuck_speed": "5 rpm"}
    for drive in (2.0, 6.0):
        system = ss.Oscillator(damping=0.05, drive_velocity=drive, law=law, mass=0.4, stiffness=1.6)
        time, rng = np.arange(0, 60, 0.01), np.random.default_rng(0)
        orbit = ss.simulate(system, 60)
        motion = orbit.to_xarray(time)
        record = {
            "time": time,
            "bit": motion["slip_velocity"].to_numpy() + 0.05 * rng.standard_normal(time.size),
            "torque": motion["force"].to_numpy() + 0.1 * rng.standard_normal(time.size),
            "top": np.full(time.size, drive),
        }
        rows = ss.measure(record, rig)["break_away"].to_dataset(inherit=False).to_dataframe()
        true = orbit.events[orbit.events["kind"] == "release"]
        nearest = true.iloc[[int(np.argmin(np.abs(true["t"] - t))) for t in rows["t"]]]
        late, longer, high = (rows[name].to_numpy() - nearest[name].to_numpy() for name in ("t", "stick_time", "force"))
        assert len(rows) == len(true)
        # the highest of so many noisy samples lies 0.13 to 0.17 above: more, the longer the stick
        assert abs(np.nanmedian(high)) < 0.06
        assert np.nanmedian(late) < 0.12
        assert np.nanmedian(longer) < 0.12
        assert np.nanmedian(np.abs(late / rows["t_error"])) < 2
        assert np.nanmedian(np.abs(longer / rows["stick_time_error"])) < 2


def turned(scale):
    """A drill string measured at the bit: friction 12000 at rest, 6500 in fast slip, falling over slip speeds of `scale`."""
    inertia, stiffness, damping, drive, step = 374.0, 473.0, 20.0, 9.42, 1e-3
    t, twist, speed, stuck, rows = 0.0, 0.0, 0.0, True, []
    while t < 120:
        torque = stiffness * twist + damping * (drive - speed)
        stuck = stuck and abs(torque) <= 12000
        if not stuck:
            friction = 6500 + 5500 * np.exp(-((speed / scale) ** 2))
            next_speed = speed + step * (torque - friction) / inertia
            stuck = next_speed <= 0 < speed
            speed = max(next_speed, 0.0)
        twist += step * (drive - speed)
        rows.append((t, stiffness * twist + damping * (drive - speed), speed))
        t += step
    random = np.random.default_rng(4)
    t, torque, speed = np.array(rows[::20]).T
    record = {
        "t": t,
        "torque": torque + 14 * random.standard_normal(t.size),
        "w": speed + 0.03 * random.standard_normal(t.size),
    }
    columns = {"time": "t", "force": {"column": "torque", "unit": "N m"}, "velocity": {"column": "w", "unit": "rad/s"}}
    return ss.measure(
        record, {"instrument": "direct_force", "inertia": inertia, "stuck_speed": 0.1, "columns": columns}
    )


def test_samples_beside_a_stick_are_no_rows_of_the_curve():
    # where a stick ends the acceleration jumps, and smoothing makes inertia of the jump: up to the whole force
    found = fit_steady(turned(1.5))
    assert found.chosen == "Gaussian Stribeck"
    assert "beside a stick" in " ".join(found.notes)
    for name, truth in (("kinetic", 6500), ("weakening", 5500), ("scale", 1.5)):
        value, error = found.parameters.loc[name, ["value", "error"]]
        assert abs(value - truth) < 3 * error


@pytest.mark.slow
@pytest.mark.parametrize(("scale", "said"), [(1.5, True), (1e-3, False)])
def test_a_fall_at_low_slip_speed_is_said_where_the_law_has_one_number(scale, said):
    notes = " ".join(ss.identify(turned(scale)).notes)
    assert ("friction is lower by" in notes) == said
