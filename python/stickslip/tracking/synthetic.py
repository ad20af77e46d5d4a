"""A synthetic rig: films of masses on a moving belt, made from an orbit, with every place known."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

from stickslip.errors import InputError, number
from stickslip.files.arrays import Array
from stickslip.tracking.motion import motion_dataset
from stickslip.tracking.scale.calibration import Calibration, Lens
from stickslip.tracking.setup import Setup
from stickslip.tracking.video.source import Picture
from stickslip.tracking.video.vision import vision
from stickslip.tracking.video.writing import write_pictures

if TYPE_CHECKING:
    import xarray as xr

Grey = npt.NDArray[np.float32]

BLOCK, MARKER, DRIVE, WALL = 205.0, 40.0, 120.0, 150.0
"""Grey levels of the masses, their markers, the belt and what is behind it."""


class Orbit(Protocol):
    """What is filmed: a motion known at any time."""

    t_end: float
    system: Any

    def at(self, t: npt.ArrayLike) -> tuple[Any, Any]:
        """Position and velocity, (n,) or (n, masses)."""
        ...


@dataclass(frozen=True, kw_only=True)
class Camera:
    """How a film is taken.

    Parameters
    ----------
    frame_rate : pictures per unit of time (per second in SI).
    width, height : px.
    scale : px per unit of length; default: the motion fills half of the width that a mass has.
    marker : diameter of a mass's dark marker in px.
    noise : white noise, given as the distance in px by which it shifts one pixel's reading of an edge: its standard
        deviation in grey levels is `noise` times the steepest slope of a marker's rim.
    blur : standard deviation of the lens blur in px.
    k1 : radial lens distortion, see :class:`stickslip.tracking.scale.calibration.Lens`.
    light : how much darker the picture is at the dim corner than at the bright one, 0 to 0.8.
    exposure : share of the time between pictures during which the shutter is open, 0 to 1.
    seed : of the noise and the belt's texture.
    """

    frame_rate: float = 20.0
    width: int = 640
    height: int = 200
    scale: float | None = None
    marker: float = 24.0
    noise: float = 0.1
    blur: float = 0.8
    k1: float = 0.0
    light: float = 0.3
    exposure: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("frame_rate", "width", "height", "marker"):
            if not number(name, getattr(self, name), "film") > 0:
                raise InputError(f"film: {name} must be a positive number, got {getattr(self, name):g}")
        for name, most in (("noise", 5.0), ("blur", 20.0), ("light", 0.8), ("exposure", 1.0)):
            if not 0 <= number(name, getattr(self, name), "film") <= most:
                raise InputError(f"film: {name} must lie in [0, {most:g}], got {getattr(self, name):g}")
        if self.scale is not None and not number("scale", self.scale, "film") > 0:
            raise InputError(f"film: scale must be a positive number of px per length, got {self.scale:g}")
        if not -0.2 <= number("k1", self.k1, "film") <= 0.2:
            raise InputError(f"film: k1 must lie in [-0.2, 0.2], got {self.k1:g}")
        if self.height < 6 * self.marker or self.width < 8 * self.marker:
            raise InputError(
                f"film: a marker of {self.marker:g} px needs a picture of {8 * self.marker:g} x {6 * self.marker:g} px at "
                f"least, got {self.width} x {self.height}"
            )

    @property
    def grey_noise(self) -> float:
        """Standard deviation of the noise in grey levels."""
        return self.noise * (BLOCK - MARKER) / (math.sqrt(2 * math.pi) * math.hypot(self.blur, math.sqrt(1 / 12)))

    @property
    def lens(self) -> Lens:
        """The lens."""
        centre = ((self.width - 1) / 2, (self.height - 1) / 2)
        return Lens(centre=centre, radius=math.hypot(self.width, self.height) / 2, k1=self.k1)


def film(
    orbit: Orbit,
    path: str | Path | None = None,
    *,
    start: float = 0.0,
    duration: float | None = None,
    progress: Callable[[str, int, int], object] | None = None,
    **camera: Any,
) -> xr.Dataset:
    """Film an orbit: light blocks with a dark round marker on a textured belt that runs at the drive velocity.

    Parameters
    ----------
    orbit : from :func:`stickslip.simulate`.
    path : where the film goes: ``.avi`` or ``.mkv`` (FFV1, lossless), ``.mp4``, or a folder for PNG; None for the truth
        alone.
    start, duration : the part of the orbit that is filmed; default all of it.
    progress : called with (what, pictures done, pictures in all).
    camera : fields of :class:`Camera`: frame_rate, width, height, scale, marker, noise, blur, k1, light, exposure, seed.

    Returns
    -------
    The truth as a motion, with ``x_px``, ``y_px`` the centres in the picture (in the middle of the exposure), x the
    position of the orbit, and in ``attrs["setup"]`` a TOML document with which :func:`stickslip.track` finds them.

    Raises
    ------
    InputError
        for a camera that cannot be, a part outside of the orbit, masses that leave the picture.

    Examples
    --------
    >>> import stickslip as ss
    >>> truth = film(ss.simulate(ss.paper.oscillator(0.2), 10.0), frame_rate=20)
    >>> dict(truth.sizes)
    {'time': 200, 'mass': 1}
    """
    try:
        rig = _Rig.build(orbit, Camera(**camera), start, duration)
    except TypeError as error:
        from dataclasses import fields

        known = ", ".join(item.name for item in fields(Camera))
        raise InputError(f"film: {str(error).split(' ', 1)[-1]}; a camera has {known}") from None
    if path is not None:
        write_pictures(path, rig.pictures(progress), rig.camera.frame_rate, lossless=True)
    return rig.truth(str(path) if path is not None else "film")


@dataclass(frozen=True)
class _Rig:
    camera: Camera
    times: Array
    ideal: Array
    """(time, mass) column of each marker's centre as an ideal lens would show it."""
    orbit: Orbit
    scale: float
    rest: Array
    drive_velocity: float

    @classmethod
    def build(cls, orbit: Orbit, camera: Camera, start: float, duration: float | None) -> _Rig:
        duration = orbit.t_end - start if duration is None else duration
        if not (start >= 0 and duration > 0 and start + duration <= orbit.t_end * (1 + 1e-12)):
            raise InputError(
                f"film: the part from {start:g} to {start + duration:g} must lie in the orbit's [0, {orbit.t_end:g}]"
            )
        times = start + np.arange(math.floor(duration * camera.frame_rate * (1 + 1e-12))) / camera.frame_rate
        if times.size < 1:
            raise InputError(f"film: no picture falls into a duration of {duration:g}; film longer or faster")
        x = _columns(orbit, times)
        masses = x.shape[1]
        room = camera.width / masses
        middle = 0.5 * (x.max(axis=0) + x.min(axis=0))
        reach = float(np.ptp(x, axis=0).max())
        scale = camera.scale if camera.scale is not None else 0.5 * room / max(reach, 1e-9)
        rest = room * (np.arange(masses) + 0.5) - 0.5 - scale * middle
        if scale * reach > room - 4 * camera.marker:
            raise InputError(
                f"film: the motion spans {scale * reach:.0f} px, but a mass has {room - 4 * camera.marker:.0f} px; "
                "choose a smaller scale or a wider picture"
            )
        return cls(camera, times, rest + scale * x, orbit, scale, rest, _drive_velocity(orbit.system))

    def pictures(self, progress: Callable[[str, int, int], object] | None) -> Iterator[Picture]:
        """The film."""
        cv2 = vision()
        camera = self.camera
        random = np.random.default_rng(camera.seed)
        rows, columns = np.mgrid[: camera.height, : camera.width].astype(float)
        ideal = camera.lens.straighten(np.stack([columns, rows], axis=-1)).astype(np.float32)
        u, v = ideal[..., 0], ideal[..., 1]
        texture = self._texture(random)
        light = self._light(u, v)
        open_for = camera.exposure / camera.frame_rate
        shutter = np.linspace(-0.5, 0.5, 7) * open_for if open_for > 0 else np.zeros(1)
        for index, time in enumerate(self.times):
            moments = np.clip(time + shutter, 0, self.orbit.t_end)
            positions = self.rest + self.scale * _columns(self.orbit, moments)
            drive = self.scale * self.drive_velocity * time
            picture = self._scene(cv2, u, v, texture, drive, positions) * light
            if camera.blur > 0:
                picture = cv2.GaussianBlur(picture, (0, 0), camera.blur)
            if camera.noise > 0:
                noise = random.standard_normal(picture.shape, dtype=np.float32)
                picture = picture + np.float32(camera.grey_noise) * noise
            grey = np.clip(np.rint(picture), 0, 255).astype(np.uint8)
            yield np.repeat(grey[..., None], 3, axis=2)
            if progress is not None:
                progress("filming", index + 1, len(self.times))

    def _texture(self, random: np.random.Generator) -> Grey:
        cv2 = vision()
        grain = random.standard_normal((self.camera.height, 1024)).astype(np.float32)
        # wrapped on before it is smoothed, so that the belt has no seam
        smooth = cv2.GaussianBlur(np.hstack([grain, grain, grain]), (0, 0), 2.5)[:, 1024:2048]
        return np.asarray(DRIVE + 14 * smooth / smooth.std(), np.float32)

    def _light(self, u: Grey, v: Grey) -> Grey:
        across = (u / self.camera.width + 0.5 * v / self.camera.height) / 1.5
        return np.asarray(1 - self.camera.light * np.clip(across, 0, 1), np.float32)

    @property
    def middle(self) -> float:
        """The row of the masses' centres."""
        return 0.45 * (self.camera.height - 1)

    @property
    def pitch(self) -> float:
        """Distance of the ruler's marks in units of length: 1, 2 or 5 times a power of ten, 30 to 75 px."""
        wanted = 50 / self.scale
        power = 10.0 ** math.floor(math.log10(wanted))
        return min((power * step for step in (1, 2, 5, 10)), key=lambda step: abs(math.log(step / wanted)))

    def _scene(self, cv2: Any, u: Grey, v: Grey, texture: Grey, drive: float, positions: Array) -> Grey:
        height, radius = self.camera.height, 0.5 * self.camera.marker
        half = 3.0 * radius
        along = np.mod(u - np.float32(drive % 1024), 1024).astype(np.float32)
        moving = cv2.remap(texture, along, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
        on_drive = _edge(0.36 * height - np.abs(v - np.float32(self.middle)))
        scene = WALL + on_drive * (moving - WALL)
        # the ruler along the foot, its marks where the black and white blocks meet
        step = np.float32(self.pitch * self.scale)
        phase = np.mod((u - np.float32(self.rest[0])) / step, 2.0)
        black = np.clip((0.5 - np.abs(phase - 0.5)) * step + 0.5, 0, 1) + np.clip(
            (phase - 1.5) * step - 0.5 * step + 0.5, 0, 1
        )
        ruler = _edge(v - np.float32(0.90 * height)) * _edge(np.float32(0.97 * height) - v)
        scene = scene + ruler * (235 - 200 * np.clip(black, 0, 1) - scene)
        across = np.abs(v - np.float32(self.middle))
        for mass in range(positions.shape[1]):
            face = np.zeros_like(u)
            spot = np.zeros_like(u)
            for position in positions[:, mass]:
                dx = u - np.float32(position)
                face += _edge(half - np.maximum(np.abs(dx), across))
                spot += _edge(radius - np.hypot(dx, across))
            face /= len(positions)
            spot /= len(positions)
            scene = scene + face * (BLOCK - scene) + spot * (MARKER - BLOCK)
        return np.asarray(scene, np.float32)

    def truth(self, source: str) -> xr.Dataset:
        """Where every marker's centre is."""
        x = _columns(self.orbit, self.times)
        flat = np.stack([self.ideal, np.full_like(self.ideal, self.middle)], axis=-1)
        positions = _distort(self.camera.lens, flat)
        zero = np.zeros_like(x)
        lost = np.full(x.shape, "", dtype=object)
        unit = "1" if self.dimensionless else "m"
        # the ruler's zero lies where the first mass is at x = 0
        calibration = Calibration(
            origin=(float(self.rest[0]), self.middle),
            coefficients=(0.0, 1 / self.scale),
            unit=unit,
            lens=self.camera.lens if self.camera.k1 else None,
            notes=("The truth of a film that was made.",),
        )
        truth = motion_dataset(
            self.times, positions[..., 0], positions[..., 1], zero, zero, lost, calibration,
            source=source, frame_rate=self.camera.frame_rate,
        )  # fmt: skip
        truth["position"] = (("time", "mass"), x, {"units": unit, "long_name": "position in the orbit"})
        table: dict[str, Any] = {
            "scale": self.scale,
            "unit": unit,
            "origin": [float(self.rest[0]), float(self.middle)],
        }
        if self.camera.k1:
            lens = self.camera.lens
            table["lens"] = {"k1": lens.k1, "centre": list(lens.centre), "radius": lens.radius}
        truth.attrs["setup"] = Setup(
            masses=x.shape[1], size=self.camera.marker, frame_rate=self.camera.frame_rate, calibration=table
        ).to_toml()
        truth.attrs["drive_velocity"] = self.drive_velocity
        return truth

    @property
    def dimensionless(self) -> bool:
        """Whether mass and stiffness are 1, as in the paper's scaling."""
        mass = np.asarray(getattr(self.orbit.system, "mass", 0.0), float)
        return bool(np.all((np.diag(mass) if mass.ndim == 2 else mass) == 1))


def _columns(orbit: Orbit, times: Array) -> Array:
    x = np.asarray(orbit.at(times)[0], float)
    return x[:, None] if x.ndim == 1 else x


def _drive_velocity(system: Any) -> float:
    if hasattr(system, "drive_velocity"):
        return float(system.drive_velocity)
    contacts = getattr(system, "contacts", ())
    return float(getattr(contacts[0], "drive_velocity", 0.0)) if contacts else 0.0


def _edge(distance: Grey) -> Grey:
    """Coverage of a pixel whose centre lies `distance` px inside an edge."""
    return np.asarray(np.clip(distance + np.float32(0.5), 0, 1), np.float32)


def _distort(lens: Lens, ideal: Array) -> Array:
    """Where the lens shows what an ideal one shows at `ideal`: the inverse of `Lens.straighten`, by iteration."""
    positions = ideal.copy()
    for _ in range(50):
        step = ideal - lens.straighten(positions)
        positions = positions + step
        if float(np.abs(step).max()) < 1e-9:
            break
    return positions
