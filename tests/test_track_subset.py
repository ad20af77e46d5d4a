"""Pieces of texture are found to a few thousandths of a pixel, also where they strain."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, map_coordinates

from stickslip.tracking.finding.subset import Subset

pytest.importorskip("cv2")


@pytest.fixture(scope="module")
def texture():
    grain = gaussian_filter(np.random.default_rng(0).standard_normal((480, 480)), 6.0, mode="wrap")
    return 128 + 40 * grain / grain.std()


def picture(texture, matrix, shift, rng, noise=1.0):
    """80 x 80 px of a texture drawn four times as fine, averaged over its pixels, moved and strained about its middle."""
    rows, columns = (np.mgrid[:320, :320] - 159.5) / 4
    x, y = np.linalg.inv(matrix) @ np.stack([columns.ravel() - shift[0], rows.ravel() - shift[1]])
    fine = map_coordinates(texture, [4 * y + 240, 4 * x + 240], order=5, mode="grid-wrap").reshape(80, 4, 80, 4)
    return np.rint(fine.mean(axis=(1, 3)) + noise * rng.standard_normal((80, 80))).astype(np.float32)


def test_no_s_curve_is_left(texture):
    rng = np.random.default_rng(1)
    first = picture(texture, np.eye(2), (0, 0), rng, 0.0)
    subset = Subset(first[20:61, 20:61])
    for shift in np.linspace(0, 1, 11):
        found = subset.find(picture(texture, np.eye(2), (shift, -0.5 * shift), rng), 40.0, 40.0)
        assert abs(found.x - 40.0 - shift) < 0.005
        assert abs(found.y - 40.0 + 0.5 * shift) < 0.005
        assert 0.0005 < found.x_error < 0.005


def test_strain_is_found_with_the_shift(texture):
    rng = np.random.default_rng(2)
    subset = Subset(picture(texture, np.eye(2), (0, 0), rng, 0.0)[20:60, 20:60], affine=True)
    gradient = np.array([[0.004, 0.02], [-0.015, -0.006]])
    found = subset.find(picture(texture, np.eye(2) + gradient, (0.3, -0.4), rng), 39.5, 39.5)
    np.testing.assert_allclose([found.x - 39.5, found.y - 39.5], [0.3, -0.4], atol=0.005)
    np.testing.assert_allclose(found.gradient, gradient, atol=5e-4)


def test_what_is_not_there_or_plain_is_not_found(texture):
    rng = np.random.default_rng(3)
    first = picture(texture, np.eye(2), (0, 0), rng)
    assert Subset(np.full((21, 21), 100.0, np.float32)).find(first, 40.0, 40.0) is None
    assert Subset(first[20:41, 20:41]).find(np.full_like(first, 128.0), 30.0, 30.0) is None
