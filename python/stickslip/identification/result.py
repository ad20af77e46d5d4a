"""A law identified from friction records, with its uncertainty."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from stickslip.files.units import unit_suffix
from stickslip.identification.estimator.result import Result, in_digits
from stickslip.identification.kinetic.replayed_motion import Motion
from stickslip.identification.records import FrictionRecord
from stickslip.identification.static.static_fit import StaticFrictionFit
from stickslip.laws import Law
from stickslip.laws.law import law_file
from stickslip.laws.numbers import maybe, pointers, units_of


@dataclass(frozen=True, repr=False, eq=False)
class Identification(Result):
    """A law identified from friction records.

    Attributes
    ----------
    law : the law.
    parameters : DataFrame over the names of the fitted numbers: value, error (standard error), low and high (95 %).
    covariance : DataFrame, names in both directions.
    groups : DataFrame of the residuals' groups: record, kind, rows, independent (rows that count), scale, record_scatter
        (standard deviation from record to record, where records differ from one another).
    rms : root mean square of measured minus predicted kinetic force; with `motions` that of measured minus simulated
        displacement, in standard deviations of the measured one.
    static : fits of static friction over stick time, None for fewer than five break-aways.
    notes : plain sentences: what was assumed, what could not be told.
    records : the records it was identified from.
    command : what to type to do it again.
    ties, bounds : numbers that follow another, and limits that come from the records.
    offset : value, error, low and high of a constant in the measured force, where it was asked for.
    motions : a row for each record over which the motion of the law was laid, None before that.
    """

    law: Law
    parameters: pd.DataFrame
    covariance: pd.DataFrame
    groups: pd.DataFrame
    rms: float
    static: StaticFrictionFit | None
    notes: list[str]
    records: list[FrictionRecord]
    command: str
    ties: Mapping[str, str] = field(default_factory=dict)
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    offset: pd.Series | None = None
    motions: pd.DataFrame | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "law", self.law.with_covariance(self.covariance, self.ties, self.bounds))

    @property
    def units(self) -> dict[str, str]:
        """The unit of each number of the law by its name, and of the offset; "1" for a pure number."""
        stated = self.records[0].units if self.records else {}
        force, time, velocity = (stated.get(name, "1") for name in ("force", "time", "slip_velocity"))
        units = units_of(self.law, force, velocity.removesuffix(f"/{time}"), time)
        return units if self.offset is None else units | {str(self.offset.name): force}

    @property
    def force_unit(self) -> str:
        """The unit of friction as it stands behind a number."""
        unit = self.records[0].units.get("force", "1") if self.records else "1"
        return unit_suffix(unit)

    def residuals(self, record: int = 0) -> pd.DataFrame:
        """Measured and predicted friction of one record while it slips.

        Returns
        -------
        DataFrame: time, slip_velocity, force, predicted (the law with its memory along the motion), and compared:
        whether the sample entered the fit (not where the memory is unknown or a climb is too steep to be seen).
        """
        motion = Motion.of(self.records[record], type(self.law))
        frame = pd.DataFrame(
            {
                "time": motion.record.time,
                "slip_velocity": motion.slip_velocity,
                "force": motion.record.force,
                "predicted": motion.replay(self.law) + (0.0 if self.offset is None else self.offset["value"]),
                "compared": motion.compared,
            }
        )
        return frame[~motion.record.stuck].reset_index(drop=True)

    def held(self) -> dict[str, float]:
        """Numbers of the law that were not fitted, by name; those that are not set are left out."""
        names = [name for name in pointers(self.law) if name not in self.parameters.index]
        return {name: number for name in names if (number := maybe(self.law, name)) is not None}

    @property
    def beside(self) -> dict[str, float]:
        """What of the measured force is no friction, by name: the offset, where one was fitted."""
        return {} if self.offset is None else {"offset": float(self.offset["value"])}

    def heading(self) -> list[str]:
        """The law and its records."""
        names = ", ".join(record.name for record in self.records)
        return [f"{type(self.law).__name__} from {len(self.records)} record(s): {names}"]

    def estimates(self) -> pd.DataFrame:
        """The parameters, and the offset where one was fitted."""
        return self.parameters if self.offset is None else pd.concat([self.parameters, self.offset.to_frame().T])

    def tables(self) -> list[str]:
        """The numbers and the misfit."""
        table = in_digits(self.shown()).to_string()
        return [table, " ".join(self.misfit())]

    def misfit(self) -> tuple[str, str]:
        """What of records and law lies apart, and by how much."""
        if self.motions is None:
            return "rms of the kinetic force:", f"{self.rms:.3g}{self.force_unit}"
        return "rms distance of the motions:", f"{self.rms:.3g} of the displacement's standard deviation"

    def measured(self) -> dict[str, list[float]]:
        """Least and greatest slip velocity while slipping, and stick time of a break-away, that the records hold."""
        slips = [np.abs(record.slip_velocity[~record.stuck]) for record in self.records]
        rests = [record.break_away["stick_time"].to_numpy(float) for record in self.records]
        held = {"slip_velocity": np.concatenate([[], *slips]), "stick_time": np.concatenate([[], *rests])}
        finite = {name: values[np.isfinite(values)] for name, values in held.items()}
        return {name: [float(values.min()), float(values.max())] for name, values in finite.items() if values.size}

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and words: the law, its parameters with their units, notes, and the motions where there are any."""
        table = self.parameters[["value", "error", "low", "high"]].to_dict("index")
        parameters = {str(name): row | {"unit": self.units[str(name)]} for name, row in table.items()}
        document: dict[str, Any] = {"law": self.law.to_dict(), "parameters": parameters, "notes": self.notes}
        return document if self.motions is None else document | {"motions": self.motions.to_dict("records")}

    def to_toml(self) -> str:
        """The law file: the tables [law], [uncertainty] (standard errors by name), [covariance] and [source]."""
        source = {
            "command": self.command,
            "records": [
                {"name": record.name, "measured_from": str(record.attrs.get("source", "unknown"))}
                for record in self.records
            ],
            "measured": self.measured(),
            **({"beside_friction": self.beside} if self.beside else {}),
            **({"units": dict(self.records[0].units)} if self.records and self.records[0].units else {}),
            "rms": self.rms,
            "intervals": {name: [float(row["low"]), float(row["high"])] for name, row in self.parameters.iterrows()},
            "notes": self.notes,
        }
        return law_file(self.law, self.covariance, source, {name: self.units[name] for name in pointers(self.law)})

    def plot(self, ax: Any = None) -> Any:
        """Friction over slip velocity: the data of every record and the law along the same motion; returns the Axes."""
        from stickslip.show.canvas import ABOVE, OKABE_ITO, axes, in_units, verbatim

        ax = axes(ax)
        many, shown = len(self.records) > NAMED, list[np.ndarray]()
        names = [f"{len(self.records)} records"] if many else [verbatim(name) for name in short_names(self.records)]
        for number in range(len(self.records)):
            frame = self.residuals(number)
            # Forces of a slip in the other sense are shown turned over; the last part is the steady motion.
            frame = frame[frame["compared"]].iloc[-6000:]
            sense = np.where(frame["slip_velocity"] < 0, -1.0, 1.0)
            w = np.abs(frame["slip_velocity"])
            measured = sense * frame["force"]
            name, colour = names[number] if number < len(names) else None, "0.5" if many else None
            ax.plot(w, measured, ".", ms=2, alpha=0.4, color=colour, label=name, rasterized=True)
            law = "law" if number == 0 else None
            ax.plot(w, sense * frame["predicted"], ".", ms=1.5, color=OKABE_ITO["black"], label=law)
            shown.append(measured.to_numpy())
        units = self.records[0].units
        ax.set_xlabel("slip velocity w" + in_units(units.get("slip_velocity")))
        ax.set_ylabel("kinetic force f" + in_units(units.get("force")))
        # A few outliers must not flatten the axis: it holds the middle 99 % and a quarter of that beside.
        low, high = np.quantile(np.concatenate(shown), (0.005, 0.995)) if sum(map(len, shown)) else (0.0, 0.0)
        if high > low:
            ax.set_ylim(low - 0.25 * (high - low), high + 0.25 * (high - low))
        ax.legend(**ABOVE, ncols=2, markerscale=4)
        return ax


NAMED = 6
"""More records than these have no name and colour each in a picture."""


def short_names(records: Sequence[FrictionRecord]) -> list[str]:
    """The names of the files of some records, with their folders where two have one name."""
    names = [Path(record.name).name for record in records]
    return names if len(set(names)) == len(names) else [record.name for record in records]
