"""The film with its tracks drawn in, so that an eye can judge them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.errors import InputError
from stickslip.tracking.setup import Setup
from stickslip.tracking.video.source import Film, Picture
from stickslip.tracking.video.vision import vision
from stickslip.tracking.video.writing import write_pictures

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

PATH_LENGTH = 60
"""Pictures whose places are drawn behind a marker."""

# The palette of Okabe and Ito, as the vision library orders its colours.
_COLOURS = [(0, 94, 213), (178, 114, 0), (115, 158, 0), (167, 121, 204), (0, 159, 230), (233, 180, 86), (66, 228, 240)]


def write_check_film(
    motion: xr.Dataset,
    source: str | Path | list[Path],
    path: str | Path,
    progress: Callable[[str, int, int], object] | None = None,
) -> Path:
    """Write the film again with a cross at every place, its number, its trail, and "lost" where it was not seen.

    Parameters
    ----------
    motion : from :func:`stickslip.track`.
    source : the film it came from.
    path : ``.avi``, ``.mkv``, ``.mp4``, or a folder for PNG.
    progress : called with (what, pictures done, pictures in all).
    """
    rate = float(motion.attrs["frame_rate"]) or 25.0
    film = _film(motion, source)

    def drawn() -> Iterator[Picture]:
        for index, (_, picture) in enumerate(film):
            if picture is not None:
                yield draw_tracks(picture, motion, index)
            if progress is not None:
                progress("drawing the tracks", index + 1, motion.sizes["time"])

    # slow motion stays slow: no more than 30 pictures a second are shown
    return write_pictures(path, drawn(), min(rate, 30.0) if rate > 1 else 5.0, lossless=False)


def _film(motion: xr.Dataset, source: str | Path | list[Path]) -> Iterator[tuple[float, Picture | None]]:
    """The pictures of a motion, with the times of that."""
    raw, times = Setup.from_toml(motion.attrs.get("setup", "")).raw, motion["time"].to_numpy()
    numbers = motion["frame"].to_numpy() if "frame" in motion.coords else np.arange(len(times))
    if len(numbers) == 0 or numbers[-1] == len(numbers) - 1:
        yield from Film(source, times=times, raw=raw)
        return
    # a film that holds its pictures more than once: any rate does, as the times are known
    chosen = dict(zip(numbers.tolist(), times.tolist(), strict=True))
    for number, (_, picture) in enumerate(Film(source, float(motion.attrs["frame_rate"]) or 1.0, raw=raw)):
        if number in chosen:
            yield chosen[number], picture


def draw_tracks(picture: Picture, motion: xr.Dataset, index: int) -> Picture:
    """One picture of a film with the tracks up to it, twice as large where it is small.

    Parameters
    ----------
    picture : (height, width, 3).
    motion : from :func:`stickslip.track`.
    index : the number of the picture.
    """
    cv2 = vision()
    zoom = max(1, min(4, round(900 / picture.shape[1])))
    canvas = cv2.resize(picture, None, fx=zoom, fy=zoom, interpolation=cv2.INTER_NEAREST)
    x, y = motion["x_px"].to_numpy(), motion["y_px"].to_numpy()
    fine, thick = 16.0, max(1, round(canvas.shape[0] / 900))
    arm = max(4, round(canvas.shape[0] / 120))

    def at(row: int, mass: int) -> tuple[int, int]:
        return round(fine * ((x[row, mass] + 0.5) * zoom - 0.5)), round(fine * ((y[row, mass] + 0.5) * zoom - 0.5))

    for mass in range(x.shape[1]):
        colour = _COLOURS[mass % len(_COLOURS)]
        seen = [row for row in range(max(0, index - PATH_LENGTH), index + 1) if math.isfinite(x[row, mass])]
        if len(seen) > 1:
            tail = np.array([at(row, mass) for row in seen], np.int32)
            cv2.polylines(canvas, [tail], False, colour, thick, cv2.LINE_AA, 4)
        known = np.flatnonzero(np.isfinite(x[: index + 1, mass]))
        if not known.size:
            continue
        column, row = at(int(known[-1]), mass)
        here = known[-1] == index
        for dx, dy in ((arm, 0), (0, arm)):
            ends = [(column + sign * int(fine) * dx, row + sign * int(fine) * dy) for sign in (-1, 1)]
            cv2.line(canvas, *ends, colour if here else (128, 128, 128), thick, cv2.LINE_AA, 4)
        text = str(mass) if here else f"{mass} lost"
        position = (column // 16 + arm, row // 16 - arm)
        cv2.putText(canvas, text, position, cv2.FONT_HERSHEY_SIMPLEX, 0.1 * arm, colour, thick, cv2.LINE_AA)
    stamp = f"{float(motion['time'][index]):.3f} s"
    position = (2 * arm, canvas.shape[0] - 2 * arm)
    cv2.putText(canvas, stamp, position, cv2.FONT_HERSHEY_SIMPLEX, 0.1 * arm, (0, 0, 0), 3 * thick, cv2.LINE_AA)
    cv2.putText(canvas, stamp, position, cv2.FONT_HERSHEY_SIMPLEX, 0.1 * arm, (255, 255, 255), thick, cv2.LINE_AA)
    result: Picture = canvas
    return result


def tracks_over_film(
    motion: xr.Dataset, source: str | Path | list[Path], ax: Axes | None = None, **options: Any
) -> Axes:
    """Draw the whole tracks over the film's middle picture.

    Parameters
    ----------
    motion : from :func:`stickslip.track`.
    source : the film it came from.
    ax : where to draw; default a new figure.
    options : for the lines.

    Returns
    -------
    The axes, in px.
    """
    from stickslip.show.canvas import OKABE_ITO, new_axes, verbatim

    middle = motion.sizes["time"] // 2
    for index, (_, picture) in enumerate(_film(motion, source)):
        if picture is not None and index >= middle:
            break
    else:
        raise InputError(f"{source}: the film ends before its middle; track it again")
    high, wide = picture.shape[:2]
    if ax is None:  # as wide or as high as the picture asks for
        size = min(7.0, 6.0 * wide / high)
        (ax,) = new_axes(figsize=(max(size, 3.0) + 1.4, size * high / wide + 0.8))
    ax.imshow(picture[..., ::-1])
    colours = [OKABE_ITO[name] for name in ("vermilion", "sky", "yellow", "purple", "green", "orange", "blue")]
    for mass in range(motion.sizes["mass"]):
        x, y = motion["x_px"].to_numpy()[:, mass], motion["y_px"].to_numpy()[:, mass]
        name = str(motion["name"].item(mass)) if "name" in motion.coords else f"mass {mass}"
        style: dict[str, Any] = {"lw": 1.2, "label": verbatim(name), "color": colours[mass % len(colours)]} | options
        ax.plot(x, y, **style)
        if math.isfinite(x[index]) and math.isfinite(y[index]):
            ax.plot(x[index], y[index], "+", ms=7, mew=1.0, color=style["color"])
    ax.set(
        xlabel="x (px)", ylabel="y (px)", title=f"at {float(motion['time'][index]):.3f} s; + marks where a mass is then",
        xlim=(-0.5, wide - 0.5), ylim=(high - 0.5, -0.5),
    )  # fmt: skip
    if motion.sizes["mass"] <= 8:  # beside the picture, never over it
        ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=8)
    return ax
