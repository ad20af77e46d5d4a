"""The identified law set in motion under the same drive, compared with the measured motion."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.files.equality import ByContent
from stickslip.files.notebook import OfTable
from stickslip.files.units import to_error
from stickslip.identification.estimator.residual_statistics import correlation_time, robust_scale
from stickslip.identification.prediction.reading import read_motion
from stickslip.identification.records import FrictionRecord, read_records
from stickslip.identification.result import Identification
from stickslip.laws import Law
from stickslip.measurement.regime import regime_of_slip
from stickslip.measurement.signals.sample_runs import runs_of
from stickslip.measurement.signals.spectra import main_line
from stickslip.model.system import Oscillator
from stickslip.simulation.orbit import Orbit
from stickslip.simulation.simulate import simulate

CYCLES = 40
"""Measured cycles that the simulated motion covers, transient included."""
WITHIN_ERRORS, DISAGREE = "within two errors", "no"
OTHER_LAW = "rank other laws (--compare, compare_laws), or check the rig's mass, damping and stiffness"
NEXT_STEP = f"refine it by the motion (--trajectories, fit_trajectories); if that does not help, {OTHER_LAW}"
"""What to do about a law whose motion is not that of its record."""
TRANSIENT = 0.4
"""Part of the simulated motion that is left out."""
RUNS, DECAY, SAMPLES = 20, 0.98, 500
"""A motion dies away where its second half is smaller by this; so many runs more, looked at in so many places, settle it."""
ALIKE_SHARE = 0.05
"""Means that differ by less than this part are called alike even where their errors are smaller."""
ALIKE_WORDS = f"within {100 * ALIKE_SHARE:.0f} %"
POINTS = 20_000


@dataclass(frozen=True, repr=False, eq=False)
class Agreement(ByContent, OfTable):
    """A measured motion and the motion of the identified law under the same drive.

    Attributes
    ----------
    table : DataFrame over the quantities compared: measured, error (standard error of the measured mean, with that by which
        all break-aways of the record may be early or late together), simulated, ratio (simulated over measured), unit, and
        whether they agree: "within two errors", "within 5 %" or "no".
    phase_distance : distance (rms) of the measured phase points from the simulated curve, in half-widths of the measured
        motion; NaN where there is no slip to compare.
    regimes : kind of motion, measured and simulated.
    sentences : whether the two agree, and what to do where they do not.
    record, orbit : the two motions.
    system : what was simulated.
    """

    table: pd.DataFrame
    phase_distance: float
    regimes: tuple[str, str]
    sentences: list[str]
    record: FrictionRecord
    orbit: Orbit
    system: Oscillator

    @property
    def disagreements(self) -> int:
        """How many quantities disagree."""
        return int((self.table["agrees"] == DISAGREE).sum())

    def summary(self) -> str:
        """One sentence: whether the motions agree, and if not in what."""
        measured, simulated = self.regimes
        off = [str(name) for name in self.table.index[self.table["agrees"] == DISAGREE]]
        if measured != simulated:
            return f"{self.record.name}: measured {measured}, simulated {simulated}."
        if not off:
            return f"{self.record.name}: both {measured}, and all quantities agree."
        return f"{self.record.name}: both {measured}; {', '.join(off)} disagree{'s' * (len(off) == 1)}."

    def shown(self) -> pd.DataFrame:
        """The table as texts: measured and simulated in the digits that the error of the measured allows."""
        rows = [
            to_error(row, row[1]) for row in self.table[["measured", "error", "simulated"]].to_numpy(float).tolist()
        ]
        columns = dict(zip(["measured", "error", "simulated"], map(list, zip(*rows, strict=True)), strict=True))
        ratio = [f"{number:.4g}" for number in self.table["ratio"]]
        return self.table.assign(**columns, ratio=ratio).replace("nan", "–")

    def report(self) -> str:
        """The table and the sentences."""
        table = self.shown().to_string()
        return "\n".join([f"{self.record.name}", "", table, "", *[f"- {sentence}" for sentence in self.sentences]])

    def plot_phase(self, ax: Any = None) -> Any:
        """Phase portraits of both motions, spring force over velocity of the mass; returns the Axes."""
        from stickslip.show.canvas import ABOVE, OKABE_ITO, axes

        ax = axes(ax)
        measured = steady_part(measured_trace_of(self.record, self.system), self.record)
        simulated = read_motion(self.record, self.orbit, TRANSIENT).trace
        stride = max(len(measured) // POINTS, 1)
        measured = measured.iloc[::stride]
        ax.plot(measured["v"], measured["spring"], ".", ms=3, color="0.6", label="measured")
        ax.plot(simulated["v"], simulated["spring"], lw=1.0, color=OKABE_ITO["vermilion"], label="simulated")
        force, _, velocity = _units(self.record)
        ax.set_xlabel("velocity ẋ" + velocity)
        ax.set_ylabel("spring force k x" + force)
        ax.legend(**ABOVE, ncols=2)
        return ax

    def plot_force(self, ax: Any = None, cycles: float = 6.0) -> Any:
        """Spring force over time of both motions from a break-away, or from a rise through its mean; returns the Axes."""
        from stickslip.show.canvas import ABOVE, OKABE_ITO, axes

        ax = axes(ax)
        measured = measured_trace_of(self.record, self.system)
        simulated = read_motion(self.record, self.orbit, TRANSIENT).trace
        cycle, length = cycle_of(self.record), float(np.ptp(self.record.time))
        span = cycles * cycle
        starts = self.record.break_away["t"].to_numpy()
        middle = float(self.record.time[0]) + min(0.5 * length, max(length - span - cycle, 0.0))
        events = self.orbit.events
        releases = events["t"][(events["kind"] == "release").to_numpy() & (events["t"] > TRANSIENT * self.orbit.t_end)]
        sticks = starts.size > 0 and len(releases) > 0
        if sticks:
            first, begin = float(starts[np.argmin(np.abs(starts - middle))]), float(releases.iloc[0])
        else:
            first, begin = _upward(measured, middle), _upward(simulated, TRANSIENT * self.orbit.t_end)
        # Where the two lie over each other both are still seen.
        for frame, origin, color, width, label in (
            (measured, first, "0.7", 2.4, "measured"),
            (simulated, begin, OKABE_ITO["vermilion"], 1.0, "simulated"),
        ):
            part = frame[(frame["time"] >= origin) & (frame["time"] <= origin + span)]
            ax.plot(part["time"] - origin, part["spring"], lw=width, color=color, label=label)
        force, time, _ = _units(self.record)
        ax.set_xlabel(("time since a break-away" if sticks else "time since a rise through the mean") + time)
        ax.set_ylabel("spring force k x" + force)
        ax.legend(**ABOVE, ncols=2)
        return ax

    def plot(self) -> Any:
        """Both pictures side by side; returns the Figure."""
        from stickslip.show.canvas import new_axes

        left, right = new_axes(1, 2, figsize=(9.5, 3.6))
        self.plot_phase(left)
        self.plot_force(right)
        return left.figure


def compare_motion(friction: Any, law: Law | Identification | Oscillator) -> Agreement:
    """Simulate with an identified law under the drive of a record, and compare the two motions.

    Real sticks differ from one to the next and a deterministic model's do not: means over the record, with their
    standard errors, are laid beside the simulated ones. No mean takes off what all break-aways of a record share, so their
    errors hold that too. The phase trajectories are compared over the samples that slip,
    each slip centred on its own middle as friction drifts along a track: the rms distance of the measured points from
    the simulated curve, in units of the half-widths of the measured motion.

    Parameters
    ----------
    friction : one friction record, as for :func:`stickslip.identify`.
    law : a law or an identification (mass, stiffness, damping and drive velocity then come from the record), or an
        oscillator that holds them.

    Returns
    -------
    Agreement: ``.table``, ``.regimes``, ``.sentences``, ``.report()``, ``.plot()``.

    Raises
    ------
    InputError
        where a constant of the oscillator is not known.

    Limits: a chaotic or slowly drifting motion has no one simulated mean; look at the picture.

    >>> import stickslip as ss
    >>> system = ss.Oscillator(damping=0.05, drive_velocity=0.2, law=ss.laws.StaticKinetic(break_away=1.0, kinetic=0.6))
    >>> orbit = ss.simulate(system, t_end=200)
    >>> data = orbit.to_xarray(np.arange(0, 200, 0.05)).rename(x="displacement", v="velocity")
    >>> data.attrs = {}
    >>> compare_motion(data, system).regimes
    ('stick_slip', 'stick_slip')
    """
    records = read_records(friction)
    if len(records) != 1:
        raise InputError(f"compare: expected one friction record, got {len(records)}; compare them one by one")
    record = records[0]
    system = oscillator_of(record, law)
    orbit = settled(system, CYCLES * max(cycle_of(record), system.natural_period))
    rows: dict[str, tuple[float, float, float]] = {}
    read = read_motion(record, orbit, TRANSIENT)
    measured_trace, simulated_trace, releases = (
        steady_part(measured_trace_of(record, system), record),
        read.trace,
        read.sticks,
    )
    table = record.break_away
    late, share_error = record.constants.get("late", 0.0), math.nan
    if len(table) >= 2:
        # Of many slips the table may have the sure ones alone.
        ends = record.time[1:][record.stuck[:-1] & ~record.stuck[1:]]
        times = ends if ends.size > len(table) else table["t"].to_numpy()
        rows["slips per time"] = (*_rate(times), _rate(releases["t"].to_numpy())[0])
        stick = table["stick_time"].dropna().to_numpy()
        if stick.size >= 2:
            mean, scatter = _mean(stick)
            error = math.hypot(scatter, late)
            rows["mean stick time"] = (mean, error, _mean(releases["stick_time"].to_numpy())[0])
            share_error = error * rows["slips per time"][0]  # the share is the product of the two
            middle = float(np.median(stick))
            spread = robust_scale(stick - middle)
            if spread < 1e-9 * middle:  # times that are whole numbers of samples
                spread = record.step / math.sqrt(12)
            scatter = 1.2533 * spread / math.sqrt(stick.size)
            simulated = float(np.median(releases["stick_time"])) if len(releases) else math.nan
            rows["median stick time"] = (middle, math.hypot(scatter, late), simulated)
        drop = table["drop"].dropna().to_numpy()
        if drop.size >= 2:
            mean, error = _mean(drop)
            # The drive loads a stick that late, also where what creeps rises more slowly.
            error = math.hypot(
                error, system.stiffness * system.drive_velocity * late, record.constants.get("common", 0.0)
            )
            rows["mean force drop"] = (mean, error, _mean(releases["drop"].dropna().to_numpy())[0])
    rows["stuck share"] = (
        float(np.mean(measured_trace["stuck"])),
        share_error,
        float(np.mean(simulated_trace["stuck"])),
    )
    spring = measured_trace["spring"].to_numpy()
    rows["mean spring force"] = (*_mean(spring), float(np.mean(simulated_trace["spring"])))
    # Of the velocity: in the acceleration of these motions the second harmonic is about as strong as the first.
    line = main_line(measured_trace["v"].to_numpy(), record.step)
    other = main_line(simulated_trace["v"].to_numpy(), record.step)
    rows["main line of velocity"] = (line.frequency, line.error, other.frequency)
    regimes = (measured_kind(record), read.kind)
    frame = pd.DataFrame.from_dict(rows, orient="index", columns=["measured", "error", "simulated"])
    frame["ratio"] = frame["simulated"] / frame["measured"].where(frame["measured"] != 0)
    force, time = (record.units.get(name, "1") for name in ("force", "time"))
    rate = {"1": "1", "s": "Hz"}.get(time, f"1/{time}")
    units = {
        "slips per time": rate,
        "main line of velocity": rate,
        "stuck share": "1",
        "mean force drop": force,
        "mean spring force": force,
    }
    frame["unit"] = [units.get(str(name), time) for name in frame.index]
    frame["agrees"] = [_agreement(*row) for row in frame[["measured", "error", "simulated"]].to_numpy()]
    distance = _phase_distance(measured_trace, simulated_trace)
    refined = isinstance(law, Identification) and law.motions is not None
    sentences = _sentences(frame, distance, regimes, record, releases, system)
    if DISAGREE in set(frame["agrees"]) or len(set(regimes)) > 1:
        sentences.append(f"The law does not give the motion of this record: {OTHER_LAW if refined else NEXT_STEP}.")
    return Agreement(frame, distance, regimes, sentences, record, orbit, system)


def compare_motions(records: Iterable[FrictionRecord], law: Law | Identification) -> list[Agreement]:
    """Each record laid beside its own simulated motion by :func:`compare_motion`, the worst first.

    Worse is another kind of motion, then more quantities that disagree, then a greater distance of the phase points.
    Records that do not say their oscillator (:func:`unknown_constants`) are left out.
    """
    known = [record for record in records if not unknown_constants(record)]
    return sorted((compare_motion(record, law) for record in known), key=_badness, reverse=True)


def _badness(agreement: Agreement) -> tuple[bool, int, float]:
    measured, simulated = agreement.regimes
    far = agreement.phase_distance
    return measured != simulated, agreement.disagreements, far if math.isfinite(far) else math.inf


def oscillator_of(record: FrictionRecord, law: Law | Identification | Oscillator) -> Oscillator:
    """The oscillator under whose drive the record was taken, with this law."""
    if isinstance(law, Oscillator):
        return law
    if isinstance(law, Identification):
        law = law.law
    if not isinstance(law, Law):
        raise InputError(f"compare: expected a law, an identification or an oscillator, got {law!r}")
    known = record.constants
    if missing := unknown_constants(record):
        raise InputError(missing)
    return Oscillator(
        damping=known.get("damping", 0.0),
        drive_velocity=known["drive_velocity"],
        law=law,
        mass=known["mass"],
        stiffness=known["stiffness"],
    )


def unknown_constants(record: FrictionRecord) -> str:
    """The sentence that names what is not known of the oscillator of a record; empty where all is known."""
    missing = [name for name in ("mass", "stiffness", "drive_velocity") if name not in record.constants]
    if not missing:
        return ""
    return (
        f"{record.name}: the record does not say its {', '.join(missing)}, so no motion can be simulated beside it; add "
        "what is missing to a rig that measures the motion (direct_force: mass, stiffness, a column drive_velocity)"
    )


def _units(record: FrictionRecord) -> tuple[str, str, str]:
    """Units of force, time and velocity as labels show them: none where the rig is dimensionless."""
    force, time, velocity = (record.units.get(name, "1") for name in ("force", "time", "slip_velocity"))
    shown = [f" ({unit})" if unit != "1" else "" for unit in (force, time, velocity)]
    return shown[0], shown[1], shown[2]


def _upward(trace: pd.DataFrame, after: float) -> float:
    """The first time after `after` at which the spring force rises through its mean; `after` if it never does."""
    late = trace[trace["time"] >= after]
    above = (late["spring"] > late["spring"].mean()).to_numpy()
    rises = np.flatnonzero(above[1:] & ~above[:-1])
    return float(late["time"].iloc[rises[0] + 1]) if rises.size else after


def settled(system: Oscillator, t_end: float) -> Orbit:
    """A run from rest; where it ends in a slip that still dies away, one that goes on from there, as often as need be.

    What a spring that was slack leaves behind is no motion of the law: it would pass for almost harmonic vibration.
    """
    orbit = simulate(system, t_end)
    for _ in range(RUNS):
        if not _dies_away(orbit):
            break
        x, v = orbit.at(orbit.t_end)
        orbit = simulate(system, t_end, float(x), float(v))
    return orbit


def _dies_away(orbit: Orbit) -> bool:
    """Whether nothing sticks in what is looked at of a run, and its second half is smaller than its first."""
    if orbit.stop != "t_end" or (orbit.events["t"].to_numpy() > TRANSIENT * orbit.t_end).any():
        return False
    first, second = np.split(orbit.at(np.linspace(TRANSIENT * orbit.t_end, orbit.t_end, 2 * SAMPLES))[0], 2)
    return bool(1e-9 * np.abs(second).max() < np.ptp(second) < DECAY * np.ptp(first))


def cycle_of(record: FrictionRecord) -> float:
    """Mean time from slip to slip, or of an oscillation of w where nothing sticks."""
    starts = record.break_away["t"].to_numpy()
    if starts.size >= 3:
        return float(np.mean(np.diff(starts)))
    w = record.slip_velocity - float(np.mean(record.slip_velocity))
    threshold = 0.3 * float(np.std(w))
    state = np.where(w > threshold, 1, np.where(w < -threshold, -1, 0))
    state = state[state != 0]
    crossings = max(int(np.count_nonzero(np.diff(state) > 0)), 1)
    return float(np.ptp(record.time)) / crossings


def measured_trace_of(record: FrictionRecord, system: Oscillator) -> pd.DataFrame:
    """Time, velocity, spring force and stuck of the measured motion."""
    v = system.drive_velocity - record.slip_velocity
    acceleration = -np.gradient(record.slip_velocity, record.time)
    spring = record.force - system.damping * v - system.mass * acceleration
    if record.displacement is not None:
        spring = system.stiffness * record.displacement
    return pd.DataFrame({"time": record.time, "v": v, "spring": spring, "stuck": record.stuck})


def steady_part(trace: pd.DataFrame, record: FrictionRecord) -> pd.DataFrame:
    """Whole cycles from break-away to break-away, or the second half of a record that hardly sticks."""
    starts = record.break_away["t"].to_numpy()
    first, last = (starts[0], starts[-1]) if starts.size >= 3 else (float(np.mean(record.time[[0, -1]])), math.inf)
    return trace[(trace["time"] >= first) & (trace["time"] <= last)]


def _mean(values: Array) -> tuple[float, float]:
    """Mean and its standard error, correlation from one to the next included."""
    if values.size == 0:
        return math.nan, math.nan
    middle = float(np.mean(values))
    if values.size < 2:
        return middle, math.nan
    return middle, float(np.std(values, ddof=1) * math.sqrt(correlation_time(values - middle) / values.size))


def _rate(times: Array) -> tuple[float, float]:
    if times.size < 2:
        return 0.0, math.nan
    mean, error = _mean(np.diff(times))
    return 1 / mean, error / mean**2


def measured_kind(record: FrictionRecord) -> str:
    """The kind of a measured motion: the word in its file, else what its sticks tell."""
    if record.attrs.get("regime"):
        return str(record.attrs["regime"])
    if record.stuck.any() and len(record.break_away) != 0:
        return "stick_slip"
    if record.stuck.any():
        return "stick_slip" if len(record.slips) > 1 else "unknown"
    return regime_of_slip(record.slip_velocity, 0.0, False)


def _phase_distance(measured: pd.DataFrame, simulated: pd.DataFrame) -> float:
    """RMS distance of measured phase points from the simulated curve, in half-widths of the measured motion."""
    stick = [bool(np.mean(trace["stuck"]) > 0.01) for trace in (measured, simulated)]
    points, curve = _slipping(measured, all(stick)), _slipping(simulated, all(stick))
    if len(points) < 2 or len(curve) < 2:
        return math.nan
    half = (np.quantile(points, 0.995, axis=0) - np.quantile(points, 0.005, axis=0)) / 2
    half = np.where(half > 0, half, 1.0)
    points = points[:: max(len(points) // POINTS, 1)]
    distance, _ = cKDTree(curve / half).query(points / half)
    return float(np.sqrt(np.mean(np.square(distance))))


def _slipping(trace: pd.DataFrame, centred: bool) -> Array:
    """Spring force and velocity while slipping, each slip centred on the middle of its spring force where asked."""
    stuck = trace["stuck"].to_numpy()
    spring, v = trace["spring"].to_numpy(), trace["v"].to_numpy()
    if not centred:
        return np.stack([spring[~stuck], v[~stuck]], axis=1)
    parts = []
    for a, b in runs_of(~stuck):
        middle = (spring[a:b].max() + spring[a:b].min()) / 2
        parts.append(np.stack([spring[a:b] - middle, v[a:b]], axis=1))
    return np.concatenate(parts) if parts else np.zeros((0, 2))


def _loaded_share(releases: pd.DataFrame, system: Oscillator) -> float:
    """How much of a simulated fall its stick had loaded: less than 1 where the spring is stretched on while slip begins."""
    share = system.stiffness * abs(system.drive_velocity) * releases["stick_time"].mean() / releases["drop"].mean()
    return float(share) if math.isfinite(share) else 1.0


def _agreement(measured: float, error: float, simulated: float) -> str:
    off = abs(simulated - measured)
    return WITHIN_ERRORS if off <= 2 * error else ALIKE_WORDS if off <= ALIKE_SHARE * abs(measured) else DISAGREE


def _sentences(
    frame: pd.DataFrame,
    distance: float,
    regimes: tuple[str, str],
    record: FrictionRecord,
    releases: pd.DataFrame,
    system: Oscillator,
) -> list[str]:
    sentences = []
    if regimes[0] == regimes[1]:
        sentences.append(f"Both motions are {regimes[0]}.")
    else:
        sentences.append(f"The kinds of motion differ: measured {regimes[0]}, simulated {regimes[1]}.")
    for name, row in frame[frame["agrees"] == DISAGREE].iterrows():
        if math.isfinite(row["simulated"]):
            sentences.append(
                f"{name}: the simulated one disagrees with the measured one ({100 * (row['ratio'] - 1):+.1f} %)."
            )
        else:
            sentences.append(f"{name}: the simulated motion has none.")
    if math.isfinite(distance):
        sentences.append(
            f"The measured phase points lie {distance:.2g} of the motion's half-width from the simulated curve (rms)."
        )
    table = record.break_away
    loaded = float((table["stick_time"] * table["force_rate"].abs()).mean())
    dropped = float(table["drop"].mean())
    creep = loaded / dropped - _loaded_share(releases, system)
    if len(table) >= 5 and abs(creep) > ALIKE_SHARE:
        sentences.append(
            f"A mean stick loads the spring by {loaded:.4g} (force rate × stick time) and a mean slip unloads it by "
            f"{dropped:.4g}: {100 * creep:+.0f} % beside the simulated motion, by creep and small slips inside sticks, which "
            "the law does not have."
        )
    stick = table["stick_time"].dropna().to_numpy()
    if stick.size >= 5:
        spread = float(np.std(stick) / np.mean(stick))
        if spread > 0.05:
            sentences.append(
                f"Measured sticks scatter by {100 * spread:.0f} % from one to the next, which no deterministic law shows: "
                "means are compared."
            )
    return sentences
