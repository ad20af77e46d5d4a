"""The law of "Almost periodic vibration excited by dry friction": static friction, branches and their memory."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from stickslip.laws.law import Law, Point
from stickslip.laws.static_friction import StaticFriction

Pencil = Annotated[Point | None, Point | Literal["infinity"] | None]


@dataclass(frozen=True)
class BogaczRyczek(Law):
    """The law with memory f(w, t_s, δ, sign ẇ) of "Almost periodic vibration excited by dry friction".

    Static friction f_s(t_s, δ) and two piecewise-linear kinetic branches, the upper one while |w| grows, the lower one while
    it falls. The branches are lines of four pencils and meet at a corner on the line l; see ``docs/paper-law.md`` for what
    the paper states, what we read into it and what we calibrated. The default has the paper's geometry and our calibration.

    Parameters
    ----------
    static_friction : the surface f_s(t_s, δ), calibrated.
    A : pencil (w, f) of the upper lines, None at infinity: then they have the angle `phi`.
    B : pencil of the lower lines, at w ≤ 0.
    C : pencil of the common lines, None at infinity: then they have the angle `psi`.
    D : pencil of the climbs from the lower to the upper branch, None at infinity: then they have the angle `eta`.
    l : (slope, intercept) of the line of corners f* = slope · w* + intercept.
    alpha : fall of friction after break-away, a number or nodes (f_s, α).
    beta : slip speed over which it falls.
    phi, psi, eta : angles in degrees.
    upper_turn : what a turn of ẇ from + to − on the upper branch does: ``down`` goes to the lower branch with the angle
        `eta`, ``back`` goes back along the upper line.

    Change the geometry point by point with :func:`dataclasses.replace`.

    >>> from dataclasses import replace
    >>> law = replace(BogaczRyczek(), D=(0.33, 2.2))
    >>> law.break_away_force(0.0, [0.25, 0.40]).round(3)
    array([1.896, 1.066])
    """

    static_friction: StaticFriction = field(
        default_factory=lambda: StaticFriction(
            initial=0.68, drop=1.24, drop_scale=0.3695, drop_exponent=10.0, limit=0.39, rate=0.3, force_rate_scale=0.5
        )
    )
    A: Pencil = None
    B: Point = (-0.41, 1.33)
    C: Pencil = None
    D: Pencil = (0.33, 2.40)
    l: Point = (3.41, -0.28)
    alpha: float | tuple[Point, ...] = ((1.9, 0.0), (2.9, 1.7))
    beta: float = 0.01
    phi: float = -58.0
    psi: float = 39.0
    eta: float = 89.0
    upper_turn: Literal["down", "back"] = "down"

    def __post_init__(self) -> None:
        for name in "ACD":
            if getattr(self, name) == "infinity":
                object.__setattr__(self, name, None)
        super().__post_init__()

    def to_dict(self) -> dict[str, Any]:
        """The document; D at infinity is said, as its default is a point."""
        return super().to_dict() | ({"D": "infinity"} if self.D is None else {})

    def to_json(self) -> str:
        """The document for the core, where a pencil at infinity is not there."""
        return json.dumps(super().to_dict())
