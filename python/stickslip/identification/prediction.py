"""What an identified law foretells of further runs: kind of motion and stick times, with their interval."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from stickslip.errors import InputError
from stickslip.identification.agreement import CYCLES, TRANSIENT, cycle_of, measured_kind, oscillator_of
from stickslip.identification.fit import Identification
from stickslip.identification.parameters import with_values
from stickslip.identification.reading import Reading, read_motion
from stickslip.identification.records import FrictionRecord, read_records
from stickslip.identification.uncertainty import robust_scale
from stickslip.laws import Law
from stickslip.simulation import simulate

Array = npt.NDArray[np.float64]

REACH = 2.0
"""Half-width of an interval in standard deviations: of two or three records these are known too poorly for more."""


@dataclass(frozen=True)
class Prediction:
    """Runs foretold by a law.

    Attributes
    ----------
    table : DataFrame over the runs: kind and predicted_kind; other_kinds within the uncertainty of the law; stick_time (the
        measured median, with its error), predicted, low and high, and ratio (predicted over measured).
    sentences : what the intervals hold, and what was foretold wrongly.
    """

    table: pd.DataFrame
    sentences: list[str]

    def report(self) -> str:
        """The table and the sentences."""
        table = self.table.to_string(float_format=lambda number: f"{number:.4g}", na_rep="-")
        return "\n".join(["Foretold runs", "", table, "", *[f"- {sentence}" for sentence in self.sentences]])

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and words."""
        table = self.table.astype(object).where(self.table.notna(), None)
        return {"table": table.to_dict("index"), "sentences": self.sentences}


def predict_motion(law: Identification, friction: Any) -> Prediction:
    """Foretell runs by a law that was identified from other ones, and lay the measured motion beside it.

    The law is simulated with the mass, stiffness, damping and drive velocity of each run; sticks and kind of the simulated
    motion are read by the rules by which the run was measured.

    Parameters
    ----------
    law : from :func:`stickslip.identify`.
    friction : the runs, as for :func:`stickslip.identify`.

    Returns
    -------
    Prediction: ``.table``, ``.sentences``, ``.report()``.

    Raises
    ------
    InputError
        where a run does not say a constant of its oscillator.

    Limits: the interval is linear in the logarithm of the stick time, holds two standard deviations of the law's numbers and,
    where the records of the law differ from one another, as much again for the run itself. It does not hold what a single
    stick differs from the usual one.

    >>> import stickslip as ss
    >>> from stickslip.identification import friction_of_orbit, identify
    >>> law = ss.laws.StaticKinetic(break_away=1.0, kinetic=0.6)
    >>> def run(drive_velocity):
    ...     orbit = ss.simulate(ss.Oscillator(damping=0.05, drive_velocity=drive_velocity, law=law), 150)
    ...     return friction_of_orbit(orbit, np.arange(0, 150, 0.05), force_noise=0.01)
    >>> found = predict_motion(identify(run(0.2), "StaticKinetic"), run(0.4))
    >>> found.table["predicted_kind"].tolist(), found.table["ratio"].round(1).tolist()
    (['stick_slip'], [1.0])
    """
    if not isinstance(law, Identification):
        raise InputError(f"predict: expected an identification, got {law!r}; identify a law first")
    runs = read_records(friction)
    # Numbers that scatter from record to record scatter once more to the next one.
    further = "between" in law.groups and bool((law.groups["between"] > 0).any())
    covariance = law.covariance.to_numpy() * (1 + len(law.records) if further else 1)
    table = pd.DataFrame(
        [_row(run, law, covariance) for run in runs], index=pd.Index([run.name for run in runs], name="run")
    )
    return Prediction(table, _sentences(table, further))


def _row(run: FrictionRecord, law: Identification, covariance: Array) -> dict[str, Any]:
    read = _simulated(run, law.law)
    predicted = _usual(read)
    others, steps = set[str](), []
    for pair in _apart(law, covariance):
        sides = [_simulated(run, side) for side in pair if side is not None]
        others |= {side.kind for side in sides}
        times = [_usual(side) for side in sides]
        steps.append(0.5 * math.log(times[0] / times[1]) if len(times) == 2 else math.nan)
    spread = REACH * math.sqrt(sum(step**2 for step in steps))
    stick = run.break_away["stick_time"].dropna().to_numpy()
    measured, error = math.nan, math.nan
    if stick.size >= 2:
        measured = float(np.median(stick))
        error = 1.2533 * robust_scale(stick - measured) / math.sqrt(stick.size)
    return {
        "kind": measured_kind(run),
        "predicted_kind": read.kind,
        "other_kinds": ", ".join(sorted(others - {read.kind})),
        "stick_time": measured,
        "error": error,
        "predicted": predicted,
        "low": predicted * math.exp(-spread),
        "high": predicted * math.exp(min(spread, 700.0)),
        "ratio": predicted / measured,
    }


def _simulated(run: FrictionRecord, law: Law) -> Reading:
    system = oscillator_of(run, law)
    return read_motion(run, simulate(system, CYCLES * max(cycle_of(run), system.natural_period)), TRANSIENT)


def _usual(read: Reading) -> float:
    """Median stick time of a motion, NaN without sticks."""
    return float(read.sticks["stick_time"].median()) if len(read.sticks) else math.nan


def _apart(law: Identification, covariance: Array) -> Iterator[tuple[Law | None, Law | None]]:
    """For each independent direction of the fitted numbers the laws one standard deviation off; None where that is no law."""
    names = [str(name) for name in law.parameters.index]
    values = law.parameters["value"].to_numpy()
    variances, directions = np.linalg.eigh(covariance)
    for variance, direction in zip(variances, directions.T, strict=True):
        step = math.sqrt(max(float(variance), 0.0)) * direction
        yield _moved(law, names, values + step), _moved(law, names, values - step)


def _moved(law: Identification, names: list[str], values: Array) -> Law | None:
    moved = dict(zip(names, values.tolist(), strict=True))
    tied = {name: moved[source] for name, source in law.ties.items() if source in moved}
    try:
        return with_values(law.law, moved | tied)
    except InputError:
        return None


def _sentences(table: pd.DataFrame, further: bool) -> list[str]:
    found = []
    if further:
        found.append(
            "The records of the law differ from one another, so its numbers are means over records and a further run may "
            "differ as much: the intervals hold that too."
        )
    wrong = table[table["kind"] != table["predicted_kind"]]
    for name, row in wrong.iterrows():
        found.append(f"{name} is {row['kind']}, foretold was {row['predicted_kind']}.")
    if wrong.empty:
        found.append("The kind of motion is foretold rightly for " + ("all runs." if len(table) > 1 else "the run."))
    for name, row in table.iterrows():
        if row["other_kinds"]:
            found.append(f"{name}: within its uncertainty the law also gives {row['other_kinds']}.")
        if not row["low"] <= row["stick_time"] <= row["high"] and math.isfinite(row["stick_time"] * row["low"]):
            found.append(f"{name}: the measured stick time lies outside of the interval: the law leaves something out.")
    return found
