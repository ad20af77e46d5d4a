"""Derivatives of a motion through its events, with respect to its start and to numbers of the system."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stickslip.documents import number
from stickslip.errors import InputError
from stickslip.network import NetworkOrbit
from stickslip.orbit import Orbit
from stickslip.simulation import simulate
from stickslip.stability.trail import Trail, check, pointer
from stickslip.system import Oscillator, System

if TYPE_CHECKING:
    import xarray as xr

#: Steps of the fourth-order difference and its weights, and the step relative to the motion.
_STEPS, _WEIGHTS, _RELATIVE = (-2.0, -1.0, 1.0, 2.0), (1 / 12, -8 / 12, 8 / 12, -1 / 12), 1e-3


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
    Shape (2 n, 2 n), positions before velocities. Of one mass it is exact to rounding (but for the law's own algebra, which
    is differenced to about 10⁻¹²); of n masses, or a drive that varies, it is a fourth-order difference of exact orbits with
    one event sequence, good to about 10⁻⁸.

    Raises
    ------
    InputError
        for a time outside the orbit, or where an orbit beside it takes other events.

    Source: Aizerman & Gantmakher 1958; Müller, Chaos Solitons Fractals 5 (1995) 1671.

    >>> from stickslip.laws import Coulomb
    >>> swing = simulate(Oscillator(damping=0.0, drive_velocity=0.0, law=Coulomb(0.5)), 1.0, x0=5.3, v0=0.0)
    >>> fundamental_matrix(swing).round(6).tolist()
    [[0.540302, 0.841471], [-0.841471, 0.540302]]
    """
    end = orbit.t_end if t is None else number("t", t, "fundamental_matrix")
    if not 0 < end <= orbit.t_end:
        raise InputError(f"fundamental_matrix: t must lie in (0, {orbit.t_end:g}], got {end:g}: simulate longer")
    system: Any = orbit.system
    if isinstance(system, Oscillator) and isinstance(system.drive_velocity, float):
        trail, _, _ = _trail(orbit, end)
        return np.array(trail.follow().rates[-1][1:3, 1:3], float)
    return _differenced(orbit, end)


def sensitivities(orbit: Orbit, parameters: Sequence[str]) -> xr.Dataset:
    """How the events of an orbit move with numbers of the system, and the state at its end.

    Parameters
    ----------
    orbit : of an oscillator of one mass, from :func:`stickslip.simulate`.
    parameters : numbers of the system document, such as ``"drive_velocity"``, ``"law.kinetic"`` or ``"forcing.amplitude"``.

    Returns
    -------
    Dataset over ``event`` and ``parameter``: ``t``, ``x``, ``v``, derivatives of the time and state of each event, and over
    ``parameter``: ``x_end``, ``v_end``, those of the state at t_end. The start does not move.

    >>> from stickslip.laws import StaticKinetic
    >>> slider = Oscillator(damping=0.0, drive_velocity=0.2, law=StaticKinetic(1.0, 0.6))
    >>> moved = sensitivities(simulate(slider, 8.0), ["law.break_away"])
    >>> round(float(moved["t"].sel(event=0)[0]), 9)  # stuck, x = s t, until it reaches f_s
    5.0
    """
    import xarray as xr

    check(orbit.system, "sensitivities")
    names = list(parameters)
    trail, kinds, _ = _trail(orbit, orbit.t_end)
    columns = [trail.follow(pointer(orbit.system, name, "sensitivities")).rates[:, :3, -1] for name in names]
    rates = np.stack(columns, axis=-1)
    events = rates[: len(kinds)]
    data: dict[str, Any] = {name: (("event", "parameter"), events[:, i]) for i, name in enumerate("txv")}
    data |= {"x_end": ("parameter", rates[-1, 1]), "v_end": ("parameter", rates[-1, 2])}
    return xr.Dataset(data, coords={"parameter": names, "event": np.arange(len(kinds)), "kind": ("event", kinds)})


def _trail(orbit: Orbit, t_end: float) -> tuple[Trail, list[str], str]:
    check(orbit.system, "fundamental_matrix")
    run = orbit._network.run if isinstance(orbit, NetworkOrbit) else orbit._core.run
    x0, v0 = (None if value is None else float(np.ravel(value)[0]) for value in run[:2])
    return Trail.of_run(orbit.system, t_end, x0 or 0.0, v0, run[3])


def _differenced(orbit: Orbit, t: float) -> NDArray[np.float64]:
    system: Any = orbit.system
    masses = system.masses if isinstance(system, System) else 1
    start = np.concatenate([np.atleast_1d(part) for part in orbit.at(0.0)])
    motion = orbit.to_xarray()
    sizes = np.concatenate([np.atleast_1d(np.abs(motion[name].to_numpy()).max(axis=0)) for name in ("x", "v")])
    signature = _signature(orbit, t)
    matrix = np.zeros((2 * masses, 2 * masses))
    for column in range(2 * masses):
        step = _RELATIVE * max(float(sizes[column]), 1e-12)
        for _ in range(12):
            ends = [_moved(orbit, start, column, steps * step, t, signature) for steps in _STEPS]
            if all(end is not None for end in ends):
                break
            step /= 4
        else:
            raise InputError(
                "fundamental_matrix: orbits beside this one take other events however near they start: "
                "it lies at the border of its event sequence"
            )
        matrix[:, column] = (
            sum(weight * end for weight, end in zip(_WEIGHTS, ends, strict=True) if end is not None) / step
        )
    return matrix


def _signature(orbit: Orbit, t: float) -> list[tuple[str, int]]:
    events = orbit.events[orbit.events["t"] < t]
    return list(zip(events["kind"].astype(str), events["contact"], strict=True))


def _moved(
    orbit: Orbit, start: NDArray[np.float64], column: int, step: float, t: float, signature: list[tuple[str, int]]
) -> NDArray[np.float64] | None:
    moved = start.copy()
    moved[column] += step
    half = moved.size // 2
    single = isinstance(orbit.system, Oscillator)
    x0, v0 = (float(moved[0]), float(moved[1])) if single else (moved[:half], moved[half:])
    other = simulate(orbit.system, t, x0=x0, v0=v0)
    if _signature(other, t) != signature:
        return None
    return np.concatenate([np.atleast_1d(part) for part in other.at(t)])
