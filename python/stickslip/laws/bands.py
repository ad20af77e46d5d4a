"""Friction of a law with its 95 % band, from the covariance of the fitted numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.laws.law import Law

if TYPE_CHECKING:
    import pandas as pd

BAND = (0.025, 0.975)
DRAWS = 1000
"""Laws of which a band is drawn."""
SPEEDS = 100
"""Slip velocities of a table in each direction."""
TIMES = 21
"""Stick times of a table."""


def drawn(law: Law) -> list[Law]:
    """Laws drawn from the covariance of a fitted one; an InputError where it has none that can be drawn from."""
    return law._drawn(DRAWS, seed=0, mirrored=True)


def band(laws: list[Law], force: Callable[[Law], Array]) -> tuple[Array, Array]:
    """Lower and upper end of the middle 95 % of what these laws say."""
    low, high = np.quantile(np.asarray([force(one) for one in laws]), BAND, axis=0)
    return low, high


def friction_table(
    law: Law, slip_velocity: npt.ArrayLike = (), stick_time: npt.ArrayLike = (), force_rate: float = 0.0
) -> pd.DataFrame:
    """Friction over slip velocity and static friction over stick time, each with the 95 % band of the fit.

    The band holds at each point 95 % of 1000 laws, drawn as :meth:`~stickslip.laws.Law.sample` does, in pairs that lie on
    either side of the law: where friction is linear in its numbers, so does the band.

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
        where the law has no covariance, or one that cannot be drawn from, or a slip velocity is 0 or not finite.

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

    low, high = band(drawn(law), force)
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
