"""What a family of orbits does as a parameter changes."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stickslip.documents import did_you_mean
from stickslip.errors import InputError
from stickslip.orbit import Orbit
from stickslip.simulation import simulate
from stickslip.system import Oscillator

if TYPE_CHECKING:
    import xarray as xr

_PARAMETERS = ("drive_velocity", "damping", "mass", "stiffness")
_FIXED = ("stable_slip", "at_rest")


def orbit_diagram(
    system: Oscillator,
    parameter: str,
    values: ArrayLike,
    *,
    periods: int = 150,
    keep: int = 20,
    x0: float | None = None,
    v0: float | None = None,
    progress: Callable[[int, int], Any] | None = None,
) -> xr.Dataset:
    """Turning points, amplitude and regime of the steady motion over a parameter, each value from a fresh start.

    Parameters
    ----------
    system : the oscillator that is varied.
    parameter : ``"drive_velocity"``, ``"damping"``, ``"mass"`` or ``"stiffness"``.
    values : its values, shape (n,), in increasing order.
    periods : natural periods to run.
    keep : the last natural periods of them that are looked at; the rest is transient.
    x0, v0 : the start; default stuck on the drive at x = 0, as in :func:`stickslip.simulate`.
    progress : called as ``progress(done, n)`` after each value.

    Returns
    -------
    Dataset over `parameter` and ``point`` (as many as the busiest value has, the others filled with NaN):
    ``turning_x`` where ẋ changes sign, ``turning_slip_velocity`` where ẇ does (0 while the mass sticks), both in order
    of time, ``amplitude`` (half of max x − min x), ``w_min``, ``w_max`` and ``regime`` (:meth:`Orbit.regime`). A fixed
    point has one point.

    Raises
    ------
    InputError
        for an unknown parameter or values that make no sense.

    Limits: two turning points within 1/200 of a natural period are missed as a pair; a transient that outlasts
    `periods` − `keep` is shown as if it were steady: near a threshold, run longer. Where several motions are stable,
    the diagram shows the one that is reached from this start.

    >>> from stickslip import paper
    >>> diagram = orbit_diagram(paper.oscillator(0.3), "drive_velocity", [0.2, 0.3, 0.45])
    >>> diagram["regime"].values.tolist()
    ['stick_slip', 'almost_harmonic', 'stable_slip']
    """
    import xarray as xr

    if parameter not in _PARAMETERS:
        hint = did_you_mean(str(parameter), _PARAMETERS)
        raise InputError(f"orbit_diagram: parameter must be one of {', '.join(_PARAMETERS)}, got {parameter!r}{hint}")
    grid = np.atleast_1d(np.asarray(values, float))
    if grid.ndim != 1 or grid.size == 0 or not np.isfinite(grid).all() or (np.diff(grid) <= 0).any():
        raise InputError("orbit_diagram: values must be a list of finite numbers in increasing order")
    if not 1 <= keep < periods:
        raise InputError(f"orbit_diagram: keep must be at least 1 and less than periods ({periods}), got {keep}")
    turning: dict[str, list[NDArray[np.float64]]] = {"turning_x": [], "turning_slip_velocity": []}
    scalars: dict[str, list[Any]] = {"amplitude": [], "w_min": [], "w_max": [], "regime": []}
    for done, value in enumerate(grid.tolist(), start=1):
        changed: Any = {parameter: value}
        varied = replace(system, **changed)
        orbit = simulate(varied, periods * varied.natural_period, x0=x0, v0=v0)
        if orbit.stop != "t_end":
            raise InputError(f"orbit_diagram: the run at {parameter} = {value:g} did not end: {orbit.stop_sentence}")
        for name, row in steady_motion(orbit, keep / periods).items():
            (turning if name in turning else scalars)[name].append(row)
        if progress is not None:
            progress(done, grid.size)
    width = max(row.size for rows in turning.values() for row in rows)
    variables: dict[str, Any] = {
        name: (
            (parameter, "point"),
            np.stack([np.pad(row, (0, width - row.size), constant_values=np.nan) for row in rows]),
        )
        for name, rows in turning.items()
    }
    variables |= {name: (parameter, np.array(column)) for name, column in scalars.items()}
    dimensionless = system.mass == system.stiffness == 1 and parameter in ("drive_velocity", "damping")
    return xr.Dataset(
        variables,
        coords={parameter: grid},
        attrs={
            "title": "stickslip orbit diagram",
            "parameter": parameter,
            "units": "dimensionless" if dimensionless else "SI",
            "system": json.dumps(system.to_dict()),
            "periods": periods,
            "keep": keep,
        },
    )


def steady_motion(orbit: Orbit, fraction: float) -> dict[str, Any]:
    """Turning points, amplitude and regime in the last `fraction` of an orbit, a row of :func:`orbit_diagram`.

    Parameters
    ----------
    orbit : long enough that its last part is steady.
    fraction : in (0, 1].

    Returns
    -------
    ``turning_x``, ``turning_slip_velocity`` (arrays), ``amplitude``, ``w_min``, ``w_max`` (numbers), ``regime``.

    >>> from stickslip import paper
    >>> round(steady_motion(simulate(paper.oscillator(0.3), 600), 0.2)["amplitude"], 4)
    0.1723
    """
    regime = orbit.regime(transient=1 - fraction)
    start = (1 - fraction) * orbit.t_end
    samples = max(2, int(200 * (orbit.t_end - start) / orbit.system.natural_period))
    times = np.linspace(start, orbit.t_end, samples)

    def column(name: str, t: NDArray[np.float64]) -> NDArray[np.float64]:
        values: NDArray[np.float64] = orbit.to_xarray(t)[name].to_numpy()
        return values

    x = orbit.at(times)[0]
    w = column("slip_velocity", times)
    if regime in _FIXED:
        turning_x, turning_w = x[-1:], w[-1:]
    else:
        turns = sign_changes(lambda t: orbit.at(t)[1], times)
        turning_x = orbit.at(turns)[0]
        turns = sign_changes(lambda t: column("a", t), times)
        turning_w = column("slip_velocity", turns)
    # The extremes lie at the turning points; a sample alone would miss them by its square.
    every_x, every_w = np.append(x, turning_x), np.append(w, turning_w)
    return {
        "turning_x": turning_x,
        "turning_slip_velocity": turning_w,
        "amplitude": float(np.ptp(every_x)) / 2,
        "w_min": float(every_w.min()),
        "w_max": float(every_w.max()),
        "regime": regime,
    }


def sign_changes(
    function: Callable[[NDArray[np.float64]], NDArray[np.float64]], times: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Times where `function` changes its sign between samples, by bisection; it may jump and may rest at zero.

    Parameters
    ----------
    function : a function of time, arrays to arrays.
    times : samples in increasing order, dense enough to part the changes.

    Returns
    -------
    The times, in order; a function that rests at zero in between changes its sign where the rest begins.

    >>> sign_changes(lambda t: np.cos(t), np.linspace(0.0, 6.0, 50)).round(6).tolist()
    [1.570796, 4.712389]
    """
    signs = np.sign(function(times))
    known = np.flatnonzero(signs)
    turns = known[:-1][signs[known][:-1] != signs[known][1:]]
    following = known[1:][signs[known][:-1] != signs[known][1:]]
    low, high, before = times[turns], times[following], signs[turns]
    # Thirty halvings of a two-hundredth of a period: what is read off at an extreme is exact to the bit long before.
    for _ in range(30 if low.size else 0):
        middle = (low + high) / 2
        same = np.sign(function(middle)) == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return np.asarray(high, float)
