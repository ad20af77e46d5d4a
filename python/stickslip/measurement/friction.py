"""The arrow from a record and its rig to a friction record; the force itself is computed in `indirect/force.py`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from stickslip.errors import InputError
from stickslip.files.equality import each_once
from stickslip.measurement.indirect.break_away_table import break_aways
from stickslip.measurement.indirect.method import Measured, measure_indirectly
from stickslip.measurement.instruments import INSTRUMENTS, InstrumentRig
from stickslip.measurement.instruments.instrument import noted, same_samples
from stickslip.measurement.masses import masses_of, opened
from stickslip.measurement.read import Record, as_record
from stickslip.measurement.result import friction_tree
from stickslip.measurement.rigs.chain import Chain, pull_together
from stickslip.measurement.rigs.rig import TURNS, Rig
from stickslip.measurement.rigs.rig_file import load_rig


def measure(
    record: Any, rig: Rig | Chain | InstrumentRig | str | Path | dict[str, Any], *, mass: int | str | None = None
) -> xr.DataTree:
    """Friction force, slip velocity and break-aways of a record.

    For a mass on a spring friction = k x + D x' + m x'' and w = V - x' (the indirect method). The sticks are found first
    and the derivatives are taken from smooth pieces between them, so that nothing is smeared across an event. Other
    instruments (`stickslip.measurement.INSTRUMENTS`) have their own way to friction; which one, the rig's `instrument` says.

    Parameters
    ----------
    record : path of a MATLAB (v5), CSV/text, JSON, look or netCDF file, or an xarray Dataset, a pandas DataFrame or a
        dict of (n,) arrays that holds the rig's columns. A motion file or Dataset with a dimension `mass` holds several
        records. For instruments that compare runs, a list of these.
    rig : a `Rig`, an `InstrumentRig`, the path of a rig TOML, or its table. Where its stiffness is a matrix, the masses
        pull on each other, and the friction on each is taken from the motion of all.
    mass : number (from 0) or label of the mass of a motion file; default: all of them.

    Returns
    -------
    DataTree. For a motion with several masses, one such tree as a child ``mass_<label>`` each. Else the root has
    `slip_velocity`, `slip_acceleration`, `force`, `force_error`, `stuck`, `displacement`, `velocity` over `time` (those
    that the instrument can give), and with the indirect method `recorded`, the displacement before any smoothing, NaN where a
    sample was left out. Child ``break_away``: `t`, `stick_time`, `force_rate`, `force`, `drop` and their ``_error``
    over `event`; other instruments add ``steady``, friction over slip velocity. Attributes of the root: `source`, `rig`
    (TOML), `command`, `version`, `notes` (what was assumed, corrected or found inconsistent, one sentence each), `regime`,
    `main_line` and `main_line_error` (Hz), `slow_share` (of the time with |w| < 0.2 V) and `stuck_share`, and the constants
    that were used: `stiffness`, `mass`, `damping`, `drive_velocity`, `inertia`, `weight`; `break_away_late`, the
    standard error in s by which all break-aways of the record may be early or late together (it is in their errors too);
    `low_pass`, the time constant in s of a filter ahead of the converter that the noise shows, 0 where it shows none;
    `force_common`, the standard error that all forces of the record share (it is in `force_error` too);
    `scale_error`, the relative error that all lengths share, where a motion states one; for other instruments the names
    in `facts`.

    Raises
    ------
    InputError
        one sentence, for a record or rig that cannot be used.

    Notes
    -----
    The drive velocity is constant and the slip in one sense. `force_error` holds the noise and what smoothing leaves
    open, not the errors of the rig's own constants; those that the record contradicts stand in `notes`.

    Examples
    --------
    A free oscillation of a dimensionless oscillator, with some noise: there is no friction to be found.

    >>> from stickslip.measurement import Rig, measure
    >>> t = np.linspace(0, 40, 1001)
    >>> x = 0.7 * np.sin(t)
    >>> rig = Rig(instrument="displacement", column="x", unit="1", stiffness=1, mass=1, drive_velocity=1.0)
    >>> friction = measure({"t": t, "x": x + 1e-3 * np.random.default_rng(0).standard_normal(1001)}, rig)
    >>> friction.attrs["regime"], bool(np.abs(friction["force"]).max() < 0.05)
    ('almost_harmonic', True)
    """
    rig = load_rig(rig)
    if isinstance(rig, InstrumentRig):
        instrument = INSTRUMENTS[rig.instrument]
        records = record if isinstance(record, list | tuple) else [record]
        if not records:
            raise InputError("measure: a record or a list of records was expected, got an empty list")
        samples = each_once((instrument.read(one, rig) for one in records), same_samples, lambda one: one.source, noted)
        tree = instrument.measure(samples, rig)
        if scale_error := max(one.scale_error for one in samples):
            tree.attrs["scale_error"] = scale_error
        return tree
    spring = rig.rigs[0] if isinstance(rig, Chain) else rig
    if isinstance(record, list | tuple):
        if len(record) != 1:
            raise InputError(
                f"measure: a {spring.instrument} rig measures one record at a time, got {len(record)}; measure each by itself"
            )
        record = record[0]
    record = opened(record)
    if isinstance(rig, Chain):
        return _measure_chain(record, rig, mass)
    masses = masses_of(record, mass)
    if masses is not None:
        trees = {f"mass_{label}": measure(one, rig) for label, one in masses.items()}
        if len(trees) == 1 or mass is not None:
            return next(iter(trees.values()))
        return xr.DataTree.from_dict({f"/{name}": tree for name, tree in trees.items()})
    if mass is not None:
        raise InputError(
            f"measure: mass = {mass!r} asks for one mass of a motion, and the record has no dimension mass"
        )
    recorded = as_record(record, rig)
    return _tree(recorded, rig, measure_indirectly(recorded, rig))


def _measure_chain(record: Any, chain: Chain, mass: int | str | None) -> xr.DataTree:
    wanted = masses_of(record, mass)
    masses = masses_of(record)
    if wanted is None or masses is None or len(masses) != len(chain.rigs):
        count = "a record of one" if masses is None else f"a motion of {len(masses)}"
        raise InputError(f"measure: the rig has {len(chain.rigs)} masses that pull on each other, got {count}")
    trees = {}
    for (label, one), rig in zip(masses.items(), chain.rigs, strict=True):
        recorded = as_record(one, rig)
        trees[f"mass_{label}"] = _tree(recorded, rig, measure_indirectly(recorded, rig, alone=False))
    trees = pull_together(trees, chain)
    if mass is not None:
        return trees[f"mass_{next(iter(wanted))}"]
    return xr.DataTree.from_dict({f"/{name}": tree for name, tree in trees.items()})


def _tree(record: Record, rig: Rig, found: Measured) -> xr.DataTree:
    f, o, units = found.friction, found.friction.fit.oscillator, rig.units
    recorded = np.where(f.fit.weight > 0, o.drive_velocity * (f.time - f.time[0]) - f.fit.path, math.nan)
    known = found.regime != "unknown"  # of a motion whose kind cannot be told the sticks are not known
    return friction_tree(
        series={
            "time": (f.time, units.time),
            "slip_velocity": (f.slip_velocity, units.speed),
            "slip_acceleration": (f.slip_acceleration, units.acceleration),
            "force": (f.force, units.force, "friction force"),
            "force_error": (f.force_error, units.force),
            "stuck": (f.stuck, "1"),
            "displacement": (f.extension, units.length, "extension of the spring"),
            "velocity": (f.velocity, units.speed),
            "recorded": (recorded, units.length, "extension with the instrument's own noise"),
        },
        tables={"break_away": break_aways(f, found.sticks, units)},
        source=record.source,
        rig=rig.to_toml(),
        notes=found.notes,
        facts={
            "regime": found.regime,
            "slips": sum(stick.ends for stick in found.sticks) if known else math.nan,
            "stuck_share": float(np.mean(f.stuck)) if known else math.nan,
            "slow_share": found.slow,
            "main_line": found.line.frequency,
            "main_line_error": found.line.error,
            "stiffness": o.stiffness,
            "inertia": o.mass,
        },
        constants={
            "creeps": int(not found.resting),
            "saturated": found.saturated,
            "mass": rig.mass,
            "damping": o.damping,
            "drive_velocity": o.drive_velocity,
            "weight": math.nan if units == TURNS else rig.mass * rig.gravity,
            "noise": f.noise,
            "break_away_late": f.late,
            "low_pass": f.low_pass,
            "force_common": f.common,
            "slip_cutoff": f.cutoff.get("slip", math.nan),
            "creep_cutoff": f.cutoff.get("creep", math.nan),
            **({"scale_error": record.scale_error} if record.scale_error else {}),
        },
    )
