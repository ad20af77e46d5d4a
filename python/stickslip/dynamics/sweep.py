"""Rows of a sweep: one run each, of which only what is steady is kept; computed in the core."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from stickslip import _core
from stickslip.dynamics.surface import Surface, forcing_frequency, surface_from, usual_surface
from stickslip.errors import InputError, number
from stickslip.files.arrays import AnyArray
from stickslip.model.parameters import contact_of, initial_state, varied
from stickslip.model.system import Oscillator, System, system_from_dict
from stickslip.simulation.integration import integrate
from stickslip.simulation.regime_names import PARTS
from stickslip.simulation.simulate import simulate
from stickslip.simulation.state_orbit import StateLayout
from stickslip.simulation.time_limit import NO_LIMIT, TimeLimit

#: What a row says, with its unit where it has one and its type.
MEANINGS = {
    "regime": "kind of motion, see stickslip.simulation.regime_names",
    "period": "returns to the section after which the motion repeats; 0 where it does not, 1 for a motion that rests",
    "recurrence": "rests, periodic, chaotic, not_repeating (in the periods looked at) or undecided",
    "chaos": "growth rate K of the 0-1 test where the motion does not repeat: near 1 for strong chaos, near 0 else",
    "parting": "factor by which the distance of two starts beside each other grows where the motion does not repeat",
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
#: How far beside each other two starts are, relative to the position.
_BESIDE = 1e-9
#: A motion still changes where its points come nearer to repeating with each of so many parts of a run, or in the last half
#: to this share of the first: on a torus all parts are alike.
_PARTS_OF_RUN, _NEARER = 8, 0.8
COUNTS = ("period", "loops", "events")
WORDS = ("regime", "recurrence", "stop")
NUMBERS = tuple(name for name in MEANINGS if name not in (*COUNTS, *WORDS))

#: Positions, velocities and a row of the column ``restart`` (empty for none).
Start = tuple[Any, Any, Any] | None


@dataclass(frozen=True)
class Look:
    """What is looked at in a run: `transient` periods are left out, `window` periods after them are looked at.

    A period is that of the first forcing, or the natural period. A motion repeats where its states in the section do, to
    the part `tolerance` of its extent. `points` turning points and points of the section are kept, the last ones, of the mass
    of one `contact`. A motion that does not repeat is followed for `decide` more periods, to tell whether it is chaotic.
    """

    transient: float
    window: float
    tolerance: float
    surface: Surface | None = None
    points: int = 0
    decide: int = 0
    max_events: int = 10_000_000
    contact: int = 0

    @classmethod
    def asked(cls, where: str, system: Oscillator | System, section: str | Surface | None, **numbers: Any) -> Self:
        """What a caller asks for, by the names of `Look`, checked.

        Raises
        ------
        InputError
            named after `where`, for a tolerance, a contact, `decide` or a section that makes no sense.
        """
        surface = section if isinstance(section, Surface | None) else surface_from(system, section, where=where)
        checked = {
            "tolerance": number("tolerance", numbers["tolerance"], where),
            "decide": periods_to_decide(numbers["decide"], where),
            "contact": contact_of(system, numbers["contact"], where),
        }
        return cls(surface=surface, **(numbers | checked))

    def to_json(self) -> str:
        """The document for the core."""
        return json.dumps(asdict(self) | {"surface": self.surface and self.surface.to_dict()})


@dataclass(frozen=True)
class Chunk:
    """Some rows: what one task computes, on a thread of this machine or on a worker elsewhere.

    `values` has a row for each run and a column for each path. Each starts from `start` (default stuck at x = 0; a velocity
    that is not a number is that of the drive); in a `chain` only the first, the others where the one before ended, and
    `backwards` the last row is the first. `before` has the values, the regime's number and max x − min x of the row where it
    starts, if that is one: the core follows a motion that changes suddenly in smaller steps. Where the motion has a closed
    form the column ``restart`` says how it goes on: x, w, the mode and what the contact remembers; under laws with a
    state it has that of each contact; else it is not a number.
    """

    document: str
    paths: tuple[str, ...]
    values: AnyArray
    look: Look
    chain: bool = False
    backwards: bool = False
    start: Start = None
    before: tuple[list[float], int, float] | None = None
    limit: TimeLimit = NO_LIMIT

    def compute(self) -> dict[str, AnyArray]:
        """The columns named in `MEANINGS`, the ends, turning points and section points, a row for each run."""
        values = self.values[::-1] if self.backwards else self.values
        document = json.loads(self.document)
        system = system_from_dict(document)
        if system.integrated:
            columns = self._integrated(document, values)
        else:
            start = None
            if self.start is not None:
                x, v, restart = (np.ravel(item).tolist() for item in self.start)
                start = (x, v, restart)
            try:
                table = _core.sweep(
                    self.document,
                    list(self.paths),
                    # A copy: what Dask hands over need not be aligned.
                    np.array(values, float).ravel(),
                    self.look.to_json(),
                    self.chain,
                    start,
                    self.before,
                    self.limit.left,
                )
            except ValueError as error:
                raise InputError(str(error)) from None
            columns = columns_of(table)
        self._tell(document, values, columns)
        if isinstance(system, Oscillator):
            columns |= {name: columns[name][:, 0] for name in ("x_end", "v_end")}
        return {name: column[::-1] for name, column in columns.items()} if self.backwards else columns

    def _tell(self, document: dict[str, Any], values: AnyArray, columns: dict[str, AnyArray]) -> None:
        """How the motions come back; where one does not repeat, from two runs that begin beside each other where it ended."""
        look = self.look
        whole = float(look.transient + look.window).is_integer()
        doubtful = (columns["stop"] == "t_end") & (columns["period"] == 0) & bool(look.decide and whole)
        changes = np.zeros(len(doubtful), bool)
        for row in np.flatnonzero(doubtful):
            system, _ = varied(document, self.paths, values[row].tolist())
            x, v = (columns[name][row] for name in ("x_end", "v_end"))
            columns["parting"][row], changes[row] = parting(system, x, v, look, self.limit.left)
        words = recurrence(columns["regime"], columns["period"], columns["parting"], look.decide)
        columns["recurrence"] = np.where(changes & (words == "not_repeating"), "undecided", words)

    def _integrated(self, document: dict[str, Any], values: AnyArray) -> dict[str, AnyArray]:
        """Runs under laws with an internal state, one by one from their whole orbits."""
        rows, start = [], self.start
        # The state of one law says nothing under another.
        same_law = not any("law" in path.split(".") for path in self.paths)
        for row in values.tolist():
            system, starts = varied(document, self.paths, row)
            if start is not None:
                x, v, state = start
                starts = {"x0": x, "v0": None if np.isnan(v).any() else v} | starts
                if np.size(state) and same_law:
                    starts["state"] = StateLayout.of(system).spread(state)
            rows.append(self._one(system, starts))
            ended = self.chain and rows[-1]["stop"][0] == "t_end"
            ends = tuple(rows[-1][name][0] for name in ("x_end", "v_end", "restart"))
            start = ends if ended else None if self.chain else start
        return {name: np.concatenate([row[name] for row in rows]) for name in rows[0]}

    def _one(self, system: Oscillator | System, starts: dict[str, Any]) -> dict[str, AnyArray]:
        look, span = self.look, period_of(system)
        surface = json.dumps((look.surface or usual_surface(system)).to_dict())
        periods = look.transient + look.window
        while True:
            orbit = integrate(system, periods * span, max_events=look.max_events, max_seconds=self.limit.left, **starts)
            columns = columns_of(orbit._steady(look.to_json(), span, surface, look.contact))
            columns |= {
                name: np.reshape(value, (1, system.masses))
                for name, value in zip(("x_end", "v_end"), orbit.at(orbit.t_end), strict=True)
            }
            columns["restart"] = orbit.variables(np.array([orbit.t_end]))[:, 2 * system.masses :]
            if orbit.stop != "t_end":
                return columns | {
                    "stop": np.array([orbit.stop]), "regime": np.array(["unfinished"]), "period": np.array([0]),
                    "recurrence": np.array(["undecided"]),
                }  # fmt: skip
            if columns["period"][0] or not look.decide or periods > look.transient + look.window:
                return columns
            # The core looks on at what comes after the window.
            periods += look.decide


def columns_of(table: dict[str, Any]) -> dict[str, AnyArray]:
    """The columns of runs from the table of the core."""
    columns = table | {
        **{name: table[name].astype(np.int64) for name in COUNTS},
        "regime": np.array(_core.REGIMES)[table["regime"]],
        "stop": np.array(_core.STOPS)[table["stop"]],
        "amplitude": (table["x_max"] - table["x_min"]) / 2,
        "parting": np.full(len(table["stop"]), np.nan),
    }
    columns["recurrence"] = recurrence(columns["regime"], columns["period"], columns["parting"], 0)
    return columns


def parting(
    system: Oscillator | System, x: AnyArray, v: AnyArray, look: Look, max_seconds: float | None
) -> tuple[float, bool]:
    """The factor by which the distance of two starts grows in `decide` periods, and whether the motion still changes.

    The factor is not a number where a run does not end.

    Parameters
    ----------
    x, v : where the motion was after whole periods, shape (masses,); NaN velocities are those of the drives.
    """
    span = period_of(system)
    times = np.arange(look.decide + 1) * span
    surface = json.dumps((look.surface or usual_surface(system)).to_dict())
    returns = Look(0.0, look.decide, look.tolerance, points=look.decide).to_json()
    beside = _BESIDE * max(float(np.abs(x).max()), 1e-3)
    many = isinstance(system, System)
    runs = []
    settles = False
    for start in (x, x + beside):
        x0, v0 = (start, v) if many else (start[0], v[0])
        orbit = simulate(
            system, times[-1], x0, None if np.isnan(v).any() else v0, look.max_events, max_seconds=max_seconds
        )
        if orbit.stop != "t_end":
            return math.nan, False
        runs.append(np.reshape(orbit.at(times)[0], (len(times), -1)))
        met = np.asarray(orbit._steady(returns, span, surface, look.contact)["section_x"][0])
        points = met[np.isfinite(met)]
        # What has not met the section once is on its way somewhere.
        settles = not points.size or still_changes(points)
    return float(np.abs(runs[1] - runs[0])[len(times) // 2 :].max() / beside), settles


def still_changes(points: AnyArray) -> bool:
    """Whether points of a section, shape (n,), come nearer to repeating all the time, as on the way to a periodic motion.

    Of the distances of each point from that some points later, where these are least: on a torus they stay as they are. Of
    less than 64 points nothing is said.

    >>> n = np.arange(500)
    >>> still_changes(0.1 * (-0.999) ** n), still_changes(0.1 * np.cos(2**0.5 * n))
    (True, False)
    """
    if len(points) < 64:
        return False

    def apart(lag: int) -> AnyArray:
        return np.asarray(np.abs(points[lag:] - points[:-lag]))

    half = len(points) // 2
    nearest = min(range(1, len(points) // 4), key=lambda lag: float(apart(lag)[half:].max()))
    parts = np.array([part.max() for part in np.array_split(apart(nearest), _PARTS_OF_RUN)])
    halves = parts.reshape(2, -1).max(axis=1)
    return bool((np.diff(parts) < 0).all() or halves[1] < _NEARER * halves[0])


def start_of(system: Oscillator | System, x0: ArrayLike | None, v0: ArrayLike | None, where: str) -> Start:
    """The start of all runs, in the shape of the state; none where nothing is asked for.

    >>> from stickslip import paper
    >>> start_of(paper.oscillator(0.3), 0.5, None, "example")
    (array(0.5), array(nan), ())
    """
    if x0 is None and v0 is None:
        return None
    shape = (system.masses,) if isinstance(system, System) else ()
    x, v = initial_state(system, x0, v0, where)
    unset = np.full(shape, np.nan)
    return np.zeros(shape) if x is None else np.reshape(x, shape), unset if v is None else np.reshape(v, shape), ()


def periods_to_decide(value: int, where: str) -> int:
    """How many periods tell how a motion comes back: none, or from 500 to 10,000, as the work grows by the square.

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


def recurrence(regime: AnyArray, period: AnyArray, parting: AnyArray, decide: int) -> AnyArray:
    """How motions come back, in a word; the criteria stand in :data:`stickslip.simulation.regime_names.RECURRENCE`.

    >>> recurrence(np.array(["stick_slip"] * 4), np.array([2, 0, 0, 0]), np.array([np.nan, 1e8, 300.0, 3.0]), 500).tolist()
    ['periodic', 'chaotic', 'undecided', 'not_repeating']
    """
    rests = np.isin(regime, ("at_rest", "stable_slip"))
    with np.errstate(invalid="ignore"):
        cases = [rests, period > 0, parting > PARTS * decide, parting <= PARTS]
    return np.select(cases, ["rests", "periodic", "chaotic", "not_repeating"], "undecided")
