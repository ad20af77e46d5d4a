"""A simulated motion read by the rules by which the record beside it was measured.

The sticks of a simulated motion are exact. Those of a mass that creeps are not: its record counts as stuck from where the
slip velocity has fallen to half of V to where it passes it again, which near a threshold is twice as long as the rest in
between, and it counts as stick-slip only where it is slow for long enough. Two motions compare only by one rule.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pandas as pd

from stickslip.errors import number
from stickslip.identification.kinetic.replayed_motion import velocity_noise
from stickslip.identification.records import FrictionRecord
from stickslip.measurement.indirect.sticks.creeping_sticks import creeping_sticks
from stickslip.measurement.regime import regime, slow_share
from stickslip.measurement.rigs.rig import Rig
from stickslip.measurement.signals.presmooth import Presmoothed
from stickslip.measurement.signals.turning_points import find_flanks
from stickslip.model.system import Oscillator
from stickslip.simulation.orbit import Orbit


@dataclass(frozen=True)
class Reading:
    """What measuring would tell of a simulated motion.

    Attributes
    ----------
    kind : its kind, a word of `stickslip.simulation.regime_names`.
    trace : DataFrame over the samples: time, v, spring (force) and stuck.
    sticks : DataFrame over the sticks: t (their end), stick_time and drop, the fall of the spring force that follows.
    """

    kind: str
    trace: pd.DataFrame
    sticks: pd.DataFrame


def read_motion(record: FrictionRecord, orbit: Orbit, transient: float) -> Reading:
    """The simulated motion, sampled as the record is, after a part of it that is left out.

    Parameters
    ----------
    record : the record it is compared with.
    orbit : of an oscillator.
    transient : the part that is left out, in [0, 1).
    """
    system = orbit.system
    assert isinstance(system, Oscillator)
    start = transient * orbit.t_end
    times = np.minimum(np.arange(start, orbit.t_end, record.step), orbit.t_end)  # arange may overshoot its end
    data = orbit.to_xarray(times)
    x, v = data["x"].to_numpy(), data["v"].to_numpy()
    trace = pd.DataFrame({"time": times, "v": v, "spring": system.stiffness * x, "stuck": data["stuck"].to_numpy()})
    kind = orbit.regime(transient)
    # Where nothing sticks, nothing tells that the mass would not creep.
    creeps = record.attrs.get("creeps") or ("creeps" in record.attrs and not len(record.break_away))
    if not creeps or kind in ("unfinished", "diverged", "at_rest"):
        return Reading(kind, trace, _releases(orbit, system, start))
    noise = record.constants.get("noise", 0.0)
    presmoothed = Presmoothed(
        times, x, v, velocity_noise(record), record.constants.get("slip_cutoff", 0.5 / record.step), noise
    )
    speed = system.drive_velocity
    flanks = find_flanks(presmoothed, _least_drop(record))
    found = creeping_sticks(presmoothed, flanks, speed)
    w = speed - v
    slow, _ = slow_share(w, speed, noise, record.step, [stick.end - stick.start for stick in found])
    kind = regime(w, speed, slow, 0.0, 0.0, resting=False, sticks=len(found), cycles=len(flanks.limits)).kind
    if kind == "unknown":  # nothing hides the sticks of a simulated motion
        kind = "almost_harmonic"
    if kind != "stick_slip":  # as in a record, what is no stick-slip has no sticks
        found = []
    stuck = np.zeros(times.size, dtype=bool)
    for stick in found:
        a, b = np.searchsorted(times, [stick.start, stick.end])
        stuck[a : b + 1] = True
    rows = []
    for stick, after in pairwise(found):
        if stick.starts:
            b, c = np.searchsorted(times, [stick.end, after.start])
            rows.append((stick.end, stick.end - stick.start, system.stiffness * float(x[b] - x[b : c + 1].min())))
    sticks = pd.DataFrame(rows, columns=["t", "stick_time", "drop"], dtype=float)
    return Reading(kind, trace.assign(stuck=stuck), sticks)


def _least_drop(record: FrictionRecord) -> float:
    """Part of the median fall from which on the record's rig counts a slip."""
    return number("least_drop", record.rig.get("least_drop", Rig.least_drop), f"{record.name}: rig")


def _releases(orbit: Orbit, system: Oscillator, start: float) -> pd.DataFrame:
    """Releases: t, stick_time and the fall of the spring force that follows."""
    events = orbit.events
    releases = events[(events["kind"] == "release").to_numpy() & (events["t"] > start).to_numpy()]
    drops = []
    times = releases["t"].to_numpy()
    for t, x, following in zip(times, releases["x"], np.append(times, np.nan)[1:], strict=True):
        if not np.isfinite(following):
            drops.append(np.nan)
            continue
        drops.append(system.stiffness * (float(x) - float(np.min(orbit.at(np.linspace(t, following, 2000))[0]))))
    return pd.DataFrame({"t": times, "stick_time": releases["stick_time"].to_numpy(), "drop": drops})
