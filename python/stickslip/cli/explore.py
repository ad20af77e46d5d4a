"""``stickslip explore``: a page in which a law is moved by hand and every motion follows."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from stickslip.cli.terminal import Commands, say_written


def add(commands: Commands[argparse.ArgumentParser]) -> None:
    command = commands.add_parser("explore", help="change a law by hand in a browser and see the motion follow")
    command.add_argument(
        "file",
        nargs="*",
        metavar="FILE",
        help="a law or system file (.toml), an orbit (.nc), friction records (.nc) to be fitted together, or a lesson (.md)",
    )
    command.add_argument(
        "-o", "--output", metavar="PAGE.html", help="file to write; default: in the cache folder of the user"
    )
    command.add_argument("--no-browser", action="store_true", help="write the page only")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    from stickslip.explorer import content_of, page
    from stickslip.files.disk import write_text

    content = content_of(*options.file) if options.file else {}
    path = Path(options.output) if options.output else cache() / "explorer.html"
    text = page(**content)
    path = write_text(path, text)
    say_written(path)
    if not options.no_browser:
        import webbrowser

        webbrowser.open(path.as_uri())


def cache() -> Path:
    """The user's folder for what can be made again."""
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    folder = base / "stickslip"
    folder.mkdir(parents=True, exist_ok=True)
    return folder
