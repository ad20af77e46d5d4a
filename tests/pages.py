"""The blocks of code of a page of the docs, run in their order."""

import re
import shlex
import tomllib
from collections.abc import Iterator
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from typing import Any

from stickslip.cli.main import main

FENCE = re.compile(r"^(`{3,}|:{3,})([^\n]*)\n(.*?)^\1\s*$", re.MULTILINE | re.DOTALL)
PICTURE = re.compile(r"\s*!\[[^\]]*\]\((?:\.\./)*figures/([\w-]+\.\w+)\)")


@dataclass
class Block:
    """A fenced block.

    Parameters
    ----------
    kind : its language.
    body : its text.
    picture : name of the picture that stands right below it, "" where none does.
    printed : what it printed, once it ran.
    names : the names of the page once it ran.
    """

    kind: str
    body: str
    picture: str = ""
    printed: str = ""
    names: dict[str, Any] = field(default_factory=dict)

    @property
    def plots(self) -> list[str]:
        """The files that a block of commands draws into."""
        return re.findall(r"--plot (\S+)", self.body) if self.kind == "console" else []


def blocks(page: Path) -> list[Block]:
    """The fenced blocks of a page without directives of the site, which have braces."""
    text = page.read_text(encoding="utf-8")
    found = []
    for block in FENCE.finditer(text):
        fence, kind, body = block.groups()
        if fence[0] == "`" and "{" not in kind:
            below = PICTURE.match(text, block.end())
            found.append(Block(kind.strip(), body, below[1] if below else ""))
    return found


def run(page: Path) -> Iterator[Block]:
    """Run the blocks of a page in the current folder; yields each of them after it ran."""
    names: dict[str, Any] = {"__name__": "page"}
    for block in blocks(page):
        with redirect_stdout(StringIO()) as out:
            if block.kind == "python":
                exec(compile(block.body, page.name, "exec"), names)
            elif block.kind == "console":
                _run_console(block.body)
        block.printed, block.names = out.getvalue(), names
        if block.kind == "toml":
            tomllib.loads(block.body)
            if name := re.match(r"# ([\w-]+\.toml)\n", block.body):
                Path(name[1]).write_text(block.body, encoding="utf-8")
        yield block


def _run_console(text: str) -> None:
    """Run the lines that begin with a prompt."""
    for line in text.replace("\\\n", " ").splitlines():
        if line.startswith("$ "):
            words = shlex.split(line[2:])
            assert words[0] == "stickslip", f"a console block holds commands of stickslip, got {line}"
            assert main(words[1:]) == 0, line
