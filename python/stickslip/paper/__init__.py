"""The system of "Almost periodic vibration excited by dry friction", with our calibration of what it leaves open.

``paper.oscillator`` makes it, ``paper.figures`` draws the paper's figures from it, ``paper.score`` says which of the
``paper.claims()`` it shows, ``paper.reproduce`` writes all of that down, ``paper.calibration`` is the search for what the
paper leaves open.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from stickslip.laws import BogaczRyczek
from stickslip.model.drive import Harmonic
from stickslip.model.system import Oscillator

if TYPE_CHECKING:
    from stickslip.paper import calibration, figures
    from stickslip.paper.reproduction import reproduce
    from stickslip.paper.scoring import claims, score

__all__ = [
    "DAMPING",
    "END_OF_OSCILLATION",
    "END_OF_STICK_SLIP",
    "calibration",
    "claims",
    "figures",
    "oscillator",
    "reproduce",
    "score",
]

_HOME = {"reproduce": "reproduction", "score": "scoring", "claims": "scoring"}

#: Dimensionless damping d: the paper does not state it; this value puts the end of stick-slip at s ≈ 0.25.
DAMPING = 0.35

#: What the paper reports: stick-slip below the first, stable slip above the second drive velocity.
END_OF_STICK_SLIP, END_OF_OSCILLATION = 0.25, 0.40


def oscillator(drive_velocity: float, forcing: Harmonic | None = None) -> Oscillator:
    """The paper's oscillator ẍ + d ẋ + x = f(w, t_s, δ, sign ẇ) + u₀ cos ηt at one drive velocity, dimensionless.

    Parameters
    ----------
    drive_velocity : s, dimensionless.
    forcing : u₀ cos ηt as ``Harmonic(u0, eta)``, or None.

    Source: Eqs. (6) and (10) of the paper; damping and law are our calibration (``docs/paper-law.md``).

    >>> oscillator(0.3).damping
    0.35
    """
    return Oscillator(damping=DAMPING, drive_velocity=drive_velocity, law=BogaczRyczek(), forcing=forcing)


def __getattr__(name: str) -> Any:
    # Pictures and scores need more than an oscillator does: imported when asked for.
    if name in _HOME:
        return getattr(importlib.import_module(f"stickslip.paper.{_HOME[name]}"), name)
    if name in ("calibration", "figures"):
        return importlib.import_module(f"stickslip.paper.{name}")
    raise AttributeError(f"module 'stickslip.paper' has no attribute {name!r}")
