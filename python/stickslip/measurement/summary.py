"""What a person reads of a measured friction: each fact with its error, in its unit."""

from __future__ import annotations

import re

import xarray as xr

from stickslip.files.units import rounded, unit_of
from stickslip.measurement.result import facts

DIMENSIONS = {
    "force": r"(\w+_)?(force|drop|torque)|lowest|highest|residual|offset|weight|in_run_deviation|drive|force_per_decade",
    "length": r"(lowest|highest)_slip|rest",
    "velocity": r"\w+_speed|drive_velocity",
    "time": r"period|recurrence|\w*stick_time|\w+_delay|clock_offset",
    "time^-1": r"main_line|cutoff|\w+_cutoff",
    "force time^-1": r"force_rate",
    "force velocity^-1": r"viscous|damping",
    "force velocity^-2": r"quadratic",
    "stiffness": r"(spring_)?stiffness",
    "force time^2 length^-1": r"(fitted_|subtracted_)?(mass|inertia)",
}
"""Dimension -> the names of the facts that have it; all others are counts, shares and words."""


def summary(friction: xr.DataTree) -> dict[str, str]:
    """The facts of a measured friction as texts, mass by mass where there are several.

    Parameters
    ----------
    friction : what :func:`stickslip.measure` gives.

    Returns
    -------
    name -> the value, its standard error where one is known, and its unit unless it is dimensionless.

    >>> from tempfile import TemporaryDirectory
    >>> import stickslip as ss
    >>> from stickslip.examples import copy_example
    >>> with TemporaryDirectory() as folder:
    ...     _ = copy_example(folder)
    ...     found = summary(ss.measure(f"{folder}/block.csv", f"{folder}/block.toml"))
    >>> found["main_line"], found["stiffness"], found["slips"]
    ('2.706 ± 0.084 Hz', '600 N/m', '11')
    """
    return {
        name: f"{text} {unit}".removesuffix(" 1").strip() for name, (text, unit) in texts_and_units(friction).items()
    }


def texts_and_units(friction: xr.DataTree) -> dict[str, tuple[str, str]]:
    """The facts of :func:`summary`: each value with its error, and its unit apart, "" for what is a count, share or word."""
    if "facts" not in friction.attrs:
        parts = {name.removeprefix("mass_"): texts_and_units(child) for name, child in friction.children.items()}
        return {f"{mass} {name}": text for mass, part in parts.items() for name, text in part.items()}
    force, time, speed = (_unit(friction, name) for name in ("force", "time", "slip_velocity"))
    length = speed.split("/")[0] if speed != "1" else "rad" if force.endswith("N m") else "1" if force == "1" else "m"
    found = facts(friction)
    errors = {value: name for name in found for value in values_of(name)}
    texts = {}
    for name, value in found.items():
        if set(values_of(name)) & set(found):
            continue
        unit = next(
            (unit_of(of, force, length, time) for of, names in DIMENSIONS.items() if re.fullmatch(names, name)), ""
        )
        error = float(found[errors[name]]) if name in errors else 0.0
        text = value if isinstance(value, str) else rounded(value, error)
        texts[name] = text, "Hz" if unit == "1/s" else unit
    return texts


def values_of(name: str) -> tuple[str, ...]:
    """The facts of which one of this name would be the standard error.

    >>> values_of("force_error"), values_of("forward_error"), values_of("force")
    (('force', 'force_force'), ('forward', 'forward_force'), ())
    """
    value = name.removesuffix("_error")
    return () if value == name else (value, f"{value}_force")


def _unit(friction: xr.DataTree, name: str) -> str:
    """The unit of a quantity in whichever table of the record has it; "1" where none says it."""
    names = {"time": ("time", "t")}.get(name, (name,))
    tables = [friction.to_dataset(), *(child.to_dataset(inherit=False) for child in friction.children.values())]
    columns = [table[one] for table in tables for one in names if one in table.variables]
    return next((str(column.attrs["units"]) for column in columns if "units" in column.attrs), "1")
