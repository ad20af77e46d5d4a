"""Scaling by Eq. (2): what was measured and what is simulated are one motion, for every law."""

from dataclasses import fields, replace

import numpy as np
import pytest

import stickslip as ss
from stickslip.files.schema import kinds
from stickslip.laws.state_law import StateLaw

SCALE = ss.Scale(mass=2.0, stiffness=740.0, force=11.0)
EXAMPLES = [kind.example() for kind in ss.laws.Law.ALL.values()]
LAWS = [
    SCALE.restore(law)
    for law in [
        *EXAMPLES,
        # Exponents stand in the dimension of a rate; a pencil may lie at infinity.
        ss.laws.DwellTime(0.5, 0.3, 0.6, exponent=0.6),
        ss.laws.ForceRate(0.5, 0.3, 0.6, force_rate_scale=0.3, exponent=0.6, force_rate_exponent=2.0),
        ss.laws.BogaczRyczek(D=None),
    ]
]


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_a_law_and_its_dimensionless_twin_answer_alike(law):
    small = SCALE.reduce(law)
    w = np.array([1e-6, 0.003, 0.05, -0.3])
    assert small.kinetic_force(w / SCALE.velocity) * SCALE.force == pytest.approx(law.kinetic_force(w), rel=1e-12)
    if not isinstance(law, StateLaw):
        rest, rate = np.array([0.0, 0.2, 30.0]), np.array([0.1, 3.0, 400.0])
        bears = small.break_away_force(rest / SCALE.time, rate / SCALE.unit("force time^-1"))
        assert bears * SCALE.force == pytest.approx(law.break_away_force(rest, rate), rel=1e-12)
    back = SCALE.restore(small)
    for item in fields(law):
        one, other = (getattr(side, item.name) for side in (law, back))
        if isinstance(one, float | tuple):
            assert np.asarray(other) == pytest.approx(np.asarray(one), rel=4e-15)


# Rock needs a rig of its own: on this one its motion is known to no tolerance that is worth comparing.
@pytest.mark.parametrize(
    "law", [law for law in LAWS if not isinstance(law, ss.laws.RateState)], ids=lambda law: type(law).__name__
)
def test_the_motion_of_a_rig_is_the_motion_of_its_dimensionless_twin(law):
    rig = ss.Oscillator(4.0, 0.012, law, mass=2.0, stiffness=740.0, forcing=ss.Harmonic(0.6, 23.0, 0.4))
    small, scale = ss.dimensionless(rig, force=11.0)
    assert (small.mass, small.stiffness, scale) == (1.0, 1.0, SCALE)
    # Eq. (2) and, for the forcing, Eq. (10).
    assert small.damping == pytest.approx(4.0 / np.sqrt(740.0 * 2.0), rel=1e-15)
    assert small.drive_velocity == pytest.approx(0.012 * np.sqrt(740.0 * 2.0) / 11.0, rel=1e-15)
    assert small.forcing.frequency == pytest.approx(23.0 * np.sqrt(2.0 / 740.0), rel=1e-15)
    end = 0.1 if isinstance(law, StateLaw) else 2.0
    orbit, twin = ss.simulate(rig, end, x0=0.004), ss.simulate(small, end / scale.time, x0=0.004 / scale.length)
    t = np.linspace(0, end, 201)
    motion, restored = orbit.to_xarray(t), scale.restore(twin.to_xarray(np.minimum(t / scale.time, twin.t_end)))
    tolerance = 1e-6 if isinstance(law, StateLaw) else 1e-9
    for name in ("time", "x", "v", "slip_velocity", "force"):
        size = float(np.abs(motion[name]).max())
        assert restored[name].to_numpy() == pytest.approx(motion[name].to_numpy(), abs=tolerance * size)
    if not isinstance(law, StateLaw):
        events = scale.restore(twin.events)
        assert events["kind"].tolist() == orbit.events["kind"].tolist()
        assert events["force_rate"].to_numpy() == pytest.approx(
            orbit.events["force_rate"].to_numpy(), rel=1e-7, nan_ok=True
        )


def test_systems_and_varying_drives_scale_with_their_matrices():
    drive = ss.Drive(0.01, (ss.Harmonic(0.004, 31.0),), ((0.1, 0.0), (0.5, 0.02)))
    law = ss.laws.StaticKinetic(8.0, 5.0)
    contacts = [ss.Contact(0, law, drive), ss.Contact(1, ss.laws.Coulomb(2.0), other=0)]
    rig = ss.System([2.0, 1.0], [[740.0, -90.0], [-90.0, 300.0]], 3.0, contacts, ss.Force(0.6, 23.0, mass=1))
    small, scale = ss.dimensionless(rig)
    assert (small.mass[0][0], small.stiffness[0][0], scale.force) == (1.0, 1.0, 8.0)
    assert small.forcing[0].mass == 1
    orbit, twin = ss.simulate(rig, 2.0), scale.restore(ss.simulate(small, 2.0 / scale.time).events)
    assert twin["t"].to_numpy() == pytest.approx(orbit.events["t"].to_numpy(), rel=1e-9)
    back = scale.restore(small)
    assert np.array(back.stiffness) == pytest.approx(np.array(rig.stiffness), rel=4e-16)
    assert back.contacts[0].drive_velocity.at(0.3) == pytest.approx(drive.at(0.3), rel=1e-14)


def _differences(one, other, name=""):
    """The numbers of two documents of one shape by their names, and whether they differ everywhere."""
    if isinstance(one, dict):
        return {
            path: differs
            for key in one
            for path, differs in _differences(one[key], other[key], f"{name}.{key}").items()
        }
    if isinstance(one, list):
        found = {}
        for item, twin in zip(one, other, strict=True):
            for path, differs in _differences(item, twin, name).items():
                found[path] = found.get(path, True) and differs
        return found
    return {name: one != other}


def test_every_number_that_has_a_dimension_is_scaled():
    law, wave = ss.laws.StaticKinetic(8.0, 5.0), ss.Harmonic(0.6, 23.0, 0.4)
    drive = ss.Drive(0.3, wave, ((0.1, 0.2), (0.5, 0.3)))
    normal = ss.NormalForce(1.1, wave, 3.0, 0.7)
    springs = ss.Spring(((0.1, 1.0), (0.2, 3.0)), 17.0, mass=1, other=2)
    contact = ss.Contact(1, law, drive, 2, normal)
    rig = ss.Oscillator(4.0, drive, law, 2.0, 740.0, wave, normal, replace(springs, mass=0, other=None))
    full = [[2.0, 0.5, 0.5], [0.5, 3.0, 0.5], [0.5, 0.5, 4.0]]
    masses = ss.System(full, full, full, [ss.Contact(0, law, 0.1), contact], ss.Force(0.6, 23.0, 0.4, 1), springs)
    for document in (rig, masses, drive, wave, normal, springs, contact, masses.forcing[0]):
        # A field that is new must be set above.
        unset = {name for name in kinds(type(document)) if getattr(document, name) in (None, (), 0.0)}
        assert unset == set()
    pure = (".phase", "s.mass", "g.mass", ".other", ".constant", ".normal_force.harmonics.amplitude", ".type")
    for system in (rig, masses):
        differ = _differences(system.to_dict(), SCALE.reduce(system).to_dict())
        assert {name for name in differ if not differ[name]} == {name for name in differ if name.endswith(pure)}


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: ss.Scale(1.0, 0.0, 1.0), "Scale: stiffness must be greater than 0, got 0"),
        (
            lambda: ss.dimensionless(ss.Oscillator(0.1, 0.1, ss.laws.LuGre.example())),
            "LuGre has no break-away force to measure by; give",
        ),
        (
            lambda: ss.dimensionless(ss.Oscillator(0.1, 0.1, ss.laws.Coulomb(0.0))),
            "force must be greater than 0, got 0",
        ),
        (lambda: SCALE.reduce("x"), "expected an oscillator, a system, a drive or a law, got 'x'"),
    ],
)
def test_what_cannot_be_scaled_is_refused_in_one_sentence(make, sentence):
    with pytest.raises(ss.InputError, match=sentence):
        make()
