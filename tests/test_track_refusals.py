"""What cannot be used is refused in one sentence, and nothing is left under a good name."""

import zipfile

import numpy as np
import pytest

import stickslip as ss
from stickslip.errors import InputError
from stickslip.tracking import Film, Setup, film, read_calibration, read_osp, track

cv2 = pytest.importorskip("cv2")


@pytest.fixture
def good(tmp_path):
    path = tmp_path / "good.avi"
    film(ss.simulate(ss.paper.oscillator(0.2), 10.0), path, duration=0.5, frame_rate=20.0)
    return path


def pictures(folder, count=3, shape=(60, 80)):
    folder.mkdir()
    for index in range(count):
        cv2.imwrite(str(folder / f"{index}.png"), np.full(shape, 128, np.uint8))
    return folder


def refused(match, call):
    with pytest.raises(InputError, match=match) as caught:
        call()
    sentence = str(caught.value)
    assert "\n" not in sentence
    assert len(sentence) < 400


def test_films_that_are_none(tmp_path, good):
    refused("no such file; give the path of a film", lambda: track(tmp_path / "nothing.avi"))
    (tmp_path / "empty.mp4").write_bytes(b"")
    refused("empty.mp4: the file is empty", lambda: track(tmp_path / "empty.mp4"))
    (tmp_path / "noise.mp4").write_bytes(np.random.default_rng(0).bytes(4000))
    refused("noise.mp4: the file is no video", lambda: track(tmp_path / "noise.mp4"))
    (tmp_path / "cut.avi").write_bytes(good.read_bytes()[:200])
    refused("cut.avi: .*(no video|no picture)", lambda: track(tmp_path / "cut.avi"))
    (tmp_path / "folder").mkdir()
    refused("folder holds no images", lambda: track(tmp_path / "folder", frame_rate=5.0))


def test_a_film_cut_short_keeps_what_is_there(tmp_path, good):
    whole = good.read_bytes()
    (tmp_path / "half.avi").write_bytes(whole[: len(whole) // 2])
    motion = track(tmp_path / "half.avi", output=tmp_path / "motion.nc")
    assert 2 <= motion.sizes["time"] < 10
    assert (tmp_path / "motion.nc").exists()


def test_pictures_damaged_in_the_middle_are_told_and_the_film_goes_on(tmp_path, good):
    data = bytearray(good.read_bytes())
    middle, size = len(data) // 2, len(data) // 8  # more than one picture of ten
    data[middle : middle + size] = np.random.default_rng(0).bytes(size)
    (tmp_path / "scratched.avi").write_bytes(bytes(data))
    decoded = [[picture for _, picture in Film(tmp_path / "scratched.avi") if picture is not None] for _ in range(8)]
    for again in decoded[1:]:
        np.testing.assert_array_equal(again, decoded[0])
    motion = track(tmp_path / "scratched.avi")
    lost = motion["lost"].values[:, 0]
    seen = {"picture cannot be read", "not found", "y: cut off at the edge"}  # the last in what is left of a picture
    assert {"", "picture cannot be read"} <= set(lost) <= {"", *seen}
    assert lost[0] == lost[-1] == ""
    assert (lost == "").sum() >= 5
    np.testing.assert_allclose(np.diff(motion["time"]), 0.05)
    assert any("in the middle cannot be decoded" in note for note in motion.attrs["notes"])


def test_a_damaged_image_is_told_and_the_others_kept(tmp_path):
    film(ss.simulate(ss.paper.oscillator(0.2), 10.0), tmp_path / "pictures", duration=0.5, frame_rate=20.0)
    (tmp_path / "pictures" / "000003.png").write_bytes(b"no image")
    motion = track(tmp_path / "pictures", frame_rate=20.0)
    assert motion["lost"].values[3, 0] == "picture cannot be read"
    assert (motion["lost"].values[:, 0] == "").sum() == 9
    assert any("000003.png" in note for note in motion.attrs["notes"])


def test_a_film_is_never_written_over_and_places_are_tried_before_the_work(tmp_path, good, monkeypatch):
    whole = good.read_bytes()
    photos = pictures(tmp_path / "photos")
    monkeypatch.setattr("stickslip.tracking.film_tracking._track_film", lambda *_: pytest.fail("the work was begun"))
    refused("good.avi: this is the film itself", lambda: track(good, output=tmp_path / "." / "good.avi"))
    refused("photos: this is the film itself", lambda: track(photos, check=photos, frame_rate=1.0))
    refused("photos: exists and holds other things", lambda: track(good, check=photos))
    refused("a film ends in", lambda: track(good, check=tmp_path / "check.xyz"))
    refused("folder .*nowhere does not exist", lambda: track(good, output=tmp_path / "nowhere" / "motion.nc"))
    refused("folder .*nowhere does not exist", lambda: track(good, check=tmp_path / "nowhere" / "check"))
    refused("folder .*nowhere does not exist", lambda: track(good, check=tmp_path / "nowhere" / "check.avi"))
    assert good.read_bytes() == whole
    assert len(list(photos.iterdir())) == 3


def test_a_marker_that_is_never_seen(tmp_path, good):
    flat = pictures(tmp_path / "flat")
    output = tmp_path / "motion.nc"
    refused("no dark marker was seen in 3 pictures", lambda: track(flat, frame_rate=1.0, output=output))
    refused("no green marker", lambda: track(good, marker="green"))
    refused("only .* can be followed", lambda: track(good, masses=40, size=24))
    refused("no fiducial of the dictionary 4X4_50", lambda: track(good, finder="fiducial"))
    assert not output.exists()


@pytest.mark.parametrize("rate", [0, -1.0, float("nan"), float("inf")])
def test_frame_rates_that_cannot_be(good, rate):
    refused("frame.rate must be a", lambda: track(good, frame_rate=rate))
    refused("frame rate must be a positive number", lambda: Film(good, frame_rate=rate))


def test_times_that_cannot_be(tmp_path):
    folder = pictures(tmp_path / "flat")
    refused("images carry no time; give frame_rate", lambda: track(folder))
    for text, match in (
        ("0\nnan\n2\n", "row 2 must be a finite time"),
        ("0\n1\n1\n", r"row 3 \(1 s\) does not follow 1 s"),
        ("0\n1\n", "3 images but 2 times"),
        ("0\nx\n1\n", "row 2 must be a time in seconds, got 'x'"),
    ):
        (tmp_path / "times.txt").write_text(text)
        refused(match, lambda: track(folder, times=str(tmp_path / "times.txt")))


def test_images_of_two_sizes(tmp_path):
    folder = pictures(tmp_path / "flat")
    cv2.imwrite(str(folder / "1.png"), np.zeros((10, 10), np.uint8))
    refused("give images of one size", lambda: track(folder, frame_rate=1.0))


@pytest.mark.parametrize(
    ("table", "match"),
    [
        ({"finder": "blobb"}, "finder must be one of blob"),
        ({"markr": "dark"}, "unknown key 'markr' .did you mean 'marker'"),
        ({"marker": "ultraviolet"}, "marker must be one of dark"),
        ({"masses": 0}, "masses must be a whole number"),
        ({"size": -3}, "size must be a positive number"),
        ({"region": [1, 2, 3]}, r"region must be \[x, y, width, height\]"),
        ({"start": [[1, 2]], "masses": 2}, "start has 1 entries for 2 masses"),
        ({"finder": "template"}, "the template finder needs templates"),
        ({"channel": "uv"}, "channel must be one of grey"),
    ],
)
def test_setups_that_cannot_be(table, match):
    refused(match, lambda: Setup.of(table))


@pytest.mark.parametrize(
    ("table", "match"),
    [
        ({}, "exactly one of scale, points"),
        ({"scale": 3, "points": []}, "exactly one of .* got scale and points"),
        ({"scale": 0}, "scale must be a positive number"),
        ({"scale": 3, "unit": "mile"}, "unit must be one of m, cm"),
        ({"scale": 3, "lenght": 1}, "unknown key 'lenght'"),
        ({"points": [[0, 0], [10, 0]]}, "length is missing"),
        ({"points": [[0, 0], [1, 0]], "length": 1}, "choose points far from each other"),
        ({"marks": [[0, 0], [1, 0]], "positions": [0]}, "lists of one length"),
        (
            {"marks": [[0, 0], [10, 0], [20, 0]], "positions": [0, 1, 2], "order": 5},
            "calibration by 3 marks: order must be a whole number from 1 to 2, got 5",
        ),
        (
            {"ruler": "nothing.png", "first": [0, 0], "second": [9, 0], "last": [99, 0], "pitch": 1},
            "no such file; give the path of a picture",
        ),
        ({"ruler": "x.png"}, "first is missing"),
    ],
)
def test_calibrations_that_cannot_be(tmp_path, table, match):
    refused(match, lambda: read_calibration(table, tmp_path))


def test_tracker_projects_that_are_damaged(tmp_path):
    (tmp_path / "a.trz").write_bytes(b"no archive")
    refused("not a whole .trz archive", lambda: read_osp(tmp_path / "a.trz"))
    with zipfile.ZipFile(tmp_path / "b.trz", "w") as archive:
        archive.writestr("readme.txt", "nothing")
    refused("holds no .trk project", lambda: read_osp(tmp_path / "b.trz"))
    (tmp_path / "c.trk").write_text("<object>")
    refused("not a whole Tracker project", lambda: read_osp(tmp_path / "c.trk"))
    (tmp_path / "d.trk").write_text("<object class='x.TrackerPanel'></object>")
    refused("no point mass", lambda: read_osp(tmp_path / "d.trk"))


@pytest.mark.parametrize(
    ("camera", "match"),
    [
        ({"frame_rate": 0.0}, "frame_rate must be a positive number"),
        ({"noise": -1.0}, "noise must lie in"),
        ({"scale": 1e6}, "choose a smaller scale"),
        ({"start": 9.0, "duration": 5.0}, "must lie in the orbit"),
        ({"colour": 3}, "unexpected keyword argument 'colour'"),
    ],
)
def test_films_that_cannot_be_made(tmp_path, camera, match):
    orbit = ss.simulate(ss.paper.oscillator(0.2), 10.0)
    refused(match, lambda: film(orbit, tmp_path / "film.avi", **camera))
    refused("ends in .avi", lambda: film(orbit, tmp_path / "film.wmv", duration=0.2))
    refused("make it first", lambda: film(orbit, tmp_path / "no" / "film.avi", duration=0.2))
    assert list(tmp_path.iterdir()) == []
