"""Regime maps: the kind of the steady motion over two parameters, or as many as are asked for."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from stickslip.dynamics.surface import Surface
from stickslip.dynamics.sweep import Chunk, Look, start_of
from stickslip.dynamics.tasks import Plan, Progress, compute, fingerprint, motion_variables, provenance
from stickslip.errors import InputError, number
from stickslip.model.parameters import document_of, grid, path_in
from stickslip.model.system import Oscillator, System

if TYPE_CHECKING:
    import xarray as xr


def regime_map(
    system: Oscillator | System,
    over: Mapping[str, ArrayLike],
    *,
    transient: float = 300,
    window: float = 32,
    section: str | Surface | None = None,
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
    """The kind of the steady motion, its period and its extremes over parameters, each point from a fresh start.

    Parameters
    ----------
    system : the oscillator, or system of masses, that is varied.
    over : values by the path of a number in the system document, such as
        ``{"forcing.amplitude": a, "forcing.frequency": f}``, each shape
        (n,) in increasing order; ``"x0"`` and ``"v0"`` vary the start. All combinations are run.
    transient : periods that are left out, of the first forcing or, without one, of the natural motion.
    window : periods after them that are looked at; a period of up to half of it is found. Stick-slip on a slow drive is
        looked at for longer, until it has come back six times.
    section, tolerance, decide, x0, v0, contact, store, workers, cluster, progress, max_seconds : as in :func:`orbit_diagram`.

    Returns
    -------
    Dataset over the names of `over`: ``regime`` (:data:`stickslip.simulation.regime_names.REGIMES`), ``period``
    (returns to the section after which the motion repeats; in forcing periods for a
    forced system; 0 where it does not repeat; 1 for one that rests),
    ``recurrence``, ``parting`` and ``chaos`` (as of :func:`orbit_diagram`),
    ``loops`` (maxima of x in that time), ``period_time``, ``amplitude``, ``x_min``, ``x_max``, ``w_min``, ``w_max``,
    ``x_mean``, ``v_mean``, ``stuck_share``, ``events``, ``stop``. With a store it is read when it is looked at, and memory
    does not grow with the map.

    Raises
    ------
    InputError
        for an unknown parameter, values that make no sense, a store of something else or a cluster that does not answer.

    >>> from stickslip import Harmonic, paper
    >>> forced = paper.oscillator(0.30, Harmonic(0.1, 1.2))
    >>> chart = regime_map(forced, {"forcing.amplitude": [0.05, 0.4], "forcing.frequency": [0.8, 1.2]}, transient=100)
    >>> chart["regime"].shape
    (2, 2)
    """
    plan = map_plan(
        "regime_map",
        system,
        over,
        transient=transient,
        window=window,
        section=section,
        tolerance=tolerance,
        decide=decide,
        start=(x0, v0),
        contact=contact,
    )
    return compute(plan, store=store, workers=workers, cluster=cluster, progress=progress, max_seconds=max_seconds)


def shares(result: xr.Dataset, name: str) -> dict[str, float]:
    """The share of each word of a variable among the runs of a map or a diagram, the greatest first.

    >>> from stickslip import paper
    >>> shares(regime_map(paper.oscillator(0.3), {"drive_velocity": [0.2, 0.25, 0.3, 0.45]}), "regime")
    {'almost_harmonic': 0.5, 'stable_slip': 0.25, 'stick_slip': 0.25}
    """
    words, counts = np.unique(result[name].to_numpy().astype("<U16"), return_counts=True)
    order = np.argsort(-counts, kind="stable")
    return {str(words[i]): float(counts[i] / counts.sum()) for i in order}


def map_plan(
    name: str,
    system: Oscillator | System,
    over: Mapping[str, ArrayLike],
    *,
    transient: float,
    window: float,
    section: str | Surface | None,
    tolerance: float,
    decide: int,
    start: tuple[ArrayLike | None, ArrayLike | None],
    contact: int,
    paths: Mapping[str, str] | None = None,
) -> Plan:
    """The plan of a map, for :func:`regime_map` and :func:`basins`; `paths` where an axis has another name in the result."""
    if not isinstance(over, Mapping) or not over:
        raise InputError(f"{name}: name at least one parameter to vary, such as {{'drive_velocity': values}}")
    document = document_of(system)
    pointers = tuple((paths or {}).get(item) or path_in(item, document, name) for item in over)
    axes = {item: grid(item, values, name) for item, values in over.items()}
    for item, value, least in (("transient", transient, 0.0), ("window", window, 1.0)):
        if number(item, value, name) < least:
            raise InputError(f"{name}: {item} must be at least {least:g} periods, got {value!r}")
    settings = {
        "transient": transient,
        "window": window,
        "tolerance": tolerance,
        "decide": decide,
        "contact": contact,
    }
    look = Look.asked(name, system, section, **settings | {"transient": float(transient), "window": float(window)})
    begin = start_of(system, *start, name)
    text = json.dumps(document)
    dims = tuple(axes)
    # A task of about half a second: some thousand runs in closed form, a hundred by Taylor steps, a few integrated.
    closed = isinstance(system, Oscillator) and system.closed_form
    most = 2500 if closed else 16 if system.integrated else 100
    side = max(1, int(most ** (1 / len(axes))))
    chunks = {item: min(side, values.size) for item, values in axes.items()}

    def task(position: tuple[int, ...], _: Any) -> Chunk:
        parts = [
            values[i * chunks[item] : (i + 1) * chunks[item]]
            for i, (item, values) in zip(position, axes.items(), strict=True)
        ]
        rows = np.stack([mesh.ravel() for mesh in np.meshgrid(*parts, indexing="ij")], axis=1)
        return Chunk(text, pointers, rows, look, start=begin)

    return Plan(
        name=name,
        coords={item: (values, {}) for item, values in axes.items()},
        sizes={item: values.size for item, values in axes.items()},
        chunks=chunks,
        variables=motion_variables(dims),
        task=task,
        before=lambda _: None,
        attrs=provenance(
            name, system, axes, look, begin, settings, **{item: fingerprint(values) for item, values in axes.items()}
        ),
    )
