"""``stickslip critical``: the drive velocities at which the kind of motion changes."""

from __future__ import annotations

import argparse

from stickslip.cli.terminal import Bar, Commands, say, say_json


def add(commands: Commands[argparse.ArgumentParser]) -> None:
    command = commands.add_parser("critical", help="drive velocities at which steady slip and cycles change their kind")
    command.add_argument("system", metavar="SYSTEM.toml")
    command.add_argument("--between", metavar="LO:HI", help="range of drive velocities to search")
    command.add_argument(
        "--max-seconds",
        type=float,
        metavar="S",
        help="end the search after so many seconds, with what is confirmed by then",
    )
    command.add_argument(
        "--samples",
        type=int,
        metavar="N",
        help="95 %% intervals from N laws drawn from the covariance of a law file",
    )
    command.add_argument("--json", action="store_true", help="print the result as JSON")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    from stickslip.cli.continue_ import parse_bounds
    from stickslip.dynamics.critical.critical_velocities import critical_velocities
    from stickslip.dynamics.critical.intervals import critical_intervals
    from stickslip.errors import InputError
    from stickslip.model.system_file import load_system

    if options.samples is not None and options.max_seconds is not None:
        raise InputError("critical: --samples does not go with --max-seconds: leave one out")
    bounds = parse_bounds("--between", options.between) if options.between else None
    system = load_system(options.system)
    with Bar() as bar:
        found = critical_velocities(system, bounds, progress=bar, max_seconds=options.max_seconds)
        spread = {}
        if options.samples is not None:
            table = critical_intervals(system, options.samples, seed=0, bounds=bounds, progress=bar)
            spread = {str(name): (row["low"], row["high"], int(row["laws"])) for name, row in table.iterrows()}
    if options.json:
        document = {
            "critical_velocities": found.all,
            "criticality": found.criticality,
            "criticalities": found.criticalities,
            "not_shown": [(point.kind, point.parameter) for point in found.not_shown],
            "neutral": found.neutral,
            "finished": found.finished,
            "brackets": found.brackets,
            "unstable": found.unstable,
            "beyond": found.beyond,
        }
        say_json(document | ({"intervals": spread} if options.samples is not None else {}))
        return
    natures = {("hopf", value): f", {word}" for value, word in found.criticalities}
    for kind, value in found.all:
        nature = natures.get((kind, value), "")
        say(f"{kind.replace('_', ' ') + ' ':20s}{value:.12g}{nature}")
    if not found:
        say("none in this range" if found.finished else "none confirmed so far")
    if found.unstable:
        low, high = found.unstable
        say(f"steady slip is unstable at every speed from {low:.6g} to {high:.6g}")
    if found.beyond:
        say(f"stick-slip goes on beyond {found.beyond:.6g}")
    for name, low, high in found.brackets:
        say(f"{name.replace('_', ' ') + ' ':20s}between {low:.12g} and {high:.12g} (not confirmed)")
    for point in found.not_shown:
        say(f"{point.kind.replace('_', ' '):20s}{point.parameter:.12g}, on a cycle (not shown by runs)")
    for name, (low, high, laws) in spread.items():
        say(f"{name.replace('_', ' '):20s}{low:.6g} to {high:.6g} (95 %, in {laws} of {options.samples} laws)")
    for low, high in found.neutral:
        say(f"{'neutral slip':20s}from {low:.12g} to {high:.12g}: small disturbances neither grow nor decay")
