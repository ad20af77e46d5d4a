"""``stickslip schema``: what a document may hold, for editors."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from stickslip.cli.terminal import Commands, say, say_written
from stickslip.files.disk import write_text


def add(commands: Commands[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "schema", help="the JSON Schema of a kind of TOML file, with which editors complete and check it"
    )
    command.add_argument("document", choices=[*_schemas()], help="the kind of file")
    command.add_argument("-o", "--output", metavar="FILE", help="file to write; default: print it")
    command.set_defaults(run=run)


def _schemas() -> dict[str, Callable[[], dict[str, Any]]]:
    def system() -> dict[str, Any]:
        from stickslip.model.system_schema import system_schema

        return system_schema()

    def law() -> dict[str, Any]:
        from stickslip.laws.law import law_schema

        return law_schema()

    def rig() -> dict[str, Any]:
        from stickslip.measurement.rigs.rig_file import rig_schema

        return rig_schema()

    def setup() -> dict[str, Any]:
        from stickslip.tracking.setup import Setup

        return Setup.schema()

    def experiment() -> dict[str, Any]:
        from stickslip.experiment.experiment import Experiment

        return Experiment.schema()

    return {"system": system, "law": law, "rig": rig, "setup": setup, "experiment": experiment}


def run(options: argparse.Namespace) -> None:
    text = json.dumps(_schemas()[options.document](), indent=1, ensure_ascii=False) + "\n"
    if options.output is None:
        say(text.rstrip())
    else:
        say_written(write_text(Path(options.output), text))
