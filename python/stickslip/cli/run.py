"""``stickslip run``: all records or films of an experiment to motion, friction, pictures, one law and one report."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from stickslip.cli.terminal import Bar, Commands, say, say_written
from stickslip.errors import InputError

if TYPE_CHECKING:
    import pandas as pd


def add(commands: Commands[argparse.ArgumentParser]) -> None:
    command = commands.add_parser("run", help="measure all records or films of an experiment, and identify their law")
    command.add_argument("experiment", metavar="EXPERIMENT.toml", help="records, rig, setup of the tracks, law, output")
    command.add_argument("--again", action="store_true", help="measure finished records again too")
    command.add_argument("--watch", action="store_true", help="wait for new records in the folders, until Ctrl-C")
    command.add_argument(
        "--every", type=float, default=5.0, metavar="SECONDS", help="seconds between two checks; default 5"
    )
    command.add_argument("--json", action="store_true", help="print the table as JSON")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    """Do the work.

    Raises
    ------
    InputError
        where the document is wrong; where any record failed, after all others are done.
    """
    from stickslip.experiment.experiment import Experiment
    from stickslip.experiment.unattended_run import run as run_all
    from stickslip.experiment.unattended_run import watch

    plan = Experiment.of(options.experiment)

    def show(table: pd.DataFrame) -> None:
        if options.json:
            say(str(table.reset_index().to_json(orient="records", indent=2)))
            return
        for name, row in table.iterrows():
            say(f"{row['state']:18s}{name}" + (f": {row['message']}" if row["message"] else ""))
        if table.attrs["law"]:
            say(f"\n{table.attrs['law']}\n")
        say_written(plan.results / "report.html", plan.results / "records.csv")

    if options.watch:
        watch(plan, every=options.every, on_table=show)
        return
    with Bar(lines=True) as bar:
        table = run_all(plan, again=options.again, progress=bar)
    show(table)
    failed = int((table["state"] == "failed").sum())
    if failed:
        raise InputError(f"{failed} of {len(table)} records could not be measured; the others are in {plan.results}")
