import numpy as np
import pytest

import stickslip as ss


def test_every_run_is_the_run_alone():
    forced = ss.paper.oscillator(0.3, ss.Harmonic(0.05, 1.25))
    runs = ss.simulate_many(
        forced, {"forcing.amplitude": [0.0, 0.1], "v0": [-0.2, 0.3]}, 120, section="reversal", keep=5
    )
    for amplitude in (0.0, 0.1):
        for v0 in (-0.2, 0.3):
            alone = ss.simulate(ss.paper.oscillator(0.3, ss.Harmonic(amplitude, 1.25)), 120, v0=v0)
            one = runs.sel({"forcing.amplitude": amplitude, "v0": v0})
            assert (float(one["x"]), float(one["v"])) == alone.at(120.0)
            reversals = alone.events.query("kind == 'reversal' and t >= 60")
            assert int(one["events"].sel(kind="reversal")) == len(reversals)
            assert (one["section_t"].to_numpy() == reversals["t"].to_numpy()[-5:]).all()


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
