"""Pictures to a film file or a folder, whole or not at all."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterable
from pathlib import Path

from stickslip.errors import InputError
from stickslip.files.disk import check_writable, write_whole
from stickslip.tracking.video.source import Picture
from stickslip.tracking.video.vision import vision

CODECS = {".avi": ("FFV1", "MJPG"), ".mkv": ("FFV1", "MJPG"), ".mp4": ("mp4v", "mp4v")}

NUMBERED = r"\d{6,}\.png"
"""Names of the pictures of a film that is a folder."""


def write_pictures(path: str | Path, pictures: Iterable[Picture], rate: float, *, lossless: bool) -> Path:
    """Write pictures as a film, or as numbered PNG where the path has no ending.

    Parameters
    ----------
    path : ``.avi`` or ``.mkv`` (FFV1, or MJPG where it need not be lossless), ``.mp4``, or a folder that is not there yet
        (an empty one or one of an earlier run is replaced).
    pictures : of one size, (height, width, 3).
    rate : pictures per second that a player shows.
    lossless : every grey level is kept; not for ``.mp4``.

    Raises
    ------
    InputError
        for another ending, or where the place cannot be written to.
    """
    path = check_target(path)
    if not path.suffix:
        return _write_folder(path, pictures)
    cv2 = vision()
    codec = CODECS[path.suffix.lower()][0 if lossless else 1]

    def write(draft: Path) -> None:
        part = draft.with_name(draft.name + path.suffix.lower())  # the library chooses the container by the ending
        writer = None
        try:
            for picture in pictures:
                if writer is None:
                    size = (picture.shape[1], picture.shape[0])
                    writer = cv2.VideoWriter(str(part), cv2.VideoWriter_fourcc(*codec), float(rate), size, True)
                    if not writer.isOpened():
                        raise InputError(
                            f"{path}: a film of the kind {codec} cannot be written here; take a folder of PNG"
                        )
                writer.write(picture)
            if writer is None:
                raise InputError(f"{path}: there are no pictures to write")
            writer.release()
            part.replace(draft)
        finally:
            if writer is not None:
                writer.release()
            part.unlink(missing_ok=True)

    return write_whole(path, write)


def check_target(path: str | Path) -> Path:
    """Refuse a film's place that :func:`write_pictures` cannot write to, or that holds somebody's pictures."""
    path = Path(path)
    if path.suffix:
        if path.suffix.lower() not in CODECS:
            raise InputError(
                f"{path}: a film ends in {', '.join(CODECS)}, or has no ending for a folder of PNG; rename it"
            )
        check_writable(path)
    elif path.exists() and (not path.is_dir() or not all(re.fullmatch(NUMBERED, file.name) for file in path.iterdir())):
        raise InputError(f"{path}: exists and holds other things than a film of ours; choose another place")
    elif not path.resolve().parent.is_dir():
        raise InputError(f"{path}: the folder {path.resolve().parent} does not exist; make it first")
    return path


def _write_folder(path: Path, pictures: Iterable[Picture]) -> Path:
    cv2 = vision()
    draft = path.with_name(f".{path.name}.part")
    shutil.rmtree(draft, ignore_errors=True)
    try:
        draft.mkdir()
        for index, picture in enumerate(pictures):
            if not cv2.imwrite(str(draft / f"{index:06d}.png"), picture):
                raise InputError(f"{path}: picture {index} cannot be written; is the disc full?")
        shutil.rmtree(path, ignore_errors=True)
        draft.replace(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror or error}); choose another place") from None
    finally:
        shutil.rmtree(draft, ignore_errors=True)
    return path
