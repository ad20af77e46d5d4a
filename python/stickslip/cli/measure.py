"""``stickslip measure``: a record to slip velocity, friction force and break-aways."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip.cli.terminal import Commands, save_figure, say_json, say_value, say_written

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def add(commands: Commands[argparse.ArgumentParser]) -> None:
    command = commands.add_parser("measure", help="turn a record into slip velocity, friction force and break-aways")
    command.add_argument("record", nargs="+", metavar="RECORD", help="a record or motion file; several runs of one rig")
    command.add_argument("--rig", required=True, metavar="RIG.toml", help="rig file: instrument, columns, constants")
    command.add_argument("--mass", metavar="LABEL", help="one mass of a motion file; default: all")
    command.add_argument("-o", "--output", metavar="FRICTION.nc", help="write the friction file")
    command.add_argument(
        "--plot", metavar="FILE.png", help="draw the result; of several masses a picture each, FILE-MASS.png"
    )
    command.add_argument(
        "--motion", metavar="MOTION.nc", help="write displacement, velocity and acceleration (of a mass on a spring)"
    )
    command.add_argument(
        "--method",
        metavar="NAME",
        default="pieces",
        help="of --motion: pieces (default), spline, savitzky_golay, kalman",
    )
    command.add_argument("--plot-motion", metavar="FILE.png", help="draw motion, phase plane and spectra, likewise")
    command.add_argument("--json", action="store_true", help="print the result as JSON")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    from stickslip.files.netcdf import write_netcdf
    from stickslip.measurement import facts, measure, notes, summary

    record = options.record if len(options.record) > 1 else options.record[0]
    friction = measure(record, options.rig, mass=options.mass)
    if options.output:
        write_netcdf(options.output, friction)
    drawn: list[str] = []
    if options.plot:
        from stickslip import show

        masses = {"": friction} if "notes" in friction.attrs else friction.children
        parts = {name.removeprefix("mass_"): part for name, part in masses.items()}
        drawn += _draw(options.plot, parts, show.friction_record)
    if options.motion or options.plot_motion:
        drawn += _motion(record, options)
    if options.json:
        say_json(facts(friction) | {"notes": notes(friction)})
        return
    for name, text in summary(friction).items():
        say_value(name, text)
    for note in notes(friction):
        say_value("note", note)
    say_written(options.output, options.motion, *drawn)


def _motion(record: str | list[str], options: argparse.Namespace) -> list[str]:
    from stickslip.files.netcdf import write_netcdf
    from stickslip.measurement import motion

    moved = motion(record, options.rig, method=options.method, mass=options.mass)
    if options.motion:
        write_netcdf(options.motion, moved)
    if not options.plot_motion:
        return []
    from stickslip import show

    parts = {str(m): moved.sel(mass=m) for m in moved["mass"].values} if "mass" in moved.dims else {"": moved}
    return _draw(options.plot_motion, parts, show.motion_figure)


def _draw(path: str, parts: Mapping[str, Any], draw: Callable[[Any], list[Axes]]) -> list[str]:
    """A picture of each part: of several masses ``force-0.png``, ``force-1.png``, ..."""
    target = Path(path)
    names = [path if len(parts) == 1 else str(target.with_stem(f"{target.stem}-{mass}")) for mass in parts]
    for name, part in zip(names, parts.values(), strict=True):
        save_figure(draw(part)[0].figure, name)
    return names
