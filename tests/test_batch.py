import numpy as np
import pytest

import stickslip as ss
from stickslip import _core


def test_every_run_is_the_run_alone():
    forced = ss.paper.oscillator(0.3, ss.Harmonic(0.05, 1.25))
    runs = ss.simulate_many(
        forced, {"forcing.amplitude": [0.0, 0.1], "v0": [-0.2, 0.3]}, 120, section="reversal", keep=5
    )
    for amplitude in (0.0, 0.1):
        for v0 in (-0.2, 0.3):
            alone = ss.simulate(ss.paper.oscillator(0.3, ss.Harmonic(amplitude, 1.25)), 120, v0=v0)
            one = runs.sel({"forcing.amplitude": amplitude, "v0": v0})
            # A run in lanes differs from one alone by rounding.
            assert (float(one["x"]), float(one["v"])) == pytest.approx(alone.at(120.0), abs=1e-9)
            reversals = alone.events.query("kind == 'reversal' and t >= 60")
            assert int(one["events"].sel(kind="reversal")) == len(reversals)
            assert one["section_t"].to_numpy() == pytest.approx(reversals["t"].to_numpy()[-5:], abs=1e-9)


def test_a_forced_run_along_lines_is_the_run_alone_to_the_bit():
    law = ss.laws.PiecewiseLinear(((0.0, 1.0), (0.2, 0.6), (0.3, 0.61)), 1.0)
    belt = ss.Oscillator(0.05, 0.3, law, forcing=ss.Harmonic(0.5, 0.7))
    runs = ss.simulate_many(belt, {"forcing.frequency": [0.7, 1.1, 1.6]}, 120)
    for frequency in (0.7, 1.1, 1.6):
        alone = ss.simulate(ss.Oscillator(0.05, 0.3, law, forcing=ss.Harmonic(0.5, frequency)), 120)
        one = runs.sel({"forcing.frequency": frequency})
        assert (float(one["x"]), float(one["v"])) == alone.at(120.0)


def test_same_bits_for_any_number_of_workers():
    over = {"drive_velocity": np.linspace(0.05, 0.6, 40), "x0": np.linspace(-1, 1, 9)}
    one, two, five = (
        ss.simulate_many(ss.paper.oscillator(0.3), over, 150, section="node", workers=workers) for workers in (1, 2, 5)
    )
    assert one.identical(two)
    assert one.identical(five)


def test_parameters_of_the_law_and_mean_stick_time():
    system = ss.Oscillator(0.1, 0.2, ss.laws.StaticKinetic(1.0, 0.6))
    runs = ss.simulate_many(system, {"law.kinetic": [0.6, 0.8]}, 400)
    # S3b of the validation cases: 3.4165 time units.
    assert float(runs["stick_time"][0]) == pytest.approx(3.416499584057921, rel=1e-9)
    assert (runs["stop"] == "t_end").all()


def test_progress_is_told_and_can_interrupt():
    seen = []

    def progress(done, n):
        seen.append((done, n))
        if len(seen) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ss.simulate_many(ss.paper.oscillator(0.3), {"x0": np.linspace(0, 1, 2000)}, 10, workers=1, progress=progress)
    assert seen == [(256, 2000), (512, 2000)]


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"over": {}}, "over is empty"),
        ({"over": {"drive_velocty": [1]}}, "no number 'drive_velocty' .did you mean 'drive_velocity'"),
        ({"over": {"law": [1]}}, "'law' is not a number"),
        ({"over": {"drive_velocity": [np.nan]}}, "finite numbers"),
        ({"over": {"mass": [1.0, -1.0]}}, r"run 1 \(mass = -1\): mass must be greater than 0, got -1"),
        ({"section": "releas"}, "did you mean 'release'"),
        ({"transient": 1}, "transient must lie in"),
        ({"keep": 0}, "keep must be a whole number"),
        ({"t_end": -1}, "t_end must be greater than 0"),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_sentence(change, sentence):
    arguments = {"over": {"drive_velocity": [0.3]}, "t_end": 10} | change
    with pytest.raises(ss.InputError, match=sentence):
        ss.simulate_many(ss.paper.oscillator(0.3), **arguments)


def test_systems_smooth_laws_and_varying_drives_run_in_batches_too():
    belt = ss.chain(3, ss.laws.StaticKinetic(1.0, 0.6), 0.2, coupling=0.8)
    over = {"contacts.0.drive_velocity": [0.1, 0.2], "x0.1": [0.0, 0.3], "stiffness.0.1": [-0.8, -0.7]}
    runs = ss.simulate_many(belt, over, 50.0, section="release", keep=4, workers=1)
    assert runs["x"].dims == (*over, "mass")
    document = belt.to_dict()
    document["contacts"][0]["drive_velocity"], document["stiffness"][0][1] = 0.1, -0.7
    alone = ss.simulate(ss.System.from_dict(document), 50.0, x0=[0.0, 0.3, 0.0])
    mine = runs.isel({"contacts.0.drive_velocity": 0, "x0.1": 1, "stiffness.0.1": 1})
    assert (mine["x"].to_numpy() == alone.at(50.0)[0]).all()
    late = alone.events.query("t >= 25 and kind == 'release'")
    assert int(mine["events"].sel(kind="release")) == len(late)
    assert (mine["section_t"].to_numpy() == late["t"].to_numpy()[-4:]).all()
    assert ss.simulate_many(belt, over, 50.0, section="release", keep=4, workers=2).identical(runs)

    shaken = ss.Oscillator(0.1, ss.Drive.shaken(0.3, 0.1, 1.2), ss.laws.Cubic(0.4, 0.45, 0.6))
    runs = ss.simulate_many(shaken, {"damping": [0.1, 0.2], "law.linear": [0.45, 0.4], "x0": [0.3]}, 40.0)
    alone = ss.simulate(ss.Oscillator(0.2, shaken.drive_velocity, ss.laws.Cubic(0.4, 0.4, 0.6)), 40.0, x0=0.3)
    assert float(runs["x"][1, 1, 0]) == alone.at(40.0)[0]


@pytest.mark.parametrize(
    ("over", "sentence"),
    [
        ({"x0": [1.0]}, "'x0' must name a mass of the system, such as x0.0"),
        ({"x0.7": [1.0]}, "x0 must name a mass, such as x0.0, got"),
        ({"contacts.5.drive_velocity": [1.0]}, "the system has no number 'contacts.5.drive_velocity'"),
        ({"mass.0.0": [-1.0]}, r"run 0 \(mass.0.0 = -1\): the mass matrix must be symmetric and positive definite"),
    ],
)
def test_batches_of_systems_refuse_what_they_do_not_have(over, sentence):
    with pytest.raises(ss.InputError, match=sentence):
        ss.simulate_many(ss.chain(2, ss.laws.Coulomb(0.5), 0.2), over, 10.0)


def test_what_crosses_the_border_has_a_type_of_its_own():
    # Names are small whole numbers, counts are counts: no number stands for two things.
    system = ss.Oscillator(0.0, 0.2, ss.laws.StaticKinetic(1.0, 0.6))
    table = _core.batch(
        system.to_json(), ["damping"], np.array([0.2, 0.3]), (50.0, 0.0, 100), "release", 4, 1, None, None
    )
    assert {name for name, column in table.items() if column.dtype != float} == {"stop", "events"}
    assert (table["section_t"].shape, table["x"].shape, table["events"].shape) == (
        (2, 4),
        (2, 1),
        (2, len(_core.KINDS)),
    )
    _, phases, kinds, _ = _core.event_sequence(system.core, None, None, 50.0, 100)
    assert [column.dtype for column in phases] == [np.int8, np.uint8, np.uint32, np.float64]
    assert [_core.ENDINGS[ending] for ending in phases[1][:2]] == ["release", "low"]
    assert (kinds[:2], phases[0][:3].tolist()) == (["release", "capture"], [0, 1, 0])
