"""The rig file: what it accepts, what it refuses and in which words."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from real_records import RIGS

import stickslip as ss
from stickslip.errors import InputError
from stickslip.measurement import InstrumentRig, Rig, load_rig

GOOD = """
instrument = "spring_force"
column = "Fnorm"
unit = "mg"
stiffness = 168
mass = 0.0307
drive_velocity = 42e-6
"""


def test_rig_survives_its_own_toml() -> None:
    rig = Rig.from_toml(GOOD + "mains_frequency = 50\neffective_mass = 0.018\n")
    assert Rig.from_toml(rig.to_toml()) == rig
    assert rig.inertia == 0.018
    assert rig.force_unit == pytest.approx(0.0307 * 9.81)


@pytest.mark.parametrize(
    ("lines", "newtons"),
    [
        ('unit = "cN"', 0.01),
        ('unit = "mN"', 1e-3),
        ('unit = "daN"', 10.0),
        ('unit = "gf"', 9.80665e-3),
        ('unit = "N"\nscale = -0.05', -0.05),
        ('unit = "mg"\nscale = 2', 2 * 0.0307 * 9.81),
    ],
)
def test_a_spring_force_may_be_in_any_unit_of_force_and_scaled(lines: str, newtons: float) -> None:
    assert Rig.from_toml(GOOD.replace('unit = "mg"', lines)).force_unit == pytest.approx(newtons)


def test_a_unit_of_another_size_is_never_proposed() -> None:
    with pytest.raises(InputError, match="one of N, mg, 1, mN, cN") as refused:
        Rig.from_toml(GOOD.replace('"mg"', '"uN"'))
    assert "did you mean" not in str(refused.value)
    with pytest.raises(InputError, match="scale must be the size of one reading in the unit, not 0"):
        Rig.from_toml(GOOD + "scale = 0\n")


def test_example_rigs_are_read() -> None:
    rigs = [load_rig(path) for path in sorted(RIGS.glob("*.toml"))]
    assert len(rigs) >= 15
    for rig in rigs:
        text = rig.toml if isinstance(rig, InstrumentRig) else rig.to_toml()
        assert load_rig(tomllib.loads(text)) == rig


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("stiffness = 168", ""), "stiffness is missing"),
        (("stiffness = 168", "stiffness = -168"), "stiffness must be a positive number, got -168"),
        (("stiffness = 168", "stiffness = 0"), "stiffness must be a positive number, got 0"),
        (("stiffness = 168", "stiffness = nan"), "stiffness must be a finite number, got nan"),
        (("stiffness = 168", "stiffness = '168'"), "stiffness = '168' has no unit"),
        (("stiffness = 168", "stifness = 168"), "did you mean 'stiffness'"),
        (("mass = 0.0307", "mass = -1"), "mass must be a positive number"),
        (("drive_velocity = 42e-6", "drive_velocity = 0"), "drive_velocity must be a positive number"),
        (("mass = 0.0307", "mass = 0.0307\ndamping = -1"), "damping must be zero or a positive number"),
        (('instrument = "spring_force"', 'instrument = "spring-force"'), "did you mean 'spring_force'"),
        (
            ('unit = "mg"', 'unit = "tonne"'),
            "N, mg, 1, mN, cN, daN, kN, MN, lb, kip, kgf, gf, N m, mN m, kN m, lb in, lb ft, got 'tonne'",
        ),
        (("mass = 0.0307", "mass = "), "not a TOML document"),
    ],
)
def test_bad_rig_is_one_sentence(change: tuple[str, str], words: str) -> None:
    with pytest.raises(InputError) as caught:
        Rig.from_toml(GOOD.replace(*change), where="rig.toml")
    message = str(caught.value)
    assert words in message
    assert message.startswith("rig.toml:")
    assert "\n" not in message


def test_a_mass_that_turns_is_measured_with_plain_numbers() -> None:
    law = ss.laws.StaticKinetic(break_away=3.0, kinetic=2.0)
    system = ss.Oscillator(damping=0.0, drive_velocity=2.0, law=law, mass=0.005, stiffness=2.0)
    time = np.arange(0, 5, 4e-3)
    torque = 2.0 * ss.simulate(system, 5).to_xarray(time)["x"].to_numpy()
    torque += 0.01 * np.random.default_rng(0).standard_normal(time.size)
    rig = {"instrument": "spring_force", "column": "torque", "unit": "1"}
    rig |= {"stiffness": 2.0, "mass": 0.005, "drive_velocity": 2.0}
    found = ss.identify(ss.measure({"t": time, "torque": torque}, rig), law="StaticKinetic").parameters["value"]
    assert found.to_dict() == pytest.approx({"break_away": 3.0, "kinetic": 2.0}, rel=0.01)


def test_missing_rig_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file; give the path of a rig file"):
        Rig.load(tmp_path / "none.toml")
