"""A law made smooth at zero slip velocity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from stickslip.files.schema import Says
from stickslip.laws.law import Law
from stickslip.laws.state_law import StateLaw

WITHOUT_STATE = "a memoryless friction law such as stickslip.laws.Coulomb"


@dataclass(frozen=True)
class Regularised(StateLaw):
    """F = s(w/width) f(|w|): a memoryless law with a smooth sign, to compare with codes that smooth it.

    Parameters
    ----------
    law : any law without memory, of which the kinetic force f is used; its break-away force is lost.
    width : slip velocity over which the sign changes, > 0.
    shape : ``"arctan"``: s(y) = (2/π) arctan y; ``"tanh"``: s(y) = tanh y.

    Limits: it creeps where the law would stick, and the period of its stick-slip is wrong: for ``Rational(1, 3)`` on a drive
    of velocity 0.2 by 6 % at width 1e-3 and by 0.1 % at 1e-6. It is no substitute for the law itself.

    >>> from stickslip.laws import Coulomb
    >>> Regularised(Coulomb(0.5), width=1e-3).kinetic_force(1e-3)
    0.25
    """

    law: Annotated[Law, Says(WITHOUT_STATE)]
    width: float
    shape: str = "arctan"

    def __post_init__(self) -> None:
        if isinstance(self.law, StateLaw):
            self.refuse(f"law must be {WITHOUT_STATE}, got {self.law!r}")
        super().__post_init__()
