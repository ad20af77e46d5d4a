"""Subset correlation: how a piece of texture has moved and strained, to a few thousandths of a pixel."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from stickslip.files.arrays import Array

MARGIN = 8
"""Px of picture around a piece that its spline sees; what is farther away changes it by less than 1e-4."""

FARTHEST = 2.0
"""Px that the fit may move from where it begins."""

ITERATIONS = 30


@dataclass(frozen=True)
class Match:
    """Where a piece was found.

    Attributes
    ----------
    x, y : its centre in px.
    gradient : displacement gradients ((∂u/∂x, ∂u/∂y), (∂v/∂x, ∂v/∂y)); zeros where only a shift was fitted.
    covariance : of x, y and, where they were fitted, the gradients row by row, from what is left over.
    residual : its standard deviation in grey levels.
    correlation : of the piece, as it was fitted, with what was found.
    """

    x: float
    y: float
    gradient: Array
    covariance: Array
    residual: float
    correlation: float

    @property
    def x_error(self) -> float:
        """Standard error of x."""
        return math.sqrt(self.covariance[0, 0])

    @property
    def y_error(self) -> float:
        """Standard error of y."""
        return math.sqrt(self.covariance[1, 1])


@dataclass(frozen=True)
class Subset:
    """A piece of a picture that is to be found in others.

    The displacement u(p) = d + G p of its pixels p, counted from its centre, the gain a and the offset b minimise

        Σ_p [I(c + p + u(p)) − a T(p) − b]²

    by Gauss-Newton steps in the piece's own coordinates (inverse compositional), with the picture I interpolated by quintic
    splines: cubic ones and tables of weights move the result by up to ± 0.025 px with the fraction of a pixel (S-curve).

    Parameters
    ----------
    piece : T, (height, width) grey levels.
    affine : fit the gradient G too; else the piece may only shift.

    Source: Baker & Matthews, Int. J. Comput. Vis. 56 (2004) 221, doi:10.1023/B:VISI.0000011205.11775.fd; Schreier, Braasch &
    Sutton, Opt. Eng. 39 (2000) 2915, doi:10.1117/1.1314593 (splines).
    """

    piece: npt.NDArray[np.float32] | npt.NDArray[np.uint8]
    affine: bool = False

    @cached_property
    def _grid(self) -> tuple[Array, Array]:
        high, wide = self.piece.shape
        rows, columns = np.mgrid[:high, :wide].astype(float)
        return (columns - (wide - 1) / 2).ravel(), (rows - (high - 1) / 2).ravel()

    @cached_property
    def _design(self) -> Array:
        from scipy.ndimage import correlate1d

        x, y = self._grid
        piece = self.piece.astype(float)
        # derivatives to sixth order in the pixel: those of the spline but for what a picture cannot hold
        taps = np.array([-1, 9, -45, 0, 45, -9, 1]) / 60
        right, down = (correlate1d(piece, taps, axis=axis, mode="nearest").ravel() for axis in (1, 0))
        strain = [right * x, right * y, down * x, down * y] if self.affine else []
        return np.stack([right, down, *strain, piece.ravel(), np.ones(x.size)], axis=1)

    @cached_property
    def _inverse(self) -> Array | None:
        normal = self._design.T @ self._design
        length = np.sqrt(np.diag(normal))
        if not length.all() or np.linalg.cond(normal / np.outer(length, length)) > 1e8:
            return None
        return np.asarray(np.linalg.inv(normal))

    @property
    def plain(self) -> bool:
        """Whether it has too little texture to be found."""
        return self._inverse is None

    def find(
        self,
        picture: npt.NDArray[np.float32] | npt.NDArray[np.uint8],
        x: float,
        y: float,
        gradient: Array | None = None,
    ) -> Match | None:
        """The piece in a picture, near its centre's place (x, y); None where it is not there or has too little texture.

        `gradient` is that of its displacement to begin with, for pieces that have turned far.
        """
        from scipy.linalg import block_diag
        from scipy.ndimage import map_coordinates, spline_filter

        inverse = self._inverse
        if inverse is None:
            return None
        high, wide = self.piece.shape
        left, top = (math.floor(at - 0.5 * side) - MARGIN for at, side in ((x, wide), (y, high)))
        left, top = max(left, 0), max(top, 0)
        window = picture[top : math.ceil(y + 0.5 * high) + MARGIN + 1, left : math.ceil(x + 0.5 * wide) + MARGIN + 1]
        spline = spline_filter(window.astype(float), order=5, mode="mirror")
        grid = np.stack([*self._grid, np.ones(self.piece.size)])
        warp = np.array([[1, 0, x - left], [0, 1, y - top], [0, 0, 1.0]])
        if gradient is not None:
            warp[:2, :2] += gradient
        shape = max(wide, high) / 2
        for _ in range(ITERATIONS):
            columns, rows, _one = warp @ grid
            here = map_coordinates(spline, [rows, columns], order=5, mode="mirror", prefilter=False)
            solution = inverse @ (self._design.T @ here)
            gain = solution[-2]
            if not gain > 0.1:
                return None
            step = np.eye(3)
            step[:2, 2] = solution[:2] / gain
            if self.affine:
                step[:2, :2] += solution[2:6].reshape(2, 2) / gain
            warp = warp @ np.linalg.inv(step)
            if np.abs((step - np.eye(3)) @ [shape, shape, 1]).max() < 1e-4:
                break
        else:
            return None
        found_x, found_y = float(warp[0, 2]) + left, float(warp[1, 2]) + top
        if not math.hypot(found_x - x, found_y - y) <= FARTHEST:
            return None
        left_over = here - self._design @ solution
        square, whole = float(left_over @ left_over), float(np.sum((here - here.mean()) ** 2))
        residual = math.sqrt(square / max(1, here.size - len(solution)))
        forward = warp[:2, :2]
        moved = block_diag(forward, *([np.kron(forward, np.eye(2))] if self.affine else []))  # steps are in the piece
        covariance = (residual / gain) ** 2 * moved @ inverse[:-2, :-2] @ moved.T
        correlation = math.sqrt(max(1 - square / whole, 0.0))
        return Match(found_x, found_y, forward - np.eye(2), covariance, residual, correlation)
