"""``stickslip reproduce``: every figure and every statement of the paper, from our model."""

from __future__ import annotations

import argparse

from stickslip.commands.terminal import Bar, Commands, say, say_json, say_written


def add(commands: Commands[argparse.ArgumentParser]) -> None:
    """Declare the options."""
    command = commands.add_parser("reproduce", help="the paper's figures and statements from our model, scored")
    command.add_argument("-o", "--output", default="paper-report", metavar="FOLDER", help="where the page goes")
    command.add_argument("--json", action="store_true", help="print the scores as JSON")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    """Do the work."""
    import json

    import pandas as pd

    from stickslip.paper.reproduction import reproduce, summary

    with Bar() as bar:
        page = reproduce(options.output, bar)
    if options.json:
        say_json(json.loads((page.parent / "statements.json").read_text(encoding="utf-8")))
        return
    scores = pd.read_csv(page.parent / "statements.csv", index_col="id")
    for name, verdict in scores["verdict"].items():
        say(f"{name!s:30s}{verdict}")
    say(summary(scores))
    say_written(page)
