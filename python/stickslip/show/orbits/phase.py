"""The phase plane of an orbit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

import numpy as np

from stickslip.errors import InputError
from stickslip.show.canvas import ABOVE, LINES, MASS_COLOURS, MODE_COLOURS, OKABE_ITO, axes, label, units_of
from stickslip.show.orbits.series import changes, columns

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from stickslip.dynamics.periodic.periodic_orbits import PeriodicOrbit
    from stickslip.simulation.orbit import Orbit


def phase_plane(
    orbit: Orbit | PeriodicOrbit,
    ax: Axes | None = None,
    *,
    transient: float = 0.5,
    show_transient: bool = True,
    colour: str = MODE_COLOURS["slip_forward"],
    name: str | None = None,
    units: str | None = None,
) -> Axes:
    """Draw velocity over position: the steady part in full colour, sticks thick, the transient faded.

    Parameters
    ----------
    orbit : any orbit, or a periodic one, of which one period is drawn: dashed if it is unstable, dotted if it is marginal.
        Of several masses each has a colour of its own, in which its sticks are thick.
    ax : axes to draw into; default a new figure.
    transient : the fraction of the orbit that counts as transient, in [0, 1).
    show_transient : whether it is drawn.
    colour, name : of the steady part of one mass, for a legend.
    units : ``"dimensionless"``, ``"SI"`` or ``"torsional"``; default by the system.

    Returns
    -------
    The axes. A steady part that does not move is drawn as a dot.
    """
    if not 0 <= transient < 1:
        raise InputError(f"phase_plane: transient must lie in [0, 1), got {transient}")
    ax = axes(ax)
    line = LINES[True]
    if not hasattr(orbit, "to_xarray"):
        line, orbit, transient = LINES[orbit.stable], orbit.orbit, 0.0
    orbit = cast("Orbit", orbit)
    system, start = orbit.system, transient * orbit.t_end
    # Events belong to the curve: without them a short stick or a corner could fall between two samples.
    times = np.union1d(orbit.times(), np.append(changes(orbit), start))
    motion = orbit.to_xarray(times)
    late = times >= start
    which = units_of(system, units)
    ax.set(xlabel=label("position x", "position", which), ylabel=label("velocity ẋ", "velocity", which))
    many = motion["x"].ndim > 1
    for (mass, x, stuck), (_, v, _) in zip(columns(orbit, motion, "x"), columns(orbit, motion, "v"), strict=True):
        if show_transient and transient > 0:
            early = times <= start
            faint: dict[str, Any] = {"color": OKABE_ITO["grey"], "lw": 0.6, "alpha": 0.55, "zorder": 1}
            ax.plot(x[early], v[early], **faint, rasterized=early.sum() > 20_000)
        own = MASS_COLOURS[mass % len(MASS_COLOURS)] if many else colour
        text = f"mass {mass}" if many else name
        extent = max(np.ptp(x), np.ptp(v), 1e-300)
        if max(np.ptp(x[late]), np.ptp(v[late])) < 2e-3 * extent:
            ax.plot(x[-1], v[-1], "o", ms=4, color=own, label=text, zorder=3)
        else:
            ax.plot(x[late], v[late], color=own, ls=line, label=text, zorder=2, rasterized=late.sum() > 20_000)
        # While it sticks, the mass moves with the drive.
        held = late & stuck
        if held.any():
            thick: dict[str, Any] = {
                "color": own if many else MODE_COLOURS["stick"],
                "lw": 2.6,
                "ls": line,
                "zorder": 3,
            }
            ax.plot(np.where(held, x, np.nan), np.where(held, v, np.nan), **thick)
    contacts = [
        contact for contact in getattr(system, "contacts", (system,)) if getattr(contact, "other", None) is None
    ]
    for speed in {contact.drive_velocity for contact in contacts if isinstance(contact.drive_velocity, float)}:
        ax.axhline(speed, color=OKABE_ITO["grey"], lw=0.6, ls="--", zorder=0)
    if many:
        ax.legend(**ABOVE, ncols=5)
    return ax
