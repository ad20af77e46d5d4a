"""How often the 95 % intervals hold the truth: a law is identified again and again from synthetic records.

    python docs/evidence/interval_coverage.py -n 200 -o FOLDER
    python docs/evidence/interval_coverage.py --slips -n 40 -o FOLDER

Prints the tables of docs/evidence/identification.md, and goes on where it was stopped. With `--slips` each stick of a record
has a break-away of its own, and the laws are fitted slip by slip.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from stickslip.errors import InputError
from stickslip.identification.records import read_records
from stickslip.identification.result import Identification
from stickslip.identification.selection.identify import identify
from stickslip.identification.synthetic import friction_of_sticks
from stickslip.identification.trajectory.shooting import fit_trajectories
from stickslip.laws import (
    BogaczRyczek,
    Combined,
    DwellTime,
    ExponentialStribeck,
    Law,
    LogarithmicDwell,
    PiecewiseLinear,
    StaticFriction,
    StaticKinetic,
)
from stickslip.laws.numbers import value
from stickslip.measurement import Rig, measure
from stickslip.model.system import Oscillator
from stickslip.simulation.simulate import simulate

COLUMNS = ["parameter", "value", "error", "low", "high"]
"""Of the file of repetitions, with the seed; a refused one has no numbers but the same columns."""
SETTLED = 100.0
"""Time before a synthetic record begins, in a system with mass and stiffness 1."""
FORCE_NOISE = 0.01
"""Of the friction force of records with scatter, from which only the branch fit is made."""


@dataclass(frozen=True)
class Case:
    """A truth, and what is recorded of it.

    Attributes
    ----------
    law : the truth.
    drive_velocities : one record each.
    damping : of the oscillator, known to the identification as its mass and stiffness (both 1) are.
    fixed : numbers that are held at their true values.
    free : names of the numbers to fit; default what the records tell.
    ties : numbers that follow another; default those of the first guess.
    guess : where the branch fit begins; default what the records show.
    pieces : of a piecewise-linear law.
    noise : standard deviation of the white noise of the displacement, relative to that of the motion.
    duration, step : of each record.
    """

    law: Law
    drive_velocities: tuple[float, ...]
    damping: float
    fixed: Mapping[str, float] = field(default_factory=dict)
    free: tuple[str, ...] | None = None
    ties: Mapping[str, str] | None = None
    guess: Law | None = None
    pieces: int | None = None
    noise: float = 0.005
    duration: float = 60.0
    step: float = 0.04

    def records(self, seed: int) -> list[tuple[dict[str, Any], Rig]]:
        """Noisy displacement records, each with its rig."""
        made = []
        t = np.arange(0.0, self.duration, self.step)
        for number, s in enumerate(self.drive_velocities):
            system = Oscillator(self.damping, s, self.law)
            x = simulate(system, SETTLED + self.duration).at(SETTLED + t)[0]
            noise = self.noise * float(np.std(x))
            x = x + noise * np.random.default_rng([seed, number]).standard_normal(t.size)
            made.append(({"t": t, "x": x}, Rig.of(system)))
        return made

    def first(self, seed: int) -> Identification:
        """The fit of the branches to the measured records of one seed."""
        frictions = [measure(record, rig) for record, rig in self.records(seed)]
        return self.fitted(frictions)

    def fitted(self, frictions: Sequence[Any]) -> Identification:
        """The fit of the branches to measured records."""
        law, free = self.guess or type(self.law), self.free if self.guess else None
        return identify(frictions, law, free, self.fixed, pieces=self.pieces, ties=self.ties)

    def again(self, first: Identification, seed: int) -> Identification:
        """The law identified from the records of another seed, the search begun at the first identification."""
        # What was smoothed from the first samples only leads the search.
        records = [
            replace(record, recorded=np.asarray(made["x"], float))
            for record, (made, _) in zip(first.records, self.records(seed), strict=True)
        ]
        begun = replace(first, records=records)
        return fit_trajectories(begun, self.free, settled_after=0.0, seed=seed)


@dataclass(frozen=True)
class Scattered(Case):
    """A truth whose number of static friction differs from stick to stick.

    Attributes
    ----------
    scatter : standard deviation of that number, relative to it.
    """

    scatter: float = 0.15

    def frictions(self, seed: int) -> list[xr.DataTree]:
        """Records with other sticks and other noise for each seed."""
        times = np.arange(0.0, self.duration, self.step)
        found = []
        for number, s in enumerate(self.drive_velocities):
            system = Oscillator(self.damping, s, self.law)
            own = seed * len(self.drive_velocities) + number
            spread = float(np.std(friction_of_sticks(system, times, self.scatter, seed=own)["displacement"]))
            found.append(friction_of_sticks(system, times, self.scatter, FORCE_NOISE, own, self.noise * spread))
        return found

    def first(self, seed: int) -> Identification:
        """The fit of the branches to the records of one seed."""
        return self.fitted(self.frictions(seed))

    def again(self, first: Identification, seed: int) -> Identification:
        """The law identified from the records of another seed, the search begun at the first identification."""
        begun = replace(first, records=read_records(self.frictions(seed)))
        return fit_trajectories(begun, self.free, settled_after=0.0, shooting="slips", seed=seed)


CASES = {
    "StaticKinetic": Case(StaticKinetic(break_away=1.0, kinetic=0.6), (0.1, 0.2, 0.3), 0.1),
    "DwellTime": Case(DwellTime(kinetic=0.5, limit=0.5, rate=0.3), (0.08, 0.12, 0.16), 0.05),
    "ExponentialStribeck": Case(
        ExponentialStribeck(break_away=1.0, kinetic=0.6, scale=0.2, viscous=0.1), (0.1, 0.2, 0.3), 0.05
    ),
    # Growth, onset and level act nearly alike on such motions: the misfit is a long bent valley. The branch fit is given a
    # start, as that of the records lies astray in some.
    "Combined": Case(
        Combined(
            LogarithmicDwell(kinetic=1.0, growth=0.08, onset=0.3),
            ExponentialStribeck(break_away=0.95, kinetic=0.7, scale=0.1, viscous=0.05),
        ),
        (0.06, 0.14, 0.34),
        0.05,
        free=(
            *("kinetic.break_away", "kinetic.kinetic", "kinetic.scale", "kinetic.viscous"),
            *("static.kinetic", "static.growth", "static.onset"),
        ),
        ties={},
        guess=Combined(
            LogarithmicDwell(kinetic=1.05, growth=0.085, onset=0.5),
            ExponentialStribeck(break_away=0.93, kinetic=0.71, scale=0.12, viscous=0.04),
        ),
        duration=150.0,
        step=0.06,
    ),
    "PiecewiseLinear": Case(
        PiecewiseLinear(nodes=((0.0, 1.0), (0.2, 0.6), (0.6, 0.75)), break_away=1.05),
        (0.1, 0.2, 0.3),
        0.1,
        fixed={"nodes[2].slip_velocity": 0.6},  # where on the last line its node lies is no number of the law
        pieces=2,
    ),
    "BogaczRyczek": Case(
        # With one f_s(0), as its fall with the force rate is not looked for.
        BogaczRyczek(static_friction=StaticFriction(1.084, limit=0.3, rate=0.3, force_rate_scale=0.5), alpha=0.0),
        (0.10, 0.15, 0.28, 0.30),
        0.28,
        fixed={"beta": 0.01, "static_friction.force_rate_scale": 0.5},
        free=(
            "static_friction.initial",
            "static_friction.limit",
            "static_friction.rate",
            "phi",
            "psi",
            "l.slope",
            "l.intercept",
            "B.w",
            "B.f",
            "D.w",
            "D.f",
        ),
    ),
}
"""The truths of the published table: three or four drive velocities each, 0.5 % noise."""

SCATTERED = {
    "StaticKinetic": Scattered(StaticKinetic(break_away=1.0, kinetic=0.6), (0.03, 0.06, 0.1), 0.1, duration=300.0),
    "DwellTime": Scattered(DwellTime(kinetic=0.5, limit=0.5, rate=0.3), (0.04, 0.1, 0.16), 0.05, duration=400.0),
    "ExponentialStribeck": Scattered(
        ExponentialStribeck(break_away=1.0, kinetic=0.6, scale=0.2, viscous=0.1),
        (0.03, 0.06, 0.1),
        0.05,
        duration=300.0,
    ),
    # Its first guess asks for a motion without sticks, so it is given one.
    "BogaczRyczek": Scattered(
        BogaczRyczek(static_friction=StaticFriction(1.084, limit=0.3, rate=0.3, force_rate_scale=0.5), alpha=0.0),
        (0.03, 0.06, 0.12),
        0.1,
        fixed=CASES["BogaczRyczek"].fixed,
        # Stick-slip alone does not tell the other numbers apart.
        free=("static_friction.initial", "static_friction.limit", "phi", "psi"),
        duration=300.0,
        guess=BogaczRyczek(
            static_friction=StaticFriction(1.1, limit=0.28, rate=0.3, force_rate_scale=0.5),
            alpha=0.0,
            phi=-57.0,
            psi=40.0,
        ),
    ),
}
"""The truths of the table by slips: three drive velocities each, 0.5 % noise, 15 % scatter from stick to stick."""


def coverage(
    case: Case,
    repetitions: int = 200,
    fresh: int = 20,
    path: str | Path | None = None,
    progress: Callable[[int, int], Any] | None = None,
) -> pd.DataFrame:
    """How often each 95 % interval of :func:`fit_trajectories` holds the truth.

    In every repetition all records have new noise. Where the search begins is found by the whole way, from noisy records
    through :func:`stickslip.measure` and :func:`stickslip.identify`, anew at every `fresh`-th repetition.

    Parameters
    ----------
    case : the truth and its records.
    repetitions : how many.
    fresh : repetitions that begin at the same first identification.
    path : a CSV file with one row a number and repetition, to which each repetition is appended; where it exists only what
        is missing is done.
    progress : called as ``progress(done, of)``.

    Returns
    -------
    DataFrame over the names of the fitted numbers: true, mean, bias (of the mean, in standard deviations of the
    values), scatter (their standard deviation), stated (median standard error), inside (intervals that hold the truth),
    repetitions, share. A repetition that was refused counts as an interval that does not hold the truth.
    """
    known = pd.read_csv(path) if path is not None and Path(path).is_file() else None
    done = set() if known is None else set(known["seed"])
    rows = [] if known is None else [known]
    first: tuple[int, Identification] | None = None
    for seed in range(repetitions):
        if progress is not None:
            progress(seed, repetitions)
        if seed in done:
            continue
        start = seed - seed % fresh
        if first is None or first[0] != start:
            first = (start, case.first(start))
        try:
            table = case.again(first[1], seed).parameters
        except InputError:
            table = pd.DataFrame(index=pd.Index(["refused"], name="parameter"), data={"value": np.nan})
        row = table.reset_index().reindex(columns=COLUMNS).assign(seed=seed)
        rows.append(row)
        if path is not None:
            row.to_csv(path, mode="a", header=not Path(path).exists(), index=False)
    return _summary(case, pd.concat(rows, ignore_index=True))


def _summary(case: Case, rows: pd.DataFrame) -> pd.DataFrame:
    count = rows["seed"].nunique()
    found = rows[rows["parameter"] != "refused"]
    table = {}
    for name, part in found.groupby("parameter", sort=False):
        true = value(case.law, str(name))
        scatter = float(part["value"].std()) if len(part) > 1 else np.nan
        inside = int(((part["low"] <= true) & (true <= part["high"])).sum())
        mean = float(part["value"].mean())
        table[str(name)] = {
            "true": true,
            "mean": mean,
            "bias": (mean - true) / scatter,
            "scatter": scatter,
            "stated": float(part["error"].median()),
            "inside": inside,
            "repetitions": count,
            "share": inside / count,
        }
    return pd.DataFrame.from_dict(table, orient="index")


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table of coverage of each law asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("laws", nargs="*", metavar="LAW", help=f"default all: {', '.join(CASES)}")
    parser.add_argument("--slips", action="store_true", help=f"by slips: {', '.join(SCATTERED)}")
    parser.add_argument("-n", type=int, default=200, help="repetitions; default 200")
    parser.add_argument("-o", default=".", metavar="FOLDER", help="where LAW.csv is kept, to go on from")
    options = parser.parse_args(arguments)
    cases: Mapping[str, Case] = SCATTERED if options.slips else CASES
    for law in options.laws or cases:
        if law not in cases:
            parser.error(f"unknown law {law!r}; known are {', '.join(cases)}")
        table = coverage(cases[law], options.n, path=Path(options.o) / f"{law}.csv")
        print(f"{law}\n{table.to_string(float_format=lambda number: f'{number:.5g}')}", flush=True)


if __name__ == "__main__":
    main()
