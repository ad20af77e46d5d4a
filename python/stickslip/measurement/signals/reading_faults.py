"""Faults of an instrument that its readings show by themselves: codes for missing values, saturation, frozen readings."""

from __future__ import annotations

import numpy as np

from stickslip.files.arrays import Array, Mask
from stickslip.measurement.signals.noise import piles_up

CODE_SPANS = 5.0
"""A value that lies outside all others by more than this many of their spans is a code."""
FEWEST_SATURATED = 20
"""Equal readings, and values beside them, that saturation must show at least."""
FROZEN = 50
"""Equal readings in a row, where no other run is longer than a tenth of this."""


def reading_faults(readings: Array, time: Array, *, noisy: bool) -> list[str]:
    """Sentences on readings that no instrument in order gives.

    Codes: some equal readings, outside all others by five times the span of those. Saturation: at the largest or the
    smallest value five times as many readings as at each of the five values next to it. Frozen: 50 equal readings in a row
    or more, where no other run has more than five. The last two are of instruments with noise: a displacement that rests
    reads the same too. Readings of zero may come of an instrument that is off, and columns whose neighbours mostly are
    equal are coarse: neither is named.

    Parameters
    ----------
    readings : (n,) as they stand in the file.
    time : (n,) of each in s.
    noisy : whether the instrument has noise at rest, as one of force or current has.

    Examples
    --------
    >>> torque = np.random.default_rng(1).standard_normal(1000)
    >>> torque[[7, 8, 300]] = -999.0
    >>> reading_faults(torque, np.arange(1000) / 100, noisy=True)[0].partition(":")[0]
    '3 readings are exactly -999, far outside all others'
    """
    codes = _codes(readings)
    said = [
        f"{np.count_nonzero(readings == value)} readings are exactly {value:g}, far outside all others: a code for missing "
        "values? give the column valid = [lowest, highest], which leaves them out, or remove these rows"
        for value in codes
    ]
    if not noisy:
        return said
    sound = ~np.isin(readings, codes)
    readings, time = readings[sound], time[sound]
    edges = np.concatenate([[0], np.flatnonzero(np.diff(readings)) + 1, [len(readings)]])
    lengths, values = np.diff(edges), readings[edges[:-1]]
    if np.median(lengths) > 1:
        return said
    ends = _ends(readings)
    for which, end in ends.items():
        at_end = readings == end
        said.append(
            f"{np.count_nonzero(at_end)} readings ({100 * at_end.mean():.2g} %) equal the {which} value, {end:g}: saturated? "
            "friction beyond it is not seen; widen the range"
        )
    long = (lengths >= FROZEN) & (values != 0) & ~np.isin(values, [*ends.values()])
    short = lengths[~np.isin(values, [0, *ends.values()]) & ~long]
    if long.any() and 10 * max(short, default=0) <= FROZEN:
        worst = int(np.argmax(np.where(long, lengths, 0)))
        start, end = time[edges[worst]], time[edges[worst] + lengths[worst] - 1]
        more = f" ({np.count_nonzero(long)} such runs in all)" if np.count_nonzero(long) > 1 else ""
        said.append(
            f"{lengths[worst]} equal readings in a row ({start:.6g} to {end:.6g} s){more}: frozen? "
            "leave that part out ([read] window)"
        )
    return said


def saturated(readings: Array) -> Mask:
    """The readings at an end of the instrument's range, as :func:`reading_faults` names them.

    >>> force = np.clip(np.random.default_rng(1).standard_normal(1000), -9, 1.5)
    >>> bool((saturated(force) == (force == 1.5)).all())
    True
    """
    edges = np.concatenate([[0], np.flatnonzero(np.diff(readings)) + 1, [len(readings)]])
    coarse = np.median(np.diff(edges)) > 1
    return np.isin(readings, [] if coarse else [*_ends(readings).values()])


def _ends(readings: Array) -> dict[str, float]:
    """The largest and the smallest reading, where it is not zero and readings pile up there."""
    found = (("largest", 1, float(readings.max())), ("smallest", -1, float(readings.min())))
    return {which: end for which, side, end in found if end != 0 and piles_up(side * readings, FEWEST_SATURATED)}


def _codes(readings: Array) -> list[float]:
    """Values at either end that lie far outside all others, two or more equal readings each."""
    values, counts = np.unique(readings, return_counts=True)
    found: list[float] = []
    while len(values) > 3 and len(found) < 2:
        below = values[1] - values[0] > CODE_SPANS * (values[-1] - values[1])
        above = values[-1] - values[-2] > CODE_SPANS * (values[-2] - values[0])
        end = 0 if below else -1
        if not (below or above) or not 2 <= counts[end] <= len(readings) / 2:
            break
        found.append(float(values[end]))
        values, counts = np.delete(values, end), np.delete(counts, end)
    return found
