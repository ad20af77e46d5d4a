"""The look that all pictures share: colours, axes, labels with their unit."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from cycler import cycler
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter
from numpy.typing import ArrayLike, NDArray

from stickslip.errors import InputError
from stickslip.model.parameters import is_dimensionless

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

    from stickslip.model.system import Oscillator, System

#: The palette of Okabe and Ito (2008): told apart with every kind of colour vision, and in grey.
OKABE_ITO = {
    "black": "#000000",
    "orange": "#E69F00",
    "sky": "#56B4E9",
    "green": "#009E73",
    "yellow": "#F0E442",
    "blue": "#0072B2",
    "vermilion": "#D55E00",
    "purple": "#CC79A7",
    "grey": "#999999",
}

#: One colour per mass of a system.
MASS_COLOURS = [OKABE_ITO[name] for name in ("blue", "orange", "green", "purple", "sky", "vermilion", "black")]

#: One colour per mode of the automaton, the same in every picture.
MODE_COLOURS = {
    "stick": OKABE_ITO["vermilion"],
    "slip_forward": OKABE_ITO["blue"],
    "slip_backward": OKABE_ITO["purple"],
}

#: One colour per regime, the same in every picture: that of its mode, where it has one.
REGIME_COLOURS = {
    "stick_slip": MODE_COLOURS["stick"],
    "almost_harmonic": MODE_COLOURS["slip_forward"],
    "stable_slip": OKABE_ITO["green"],
    "reversing_slip": MODE_COLOURS["slip_backward"],
    "at_rest": OKABE_ITO["grey"],
    "diverged": OKABE_ITO["black"],
    "unfinished": OKABE_ITO["yellow"],
}

#: One line for motions that are stable (True), unstable (False) and marginal (None).
LINES: dict[bool | None, Any] = {True: "-", False: (0, (3, 2)), None: (0, (1, 1.5))}

#: One colour per direction of a sweep; what all directions share is grey.
DIRECTION_COLOURS = {"up": OKABE_ITO["orange"], "down": OKABE_ITO["sky"], "fresh": OKABE_ITO["black"]}

#: Slip that grows and slip that falls, in a law that depends on it and in a record.
SPEED_COLOURS = {"|w| grows": OKABE_ITO["orange"], "|w| falls": OKABE_ITO["sky"]}

# The symbol of a parameter and the kind of quantity that it is, for axes.
_PARAMETERS = {
    "drive_velocity": ("drive velocity s", "velocity"),
    "damping": ("damping D", "damping"),
    "mass": ("mass m", "mass"),
    "stiffness": ("stiffness k", "stiffness"),
    "forcing.amplitude": ("forcing amplitude u₀", "force"),
    "forcing.frequency": ("forcing frequency η", "frequency"),
    "x": ("position x at t = 0", "position"),
    "v": ("velocity ẋ at t = 0", "velocity"),
}

#: One after another, of what has no colour of its own.
COLOURS = [OKABE_ITO[name] for name in ("blue", "vermilion", "green", "purple", "orange", "sky")]

#: What makes a figure fit for print; in force where a picture makes its own figure.
STYLE: Any = {
    "figure.figsize": (4.2, 3.2),
    "figure.dpi": 120,
    "figure.constrained_layout.use": True,
    "savefig.dpi": 300,
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.labelsize": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "axes.prop_cycle": cycler(color=COLOURS),
    "axes.edgecolor": "0.35",
    "axes.titlelocation": "left",
    "axes.titleweight": "medium",
    "axes.formatter.useoffset": False,
    "xtick.color": "0.25",
    "ytick.color": "0.25",
    "lines.linewidth": 1.3,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "svg.hashsalt": "stickslip",
}

FEW_DECADES = 300.0
"""Ratio of the ends up to which a logarithmic axis names more than its powers of ten."""

#: Where a legend never lies on data: above the axes.
ABOVE: Any = {
    "loc": "lower left",
    "bbox_to_anchor": (0.0, 1.0),
    "borderaxespad": 0.2,
    "handletextpad": 0.4,
    "fontsize": 8,
    "frameon": False,
}

_HYPHENATED = {
    "stick_slip": "stick-slip",
    "almost_harmonic": "almost-harmonic",
    "reversing_slip": "reversing slip",
}

_SI = {
    "position": "m",
    "velocity": "m/s",
    "force": "N",
    "time": "s",
    "force rate": "N/s",
    "frequency": "rad/s",
    "damping": "N s/m",
    "mass": "kg",
    "stiffness": "N/m",
}
#: Of a joint or a drill string, where position is an angle and force a torque.
_TORSIONAL = _SI | {
    "position": "rad",
    "velocity": "rad/s",
    "force": "N m",
    "force rate": "N m/s",
    "damping": "N m s/rad",
    "mass": "kg m^2",
    "stiffness": "N m/rad",
}
_UNITS = {"SI": _SI, "torsional": _TORSIONAL, "dimensionless": dict.fromkeys(_SI, "dimensionless")}


def verbatim(name: str) -> str:
    r"""A name that somebody else has chosen, as a picture shows it: what stands between dollars is no formula.

    >>> print(verbatim("run $2.nc"))
    run \$2.nc
    """
    return name.replace("$", r"\$")


def axes(ax: Axes | None = None) -> Axes:
    """`ax` itself, or the only axes of a new figure in our style."""
    return new_axes()[0] if ax is None else ax


@contextmanager
def styled() -> Iterator[None]:
    """What is drawn inside has our style.

    The backend is loaded before: that of a notebook sets ``interactive`` when it is, which would be taken back at the end,
    and no later picture would be shown.
    """
    plt.draw_if_interactive()  # type: ignore[no-untyped-call]
    with plt.rc_context(STYLE):
        yield


def new_axes(rows: int = 1, columns: int = 1, **options: Any) -> list[Axes]:
    """The axes of a new figure in our style, row by row; `options` go to ``plt.subplots``."""
    with styled():
        _, grid = plt.subplots(rows, columns, squeeze=False, **options)
    return list(grid.flat)


def shade_sticks(ax: Axes, time: NDArray[np.float64], stuck: NDArray[np.bool_]) -> None:
    """Shade the time in which the contact sticks, and name it for a legend.

    Parameters
    ----------
    ax : axes over time.
    time, stuck : shape (n,).
    """
    ax.fill_between(
        time, 0, 1, where=stuck, transform=ax.get_xaxis_transform(), color=MODE_COLOURS["stick"], alpha=0.14, lw=0,
        label="stuck", zorder=0,
    )  # fmt: skip


def label(quantity: str, kind: str, units: str) -> str:
    """An axis label, the name of the quantity with its unit.

    Parameters
    ----------
    quantity : name and symbol.
    kind : ``"position"``, ``"velocity"``, ``"force"``, ``"time"``, ``"frequency"`` and so on.
    units : ``"dimensionless"``, ``"SI"`` or, where position is an angle and force a torque, ``"torsional"``.

    >>> label("slip velocity w", "velocity", "SI"), label("friction F", "force", "torsional")
    ('slip velocity w (m/s)', 'friction F (N m)')
    """
    if units not in _UNITS:
        raise InputError(f"show: units must be one of {', '.join(map(repr, _UNITS))}, got {units!r}")
    return f"{quantity} ({_UNITS[units][kind]})"


def unit(values: xr.DataArray) -> str:
    """The unit of measured values, as it stands behind their name.

    >>> import xarray as xr
    >>> "time t" + unit(xr.DataArray(0.0, attrs={"units": "s"}))
    'time t (s)'
    """
    return in_units(values.attrs.get("units", "1"))


def logarithmic_x(axes: Axes, values: ArrayLike) -> None:
    """Lay positive values that span more than half a decade over their logarithm, named at 1, 2 and 5 where decades are few.

    >>> axes = new_axes()[0]
    >>> logarithmic_x(axes, [0.4, 8.0])
    >>> axes.get_xscale(), [f"{tick:g}" for tick in axes.get_xticks() if 0.4 < tick < 8]
    ('log', ['0.5', '1', '2', '5'])
    """
    known = np.asarray(values, float)
    known = known[np.isfinite(known)]
    if not (known.size and known.min() > 0 and known.max() > 3 * known.min()):
        return  # a logarithmic axis of less has no whole power on it
    axes.set_xscale("log")
    if known.max() < FEW_DECADES * known.min():
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes.xaxis.set_minor_formatter(NullFormatter())


def in_units(name: str | None) -> str:
    """A unit as it stands behind the name of a quantity; nothing where it is not known.

    >>> in_units("N"), in_units("1"), in_units(None)
    (' (N)', ' (dimensionless)', '')
    """
    return "" if name is None else f" ({'dimensionless' if name == '1' else name})"


def parameter_label(parameter: str, units: str) -> str:
    """An axis label for a number of the system document.

    >>> parameter_label("drive_velocity", "SI"), parameter_label("law.break_away", "SI")
    ('drive velocity s (m/s)', 'law: break away')
    """
    if parameter in _PARAMETERS:
        return label(*_PARAMETERS[parameter], units)
    return ": ".join(words(part) for part in parameter.split("."))


def units_of(system: Oscillator | System, units: str | None) -> str:
    """`units` where given; else dimensionless for mass = stiffness = 1, or for several masses of 1, and SI for any other.

    >>> from stickslip import paper
    >>> units_of(paper.oscillator(0.3), None)
    'dimensionless'
    """
    if units is not None:
        return units
    return "dimensionless" if is_dimensionless(system) else "SI"


def words(name: str) -> str:
    """A name of the code as the words of the paper.

    >>> words("almost_harmonic"), words("stable_slip")
    ('almost-harmonic', 'stable slip')
    """
    return _HYPHENATED.get(name, name.replace("_", " "))
