"""From pixels to metres: scale, rotation, lens distortion, a curved scale along an axis, a plane seen at an angle."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from stickslip.errors import InputError, number, whole_number
from stickslip.files.arrays import Array
from stickslip.files.median_deviation import MAD_TO_SIGMA
from stickslip.files.schema import check_keys
from stickslip.tracking.scale.ruler import find_marks
from stickslip.tracking.video.source import read_picture
from stickslip.tracking.video.vision import vision

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254, "ft": 0.3048, "1": 1.0}

Pair = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Lens:
    """Radial distortion: a pixel at p shows what an ideal lens would show at c + (p − c)(1 + k1 ρ² + k2 ρ⁴).

    With ρ = |p − c|/radius.

    Parameters
    ----------
    centre : c in px.
    radius : the unit of ρ in px, usually half the picture's diagonal.
    k1, k2 : dimensionless; k1 > 0 for barrel distortion.
    """

    centre: Pair
    radius: float
    k1: float = 0.0
    k2: float = 0.0

    def straighten(self, marked: npt.ArrayLike) -> Array:
        """(n, 2) pixels as an ideal lens would show them."""
        away = np.asarray(marked, float) - self.centre
        rho2 = (away**2).sum(axis=-1, keepdims=True) / self.radius**2
        return np.asarray(self.centre + away * (1 + self.k1 * rho2 + self.k2 * rho2**2))


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """A map from pixels to the world's plane, x along an axis, y to its left (upwards where x points right).

    With s and n the pixel distances along and to the left of the axis through `origin`, after the lens is taken out,

        x = Σ_j c_j s^j,   y = n dx/ds,

    or, for a plane seen at an angle, the 3 x 3 `homography` H: (x, y, 1) ~ H (X, Y, 1).

    Parameters
    ----------
    origin : pixel (X, Y) where s = n = 0.
    angle : direction of the axis in degrees, counter-clockwise from the picture's right.
    coefficients : c_0, c_1, ... in m per px^j; (0, scale) for an even scale.
    unit : unit of x and y: ``"m"``, ``"1"`` for a dimensionless world, ``"px"`` for none.
    lens : radial distortion, or None.
    homography : rows of H, or None.
    scale_error : relative standard error of the scale.
    notes : sentences on how it was found and how well it fits.
    """

    origin: Pair = (0.0, 0.0)
    angle: float = 0.0
    coefficients: tuple[float, ...] = (0.0, 1.0)
    unit: str = "m"
    lens: Lens | None = None
    homography: tuple[tuple[float, ...], ...] | None = None
    scale_error: float = 0.0
    notes: tuple[str, ...] = field(default=())

    def to_world(self, x: npt.ArrayLike, y: npt.ArrayLike) -> tuple[Array, Array]:
        """World coordinates of pixels, any shape; NaN stays NaN."""
        marked = np.stack(np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float)), axis=-1)
        if self.lens is not None:
            marked = self.lens.straighten(marked)
        if self.homography is not None:
            world = _project(np.array(self.homography), marked)
            return world[..., 0], world[..., 1]
        turn = math.radians(self.angle)
        away = marked - self.origin
        s = away[..., 0] * math.cos(turn) - away[..., 1] * math.sin(turn)
        n = -away[..., 0] * math.sin(turn) - away[..., 1] * math.cos(turn)
        polynomial = np.polynomial.Polynomial(self.coefficients)
        return np.asarray(polynomial(s)), np.asarray(n * polynomial.deriv()(s))

    def discs_to_world(self, x: Array, y: Array, diameter: Array) -> tuple[Array, Array]:
        """World coordinates of the centres of flat discs whose images have their centroids at these pixels.

        A lens and a tilted plane map a disc to something whose centroid is not the image of its centre: of a disc of 20 px
        under k1 = 0.06 it is off by up to 0.02 px. The centre is the mean of the world coordinates over the image, by
        world area; eight points on a ring of radius √½ of the disc's have its second moments.

        Parameters
        ----------
        x, y, diameter : px, of one shape.
        """
        ring = 0.25 * math.pi * np.arange(8)
        radius = (math.sqrt(0.5) * 0.5 * np.nan_to_num(diameter))[..., None]
        around = x[..., None] + radius * np.cos(ring), y[..., None] + radius * np.sin(ring)
        (xx, yx), (xy, yy) = self._slopes(*around)
        area = np.abs(xx * yy - xy * yx)
        area = area / area.sum(axis=-1, keepdims=True)
        return tuple((area * part).sum(axis=-1) for part in self.to_world(*around))

    def _slopes(self, x: Array, y: Array) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Change of both world coordinates with a pixel to the right, and with one downwards."""
        step = 0.5
        right, left = self.to_world(x + step, y), self.to_world(x - step, y)
        down, up = self.to_world(x, y + step), self.to_world(x, y - step)
        return (right[0] - left[0], right[1] - left[1]), (down[0] - up[0], down[1] - up[1])

    def errors(self, x: Array, y: Array, x_error: Array, y_error: Array) -> tuple[Array, Array]:
        """Standard errors of the world coordinates from those of the pixels, to first order."""
        right, down = self._slopes(x, y)
        return tuple(np.hypot(right[i] * x_error, down[i] * y_error) for i in (0, 1))  # type: ignore[return-value]

    def to_dict(self) -> dict[str, Any]:
        """As plain data; :meth:`from_dict` reads it back."""
        return asdict(self)

    def to_json(self) -> str:
        """As a JSON document, how a motion file carries it."""
        return json.dumps(self.to_dict())

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Calibration:
        """The calibration that :meth:`to_dict` wrote."""
        lens = data.get("lens")
        rows = data.get("homography")
        return cls(
            **{
                **data,
                "origin": tuple(data["origin"]),
                "coefficients": tuple(data["coefficients"]),
                "lens": None if lens is None else Lens(**{**lens, "centre": tuple(lens["centre"])}),
                "homography": None if rows is None else tuple(tuple(row) for row in rows),
                "notes": tuple(data["notes"]),
            }
        )


FEWEST_FOR_LENS = 8
"""Marks of a plane from which its lens can be told too."""

FARTHEST = 1e9
"""No pixel lies farther away."""

PIXELS = Calibration(unit="px", coefficients=(0.0, 1.0))
"""No calibration: coordinates stay pixels, x to the right and y downwards as in the picture."""

_COMMON = ("unit", "origin", "angle", "lens")
_KINDS = {
    "scale": (),
    "points": ("length",),
    "ruler": ("first", "second", "last", "pitch", "order", "start"),
    "marks": ("positions", "order"),
    "checker": ("corners", "square"),
    "marker_size": (),
}


def read_calibration(
    table: Mapping[str, Any],
    folder: Path,
    marker_size: float | None = None,
    *,
    beside: Path | None = None,
    shape: tuple[int, int] | None = None,
) -> Calibration:
    """The calibration that a table asks for.

    Exactly one of these keys says how; lengths are in `unit` (default ``"m"``; results are in m):

    * ``scale``: px per unit.
    * ``points = [[x, y], [x, y]]`` with ``length``: two pixels and their distance; the axis runs from the first to the
      second, the first is the origin.
    * ``ruler = "photo.jpg"`` with ``first``, ``second``, ``last`` (pixels of those marks), ``pitch``, ``order`` (of the
      polynomial, default 3) and ``start`` (what the first mark says, default 0): the marks are found in the photo.
    * ``marks = [[x, y], ...]`` with ``positions = [...]`` and ``order`` (default 1): pixels of known places.
    * ``marks = [[x, y], ...]`` with ``positions = [[X, Y], ...]``, four or more: a plane seen at an angle, Y to
      the left of X; with eight or more its lens is fitted too where none is given.
    * ``checker = "board.png"`` with ``corners = [9, 6]`` (inner corners along and across) and ``square``: a board in the
      plane of motion; plane and lens are fitted together.
    * ``marker_size``: the true diameter (or side) of the marker that is tracked.

    ``origin = [x, y]``, ``angle`` (degrees, counter-clockwise) and ``lens = {k1 = ..., k2 = ..., centre = [x, y],
    radius = ...}`` may be added to the first four and the last.

    Parameters
    ----------
    table : the keys above.
    folder : where relative paths begin.
    marker_size : diameter of the tracked marker in px, for the kind of that name.
    beside : the film; a photo that is not in `folder` is looked for beside it.
    shape : (height, width) of the film's pictures, whose middle is that of a lens that is fitted.

    Raises
    ------
    InputError
        with the key that is unknown, missing or of another kind.
    """
    where = "calibration"
    if not isinstance(table, Mapping):
        raise InputError(f"{where}: expected a table with one of {', '.join(_KINDS)}, got {table!r}")
    kinds = [kind for kind in _KINDS if kind in table]
    if len(kinds) != 1:
        check_keys(table, [*_KINDS, *_COMMON, *(key for keys in _KINDS.values() for key in keys)], (), where)
        got = " and ".join(kinds) if kinds else "none"
        raise InputError(f"{where}: exactly one of {', '.join(_KINDS)} must say how, got {got}")
    kind = kinds[0]
    check_keys(table, [kind, *_KINDS[kind], *_COMMON], (), where)
    unit = str(table.get("unit", "m"))
    if unit not in UNITS:
        raise InputError(f"{where}: unit must be one of {', '.join(UNITS)}, got {unit!r}")
    factor = UNITS[unit]
    lens = _lens(table.get("lens"))
    base: dict[str, Any] = {"unit": "1" if unit == "1" else "m", "lens": lens}
    if "origin" in table:
        base["origin"] = _pair(table["origin"], "origin")
    if "angle" in table:
        base["angle"] = number("angle", table["angle"], where)
    if kind == "marks":
        return _from_marks(table, None, factor, base, shape)
    if kind in ("ruler", "checker"):
        photo = folder / str(table[kind])
        aside = photo if beside is None else beside.parent / str(table[kind])
        if not os.path.exists(photo) and os.path.exists(aside):  # noqa: PTH110 that of pathlib fails for names that cannot be
            photo = aside
        return (_from_checker if kind == "checker" else _from_marks)(table, photo, factor, base)
    if kind == "points":
        return _from_points(table, factor, base)
    given = _positive(table, kind)
    if kind == "scale":
        return Calibration(
            **base, coefficients=(0.0, factor / given), notes=(f"Scale given: {given:g} px per {unit}.",)
        )
    if marker_size is None:
        raise InputError(f"{where}: marker_size needs a marker that is tracked; give scale or points")
    note = f"Scale from the marker: {given:g} {unit} across {marker_size:.2f} px."
    # half a pixel of doubt at either rim of a marker that is blurred
    return Calibration(
        **base, coefficients=(0.0, factor * given / marker_size), scale_error=0.5 / marker_size, notes=(note,)
    )


def _from_points(table: Mapping[str, Any], factor: float, base: dict[str, Any]) -> Calibration:
    points = table["points"]
    if not isinstance(points, list | tuple) or len(points) != 2:
        raise InputError(f"calibration: points must be two pixels [[x, y], [x, y]], got {points!r}")
    pair = np.array([_pair(point, "points") for point in points])
    length = _positive(table, "length")
    straight = pair if base["lens"] is None else base["lens"].straighten(pair)
    step = straight[1] - straight[0]
    distance = float(np.hypot(*step))
    if distance < 2:
        raise InputError(f"calibration: the two points are {distance:.3g} px apart; choose points far from each other")
    found = {
        "origin": (float(straight[0, 0]), float(straight[0, 1])),
        "angle": math.degrees(math.atan2(-step[1], step[0])),
    }
    note = f"Scale from two points {distance:.2f} px apart; a pixel of doubt in one is {100 / distance:.2g} % of it."
    return Calibration(
        **{**found, **base}, coefficients=(0.0, factor * length / distance), scale_error=0.5 / distance, notes=(note,)
    )


def _from_marks(
    table: Mapping[str, Any],
    photo: Path | None,
    factor: float,
    base: dict[str, Any],
    shape: tuple[int, int] | None = None,
) -> Calibration:
    if photo is not None:
        for key in ("first", "second", "last"):
            if key not in table:
                raise InputError(f"calibration: {key} is missing; add the pixel of that mark, `{key} = [x, y]`")
        ends = [_pair(table[key], key) for key in ("first", "second", "last")]
        marked, numbers = find_marks(read_picture(photo), *ends)
        positions = number("start", table.get("start", 0.0), "calibration") + _positive(table, "pitch") * numbers
        order, of = table.get("order", 3), f"the ruler in {photo.name}"
    else:
        marks, given = table["marks"], table.get("positions")
        if not isinstance(marks, list | tuple) or not isinstance(given, list | tuple) or len(marks) != len(given):
            raise InputError(
                "calibration: marks and positions must be lists of one length; give a position for each mark"
            )
        if given and isinstance(given[0], list | tuple):
            return _from_plane_marks(table, factor, base, shape)
        marked = np.array([_pair(mark, "marks") for mark in marks])
        positions = np.array([_coordinate("positions", value) for value in given])
        order, of = table.get("order", 1), "the marks given"
    whole_number("order", order, f"calibration by {len(marked)} marks", 1, len(marked) - 1)
    straight = marked if base["lens"] is None else base["lens"].straighten(marked)
    middle = straight.mean(axis=0)
    along = np.linalg.svd(straight - middle)[2][0]
    along = along * np.sign(along @ (straight[-1] - straight[0]))
    # s is counted from the pixel on the ruler's line where X = 0 only if no origin is given: any other serves as well
    origin = np.array(base.pop("origin", (float(straight[0, 0]), float(straight[0, 1]))))
    angle = base.pop("angle", math.degrees(math.atan2(-along[1], along[0])))
    turn = math.radians(angle)
    s = (straight - origin) @ np.array([math.cos(turn), -math.sin(turn)])
    keep = np.ones(len(s), bool)
    for _ in range(3):  # a scratch or a stain taken for a mark stands out from the others
        curve = np.polynomial.Polynomial.fit(s[keep], positions[keep], order)
        misfit = np.abs(positions - curve(s))
        keep = misfit <= max(6 * MAD_TO_SIGMA * float(np.median(misfit)), 1e-9 * float(np.ptp(positions)))
        if keep.sum() <= order + 1:
            keep[:] = True
    rms = float(np.sqrt(np.mean((positions - curve(s))[keep] ** 2)))
    span = float(np.ptp(positions[keep]))
    unit = str(table.get("unit", "m"))
    notes = [
        f"Scale from {int(keep.sum())} of {len(s)} marks of {of}, a polynomial of order {order}: it misses the marks by "
        f"{rms:.3g} {unit} rms over {span:g} {unit}."
    ]
    if order < len(s) - 3:
        better = np.polynomial.Polynomial.fit(s[keep], positions[keep], order + 1)
        finer = float(np.sqrt(np.mean((positions - better(s))[keep] ** 2)))
        if finer < 0.5 * rms:
            notes.append(
                f"A polynomial of order {order + 1} would miss them by {finer:.3g} {unit}: "
                f"`order = {order + 1}` is the truer scale."
            )
    coefficients = tuple(factor * float(value) for value in curve.convert().coef)
    return Calibration(
        **base,
        origin=(float(origin[0]), float(origin[1])),
        angle=float(angle),
        coefficients=coefficients,
        scale_error=rms / span,
        notes=tuple(notes),
    )


def _from_checker(table: Mapping[str, Any], photo: Path, factor: float, base: dict[str, Any]) -> Calibration:
    cv2 = vision()
    picture = read_picture(photo)
    corners = table.get("corners")
    if not isinstance(corners, list | tuple) or len(corners) != 2 or min(corners) < 3:
        raise InputError(
            f"calibration: corners must be the inner corners [along, across], 3 or more each, got {corners!r}"
        )
    along, across = (int(value) for value in corners)
    square = _positive(table, "square")
    grey = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
    found, marked = cv2.findChessboardCornersSB(grey, (along, across), flags=cv2.CALIB_CB_ACCURACY)
    if not found:
        raise InputError(
            f"{photo}: no checker board with {along} x {across} inner corners seen; check corners and light"
        )
    marked = marked.reshape(-1, 2).astype(float)
    rows, columns = np.divmod(np.arange(along * across), along)
    board = np.stack([columns, across - 1 - rows], axis=1).astype(float)  # y upwards
    if (marked[along - 1] - marked[0]) @ (1, 0) < 0:  # the finder may begin at either end of the board
        marked = marked[::-1]
    unit = str(table.get("unit", "m"))
    of = f"corners of the board in {photo.name}"
    return _plane(marked, square * board, of, unit, factor, base, grey.shape, terms=2)


def _from_plane_marks(
    table: Mapping[str, Any], factor: float, base: dict[str, Any], shape: tuple[int, int] | None
) -> Calibration:
    marks = np.array([_pair(mark, "marks") for mark in table["marks"]])
    positions = np.array([_pair(position, "positions") for position in table["positions"]])
    for key in ("order", "origin", "angle"):
        if key in table:
            raise InputError(
                f"calibration: {key} is no part of a plane through marks; their positions say it, leave it out"
            )
    if len(marks) < 4:
        raise InputError(
            f"calibration: a plane needs four marks or more with positions [[x, y], ...], got {len(marks)}"
        )
    given = base["lens"] is not None or shape is None
    terms = 0 if given or len(marks) < FEWEST_FOR_LENS else 1
    return _plane(marks, positions, "marks given", str(table.get("unit", "m")), factor, base, shape, terms=terms)


def _plane(
    marked: Array,
    world: Array,
    of: str,
    unit: str,
    factor: float,
    base: dict[str, Any],
    shape: tuple[int, ...] | None,
    *,
    terms: int,
) -> Calibration:
    """A plane seen at an angle, from places in the picture and in the plane, with so many terms of a lens fitted."""
    from scipy.optimize import least_squares

    span = float(np.ptp(world, axis=0).max())
    if min(np.linalg.svd(points - points.mean(axis=0))[1][1] / np.ptp(points) for points in (marked, world)) < 1e-3:
        raise InputError("calibration: the marks lie on one line, which shows no plane; add marks beside it")
    high, wide = shape if shape is not None else (0, 0)
    centre, radius = ((wide - 1) / 2, (high - 1) / 2), math.hypot(wide, high) / 2

    def lens_of(numbers: Array) -> Lens | None:
        if not terms:
            given: Lens | None = base["lens"]
            return given
        return Lens(centre=centre, radius=radius, **dict(zip(("k1", "k2"), map(float, numbers), strict=False)))

    def straight(lens: Lens | None) -> Array:
        return marked if lens is None else lens.straighten(marked)

    start = vision().findHomography(straight(None if terms else base["lens"]), world / span)[0]
    if start is None:
        raise InputError("calibration: no plane goes through these marks; check the order of marks and positions")

    def misfit(p: Array) -> Array:
        plane = np.append(p[:8], 1.0).reshape(3, 3)
        return np.asarray((_project(plane, straight(lens_of(p[8:]))) - world / span).ravel())

    fit = least_squares(misfit, np.append(start.ravel()[:8] / start[2, 2], np.zeros(terms)), x_scale="jac")
    plane = np.append(fit.x[:8], 1.0).reshape(3, 3)
    plane[:2] *= span * factor
    rms = float(np.sqrt(2 * np.mean(fit.fun**2))) * span
    lens = lens_of(fit.x[8:])
    note = f"Plane from {len(marked)} {of}: they are missed by {rms:.3g} {unit} rms"
    if terms and lens is not None:
        note += f"; lens fitted with it, k1 = {lens.k1:.4g}, k2 = {lens.k2:.4g}"
    extent = float(np.ptp(marked, axis=0).max())
    if len(marked) == 4:
        note += f" as any four are; a pixel of doubt in one is {100 / extent:.2g} % of the scale"
    return Calibration(
        **{**base, "lens": lens},
        homography=tuple(tuple(float(value) for value in row) for row in plane),
        scale_error=max(rms / span, 0.5 / extent if len(marked) == 4 else 0.0),
        notes=(note + ".",),
    )


def _project(plane: Array, marked: Array) -> Array:
    ahead = np.concatenate([marked, np.ones((*marked.shape[:-1], 1))], axis=-1) @ plane.T
    return np.asarray(ahead[..., :2] / ahead[..., 2:])


def _lens(table: object) -> Lens | None:
    if table is None:
        return None
    if not isinstance(table, Mapping):
        raise InputError(
            f"calibration: lens must be a table {{k1 = ..., centre = [x, y], radius = ...}}, got {table!r}"
        )
    check_keys(table, ("k1", "k2", "centre", "radius"), ("k1", "centre", "radius"), "calibration lens")
    numbers = {key: number(key, table.get(key, 0.0), "calibration lens") for key in ("k1", "k2", "radius")}
    if not 1 <= numbers["radius"] <= FARTHEST or max(abs(numbers["k1"]), abs(numbers["k2"])) > FARTHEST:
        raise InputError(
            f"calibration lens: radius must be px from 1 to {FARTHEST:g}, and k1 and k2 no larger, got {dict(table)!r}"
        )
    return Lens(centre=_pair(table["centre"], "centre"), **numbers)


def _pair(value: object, name: str) -> Pair:
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise InputError(f"calibration: {name} must be a pixel [x, y], got {value!r}")
    return _coordinate(name, value[0]), _coordinate(name, value[1])


def _coordinate(name: str, value: object) -> float:
    """A coordinate, small enough for its powers to be numbers."""
    found = number(name, value, "calibration")
    if abs(found) > FARTHEST:
        raise InputError(f"calibration: {name} must lie within ±{FARTHEST:g}, got {found:g}: look for a digit too many")
    return found


def _positive(table: Mapping[str, Any], key: str) -> float:
    if key not in table:
        raise InputError(f"calibration: {key} is missing; add a line `{key} = ...`")
    value = number(key, table[key], "calibration")
    if value <= 0:
        raise InputError(f"calibration: {key} must be a positive number, got {value:g}")
    return value
