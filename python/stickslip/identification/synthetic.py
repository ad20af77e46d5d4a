"""A friction record of a simulated orbit, as a measurement without the indirect method would give it."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from stickslip.documents import number
from stickslip.errors import InputError
from stickslip.orbit import Orbit


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
    displacement_noise : standard deviation of the white noise in ``recorded``, the displacement as a gauge gives it; 0
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
    for what, noise in (("force_noise", force_noise), ("displacement_noise", displacement_noise)):
        if number(what, noise, "friction_of_orbit") < 0:
            raise InputError(f"friction_of_orbit: {what} must not be negative, got {noise}")
    t = np.asarray(times, float)
    random = np.random.default_rng(seed)
    sampled = orbit.to_xarray(t).rename(x="displacement", v="velocity").drop_vars("a")
    sampled["force"] = sampled["force"] + force_noise * random.standard_normal(t.size)
    sampled["force_error"] = ("time", np.full(t.size, float(force_noise)))
    if displacement_noise > 0:
        gauge = np.random.default_rng([seed, 1]).standard_normal(t.size)
        sampled["recorded"] = sampled["displacement"] + displacement_noise * gauge
    system = orbit.system
    sampled.attrs = {
        "source": f"simulated {type(system.law).__name__}, drive velocity {system.drive_velocity:g}, seed {seed}",
        "mass": system.mass,
        "damping": system.damping,
        "stiffness": system.stiffness,
        "drive_velocity": system.drive_velocity,
        "notes": [],
    }
    events = orbit.events
    begun = (events["t"] - events["stick_time"]).to_numpy() > t[0]
    rows = events[(events["kind"] == "release").to_numpy() & begun & (events["t"] <= t[-1]).to_numpy()]
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
