"""How many linear pieces a record asks for: each number of them is judged by its prediction of held-back parts."""

from __future__ import annotations

from typing import Any

from stickslip.errors import InputError
from stickslip.identification.compare import COUNTED, WHOLE, folds, held_back, ranked
from stickslip.identification.fit import Identification, identify
from stickslip.identification.records import FrictionRecord
from stickslip.laws import Law

MOST = 8
FRUITLESS = 2
"""The search ends after that many numbers of pieces more than the best one."""


def choose_pieces(records: list[FrictionRecord], kind: type[Law], options: dict[str, Any]) -> Identification:
    """The law with the fewest pieces that predicts held-back parts as well as any number of them.

    Parameters
    ----------
    records : read ones.
    kind : a law of linear pieces.
    options : the others of :func:`stickslip.identify`.

    Returns
    -------
    Identification; the first of its notes says how many pieces were taken and why.

    Raises
    ------
    InputError
        for a law that has no pieces to count, names of nodes that are not there yet, or where none can be identified.
    """
    if kind.__name__ not in COUNTED:
        raise InputError(
            f"identify: pieces are counted for {' and '.join(COUNTED)}, got {kind.__name__}: leave out pieces = 'auto'"
        )
    named = [
        name
        for name in [*(options["free"] or []), *(options["fixed"] or {}), *(options["bounds"] or {})]
        if "[" in name
    ]
    if named:
        raise InputError(
            f"identify: {named[0]} names a node, and with pieces = 'auto' their number is not known yet: give it as a number"
        )
    parts = folds(records)
    found: dict[str, Identification] = {}
    errors: dict[str, Any] = {}
    best, refused = 0, ""
    for count in range(1, MOST + 1):
        label = f"{count} piece{'s' * (count > 1)}"
        try:
            whole = identify(records, law=kind, pieces=count, **options)
            errors[label] = [held_back(whole, train, test, options["offset"]) for train, test in parts]
        except InputError as error:
            refused = refused or str(error)
            continue
        found[label] = whole
        best = int(ranked(found, errors)[1][0].split()[0])
        if count >= best + FRUITLESS:
            break
    if not found:
        raise InputError(refused)
    table, alike, _ = ranked(found, errors)
    chosen = alike[0]
    behind = ", ".join(f"{100 * row:.2g} % with {label}" for label, row in table["behind"].sort_index().items())
    what = "each record" if len(parts) == len(records) >= WHOLE else f"each of {len(parts)} blocks of time"
    why = (
        f"{chosen} of {kind.__name__} taken: {what} was held back in turn and predicted from the rest, with an error above "
        f"the least by {behind}; of those that predict alike within the scatter from part to part it is the fewest."
    )
    result = found[chosen]
    return Identification(**{**vars(result), "notes": [why, *result.notes]})
