"""Friction records of simulated motions, as a measurement without the indirect method would give them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import ArrayLike

from stickslip.errors import InputError, number
from stickslip.files.arrays import Array
from stickslip.identification.trajectory.first_passage import own_number
from stickslip.laws.numbers import value, with_values
from stickslip.model.system import Oscillator
from stickslip.simulation.orbit import Orbit
from stickslip.simulation.simulate import simulate

LONGEST_CYCLE = 1000.0
"""Natural periods in which a stick and the slip that follows must end."""


def friction_of_orbit(
    orbit: Orbit, times: ArrayLike, force_noise: float = 0.0, seed: int = 0, displacement_noise: float = 0.0
) -> xr.DataTree:
    """Friction force and slip velocity of an orbit at these times, with its break-aways, for tests and trials.

    Parameters
    ----------
    orbit : a simulated motion.
    times : increasing, shape (n,).
    force_noise : standard deviation of the white noise added to every friction force, in the orbit's unit.
    seed : of the noise.
    displacement_noise : standard deviation of the white noise in ``recorded``, the displacement as an instrument gives it; 0
        leaves that variable out.

    Returns
    -------
    DataTree in the form of :func:`stickslip.measure`: the root over ``time``, the child ``break_away`` over ``event``
    with the releases whose stick began after the first time.

    Raises
    ------
    InputError
        for a negative noise or times outside the orbit.

    Limits: slip velocities and stick times are exact, so only the statistics of the fit are put to the test; a whole
    trial adds noise to the displacement and goes through ``measure``.

    >>> import stickslip as ss
    >>> system = ss.Oscillator(damping=0.1, drive_velocity=0.2, law=ss.laws.StaticKinetic(break_away=1.0, kinetic=0.6))
    >>> friction = friction_of_orbit(ss.simulate(system, t_end=50), np.arange(0, 50, 0.1))
    >>> friction["break_away"]["force"].values.round(6)[:2]
    array([1., 1.])
    """
    t = np.asarray(times, float)
    system = orbit.system
    sampled = orbit.to_xarray(t).rename(x="displacement", v="velocity").drop_vars("a")
    source = f"simulated {type(system.law).__name__}, drive velocity {system.drive_velocity:g}, seed {seed}"
    events = orbit.events[(orbit.events["kind"] == "release").to_numpy()]
    return _record(sampled, system, events, source, (force_noise, displacement_noise), seed)


def friction_of_sticks(
    system: Oscillator,
    times: ArrayLike,
    scatter: float,
    force_noise: float = 0.0,
    seed: int = 0,
    displacement_noise: float = 0.0,
) -> xr.DataTree:
    """A record whose sticks each break away at a force of their own, as those of real surfaces do.

    Each stick and the slip that follows are simulated with a law in which the number of static friction (see
    :func:`stickslip.identification.trajectory.first_passage.own_number`) is drawn anew, evenly around that of the law.

    Parameters
    ----------
    system : of the motion, with a law whose sticks have a number of their own.
    times : increasing, ≥ 0, shape (n,); the motion begins there stuck at x = 0.
    scatter : standard deviation of that number, relative to it, in [0, 0.5].
    force_noise, seed, displacement_noise : as for :func:`friction_of_orbit`; the seed is also that of the sticks.

    Returns
    -------
    DataTree as of :func:`friction_of_orbit`.

    Raises
    ------
    InputError
        for a scatter outside its range, or a stick or slip that does not end.

    >>> import stickslip as ss
    >>> system = ss.Oscillator(damping=0.1, drive_velocity=0.05, law=ss.laws.StaticKinetic(break_away=1.0, kinetic=0.6))
    >>> friction = friction_of_sticks(system, np.arange(0, 100, 0.1), scatter=0.15, seed=1)
    >>> friction["break_away"]["force"].values.round(2)
    array([0.96, 0.96, 0.88, 1.17])
    """
    t = np.asarray(times, float)
    if not 0 <= number("scatter", scatter, "friction_of_sticks") <= 0.5:
        raise InputError(f"friction_of_sticks: scatter must lie in [0, 0.5], got {scatter}")
    random = np.random.default_rng([seed, 2])
    name = own_number(system.law)
    usual = value(system.law, name)
    begin, x0, parts, events = 0.0, 0.0, [], []
    while begin <= t[-1]:
        own = usual * (1 + scatter * np.sqrt(3) * random.uniform(-1, 1))
        law = with_values(system.law, {name: own})
        once = Oscillator(system.damping, system.drive_velocity, law, system.mass, system.stiffness)
        orbit, release, capture = _stick_and_slip(once, x0)
        inside = t[(t >= begin) & (t < begin + capture["t"])]
        parts.append(orbit.to_xarray(inside - begin).assign_coords(time=inside))
        events.append({**release, "t": begin + release["t"]})
        begin, x0 = begin + capture["t"], capture["x"]
    sampled = xr.concat(parts, "time").rename(x="displacement", v="velocity").drop_vars("a")
    source = (
        f"simulated {type(system.law).__name__} with {name} scattered by {scatter:g}, drive velocity "
        f"{system.drive_velocity:g}, seed {seed}"
    )
    return _record(sampled, system, pd.DataFrame(events), source, (force_noise, displacement_noise), seed)


def _stick_and_slip(system: Oscillator, x0: float) -> tuple[Orbit, dict[str, Any], dict[str, Any]]:
    """The motion from a stick to the next, with the events of its release and capture."""
    span = 8 * system.natural_period
    while span < LONGEST_CYCLE * system.natural_period:
        orbit = simulate(system, span, x0=x0)
        kinds = orbit.events["kind"].to_numpy()
        released = np.flatnonzero(kinds == "release")
        captured = np.flatnonzero(kinds == "capture")
        captured = captured[captured > released[0]] if released.size else released
        if captured.size:
            return orbit, *(orbit.events.iloc[i].to_dict() for i in (released[0], captured[0]))
        span *= 2
    raise InputError(
        f"friction_of_sticks: the motion from x = {x0:.4g} does not stick and slip within {span:.4g} of time: take a lower "
        "drive velocity or less scatter"
    )


def _record(
    sampled: xr.Dataset, system: Oscillator, events: pd.DataFrame, source: str, noises: tuple[float, float], seed: int
) -> xr.DataTree:
    """The record of a sampled motion and its releases."""
    for what, noise in zip(("force_noise", "displacement_noise"), noises, strict=True):
        if number(what, noise, "friction_of_orbit") < 0:
            raise InputError(f"friction_of_orbit: {what} must not be negative, got {noise}")
    force_noise, displacement_noise = noises
    t: Array = sampled["time"].to_numpy()
    random = np.random.default_rng(seed)
    sampled["force"] = sampled["force"] + force_noise * random.standard_normal(t.size)
    sampled["force_error"] = ("time", np.full(t.size, float(force_noise)))
    if displacement_noise > 0:
        instrument = np.random.default_rng([seed, 1]).standard_normal(t.size)
        sampled["recorded"] = sampled["displacement"] + displacement_noise * instrument
    sampled.attrs = {
        "source": source,
        "mass": system.mass,
        "damping": system.damping,
        "stiffness": system.stiffness,
        "drive_velocity": system.drive_velocity,
        "notes": [],
    }
    begun = (events["t"] - events["stick_time"]).to_numpy() > t[0]
    rows = events[begun & (events["t"] <= t[-1]).to_numpy()]
    force = rows["force"].to_numpy() + force_noise * random.standard_normal(len(rows))
    columns = {"t": rows["t"], "stick_time": rows["stick_time"], "force_rate": rows["force_rate"].abs(), "force": force}
    table = xr.Dataset({name: ("event", np.asarray(column, float)) for name, column in columns.items()})
    spring = system.stiffness * sampled["displacement"].to_numpy()
    ends = np.append(rows["t"].to_numpy(), t[-1])[1:]
    drops = [
        system.stiffness * x - spring[(t >= start) & (t <= end)].min(initial=np.inf)
        for start, end, x in zip(rows["t"], ends, rows["x"], strict=True)
    ]
    table["drop"] = ("event", np.where(np.isfinite(drops), drops, np.nan))
    for name in list(table):
        noise = force_noise if name in ("force", "drop") else 0.0
        table[f"{name}_error"] = ("event", np.full(len(rows), float(noise)))
    return xr.DataTree.from_dict({"/": sampled, "/break_away": table})
