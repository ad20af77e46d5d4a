"""Rows of a sweep: one run each, of which only what is steady is kept; computed in the core where the motion is closed."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stickslip import _core
from stickslip.dynamics.sections import Surface, forcing_frequency, points_of, usual_surface
from stickslip.dynamics.steady import steady_motion
from stickslip.errors import InputError
from stickslip.model.parameters import varied
from stickslip.model.system import Oscillator, System
from stickslip.simulation.orbit import Orbit
from stickslip.simulation.regimes import CHAOTIC, REGULAR
from stickslip.simulation.simulate import simulate

Array = NDArray[Any]

#: What a row says, with its unit where it has one and its type.
MEANINGS = {
    "regime": "kind of motion, see stickslip.simulation.regimes",
    "period": "returns to the section after which the motion repeats; 0 where it does not, 1 for a motion that rests",
    "recurrence": "rests, periodic, quasi_periodic, chaotic or undecided, see stickslip.simulation.regimes",
    "chaos": "growth rate K of the 0-1 test where the motion does not repeat: near 1 for chaos, near 0 on a torus",
    "loops": "maxima of x until the motion repeats",
    "period_time": "time until the motion repeats",
    "amplitude": "half of max x - min x",
    "x_min": "least position",
    "x_max": "greatest position",
    "w_min": "least slip velocity",
    "w_max": "greatest slip velocity",
    "x_mean": "mean position in the section over one period",
    "v_mean": "mean velocity in the section over one period",
    "stuck_share": "share of the time in which the mass sticks",
    "events": "events of the whole run",
    "stop": "why the run ended",
}
COUNTS = ("period", "loops", "events")
WORDS = ("regime", "recurrence", "stop")
NUMBERS = tuple(name for name in MEANINGS if name not in (*COUNTS, *WORDS))

#: Position and velocity, or a row of the column ``restart``.
Start = tuple[Any, Any] | Array | None


@dataclass(frozen=True)
class Look:
    """What is looked at in a run: `transient` periods are left out, `window` periods after them are looked at.

    A period is that of the first forcing, or the natural period. A motion repeats where its states in the section do, to
    the part `tolerance` of its extent. `points` turning points and points of the section are kept, the last ones. A motion
    that does not repeat is followed for `decide` more periods, to tell whether it is chaotic.
    """

    transient: float
    window: float
    tolerance: float
    surface: Surface | None = None
    points: int = 0
    decide: int = 0
    max_events: int = 10_000_000

    def to_json(self) -> str:
        """The document for the core."""
        return json.dumps(asdict(self) | {"surface": self.surface and self.surface.to_dict()})


@dataclass(frozen=True)
class Chunk:
    """Some rows: what one task computes, on a thread of this machine or on a worker elsewhere.

    `values` has a row for each run and a column for each path. Each starts from `start` (default stuck at x = 0; a velocity
    that is not a number means stuck); in a `chain` only the first, the others where the one before ended, and `backwards`
    the last row is the first. Of an oscillator of linear pieces the column ``restart`` says how its motion goes on: x, w, the
    mode and what the contact remembers.
    """

    document: str
    paths: tuple[str, ...]
    values: Array
    look: Look
    contact: int = 0
    chain: bool = False
    backwards: bool = False
    start: Start = None

    def compute(self) -> dict[str, Array]:
        """The columns named in `MEANINGS`, the ends, turning points and section points, a row for each run."""
        values = self.values[::-1] if self.backwards else self.values
        document = json.loads(self.document)
        system, _ = varied(document, (), ())
        closed = isinstance(system, Oscillator) and system.closed_form
        columns = self._in_the_core(values) if closed else self._one_by_one(document, values)
        columns["recurrence"] = recurrence(columns["regime"], columns["period"], columns["chaos"])
        return {name: column[::-1] for name, column in columns.items()} if self.backwards else columns

    def _one_by_one(self, document: dict[str, Any], table: Array) -> dict[str, Array]:
        rows = []
        start = self.start
        for values in table.tolist():
            row = self._row(document, values, start)
            rows.append(row)
            if self.chain:
                start = (row["x_end"], row["v_end"]) if row["stop"] == "t_end" else None
        return {name: np.array([row[name] for row in rows]) for name in rows[0]}

    def _in_the_core(self, values: Array) -> dict[str, Array]:
        start = None
        if self.start is not None:
            start = [float(item) for item in self.start]
        try:
            numbers, turning_x, turning_w, section, restart = _core.sweep(
                self.document,
                list(self.paths),
                # A copy: what Dask hands over need not be aligned.
                np.array(values, float).ravel(),
                self.look.to_json(),
                self.chain,
                start,
            )
        except ValueError as error:
            raise InputError(str(error)) from None
        count, points = len(self.values), self.look.points
        columns = dict(zip(_core.SWEEP_COLUMNS, numbers.reshape(count, -1).T.copy(), strict=True))
        columns["amplitude"] = (columns["x_max"] - columns["x_min"]) / 2
        columns["v_end"][columns.pop("stuck_end") == 1] = np.nan
        section = section.reshape(count, points, 3)
        return {
            **columns,
            **{name: columns[name].astype(np.int64) for name in COUNTS},
            "regime": np.array(_core.REGIMES)[columns["regime"].astype(int)],
            "stop": np.array(_core.STOPS)[columns["stop"].astype(int)],
            "turning_x": turning_x.reshape(count, points),
            "turning_slip_velocity": turning_w.reshape(count, points),
            **{f"section_{name}": section[:, :, i] for i, name in enumerate("txv")},
            "restart": restart.reshape(count, -1),
        }

    def _row(self, document: dict[str, Any], values: Sequence[float], start: Start) -> dict[str, Any]:
        """One run of a system without a closed form, from its whole orbit."""
        look = self.look
        system, starts = varied(document, self.paths, values)
        if start is not None:
            x, v = start
            starts = {"x0": x, "v0": None if np.isnan(v).any() else v} | starts
        span = period_of(system)
        orbit = simulate(system, (look.transient + look.window) * span, max_events=look.max_events, **starts)
        if orbit.stop != "t_end":
            return _unknown(orbit, look.points)
        surface, after, chaos = look.surface or usual_surface(system), look.transient * span, np.nan
        motion, section, period = self._look_at(orbit, surface, after)
        if not period and look.decide:
            # A slow motion may still settle, and the 0-1 test wants a long series; as in the core.
            compared = len(section)
            orbit, after = simulate(system, look.decide * span, *orbit.at(orbit.t_end), look.max_events), 0.0
            motion, section, period = self._look_at(orbit, surface, after, compared)
            chaos = np.nan if period else _core.chaos(np.ascontiguousarray(section[:, 1]))
        x, v = orbit.at(orbit.t_end)
        rests = motion["regime"] in ("stable_slip", "at_rest")
        lasts, loops = np.nan, 0
        if period and not rests:
            lasts = section[-1, 0] - section[-1 - period, 0]
            maxima = points_of(orbit, Surface(normal=(0.0, 1.0, 0.0), direction=-1), after, self.contact)[:, 0]
            loops = int(((maxima > section[-1, 0] - lasts) & (maxima <= section[-1, 0])).sum())
        cycle = section[-period:] if period else section
        here = (np.ravel(x)[0], np.ravel(v)[0])
        mean = here if rests or not len(cycle) else cycle[:, 1:3].mean(axis=0)
        return {
            **{
                name: motion[name]
                for name in ("regime", "amplitude", "x_min", "x_max", "w_min", "w_max", "stuck_share")
            },
            "period": period,
            "chaos": chaos,
            "loops": loops,
            "period_time": lasts,
            "x_mean": mean[0],
            "v_mean": mean[1],
            "events": orbit.work.events,
            "stop": orbit.stop,
            "x_end": x,
            "v_end": v,
            **{name: _last(motion[name], look.points) for name in ("turning_x", "turning_slip_velocity")},
            **{f"section_{name}": _last(section[:, i], look.points) for i, name in enumerate("txv")},
        }

    def _look_at(
        self, orbit: Orbit, surface: Surface, after: float, compared: int = 256
    ) -> tuple[dict[str, Any], Array, int]:
        """What is steady in an orbit after a time, its section there, and after how many returns it repeats."""
        motion = steady_motion(orbit, 1 - after / orbit.t_end, contact=self.contact)
        section = points_of(orbit, surface, after, self.contact)
        if motion["regime"] in ("stable_slip", "at_rest"):
            return motion, section, 1
        extent = (2 * motion["amplitude"], motion["w_max"] - motion["w_min"])
        return motion, section, _repeats(section[-compared:], extent, self.look.tolerance)


def start_of(system: Oscillator | System, x0: ArrayLike | None, v0: ArrayLike | None, where: str) -> Start:
    """The start of all runs, in the shape of the state; none where nothing is asked for.

    >>> from stickslip import paper
    >>> start_of(paper.oscillator(0.3), 0.5, None, "example")
    (array(0.5), array(nan))
    """
    if x0 is None and v0 is None:
        return None
    shape = (system.masses,) if isinstance(system, System) else ()
    state = []
    for name, value, default in (("x0", x0, 0.0), ("v0", v0, np.nan)):
        try:
            numbers = np.full(shape, default) if value is None else np.asarray(value, float)
        except (TypeError, ValueError):
            raise InputError(f"{where}: {name} must be numbers, got {value!r}") from None
        if numbers.shape != shape or (value is not None and not np.isfinite(numbers).all()):
            wanted = f"finite, of shape {shape}" if shape else "a finite number"
            raise InputError(f"{where}: {name} must be {wanted}, got {value!r}")
        state.append(numbers)
    return state[0], state[1]


def periods_to_decide(value: int, where: str) -> int:
    """The length of the series for the 0–1 test: none, or from 500 to 10,000, as its work grows by the square.

    >>> periods_to_decide(500, "example")
    500
    """
    if isinstance(value, bool) or not isinstance(value, int) or not (value == 0 or 500 <= value <= 10_000):
        raise InputError(f"{where}: decide must be 0 or a whole number from 500 to 10000, got {value!r}")
    return value


def period_of(system: Oscillator | System) -> float:
    """The period of the first forcing, of a force or a drive, or the natural period of a system without one.

    >>> from stickslip import Harmonic, paper
    >>> round(period_of(paper.oscillator(0.3, Harmonic(0.1, 2.0))), 6)
    3.141593
    """
    frequency = forcing_frequency(system)
    return system.natural_period if frequency is None else 2 * np.pi / frequency


def recurrence(regime: Array, period: Array, chaos: Array) -> Array:
    """How motions come back, in a word; the criteria stand in :data:`stickslip.simulation.regimes.RECURRENCE`.

    >>> recurrence(np.array(["stick_slip"] * 3), np.array([2, 0, 0]), np.array([np.nan, 0.95, 0.01])).tolist()
    ['periodic', 'chaotic', 'quasi_periodic']
    """
    rests = np.isin(regime, ("at_rest", "stable_slip"))
    with np.errstate(invalid="ignore"):
        cases = [rests, period > 0, chaos >= CHAOTIC, chaos <= REGULAR]
    return np.select(cases, ["rests", "periodic", "chaotic", "quasi_periodic"], "undecided")


def _repeats(section: Array, extent: tuple[float, float], tolerance: float) -> int:
    """The fewest returns after which all repeat, as in the core."""
    recent = section[-256:]
    for period in range(1, len(recent) // 2 + 1):
        if len(recent) < period + 2:
            break
        change = np.abs(recent[period:, 1:3] - recent[:-period, 1:3])
        times = recent[period:, 0] - recent[:-period, 0]
        if (change <= tolerance * np.array(extent)).all() and (
            np.abs(times - times[-1]) <= tolerance * times[-1]
        ).all():
            return period
    return 0


def _last(values: Array, count: int) -> Array:
    kept = values[len(values) - min(count, len(values)) :]
    return np.pad(kept, (0, count - len(kept)), constant_values=np.nan)


def _unknown(orbit: Orbit, points: int) -> dict[str, Any]:
    """The row of a run that did not reach its end."""
    masses = orbit.system.masses if isinstance(orbit.system, System) else None
    end = np.full(masses, np.nan) if masses else np.nan
    missing = np.full(points, np.nan)
    regime = "diverged" if orbit.stop == "diverged" else "unfinished"
    lists = ("turning_x", "turning_slip_velocity", "section_t", "section_x", "section_v")
    return {
        **dict.fromkeys(NUMBERS, np.nan),
        **dict.fromkeys(COUNTS, 0),
        "regime": regime,
        "stop": orbit.stop,
        "events": orbit.work.events,
        "x_end": end,
        "v_end": end,
        **dict.fromkeys(lists, missing),
    }
