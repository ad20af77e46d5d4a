"""What an identified law predicts of further runs: the probability of each kind of motion, and numbers with intervals."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import nnls
from scipy.special import ndtr, stdtrit

from stickslip.errors import InputError, number
from stickslip.files.arrays import Array
from stickslip.files.equality import ByContent
from stickslip.files.notebook import OfTable
from stickslip.identification.estimator.residual_statistics import correlation_time, median_error
from stickslip.identification.estimator.threads import one_thread
from stickslip.identification.prediction.agreement import (
    CYCLES,
    TRANSIENT,
    cycle_of,
    measured_kind,
    measured_trace_of,
    oscillator_of,
    settled,
    steady_part,
)
from stickslip.identification.prediction.reading import Reading, read_motion
from stickslip.identification.records import FrictionRecord, check_same_units, items_of, read_records
from stickslip.identification.result import Identification
from stickslip.laws import Law
from stickslip.laws.numbers import Spread
from stickslip.measurement.instruments import InstrumentRig
from stickslip.measurement.rigs.rig import Rig
from stickslip.measurement.rigs.rig_file import load_rig
from stickslip.measurement.signals.spectra import main_line
from stickslip.model.system import Oscillator
from stickslip.simulation.simulate import simulate

REACH = 2.0
"""Half-width of an interval in standard deviations: of two or three records these are known too poorly for more."""
DRAWS = 32
"""Laws that are drawn as the uncertainty of the law lets expect; a power of two, as the sequence asks."""
KINDS = ("stick_slip", "almost_harmonic", "stable_slip")
UNKNOWN = "unknown"
"""The kind of a record that cannot be told: it speaks neither for a law nor against it."""
QUANTITIES = ("amplitude", "stick_time", "stick_rate", "mean_force", "min_force", "max_force", "main_line")
RATIOS = ("stick_time", "stick_rate", "main_line")
"""Quantities whose errors are parts of them."""
STATED = ("stiffness", "drive_velocity")
"""Constants that measuring may correct, and that are known of another run as its rig says them only."""
FASTER = 1.05
"""Slip faster than that many times the fastest of the records is beyond what they tell."""
FAR_FROM_RECORDS = 0.1
"""Distance from the records of the law, in e-folds, that is worth a sentence."""


@dataclass(frozen=True, repr=False, eq=False)
class Prediction(ByContent, OfTable):
    """Runs predicted by a law.

    Attributes
    ----------
    table : DataFrame over the runs: kind (as measured, missing for a run that is a rig alone), predicted_kind (the most
        probable), probability of each kind by its name, beyond (distance from the records of the law in e-folds of
        stiffness, drive velocity and mass; 0 between them), fastest_slip (of the predicted motion); then for `amplitude`
        (half of the range of the displacement in the steady motion, m), `stick_time` (median, s), `stick_rate` (sticks per
        second), `mean_force`, `min_force` and `max_force` (of the spring in the steady motion) and `main_line` (Hz, of the
        acceleration) the measured value, its ``_error``, ``_predicted``, ``_low`` and ``_high``: of the predicted kind.
    sentences : what the numbers hold, and what was predicted wrongly.
    """

    table: pd.DataFrame
    sentences: list[str]

    def report(self) -> str:
        """The kinds, the numbers and the sentences."""
        kinds = self.table.drop(columns=[column for name in QUANTITIES for column in columns(name)])
        parts = {name: self.table[columns(name)].set_axis(list(COLUMNS), axis=1) for name in QUANTITIES}
        numbers = pd.concat(parts).swaplevel().loc[self.table.index]
        shown = [one.to_string(float_format=lambda number: f"{number:.4g}", na_rep="-") for one in (kinds, numbers)]
        return "\n".join(["Predicted runs", "", shown[0], "", shown[1], "", *[f"- {one}" for one in self.sentences]])


COLUMNS = ("measured", "error", "predicted", "low", "high")


def columns(quantity: str) -> list[str]:
    """Columns of a quantity in the table of a prediction: measured, error, predicted, low, high.

    >>> columns("main_line")[:3]
    ['main_line', 'main_line_error', 'main_line_predicted']
    """
    return [quantity, *(f"{quantity}_{column}" for column in COLUMNS[1:])]


@one_thread
def predict_motion(law: Identification, friction: Any, duration: float | None = None) -> Prediction:
    """Predict runs by a law that was identified from other ones, beside what was measured of them.

    Laws are drawn from the covariance of the fitted numbers and simulated with mass, damping, stiffness and drive velocity of
    each run as its rig states them; the stiffness is drawn too, as far off as it was found in the records of the law. Kind,
    sticks and main line of the simulated motions are read by the rules by which the run was measured.

    Parameters
    ----------
    law : from :func:`stickslip.identify`.
    friction : the runs, as for :func:`stickslip.identify`; a `Rig` of a spring, or the path of its TOML, for a run of
        which there is no record.
    duration : time for which the sentences give the number of sticks, in their unit; default that of each record.

    Returns
    -------
    Prediction: ``.table``, ``.sentences``, ``.report()``.

    Raises
    ------
    InputError
        where a run does not say a constant of its oscillator.

    Notes
    -----
    An interval holds two standard deviations (of the logarithm of a time or frequency): those of the drawn motions, or how
    far the law lies from its own records where that is more. The level of friction may differ in each record, also where the
    records of the law do not show it: for the mean force n records are a sample with n - 1 degrees of freedom, and two
    standard deviations become Student's t √(1 + 1/n), with t = 14 for two records and 3.3 for four. Records of a law that
    differ from one another may differ once more in a further run, which is drawn too. A run at the distance d beyond the
    records of the law, in e-folds of stiffness, drive velocity and mass from the nearest point between them, has variances
    larger by 1 + d: a law wanders off by as much in an e-fold as is not known of it between its records.

    Of the probability of a kind the share p of the drawn motions is one part. The other is that the law leaves out what
    decides: it is right with the probability c = (1 + g r) / (2 + g n), for r kinds right among its n records (Laplace's rule
    of succession), where g = exp(-d) says how much they are worth at that distance. A kind has c p + (1 - c) (1 - p) / 2.
    Far from all records nothing is left of the law but one half.

    It does not hold what a single stick differs from the usual one.

    Source: Laplace's rule after Jaynes, Probability Theory (2003), ch. 18; the decay with the distance is our own convention.

    >>> import stickslip as ss
    >>> from stickslip.identification import friction_of_orbit, identify
    >>> law = ss.laws.StaticKinetic(break_away=1.0, kinetic=0.6)
    >>> def run(drive_velocity):
    ...     orbit = ss.simulate(ss.Oscillator(damping=0.05, drive_velocity=drive_velocity, law=law), 150)
    ...     return friction_of_orbit(orbit, np.arange(0, 150, 0.05), force_noise=0.01)
    >>> row = predict_motion(identify(run(0.2), "StaticKinetic"), run(0.4)).table.iloc[0]
    >>> row["predicted_kind"], round(float(row["stick_slip"]), 2), round(float(row["beyond"]), 2)
    ('stick_slip', 0.6, 0.69)
    """
    if duration is not None and number("duration", duration, "predict") <= 0:
        raise InputError(f"predict: duration must be positive, got {duration}")
    if not isinstance(law, Identification):
        raise InputError(f"predict: expected an identification, got {law!r}; identify a law first")
    runs = [_run(one, law) for one in _items(friction)]
    found = _Law(law)
    rows = [_row(run, found) for run in runs]
    names = pd.Index([run.name for run in runs], name="run")
    table = pd.DataFrame(rows, index=names)
    lengths = [duration or (float(np.ptp(run.time)) if _is_measured(run) else math.nan) for run in runs]
    return Prediction(table, [*_sentences(table, found), *_counts(table, lengths)])


def _items(friction: Any) -> list[Any]:
    items = items_of(friction)
    if not items:
        raise InputError("predict: expected at least one run, got none: give a friction file or a rig")
    return items


def _run(item: Any, law: Identification) -> FrictionRecord:
    """A measured run with the constants that its rig states, or the run of a rig alone."""
    if isinstance(item, str | Path) and Path(item).suffix == ".toml":
        rig = load_rig(item)
        if not isinstance(rig, Rig):
            kind = f"the instrument {rig.instrument}" if isinstance(rig, InstrumentRig) else "a chain of masses"
            raise InputError(
                f"{item}: expected the rig of one mass on a spring, got {kind}; give a friction file instead"
            )
        return _unmeasured(rig, str(item), law)
    if isinstance(item, Rig):
        return _unmeasured(item, f"{item.stiffness:g} N/m at {item.drive_velocity:g} m/s", law)
    (run,) = read_records(item)
    check_same_units((record.name, record.units) for record in (*law.records, run))
    return replace(run, constants={**run.constants, **_stated(run)})


def _stated(record: FrictionRecord) -> dict[str, float]:
    """Constants as the rig of a record states them, before measuring corrected any."""
    known = {name: record.constants.get(name) for name in STATED}
    known |= {name: float(record.rig[name]) for name in STATED if isinstance(record.rig.get(name), int | float)}
    return {name: value for name, value in known.items() if value is not None}


def _unmeasured(rig: Rig, name: str, law: Identification) -> FrictionRecord:
    """A record without samples: what it would be read by, and the size of its force, are those of the records of the law."""
    others = law.records

    def usual(key: str) -> dict[str, float]:
        known = [record.constants[key] for record in others if key in record.constants]
        return {key: float(np.median(known))} if known else {}

    step = 1 / rig.sampling_rate if rig.sampling_rate else float(np.median([record.step for record in others]))
    none = np.zeros(2)
    return FrictionRecord(
        name=name,
        time=np.array([0.0, step]),
        slip_velocity=none,
        force=np.full(2, max(float(np.max(np.abs(record.force))) for record in others)),
        force_error=none,
        stuck=np.zeros(2, dtype=bool),
        break_away=others[0].break_away.iloc[:0],
        constants={
            "mass": rig.inertia,
            "damping": rig.damping,
            "stiffness": rig.stiffness,
            "drive_velocity": rig.drive_velocity,
            **usual("noise"),
            **usual("slip_cutoff"),
        },
        attrs={"rig": rig.to_toml(), **({"creeps": 1} if any(record.attrs.get("creeps") for record in others) else {})},
    )


def _is_measured(run: FrictionRecord) -> bool:
    return len(run.time) > 2


class _Law:
    """A law, the laws that may as well be, and what its own records say of it."""

    def __init__(self, law: Identification) -> None:
        self.law = law.law
        self.further = "record_scatter" in law.groups and bool((law.groups["record_scatter"] > 0).any())
        # Numbers that scatter from record to record scatter once more to the next one.
        self.covariance = law.covariance * (1 + len(law.records) if self.further else 1)
        self.ties = law.ties
        self.records = [record for record in law.records if {"mass", *STATED} <= set(record.constants)]
        self.fastest = max((_fastest(record.slip_velocity) for record in law.records), default=0.0)
        known = [(record.constants, _stated(record)) for record in self.records]
        self.points = np.array([_point({**used, **said}) for used, said in known])
        off = [[used[name] / said[name] for name in STATED] for used, said in known]
        self.mistaken = np.sqrt(np.mean(np.log(np.array(off)) ** 2, axis=0)) if off else np.zeros(len(STATED))
        kinds, rests = [], []
        for record in self.records:
            read = _simulated(record, self.law)
            here, there = _numbers_of(read, record), _measured(record, oscillator_of(record, self.law))
            if (kind := measured_kind(record)) != UNKNOWN:
                kinds.append(read.kind == kind)
            rests.append([_off(name, here[name], there[name][0]) for name in QUANTITIES])
        self.right, self.decided = sum(kinds), len(kinds)
        rest = np.array(rests).reshape(-1, len(QUANTITIES))
        self.misfit = {
            name: float(np.sqrt(np.nanmean(column**2))) if np.isfinite(column).any() else 0.0
            for name, column in zip(QUANTITIES, rest.T, strict=True)
        }
        # No number of the law holds how the level of friction scatters from record to record: the records are its sample.
        count = len(self.records)
        self.reach = dict.fromkeys(QUANTITIES, REACH)
        if count > 1:
            self.reach["mean_force"] = float(-stdtrit(count - 1, ndtr(-REACH))) * math.sqrt((count + 1) / (count - 1))

    def beyond(self, run: FrictionRecord) -> float:
        """Distance of a run from the nearest point between the records, in e-folds."""
        if not len(self.points):
            return 0.0
        apart = self.points - _point(run.constants)
        # weights that are positive and add up to one: the last row is heavy
        heavy = 1e3 * max(float(np.abs(apart).max()), 1.0)
        matrix = np.vstack([apart.T, np.full(len(apart), heavy)])
        weights, _ = nnls(matrix, np.append(np.zeros(apart.shape[1]), heavy))
        return float(np.linalg.norm(weights @ apart / weights.sum()))

    def credibility(self, beyond: float) -> float:
        """Probability that the law says the kind of a run at this distance rightly."""
        weight = math.exp(-beyond)
        return (1 + weight * self.right) / (2 + weight * self.decided)

    def draws(self, run: FrictionRecord, beyond: float) -> list[tuple[Reading, FrictionRecord]]:
        """Motions of the laws that may as well be, each with the run as it may as well be."""
        spread = Spread(self.law, self.covariance * (1 + beyond), self.ties)
        count = len(spread.names)
        from scipy.stats import qmc  # loads for half a second

        normal = qmc.MultivariateNormalQMC(np.zeros(count + len(STATED)), rng=np.random.default_rng(0)).random(DRAWS)
        found = []
        for one in normal:
            law = spread.at(one[:count])
            ratios = np.exp(self.mistaken * one[count:])
            known = {name: run.constants[name] * ratio for name, ratio in zip(STATED, ratios, strict=True)}
            if law is not None:
                there = replace(run, constants={**run.constants, **known})
                found.append((_simulated(there, law), there))
        return found


def _fastest(slip_velocity: Array) -> float:
    """The slip speed that a thousandth of the samples exceed."""
    return float(np.quantile(np.abs(slip_velocity), 0.999))


def _point(constants: Mapping[str, float]) -> Array:
    return np.log(np.abs([constants[name] for name in (*STATED, "mass")]))


def _row(run: FrictionRecord, law: _Law) -> dict[str, Any]:
    system = oscillator_of(run, law.law)  # names the constant that is missing
    beyond = law.beyond(run)
    read, drawn = _simulated(run, law.law), law.draws(run, beyond)
    kinds = [one.kind for one, _ in drawn] or [read.kind]
    probabilities = _probabilities(kinds, law.credibility(beyond))
    row: dict[str, Any] = {
        "kind": measured_kind(run) if _is_measured(run) else None,
        "predicted_kind": max(probabilities, key=lambda kind: probabilities[kind]),
        **probabilities,
        "beyond": beyond,
        "fastest_slip": _fastest(read.trace["v"].to_numpy() - run.constants["drive_velocity"]),
    }
    centre, others = _numbers_of(read, run), [_numbers_of(*one) for one in drawn]
    measured = _measured(run, system) if _is_measured(run) else {}
    for name in QUANTITIES:
        value, rest = centre[name], np.array([_off(name, other[name], centre[name]) for other in others])
        rest = rest[np.isfinite(rest)]
        spread = float(np.sqrt(np.mean(rest**2))) if rest.size else math.nan
        half = max(REACH * spread, law.reach[name] * law.misfit[name] * math.sqrt(1 + beyond))
        if name in RATIOS:
            low, high = value * math.exp(-half), value * math.exp(min(half, 700.0))
        else:
            low, high = value - half, value + half
        if name == "amplitude":
            low = max(low, 0.0)
        if name in ("mean_force", "max_force"):  # friction does not turn round
            low, high = np.array([low, high]).clip(*((0.0, math.inf) if value > 0 else (-math.inf, 0.0)))
        row |= dict(zip(columns(name), (*measured.get(name, (math.nan, math.nan)), value, low, high), strict=True))
    return row


def _probabilities(kinds: Sequence[str], credibility: float) -> dict[str, float]:
    """Probability of each kind from the kinds of the drawn motions and from how far the law is to be believed.

    >>> {kind: round(p, 3) for kind, p in _probabilities(["stick_slip"] * 3 + ["stable_slip"], 0.8).items()}
    {'stick_slip': 0.625, 'almost_harmonic': 0.1, 'stable_slip': 0.275}
    """
    named = [*KINDS, *sorted(set(kinds) - set(KINDS))]
    shares = {kind: kinds.count(kind) / len(kinds) for kind in named}
    wrong = (1 - credibility) / (len(named) - 1)
    return {kind: credibility * share + wrong * (1 - share) for kind, share in shares.items()}


def _simulated(run: FrictionRecord, law: Law) -> Reading:
    system = oscillator_of(run, law)
    cycle = cycle_of(run) if _is_measured(run) else _usual_cycle(run, law)
    return read_motion(run, settled(system, CYCLES * max(cycle, system.natural_period)), TRANSIENT)


def _usual_cycle(run: FrictionRecord, law: Law) -> float:
    """Time from slip to slip of a run of which nothing is measured; 0 where the law does not stick there."""
    system = oscillator_of(run, law)
    # From the slack spring to the first slip at the latest, and some cycles more, which are shorter.
    loading = run.force[0] / abs(system.stiffness * system.drive_velocity)
    events = simulate(system, 4 * loading + CYCLES * system.natural_period).events
    ends = events["t"][(events["kind"] == "release").to_numpy()].to_numpy()
    return float(np.mean(np.diff(ends[ends.size // 2 :]))) if ends.size >= 4 else 0.0


def _numbers_of(read: Reading, run: FrictionRecord) -> dict[str, float]:
    """The quantities of a simulated motion of a run, NaN where it has none."""
    step = float(read.trace["time"].iloc[1] - read.trace["time"].iloc[0])
    swings = read.kind != "stable_slip"
    rate = _rate(read.sticks["t"].to_numpy())[0]
    return {
        "amplitude": float(np.ptp(read.trace["spring"])) / run.constants["stiffness"] / 2 if swings else 0.0,
        "stick_rate": rate,
        "min_force": float(read.trace["spring"].min()),
        "max_force": float(read.trace["spring"].max()),
        "stick_time": float(read.sticks["stick_time"].median()) if len(read.sticks) else math.nan,
        "mean_force": float(read.trace["spring"].mean()),
        "main_line": main_line(np.gradient(read.trace["v"].to_numpy()), step, rate=rate).frequency
        if swings
        else math.nan,
    }


def _rate(times: Array) -> tuple[float, float]:
    """Sticks per time and its error, NaN for fewer than three."""
    if times.size < 3:
        return math.nan, math.nan
    gaps = np.diff(times)
    middle = float(np.median(gaps))
    return 1 / middle, median_error(gaps) / middle**2


def _measured(run: FrictionRecord, system: Oscillator) -> dict[str, tuple[float, float]]:
    """The same of a measured run, each with its error."""
    found = {"stick_time": (math.nan, math.nan)}
    stick = run.break_away["stick_time"].dropna().to_numpy()
    if stick.size >= 2:
        found["stick_time"] = (float(np.median(stick)), median_error(stick))
    found["stick_rate"] = _rate(run.break_away["t"].to_numpy())
    # Whole cycles: over them the friction is that of the spring, and what came before the motion was steady is left out.
    steady = steady_part(pd.DataFrame({"time": run.time, "force": run.force}), run)["force"].to_numpy()
    force = steady[:: max(len(steady) // 20_000, 1)]
    mean = float(np.mean(force))
    found["mean_force"] = (mean, float(np.std(force)) * math.sqrt(correlation_time(force - mean) / force.size))
    spring = steady_part(measured_trace_of(run, system), run)["spring"]
    found |= {"min_force": (float(spring.min()), math.nan), "max_force": (float(spring.max()), math.nan)}
    found["amplitude"] = (float(np.ptp(spring)) / system.stiffness / 2, math.nan)
    line = main_line(np.gradient(run.slip_velocity), run.step, rate=found["stick_rate"][0])
    found["main_line"] = (line.frequency, line.error)
    return found


def _off(name: str, value: float, other: float) -> float:
    """How far a quantity is from another value of it: the logarithm of their ratio, or the difference."""
    if name not in RATIOS:
        return value - other
    return math.log(value / other) if value > 0 and other > 0 else math.nan


def _counts(table: pd.DataFrame, lengths: Sequence[float]) -> list[str]:
    """How many sticks come in the time asked for, and the highest spring force."""
    found = []
    for (name, row), length in zip(table.iterrows(), lengths, strict=True):
        rate, least, force = (
            [row[column] for column in columns(quantity)[2:]] for quantity in ("stick_rate", "min_force", "max_force")
        )
        if not (math.isfinite(length) and math.isfinite(rate[0])):
            continue
        count, low, high = (length * value for value in rate)
        if not (math.isfinite(low) and math.isfinite(high)):
            found.append(
                f"{name}: {count:.0f} sticks in {length:.4g} of steady motion by the law itself; none of the laws drawn from "
                "its uncertainty sticks there, so there is no interval."
            )
        else:
            found.append(
                f"{name}: {count:.0f} sticks ({math.floor(low)} to {math.ceil(high)}) in {length:.4g} of steady motion, one "
                f"in {1 / rate[0]:.4g} ({1 / rate[2]:.4g} to {1 / rate[1]:.4g}), with a spring force from {least[0]:.4g} "
                f"({least[1]:.4g} to {least[2]:.4g}) to {force[0]:.4g} ({force[1]:.4g} to {force[2]:.4g})."
            )
    return found


def _sentences(table: pd.DataFrame, law: _Law) -> list[str]:
    found = []
    if law.further:
        found.append(
            "The records of the law differ from one another, so its numbers are means over records and a further run may "
            "differ as much: the intervals include that too."
        )
    if (law.mistaken > 0).any():
        found.append(
            "The runs are predicted with what their rigs state; in the records of the law the stiffness was "
            f"{100 * law.mistaken[0]:.0f} % off and the drive velocity {100 * law.mistaken[1]:.0f} % (rms), which the "
            "intervals hold."
        )
    if law.right < law.decided:
        found.append(f"Of its own {law.decided} records the law gives the kind of {law.right} rightly.")
    found.append(
        "A probability is the share of the laws within the errors of the fit that move so, less what the law was wrong about "
        "its own records and what the distance from them leaves open. The intervals are those of the predicted kind."
    )
    for name, row in table.iterrows():
        odds = ", ".join(f"{kind} {row[kind]:.2f}" for kind in KINDS)
        found.append(f"{name}: probability of {odds}.")
        if row["fastest_slip"] > FASTER * law.fastest > 0:
            found.append(
                f"{name} slips at up to {row['fastest_slip']:.3g}, the records of the law at no more than {law.fastest:.3g}: "
                "between them friction is extrapolated by the form of the law."
            )
        if row["beyond"] > FAR_FROM_RECORDS:
            found.append(
                f"{name} lies {row['beyond']:.2g} e-folds of stiffness, drive velocity and mass beyond the records of the "
                "law: an extrapolation."
            )
    measured = table[table["kind"].notna()]
    decided = measured[measured["kind"] != UNKNOWN]
    wrong = decided[decided["kind"] != decided["predicted_kind"]]
    for name, row in wrong.iterrows():
        predicted = str(row["predicted_kind"])
        found.append(f"{name} is {row['kind']}, predicted was {predicted} with a probability of {row[predicted]:.2f}.")
    if len(measured) and wrong.empty:
        found.append(
            "The kind of motion is predicted rightly for " + ("all runs." if len(measured) > 1 else "the run.")
        )
    for name, row in measured.iterrows():
        for quantity in QUANTITIES:
            value, _, _, low, high = (row[column] for column in columns(quantity))
            # Of another kind than the predicted one nothing was said.
            if row["kind"] == row["predicted_kind"] and math.isfinite(value * low) and not low <= value <= high:
                words = quantity.replace("_", " ")
                found.append(
                    f"{name}: the measured {words} lies outside of the interval: the law leaves something out."
                )
    return found
