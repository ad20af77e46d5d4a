"""Films made from a known motion: what is found is laid beside the truth."""

import tomllib

import numpy as np
import pytest
import xarray as xr

import stickslip as ss
from stickslip.tracking import Setup, film, track, track_films, tracks_over_film, write_check_film

cv2 = pytest.importorskip("cv2")


SMALL = {"frame_rate": 20.0, "width": 320, "height": 96, "marker": 16.0}


def make(path, drive_velocity=0.15, duration=4.0, **camera):
    orbit = ss.simulate(ss.paper.oscillator(drive_velocity), 60.0)
    return film(orbit, path, start=20.0, duration=duration, **(SMALL | camera))


@pytest.mark.parametrize(
    "drive_velocity", [0.15, *(pytest.param(speed, marks=pytest.mark.long) for speed in (0.27, 0.31))]
)
def test_places_lie_within_a_twentieth_of_a_pixel_of_the_truth_without_any_option(tmp_path, drive_velocity):
    truth = make(tmp_path / "film.avi", drive_velocity)
    motion = track(tmp_path / "film.avi")
    assert (motion["lost"] == "").all()
    error = np.concatenate([motion["x_px"] - truth["x_px"].values, motion["y_px"] - truth["y_px"].values])
    assert np.sqrt(np.mean(error**2)) < 0.03
    np.testing.assert_allclose(motion["time"], truth["time"] - truth["time"][0], atol=1e-9)


@pytest.mark.long
def test_the_uncertainty_of_a_point_is_the_scatter_that_is_there(tmp_path):
    truth = make(tmp_path / "film.avi", light=0.0)
    motion = track(tmp_path / "film.avi")
    normal = (motion["x_px"] - truth["x_px"].values) / motion["x_error"].values
    assert 0.6 < normal.std() < 1.6


@pytest.mark.parametrize(
    "camera",
    [
        {"k1": 0.08},
        pytest.param({"exposure": 0.5, "light": 0.6}, marks=pytest.mark.long),
        pytest.param({"noise": 0.3, "blur": 1.5}, marks=pytest.mark.long),
    ],
)
def test_lens_blur_and_bad_light_do_little_harm(tmp_path, camera):
    truth = make(tmp_path / "film.avi", **camera)
    motion = track(tmp_path / "film.avi", tomllib.loads(truth.attrs["setup"]))
    scale = tomllib.loads(truth.attrs["setup"])["calibration"]["scale"]
    assert motion["x"].attrs["units"] == "1"
    assert np.sqrt(np.mean((motion["x"].values - truth["position"].values) ** 2)) * scale < 0.08


def test_several_masses_keep_their_identity_through_jumps_of_tens_of_pixels(tmp_path):
    class Jumping:
        t_end = 3.0
        system = None

        def at(self, t):
            t = np.asarray(t)
            return np.stack([(-1) ** i * 30 * np.sign(np.sin(3 * t + i)) for i in range(3)], axis=-1), None

    truth = film(Jumping(), tmp_path / "film.avi", frame_rate=10, scale=1.0, width=900, height=96, marker=16)
    jumps = np.abs(np.diff(truth["x_px"], axis=0)).max()
    motion = track(tmp_path / "film.avi", masses=3)
    assert jumps > 50
    assert (motion["lost"] == "").all()
    assert np.abs(motion["x_px"] - truth["x_px"].values).max() < 0.2


def test_a_folder_of_pictures_gives_what_the_film_gives(tmp_path):
    make(tmp_path / "film.avi", duration=1.0)
    make(tmp_path / "pictures", duration=1.0)
    one = track(tmp_path / "film.avi")
    other = track(tmp_path / "pictures", frame_rate=20.0)
    np.testing.assert_array_equal(one["x_px"], other["x_px"])
    np.testing.assert_allclose(one["time"], other["time"], atol=1e-9)


def test_pictures_of_any_depth_and_what_a_system_leaves_beside_them(tmp_path):
    path = tmp_path / "Fotos ∂ 日本"
    truth = make(path, duration=1.0)
    plain = track(path, frame_rate=20.0)
    (path / "._000000.png").write_bytes(b"what a Mac leaves on a stick")
    (path / ".hidden.png").write_bytes(b"")
    for file in path.glob("0*.png"):  # a camera of 10 bits
        cv2.imwrite(str(file), cv2.imread(str(file), cv2.IMREAD_GRAYSCALE).astype(np.uint16) * 4)
    deep = track(path, frame_rate=20.0)
    assert deep.sizes["time"] == truth.sizes["time"] == plain.sizes["time"]
    np.testing.assert_allclose(deep["x_px"], plain["x_px"], atol=0.01)
    assert "white at 1023" in deep.attrs["notes"][0]


def test_a_marker_behind_something_is_lost_and_found_again_never_invented(tmp_path):
    truth = make(tmp_path / "pictures", duration=2.0)
    for index in range(15, 22):
        path = tmp_path / "pictures" / f"{index:06d}.png"
        picture = cv2.imread(str(path))
        picture[20:70] = 120
        cv2.imwrite(str(path), picture)
    motion = track(tmp_path / "pictures", frame_rate=20.0, size=16)
    lost = motion["lost"].values[:, 0] != ""
    np.testing.assert_array_equal(np.flatnonzero(lost), np.arange(15, 22))
    assert set(motion["lost"].values[lost, 0]) == {"not found"}
    assert np.isnan(motion["x"].values[lost]).all()
    assert np.isnan(motion["x_error"].values[lost]).all()
    assert np.abs(motion["x_px"] - truth["x_px"].values)[~lost].max() < 0.15
    assert any("7 not found" in note for note in motion.attrs["notes"])


def test_slow_motion_is_put_right_by_the_rate_of_the_camera(tmp_path):
    make(tmp_path / "film.avi", duration=1.0)
    motion = track(tmp_path / "film.avi", frame_rate=240.0)
    np.testing.assert_allclose(np.diff(motion["time"]), 1 / 240, rtol=1e-6)
    assert motion.attrs["frame_rate"] == 240.0


def test_a_motion_file_says_where_it_comes_from(tmp_path):
    truth = make(tmp_path / "film.avi", duration=1.0)
    setup = Setup.of(tomllib.loads(truth.attrs["setup"]))
    track(tmp_path / "film.avi", setup, output=tmp_path / "motion.nc")
    with xr.open_dataset(tmp_path / "motion.nc", engine="h5netcdf") as motion:
        assert motion["x"].dims == ("time", "mass")
        assert {"x", "y", "x_error", "y_error", "lost"} <= set(motion)
        assert motion.attrs["source"].endswith("film.avi")
        assert Setup.of(tomllib.loads(motion.attrs["setup"])) == setup
        assert motion.attrs["calibration"]
        assert motion.attrs["command"].startswith("stickslip.track")


def test_the_check_film_shows_every_track(tmp_path):
    make(tmp_path / "film.avi", duration=1.0)
    motion = track(tmp_path / "film.avi", check=tmp_path / "check.avi")
    write_check_film(motion, tmp_path / "film.avi", tmp_path / "check")
    assert len(list((tmp_path / "check").glob("*.png"))) == 20
    capture = cv2.VideoCapture(str(tmp_path / "check.avi"))
    assert int(capture.get(cv2.CAP_PROP_FRAME_COUNT)) == 20
    ax = tracks_over_film(motion, tmp_path / "film.avi")
    assert ax.get_xlabel() == "x (px)"
    named = tracks_over_film(motion.assign_coords(name=("mass", ["slider"])), tmp_path / "film.avi")
    assert [text.get_text() for one in (ax, named) for text in one.get_legend().get_texts()] == ["mass 0", "slider"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["check", "check.avi", "film.avi"]


def test_a_batch_goes_on_where_it_was_and_past_a_bad_film(tmp_path):
    make(tmp_path / "a.avi", duration=1.0)
    make(tmp_path / "b.avi", duration=1.0)
    (tmp_path / "c.avi").write_bytes((tmp_path / "a.avi").read_bytes()[:300])
    films = [tmp_path / name for name in ("a.avi", "c.avi", "b.avi")]
    told = []
    first = track_films(films[:1], tmp_path / "out", size=16, progress=lambda *what: told.append(what))
    second = track_films(films, tmp_path / "out", size=16)
    assert list(first["state"]) == ["tracked"]
    assert told[-1] == ("done", 1, 1)
    assert list(second["state"]) == ["finished before", "failed", "tracked"]
    assert "c.avi" in second["message"][1]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["a.nc", "b.nc"]
    third = track_films(films[:1], tmp_path / "out", size=18)
    assert list(third["state"]) == ["tracked"]  # another setup


@pytest.mark.long
def test_templates_follow_what_has_no_colour(tmp_path):
    truth = make(tmp_path / "film.avi", duration=2.0)
    x, y = (round(float(truth[name][0, 0])) for name in ("x_px", "y_px"))
    motion = track(tmp_path / "film.avi", finder="template", templates=[[x - 20, y - 20, 41, 41]])
    moved = motion["x_px"].values - motion["x_px"].values[0]
    wanted = truth["x_px"].values - truth["x_px"].values[0]
    assert (motion["lost"] == "").all()
    assert (moved - wanted).std() < 0.07  # the template is a noisy picture itself
    assert motion["x_error"].max() < 0.1


def test_fiducials_carry_their_own_name(tmp_path):
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    folder = tmp_path / "pictures"
    folder.mkdir()
    random = np.random.default_rng(1)
    truth = []
    for index in range(12):
        picture = np.full((240, 480), 200, np.uint8)
        row = []
        for number, place in ((7, 60 + 15.3 * index), (3, 420 - 15.7 * index)):
            marker = cv2.aruco.generateImageMarker(dictionary, number, 48)
            shift = np.array([[1, 0, place - 23.5], [0, 1, 55 + 100 * (number == 3)]], float)
            ground = cv2.warpAffine(marker, shift, (480, 240), flags=cv2.INTER_LINEAR, borderValue=200)
            picture = np.minimum(picture, ground)
            row.append(place)
        noisy = cv2.GaussianBlur(picture, (0, 0), 0.8) + 3 * random.standard_normal(picture.shape)
        cv2.imwrite(str(folder / f"{index}.png"), np.clip(noisy, 0, 255).astype(np.uint8))
        truth.append(row)
    motion = track(folder, finder="fiducial", ids=[7, 3], frame_rate=10)
    error = motion["x_px"].values - np.array(truth)
    assert (motion["lost"] == "").all()
    assert np.sqrt(np.mean(error**2)) < 0.1  # what CORNER_ERROR says


def disc_film(path, x, rate, noise, code="FFV1"):
    """A film of a dark disc of 18 px at these places, drawn here by the share of each pixel that it covers."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*code), rate, (200, 60))
    random = np.random.default_rng(0)
    fine = (np.arange(0, 200, 0.125) + 0.0625) - 0.5
    for place in x:
        inside = (fine[None] - place) ** 2 + (fine[: 8 * 60, None] - 30) ** 2 < 81
        covered = inside.reshape(60, 8, 200, 8).mean((1, 3))
        grey = 190 - 150 * covered + noise * random.standard_normal((60, 200))
        writer.write(cv2.cvtColor(np.clip(np.round(grey), 0, 255).astype(np.uint8), cv2.COLOR_GRAY2BGR))
    writer.release()


@pytest.mark.parametrize(("shown", "code"), [(2, "FFV1"), (4, "FFV1"), (4, "MJPG"), (4, "mp4v")])
def test_pictures_that_a_film_holds_more_than_once_are_no_samples(tmp_path, shown, code):
    time = np.arange(0, 1, 1 / 60)
    x = 100 + 60 * np.sin(2 * np.pi * 2 * time)
    disc_film(tmp_path / "one.avi", x, 60, 2.0)
    pictures, capture = [], cv2.VideoCapture(str(tmp_path / "one.avi"))
    while (read := capture.read())[0]:
        pictures.append(read[1])
    writer = cv2.VideoWriter(str(tmp_path / "film.avi"), cv2.VideoWriter_fourcc(*code), 60 * shown, (200, 60))
    for picture in pictures:
        for _ in range(shown):
            writer.write(picture)
    writer.release()
    motion = track(tmp_path / "film.avi", check=tmp_path / "check")
    assert motion.sizes["time"] == time.size
    np.testing.assert_allclose(motion["time"], time, atol=1e-3)
    assert motion["frame"].values.tolist() == [*range(0, shown * time.size, shown)]
    assert motion.attrs["frame_rate"] == pytest.approx(60)
    assert np.abs(motion["x_px"].values[:, 0] - x).max() < 0.3
    assert f"{shown - 1} of {shown} pictures are copies" in " ".join(motion.attrs["notes"])
    assert "the camera took 60 pictures per second, not" in " ".join(motion.attrs["notes"])
    assert len([*(tmp_path / "check").iterdir()]) == time.size


@pytest.mark.parametrize("noise", [0.0, 2.0])
@pytest.mark.parametrize("code", ["FFV1", "mp4v"])
def test_pictures_of_rest_are_no_copies(tmp_path, noise, code):
    """A mass that lies still and slides: without noise its pictures at rest are equal, and samples all the same."""
    x = np.concatenate([60 + 20 * i + np.concatenate([np.zeros(24), np.linspace(0, 20, 7)[:-1]]) for i in range(5)])
    disc_film(tmp_path / "film.avi", x, 60, noise, code)
    motion = track(tmp_path / "film.avi")
    assert motion.sizes["time"] == x.size
    assert not any("copies of the one before" in note for note in motion.attrs["notes"])
