"""Orbits of systems of masses, of smooth laws and of varying drives: Taylor steps between certified events."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stickslip import _core
from stickslip.errors import InputError
from stickslip.files.documents import number, numbers
from stickslip.model.system import Oscillator, System, system_from_dict
from stickslip.simulation.orbit import EVENTS, Orbit, Work

if TYPE_CHECKING:
    import pandas as pd


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
        None if x0 is None else numbers("x0", x0, masses, "simulate", "mass"),
        None if v0 is None else numbers("v0", v0, masses, "simulate", "mass"),
        number("t_end", t_end, "simulate"),
        max_events,
    )
    try:
        return NetworkOrbit(system, _core.Orbit.simulate(system.core, run, max_seconds))
    except ValueError as error:
        raise InputError(f"simulate: {error}") from None


class NetworkOrbit(Orbit):
    """The motion of a system from event to event; of an oscillator, the same face as any orbit's.

    Shapes: for a system of n masses and c contacts, x and v are (..., n), slip velocity and force (..., c).
    """

    def __init__(self, system: Oscillator | System, core: _core.Orbit) -> None:
        # No super().__init__: it wants the core of an orbit in closed form.
        self.system = system
        self._network = core
        self._stop, self.stop, self.stop_sentence = core.stop
        self.work = Work(*core.work)
        self.t_end = core.t_last

    @property
    def _kept(self) -> _core.Orbit:
        return self._network

    def _rows(self) -> NDArray[np.float64]:
        return self._network.segments().reshape(-1, 2 + 2 * self._masses + 4 * self._contacts)

    def _names(self) -> list[str]:
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

        return pd.DataFrame(self._rows(), columns=self._names())

    def _columns(self, times: NDArray[np.float64]) -> dict[str, NDArray[Any]]:
        columns = super()._columns(times)
        if isinstance(self.system, Oscillator):
            return columns
        widths = [self._masses] * 3 + [self._contacts] * 3
        return {
            name: column.reshape(times.size, width)
            for (name, column), width in zip(columns.items(), widths, strict=True)
        }

    def save(self, path: str | Path) -> Path:
        """Write a netCDF file: the sampled motion at the root, the groups ``events`` and ``segments`` (the Taylor steps).

        :func:`stickslip.load` gives back the same orbit to the bit.
        """
        columns = {"events": EVENTS, "segments": self._names()}
        return self._write(path, {"run": json.dumps(self._run())}, self._tables(), columns)

    def _run(self) -> list[Any]:
        return [*self._network.run, self._stop]

    def _tables(self) -> dict[str, NDArray[np.float64]]:
        return {"events": self._network.events().reshape(-1, len(EVENTS)), "segments": self._rows()}


def restore(
    document: dict[str, Any], run: Sequence[Any], work: tuple[int, int, int, int], rows: Sequence[NDArray[np.float64]]
) -> NetworkOrbit:
    """The orbit that :meth:`NetworkOrbit.save` wrote, from its parts."""
    *start, stop = run
    system = system_from_dict(document)
    return NetworkOrbit(system, _core.Orbit.restore(system.core, tuple(start), stop, work, *rows))
