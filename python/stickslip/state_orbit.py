"""What the integration of a law with an internal state returns: a motion between steps, with its pseudo-events."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stickslip import _core
from stickslip.documents import write_whole
from stickslip.errors import InputError
from stickslip.orbit import Orbit, Work
from stickslip.regimes import regime_of
from stickslip.state_laws import StateLaw
from stickslip.system import Oscillator

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

#: Slip slower than this fraction of the fastest is called stuck, as these laws creep where others stick.
CREEP = 1e-2

_SENTENCES = {
    "t_end": "the run reached t_end",
    "max_events": "the run stopped at max_events: raise max_events to go on",
    "max_seconds": "the run stopped after max_seconds: raise max_seconds to go on",
    "solver": "the integrator could not go on, as the motion runs away or changes faster than it can follow: look at the "
    "last states, or give it another method or tolerance",
}


class StateOrbit(Orbit):
    """The motion of an oscillator whose friction law has an internal state.

    Attributes
    ----------
    system : the oscillator.
    stop : ``"t_end"``, ``"max_events"``, ``"max_seconds"`` or ``"solver"``; `stop_sentence` says what it means.
    work : events and evaluations of the right-hand side.
    t_end : the time up to which the orbit is known.

    It answers as :class:`stickslip.Orbit` does, but is only as exact as the tolerance of its integration.
    """

    def __init__(
        self,
        system: Oscillator,
        solution: Callable[[Any], NDArray[np.float64]],
        event_times: tuple[NDArray[np.float64], ...],
        t_end: float,
        stop: str,
        work: Work,
    ) -> None:
        # No super().__init__: it wants the core of an orbit in closed form.
        self.system = system
        self._solution = solution
        self._event_times = event_times
        self.t_end = t_end
        self.stop = stop
        self.stop_sentence = _SENTENCES[stop]
        self.work = work

    def __repr__(self) -> str:
        return f"<StateOrbit of {self.work.evaluations} evaluations to t = {self.t_end:g}, stop: {self.stop}>"

    @cached_property
    def events(self) -> pd.DataFrame:
        """The table of pseudo-events: t, kind, contact, x, v, force, stick_time, force_rate, state.

        kind is crossing (the slip velocity changes its sign) or turn (the velocity does). Nothing happens there to a
        smooth motion: they mark it, and stick_time and force_rate are missing throughout.
        """
        import pandas as pd

        times = np.concatenate(self._event_times)
        kinds = np.repeat(["crossing", "turn"], [len(part) for part in self._event_times])
        order = np.argsort(times, kind="stable")
        x, w, z = self._states(times[order])
        _, force = self._accelerations(times[order], x, w, z)
        return pd.DataFrame(
            {
                "t": times[order],
                "kind": pd.Categorical(kinds[order], categories=["crossing", "turn"]),
                "contact": np.zeros(len(times), dtype=int),
                "x": x,
                "v": self.system.drive_velocity - w,
                "force": force,
                "stick_time": np.full(len(times), np.nan),
                "force_rate": np.full(len(times), np.nan),
                "state": z,
            }
        )

    @property
    def segments(self) -> pd.DataFrame:
        """Refused: a smooth motion has no segments."""
        raise InputError(
            f"segments: the motion under {type(self.system.law).__name__} is smooth; sample it with to_xarray"
        )

    def at(self, t: ArrayLike) -> tuple[Any, Any]:
        """Position and velocity at any time up to `t_end`.

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
        x, w, _ = self._states(t)
        v = self.system.drive_velocity - w
        return (x, v) if np.ndim(t) else (x.item(), v.item())

    def state(self, t: ArrayLike) -> Any:
        """The law's internal state at any time up to `t_end`."""
        z = self._states(t)[2]
        return z if np.ndim(t) else z.item()

    def _states(self, t: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        times = np.asarray(t, float)
        if times.size and not (times.min() >= 0 and times.max() <= self.t_end * (1 + 1e-12)):
            raise InputError(
                f"orbit: t must lie in [0, {self.t_end:g}], got [{times.min():g}, {times.max():g}]: simulate longer"
            )
        if times.size == 0:
            return np.empty(times.shape), np.empty(times.shape), np.empty(times.shape)
        columns = self._solution(times.ravel())
        state = columns[2] if len(columns) > 2 else np.zeros(times.size)
        return columns[0].reshape(times.shape), columns[1].reshape(times.shape), state.reshape(times.shape)

    def _accelerations(
        self, t: NDArray[np.float64], x: NDArray[np.float64], w: NDArray[np.float64], z: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        core = _core.StateOscillator(self.system.to_json())
        a, force = core.states(*(np.ascontiguousarray(column.ravel()) for column in (t, x, w, z)))
        return a.reshape(x.shape), force.reshape(x.shape)

    def to_xarray(self, t: ArrayLike | None = None) -> xr.Dataset:
        """The motion sampled at times `t` (default :meth:`times`).

        Returns
        -------
        Dataset with the dimension ``time`` and x, v, a, slip_velocity, force (friction on the mass), stuck (slip slower
        than 1 % of the fastest in these samples) and state.
        """
        import xarray as xr

        times = self.times() if t is None else np.asarray(t, float)
        x, w, z = self._states(times)
        a, force = self._accelerations(times, x, w, z)
        v, stuck = self.system.drive_velocity - w, _creeps(w)
        columns = {"x": x, "v": v, "a": a, "slip_velocity": w, "force": force, "stuck": stuck}
        if isinstance(self.system.law, StateLaw) and self.system.law.has_state:
            columns["state"] = z
        return xr.Dataset(
            {name: ("time", values) for name, values in columns.items()},
            coords={"time": times},
            attrs={"title": "stickslip orbit", "system": json.dumps(self.system.to_dict())},
        )

    def regime(self, transient: float = 0.5) -> str:
        """The kind of motion after a transient, in the words of :meth:`stickslip.Orbit.regime`.

        ``"at_rest"``: no slip faster than 1e-6 of the drive velocity; ``"stable_slip"``: slip velocity constant within
        0.1 %; ``"stick_slip"``: slip slower than 1 % of the fastest for 1 % of the time; ``"almost_harmonic"``: the slip
        velocity keeps its sign; else ``"back_and_forth"``.
        """
        if not 0 <= transient < 1:
            raise InputError(f"regime: transient must lie in [0, 1), got {transient}")
        times = self.times()
        w = self._states(times[times >= transient * self.t_end])[1]
        rests = np.abs(w).max() <= 1e-6 * abs(self.system.drive_velocity)
        creeps = bool(_creeps(w).mean() > 0.01)
        return regime_of(float(rests), creeps, float(w.min()), float(w.max()))

    def save(self, path: str | Path) -> Path:
        """Write a netCDF file with the sampled motion and the group ``events``; the steps of the integrator are not kept."""
        import xarray as xr

        attrs = {"stickslip": "sampled orbit", "stop": self.stop, "work": [self.work.events, self.work.evaluations]}
        events = self.events.astype({"kind": str})
        table = xr.Dataset({name: ("event", events[name].to_numpy()) for name in events})
        tree = xr.DataTree.from_dict({"/": self.to_xarray().assign_attrs(attrs), "/events": table})
        return write_whole(path, lambda draft: tree.to_netcdf(draft, engine="h5netcdf"))


def _creeps(w: NDArray[np.float64]) -> NDArray[np.bool_]:
    slow: NDArray[np.bool_] = np.abs(w) <= CREEP * np.abs(w).max(initial=0.0)
    return slow
