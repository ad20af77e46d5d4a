"""``stickslip continue``: branches of motions over a number of the system file."""

from __future__ import annotations

import argparse

from stickslip.commands.terminal import Bar, Commands, save_figure, say, say_json, say_written
from stickslip.errors import InputError


def add(commands: Commands[argparse.ArgumentParser]) -> None:
    """Declare the options."""
    command = commands.add_parser("continue", help="branches of steady slip and cycles over a parameter")
    command.add_argument("system", metavar="SYSTEM.toml")
    command.add_argument("--over", required=True, metavar="NAME=LO:HI", help="the parameter and its bounds")
    command.add_argument("-o", "--output", metavar="BRANCHES.nc", help="write the branches")
    command.add_argument("--plot", metavar="FILE.png", help="draw the result")
    command.add_argument("--json", action="store_true", help="print the result as JSON")
    command.set_defaults(run=run)


def parse_bounds(option: str, text: str) -> tuple[float, float]:
    """LO:HI as two numbers.

    >>> parse_bounds("--between", "0.1:0.5")
    (0.1, 0.5)
    """
    try:
        low, high = (float(part) for part in text.split(":"))
    except ValueError:
        raise InputError(f"{option}: expected LO:HI such as 0.05:0.6, got {text!r}") from None
    return low, high


def run(options: argparse.Namespace) -> None:
    """Do the work."""
    from stickslip.documents import write_whole
    from stickslip.stability.branches import continuation
    from stickslip.stability.trail import check
    from stickslip.system import load_system

    name, found, text = options.over.partition("=")
    if not found:
        raise InputError(f"--over: expected NAME=LO:HI such as drive_velocity=0.05:0.6, got {options.over!r}")
    bounds = parse_bounds("--over", text)
    system = check(load_system(options.system), "continue")
    with Bar() as bar:
        result = continuation(system, name, bounds, progress=lambda done, most: bar("points", done, most))
    if options.output:
        dataset = result.to_xarray()
        write_whole(options.output, lambda draft: dataset.to_netcdf(draft, engine="h5netcdf"))
    if options.plot:
        from stickslip import show

        save_figure(show.branches_plot(result).figure, options.plot)
    points = [{"kind": item.kind, "border": item.border, name: item.parameter} for item in result.special_points]
    branches = [
        {"kind": item.kind, "points": len(item.values), "from": item.values[0], "to": item.values[-1]}
        for item in result.branches
    ]
    if options.json:
        say_json({"parameter": name, "branches": branches, "special_points": points})
        return
    for branch in branches:
        kind = str(branch["kind"]).replace("_", " ")
        say(f"{kind:20s}{branch['points']} points, {name} {branch['from']:.6g} … {branch['to']:.6g}")
    for item in result.special_points:
        say(f"{item.kind.replace('_', ' '):20s}{name} = {item.parameter:.12g}")
    say_written(options.output, options.plot)
