"""The report of an identification: one HTML page with data, fit, residuals, uncertainty and both motions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from stickslip.errors import InputError
from stickslip.files.units import rounded, unit_suffix
from stickslip.identification.estimator.residual_statistics import correlation_time
from stickslip.identification.estimator.result import Result, in_digits
from stickslip.identification.prediction.agreement import compare_motion
from stickslip.identification.result import NAMED, Identification, short_names
from stickslip.identification.selection.comparison import Comparison
from stickslip.identification.trajectory.sensitivity import sensitivity
from stickslip.report.report import Report
from stickslip.show.canvas import ABOVE, in_units, new_axes

SHOWN = 4
"""Records that are drawn one by one; of more the first ones."""
DISTINCT = 0.5
"""A number whose error is a larger share of it may as well be 0."""
POINTS = 8000
"""Samples that are drawn of each record."""


def page(result: Identification, comparison: Comparison | None = None, simulate: bool = True) -> Report:
    """Put the report of an identification together.

    Parameters
    ----------
    result : the identification.
    comparison : the comparison of laws that it comes from, where there was one.
    simulate : whether the law is set in motion and compared with each record; a record that does not say its mass,
        stiffness and drive velocity is left out with the reason.

    Returns
    -------
    Report; ``.write("FILE.html")`` makes one file that needs nothing else.
    """
    name = type(result.law).__name__
    report = Report(f"{name} identified")
    report.summary(_sentence(result), _key_numbers(result))
    report.heading("Data")
    report.table(_data(result))
    report.figure(
        result.plot().figure,
        "Friction over slip velocity: measured (light), and the law along that motion.",
        live=_live(result),
        panels="law,phase,displacement",
    )
    if comparison is not None:
        report.heading("Which law")
        report.table(comparison.table, mark="verdict")
        report.items(comparison.sentences)
    report.heading("The law and its uncertainty")
    report.table(in_digits(result.shown()).rename(columns={"low": "95 % from", "high": "to"}))
    report.figure(
        _correlation(result), "Correlation of the fitted numbers: near ±1 only a combination of the two is known."
    )
    if result.static is not None:
        report.heading("Static friction over stick time")
        report.figure(result.static.plot().figure, "Break-away forces and the forms that lie closest to them.")
        report.figure(result.static.plot_residuals()[0].figure, "Break-away forces above the chosen form.")
    report.heading("Residuals")
    report.figure(
        _residuals(result),
        "Measured minus predicted friction over time, over slip velocity, and its density. An indirect force is rounded by "
        "smoothing where friction bends or a slip begins; the fit compares displacements, whose scale the table gives.",
    )
    report.table(result.groups.set_index("record"))
    if result.motions is not None:
        report.heading("The motion compared with each record")
        report.table(result.motions.set_index("record"))
    if simulate:
        _motions(report, result)
    report.heading("What was assumed, and what the records cannot show")
    report.items([*_held(result), *result.notes])
    report.heading("To do it again")
    report.code(result.command)
    report.code(result.to_toml())
    return report


def page_of_table(result: Result) -> Report:
    """The report of a fit to tables: friction over slip velocity, break-aways, or steps of the speed.

    Returns
    -------
    Report; ``.write("FILE.html")`` makes one file that needs nothing else.
    """
    first, *more = result.heading()
    report = Report(first)
    numbers = result.estimates()
    report.summary(" ".join(more), _best_known(numbers, result.units))
    report.figure(result.plot().figure, "Measured, and the fit.")
    report.heading("The numbers and their uncertainty")
    report.table(in_digits(result.shown()).rename(columns={"low": "95 % from", "high": "to"}))
    report.heading("All that was fitted")
    tables = result.tables()
    report.code("\n\n".join(tables[1:] or tables))
    report.heading("What was assumed, and what the records cannot show")
    report.items(result.notes)
    return report


def _live(result: Identification) -> dict[str, Any] | None:
    """The first record and the law as the explorer shows them, where it knows motions of such a law."""
    from stickslip.explorer import content_of_record
    from stickslip.laws.state_law import StateLaw

    record = result.records[0]
    if isinstance(result.law, StateLaw) or not {"mass", "stiffness", "drive_velocity"} <= set(record.constants):
        return None
    return content_of_record(record, record.name, result.law)


def _sentence(result: Identification) -> str:
    names = [record.name for record in result.records]
    records = ", ".join(names) if len(names) <= SHOWN else f"{len(names)} records"
    fitted = len(result.parameters)
    return f"{type(result.law).__name__} with {fitted} fitted numbers describes {records}."


def _key_numbers(result: Identification) -> dict[str, str]:
    """The numbers of the law that are known best, three with the residual where they are few."""
    key = _best_known(result.parameters, result.units)
    what, size = result.misfit()
    return key if len(key) == 3 else key | {what.removesuffix(":"): size}


def _best_known(table: pd.DataFrame, units: Mapping[str, str]) -> dict[str, str]:
    """Up to three numbers whose errors are least beside their values, with their units; none that may as well be 0."""
    relative = (table["error"] / table["value"].abs()).sort_values(kind="stable")
    best = relative.index[relative < DISTINCT][:3]
    key = {}
    for name in (name for name in table.index if name in best):
        known = rounded(float(table.loc[name, "value"]), float(table.loc[name, "error"]))
        key[str(name)] = known + unit_suffix(units.get(str(name)))
    return key


def _data(result: Identification) -> pd.DataFrame:
    rows = {}
    for record in result.records:
        time, velocity = in_units(record.units.get("time")), in_units(record.units.get("slip_velocity"))
        rows[record.name] = {
            "samples": record.time.size,
            f"from{time}": float(record.time[0]),
            f"to{time}": float(record.time[-1]),
            f"drive velocity{velocity}": record.constants.get("drive_velocity", math.nan),
            "break-aways": len(record.break_away),
            "stuck": float(np.mean(record.stuck)),
            "measured from": str(record.attrs.get("source", "not said")),
        }
    return pd.DataFrame.from_dict(rows, orient="index")


def _held(result: Identification) -> list[str]:
    held = [f"{name} = {number:.6g}" for name, number in result.held().items()]
    return ["Numbers of the law that were not fitted: " + ", ".join(held) + "."] if held else []


def _correlation(result: Identification) -> Any:
    names = [str(name) for name in result.covariance.index]
    errors = np.sqrt(np.diag(result.covariance))
    correlation = result.covariance.to_numpy() / np.outer(errors, errors)
    size = 2.2 + 0.45 * len(names)
    (axes,) = new_axes(figsize=(size + 1.2, size))
    picture = axes.imshow(correlation, vmin=-1, vmax=1, cmap="RdBu_r")
    axes.set_xticks(range(len(names)), names, rotation=90)
    axes.set_yticks(range(len(names)), names)
    axes.figure.colorbar(picture, ax=axes, label="correlation")
    return axes.figure


def _residuals(result: Identification) -> Any:
    over_time, over_speed, spread = new_axes(1, 3, figsize=(9.6, 3.2))
    names, rests, together = short_names(result.records), list[np.ndarray](), list[float]()
    many = len(names) > NAMED
    for number in range(len(result.records)):
        frame = result.residuals(number)
        frame = frame[frame["compared"]]
        rest = (frame["force"] - frame["predicted"]).to_numpy()
        if not rest.size:
            continue
        some = slice(None, None, max(1, rest.size // POINTS))
        look: dict[str, Any] = {"ms": 2, "rasterized": True, "color": "0.4" if many else None}
        over_time.plot(frame["time"].to_numpy()[some], rest[some], ".", **look)
        over_speed.plot(frame["slip_velocity"].to_numpy()[some], rest[some], ".", **look)
        rests.append(rest)
        together.append(correlation_time(rest))
        label = None if many else f"{names[number]}: {together[-1]:.0f} samples together"
        spread.hist(rest, bins=60, density=True, histtype="step", label=label, color="0.4" if many else None)
    units = result.records[0].units
    residual = "measured − predicted friction" + in_units(units.get("force"))
    # A few outliers must not flatten the axis: it holds all but the farthest 1 %, twice as wide.
    reach = 2 * float(np.quantile(np.abs(np.concatenate(rests)), 0.99)) if rests else 0.0
    for axes, label, name in ((over_time, "time t", "time"), (over_speed, "slip velocity w", "slip_velocity")):
        axes.axhline(0, color="0.3", lw=0.8)
        axes.set(xlabel=label + in_units(units.get(name)), ylabel=residual)
        if reach:
            axes.set_ylim(-reach, reach)
    spread.set(xlabel=residual, ylabel="density")
    if many:
        spread.set_title(f"{len(rests)} records, {np.median(together):.0f} samples together", fontsize=8)
    else:
        spread.legend(**ABOVE)
    return over_time.figure


def _motions(report: Report, result: Identification) -> None:
    report.heading("From the law to the motion")
    left_out = []
    for record in result.records[:SHOWN]:
        try:
            agreement = compare_motion(record, result)
        except InputError as error:
            left_out.append(str(error))
            continue
        report.figure(
            agreement.plot(), f"{record.name}: measured and simulated phase portrait, and spring force over time."
        )
        report.table(agreement.shown())
        report.items(agreement.sentences)
    report.items(left_out)
    if len(result.records) > SHOWN:
        report.text(f"The first {SHOWN} of {len(result.records)} records are shown.")
    try:
        found = sensitivity(result)
    except InputError as error:
        report.items([f"How the motion answers to the numbers cannot be said: {error}."])
        return
    report.text(
        "Change of the motion for 1 % of each number: of the period in %, of the turning points in % of half the width of "
        "the measured motion, of the time stuck in points of per cent."
    )
    report.table(found.table)
    strongest = str(found.table.abs().max(axis=1).idxmax())
    report.figure(
        found.plot(strongest).figure,
        f"Phase trajectories with {strongest} changed by 10 % to either side, where that is a law.",
    )
