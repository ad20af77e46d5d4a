"""The command line: each arrow of the way is a sub-command, the config file is the truth.

Results go to stdout or to ``-o``, progress to stderr; ``--json`` is for machines. Input that cannot be used gives one
sentence and exit code 2.
"""

from __future__ import annotations

import argparse
import contextlib
import signal
import sys
import threading
import warnings
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from stickslip.cli import (
    basins,
    completion,
    continue_,
    critical,
    demo,
    example,
    explore,
    film,
    identify,
    law,
    measure,
    reproduce,
    run,
    schema,
    simulate,
    sweep,
    track,
)
from stickslip.cli.terminal import say
from stickslip.errors import InputError, UnfinishedWarning
from stickslip.files.disk import check_ending, check_writable, keeping_inputs

TARGETS = ("output", "plot", "report", "motion", "plot_motion", "check", "table", "code")
"""Options that name a file which is written; what stands for it in the help says by its ending what kind of file."""

SAME_KIND = {".html": (".html", ".htm"), ".avi": (".avi", ".mkv", ".mp4")}
"""Endings that do as well as the one in the help."""

FILES = (".html", ".htm", ".pdf", ".png", ".csv", ".json", ".toml", ".nc", ".txt", ".md")
"""Endings that a new folder may not have: a file was meant."""

# In the order of the way through the package.
COMMANDS = (
    example,
    simulate,
    film,
    track,
    measure,
    identify,
    law,
    run,
    sweep,
    basins,
    continue_,
    critical,
    reproduce,
    explore,
    demo,
    schema,
    completion,
)


EXAMPLES = {
    "example": "stickslip example -o example",
    "simulate": "stickslip simulate example/system.toml -o orbit.nc --plot orbit.png",
    "film": "stickslip film system.toml -o film.avi",
    "track": "stickslip track film.avi --setup film.track.toml -o motion.nc",
    "measure": "stickslip measure example/block.csv --rig example/block.toml -o friction.nc --plot friction.png",
    "identify": "stickslip identify friction.nc -o law.toml --report law.html",
    "law": "stickslip law law.toml --plot law.png --code law.c --speed 0.5",
    "run": "stickslip run experiment.toml --watch",
    "sweep": "stickslip sweep system.toml --over drive_velocity=0.05:0.6:200 --plot diagram.png",
    "basins": "stickslip basins system.toml --x=-1:2:60 --v=-1:1:60 --plot basins.png",
    "continue": "stickslip continue system.toml --over drive_velocity=0.1:0.5 --plot branches.png",
    "critical": "stickslip critical system.toml",
    "explore": "stickslip explore law.toml",
    "reproduce": "stickslip reproduce -o report",
    "demo": "stickslip demo -o demo-report",
    "schema": "stickslip schema rig -o rig.schema.json",
    "completion": "stickslip completion bash >> ~/.bashrc",
}
"""What the help of each command ends with."""

FUNCTIONS = {
    "orbit_diagram": "sweep",
    "regime_map": "sweep",
    "continuation": "continue",
    "critical_velocities": "critical",
}
"""The command that stands for a function of Python whose name begins a message."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="stickslip",
        description="From a friction record to a friction law, and from the law to the motions of the system.",
    )
    parser.add_argument("--version", action="store_true", help="print the version and exit")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    for command in COMMANDS:
        command.add(commands)
    for name, command_parser in commands.choices.items():
        command_parser.epilog = f"example: {EXAMPLES[name]}"
    return parser


def _commands(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    (commands,) = (action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    return dict(commands.choices)


def _check_target(target: str, named: str, command: str) -> None:
    """Refuse a place that cannot be written to, or a file of another kind, before any work is done.

    Parameters
    ----------
    target : the path.
    named : what stands for it in the help, such as ``ORBIT.nc`` or ``FILM.avi|FOLDER``.
    command : the command that writes it.
    """
    if not target:
        raise InputError("-o, --plot and --report need the name of a file, got an empty one")
    folder = Path(target).resolve().parent
    if command not in ("demo", "reproduce", "example") and not folder.is_dir():
        raise InputError(f"{target}: the folder {folder} does not exist; make it first")
    file, *others = named.split("|")
    if Path(file).suffix not in ("", ".zarr") and not others:
        check_writable(target)
    wanted, ending = Path(file).suffix, Path(target).suffix.lower()
    if file == "FOLDER" and ending in FILES and not Path(target).is_dir():
        raise InputError(f"{target}: expected the name of a folder, got the ending {ending}; write {Path(target).stem}")
    if not wanted or (others and not ending):
        return
    check_ending(target, *(_pictures() if wanted == ".png" else SAME_KIND.get(wanted, (wanted,))))


def _check_apart(targets: Iterable[str]) -> None:
    """Refuse two outputs of one name: the second would be written over the first. Films may share a folder."""
    files = [Path(target).resolve() for target in targets if Path(target).suffix]
    for file in files:
        if files.count(file) > 1:
            raise InputError(f"{file}: two outputs have this name; give each its own")


def _pictures() -> tuple[str, ...]:
    from matplotlib.backend_bases import FigureCanvasBase

    return ".png", *(f".{kind}" for kind in sorted(FigureCanvasBase.get_supported_filetypes()) if kind != "png")


@contextlib.contextmanager
def _warning_in_one_line() -> Iterator[None]:
    """What is unfinished is said without the line of code that noticed it."""
    with warnings.catch_warnings():
        warnings.simplefilter("always", UnfinishedWarning)
        warnings.showwarning = lambda message, *_, **__: _tell(message)
        yield


def _tell(message: Warning | str | Exception) -> None:
    """Write one sentence to stderr; it names the command where it would name a function of Python."""
    name, colon, rest = str(message).partition(":")
    print(f"stickslip: {FUNCTIONS.get(name, name)}{colon}{rest}", file=sys.stderr)


@contextlib.contextmanager
def _ended_in_order() -> Iterator[None]:
    """A process that is asked to end (SIGTERM, as by `timeout`) ends as at Ctrl-C: nothing is left half done."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit code."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if options.version:
        from stickslip import _core

        say(f"stickslip {_core.__version__}")
        return 0
    if options.command is None:
        parser.print_help()
        return 2
    try:
        targets = {name: target for name in TARGETS if (target := getattr(options, name, None)) is not None}
        for action in _commands(parser)[options.command]._actions:
            if action.dest in targets:
                _check_target(targets[action.dest], str(action.metavar), options.command)
        _check_apart(targets.values())
        with _ended_in_order(), keeping_inputs(targets.values()), _warning_in_one_line():
            options.run(options)
    except InputError as error:
        _tell(error)
        return 2
    except KeyboardInterrupt as stop:
        print("; ".join(["stickslip: interrupted", *map(str, stop.args)]), file=sys.stderr)
        return 130
    except BrokenPipeError:
        return 1
    return 0
