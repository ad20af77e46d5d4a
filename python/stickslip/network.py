"""Orbits of systems of masses, of smooth laws and of varying drives: Taylor steps between certified events."""

from __future__ import annotations

import json
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stickslip import _core
from stickslip.documents import number, write_whole
from stickslip.errors import InputError
from stickslip.orbit import Orbit, Work
from stickslip.regimes import regime_of
from stickslip.system import Oscillator, System, system_from_dict

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

_EVENTS = ("t", "kind", "contact", "x", "v", "force", "stick_time", "force_rate")


def simulate_network(
    system: Oscillator | System,
    t_end: float,
    x0: ArrayLike | None,
    v0: ArrayLike | None,
    max_events: int,
    max_seconds: float | None,
) -> NetworkOrbit:
    """What :func:`stickslip.simulate` does where the motion has no closed form."""
    masses = system.masses if isinstance(system, System) else 1
    run = (
        _start("x0", x0, masses),
        _start("v0", v0, masses),
        number("t_end", t_end, "simulate"),
        max_events,
    )
    try:
        return NetworkOrbit(system, _core.Network.simulate(_document(system), run, max_seconds))
    except ValueError as error:
        raise InputError(f"simulate: {error}") from None


def _document(system: Oscillator | System) -> str:
    return (system if isinstance(system, System) else system.to_system()).to_json()


def _start(name: str, value: ArrayLike | None, masses: int) -> list[float] | None:
    if value is None:
        return None
    try:
        values = np.asarray(value, float)
    except (TypeError, ValueError):
        raise InputError(f"simulate: {name} must be numbers, got {value!r}") from None
    if values.shape not in [(masses,), *([()] if masses == 1 else [])]:
        raise InputError(f"simulate: {name} must have the shape ({masses},), one number a mass, got {values.shape}")
    return [number(name, item, "simulate") for item in values.ravel().tolist()]


class NetworkOrbit(Orbit):
    """The motion of a system from event to event; of an oscillator, the same face as any orbit's.

    Shapes: for a system of n masses and c contacts, x and v are (..., n), slip velocity and force (..., c).
    """

    def __init__(self, system: Oscillator | System, core: _core.Network) -> None:
        # No super().__init__: it wants the core of an orbit in closed form.
        self.system: Any = system
        self._network = core
        self._stop, self.stop, self.stop_sentence = core.stop
        self.work = Work(*core.work)
        self.t_end = core.t_last
        self._masses = system.masses if isinstance(system, System) else 1
        self._contacts = len(system.contacts) if isinstance(system, System) else 1

    @cached_property
    def events(self) -> pd.DataFrame:
        """The table of events: t, kind, contact, x, v (of the contact's mass), force, stick_time, force_rate."""
        import pandas as pd

        rows = self._network.events().reshape(-1, 8)
        frame = pd.DataFrame(rows, columns=list(_EVENTS))
        kinds = pd.Categorical.from_codes(rows[:, 1].astype(np.int64), categories=pd.Index(_core.KINDS))
        return frame.assign(kind=kinds, contact=rows[:, 2].astype(int))

    def _rows(self) -> NDArray[np.float64]:
        return self._network.segments().reshape(-1, 2 + 2 * self._masses + 4 * self._contacts)

    def _columns(self) -> list[str]:
        masses = [""] if isinstance(self.system, Oscillator) else [f"_{i}" for i in range(self._masses)]
        contacts = [""] if isinstance(self.system, Oscillator) else [f"_{i}" for i in range(self._contacts)]
        rub = ("direction", "offset", "slope", "branch")
        return [
            "t",
            "t_low",
            *(f"{name}{i}" for name in "xv" for i in masses),
            *(f"{name}{c}" for c in contacts for name in rub),
        ]

    @cached_property
    def segments(self) -> pd.DataFrame:
        """The Taylor steps: start time and state, direction of slip (0 while stuck) and line of friction of each contact."""
        import pandas as pd

        return pd.DataFrame(self._rows(), columns=self._columns())

    def _all(self, t: ArrayLike) -> dict[str, NDArray[Any]]:
        times = np.asarray(t, float)
        if times.size and not (times.min() >= 0 and times.max() <= self.t_end * (1 + 1e-12)):
            raise InputError(
                f"orbit: t must lie in [0, {self.t_end:g}], got [{times.min():g}, {times.max():g}]: simulate longer"
            )
        columns = self._network.states(np.ascontiguousarray(times.ravel()))
        one = isinstance(self.system, Oscillator)
        sizes = (self._masses,) * 3 + (self._contacts,) * 3
        names = ("x", "v", "a", "slip_velocity", "force", "stuck")
        return {
            name: column.reshape(times.shape if one else (*times.shape, size))
            for name, column, size in zip(names, columns, sizes, strict=True)
        }

    def _states(self, t: ArrayLike) -> tuple[Any, ...]:
        values = self._all(t)
        columns = [values[name] for name in ("x", "v", "a", "force", "stuck")]
        return tuple(column if column.ndim else column.item() for column in columns)

    def to_xarray(self, t: ArrayLike | None = None) -> xr.Dataset:
        """The motion sampled at times `t` (default :meth:`times`).

        Returns
        -------
        Dataset with the dimension ``time``, for a system also ``mass`` and ``contact``: x, v, a; slip_velocity, force
        (friction on the mass) and stuck.
        """
        import xarray as xr

        times = self.times() if t is None else np.asarray(t, float)
        values = self._all(times)
        dims: dict[str, tuple[str, ...]] = {
            name: ("time", "mass") if name in "xva" else ("time", "contact") for name in values
        }
        if isinstance(self.system, Oscillator):
            dims = dict.fromkeys(values, ("time",))
        return xr.Dataset(
            {name: (dims[name], column) for name, column in values.items()},
            coords={"time": times},
            attrs={"title": "stickslip orbit", "system": json.dumps(self.system.to_dict())},
        )

    def regime(self, transient: float = 0.5, contact: int = 0) -> str:
        """The kind of motion at a contact after a transient; see :meth:`stickslip.Orbit.regime`."""
        if not 0 <= transient < 1:
            raise InputError(f"regime: transient must lie in [0, 1), got {transient}")
        if not 0 <= contact < self._contacts:
            raise InputError(f"regime: contact must lie from 0 to {self._contacts - 1}, got {contact}")
        start = transient * self.t_end
        times = self.times()
        late = self._all(times[times >= start])
        pick = Ellipsis if isinstance(self.system, Oscillator) else (Ellipsis, contact)
        stuck, w = late["stuck"][pick], late["slip_velocity"][pick]
        events = self.events[(self.events["t"] >= start) & (self.events["contact"] == contact)]
        sticks = bool((events["kind"] == "release").any() or stuck.any())
        return regime_of(float(stuck.mean()), sticks, float(w.min()), float(w.max()))

    def save(self, path: str | Path) -> Path:
        """Write a netCDF file: the sampled motion at the root, the groups ``events`` and ``segments`` (the Taylor steps).

        :func:`stickslip.load` gives back the same orbit to the bit.
        """
        import xarray as xr

        attrs = {
            "stickslip": "orbit",
            "engine": "network",
            "run": json.dumps([*self._network.run, self._stop]),
            "work": [self.work.events, self.work.evaluations],
            "stop": self.stop,
        }
        root = self.to_xarray().assign_attrs(attrs)
        rows, columns = self._network.events().reshape(-1, 8), self._columns()
        events = xr.Dataset({name: ("event", rows[:, i]) for i, name in enumerate(_EVENTS)})
        events["kind"].attrs["meaning"] = ", ".join(f"{i} {kind}" for i, kind in enumerate(_core.KINDS))
        steps = self._rows()
        segments = xr.Dataset({name: ("segment", steps[:, i]) for i, name in enumerate(columns)})

        def write(draft: Path) -> None:
            tree = xr.DataTree.from_dict({"/": root, "/events": events, "/segments": segments})
            tree.to_netcdf(draft, engine="h5netcdf")

        return write_whole(path, write)


def restore(tree: xr.DataTree) -> NetworkOrbit:
    """The orbit of an open file that :meth:`NetworkOrbit.save` wrote."""
    x0, v0, t_end, max_events, stop = json.loads(tree.attrs["run"])
    system = system_from_dict(json.loads(tree.attrs["system"]))
    events, evaluations = (int(value) for value in tree.attrs["work"])
    tables = [
        np.stack([column.to_numpy().astype(float) for column in tree[name].to_dataset().data_vars.values()], axis=-1)
        for name in ("segments", "events")
    ]
    core = _core.Network.restore(
        _document(system),
        (x0, v0, t_end, max_events),
        stop,
        (events, evaluations),
        *(np.ascontiguousarray(table.ravel()) for table in tables),
    )
    return NetworkOrbit(system, core)
