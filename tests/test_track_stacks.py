"""Films that are stacks of pictures, and what many films at once write."""

import numpy as np
import pytest

import stickslip as ss
from stickslip.cli.main import main
from stickslip.errors import InputError
from stickslip.tracking import Film, film, track, tracks_over_film

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


@pytest.mark.long
def test_many_films_are_drawn_each(tmp_path):
    for name in "ab":
        make(tmp_path / f"{name}.avi", duration=0.3)
    films = [str(tmp_path / f"{name}.avi") for name in "ab"]
    assert main(["track", *films, "-o", str(tmp_path / "out"), "--plot", str(tmp_path / "tracks.png")]) == 0
    assert (tmp_path / "tracks-a.png").stat().st_size > 1000
    assert (tmp_path / "tracks-b.png").exists()


@pytest.mark.parametrize(("bits", "packed"), [(8, False), (12, False), (12, True), (10, True)])
def test_bare_grey_levels_of_a_machine_camera(tmp_path, bits, packed):
    from stickslip.tracking.video.raw import Raw

    rows, columns = np.mgrid[:60, :120]
    levels = [np.clip(np.hypot(columns - 30 - 4.0 * i, rows - 30) - 7.5, 0, 1) for i in range(12)]
    levels = [np.rint((0.2 + 0.7 * level) * (2**bits - 1)).astype("<u2") for level in levels]
    if packed:
        bit = [(level.ravel()[:, None] >> np.arange(bits)) & 1 for level in levels]
        data = [np.packbits(one.astype(np.uint8).ravel(), bitorder="little").tobytes() for one in bit]
    else:
        data = [level.astype(np.uint8 if bits == 8 else "<u2").tobytes() for level in levels]
    path = tmp_path / "camera.bin"
    path.write_bytes(b"head" + b"".join(data))
    raw = {"width": 120, "height": 60, "bits": bits, "packed": packed, "header": 4}
    assert (Raw(**raw).read(path, 3) == levels[3]).all()
    motion = track(path, raw=raw, frame_rate=100.0, check=tmp_path / "check")
    np.testing.assert_allclose(motion["x_px"][:, 0], 30 + 4.0 * np.arange(12), atol=0.02)
    (line, _place) = tracks_over_film(motion, path).lines
    np.testing.assert_array_equal(line.get_xdata(), motion["x_px"][:, 0])
    with pytest.raises(InputError, match=r"expected whole pictures of \d+ bytes \(119 x 60 px of"):
        track(path, raw=raw | {"width": 119, "packed": False}, frame_rate=100.0)
    with pytest.raises(InputError, match="images carry no time"):
        track(path, raw=raw)
    with pytest.raises(InputError, match="raw: bits must"):
        track(path, raw=raw | {"bits": 32}, frame_rate=100.0)


def test_grey_levels_of_more_bits_than_was_said_are_refused(tmp_path):
    (tmp_path / "a.raw").write_bytes(np.full(200, 5000, "<u2").tobytes())
    with pytest.raises(InputError, match="holds the grey level 5000, more than 12 bits can say"):
        track(tmp_path / "a.raw", raw={"width": 20, "height": 10, "bits": 12}, frame_rate=1.0)
