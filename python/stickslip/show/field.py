"""Fields of displacement and strain over the grid of their film."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.errors import InputError
from stickslip.show.canvas import new_axes, styled

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

ERRORS = 8.0
"""Standard errors that the colours of a picture go to at least."""


def field_plot(field: xr.Dataset, variable: str = "u", ax: Axes | None = None, *, picture: int = -1) -> Axes:
    """Draw one quantity of a field over the grid, as in the picture: y runs downwards.

    Parameters
    ----------
    field : from :func:`stickslip.tracking.displacement_field`.
    variable : ``"u"``, ``"v"``, ``"exx"``, ``"eyy"``, ``"exy"``, ``"rotation"`` or ``"residual"``.
    ax : where to draw; default a new figure.
    picture : its number; default the last.

    Returns
    -------
    The axes, with a colour bar; what was not found is left white.
    """
    names = [str(name) for name in field.data_vars if not str(name).endswith("_error")]
    if variable not in names:
        raise InputError(f"a field holds {', '.join(names)}, got {variable!r}; choose one of these")
    values = field[variable].isel(time=picture)
    across, down = _sides(field)
    if ax is None:
        (ax,) = new_axes(figsize=(5.0, max(5.0 * down / across, 1.0) + 0.8))
    limits: dict[str, Any] = {"cmap": "cividis", "vmin": 0.0}
    if variable != "residual":  # of two signs, white at zero; and errors alone must not look like a field
        known = values.to_numpy()[np.isfinite(values)]
        errors = field[f"{variable}_error"].isel(time=picture).to_numpy()[np.isfinite(values)]
        most = max(float(np.abs(known).max()), ERRORS * float(np.median(errors))) if known.size else 1.0
        limits = {"cmap": "RdBu_r", "vmin": -most, "vmax": most}
    mesh = ax.pcolormesh(field["x"], field["y"], values, shading="nearest", rasterized=True, **limits)
    words, unit = str(values.attrs["long_name"]), values.attrs["units"]
    quantity = (words if variable in words else f"{words}, {variable}") + ("" if unit == "1" else f" ({unit})")
    with styled():
        ax.figure.colorbar(mesh, ax=ax)
    ax.set(xlabel="x (px)", ylabel="y (px)", aspect="equal")
    ax.set_title(f"{quantity} at {float(values['time']):.4g} s", fontsize=8)
    if not ax.yaxis_inverted():
        ax.invert_yaxis()
    return ax


def field_figure(field: xr.Dataset, picture: int = -1) -> Any:
    """Displacements, strains, rotation and residual of one picture, one beside the other."""
    across, down = _sides(field)
    names = ("u", "v", "rotation", "residual", "exx", "eyy", "exy")
    rows, columns = (4, 2) if down < 0.5 * across else (2, 4)
    wide = 4.2 if columns == 2 else 3.2
    axes = new_axes(rows, columns, figsize=(wide * columns, rows * (0.7 * wide * down / across + 0.7)))
    for name, ax in zip(names, axes, strict=False):
        field_plot(field, name, ax, picture=picture)
    for ax in axes[: len(names) - columns]:  # the panel below has the same axis
        ax.set_xlabel("")
    axes[-1].set_axis_off()
    return axes[0].get_figure(root=True)


def _sides(field: xr.Dataset) -> tuple[float, float]:
    """Px across and down that the points of the grid stand for."""
    across, down = (float(np.ptp(field[name].to_numpy())) + float(field.attrs["spacing"]) for name in "xy")
    return across, down
