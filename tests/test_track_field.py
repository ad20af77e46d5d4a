"""Fields of displacement and strain of a texture whose motion is known in closed form."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from stickslip.cli.main import main
from stickslip.errors import InputError
from stickslip.files.netcdf import read_tree
from stickslip.tracking import displacement_field, field_plot

cv2 = pytest.importorskip("cv2")

HIGH, WIDE = 160, 240


class Texture:
    """A sum of waves, averaged over each pixel exactly: a wave over a square pixel is the wave times two sincs."""

    def __init__(self):
        rng = np.random.default_rng(7)
        self.waves = rng.uniform(-0.16, 0.16, (2, 160))  # periods a pixel, x and y
        self.phase = rng.uniform(0, 2 * np.pi, 160)

    def __call__(self, matrix=((1, 0), (0, 1)), shift=(0.0, 0.0), noise=1.0, seed=0):
        """The picture in which the point p about the middle has come to matrix p + shift (a number or one for each row)."""
        back = np.linalg.inv(matrix)
        waves = back.T @ self.waves
        rows, columns = np.mgrid[:HIGH, :WIDE].astype(float)
        x, y = columns - (WIDE - 1) / 2 - shift[0], rows - (HIGH - 1) / 2 - shift[1]
        found = np.zeros((HIGH, WIDE))
        for (kx, ky), phase in zip(waves.T, self.phase, strict=True):
            found += np.sinc(kx) * np.sinc(ky) * np.cos(2 * np.pi * (kx * x + ky * y) + phase)
        found = 128 + 40 * found / np.sqrt(80) + noise * np.random.default_rng(seed).standard_normal((HIGH, WIDE))
        return np.clip(np.rint(found), 0, 255).astype(np.uint8)


@pytest.fixture(scope="module")
def texture():
    return Texture()


def write(folder, pictures):
    folder.mkdir()
    for number, picture in enumerate(pictures):
        assert cv2.imwrite(str(folder / f"{number}.png"), picture)
    return folder


def off(field, matrix=((1, 0), (0, 1)), shift=(0.0, 0.0)):
    """Errors of u and v in the last picture, and those over the stated ones."""
    x, y = np.meshgrid(field["x"] - (WIDE - 1) / 2, field["y"] - (HIGH - 1) / 2)
    moved = np.einsum("ij,jkl->ikl", np.asarray(matrix) - np.eye(2), [x, y])
    found = np.stack([field[name].to_numpy()[-1] - one - d for name, one, d in zip("uv", moved, shift, strict=True)])
    return found, found / np.stack([field[f"{name}_error"].to_numpy()[-1] for name in "uv"])


def held(share):
    """That errors over the stated ones scatter by about one; neighbours share pixels, so these are fewer than they seem."""
    assert 0.7 < np.sqrt(np.mean(np.square(share))) < 1.3


def test_one_part_of_a_contact_slips_and_the_other_sticks(texture, tmp_path):
    across = np.where(np.arange(WIDE) < WIDE // 2, 0.37, 0.0)  # the left half has moved
    pictures = [texture(seed=0), texture(shift=(0.5 * across, 0.0), seed=1), texture(shift=(across, 0.0), seed=2)]
    field = displacement_field(write(tmp_path / "film", pictures), frame_rate=100.0, size=31, spacing=20)
    assert field["u"].dims == ("time", "y", "x")
    truth = np.where(field["x"] < WIDE / 2, 0.37, 0.0)
    clear = np.abs(field["x"] - WIDE / 2) > 16  # pieces that lie on one side
    error, over = off(field, shift=(truth, 0.0))
    assert np.sqrt(np.mean(error[..., clear] ** 2)) < 0.005
    held(over[..., clear])
    # what lies across the edge of the slip is not a piece that moves: that is seen in what is left over
    left = field["residual"].to_numpy()[-1]
    assert left[:, ~clear].min() > 1.5 * np.median(left[:, clear])


def test_a_uniform_strain_of_a_thousandth(texture, tmp_path):
    matrix = np.array([[1.001, 0.0], [0.0, 0.9997]])
    source = write(tmp_path / "film", [texture(seed=0), texture(matrix, seed=1)])
    field = displacement_field(source, frame_rate=1.0, size=41, spacing=20).isel(time=-1)
    error, over = off(field.expand_dims("time"), matrix)
    assert np.sqrt(np.mean(error**2)) < 0.005
    held(over)
    for name, true in (("exx", 1.001**2 / 2 - 0.5), ("eyy", 0.9997**2 / 2 - 0.5), ("exy", 0.0)):
        apart = field[name] - true
        assert abs(float(apart.mean())) < 1e-4
        held((apart / field[f"{name}_error"]).to_numpy())


def test_a_rotation_is_no_strain(texture, tmp_path):
    def turned(angle):
        return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])

    angles = [0.0, 0.06, 0.12, 0.18]  # more than one step would find
    source = write(tmp_path / "film", [texture(turned(angle), seed=i) for i, angle in enumerate(angles)])
    field = displacement_field(source, frame_rate=1.0, region=[60, 30, 120, 100], size=31, spacing=20)
    error, over = off(field, turned(angles[-1]))
    assert np.sqrt(np.mean(error**2)) < 0.005
    held(over)
    assert abs(float(field["rotation"][-1].mean()) - angles[-1]) < 1e-4
    assert abs(float(field["exx"][-1].mean())) < 1e-4
    held((field["exy"] / field["exy_error"]).to_numpy()[1:])


def test_what_is_plain_or_gone_is_empty_and_told(texture, tmp_path):
    plain = texture(seed=0)
    plain[:, :80] = 128
    gone = plain.copy()
    gone[:, 160:] = 255
    field = displacement_field(write(tmp_path / "film", [plain, gone]), frame_rate=1.0, size=31, spacing=20)
    assert np.isnan(field["u"].sel(x=slice(None, 60))).all()
    assert np.isnan(field["u"][1].sel(x=slice(180, None))).all()
    assert np.isfinite(field["u"].sel(x=slice(100, 140))).all()
    assert any("too little texture" in note for note in field.attrs["notes"])
    assert any("were not found" in note for note in field.attrs["notes"])


@pytest.mark.long
def test_the_command_writes_field_and_picture(texture, tmp_path, capsys):
    source = write(tmp_path / "film", [texture(seed=0), texture(shift=(0.4, 0.1), seed=1)])
    out, plot = tmp_path / "field.nc", tmp_path / "field.png"
    given = ["--field", "40", "--size", "31", "--frame-rate", "50", "-o", str(out), "--plot", str(plot)]
    assert main(["track", str(source), *given]) == 0
    assert plot.stat().st_size > 1000
    assert "pieces" in capsys.readouterr().out
    field = read_tree(out).to_dataset()
    assert abs(float(field["u"][1].mean()) - 0.4) < 0.005
    assert main(["track", str(source), *given, "--marker", "bright"]) == 2
    assert "a field takes" in capsys.readouterr().err


def test_the_picture_shows_the_field(texture, tmp_path):
    source = write(tmp_path / "film", [texture(seed=0), texture(shift=(0.4, 0.1), seed=1)])
    field = displacement_field(source, frame_rate=1.0, size=31, spacing=40)
    ax = field_plot(field, "v")
    np.testing.assert_allclose(ax.collections[0].get_array().ravel(), field["v"][1].to_numpy().ravel())
    assert ax.get_xlabel() == "x (px)"
    plt.close(ax.figure)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"spacing": 0}, "spacing must be"),
        ({"size": 4}, "expected pieces of at least"),
        ({"size": 400}, "no piece of 400 px lies in"),
        ({"masses": 2}, "a field takes"),
        ({"calibration": {"scale": 4.0}}, "a field takes"),
    ],
)
def test_what_makes_no_field_is_refused(texture, tmp_path, options, said):
    source = write(tmp_path / "film", [texture(seed=0)])
    with pytest.raises(InputError, match=said):
        displacement_field(source, frame_rate=1.0, **options)
