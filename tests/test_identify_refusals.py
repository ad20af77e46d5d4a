"""Records that cannot identify the law asked for are refused with the reason, and bad records with the place."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import stickslip as ss
from stickslip.errors import InputError
from stickslip.identification import friction_of_orbit, identify
from stickslip.measurement import Rig


def record(law=None, s=0.2, t_end=200.0):
    law = ss.laws.StaticKinetic(break_away=1.0, kinetic=0.6) if law is None else law
    orbit = ss.simulate(ss.Oscillator(damping=0.1, drive_velocity=s, law=law), t_end)
    return friction_of_orbit(orbit, np.arange(0, t_end, 0.1), 0.01, seed=1)


@pytest.fixture
def friction():
    return record()


def changed(friction, **columns):
    data = friction.to_dataset(inherit=False).assign({name: ("time", values) for name, values in columns.items()})
    return xr.DataTree.from_dict({"/": data, "/break_away": friction["break_away"].to_dataset(inherit=False)})


def test_no_break_away_is_refused_for_a_law_of_stick_time(friction):
    with pytest.raises(
        InputError, match=r"DwellTime needs at least 5 break-aways .* hold none: take a record in which"
    ):
        identify(xr.DataTree(friction.to_dataset(inherit=False)), law="DwellTime")


def test_equal_stick_times_are_refused_for_a_law_of_stick_time(friction):
    with pytest.raises(InputError, match=r"needs stick times that differ.*add records at other drive velocities"):
        identify(friction, law="DwellTime")


def test_one_drive_velocity_is_refused_for_the_papers_law():
    orbit = ss.simulate(ss.paper.oscillator(0.28), 150)
    friction = friction_of_orbit(orbit, np.arange(0, 150, 0.02), 0.003)
    with pytest.raises(InputError, match="all records have one drive velocity"):
        identify(friction, law="BogaczRyczek")


@pytest.mark.long
def test_sticks_in_every_record_are_refused_for_the_papers_law():
    orbits = [ss.simulate(ss.paper.oscillator(s), 150) for s in (0.1, 0.15)]
    frictions = [friction_of_orbit(orbit, np.arange(0, 150, 0.02), 0.003) for orbit in orbits]
    with pytest.raises(InputError, match="needs a record without sticks"):
        identify(frictions, law="BogaczRyczek")


def test_a_record_that_never_slips_is_refused(friction):
    still = changed(friction, stuck=np.ones(friction.sizes["time"], dtype=bool))
    with pytest.raises(InputError, match="holds no slip"):
        identify(still, law="Coulomb")


def test_nan_is_refused_with_its_place(friction):
    force = friction["force"].to_numpy().copy()
    force[17] = np.nan
    with pytest.raises(InputError, match="force is nan at sample 17"):
        identify(changed(friction, force=force))


def test_a_missing_variable_is_refused_with_what_is_there(friction):
    short = xr.DataTree(friction.to_dataset(inherit=False).drop_vars("force"))
    with pytest.raises(InputError, match="expected the variable 'force', found"):
        identify(short)


def test_time_that_runs_back_is_refused(friction):
    data = friction.to_dataset(inherit=False)
    data = data.assign_coords(time=data["time"].to_numpy()[::-1])
    with pytest.raises(InputError, match="time must increase"):
        identify(xr.DataTree(data))


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"law": "DwelTime"}, "did you mean 'DwellTime'"),
        ({"law": 3}, "unknown law 3"),
        ({"law": "StaticKinetic", "free": ["kinetc"]}, "did you mean 'kinetic'"),
        ({"law": "StaticKinetic", "fixed": {"kinetic": 0.6, "break_away": 1.0}}, "no parameter is left to fit"),
        ({"law": "StaticKinetic", "fixed": {"kinetic": 7.0}}, "do not make a law"),
        ({"law": "PiecewiseLinear", "pieces": 0}, "whole number from 1 to 12"),
    ],
)
def test_wrong_options_are_refused_in_one_sentence(refused, friction, options, sentence):
    refused(sentence, lambda: identify(friction, **options))


def test_no_record_at_all_is_refused():
    with pytest.raises(InputError, match="got none"):
        identify([])


def test_a_file_that_is_missing_or_broken_is_refused(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        identify(tmp_path / "friction.nc")
    broken = tmp_path / "broken.nc"
    broken.write_bytes(b"\x89HDF\r\n\x1a\n and no more")
    with pytest.raises(InputError, match=r"broken\.nc: not a netCDF file, or a truncated or damaged one"):
        identify(broken)


def test_two_numbers_that_act_alike_are_named(friction):
    # With one stick time a limit and a rate are one number.
    start = ss.laws.DwellTime(kinetic=0.6, limit=0.5, rate=0.3)
    same = friction["break_away"].to_dataset(inherit=False)
    same["stick_time"] = xr.full_like(same["stick_time"], 3.0)
    tree = xr.DataTree.from_dict({"/": friction.to_dataset(inherit=False), "/break_away": same})
    with pytest.raises(InputError, match="limit and rate of DwellTime cannot be separated"):
        identify(tree, law=start, free=["kinetic", "limit", "rate"])


def measured(noise=0.005, change=lambda x: x, t_end=200):
    system = ss.Oscillator(damping=0.1, drive_velocity=0.2, law=ss.laws.StaticKinetic(break_away=1.0, kinetic=0.6))
    t = np.arange(0, t_end, 0.05)
    x = ss.simulate(system, t_end).at(t)[0]
    x = change(x + noise * np.std(x) * np.random.default_rng(0).standard_normal(t.size))
    return ss.measure({"t": t, "x": x}, Rig.of(system))


@pytest.mark.slow
def test_noise_as_large_as_the_falls_is_refused():
    with pytest.raises(
        InputError, match=r"the noise of the instrument is .* in force, and a break-away falls by .* less noise"
    ):
        identify(measured(noise=1.5, t_end=60), law="StaticKinetic")


@pytest.mark.long
def test_of_a_clipped_gauge_there_are_no_break_aways():
    clipped = measured(change=lambda x: np.minimum(x, 0.8), t_end=60)
    with pytest.raises(
        InputError, match=r"needs at least 2 break-aways .*the instrument's range: it was saturated there"
    ):
        identify(clipped, law="StaticKinetic")
    assert identify(clipped, law="Coulomb").law.kinetic == pytest.approx(0.6, abs=0.03)
    # An instrument of few steps is not clipped.
    coarse = identify(measured(change=lambda x: np.round(x, 2), t_end=60), law="StaticKinetic")
    assert coarse.law.kinetic == pytest.approx(0.6, abs=0.01)


@pytest.mark.long
def test_a_zero_that_nobody_gave_is_said_where_no_record_tells_it():
    tree = measured(t_end=60)
    word = "all friction forces are off by the force it stands for"
    assert any(word in note for note in identify(tree, law="StaticKinetic").notes)
    tree.attrs["rig"] = tree.attrs["rig"].replace("rest = 0.0", "rest = 1e-9")
    assert not any(word in note for note in identify(tree, law="StaticKinetic").notes)


def test_slip_that_settles_to_one_speed_is_refused_for_linear_pieces():
    system = ss.Oscillator(damping=0.5, drive_velocity=0.2, law=ss.laws.Coulomb(0.5))
    friction = friction_of_orbit(ss.simulate(system, 200, x0=0.5, v0=0.2), np.arange(0, 200, 0.1), 0.01)
    with pytest.raises(
        InputError, match="PiecewiseLinear is a curve over the slip velocity, and nearly all slip is between"
    ):
        identify(friction, law="PiecewiseLinear")


def test_where_no_law_is_asked_for_the_break_aways_choose_it(friction):
    equal = identify(friction)
    assert type(equal.law) is ss.laws.StaticKinetic
    assert "StaticKinetic was taken: static friction over stick time has the constant form" in equal.notes[0]
    growth = ss.laws.DwellTime(kinetic=0.5, limit=0.5, rate=0.3)
    orbits = [ss.simulate(ss.Oscillator(damping=0.05, drive_velocity=s, law=growth), 200) for s in (0.08, 0.12, 0.16)]
    several = [friction_of_orbit(orbit, np.arange(0, 200, 0.1), 0.002, seed=1) for orbit in orbits]
    # Three of them and one stiffness tie the two, which is said; growth predicts what comes at any of the three.
    grown = identify(several)
    assert type(grown.law) is ss.laws.DwellTime
    assert any("may be an effect of the force rate; vary the stiffness" in note for note in grown.notes)
    slides = record(ss.laws.Coulomb(0.5), t_end=60.0)
    assert type(identify(slides).law) is ss.laws.Coulomb


def test_a_displacement_of_the_wrong_sign_is_refused_as_friction_does_no_work():
    wrong = measured(change=lambda x: -x, t_end=60)
    for law in ("Coulomb", "PiecewiseLinear", "TwoBranch"):
        with pytest.raises(
            InputError, match=r"friction does work on the slip \(it is -0\.\d+ in its sense on average\)"
        ):
            identify(wrong, law=law)


def test_a_law_that_would_drive_is_refused():
    # Friction that pushes at low speed, though it does no work over a whole cycle.
    t = np.arange(0, 100, 0.05)
    w = 0.4 + 0.35 * np.sin(t)
    force = 3 * (w - 0.45) + 0.01 * np.random.default_rng(0).standard_normal(t.size)
    data = xr.Dataset({"slip_velocity": ("time", w), "force": ("time", force)}, coords={"time": t})
    with pytest.raises(InputError, match=r"PiecewiseLinear closest to the records pushes with the slip over \d+ %"):
        identify(xr.DataTree(data), law="PiecewiseLinear", pieces=1)


def test_records_of_two_contacts_are_told():
    found = identify([record(), record(ss.laws.StaticKinetic(break_away=3.0, kinetic=2.0))], law="Coulomb")
    assert re.search(
        r"records do not obey one Coulomb: their mean friction is .* off from it by .* \(record 1\)", found.notes[0]
    )
    alike = identify([record(), record(s=0.25)], law="Coulomb")
    assert not any("do not obey one" in note for note in alike.notes)


@pytest.mark.slow
def test_a_law_of_the_wrong_form_or_rig_is_told_by_the_noise_it_leaves():
    law = ss.laws.PiecewiseLinear(nodes=[(0, 1), (0.2, 0.6), (0.6, 0.75)], break_away=1.05)
    t = np.arange(0, 60, 0.05)
    system = ss.Oscillator(damping=0.1, drive_velocity=0.2, law=law)
    x = ss.simulate(system, 120).at(60 + t)[0]
    x = x + 0.005 * np.std(x) * np.random.default_rng(0).standard_normal(t.size)
    right, wrong = (ss.measure({"t": t, "x": x}, Rig.of(replace(system, mass=mass))) for mass in (1.0, 2.0))

    def leaves(friction, pieces):
        found = identify(friction, law="PiecewiseLinear", pieces=pieces)
        return any("times the noise of the instrument" in note for note in found.notes)

    assert not leaves(right, 2)
    assert leaves(right, 1)
    assert leaves(wrong, 2)


def test_a_mass_that_goes_with_the_drive_throughout_is_refused():
    t = np.arange(0, 100, 0.05)
    x = 0.2 * t + 0.001 * np.random.default_rng(0).standard_normal(t.size)
    friction = ss.measure({"t": t, "x": x}, Rig.of(ss.Oscillator(0.1, 0.2, ss.laws.Coulomb(0.5))))
    with pytest.raises(InputError, match=r"the mass goes with the drive throughout|holds no slip"):
        identify(friction, law="Coulomb")


def test_a_record_without_slip_is_refused_beside_others(friction):
    data = friction.to_dataset(inherit=False).drop_vars("slip_velocity")
    stuck = xr.DataTree.from_dict({"/": data, "/break_away": friction["break_away"].to_dataset(inherit=False)})
    with pytest.raises(InputError, match=r"record 2 holds break-aways and no slip.*: leave it out"):
        identify([friction, stuck], law="StaticKinetic")


def test_a_file_of_several_masses_says_how_to_take_one(tmp_path):
    one = measured(t_end=60)
    both = xr.DataTree.from_dict({"/mass_0": one, "/mass_1": one})
    both.to_netcdf(tmp_path / "two.nc", engine="h5netcdf")
    with pytest.raises(InputError, match=r"friction of 2 masses \(mass_0, mass_1\).* --mass 0, .* tree\['mass_0'\]"):
        identify(tmp_path / "two.nc")
