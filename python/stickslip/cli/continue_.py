"""``stickslip continue``: branches of motions over a number of the system file."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from stickslip.cli.terminal import Bar, Commands, partial, save_figure, say, say_json, say_written
from stickslip.errors import InputError, Interrupted

if TYPE_CHECKING:
    from stickslip.dynamics.continuation.branch import Branches
    from stickslip.dynamics.continuation.loci import Locus

#: What a branch that ends within the bounds says, where that is not the kind of its last special point.
_WHY = {"point": "the cycle shrinks to a point", "lost": "no orbit is found beyond"}


def add(commands: Commands[argparse.ArgumentParser]) -> None:
    command = commands.add_parser("continue", help="branches of steady slip and cycles over a parameter")
    command.add_argument("system", metavar="SYSTEM.toml")
    command.add_argument("--over", required=True, metavar="NAME=LO:HI", help="the parameter and its bounds")
    command.add_argument(
        "--and", dest="also", metavar="NAME=LO:HI", help="follow the special points over this number too"
    )
    command.add_argument("--doubled", action="store_true", help="follow the branches of twice the period from flips")
    command.add_argument(
        "--most", type=int, default=300, metavar="N", help="largest number of points of a branch each way"
    )
    command.add_argument(
        "--starts", type=int, default=3, metavar="N", help="search for further motions from N positions by N velocities"
    )
    command.add_argument(
        "--max-seconds",
        type=float,
        metavar="S",
        help="end the search for branches after so many seconds, with what is found by then",
    )
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


def parse_range(option: str, text: str) -> tuple[str, tuple[float, float]]:
    """NAME=LO:HI as a name and two numbers."""
    name, found, bounds = text.partition("=")
    if not found:
        raise InputError(f"{option}: expected NAME=LO:HI such as drive_velocity=0.05:0.6, got {text!r}")
    return name, parse_bounds(option, bounds)


def run(options: argparse.Namespace) -> None:
    from dataclasses import replace

    from stickslip.dynamics.continuation.bifurcation_conditions import BY_MULTIPLIERS
    from stickslip.dynamics.continuation.branch_switching import switch_branch
    from stickslip.dynamics.continuation.branches import continuation
    from stickslip.dynamics.continuation.loci import Locus, locus, together
    from stickslip.dynamics.periodic.event_sequence import check
    from stickslip.files.netcdf import write_netcdf
    from stickslip.model.system_file import load_system
    from stickslip.simulation.time_limit import TimeLimit

    name, bounds = parse_range("--over", options.over)
    other = parse_range("--and", options.also) if options.also else None
    system = check(load_system(options.system), "continue")
    result: Branches | None = None
    loci: list[Locus] = []
    most, limit, left, interrupted = options.most, TimeLimit.after(options.max_seconds, "continue"), 0, False
    with Bar() as bar:

        def notify(done: int, most: int) -> None:
            bar("points" if done else "an orbit to start from", done, most)

        try:
            result = continuation(
                system, name, bounds, starts=options.starts, most=most, max_seconds=limit.left, progress=notify
            )
            for flip in [item for item in result.special_points if item.kind == "flip"] if options.doubled else ():
                doubled = switch_branch(result, flip, most=most, max_seconds=limit.left, progress=notify)
                result = replace(result, branches=(*result.branches, doubled))
            if other is not None:
                kinds = ("hopf", *BY_MULTIPLIERS)
                for item in [item for item in result.special_points if item.kind in kinds or item.boundary]:
                    if limit.passed:
                        left += 1
                    else:
                        loci.append(locus(item, (name, other[0]), (bounds, other[1]), progress=notify))
        except KeyboardInterrupt as stop:
            if isinstance(stop, Interrupted):
                more = stop.result
                if isinstance(more, Locus):
                    loci.append(more)
                elif result is None:
                    result = more
                elif more.values:
                    result = replace(result, branches=(*result.branches, more))
            if result is None:
                raise
            interrupted = True
    output, plot = (partial(path) if interrupted else path for path in (options.output, options.plot))
    if output:
        dataset = result.to_xarray().merge(together(loci)) if loci else result.to_xarray()
        write_netcdf(output, dataset.assign_attrs(interrupted=int(interrupted)))
    if plot:
        from stickslip import show

        ax = show.loci_plot(loci) if loci else show.branches_plot(result)
        save_figure(ax.figure, plot)
    points = [{"kind": item.kind, "boundary": item.boundary, name: item.parameter} for item in result.special_points]
    branches: list[dict[str, Any]] = [
        {
            "kind": item.kind,
            "points": len(item.values),
            "from": min(item.values),
            "to": max(item.values),
            "closed": item.closed,
            "cut": item.cut,
            "ends": list(zip((item.values[0], item.values[-1]), item.ends, strict=True)),
        }
        for item in result.branches
    ]
    if options.json:
        curves = [{"kind": curve.kind, "values": curve.values.tolist()} for curve in loci]
        others = [{"regime": item.regime, name: item.value, "x": item.x, "start": item.start} for item in result.others]
        said = {"parameter": name, "interrupted": interrupted, "branches": branches, "special_points": points}
        said["motions_on_no_branch"] = others
        say_json(said | ({"loci": curves, "over": [name, other[0]]} if other else {}))
    else:
        _say(name, branches, result, loci)
        if left:
            say(f"{left} special points were not followed over {options.also} within --max-seconds")
        say_written(output, plot)
    if interrupted:
        files = " and ".join(path for path in (output, plot) if path)
        where = f"written to {files}" if files else "above; name a file with -o to keep it"
        raise KeyboardInterrupt(f"what was found by then is {where}")


def _say(name: str, branches: list[dict[str, Any]], result: Branches, loci: list[Locus]) -> None:
    for branch in branches:
        kind = str(branch["kind"]).replace("_", " ")
        limit = {"": "", "interrupt": ", cut off by Ctrl-C"}.get(branch["cut"])
        cut = f", cut off by --{branch['cut'].replace('_', '-')}" if limit is None else limit
        closed = ", closed" * branch["closed"]
        ends = "".join(
            f", ends at {value:.6g}: {_WHY.get(why, why.replace('_', ' '))}"
            for value, why in branch["ends"]
            if why not in ("", "bounds", "closed", branch["cut"])
        )
        say(f"{kind:20s}{branch['points']} points, {name} {branch['from']:.6g} … {branch['to']:.6g}{closed}{ends}{cut}")
    for other in result.others:
        kind = f"other {other.regime.replace('_', ' ')}"
        ends, start = (", ".join(f"{value:.4g}" for value in pair) for pair in (other.x, other.start))
        say(
            f"{kind:20s}{name} {other.value:.6g}, x from and to {ends}, on no branch; from the start (x, v) = ({start})"
        )
    for item in result.special_points:
        say(f"{item.kind.replace('_', ' '):20s}{name} = {item.parameter:.12g}")
    for curve in loci:
        ends = " … ".join(f"({x:.6g}, {y:.6g})" for x, y in curve.values[[0, -1]])
        cut = ", cut off by Ctrl-C" if curve.cut else ""
        say(f"{'locus of ' + curve.kind.replace('_', ' '):30s}{len(curve.values)} points, {ends}{cut}")
