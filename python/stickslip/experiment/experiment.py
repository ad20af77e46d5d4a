"""The document of an experiment: records or films of one rig, and what is to be made of them."""

from __future__ import annotations

import glob
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fnmatch import fnmatch
from pathlib import Path
from typing import Annotated, Any, ClassVar

from stickslip.errors import InputError
from stickslip.files.disk import read_toml
from stickslip.files.schema import Count, Document, FilePath, Says


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
            if is_named(path, pattern):
                rig = {**(read_toml(rig, "rig file") if isinstance(rig, str) else rig), **keys}
        return rig

    def said(self, key: str) -> Any:
        """What `rig` or `track` says: its table, or the path of its file."""
        value = getattr(self, key)
        return value if value is None or isinstance(value, Mapping) else str(self.folder / value)


def is_named(path: Path, pattern: str) -> bool:
    """Whether a pattern names the record of this file, with its ending or without."""
    return fnmatch(path.name, pattern) or fnmatch(path.stem, pattern)
