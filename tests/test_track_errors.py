"""Standard errors of places: over a ground with texture, beside texture that moves along, in uneven light."""

import cv2
import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, map_coordinates, spline_filter
from scipy.special import erf

from stickslip.tracking import track

PICTURES = 60


def filmed(folder, *, scatter, coarse, size=20, moves=False, falls=0.0, seed=1):
    """A folder of pictures of a dark disc that wanders, by code that shares nothing with the tracker; its true places.

    The ground scatters by `scatter` grey levels and is alike over `coarse` px; it rests, or moves with the disc. The light
    falls by a share across the picture.
    """
    rng = np.random.default_rng(seed)
    rows, columns = np.mgrid[:90, :320].astype(float)
    ground = gaussian_filter(rng.standard_normal((220, 700)), coarse, mode="wrap") if coarse else None
    pieces = spline_filter(ground / ground.std(), mode="grid-wrap") if coarse else None
    time = np.arange(PICTURES) / 30
    places = np.stack([160 + 110 * np.sin(2.1 * time), 45 + 6 * np.sin(5 * time)], axis=1)
    for number, (x, y) in enumerate(places):
        at = [rows - y + 100, columns - x + 300] if moves else [rows + 60, columns + 100]
        grey = rng.standard_normal(rows.shape)
        if coarse:
            grey = map_coordinates(pieces, at, mode="grid-wrap", prefilter=False)
        disc = 0.5 * (1 + erf((size / 2 - np.hypot(columns - x, rows - y)) / 1.4))
        bright = ((190 + scatter * grey) * (1 - disc) + 25 * disc) * (1 - falls * columns / 320)
        bright += 1.2 * rng.standard_normal(rows.shape)
        cv2.imwrite(str(folder / f"{number:03d}.png"), np.clip(np.rint(bright), 0, 255).astype(np.uint8))
    return places


def of_track(folder, places):
    """The true errors and the stated ones, both (pictures, 2)."""
    motion = track(folder, {"frame_rate": 30.0})
    found = np.stack([motion["x_px"].values[:, 0], motion["y_px"].values[:, 0]], axis=1)
    stated = np.stack([motion["x_error"].values[:, 0], motion["y_error"].values[:, 0]], axis=1)
    return found - places, stated


@pytest.mark.parametrize(("scatter", "coarse"), [(2, 0), (6, 1.0), (6, 1.5), (6, 3.0), (11, 2.0)])
@pytest.mark.parametrize("size", [10, 20, 36])
def test_a_ground_with_texture_moves_a_centre_by_no_more_than_is_said(tmp_path, scatter, coarse, size):
    off, stated = of_track(tmp_path, filmed(tmp_path, scatter=scatter, coarse=coarse, size=size))
    assert np.mean(np.abs(off) < 1.96 * stated) > 0.9
    assert np.sqrt(np.mean(off**2)) > 0.35 * np.median(stated)


def test_texture_that_moves_with_the_marker_is_no_noise(tmp_path):
    off, stated = of_track(tmp_path, filmed(tmp_path, scatter=6, coarse=2.0, moves=True))
    off = off - off.mean(axis=0)
    assert np.mean(np.abs(off) < 1.96 * stated) > 0.9
    assert np.median(stated) < 0.012  # 0.04 where the ground rests


def test_light_that_falls_is_no_texture(tmp_path):
    off, stated = of_track(tmp_path, filmed(tmp_path, scatter=1, coarse=0, falls=0.3))
    assert np.mean(np.abs(off) < 1.96 * stated) > 0.9
    assert np.median(stated) < 0.01
