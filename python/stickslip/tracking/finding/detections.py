"""What a finder hands over for one picture: possible markers with their centres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from stickslip.files.arrays import Array


class Row(NamedTuple):
    """One possible marker; see :class:`Detections`."""

    x: float
    y: float
    x_error: float
    y_error: float
    size: float
    size_error: float
    contrast: float
    score: float
    label: int = -1
    cut_x: bool = False
    cut_y: bool = False

    def moved(self, dx: float, dy: float) -> Row:
        """Shifted from the corner of a window to that of the picture."""
        return self._replace(x=self.x + dx, y=self.y + dy)


@dataclass(frozen=True)
class Detections:
    """Possible markers in one picture, n of them; all lengths in px, the centre of the top left pixel is (0, 0).

    Attributes
    ----------
    x, y : centres, x to the right, y downwards.
    x_error, y_error : standard errors of the centres from the picture's noise.
    size : diameter of a disc of the same area.
    size_error : its standard error from the picture's noise; NaN where the finder does not know it.
    contrast : how far the marker stands out: grey levels for blobs, correlation for templates.
    score : how much it looks like a marker; only for choosing between candidates.
    label : identity that the marker itself carries, else -1.
    cut_x, cut_y : whether an edge of the picture or the region cuts it off, so that the centre is not its own.
    """

    x: Array
    y: Array
    x_error: Array
    y_error: Array
    size: Array
    size_error: Array
    contrast: Array
    score: Array
    label: npt.NDArray[np.int64]
    cut_x: npt.NDArray[np.bool_]
    cut_y: npt.NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.x)

    @classmethod
    def of(cls, rows: Sequence[tuple[float, ...]]) -> Detections:
        """From rows of the attributes in their order."""
        table = np.array(rows, float).reshape(-1, len(fields(cls)))
        types = (np.float64,) * (len(fields(cls)) - 3) + (np.int64, np.bool_, np.bool_)
        return cls(*(column.astype(kind) for column, kind in zip(table.T, types, strict=True)))

    def rows(self) -> list[Row]:
        """One by one."""
        return [Row(*row) for row in zip(*(getattr(self, item.name).tolist() for item in fields(self)), strict=True)]

    def take(self, which: npt.NDArray[np.int64]) -> Detections:
        """Those of the indices `which`."""
        return Detections(*(getattr(self, item.name)[which] for item in fields(self)))

    def best(self, count: int) -> Detections:
        """The `count` of highest score."""
        return self if len(self) <= count else self.take(np.sort(np.argsort(-self.score, kind="stable")[:count]))

    def moved(self, dx: float, dy: float) -> Detections:
        """Shifted from the corner of a region to that of the picture."""
        columns = {item.name: getattr(self, item.name) for item in fields(self)}
        return Detections(**(columns | {"x": self.x + dx, "y": self.y + dy}))
