"""Periodic orbits, unstable ones too, near the returns of a section or of a column of an orbit diagram."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import numpy as np

from stickslip.dynamics.periodic.event_sequence import check_one, with_number
from stickslip.dynamics.periodic.periodic_orbits import PeriodicOrbit, event_cycle, finished, from_section
from stickslip.dynamics.periodic.poincare_map import forcing_period, once
from stickslip.errors import InputError, number, whole_number
from stickslip.files.arrays import Array
from stickslip.model.parameters import document_of, path_in
from stickslip.model.system import Oscillator, system_from_dict
from stickslip.simulation.simulate import simulate

if TYPE_CHECKING:
    import xarray as xr

#: Two orbits whose periods and positions at their events agree to this part are one.
_SAME = 1e-6


def periodic_orbits(
    points: xr.Dataset, *, returns: int = 6, near: float = 0.02, most: int = 20, tries: int = 60
) -> list[PeriodicOrbit]:
    """The periodic orbits that a motion comes near, unstable ones too, from the returns of one section.

    A state that comes back after p returns, to the part `near` of the extent of the section, is a guess for an orbit
    of p returns; Newton's method decides. A chaotic motion comes near all of its unstable orbits.

    Parameters
    ----------
    points : from :func:`stickslip.section`, of one mass; or one column of an orbit diagram, such as
        ``diagram.sel(drive_velocity=0.3)`` or ``diagram.isel({"forcing.frequency": 3})``.
    returns : the most returns of one orbit.
    near : how near a return is to count, as a part of the extent of the section.
    most : so many orbits at most.
    tries : so many returns are tried for each number p of returns, the nearest first.

    Returns
    -------
    The orbits that were found, the shortest first; empty where none is.

    Raises
    ------
    InputError
        for data without points or of several masses, or values that make no sense.

    Limits: what is found depends on what the motion came near. What a contact remembers is not in a section: it comes from
    the run from there.

    Source: Auerbach, Cvitanović, Eckmann, Gunaratne & Procaccia, Phys. Rev. Lett. 58 (1987) 2387; Lathrop & Kostelich,
    Phys. Rev. A 40 (1989) 4028.

    >>> import stickslip as ss
    >>> belt = ss.Oscillator(0.0, 0.1, ss.laws.StaticKinetic(1.0, 0.5), forcing=ss.Harmonic(0.8, 1.3))
    >>> found = ss.periodic_orbits(ss.section(belt, t_end=4000), returns=4)
    >>> [(cycle.forcing_periods, cycle.stable, round(cycle.largest, 4)) for cycle in found]
    [(4, False, 2.5261)]
    """
    for name, count in (("returns", returns), ("most", most), ("tries", tries)):
        whole_number(name, count, "periodic_orbits")
    if not 0 < number("near", near, "periodic_orbits") < 1:
        raise InputError(f"periodic_orbits: near must lie in (0, 1), got {near}")
    system, (t, x, v) = _states(points)
    extent = np.maximum(np.array([np.ptp(x), np.ptp(v)]), 1e-300)
    # A motion that always comes back to one point has no extent.
    extent = np.maximum(extent, 1e-6 * np.array([np.abs(x).max(), np.abs(v).max()]) + 1e-300)
    found: list[PeriodicOrbit] = []
    for count in range(1, min(returns, len(t) - 1) + 1):
        gaps = np.hypot((x[count:] - x[:-count]) / extent[0], (v[count:] - v[:-count]) / extent[1])
        for start in np.argsort(gaps, kind="stable")[:tries]:
            if gaps[start] > near or len(found) >= most:
                break
            cycle = _tried(
                system, float(t[start]), float(x[start]), float(v[start]), float(t[start + count] - t[start])
            )
            if cycle is not None and not any(_same(cycle, other) for other in found):
                found.append(cycle)
    return sorted(found, key=lambda cycle: cycle.period)


def _states(points: xr.Dataset) -> tuple[Oscillator, tuple[Array, Array, Array]]:
    """The system and t, x, v at the points of a section or of a column of a diagram."""
    prefix = "" if "x" in points and "slip_velocity" in points else "section_"
    names = [prefix + name for name in ("t", "x", "v")]
    if "system" not in points.attrs or any(name not in points for name in names):
        raise InputError("periodic_orbits: expected the data of section or one column of an orbit_diagram")
    columns = [points[name].to_numpy() for name in names]
    if columns[0].ndim != 1:
        raise InputError(
            f"periodic_orbits: expected one column of the diagram, got {columns[0].shape}; choose one by isel or sel"
        )
    system = check_one(system_from_dict(json.loads(points.attrs["system"])), "periodic_orbits")
    if prefix:
        name = points.attrs["parameter"]
        path = "/" + path_in(name, document_of(system), "periodic_orbits", starts=False).replace(".", "/")
        system = with_number(system, path, float(points[name]))
    known = np.isfinite(columns[0])
    t, x, v = (column[known] for column in columns)
    if len(t) < 2:
        raise InputError(f"periodic_orbits: the section has {len(t)} points; simulate longer, or keep more of them")
    return system, (t, x, v)


def _tried(system: Oscillator, t: float, x: float, v: float, time: float) -> PeriodicOrbit | None:
    """The orbit near a state that comes back after a time; None where Newton's method finds none."""
    force = forcing_period(system)
    try:
        if force is None:
            return event_cycle(system, (x, v), t_end=2.5 * time)
        phase = force * math.ceil(t / force - 1e-9) - t
        if phase > 1e-9 * force:
            # To where the clock of the forcing is zero.
            x, v = simulate(from_section(system, t), phase, x0=x, v0=v).at(phase)
        periods = max(1, round(time / force))
        cycle = event_cycle(system, (x, v), t_end=(2 * periods + 1.5) * force, periods=periods)
        # After twice its period an orbit comes back as well.
        single = once(cycle.closed)
        return cycle if single is cycle.closed else finished(single, cycle.rounds)
    except InputError:
        return None


def _same(one: PeriodicOrbit, other: PeriodicOrbit) -> bool:
    """Whether two orbits are one: the same positions at their events, whichever comes first."""
    if abs(one.period - other.period) > _SAME * one.period:
        return False
    positions = [np.sort(cycle.closed.sequence.follow(keep="nothing").states[:, 1]) for cycle in (one, other)]
    return len(positions[0]) == len(positions[1]) and bool(
        np.abs(positions[0] - positions[1]).max() < _SAME * max(np.abs(positions[0]).max(), 1e-300)
    )
