"""A body of which several points are followed: its shift and turn, with errors."""

import numpy as np
import pytest

from stickslip.errors import InputError
from stickslip.tracking import Setup, rigid_body, track
from stickslip.tracking.motion import motion_dataset
from stickslip.tracking.scale.calibration import PIXELS

SHAPE = np.array([[-30.0, -10.0], [25.0, -20.0], [5.0, 30.0]])
TIME = np.arange(300) / 100
ANGLE = 0.4 * np.sin(3 * TIME) + 2.0 * TIME  # over more than half a turn
CENTRE = np.stack([200 + 40 * np.cos(5 * TIME), 100 + 10 * TIME], axis=1)


def body(noise, seed=0):
    turn = np.array([[np.cos(ANGLE), -np.sin(ANGLE)], [np.sin(ANGLE), np.cos(ANGLE)]]).transpose(2, 0, 1)
    places = CENTRE[:, None] + np.einsum("tij,kj->tki", turn, SHAPE - SHAPE.mean(axis=0))
    places += noise * np.random.default_rng(seed).standard_normal(places.shape)
    places[50, 1] = places[60, 0] = places[60, 2] = np.nan
    error = np.where(np.isfinite(places[..., 0]), noise, np.nan)
    lost = np.where(np.isfinite(places[..., 0]), "", "not found").astype(object)
    return motion_dataset(
        TIME, places[..., 0], places[..., 1], error, error.copy(), lost, PIXELS, source="made", frame_rate=100.0
    )


def test_shift_and_turn_are_known_as_well_as_the_errors_say():
    found = rigid_body(body(0.05))
    seen = np.arange(300) != 60
    assert found["lost"].values[60, 0] == "fewer than two points seen"
    assert np.isnan(found["x"].values[60, 0])
    for name, true in (("x", CENTRE[:, 0]), ("y", CENTRE[:, 1]), ("angle", ANGLE)):
        normal = (found[name].values[:, 0] - true) / found[f"{name}_error"].values[:, 0]
        if name == "angle":  # it is zero where the points are first seen, to its error there
            normal -= normal[seen].mean()
        assert 0.85 < np.std(normal[seen]) < 1.15
        assert abs(np.mean(normal[seen])) < 0.3
    assert found["angle_error"].values[50, 0] > 1.1 * found["angle_error"].values[51, 0]
    assert "are off one rigid body by 0.0" in found.attrs["notes"][-1]


def test_points_that_are_no_rigid_body_have_larger_errors_and_it_is_said():
    motion = body(0.05)
    motion["x"][:, 0] += 3 * np.sin(40 * TIME)
    loose, rigid = rigid_body(motion), rigid_body(body(0.05))
    assert (loose["x_error"] > 5 * rigid["x_error"]).sum() > 290
    assert "by 0.87" in loose.attrs["notes"][-1]


def test_wrong_points_are_refused():
    with pytest.raises(InputError, match=r"expected two or more of the masses 0 to 2 as points, got \[0\]"):
        rigid_body(body(0.05), [0])
    with pytest.raises(InputError, match=r"each of bodies must name two or more of the masses 0 to 2 .* got \[1, 3\]"):
        Setup(masses=3, bodies=[[1, 3]])


def test_a_setup_names_the_points_of_a_body(tmp_path):
    cv2 = pytest.importorskip("cv2")
    for index in range(12):
        picture = np.full((120, 240, 3), 210, np.uint8)
        turn = 0.05 * index
        for x, y in ((0, 0), (60 * np.cos(turn), 60 * np.sin(turn))):
            place = (round(16 * (60 + 4 * index + x)), round(16 * (40 + y)))
            cv2.circle(picture, place, 128, (30, 30, 30), -1, cv2.LINE_AA, 4)
        cv2.imwrite(str(tmp_path / f"{index:02d}.png"), cv2.GaussianBlur(picture, (0, 0), 0.8))
    motion = track(tmp_path, masses=2, bodies=[[0, 1]], frame_rate=10.0)
    assert motion.sizes["mass"] == 1
    np.testing.assert_allclose(motion["angle"].values[:, 0], 0.05 * np.arange(12), atol=0.002)
    x = 60 + 4 * np.arange(12) + 30 * np.cos(0.05 * np.arange(12))
    np.testing.assert_allclose(motion["x"].values[:, 0], x, atol=0.05)
