"""Many runs of one oscillator or system over parameters and starts, on all cores."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from stickslip import _core
from stickslip.errors import InputError, did_you_mean, fits, fraction, number, time_limit, whole_number
from stickslip.model.parameters import axis_of, document_of, path_in
from stickslip.model.system import Oscillator, System

if TYPE_CHECKING:
    import xarray as xr


def simulate_many(
    system: Oscillator | System,
    over: Mapping[str, ArrayLike],
    t_end: float,
    *,
    transient: float = 0.5,
    section: str | None = None,
    keep: int = 32,
    max_events: int = 10_000_000,
    max_seconds: float | None = None,
    workers: int | None = None,
    progress: Callable[[int, int], Any] | None = None,
) -> xr.Dataset:
    """Simulate every combination of parameters and starts and keep only what is asked for.

    Parameters
    ----------
    system : the oscillator or the system of masses that is varied.
    over : values by name, each shape (n,): a number of the system document such as ``"drive_velocity"``,
        ``"forcing.amplitude"`` or ``"law.kinetic"``, or the start ``"x0"``, ``"v0"``; of a system such as
        ``"contacts.0.drive_velocity"``, ``"stiffness.0.1"``, and the start of a mass ``"x0.1"``. All combinations are run.
    t_end : time to run each.
    transient : the fraction of each run whose events do not count, in [0, 1).
    section : a kind of event, such as ``"release"``, whose last `keep` occurrences are kept.
    keep : how many.
    max_events : the most events of each run.
    max_seconds : time on the clock > 0 after which all runs that are not done end where they are, with the stop
        ``"max_seconds"``; default none.
    workers : threads; default all cores. The result does not depend on it.
    progress : called as ``progress(done, n)`` after each block of runs.

    Returns
    -------
    Dataset over the names of `over`: ``x`` and ``v`` at t_end (of a system over ``mass``), ``events`` (a number for each
    ``kind``, after the transient), ``stick_time`` (the mean, NaN where nothing sticks), ``stop``; and with a section
    ``section_t``, ``section_x`` and ``section_v`` over ``point``, the last events in time, NaN where there are fewer. Of a
    system events and sections are those of all contacts, x and v those of the contact's mass.

    Raises
    ------
    InputError
        for an unknown name or a value that makes no sense; nothing is returned then.
    KeyboardInterrupt
        by Ctrl-C, at once; what has run is lost.

    Limits: runs that go side by side differ from those of :func:`stickslip.simulate` by rounding, which a chaotic motion
    makes large. They do not depend on each other, on `workers` or on the processor.

    >>> from stickslip import paper
    >>> runs = simulate_many(paper.oscillator(0.3), {"drive_velocity": [0.2, 0.3], "x0": [0.0, 0.5]}, t_end=400)
    >>> (runs["events"].sel(kind="release") > 0).values.tolist()
    [[True, True], [False, False]]
    """
    import xarray as xr

    if system.integrated:
        raise InputError("simulate_many: laws with an internal state are integrated one by one; run simulate in a loop")
    if not over:
        raise InputError("simulate_many: over is empty; name at least one parameter or start to vary")
    fraction("transient", transient, "simulate_many")
    if section is not None and section not in _core.KINDS:
        hint = did_you_mean(section, _core.KINDS)
        raise InputError(f"simulate_many: section must be one of {', '.join(_core.KINDS)}, got {section!r}{hint}")
    for name, count in (("keep", keep), ("max_events", max_events), ("workers", workers or 1)):
        whole_number(name, count, "simulate_many")
    time_limit(max_seconds, "simulate_many")
    axes = {name: axis_of(name, values, "simulate_many") for name, values in over.items()}
    held = keep if section else 0
    runs = math.prod(values.size for values in axes.values())
    fits(
        runs * (len(axes) + 2 * system.masses + len(_core.KINDS) + 2 + 3 * held),
        "simulate_many",
        "lower keep, or run the combinations in parts",
    )
    document = document_of(system)
    paths = [_path(name, document) for name in axes]
    grid = np.stack([mesh.ravel() for mesh in np.meshgrid(*axes.values(), indexing="ij")], axis=1)
    end = number("t_end", t_end, "simulate_many")
    try:
        table = _core.batch(
            json.dumps(document),
            paths,
            np.ascontiguousarray(grid.ravel()),
            (end, transient * end, max_events),
            section,
            held,
            workers or os.cpu_count() or 1,
            max_seconds,
            progress,
        )
    except ValueError as error:
        raise InputError(f"simulate_many: {error}") from None
    dims = list(axes)
    shape = tuple(values.size for values in axes.values())
    columns = {name: column.reshape(*shape, *column.shape[1:]) for name, column in table.items()}
    counts = columns["events"]
    releases = counts[..., _core.KINDS.index("release")]
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(releases > 0, columns["stick_time"] / releases, np.nan)
    over_masses = [*dims, "mass"] if isinstance(system, System) else dims
    x, v = (columns[name] if isinstance(system, System) else columns[name][..., 0] for name in "xv")
    data: dict[str, Any] = {
        "x": (over_masses, x),
        "v": (over_masses, v),
        "events": ([*dims, "kind"], counts.astype(np.int64)),
        "stick_time": (dims, mean),
        "stop": (dims, np.array(_core.STOPS)[columns["stop"]]),
    }
    if section:
        data |= {name: ([*dims, "point"], columns[name]) for name in ("section_t", "section_x", "section_v")}
    attrs = {"system": json.dumps(system.to_dict()), "t_end": end, "transient": transient, "section": section or ""}
    return xr.Dataset(data, coords={**axes, "kind": _core.KINDS}, attrs=attrs)


def _path(name: str, document: Mapping[str, Any]) -> str:
    """The path of a name in the document; starts stay as they are."""
    head, _, mass = name.partition(".")
    if head in ("x0", "v0") and "contacts" in document and not mass.isdigit():
        raise InputError(f"simulate_many: {name!r} must name a mass of the system, such as {head}.0")
    return path_in(name, document, "simulate_many")
