"""A zero that drifts along a record is said with its size, and in the intervals."""

import numpy as np
import pytest
from spring_and_block import motion

from stickslip.identification import identify
from stickslip.measurement import Rig, measure

DRIVE, DAMPING, STEP, NOISE = 0.1, 0.1, 0.08, 2e-3
LIMIT, KINETIC = 1.2, 0.7
RIG = Rig(
    instrument="spring_force", column="F", unit="1", stiffness=1, mass=1, damping=DAMPING, drive_velocity=DRIVE
)  # fmt: skip


@pytest.fixture(scope="module")
def clean():
    return motion(lambda w: KINETIC, lambda rest: LIMIT, DRIVE, damping=DAMPING, step=STEP, samples=3000, inner=20)[0]  # noqa: ARG005


def measured(x, seed):
    noise = NOISE * np.random.default_rng(seed).standard_normal(len(x))
    return measure({"t": STEP * np.arange(len(x)), "F": x + noise}, RIG)


def said(friction):
    return [note for note in friction.attrs["notes"] if "drift together" in note]


def forms(share, kind, count):
    u = np.linspace(0, 1, count)
    whole = share * 1.0  # the sticks wind the spring up from 0.2 to 1.2
    return whole * {"line": u, "fading": (1 - np.exp(-3 * u)) / (1 - np.exp(-3)), "to and fro": np.sin(np.pi * u)}[kind]


@pytest.mark.long
@pytest.mark.parametrize(
    ("share", "kind"),
    [
        (0.02, "line"),
        *(
            pytest.param(share, kind, marks=pytest.mark.slow)
            for share, kind in [
                (0.1, "line"),
                (0.1, "to and fro"),
                (0.02, "fading"),
                (0.1, "fading"),
                (0.02, "to and fro"),
            ]
        ),
    ],
)
def test_a_drift_of_the_zero_is_said_with_its_size_and_held_by_the_intervals(clean, kind, share):
    friction = measured(clean + forms(share, kind, len(clean)), 21)
    (note,) = said(friction)
    size = float(note.split("together, by ")[1].split()[0])
    assert size == pytest.approx(share, rel=0.25)
    found = identify(friction, law="StaticKinetic").parameters
    for name, truth in (("break_away", LIMIT), ("kinetic", KINETIC)):
        assert found.loc[name, "low"] < truth < found.loc[name, "high"]
        assert found.loc[name, "high"] - found.loc[name, "low"] < 3.5 * share


@pytest.mark.long
@pytest.mark.parametrize("seed", [22, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (23, 24))])
def test_no_drift_is_said_where_there_is_none(clean, seed):
    friction = measured(clean, seed)
    assert not said(friction)
    assert friction.attrs["force_common"] == 0.0


@pytest.mark.long
def test_break_aways_that_grow_are_no_drift_of_the_zero():
    def limit(rest):  # noqa: ARG001
        limit.count += 1e-6
        return LIMIT + limit.count

    limit.count = 0.0
    x = motion(lambda w: KINETIC, limit, DRIVE, damping=DAMPING, step=STEP, samples=3000, inner=20)[0]  # noqa: ARG005
    assert limit.count > 0.03
    assert not said(measured(x, 25))


@pytest.mark.long
@pytest.mark.parametrize(
    "drives",
    [
        (0.1, 0.16),
        pytest.param((0.1, 0.05), marks=pytest.mark.slow),
        pytest.param((0.14, 0.1, 0.14), marks=pytest.mark.slow),
    ],
)
def test_a_drive_of_several_speeds_is_said_and_one_of_them_measured(drives):
    pieces = []
    for number, drive in enumerate(drives):
        x, _, _, stuck, _ = motion(
            lambda w: KINETIC, lambda rest: LIMIT, drive, damping=DAMPING, step=STEP, samples=2000, inner=20  # noqa: ARG005
        )  # fmt: skip
        half = np.flatnonzero(stuck & (np.abs(x - 0.7) < drive * STEP))  # the speed changes within a stick
        first = half[0] if number else 0
        pieces.append(x[first : half[-1] if number < len(drives) - 1 else None])
    friction = measured(np.concatenate(pieces), 31)
    (note,) = [note for note in friction.attrs["notes"] if "several speeds" in note]
    for drive in drives:
        assert f"{drive:g}" in note or f"{drive:.2f}" in note or f"{1.001 * drive:.3g}" in note
    assert not any("intermittent" in note for note in friction.attrs["notes"])
    at = drives.index(0.1)
    lasts = sum(len(piece) for piece in pieces[: at + 1])
    assert STEP * (lasts - 250) < float(friction["time"][-1]) <= STEP * lasts + 6
    found = identify(friction, law="StaticKinetic").parameters["value"]
    assert found["break_away"] == pytest.approx(LIMIT, abs=0.01)
    assert found["kinetic"] == pytest.approx(KINETIC, abs=0.01)


@pytest.mark.long
def test_one_speed_is_no_several(clean):
    assert not any("several speeds" in note for note in measured(clean, 32).attrs["notes"])
