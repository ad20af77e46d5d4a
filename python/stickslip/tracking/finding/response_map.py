"""A picture as response map: one number a pixel, high where the marker is."""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt

from stickslip.errors import InputError
from stickslip.tracking.video.source import Picture
from stickslip.tracking.video.vision import vision

ResponseMap = npt.NDArray[np.uint8]

COLOURS = {
    "red": (255, 0, 0),
    "orange": (255, 128, 0),
    "yellow": (255, 255, 0),
    "green": (0, 255, 0),
    "cyan": (0, 255, 255),
    "blue": (0, 0, 255),
    "magenta": (255, 0, 255),
    "pink": (255, 105, 180),
}
CHANNELS = {"blue": 0, "green": 1, "red": 2}


def check_marker(marker: str, where: str) -> None:
    """Refuse a marker that is not ``"dark"``, ``"bright"``, the name of a colour or ``"#rrggbb"``."""
    if marker not in ("dark", "bright", *COLOURS) and not re.fullmatch(r"#[0-9a-fA-F]{6}", marker):
        known = ", ".join(("dark", "bright", *COLOURS))
        raise InputError(f"{where}: marker must be one of {known} or a colour like '#20a040', got {marker!r}")


def response_map(picture: Picture, marker: str, channel: str = "grey") -> ResponseMap:
    """How much each pixel looks like the marker, 0 to 255.

    A dark marker: 255 minus the brightness; a bright one: the brightness. A coloured one: with the colour c and the
    pixel p, both less their mean over red, green and blue, and ĉ = c/|c|,

        p·ĉ − ½ |p − (p·ĉ) ĉ|,

    so grey pixels of any brightness and those of other hues (63° away and more) give nothing. It is linear in the
    marker's share of a pixel on a grey ground, so centres keep their sub-pixel part.

    Parameters
    ----------
    picture : (height, width, 3), blue-green-red, or (height, width) of grey.
    marker : ``"dark"``, ``"bright"``, the name of a colour or ``"#rrggbb"``.
    channel : ``"grey"`` (luma, 0.299 red + 0.587 green + 0.114 blue), ``"red"``, ``"green"`` or ``"blue"``, for dark and
        bright markers.
    """
    if marker in ("dark", "bright"):
        if picture.ndim == 3:
            cv2, number = vision(), CHANNELS.get(channel)
            picture = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY) if number is None else picture[..., number])
        return picture if marker == "bright" else np.asarray(255 - picture, np.uint8)
    rgb = COLOURS.get(marker) or tuple(int(marker[i : i + 2], 16) for i in (1, 3, 5))
    colour = np.array(rgb[::-1], np.float32)
    colour -= colour.mean()
    length = float(np.linalg.norm(colour))
    if length < 8:
        raise InputError(f"marker {marker!r} is grey; say 'dark' or 'bright' instead")
    colour /= length
    pixels = picture.astype(np.float32)
    pixels -= pixels.mean(axis=2, keepdims=True)
    along = pixels @ colour
    across = np.sqrt(np.maximum((pixels**2).sum(axis=2) - along**2, 0))
    return np.asarray(np.rint(np.clip(along - 0.5 * across, 0, 255)), np.uint8)
