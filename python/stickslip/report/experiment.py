"""A whole experiment in one unattended run: each record to motion, friction and pictures, all to one law and one report."""

from __future__ import annotations

import glob
import hashlib
import json
import math
import time
from collections.abc import Callable, Generator, Mapping
from concurrent.futures import as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, suppress
from dataclasses import dataclass, field, replace
from fnmatch import fnmatch
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from stickslip.errors import InputError
from stickslip.files.checks import did_you_mean, number
from stickslip.files.disk import read_toml, write_whole
from stickslip.files.netcdf import write_netcdf
from stickslip.files.schema import Count, Document, FilePath, Says
from stickslip.files.worker_processes import worker_processes

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

Progress = Callable[[str, int, int], object]

FILMS = (".avi", ".mp4", ".mkv", ".mov", ".m4v", ".mpg", ".mpeg", ".wmv", ".webm", ".tif", ".tiff", ".trk", ".trz")
"""Endings of what is tracked before it is measured; folders of images are too."""


@dataclass(frozen=True)
class Experiment(Document):
    """Records or films of one rig, and what is to be made of them.

    Parameters
    ----------
    records : paths or patterns (``runs/*.csv``), from the folder of the document.
    rig : path of a rig file, or its table.
    track : path of a setup file, or its table, for films; needed for films only where the default finds nothing.
    each : keys of the rig that differ from record to record, by the file name of the record or a pattern of names, such as
        ``{"pull-8.csv": {"drive_velocity": "8 mm/s"}}``.
    output : folder of the results.
    law : name of the law that is identified from all records; ``"auto"``: what they tell; ``""``: none.
    workers : processes; default one a core.

    Examples
    --------
    >>> Experiment(("a.csv",), {"instrument": "displacement"}, law="Coulomb").law
    'Coulomb'
    """

    TITLE: ClassVar[str] = "experiment"

    records: Annotated[tuple[FilePath, ...], FilePath | tuple[FilePath, ...]]
    rig: Annotated[FilePath | Mapping[str, Any], Says("the path of a rig file or its table")]
    track: Annotated[FilePath | Mapping[str, Any], Says("the path of a setup file or its table")] | None = None
    each: Annotated[Mapping[str, Mapping[str, Any]], Says("tables of rig keys by the names of records")] = field(
        default_factory=dict
    )
    output: FilePath = "results"
    law: str = "auto"
    workers: Count | None = None
    folder: Path = field(default=Path(), compare=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.records, str):
            object.__setattr__(self, "records", (self.records,))
        for name, keys in self.each.items():
            if not isinstance(keys, Mapping):
                self.refuse(f"each must be tables of rig keys by the names of records, got {keys!r} for {name}")
        if not self.records:
            self.refuse('records must be a list of paths or patterns, ["runs/*.csv"], got none')

    @classmethod
    def of(cls, given: Experiment | Mapping[str, Any] | str | Path) -> Experiment:
        """An experiment from one, its table, or the path of its TOML file."""
        if isinstance(given, Experiment):
            return given
        if isinstance(given, Mapping):
            return cls.from_dict(given)
        return replace(cls.load(given), folder=Path(given).parent)

    @property
    def results(self) -> Path:
        """The folder of the results."""
        return self.folder / self.output

    def sources(self) -> dict[str, Path]:
        """The records that are there now by the name of their results; of equal names the folder's comes before."""
        found: list[Path] = []
        for pattern in self.records:
            there = sorted(glob.glob(str(self.folder / pattern)))  # noqa: PTH207 the pattern may be absolute
            if not there and not glob.has_magic(pattern):
                there = [str(self.folder / pattern)]  # it will be said that there is none
            found += [Path(path) for path in there if Path(path) not in found]
        stems = [path.stem for path in found]
        names = [path.stem if stems.count(path.stem) == 1 else f"{path.parent.name}-{path.name}" for path in found]
        if len(set(names)) < len(names):
            raise InputError("run: two records would have one folder of results; rename one of them")
        return dict(zip(names, found, strict=True))

    def rig_of(self, path: Path) -> Any:
        """The rig of one record: its table, or the path of its file where nothing differs for this record."""
        rig = self.said("rig")
        for pattern, keys in self.each.items():
            if _named(path, pattern):
                rig = {**(read_toml(rig, "rig file") if isinstance(rig, str) else rig), **keys}
        return rig

    def said(self, key: str) -> Any:
        """What `rig` or `track` says: its table, or the path of its file."""
        value = getattr(self, key)
        return value if value is None or isinstance(value, Mapping) else str(self.folder / value)


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
        if not any(_named(path, pattern) for path in sources.values()):
            raise InputError(f"run: each names {pattern!r}, and no record has such a name; correct each, or records")
    return _run(plan, sources, again, progress)


def _run(plan: Experiment, sources: Mapping[str, Path], again: bool, progress: Progress | None) -> pd.DataFrame:
    """The run of these records."""
    import pandas as pd

    for key in ("rig", "track"):
        if isinstance(path := plan.said(key), str):
            read_toml(path, f"{key} file")
    _check(plan, sources)
    try:
        plan.results.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"{plan.results}: the folder cannot be made ({error.strerror}); choose another output"
        ) from None
    rows = {}
    with closing(_rows(plan, sources, again)) as finished:
        for done, (name, row) in enumerate(finished, start=1):
            rows[name] = row
            if progress is not None:
                progress(f"{name} {row['state']}", done, len(sources))
    texts = {name: row.pop("texts", {}) for name, row in rows.items()}
    table = pd.DataFrame.from_dict({name: rows[name] for name in sources}, orient="index").rename_axis("record")
    table.attrs["units"] = _units(texts)
    if progress is not None and plan.law:
        progress("identifying the law", len(sources), len(sources))
    table.attrs["law"] = _together(plan, table, texts)
    return table


Texts = Mapping[str, Mapping[str, tuple[str, str]]]
"""Of each record by name: the facts, each value with its error as a text, and its unit."""


def _units(texts: Texts) -> dict[str, str]:
    """The unit of each fact that has one, the same in all records."""
    units: dict[str, set[str]] = {}
    for facts in texts.values():
        for name, (_, unit) in facts.items():
            units.setdefault(name, set()).add(unit)
    return {name: unit for name, (unit, *others) in units.items() if unit not in ("", "1") and not others}


def _head(name: str, units: Mapping[str, str]) -> str:
    """The head of a column, with its unit; an error has that of its value."""
    from stickslip.measurement.summary import values_of

    unit = next((units[one] for one in (name, *values_of(name)) if one in units), "")
    return f"{name} [{unit}]" if unit else name


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


def _named(path: Path, pattern: str) -> bool:
    """Whether a pattern names the record of this file, with its ending or without."""
    return fnmatch(path.name, pattern) or fnmatch(path.stem, pattern)


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
                pool.submit(_measured, path, plan.rig_of(path), plan.said("track"), plan.results / name, mark): name
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
                _measured, path, plan.rig_of(path), plan.said("track"), plan.results / name, mark
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


def _measured(path: Path, rig: Any, setup: Any, folder: Path, mark: str) -> dict[str, Any]:
    """Measure one record into its folder; its row. Runs in a process of its own, where nothing may stop the others."""
    try:
        return {"state": "measured", "message": "", **_make(path, rig, setup, folder, mark)}
    except InputError as error:
        return {"state": "failed", "message": str(error)}
    except Exception as error:  # noqa: BLE001 a fault of ours in one record must not cost the other fifty-nine
        return {"state": "failed", "message": f"{path}: {type(error).__name__}: {' '.join(str(error).split())}"}


def _make(path: Path, rig: Any, setup: Any, folder: Path, mark: str) -> dict[str, Any]:
    import xarray as xr

    from stickslip.measurement import Bench, facts, load_rig, measure, motion, notes
    from stickslip.measurement.masses import masses_of
    from stickslip.measurement.summary import texts_and_units

    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.iterdir():
        if old.name in RESULTS or old.name.startswith(("friction-", "motion-")):
            old.unlink()
    record: Any = path
    if path.is_dir() or path.suffix.lower() in FILMS:
        from stickslip.tracking import track

        record = track(path, setup, output=folder / "motion.nc")
    known_rig = load_rig(rig)
    friction = measure(record, known_rig)
    write_netcdf(folder / "friction.nc", friction)
    from stickslip import show  # what draws is loaded for what was measured: it takes as long as all else

    parts = {"": friction} if "notes" in friction.attrs else dict(friction.children)
    for name, part in parts.items():
        end = name.replace("mass_", "-")
        _draw(
            show.friction_record(xr.DataTree(part.to_dataset(), children=dict(part.children)))[0],
            folder / f"friction{end}.png",
        )
    if not isinstance(known_rig, Bench):
        moved = motion(record, known_rig)
        masses = {f"-{label}": one for label, one in (masses_of(moved) or {}).items()} or {"": moved}
        for end, one in masses.items():
            _draw(show.motion_figure(one)[0], folder / f"motion{end}.png")
    events = _events(parts)
    write_whole(folder / "break_away.csv", lambda draft: events.to_csv(draft, index=False))
    found = {**facts(friction), "notes": " ".join(notes(friction))}
    plain = {name: value if isinstance(value, str) or math.isfinite(value) else None for name, value in found.items()}
    done = {"mark": mark, "facts": plain, "texts": texts_and_units(friction)}
    write_whole(folder / "finished.json", lambda draft: draft.write_text(json.dumps(done)))
    return {**plain, "texts": done["texts"]}


def _draw(ax: Axes, path: Path) -> None:
    """Write the picture that holds these axes, and close it."""
    import matplotlib.pyplot as plt

    whole = ax.get_figure(root=True)
    assert whole is not None
    write_whole(path, lambda draft: whole.savefig(draft, format="png", dpi=110))
    plt.close(whole)


RESULTS = ("motion.nc", "friction.nc", "friction.png", "motion.png", "break_away.csv", "finished.json")
"""What lies in the folder of a record."""


def _events(parts: Mapping[str, Any]) -> pd.DataFrame:
    """The break-aways of all masses, with the units in the heads of the columns."""
    import pandas as pd

    tables = []
    for name, part in parts.items():
        if "break_away" in part.children:
            data = part["break_away"].to_dataset(inherit=False)
            units = {str(key): str(column.attrs.get("units", "")) for key, column in data.variables.items()}
            table = data.to_dataframe().rename(columns=lambda key, units=units: _head(key, units))
            tables.append(table.assign(mass=name.removeprefix("mass_")) if name else table)
    return pd.concat(tables) if tables else pd.DataFrame()


def _together(plan: Experiment, table: pd.DataFrame, texts: Texts) -> str:
    """What is made of all records: one table, one law, one report. Returns what is to be said of the law."""
    import pandas as pd

    from stickslip.identification import Identification, identify
    from stickslip.report.identification import page, page_of_table
    from stickslip.report.report import Report

    results, units = plan.results, table.attrs["units"]
    headed = table.rename(columns=lambda name: _head(name, units))
    write_whole(results / "records.csv", lambda draft: headed.to_csv(draft))
    good = [str(name) for name in table.index[table["state"] != "failed"]]
    events = []
    for name in good:
        try:
            events.append(pd.read_csv(results / name / "break_away.csv").assign(record=name))
        except pd.errors.EmptyDataError:
            continue
    together = pd.concat(events) if events else pd.DataFrame()
    write_whole(results / "break_away.csv", lambda draft: together.to_csv(draft, index=False))
    report, why = Report("Experiment"), ""
    law = None
    if plan.law and good:
        try:
            law = identify(
                [results / name / "friction.nc" for name in good], law=None if plan.law == "auto" else plan.law
            )
            law.save(results / "law.toml")
            report = page(law, simulate=False) if isinstance(law, Identification) else page_of_table(law)
        except InputError as error:
            why = str(error)
    if law is None:
        (results / "law.toml").unlink(missing_ok=True)
    report.heading("Records")
    report.text(
        f"{len(good)} of {len(table)} records were measured." + (f" No law was identified: {why}" if why else "")
    )
    shown = pd.DataFrame({name: {key: text for key, (text, _) in texts[name].items()} for name in good}).T
    shown = shown.rename(columns=lambda name: _head(name, units)).rename_axis("record")
    report.table(table[["state", "message"] if len(good) < len(table) else ["state"]].join(shown).fillna(""))
    report.items(
        [f"{name}: {note}" for name, note in table.get("notes", pd.Series(dtype=str)).dropna().items() if note]
    )
    if len(together):
        report.heading("Break-aways")
        report.table(together.set_index("record").drop(columns=["event"], errors="ignore").head(MOST_ROWS))
        if len(together) > MOST_ROWS:
            report.text(f"The first {MOST_ROWS} of {len(together)}; all are in break_away.csv.")
    report.write(results / "report.html")
    return law.report() if law is not None else f"No law was identified: {why}" if why else ""


MOST_ROWS = 500
"""Break-aways that the report shows."""
