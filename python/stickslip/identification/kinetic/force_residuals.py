"""What a law fitted to forces is judged by: measured minus predicted kinetic force and break-aways, memory included."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from stickslip.errors import InputError
from stickslip.files.arrays import Array, Mask
from stickslip.identification.estimator.least_squares import has_effect
from stickslip.identification.estimator.uncertainty import no_evidence, own_error
from stickslip.identification.kinetic.replayed_motion import WITH_MEMORY, Motion
from stickslip.identification.law_parameters import parameters_of_law
from stickslip.identification.records import FrictionRecord
from stickslip.laws import Coulomb, Law
from stickslip.laws.numbers import Replacement, numbers, value, with_values
from stickslip.laws.state_law import StateLaw

OFFSET = "offset"
"""Name of the constant in the measured force."""
STEEPEST = 0.02
"""Least approach of load and limit of a stick, over the rise of the load."""


@dataclass(frozen=True)
class _BreakAways:
    """The break-aways of a record that are compared, each column of shape (n,).

    `rate` is the slope of friction over a stick, `loading` that of the pull, which is another where the mass creeps.
    """

    slip: list[tuple[int, int]]
    stick_time: Array
    force: Array
    rate: Array
    loading: Array
    sense: Array
    stated: Array

    @classmethod
    def of(cls, table: pd.DataFrame) -> _BreakAways | None:
        """Of a table of them; None of an empty one."""
        if not len(table):
            return None
        names = ("stick_time", "force", "rate", "loading", "sense", "stated")
        return cls(table["slip"].to_list(), *(table[name].to_numpy(float) for name in names))


class Problem:
    """Records, a kind of law, and the numbers that are free: what residuals are made of.

    Numbers that are held at a guess come with its standard deviation (`guessed`).

    Residuals come in groups (the kinetic force of each record, the break-aways of each record). A group has its own
    scale, found from its residuals, and its own correlation time τ: smoothed data are not independent, and each group
    weighs what its n / τ independent rows are worth. Where records differ from one another by more than that, each weighs
    as one observation.
    """

    def __init__(
        self,
        records: Sequence[FrictionRecord],
        law: Law,
        free: Sequence[str],
        relative: bool = False,
        ties: Mapping[str, str] | None = None,
        bounds: Mapping[str, tuple[float, float]] | None = None,
        offset: bool = False,
        every_row: bool = False,
        guessed: Mapping[str, float] | None = None,
    ) -> None:
        self.guessed = dict(guessed or {})
        # A constant in the measured force is no number of the law; it stands last.
        self.free = [*free, OFFSET] if offset else list(free)
        self.parameters = parameters_of_law(law, self.free, bounds, ties)
        self.law = law
        self.relative = relative
        # Break-aways tell Coulomb's law nothing, but it predicts them.
        self.every_row = every_row
        self.motions = [Motion.of(record, type(law)) for record in records]
        self.groups: list[tuple[int, str]] = []
        self.stated: list[Array] = []
        self.tables = [_BreakAways.of(self._rows(motion)) for motion in self.motions]
        for number, (motion, table) in enumerate(zip(self.motions, self.tables, strict=True)):
            if motion.stretches:
                self.groups.append((number, "kinetic"))
                self.stated.append(motion.misfit_error())
            if table is not None:
                self.groups.append((number, "break-away"))
                self.stated.append(table.stated)
        if not self.groups:
            raise InputError(
                "identify: the records hold no stretch of slip whose history is known: take longer records, with "
                "several periods of the motion"
            )
        self.scales = self._natural_scales()
        force = max(float(np.max(np.abs(motion.record.force))) for motion in self.motions)
        stiff = max(max(motion.record.constants.get("stiffness", 1.0), 1.0) for motion in self.motions)
        self.rounding = max(1e-9 * force / stiff, 1e-300)

    def _rows(self, motion: Motion) -> pd.DataFrame:
        # Adhesion is no limit but a state in laws that have one.
        if isinstance(self.law, StateLaw) or (isinstance(self.law, Coulomb) and not self.every_row):
            return pd.DataFrame()
        record = motion.record
        slips = pd.Series(record.own_slip(), dtype=object)
        table = record.break_away.assign(slip=slips, loading=record.force_rates().abs())
        table = table[table["stick_time"].notna() & (table["stick_time"] > 0)]
        if self.relative:
            table = table[table["slip"].notna()]
        rate = table["force_rate"].abs().fillna(_usual_rate(record))
        sense = [record.sense_of(slip) for slip in table["slip"]]
        late = _lag(record) if isinstance(self.law, WITH_MEMORY) else 0.0
        known = record.constants
        loading = table["loading"].fillna(_usual_rate(record))
        shared = np.hypot(loading * known.get("late", 0.0), known.get("common", 0.0))
        own = own_error(table["force_error"].fillna(0.0), shared)
        return table.assign(rate=rate, loading=loading, sense=sense, stated=np.hypot(own, rate * late))

    def _natural_scales(self) -> Array:
        """A natural size of each free number."""
        force = float(np.median([np.median(np.abs(m.record.force[~m.record.stuck])) for m in self.motions]))
        speed = float(np.max([np.max(np.abs(m.slip_velocity)) for m in self.motions]))
        force, speed = max(force, 1e-300), max(speed, 1e-300)
        sizes = {"": 1.0, "angle": 1.0, "velocity": speed, "force velocity^-1": force / speed}
        known = numbers(self.law)
        by_name = {name: 1.0 if item.ratio else sizes.get(item.dimension, force) for name, item in known.items()}
        return np.array([by_name.get(name, force) for name in self.free])

    def late(self, law: Law) -> list[Array]:
        """For each group how its residuals change by what all rows of its record share, by one standard error.

        All break-aways may be seen late, and all forces be off. Of a late break-away the force is read
        further up the loading line, and the stick is taken for longer than it was. A break-away that is compared with its
        own slip shares the error of all forces with it.
        """
        found = [np.zeros_like(stated) for stated in self.stated]
        for i, (number, kind) in enumerate(self.groups):
            motion, table = self.motions[number], self.tables[number]
            late, common = (motion.record.constants.get(name, 0.0) for name in ("late", "common"))
            if kind == "kinetic" and common > 0:
                found[i] = motion.misfit(law) - motion.misfit(law, common)
            if kind == "break-away" and common > 0 and not self.relative:
                found[i] = np.full_like(self.stated[i], common)
            if kind == "break-away" and table is not None and late > 0:
                load = table.sense * table.rate
                grown = law.break_away_force(table.stick_time + late, load) - law.break_away_force(
                    table.stick_time, load
                )
                found[i] = np.hypot(found[i], table.loading * late - grown)
        return found

    def approach(self, law: Law, number: int) -> Array:
        """How fast the load of each stick of a record nears its limit, over how fast the load rises: 1 − f_s′/δ.

        A stick that is stronger by r breaks away r / (1 − f_s′/δ) higher up its loading line, as the limit grows while the
        load goes on to meet it. At least `STEEPEST`.
        """
        table = self.tables[number]
        assert table is not None
        load, h = table.sense * table.rate, 1e-3 * table.stick_time
        above, below = (law.break_away_force(table.stick_time + step, load) for step in (h, -h))
        return np.asarray(np.maximum(1 - (above - below) / (2 * h * np.maximum(table.rate, 1e-300)), STEEPEST))

    # --- numbers <-> law

    @property
    def law(self) -> Law:
        """The law whose other numbers are held."""
        return self._replacement.law

    @law.setter
    def law(self, law: Law) -> None:
        self._replacement = Replacement(law, [item.name for item in self.parameters.all if item.name != OFFSET])

    def numbers(self, law: Law) -> Array:
        """The search vector of a law."""
        return self.parameters.vector({name: 0.0 if name == OFFSET else value(law, name) for name in self.free})

    def at(self, numbers: Array) -> Law:
        """The law with these free numbers."""
        values = self.parameters.values(numbers)
        return self._replacement([values[item.name] for item in self.parameters.all if item.name != OFFSET])

    def offset(self, numbers: Array) -> float:
        """The constant in the measured force."""
        return float(numbers[-1]) if self.free[-1] == OFFSET else 0.0

    # --- residuals

    def residuals(self, law: Law, offset: float = 0.0) -> list[Array]:
        """Measured minus predicted, one array per group."""
        found: list[Array] = []
        for number, motion in enumerate(self.motions):
            if motion.stretches:
                found.append(motion.misfit(law, offset))
            table = self.tables[number]
            if table is not None:
                rest = table.force - law.break_away_force(table.stick_time, table.sense * table.rate)
                if offset:
                    rest = rest - offset * table.sense
                if self.relative:
                    ahead = motion.difference(law, offset)
                    means = [motion.record.sense(*slip) * motion.work_mean(ahead, *slip) for slip in table.slip]
                    rest = rest - np.array(means)
                found.append(rest)
        return found

    def column(self, numbers: Array) -> Array:
        """All residuals at these free numbers."""
        return np.concatenate(self.groups_at(numbers))

    def groups_at(self, numbers: Array) -> list[Array]:
        """Residuals at these free numbers, one array per group."""
        return self.residuals(self.at(numbers), self.offset(numbers))

    def rms(self, law: Law, offset: float = 0.0) -> float:
        """Root mean square of measured minus predicted kinetic force."""
        parts = []
        for motion in self.motions:
            residuals = motion.difference(law, offset)
            parts += [residuals[a:b] for a, b in motion.stretches]
        return float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) if parts else math.nan

    def cost(self, law: Law, scales: Sequence[float]) -> float:
        """Sum over the groups of the mean of ρ(r / scale): a quick judgement between starting points."""
        total = 0.0
        for residuals, scale in zip(self.residuals(law), scales, strict=True):
            total += float(np.mean(2 * (np.sqrt(1 + (residuals / scale) ** 2) - 1)))
        return total

    def jacobian(self, numbers: Array, residuals: Callable[[Array], Array]) -> Array:
        """Central differences, one-sided where one side makes no law.

        The replay of a law with memory is continuous but has kinks, so the steps are wider than rounding asks for.
        """
        low, high = self.parameters.bounds()
        here: Array | None = None
        columns = []
        for j, h in enumerate(1e-4 * (np.abs(numbers) + 0.1 * self.scales)):
            sides = []
            for step in (h, -h):
                trial = numbers.copy()
                trial[j] = np.clip(trial[j] + step, low[j], high[j])
                try:
                    sides.append((trial[j] - numbers[j], residuals(trial)))
                except InputError:
                    continue
            if len(sides) < 2:
                here = residuals(numbers) if here is None else here
                sides += [(0.0, here)] * (2 - len(sides))
            (above, up), (below, down) = sides[0], sides[1]
            columns.append((up - down) / (above - below) if above != below else np.zeros_like(up))
        return np.stack(columns, axis=1)

    def refuse(self, silent: Mask) -> None:
        """Refuse free numbers of which the residuals say nothing, one flag for each."""
        names = [name for name, none in zip(self.free, silent, strict=True) if none]
        if names:
            raise no_evidence("the records", f"{', '.join(names)} of {type(self.law).__name__}")

    def refuse_silent(self, start: Law) -> None:
        """Refuse a free number that acts neither at the start nor beside it, before anything is searched.

        A number that does not act at one place may act at another, such as a node that other numbers move. So it is looked
        for at the start, and where all others lie a tenth of their size above and below.
        """
        low, high = self.parameters.bounds()
        middle = self.numbers(start)
        tenth = 0.1 * (np.abs(middle) + 0.1 * self.scales)
        silent = np.ones(len(self.free), dtype=bool)
        for side in (0.0, 1.0, -1.0):
            try:
                steep = self.jacobian(np.clip(middle + side * tenth, low, high), self.column)
            except InputError:
                continue
            silent &= ~has_effect(steep)
            if not silent.any():
                return
        self.refuse(silent)

    def slope(self, numbers: Array, name: str) -> Array:
        """Derivative of all residuals by a number of the law that is not free, one-sided where one side makes no law."""
        law, offset, error = self.at(numbers), self.offset(numbers), self.guessed[name]
        sides = []
        for step in (0.1 * error, -0.1 * error, 0.0):
            try:
                moved = with_values(law, {name: value(law, name) + step})
                sides.append((step, np.concatenate(self.residuals(moved, offset))))
            except InputError:
                continue
        (above, up), (below, down) = sides[:2]
        return np.asarray((up - down) / (above - below))


def _usual_rate(record: FrictionRecord) -> float:
    known = record.constants
    return known.get("stiffness", 0.0) * known.get("drive_velocity", 0.0)


def _lag(record: FrictionRecord) -> float:
    """How late the end of a stick may be seen where friction does not jump at it.

    After such a release the slip path grows like (k V / m) t³ / 6; it shows once it passes the noise of the instrument.
    """
    known = record.constants
    if not {"noise", "mass", "stiffness", "drive_velocity"} <= set(known):
        return 0.0
    jerk = known["stiffness"] * abs(known["drive_velocity"]) / known["mass"]
    return float((6 * known["noise"] / jerk) ** (1 / 3)) if jerk > 0 else 0.0
