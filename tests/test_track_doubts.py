"""Films in which the finder may take the wrong thing: it says so, leaves it out, or asks."""

import numpy as np
import pytest

import stickslip as ss
from stickslip.errors import InputError
from stickslip.tracking import film, track
from stickslip.tracking.positions.scatter import scatter
from stickslip.tracking.positions.size_changes import hidden, one_sided
from stickslip.tracking.positions.standard_errors import errors_from_scatter

cv2 = pytest.importorskip("cv2")

SMALL = {"frame_rate": 20.0, "width": 320, "height": 96, "marker": 16.0}


def texture(step):
    """Belt texture alone, moving `step` px a picture."""
    rng = np.random.default_rng(0)
    grain = cv2.GaussianBlur(rng.standard_normal((120, 400)).astype(np.float32), (0, 0), 2.5)
    for index in range(16):
        part = 128 + 18 * grain[:, step * index : step * index + 240] / grain.std() + rng.normal(0, 3, (120, 240))
        yield np.clip(part, 0, 255).astype(np.uint8)


@pytest.mark.parametrize("step", [3, pytest.param(0, marks=pytest.mark.slow)])
def test_a_film_without_a_marker_is_refused(tmp_path, step):
    for index, picture in enumerate(texture(step)):
        cv2.imwrite(str(tmp_path / f"{index}.png"), picture)
    with pytest.raises(InputError, match="other spots in a picture look like a dark marker"):
        track(tmp_path, frame_rate=20.0)
    notes = track(tmp_path, frame_rate=20.0, size=10.0).attrs["notes"]
    assert any("look whether it is the marker" in note for note in notes)


def filmed(path, **camera):
    return film(ss.simulate(ss.paper.oscillator(0.15), 60.0), path, start=20.0, duration=3.0, **(SMALL | camera))


def test_a_marker_hidden_in_part_is_left_out(tmp_path):
    truth = filmed(tmp_path / "film")
    x, y = (truth[name].to_numpy()[:, 0] for name in ("x_px", "y_px"))
    for index in range(20, 30):
        path = tmp_path / "film" / f"{index:06d}.png"
        picture = cv2.imread(str(path))
        picture[round(y[index]) - 12 : round(y[index]) + 12, round(x[index]) + 3 : round(x[index]) + 30] = 215
        cv2.imwrite(str(path), picture)
    motion = track(tmp_path / "film", frame_rate=20.0)
    assert set(motion["lost"].to_numpy()[20:30, 0]) <= {"partly hidden", "not found"}
    seen = motion["lost"].to_numpy()[:, 0] == ""
    assert np.abs(motion["x_px"].to_numpy()[seen, 0] - x[seen]).max() < 0.2
    assert seen.sum() == 48  # one more before and after
    assert any("12 partly hidden" in note for note in motion.attrs["notes"])


def test_the_pictures_around_a_hidden_marker_are_left_out_and_single_noisy_ones_are_not():
    size = 20 + 0.05 * np.random.default_rng(0).standard_normal(200)
    size[50:60] -= [0.5, 1.0, 2.0, 4.0, 5.0, np.nan, 3.0, 1.5, 0.6, 0.4]
    size[60:62] += 0.4  # what hides it leaves, and seems a part of it
    size[120] -= 3.0
    assert np.flatnonzero(hidden(size)).tolist() == [49, 50, 51, 52, 53, 54, 56, 57, 58, 59, 60, 61, 62]
    size[150] -= 6.0
    assert hidden(size)[150]


def test_what_changes_the_size_at_one_side_shifts_the_centre_by_as_much_and_blur_does_not():
    size = 20 + 0.02 * np.random.default_rng(0).standard_normal(200)
    x, y = np.zeros(200), np.zeros(200)
    assert not one_sided(x, y, size).any()
    size[100:103] += [0.8, -1.0, 2.0]
    x[102:] = 3.5  # a step in which blur explains that it is larger
    np.testing.assert_allclose(one_sided(x, y, size)[99:104], [0, 0.8, 1.0, 0, 0], atol=0.1)


def test_a_clear_marker_raises_no_doubt_and_its_errors_stay(tmp_path):
    filmed(tmp_path / "film.avi")
    assert not track(tmp_path / "film.avi").attrs["notes"]


def test_what_compression_scatters_is_in_the_errors(tmp_path):
    truth = filmed(tmp_path / "film", noise=0.02)
    for path in (tmp_path / "film").iterdir():
        picture = cv2.imread(str(path))
        _, small = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 6])
        cv2.imwrite(str(path), cv2.imdecode(small, cv2.IMREAD_COLOR))
    motion = track(tmp_path / "film", frame_rate=20.0)
    normal = ((motion["x_px"] - truth["x_px"].values) / motion["x_error"]).to_numpy()
    assert np.std(normal) < 2
    assert any("the errors include that" in note for note in motion.attrs["notes"])


def test_the_slider_is_taken_and_not_a_clearer_spot_that_rests(tmp_path):
    truth = filmed(tmp_path / "film")
    for path in (tmp_path / "film").iterdir():
        picture = cv2.imread(str(path))
        cv2.circle(picture, (20, 80), 14, (205, 205, 205), -1, cv2.LINE_AA)
        cv2.circle(picture, (20, 80), 8, (5, 5, 5), -1, cv2.LINE_AA)
        cv2.imwrite(str(path), picture)
    motion = track(tmp_path / "film", frame_rate=20.0)
    assert np.abs(motion["x_px"].to_numpy() - truth["x_px"].to_numpy()).max() < 0.2
    assert any(
        "At (20, 80) px rests a spot that looks like a dark marker too" in note for note in motion.attrs["notes"]
    )
    rests = track(tmp_path / "film", frame_rate=20.0, start=[[20, 80]])
    assert rests["x_px"].std() < 0.1
    both = track(tmp_path / "film", frame_rate=20.0, masses=2, reference=[0])
    assert np.abs(both["x_px"].to_numpy() - truth["x_px"].to_numpy()).max() < 0.2


def test_a_leap_is_said(tmp_path):
    filmed(tmp_path / "film")
    for index in range(30, 33):  # the marker is gone, and one like it stands elsewhere
        picture = np.full((96, 320, 3), 205, np.uint8)
        cv2.circle(picture, (300, 80), 8, (40, 40, 40), -1, cv2.LINE_AA)
        cv2.imwrite(str(tmp_path / "film" / f"{index:06d}.png"), picture)
    motion = track(tmp_path / "film", frame_rate=20.0, max_jump=400.0)
    assert any("another spot may have been taken" in note for note in motion.attrs["notes"])


def dots(folder, sizes, frames=40, grey=60):
    """Dots of these diameters side by side on rows that swing together, on a belt with texture."""
    folder.mkdir()
    rng = np.random.default_rng(4)
    grain = cv2.GaussianBlur(rng.standard_normal((100, 700)).astype(np.float32), (0, 0), 2.5)
    for index in range(frames):
        picture = 170 + 6 * grain[:, 2 * index : 2 * index + 600] / grain.std() + rng.normal(0, 2, (100, 600))
        for number, size in enumerate(sizes):
            x, y = (50 + 90 * number + 25 * np.sin(index / 5)) * 16, 50 * 16
            level = grey - 50 if size > 20 else grey
            cv2.circle(picture, (round(x), y), round(8 * size), level, -1, cv2.LINE_AA, 4)
        cv2.imwrite(
            str(folder / f"{index:03d}.png"), np.clip(cv2.GaussianBlur(picture, (0, 0), 0.8), 0, 255).astype(np.uint8)
        )


def test_a_darker_dot_of_another_size_is_not_taken_for_one_of_the_markers(tmp_path):
    dots(tmp_path / "film", (14, 14, 32, 14, 14, 14))
    motion = track(tmp_path / "film", frame_rate=20.0, masses=5)
    np.testing.assert_allclose(motion["x_px"].to_numpy()[0], [50, 140, 320, 410, 500], atol=1)
    assert any("about 14" in note and "give size if that is wrong" in note for note in motion.attrs["notes"])


def test_texture_that_is_darker_for_some_pictures_is_not_taken_for_the_marker(tmp_path):
    dots(tmp_path / "film", (14,), grey=110)
    for index in range(14, 22):  # the marker is hidden, and a larger patch shows
        path = tmp_path / "film" / f"{index:03d}.png"
        picture = cv2.imread(str(path))
        picture[30:70, :120] = 170
        cv2.circle(picture, (140 + index, 50), 14, (60, 60, 60), -1, cv2.LINE_AA)
        cv2.imwrite(str(path), picture)
    motion = track(tmp_path / "film", frame_rate=20.0)
    seen = motion["lost"].to_numpy()[:, 0] == ""
    true = 50 + 25 * np.sin(np.arange(40) / 5)
    assert seen.sum() >= 30
    # the belt's texture moves a dot this faint by half a pixel; the patch lies 70 px away
    assert np.abs(motion["x_px"].to_numpy()[seen, 0] - true[seen]).max() < 2


def test_a_fixed_mark_takes_out_the_shake_of_the_camera(tmp_path):
    truth = filmed(tmp_path / "film", width=400, scale=40.0)
    shake = 1.5 * np.random.default_rng(2).standard_normal((60, 2))
    for index, path in enumerate(sorted((tmp_path / "film").iterdir())):
        picture = cv2.imread(str(path))
        cv2.circle(picture, (30, 44), 16, (205, 205, 205), -1, cv2.LINE_AA)
        cv2.circle(picture, (30, 44), 8, (40, 40, 40), -1, cv2.LINE_AA)
        moved = np.float32([[1, 0, shake[index, 0]], [0, 1, shake[index, 1]]])
        cv2.imwrite(str(path), cv2.warpAffine(picture, moved, (400, 96), flags=cv2.INTER_CUBIC, borderMode=1))
    alone = track(tmp_path / "film", frame_rate=20.0, masses=2)
    steady = track(tmp_path / "film", frame_rate=20.0, masses=2, reference=[0])
    assert steady.sizes["mass"] == 1

    def off(motion):
        rest = motion["x_px"].to_numpy()[:, -1] - truth["x_px"].to_numpy()[:, 0]
        return np.std(rest)

    assert off(alone) > 1
    assert off(steady) < 0.1
    assert any("The camera moves by" in note for note in steady.attrs["notes"])
    with pytest.raises(
        InputError, match=r"reference must hold some of the masses 0 to 1, and leave one that moves, got \[2\]"
    ):
        track(tmp_path / "film", frame_rate=20.0, masses=2, reference=[2])


@pytest.mark.parametrize("excess", [1.0, 1.5, 4.0])
def test_scatter_is_told_from_motion_over_the_stated_errors(excess):
    rng = np.random.default_rng(0)
    t = np.arange(800) / 40
    x = 30 * np.sin(2 * np.pi * t) + 0.01 * excess * rng.standard_normal(800)
    assert np.median(scatter(x, np.full(800, 0.01), t)) == pytest.approx(excess, rel=0.15)


def test_scatter_is_not_given_where_pictures_do_not_follow_the_motion():
    law = ss.laws.StaticKinetic(break_away=1.0, kinetic=0.5)
    orbit = ss.simulate(ss.Oscillator(damping=0.04, drive_velocity=0.4, law=law), 140.0)
    for pictures, told in ((17, False), (60, True)):  # in a period of the free mass
        t = np.arange(0, 120, 2 * np.pi / pictures)
        x = 150 * orbit.at(20 + t)[0] + 0.01 * np.random.default_rng(0).standard_normal(t.size)
        found = scatter(x, np.full(t.size, 0.01), t)
        assert (np.median(found) == pytest.approx(1, rel=0.2)) if told else np.isnan(found).all()


def test_a_coordinate_that_rests_has_the_errors_of_the_other_where_pictures_are_copied():
    rng, t = np.random.default_rng(0), np.arange(600) / 40
    x = 30 * np.sin(2 * np.pi * t) + 0.05 * rng.standard_normal(600)
    y = 20 + np.repeat(0.05 * rng.standard_normal(10), 60) + 0.005 * rng.standard_normal(600)
    errors = {}
    for copied in (False, True):
        pair = np.full(600, 0.01), np.full(600, 0.01)
        errors_from_scatter(0, t, copied, (x, pair[0]), (y, pair[1]))
        errors[copied] = pair
    assert np.median(errors[False][1]) == 0.01
    assert np.mean(np.abs(y - 20) < 1.96 * errors[True][1]) > 0.9
    assert np.mean(np.abs(x - 30 * np.sin(2 * np.pi * t)) < 1.96 * errors[False][0]) > 0.92
