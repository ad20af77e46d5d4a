"""Friction of a law with its 95 % band, from the covariance of the fitted numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.laws.law import Law

if TYPE_CHECKING:
    import pandas as pd

BAND = (0.025, 0.975)
HALF_WIDTH = 1.959964
"""Of the middle 95 % of a normal distribution, in its standard deviations."""
DRAWS = 1000
"""Laws of which a band is drawn."""
CUT = 0.025
"""Share of them that limits may cut off: with more the rest lies to one side, and the law of the fit at the edge of it."""
NEAR = 1e-3
"""Standard errors by which a law is moved to see how its force changes."""
SPEEDS = 100
"""Slip velocities of a table in each direction."""
TIMES = 21
"""Stick times of a table."""


@dataclass(frozen=True)
class Likely:
    """The laws that may as well be as a fitted one.

    Attributes
    ----------
    law : the fitted one.
    drawn : drawn by its covariance, in pairs that lie on either side of it; none where limits cut off more than `CUT`.
    beside : the law `NEAR` it on either side along each direction in which its numbers vary; None where that is beyond a
        limit.
    """

    law: Law
    drawn: list[Law]
    beside: list[tuple[Law | None, Law | None]]

    @classmethod
    def of(cls, law: Law) -> Likely:
        """Those by the covariance of a law; an InputError where it has none, or one that leaves no other law."""
        spread, normal = law._spread(), np.random.default_rng(0)
        count = len(spread.names)
        vectors = [sign * one for one in normal.standard_normal((DRAWS // 2, count)) for sign in (1.0, -1.0)]
        found = [one for one in map(spread.at, vectors) if one is not None]
        if len(found) >= (1 - CUT) * DRAWS:
            return cls(law, found, [])
        steps = NEAR * np.eye(count)
        beside = [(spread.at(step), spread.at(-step)) for step in steps]
        if not any(one is not None for pair in beside for one in pair):
            raise InputError(
                f"the numbers of this {type(law).__name__} lie beyond their limits, so it has no 95 % band; fit it again, or "
                "hold some of them (fixed)"
            )
        return cls(law, [], beside)

    def band(self, force: Callable[[Law], Array]) -> tuple[Array, Array]:
        """Lower and upper end of the middle 95 % of what these laws say.

        They are quantiles of the drawn ones. Where limits cut off many of those, as those of a scale that is not told from 0,
        the ends are 1.96 standard errors off the force of the fit, by how it changes with the numbers near them: the record
        knows the force far better than single numbers. To a side on which a number has its limit it changes nothing.
        """
        if self.drawn:
            low, high = np.quantile(np.asarray([force(one) for one in self.drawn]), BAND, axis=0)
            return low, high
        middle = np.asarray(force(self.law), dtype=float)
        below, above = np.zeros_like(middle), np.zeros_like(middle)
        for pair in self.beside:
            moved = [np.zeros_like(middle) if one is None else (force(one) - middle) / NEAR for one in pair]
            above += np.max([*moved, np.zeros_like(middle)], axis=0) ** 2
            below += np.min([*moved, np.zeros_like(middle)], axis=0) ** 2
        return middle - HALF_WIDTH * np.sqrt(below), middle + HALF_WIDTH * np.sqrt(above)


def friction_table(
    law: Law, slip_velocity: npt.ArrayLike = (), stick_time: npt.ArrayLike = (), force_rate: float = 0.0
) -> pd.DataFrame:
    """Friction over slip velocity and static friction over stick time, each with the 95 % band of the fit.

    The band holds at each point 95 % of 1000 laws, drawn as :meth:`~stickslip.laws.Law.sample` does, in pairs that lie on
    either side of the law: where friction is linear in its numbers, so does the band. Where limits of the numbers cut off
    more than one in 40 of them, those left lie to one side: the band is then 1.96 standard errors on either side of the law,
    to first order in its numbers.

    Parameters
    ----------
    law : with a covariance: of an identification, or loaded from its law file.
    slip_velocity : w, shape (n,), not 0: f(w) has the sign of w (:meth:`~stickslip.laws.Law.kinetic_force`).
    stick_time : t_s at rest, shape (m,): break-away force f_s(t_s, δ).
    force_rate : δ of the break-away force.

    Returns
    -------
    DataFrame, n + m rows: slip_velocity (0 at rest), stick_time (NaN while slipping), force, low, high, in the units of the
    law.

    Raises
    ------
    InputError
        where the law has no covariance, or one that leaves no other law, or a slip velocity is 0 or not finite.

    Limits: the band is that of the law's form and of the errors of the fit alone.

    >>> import pandas as pd
    >>> from stickslip.laws import StaticKinetic
    >>> covariance = pd.DataFrame([[1e-4]], index=["kinetic"], columns=["kinetic"])
    >>> law = StaticKinetic(1.0, 0.6).with_covariance(covariance)
    >>> friction_table(law, [-0.2, 0.2], [0.0]).round(2).to_numpy().tolist()
    [[-0.2, nan, -0.6, -0.62, -0.58], [0.2, nan, 0.6, 0.58, 0.62], [0.0, 0.0, 1.0, 1.0, 1.0]]
    """
    import pandas as pd

    w, times = (np.atleast_1d(np.asarray(values, dtype=float)) for values in (slip_velocity, stick_time))
    wrong = [*w[~np.isfinite(w) | (w == 0)], *times[~(times >= 0)]]
    if wrong:
        raise InputError(
            f"friction_table: expected slip velocities that are finite and not 0 and stick times from 0, got {wrong[0]:g}; "
            "give stick times for friction at rest"
        )

    def force(one: Law) -> Array:
        return np.concatenate([one.kinetic_force(w), one.break_away_force(times, force_rate)])

    low, high = Likely.of(law).band(force)
    columns = {
        "slip_velocity": np.concatenate([w, np.zeros(times.size)]),
        "stick_time": np.concatenate([np.full(w.size, np.nan), times]),
        "force": force(law),
        "low": low,
        "high": high,
    }
    return pd.DataFrame(columns)


def table_up_to(
    law: Law,
    most: float,
    force: str | None,
    velocity: str | None,
    time: str | None,
    least: float = 0.0,
    ways: Sequence[float] = (-1.0, 1.0),
) -> pd.DataFrame:
    """The law as a table with bands: friction from a slowest to a fastest |w|, and at rest.

    Parameters
    ----------
    law : with a covariance.
    most, least : limits of |w| > 0; the slowest is at least a ten-thousandth of the fastest.
    ways : signs of w, the negative first; both by default.
    force, velocity, time : units that stand behind the names of the columns; None where one is not known.

    Returns
    -------
    DataFrame as of :func:`friction_table`; at rest one row where the law has no memory of it.
    """
    speeds = np.geomspace(max(least, 1e-4 * most), most, SPEEDS)
    grows = law.break_away_force(1e12) > law.break_away_force(0.0)
    times = np.linspace(0.0, long_rest(law), TIMES) if grows else np.zeros(1)
    table = friction_table(law, np.concatenate([way * speeds[:: int(way)] for way in ways]), times)
    units = {"slip_velocity": velocity, "stick_time": time, **dict.fromkeys(("force", "low", "high"), force)}
    return table.rename(columns={name: f"{name} ({unit})" for name, unit in units.items() if unit})


def long_rest(law: Law) -> float:
    """Four times the rest beyond which a tenfold rest adds less than half of what has grown; 1 where nothing grows."""
    times = np.geomspace(1e-9, 1e12, 2101)
    grown = law.break_away_force(times) - law.break_away_force(0.0)
    slows = (grown > 0) & (law.break_away_force(10 * times) - law.break_away_force(times) < 0.5 * grown)
    return 4 * float(times[np.argmax(slows)]) if slows.any() else 1.0
