"""Friction that differs between the two directions of slip."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from stickslip.files.schema import Says
from stickslip.laws.law import Law
from stickslip.laws.state_law import StateLaw

WITH_ADHESION = "a friction law with true adhesion such as stickslip.laws.StaticKinetic"


def check_parts(law: Law, *names: str) -> None:
    """Refuse parts that creep instead of sticking."""
    for name in names:
        if isinstance(part := getattr(law, name), StateLaw):
            law.refuse(f"{name} must be {WITH_ADHESION}, got {part!r}")


@dataclass(frozen=True)
class Asymmetric(Law):
    """One law where the friction on the mass is positive, another where it is negative: brakes, seals, joints, fur.

    Parameters
    ----------
    forward : the law for w > 0, and of a stick that holds the mass against a pull to that side.
    backward : the law for w < 0.

    What a contact remembers of its rest is the same for both.

    >>> from stickslip.laws import StaticKinetic
    >>> law = Asymmetric(forward=StaticKinetic(1.2, 0.7), backward=StaticKinetic(0.8, 0.5))
    >>> law.kinetic_force([0.1, -0.1])
    array([ 0.7, -0.5])
    >>> law.break_away_force(force_rate=[0.0, -0.1])  # its sign is that of the friction force
    array([1.2, 0.8])
    """

    forward: Annotated[Law, Says(WITH_ADHESION)]
    backward: Annotated[Law, Says(WITH_ADHESION)]

    def __post_init__(self) -> None:
        check_parts(self, "forward", "backward")
        super().__post_init__()
