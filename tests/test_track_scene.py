"""The scene before the camera: a plane seen at an angle, its lens, and how the shutter works."""

import numpy as np
import pytest
from scipy.special import erf

from stickslip.errors import InputError
from stickslip.tracking import Calibration, Lens, read_calibration, track
from stickslip.tracking.finding.blobs import find_blobs

cv2 = pytest.importorskip("cv2")

PLANE = np.array([[0.9, 0.05, 30.0], [-0.02, 1.1, 20.0], [4e-4, 1e-4, 1.0]])
"""From the plane, in px of its own, to pictures of 480 x 360 px."""


def seen(world):
    ahead = np.column_stack([world, np.ones(len(world))]) @ PLANE.T
    return ahead[:, :2] / ahead[:, 2:]


def test_four_marks_give_the_plane(tmp_path):
    world = np.array([[0.0, 0.0], [400.0, 0.0], [400.0, 250.0], [0.0, 250.0]])
    table = {"marks": seen(world).tolist(), "positions": world.tolist(), "unit": "mm"}
    calibration = read_calibration(table, tmp_path)
    inside = np.array([[200.0, 120.0], [33.0, 210.0]])
    np.testing.assert_allclose(np.stack(calibration.to_world(*seen(inside).T), axis=1), inside / 1000, atol=1e-9)
    assert "any four" in calibration.notes[0]


def test_eight_marks_give_the_lens_too(tmp_path):
    world = np.array([[x, y] for x in (0.0, 130.0, 260.0, 400.0) for y in (0.0, 120.0, 250.0)])
    ideal = seen(world)
    centre, radius, places = np.array([239.5, 179.5]), 300.0, ideal.copy()
    for _ in range(60):  # the lens shows at `places` what an ideal one shows at `ideal`
        away = places - centre
        places = places + ideal - (centre + away * (1 + 0.05 * (away**2).sum(axis=1, keepdims=True) / radius**2))
    table = {"marks": places.tolist(), "positions": world.tolist(), "unit": "mm"}
    calibration = read_calibration(table, tmp_path, shape=(360, 480))
    assert calibration.lens.k1 == pytest.approx(0.05, abs=1e-4)
    found = np.stack(calibration.to_world(*places.T), axis=1)
    np.testing.assert_allclose(found, world / 1000, atol=1e-6)


@pytest.mark.parametrize("bent", ["lens", "plane"])
def test_the_centre_of_a_marker_is_not_the_centroid_of_its_bent_image(bent):
    if bent == "lens":
        calibration = Calibration(lens=Lens(centre=(240.0, 100.0), radius=260.0, k1=0.06))
    else:
        rows = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [2e-4, 1e-4, 1.0]]
        calibration = Calibration(homography=tuple(map(tuple, rows)))
    columns, lines = np.meshgrid(np.arange(80.0, 120.0, 0.05), np.arange(60.0, 100.0, 0.05))
    world = np.stack(calibration.to_world(columns, lines))
    centre = np.stack(calibration.to_world(100.0, 80.0))
    inside = np.hypot(*(world - centre[:, None, None])) < 10
    at = np.array([columns[inside].mean()]), np.array([lines[inside].mean()])
    size = np.sqrt(4 / np.pi * inside.sum()) * 0.05
    apart = [
        np.hypot(*(np.stack(found)[:, 0] - centre))
        for found in (calibration.to_world(*at), calibration.discs_to_world(*at, np.array([size])))
    ]
    assert apart[0] > 0.01
    assert apart[1] < 0.1 * apart[0]


def test_marks_out_of_all_reason_are_refused_before_they_overflow(tmp_path):
    table = {"marks": [[x, 1.7e308] for x in range(4)], "positions": [0.0, 1.0, 2.0, 3.0], "unit": "cm"}
    with pytest.raises(InputError, match=r"marks must lie within ±1e\+09, got 1.7e\+308"):
        read_calibration(table, tmp_path, 12.0)


@pytest.mark.parametrize(
    ("positions", "said"),
    [
        ([[0, 0], [1, 0], [2, 0], [3, 0]], "lie on one line"),
        ([[0, 0], [1, 0], [1, 1]], "four marks or more"),
    ],
)
def test_marks_that_show_no_plane_are_refused(tmp_path, positions, said):
    marks = [[0, 0], [100, 0], [100, 100], [0, 100]][: len(positions)]
    with pytest.raises(InputError, match=said):
        read_calibration({"marks": marks, "positions": positions}, tmp_path)


def test_a_rolling_shutter_and_a_long_exposure_are_taken_out(tmp_path):
    rows, columns = np.mgrid[:120, :200]
    rate, line_time, exposure = 50.0, 5e-5, 0.01

    def way(t):
        return 100 + 60 * np.sin(4 * t)

    for index in range(60):
        moments = index / rate + line_time * rows[..., None] + exposure * (np.arange(8) + 0.5) / 8
        off = np.hypot(columns[..., None] - way(moments), rows[..., None] - 90)
        picture = 200 - 160 * np.clip(10.5 - off, 0, 1).mean(axis=-1)
        cv2.imwrite(str(tmp_path / f"{index}.png"), np.rint(picture).astype(np.uint8))
    setup = {"frame_rate": rate, "line_time": line_time, "exposure": exposure}
    motion = track(tmp_path, setup)
    apart = motion["x_px"].to_numpy()[:, 0] - way(motion["time"].to_numpy())
    assert np.abs(apart).max() < 0.1
    assert any("9.5 ms after the stamps" in note for note in motion.attrs["notes"])
    late = track(tmp_path, frame_rate=rate)
    assert np.abs(late["x_px"].to_numpy()[:, 0] - way(late["time"].to_numpy())).max() > 1


@pytest.mark.parametrize(("radius", "blur"), [(4.0, 0.0), (10.0, 0.0), (10.0, 3.4), (15.0, 3.4)])
def test_a_centre_does_not_depend_on_how_its_rim_lies_between_the_pixels(radius, blur):
    rows, columns = np.mgrid[:81, :81].astype(float)
    off = []
    for middle in 40 + np.arange(8) / 8:
        moments = middle + blur * (np.arange(9) / 9 - 4 / 9)
        apart = np.hypot(columns[..., None] - moments, rows[..., None] - 40)
        picture = 40 + 165 * (0.5 * (1 + erf((radius - apart) / 1.35))).mean(axis=-1)
        found = find_blobs(np.rint(picture).astype(np.uint8))
        off.append(float(found.x[0]) - middle)
    assert np.std(off) < 0.0025  # 0.003 to 0.015 px with a weight that has corners
