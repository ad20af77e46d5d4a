"""How many linear pieces a record asks for: each number of them is judged by its prediction of held-back parts."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from stickslip.errors import InputError
from stickslip.identification.fit_options import Options
from stickslip.identification.law_fit import check_kind, fit_law
from stickslip.identification.records import FrictionRecord
from stickslip.identification.result import Identification
from stickslip.identification.selection.comparison import COUNTED, WHOLE, folds, held_back, ranked
from stickslip.laws import Law

MOST_PIECES = 8
FRUITLESS = 2
"""The search ends after that many numbers of pieces more than the best one."""


def choose_pieces(records: list[FrictionRecord], law: str | type[Law] | Law, options: Options) -> Identification:
    """The law with the fewest pieces that predicts held-back parts as well as any number of them.

    Parameters
    ----------
    records : read ones.
    law : one of linear pieces.
    options : of :func:`stickslip.identify`.

    Returns
    -------
    Identification; the first of its notes says how many pieces were taken and why.

    Raises
    ------
    InputError
        for a law that has no pieces to count, names of nodes that are not there yet, or where none can be identified.
    """
    kind = check_kind(records, law, options)
    if kind.__name__ not in COUNTED:
        raise InputError(
            f"identify: pieces are counted for {' and '.join(COUNTED)}, got {kind.__name__}: leave out pieces = 'auto'"
        )
    named = [name for name in [*(options.free or []), *options.fixed, *options.bounds] if "[" in name]
    if named:
        raise InputError(
            f"identify: {named[0]} names a node, and with pieces = 'auto' their number is not known yet: give it as a number"
        )
    parts, whole = folds(records), len(records) >= WHOLE
    found: dict[str, Identification] = {}
    errors: dict[str, Any] = {}
    best, refused = 0, ""
    for count in range(1, MOST_PIECES + 1):
        label = f"{count} piece{'s' * (count > 1)}"
        try:
            fitted = fit_law(records, kind, replace(options, pieces=count))
            errors[label] = [held_back(fitted, train, test, options.offset) for train, test in parts]
        except InputError as error:
            refused = refused or str(error)
            continue
        found[label] = fitted
        best = int(ranked(found, errors, whole)[1].split()[0])
        if count >= best + FRUITLESS:
            break
    if not found:
        raise InputError(refused)
    table, chosen, _ = ranked(found, errors, whole)
    behind = ", ".join(f"{100 * row:.2g} % with {label}" for label, row in table["behind"].sort_index().items())
    what = "each record" if whole else f"each of {len(parts)} blocks of time"
    why = (
        f"{chosen} of {kind.__name__} taken: {what} was held back in turn and predicted from the rest, with an error above "
        f"the least by {behind}; of those that are within their scatter from part to part, and with "
        "an error at most half as much again, it is the fewest."
    )
    result = found[chosen]
    return replace(result, notes=[why, *result.notes], command=options.command(records, law))
