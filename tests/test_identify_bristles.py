"""Laws of bristles: a stiffness that the records do not limit from above is held and said so, and such fits take seconds."""

from __future__ import annotations

import re
import time

import numpy as np
import pytest
import xarray as xr

import stickslip as ss
from stickslip.errors import InputError
from stickslip.identification import friction_of_orbit, identify
from stickslip.identification.guesses.state_laws import stiffest
from stickslip.identification.records import read_records
from stickslip.laws import BoucWen, Coulomb, Dahl, ExponentialStribeck, LuGre, StaticKinetic
from stickslip.laws.state_law import StateLaw


def to_and_fro(law, seed=0, noise=0.006):
    """A force measured directly over twelve seconds of a sinusoidal slip: 2400 samples, eight reversals."""
    t = np.arange(2400) * 0.005
    w = np.sin(2 * np.pi * 0.35 * t)
    force = law.follow(t, w)[0] if isinstance(law, StateLaw) else law.kinetic_force(w)
    force = force + noise * np.random.default_rng(seed).standard_normal(t.size)
    return xr.DataTree(xr.Dataset({"slip_velocity": ("time", w), "force": ("time", force)}, {"time": t}))


def stick_slip(law, drives=(0.08, 0.12, 0.16)):
    orbits = [ss.simulate(ss.Oscillator(0.1, drive, law), 150) for drive in drives]
    return [friction_of_orbit(orbit, np.arange(0, 150, 0.1), 0.005, seed=number) for number, orbit in enumerate(orbits)]


def least(found):
    """The lower bound of the stiffness that the notes give."""
    (said,) = [note for note in found.notes if note.startswith("Only a lower bound of the stiffness is determined")]
    return float(re.search(r"stiffness > (\S+) \(95 %\)", said)[1])


@pytest.mark.parametrize("kind", ["Dahl", "BoucWen"])
@pytest.mark.parametrize("truth", [Coulomb(1.0), Dahl(1e6, 1.0), Dahl(1e7, 1.0)], ids=["rigid", "1e6", "1e7"])
def test_a_stiffness_that_looks_rigid_is_held_and_has_a_true_lower_bound(kind, truth):
    data = to_and_fro(truth)
    found = identify(data, kind)
    assert "stiffness" not in found.parameters.index
    assert found.law.stiffness == pytest.approx(stiffest(read_records([data])))
    assert 1e5 < least(found) < getattr(truth, "stiffness", np.inf)
    assert float(found.law.kinetic_force(0.5)) == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("stiffness", [1e4, 1e5])
def test_a_stiffness_that_the_samples_show_is_fitted_as_before(stiffness):
    row = identify(to_and_fro(Dahl(stiffness, 1.0)), "Dahl").parameters.loc["stiffness"]
    assert abs(row["value"] - stiffness) < 3 * row["error"]
    assert row["error"] < 0.01 * stiffness


@pytest.mark.long
def test_the_curve_of_rigid_bristles_is_found_and_no_number_has_digits_that_mean_nothing():
    found = identify(to_and_fro(LuGre(3e5, 10.0, 0.02, 0.6, 1.0, 0.1)), "LuGre")
    assert least(found) < 3e5
    for name, true in {"kinetic": 0.6, "break_away": 1.0, "scale": 0.1}.items():
        row = found.parameters.loc[name]
        assert abs(row["value"] - true) < 3 * row["error"] + 0.02 * true, name
        assert row["error"] < 0.1 * true, name


@pytest.mark.long
@pytest.mark.parametrize("law", [StaticKinetic(1.0, 0.6), ExponentialStribeck(1.0, 0.6, 0.1, 0.02)])
def test_records_of_sticks_do_not_tell_the_stiffness_nor_a_bound_of_it(law):
    found = identify(stick_slip(law), "LuGre")
    assert "stiffness" not in found.parameters.index
    assert any("stiffness is not determined: sticks hide how bristles bend" in note for note in found.notes)
    assert (found.parameters["error"] < 10).all()


def test_a_stiffness_alone_that_looks_rigid_is_refused_with_what_to_do():
    with pytest.raises(
        InputError, match=r"only say that the stiffness of Dahl is large: hold it at a value, such as fixed="
    ):
        identify(to_and_fro(Coulomb(1.0)), Dahl(1e5, 1.0), free=["stiffness"])


@pytest.mark.long
@pytest.mark.parametrize(
    ("truth", "law", "most"),
    [
        (Coulomb(0.6), "BoucWen", 10.0),
        (ExponentialStribeck(1.0, 0.6, 0.1, 0.02), "BoucWen", 10.0),
    ],
)
def test_a_fit_that_tries_stiff_loops_takes_seconds(truth, law, most):
    # minutes, where each sample of a stiff loop was followed in up to 1e5 steps
    begun = time.process_time()
    identify(to_and_fro(truth), law)
    assert time.process_time() - begun < most


def test_bouc_wen_of_exponent_one_is_dahl_however_stiff():
    t = np.arange(2400) * 0.005
    w = np.sin(2 * np.pi * 0.35 * t)
    for stiffness in (30.0, 1e5, 1e9):
        begun = time.process_time()
        loop = BoucWen(stiffness, beta=stiffness, gamma=0.0).follow(t, w)[0]
        assert loop == pytest.approx(Dahl(stiffness, 1.0).follow(t, w)[0], abs=1e-9)
        assert time.process_time() - begun < 1.0
