"""Numbers with units in system and law files, and records that do not join."""

import numpy as np
import pytest
import xarray as xr

import stickslip as ss
from stickslip.cli.main import main
from stickslip.errors import InputError
from stickslip.files.units import check_one_kind, find_unit
from stickslip.identification import fit_steady, friction_of_orbit, predict_motion
from stickslip.measurement import measure

SYSTEM = """
mass = "1200 g"
stiffness = "0.6 N/mm"
damping = "1 N s/m"
drive_velocity = "50 mm/s"
law = { type = "StaticKinetic", break_away = "6 N", kinetic = "3000 mN" }
[simulation]
t_end = "500 ms"
x0 = "2 mm"
"""
PLAIN = ss.Oscillator(1.0, 0.05, ss.laws.StaticKinetic(6.0, 3.0), mass=1.2, stiffness=600.0)


def test_a_system_file_takes_numbers_with_units(tmp_path):
    path = tmp_path / "system.toml"
    path.write_text(SYSTEM)
    assert ss.load_system(path) == PLAIN
    assert main(["simulate", str(path), "-o", str(tmp_path / "orbit.nc")]) == 0
    orbit = ss.load(tmp_path / "orbit.nc")
    assert (orbit.t_end, orbit.at(0.0)[0]) == (0.5, 0.002)


MASSES = """
mass = ["1200 g", 1]
stiffness = [["1 N/mm", -200], ["-0.2 N/mm", 1000]]
damping = "1 N s/m"
forcing = { amplitude = "2 mN", frequency = "1 Hz", phase = "90 deg" }
[[contacts]]
mass = 0
drive_velocity = { nodes = [[0, "50 mm/s"], ["500 ms", 0.1]] }
law = { type = "PiecewiseLinear", break_away = "6 N", nodes = [["0 m/s", "5 N"], ["100 mm/s", 3]] }
"""


def test_matrices_nodes_and_drives_take_numbers_with_units_each_of_its_own(tmp_path):
    path = tmp_path / "masses.toml"
    path.write_text(MASSES)
    law = ss.laws.PiecewiseLinear([(0.0, 5.0), (0.1, 3.0)], 6.0)
    assert ss.load_system(path) == ss.System(
        [1.2, 1.0],
        [[1000, -200], [-200, 1000]],
        1.0,
        ss.Contact(0, law, ss.Drive(nodes=((0.0, 0.05), (0.5, 0.1)))),
        ss.Force(0.002, 2 * np.pi, np.pi / 2),
    )
    for right, wrong, said in (
        ('"100 mm/s"', '"100 mm"', r"nodes\[1\]\[0\]: the unit must be one of m/s"),
        ('"-0.2 N/mm"', '"-0.2 N"', "stiffness: the unit must be one of N/m"),
    ):
        path.write_text(MASSES.replace(right, wrong))
        with pytest.raises(ss.InputError, match=said):
            ss.load_system(path)


def test_the_amplitude_of_a_harmonic_has_the_unit_of_what_it_is_part_of():
    wave = {"amplitude": "2 mN", "frequency": "1 Hz"}
    oscillator = PLAIN.to_dict() | {"forcing": [wave]}
    assert ss.Oscillator.from_dict(oscillator).forcing == ss.Harmonic(0.002, 2 * np.pi)
    drive = {"velocity": "5 cm/s", "harmonics": wave | {"amplitude": "2 mm/s"}}
    assert ss.Drive.from_dict(drive) == ss.Drive(0.05, ss.Harmonic(0.002, 2 * np.pi))
    with pytest.raises(ss.InputError, match=r"forcing.* amplitude: the unit must be one of N, .*, got 'mm/s'"):
        ss.Oscillator.from_dict(oscillator | {"forcing": wave | {"amplitude": "2 mm/s"}})
    with pytest.raises(ss.InputError, match=r"harmonics.* amplitude: the unit must be one of m/s, .*, got 'mN'"):
        ss.Drive.from_dict(drive | {"harmonics": [wave]})
    with pytest.raises(ss.InputError, match=r"harmonics.* amplitude: the unit must be one of 1, %, got 'mN'"):
        ss.NormalForce.from_dict({"harmonics": [wave]})


@pytest.mark.parametrize(
    ("written", "said"),
    [
        ('damping = "1 N"', "damping: the unit must be one of N s/m"),
        ('damping = "1"', "damping = '1' has no unit; write a number without quotes for SI"),
        ('damping = "one N s/m"', 'damping must be a number or a text such as "1.5 N s/m"'),
    ],
)
def test_a_unit_of_another_kind_is_one_sentence(tmp_path, capsys, written, said):
    path = tmp_path / "system.toml"
    path.write_text(SYSTEM.replace('damping = "1 N s/m"', written))
    assert main(["simulate", str(path)]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


@pytest.fixture(scope="module")
def friction():
    orbit = ss.simulate(PLAIN, 3.0)
    tree = friction_of_orbit(orbit, np.arange(0.5, 3.0, 0.002), force_noise=0.02)
    return in_units(tree, "N", "m/s", "s")


def in_units(tree, force, velocity, time):
    units = {"force": force, "slip_velocity": velocity, "time": time}
    data = tree.to_dataset(inherit=False).copy(deep=True)
    for name, unit in units.items():
        data[name].attrs["units"] = unit
    return xr.DataTree.from_dict({"/": data, "/break_away": tree["break_away"].to_dataset(inherit=False)})


def test_tables_and_law_files_carry_the_units_of_the_record(friction, tmp_path):
    found = ss.identify(friction, law="ExponentialStribeck", fixed={"viscous": 0.0})
    assert found.units == {"break_away": "N", "kinetic": "N", "scale": "m/s", "viscous": "N s/m"}
    assert found.shown()["unit"].to_dict() == {name: found.units[name] for name in found.parameters.index}
    assert " N" in found.report().splitlines()[4]
    found.save(tmp_path / "law.toml")
    assert '[units]\nbreak_away = "N"' in (tmp_path / "law.toml").read_text()


def test_records_in_newtons_and_in_friction_coefficients_do_not_join(friction):
    coefficient = in_units(friction, "1", "m/s", "s")
    said = "expected the force in N, as in record 1, got it dimensionless"
    for join in (ss.identify, fit_steady):
        with pytest.raises(ss.InputError, match=said):
            join([friction, coefficient])
    with pytest.raises(ss.InputError, match="expected the force in N"):
        predict_motion(ss.identify(friction, law="StaticKinetic"), [coefficient])
    with pytest.raises(ss.InputError, match="expected the slip velocity in m/s"):
        ss.identify([friction, in_units(friction, "N", "rad/s", "s")])


def torque(tmp_path):
    t = np.arange(0, 20, 0.02)
    w = 0.5 * np.sin(0.7 * t)
    torque = 0.4 * np.sign(w) + 0.25 * w + 0.02 * np.random.default_rng(2).standard_normal(t.size)
    columns = {"time": "t", "velocity": {"column": "w", "unit": "rad/s"}, "force": {"column": "f", "unit": "N m"}}
    friction = ss.measure({"t": t, "w": w, "f": torque}, {"instrument": "direct_force", "columns": columns})
    friction.to_netcdf(tmp_path / "friction.nc", engine="h5netcdf")
    return tmp_path / "friction.nc"


@pytest.mark.slow
def test_python_and_the_command_line_choose_the_same_law(tmp_path):
    path = torque(tmp_path)
    assert main(["identify", str(path), "-o", str(tmp_path / "law.toml")]) == 0
    found = ss.identify(path)
    assert found == fit_steady(path)
    assert found.law == ss.load_law(tmp_path / "law.toml")
    assert "viscous" in found.parameters.index
    assert (
        '[units]\n"nodes[0].slip_velocity" = "rad/s"\n"nodes[0].force" = "N m"' in (tmp_path / "law.toml").read_text()
    )
    with pytest.raises(ss.InputError, match="offset does not go with the fit of friction over slip velocity alone"):
        ss.identify(path, offset=True)


def test_torque_of_the_oil_field_is_known_by_its_own_name():
    for name in ("klbf-ft", "klbf ft", "kip-ft"):
        assert find_unit(name, ("force", "torque"), "rig") == ("torque", pytest.approx(1355.8179483))


@pytest.mark.parametrize(
    "written",
    ['stiffness = "600 N m/rad"', 'drive_velocity = "3 rpm"', 'mass = "1.2 kg m^2"', 'damping = "1 N m s/rad"'],
)
def test_units_of_a_mass_that_turns_do_not_go_with_those_of_one_that_moves_along_a_line(tmp_path, written):
    path, name = tmp_path / "system.toml", written.partition(" ")[0]
    lines = [written if line.startswith(f"{name} ") else line for line in SYSTEM.splitlines()]
    path.write_text("\n".join(lines))
    with pytest.raises(ss.InputError, match=r"is of a mass that turns and .* of one that moves along a line"):
        ss.load_system(path)


def test_a_system_that_turns_is_read(tmp_path):
    path = tmp_path / "system.toml"
    path.write_text(
        'mass = "1.2 kg m^2"\nstiffness = "600 N m/rad"\ndamping = 1\ndrive_velocity = "3 rpm"\n'
        'forcing = { amplitude = "1 N m", frequency = "2 rad/s", phase = "90 deg" }\n'
        'law = { type = "Coulomb", kinetic = "6 N m" }\n[simulation]\nx0 = "5 deg"\n'
    )
    assert ss.load_system(path).drive_velocity == pytest.approx(np.pi / 10)


def test_a_mass_in_pounds_is_no_force(tmp_path):
    path = tmp_path / "system.toml"
    path.write_text(SYSTEM.replace('mass = "1200 g"', 'mass = "2 lb"'))
    assert ss.load_system(path).mass == pytest.approx(0.90718474)
    path.write_text(SYSTEM.replace('mass = "1200 g"', 'mass = "2 lbf"'))
    with pytest.raises(ss.InputError, match="mass: the unit must be one of kg, g, lb"):
        ss.load_system(path)


def test_quadratic_and_cubic_numbers_take_their_units():
    # 2 N/mm^3 at 1 mm is 2 N; 3 N s^2/m^2 at 2 m/s is 12 N more.
    spring = ss.Spring.from_dict({"cubic": "2 N/mm^3"})
    assert spring.cubic * 1e-3**3 == pytest.approx(2.0)
    table = ss.laws.PoppStelter.example().to_dict() | {"square": "3 N s^2/m^2"}
    assert ss.laws.Law.from_dict(table).square == 3.0
    with pytest.raises(ss.InputError, match="N s\\^3/m\\^3"):
        ss.laws.Law.from_dict(ss.laws.Cubic.example().to_dict() | {"cubic": "3 N/m"})


@pytest.mark.parametrize(
    "turning", ["4 N m s^2/rad^2", "4 N m s^3/rad^3", "4 N m/rad^3"], ids=["square", "cubic", "cubic stiffness"]
)
def test_a_square_or_cubic_number_that_turns_does_not_go_with_a_mass_in_kg(turning):
    with pytest.raises(InputError, match="is of a mass that turns and mass = '1 kg' of one that moves along a line"):
        check_one_kind({"mass": "1 kg", "number": turning}, "a.toml")
    check_one_kind({"inertia": "1 kg m^2", "number": turning, "rate": "2 Hz"}, "a.toml")


def test_a_square_or_cubic_number_along_a_line_does_not_go_with_one_that_turns():
    for straight in ("4 N s^2/m^2", "4 N s^3/m^3", "4 N/m^3"):
        with pytest.raises(InputError, match="is of a mass that turns"):
            check_one_kind({"stiffness": "1 N m/rad", "number": straight}, "a.toml")


def test_a_header_of_another_kind_is_refused_unless_a_scale_says_what_a_reading_is():
    time = np.arange(0, 20, 0.01)
    record = {"t": time, "w [rpm]": 50 * np.sin(time), "f": np.sign(np.sin(time))}
    rig = {
        "instrument": "direct_force",
        "columns": {"time": "t", "velocity": {"column": "w", "unit": "m/s"}, "force": "f"},
    }
    with pytest.raises(
        InputError, match=r"is in rpm and the rig says m/s; name another column, correct the unit, or give"
    ):
        measure(record, rig)
    rig["columns"]["velocity"]["scale"] = 0.002
    assert measure(record, rig).attrs["highest_speed"] == pytest.approx(0.1, rel=0.02)


def test_a_unit_behind_the_usual_name_of_time_is_part_of_the_name():
    time = np.arange(0, 60, 0.05)
    record = {"t [s]": time, "x": np.minimum((0.1 * time) % 1.2, 1.0) + 1e-3 * np.sin(77 * time)}
    rig = {
        "instrument": "displacement",
        "column": "x",
        "unit": "1",
        "stiffness": 1.0,
        "mass": 1.0,
        "drive_velocity": 0.1,
    }
    assert measure(record, rig)["time"].size == time.size
