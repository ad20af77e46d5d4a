"""How a drive goes from one speed to the next, and whether the displacement is its own or that of the sample."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import xarray as xr

from stickslip.files.arrays import Array
from stickslip.identification.estimator.least_squares import project_out

GAP = 0.3
"""Ramp of the drive from one speed to the next, as a part of the shorter hold, above which it is no step."""
ON_SAMPLE = -0.8
"""Correlation of displacement and friction after the steps, below which the displacement is that of the sample."""


def ramp_of(time: Array, x: Array, at: float, begin: float, end: float) -> tuple[float, float]:
    """When a drive begins to change its speed and how long it takes (s); (at, 0) where no even ramp stands out.

    Of an even ramp over T the displacement lies |V₂ − V₁| T / 8 above (below) the lines of the two holds where they cross, a
    quarter of that T / 4 before and after.
    """
    old, new = at - begin, end - at
    windows = (begin + 0.25 * old, at - 0.2 * old), (at + 0.2 * new, end - 0.25 * new)
    parts = [slice(*np.searchsorted(time, window).tolist()) for window in windows]
    if min(part.stop - part.start for part in parts) < 8:
        return at, 0.0
    lines = [np.polyfit(time[part] - at, x[part], 1) for part in parts]
    noise = max(
        float(np.std(x[part] - np.polyval(line, time[part] - at))) for part, line in zip(parts, lines, strict=True)
    )
    change = float(lines[1][0] - lines[0][0])
    if change == 0:
        return at, 0.0
    crossing = at + float((lines[0][1] - lines[1][1]) / change)

    def off(when: float) -> float:
        line = lines[0] if when < crossing else lines[1]
        return math.copysign(1.0, change) * (float(np.interp(when, time, x)) - float(np.polyval(line, when - at)))

    lasts = 8 * off(crossing) / abs(change)
    sample = float(np.median(np.diff(time[parts[0].stop : parts[1].start + 1])))
    if off(crossing) < 5 * noise or not 4 * sample < lasts < GAP * min(old, new):
        return at, 0.0
    sides = [off(crossing + side * lasts / 4) / off(crossing) for side in (-1, 1)]
    return (crossing - lasts / 2, lasts) if all(0.1 < side < 0.45 for side in sides) else (at, 0.0)


def notes_if_behind_spring(tree: xr.DataTree, table: pd.DataFrame) -> list[str]:
    """That the displacement lags behind an even drive as friction rises: it is then measured behind the machine's spring."""
    time, x, friction = (tree[name].to_numpy() for name in ("time", "displacement", "force"))
    found = []
    for at, begin, end in table[["t", "begin", "end"]].to_numpy().tolist():
        later = slice(*np.searchsorted(time, [at + ramp_of(time, x, at, begin, end)[1], end]).tolist())
        if later.stop - later.start < 8:
            continue
        even = project_out(np.column_stack([np.ones(later.stop - later.start), time[later] - at]))
        lag, change = even(x[later]), even(friction[later])
        sizes = float(lag @ lag), float(change @ change)
        if min(sizes) > 0:
            found.append((float(lag @ change) / math.sqrt(sizes[0] * sizes[1]), math.sqrt(sizes[1] / sizes[0])))
    if not found or (middle := float(np.median([one[0] for one in found]))) > ON_SAMPLE:
        return []
    spring = float(np.median([one[1] for one in found])) * abs(middle)
    return [
        "the displacement lags behind an even drive as friction rises, as that of a sample behind a spring of about "
        f"{spring:.2g} (friction per m): it is not that of the load point, from which the fit takes the path, so the numbers "
        "are off by more than their errors; give the rig the column of the load point's displacement"
    ]


def notes_on_ramps(lasts: list[float], paths: list[float]) -> list[str]:
    """That the drive takes its time at a step, and how it is fitted."""
    if not max(lasts) > 0:
        return []
    return [
        f"the drive takes up to {max(lasts):.2g} s ({max(paths):.2g} m of its path) to change its speed in "
        f"{sum(one > 0 for one in lasts)} of the steps: fitted as even ramps; a sudden step tells a and length better"
    ]
