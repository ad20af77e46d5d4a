"""What makes a section: the words and numbers that name a surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from stickslip import _core
from stickslip.errors import InputError, did_you_mean, number
from stickslip.model.system import Oscillator, System

#: Sections by a word, beside the kinds of events.
NAMED = ("strobe", "maximum", "minimum")


@dataclass(frozen=True)
class Surface:
    """What makes a section: times `start` + n `period`, events of a `kind`, or normal · (x, ẋ, ẍ) = level.

    The core looks for the points (`Surface` in ``crates/stickslip/src/observer/surface.rs``).
    """

    kind: str | None = None
    period: float | None = None
    start: float = 0.0
    normal: tuple[float, float, float] | None = None
    level: float = 0.0
    direction: int = 0

    def to_dict(self) -> dict[str, Any]:
        """The document for the core."""
        if self.kind is not None:
            return {"event": self.kind}
        if self.period is not None:
            return {"strobe": {"period": self.period, "start": self.start}}
        return {"plane": {"normal": self.normal, "level": self.level, "direction": self.direction}}


def forcing_frequency(system: Oscillator | System) -> float | None:
    """The frequency of the first force that varies or, without one, of a drive or a normal force; none where nothing does.

    >>> from stickslip import Drive, Oscillator, laws
    >>> forcing_frequency(Oscillator(0.1, Drive.shaken(0.2, 0.05, 1.3), laws.Coulomb(0.5)))
    1.3
    """
    return next((float(harmonic.frequency) for harmonic in system.swings), None)


def usual_surface(system: Oscillator | System) -> Surface:
    """The stroboscopic section of a forced system, the maxima of x of another.

    >>> from stickslip import paper
    >>> usual_surface(paper.oscillator(0.3)).direction
    -1
    """
    frequency = forcing_frequency(system)
    if frequency is not None:
        return Surface(period=2 * np.pi / frequency)
    return Surface(normal=(0.0, 1.0, 0.0), direction=-1)


def surface_from(
    system: Oscillator | System,
    on: str | None,
    *,
    normal: ArrayLike | None = None,
    level: float = 0.0,
    direction: int = 0,
    period: float | None = None,
    start: float = 0.0,
    where: str = "section",
) -> Surface:
    """The surface that the words and numbers of :func:`section` name.

    >>> from stickslip import paper
    >>> surface_from(paper.oscillator(0.3), "release").kind
    'release'
    """
    if normal is not None:
        factors = np.asarray(normal, float)
        if on is not None or factors.shape != (2,) or not np.isfinite(factors).all() or not factors.any():
            raise InputError(
                f"{where}: normal must be two numbers (of x and v), not both 0, and on be left out; got {normal!r}"
            )
        if direction not in (-1, 0, 1):
            raise InputError(f"{where}: direction must be 1 (rising), -1 (falling) or 0 (both), got {direction!r}")
        return Surface(
            normal=(float(factors[0]), float(factors[1]), 0.0),
            level=number("level", level, where),
            direction=direction,
        )
    if on is None and period is None:
        return usual_surface(system)
    if on in ("maximum", "minimum"):
        return Surface(normal=(0.0, 1.0, 0.0), direction=-1 if on == "maximum" else 1)
    if on in (None, "strobe"):
        every = usual_surface(system).period if period is None else number("period", period, where)
        if every is None:
            raise InputError(
                f"{where}: this system has no forcing; say the period of the stroboscopic section, period=..."
            )
        if every <= 0:
            raise InputError(f"{where}: period must be greater than 0, got {every:g}")
        return Surface(period=every, start=number("start", start, where))
    if on not in _core.KINDS:
        known = (*NAMED, *_core.KINDS)
        raise InputError(f"{where}: on must be one of {', '.join(known)}, got {on!r}{did_you_mean(str(on), known)}")
    return Surface(kind=on)
