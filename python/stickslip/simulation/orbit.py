"""What a simulation returns: a motion exact at any time, its events, why it stopped and what it cost; saved as netCDF."""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping, Sequence
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stickslip import _core
from stickslip.errors import InputError, fraction
from stickslip.files.equality import alike
from stickslip.files.netcdf import read_tree, write_netcdf
from stickslip.files.notebook import InNotebook
from stickslip.model.parameters import contact_of
from stickslip.model.system import Oscillator, System, system_from_dict
from stickslip.simulation.regime_names import regime_of_stop

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

#: The columns of a sampled motion, and of the events in a file.
COLUMNS = ("x", "v", "a", "slip_velocity", "force", "stuck")
EVENTS = ("t", "kind", "contact", "x", "v", "force", "stick_time", "force_rate")

#: Where among these the kind, the contact and the numbers stand, as pandas wants to know it.
_KIND, _CONTACT = (np.array([EVENTS.index(name)]) for name in ("kind", "contact"))
_NUMBERS = np.array([EVENTS.index(name) for name in EVENTS if name not in {"kind", "contact"}])


@cache
def _kinds() -> pd.CategoricalDtype:
    """The kinds of events as a table has them."""
    import pandas as pd

    return pd.CategoricalDtype(pd.Index(_core.KINDS))


@cache
def _event_columns() -> pd.Index:
    """The names of the columns of a table of events."""
    import pandas as pd

    return pd.Index(EVENTS)


class Work(NamedTuple):
    """What a run cost: events that occurred and evaluations of the closed-form motion to find them.

    grazes are touches of the end of a mode within rounding that turned back: no events. fallbacks are steps that looked like
    the last one to an event but left more than rounding there: the search went on.
    """

    events: int
    evaluations: int
    grazes: int = 0
    fallbacks: int = 0


class Orbit(InNotebook):
    """The motion of an oscillator or of a system of masses from event to event.

    Shapes: of an oscillator x, v, slip velocity and force have the shape of the times asked for; of a system of n masses and
    c contacts x and v are (..., n), slip velocity and force (..., c).

    Attributes
    ----------
    system : the oscillator or system.
    stop : ``"t_end"``, ``"max_events"``, ``"max_seconds"``, ``"accumulation"``, ``"diverged"``, ``"stiff"``,
        ``"not_a_number"`` or ``"memory"``; `stop_sentence` says what it means.
    work : events, evaluations, grazes and fallbacks.
    t_end : the time up to which the orbit is known.
    """

    def __init__(self, system: Oscillator | System, core: _core.Orbit) -> None:
        self.system: Any = system
        self._core = core
        self._stop, self.stop, self.stop_sentence = core.stop
        self.work = Work(*core.work)
        self.t_end = core.t_last

    def _steady(self, look: str, period: float, surface: str, contact: int) -> Any:
        """What an observer of the core sees as steady in it, as a table of one row."""
        del contact  # The look names it.
        return self._core.steady(look, period, surface)

    def _points(self, surface: str, kind: str | None, contact: int, after: float, most: int) -> NDArray[np.float64]:
        """The points of a section, rows t, x, v, w, force, stick_time, force_rate; of events of a `kind` or of a surface."""
        del kind
        return self._core.section(surface, contact, after, most)[0]

    @property
    def _contacts(self) -> int:
        return len(self.system.contacts)

    def __repr__(self) -> str:
        return f"<Orbit of {self.work.events} events to t = {self.t_end:g}, stop: {self.stop}>"

    def facts(self) -> dict[str, Any]:
        """What a notebook shows."""
        kinds = self.events["kind"].value_counts(sort=False)
        counts = ", ".join(f"{count} {kind}" for kind, count in kinds.items() if count) or "none"
        return {"regime": self.regime(), "t_end": self.t_end, "stop": self.stop_sentence, "events": counts}

    @cached_property
    def events(self) -> pd.DataFrame:
        """The table of events: t, kind, contact, x, v, force, stick_time, force_rate.

        kind is release, capture, crossing (w changes sign without a stick), reversal (ẇ changes sign; for laws that have
        branches by that sign) or node (the next linear piece). force is the friction on the mass just before the event;
        stick_time and force_rate belong to a release and are missing elsewhere.
        """
        import pandas as pd

        table = self._core.events().reshape(-1, len(EVENTS)).T
        kinds = pd.Categorical.from_codes(table[1].astype(np.int8), dtype=_kinds(), validate=False)
        contacts, numbers = table[2:3].astype(int), table.take(_NUMBERS, 0)
        # Since pandas 3.0 a frame can be made of ready columns at a tenth of the cost.
        create = getattr(getattr(pd.api, "internals", None), "create_dataframe_from_blocks", None)
        if create is not None:
            blocks = [(kinds, _KIND), (contacts, _CONTACT), (numbers, _NUMBERS)]
            rows = pd.RangeIndex.from_range(range(table.shape[1]))
            # A view, so that a name that is given to it stays with this table.
            frame: pd.DataFrame = create(blocks, rows, _event_columns().view())
            return frame
        columns = dict(zip(EVENTS, table, strict=True)) | {"kind": kinds, "contact": contacts[0]}
        return pd.DataFrame(columns)

    @cached_property
    def segments(self) -> pd.DataFrame:
        """The modes, or the Taylor steps where the motion has no closed form.

        Start time (t + t_low) and state, and of each contact the direction of slip (0 while stuck) and the line of friction.
        """
        import pandas as pd

        frame = pd.DataFrame(self._tables()["segments"], columns=self._names())
        for name in (name for name in self._names() if name.startswith("branch")):
            # A Taylor step that begins without slip acceleration is marked as −1 − branch.
            frame[name] = np.maximum(frame[name], -1.0 - frame[name])
        return frame.astype({name: int for name in self._names() if name.startswith(("direction", "branch"))})

    def _names(self) -> list[str]:
        """The columns of the segments; those of several masses and contacts carry their numbers."""
        many = isinstance(self.system, System)
        masses = [f"_{i}" for i in range(self.system.masses)] if many else [""]
        contacts = [f"_{i}" for i in range(self._contacts)] if many else [""]
        friction = ("direction", "offset", "slope", "branch")
        return [
            *("t", "t_low"),
            *(f"{name}{i}" for name in "xv" for i in masses),
            *(f"{name}{c}" for c in contacts for name in friction),
            *(f"spring_{i}" for i in range(len(self.system.springs))),
        ]

    def at(self, t: ArrayLike) -> tuple[Any, Any]:
        """Position and velocity at any time up to `t_end`, exact.

        Parameters
        ----------
        t : time, any shape.

        Returns
        -------
        x, v : arrays of that shape (numbers for a number).

        Raises
        ------
        InputError
            for a time outside the orbit.
        """
        values = self._all(t)
        x, v = (column if column.ndim else column.item() for column in (values["x"], values["v"]))
        return x, v

    def _all(self, t: ArrayLike) -> dict[str, NDArray[Any]]:
        """What :meth:`to_xarray` gives, by name."""
        times = np.asarray(t, float)
        # A grid may overshoot its end by rounding; the last mode goes on that far.
        if times.size and not (times.min() >= 0 and times.max() <= self.t_end * (1 + 1e-12)):
            raise InputError(
                f"orbit: t must lie in [0, {self.t_end:g}], got [{times.min():g}, {times.max():g}]: simulate longer"
            )
        columns = self._columns(np.ascontiguousarray(times.ravel()))
        return {name: column.reshape(times.shape + column.shape[1:]) for name, column in columns.items()}

    def _columns(self, times: NDArray[np.float64]) -> dict[str, NDArray[Any]]:
        columns = dict(zip(COLUMNS, self._core.states(times), strict=True))
        if not isinstance(self.system, System):
            return columns
        widths = {name: self.system.masses if name in ("x", "v", "a") else self._contacts for name in columns}
        return {name: column.reshape(times.size, widths[name]) for name, column in columns.items()}

    def times(self, per_period: int = 200, most: int = 200_000) -> NDArray[np.float64]:
        """A regular grid over the orbit, `per_period` points a natural period but no more than `most`."""
        count = int(min(most, max(2, per_period * self.t_end / self.system.natural_period)))
        return np.linspace(0.0, self.t_end, count)

    def to_xarray(self, t: ArrayLike | None = None) -> xr.Dataset:
        """The motion sampled at times `t` (default :meth:`times`).

        Returns
        -------
        Dataset with the dimension ``time``, for a system of masses also ``mass`` and ``contact``: x, v, a; slip_velocity,
        force (friction on the mass), stuck and, under laws that have one, the internal state. Where a law has two state
        variables, the state has the dimension ``state_variable`` too, with NaN for a contact that has one.
        """
        import xarray as xr

        times = self.times() if t is None else np.asarray(t, float)
        return xr.Dataset(
            {name: (self._dims(name), values) for name, values in self._all(times).items()},
            coords={"time": times},
            attrs={"title": "stickslip orbit", "system": json.dumps(self.system.to_dict())},
        )

    def _dims(self, name: str) -> tuple[str, ...]:
        """The dimensions of a column."""
        one = "mass" if name in ("x", "v", "a") else "contact"
        return ("time", one) if isinstance(self.system, System) else ("time",)

    def regime(self, transient: float = 0.5, contact: int = 0) -> str:
        """The kind of motion after a transient.

        Parameters
        ----------
        transient : the fraction of the orbit that is left out, in [0, 1).
        contact : of a system of masses, the contact.

        Returns
        -------
        ``"stick_slip"``: adhesion breaks again and again; ``"at_rest"``: stuck throughout; ``"stable_slip"``: slip velocity
        constant within 0.2 % of its size; ``"almost_harmonic"``: it oscillates and keeps its sign; ``"reversing_slip"``: it
        changes its sign without sticking; ``"diverged"`` and ``"unfinished"`` where the numbers left their range,
        or where a run that stopped before its time is shorter than a natural period. The words and their
        criteria stand in :data:`stickslip.simulation.regime_names.REGIMES`.

        Limits: a slow transient near a threshold needs a longer orbit; look at two lengths.
        """
        fraction("transient", transient, "regime")
        if not self._contacts:
            raise InputError("regime: the system has no contact, whose stick and slip a regime is")
        contact_of(self.system, contact, "regime")
        enough = not self.t_end < self.system.natural_period < np.inf
        if (stopped := regime_of_stop(self.stop, enough)) is not None:
            return stopped
        look = {"transient": transient, "window": 1 - transient, "tolerance": 1e-6, "points": 0, "contact": contact}
        # The motion is there already: no more events are needed, and no section is looked at.
        row = self._steady(json.dumps(look | {"max_events": 0}), self.t_end, json.dumps({"event": "release"}), contact)
        return _core.REGIMES[int(row["regime"][0])]

    def save(self, path: str | Path) -> Path:
        """Write a netCDF file: the sampled motion at the root, the groups ``events`` and ``segments``.

        The segments are exact: :func:`load` gives back the same orbit to the bit.
        """
        import xarray as xr

        tables, columns = self._tables(), {"events": EVENTS, "segments": self._names()}
        attrs = {"run": json.dumps(self._run()), "stickslip": "orbit", "work": list(self.work), "stop": self.stop}
        root = self.to_xarray().assign_attrs(attrs)
        root.attrs["checksum"] = _checksum(root.attrs, tables)
        groups = {
            name: xr.Dataset({column: (name[:-1], table[:, i]) for i, column in enumerate(columns[name])})
            for name, table in tables.items()
        }
        groups["events"]["kind"].attrs["meaning"] = ", ".join(f"{i} {kind}" for i, kind in enumerate(_core.KINDS))
        tree = xr.DataTree.from_dict({"/": root, **{f"/{name}": group for name, group in groups.items()}})
        return write_netcdf(path, tree)

    def _tables(self) -> dict[str, NDArray[np.float64]]:
        """All that an orbit is made from again, beside its system and its run."""
        return {
            "events": self._core.events().reshape(-1, len(EVENTS)),
            "segments": self._core.segments().reshape(-1, len(self._names())),
        }

    def __reduce__(self) -> tuple[Any, ...]:
        tables = self._tables()
        rows = [tables[name].ravel() for name in ("segments", "events")]
        return _restore, (self.system.to_dict(), self._run(), self.work, rows)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Orbit) or type(self) is not type(other):
            return NotImplemented
        return self.system == other.system and self._run() == other._run() and alike(self._tables(), other._tables())

    def __hash__(self) -> int:
        return hash((self.t_end, self.stop, self.work))

    def _run(self) -> list[Any]:
        """Start, end, bound of the events and stop."""
        return [*self._core.run, self._stop]


def _checksum(attrs: Mapping[Any, Any], tables: Mapping[str, NDArray[np.float64]]) -> int:
    """Of everything that :func:`load` makes an orbit from."""
    said = json.dumps([str(attrs[name]) for name in ("system", "run")] + [int(value) for value in attrs["work"]])
    check = zlib.crc32(said.encode())
    for name in ("events", "segments"):
        check = zlib.crc32(np.ascontiguousarray(tables[name], "<f8").tobytes(), check)
    return check


def load(path: str | Path) -> Orbit:
    """Read back an orbit saved by :meth:`Orbit.save`, the same to the bit.

    Raises
    ------
    InputError
        where the file is not there, holds no orbit, or not the one that was saved.
    """
    tree = read_tree(path, "orbit file")
    if tree.attrs.get("stickslip") != "orbit":
        measured = tree.attrs.get("command") == "stickslip measure"
        what = (
            "a measured friction; identify takes it, xarray.open_datatree opens it"
            if measured
            else "another netCDF file"
        )
        raise InputError(f"{path}: expected an orbit, as Orbit.save makes it, got {what}")
    try:
        tables = {name: _table(tree[name].to_dataset()) for name in ("events", "segments")}
        whole = int(tree.attrs["checksum"]) == _checksum(tree.attrs, tables)
    except (KeyError, TypeError, ValueError, OverflowError):
        whole = False
    if not whole:
        raise InputError(
            f"{path}: damaged, or saved by an older version: it is not the orbit that was saved; simulate again"
        )
    work = Work(*(int(value) for value in tree.attrs["work"]))
    rows = [np.ascontiguousarray(tables[name].ravel()) for name in ("segments", "events")]
    return _restore(json.loads(tree.attrs["system"]), json.loads(tree.attrs["run"]), work, rows)


def _restore(document: dict[str, Any], run: list[Any], work: Work, rows: Sequence[NDArray[np.float64]]) -> Orbit:
    """An orbit from its parts."""
    *start, stop = run
    system = system_from_dict(document)
    return Orbit(system, _core.Orbit.restore(system.core, tuple(start), stop, work, *rows))


def _table(group: xr.Dataset) -> NDArray[np.float64]:
    return np.stack([column.to_numpy().astype(float) for column in group.data_vars.values()], axis=-1)
