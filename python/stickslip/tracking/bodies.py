"""Several points of one body: how it is shifted and turned."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from stickslip.errors import InputError
from stickslip.files.arrays import Array

if TYPE_CHECKING:
    import xarray as xr

ROUNDS = 3
"""Times that the shape of the body is averaged over the film."""


def rigid_body(motion: xr.Dataset, points: Sequence[int] | None = None) -> xr.Dataset:
    """The motion of a body some of whose points were followed.

    In each picture the shift c and the angle θ minimise, over the points that are seen,

        Σ_i |p_i − c − R(θ) q_i|² / σ_i²,

    with the shape q_i of the body, its centre at 0, as the mean over all pictures shows it. The errors are those of the
    points' errors σ_i, and as much larger as the points are off a rigid body.

    Parameters
    ----------
    motion : from :func:`stickslip.track`, in m or px.
    points : numbers of the masses that are points of the body, two or more; default all.

    Returns
    -------
    A motion of one mass: ``x``, ``y`` of the body's centre (the mean of the points), ``angle`` in rad, from x towards y, 0
    where all points are first seen, continuous; ``x_error``, ``y_error``, ``angle_error``; ``lost`` where fewer than two
    points are seen. A note says how rigid the body is.

    Raises
    ------
    InputError
        where there are fewer than two points, or no picture shows all of them.

    Limits: motion in the plane; a body that moves towards the camera grows, which the note shows.

    Source: Arun, Huang & Blostein, IEEE Trans. Pattern Anal. 9 (1987) 698, doi:10.1109/TPAMI.1987.4767965.

    Examples
    --------
    >>> body = rigid_body(track("block.mp4", masses=3), [0, 1, 2])  # doctest: +SKIP
    """
    masses = motion.sizes["mass"]
    chosen = list(range(masses)) if points is None else list(points)
    if len(set(chosen)) < max(2, len(chosen)) or not set(chosen) <= set(range(masses)):
        raise InputError(f"rigid_body: expected two or more of the masses 0 to {masses - 1} as points, got {chosen}")
    square = _variance(motion, chosen)
    positions = motion["x"].to_numpy()[:, chosen] + 1j * motion["y"].to_numpy()[:, chosen]
    known = np.isfinite(positions)
    whole = np.flatnonzero(known.all(axis=1))
    if not whole.size:
        raise InputError("rigid_body: no picture shows all points; leave those out that are seen least")
    weight, positions = np.where(known, 1 / square, 0.0), np.where(known, positions, 0)
    shape = positions[whole[0]] - positions[whole[0]].mean()
    if np.abs(shape).max() == 0:
        raise InputError("rigid_body: the points lie at one place; name points that are apart")
    enough = known.sum(axis=1) >= 2
    for _ in range(ROUNDS):
        centre, turn, _ = _pose(positions, weight, shape)
        own = np.where(known & enough[:, None], (positions - centre[:, None]) / turn[:, None], 0).sum(axis=0)
        shape = own / (known & enough[:, None]).sum(axis=0)
        shape = (shape - shape.mean()) * turn[whole[0]]
    centre, turn, error = _pose(positions, weight, shape)
    off = np.where(known, positions - centre[:, None] - turn[:, None] * shape, 0)[enough]
    free = 2 * known[enough].sum() - 3 * enough.sum()
    scale = max(1.0, math.sqrt(float((weight[enough] * np.abs(off) ** 2).sum()) / max(int(free), 1)))
    total = np.maximum(weight.sum(axis=1), 1e-300)
    arm = turn * (weight @ shape) / total
    errors = {
        "x_error": np.sqrt(1 / total + (arm.imag * error) ** 2),
        "y_error": np.sqrt(1 / total + (arm.real * error) ** 2),
        "angle_error": error,
    }
    angle = np.full(len(turn), np.nan)
    angle[enough] = np.unwrap(np.angle(turn[enough]))
    kept = [name for name in ("x", "y", "x_error", "y_error", "x_px", "y_px") if name in motion]
    found = motion[kept].isel(mass=chosen).mean("mass").expand_dims(mass=[0], axis=-1)
    columns = {"x": centre.real, "y": centre.imag, "angle": angle} | {name: scale * one for name, one in errors.items()}
    for name, column in columns.items():
        units = {"units": "rad"} if name.startswith("angle") else motion[name].attrs
        found[name] = (("time", "mass"), np.where(enough, column, np.nan)[:, None], units)
    lost = np.where(enough, "", "fewer than two points seen").astype(object)
    found["lost"] = (("time", "mass"), lost[:, None])
    rms = math.sqrt(float(np.mean(np.abs(off[known[enough]]) ** 2)))
    unit = motion["x"].attrs.get("units", "px")
    said = f"The points {', '.join(map(str, chosen))} are off one rigid body by {rms:.2g} {unit} rms."
    found.attrs = {**motion.attrs, "notes": [*motion.attrs.get("notes", []), said]}
    return found


def _variance(motion: xr.Dataset, chosen: list[int]) -> Array:
    """Of a coordinate of each point; never zero, so that a truth without errors can be fitted."""
    both = 0.5 * sum(motion[name].to_numpy()[:, chosen] ** 2 for name in ("x_error", "y_error"))
    least = float(np.nanmax(both)) if np.isfinite(both).any() else 0.0
    return np.maximum(np.nan_to_num(both, nan=1.0), 1e-6 * least if least > 0 else 1.0)


def _pose(positions: np.ndarray, weight: Array, shape: np.ndarray) -> tuple[np.ndarray, np.ndarray, Array]:
    """Centre, turn exp(iθ) and error of θ in each picture, from points as complex numbers."""
    total = np.maximum(weight.sum(axis=1), 1e-300)
    middle, of_shape = (weight * positions).sum(axis=1) / total, weight @ shape / total
    arms = shape - of_shape[:, None]
    product = (weight * arms.conj() * (positions - middle[:, None])).sum(axis=1)
    turn = np.where(np.abs(product) > 0, product / np.maximum(np.abs(product), 1e-300), 1)
    lever = (weight * np.abs(arms) ** 2).sum(axis=1)
    return middle - turn * of_shape, turn, 1 / np.sqrt(np.maximum(lever, 1e-300))
