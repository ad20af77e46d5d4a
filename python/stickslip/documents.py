"""Documents on disk: TOML tables read and checked with one clear sentence, files written whole or not at all."""

from __future__ import annotations

import difflib
import math
import os
import tomllib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from stickslip.errors import InputError


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return " (did you mean 'x'?)" where a known word is close to `word`, else nothing.

    >>> did_you_mean("stifness", ["mass", "stiffness"])
    " (did you mean 'stiffness'?)"
    """
    close = difflib.get_close_matches(word, list(known), n=1)
    return f" (did you mean {close[0]!r}?)" if close else ""


def check_keys(table: Mapping[str, Any], known: Iterable[str], required: Iterable[str], where: str) -> None:
    """Refuse a table with unknown or missing keys; `where` names it in the sentence."""
    if not isinstance(table, Mapping):
        raise InputError(f"{where}: expected a table with the keys {', '.join(known)}, got {table!r}")
    known = list(known)
    for key in table:
        if key not in known:
            raise InputError(f"{where}: unknown key {key!r}{did_you_mean(key, known)}; known are {', '.join(known)}")
    for key in required:
        if key not in table:
            raise InputError(f"{where}: {key} is missing; add a line `{key} = ...`")


def number(name: str, value: object, where: str) -> float:
    """`value` as a float; anything but a finite number is refused."""
    if isinstance(value, bool) or not hasattr(value, "__float__"):
        raise InputError(f"{where}: {name} must be a number, got {value!r}")
    try:
        result = float(value)
    except (OverflowError, ValueError, TypeError):
        result = math.inf
    if not math.isfinite(result):
        raise InputError(f"{where}: {name} must be a finite number, got {result}")
    return result


def numbers(name: str, value: Any, count: int, where: str, one_a: str) -> list[float]:
    """`value` as `count` floats, a single number where one is enough; `one_a` says what each belongs to.

    >>> numbers("x0", 0.5, 1, "simulate", "mass")
    [0.5]
    """
    import numpy as np

    try:
        values = np.asarray(value, float)
    except (TypeError, ValueError):
        raise InputError(f"{where}: {name} must be numbers, got {value!r}") from None
    if values.shape not in [(count,), *([()] if count == 1 else [])]:
        raise InputError(f"{where}: {name} must have the shape ({count},), one number a {one_a}, got {values.shape}")
    return [number(name, item, where) for item in values.ravel().tolist()]


def whole_number(name: str, value: object, where: str, least: int = 1, most: int = 2**63 - 1) -> int:
    """`value`, if it is a whole number from `least` to `most`.

    >>> whole_number("keep", 32, "simulate_many")
    32
    """
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
        wanted = f"of at least {least}" if value is None or most == 2**63 - 1 else f"from {least} to {most}"
        raise InputError(f"{where}: {name} must be a whole number {wanted}, got {value!r}")
    return value


def time_limit(value: float | None, where: str) -> float | None:
    """The seconds on the clock after which a run ends where it is, greater than 0; none for no limit."""
    if value is not None and number("max_seconds", value, where) <= 0:
        raise InputError(f"{where}: max_seconds must be greater than 0, got {value:g}")
    return value


#: The most numbers that one result may hold: 4 GiB.
MOST_NUMBERS = 2**29


def fits(count: float, where: str, advice: str) -> None:
    """Refuse a result of so many numbers that it would fill the memory of the machine; `advice` says what to lower."""
    if count > MOST_NUMBERS:
        most, size = (numbers * 8 / 2**30 for numbers in (MOST_NUMBERS, count))
        raise InputError(f"{where}: expected a result of at most {most:g} GiB, got one of {size:.3g} GiB; {advice}")


def read_toml(path: str | Path) -> dict[str, Any]:
    """The table of a TOML file."""
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; check the path") from None
    except IsADirectoryError:
        raise InputError(f"{path}: expected a TOML file, got a folder") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: expected a TOML file in UTF-8, got something else") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check its permissions") from None
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not a TOML document ({error}); correct that line") from None


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
    return path


def write_whole(path: str | Path, write: Callable[[Path], object]) -> Path:
    """Let `write` fill a temporary file beside `path`, then give it that name; on failure nothing is left.

    Raises
    ------
    InputError
        where the folder does not exist or cannot be written to.
    """
    path = check_writable(path)
    draft = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        write(draft)
        draft.replace(path)
    except FileNotFoundError:
        raise InputError(f"{path}: the folder {path.parent} does not exist; make it first") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror or error}); choose another place") from None
    finally:
        draft.unlink(missing_ok=True)
    return path
