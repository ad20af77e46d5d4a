"""``stickslip measure``: a record to slip velocity, friction force and break-aways."""

from __future__ import annotations

import argparse

from stickslip.commands.terminal import Commands, save_figure, say_json, say_value, say_written


def add(commands: Commands[argparse.ArgumentParser]) -> None:
    """Declare the options."""
    command = commands.add_parser("measure", help="turn a record into slip velocity, friction force and break-aways")
    command.add_argument("record", nargs="+", metavar="RECORD", help="a record or motion file; several runs of one rig")
    command.add_argument("--rig", required=True, metavar="RIG.toml", help="what the record was taken with")
    command.add_argument("--mass", metavar="LABEL", help="one mass of a motion file; default: all")
    command.add_argument("-o", "--output", metavar="FRICTION.nc", help="write the friction file")
    command.add_argument("--plot", metavar="FILE.png", help="draw the result")
    command.add_argument(
        "--motion", metavar="MOTION.nc", help="write displacement, velocity and acceleration (a spring)"
    )
    command.add_argument(
        "--method", metavar="NAME", default="pieces", help="of --motion: pieces (default), spline, ..."
    )
    command.add_argument("--plot-motion", metavar="FILE.png", help="draw motion, phase plane and spectra")
    command.add_argument("--json", action="store_true", help="print the result as JSON")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    """Do the work."""
    from stickslip.documents import write_whole
    from stickslip.measurement import facts, measure, notes

    record = options.record if len(options.record) > 1 else options.record[0]
    friction = measure(record, options.rig, mass=options.mass)
    if options.output:
        write_whole(options.output, lambda draft: friction.to_netcdf(draft, engine="h5netcdf"))
    if options.plot:
        from stickslip import show

        first = friction if "notes" in friction.attrs else next(iter(friction.children.values()))
        save_figure(show.friction_record(first)[0].figure, options.plot)
    if options.motion or options.plot_motion:
        _motion(record, options)
    found = facts(friction)
    if options.json:
        say_json(found | {"notes": notes(friction)})
        return
    for name, value in found.items():
        say_value(name, value)
    for note in notes(friction):
        say_value("note", note)
    say_written(options.output, options.plot, options.motion, options.plot_motion)


def _motion(record: str | list[str], options: argparse.Namespace) -> None:
    from stickslip.documents import write_whole
    from stickslip.measurement import motion

    moved = motion(record, options.rig, method=options.method, mass=options.mass)
    if options.motion:
        write_whole(options.motion, lambda draft: moved.to_netcdf(draft, engine="h5netcdf"))
    if options.plot_motion:
        from stickslip import show

        one = moved.isel(mass=0) if "mass" in moved.dims else moved
        save_figure(show.motion_figure(one)[0].figure, options.plot_motion)
