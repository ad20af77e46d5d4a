"""Coverage of the intervals of f_s and f_k over records cut anywhere: `python record_ends.py record-ends.md [COUNT]`.

Each record is the exact motion of an oscillator under StaticKinetic with random numbers, sampled at a random rate with
random noise, from a random moment to a random moment, with 3 to 40 break-aways (their logarithm even). A sample is the mean
over a random part of the time between two, as that of a camera or a converter; nobody tells which. It is measured with
the rig's own numbers and identified, and the 95 % intervals are laid beside the truth. Half of the records have seeds from 0
on, on which the measuring was improved, and half have seeds from `FRESH` on, on which it was not. One line a record goes to
`<page>.csv`, and a run that was interrupted goes on from there.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

import stickslip as ss
from stickslip.identification import identify
from stickslip.measurement import Rig, measure

COUNT = 400
FRESH = 7000
WITHIN_A_SAMPLE = 16
"""So many times are averaged for one sample."""
COLUMNS = ("number", "break_aways", "name", "truth", "value", "error", "low", "high")


def cases(count: int) -> Iterator[tuple[int, dict[str, float]]]:
    """Numbers of each record, the same on every run."""
    for number in (seed for half in range(count // 2) for seed in (half, FRESH + half)):
        rng = np.random.default_rng(number)
        yield (
            number,
            {
                "break_away": rng.uniform(0.9, 1.6),
                "ratio": rng.uniform(0.5, 0.8),
                "damping": rng.uniform(0.02, 0.1),
                "drive_velocity": rng.uniform(0.06, 0.2),
                "samples": rng.uniform(50, 120),
                "noise": 10 ** rng.uniform(-3.3, -2.3),
                "break_aways": round(np.exp(rng.uniform(np.log(3), np.log(40)))),
                "first": rng.uniform(),
                "last": rng.uniform(),
            },
        )


def rows(number: int, case: dict[str, float]) -> list[tuple[object, ...]]:
    """The intervals of one record."""
    law = ss.laws.StaticKinetic(break_away=case["break_away"], kinetic=case["break_away"] * case["ratio"])
    wanted = int(case["break_aways"])
    oscillator = ss.Oscillator(damping=case["damping"], drive_velocity=case["drive_velocity"], law=law)
    orbit = ss.simulate(oscillator, 60.0 + (wanted + 3) * 50.0)
    ends = orbit.events.query("kind == 'release' and t > 20")["t"].to_numpy()
    start = ends[0] + case["first"] * (ends[1] - ends[0])
    stop = ends[wanted] + case["last"] * (ends[wanted + 1] - ends[wanted])
    step = 2 * np.pi / case["samples"]
    time = np.arange(start, stop, step)
    open_for = step * np.random.default_rng([number, 2]).uniform()
    while_open = open_for * ((np.arange(WITHIN_A_SAMPLE) + 0.5) / WITHIN_A_SAMPLE - 0.5)
    x = np.mean([orbit.at(time + part)[0] for part in while_open], axis=0)
    x += case["noise"] * np.random.default_rng([number, 1]).standard_normal(len(time))
    found = identify(measure({"t": time - start, "x": x}, Rig.of(oscillator)), law="StaticKinetic").parameters
    return [
        (number, wanted, name, getattr(law, name), *found.loc[name, ["value", "error", "low", "high"]].to_numpy(float))
        for name in ("break_away", "kinetic")
    ]


def table(path: Path, count: int) -> pd.DataFrame:
    """All rows, those of an earlier run kept."""
    done = set(pd.read_csv(path)["number"]) if path.exists() else set()
    for number, case in cases(count):
        if number in done:
            continue
        try:
            found = rows(number, case)
        except ss.InputError as error:  # a refusal is no interval that misses, but it counts
            found = [(number, int(case["break_aways"]), f"refused: {error}", *[float("nan")] * 5)]
        pd.DataFrame(found, columns=COLUMNS).to_csv(path, mode="a", index=False, header=not path.exists())
    return pd.read_csv(path)


def page(found: pd.DataFrame) -> str:
    """The page of the table."""
    lines = [
        "# Records cut anywhere: do the intervals hold the truth?",
        "",
        "Made by `record_ends.py`; its docstring says what is drawn at random. Share of the 95 % intervals that hold the",
        "truth, with its own binomial error, and the median half width of the intervals over the truth. Of records that are",
        "sampled at moments, whose part of the time is 0, 98.5 and 95.5 % hold: the intervals are made for any part.",
        "",
        "| number of the law | break-aways | records | held, % | half width, % | largest miss, half widths |",
        "|---|---|---:|---:|---:|---:|",
    ]
    groups = ((3, 40), (3, 5), (6, 10), (11, 20), (21, 40))
    old, new = found["number"] < FRESH, found["number"] >= FRESH
    for name in ("break_away", "kinetic"):
        some = [(f"{low} to {high}", found["break_aways"].between(low, high)) for low, high in groups]
        for words, these in [*some, (f"seeds below {FRESH}", old), (f"seeds from {FRESH} on", new)]:
            part = found[(found["name"] == name) & these]
            if part.empty:
                continue
            held = (part["low"] <= part["truth"]) & (part["truth"] <= part["high"])
            half = (part["high"] - part["low"]) / 2
            share, count = float(held.mean()), len(part)
            off = float(((part["value"] - part["truth"]).abs() / half).max())
            error = 100 * np.sqrt(share * (1 - share) / count)
            lines.append(
                f"| {name} | {words} | {count} | {100 * share:.1f} ± {error:.1f} "
                f"| {100 * float((half / part['truth']).median()):.3f} | {off:.1f} |"
            )
    refused = found[~found["name"].isin(["break_away", "kinetic"])]
    lines += ["", f"Refused: {len(refused)} records.", *(f"- {word}" for word in refused["name"].unique())]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    place = Path(sys.argv[1])
    whole = table(place.with_suffix(".csv"), int(sys.argv[2]) if len(sys.argv) > 2 else COUNT)
    place.write_text(page(whole))
