"""Orbit diagrams: what steady motions do as a parameter changes, swept up, swept down and from fresh starts."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stickslip import _core
from stickslip.dynamics.surface import Surface
from stickslip.dynamics.sweep import Chunk, Look, Start, start_of
from stickslip.dynamics.tasks import Plan, Progress, Variable, compute, fingerprint, motion_variables, provenance
from stickslip.errors import InputError, whole_number
from stickslip.model.parameters import document_of, grid, path_in
from stickslip.model.system import Oscillator, System
from stickslip.simulation.state_orbit import state_laws_of

if TYPE_CHECKING:
    import xarray as xr

DIRECTIONS = ("up", "down", "fresh")
#: Values of a parameter in one task.
CHUNK = 64


def orbit_diagram(
    system: Oscillator | System,
    parameter: str,
    values: ArrayLike,
    *,
    direction: str | Sequence[str] = "fresh",
    periods: int = 150,
    keep: int = 20,
    section: str | Surface | None = None,
    points: int = 128,
    tolerance: float = 1e-6,
    decide: int = 0,
    x0: ArrayLike | None = None,
    v0: ArrayLike | None = None,
    contact: int = 0,
    store: str | Path | None = None,
    workers: int | None = None,
    cluster: str | None = None,
    progress: Progress = None,
    max_seconds: float | None = None,
) -> xr.Dataset:
    """Turning points, returns to a section, extremes and regime of the steady motion over a parameter.

    Parameters
    ----------
    system : the oscillator, or system of masses, that is varied.
    parameter : the path of a number in the system document, such as ``"drive_velocity"``, ``"law.break_away"``,
        ``"forcing.amplitude"`` or, for a system of masses, ``"contacts.0.drive_velocity"``.
    values : its values, shape (n,), in increasing order.
    direction : ``"fresh"``: each value from the start x0, v0; ``"up"`` or ``"down"``: each from where its neighbour ended, so
        that a motion is followed as long as it attracts: where its kind changes, or its size by more than a quarter, in
        steps down to a 64th. Several of them give the result a dimension ``direction``; where they differ, motions coexist.
    periods : periods to run, of the first forcing or, without one, of the natural motion.
    keep : the last of them that are looked at; the rest is transient.
    section : in which returns are counted: ``"strobe"``, ``"maximum"``, a kind of event, or a :class:`Surface`; default the
        stroboscopic section where there is forcing, else the maxima of x.
    points : the most turning points and returns that are kept of each motion, the last ones.
    tolerance : a motion repeats where its returns do, to this part of its extent.
    decide : a motion that does not repeat is followed for so many more periods, at least 500 if at all: it may repeat after
        up to half of them, and if not, two runs that begin beside each other say whether it is chaotic. They need whole
        periods before them. Weak chaos asks for more than 500.
    x0, v0 : the start; default stuck on the drive at x = 0, as in :func:`stickslip.simulate`.
    contact : of a system of masses, the contact that is looked at, with its mass.
    store : folder of a Zarr store to write to, part by part; after a kill the same call goes on, and ends with the
        same bytes.
    workers : threads; default all cores. The result does not depend on it.
    cluster : address of a Dask scheduler whose workers compute instead, ``"tcp://host:8786"``.
    progress : called as ``progress(done, n)`` with runs.
    max_seconds : time on the clock > 0 after which all runs that are not done end where they are, with the stop
        ``"max_seconds"`` and a warning of how many they are; default none. In a store the same call goes on with them.

    Returns
    -------
    Dataset over `parameter` and ``point``: ``turning_x`` where ẋ changes sign, ``turning_slip_velocity`` where ẇ does (0
    while the mass sticks) and ``section_t``, ``section_x``, ``section_v``, all in order of time and filled with NaN;
    ``amplitude`` (half of max x − min x), ``x_min``, ``x_max``, ``w_min``, ``w_max``, ``regime``
    (:data:`stickslip.simulation.regime_names.REGIMES`), ``period`` (returns after which the motion repeats, 0 where it does
    not within half of `keep` or of `decide`), ``recurrence`` (``"rests"``, ``"periodic"``, ``"chaotic"``,
    ``"not_repeating"``: a torus, a longer period or chaos too weak to be seen, or ``"undecided"``), ``parting`` (the factor
    by which the distance of two starts beside each other grows in `decide` periods), ``chaos`` (the K of the 0–1 test of the
    returns), ``loops`` and ``period_time`` of that period, ``x_end`` and ``v_end`` (NaN: stuck). A fixed point has one
    turning point. With a store, the Dataset is read when it is looked at.

    Raises
    ------
    InputError
        for an unknown parameter, values that make no sense, a store of something else or a cluster that does not answer.

    Limits: a transient that outlasts `periods` − `keep` is shown as if it were steady: near a threshold, run longer. A swept
    motion is handed on with its position and its slip velocity, at a whole period of the first forcing, and with what the
    contact remembers (the internal state of a law) unless it is the law that is varied; a system of masses and a smooth law
    with position and velocity, or stuck on the drive. Under laws with an internal state a step is never made smaller: there a
    motion can be lost early.

    >>> from stickslip import paper
    >>> diagram = orbit_diagram(paper.oscillator(0.3), "drive_velocity", [0.2, 0.3, 0.45])
    >>> diagram["regime"].values.tolist()
    ['stick_slip', 'almost_harmonic', 'stable_slip']
    """
    document = document_of(system)
    path = path_in(parameter, document, "orbit_diagram")
    axis = grid(parameter, values, "orbit_diagram")
    if not 1 <= keep < periods:
        raise InputError(f"orbit_diagram: keep must be at least 1 and less than periods ({periods}), got {keep}")
    whole_number("points", points, "orbit_diagram")
    directions = _directions(direction)
    asked = {"tolerance": tolerance, "decide": decide, "points": points, "contact": contact}
    look = Look.asked("orbit_diagram", system, section, transient=periods - float(keep), window=float(keep), **asked)
    settings = {"periods": periods, "keep": keep, **asked}
    begin = start_of(system, x0, v0, "orbit_diagram")
    parts = _Parts(json.dumps(document), path, axis, look, directions, begin, _restart_numbers(system))
    sizes = {"direction": len(directions), parameter: axis.size, "point": points}
    if parts.numbers:
        sizes["number"] = parts.numbers
    if isinstance(system, System):
        sizes["mass"] = system.masses
    plan = Plan(
        name="orbit_diagram",
        coords={"direction": (np.array(directions), {}), parameter: (axis, {})},
        sizes=sizes,
        chunks={"direction": 1, parameter: CHUNK},
        variables=_variables(("direction", parameter), system, parts.numbers),
        task=parts.task,
        before=parts.before,
        attrs={"parameter": parameter}
        | provenance(
            "orbit_diagram",
            system,
            [parameter],
            look,
            begin,
            settings,
            parameter=parameter,
            values=fingerprint(axis),
            direction=directions,
        ),
    )
    diagram = compute(plan, store=store, workers=workers, cluster=cluster, progress=progress, max_seconds=max_seconds)
    if store is None:
        # As many points as the busiest motion has.
        lists = ("turning_x", "turning_slip_velocity", "section_x")
        busiest = max(int(np.isfinite(diagram[name].to_numpy()).sum(axis=-1).max()) for name in lists)
        diagram = diagram.isel(point=slice(max(1, busiest)))
    return diagram.isel(direction=0, drop=True) if isinstance(direction, str) else diagram


def windows(diagram: xr.Dataset) -> list[dict[str, Any]]:
    """Where neighbouring values of a diagram have motions that come back alike, of each direction in turn.

    Returns
    -------
    For each: ``direction`` ("" where there is one), the values ``from`` and ``to``, ``recurrence`` and, where the motion is
    periodic, ``period`` (else 0). None of a map.

    >>> from stickslip import paper
    >>> found = windows(orbit_diagram(paper.oscillator(0.3), "drive_velocity", [0.2, 0.3, 0.45, 0.5]))
    >>> [(item["from"], item["to"], item["recurrence"]) for item in found]
    [(0.2, 0.3, 'periodic'), (0.45, 0.5, 'rests')]
    """
    if "parameter" not in diagram.attrs:
        return []
    values = diagram[diagram.attrs["parameter"]].to_numpy().tolist()
    table = diagram[["recurrence", "period"]]
    if "direction" not in table.dims:
        table = table.expand_dims(direction=[""])
    found = []
    for i, direction in enumerate(table["direction"].to_numpy().tolist()):
        words, periods = (table[name].isel(direction=i).to_numpy().tolist() for name in ("recurrence", "period"))
        periods = [period if word == "periodic" else 0 for period, word in zip(periods, words, strict=True)]
        motions = list(zip(values, words, periods, strict=True))
        for (word, period), group in groupby(motions, key=lambda item: item[1:]):
            ends = [item[0] for item in group]
            found.append(
                {"direction": direction, "from": ends[0], "to": ends[-1], "recurrence": word, "period": period}
            )
    return found


def _directions(direction: str | Sequence[str]) -> list[str]:
    """Those that are asked for, checked."""
    directions = [direction] if isinstance(direction, str) else list(direction)
    if not directions or any(item not in DIRECTIONS for item in directions) or len({*directions}) < len(directions):
        raise InputError(
            f"orbit_diagram: direction must be one or several of {', '.join(DIRECTIONS)}, got {direction!r}"
        )
    return directions


def _restart_numbers(system: Oscillator | System) -> int:
    """How many numbers a motion is handed on with beside positions and velocities."""
    if system.integrated:
        return sum(law.states for law in state_laws_of(system))
    return _core.RESTART if isinstance(system, Oscillator) and system.closed_form else 0


@dataclass(frozen=True)
class _Parts:
    """The runs of a diagram in parts of `CHUNK` values; in a sweep a part goes on from where the one before it ended.

    Attributes
    ----------
    text : the document of the system; `path` the number in it that has the `values`.
    begin : the start of runs that go on from none; `numbers` as of :func:`_restart_numbers`.
    """

    text: str
    path: str
    values: NDArray[np.float64]
    look: Look
    directions: list[str]
    begin: Start
    numbers: int

    def before(self, position: tuple[int, ...]) -> tuple[int, ...] | None:
        """The part that has to be done first."""
        which, part = position
        neighbour = part - 1 if self.directions[which] == "up" else part + 1
        chained = self.directions[which] != "fresh" and 0 <= neighbour < -(-self.values.size // CHUNK)
        return (which, neighbour) if chained else None

    def task(self, position: tuple[int, ...], arrays: Any) -> Chunk:
        """The runs of a part, begun from what the parts before it left in the arrays."""
        which, part = position
        low, high = part * CHUNK, min((part + 1) * CHUNK, self.values.size)
        start, link = self.begin, None
        if self.before(position) is not None:
            # The run beside this part: below it on the way up, above it on the way down.
            there = low - 1 if self.directions[which] == "up" else high
            if arrays["stop"][which, there] == "t_end":
                carried = ("x_end", "v_end", *(["restart"] if self.numbers else []))
                ends = [np.asarray(arrays[name][which, there]) for name in carried]
                start = (ends[0], ends[1], ends[2] if self.numbers else ())
                regime, low_x, high_x = (arrays[name][which, there] for name in ("regime", "x_min", "x_max"))
                link = ([float(self.values[there])], _core.REGIMES.index(str(regime)), float(high_x - low_x))
        return Chunk(
            self.text,
            (self.path,),
            self.values[low:high, None],
            self.look,
            chain=self.directions[which] != "fresh",
            backwards=self.directions[which] == "down",
            start=start,
            before=link,
        )


def _variables(dims: tuple[str, ...], system: Oscillator | System, numbers: int) -> dict[str, Variable]:
    """The columns of a diagram."""
    state = (*dims, "mass") if isinstance(system, System) else dims
    variables = {
        **motion_variables(dims),
        "x_end": Variable(state, float, {"long_name": "position at the end"}),
        "v_end": Variable(state, float, {"long_name": "velocity at the end, not a number while stuck"}),
        "turning_x": Variable((*dims, "point"), float, {"long_name": "position where the velocity changes its sign"}),
        "turning_slip_velocity": Variable(
            (*dims, "point"), float, {"long_name": "slip velocity where the acceleration changes its sign"}
        ),
        **{
            f"section_{name}": Variable((*dims, "point"), float, {"long_name": f"{what} at the returns to the section"})
            for name, what in (("t", "time"), ("x", "position"), ("v", "velocity"))
        },
    }
    if numbers:
        variables["restart"] = Variable(
            (*dims, "number"), float, {"long_name": "the state from which the motion goes on"}
        )
    return variables
