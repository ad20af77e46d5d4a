"""A law sharpened by the agreement of whole motions: the steady motion it makes, laid over each measured one."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.optimize import least_squares
from scipy.stats import norm

from stickslip.errors import InputError
from stickslip.identification.parameters import check_names, limits, value, with_values
from stickslip.identification.uncertainty import correlation_time
from stickslip.simulation import simulate
from stickslip.system import Oscillator

if TYPE_CHECKING:
    from stickslip.identification.fit import Identification
    from stickslip.identification.records import FrictionRecord
    from stickslip.laws import Law

Array = npt.NDArray[np.float64]

TRANSIENT = 25.0
"""Natural periods that the simulated motion is given to settle."""
SHARES = (0.1, 0.2, 0.5, 1.0)
"""Shares of each record that are fitted one after the other."""
SAMPLES = 4000
"""Samples of a record that are compared, evenly thinned."""


class _Target:
    """The steady end of one record, and the oscillator that should make it."""

    def __init__(self, record: FrictionRecord, settled_after: float) -> None:
        if record.displacement is None:
            raise InputError(
                f"{record.name}: holds no displacement, so no motion can be laid over it; measure it again"
            )
        constants = record.constants
        for name in ("mass", "damping", "stiffness", "drive_velocity"):
            if name not in constants:
                raise InputError(f"{record.name}: {name} is not known; measure it with a rig that says it")
        self.name = record.name
        displacement = _as_recorded(record)
        kept = record.time >= record.time[0] + settled_after * (record.time[-1] - record.time[0])
        stride = max(1, int(kept.sum()) // SAMPLES)
        self.time = record.time[kept][::stride] - record.time[kept][0]
        self.displacement = displacement[kept][::stride]
        self.step = float(self.time[1] - self.time[0])
        self.make = partial(
            Oscillator,
            constants["damping"],
            constants["drive_velocity"],
            mass=constants["mass"],
            stiffness=constants["stiffness"],
        )

    def motion(self, law: Law, shift: float, count: int) -> Array:
        """The first `count` samples of the settled motion, begun `shift` later."""
        system = self.make(law=law)
        settle = TRANSIENT * system.natural_period
        times = settle + shift + self.time[:count]
        return np.asarray(simulate(system, float(times[-1]) + self.step).at(times)[0])

    def first_shift(self, law: Law) -> float:
        """The shift of time with the least misfit, over the longest cycle the motion can have."""
        system = self.make(law=law)
        settle = TRANSIENT * system.natural_period
        events = simulate(system, 2 * settle).events
        releases = events["t"][events["kind"].isin(["release", "reversal"])].to_numpy()
        late = releases[releases > settle]
        cycle = 2.5 * float(np.diff(late).max()) if late.size > 2 else system.natural_period
        grid = np.arange(0.0, cycle, max(self.step, cycle / 400))
        few = slice(0, np.searchsorted(self.time, 0.7 * cycle))
        orbit = simulate(system, settle + cycle + self.time[few][-1] + self.step)
        misfit = [
            float(np.sum((orbit.at(settle + shift + self.time[few])[0] - self.displacement[few]) ** 2))
            for shift in grid
        ]
        return float(grid[int(np.argmin(misfit))])


def _as_recorded(record: FrictionRecord) -> Array:
    """Displacement with the gauge's own noise, which is white, where the record can still be read; else the smoothed one."""
    from stickslip.measurement.read import as_record
    from stickslip.measurement.rig import Rig

    source, rig_text = record.attrs.get("source"), record.attrs.get("rig")
    if source and rig_text and Path(str(source)).is_file():
        rig = Rig.from_toml(str(rig_text))
        if rig.gauge == "displacement":
            recorded = as_record(str(source), rig)
            if recorded.signal.size == record.time.size:
                return recorded.signal
    if record.displacement is None:
        raise InputError(f"{record.name}: holds no displacement, so no motion can be laid over it; measure it again")
    return record.displacement


def fit_trajectories(
    first: Identification, free: Iterable[str] | None = None, settled_after: float = 0.4
) -> Identification:
    """Sharpen an identified law until the motion it makes lies over the measured motion.

    Minimised is Σ (x_simulated(t + φ_r; law) − x_measured(t))² over all records r, where x_simulated is the settled
    motion under the record's drive and φ_r a shift of time, one for each record.

    Parameters
    ----------
    first : an identification whose records hold a displacement and whose motion is steady in each.
    free : names of the numbers to fit; default those of `first`.
    settled_after : the fraction of each record that is left out as transient, in [0, 1).

    Returns
    -------
    Identification with the sharpened law, its parameters and covariance; ``rms`` is that of the displacement.

    Raises
    ------
    InputError
        for a record without displacement or with unknown constants, or where no motion lies near the record.

    Limits: for steady, repeating motions. A record whose cycles scatter (most real sticks do) has no one motion to be
    laid over; there the fit of the branches is what the record can tell. The covariance takes the correlation of the
    residuals from sample to sample into account, not errors of the rig's constants.

    Source: the criterion of identification of the paper's Section 6, agreement of phase trajectories.
    """
    if not 0 <= settled_after < 1:
        raise InputError(f"fit_trajectories: settled_after must lie in [0, 1), got {settled_after}")
    targets = [_Target(record, settled_after) for record in first.records]
    names = check_names(first.law, first.parameters.index if free is None else free)
    start = np.array([value(first.law, name) for name in names])
    error = first.parameters["error"].reindex(names).to_numpy()
    scale = np.where(np.isfinite(error) & (error > 0), error, 1e-3 * np.maximum(np.abs(start), 1.0))
    shifts = np.array([target.first_shift(first.law) for target in targets])

    def law_at(numbers: Array) -> Law:
        return with_values(first.law, dict(zip(names, start + scale * numbers[: len(names)], strict=True)))

    def residuals(numbers: Array, share: float = 1.0) -> Array:
        counts = [max(2, int(share * target.time.size)) for target in targets]
        try:
            law = law_at(numbers)
        except InputError:
            # Not a law: far from every record.
            return np.full(sum(counts), 10.0)
        parts = [
            (target.motion(law, abs(shift), count) - target.displacement[:count]) / np.std(target.displacement)
            for target, shift, count in zip(targets, numbers[len(names) :], counts, strict=True)
        ]
        return np.concatenate(parts)

    bounds = np.array([limits(name) for name in names])
    low = np.concatenate([np.maximum((bounds[:, 0] - start) / scale, -1e3), np.zeros(shifts.size)])
    high = np.concatenate([np.minimum((bounds[:, 1] - start) / scale, 1e3), np.full(shifts.size, np.inf)])
    numbers = np.clip(np.concatenate([np.zeros(len(names)), shifts]), low, high)
    for share in SHARES:
        # A few cycles first: over many a small error of the period would put the motions out of step.
        numbers = least_squares(
            partial(residuals, share=share),
            numbers,
            bounds=(low, high),
            x_scale="jac",
            diff_step=np.full(numbers.size, 1e-4),
            max_nfev=80,
            loss="soft_l1",
            f_scale=0.02,
        ).x
    plain = residuals(numbers)
    edges = np.cumsum([0, *(target.time.size for target in targets)])
    parts = [plain[a:b] for a, b in pairwise(edges)]
    misfit = [float(np.sqrt(np.mean(part**2))) for part in parts]
    for target, far in zip(targets, misfit, strict=True):
        if far > 0.3:
            raise InputError(
                f"{target.name}: no motion of the law lies near this record (distance {far:.2f} of its standard deviation); "
                "keep the fit of the branches"
            )
    jacobian = _jacobian(residuals, numbers)
    weight = np.concatenate(
        [np.full(part.size, 1 / (miss**2 * correlation_time(part))) for part, miss in zip(parts, misfit, strict=True)]
    )
    information = jacobian.T @ (weight[:, None] * jacobian)
    covariance = np.linalg.pinv(information)[: len(names), : len(names)] * np.outer(scale, scale)
    law = law_at(numbers)
    errors = np.sqrt(np.diag(covariance))
    half = float(norm.ppf(0.975)) * errors
    values = np.array([value(law, name) for name in names])
    parameters = pd.DataFrame(
        {"value": values, "error": errors, "low": values - half, "high": values + half},
        index=pd.Index(names, name=first.parameters.index.name),
    )
    distance = math.sqrt(float(np.mean([miss**2 for miss in misfit])))
    note = (
        f"Sharpened by the agreement of the motions: they lie {distance:.2g} of the displacement's standard deviation apart, "
        "with one shift of time for each record."
    )
    return replace(
        first,
        law=law,
        parameters=parameters,
        covariance=pd.DataFrame(covariance, index=names, columns=names),
        rms=distance,
        command=f"{first.command} --trajectories",
        notes=[*first.notes, note],
    )


def _jacobian(residuals: Callable[[Array], Array], at: Array, step: float = 1e-3) -> Array:
    """Central differences; `at` is in units of the first standard errors and of time."""
    columns = []
    for j in range(at.size):
        ahead, behind = at.copy(), at.copy()
        ahead[j] += step
        behind[j] -= step
        columns.append((residuals(ahead) - residuals(behind)) / (2 * step))
    return np.stack(columns, axis=1)
