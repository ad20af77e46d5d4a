"""What is made of all records of an experiment together: one table, one law, one report."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from stickslip.errors import InputError
from stickslip.experiment.experiment import Experiment
from stickslip.experiment.record_results import column_head
from stickslip.files.disk import write_whole

if TYPE_CHECKING:
    import pandas as pd

Texts = Mapping[str, Mapping[str, tuple[str, str]]]
"""Of each record by name: the facts, each value with its error as a text, and its unit."""


def common_units(texts: Texts) -> dict[str, str]:
    """The unit of each fact that has one, the same in all records."""
    units: dict[str, set[str]] = {}
    for facts in texts.values():
        for name, (_, unit) in facts.items():
            units.setdefault(name, set()).add(unit)
    return {name: unit for name, (unit, *others) in units.items() if unit not in ("", "1") and not others}


def write_joint_results(plan: Experiment, table: pd.DataFrame, texts: Texts) -> str:
    """What is made of all records: one table, one law, one report. Returns what is to be said of the law."""
    import pandas as pd

    from stickslip.identification import Identification, identify
    from stickslip.report.identification import page, page_of_table
    from stickslip.report.report import Report

    results, units = plan.results, table.attrs["units"]
    headed = table.rename(columns=lambda name: column_head(name, units))
    write_whole(results / "records.csv", lambda draft: headed.to_csv(draft))
    good = [str(name) for name in table.index[table["state"] != "failed"]]
    events = []
    for name in good:
        try:
            events.append(pd.read_csv(results / name / "break_away.csv").assign(record=name))
        except pd.errors.EmptyDataError:
            continue
    together = pd.concat(events) if events else pd.DataFrame()
    write_whole(results / "break_away.csv", lambda draft: together.to_csv(draft, index=False))
    report, why = Report("Experiment"), ""
    law = None
    if plan.law and good:
        try:
            law = identify(
                [results / name / "friction.nc" for name in good], law=None if plan.law == "auto" else plan.law
            )
            law.save(results / "law.toml")
            report = page(law, simulate=False) if isinstance(law, Identification) else page_of_table(law)
        except InputError as error:
            why = str(error)
    if law is None:
        (results / "law.toml").unlink(missing_ok=True)
    report.heading("Records")
    report.text(
        f"{len(good)} of {len(table)} records were measured." + (f" No law was identified: {why}" if why else "")
    )
    shown = pd.DataFrame({name: {key: text for key, (text, _) in texts[name].items()} for name in good}).T
    shown = shown.rename(columns=lambda name: column_head(name, units)).rename_axis("record")
    report.table(table[["state", "message"] if len(good) < len(table) else ["state"]].join(shown).fillna(""))
    report.items(
        [f"{name}: {note}" for name, note in table.get("notes", pd.Series(dtype=str)).dropna().items() if note]
    )
    if len(together):
        report.heading("Break-aways")
        report.table(together.set_index("record").drop(columns=["event"], errors="ignore").head(MOST_ROWS))
        if len(together) > MOST_ROWS:
            report.text(f"The first {MOST_ROWS} of {len(together)}; all are in break_away.csv.")
    report.write(results / "report.html")
    return law.report() if law is not None else f"No law was identified: {why}" if why else ""


MOST_ROWS = 500
"""Break-aways that the report shows."""
