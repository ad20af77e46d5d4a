"""Sections of a motion, and the maps from one return to the next."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stickslip import _core
from stickslip.errors import InputError
from stickslip.files.checks import did_you_mean, number, numbers, time_limit, whole_number
from stickslip.laws.state_law import StateLaw
from stickslip.model.drive import Drive
from stickslip.model.parameters import is_dimensionless
from stickslip.model.system import Oscillator, System
from stickslip.simulation.orbit import Orbit
from stickslip.simulation.simulate import simulate

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]

#: Sections by a word, beside the kinds of events.
NAMED = ("strobe", "maximum", "minimum")


@dataclass(frozen=True)
class Surface:
    """What makes a section: times `start` + n `period`, events of a `kind`, or normal · (x, ẋ, ẍ) = level."""

    kind: str | None = None
    period: float | None = None
    start: float = 0.0
    normal: tuple[float, float, float] | None = None
    level: float = 0.0
    direction: int = 0

    def to_dict(self) -> dict[str, Any]:
        """The document for the core."""
        if self.kind is not None:
            return {"event": self.kind}
        if self.period is not None:
            return {"strobe": {"period": self.period, "start": self.start}}
        return {"plane": {"normal": self.normal, "level": self.level, "direction": self.direction}}


def forcing_frequency(system: Oscillator | System) -> float | None:
    """The frequency of the first force that varies or, without one, of a drive or a normal force; none where nothing does.

    >>> from stickslip import Drive, Oscillator, laws
    >>> forcing_frequency(Oscillator(0.1, Drive.shaken(0.2, 0.05, 1.3), laws.Coulomb(0.5)))
    1.3
    """
    return next((float(harmonic.frequency) for harmonic in system.swings), None)


def usual_surface(system: Oscillator | System) -> Surface:
    """The stroboscopic section of a forced system, the maxima of x of another.

    >>> from stickslip import paper
    >>> usual_surface(paper.oscillator(0.3)).direction
    -1
    """
    frequency = forcing_frequency(system)
    if frequency is not None:
        return Surface(period=2 * np.pi / frequency)
    return Surface(normal=(0.0, 1.0, 0.0), direction=-1)


def surface_from(
    system: Oscillator | System,
    on: str | None,
    *,
    normal: ArrayLike | None = None,
    level: float = 0.0,
    direction: int = 0,
    period: float | None = None,
    start: float = 0.0,
    where: str = "section",
) -> Surface:
    """The surface that the words and numbers of :func:`section` name.

    >>> from stickslip import paper
    >>> surface_from(paper.oscillator(0.3), "release").kind
    'release'
    """
    if normal is not None:
        factors = np.asarray(normal, float)
        if on is not None or factors.shape != (2,) or not np.isfinite(factors).all() or not factors.any():
            raise InputError(
                f"{where}: normal must be two numbers (of x and v), not both 0, and on be left out; got {normal!r}"
            )
        if direction not in (-1, 0, 1):
            raise InputError(f"{where}: direction must be 1 (rising), -1 (falling) or 0 (both), got {direction!r}")
        return Surface(
            normal=(float(factors[0]), float(factors[1]), 0.0),
            level=number("level", level, where),
            direction=direction,
        )
    if on is None and period is None:
        return usual_surface(system)
    if on in ("maximum", "minimum"):
        return Surface(normal=(0.0, 1.0, 0.0), direction=-1 if on == "maximum" else 1)
    if on in (None, "strobe"):
        every = usual_surface(system).period if period is None else number("period", period, where)
        if every is None:
            raise InputError(
                f"{where}: this system has no forcing; say the period of the stroboscopic section, period=..."
            )
        if every <= 0:
            raise InputError(f"{where}: period must be greater than 0, got {every:g}")
        return Surface(period=every, start=number("start", start, where))
    if on not in _core.KINDS:
        known = (*NAMED, *_core.KINDS)
        raise InputError(f"{where}: on must be one of {', '.join(known)}, got {on!r}{did_you_mean(str(on), known)}")
    return Surface(kind=on)


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
    if not 0 <= transient < 1:
        raise InputError(f"section: transient must lie in [0, 1), got {transient}")
    for name, count in (("most", most), ("max_events", max_events)):
        whole_number(name, count, "section")
    time_limit(max_seconds, "section")
    contact_of(system, contact, "section")
    if system.integrated:
        orbit = simulate(system, end, x0, v0, max_events, max_seconds)
        points, stopped = points_of(orbit, surface, transient * end, contact)[-most:], orbit.stop
    else:
        masses = system.masses if isinstance(system, System) else 1
        begin, velocity = _start(x0, v0, masses)
        run = (begin, velocity, end, max_events)
        try:
            points, stopped = _core.section(
                system.core, json.dumps(surface.to_dict()), run, contact, transient * end, most, max_seconds
            )
        except ValueError as error:
            raise InputError(f"section: {error}") from None
    t, x, v, slip, *event = points.T
    drive = system.drive_velocity if isinstance(system, Oscillator) else system.contacts[contact].drive_velocity
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


def contact_of(system: Oscillator | System, contact: int, where: str) -> int:
    """The contact that is looked at, if the system has it.

    >>> from stickslip import paper
    >>> contact_of(paper.oscillator(0.3), 0, "example")
    0
    """
    count = len(system.contacts) if isinstance(system, System) else 1
    if isinstance(contact, bool) or not isinstance(contact, int) or not 0 <= contact < count:
        raise InputError(f"{where}: contact must be a number from 0 to {count - 1}, got {contact!r}")
    return contact


def _start(x0: ArrayLike | None, v0: ArrayLike | None, masses: int) -> list[list[float] | None]:
    pairs = (("x0", x0), ("v0", v0))
    return [None if value is None else numbers(name, value, masses, "section", "mass") for name, value in pairs]


def points_of(orbit: Orbit, surface: Surface, after: float, contact: int = 0) -> Array:
    """The points of a section of an orbit that is there already, rows t, x, v, w, force, stick_time, force_rate.

    >>> from stickslip import paper
    >>> points_of(simulate(paper.oscillator(0.2), 40), Surface(kind="release"), 0).shape
    (3, 7)
    """
    return orbit._points(json.dumps(surface.to_dict()), surface.kind, contact, after, 2**31)


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

    >>> from stickslip import paper
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
    if isinstance(lag, bool) or not isinstance(lag, int) or lag < 1:
        raise InputError(f"return_map: lag must be a whole number of at least 1, got {lag!r}")
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
