"""A user's own friction law, turned once into linear pieces with a stated error: nothing of it is called in a run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from stickslip.errors import InputError, number, positive
from stickslip.files.arrays import Array
from stickslip.laws.piecewise_linear import PiecewiseLinear

#: The share of the error that goes to sampling.
_SHARE = 0.1
_FIRST = 4096
_GOLDEN = (5**0.5 - 1) / 2
_MOST_SAMPLES = 400_000
_MOST_NODES = 20_000


def from_function(
    f: Callable[[Any], Any] | ArrayLike,
    w_max: float | None = None,
    break_away: float | None = None,
    error: float = 1e-4,
) -> PiecewiseLinear:
    """A law of linear pieces from a function or a table of the kinetic force.

    Parameters
    ----------
    f : the kinetic force over the slip speed: a function of one number (or array), or a table of two columns, slip speed
        (from 0, increasing) and force, shape (n, 2).
    w_max : the largest slip speed that will occur; beyond it the last slope goes on. Default for a table: its end.
    break_away : f_s, at least f(0); default f(0).
    error : the largest deviation from f on [0, w_max], in the unit of force.

    Returns
    -------
    PiecewiseLinear.

    Raises
    ------
    InputError
        where f is neither, gives anything but finite numbers, or cannot be met: it jumps, or needs too many nodes.

    How the error is bounded: of `error`, a tenth goes to a fine sampling, split until f at the three quarter points of every
    interval lies within half of that from the chord (an estimate: a feature narrower than w_max/10,000 can be missed), and
    the rest to leaving samples out, which is exact. A table is taken as linear between its rows: there the bound is exact.

    >>> import numpy as np
    >>> law = from_function(lambda w: 0.5 + 0.5 * np.exp(-w / 0.1), w_max=1.0)
    >>> len(law.nodes)
    55
    """
    # The laws export this function.
    bound = positive("error", error, "from_function")
    if callable(f):
        if w_max is None:
            raise InputError("from_function: w_max is missing; give the largest slip speed that will occur")
        w, force = _sample(f, positive("w_max", w_max, "from_function"), _SHARE * bound)
        allowed = (1 - _SHARE) * bound
    else:
        w, force = _table(f, w_max)
        allowed = bound
    keep = _thin(w, force, allowed)
    if len(keep) > _MOST_NODES:
        raise InputError(f"from_function: an error of {bound:g} needs {len(keep)} nodes: allow a larger error")
    nodes = tuple((float(w[i]), float(force[i])) for i in keep)
    return PiecewiseLinear(nodes=nodes, break_away=nodes[0][1] if break_away is None else break_away)


#: What a function may raise where it was not made for its argument.
_TROUBLE = (ArithmeticError, LookupError, TypeError, ValueError)


def evaluate(f: Callable[[Any], Any], w: Array, where: str, name: str = "f") -> Array:
    """The function at all slip speeds, at once or singly."""
    # What is not finite is refused below, so numpy need not warn of it.
    with np.errstate(all="ignore"):
        try:
            given = np.asarray(f(w))
        except _TROUBLE:
            # A function of one number only.
            given = np.empty(0)
        if given.shape != w.shape:
            singly = []
            for item in w.tolist():
                try:
                    singly.append(f(item))
                except _TROUBLE as problem:
                    raise InputError(
                        f"{where}: {name} must give a number for a number, got the error: {problem} at w = {item:g}"
                    ) from None
            given = np.asarray(singly)
    try:
        if np.iscomplexobj(given):
            raise TypeError("complex numbers")
        values: Array = given.astype(float)
    except (TypeError, ValueError) as problem:
        raise InputError(f"{where}: {name} must give a number for a number, got the error: {problem}") from None
    bad = ~np.isfinite(values)
    if bad.any():
        raise InputError(f"{where}: {name} must be finite on [0, w_max], got {values[bad][0]} at w = {w[bad][0]:g}")
    return values


def uneven(top: float) -> Array:
    """Slip speeds from 0 to `top`, so uneven that no wave hides between them."""
    index = np.arange(1, _FIRST)
    return np.concatenate([[0.0], (index - 0.5 * (index * _GOLDEN % 1)) / _FIRST, [1.0]]) * top


def _sample(f: Callable[[Any], Any], top: float, allowed: float) -> tuple[Array, Array]:
    w = uneven(top)
    force = evaluate(f, w, "from_function")
    done_w, done_force = [w], [force]
    low, high, f_low, f_high = w[:-1], w[1:], force[:-1], force[1:]
    count = len(w)
    while len(low):
        inner = low + np.array([[0.25], [0.5], [0.75]]) * (high - low)
        values = evaluate(f, inner.ravel(), "from_function").reshape(inner.shape)
        chord = f_low + np.array([[0.25], [0.5], [0.75]]) * (f_high - f_low)
        split = np.abs(values - chord).max(axis=0) > 0.5 * allowed
        if not split.any():
            break
        count += 3 * int(split.sum())
        narrowest = float((high - low)[split].min())
        if narrowest < 1e-15 * top or count > _MOST_SAMPLES:
            where = float(low[split][np.argmin((high - low)[split])])
            raise InputError(
                f"from_function: an error of {allowed / _SHARE:g} is out of reach near w = {where:g}, where f jumps "
                "or is too steep: allow a larger error or smooth f"
            )
        inner, values = inner[:, split], values[:, split]
        done_w.append(inner.ravel())
        done_force.append(values.ravel())
        edges = np.vstack([low[split], inner, high[split]])
        heights = np.vstack([f_low[split], values, f_high[split]])
        low, high = edges[:-1].ravel(), edges[1:].ravel()
        f_low, f_high = heights[:-1].ravel(), heights[1:].ravel()
    w, force = np.concatenate(done_w), np.concatenate(done_force)
    order = np.argsort(w)
    return w[order], force[order]


def table(given: Any, where: str, most: int = 2) -> tuple[Array, ...]:
    """The columns of a table: slip speed from 0 on, force, and the slope where `most` is 3 and it is there."""
    try:
        rows = np.asarray(given, float)
    except (TypeError, ValueError):
        rows = np.empty(0)
    if rows.ndim != 2 or not 2 <= rows.shape[1] <= most or len(rows) < 2:
        third = " or three (slip speed, force, slope)" if most == 3 else ""
        raise InputError(
            f"{where}: f must be a function of the slip speed, or a table of two columns (slip speed, force){third} and at "
            f"least two rows, got {type(given).__name__}"
        )
    if not np.isfinite(rows).all():
        row = int(np.flatnonzero(~np.isfinite(rows).all(axis=1))[0])
        raise InputError(f"{where}: the table must be finite, got {rows[row].tolist()} in row {row} (counted from 0)")
    w = rows[:, 0]
    if w[0] != 0 or (np.diff(w) <= 0).any():
        raise InputError(f"{where}: the slip speeds of the table must start at 0 and increase; sort its rows")
    return tuple(rows.T)


def _table(given: Any, w_max: float | None) -> tuple[Array, Array]:
    w, force = table(given, "from_function")
    if w_max is not None:
        top = number("w_max", w_max, "from_function")
        if not 0 < top <= w[-1]:
            raise InputError(f"from_function: w_max must lie in (0, {w[-1]:g}], the end of the table, got {top:g}")
        inside = w < top
        w, force = np.append(w[inside], top), np.append(force[inside], np.interp(top, w, force))
    return w, force


def _thin(w: Array, force: Array, allowed: float) -> list[int]:
    """Samples that suffice: from each the farthest other from which no sample between deviates more than `allowed`.

    A chord may run to a sample if its slope lies in every wedge that the samples between leave open.
    """
    keep = [0]
    start, lowest, highest, last = 0, -np.inf, np.inf, 0
    i = 1
    while i < len(w):
        run = w[i] - w[start]
        slope = (force[i] - force[start]) / run
        if lowest <= slope <= highest:
            last = i
        lowest = max(lowest, (force[i] - allowed - force[start]) / run)
        highest = min(highest, (force[i] + allowed - force[start]) / run)
        i += 1
        if lowest > highest or i == len(w):
            keep.append(last)
            if last == len(w) - 1:
                break
            start, lowest, highest = last, -np.inf, np.inf
            i = last + 1
    return keep
