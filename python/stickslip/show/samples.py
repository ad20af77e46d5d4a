"""The samples of an orbit that a picture needs, whatever its law and its number of masses."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stickslip.laws.state_law import StateLaw
from stickslip.model.system import Oscillator
from stickslip.show.canvas import OKABE_ITO

if TYPE_CHECKING:
    import xarray as xr

    from stickslip.simulation.orbit import Orbit

#: One colour per mass of a system.
MASS_COLOURS = [OKABE_ITO[name] for name in ("blue", "orange", "green", "purple", "sky", "vermilion", "black")]


def changes(orbit: Orbit) -> NDArray[np.float64]:
    """The times at which the motion or its friction has a corner or a jump, that of the start among them."""
    contacts = (orbit.system,) if isinstance(orbit.system, Oscillator) else orbit.system.contacts
    smooth = any(isinstance(contact.law, StateLaw) for contact in contacts)
    times = orbit.events["t"] if smooth else orbit.segments["t"]
    return np.asarray(times, dtype=float)


def columns(
    orbit: Orbit, motion: xr.Dataset, name: str
) -> Iterator[tuple[int, NDArray[np.float64], NDArray[np.bool_]]]:
    """Each curve of a sampled quantity, with the number of its mass and where that sticks to a drive.

    Parameters
    ----------
    orbit : what was sampled.
    motion : its samples, from ``orbit.to_xarray``.
    name : of a variable; one of contacts (force) belongs to the mass of the contact.
    """
    values: Any = motion[name].to_numpy()
    stuck = motion["stuck"].to_numpy()
    if isinstance(orbit.system, Oscillator):
        yield 0, values, stuck
        return
    drives = {contact.mass: number for number, contact in enumerate(orbit.system.contacts) if contact.other is None}
    free = np.zeros(len(values), dtype=bool)
    masses = (
        [contact.mass for contact in orbit.system.contacts]
        if "contact" in motion[name].dims
        else range(values.shape[1])
    )
    for column, mass in enumerate(masses):
        yield mass, values[:, column], stuck[:, drives[mass]] if mass in drives else free
