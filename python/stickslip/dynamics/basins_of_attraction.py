"""Basins of attraction: which steady motion is reached from which start."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from stickslip.dynamics.regime_maps import map_plan
from stickslip.dynamics.surface import Surface
from stickslip.dynamics.tasks import Plan, Progress, compute
from stickslip.errors import positive, whole_number
from stickslip.files.arrays import AnyArray
from stickslip.model.system import Oscillator, System
from stickslip.simulation.attractor import ATTRACTOR, on_one_attractor

if TYPE_CHECKING:
    import xarray as xr


#: More motions than this are a continuum, as without damping: starts beyond them get no label.
MOST = 1000


def basins(
    system: Oscillator | System,
    *,
    x: ArrayLike,
    v: ArrayLike,
    mass: int = 0,
    transient: float = 300,
    window: float = 32,
    section: str | Surface | None = None,
    tolerance: float = 1e-4,
    decide: int = 0,
    same: float = 1e-2,
    contact: int = 0,
    store: str | Path | None = None,
    workers: int | None = None,
    cluster: str | None = None,
    progress: Progress = None,
    max_seconds: float | None = None,
) -> xr.Dataset:
    """Which steady motion is reached from each start (x, ẋ), and the share of the starts that each attracts.

    Two motions are one attractor if they have the same regime, and their extremes of x and w and the mean of their returns
    over a period agree to the part `same` of their extent; motions that rest, if their positions agree to that part of the
    range of starts (all that stay stuck count as one). Periods are not compared: the same motion may repeat in one window
    and not yet, or after twice as long, in another. The means count where both repeat. Motions that do not repeat scatter in
    a finite window: two of them are one attractor also if their ranges of x share more than half of their union.

    Parameters
    ----------
    system : the oscillator, or system of masses.
    x, v : positions and velocities at t = 0, shape (n,) each, in increasing order; all combinations are run.
    mass : of a system of masses, the one that starts there; the others start at rest at x = 0.
    transient, window : periods that are left out and then looked at, as in :func:`regime_map`.
    section, tolerance, decide, contact, store, workers, cluster, progress, max_seconds : as in :func:`orbit_diagram`.
    same : how far two motions may differ to be the same, > 0.

    Returns
    -------
    Dataset over ``x`` and ``v``: ``label`` (the number of the attractor, those that attract more starts first; −1 where the
    motion diverges or ends before its time) and the variables of :func:`regime_map`; over ``attractor``: ``fraction`` of the
    starts, and its ``attractor_regime``, ``attractor_period``, ``attractor_loops``, ``attractor_x_min`` and so on, and
    ``attractor_recurrence``: without `decide` a motion that does not repeat in the window is ``"undecided"``, as it may only
    not have settled yet.

    Raises
    ------
    InputError
        as :func:`regime_map`.

    Limits: the fractions are those of a regular grid of starts. A transient that outlasts `transient` leaves a label of its
    own: run longer, and look at two lengths near a threshold.

    Source: basin stability, Menck, Heitzig, Marwan & Kurths, Nature Physics 9 (2013) 89.

    >>> from stickslip import Oscillator, laws
    >>> falling = laws.PiecewiseLinear(nodes=[(0.0, 1.0), (1.0, 0.6), (2.0, 0.8)], break_away=1.0)
    >>> belt = Oscillator(damping=0.0, drive_velocity=1.2, law=falling)
    >>> both = basins(belt, x=[0.6, 3.0], v=[0.0], transient=100)
    >>> both["attractor_regime"].values.tolist(), both["fraction"].values.tolist()
    (['stable_slip', 'stick_slip'], [0.5, 0.5])
    """
    positive("same", same, "basins")
    whole_number("mass", mass, "basins", 0, system.masses - 1)
    masses = system.masses if isinstance(system, System) else None
    plan = map_plan(
        "basins",
        system,
        {"x": x, "v": v},
        transient=transient,
        window=window,
        section=section,
        tolerance=tolerance,
        decide=decide,
        start=(np.zeros(masses), np.zeros(masses)) if masses else (None, None),
        contact=contact,
        paths={"x": f"x0.{mass}", "v": f"v0.{mass}"} if masses else {"x": "x0", "v": "v0"},
    )
    plan = replace(plan, attrs={**plan.attrs, "same": same}, finish=lambda plan, arrays: _labels(plan, arrays, same))
    return compute(plan, store=store, workers=workers, cluster=cluster, progress=progress, max_seconds=max_seconds)


def _labels(plan: Plan, arrays: Mapping[str, Any], same: float) -> dict[str, tuple[tuple[str, ...], AnyArray]]:
    """The labels of all starts and the table of attractors, chunk by chunk in their order."""
    found: dict[str, list[Any]] = {name: [] for name in (*ATTRACTOR, "recurrence")}
    label = np.full(tuple(plan.sizes[dim] for dim in plan.chunks), -1, np.int16)
    wide = max(float(np.ptp(values)) for values, _ in plan.coords.values()) or 1.0
    for index in range(int(np.prod(plan.counts))):
        region = plan.region(plan.position(index))
        rows = {name: np.asarray(arrays[name][region]) for name in found}
        mine = np.full(rows["period"].shape, -1, np.int16)
        left = ~np.isin(rows["regime"].astype("<U16"), ("diverged", "unfinished"))
        for number_of in range(MOST):
            if not left.any():
                break
            if number_of == len(found["period"]):
                # A motion that repeats says more of the attractor than one that still approaches it.
                candidates = left & (rows["period"] > 0)
                first = tuple(axis[0] for axis in np.nonzero(candidates if candidates.any() else left))
                for name, column in rows.items():
                    found[name].append(column[first])
            attractor = {name: values[number_of] for name, values in found.items()}
            mine_too = left & on_one_attractor(rows, attractor, same, wide)
            mine[mine_too] = number_of
            left &= ~mine_too
        label[region] = mine
    counts = np.bincount(label[label >= 0].ravel(), minlength=len(found["period"]))
    order = np.argsort(-counts, kind="stable")
    rank = np.append(np.argsort(order), -1).astype(np.int16)
    table = {
        f"attractor_{name}": (
            ("attractor",),
            np.array(values, "<U16" if name in ("regime", "recurrence") else None)[order],
        )
        for name, values in found.items()
    }
    return {
        "label": (tuple(plan.chunks), rank[label]),
        "fraction": (("attractor",), counts[order] / label.size),
        **table,
    }
