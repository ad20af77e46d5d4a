"""First guesses: any law of the catalogue can be asked for, and is found again from a motion of its own."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import stickslip as ss
from stickslip.errors import InputError
from stickslip.identification import friction_of_orbit, identify
from stickslip.identification.guesses.first_guess import GUESSES, first_guess
from stickslip.identification.guesses.guess_data import GuessData
from stickslip.identification.records import read_records
from stickslip.identification.selection.comparison import BY_NAME_ONLY
from stickslip.identification.static.rows import break_away_rows
from stickslip.laws import (
    BoucWen,
    Coulomb,
    ExponentialStribeck,
    Law,
    LogarithmicDwell,
    Lorentzian,
    LuGre,
    RateState,
    Regularised,
    Tabulated,
    smooth_from_function,
)


def records(law, velocities, damping=0.1, t_end=80.0):
    made = []
    for number, s in enumerate(velocities):
        orbit = ss.simulate(ss.Oscillator(damping=damping, drive_velocity=s, law=law), t_end)
        made.append(friction_of_orbit(orbit, np.arange(0, t_end, 0.1), 0.005, seed=number))
    return made


def test_every_law_of_the_catalogue_can_be_asked_for():
    ours = {kind for kind in Law.ALL.values() if kind.__module__.startswith("stickslip.")}
    assert ours == set(GUESSES)
    assert set(BY_NAME_ONLY) < set(GUESSES)


CURVE = ExponentialStribeck(1.0, 0.6, 0.2, 0.1)


@pytest.mark.parametrize(
    ("law", "velocities", "damping"),
    [
        pytest.param(Lorentzian(1.0, 0.5, scale=0.1, viscous=0.2), (0.1, 0.3), 0.1, marks=pytest.mark.long),
        (Tabulated([(0, 0.9), (0.1, 0.7), (0.3, 0.6), (0.6, 0.65)], 0.95), (0.1, 0.3), 0.1),
        (Regularised(CURVE, width=1e-3), (0.1, 0.3), 0.1),
        (RateState(1.0, a=0.02, b=0.03, length=0.05, reference_velocity=0.2), (0.02, 0.1, 0.5), 0.3),
        pytest.param(
            smooth_from_function(lambda w: 0.6 + 0.4 * np.exp(-w / 0.3) + 0.1 * w, 2.0),
            (0.1, 0.3),
            0.1,
            marks=pytest.mark.long,
        ),
        (BoucWen(stiffness=40.0, beta=60.0, gamma=0.0), (0.2,), 0.1),
    ],
    ids=lambda item: type(item).__name__ if isinstance(item, Law) else "",
)
def test_friction_over_slip_velocity_is_found_again(law, velocities, damping):
    pieces = 6 if isinstance(law, Tabulated) else None
    found = identify(records(law, velocities, damping), law=type(law), pieces=pieces)
    # Inside the speeds that the records hold; numbers that are held (stiffness, width, length) only shape its beginning.
    w = np.array([0.1, 0.2, 0.4])
    np.testing.assert_allclose(found.law.kinetic_force(w), law.kinetic_force(w), rtol=0.03)
    if isinstance(law, (BoucWen, RateState, Regularised)):
        assert any("held at" in note for note in found.notes)


def test_numbers_of_logarithmic_growth_are_found_again():
    law = LogarithmicDwell(0.5, growth=0.1, onset=0.5)
    table = identify(records(law, (0.08, 0.12, 0.16), 0.05, 200.0), law="LogarithmicDwell").parameters
    for name, true in {"kinetic": 0.5, "growth": 0.1, "onset": 0.5}.items():
        # Ten samples a slip give its work to about a thousandth.
        assert abs(table.loc[name, "value"] - true) < 3 * table.loc[name, "error"] + 1e-3 * true, name
    assert table.loc["growth", "error"] < 0.02


def test_a_table_has_static_friction_over_stick_time_where_that_differs():
    law = LogarithmicDwell(0.5, growth=0.1, onset=0.5)
    found = identify(records(law, (0.08, 0.12, 0.16), 0.05, 200.0), law="Tabulated").law
    times = [node[0] for node in found.break_away[1:]]
    np.testing.assert_allclose(found.break_away_force(times), law.break_away_force(times), rtol=0.02)


def test_nodes_of_the_break_away_force_reach_the_longest_sticks_however_few_they_are():
    # Many short sticks, few of forty seconds.
    several = read_records(records(LogarithmicDwell(0.5, 0.05, 10.0), (0.01, 0.03, 0.16), 0.05, 150.0))
    rows = break_away_rows(several)
    nodes = first_guess(Tabulated, GuessData(several, rows, None, False, 3)).law.break_away
    longest, shortest = rows["stick_time"].max(), rows["stick_time"].min()
    assert 4 <= len(nodes) <= 6
    assert nodes[-1][0] == pytest.approx(longest, rel=0.2)
    assert nodes[1][0] == pytest.approx(shortest, rel=0.2)
    assert nodes[2][0] > 2 * nodes[1][0]


@pytest.mark.slow
def test_a_fall_of_friction_is_guessed_with_numbers_that_make_a_law():
    # Left to itself the linear fit has a negative kinetic force; LuGre's began from 2.5 instead of 0.7.
    found = identify(records(CURVE, (0.1, 0.3)), law="LuGre").law
    np.testing.assert_allclose(found.kinetic_force([0.2, 0.4]), CURVE.kinetic_force([0.2, 0.4]), rtol=0.05)


def test_slip_at_one_speed_is_refused_for_a_logarithm_of_it():
    with pytest.raises(InputError, match=r"RateState is a logarithm .* drive velocities ten times apart"):
        identify(records(Coulomb(0.5), (0.2,), 0.5), law="RateState")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "frequency", "why"),
    [
        (LuGre(240.0, 4.9, 0.05, 1.04, 1.8, 0.107), 0.5, "held at a guess, bristles made kinetic friction 0.57 ± 0.09"),
        (LuGre(30.9, 0.91, 0.177, 1.176, 2.018, 0.099), 0.35, "friction falls while the bristles still give way"),
    ],
)
def test_bristles_are_fitted_where_the_record_shows_them_and_the_other_numbers_are_right_then(law, frequency, why):
    t = np.arange(0, 20, 0.005)
    w = np.sin(2 * np.pi * frequency * t)
    force = law.follow(t, w)[0] + 0.006 * np.random.default_rng(0).standard_normal(t.size)
    data = xr.Dataset({"slip_velocity": ("time", w), "force": ("time", force)}, {"time": t})
    found = identify(xr.DataTree(data), law="LuGre").parameters
    assert {"stiffness", "damping"} < set(found.index), why
    for name, row in found.iterrows():
        assert abs(row["value"] - getattr(law, name)) < 3 * row["error"], why
