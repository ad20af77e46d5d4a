"""Sections of a motion: the states in which it meets a surface."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from stickslip import _core
from stickslip.dynamics.surface import Surface, surface_from
from stickslip.errors import InputError, fraction, number, time_limit, whole_number
from stickslip.files.arrays import Array
from stickslip.model.drive import Drive
from stickslip.model.parameters import contact_of, initial_state, is_dimensionless
from stickslip.model.system import Oscillator, System
from stickslip.simulation.orbit import Orbit
from stickslip.simulation.simulate import simulate

if TYPE_CHECKING:
    import xarray as xr


def section(
    system: Oscillator | System,
    on: str | None = None,
    *,
    t_end: float,
    transient: float = 0.5,
    normal: ArrayLike | None = None,
    level: float = 0.0,
    direction: int = 0,
    period: float | None = None,
    start: float = 0.0,
    x0: ArrayLike | None = None,
    v0: ArrayLike | None = None,
    contact: int = 0,
    most: int = 1_000_000,
    max_events: int = 10_000_000,
    max_seconds: float | None = None,
) -> xr.Dataset:
    """The states in which a motion meets a surface: stroboscopic, at events, or on a line of the phase plane.

    The surface is t = start + n · period (``on="strobe"``), an event, or a_x x + a_v ẋ = level (`normal` = (a_x, a_v)).

    Parameters
    ----------
    system : an oscillator or a system of masses.
    on : ``"strobe"``, ``"maximum"`` or ``"minimum"`` (of x), or a kind of event such as ``"release"``; default ``"strobe"``
        where there is forcing, else ``"maximum"``.
    t_end : time to run > 0.
    transient : the fraction of it that is left out, in [0, 1).
    normal, level, direction : a line instead of `on`; `direction` 1 takes crossings where the left side rises, −1 where it
        falls, 0 both.
    period, start : of the stroboscopic section; default the period of the first forcing, from t = 0 on.
    x0, v0 : the start, as in :func:`stickslip.simulate`.
    contact : of a system of masses, the contact whose mass is looked at.
    most : only the last so many points are kept.
    max_events : the most events of the run.
    max_seconds : time on the clock > 0 after which the run ends where it is, with ``stop`` ``"max_seconds"``; default none.

    Returns
    -------
    Dataset over ``point``: ``t``, ``x``, ``v``, ``slip_velocity``; with forcing ``phase`` (Ωt + φ in [0, 2π)); on events
    ``force``, ``stick_time`` and ``force_rate``.

    Raises
    ------
    InputError
        for a surface that makes no sense.

    Limits: no crossing is missed and nothing but the points is kept in memory. Under laws with an internal state all of the
    motion is kept, and crossings are those of a polynomial between the steps of its integration.

    >>> from stickslip import paper
    >>> points = section(paper.oscillator(0.2), "release", t_end=400)
    >>> round(float(points["stick_time"][-1]), 9)
    5.924558432
    """
    import xarray as xr

    surface = surface_from(system, on, normal=normal, level=level, direction=direction, period=period, start=start)
    end = number("t_end", t_end, "section")
    fraction("transient", transient, "section")
    for name, count in (("most", most), ("max_events", max_events)):
        whole_number(name, count, "section")
    time_limit(max_seconds, "section")
    contact_of(system, contact, "section")
    if system.integrated:
        orbit = simulate(system, end, x0, v0, max_events, max_seconds)
        points, stopped = points_of(orbit, surface, transient * end, contact)[-most:], orbit.stop
    else:
        run = (*initial_state(system, x0, v0, "section"), end, max_events)
        try:
            points, stopped = _core.section(
                system.core, json.dumps(surface.to_dict()), run, contact, transient * end, most, max_seconds
            )
        except ValueError as error:
            raise InputError(f"section: {error}") from None
    t, x, v, slip, *event = points.T
    drive = system.contacts[contact].drive_velocity
    # At events that leave a slip velocity it is that of the drive.
    slip = np.where(np.isnan(slip), (drive.at(t) if isinstance(drive, Drive) else drive) - v, slip)
    units = _units(system)
    data: dict[str, Any] = {
        "t": ("point", t, {"units": units["t"]}),
        "x": ("point", x, {"units": units["x"]}),
        "v": ("point", v, {"units": units["v"]}),
        "slip_velocity": ("point", slip, {"units": units["v"]}),
    }
    forces = system.forcing if isinstance(system, System) else system.harmonics
    if swinging := [force for force in forces if force.frequency]:
        angle = np.mod(swinging[0].frequency * t + swinging[0].phase, 2 * np.pi)
        data["phase"] = ("point", angle, {"units": "rad"})
    if surface.kind is not None:
        for name, column in zip(("force", "stick_time", "force_rate"), event, strict=True):
            data[name] = ("point", column, {"units": units[name]})
    attrs = {
        "title": "stickslip section",
        "surface": json.dumps(surface.to_dict()),
        "system": json.dumps(system.to_dict()),
        "t_end": end,
        "transient": transient,
        "stop": stopped,
    }
    return xr.Dataset(data, attrs=attrs)


def _units(system: Oscillator | System) -> dict[str, str]:
    si = {"t": "s", "x": "m", "v": "m/s", "force": "N", "stick_time": "s", "force_rate": "N/s"}
    return dict.fromkeys(si, "1") if is_dimensionless(system) else si


def points_of(orbit: Orbit, surface: Surface, after: float, contact: int = 0) -> Array:
    """The points of a section of an orbit that is there already, rows t, x, v, w, force, stick_time, force_rate.

    >>> from stickslip import paper
    >>> points_of(simulate(paper.oscillator(0.2), 40), Surface(kind="release"), 0).shape
    (3, 7)
    """
    return orbit._points(json.dumps(surface.to_dict()), surface.kind, contact, after, 2**31)
