"""The unattended run of an experiment: its records in parallel, each failure one line, and what was finished is kept.

What is done with one record is `measured_record` in `record_results.py`; here is when, in which process, and what is kept.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Generator, Mapping
from concurrent.futures import as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip.errors import InputError, did_you_mean, number
from stickslip.experiment.experiment import Experiment, is_named
from stickslip.experiment.joint_results import common_units, write_joint_results
from stickslip.experiment.record_results import measured_record
from stickslip.files.disk import make_folder, read_toml
from stickslip.files.worker_processes import worker_processes

if TYPE_CHECKING:
    import pandas as pd

Progress = Callable[[str, int, int], object]


def run(
    experiment: Experiment | Mapping[str, Any] | str | Path,
    *,
    again: bool = False,
    progress: Progress | None = None,
) -> pd.DataFrame:
    """Measure every record of an experiment, in parallel, and identify one law from all.

    Into the folder of results go, for each record, ``motion.nc`` (of a film), ``friction.nc``, ``break_away.csv``,
    ``friction.png``, and for a spring ``motion.png`` (motion, phase plane, spectra); for all together ``records.csv`` (the
    table returned), ``break_away.csv``, ``law.toml`` and ``report.html``. A record whose results are there, made from the
    same file with the same rig and setup, is not measured again; one that fails is a row with its sentence, and the others
    go on.

    Parameters
    ----------
    experiment : an :class:`Experiment`, its table, or the path of its TOML file.
    again : measure also what is finished.
    progress : called with (name and state of a record, records done, records in all).

    Returns
    -------
    DataFrame over the names of the records: source, state (``"measured"``, ``"finished before"``, ``"failed"``), message, and
    what a summary of the record prints. Its ``attrs["units"]`` are the units of its columns, by name, and ``attrs["law"]`` is
    the report of the identified law, or why there is none.

    Raises
    ------
    InputError
        for a wrong document, a law that there is not, a wrong setup, a rig that is wrong for every record (before any is
        measured), where no record is found, or the folder cannot be made.

    Examples
    --------
    >>> table = run("experiment.toml")  # doctest: +SKIP
    """
    plan = Experiment.of(experiment)
    sources = plan.sources()
    if not sources:
        raise InputError(
            f"run: no record matches {', '.join(plan.records)} in {plan.folder.resolve()}; correct records"
        )
    for pattern in plan.each:
        if not any(is_named(path, pattern) for path in sources.values()):
            raise InputError(f"run: each names {pattern!r}, and no record has such a name; correct each, or records")
    return _run(plan, sources, again, progress)


def _run(plan: Experiment, sources: Mapping[str, Path], again: bool, progress: Progress | None) -> pd.DataFrame:
    """The run of these records."""
    import pandas as pd

    for key in ("rig", "track"):
        if isinstance(path := plan.said(key), str):
            read_toml(path, f"{key} file")
    _check(plan, sources)
    make_folder(plan.results, "output")
    rows = {}
    with closing(_rows(plan, sources, again)) as finished:
        for done, (name, row) in enumerate(finished, start=1):
            rows[name] = row
            if progress is not None:
                progress(f"{name} {row['state']}", done, len(sources))
    texts = {name: row.pop("texts", {}) for name, row in rows.items()}
    table = pd.DataFrame.from_dict({name: rows[name] for name in sources}, orient="index").rename_axis("record")
    table.attrs["units"] = common_units(texts)
    if progress is not None and plan.law:
        progress("identifying the law", len(sources), len(sources))
    table.attrs["law"] = write_joint_results(plan, table, texts)
    return table


def _check(plan: Experiment, sources: Mapping[str, Path]) -> None:
    """Refuse what would fail at the end of every record, or after all of them."""
    from stickslip.laws import Law
    from stickslip.measurement import load_rig
    from stickslip.tracking.setup import Setup

    if plan.law not in ("", "auto", *Law.ALL):
        raise InputError(
            f"run: unknown law {plan.law!r}{did_you_mean(plan.law, Law.ALL)}; known are auto, {', '.join(Law.ALL)}"
        )
    if plan.track is not None:
        Setup.of(plan.said("track"))
    wrong = None
    for path in sources.values():
        try:
            load_rig(plan.rig_of(path))
        except InputError as error:
            wrong = wrong or error
        else:
            return
    if wrong is not None:
        raise wrong


def watch(
    experiment: Experiment | Mapping[str, Any] | str | Path,
    *,
    every: float = 5.0,
    stop: Callable[[], bool] = lambda: False,
    on_table: Callable[[pd.DataFrame], object] | None = None,
) -> None:
    """Run an experiment whenever a record comes or changes, until `stop` says so.

    A record counts once its size has stayed the same from one look to the next; those that still grow do not keep the others
    waiting, and names in `each` may be of records that are yet to come.

    Parameters
    ----------
    every : seconds between two looks.
    stop : asked after each look.
    on_table : called with the table of each run.
    """
    number("every", every, "watch")
    plan = Experiment.of(experiment)
    before: dict[Path, str] = {}
    measured: dict[Path, str] = {}
    while True:
        sources, now = plan.sources(), {}
        for path in sources.values():
            with suppress(FileNotFoundError):  # it may be removed at any moment
                now[path] = _state_of(path)
        settled = {path: state for path, state in now.items() if before.get(path) == state}
        if settled and settled != measured:
            table = _run(plan, {name: path for name, path in sources.items() if path in settled}, False, None)
            if on_table is not None:
                on_table(table)
            measured = settled
        before = now
        if stop():
            return
        time.sleep(every)


def _state_of(path: Path) -> str:
    """What changes when a record does: sizes and times of its files."""
    files = sorted(file for file in path.iterdir() if file.is_file()) if path.is_dir() else [path]
    return json.dumps([(file.name, file.stat().st_size, file.stat().st_mtime_ns) for file in files])


def _mark(plan: Experiment, path: Path) -> str:
    """What the results of a record hang on."""
    described = (plan.rig_of(path), plan.said("track"))
    parts = [_state_of(path), *(Path(one).read_text() if isinstance(one, str) else repr(one) for one in described)]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def _rows(
    plan: Experiment, sources: Mapping[str, Path], again: bool
) -> Generator[tuple[str, dict[str, Any]], None, None]:
    """Each record with its row, in the order in which they are finished."""
    waiting = {}
    for name, path in sources.items():
        row = {"source": str(path), "state": "failed", "message": f"{path}: no such file; correct records"}
        if not path.exists():
            yield name, row
            continue
        finished = plan.results / name / "finished.json"
        mark = _mark(plan, path)
        if not again and (known := _known(finished, mark)) is not None:
            yield name, {"source": str(path), "state": "finished before", "message": "", **known}
        else:
            waiting[name] = (path, mark)
    while waiting:
        with worker_processes(plan.workers) as pool:
            jobs = {
                pool.submit(
                    measured_record, path, plan.rig_of(path), plan.said("track"), plan.results / name, mark
                ): name
                for name, (path, mark) in waiting.items()
            }
            broken = []
            for job in as_completed(jobs):
                name = jobs[job]
                try:
                    row = job.result()
                except BrokenProcessPool:  # one has ended its process, and with it those of the others
                    broken.append(name)
                    continue
                yield name, {"source": str(waiting.pop(name)[0]), **row}
        if broken:  # each by itself from now on: the first is done alone next
            name = broken[0]
            path, mark = waiting.pop(name)
            yield name, {"source": str(path), **_alone(plan, path, name, mark)}


def _alone(plan: Experiment, path: Path, name: str, mark: str) -> dict[str, Any]:
    """The row of a record measured in a process of its own."""
    with worker_processes(1) as pool:
        try:
            return pool.submit(
                measured_record, path, plan.rig_of(path), plan.said("track"), plan.results / name, mark
            ).result()
        except BrokenProcessPool:
            return {"state": "failed", "message": f"{path}: the process that measured it ended; is the memory full?"}


def _known(finished: Path, mark: str) -> dict[str, Any] | None:
    """The facts of a record that was finished with this mark."""
    try:
        known = json.loads(finished.read_text())
    except (OSError, ValueError):
        return None
    if not isinstance(known, dict) or known.get("mark") != mark or "texts" not in known:
        return None
    return {**known["facts"], "texts": known["texts"]}
