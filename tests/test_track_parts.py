"""The parts of tracking: times, response maps, blobs, identities, calibration, import."""

import struct

import numpy as np
import pytest

from stickslip import _core
from stickslip.errors import InputError
from stickslip.tracking import Calibration, Film, Lens, read_calibration, read_osp, track
from stickslip.tracking.finding.blobs import find_blobs
from stickslip.tracking.finding.detections import Detections
from stickslip.tracking.finding.response_map import response_map
from stickslip.tracking.finding.window import WindowedFinder
from stickslip.tracking.linking import find_markers
from stickslip.tracking.scale.ruler import find_marks

cv2 = pytest.importorskip("cv2")


def disc(x, y, radius=10.0, size=(80, 120), ground=200.0, spot=40.0):
    rows, columns = np.mgrid[: size[0], : size[1]]
    share = np.clip(radius - np.hypot(columns - x, rows - y) + 0.5, 0, 1)
    return cv2.GaussianBlur((ground + share * (spot - ground)).astype(np.float32), (0, 0), 0.8)


def film_of(path, count=6):
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"mp4v"), 25.0, (120, 80), True)
    for index in range(count):
        writer.write(np.repeat(disc(40.0 + 4 * index, 40.0)[..., None], 3, axis=2).astype(np.uint8))
    writer.release()


def grow(data, path, more):
    """Add bytes at the end of a box of an MP4 file, all the boxes around it growing too."""
    position, end, sizes = 0, len(data), []
    for name in path:
        at = position
        while data[at + 4 : at + 8] != name:
            at += struct.unpack(">I", data[at : at + 4])[0]
            assert at < end
        sizes.append(at)
        end = at + struct.unpack(">I", data[at : at + 4])[0]
        position = at + 8
    data = bytearray(data[:end] + more + data[end:])
    for at in sizes:
        data[at : at + 4] = struct.pack(">I", struct.unpack(">I", data[at : at + 4])[0] + len(more))
    return data, sizes[-1]


def uneven(path):
    """Rewrite the time table of an MP4 film: two pictures of one length, then shorter ones."""
    data = path.read_bytes()
    assert data.index(b"mdat") < data.index(b"moov")  # so that offsets to the pictures stay
    stts = data.index(b"stts") - 4
    count, step = struct.unpack(">II", data[stts + 16 : stts + 24])
    data, stts = grow(
        data, [b"moov", b"trak", b"mdia", b"minf", b"stbl", b"stts"], struct.pack(">II", count - 2, step // 2)
    )
    data[stts + 12 : stts + 24] = struct.pack(">III", 2, 2, step)
    path.write_bytes(data)


def test_the_time_stamps_of_a_variable_frame_rate_are_kept(tmp_path):
    path = tmp_path / "film.mp4"
    film_of(path)
    np.testing.assert_allclose([time for time, _ in Film(path)], 0.04 * np.arange(6), atol=1e-6)
    uneven(path)
    times = [time for time, _ in Film(path)]
    np.testing.assert_allclose(np.diff(times), [0.04, 0.04, 0.02, 0.02, 0.02], atol=1e-4)
    motion = track(path, size=20)
    assert any("not evenly spaced" in note for note in motion.attrs["notes"])
    np.testing.assert_allclose(np.diff(motion["x"].values[:, 0]), 4, atol=0.1)


def test_a_blob_is_found_to_a_hundredth_of_a_pixel():
    random = np.random.default_rng(3)
    errors = []
    for _ in range(60):
        x, y = 60 + random.uniform(-1, 1), 40 + random.uniform(-1, 1)
        found = find_blobs((255 - np.rint(disc(x, y))).astype(np.uint8))
        assert len(found) == 1
        errors += [found.x[0] - x, found.y[0] - y]
        assert found.size[0] == pytest.approx(20, rel=0.05)
    assert np.std(errors) < 0.01
    assert abs(np.mean(errors)) < 0.005


@pytest.mark.parametrize("shape", [(1, 7), (5, 9), (64, 61)])
def test_a_picture_is_blurred_as_opencv_does_it(shape):
    rng = np.random.default_rng(0)
    for sigma in (0.8, 1.0, 2.5, *rng.uniform(0.8, 12, 40)):
        picture = rng.integers(0, 256, shape, dtype=np.uint8)
        np.testing.assert_array_equal(_core.blurred(picture, sigma), cv2.GaussianBlur(picture, (0, 0), sigma))


def test_uneven_light_does_not_hide_a_blob():
    picture = np.minimum(disc(30, 40), disc(90, 40)) * np.linspace(1.0, 0.25, 120)
    found = find_blobs((255 - picture).astype(np.uint8), size=20).best(2)
    np.testing.assert_allclose(np.sort(found.x), [30, 90], atol=0.5)


def test_a_blob_at_the_edge_is_known_to_be_cut_off():
    found = find_blobs((255 - disc(4, 40)).astype(np.uint8))
    assert found.cut_x[0]
    assert not found.cut_y[0]


def test_likeness_of_a_colour_gives_nothing_for_grey_and_other_hues():
    pixels = np.array([[[30, 160, 40], [200, 200, 200], [40, 40, 200], [200, 60, 50]]], np.uint8)
    green = response_map(pixels, "green")[0]
    assert green[0] > 60
    np.testing.assert_allclose(green[1:], 0)


def film_of_points(paths):
    """Detections of points, each row of `paths` a picture."""
    return [
        Detections.of([(x, y, 0.01, 0.01, 20, 0.02, 100, 100, -1, 0, 0) for x, y in row if np.isfinite(x)])
        for row in paths
    ]


def test_identities_survive_a_common_jump_and_a_gap():
    time = np.arange(40)
    shift = np.where(time % 2, 35.0, 0.0)
    paths = np.stack([np.stack([100.0 * i + 50 + shift, np.full(40, 50.0)], axis=1) for i in range(5)], axis=1)
    paths[10:14, 2] = np.nan
    tracks = find_markers(film_of_points(paths), 5)
    assert [len(track.frames) for track in tracks] == [40, 40, 36, 40, 40]
    detections = film_of_points(paths)
    for number, found in enumerate(tracks):
        x = [detections[frame].x[index] for frame, index in zip(found.frames, found.indices, strict=True)]
        np.testing.assert_allclose(x, paths[found.frames, number, 0])


def test_two_that_cross_keep_their_ways():
    time = np.linspace(0, 1, 30)
    paths = np.stack(
        [np.stack([50 + 400 * time, 50 + 10 * time], axis=1), np.stack([450 - 400 * time, 55 - 10 * time], axis=1)],
        axis=1,
    )
    detections = film_of_points(paths)
    tracks = find_markers(detections, 2, start=((50, 50), (450, 55)))
    for number, found in enumerate(tracks):
        x = [detections[frame].x[index] for frame, index in zip(found.frames, found.indices, strict=True)]
        np.testing.assert_allclose(x, paths[:, number, 0])


def way_of(kind, t, n, shake):
    """Columns of marker `n` over the pictures t; each of them has 100 px of its own."""
    return {
        "swinging": 40 * np.sin(0.35 * t + n),
        "jumping": 16.0 * (-1) ** (t // 9) + 0.3 * (t % 9),
        "jumping once": 40.0 * (t > 40 + 5 * n) - 20,
        "shaken": 15 * np.sin(0.3 * t + n) + shake,
        "slow": 0.4 * t - 20,
    }[kind]


@pytest.mark.parametrize("masses", [2, 5])
@pytest.mark.parametrize("size", [8.0, 20.0])
@pytest.mark.parametrize("way", ["swinging", "jumping", "jumping once", "shaken", "slow"])
def test_small_and_fast_markers_are_told_from_clutter_with_no_option_set(way, size, masses):
    """Jumps of up to five diameters beside spots that rest, spots that flash up, and markers whose look changes."""
    random = np.random.default_rng(7)
    time = np.arange(100)
    shake = 3 * np.cumsum(random.standard_normal(len(time)))  # a camera shakes all alike
    truth = np.stack([150 + 100 * n + way_of(way, time, n, shake) for n in range(masses)], axis=1)
    film = []
    for row in truth:
        rows = [(x, 100.0, size, 150.0) for x in row]
        rows += [(60.0 + 130 * i, 30.0 + 140 * (i % 2), 14.0, 110.0) for i in range(4)]
        flashes = random.uniform((0, 0), (masses * 100 + 200, 200), (random.poisson(2), 2))
        rows += [(x, y, size * np.exp(0.5 * random.standard_normal()), 60.0) for x, y in flashes]
        look = np.exp(0.06 * random.standard_normal((len(rows), 2)))
        film.append(
            Detections.of(
                [
                    (x, y, 0.05, 0.05, wide * a, 0.1, high * b, high * b * wide**0.25, -1, 0, 0)
                    for (x, y, wide, high), (a, b) in zip(rows, look, strict=True)
                ]
            )
        )
    tracks = find_markers(film, masses)
    assert len(tracks) == masses
    wrong = 0
    for number, found in enumerate(tracks):
        seen = zip(found.frames, found.indices, strict=True)
        right = sum(film[frame].x[place] == truth[frame, number] for frame, place in seen)
        wrong += len(time) - right
    assert wrong <= 0.01 * masses * len(time)


def test_two_points_give_scale_rotation_and_origin(tmp_path):
    table = {"points": [[100, 200], [100 + 80, 200 - 60]], "length": 5, "unit": "cm"}
    calibration = read_calibration(table, tmp_path)
    np.testing.assert_allclose(calibration.to_world(180, 140), (0.05, 0), atol=1e-12)
    np.testing.assert_allclose(calibration.to_world(100 - 60, 200 - 80), (0, 0.05), atol=1e-12)  # to its left
    assert calibration.scale_error == pytest.approx(0.005)
    again = Calibration.from_dict(calibration.to_dict())
    assert again == calibration


def test_errors_follow_the_scale(tmp_path):
    calibration = read_calibration({"scale": 1000.0, "angle": 90.0}, tmp_path)
    one = np.ones(1)
    x_error, y_error = calibration.errors(one, one, 0.2 * one, 0.1 * one)
    np.testing.assert_allclose([x_error[0], y_error[0]], [1e-4, 2e-4])


def test_what_an_edge_takes_is_said_of_the_other_coordinate_too(tmp_path):
    for index in range(6):
        cv2.imwrite(str(tmp_path / f"{index}.png"), disc(40.0 + 4 * index, 4.0).astype(np.uint8))
    # half of what is seen of the marker, 17.7 px wide as a disc, times the sine of the angle, over 1000 px per m
    for angle, said in ((0.0, "cut off at the edge."), (5.0, "the axis leans, so x is known to ± 0.00077 m only.")):
        motion = track(tmp_path, frame_rate=1.0, calibration={"scale": 1000.0, "angle": angle})
        assert np.isnan(motion["y"]).all()
        assert np.isfinite(motion["x"]).all()
        assert motion.attrs["notes"][-1].endswith(said)


def test_marks_of_a_curved_ruler_are_found_and_followed(tmp_path):
    pitch = 40 + 0.02 * np.arange(700)
    place = np.concatenate([[0], np.cumsum(1 / pitch)])[:700]
    picture = np.where(np.floor(place).astype(int) % 2, 30, 220)[None, :].repeat(60, axis=0).astype(np.uint8)
    edges = (np.flatnonzero(np.diff(picture[0].astype(int))) + 0.5)[:12]
    noisy = cv2.GaussianBlur(picture, (0, 0), 1.0)
    cv2.imwrite(str(tmp_path / "ruler.png"), noisy)
    places, numbers = find_marks(
        cv2.imread(str(tmp_path / "ruler.png")), (edges[0], 30), (edges[1] + 2, 30), (edges[-1], 30)
    )
    np.testing.assert_array_equal(numbers, np.arange(12))
    np.testing.assert_allclose(places[:, 0], edges, atol=0.1)
    table = {
        "ruler": "ruler.png",
        "first": [edges[0], 30],
        "second": [edges[1], 30],
        "last": [edges[-1], 30],
        "pitch": 1,
        "unit": "cm",
    }
    calibration = read_calibration(table, tmp_path)
    x, _ = calibration.to_world(edges, 30 * np.ones(12))
    np.testing.assert_allclose(100 * np.diff(x), 1, atol=0.02)


def test_a_checker_board_gives_plane_and_lens(tmp_path):
    lens = Lens(centre=(319.5, 239.5), radius=400.0, k1=0.06)
    plane = np.array([[0.021, 0.002, -1.8], [0.001, -0.022, 8.2], [1e-4, 5e-5, 1.0]])  # px to squares
    rows, columns = np.mgrid[:480, :640].astype(float)
    fine = np.zeros((480, 640))
    for dx in (-0.25, 0.25):
        for dy in (-0.25, 0.25):
            world = np.concatenate(
                [lens.straighten(np.stack([columns + dx, rows + dy], -1)), np.ones((480, 640, 1))], -1
            )
            world = world @ plane.T
            u, v = world[..., 0] / world[..., 2], world[..., 1] / world[..., 2]
            black = (np.floor(u) + np.floor(v)).astype(int) % 2 == 0
            inside = (u > 0) & (u < 9) & (v > 0) & (v < 7)
            fine += np.where(inside & black, 20, 230) / 4
    cv2.imwrite(str(tmp_path / "board.png"), cv2.GaussianBlur(fine, (0, 0), 0.7))
    calibration = read_calibration({"checker": "board.png", "corners": [8, 6], "square": 10, "unit": "mm"}, tmp_path)
    assert calibration.lens.k1 == pytest.approx(0.06, abs=0.01)
    spots = np.array([[150.0, 120.0], [500.0, 130.0], [300.0, 350.0], [450.0, 300.0]])
    world = np.concatenate([lens.straighten(spots), np.ones((4, 1))], 1) @ plane.T
    truth = world[:, :2] / world[:, 2:] * 0.01
    x, y = calibration.to_world(spots[:, 0], spots[:, 1])
    apart = np.stack([x, y], 1) - truth
    np.testing.assert_allclose(apart - apart.mean(axis=0), 0, atol=2e-5)  # 0.02 mm of 80 mm


def test_the_size_of_the_marker_gives_the_scale(tmp_path):
    film_of(tmp_path / "film.mp4")
    motion = track(tmp_path / "film.mp4", size=20, calibration={"marker_size": 10, "unit": "mm"})
    assert motion["x"].attrs["units"] == "m"
    np.testing.assert_allclose(np.diff(motion["x"].values[:, 0]), 0.002, rtol=0.08)


def test_text_tables_of_tracker_are_read(tmp_path):
    path = tmp_path / "export.txt"
    path.write_text("#multi:\ncart\t\t\tbob\nt\tx\ty\tt\tx\ty\n0,0\t1,5\t2\t0,0\t3\t4\n0,1\t1,6\t2\t0,1\t\t\n")
    motion = read_osp(path)
    assert list(motion["name"].values) == ["cart", "bob"]
    np.testing.assert_allclose(motion["x"], [[1.5, 3], [1.6, np.nan]])
    assert motion["lost"].values[1, 1] == "not in the table"
    path.write_text("t,x,y\n0,1,2\n0.1,oops,2\n")
    with pytest.raises(InputError, match=r"row 3, column 'x' must be a number, got 'oops'"):
        read_osp(path)
    path.write_text("t,x,y\n0,1,2\n0,1,2\n")
    with pytest.raises(InputError, match="row 3: time 0 s does not follow 0 s"):
        read_osp(path)


def test_windows_find_what_whole_pictures_show_and_look_at_few_of_them():
    rng = np.random.default_rng(0)
    places = [(60 + 45 * np.sin(i / 9), 40 + 0.1 * i) for i in range(150)]
    pictures = [np.clip(disc(*at) + rng.normal(0, 2, (80, 120)), 0, 255).astype(np.uint8) for at in places]
    pictures = [np.repeat(picture[..., None], 3, axis=2) for picture in pictures]
    looks = []

    def response(picture):
        looks.append(picture.size)
        return 255 - picture[..., 0]

    def followed(windows):
        looks.clear()
        rows = [found for found, _ in WindowedFinder(response, 1, size=20, windows=windows)(iter(pictures))]
        return np.array([(float(row.x[0]), float(row.y[0])) for row in rows]), sum(looks)

    (near, few), (whole, many) = followed(True), followed(False)
    assert np.abs(near - whole).max() < 0.02
    assert np.abs(near - places).max() < 0.1
    assert few < 0.5 * many


def test_a_rival_that_comes_later_is_seen_from_its_first_picture_on():
    alone = [np.clip(disc(40 + 20 * np.sin(i / 9), 40), 0, 255).astype(np.uint8) for i in range(270)]
    both = [
        np.minimum(picture, disc(100, 40).astype(np.uint8)) if i >= 150 else picture for i, picture in enumerate(alone)
    ]
    counts = {}
    for name, pictures in (("alone", alone), ("both", both)):
        found = list(WindowedFinder(lambda picture: 255 - picture, 1, size=20)(iter(pictures)))
        counts[name] = [len(rows) for rows, _ in found]
        assert sum(whole for _, whole in found) < 5 or name == "both"
    assert counts["alone"] == 270 * [1]
    assert counts["both"] == 150 * [1] + 120 * [2]


def test_where_a_marker_is_lost_whole_pictures_are_looked_at_until_it_is_back():
    pictures = [np.repeat(disc(40 + i, 40).astype(np.uint8)[..., None], 3, axis=2) for i in range(40)]
    pictures[25] = np.full_like(pictures[0], 255)
    found = list(WindowedFinder(lambda picture: 255 - picture[..., 0], 1, size=20)(iter(pictures)))
    assert [i for i, (rows, _) in enumerate(found) if not len(rows)] == [25]
    assert all(whole for _, whole in found[:28])
    assert not any(whole for _, whole in found[30:])


def test_the_parts_above_all_heights_are_those_that_each_cut_shows():
    """Against OpenCV, one cut after the other."""
    random = np.random.default_rng(5)
    rows, columns = np.mgrid[:90, :140]
    picture = random.normal(60, 12, rows.shape)
    for _ in range(12):
        x, y, radius = random.uniform(0, 140), random.uniform(0, 90), random.uniform(2, 12)
        picture += random.uniform(20, 90) * (np.hypot(columns - x, rows - y) < radius)
    picture = np.clip(picture, 0, 255).astype(np.uint8)
    heights = np.linspace(40, 200, 16) + 0.3
    levels = _core.spot_levels(picture, heights.tolist(), (4.0, 2000.0))
    kept, above = 0, None
    for height, level in zip(heights[::-1], levels, strict=True):
        _, labels, stats, _ = cv2.connectedComponentsWithStats((picture > height).astype(np.uint8), connectivity=8)
        expected = {}
        for label, (left, top, width, high, area) in enumerate(stats.tolist()):
            narrow = min(width, high) / max(width, high)
            if label and 4 <= area <= 2000 and area >= 0.45 * width * high and narrow >= 0.25:
                expected[label] = (area, left, top, width, high)
        assert sorted(spot[:5] for spot in level) == sorted(expected.values())
        if above is not None:
            before, before_labels, before_expected = above
            for spot in before:
                (label,) = [one for one, its in before_expected.items() if its == spot[:5]]
                around = int(
                    labels[np.argwhere(before_labels == label)[0][0], np.argwhere(before_labels == label)[0][1]]
                )
                assert expected.get(around) == (level[spot[5]][:5] if spot[5] >= 0 else None)
        kept, above = kept + len(level), (level, labels, expected)
    assert kept > 60


def test_a_height_above_everything_has_no_parts():
    assert _core.spot_levels(np.full((3, 4), 9, np.uint8), [9.0], (1.0, 99.0)) == [[]]
    assert _core.spot_levels(np.full((3, 4), 10, np.uint8), [9.0], (1.0, 99.0)) == [[(12, 0, 0, 4, 3, -1)]]
