"""``stickslip identify``: friction files to a friction law with its uncertainty."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from inspect import signature
from pathlib import Path as File
from typing import TYPE_CHECKING, Any, Literal

from stickslip.cli.terminal import Bar, Commands, save_figure, say, say_json, say_written
from stickslip.errors import InputError
from stickslip.files.disk import write_text

if TYPE_CHECKING:
    from stickslip.identification import Identification


COMPARED = 5
"""The most linear pieces that --compare --pieces auto tries."""


def add(commands: Commands[argparse.ArgumentParser]) -> None:
    """Declare the options; the steps of the paths say what they are where they are not given."""
    command = commands.add_parser(
        "identify",
        help="fit a friction law to friction files, and simulate with it",
        argument_default=argparse.SUPPRESS,  # what was not given is not there, so what was given can be told
    )
    command.add_argument("friction", nargs="+", metavar="FRICTION.nc")
    command.add_argument(
        "--law",
        metavar="NAME",
        help="law to fit; default chosen from the records; Combined:STATIC:KINETIC also names the parts of Combined",
    )
    command.add_argument(
        "--free", nargs="+", metavar="NAME", help="numbers of the law to fit; default chosen from the records"
    )
    command.add_argument("--fixed", nargs="+", metavar="NAME=VALUE", help="numbers that keep a given value")
    command.add_argument(
        "--bounds", nargs="+", metavar="NAME=LOW:HIGH", help="lowest and highest value of fitted numbers"
    )
    command.add_argument(
        "--ties",
        nargs="*",
        metavar="NAME=NAME",
        help="numbers that follow another; with none all are fitted; default those of the first guess, which the notes name",
    )
    command.add_argument(
        "--pieces",
        type=_pieces,
        metavar="N|auto",
        help="linear pieces of PiecewiseLinear, TwoBranch and Tabulated; default 3; auto: the fewest that predict well",
    )
    command.add_argument("--offset", action="store_true", help="fit a constant offset of the measured force too")
    command.add_argument(
        "--trajectories", action="store_true", help="refine the law by comparing its motion with each record"
    )
    command.add_argument(
        "--shooting",
        choices=("auto", "records", "slips"),
        help="what --trajectories compares: whole records or slip by slip; default by whether cycles scatter",
    )
    command.add_argument("--starts", type=int, help="the most starting points of --trajectories; default 8")
    command.add_argument(
        "--profile", action="store_true", help="intervals of --trajectories from the profile of the likelihood"
    )
    command.add_argument(
        "--zero-error",
        type=float,
        metavar="LENGTH",
        help="standard error of the zero of the position, for --trajectories",
    )
    command.add_argument(
        "--scale-error",
        type=float,
        metavar="SHARE",
        help="relative standard error of the scale of the position, for --trajectories; default that of the records, "
        "as those from films have one",
    )
    command.add_argument(
        "--steady",
        action="store_true",
        help="fit friction over slip velocity alone and compare its forms, with an offset or without; default for records "
        "that show only this",
    )
    command.add_argument(
        "--compare",
        nargs="*",
        metavar="LAW",
        help="rank laws (default all that can be identified) by their prediction of held-back parts of the records",
    )
    command.add_argument(
        "--predict",
        nargs="+",
        metavar="RUN.nc|RIG.toml",
        help="predict regime, sticks, mean and highest force and main line of further runs by the law, beside the measured "
        "ones; a rig file (.toml) stands for a run without a record",
    )
    command.add_argument(
        "--duration",
        type=float,
        metavar="TIME",
        help="length of time of --predict in which sticks are counted; default that of each run",
    )
    command.add_argument(
        "--no-simulation", action="store_true", help="do not compare a simulated motion with the measured one"
    )
    command.add_argument(
        "-o",
        "--output",
        metavar="LAW.toml",
        help="write the law file (of break-aways alone: the fits of static friction)",
    )
    command.add_argument(
        "--table",
        metavar="TABLE.csv",
        help="write friction over slip velocity, and static friction over stick time, with 95 %% bands",
    )
    command.add_argument(
        "--plot",
        metavar="FILE.png",
        help="draw measured and simulated motion; friction over slip velocity where there is none",
    )
    command.add_argument("--report", metavar="FILE.html", help="write a page that needs no other file")
    command.add_argument("--json", action="store_true", help="print the result as JSON")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    """Do the work."""
    given = {name: value for name, value in vars(options).items() if name not in NO_OPTIONS}
    others = [path.options for name, path in PATHS.items() if name != "trajectories"]
    for name in given:
        if "trajectories" not in given and name in PATHS["trajectories"].options.difference(*others):
            raise InputError(f"{_flag(name)} belongs to --trajectories: add --trajectories, or leave {_flag(name)} out")
    kind = _path(options.friction, given)
    path = PATHS[kind]
    for name in given:
        if name not in path.options:
            raise InputError(f"{_flag(name)} does not go with {_words(kind)}: {path.instead.format(_flag(name))}")
    found = options.friction
    for step in path.steps:
        found = step(found, **{name: given[name] for name in _keywords(step) if name in given})


NO_OPTIONS = ("command", "run", "version", "friction")
"""What the parser returns beside the options of this command."""


def _keywords(step: Callable[..., Any]) -> set[str]:
    """The options that a step uses."""
    return {name for name, item in signature(step).parameters.items() if item.kind is item.KEYWORD_ONLY}


@dataclass(frozen=True)
class Path:
    """One way from friction files to a result.

    Attributes
    ----------
    instead : what to do about an option that it does not use, with a gap for that option.
    steps : functions of what the one before returns, the first of the friction files. The options that they use are their
        keywords, so one that is used nowhere is refused everywhere.
    words : what it does, where that is no fit of :data:`stickslip.identification.selection.identify.FITS`.
    chosen_by : options that make this path the one that is taken, and are used by that.
    """

    instead: str
    steps: tuple[Callable[..., Any], ...]
    words: str = ""
    chosen_by: frozenset[str] = frozenset()

    @property
    def options(self) -> frozenset[str]:
        """All that it uses."""
        return self.chosen_by.union(*map(_keywords, self.steps))


def _path(files: list[str], given: dict[str, Any]) -> str:
    """The name of the way for these files and options: tables where there is no motion to fit a law to."""
    if "compare" in given:
        return "laws"
    from stickslip.identification.selection.identify import fit_of

    kind = fit_of(files, given.get("law"), steady="steady" in given)
    if kind == "motion":
        return "trajectories" if "trajectories" in given else "branches"
    return kind


def _words(kind: str) -> str:
    """What a way does."""
    from stickslip.identification.selection.identify import FITS

    return PATHS[kind].words or FITS[kind][0]


def _flag(name: str) -> str:
    return "--" + name.replace("_", "-")


def _fit_law(
    files: list[str],
    *,
    law: str | None = None,
    free: list[str] | None = None,
    fixed: Sequence[str] = (),
    bounds: Sequence[str] = (),
    ties: Sequence[str] | None = None,
    pieces: int | Literal["auto"] | None = None,
    offset: bool = False,
) -> Identification:
    from stickslip.identification import identify

    held, within = dict(map(_assignment, fixed)), dict(map(_bounds, bounds))
    tied = None if ties is None else dict(map(_tie, ties))
    found: Identification = identify(
        files, law=law, free=free, fixed=held, pieces=pieces, offset=offset, bounds=within, ties=tied
    )
    return found


def _refine(
    first: Identification,
    *,
    shooting: Literal["auto", "records", "slips"] = "auto",
    starts: int = 8,
    profile: bool = False,
    zero_error: float = 0.0,
    scale_error: float | None = None,
    output: str | None = None,
) -> Identification:
    from stickslip.identification import fit_trajectories

    unfinished = File(output).with_suffix(".unfinished.toml") if output else None
    try:
        with Bar() as bar:
            return fit_trajectories(
                first,
                shooting=shooting,
                starts=starts,
                profile=profile,
                zero_error=zero_error,
                scale_error=scale_error,
                progress=bar,
                checkpoint=unfinished,
            )
    except KeyboardInterrupt:
        if unfinished is not None and unfinished.exists():
            sentence = f"the best law so far is in {unfinished}; the same command goes on from it"
            sys.stderr.write(f"stickslip: {sentence}\n")
        raise


def _deliver_law(
    result: Identification,
    *,
    predict: list[str] | None = None,
    duration: float | None = None,
    no_simulation: bool = False,
    output: str | None = None,
    plot: str | None = None,
    report: str | None = None,
    json: bool = False,
) -> None:
    from stickslip.identification import predict_motion
    from stickslip.identification.prediction.agreement import compare_motions, unknown_constants

    missing = [said for record in result.records if (said := unknown_constants(record))]
    if missing:
        result = replace(result, notes=[*result.notes, *(f"{said}." for said in missing)])
    agreements = [] if no_simulation else compare_motions(result.records, result)
    if duration is not None and not predict:
        raise InputError("--duration belongs to --predict: add --predict, or leave --duration out")
    prediction = predict_motion(result, predict, duration) if predict else None
    if output:
        result.save(output)
    if plot:
        # Without a mass on a spring no motion is simulated: the law over the measured friction is what can be drawn.
        save_figure(agreements[0].plot() if agreements else result.plot().figure, plot)
    if report:
        from stickslip.report.identification import page

        page(result, simulate=not no_simulation).write(report)
    if json:
        document = result.to_dict()
        if agreements:
            document["agreements"] = [{"record": one.record.name} | one.to_dict() for one in agreements]
            document["agreement"] = document["agreements"][0]
        if prediction is not None:
            document["prediction"] = prediction.to_dict()
        say_json(document)
        return
    say(result.report())
    if agreements:
        say("\n" + agreements[0].report())
    if len(agreements) > 1:
        say(f"- This is the worst of {len(agreements)} records; the others, from the worst on:")
        for agreement in agreements[1:]:
            say(f"  - {agreement.summary()}")
    if prediction is not None:
        say("\n" + prediction.report())
    say_written(output, plot, report)


def _write_table(found: Any, *, table: str | None = None, json: bool = False) -> Any:
    if table:
        from stickslip.identification.law_table import law_table

        text = law_table(found).to_csv(index=False)
        write_text(table, text, ".csv")
        if not json:
            say_written(table)
    return found


def _compare(
    files: list[str],
    *,
    compare: list[str],
    pieces: int | Literal["auto"] = 3,
    no_simulation: bool = False,
    output: str | None = None,
    report: str | None = None,
    json: bool = False,
) -> None:
    from stickslip.identification import compare_laws

    most = COMPARED if pieces == "auto" else pieces
    with Bar() as bar:
        found = compare_laws(files, compare or None, pieces=most, progress=bar)
    if output:
        found.best.save(output)
    if report:
        from stickslip.report.identification import page

        page(found.best, comparison=found, simulate=not no_simulation).write(report)
    if json:
        say_json(found.to_dict() | {"law": found.best.law.to_dict()})
        return
    say(found.report())
    say_written(output, report)


def _fit_curve(files: list[str], *, law: str | None = None) -> Any:
    from stickslip.identification import fit_steady

    return fit_steady(files, law)


def _fit_steps(files: list[str], *, law: str | None = None) -> Any:
    from stickslip.identification import identify

    return identify(files, law)


def _fit_static(files: list[str]) -> Any:
    return _fit_steps(files)


def _deliver_table(
    found: Any,
    *,
    no_simulation: bool = False,
    output: str | None = None,
    plot: str | None = None,
    report: str | None = None,
    json: bool = False,
) -> None:
    del no_simulation  # no motion is fitted, so none is simulated: one command serves records of all kinds
    if output:
        found.save(output)
    if plot:
        save_figure(found.plot().figure, plot)
    if report:
        from stickslip.report.identification import page_of_table

        page_of_table(found).write(report)
    if json:
        say_json(found.to_dict())
        return
    say(found.report())
    say_written(output, plot, report)


PATHS = {
    "laws": Path("compare first, then identify the law that is best, with {}", (_compare,), "--compare"),
    "branches": Path(
        "leave {} out",
        (_fit_law, _write_table, _deliver_law),
        "the fit of a law to branches and break-aways",
    ),
    "trajectories": Path(
        "leave {} out",
        (_fit_law, _refine, _write_table, _deliver_law),
        "the fit of a law by --trajectories",
        frozenset({"trajectories"}),
    ),
    "curve": Path(
        "leave {} out, or name a law of the motion with --law",
        (_fit_curve, _write_table, _deliver_table),
        chosen_by=frozenset({"steady"}),
    ),
    "step": Path("leave {} out", (_fit_steps, _deliver_table)),
    "steps": Path("leave {} out", (_fit_steps, _deliver_table)),
    "static": Path("leave {} out, or add a record of the motion", (_fit_static, _deliver_table)),
}


def _pieces(text: str) -> int | Literal["auto"]:
    if text == "auto":
        return "auto"
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected a whole number or auto, got {text!r}") from None


def _bounds(text: str) -> tuple[str, tuple[float, float]]:
    name, _, ends = text.partition("=")
    low, _, high = ends.partition(":")
    try:
        return name, (float(low), float(high))
    except ValueError:
        raise InputError(f"--bounds: expected NAME=LOW:HIGH with two numbers, got {text!r}") from None


def _tie(text: str) -> tuple[str, str]:
    name, _, source = text.partition("=")
    if not name or not source:
        raise InputError(f"--ties: expected NAME=NAME, a number and the one that it follows, got {text!r}")
    return name, source


def _assignment(text: str) -> tuple[str, float]:
    name, _, number = text.partition("=")
    try:
        return name, float(number)
    except ValueError:
        raise InputError(f"--fixed: expected NAME=VALUE with a number, got {text!r}") from None
