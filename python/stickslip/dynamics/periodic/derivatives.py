"""Derivatives of a motion through its events, with respect to its start and to numbers of the system."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stickslip.dynamics.periodic.event_sequence import EventSequence, check, pointer
from stickslip.errors import InputError, number
from stickslip.model.system import System
from stickslip.simulation.orbit import Orbit

if TYPE_CHECKING:
    import xarray as xr


def fundamental_matrix(orbit: Orbit, t: float | None = None) -> NDArray[np.float64]:
    """The derivative of the state at a time with respect to the state at t = 0, through all events in between.

    Φ(t) = ∂(x, v)(t) / ∂(x, v)(0); at an event it jumps by the saltation matrix
    S = D_xR + (F⁺ − D_xR F⁻ − D_tR) nᵀ/(nᵀF⁻ + h_t), what the contact remembers included. A motion that starts stuck does not
    feel its v.

    Parameters
    ----------
    orbit : from :func:`stickslip.simulate`.
    t : a time in (0, t_end]; default t_end.

    Returns
    -------
    Shape (2 n, 2 n), positions before velocities, exact to rounding.

    Raises
    ------
    InputError
        for a time outside the orbit, contacts that close a loop, a drive along a table, or events of several contacts at one
        time, which a disturbance would part.

    Source: Aizerman & Gantmakher 1958; Müller, Chaos Solitons Fractals 5 (1995) 1671.

    >>> from stickslip import Oscillator, simulate
    >>> from stickslip.laws import Coulomb
    >>> swing = simulate(Oscillator(damping=0.0, drive_velocity=0.0, law=Coulomb(0.5)), 1.0, x0=5.3, v0=0.0)
    >>> fundamental_matrix(swing).round(6).tolist()
    [[0.540302, 0.841471], [-0.841471, 0.540302]]
    """
    end = orbit.t_end if t is None else number("t", t, "fundamental_matrix")
    if not 0 < end <= orbit.t_end:
        raise InputError(f"fundamental_matrix: t must lie in (0, {orbit.t_end:g}], got {end:g}: simulate longer")
    sequence, _, _ = _sequence(orbit, end)
    motion = np.concatenate([sequence.layout.x, sequence.layout.v])
    return np.array(sequence.follow(keep="last").rates[-1][np.ix_(motion, motion)], float)


def sensitivities(orbit: Orbit, parameters: Sequence[str]) -> xr.Dataset:
    """How the events of an orbit move with numbers of the system, and the state at its end.

    Parameters
    ----------
    orbit : from :func:`stickslip.simulate`.
    parameters : numbers of the system document, such as ``"drive_velocity"``, ``"law.kinetic"`` or ``"forcing.amplitude"``.

    Returns
    -------
    Dataset over ``event`` and ``parameter``: ``t``, ``x``, ``v``, derivatives of the time and state of each event, and over
    ``parameter``: ``x_end``, ``v_end``, those of the state at t_end; of several masses over ``mass`` too. The start does not
    move; what friction is there does.

    >>> from stickslip import Oscillator, simulate
    >>> from stickslip.laws import StaticKinetic
    >>> slider = Oscillator(damping=0.0, drive_velocity=0.2, law=StaticKinetic(1.0, 0.6))
    >>> moved = sensitivities(simulate(slider, 8.0), ["law.break_away"])
    >>> round(float(moved["t"].sel(event=0)[0]), 9)  # stuck, x = s t, until it reaches f_s
    5.0
    """
    import xarray as xr

    check(orbit.system, "sensitivities")
    names = list(parameters)
    sequence, kinds, _ = _sequence(orbit, orbit.t_end)
    run = orbit._core.run
    followed = sequence.follow(
        *(pointer(orbit.system, name, "sensitivities") for name in names), origin=(run[0], run[1])
    )
    first = sequence.layout.width
    rates = followed.rates[:, :, first : first + len(names)]
    events = rates[: len(kinds)]
    several = isinstance(orbit.system, System)
    data: dict[str, Any] = {"t": (("event", "parameter"), events[:, 0])}
    for name, coordinates in (("x", sequence.layout.x), ("v", sequence.layout.v)):
        masses, dims = (coordinates, ("mass",)) if several else (coordinates[0], ())
        data[name] = (("event", *dims, "parameter"), events[:, masses])
        data[f"{name}_end"] = ((*dims, "parameter"), rates[-1][masses])
    return xr.Dataset(data, coords={"parameter": names, "event": np.arange(len(kinds)), "kind": ("event", kinds)})


def _sequence(orbit: Orbit, t_end: float) -> tuple[EventSequence, list[str], str]:
    check(orbit.system, "fundamental_matrix")
    run = orbit._core.run
    return EventSequence.of_run(orbit.system, t_end, run[0], run[1], run[3])
