"""The system of "Almost periodic vibration excited by dry friction", with our calibration of what it leaves open.

``paper.oscillator`` makes it, ``paper.figures`` draws the paper's figures from it, ``paper.score`` says which of the
``paper.claims()`` it shows, ``paper.reproduce`` writes all of that down, ``paper.calibration`` is the search for what the
paper leaves open.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from stickslip.paper.default_calibration import DAMPING, END_OF_OSCILLATION, END_OF_STICK_SLIP, oscillator

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


def __getattr__(name: str) -> Any:
    # Pictures and scores need more than an oscillator does: imported when asked for.
    if name in _HOME:
        return getattr(importlib.import_module(f"stickslip.paper.{_HOME[name]}"), name)
    if name in ("calibration", "figures"):
        return importlib.import_module(f"stickslip.paper.{name}")
    raise AttributeError(f"module 'stickslip.paper' has no attribute {name!r}")
