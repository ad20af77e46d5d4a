"""``stickslip demo``: the whole way on what ships with the package."""

from __future__ import annotations

import argparse

from stickslip.cli.terminal import Bar, Commands, say


def add(commands: Commands[argparse.ArgumentParser]) -> None:
    command = commands.add_parser("demo", help="the whole way on what ships with the package")
    command.add_argument(
        "-o", "--output", default="demo-report", metavar="FOLDER", help="folder to write; default demo-report"
    )
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    from stickslip.paper.demo import demo

    with Bar() as bar:
        report = demo(options.output, bar)
    say(str(report))
