"""A claim of the paper: a fact in our words, how it is measured, when it counts as reproduced.

`basis` says what stands behind a success: ``calibration`` (a free number was chosen so that this comes out), ``reading`` (our
reading of the law says so by construction) or ``follows`` (nothing was chosen for it). `source` says whether the paper
states the fact or we infer it from its words.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from stickslip.paper.study import Study

#: The paper says it; the numbers of the check are ours all the same.
STATED = "stated"

REPRODUCED, PARTLY, NOT = "reproduced", "partly", "not reproduced"


class CheckResult(NamedTuple):
    """A verdict, its main number and a sentence with all numbers."""

    verdict: str
    value: float
    sentence: str


@dataclass(frozen=True)
class Claim:
    """A claim of the paper: where it stands, what it says, how it is measured and when it counts as reproduced.

    `source` is :data:`STATED` or ``inferred: …`` with what of it the paper does not say.
    """

    id: str
    section: str
    sentence: str
    measured: str
    threshold: str
    basis: str
    check: Callable[[Study], CheckResult] = field(repr=False)
    source: str = STATED


def listed(values: list[float]) -> str:
    """A few of the values, and how many there are.

    >>> listed([0.1, 0.2])
    '0.100, 0.200'
    """
    texts = [f"{value:.3f}" for value in values]
    return ", ".join(texts) if len(texts) <= 5 else f"{texts[0]} … {texts[-1]} ({len(texts)} values)"
