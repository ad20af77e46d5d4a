"""What the integration of a law with an internal state returns: a motion between steps, with its pseudo-events."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stickslip import _core
from stickslip.errors import InputError, number, numbers
from stickslip.files.equality import alike
from stickslip.files.netcdf import write_netcdf
from stickslip.laws.state_law import StateLaw
from stickslip.model.system import Oscillator, System
from stickslip.simulation.orbit import Orbit, Work

if TYPE_CHECKING:
    import pandas as pd
    from scipy.integrate import OdeSolution

#: Slip slower than this fraction of the fastest is called stuck, as these laws creep where others stick.
CREEP = 1e-2

_SENTENCES = {
    "t_end": "the run reached t_end",
    "max_events": "the run stopped at max_events: raise max_events to go on",
    "max_seconds": "the run stopped after max_seconds: raise max_seconds to go on",
    "max_evaluations": "the run stopped after max_evaluations of the right-hand side: stickslip.integrate takes more of "
    "them, or a looser tolerance",
    "solver": "the integrator could not go on, as the motion runs away or changes faster than it can follow: look at the "
    "last states, or give it another method or tolerance",
}


@dataclass(frozen=True)
class Mark:
    """Where the slip velocity of a contact (``"crossing"``) or the velocity of its mass (``"turn"``) changes its sign."""

    kind: str
    contact: int
    times: NDArray[np.float64]


@dataclass(frozen=True)
class StateLayout:
    """How the states of a system are shown: with a last axis where a law has two state variables.

    Attributes
    ----------
    sizes : how many numbers the state of each contact is.
    alone : whether it is an oscillator, which has no axis of contacts.

    >>> from stickslip.laws import RateState
    >>> law = RateState(1.0, 0.01, 0.01, 1.0, 1.0, second_b=0.005, second_length=0.1)
    >>> StateLayout.of(Oscillator(damping=0.0, drive_velocity=1.0, law=law)).shape
    (2,)
    """

    sizes: tuple[int, ...]
    alone: bool

    @classmethod
    def of(cls, system: Oscillator | System) -> StateLayout:
        """That of an oscillator or a system."""
        return cls(tuple(law.states for law in state_laws_of(system)), isinstance(system, Oscillator))

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the states at one time."""
        most = max(self.sizes)
        return (() if self.alone else (len(self.sizes),)) + ((most,) if most > 1 else ())

    @property
    def _used(self) -> NDArray[np.bool_]:
        return np.arange(max(self.sizes)) < np.array(self.sizes)[:, None]

    def spread(self, row: NDArray[np.float64]) -> NDArray[np.float64]:
        """States as they are shown, (..., *shape), from all their numbers (..., n); NaN where a contact has none."""
        times = row.shape[:-1]
        shown = np.full((*times, *self._used.shape), np.nan)
        shown[..., self._used] = row
        return shown.reshape(times + self.shape)

    def gather(self, state: ArrayLike, where: str) -> list[float]:
        """All their numbers from the states at one time, as :meth:`spread` shows them.

        Raises
        ------
        InputError
            for another shape, and for a number that is not finite.
        """
        if max(self.sizes) == 1:
            return numbers("state", state, len(self.sizes), where, "contact")
        values = np.asarray(state, float)
        if values.shape != self.shape:
            raise InputError(
                f"{where}: state must have the shape {self.shape}, the state variables last, got {values.shape}"
            )
        used = values.reshape(self._used.shape)[self._used]
        return [number("state", value, where) for value in used.tolist()]


class StateOrbit(Orbit):
    """The motion of an oscillator or a system of masses whose friction laws have an internal state.

    Attributes
    ----------
    system : the oscillator or system.
    stop : ``"t_end"``, ``"max_events"``, ``"max_seconds"``, ``"max_evaluations"`` or ``"solver"``; `stop_sentence` says what
        it means.
    work : events and evaluations of the right-hand side.
    t_end : the time up to which the orbit is known.

    It answers as :class:`stickslip.Orbit` does, but is only as exact as the tolerance of its integration.
    """

    def __init__(
        self,
        system: Oscillator | System,
        core: _core.StateSystem,
        solution: OdeSolution,
        marks: Sequence[Mark],
        t_end: float,
        stop: str,
        work: Work,
        start: NDArray[np.float64],
        v0: ArrayLike | None,
    ) -> None:
        # No super().__init__: it wants the core of an orbit in closed form.
        self.system = system
        self._right_hand_side = core
        self._solution = solution
        self._marks = marks
        self._layout = StateLayout.of(system)
        self._start = start
        self._v0 = v0
        self.t_end = t_end
        self.stop = stop
        self.stop_sentence = _SENTENCES[stop]
        self.work = work

    def __repr__(self) -> str:
        return f"<StateOrbit of {self.work.evaluations} evaluations to t = {self.t_end:g}, stop: {self.stop}>"

    @cached_property
    def events(self) -> pd.DataFrame:
        """The table of pseudo-events: t, kind, contact, x, v (of the contact's mass), force, stick_time, force_rate, state.

        kind is crossing (the slip velocity changes its sign) or turn (the velocity of the contact's mass does). Nothing
        happens there to a smooth motion: they mark it, and stick_time and force_rate are missing throughout. Where a law has
        two state variables the second is in second_state.
        """
        import pandas as pd

        times = np.concatenate([mark.times for mark in self._marks])
        sizes = [mark.times.size for mark in self._marks]
        contacts = np.repeat([mark.contact for mark in self._marks], sizes)
        kinds = np.repeat([mark.kind for mark in self._marks], sizes)
        order = np.argsort(times, kind="stable")
        times, contacts, kinds = times[order], contacts[order], kinds[order]
        columns = self._all(times)
        state = columns.pop("state", np.zeros((times.size, self._contacts)))
        state = state.reshape(times.size, self._contacts, max(self._layout.sizes))
        values = {name: column[:, None] if column.ndim == 1 else column for name, column in columns.items()}
        rows, masses = np.arange(times.size), np.array(masses_of(self.system))[contacts]
        names = ("state", "second_state")[: state.shape[2]]
        return pd.DataFrame(
            {
                "t": times,
                "kind": pd.Categorical(kinds, categories=["crossing", "turn"]),
                "contact": contacts,
                "x": values["x"][rows, masses],
                "v": values["v"][rows, masses],
                "force": values["force"][rows, contacts],
                "stick_time": np.full(times.size, np.nan),
                "force_rate": np.full(times.size, np.nan),
            }
            | {name: state[rows, contacts, i] for i, name in enumerate(names)}
        )

    @property
    def segments(self) -> pd.DataFrame:
        """Refused: a smooth motion has no segments."""
        raise InputError("segments: the motion under a law with an internal state is smooth; sample it with to_xarray")

    def state(self, t: ArrayLike) -> Any:
        """The laws' internal states at any time up to `t_end`, for a system of masses shape (..., contacts).

        Where a law has two state variables they are the last axis, with NaN for a contact that has one.
        """
        z = self._all(t).get("state")
        if z is None:
            raise InputError("state: no law of this system has an internal state")
        return z if z.ndim else z.item()

    def variables(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """What is integrated, at times: positions, velocities or slip velocities, internal states; shape (times, w)."""
        rows = np.ascontiguousarray(self._solution(times).T)
        natural = np.asarray(self._right_hand_side.natural(rows.ravel())).reshape(rows.shape)
        # a slip velocity that is integrated as a logarithm would differ from the start by rounding
        natural[np.asarray(times) == 0] = self._start
        return natural

    def maxima(self) -> NDArray[np.float64]:
        """The times at which the position of the first contact's mass is greatest."""
        times = next(mark.times for mark in self._marks if mark.kind == "turn" and mark.contact == 0)
        if not times.size:
            return times
        a = self._columns(times)["a"].reshape(times.size, -1)[:, masses_of(self.system)[0]]
        return times[a < 0]

    def _columns(self, times: NDArray[np.float64]) -> dict[str, NDArray[Any]]:
        n, c = self.system.masses, self._contacts
        y = self.variables(times) if times.size else np.empty((0, 2 * n + sum(self._layout.sizes)))
        v, a, w, force, _ = self._right_hand_side.states(times, y.ravel())
        v = v.reshape(-1, n)
        if self._v0 is not None:
            v[times == 0] = self._v0
        columns: dict[str, NDArray[Any]] = {
            "x": y[:, :n], "v": v, "a": a.reshape(-1, n),
            "slip_velocity": (w := w.reshape(-1, c)), "force": force.reshape(-1, c),
            "stuck": np.abs(w) <= CREEP * np.abs(w).max(axis=0, initial=0.0),
        }  # fmt: skip
        if isinstance(self.system, Oscillator):
            columns = {name: column[:, 0] for name, column in columns.items()}
        if any(law.has_state for law in state_laws_of(self.system)):
            columns["state"] = self._layout.spread(y[:, 2 * n :])
        return columns

    def _dims(self, name: str) -> tuple[str, ...]:
        two = name == "state" and max(self._layout.sizes) > 1
        return (*super()._dims(name), *(["state_variable"] if two else []))

    def _looked_at(self, after: float) -> NDArray[np.float64]:
        """All steps of the integrator, and between two of them as many times as 200 a natural period, but no more than 16.

        However long the motion rests, it is looked at no more often than it was integrated. A run that ended before is not
        looked at.
        """
        after = min(after, self.t_end)
        steps = np.asarray(self._solution.ts)
        steps = np.concatenate([[after], steps[(steps > after) & (steps < self.t_end)], [self.t_end]])
        parts = np.clip(np.ceil(np.diff(steps) * (200 / self.system.natural_period)), 1, 16)
        return np.unique(np.interp(np.arange(parts.sum() + 1), np.append(0.0, np.cumsum(parts)), steps))

    @cached_property
    def _pace(self) -> float:
        """The greatest speed of a mass in the whole run, or 1e-4 of that of a swing so far, if that is more."""
        t = np.asarray(self._solution.ts)
        y = self.variables(t)
        fastest = np.abs(self._right_hand_side.states(t, y.ravel())[0]).max()
        far = np.abs(y[:, : self.system.masses]).max()
        return float(max(fastest, 1e-4 * far * 2 * np.pi / self.system.natural_period))

    def _samples(self, after: float, contact: int) -> _core.Samples:
        """The motion of a contact's mass for the observers of the core.

        At rest: slip never faster than 1e-6 of the fastest mass, or of the pace of the whole run where no drive moves
        and masses at rest leave nothing to compare with; sticking: `stuck` for more than 1 % of the time.
        """
        t = self._looked_at(after)
        values = {name: column.reshape(t.size, -1) for name, column in self._columns(t).items()}
        y = self.variables(t)
        slip = self._right_hand_side.states(t, y.ravel())[4].reshape(t.size, -1)[:, contact]
        w, stuck = values["slip_velocity"][:, contact], values["stuck"][:, contact]
        stands = all(one.drive_velocity == 0 for one in self.system.contacts)
        fastest = max(np.abs(values["v"]).max(), self._pace if stands else 0.0)
        if np.abs(w).max() <= 1e-6 * fastest:
            stuck = np.full(t.size, True)
        elif not np.diff(t) @ stuck[1:] > 0.01 * (t[-1] - t[0]):
            stuck = np.full(t.size, False)
        mass = masses_of(self.system)[contact]
        columns = [t, *(values[name][:, mass] for name in "xva"), w, slip]
        return _core.Samples(columns, stuck, self.work.events)

    def _steady(self, look: str, period: float, surface: str, contact: int) -> Any:
        asked = json.loads(look)
        # The samples are those of this contact alone.
        alone = json.dumps(asked | {"contact": 0})
        return self._samples(asked["transient"] * period, contact).steady(alone, period, surface)

    def _points(self, surface: str, kind: str | None, contact: int, after: float, most: int) -> NDArray[np.float64]:
        if kind is None:
            return self._samples(after, contact).section(surface, contact, after, most)[0]
        table = self.events
        rows = table[(table["kind"] == kind) & (table["t"] >= after) & (table["contact"] == contact)].assign(w=np.nan)
        return rows[["t", "x", "v", "w", "force", "stick_time", "force_rate"]].to_numpy(float)[-most:]

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (self.system, *self._contents(), self.work, self._start, self._v0)

    def _contents(self) -> tuple[Any, ...]:
        return self._solution, self._marks, self.t_end, self.stop

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, StateOrbit):
            return NotImplemented
        return self.system == other.system and _same(self._contents(), other._contents())

    def __hash__(self) -> int:
        return hash((self.t_end, self.stop, self.work))

    def save(self, path: str | Path) -> Path:
        """Write a netCDF file with the sampled motion and the group ``events``; the steps of the integrator are not kept."""
        import xarray as xr

        attrs = {"stickslip": "sampled orbit", "stop": self.stop, "work": [self.work.events, self.work.evaluations]}
        events = self.events.astype({"kind": str})
        table = xr.Dataset({name: ("event", events[name].to_numpy()) for name in events})
        tree = xr.DataTree.from_dict({"/": self.to_xarray().assign_attrs(attrs), "/events": table})
        return write_netcdf(path, tree)


def state_laws_of(system: Oscillator | System) -> list[StateLaw]:
    """The laws of the contacts, all with an internal state.

    Raises
    ------
    InputError
        where one has none.
    """
    laws = [contact.law for contact in system.contacts]
    for law in laws:
        if not isinstance(law, StateLaw):
            raise InputError(f"integrate: {type(law).__name__} has no internal state; use stickslip.simulate")
    return [law for law in laws if isinstance(law, StateLaw)]


def masses_of(system: Oscillator | System) -> list[int]:
    """The mass of every contact."""
    return [contact.mass for contact in system.contacts]


def _restored(system: Oscillator | System, *rest: Any) -> StateOrbit:
    return StateOrbit(system, _core.StateSystem(system.to_system().to_json()), *rest)


def _same(ours: tuple[Any, ...], theirs: tuple[Any, ...]) -> bool:
    """Whether two runs took the same steps to the same states, and saw the same signs change."""
    (solution, marks, *rest), (other, other_marks, *other_rest) = ours, theirs
    return (
        rest == other_rest
        and np.array_equal(solution.ts, other.ts)
        and np.array_equal(solution(solution.ts), other(other.ts), equal_nan=True)
        and alike(list(marks), list(other_marks))
    )
