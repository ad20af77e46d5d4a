"""Static friction of one law with the kinetic friction of another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from stickslip.files.schema import Says
from stickslip.laws.asymmetric import WITH_ADHESION, check_parts
from stickslip.laws.law import Law


@dataclass(frozen=True)
class Combined(Law):
    """|F| ≤ f_s(t_s, δ) of one law at rest, F(w) of another in slip: a memory for any curve.

    Parameters
    ----------
    static : the law whose break-away force counts, at least the kinetic force at w = 0.
    kinetic : the law whose kinetic force counts, any but :class:`BogaczRyczek`, whose branches follow from its own
        break-away force.

    >>> from stickslip.laws import DwellTime, ExponentialStribeck
    >>> law = Combined(static=DwellTime(1.0, 0.5, rate=0.4), kinetic=ExponentialStribeck(1.0, 0.5, scale=0.1))
    >>> law.break_away_force([0.0, 1e9]), round(law.kinetic_force(0.1), 6)
    (array([1. , 1.5]), 0.68394)
    """

    static: Annotated[Law, Says(WITH_ADHESION)]
    kinetic: Annotated[Law, Says(WITH_ADHESION)]

    def __post_init__(self) -> None:
        check_parts(self, "static", "kinetic")
        super().__post_init__()
