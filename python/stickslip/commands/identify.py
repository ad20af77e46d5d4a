"""``stickslip identify``: friction files to a friction law with its uncertainty."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip.commands.terminal import Bar, Commands, save_figure, say, say_json, say_written
from stickslip.errors import InputError

if TYPE_CHECKING:
    from stickslip.identification import Agreement, Identification


COMPARED = 5
"""The most linear pieces that --compare --pieces auto tries."""


def add(commands: Commands[argparse.ArgumentParser]) -> None:
    """Declare the options."""
    command = commands.add_parser("identify", help="fit a friction law to friction files, and simulate with it")
    command.add_argument("friction", nargs="+", metavar="FRICTION.nc")
    command.add_argument("--law", metavar="NAME", help="law to fit; default what the records can tell")
    command.add_argument(
        "--free", nargs="+", metavar="NAME", help="numbers of the law to fit; default what the records tell"
    )
    command.add_argument("--fixed", nargs="+", default=[], metavar="NAME=VALUE", help="numbers to hold")
    command.add_argument(
        "--bounds", nargs="+", default=[], metavar="NAME=LOW:HIGH", help="lowest and highest value of fitted numbers"
    )
    command.add_argument(
        "--pieces",
        type=_pieces,
        default=3,
        metavar="N|auto",
        help="linear pieces of PiecewiseLinear and TwoBranch; default 3; auto: as few as predict held-back parts best",
    )
    command.add_argument("--offset", action="store_true", help="fit a constant offset of the measured force too")
    command.add_argument(
        "--trajectories", action="store_true", help="sharpen the law by laying its motion over each record"
    )
    command.add_argument(
        "--shooting",
        choices=("auto", "records", "slips"),
        default="auto",
        help="what --trajectories lays over each other: whole records or slip by slip; default by whether cycles scatter",
    )
    command.add_argument("--starts", type=int, default=8, help="the most starting points of --trajectories; default 8")
    command.add_argument(
        "--profile", action="store_true", help="intervals of --trajectories from the profile of the likelihood"
    )
    command.add_argument(
        "--zero-error", type=float, default=0.0, metavar="LENGTH", help="of the displacement gauge, for --trajectories"
    )
    command.add_argument(
        "--scale-error", type=float, default=0.0, metavar="PART", help="of the displacement gauge, for --trajectories"
    )
    command.add_argument(
        "--steady",
        action="store_true",
        help="fit friction over slip velocity alone and compare its forms, with an offset or without; default for records "
        "that tell no more",
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
        help="predict kind of motion, stick time, mean force and main line of further runs by the law, beside what was "
        "measured; a rig file (.toml) for a run of which there is no record",
    )
    command.add_argument(
        "--no-simulation", action="store_true", help="do not lay a simulated motion over the measured one"
    )
    command.add_argument("-o", "--output", metavar="LAW.toml", help="write the law file")
    command.add_argument("--plot", metavar="FILE.png", help="draw the result")
    command.add_argument("--report", metavar="FILE.html", help="write a page that needs no other file")
    command.add_argument("--json", action="store_true", help="print the result as JSON")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    """Do the work."""
    if options.compare is not None:
        _compare(options)
        return
    from dataclasses import replace

    from stickslip.identification import compare_motion, fit_trajectories, identify, predict_motion
    from stickslip.identification.agreement import unknown_constants

    if options.plot and options.no_simulation:
        raise InputError("--plot lays a simulated motion over the measured one: leave out --no-simulation")
    if options.profile and not options.trajectories:
        raise InputError("--profile belongs to the misfit of the motions: add --trajectories")
    tables = _tables(options)
    if tables is not None:
        _say_tables(tables, options)
        return
    result = identify(
        options.friction,
        law=options.law,
        free=options.free,
        fixed=dict(map(_assignment, options.fixed)),
        pieces=options.pieces,
        offset=options.offset,
        bounds=dict(map(_bounds, options.bounds)),
    )
    if options.trajectories:
        unfinished = Path(options.output).with_suffix(".unfinished.toml") if options.output else None
        try:
            with Bar() as bar:
                result = fit_trajectories(
                    result,
                    shooting=options.shooting,
                    starts=options.starts,
                    profile=options.profile,
                    zero_error=options.zero_error,
                    scale_error=options.scale_error,
                    progress=bar,
                    checkpoint=unfinished,
                )
        except KeyboardInterrupt:
            if unfinished is not None and unfinished.exists():
                sentence = f"the best law so far is in {unfinished}; the same command goes on from it"
                sys.stderr.write(f"stickslip: {sentence}\n")
            raise
    missing = unknown_constants(result.records[0])
    if missing and options.plot:
        raise InputError(missing)
    if missing:
        result = replace(result, notes=[*result.notes, f"{missing}."])
    without = options.no_simulation or missing
    agreements = [] if without else [compare_motion(name, result) for name in options.friction[:1]]
    prediction = predict_motion(result, options.predict) if options.predict else None
    if options.output:
        result.save(options.output)
    if options.plot:
        save_figure(agreements[0].plot(), options.plot)
    if options.report:
        from stickslip.identification.page import page

        page(result, simulate=not options.no_simulation).write(options.report)
    if options.json:
        predicted = {} if prediction is None else {"prediction": prediction.to_dict()}
        say_json(_document(result, agreements) | predicted)
        return
    say(result.report())
    for agreement in agreements:
        say("\n" + agreement.report())
    if prediction is not None:
        say("\n" + prediction.report())
    say_written(options.output, options.plot, options.report)


def _document(result: Identification, agreements: list[Agreement]) -> dict[str, Any]:
    parameters = result.parameters[["value", "error", "low", "high"]].to_dict("index")
    document: dict[str, Any] = {"law": result.law.to_dict(), "parameters": parameters, "notes": result.notes}
    if result.motions is not None:
        document["motions"] = result.motions.to_dict("records")
    for agreement in agreements:
        table = agreement.table.astype(object).where(agreement.table.notna(), None)
        document["agreement"] = {"table": table.to_dict("index"), "sentences": agreement.sentences}
    return document


def _compare(options: argparse.Namespace) -> None:
    from stickslip.identification import compare_laws

    for name, given in (("--trajectories", options.trajectories), ("--plot", options.plot)):
        if given:
            raise InputError(f"--compare does not go with {name}: compare first, then identify the law that is best")
    pieces = COMPARED if options.pieces == "auto" else options.pieces
    with Bar() as bar:
        found = compare_laws(options.friction, options.compare or None, pieces=pieces, progress=bar)
    if options.output:
        found.best.save(options.output)
    if options.report:
        from stickslip.identification.page import page

        page(found.best, comparison=found, simulate=not options.no_simulation).write(options.report)
    if options.json:
        table = found.table.astype(object).where(found.table.notna(), None)
        say_json({"table": table.to_dict("index"), "sentences": found.sentences, "law": found.best.law.to_dict()})
        return
    say(found.report())
    say_written(options.output, options.report)


def _tables(options: argparse.Namespace) -> Any:
    """The fit to tables of friction over slip velocity or of break-aways, None where there is a motion to fit a law to."""
    from stickslip.identification import fit_static_friction, fit_steady, fit_velocity_step, fit_velocity_steps
    from stickslip.identification.rate_and_state import LEAST_STEPS
    from stickslip.identification.records import opened

    trees = [opened(Path(path)) for path in options.friction]
    steps = len(trees) == 1 and "step" in trees[0].children
    if options.law == "RateState" and steps:
        many = trees[0]["step"].sizes["step"] >= LEAST_STEPS
        return fit_velocity_steps(trees[0]) if many else fit_velocity_step(trees[0])
    if options.steady or all("time" not in tree.coords and "steady" in tree.children for tree in trees):
        return fit_steady(options.friction, options.law)
    if options.law is not None:
        return None
    if all("steady" in tree.children and not tree["break_away"].sizes["event"] for tree in trees):
        # Motion without sticks: friction over slip velocity is all there is, or how it settles after one step of the speed.
        return fit_velocity_step(options.friction[0]) if steps and _one_step(trees[0]) else fit_steady(options.friction)
    if all("slip_velocity" not in tree.variables for tree in trees):
        return fit_static_friction(options.friction)
    return None


def _one_step(tree: Any) -> bool:
    return bool(tree["step"].sizes["step"] == 1)


def _say_tables(found: Any, options: argparse.Namespace) -> None:
    if options.report:
        raise InputError("--report shows a law on records of motion; for tables of friction use --plot and -o")
    if options.output:
        found.save(options.output)
    if options.plot:
        save_figure(found.plot().figure, options.plot)
    if options.json:
        say_json(found.to_dict())
        return
    say(found.report())
    say_written(options.output, options.plot)


def _pieces(text: str) -> int | str:
    if text == "auto":
        return text
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


def _assignment(text: str) -> tuple[str, float]:
    name, _, number = text.partition("=")
    try:
        return name, float(number)
    except ValueError:
        raise InputError(f"--fixed: expected NAME=VALUE with a number, got {text!r}") from None
