"""Laws drawn from the covariance that is saved with a law."""

import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import stickslip as ss
from stickslip.identification import friction_of_orbit
from stickslip.identification.law_table import law_table
from stickslip.laws.law import save_law
from stickslip.laws.numbers import units_of

LAW = ss.laws.DwellTime(kinetic=0.5, limit=0.5, rate=0.4)
NAMES = ["kinetic", "limit", "rate"]
MATRIX = np.array([[4e-4, -2e-4, 0.0], [-2e-4, 9e-4, 1e-3], [0.0, 1e-3, 0.04]])
COVARIANCE = pd.DataFrame(MATRIX, index=NAMES, columns=NAMES)


def drawn(law, names, n=4000):
    laws = law.sample(n, seed=1)
    return np.array([[getattr(one, name) for name in names] for one in laws])


def test_draws_have_the_covariance_that_the_file_holds(tmp_path):
    save_law(tmp_path / "law.toml", LAW.with_covariance(COVARIANCE), COVARIANCE, {}, units_of(LAW))
    law = ss.load_law(tmp_path / "law.toml")
    pd.testing.assert_frame_equal(law.covariance, COVARIANCE)
    values = drawn(law, NAMES)
    # The standard error of a variance of 4000 draws is 2.2 %; of a logarithm's normal it is larger.
    assert np.cov(values[:, :2].T) == pytest.approx(MATRIX[:2, :2], rel=0.15)
    assert law == LAW
    assert law.sample(3, 7) == LAW.with_covariance(COVARIANCE).sample(3, 7)


def test_what_is_known_by_its_ratio_is_drawn_in_its_logarithm():
    wide = pd.DataFrame([[0.16]], index=["rate"], columns=["rate"])  # as large as the number itself
    rates = drawn(LAW.with_covariance(wide), ["rate"])[:, 0]
    assert (rates > 0).all()
    assert np.median(np.log(rates)) == pytest.approx(np.log(0.4), abs=0.06)
    assert np.std(np.log(rates)) == pytest.approx(1.0, rel=0.08)


def test_limits_and_ties_hold_in_every_draw(tmp_path):
    error = pd.DataFrame([[0.04]], index=["kinetic"], columns=["kinetic"])
    law = ss.laws.StaticKinetic(0.6, 0.6)
    assert all(one.break_away >= one.kinetic for one in law.with_covariance(error).sample(50, 0))
    narrow = law.with_covariance(error, {"break_away": "kinetic"}, {"kinetic": (0.5, float("inf"))})
    save_law(tmp_path / "law.toml", narrow, error, {}, units_of(law))
    laws = ss.load_law(tmp_path / "law.toml").sample(200, 0)
    assert all(one.break_away == one.kinetic >= 0.5 for one in laws)
    assert laws == narrow.sample(200, 0)


def test_the_law_of_an_identification_is_drawn_before_and_after_it_is_saved(tmp_path):
    true = ss.laws.StaticKinetic(1.0, 0.6)
    orbit = ss.simulate(ss.Oscillator(0.05, 0.2, true), 120)
    found = ss.identify(friction_of_orbit(orbit, np.arange(60, 120, 0.05), force_noise=0.01), law="StaticKinetic")
    found.save(tmp_path / "law.toml")
    assert ss.load_law(tmp_path / "law.toml").sample(5, 3) == found.law.sample(5, 3)
    kinetic = drawn(found.law, ["kinetic"], 1000)[:, 0]
    assert np.std(kinetic) == pytest.approx(found.parameters.loc["kinetic", "error"], rel=0.1)


@pytest.mark.parametrize(
    ("law", "said"),
    [
        (ss.laws.Coulomb(0.5), "this Coulomb has no covariance; take the law of an identification"),
        (LAW.with_covariance(COVARIANCE * np.inf), "covariance of kinetic, limit, rate is not finite"),
        (
            ss.laws.Coulomb(0.5).with_covariance(
                pd.DataFrame([[1.0]], index=["kinetic"], columns=["kinetic"]), bounds={"kinetic": (500.0, 501.0)}
            ),
            "of 1000 draws 0 lie within the limits",
        ),
    ],
)
def test_a_law_that_cannot_be_drawn_is_one_sentence(law, said):
    with pytest.raises(ss.InputError, match=said):
        law.sample(2, seed=0)


@pytest.mark.parametrize("known", [True, False])
def test_a_law_made_by_hand_is_saved_with_or_without_its_covariance(tmp_path: Path, known: bool) -> None:
    law = ss.laws.Asymmetric(forward=ss.laws.StaticKinetic(1.2, 0.7), backward=ss.laws.StaticKinetic(0.8, 0.5))
    names = ["forward.kinetic", "backward.kinetic"]
    if known:
        law = law.with_covariance(pd.DataFrame([[4e-4, 1e-4], [1e-4, 9e-4]], names, names))
    units = units_of(law, "N m", "rad")
    again = ss.load_law(law.save(tmp_path / "law.toml", units))
    assert again == law
    assert tomllib.loads((tmp_path / "law.toml").read_text(encoding="utf-8"))["units"] == units
    assert again.covariance.equals(law.covariance)
    assert not known or len(again.sample(3, seed=0)) == 3


def test_a_seed_that_is_missing_is_asked_for():
    with pytest.raises(ss.InputError, match=r"a seed is missing.*write seed=0"):
        LAW.with_covariance(COVARIANCE).sample(3)


def test_a_band_lies_evenly_on_both_sides_of_a_law_that_is_linear_in_its_numbers():
    names = ["break_away", "kinetic"]
    covariance = pd.DataFrame([[4e-4, 1e-4], [1e-4, 9e-4]], index=names, columns=names)
    law = ss.laws.StaticKinetic(1.0, 0.6).with_covariance(covariance)
    table = ss.laws.friction_table(law, [0.1], [0.0])
    assert (table["high"] - table["force"]).tolist() == pytest.approx(
        (table["force"] - table["low"]).tolist(), rel=1e-9
    )
    # 1.96 errors; the ends of a band of 500 pairs scatter by 4 %
    assert (table["high"] - table["force"]).tolist() == pytest.approx([1.96 * 0.03, 1.96 * 0.02], rel=0.1)


def test_a_band_holds_the_law_in_its_middle_where_a_scale_is_not_told_from_zero():
    # the covariance of least squares on 60 points of kinetic + (break_away - kinetic) exp(-w / scale) + viscous w
    names, (first, last, scale, slope) = ["break_away", "kinetic", "scale", "viscous"], (4.2, 3.6, 0.05, -0.06)

    def columns(w):
        fall = np.exp(-w / scale)
        return np.column_stack([fall, 1 - fall, (first - last) * fall * w / scale**2, w])

    covariance = 0.05**2 * np.linalg.inv((matrix := columns(np.linspace(0.005, 0.12, 60))).T @ matrix)
    assert np.sqrt(covariance[2, 2]) > 0.8 * scale
    law = ss.laws.ExponentialStribeck(first, last, scale, slope).with_covariance(pd.DataFrame(covariance, names, names))
    w = np.linspace(0.01, 0.15, 15)
    table = ss.laws.friction_table(law, w)
    half = 1.96 * np.sqrt(np.einsum("ni,ij,nj->n", columns(w), covariance, columns(w)))
    # the middle 95 % of the drawn laws whose scale is positive had the law at an edge, and were three times as wide
    assert (table["high"] - table["force"]).to_numpy() == pytest.approx(half, rel=0.05)
    assert (table["force"] - table["low"]).to_numpy() == pytest.approx(half, rel=0.05)


def test_a_band_goes_to_one_side_of_a_law_at_its_limit():
    error = pd.DataFrame([[0.04]], index=["kinetic"], columns=["kinetic"])
    table = ss.laws.friction_table(ss.laws.StaticKinetic(0.6, 0.6).with_covariance(error), [0.1])
    assert table[["low", "force", "high"]].to_numpy()[0] == pytest.approx([0.6 - 1.96 * 0.2, 0.6, 0.6], abs=1e-4)
    beyond = ss.laws.Coulomb(0.5).with_covariance(error, bounds={"kinetic": (500.0, 501.0)})
    with pytest.raises(ss.InputError, match="lie beyond their limits"):
        ss.laws.friction_table(beyond, [0.1])


@pytest.mark.long
def test_the_table_of_a_fit_has_the_ways_that_were_measured():
    t = np.arange(0, 20, 0.01)
    w = 0.3 + 0.2 * np.sin(t)
    force = 1.0 + 0.5 * w + 0.01 * np.random.default_rng(0).standard_normal(t.size)
    columns = {"time": "t", "velocity": "w", "force": {"column": "f", "unit": "N"}}
    for ways, signs in (([1.0], [1.0]), ([-1.0, 1.0], [-1.0, 1.0])):
        record = {
            "t": np.concatenate([t + i * (t[-1] + 0.01) for i in range(len(ways))]),
            "w": np.concatenate([way * w for way in ways]),
            "f": np.concatenate([way * force for way in ways]),
        }
        found = ss.identify(ss.measure(record, {"instrument": "direct_force", "columns": columns}))
        slips = law_table(found)["slip_velocity (m/s)"]
        assert sorted(set(np.sign(slips[slips != 0]))) == signs
