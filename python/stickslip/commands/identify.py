"""``stickslip identify``: friction files to a friction law with its uncertainty."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from stickslip.commands.terminal import Commands, save_figure, say, say_json, say_written
from stickslip.errors import InputError


def add(commands: Commands[argparse.ArgumentParser]) -> None:
    """Declare the options."""
    command = commands.add_parser("identify", help="fit a friction law to friction files, and simulate with it")
    command.add_argument("friction", nargs="+", metavar="FRICTION.nc")
    command.add_argument("--law", metavar="NAME", help="law to fit; default DwellTime, or the form that predicts best")
    command.add_argument(
        "--free", nargs="+", metavar="NAME", help="numbers of the law to fit; default what the records tell"
    )
    command.add_argument("--fixed", nargs="+", default=[], metavar="NAME=VALUE", help="numbers to hold")
    command.add_argument("--pieces", type=int, default=3, help="linear pieces of PiecewiseLinear; default 3")
    command.add_argument(
        "--trajectories", action="store_true", help="sharpen the law by laying its motion over each (steady) record"
    )
    command.add_argument(
        "--steady",
        action="store_true",
        help="fit friction over slip velocity alone and compare its forms, with an offset or without; default for records "
        "that tell no more",
    )
    command.add_argument(
        "--no-simulation", action="store_true", help="do not lay a simulated motion over the measured one"
    )
    command.add_argument("-o", "--output", metavar="LAW.toml", help="write the law file")
    command.add_argument("--plot", metavar="FILE.png", help="draw the result")
    command.add_argument("--json", action="store_true", help="print the result as JSON")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    """Do the work."""
    from stickslip.identification import compare_motion, identify
    from stickslip.identification.trajectory import fit_trajectories

    tables = _tables(options)
    if tables is not None:
        _say_tables(tables, options)
        return
    if options.plot and options.no_simulation:
        raise InputError("--plot lays a simulated motion over the measured one: leave out --no-simulation")
    settings = {"free": options.free, "fixed": dict(map(_assignment, options.fixed)), "pieces": options.pieces}
    result = identify(options.friction, law=options.law or "DwellTime", **settings)
    if options.trajectories:
        result = fit_trajectories(result)
    agreement = None if options.no_simulation else compare_motion(options.friction[0], result)
    if options.output:
        result.save(options.output)
    if options.plot and agreement is not None:
        save_figure(agreement.plot(), options.plot)
    if options.json:
        parameters = result.parameters[["value", "error", "low", "high"]].to_dict("index")
        document = {"law": result.law.to_dict(), "parameters": parameters, "notes": result.notes}
        if agreement is not None:
            table = agreement.table.astype(object).where(agreement.table.notna(), None)
            document["agreement"] = {"table": table.to_dict("index"), "sentences": agreement.sentences}
        say_json(document)
        return
    say(result.report())
    if agreement is not None:
        say("\n" + agreement.report())
    say_written(options.output, options.plot)


def _tables(options: argparse.Namespace) -> Any:
    """The fit to tables of friction over slip velocity or of break-aways, None where there is a motion to fit a law to."""
    from stickslip.identification import fit_static_friction, fit_steady
    from stickslip.identification.records import opened

    trees = [opened(Path(path)) for path in options.friction]
    if options.steady or all("time" not in tree.coords and "steady" in tree.children for tree in trees):
        return fit_steady(options.friction, options.law)
    if options.law is None and all("slip_velocity" not in tree.variables for tree in trees):
        return fit_static_friction(options.friction)
    return None


def _say_tables(found: Any, options: argparse.Namespace) -> None:
    if options.output:
        found.save(options.output)
    if options.plot:
        save_figure(found.plot().figure, options.plot)
    if options.json:
        say_json(found.to_dict())
        return
    say(found.report())
    say_written(options.output, options.plot)


def _assignment(text: str) -> tuple[str, float]:
    name, _, number = text.partition("=")
    try:
        return name, float(number)
    except ValueError:
        raise InputError(f"--fixed: expected NAME=VALUE with a number, got {text!r}") from None
