"""What a case with known numbers is, and what cases have in common: cycles, extremes, slopes, ends of a property.

To add a case: a function that returns what the package gets, under a decorator that says what is known and from where.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Chebyshev
from scipy.optimize import brentq

import stickslip as ss

Results = dict[str, float]


@dataclass(frozen=True, eq=False)
class Case:
    """What is known: `expected` by quantity, to so many significant `digits`; `missed` says why a quantity is not met."""

    name: str
    source: str
    digits: int
    expected: Results
    compute: Callable[[], Results]
    missed: dict[str, str]


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    case: str
    source: str
    quantity: str
    expected: float
    got: float
    digits: int
    missed: str

    @property
    def error(self) -> float:
        """Relative to what is expected."""
        return abs(self.got - self.expected) / abs(self.expected)

    @property
    def met(self) -> bool:
        """Whether all digits but the last agree."""
        return self.error <= 10.0 ** (1 - self.digits)


CASES: list[Case] = []


def case(
    name: str, source: str, digits: int, *, missed: dict[str, str] | None = None, **expected: float
) -> Callable[[Callable[[], Results]], Callable[[], Results]]:
    """Enter a case; the names of its quantities are words joined by underscores."""

    def enter(compute: Callable[[], Results]) -> Callable[[], Results]:
        CASES.append(Case(name, source, digits, expected, compute, missed or {}))
        return compute

    return enter


def spoken(name: str) -> str:
    """A quantity in words: ``period_at_v_1p5`` is "period at v 1.5"."""
    return re.sub(r"(\d)p(\d)", r"\1.\2", name).replace("_", " ")


@functools.cache
def rows(of: Case) -> list[Row]:
    """Compute a case, once."""
    got = of.compute()
    assert got.keys() == of.expected.keys(), f"{of.name}: {got.keys() ^ of.expected.keys()}"
    return [
        Row(of.name, of.source, spoken(name), expected, float(got[name]), of.digits, of.missed.get(name, ""))
        for name, expected in of.expected.items()
    ]


def table(of: Case) -> str:
    """A case on the page: its name, its source and its rows."""
    lines = [
        f"**{of.name}.** {of.source}\n",
        "| quantity | expected | got | relative error | met |",
        "|---|---|---|---|---|",
    ]
    for row in rows(of):
        shown = f"{row.expected:.{row.digits}g}", f"{row.got:.{row.digits}g}", f"{row.error:.0e}"
        met = "yes" if row.met else f"no: {row.missed}"
        lines.append("| " + " | ".join((row.quantity, *shown, met)) + " |")
    return "\n".join(lines) + "\n"


def belt(law: ss.laws.Law, damping: float, velocity: float, t_end: float = 60.0) -> ss.Orbit:
    """A block on a belt, from x = 0 at the velocity of the belt."""
    return ss.simulate(ss.Oscillator(damping, velocity, law), t_end)


def cycle(orbit: ss.Orbit) -> Results:
    """The last stick-slip cycle."""
    events = orbit.events
    first, last = events[events["kind"] == "release"].iloc[-2:].to_dict("records")
    capture = events[(events["kind"] == "capture") & (events["t"] > first["t"])].iloc[0]
    return {
        "start": first["t"],
        "slip_time": capture["t"] - first["t"],
        "x_at_capture": capture["x"],
        "stick_time": last["stick_time"],
        "period": last["t"] - first["t"],
        "break_away": last["force"],
    }


def extremes(orbit: ss.Orbit, start: float, end: float, of: str = "x") -> tuple[float, float]:
    """The least and the largest x or v within a time: roots of its derivative between samples."""
    times = np.linspace(start, end, 2000)
    rate = {"x": "v", "v": "a"}[of]
    slopes = orbit.to_xarray(times)[rate].to_numpy()
    roots = [
        brentq(lambda t: float(orbit.to_xarray([t])[rate][0]), times[i], times[i + 1], xtol=1e-14)
        for i in np.flatnonzero(slopes[:-1] * slopes[1:] < 0)
    ]
    found = orbit.to_xarray([start, *roots, end])[of]
    return float(found.min()), float(found.max())


def slope(function: Callable[[float], float], at: float, radius: float, nodes: int = 25) -> float:
    """The derivative of a smooth function, by Chebyshev interpolation around a point."""
    near = Chebyshev.interpolate(np.vectorize(function, otypes=[float]), nodes, [at - radius, at + radius])
    return float(near.deriv()(at))


def bisect(holds: Callable[[float], bool], low: float, high: float, steps: int = 50) -> float:
    """Where a property that holds at `low` and not at `high` ends."""
    for _ in range(steps):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return 0.5 * (low + high)


def upcrossings(orbit: ss.Orbit, w: float) -> list[float]:
    """When the slip velocity rises through w."""

    def over(t: float) -> float:
        return float(orbit.system.drive_velocity - orbit.at(t)[1] - w)

    times = np.linspace(0, orbit.t_end, 40_001)
    above = orbit.system.drive_velocity - orbit.at(times)[1] >= w
    rises = np.flatnonzero(~above[:-1] & above[1:])
    return [brentq(over, times[i], times[i + 1], xtol=1e-13) for i in rises]
