"""``stickslip example``: the record that ships with the package."""

from __future__ import annotations

import argparse

from stickslip.cli.terminal import Commands, say_written


def add(commands: Commands[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "example", help="copy a record, its rig file and a system file that ship with the package"
    )
    command.add_argument("-o", "--output", default="example", metavar="FOLDER", help="folder to write; default example")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    from stickslip.examples import copy_example

    say_written(*copy_example(options.output))
