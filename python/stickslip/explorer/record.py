"""A measured record as the page lays it over its panels: the samples of its slips, thinned out, and its break-aways."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from stickslip.identification.kinetic.replayed_motion import Motion
from stickslip.identification.records import FrictionRecord
from stickslip.identification.static.rows import break_away_rows, is_relative
from stickslip.laws import Coulomb, Law, StaticKinetic

#: Samples of slips that a page holds, about: some 100 kB.
SAMPLES = 3000


def record_of(record: FrictionRecord, path: str) -> dict[str, Any]:
    """The columns that the page draws and fits: of each slip every n-th sample and its last, of each stick both ends.

    Break-aways are those of :func:`stickslip.identify`: where friction drifts along the record, each force is that above
    the kinetic force of its own slip, on top of the mean kinetic force.
    """
    motion = Motion.of(record, Coulomb)
    compact = motion.record
    stuck = compact.stuck
    stride = max(1, int((~stuck).sum()) // SAMPLES)
    ends = np.flatnonzero(np.diff(stuck.astype(int)))
    kept = stuck.copy()
    kept[::stride] = kept[ends] = kept[np.minimum(ends + 1, len(stuck) - 1)] = True

    def column(values: Any) -> list[float]:
        return [float(f"{value:.5g}") for value in np.asarray(values)[kept]]

    rows = break_away_rows([record])
    force = rows["force"]
    if is_relative(rows)[0]:
        force = force - rows["level"] + rows["level"].mean()
    rows = rows.assign(force=force)[force.notna()]
    start = compact.time[0]
    x = None
    if compact.displacement is not None:
        # On the mean the spring carries the friction.
        shift = np.mean(record.force) / record.constants.get("stiffness", math.inf) - np.mean(compact.displacement)
        x = column(compact.displacement + shift)
    return {
        "name": path,
        "t": [round(float(t - start), 9) for t in compact.time[kept]],
        "w": column(np.where(stuck, 0.0, motion.slip_velocity)),
        "force": column(compact.force),
        "error": column(compact.force_error) if np.any(compact.force_error) else None,
        "stuck": stuck[kept].tolist(),
        "rate": column(motion.force_rate),
        "x": x,
        "breaks": [
            [float(f"{value:.6g}") for value in row]
            for row in rows[["stick_time", "force_rate", "force"]].to_numpy(float)
        ],
        "drive": record.constants.get("drive_velocity"),
        "file": path,
    }


def first_law(record: dict[str, Any]) -> Law:
    """A law to begin the fit with: two numbers of the record, or one where nothing broke away."""
    force, w = np.array(record["force"]), np.abs(record["w"])
    kinetic = float(f"{np.average(force, weights=w):.4g}")
    breaks = np.array([force for _, _, force in record["breaks"]])
    if not len(breaks):
        return Coulomb(kinetic)
    return StaticKinetic(break_away=max(kinetic, float(f"{breaks.mean():.4g}")), kinetic=kinetic)
