"""Pictures of machine cameras as bare grey levels: nothing in the file says how large they are."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
import numpy.typing as npt

from stickslip.errors import InputError
from stickslip.files.schema import Count, Document, Limits


@dataclass(frozen=True, kw_only=True)
class Raw(Document):
    """How bare grey levels lie in a file: one picture after the other, row by row, the lower byte first.

    Parameters
    ----------
    width, height : of a picture in px.
    bits : of a pixel, 8 to 16; from 9 on each takes two bytes.
    packed : the bits of the pixels follow each other without a gap, the lowest first (Mono10p, Mono12p).
    header : bytes before the first picture.

    Examples
    --------
    >>> Raw(width=640, height=480, bits=12, packed=True).bytes
    460800
    """

    TITLE: ClassVar[str] = "raw"

    width: Count
    height: Count
    bits: Annotated[int, Limits(least=8, most=16)] = 8
    packed: bool = False
    header: Annotated[int, Limits(least=0)] = 0

    @property
    def bytes(self) -> int:
        """Of a picture."""
        each = self.bits if self.packed else 8 if self.bits == 8 else 16
        if self.width * self.height * each % 8:
            self.refuse(f"{self.width} x {self.height} px of {self.bits} packed bits end inside a byte; correct them")
        return self.width * self.height * each // 8

    @property
    def white(self) -> int:
        """The largest grey level."""
        return int(2**self.bits - 1)

    def count(self, path: Path) -> int:
        """Pictures in a file.

        Raises
        ------
        InputError
            where it does not hold whole pictures.
        """
        size = path.stat().st_size - self.header
        if size <= 0 or size % self.bytes:
            raise InputError(
                f"{path}: expected whole pictures of {self.bytes} bytes ({self.width} x {self.height} px of {self.bits} bits"
                f"{', packed' if self.packed else ''}), got {max(size, 0)} bytes after the header; correct raw"
            )
        return size // self.bytes

    def read(self, path: Path, number: int) -> npt.NDArray[Any]:
        """A picture (from 0), shape (height, width).

        Raises
        ------
        InputError
            where a grey level is too large.
        """
        start = self.header + number * self.bytes
        if self.packed:
            bits = np.unpackbits(np.fromfile(path, np.uint8, self.bytes, offset=start), bitorder="little")
            levels = bits.reshape(-1, self.bits).astype(np.uint16) @ (1 << np.arange(self.bits)).astype(np.uint16)
        else:
            kind = np.uint8 if self.bits == 8 else np.dtype("<u2")
            levels = np.fromfile(path, kind, self.width * self.height, offset=start)
        if levels.max() > self.white:
            raise InputError(
                f"{path}: picture {number} holds the grey level {levels.max()}, more than {self.bits} bits can say; correct "
                "bits, packed or header of raw"
            )
        return np.asarray(levels.reshape(self.height, self.width))
