"""Fields of displacement and strain: a grid of pieces of texture, each followed through the film."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip import _core
from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.files.disk import check_writable
from stickslip.tracking.finding.response_map import ResponseMap, response_map
from stickslip.tracking.finding.subset import Match, Subset
from stickslip.tracking.finding.template import LEAST_CORRELATION, LEAST_ERROR
from stickslip.tracking.motion import save_motion
from stickslip.tracking.setup import Setup
from stickslip.tracking.video.vision import vision

if TYPE_CHECKING:
    import xarray as xr

KEYS = ("region", "size", "channel", "frame_rate", "times", "raw")
"""What a setup may hold for a field."""

SIDE = 31
"""Px of a piece where nothing is said."""

LEAST_SIDE = 9
"""Px of a piece at least: six numbers and two of the light must be told from it."""

EDGE = 3
"""Px from the edge of the picture to the nearest piece, which may move so far before a part of it is gone."""

NAMES = {
    "u": ("px", "displacement to the right"),
    "v": ("px", "displacement downwards"),
    "exx": ("1", "strain to the right"),
    "eyy": ("1", "strain downwards"),
    "exy": ("1", "shear strain"),
    "rotation": ("rad", "rotation from x to y"),
}


def displacement_field(
    source: str | Path | list[Path],
    setup: Setup | Mapping[str, Any] | str | Path | None = None,
    *,
    spacing: int = 16,
    output: str | Path | None = None,
    progress: Callable[[str, int, int], object] | None = None,
    command: str | None = None,
    **options: Any,
) -> xr.Dataset:
    """Displacement and strain of a texture on a grid, in every picture of a film, against the first.

    Around each point of the grid a square piece of the first picture is followed from picture to picture
    (:class:`stickslip.tracking.finding.subset.Subset`): its displacement d and the gradient G of that by x and y minimise the
    squared differences of grey levels, the picture between its pixels taken from quintic splines. With F = 1 + G

        E = ½ (Fᵀ F − 1),   rotation = atan2(G_vx − G_uy, 2 + G_ux + G_vy),

    the strain of Green and Lagrange, which is zero for a motion without strain however far it turns, and the rotation of the
    polar decomposition.

    Parameters
    ----------
    source, output, progress, command : as for :func:`stickslip.track`.
    setup : a :class:`Setup`, a table or the path of a TOML file, of which a field takes ``region`` (where the pieces lie in
        the first picture), ``size`` (the side of a piece in px, default 31), ``channel``, ``frame_rate``, ``times``, ``raw``.
    spacing : of the grid in px.
    options : these keys, over those of `setup`.

    Returns
    -------
    Dataset over ``time`` (s), ``y`` and ``x`` (px, centres of the pieces in the first picture), each with its ``_error``:

    * ``u``, ``v``: displacement in px, to the right and downwards;
    * ``exx``, ``eyy``, ``exy``: strain, dimensionless;
    * ``rotation``: in rad, positive from x to y (clockwise as seen);

    and ``residual``, what of the grey levels the fit leaves. NaN where a piece has too little texture, leaves the picture or
    is not found; ``notes`` count them. In the first picture all is zero.

    Raises
    ------
    InputError
        where the film cannot be read, the setup holds other keys, or no piece lies in the region.

    Limits: errors are those of white noise of the pixels, and of the displacement at least 0.002 px. A piece that lies across
    the edge of a slip is no piece with one gradient: to half of `size` beside such an edge displacement is smeared, strain is
    of the fit alone, and the errors do not hold that; a jump of some tenths of a px shows in ``residual``. Neighbours whose
    pieces overlap have errors in common. From one picture to the next a piece may move by half of its side, and turn by some
    five degrees. A camera that moves is in u and v.

    Source: Pan, Qian, Xie & Asundi, Meas. Sci. Technol. 20 (2009) 062001, doi:10.1088/0957-0233/20/6/062001 (review).

    Examples
    --------
    >>> field = displacement_field("contact.avi", region=[100, 40, 400, 120], spacing=8)  # doctest: +SKIP
    >>> field.u.isel(time=-1).plot()  # doctest: +SKIP
    """
    import xarray as xr

    setup = _checked(setup, spacing, options)
    if output is not None:
        check_writable(output)
    film, side = setup.film(source), round(setup.size or SIDE)
    times: list[float] = []
    tables: list[Array] = []
    pieces: list[Subset] = []
    start: list[Match] = []
    last: list[Match] = []
    x = y = np.zeros(0)
    before: ResponseMap = np.zeros((0, 0), np.uint8)
    for time, picture in film:
        times.append(time)
        if progress is not None:
            progress(f"looking at {Path(film.name).name}", len(times), max(len(film), len(times)))
        if picture is None:
            tables.append(np.empty(0))
            continue
        grey = response_map(picture, "bright", setup.channel)
        if not pieces:
            x, y = _grid(setup.box(picture, film.name), grey.shape, side, spacing, film.name)
            half = (side - 1) / 2
            corners = [(round(row - half), round(column - half)) for row in y for column in x]
            pieces = [Subset(grey[top : top + side, left : left + side], affine=True) for top, left in corners]
            start = last = [
                Match(left + half, top + half, np.zeros((2, 2)), np.zeros((6, 6)), 0.0, 1.0) for top, left in corners
            ]
            found = [None if piece.plain else one for piece, one in zip(pieces, start, strict=True)]
        else:
            found = [_followed(grey, before, piece, one) for piece, one in zip(pieces, last, strict=True)]
            last = [old if one is None else one for old, one in zip(last, found, strict=True)]
        before = grey
        tables.append(np.array([_row(one, first) for one, first in zip(found, start, strict=True)]))
    columns = 2 * len(NAMES) + 1
    empty = np.full((len(pieces), columns), math.nan)
    table = np.array([one if one.size else empty for one in tables]).reshape(len(times), len(y), len(x), columns)
    dims = ("time", "y", "x")
    field = xr.Dataset(
        coords={
            "time": ("time", np.array(times), {"units": "s"}),
            "y": ("y", y, {"units": "px"}),
            "x": ("x", x, {"units": "px"}),
        }
    )
    for number, (name, (unit, words)) in enumerate(NAMES.items()):
        field[name] = (dims, table[..., 2 * number], {"units": unit, "long_name": words})
        field[f"{name}_error"] = (dims, table[..., 2 * number + 1], {"units": unit})
    field["residual"] = (dims, table[..., -1], {"units": "grey levels", "long_name": "residual"})
    field.attrs = {
        "title": "stickslip field",
        "stickslip": "field",
        "source": film.name,
        "size": side,
        "spacing": spacing,
        "notes": [*film.notes, *_notes(pieces, table)],
        "setup": setup.to_toml(),
        "command": command or f"stickslip.tracking.displacement_field({str(source)!r})",
        "version": _core.__version__,
    }
    if output is not None:
        save_motion(field, output)
    return field


def _checked(given: Any, spacing: int, options: dict[str, Any]) -> Setup:
    setup = Setup.of(given, **options)
    other = sorted(set(setup.changed()) - {*KEYS, *(["masses"] if setup.masses == 1 else [])})
    if other:
        raise InputError(f"a field takes {', '.join(KEYS)}, got {', '.join(other)}; leave that out")
    if isinstance(spacing, bool) or not isinstance(spacing, int | np.integer) or spacing < 1:
        raise InputError(f"a field: spacing must be a whole number of px, 1 or more, got {spacing!r}")
    if setup.size is not None and setup.size < LEAST_SIDE:
        raise InputError(f"a field: expected pieces of at least {LEAST_SIDE} px, got size = {setup.size:g}")
    return setup


def _grid(box: tuple[slice, slice], shape: tuple[int, ...], side: int, spacing: int, name: str) -> tuple[Array, Array]:
    """Centres of the pieces, x and y."""
    y, x = (
        np.arange(max(part.start, EDGE), min(part.stop, whole - EDGE) - side + 1, spacing) + (side - 1) / 2
        for part, whole in zip(box, shape, strict=True)
    )
    if not (x.size and y.size):
        wide, high = (part.stop - part.start for part in box[::-1])
        raise InputError(
            f"{name}: no piece of {side} px lies in {wide} x {high} px; give a smaller size or more region"
        )
    return x, y


def _followed(grey: ResponseMap, before: ResponseMap, piece: Subset, last: Match) -> Match | None:
    """A piece from where it was last; where it is not there, from where the picture looks most like that did before."""
    if piece.plain:
        return None
    if (found := _inside(grey, piece, piece.find(grey, last.x, last.y, last.gradient))) is not None:
        return found
    side = len(piece.piece)
    row, column = round(last.y - (side - 1) / 2), round(last.x - (side - 1) / 2)
    top, left = max(row - side // 2, 0), max(column - side // 2, 0)
    around = grey[top : row + side + side // 2, left : column + side + side // 2]
    cv2 = vision()
    look = cv2.matchTemplate(around, before[row : row + side, column : column + side], cv2.TM_CCOEFF_NORMED)
    _, best, _, (right, down) = cv2.minMaxLoc(look)
    if best < LEAST_CORRELATION:
        return None
    return _inside(
        grey, piece, piece.find(grey, last.x + left + right - column, last.y + top + down - row, last.gradient)
    )


def _inside(grey: ResponseMap, piece: Subset, found: Match | None) -> Match | None:
    """A match that looks like the piece and lies wholly in the picture."""
    if found is None or found.correlation < LEAST_CORRELATION:
        return None
    reach = np.abs(np.eye(2) + found.gradient).sum(axis=1) * (len(piece.piece) - 1) / 2
    high, wide = grey.shape
    x, y = found.x, found.y
    return found if reach[0] <= x <= wide - 1 - reach[0] and reach[1] <= y <= high - 1 - reach[1] else None


def _row(found: Match | None, first: Match) -> list[float]:
    """Each quantity and its error, and the residual."""
    if found is None:
        return [math.nan] * (2 * len(NAMES) + 1)
    forward = np.eye(2) + found.gradient
    (a, b), (c, d) = forward
    strain = 0.5 * (forward.T @ forward - np.eye(2))
    turn, stretch = c - b, a + d
    values = found.x - first.x, found.y - first.y, strain[0, 0], strain[1, 1], strain[0, 1], math.atan2(turn, stretch)
    slopes = np.zeros((len(NAMES), 6))
    slopes[0, 0] = slopes[1, 1] = 1
    slopes[2:, 2:] = [
        [a, 0, c, 0],
        [0, b, 0, d],
        [b / 2, a / 2, d / 2, c / 2],
        np.array([-turn, -stretch, stretch, -turn]) / (turn**2 + stretch**2),
    ]
    errors = np.sqrt(np.einsum("ij,jk,ik->i", slopes, found.covariance, slopes))
    if found is not first:
        errors[:2] = np.maximum(errors[:2], LEAST_ERROR)
    return [*np.stack([values, errors], axis=1).ravel(), found.residual]


def _notes(pieces: list[Subset], table: Array) -> list[str]:
    plain = sum(piece.plain for piece in pieces)
    gone = int(np.isnan(table[..., 0]).sum()) - plain * len(table)
    found = [f"{plain} of {len(pieces)} pieces have too little texture and are empty."] if plain else []
    if gone > 0:
        found.append(f"{gone} of {(len(pieces) - plain) * len(table)} places were not found and are empty.")
    return found
