"""``stickslip basins``: which steady motion is reached from each start."""

from __future__ import annotations

import argparse
import re

from stickslip.cli.sweep import add_run, lengths, numbers_of, settings
from stickslip.cli.terminal import Bar, Commands, save_figure, say, say_json, say_value, say_written


def add(commands: Commands[argparse.ArgumentParser]) -> None:
    command = commands.add_parser("basins", help="which steady motion is reached from each start")
    # A range may begin with a minus; argparse knows only plain numbers that do.
    command._negative_number_matcher = re.compile(r"-[\d.]")
    command.add_argument("system", metavar="SYSTEM.toml")
    command.add_argument("--x", required=True, metavar="LO:HI:N", help="positions at t = 0")
    command.add_argument("--v", required=True, metavar="LO:HI:N", help="velocities at t = 0")
    command.add_argument(
        "--mass", type=int, default=0, metavar="I", help="of several masses, the one that starts there"
    )
    add_run(command, "BASINS.zarr")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    from stickslip.dynamics import basins
    from stickslip.model.system_file import load_system

    system = load_system(options.system)
    starts = {name: numbers_of(getattr(options, name), f"--{name}", getattr(options, name)) for name in ("x", "v")}
    with Bar() as bar:
        progress = settings(options, lambda done, n: bar("starts", done, n))
        result = basins(system, **starts, mass=options.mass, decide=options.decide, **lengths(options), **progress)
    if options.plot:
        from stickslip import show

        save_figure(show.basins_plot(result).figure, options.plot)
    columns = ("regime", "period", "recurrence", "loops", "x_mean", "v_mean")
    attractors = [
        {"fraction": float(result["fraction"][i])} | {name: result[f"attractor_{name}"][i].item() for name in columns}
        for i in range(result.sizes["attractor"])
    ]
    if options.json:
        say_json({"starts": result["label"].size, "attractors": attractors})
        return
    say_value("starts", result["label"].size)
    for row in attractors:
        period = f"period {row['period']}" if row["period"] else row["recurrence"].replace("_", " ")
        means = {"x": row["x_mean"], "v": row["v_mean"]}
        spans = {name: float(abs(result[name]).max()) for name in means}  # what is left of a zero is rounding
        shown = [f"{name} = {value if abs(value) > 1e-12 * spans[name] else 0:.6g}" for name, value in means.items()]
        where = f"{', '.join(shown)} in the section"
        say(f"{100 * row['fraction']:7.3f} %           {row['regime'].replace('_', ' ')}, {period}, {where}")
    say_written(options.output, options.plot)
