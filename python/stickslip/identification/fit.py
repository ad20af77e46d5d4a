"""The arrow from friction records to a law with its uncertainty."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd

from stickslip.errors import InputError
from stickslip.files.documents import did_you_mean, write_whole
from stickslip.identification.branches import BranchFit, Problem, fit_branches
from stickslip.identification.break_away import (
    FEWEST_ROWS,
    StaticFriction,
    break_away_rows,
    fit_static_friction,
    is_relative,
    tied,
    unlike,
)
from stickslip.identification.first_guess import GUESSES, first_guess
from stickslip.identification.lack_of_fit import lack_of_fit
from stickslip.identification.motion import WITH_MEMORY, Motion
from stickslip.identification.parameters import check_names, maybe, places, value, with_values
from stickslip.identification.records import FrictionRecord, read_records
from stickslip.identification.seen import Guess, Seen, refuse_unreadable
from stickslip.laws import (
    Coulomb,
    DwellTime,
    ForceRate,
    Law,
    LogarithmicDwell,
    PiecewiseLinear,
    StaticKinetic,
    Tabulated,
    TwoBranch,
)
from stickslip.laws.law import law_file

CORRELATED = 0.98
OF_PIECES = (PiecewiseLinear, TwoBranch, Tabulated)
"""Laws whose linear pieces are counted, and how many there are where nothing else is said."""
USUAL_PIECES = 3
BY_FORM: dict[str, type[Law]] = {
    "constant": StaticKinetic,
    "logarithmic": LogarithmicDwell,
    "force rate": ForceRate,
    "stick time and force rate": ForceRate,
    "exponential over force rate": ForceRate,
}
"""The law that is taken where none is asked for, by the form of static friction; `DwellTime` for all others."""


@dataclass(frozen=True)
class Identification:
    """A law identified from friction records.

    Attributes
    ----------
    law : the law.
    parameters : DataFrame over the names of the fitted numbers: value, error (standard error), low and high (95 %).
    covariance : DataFrame, names in both directions.
    groups : DataFrame of the residuals' groups: record, kind, rows, independent (rows that count), scale, between (standard
        deviation from record to record, where records differ from one another).
    rms : root mean square of measured minus predicted kinetic force.
    static : fits of static friction over stick time, None for fewer than five break-aways.
    notes : plain sentences: what was assumed, what could not be told.
    records : the records it was identified from.
    command : what to type to do it again.
    ties, within : numbers that follow another, and limits that come from the records.
    offset : value, error, low and high of a constant in the measured force, where it was asked for.
    motions : a row for each record over which the motion of the law was laid, None before that.
    """

    law: Law
    parameters: pd.DataFrame
    covariance: pd.DataFrame
    groups: pd.DataFrame
    rms: float
    static: StaticFriction | None
    notes: list[str]
    records: list[FrictionRecord]
    command: str
    ties: Mapping[str, str] = field(default_factory=dict)
    within: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    offset: pd.Series | None = None
    motions: pd.DataFrame | None = None

    def residuals(self, record: int = 0) -> pd.DataFrame:
        """Measured and predicted friction of one record while it slips.

        Returns
        -------
        DataFrame: time, slip_velocity, force, predicted (the law with its memory along the motion), and compared:
        whether the sample entered the fit (not where the memory is unknown or a climb is too steep to be seen).
        """
        motion = Motion.of(self.records[record], type(self.law))
        frame = pd.DataFrame(
            {
                "time": motion.record.time,
                "slip_velocity": motion.slip_velocity,
                "force": motion.record.force,
                "predicted": motion.replay(self.law) + (0.0 if self.offset is None else self.offset["value"]),
                "compared": False,
            }
        )
        for first, last in motion.stretches:
            frame.loc[first : last - 1, "compared"] = True
        return frame[~motion.record.stuck].reset_index(drop=True)

    def held(self) -> dict[str, float]:
        """Numbers of the law that were not fitted, by name; those that are not set are left out."""
        names = [name for name in places(self.law) if name not in self.parameters.index]
        return {name: number for name in names if (number := maybe(self.law, name)) is not None}

    def report(self) -> str:
        """The result in words and one table."""
        shown = self.parameters if self.offset is None else pd.concat([self.parameters, self.offset.to_frame().T])
        table = shown.to_string(float_format=lambda number: f"{number:.5g}")
        lines = [
            f"{type(self.law).__name__} from {len(self.records)} record(s): " + ", ".join(r.name for r in self.records),
            "",
            table,
            "",
            f"rms of the kinetic force: {self.rms:.3g}",
            *[f"- {note}" for note in self.notes],
        ]
        return "\n".join(lines)

    def to_toml(self) -> str:
        """The law file: the tables [law], [uncertainty] (standard errors by name), [covariance] and [source]."""
        source = {
            "command": self.command,
            "records": [
                {"name": record.name, "measured_from": str(record.attrs.get("source", "unknown"))}
                for record in self.records
            ],
            "rms": self.rms,
            "intervals": {name: [float(row["low"]), float(row["high"])] for name, row in self.parameters.iterrows()},
            "notes": self.notes,
        }
        return law_file(self.law, self.covariance, source)

    def save(self, path: str | Path) -> Path:
        """Write the law file; :func:`stickslip.load_law` and :func:`stickslip.laws.load_covariance` read it back."""
        text = self.to_toml()
        return write_whole(path, lambda draft: draft.write_text(text, encoding="utf-8"))

    def plot(self, ax: Any = None) -> Any:
        """Friction over slip velocity: the data of every record and the law along the same motion; returns the Axes."""
        import matplotlib.pyplot as plt

        from stickslip.show.canvas import verbatim

        axes = plt.subplots()[1] if ax is None else ax
        for number, record in enumerate(self.records):
            frame = self.residuals(number)
            # Forces of a slip in the other sense are shown turned over; the last part is the steady motion.
            frame = frame[frame["compared"]].iloc[-6000:]
            sense = np.where(frame["slip_velocity"] < 0, -1.0, 1.0)
            w = np.abs(frame["slip_velocity"])
            dots = axes.plot(w, sense * frame["force"], ".", ms=2, alpha=0.4, label=verbatim(record.name))
            axes.plot(w, sense * frame["predicted"], ".", ms=1.5, color=_darker(dots[0].get_color()))
        axes.set_xlabel("slip velocity w")
        axes.set_ylabel("kinetic force f (light: measured, dark: law)")
        axes.legend()
        return axes


def identify(
    friction: Any,
    law: str | type[Law] | Law | None = None,
    free: Iterable[str] | None = None,
    fixed: Mapping[str, float] | None = None,
    pieces: int | Literal["auto"] | None = None,
    offset: bool = False,
    bounds: Mapping[str, tuple[float, float]] | None = None,
) -> Identification:
    """Identify a friction law, with its uncertainty, from one or more friction records.

    Minimised is the robust misfit between the measured kinetic force and the law replayed with its memory along the
    measured motion, and between the measured break-away forces and f_s(t_s, δ), over all records at once.

    Parameters
    ----------
    friction : a DataTree from :func:`stickslip.measure`, the path of a friction file, or a list of either.
    law : name or class of a law (the first guess then comes from the data), or a law as first guess; default the law whose
        static friction has the form that the break-aways show, `StaticKinetic` where they cannot tell; `notes` says which.
    free : names of the numbers to fit, such as ``"kinetic"``, ``"nodes[1].force"``, ``"static_friction.initial"``,
        ``"l.slope"``, ``"B.w"``; default: what the records can tell. For a law given as first guess: default as for its
        class.
    fixed : numbers to hold, by name.
    pieces : linear pieces of ``PiecewiseLinear``, ``TwoBranch`` and ``Tabulated``, 1 to 12, default 3; or ``"auto"``: the
        fewest that predict held-back parts of the records as well as any number of them; the first of the notes says why.
    offset : whether a constant in the measured force is fitted too: the zero of a gauge, or friction that differs by the
        sense of the slip. The records must slip in both.
    bounds : lowest and highest value of numbers that are fitted, by name.

    Returns
    -------
    Identification: ``.law``, ``.parameters``, ``.covariance``, ``.rms``, ``.notes``, ``.report()``, ``.save(path)``.

    Raises
    ------
    InputError
        for records that cannot identify the law asked for, with the reason.

    Limits: intervals hold the noise of the records and its correlation from sample to sample, not errors of the rig's
    constants (mass, stiffness, damping, drive velocity), which shift friction as a whole. Where slips are sparse they
    rest on few independent rows and are wide.

    The slip velocity and an indirect force have their errors from one displacement, which is taken into account to first
    order (see :mod:`stickslip.identification.latent`). Errors of ``BogaczRyczek`` hold the scatter of cycles, not bias:
    ``static_friction.initial`` is too low by several of its errors (`notes` say so). The interval of a break-away force that
    kinetic friction hardly falls from is too narrow.
    :func:`stickslip.identification.fit_trajectories` goes on from here without that error, where the motion is steady.

    Source: least squares on the branches after Sections 4 to 6 of the paper; the sandwich of scale and correlation time
    is our own; clustered by cycles after Bell & McCaffrey, Survey Methodology 28 (2002) 169.

    >>> import stickslip as ss
    >>> import xarray as xr
    >>> system = ss.Oscillator(damping=0.05, drive_velocity=0.2, law=ss.laws.StaticKinetic(break_away=1.0, kinetic=0.6))
    >>> orbit = ss.simulate(system, t_end=200)
    >>> t = np.arange(0, 200, 0.05)
    >>> data = orbit.to_xarray(t)[["slip_velocity", "force", "stuck"]]
    >>> data["force"] = data["force"] + 0.01 * np.random.default_rng(0).standard_normal(t.size)
    >>> sticks = orbit.events[orbit.events["kind"] == "release"]
    >>> rows = {name: ("event", sticks[name].to_numpy()) for name in ("t", "stick_time", "force_rate", "force")}
    >>> found = identify(xr.DataTree.from_dict({"/": data, "/break_away": xr.Dataset(rows)}), law="StaticKinetic")
    >>> found.parameters["value"].round(2).to_dict()
    {'break_away': 1.0, 'kinetic': 0.6}
    """
    records = read_records(friction)
    if law is None:
        return _by_default(records, free, fixed, pieces, offset, bounds)
    kind, start = _kind(law)
    if not any(record.slips for record in records):
        raise InputError(
            f"identify: {records[0].name} is a table of break-aways, so nothing is known of kinetic friction: leave the law "
            "out to fit static friction alone, or add a record of the motion"
        )
    if pieces is not None and kind not in OF_PIECES:
        names = ", ".join(law.__name__ for law in OF_PIECES)
        raise InputError(
            f"identify: {kind.__name__} has no linear pieces to count: leave pieces out, or ask for {names}"
        )
    if pieces == "auto":
        from stickslip.identification.pieces import choose_pieces

        chosen = choose_pieces(records, kind, {"free": free, "fixed": fixed, "offset": offset, "bounds": bounds})
        return replace(chosen, command=_command(records, kind, free, fixed, pieces, offset, bounds))
    count = USUAL_PIECES if pieces is None else pieces
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= 12:
        raise InputError(f"identify: pieces must be a whole number from 1 to 12, or 'auto', got {pieces!r}")
    if offset and not any(record.both_senses() for record in records):
        raise InputError(
            "identify: an offset can be told from friction only where a record slips in both senses, and none does: add one, "
            "or leave the offset out"
        )
    for record in records:
        refuse_unreadable(record)
    rows = break_away_rows(records)
    static = fit_static_friction(records) if len(rows) >= FEWEST_ROWS and kind is not Coulomb else None
    relative, drift = is_relative(rows) if kind is not Coulomb else (False, [])
    seen = Seen(records, rows, static, relative, count)
    guess = _bounded(_guess(kind, start, seen, free, fixed), bounds or {})
    fits = []
    for form in _forms(guess):
        problem = Problem(
            records, form.law, form.free, relative=relative, ties=form.ties, within=form.within, offset=offset
        )
        fits.append((problem, fit_branches(problem, _best_start(problem, form))))
    problem, found = min(fits, key=lambda fit: fit[1].rms)
    constant = 0.0 if found.offset is None else float(found.offset["value"])
    notes = [
        *lack_of_fit(problem, found.law, constant),
        *_bias(problem),
        *(static.notes if static is not None else drift),
        *guess.notes,
        *_chosen_form(found.law, guess),
        *_at_bounds(found, bounds or {}),
        *_what_could_not_be_told(found),
    ]
    if kind is DwellTime and static is not None and static.chosen != "exponential":
        notes.append("The law asked for has the exponential form; the other form is named for comparison.")
    if relative:
        notes.append("The kinetic force is the mean over the record; its error holds the drift from slip to slip.")
    notes += [f"{record.name}: {note}" for record in records for note in _notes(record)]
    return Identification(
        law=found.law,
        parameters=found.parameters,
        covariance=found.covariance,
        groups=found.groups,
        rms=found.rms,
        static=static,
        notes=list(dict.fromkeys(notes)),
        records=records,
        command=_command(records, kind, free, fixed, pieces, offset, bounds),
        ties=guess.ties,
        within=guess.within,
        offset=found.offset,
    )


def _by_default(
    records: list[FrictionRecord],
    free: Iterable[str] | None,
    fixed: Mapping[str, float] | None,
    pieces: int | Literal["auto"] | None,
    offset: bool,
    bounds: Mapping[str, tuple[float, float]] | None,
) -> Identification:
    """The law whose static friction has the form that the break-aways show; a simpler one where they show none."""
    rows = break_away_rows(records)
    kinds: list[type[Law]] = [StaticKinetic, Coulomb]
    why = "the break-aways are too few to show growth with stick time"
    if len(rows) >= FEWEST_ROWS:
        static = fit_static_friction(records)
        why = f"static friction over stick time has the {static.chosen} form"
        if unlike(static):
            why = "the records differ from any one law of stick time"
        elif tied(static.rows) and static.chosen != "constant":
            # Growth that may be an effect of the force rate predicts nothing at another one.
            why = "growth with stick time cannot be told from an effect of the force rate in these records"
        else:
            kinds.insert(0, BY_FORM.get(static.chosen, DwellTime))
    refused: list[str] = []
    for kind in dict.fromkeys(kinds):
        try:
            found = identify(records, kind, free, fixed, pieces, offset, bounds)
        except InputError as error:
            refused.append(str(error))
            continue
        reason = refused[-1].removeprefix("identify: ") if refused else why
        return replace(found, notes=[f"No law was asked for; {kind.__name__} was taken: {reason}.", *found.notes])
    raise InputError(refused[0])


def _kind(law: str | type[Law] | Law) -> tuple[type[Law], Law | None]:
    if isinstance(law, Law):
        return type(law), law
    if isinstance(law, type) and issubclass(law, Law):
        return law, None
    if isinstance(law, str) and law in Law.ALL:
        return Law.ALL[law], None
    hint = did_you_mean(str(law), Law.ALL)
    known = ", ".join(item.__name__ for item in GUESSES)
    raise InputError(f"identify: unknown law {law!r}{hint}; known are {known}")


def _guess(
    kind: type[Law], start: Law | None, seen: Seen, free: Iterable[str] | None, fixed: Mapping[str, float] | None
) -> Guess:
    fixed = dict(fixed or {})
    asked = None if free is None else list(free)
    if start is not None and asked is not None:
        guess = Guess(start, asked)
    else:
        guess = first_guess(kind, seen)
        if start is not None:
            known = places(start)
            guess = Guess(
                start, [name for name in guess.free if name in known], guess.ties, guess.notes, within=guess.within
            )
    names = check_names(guess.law, guess.free if asked is None else asked)
    check_names(guess.law, fixed)
    names = [name for name in names if name not in fixed]
    if not names:
        raise InputError("identify: no parameter is left to fit; give fewer in fixed, or more in free")
    laws: list[Law] = []
    for candidate in [guess.law, *guess.rivals]:
        try:
            laws.append(with_values(candidate, fixed))
        except InputError as error:
            reason = error
    if not laws:
        raise InputError(f"identify: the values that are held fixed do not make a law: {reason}")
    notes = [*guess.notes]
    if fixed:
        notes.append("Held fixed as asked: " + ", ".join(f"{name} = {value:g}" for name, value in fixed.items()) + ".")
    return Guess(laws[0], names, guess.ties, notes, laws[1:], guess.within)


def _bounded(guess: Guess, bounds: Mapping[str, tuple[float, float]]) -> Guess:
    """The guess with the bounds asked for, and its numbers inside them."""
    if not bounds:
        return guess
    for name in check_names(guess.law, bounds):
        low, high = bounds[name]
        if name not in guess.free:
            raise InputError(f"identify: {name} has bounds but is not fitted; add it to free, or leave its bounds out")
        if not low < high:
            raise InputError(
                f"identify: the bounds of {name} must be the lower and the higher value, got {low:g} and {high:g}"
            )
    laws: list[Law] = []
    for law in [guess.law, *guess.rivals]:
        inside = {name: float(np.clip(value(law, name), *bounds[name])) for name in bounds}
        try:
            laws.append(with_values(law, inside))
        except InputError as error:
            reason = error
    if not laws:
        raise InputError(f"identify: within these bounds there is no law to begin with: {reason}")
    return replace(guess, law=laws[0], rivals=laws[1:], within=guess.within | dict(bounds))


def _bias(problem: Problem) -> list[str]:
    """That the interval of f_s(0) does not hold it, where it comes from indirect forces of motions without sticks."""
    if "static_friction.initial" not in problem.free or not isinstance(problem.law, WITH_MEMORY):
        return []
    sticking = {number for number, kind in problem.groups if kind == "break-away"}
    if not any(motion.indirect and number not in sticking for number, motion in enumerate(problem.motions)):
        return []
    return [
        "The interval of static_friction.initial does not hold its bias: single cycles of motions without sticks lie off as "
        "a whole and make it too low, in trials by two to five stated errors; fit_trajectories has not this error."
    ]


def _choices(law: Law) -> dict[str, float]:
    """The numbers that choose the form of a law."""
    return {name: getattr(law, name) for name in law.CHOICES}


def _forms(guess: Guess) -> list[Guess]:
    """A guess for each form of the law among the first guesses, as numbers that choose a form are never fitted."""
    laws = [guess.law, *guess.rivals]
    forms = [[law for law in laws if _choices(law) == choices] for choices in map(_choices, laws)]
    return [replace(guess, law=form[0], rivals=form[1:]) for i, form in enumerate(forms) if form not in forms[:i]]


def _chosen_form(law: Law, guess: Guess) -> list[str]:
    """Which form of a law that has several was taken."""
    if len(_forms(guess)) < 2:
        return []
    said = ", ".join(f"{name} = {number:g}" for name, number in _choices(law).items())
    return [f"Of the forms of {type(law).__name__} that with {said} lies closest to the records; it was taken."]


def _at_bounds(found: BranchFit, bounds: Mapping[str, tuple[float, float]]) -> list[str]:
    """Which numbers the records push against the bounds they were given."""
    return [
        f"{name} = {number:.4g} lies on the bound it was given: the records ask for a value beyond it."
        for name, number, error in found.parameters[["value", "error"]].itertuples()
        if name in bounds and min(abs(number - end) for end in bounds[name]) < 0.01 * error
    ]


def _best_start(problem: Problem, guess: Guess) -> Law:
    """Of the first guesses the one with the least misfit."""
    if not guess.rivals:
        return guess.law
    usual = [np.full_like(rest, max(float(np.median(np.abs(rest))), 1e-300)) for rest in problem.residuals(guess.law)]
    return min([guess.law, *guess.rivals], key=lambda law: problem.cost(law, usual))


def _what_could_not_be_told(found: BranchFit) -> list[str]:
    notes = []
    for name, number, error in found.parameters[["value", "error"]].itertuples():
        if abs(number) < 2 * error:
            notes.append(f"{name} is not told apart from zero: {number:.3g} ± {error:.2g}.")
    errors = found.parameters["error"].to_numpy()
    correlation = found.covariance.to_numpy() / np.outer(errors, errors)
    names = list(found.parameters.index)
    notes += [
        f"{names[j]} and {names[i]} are hardly told apart (correlation {correlation[i, j]:.3f}): a combination of them is "
        "known far better than either."
        for i in range(len(names))
        for j in range(i)
        if abs(correlation[i, j]) > CORRELATED
    ]
    return notes


def _notes(record: FrictionRecord) -> list[str]:
    notes = record.attrs.get("notes", [])
    if isinstance(notes, str):
        return [notes] if notes else []
    return [str(note) for note in np.atleast_1d(notes)]


def _command(
    records: Sequence[FrictionRecord],
    kind: type[Law],
    free: Iterable[str] | None,
    fixed: Mapping[str, float] | None,
    pieces: int | Literal["auto"] | None,
    offset: bool,
    bounds: Mapping[str, tuple[float, float]] | None,
) -> str:
    files = [f"FRICTION-{i}.nc" if record.name == f"record {i}" else record.name for i, record in enumerate(records, 1)]
    parts = ["stickslip", "identify", *files, "--law", kind.__name__]
    if free is not None:
        parts += ["--free", *free]
    if fixed:
        parts += ["--fixed", *(f"{name}={value:g}" for name, value in fixed.items())]
    if pieces is not None:
        parts += ["--pieces", str(pieces)]
    if offset:
        parts.append("--offset")
    if bounds:
        parts += ["--bounds", *(f"{name}={low:g}:{high:g}" for name, (low, high) in bounds.items())]
    return shlex.join(parts)


def _darker(color: Any) -> Any:
    from matplotlib.colors import to_rgb

    return tuple(0.45 * part for part in to_rgb(color))
