"""Many films at once: a finished one is not done again, a bad one does not stop the others."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip.errors import InputError
from stickslip.files.disk import make_folder
from stickslip.files.netcdf import tree_of
from stickslip.tracking.film_tracking import track
from stickslip.tracking.setup import Setup

if TYPE_CHECKING:
    import pandas as pd


def track_films(
    sources: list[str | Path],
    folder: str | Path,
    setup: Setup | Mapping[str, Any] | str | Path | None = None,
    *,
    check: bool = False,
    again: bool = False,
    progress: Callable[[str, int, int], object] | None = None,
    command: str | None = None,
    **options: Any,
) -> pd.DataFrame:
    """Track films into a folder, one motion file each.

    A film whose motion file is there, newer than the film and made with the same setup, is skipped, so an interrupted
    batch goes on where it was. A film that cannot be tracked is told in the table and the others go on.

    Parameters
    ----------
    sources : videos or folders of images.
    folder : where ``<name of the film>.nc`` goes; made if it is not there.
    setup, options : as for :func:`stickslip.track`, the same for all.
    check : write ``<name>.check.avi`` too.
    again : track also what is finished.
    progress : called with (what, films done, films in all).
    command : for the motion files.

    Returns
    -------
    Table with a row a film: source, motion (its file, or None), state (``"tracked"``, ``"finished before"``,
    ``"failed"``), seen (share of the places that were seen) and message (why it failed).

    Raises
    ------
    InputError
        if the setup is wrong, two films would have one name, or the folder cannot be made.
    """
    import pandas as pd

    wanted = Setup.of(setup, **options)
    names = _names([Path(source) for source in sources])
    folder = make_folder(folder)
    rows = []
    for done, (source, name) in enumerate(zip(sources, names, strict=True)):
        if progress is not None:
            progress(name, done, len(names))
        target = folder / f"{name}.nc"
        row: dict[str, Any] = {"source": str(source), "motion": str(target), "state": "tracked", "message": ""}
        if not again and (seen := _finished(Path(source), target, wanted)) is not None:
            rows.append(row | {"state": "finished before", "seen": seen})
            continue
        try:
            film = folder / f"{name}.check.avi" if check else None
            motion = track(source, wanted, output=target, check=film, command=command)
            rows.append(row | {"seen": float((motion["lost"] == "").mean())})
        except InputError as error:
            rows.append(row | {"motion": None, "state": "failed", "seen": 0.0, "message": str(error)})
    if progress is not None:
        progress("done", len(names), len(names))
    return pd.DataFrame(rows, columns=["source", "motion", "state", "seen", "message"])


def _names(paths: list[Path]) -> list[str]:
    """Names of the motion files; films of one name in different folders take their folder's name before it."""
    names = [path.name if path.is_dir() else path.stem for path in paths]
    names = [
        f"{path.resolve().parent.name}-{name}" if names.count(name) > 1 else name
        for path, name in zip(paths, names, strict=True)
    ]
    for name in names:
        if names.count(name) > 1:
            raise InputError(
                f"track: two films would be written to {name}.nc; rename one, or track them into two folders"
            )
    return names


def _finished(source: Path, target: Path, setup: Setup) -> float | None:
    """The share seen that a finished motion file says, None where there is none that fits."""
    if not (source.exists() and target.is_file() and target.stat().st_mtime >= source.stat().st_mtime):
        return None
    try:
        motion = tree_of(target)
        if motion.attrs.get("setup") != setup.to_toml():
            return None
        return float((motion["lost"] == "").mean())
    except (InputError, KeyError):
        return None  # damaged: track it again
