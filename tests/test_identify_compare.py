"""Laws compared by what they predict, first guesses of the curves, and the offset of the force."""

from __future__ import annotations

import re
import shlex
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from scipy import stats

import stickslip as ss
from stickslip.cli.main import main
from stickslip.errors import InputError
from stickslip.identification import compare_laws, friction_of_orbit, identify, law_forms
from stickslip.identification.guesses import first_guess, guess_data
from stickslip.identification.selection import comparison
from stickslip.laws.numbers import value


def swept(law, offset=0.0, noise=0.01, seed=0, count=2000):
    """Friction measured directly along a slip velocity that goes to and fro."""
    t = np.linspace(0.0, 40.0, count)
    w = 0.6 * np.sin(t) * (1 + 0.3 * np.sin(0.37 * t))
    force = law.kinetic_force(w) + offset + noise * np.random.default_rng(seed).standard_normal(count)
    data = xr.Dataset({"slip_velocity": ("time", w), "force": ("time", force)}, coords={"time": t})
    return xr.DataTree(data)


def orbits(law, speeds=(0.08, 0.12, 0.16), damping=0.05):
    found = []
    for number, s in enumerate(speeds):
        orbit = ss.simulate(ss.Oscillator(damping=damping, drive_velocity=s, law=law), 200)
        found.append(friction_of_orbit(orbit, np.arange(60, 200, 0.1), 0.01, seed=number))
    return found


@pytest.mark.parametrize(
    "law",
    [
        ss.laws.ExponentialStribeck(1.0, 0.6, scale=0.1, viscous=0.15),
        ss.laws.PoppStelter(1.0, 0.5, weakening=6.0, square=0.3),
        ss.laws.Rational(1.0, weakening=1.5),
        ss.laws.Cubic(static=1.0, linear=1.2, cubic=0.8),
    ],
    ids=lambda law: type(law).__name__,
)
def test_curves_are_recovered_from_a_name_alone(law):
    table = identify(swept(law), law=type(law)).parameters
    for name in table.index:
        assert abs(table.loc[name, "value"] - value(law, name)) < 4 * table.loc[name, "error"] + 1e-6, name
    w = np.linspace(0.02, 0.7, 50)
    np.testing.assert_allclose(
        identify(swept(law), law=type(law)).law.kinetic_force(w), law.kinetic_force(w), atol=0.01
    )


def test_a_comparison_fits_no_law_that_a_part_cannot_tell_and_static_friction_once(monkeypatch):
    # Adhesion acts in the slow record alone: of a break-away force the other two say nothing.
    records = orbits(ss.laws.StaticKinetic(1.0, 0.6), speeds=(0.1, 0.9, 1.0), damping=0.3)
    fitted, static = [], []

    def counted(function, calls):
        def call(*arguments):
            calls.append(arguments)
            return function(*arguments)

        return call

    for module in (law_forms, comparison):
        monkeypatch.setattr(module, "fit_forces", counted(module.fit_forces, fitted))
    monkeypatch.setattr(guess_data, "fit_static_friction", counted(guess_data.fit_static_friction, static))
    found = compare_laws(records, ["Coulomb", "StaticKinetic", "DwellTime", "PiecewiseLinear"], pieces=2)
    assert found.table.index.to_list() == ["Coulomb"]
    assert any("nothing about break_away of StaticKinetic" in sentence for sentence in found.sentences)
    # Coulomb's law: of all records, and of each pair of them.
    assert len(fitted) == 4
    assert len(static) == 1


def test_two_branches_are_told_apart():
    law = ss.laws.TwoBranch(rising=[(0, 1.0), (0.8, 0.8)], falling=[(0, 0.7), (0.8, 0.75)], break_away=1.1)
    t = np.linspace(0.0, 60.0, 4000)
    w = 0.4 + 0.35 * np.sin(t)
    force = ss.force_along(law, t, w, np.zeros(t.size, bool)) + 0.005 * np.random.default_rng(1).standard_normal(t.size)
    data = xr.Dataset({"slip_velocity": ("time", w), "force": ("time", force)}, coords={"time": t})
    found = identify(xr.DataTree(data), law="TwoBranch", pieces=2).law
    inner = np.linspace(0.1, 0.7, 20)
    for name in ("rising", "falling"):
        true, got = (np.array(getattr(one, name)) for one in (law, found))
        np.testing.assert_allclose(np.interp(inner, *got.T), np.interp(inner, *true.T), atol=0.02)


@pytest.mark.long
def test_force_rate_is_recovered_and_needs_several_rates():
    law = ss.laws.ForceRate(kinetic=0.5, limit=0.6, rate=0.3, force_rate_scale=0.2)
    found = identify(orbits(law, (0.04, 0.08, 0.12)), law="ForceRate")
    time = np.array([3.0, 6.0, 12.0])
    np.testing.assert_allclose(found.law.break_away_force(time, 0.08), law.break_away_force(time, 0.08), atol=0.06)
    one = orbits(law, (0.08,))[0]
    table = one["break_away"].to_dataset(inherit=False)
    table["stick_time"] = table["stick_time"] * np.linspace(0.5, 1.5, table.sizes["event"])
    tree = xr.DataTree.from_dict({"/": one.to_dataset(), "/break_away": table})
    with pytest.raises(InputError, match=r"needs force rates that differ.*one drive velocity"):
        identify(tree, law="ForceRate")


def test_steady_slip_at_one_speed_is_refused_for_a_curve():
    t = np.arange(0.0, 20.0, 0.01)
    data = xr.Dataset(
        {"slip_velocity": ("time", 0.3 + 0.001 * np.sin(t)), "force": ("time", 0.5 + 0.001 * np.cos(3 * t))},
        coords={"time": t},
    )
    with pytest.raises(InputError, match=r"ExponentialStribeck is a curve.*add records at other drive velocities"):
        identify(xr.DataTree(data), law="ExponentialStribeck")


def test_a_law_without_a_first_guess_asks_for_numbers(monkeypatch):
    monkeypatch.delitem(first_guess.GUESSES, ss.laws.BoucWen)
    with pytest.raises(InputError, match=r"no first guess for BoucWen: give a law of it with numbers"):
        identify(swept(ss.laws.Coulomb(0.5)), law="BoucWen")


def test_offset_of_the_force_is_recovered_with_its_interval():
    found = identify(swept(ss.laws.Coulomb(0.5), offset=-0.17), law="Coulomb", offset=True)
    assert found.offset["low"] <= -0.17 <= found.offset["high"]
    assert found.parameters.loc["kinetic", "value"] == pytest.approx(0.5, abs=0.002)
    assert "offset" in found.report()
    frame = found.residuals()
    assert np.std(frame["force"] - frame["predicted"]) == pytest.approx(0.01, rel=0.1)


def test_offset_needs_slip_in_both_senses():
    with pytest.raises(InputError, match="slips in both senses, and none does"):
        identify(orbits(ss.laws.StaticKinetic(1.0, 0.6), (0.2,)), law="StaticKinetic", offset=True)


@pytest.mark.slow
def test_offset_is_found_by_the_comparison_and_only_where_it_is():
    viscous = ss.laws.PiecewiseLinear(nodes=[(0, 0.4), (1, 0.6)], break_away=0.4)
    laws = ["Coulomb", "PiecewiseLinear"]
    found = compare_laws(swept(viscous, offset=-0.17), laws, pieces=1)
    assert found.table.index[0] == "PiecewiseLinear + offset"
    assert found.best.offset["low"] <= -0.17 <= found.best.offset["high"]
    assert "The residuals ask for an offset" in found.report()
    plain = compare_laws(swept(viscous), laws, pieces=1)
    assert plain.table.index[0] == "PiecewiseLinear"
    assert "No offset is called for" in plain.report()


@pytest.mark.slow
def test_law_with_memory_wins_on_held_back_records_and_the_rest_is_worse():
    law = ss.laws.DwellTime(kinetic=0.5, limit=0.5, rate=0.3)
    found = compare_laws(orbits(law), ["Coulomb", "StaticKinetic", "DwellTime"])
    assert list(found.table["verdict"]) == ["best", "worse", "worse"]
    assert found.best.law.rate == pytest.approx(0.3, rel=0.1)
    assert "each of the records in turn" in found.sentences[0]


@pytest.mark.long
def test_what_the_data_cannot_decide_is_said_and_the_simpler_law_chosen():
    found = compare_laws(swept(ss.laws.Rational(1.0, weakening=0.3), count=300), ["Cubic", "Rational"])
    assert type(found.best.law).__name__ == "Rational"
    assert "cannot decide between Rational and" in " ".join(found.sentences)


def test_laws_that_cannot_be_identified_are_named_with_the_reason():
    found = compare_laws(swept(ss.laws.Coulomb(0.5)), ["Coulomb", "DwellTime"])
    assert any("DwellTime was not compared" in sentence for sentence in found.sentences)
    with pytest.raises(InputError, match="no law could be identified"):
        compare_laws(swept(ss.laws.Coulomb(0.5)), ["DwellTime"])


def test_command_ranks_and_writes_the_best(tmp_path, capsys):
    path, law = tmp_path / "friction.nc", tmp_path / "law.toml"
    swept(ss.laws.Rational(1.0, weakening=1.5)).to_netcdf(path, engine="h5netcdf")
    assert main(["identify", str(path), "--compare", "Coulomb", "Rational", "-o", str(law)]) == 0
    assert re.search(r"Rational .* best\n", capsys.readouterr().out)
    assert type(ss.load_law(law)).__name__ == "Rational"


@pytest.mark.slow
def test_the_offset_of_a_robot_joint_is_found_by_the_comparison(shared_data):
    # README of robot_joint_nnfm: Coulomb 0.40, viscous, offset -0.17; laws forced through zero lose.
    record = shared_data / "robot_joint_nnfm" / "franka_case3_slow.csv"
    rig = {
        "instrument": "direct_force",
        "columns": {
            "time": "time",
            "velocity": {"column": "dq2", "unit": "rad/s"},
            "force": {"column": "q2_tau_J_compensate", "unit": "N m"},
        },
    }
    found = compare_laws(ss.measure(record, rig), ["Coulomb", "PiecewiseLinear"], pieces=1)
    assert found.table["verdict"].to_dict() == {
        "Coulomb + offset": "best",
        "PiecewiseLinear + offset": "as good",
        "PiecewiseLinear": "worse",
        "Coulomb": "worse",
    }
    viscous = found.identifications["PiecewiseLinear + offset"]
    for fit, kinetic in ((found.best, "kinetic"), (viscous, "nodes[0].force")):
        assert fit.offset["low"] <= -0.17 <= fit.offset["high"]
        assert fit.parameters.loc[kinetic, "low"] <= 0.40 <= fit.parameters.loc[kinetic, "high"]


BENT = ss.laws.PiecewiseLinear(nodes=[(0, 1), (0.2, 0.6), (0.8, 0.75)], break_away=1.05)


@pytest.mark.slow
def test_the_number_of_pieces_is_chosen_by_prediction_and_the_reason_said():
    found = identify(swept(BENT, count=500), law="PiecewiseLinear", pieces="auto")
    assert len(found.law.nodes) == 3
    assert found.law.nodes[1] == pytest.approx((0.2, 0.6), abs=0.01)
    assert found.notes[0].startswith("2 pieces of PiecewiseLinear taken: each of 5 blocks of time was held back")
    assert found.command.endswith("--pieces auto")


def test_pieces_are_chosen_only_where_a_law_has_any():
    with pytest.raises(
        InputError, match=r"nodes\[1\]\.force names a node, and with pieces = 'auto' their number is not"
    ):
        identify(swept(BENT), law="PiecewiseLinear", pieces="auto", fixed={"nodes[1].force": 0.6})
    with pytest.raises(InputError, match="pieces are counted for PiecewiseLinear and TwoBranch, got Tabulated"):
        identify(swept(BENT), law="Tabulated", pieces="auto")
    with pytest.raises(InputError, match="Cubic has no linear pieces to count: leave pieces out, or ask for Piecewise"):
        identify(swept(BENT), law="Cubic", pieces="auto")


def test_bounds_hold_and_a_number_on_its_bound_is_named(tmp_path):
    free = identify(swept(BENT), law="PiecewiseLinear", pieces=2)
    bounds = {"nodes[1].force": (0.62, 0.7), "nodes[1].slip_velocity": (0.1, 0.3)}
    held = identify(swept(BENT), law="PiecewiseLinear", pieces=2, bounds=bounds)
    assert free.law.nodes[1][1] < 0.61
    assert held.law.nodes[1][1] == pytest.approx(0.62, abs=1e-6)
    assert any("nodes[1].force = 0.62 lies on the bound it was given" in note for note in held.notes)
    assert not any("nodes[1].slip_velocity" in note and "bound" in note for note in held.notes)
    path, law = tmp_path / "friction.nc", tmp_path / "law.toml"
    swept(BENT).to_netcdf(path)
    asked = ["--law", "PiecewiseLinear", "--pieces", "2", "--bounds", "nodes[1].force=0.62:0.7"]
    main(["identify", str(path), *asked, "--no-simulation", "-o", str(law)])
    assert ss.load_law(law).nodes[1][1] == pytest.approx(0.62, abs=1e-6)
    assert shlex.join(asked) in law.read_text()


@pytest.mark.parametrize(
    ("bounds", "sentence"),
    [
        ({"nodes[1].force": (0.7, 0.62)}, "must be the lower and the higher value"),
        ({"nodes[2].slip_velocity": (0.1, 0.9)}, "has bounds but is not fitted"),
        ({"nodes[9].force": (0.1, 0.9)}, "has no parameter"),
    ],
)
def test_wrong_bounds_are_refused(bounds, sentence):
    with pytest.raises(InputError, match=sentence):
        identify(swept(BENT), law="PiecewiseLinear", pieces=2, bounds=bounds)


@pytest.mark.slow
def test_a_gaussian_fall_is_found_with_its_break_away_and_preferred_to_a_bristle():
    law = ss.laws.ExponentialStribeck(3.0, 1.8, 0.12, 0.5, exponent=2.0)
    found = compare_laws(swept(law, noise=0.05, seed=4, count=500), ["Dahl", "ExponentialStribeck"])
    assert isinstance(found.best.law, ss.laws.ExponentialStribeck)
    assert found.best.law.exponent == 2.0
    for name, row in found.best.parameters.iterrows():
        assert row["low"] <= getattr(law, name) <= row["high"], name
    assert any("exponent = 2" in note for note in found.best.notes)


def verdicts(ratios, numbers):
    """What `ranked` says of two laws, the second with errors larger by `ratios` in the records: names, verdicts, behind."""
    rng = np.random.default_rng(3)
    first = [rng.standard_normal(400) for _ in ratios]
    second = [ratio * errors for ratio, errors in zip(ratios, first, strict=True)]
    found = {
        name: SimpleNamespace(parameters=range(count), offset=None)
        for name, count in zip(("A", "B"), numbers, strict=True)
    }
    errors = {"A": [(one, np.zeros(0)) for one in first], "B": [(one, np.zeros(0)) for one in second]}
    table, chosen, said = comparison.ranked(found, errors, whole=True)
    # The same by hand: sums of squares, and the jackknife over the records with Student's t.
    sums = np.array([[np.sum(one**2) for one in part] for part in (first, second)])
    behind = 0.5 * np.log(sums[1].sum() / sums[0].sum())
    left = 0.5 * np.log((sums[1].sum() - sums[1]) / (sums[0].sum() - sums[0]))
    n = len(ratios)
    error = np.sqrt((n - 1) / n * np.sum((left - left.mean()) ** 2))
    low, high = behind + np.array([-1, 1]) * stats.t.ppf(0.975, n - 1) * error
    if behind > 0:
        assert table.loc["B", "behind"] == pytest.approx(behind, rel=1e-12)
        assert table.loc["B", "error"] == pytest.approx(error, rel=1e-9, abs=1e-12)
    return chosen, table["verdict"].to_dict(), said, (low, behind, high)


def spread(behind, scatter=0.9, count=6):
    """Ratios of errors in records that lie `behind` on the whole, and so far apart that they could as well be none."""
    apart = np.exp(scatter * np.linspace(-1, 1, count))
    rng = np.random.default_rng(3)
    sums = np.array([np.sum(rng.standard_normal(400) ** 2) for _ in range(count)])
    return np.exp(behind) * apart / np.sqrt(np.sum(sums * apart**2) / np.sum(sums))


def test_a_law_of_more_numbers_is_as_good_worse_or_not_to_be_told_by_the_interval_of_its_difference():
    chosen, verdict, said, (_, _, high) = verdicts(spread(0.02, 0.05), (2, 3))
    assert (chosen, verdict) == ("A", {"A": "best", "B": "as good"})
    assert high < comparison.CLOSE_BEHIND
    assert "cannot decide between A and B" in said[0]
    chosen, verdict, said, (low, _, _) = verdicts(np.full(6, 1.2), (2, 3))
    assert (chosen, verdict) == ("A", {"A": "best", "B": "worse"})
    assert low > 0
    assert "the error of B, the next, is 20 % larger" in said[0]
    chosen, verdict, said, (low, behind, high) = verdicts(spread(0.2), (2, 3))
    assert (chosen, verdict) == ("A", {"A": "best", "B": "cannot tell"})
    assert low < 0 < behind < high
    assert high > comparison.CLOSE_BEHIND
    assert "B (error 22.1 % above the least); more records are needed" in said[-1]


@pytest.mark.parametrize(("behind", "chosen"), [(0.38, "B"), (0.42, "A")])
def test_a_law_of_fewer_numbers_is_not_chosen_where_its_error_is_half_as_much_again(behind, chosen):
    # In both cases the interval holds 0 and more than a tenth: only the number itself tells them apart.
    name, verdict, _, (low, found, high) = verdicts(spread(behind), (3, 2))
    assert found == pytest.approx(behind, rel=1e-12)
    assert low < 0 < comparison.CLOSE_BEHIND < high
    assert name == chosen
    assert verdict == ({"B": "best", "A": "as good"} if chosen == "B" else {"A": "best", "B": "cannot tell"})
