"""Motion as a labelled data set: displacement, velocity and acceleration, with a cut-off and an uncertainty.

The numbers are made elsewhere: by the pieces between sticks in `signals/piecewise_fit`, reached through
`indirect/method`, and by the smoothers that know of no events in `signals/smooth`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from stickslip import _core
from stickslip.errors import InputError, did_you_mean
from stickslip.files.arrays import Array, Mask
from stickslip.measurement.indirect.method import measure_indirectly
from stickslip.measurement.instruments import InstrumentRig
from stickslip.measurement.masses import masses_of, opened
from stickslip.measurement.read import as_record
from stickslip.measurement.rigs.chain import Chain
from stickslip.measurement.rigs.rig import Rig
from stickslip.measurement.rigs.rig_file import load_rig
from stickslip.measurement.signals.smooth import Smooth, jerk_spline, kalman, savitzky_golay

METHODS = ("pieces", "spline", "savitzky_golay", "kalman")


def motion(
    record: Any,
    rig: Rig | Chain | str | Path | dict[str, Any],
    *,
    method: str = "pieces",
    cutoff: float | None = None,
    mass: int | str | None = None,
) -> xr.Dataset:
    """Displacement, velocity and acceleration of a mass on its spring.

    With ``"pieces"`` the sticks are found first and smooth pieces fitted between them, so that x'' may jump at an event.
    ``"spline"``, ``"savitzky_golay"`` and ``"kalman"`` (Rauch-Tung-Striebel) know nothing of events; they are here to be
    compared with: near a break-away they miss the friction force by about a tenth.

    Parameters
    ----------
    record, rig, mass : as for :func:`stickslip.measure`; a rig of a spring instrument.
    method : one of the four.
    cutoff : Hz, half-amplitude frequency of the smoother; default: the likeliest (for Savitzky-Golay: the one of the
        spline). The pieces choose their own.

    Returns
    -------
    Dataset over `time` (and `mass`): `x`, `v`, `a`, each with ``_error``, `stuck` (all False for the generic ones).
    Attributes: `cutoff` (Hz), `method`, `noise` (of x), `notes`, `source`, `rig`, `version`.

    Raises
    ------
    InputError
        for an unknown method, a rig without a spring, or a record that cannot be used.

    Notes
    -----
    The errors hold the noise and what smoothing leaves open, and for the pieces the uncertain time of events; the
    generic smoothers do not know of events, so their errors are too small there.

    Examples
    --------
    >>> from stickslip.measurement import Rig, motion
    >>> t = np.linspace(0, 40, 1001)
    >>> rig = Rig(instrument="displacement", column="x", unit="1", stiffness=1, mass=1, drive_velocity=1.0)
    >>> x = 0.7 * np.sin(t) + 1e-3 * np.random.default_rng(0).standard_normal(1001)
    >>> found = motion({"t": t, "x": x}, rig)
    >>> bool(np.abs(found["a"] + 0.7 * np.sin(t)).max() < 0.05)
    True
    """
    if method not in METHODS:
        raise InputError(
            f"motion: method must be one of {', '.join(METHODS)}, got {method!r}{did_you_mean(method, METHODS)}"
        )
    spring = load_rig(rig)
    if isinstance(spring, InstrumentRig):
        raise InputError(
            f"motion: a rig with a spring was expected, got the instrument {spring.instrument!r}; see ss.measure"
        )
    record = opened(record)
    masses = masses_of(record, mass)
    if isinstance(spring, Chain):
        labels = list(masses_of(record) or {})
        if masses is None or len(labels) != len(spring.rigs):
            raise InputError(f"motion: the rig has {len(spring.rigs)} masses, the record {max(len(labels), 1)}")
        rigs = [spring.rigs[labels.index(label)] for label in masses]
    else:
        rigs = [spring] * len(masses or {})
    if masses is None:
        assert isinstance(spring, Rig)
        return _smooth_motion(record, spring, method, cutoff)
    parts = [_smooth_motion(one, own, method, cutoff) for one, own in zip(masses.values(), rigs, strict=True)]
    if len(parts) == 1:
        return parts[0]
    label = xr.DataArray(list(masses), dims="mass", name="mass")
    together = xr.concat(parts, dim=label, join="outer", fill_value={"stuck": False}, combine_attrs="drop_conflicts")
    together["cutoff"] = ("mass", [part.attrs["cutoff"] for part in parts])
    together.attrs["notes"] = [
        f"mass {name}: {note}" for name, part in zip(masses, parts, strict=True) for note in part.attrs["notes"]
    ]
    return together.transpose("time", "mass", ...)


def _smooth_motion(source: Any, rig: Rig, method: str, cutoff: float | None) -> xr.Dataset:
    record = as_record(source, rig)
    if method == "pieces":
        if cutoff is not None:
            raise InputError('motion: method = "pieces" chooses its own cut-off; leave cutoff out')
        found = measure_indirectly(record, rig)
        friction, fit = found.friction, found.friction.fit
        positions = np.unique(np.concatenate(fit.knots))
        errors = [
            np.interp(friction.time, positions, fit.deviation(positions, {d: 1.0}, friction.noise)) for d in range(3)
        ]
        # the force error also knows that a sample may lie on the other side of an event
        errors[2] = np.maximum(errors[2], friction.force_error / fit.oscillator.mass)
        smooth = Smooth(
            friction.extension,
            friction.velocity,
            -friction.slip_acceleration,
            errors[0],
            errors[1],
            errors[2],
            friction.cutoff.get("slip", friction.cutoff.get("creep", float("nan"))),
            friction.noise,
        )
        return _data(friction.time, smooth, friction.stuck, found.notes, record.source, rig, method)
    x = (record.signal - rig.rest) * rig.force_unit
    if rig.instrument == "spring_force":
        x = x / rig.stiffness
    if method == "savitzky_golay":
        if cutoff is None:
            cutoff = jerk_spline(record.time, x, record.weight).cutoff
        smooth = savitzky_golay(record.time, x, cutoff)
    else:
        smooth = (
            kalman(record.time, x, cutoff, record.weight)
            if method == "kalman"
            else jerk_spline(record.time, x, record.weight, cutoff)
        )
    warned = [*record.notes, "this smoother knows no events: near them it misses the acceleration"]
    return _data(record.time, smooth, np.zeros(len(x), dtype=bool), warned, record.source, rig, method)


def _data(time: Array, s: Smooth, stuck: Mask, notes: list[str], source: str, rig: Rig, method: str) -> xr.Dataset:
    units = rig.units
    data = xr.Dataset(coords={"time": ("time", time, {"units": units.time})})
    for name, unit, values, error in (
        ("x", units.length, s.x, s.x_error),
        ("v", units.speed, s.v, s.v_error),
        ("a", units.acceleration, s.a, s.a_error),
    ):
        data[name] = ("time", values, {"units": unit})
        data[f"{name}_error"] = ("time", error, {"units": unit})
    data["stuck"] = ("time", stuck)
    data.attrs = {
        "method": method,
        "cutoff": s.cutoff,
        "noise": s.noise,
        "notes": notes,
        "source": source,
        "rig": rig.to_toml(),
        "command": "stickslip.measurement.motion",
        "version": _core.__version__,
    }
    return data
