"""Files on disk: refused in one sentence where they cannot be read, written whole or not at all."""

from __future__ import annotations

import contextlib
import glob
import os
import platform
import shutil
import tomllib
from collections.abc import Callable, Iterable, Iterator
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from stickslip.errors import InputError

MOST_BYTES = 8 << 20
"""Of a document: tables of a hundred thousand nodes; what is larger is something else."""

Identity = tuple[int, int]
_apart: ContextVar[tuple[set[Identity], set[Identity]] | None] = ContextVar("inputs and outputs", default=None)


@contextlib.contextmanager
def keeping_inputs(outputs: Iterable[str | Path]) -> Iterator[None]:
    """Within this, a file that is read cannot be written, under whatever name; `outputs` are known to be written later."""
    token = _apart.set((set(), {one for path in outputs if (one := _identity(Path(path))) is not None}))
    try:
        yield
    finally:
        _apart.reset(token)


def _identity(path: Path) -> Identity | None:
    """What a file is under all its names; None where there is none."""
    with contextlib.suppress(OSError, ValueError):
        status = path.stat()
        return status.st_dev, status.st_ino
    return None


def _both(path: Path) -> InputError:
    return InputError(f"{path}: is read and would be written over; give the output another name")


def with_article(what: str) -> str:
    """A noun with its article.

    >>> with_article("friction file"), with_article("experiment file")
    ('a friction file', 'an experiment file')
    """
    return f"{'an' if what[0].lower() in 'aeio' else 'a'} {what}"


def input_file(path: str | Path, what: str = "file") -> Path:
    """The path of a file that is to be read; `what` says what was expected there.

    Raises
    ------
    InputError
        where there is none, for a folder or a device, and within :func:`keeping_inputs` for an output.
    """
    path = Path(path)
    if _identity(path) is None:
        raise InputError(f"{path}: no such file; give the path of {with_article(what)}")
    if path.is_dir():
        raise InputError(f"{path}: {with_article(what)} was expected, this is a folder; name a file in it")
    if not path.is_file():
        raise InputError(f"{path}: {with_article(what)} was expected, this is a device; name a file")
    if (apart := _apart.get()) is not None and (identity := _identity(path)) is not None:
        inputs, outputs = apart
        if identity in outputs:
            raise _both(path)
        inputs.add(identity)
    return path


def read_bytes(path: str | Path, what: str, most: int) -> bytes:
    """The bytes of a file of at most `most`."""
    path = input_file(path, what)
    size = path.stat().st_size
    if size > most:
        raise InputError(
            f"{path}: {with_article(what)} of at most {most / 1e6:.3g} MB was expected, got {size / 1e6:.3g} MB"
        )
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: the file cannot be read ({error.strerror}); check its permissions") from None


def read_text(path: str | Path, what: str, most: int = MOST_BYTES) -> str:
    """The text of a file in UTF-8, with or without a mark at its start."""
    try:
        return read_bytes(path, what, most).decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError:
        raise InputError(f"{path}: expected {with_article(what)} in UTF-8, got something else") from None


def toml_table(text: str, where: str) -> dict[str, Any]:
    """The table of a TOML document."""
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # numbers of thousands of digits, brackets in brackets in brackets
        reason = "brackets too deep in each other" if isinstance(error, RecursionError) else error
        raise InputError(f"{where}: not a TOML document ({reason}); correct that line") from None


def read_toml(path: str | Path, what: str = "TOML file") -> dict[str, Any]:
    """The table of a TOML file."""
    return toml_table(read_text(path, what), str(path))


def check_writable(path: str | Path) -> Path:
    """The path made absolute; refused where no file can be written, so that long work is not done for nothing.

    Raises
    ------
    InputError
        for a folder, a device, or a place that is not there or closed.
    """
    path = Path(path).resolve()
    if path.is_dir():
        raise InputError(f"{path}: expected the name of a file, got a folder; add a file name")
    if path.exists() and not path.is_file():
        raise InputError(f"{path}: expected the name of a file, got a device; choose a file")
    if not path.parent.is_dir():
        raise InputError(f"{path}: the folder {path.parent} does not exist; make it first")
    if not os.access(path.parent, os.W_OK):
        raise InputError(f"{path}: cannot be written (Permission denied); choose another place")
    if (apart := _apart.get()) is not None and _identity(path) in apart[0]:
        raise _both(path)
    return path


def make_folder(path: str | Path, another: str = "folder") -> Path:
    """The folder, made if it is not there; `another` is what to choose where it cannot be.

    Raises
    ------
    InputError
        where it cannot be made.
    """
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: the folder cannot be made ({error.strerror}); choose another {another}") from None
    return folder


@contextlib.contextmanager
def draft_of(path: Path) -> Iterator[Path]:
    """A temporary name beside `path`: nothing is left of it in the end, nor of those that a killed process left."""
    start = f".{path.name}.{platform.node()}."
    for left in path.parent.glob(f"{glob.escape(start)}*.part"):
        if not _runs(left.name.removeprefix(start).removesuffix(".part")):
            _remove(left)
    draft = path.with_name(f"{start}{os.getpid()}.part")
    try:
        yield draft
    finally:
        _remove(draft)


def _runs(process: str) -> bool:
    """Whether a process of this machine may still run; elsewhere than on POSIX nobody is asked."""
    if os.name != "posix" or not process.isdecimal():
        return True
    try:
        os.kill(int(process), 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # another user's
        return True
    return True


def _remove(draft: Path) -> None:
    if draft.is_dir():
        shutil.rmtree(draft, ignore_errors=True)
    else:
        draft.unlink(missing_ok=True)


def check_ending(path: str | Path, *known: str) -> None:
    """Refuse a name whose ending promises another kind of file than what is written.

    Raises
    ------
    InputError
        where the ending is none of `known`.
    """
    ending = Path(path).suffix.lower()
    if ending not in known:
        raise InputError(
            f"{path}: expected a name that ends in {', '.join(known)}, got "
            f"{f'the ending {ending}' if ending else 'one without an ending'}; "
            f"write {Path(path).with_suffix(known[0])} for example"
        )


def write_text(path: str | Path, text: str, *endings: str) -> Path:
    """Write a text file whole, as :func:`write_whole`; where `endings` are given, its name must have one of them."""
    if endings:
        check_ending(path, *endings)
    return write_whole(path, lambda draft: draft.write_text(text, encoding="utf-8"))


def write_whole(path: str | Path, write: Callable[[Path], object]) -> Path:
    """Let `write` fill a temporary file beside `path`, then give it that name; on failure nothing is left.

    Raises
    ------
    InputError
        where the folder does not exist or cannot be written to.
    """
    path = check_writable(path)
    try:
        with draft_of(path) as draft:
            write(draft)
            draft.replace(path)
    except FileNotFoundError:
        raise InputError(f"{path}: the folder {path.parent} does not exist; make it first") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror or error}); choose another place") from None
    return path
