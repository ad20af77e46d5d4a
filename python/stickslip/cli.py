"""The command line: each arrow of the way is a sub-command, the config file is the truth.

Results go to stdout or to ``-o``, progress to stderr; ``--json`` is for machines. Input that cannot be used gives one
sentence and exit code 2.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from stickslip.errors import InputError


def _simulate(options: argparse.Namespace) -> None:
    from stickslip.simulation import simulate
    from stickslip.system import load_system_document

    system, settings = load_system_document(options.system)
    asked = {name: getattr(options, name) for name in ("t_end", "x0", "v0", "max_events")}
    settings |= {name: value for name, value in asked.items() if value is not None}
    settings.setdefault("t_end", 50 * system.natural_period)
    orbit = simulate(system, **settings)
    if options.output:
        orbit.save(options.output)
    if options.plot:
        _plot_orbit(orbit, options.plot)
    kinds = orbit.events["kind"].value_counts(sort=False)
    sticks = orbit.events["stick_time"].dropna()
    summary: dict[str, Any] = {
        "regime": orbit.regime(),
        "t_end": orbit.t_end,
        "stop": orbit.stop,
        "events": {str(kind): int(count) for kind, count in kinds.items() if count},
        "mean_stick_time": float(sticks.mean()) if len(sticks) else None,
        "evaluations": orbit.work.evaluations,
    }
    if options.json:
        _print_json(summary)
        return
    events = ", ".join(f"{count} {kind}" for kind, count in summary["events"].items()) or "none"
    print(f"regime              {summary['regime']}")
    print(f"simulated to        t = {orbit.t_end:g}; {orbit.stop_sentence}")
    print(f"events              {events}")
    if len(sticks):
        print(f"mean stick time     {sticks.mean():.6g}")
    _print_written(options)


def _plot_orbit(orbit: Any, path: str) -> None:
    import matplotlib.pyplot as plt

    from stickslip import show

    with plt.rc_context(show.STYLE):
        figure = plt.figure(figsize=(11, 4.4), layout="constrained")
    left, right = figure.subfigures(1, 2, squeeze=False, width_ratios=[1, 1.4])[0]
    show.phase_plane(orbit, left.subplots())
    show.time_series(orbit, right.subplots(3, 1, sharex=True), start=0.5 * orbit.t_end)
    _save_figure(figure, path)


def _save_figure(figure: Any, path: str) -> None:
    from stickslip.documents import write_whole

    kind = Path(path).suffix.lstrip(".").lower() or "png"
    if kind not in figure.canvas.get_supported_filetypes():
        known = ", ".join(sorted(figure.canvas.get_supported_filetypes()))
        raise InputError(f"{path}: cannot draw a picture of the kind {kind!r}; known are {known}")
    write_whole(path, lambda draft: figure.savefig(draft, format=kind, dpi=150))


def _measure(options: argparse.Namespace) -> None:
    from stickslip.documents import write_whole
    from stickslip.measurement import facts, measure, notes

    record = options.record if len(options.record) > 1 else options.record[0]
    friction = measure(record, options.rig, mass=options.mass)
    if options.output:
        write_whole(options.output, lambda draft: friction.to_netcdf(draft, engine="h5netcdf"))
    if options.plot:
        from stickslip import show

        first = friction if "notes" in friction.attrs else next(iter(friction.children.values()))
        _save_figure(show.friction_record(first)[0].figure, options.plot)
    found = facts(friction)
    if options.json:
        _print_json(found | {"notes": notes(friction)})
        return
    for name, value in found.items():
        print(f"{name.replace('_', ' '):20s}{value:.6g}" if isinstance(value, float) else f"{name:20s}{value}")
    for note in notes(friction):
        print(f"note                {note}")
    _print_written(options)


def _identify(options: argparse.Namespace) -> None:
    from stickslip.identification import compare_motion, identify
    from stickslip.identification.trajectory import fit_trajectories

    if options.plot and options.no_simulation:
        raise InputError("--plot lays a simulated motion over the measured one: leave out --no-simulation")
    settings = {"free": options.free, "fixed": dict(map(_assignment, options.fixed)), "pieces": options.pieces}
    result = identify(options.friction, law=options.law, **settings)
    if options.trajectories:
        result = fit_trajectories(result)
    agreement = None if options.no_simulation else compare_motion(options.friction[0], result)
    if options.output:
        result.save(options.output)
    if options.plot and agreement is not None:
        _save_figure(agreement.plot(), options.plot)
    if options.json:
        parameters = result.parameters[["value", "error", "low", "high"]].to_dict("index")
        document = {"law": result.law.to_dict(), "parameters": parameters, "notes": result.notes}
        if agreement is not None:
            table = agreement.table.astype(object).where(agreement.table.notna(), None)
            document["agreement"] = {"table": table.to_dict("index"), "sentences": agreement.sentences}
        _print_json(document)
        return
    print(result.report())
    if agreement is not None:
        print("\n" + agreement.report())
    _print_written(options)


def _check_target(target: str | None, command: str) -> None:
    """Refuse a place that cannot be written to before any work is done, so that nothing is left half done."""
    if target is None:
        return
    if not target:
        raise InputError("-o and --plot need the name of a file, got an empty one")
    folder = Path(target).resolve().parent
    if command != "demo" and not folder.is_dir():
        raise InputError(f"{target}: the folder {folder} does not exist; make it first")


def _assignment(text: str) -> tuple[str, float]:
    name, _, number = text.partition("=")
    try:
        return name, float(number)
    except ValueError:
        raise InputError(f"--fixed: expected NAME=VALUE with a number, got {text!r}") from None


def _demo(options: argparse.Namespace) -> None:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    from stickslip.demo import demo

    columns = (BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("start")
        report = demo(options.output, lambda what, done, n: bar.update(task, description=what, completed=done, total=n))
    print(report)


def _print_written(options: argparse.Namespace) -> None:
    for path in (options.output, options.plot):
        if path:
            print(f"written             {path}")


def _print_json(document: dict[str, Any]) -> None:
    json.dump(document, sys.stdout, indent=2, default=float)
    print()


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="stickslip",
        description="From a record of something that rubs to a friction law, and from the law to every motion.",
    )
    parser.add_argument("--version", action="store_true", help="print the version and exit")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")

    command = commands.add_parser("simulate", help="simulate the oscillator of a system file")
    command.add_argument("system", metavar="SYSTEM.toml")
    command.add_argument("--t-end", type=float, metavar="T", help="time to run; default: 50 natural periods")
    command.add_argument("--x0", type=float, help="position at t = 0; default 0")
    command.add_argument("--v0", type=float, help="velocity at t = 0; default that of the drive")
    command.add_argument("--max-events", type=int, metavar="N", help="stop there at the latest")
    command.add_argument("-o", "--output", metavar="ORBIT.nc", help="write the orbit")
    command.set_defaults(run=_simulate)

    command = commands.add_parser("measure", help="turn a record into slip velocity, friction force and break-aways")
    command.add_argument("record", nargs="+", metavar="RECORD", help="a record or motion file; several runs of one rig")
    command.add_argument("--rig", required=True, metavar="RIG.toml", help="what the record was taken with")
    command.add_argument("--mass", metavar="LABEL", help="one mass of a motion file; default: all")
    command.add_argument("-o", "--output", metavar="FRICTION.nc", help="write the friction file")
    command.set_defaults(run=_measure)

    command = commands.add_parser("identify", help="fit a friction law to friction files, and simulate with it")
    command.add_argument("friction", nargs="+", metavar="FRICTION.nc")
    command.add_argument("--law", default="DwellTime", metavar="NAME", help="law to fit; default DwellTime")
    command.add_argument(
        "--free", nargs="+", metavar="NAME", help="numbers of the law to fit; default what the records tell"
    )
    command.add_argument("--fixed", nargs="+", default=[], metavar="NAME=VALUE", help="numbers to hold")
    command.add_argument("--pieces", type=int, default=3, help="linear pieces of PiecewiseLinear; default 3")
    command.add_argument(
        "--trajectories", action="store_true", help="sharpen the law by laying its motion over each (steady) record"
    )
    command.add_argument(
        "--no-simulation", action="store_true", help="do not lay a simulated motion over the measured one"
    )
    command.add_argument("-o", "--output", metavar="LAW.toml", help="write the law file")
    command.set_defaults(run=_identify)

    for command in (commands.choices["simulate"], commands.choices["measure"], commands.choices["identify"]):
        command.add_argument("--plot", metavar="FILE.png", help="draw the result")
        command.add_argument("--json", action="store_true", help="print the result as JSON")

    from stickslip.tracking.command import add_film, add_track

    add_track(commands)
    add_film(commands)

    command = commands.add_parser("demo", help="the whole way on what ships with the package")
    command.add_argument("-o", "--output", default="demo-report", metavar="FOLDER", help="where the report goes")
    command.set_defaults(run=_demo)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit code."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if options.version:
        from stickslip import _core

        print(f"stickslip {_core.__version__}")
        return 0
    if options.command is None:
        parser.print_help()
        return 2
    try:
        for target in (getattr(options, "output", None), getattr(options, "plot", None)):
            _check_target(target, options.command)
        options.run(options)
    except InputError as error:
        print(f"stickslip: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("stickslip: interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
