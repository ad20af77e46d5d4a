"""Laws ranked by how well they predict parts of the records that were held back from their fit."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.files.equality import ByContent
from stickslip.files.notebook import OfTable
from stickslip.files.progress import waiting_by_stage
from stickslip.identification.estimator.threads import one_thread
from stickslip.identification.estimator.uncertainty import half_width
from stickslip.identification.fit_options import Options
from stickslip.identification.guesses.first_guess import GUESSES
from stickslip.identification.guesses.guess_data import BreakAways, Guess
from stickslip.identification.kinetic.force_fit import fit_forces
from stickslip.identification.kinetic.force_residuals import OFFSET, Problem
from stickslip.identification.law_fit import LawFit
from stickslip.identification.records import FrictionRecord, read_records
from stickslip.identification.result import Identification
from stickslip.identification.static.rows import break_away_rows, is_relative
from stickslip.laws import (
    Asymmetric,
    BoucWen,
    Coulomb,
    Law,
    PiecewisePolynomial,
    RateState,
    Regularised,
    Tabulated,
)
from stickslip.laws.state_law import StateLaw

PARTS = 5
"""Blocks of time into which a few records are cut."""
WHOLE = 3
"""With this many records or more, whole records are held back."""
INNER = 4
"""Blocks into which a held-back part is cut again where there are few, for the error of a difference."""
ALIKE_PREDICTIONS = 0.01
"""Predictions whose errors differ by less than this part are alike."""
CLOSE_BEHIND = 0.1
"""A law whose prediction error is surely no more than this part above the least predicts as well."""
FARTHEST_BEHIND = 0.4
"""Behind the least in the logarithm of its prediction error, so half as much again: such a law is never chosen, whatever the
error of the difference."""
BEST, AS_GOOD, CANNOT_TELL, WORSE = "best", "as good", "cannot tell", "worse"
BY_NAME_ONLY = (Asymmetric, BoucWen, PiecewisePolynomial, RateState, Regularised, Tabulated)
"""Laws that are compared where they are asked for: for what a record tells they are others (Dahl, a logarithm, a curve with a
width that is no number of the contact, linear pieces), and they would crowd the table."""
COUNTED = ("PiecewiseLinear", "TwoBranch")
"""Laws that are tried with each number of linear pieces."""
STATES = tuple(kind.__name__ for kind in GUESSES if issubclass(kind, StateLaw))
"""Laws that have no break-away force of their own."""
SAMPLES = 6000
"""Samples of a directly measured record that are used, evenly thinned."""


@dataclass(frozen=True, repr=False, eq=False)
class Comparison(ByContent, OfTable):
    """Laws in the order of their prediction.

    Attributes
    ----------
    table : DataFrame over the laws, the best first: numbers (fitted), kinetic and break_away (root mean square of
        measured minus predicted force on parts that were held back), behind (logarithm of the prediction error above that
        least, slip and break-aways together), error (its standard error, from the differences between the two laws part by
        part), verdict: "best" is the chosen law; "as good" is surely no more than 10 % behind; "worse" is surely behind;
        "cannot tell" is neither: the 95 % interval of its difference holds both.
    sentences : what was held back, what the data decide and what they cannot, which laws were refused and why.
    best : identification of the chosen law from all of the records: of those that are not surely worse, and whose error is by
        number at most half as much again as the least, the one with the fewest numbers.
    identifications : of every law in `table`.
    """

    table: pd.DataFrame
    sentences: list[str]
    best: Identification
    identifications: dict[str, Identification]

    def report(self) -> str:
        """The table, the sentences, and the chosen law."""
        table = self.table.to_string(float_format=lambda number: f"{number:.4g}", na_rep="-")
        return "\n".join([table, "", *[f"- {sentence}" for sentence in self.sentences], "", self.best.report()])


@one_thread
def compare_laws(
    friction: Any,
    laws: Iterable[str | type[Law]] | None = None,
    pieces: int = 3,
    progress: Callable[[str, int, int], Any] | None = None,
) -> Comparison:
    """Rank laws of the catalogue on records by their prediction of held-back parts.

    Each law is fitted to all parts but one and predicts that one; every part is held back once. The parts are whole records
    where there are three or more, else five blocks of time. Where records slip in both senses each law is also tried with a
    constant offset of the measured force.

    Parameters
    ----------
    friction : as for :func:`stickslip.identify`.
    laws : names or classes; default all but those in `BY_NAME_ONLY`; those of linear pieces with one to `pieces` of them.
    pieces : linear pieces.
    progress : called as ``progress(what, done, of)`` before each law and at the end; default a line for a person who waits.

    Returns
    -------
    Comparison: ``.table``, ``.sentences``, ``.best``, ``.report()``.

    Raises
    ------
    InputError
        where no law can be identified, or the records are too short to hold a part back.

    Limits: parts of one record share what drifts slowly, so blocks of time flatter every law alike; whole records are the
    harder test. The error of a difference comes from leaving out one record (or block) after the other, with Student's t:
    of three records it is poorly known, and few laws are surely worse.

    Source: cross-validation, Stone, J. R. Statist. Soc. B 36 (1974) 111.

    >>> import stickslip as ss
    >>> from stickslip.identification import friction_of_orbit
    >>> law = ss.laws.StaticKinetic(break_away=1.0, kinetic=0.6)
    >>> orbit = ss.simulate(ss.Oscillator(damping=0.1, drive_velocity=0.2, law=law), 200)
    >>> data = friction_of_orbit(orbit, np.arange(0, 200, 0.1), force_noise=0.01)
    >>> compare_laws(data, ["Coulomb", "StaticKinetic"]).table["verdict"].to_dict()
    {'StaticKinetic': 'best', 'Coulomb': 'worse'}
    """
    records = [_thinned(record) for record in read_records(friction)]
    candidates = _candidates(laws, pieces)
    parts, break_aways = folds(records), BreakAways(records)
    offsets = [False, True] if any(record.both_senses() for record in records) else [False]
    breaks = any(len(record.break_away) for record in records)
    found: dict[str, Identification] = {}
    errors: dict[str, list[tuple[Array, Array]]] = {}
    refused: list[str] = []
    trials = [(label, kind, count, offset) for label, kind, count in candidates for offset in offsets]
    progress = waiting_by_stage(progress)
    for number, (label, kind, count, offset) in enumerate(trials):
        label = f"{label} + offset" if offset else label
        progress(label, number, len(trials))
        try:
            if breaks and kind in STATES:
                raise InputError(
                    f"adhesion is a state of {kind}, so its break-aways cannot be predicted like the others'"
                )
            fit = LawFit(records, kind, Options(pieces=count, offset=offset), break_aways)
            for problem in fit.problems if len(fit.problems) == 1 else []:
                # What no part tells is known before anything is fitted.
                for train, _ in parts:
                    _learnt(
                        train, problem.law, [name for name in problem.free if name != OFFSET], fit.guess, offset
                    ).refuse_silent(problem.law)
            whole = fit.identify()
            errors[label] = [held_back(whole, train, test, offset) for train, test in parts]
            found[label] = whole
        except InputError as error:
            refused.append(f"{label} was not compared: {error}")
    progress("laws compared", len(trials), len(trials))
    if not found:
        raise InputError(
            f"compare: no law could be identified; {refused[0]}" if refused else "compare: no law was requested"
        )
    table, chosen, verdict = ranked(found, errors, whole=len(records) >= WHOLE)
    kept = "each of the records" if len(records) >= WHOLE else f"each of {len(parts)} blocks of time"
    sentences = [f"Held back and predicted from the rest was {kept} in turn."]
    sentences += verdict
    best = found[chosen]
    return Comparison(table, [*sentences, *dict.fromkeys(refused)], best, found)


def _candidates(laws: Iterable[str | type[Law]] | None, pieces: int) -> list[tuple[str, str, int | None]]:
    usual = [law for law in GUESSES if law not in BY_NAME_ONLY]
    asked: Sequence[str | type[Law]] = usual if laws is None else [laws] if isinstance(laws, str) else [*laws]
    found: list[tuple[str, str, int | None]] = []
    for name in [law if isinstance(law, str) else law.__name__ for law in asked]:
        counts = [*range(1, pieces + 1)] if name in COUNTED else [pieces if name == "Tabulated" else None]
        many = len(counts) > 1
        found += [(f"{name} ({n} piece{'s' * (n != 1)})" if many else name, name, n) for n in counts]
    return found


def _thinned(record: FrictionRecord) -> FrictionRecord:
    """A directly measured record without samples that tell nothing new; an indirect one needs them all."""
    stride = record.time.size // SAMPLES
    if stride < 2 or "slip_cutoff" in record.constants:
        return record
    return record.every(stride)


Fold = tuple[list[FrictionRecord], list[FrictionRecord]]


def folds(records: list[FrictionRecord]) -> list[Fold]:
    """What is learnt from and what is held back, in turn."""
    if len(records) >= WHOLE:
        return [([r for r in records if r is not record], [record]) for record in records]
    cut: list[list[FrictionRecord]] = []
    for record in records:
        edges = np.linspace(0, record.time.size, PARTS + 1).astype(int)
        cut.append([record.part(a, b) for a, b in pairwise(edges)])
    found = []
    for k in range(PARTS):
        train = [part for parts in cut for i, part in enumerate(parts) if i != k and not part.stuck.all()]
        test = [parts[k] for parts in cut if not parts[k].stuck.all()]
        if train and test:
            found.append((train, test))
    if len(found) < 2:
        raise InputError("compare: the records are too short to hold parts of them back; take longer ones, or more")
    return found


def _learnt(
    train: list[FrictionRecord], law: Law, names: Sequence[str], limits: Identification | Guess, offset: bool
) -> Problem:
    """The problem of learning a law from some parts."""
    drifts = not isinstance(law, Coulomb) and is_relative(break_away_rows(train))[0]
    return Problem(train, law, names, relative=drifts, ties=limits.ties, bounds=limits.bounds, offset=offset)


def held_back(
    whole: Identification, train: list[FrictionRecord], test: list[FrictionRecord], offset: bool
) -> tuple[Array, Array]:
    """Errors of the prediction of held-back slip (NaN where nothing is compared) and break-aways.

    A law that predicts a break-away does not know when it happens: it predicts where the limit meets the load. The stick time
    that was measured would tell it, as of sticks that differ by chance the strong ones last longer.
    """
    names = [str(name) for name in whole.parameters.index]
    learnt = _learnt(train, whole.law, names, whole, offset)
    fitted = fit_forces(learnt, whole.law)
    constant = 0.0 if fitted.offset is None else float(fitted.offset["value"])
    problem = Problem(test, fitted.law, names, relative=learnt.relative, every_row=True)
    kinetic = []
    for motion in problem.motions:
        usual = float(np.median(motion.record.force_error)) or 1.0
        weight = usual / np.maximum(motion.record.force_error, usual)
        residuals = weight * motion.difference(fitted.law, constant)
        kinetic.append(np.where(motion.compared, residuals, np.nan)[~motion.record.stuck])
    groups = problem.residuals(fitted.law, constant)
    breaks = [
        residuals / problem.approach(fitted.law, number)
        for (number, kind), residuals in zip(problem.groups, groups, strict=True)
        if kind == "break-away"
    ]
    return np.concatenate(kinetic), np.concatenate(breaks) if breaks else np.zeros(0)


@dataclass(frozen=True)
class _Sums:
    """Sums of squared errors and their counts over blocks, shape (laws, blocks)."""

    squares: Array
    counts: Array

    def log_error(self, without: int | None = None) -> Array:
        """Logarithm of the root mean square error of each law, 0 where there is nothing to predict."""
        keep = np.arange(self.counts.shape[1]) != (-1 if without is None else without)
        count = self.counts[:, keep].sum(axis=1)
        mean = self.squares[:, keep].sum(axis=1) / np.maximum(count, 1)
        return np.where(count > 0, 0.5 * np.log(np.maximum(mean, 1e-300)), 0.0)

    def error(self) -> list[float]:
        """Root mean square error of each law; NaN where there is nothing to predict."""
        return [math.exp(e) if n else math.nan for e, n in zip(self.log_error(), self.counts.sum(axis=1), strict=True)]


def _sums(errors: dict[str, list[tuple[Array, Array]]], whole: bool) -> tuple[_Sums, _Sums]:
    """Of slip and of break-aways, over blocks of the held-back parts; what is left of one record goes together."""
    parts = [[rows[k] for rows in errors.values()] for k in range(len(next(iter(errors.values()))))]
    inner = 1 if whole else INNER
    slip: list[tuple[Array, Array]] = []
    rest: list[tuple[Array, Array]] = []
    for part in parts:
        left = np.stack([kinetic for kinetic, _ in part])
        # Only where every law says something: their memories are known at different times.
        left = np.where(np.isfinite(left).all(axis=0), left, np.nan)
        blocks = np.array_split(left, inner, axis=1)
        slip += [(np.nansum(block**2, axis=1), np.isfinite(block).sum(axis=1)) for block in blocks]
        complete = all(rows.size for _, rows in part)
        squares = np.array([np.sum(rows**2) if complete else 0.0 for _, rows in part])
        counts = np.array([rows.size if complete else 0 for _, rows in part])
        rest += [(squares, counts), *[(0 * squares, 0 * counts)] * (len(blocks) - 1)]
    kinetic, breaks = (
        _Sums(*(np.stack(column, axis=1) for column in zip(*sums, strict=True))) for sums in (slip, rest)
    )
    return kinetic, breaks


def ranked(
    found: dict[str, Identification], errors: dict[str, list[tuple[Array, Array]]], whole: bool
) -> tuple[pd.DataFrame, str, list[str]]:
    """The table, the name of the chosen law, and what the data decide; `whole`: the parts are records."""
    names = [*found]
    kinetic, breaks = _sums(errors, whole)
    if not kinetic.counts.any():
        raise InputError("compare: the laws have no part in common that they predict; take longer records")
    score = kinetic.log_error() + breaks.log_error()
    error = kinetic.error()
    asked, offset_said = _offset(found, dict(zip(names, error, strict=True)))
    # A number that is not zero tells more than predictions, which a few blocks can hardly tell apart.
    open_to = [i for i, name in enumerate(names) if not asked or f"{name} + offset" not in found]
    first = min(open_to, key=lambda i: score[i])
    behind = score - score[first]
    # The error of a difference, by leaving out one block after the other (jackknife).
    left = np.stack([kinetic.log_error(b) + breaks.log_error(b) for b in range(kinetic.counts.shape[1])])
    left = left - left[:, first : first + 1]
    spread = np.sqrt((len(left) - 1) * np.mean((left - left.mean(axis=0)) ** 2, axis=0))
    half = np.array([half_width(error, len(left) - 1) for error in spread])
    open_still = [i for i in open_to if behind[i] <= max(half[i], ALIKE_PREDICTIONS)]
    count = [len(found[name].parameters) + (found[name].offset is not None) for name in names]
    near = [i for i in open_still if behind[i] <= FARTHEST_BEHIND]
    chosen = min(near, key=lambda i: (count[i], behind[i]))
    verdict = [
        BEST
        if i == chosen
        else WORSE
        if i not in open_still
        else AS_GOOD
        if behind[i] + half[i] <= CLOSE_BEHIND
        else CANNOT_TELL
        for i in range(len(names))
    ]
    rank = (BEST, AS_GOOD, CANNOT_TELL, WORSE)
    order = sorted(range(len(names)), key=lambda i: (rank.index(verdict[i]), behind[i]))
    table = pd.DataFrame(
        {
            "numbers": count,
            "kinetic": error,
            "break_away": breaks.error(),
            "behind": behind,
            "error": spread,
            "verdict": verdict,
        },
        index=pd.Index(names, name="law"),
    ).iloc[order]
    said = _said(table, "record to record" if whole else "block to block")
    return table, names[chosen], [*said, *offset_said]


def _said(table: pd.DataFrame, scatter: str) -> list[str]:
    """What a table of laws decides, and what it leaves open."""
    chosen, of = str(table.index[0]), {word: table[table["verdict"] == word] for word in (AS_GOOD, CANNOT_TELL, WORSE)}
    if len(table) == 1:
        return [f"{chosen} is the only law that these records can identify."]
    said = []
    if len(of[AS_GOOD]):
        said.append(
            f"The data cannot decide between {chosen} and {', '.join(of[AS_GOOD].index)}: they predict alike within their "
            f"scatter from {scatter}; {chosen} has the fewest numbers and is chosen."
        )
    elif len(of[WORSE]) == len(table) - 1:
        second, more = of[WORSE].index[0], 100 * math.expm1(of[WORSE]["behind"].iloc[0])
        said.append(
            f"{chosen} predicts best: the error of {second}, the next, is {more:.3g} % larger, which is beyond its scatter "
            f"from {scatter}."
        )
    else:
        said.append(f"{chosen} is chosen: of the laws that may predict as well as any it has the fewest numbers.")
    if len(of[CANNOT_TELL]):
        each = ", ".join(
            f"{name} (error {100 * math.expm1(row['behind']):.3g} % above the least)"
            for name, row in of[CANNOT_TELL].iterrows()
        )
        said.append(
            f"Whether these predict as well or worse cannot be determined, as their differences scatter from {scatter}: "
            f"{each}; more records are needed."
        )
    return said


def _offset(found: dict[str, Identification], error: dict[str, float]) -> tuple[bool, list[str]]:
    """Whether the law that predicts best with an offset of the force has one that is not zero, and the sentence of it."""
    pairs = [name for name in found if f"{name} + offset" in found]
    if not pairs:
        return False, []
    plain = min(pairs, key=lambda name: error[f"{name} + offset"])
    offset = found[f"{plain} + offset"].offset
    assert offset is not None
    without, with_it = error[plain], error[f"{plain} + offset"]
    said = (
        f"an offset of {offset['value']:.3g} (95 %: {offset['low']:.3g} to {offset['high']:.3g}) of the measured force takes "
        f"the error of {plain} from {without:.3g} to {with_it:.3g}"
    )
    if with_it < (1 - ALIKE_PREDICTIONS) * without and not offset["low"] <= 0.0 <= offset["high"]:
        return True, [
            f"The residuals ask for an offset: {said}; the instrument has a zero, or friction differs by the sense of slip. "
            "Laws without one are not chosen."
        ]
    return False, [f"No offset is called for: {said}."]
