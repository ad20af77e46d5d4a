"""A record that ships with the package, made by ``make.py`` beside it, so that the law behind it is known."""

from __future__ import annotations

import shutil
from pathlib import Path

from stickslip.errors import InputError

FILES = ("block.csv", "block.toml", "system.toml")
"""A position record, its rig file, and the oscillator with the true law."""
FOLDERS = ("rigs", "tracks")
"""Rig files of every instrument, and setups of films."""


def copy_example(folder: str | Path = ".") -> list[Path]:
    """Copy the example into a folder.

    Parameters
    ----------
    folder : where the files go; made if it does not exist.

    Returns
    -------
    The paths of ``block.csv``, ``block.toml`` and ``system.toml``, and of the folders ``rigs`` and
    ``tracks`` with further rig files and setups.

    Raises
    ------
    InputError
        where a file of that name exists already, or the folder cannot be written to.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     [path.name for path in copy_example(folder)]
    ['block.csv', 'block.toml', 'system.toml', 'rigs', 'tracks']
    """
    target = Path(folder)
    paths = [target / name for name in (*FILES, *FOLDERS)]
    for path in paths:
        if path.exists():
            raise InputError(f"{path}: expected a new file, got one that exists; choose another folder with -o")
    try:
        target.mkdir(parents=True, exist_ok=True)
        for path in paths:
            own = Path(__file__).with_name(path.name)
            (shutil.copytree if own.is_dir() else shutil.copyfile)(own, path)
    except OSError as error:
        raise InputError(f"{folder}: expected a folder to write to, got {error.strerror}; choose another") from None
    return paths
