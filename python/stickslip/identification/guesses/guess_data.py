"""What a first guess may look at, and what it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import pandas as pd

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.files.units import unit_suffix
from stickslip.identification.records import FrictionRecord
from stickslip.identification.static.rows import FEWEST_ROWS, break_away_rows, is_relative
from stickslip.identification.static.static_fit import StaticFrictionFit, fit_static_friction
from stickslip.laws import Law

DROWNED = 0.3
"""Noise of the instrument beyond that part of the usual fall at a break-away hides where sticks begin and end."""
WITH_DRIVE = 0.02
"""Slip that is slower than that part of the drive velocity is none."""


@dataclass
class BreakAways:
    """What the break-aways of records tell without a law, found once for all laws that are fitted to them.

    Attributes
    ----------
    records : all of them.
    """

    records: list[FrictionRecord]

    @cached_property
    def rows(self) -> pd.DataFrame:
        """Those with a known stick time."""
        return break_away_rows(self.records)

    @cached_property
    def static(self) -> StaticFrictionFit | None:
        """The fits of static friction, None for too few rows."""
        return fit_static_friction(self.records) if len(self.rows) >= FEWEST_ROWS else None

    @cached_property
    def relative(self) -> tuple[bool, list[str]]:
        """Whether friction drifts, so that break-aways are taken above the kinetic force of their slip, and a sentence."""
        return is_relative(self.rows)


@dataclass(frozen=True)
class GuessData:
    """What a first guess may look at.

    Attributes
    ----------
    records : all of them.
    rows : their break-aways with a known stick time.
    static : the fits of static friction, None for too few rows.
    relative : whether friction drifts, so that break-aways are taken above the kinetic force of their own slip.
    pieces : number of linear pieces asked for.
    sense : 1 or -1 where only slip in that sense counts, None: either.
    start : the law that was given as first guess; it says of which kinds the parts of a law are.
    parts : the kinds of the static and the kinetic part of a law that has them, where they are asked for by name.
    """

    records: Sequence[FrictionRecord]
    rows: pd.DataFrame
    static: StaticFrictionFit | None
    relative: bool
    pieces: int
    sense: float | None = None
    start: Law | None = None
    parts: tuple[type[Law], ...] = ()

    def toward(self, sense: float) -> GuessData:
        """The data of one direction; the fits of static friction are of both."""
        return replace(self, rows=self.rows[self.rows["sense"] == sense], static=None, sense=sense)

    @property
    def curve(self) -> tuple[Array, Array]:
        """Slip speed, and kinetic force in the sense of the slip, of every sample that slips."""
        w = np.concatenate([r.slip_velocity[~r.stuck] for r in self.records])
        force = np.copysign(1.0, w) * np.concatenate([r.force[~r.stuck] for r in self.records])
        counts = np.ones(w.size, bool) if self.sense is None else np.sign(w) == self.sense
        return np.abs(w[counts]), force[counts]

    @property
    def kinetic(self) -> float:
        """The constant kinetic force that does the same work in all slips."""
        if self.sense is not None:
            speed, force = self.curve
            return float(np.average(force, weights=speed))
        levels = [record.slip_level(a, b) for record in self.records for a, b in record.slips]
        paths = [float(np.abs(record.slip_velocity[a:b]).sum()) for record in self.records for a, b in record.slips]
        return float(np.average(levels, weights=paths)) if sum(paths) > 0 else float(np.mean(levels))

    @property
    def break_away(self) -> float:
        """The usual break-away force."""
        force = self.rows["force"].to_numpy()
        if self.relative:
            force = force - self.rows["level"].to_numpy() + self.kinetic
        return float(np.nanmedian(force))


@dataclass(frozen=True)
class Guess:
    """A law to begin with, the numbers to fit, and what was assumed.

    Attributes
    ----------
    law : the first guess.
    free : names of the numbers that are fitted.
    ties : names of numbers that follow another.
    notes : plain sentences.
    candidates : other first guesses, from which the one with the least misfit is taken.
    bounds : limits that come from the records.
    guessed : numbers that are held at a guess, with its standard deviation.
    held : what is said of a number that is held, unless it is fitted.
    wider : names that are fitted too where the records are far likelier so.
    starts : laws from which the fit with these begins.
    """

    law: Law
    free: list[str]
    ties: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    candidates: list[Law] = field(default_factory=list)
    bounds: dict[str, tuple[float, float]] = field(default_factory=dict)
    guessed: dict[str, float] = field(default_factory=dict)
    held: dict[str, str] = field(default_factory=dict)
    wider: list[str] = field(default_factory=list)
    starts: list[Law] = field(default_factory=list)


def need_rows(data: GuessData, kind: str, fewest: int) -> None:
    """Refuse records with fewer break-aways than the law needs."""
    if len(data.rows) < fewest:
        got = f"only {len(data.rows)}" if len(data.rows) else "none"
        raise InputError(
            f"identify: {kind} needs at least {fewest} break-aways with a known stick time, the records hold {got}: take "
            f"a record in which the mass sticks (a lower drive velocity), or ask for Coulomb{_unseen(data.records)}"
        )


def _unseen(records: Sequence[FrictionRecord]) -> str:
    """Which records left the range of their instrument, where no break-away can be seen."""
    return "".join(
        f". {record.name}: {count} samples stand at the end of the instrument's range: it was saturated there, and "
        "break-aways among them cannot be seen; widen the range"
        for record in records
        if (count := int(record.attrs.get("saturated", 0)))
    )


def refuse_unreadable(record: FrictionRecord) -> None:
    """Refuse a record whose friction drives, or whose noise is as large as its falls."""
    w, drive = record.slip_velocity[~record.stuck], abs(record.constants.get("drive_velocity", 0.0))
    rests = record.attrs.get("regime") == "at_rest"
    speed, newton = (unit_suffix(record.units.get(of, "1")) for of in ("slip_velocity", "force"))
    if w.size and (rests or float(np.quantile(np.abs(w), 0.9)) < WITH_DRIVE * drive):
        raise InputError(
            f"{record.name}: the mass goes with the drive throughout (nine tenths of its slip is slower than "
            f"{float(np.quantile(np.abs(w), 0.9)):.2g}{speed}, the drive has {drive:.2g}{speed}), so nothing can be said "
            f"about the friction of slip; static friction is above {float(np.max(np.abs(record.force))):.3g}{newton}; take a "
            "record in which it breaks away"
        )
    work = float(np.sum((record.force * record.slip_velocity)[~record.stuck]))
    if work < 0:
        path = float(np.sum(np.abs(record.slip_velocity[~record.stuck])))
        raise InputError(
            f"{record.name}: friction does work on the slip (it is {work / path:.3g}{newton} in its sense on average), as no "
            "friction does: check the signs of displacement and drive velocity, and the rest position of the rig"
            f"{_unseen([record])}"
        )
    noise = record.constants.get("noise", 0.0) * record.constants.get("stiffness", 0.0)
    drop = record.break_away["drop"].dropna().to_numpy()
    if drop.size and noise > DROWNED * float(np.median(drop)):
        raise InputError(
            f"{record.name}: the noise of the instrument is {noise:.3g}{newton} in force, and a break-away falls by "
            f"{np.median(drop):.3g}{newton}: where sticks begin and end cannot be determined; record with less noise"
        )
