"""Pictures with their times, from a video file or a folder of images."""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from stickslip.errors import InputError
from stickslip.files.disk import input_file, read_text
from stickslip.tracking.video.raw import Raw
from stickslip.tracking.video.vision import MOST_PIXELS, vision

Picture = npt.NDArray[np.uint8]

MOST_BYTES = 1 << 28
"""Of a text file of times: ten million."""

PAGES = 32
"""Of a file with many pictures so many are read at once."""

STACKS = (".tif", ".tiff")
"""Images that may hold several pictures, one after the other."""

WHOLE = ("mjpg", "ffv1", "ffvh", "hfyu", "mpng", "png ", "dvsd", "apch", "apcn", "apcs", "apco", "ap4h")
"""Codes of formats that give each picture by itself, in small letters."""

NOISE_BITS = 1.0
"""Bits that the noise of a pixel needs at least, that of one grey level two: where a file has fewer it is not in there."""

IMAGES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp", ".pgm", ".ppm")


@dataclass
class Film:
    """Pictures in the order of time.

    Iterating gives (time in s, picture of shape (height, width, 3) in blue-green-red), again and again if wanted; an image
    file or a picture of a video that cannot be read gives None for its picture.
    A video's time stamps are those of the file, also where they are not evenly spaced.

    Parameters
    ----------
    source : a video file, a folder of images (in natural order: 2 before 10), or a list of image files; of a TIFF all
        pages, each a picture.
    frame_rate : pictures per second of the camera. A video says its own; this overrides it, for slow motion: its time
        stamps are then scaled by (rate the file says) / `frame_rate`. Images need it, or `times`.
    times : a text file with one time in s a line, or the times themselves; for images or instead of a video's stamps.
    grey : the pictures are (height, width) of luma.
    raw : how bare grey levels lie in the files, which may then have any name.

    Attributes
    ----------
    notes : what was found worth telling while reading, complete after the film has been read to its end.

    Raises
    ------
    InputError
        for a file that is missing or no video, a folder without images, a frame rate that is not positive, times that
        are missing, not finite or do not increase.
    """

    source: str | Path | list[Path]
    frame_rate: float | None = None
    times: str | Path | npt.ArrayLike | None = None
    notes: list[str] = field(default_factory=list)
    grey: bool = False
    raw: Raw | None = None

    def __post_init__(self) -> None:
        rate = self.frame_rate
        if rate is not None and not (math.isfinite(rate) and rate > 0):
            raise InputError(
                f"{self.name}: the frame rate must be a positive number of pictures per second, got {rate:g}"
            )
        self._images: list[Path] | None = None
        self._file_rate = math.nan
        self._times = self._given_times()
        if isinstance(self.source, list):
            self._images = [Path(path) for path in self.source]
            for path in self._images:
                if path.exists():  # one that is missing is told with the unreadable ones
                    input_file(path, "picture")
        else:
            path = Path(self.source)
            if path.is_dir():
                self._images = natural_order(
                    [
                        file
                        for file in path.iterdir()
                        if (self.raw is not None or file.suffix.lower() in IMAGES) and not file.name.startswith(".")
                    ]
                )
                if not self._images:
                    raise InputError(
                        f"{path}: the folder holds no images; expected files ending in {', '.join(IMAGES[:3])}"
                    )
            elif input_file(path, "film or folder of images").suffix.lower() in IMAGES or self.raw is not None:
                self._images = [path]
            else:
                self._file_rate = self._open(path).get(vision().CAP_PROP_FPS)
        self._pages = [(self.raw.count if self.raw else _count_pages)(path) for path in self._images or []]
        if self._images is not None and self._times is None and rate is None:
            if len(self) > 1:
                raise InputError(
                    f"{self.name}: images carry no time; give frame_rate in pictures per second (0.5 for one every 2 s)"
                )
            self._times = np.zeros(1)
        if self._images is not None and self._times is not None and len(self._times) != len(self):
            raise InputError(f"{self.name}: {len(self)} images but {len(self._times)} times; give one for each")

    @property
    def name(self) -> str:
        """What the film is called in messages."""
        return f"{self.source[0].parent}" if isinstance(self.source, list) and self.source else str(self.source)

    @property
    def rate(self) -> float:
        """Pictures per second of the camera: as given, else as the file says, NaN where neither does."""
        return self.frame_rate if self.frame_rate is not None else self._file_rate

    @property
    def copied(self) -> bool:
        """Whether a video gives its pictures as differences from others, in so few bits that noise is copied with them."""
        if self._images is not None:
            return False
        cv2, path = vision(), Path(str(self.source))
        capture = self._open(path)
        code = int(capture.get(cv2.CAP_PROP_FOURCC)).to_bytes(4, "little", signed=True).decode("latin-1").lower()
        pixels = capture.get(cv2.CAP_PROP_FRAME_WIDTH) * capture.get(cv2.CAP_PROP_FRAME_HEIGHT) * max(1, len(self))
        return code not in WHOLE and 8 * path.stat().st_size < NOISE_BITS * pixels

    def __len__(self) -> int:
        """The number of pictures, as far as the file knows."""
        if self._images is not None:
            return sum(self._pages)
        return max(0, int(self._open(Path(str(self.source))).get(vision().CAP_PROP_FRAME_COUNT)))

    def __iter__(self) -> Iterator[tuple[float, Picture | None]]:
        self.notes.clear()
        return self._pictures() if self._images is not None else self._frames(Path(str(self.source)))

    def _pictures(self) -> Iterator[tuple[float, Picture | None]]:
        shape: tuple[int, ...] | None = None
        white: int | None = None  # that of the first picture, so that the light does not flicker
        unreadable: list[str] = []
        for index, (path, page, deep) in enumerate(self._read_images()):
            time = self._times[index] if self._times is not None else index / self.rate
            try:
                if isinstance(deep, InputError):
                    raise deep
                if deep.dtype != np.uint8 and white is None:
                    white = white_level(deep) if self.raw is None else self.raw.white
                    self.notes.append(f"Pictures of more than 8 bits are read with white at {white}.")
                picture = _eight_bits(deep, white)
            except InputError:
                unreadable.append(path.name + (f", page {page}" if page else ""))
                yield float(time), None
                continue
            if shape is not None and picture.shape != shape:
                raise InputError(
                    f"{path}: {picture.shape[1]} x {picture.shape[0]} pixels, but the first image has "
                    f"{shape[1]} x {shape[0]}; give images of one size"
                )
            shape = picture.shape
            yield float(time), picture
        if shape is None:
            raise InputError(f"{self.name}: none of the {len(unreadable)} images can be read; copy them again")
        if unreadable:
            self.notes.append(f"{len(unreadable)} image(s) cannot be read: {', '.join(unreadable[:5])}.")

    def _read_images(self) -> Iterator[tuple[Path, int, npt.NDArray[Any] | InputError]]:
        """Each picture with its file and page (from 1; 0 of a file with one), or why it cannot be read."""
        for path, pages in zip(self._images or [], self._pages, strict=True):
            if self.raw is not None:
                for number in range(pages):
                    levels = self.raw.read(path, number)
                    yield path, number + 1, levels if self.grey else np.repeat(levels[..., None], 3, axis=2)
                continue
            if pages == 1:
                try:
                    yield path, 0, _read_image(path, self.grey)
                except InputError as error:
                    yield path, 0, error
                continue
            for first in range(0, pages, PAGES):
                found = _read_pages(path, first, min(PAGES, pages - first), self.grey)
                for page, picture in enumerate(found, start=first + 1):
                    yield path, page, picture

    def _frames(self, path: Path) -> Iterator[tuple[float, Picture | None]]:
        cv2 = vision()
        capture = self._open(path)
        announced = int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
        file_rate = capture.get(cv2.CAP_PROP_FPS)
        stretch = file_rate / self.frame_rate if self.frame_rate is not None else 1.0
        index, last, damaged, damaged_in_all = 0, -math.inf, 0, 0
        picture: Picture | None = None
        while True:
            # a picture that is only turned to grey makes room for the next one
            seen, picture = capture.read(picture if self.grey else None)
            if not seen:  # a damaged picture, or the end
                damaged += 1
                if index == 0 or index + damaged >= announced:
                    break
                continue
            if self._times is not None:
                if index + damaged >= len(self._times):
                    raise InputError(f"{path}: {len(self._times)} times, but more pictures; give one for each")
                time = float(self._times[index + damaged])
            else:
                time = 1e-3 * capture.get(cv2.CAP_PROP_POS_MSEC) * stretch
            if not time > last:
                raise InputError(
                    f"{path}: the time stamp of picture {index + damaged} ({time:g} s) does not follow that of the one "
                    f"before ({last:g} s); give the times yourself with `times`"
                )
            for number in range(damaged):  # its stamp is lost with it
                yield last + (time - last) * (number + 1) / (damaged + 1), None
            index, last, damaged, damaged_in_all = index + damaged + 1, time, 0, damaged_in_all + damaged
            yield time, cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY) if self.grey else picture
        capture.release()
        if index == 0:
            raise InputError(f"{path}: no picture could be decoded, the file seems damaged; copy it again")
        if damaged_in_all:
            self.notes.append(f"{damaged_in_all} picture(s) in the middle cannot be decoded.")
        if self._times is not None and len(self._times) > index:
            self.notes.append(f"{len(self._times)} times for {index} pictures: the last times were left out.")
        if index < announced - 1:
            self.notes.append(f"The film ends after {index} of {announced} pictures: the rest cannot be decoded.")

    def _open(self, path: Path) -> Any:
        cv2 = vision()
        # several threads fill what is damaged in a picture with what another of them has done so far, never the same
        capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG, [cv2.CAP_PROP_N_THREADS, 1])
        if not capture.isOpened():
            what = "is empty" if path.stat().st_size == 0 else "is no video, or a truncated or damaged one"
            raise InputError(f"{path}: the file {what}; copy or export it again")
        width, height = (capture.get(size) for size in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT))
        if width * height > MOST_PIXELS:
            raise InputError(
                f"{path}: says pictures of {width:.0f} x {height:.0f} px, more than are read; is it damaged?"
            )
        rate = capture.get(cv2.CAP_PROP_FPS)
        if self.frame_rate is not None and not (math.isfinite(rate) and rate > 0) and self._times is None:
            raise InputError(f"{path}: the file says no frame rate, so its stamps cannot be scaled; give `times`")
        return capture

    def _given_times(self) -> npt.NDArray[np.float64] | None:
        if self.times is None:
            return None
        if not isinstance(self.times, str | Path):
            return _checked_times(np.asarray(self.times, float), "times", 0)
        path = Path(self.times)
        lines = read_text(path, "text file, one time a line", MOST_BYTES).split()
        values = []
        for row, word in enumerate(lines, start=1):
            try:
                values.append(float(word))
            except ValueError:
                raise InputError(f"{path}: row {row} must be a time in seconds, got {word!r}") from None
        return _checked_times(np.array(values), str(path), 1)


def _checked_times(times: npt.NDArray[np.float64], where: str, first: int) -> npt.NDArray[np.float64]:
    bad = np.flatnonzero(~np.isfinite(times))
    if bad.size:
        raise InputError(f"{where}: row {bad[0] + first} must be a finite time in seconds, got {times[bad[0]]}")
    back = np.flatnonzero(np.diff(times) <= 0)
    if back.size:
        row = back[0] + 1
        raise InputError(
            f"{where}: times must increase, but row {row + first} ({times[row]:g} s) does not follow "
            f"{times[row - 1]:g} s; remove the duplicate"
        )
    return times


def read_picture(path: str | Path) -> Picture:
    """One image file as a (height, width, 3) array in blue-green-red, of 8 bits (see :func:`white_level`).

    Raises
    ------
    InputError
        where it is missing or no image.
    """
    return _eight_bits(_read_image(input_file(path, "picture")))


def _read_image(path: Path, grey: bool = False) -> npt.NDArray[Any]:
    cv2 = vision()
    if _pixels(path) > MOST_PIXELS:
        raise InputError(
            f"{path}: a picture of at most {MOST_PIXELS / 1e6:.0f} million pixels was expected; is it damaged?"
        )
    try:
        picture: npt.NDArray[Any] | None = cv2.imread(str(path), _kind(grey))
    except cv2.error:
        picture = None
    if picture is None:
        raise InputError(f"{path}: not a whole image file; copy it again")
    if picture.dtype.kind != "u":
        raise InputError(f"{path}: a picture of 8 or 16 bits was expected, got {picture.dtype}; save it as such")
    return picture


def _kind(grey: bool) -> int:
    cv2 = vision()
    return int((cv2.IMREAD_GRAYSCALE if grey else cv2.IMREAD_COLOR_BGR) | cv2.IMREAD_ANYDEPTH)


def _count_pages(path: Path) -> int:
    """How many pictures an image file holds, as far as it says."""
    if path.suffix.lower() not in STACKS or not path.is_file():
        return 1
    return max(1, int(vision().imcount(str(path))))


def _read_pages(path: Path, first: int, count: int, grey: bool = False) -> list[npt.NDArray[Any] | InputError]:
    """Pages `first` to `first + count` (from 0), or why one cannot be read."""
    cv2 = vision()
    damaged = InputError(f"{path}: a page is no whole picture; copy it again")
    if _pixels(path) > MOST_PIXELS:
        return [damaged] * count
    try:
        seen, found = cv2.imreadmulti(str(path), start=first, count=count, flags=_kind(grey))
    except cv2.error:
        seen, found = False, ()
    pages = [*found] if seen else []
    if len(pages) < count and count > 1:  # a damaged page takes the others with it
        return [one for page in range(first, first + count) for one in _read_pages(path, page, 1, grey)]
    return [page if page.dtype.kind == "u" else damaged for page in pages] or [damaged]


def _pixels(path: Path) -> float:
    """What the head of an image file claims, 0 where it says nothing."""
    from PIL import Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with Image.open(path) as head:
                return head.width * head.height
    except Image.DecompressionBombError:
        return math.inf
    except Exception:  # noqa: BLE001 damaged, which the reader proper will say, or of a kind that only that one knows
        return 0


def white_level(picture: npt.NDArray[Any]) -> int:
    """What a camera of 10, 12, 14 or 16 bits calls white: the least 2^n - 1 that is not exceeded.

    >>> white_level(np.array([[0, 3900]], np.uint16))
    4095
    """
    return int(2 ** max(8, math.ceil(math.log2(float(picture.max()) + 1))) - 1)


def _eight_bits(picture: npt.NDArray[Any], white: int | None = None) -> Picture:
    if picture.dtype == np.uint8:
        return picture
    scale = 255 / (white or white_level(picture))
    return np.clip(np.rint(picture * np.float32(scale)), 0, 255).astype(np.uint8)


def natural_order(paths: list[Path]) -> list[Path]:
    """The paths as people count: ``frame2`` before ``frame10``.

    >>> [path.name for path in natural_order([Path("f10.png"), Path("f2.png")])]
    ['f2.png', 'f10.png']
    """

    def key(path: Path) -> list[tuple[int, int | str]]:
        return [(0, int(part)) if part.isdigit() else (1, part) for part in re.split(r"(\d+)", path.name) if part]

    return sorted(paths, key=key)
