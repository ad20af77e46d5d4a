"""Films that are stacks of pictures, and what many films at once write."""

import numpy as np
import pytest

import stickslip as ss
from stickslip.cli.main import main
from stickslip.errors import InputError
from stickslip.tracking import Film, film, track

cv2 = pytest.importorskip("cv2")


def make(path, duration=1.0, **camera):
    orbit = ss.simulate(ss.paper.oscillator(0.2), 10.0)
    return film(orbit, path, duration=duration, **({"frame_rate": 20.0, "width": 320, "height": 144} | camera))


def test_all_pages_of_a_tiff_are_pictures(tmp_path):
    make(tmp_path / "pictures", duration=2.0)  # more pages than are read at once
    pictures = [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in sorted((tmp_path / "pictures").iterdir())]
    assert cv2.imwritemulti(str(tmp_path / "stack.tif"), pictures)
    one, other = track(tmp_path / "pictures", frame_rate=20.0), track(tmp_path / "stack.tif", frame_rate=20.0)
    np.testing.assert_array_equal(one["x_px"], other["x_px"])
    np.testing.assert_allclose(one["time"], other["time"], atol=1e-9)
    with pytest.raises(InputError, match="images carry no time"):
        Film(tmp_path / "stack.tif")
    deep = [picture.astype(np.uint16) * 16 for picture in pictures]
    assert cv2.imwritemulti(str(tmp_path / "deep.tif"), deep)
    np.testing.assert_allclose(track(tmp_path / "deep.tif", frame_rate=20.0)["x_px"], one["x_px"], atol=0.01)


def test_many_films_are_drawn_each(tmp_path):
    for name in "ab":
        make(tmp_path / f"{name}.avi", duration=0.3)
    films = [str(tmp_path / f"{name}.avi") for name in "ab"]
    assert main(["track", *films, "-o", str(tmp_path / "out"), "--plot", str(tmp_path / "tracks.png")]) == 0
    assert (tmp_path / "tracks-a.png").stat().st_size > 1000
    assert (tmp_path / "tracks-b.png").exists()
