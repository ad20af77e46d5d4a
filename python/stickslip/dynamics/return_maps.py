"""Maps of a motion: from one point of a section to the next, and from one release to the next."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from stickslip import _core
from stickslip.errors import InputError, did_you_mean, whole_number
from stickslip.laws.state_law import StateLaw
from stickslip.model.system import Oscillator

if TYPE_CHECKING:
    import xarray as xr


def return_map(points: xr.Dataset, quantity: str = "x", *, lag: int = 1) -> xr.Dataset:
    """The map from one return to the section to the next, q_n → q_{n + lag}, as the motion visits it.

    Parameters
    ----------
    points : from :func:`section`.
    quantity : one of its variables, such as ``"x"``, ``"slip_velocity"``, ``"phase"`` or ``"stick_time"``; ``"interval"`` is
        the time between two returns.
    lag : returns from the first to the second, ≥ 1.

    Returns
    -------
    Dataset over ``pair``: ``before`` and ``after``.

    Raises
    ------
    InputError
        for a quantity that the section has not, or too few points.

    >>> from stickslip import paper, section
    >>> pairs = return_map(section(paper.oscillator(0.2), "release", t_end=400), "interval")
    >>> round(float(pairs["after"][-1]), 9)
    10.594340817
    """
    import xarray as xr

    if quantity == "interval":
        values = np.diff(points["t"].to_numpy())
    elif quantity in points:
        values = points[quantity].to_numpy()
    else:
        known = [*map(str, points), "interval"]
        hint = did_you_mean(str(quantity), known)
        raise InputError(f"return_map: quantity must be one of {', '.join(known)}, got {quantity!r}{hint}")
    whole_number("lag", lag, "return_map")
    if len(values) <= lag:
        raise InputError(f"return_map: the section has {len(values)} values, a pair needs {lag + 1}: simulate longer")
    units = points["t" if quantity == "interval" else quantity].attrs.get("units", "1")
    data = {"before": ("pair", values[:-lag], {"units": units}), "after": ("pair", values[lag:], {"units": units})}
    return xr.Dataset(data, attrs={"title": "stickslip return map", "quantity": quantity, "lag": lag})


def release_map(system: Oscillator, phase: ArrayLike, *, side: int = 1, periods: float = 100.0) -> xr.Dataset:
    """The one-dimensional map of stick-slip: from the phase of the forcing at one release to that at the next.

    Where adhesion breaks, ẋ = s and k x + D s − A cos θ = ± f_s: the phase θ is all that is free. From each θ the motion runs
    to its next release.

    Parameters
    ----------
    system : an oscillator on a constant drive with one harmonic force, of a law whose static friction is constant: one of
        pieces or a smooth one.
    phase : phases θ = Ωt + φ at the first release, rad, shape (n,).
    side : 1 for a release in the direction of the drive (the friction force is + f_s), −1 against it.
    periods : forcing periods after which a release counts as missing.

    Returns
    -------
    Dataset over ``phase``: ``image`` (the phase at the next release in [0, 2π)), ``time`` until then, ``stick_time`` before
    it, ``side`` of it, ``slope`` dθ'/dθ from neighbours. All are NaN where adhesion would not break at θ (its load falls), or
    never again.

    Raises
    ------
    InputError
        without forcing, or for a law that remembers: whose static friction changes with stick time or force rate, whose
        kinetic friction remembers the release, or that has an internal state. Its map has more than one dimension; look at
        :func:`return_map` of a section there.

    Source: Feeny & Moon (1994) and Galvanetto & Bishop (1999) use such maps.

    >>> from stickslip import Harmonic, Oscillator, laws
    >>> belt = Oscillator(damping=0.0, drive_velocity=0.3, law=laws.StaticKinetic(1.0, 0.5), forcing=Harmonic(0.2, 0.9))
    >>> release_map(belt, [4.0, 4.5])["image"].round(6).values.tolist()
    [1.612504, 1.795546]
    """
    import xarray as xr

    if (
        not isinstance(system, Oscillator)
        or [bool(harmonic.frequency) for harmonic in system.harmonics] != [True]
        or not isinstance(system.drive_velocity, float)
        or system.normal_force is not None
    ):
        raise InputError(
            "release_map: expected one mass on a constant drive with one harmonic force and a constant normal force; write a "
            "shaken drive as a forcing, and look at return_map of a section where the normal force varies"
        )
    adhesion = system.law
    if isinstance(adhesion, StateLaw):
        raise InputError(
            f"release_map: {type(adhesion).__name__} has an internal state, so its motion has no releases; look at "
            "return_map of a section"
        )
    limits = adhesion.break_away_force([0.0, 1.0, 1e6], [0.0, 1.0, 0.0])
    if np.ptp(limits) > 0:
        raise InputError(
            f"release_map: the static friction of {type(adhesion).__name__} depends on stick time or force rate, so its map "
            "has more than one dimension; look at return_map of a section"
        )
    if side not in (-1, 1):
        raise InputError(f"release_map: side must be 1 or -1, got {side!r}")
    angles = np.atleast_1d(np.asarray(phase, float))
    if angles.ndim != 1 or not np.isfinite(angles).all():
        raise InputError("release_map: phase must be a list of finite numbers")
    forcing, s, limit = system.harmonics[0], system.drive_velocity, float(limits[0])
    image, lasts, stick_time, sides = np.full((4, angles.size), np.nan)
    surface = json.dumps({"event": "release"})
    for index, theta in enumerate(angles.tolist()):
        shifted = system.core.with_number("/forcing/0/phase", theta)
        # The load k x + D s − A cos θ must grow in the direction of the friction that holds it.
        rate = system.stiffness * s + forcing.amplitude * forcing.frequency * np.sin(theta)
        if side * rate <= 0:
            continue
        x = (side * limit - system.damping * s + forcing.amplitude * np.cos(theta)) / system.stiffness
        run = ([x], [s], 2 * np.pi / forcing.frequency * periods, 1_000)
        table, _ = _core.section(shifted, surface, run, 0, 0.0, 1_000, None)
        # Rounding may put the first release at once or leave it out.
        later = table[table[:, 0] > 1e-9 * system.natural_period]
        if len(later):
            lasts[index], stick_time[index], sides[index] = later[0, 0], later[0, 5], np.sign(later[0, 4])
            image[index] = np.mod(theta + forcing.frequency * later[0, 0], 2 * np.pi)
    slope = np.gradient(np.unwrap(image), angles) if angles.size > 1 else np.full(angles.size, np.nan)
    data = {"image": image, "time": lasts, "stick_time": stick_time, "side": sides, "slope": slope}
    return xr.Dataset(
        {name: ("phase", column) for name, column in data.items()},
        coords={"phase": angles},
        attrs={"title": "stickslip release map", "system": json.dumps(system.to_dict())},
    )
