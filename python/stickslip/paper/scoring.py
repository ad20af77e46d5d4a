"""The paper's claims as a table, and how much of it a model shows.

Each verdict is given by the check of its claim, in `checks/`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from stickslip.paper import oscillator as paper_oscillator
from stickslip.paper.checks import CLAIMS
from stickslip.paper.study import Make, Study

if TYPE_CHECKING:
    import pandas as pd


def claims() -> pd.DataFrame:
    """The paper's claims that are scored, in our words.

    Returns
    -------
    DataFrame indexed by id: section of the paper, claim, source (``stated`` by the paper or ``inferred: …`` by us), measured
    (what is looked at), threshold (when it counts as reproduced) and basis (``calibration: …``, ``reading: …``,
    ``follows``: what a success of our model rests on).

    >>> claims().loc["end-of-oscillation", "section"]
    '9'
    """
    import pandas as pd

    rows = [
        {
            "id": s.id,
            "section": s.section,
            "claim": s.sentence,
            "source": s.source,
            "measured": s.measured,
            "threshold": s.threshold,
            "basis": s.basis,
        }
        for s in CLAIMS
    ]
    return pd.DataFrame(rows).set_index("id")


def score(
    oscillator: Make = paper_oscillator,
    *,
    only: tuple[str, ...] | None = None,
    periods: int = 200,
    tolerance: float = 2e-4,
    forcing_periods: int = 600,
    workers: int = 2,
    progress: Callable[[int, int], Any] | None = None,
) -> pd.DataFrame:
    """Score the paper's claims against a model.

    Parameters
    ----------
    oscillator : the model, called with a drive velocity and a forcing (or None); default ours.
    only : ids of the claims to score; default all.
    periods : natural periods of each run; the last tenth is looked at.
    tolerance : width to which thresholds of the drive velocity are bisected.
    forcing_periods : transient of the forced runs.
    workers : threads for the forced runs.
    progress : called as ``progress(done, n)`` after each claim.

    Returns
    -------
    DataFrame indexed by id: section, claim, source (``stated``, ``inferred: …``), measured, threshold, verdict
    (``reproduced``, ``partly``, ``not reproduced``), value, evidence, basis (``calibration: …``, ``reading: …``,
    ``follows``).

    Raises
    ------
    InputError
        for an unknown id.

    The whole table takes some seconds. Finer: longer `periods` and `forcing_periods`, smaller `tolerance`. Verdicts on
    forced motion next to a window's edge may change with the length of the transient.

    >>> score(only=("amplitude-falls",))["verdict"].item()
    'reproduced'
    """
    from stickslip.errors import InputError, did_you_mean

    known = {claim.id: claim for claim in CLAIMS}
    for name in only or ():
        if name not in known:
            raise InputError(f"score: unknown claim {name!r}{did_you_mean(name, known)}")
    chosen = [claim for claim in CLAIMS if only is None or claim.id in only]
    study = Study(oscillator, periods, tolerance, forcing_periods, workers)
    found = []
    for done, claim in enumerate(chosen, start=1):
        found.append(claim.check(study))
        if progress is not None:
            progress(done, len(chosen))
    table = claims().loc[[claim.id for claim in chosen]]
    table.insert(5, "verdict", [one.verdict for one in found])
    table.insert(6, "value", [one.value for one in found])
    table.insert(7, "evidence", [one.sentence for one in found])
    return table
