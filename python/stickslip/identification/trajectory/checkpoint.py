"""A search that was killed goes on: the best law so far, in a law file whose name says that it is unfinished."""

from __future__ import annotations

import hashlib
import json
import math
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tomli_w

from stickslip.files.arrays import Array
from stickslip.files.disk import write_text

if TYPE_CHECKING:
    from stickslip.identification.result import Identification
    from stickslip.identification.trajectory.search import Shooting

Best = tuple[float, Array]


class Checkpoint:
    """The file in which a search keeps its best law and how far it has come.

    Parameters
    ----------
    path : the file; None keeps nothing.
    first, about : what the search is about, its options as plain data: a file from another search is not gone on from.
    """

    def __init__(self, path: str | Path | None, first: Identification, about: Sequence[Any]) -> None:
        self.path = None if path is None else Path(path)
        whole = [first.law.to_dict(), *about]
        whole += [[record.name, record.time.size, float(np.sum(record.force))] for record in first.records]
        self.fingerprint = hashlib.sha256(json.dumps(whole).encode()).hexdigest()[:16]

    def read(self, best: Best) -> tuple[int, Best]:
        """Number of starts that are done, and the best of them; (0, `best`) where there is nothing to go on from."""
        if self.path is None or not self.path.is_file():
            return 0, best
        try:
            search = tomllib.loads(self.path.read_text(encoding="utf-8"))["source"]["search"]
            if search["fingerprint"] != self.fingerprint:
                return 0, best
            return int(search["starts"]), (float(search["misfit"]), np.array(search["unknowns"], float))
        except (KeyError, TypeError, ValueError):
            # Half a file, or one of another kind: begin anew.
            return 0, best

    def write(self, shooting: Shooting, starts: int) -> None:
        """Keep the best so far, once there is one."""
        misfit, unknowns = shooting.best
        if self.path is None or not math.isfinite(misfit):
            return
        search = {
            "fingerprint": self.fingerprint,
            "starts": starts,
            "misfit": misfit,
            "unknowns": [float(number) for number in unknowns],
        }
        notes = ["Unfinished: the best law so far of a search that did not come to its end; it has no intervals yet."]
        law = shooting.free.law(unknowns[: len(shooting.free.names)]).to_dict()
        text = tomli_w.dumps({"law": law, "source": {"notes": notes, "search": search}})
        write_text(self.path, text)

    def remove(self) -> None:
        """The search is at its end."""
        if self.path is not None:
            self.path.unlink(missing_ok=True)
