"""What is known of public records beside the laws identified from them, and the page public-records.md made of it.

python docs/evidence/public_records.py [FOLDER of the records; default STICKSLIP_DATA]
"""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.identification import fit_static_friction, fit_steady, fit_velocity_step, fit_velocity_steps
from stickslip.measurement import load_rig, measure

PAGE = Path(__file__).with_name("public-records.md")
RIGS = Path(__file__).parents[2] / "python" / "stickslip" / "examples" / "rigs"

INTRODUCTION = """# Laws of public records, and what is known of them

Each record is measured with its rig file in `python/stickslip/examples/rigs`. It is identified as `stickslip identify`
does it, with no number given by hand. Known is what the owners of the records published, or what was found
independently of this package. An interval is that of the law, 95 %. Where the known number is one measurement, it is
that of one more measurement. Where only break-aways were recorded, it is that of a mean. The tests compute the table
anew where the records are at hand. `python docs/evidence/public_records.py` writes it.

| record | law | number | known | found | 95 % | inside |
|---|---|---|---|---|---|---|
"""


@dataclass(frozen=True)
class Row:
    """One line of the table; `why` says why an interval does not hold what is known."""

    record: str
    law: str
    number: str
    known: float
    found: float
    low: float
    high: float
    why: str = ""

    @property
    def inside(self) -> bool:
        """Whether the interval holds the known number."""
        return self.low <= self.known <= self.high

    def line(self) -> str:
        """The line."""
        cells = [self.record, self.law, self.number, f"{self.known:g}", f"{self.found:.4g}"]
        verdict = "yes" if self.inside else f"no: {self.why}"
        return "| " + " | ".join([*cells, f"{self.low:.4g} to {self.high:.4g}", verdict]) + " |\n"


Records = Callable[..., Any]
RECORDS: dict[str, Callable[[Path], Iterator[Row]]] = {}


def record(function: Callable[[Path], Iterator[Row]]) -> Callable[[Path], Iterator[Row]]:
    """One record, by the name of its function."""
    RECORDS[function.__name__] = function
    return function


def measured(folder: Path, rig: str, *patterns: str, window: tuple[float, float] | None = None) -> Any:
    """Friction of these records with this rig."""
    bench = load_rig(RIGS / f"{rig}.toml")
    if window is not None:
        bench = replace(bench, read=replace(bench.read, window=window))
    return measure([path for pattern in patterns for path in sorted(folder.glob(pattern))], bench)


def numbers(name: str, law: str, parameters: Any, known: dict[str, tuple[str, float]], why: str = "") -> Iterator[Row]:
    """Numbers of a law: by its name of them, what they are, and what is known."""
    for key, (words, value) in known.items():
        row = parameters.loc[key]
        yield Row(name, law, words, value, row["value"], row["low"], row["high"], why)


def points(
    name: str, found: Any, words: list[str], known: Any, w: Any, single: bool = False, **beside: Any
) -> Iterator[Row]:
    """Values of a curve."""
    low, high = found.best.interval(w, single=single, **beside)
    law = found.chosen + (" (one measurement)" if single else "")
    for one in zip(words, known, found.best(w, **beside), low, high, strict=True):
        yield Row(name, law, *one)


@record
def robot_joint_kinova(folder: Path) -> Iterator[Row]:
    found = fit_steady(measured(folder, "robot_joint_kinova", "robot_joint_kinova/velocity_*.csv"))
    speed = found.rows["slip_velocity"].to_numpy()
    words = [f"torque at {w} rad/s, N m" for w in (0.03, 0.09, 0.3, 0.7, 1.3)]
    yield from points("robot_joint_kinova", found, words, [1.69, 1.79, 1.79, 2.10, 2.56], speed)


@record
def robot_joint_franka(folder: Path) -> Iterator[Row]:
    found = fit_steady(measured(folder, "robot_joint_nnfm", "robot_joint_nnfm/franka*.csv"))
    known = {"kinetic": ("Coulomb torque, N m", 0.40), "offset": ("offset of the torque, N m", -0.17)}
    yield from numbers("robot_joint_nnfm, franka", found.chosen, found.parameters, known)


@record
def robot_joint_fairino(folder: Path) -> Iterator[Row]:
    found = fit_steady(measured(folder, "robot_joint_fairino", "robot_joint_nnfm/fairino*.csv"))
    # the largest torque of slow passages, one sample each
    yield from points(
        "robot_joint_nnfm, fairino", found, ["largest torque below 0.002 rad/s, N m"], [8.0], [0.002], True
    )


@record
def pneumatic_seal(folder: Path) -> Iterator[Row]:
    runs = {
        "O-ring": ("pneumatic_seal_o_ring", ["O-ring257_*.csv", "rerun*.csv"], [4.75, 5.95, 7.25, 8.04]),
        "KDN": ("pneumatic_seal_kdn", ["KDN_*.csv"], [5.63, 5.74, 6.29, 7.02]),
    }
    bars = np.array([1.0, 3.0, 5.0, 7.0])
    for seal, (rig, patterns, known) in runs.items():
        found = fit_steady(measured(folder, rig, *(f"pneumatic_seal/{pattern}" for pattern in patterns)))
        words = [f"half loop at {bar:g} bar, N" for bar in bars]
        yield from points(
            f"pneumatic_seal, {seal}", found, words, known, np.full(4, found.best.curve.reference), load=1e5 * bars
        )


@record
def rock_velocity_steps(folder: Path) -> Iterator[Row]:
    found = fit_velocity_step(measured(folder, "rock_velocity_steps", "rock_velocity_steps/*.txt"))
    law = f"RateState, {found.law.law} law"
    jump = math.log(10.01 / 3.00)
    known = {"a": ("direct effect a: 0.0105 / ln(10.01/3.00)", round(0.0105 / jump, 5)), "a_minus_b": ("a - b", 0.0)}
    yield from numbers("rock_velocity_steps", law, found.parameters, known)
    why = "known is the mean of the last two seconds, of the last five it is 0.6081"
    before = {"reference_friction": ("friction before", 0.6085)}
    yield from numbers("rock_velocity_steps", law, found.parameters, before, why)


@record
def rock_biax_p446(folder: Path) -> Iterator[Row]:
    name = "rock_biax_p446, 10 MPa"
    tree = measured(folder, "rock_biax_p446", "rock_biax_p446/p446s7tr005l", window=(2920.0, 4140.0))
    found = fit_steady(tree)
    yield from numbers(name, found.chosen, found.parameters, {"logarithm": ("growth per e-fold of the speed", 0.001)})
    together = fit_velocity_steps(tree)
    law = f"RateState, {together.law.law} law, {len(together.steps)} steps"
    yield from numbers(name, law, together.parameters, {"a_minus_b": ("a - b", 0.001)})
    holds = tree["steady"].to_dataset(inherit=False).to_dataframe()
    last = holds.iloc[-11:]  # from 1 um/s up to 300 and back; the hold before is that of the loading
    known = [0.5764, 0.5779, 0.5775, 0.5785, 0.5809, 0.5824, 0.5798, 0.5806, 0.5813, 0.5812, 0.5802]
    speeds = [1, 3, 10, 30, 100, 300, 100, 30, 10, 3, 1]
    words = [f"friction at {speed} um/s, {'up' if i < 6 else 'down'}" for i, speed in enumerate(speeds)]
    w, place = last["slip_velocity"].to_numpy(), last["displacement"].to_numpy()
    yield from points(name, found, words, known, w, single=True, position=place)


@record
def single_pendulum(folder: Path) -> Iterator[Row]:
    tree = measured(folder, "single_pendulum", "single_pendulum/*.mat")
    found = fit_steady(tree)
    law, name = found.chosen, "single_pendulum"
    yield from numbers(name, law, found.parameters, {"kinetic": ("Coulomb torque, N m", 5.9e-4)})
    restoring = float(tree.attrs["restoring_torque"])
    kinetic = found.parameters.loc["kinetic"]
    last = [4 * kinetic[key] / restoring for key in ("value", "low", "high")]
    yield Row(name, law, "loss per cycle that it tends to, rad", 0.011, *last)
    # the loss of a cycle costs the energy m g l (cos A' - cos A) and is friction times path
    cycles, rows = tree["cycle"].to_dataset(inherit=False).to_dataframe(), found.rows
    for amplitude, known in ((1.6, 0.052), (1.2, 0.030), (0.93, 0.0219), (0.72, 0.0166), (0.55, 0.0137), (0.25, 0.012)):
        at = int((cycles["amplitude"] - amplitude).abs().to_numpy().argmin())
        swing, loss, torque = cycles["amplitude"].iloc[at], cycles["loss"].iloc[at], rows["force"].iloc[at]
        path = restoring * (math.cos(swing - loss) - math.cos(swing)) / torque
        w = [float(rows["slip_velocity"].iloc[at])]
        low, high = found.best.interval(w, single=True)
        ends = [
            swing - math.acos(min(math.cos(swing) + float(force[0]) * path / restoring, 1.0))
            for force in (found.best(w), low, high)
        ]
        yield Row(name, f"{law} (one measurement)", f"loss per cycle at {amplitude} rad, rad", known, *ends)


@record
def spring_slider_camera(folder: Path) -> Iterator[Row]:
    tree = measured(folder, "spring_slider_camera", "spring_slider_camera/Force7_rows*.txt")
    name, events = "spring_slider_camera", tree["break_away"].to_dataset(inherit=False).to_dataframe()
    waits = np.diff(events["t"])
    for words, known, values in (
        ("peak force, N", 11.43, events["force"]),
        ("fall, N", 3.04, events["drop"]),
        ("recurrence, s", 7.06, waits),
        ("loading rate, N/s", 0.485, events["force_rate"]),
    ):
        values = np.asarray(values, float)[np.isfinite(values)]
        middle = float(np.median(values)) if "rate" in words else float(np.mean(values))
        half = 1.96 * float(np.std(values, ddof=1)) / math.sqrt(len(values))
        yield Row(name, f"{len(values)} break-aways", words, known, middle, middle - half, middle + half)
    found = fit_static_friction(tree)
    slope = found.fits["logarithmic"].parameters.loc["slope"]
    yield Row(name, "logarithmic", "growth per decade of stick time, N", 2.8, *slope[["value", "low", "high"]])


NOTES = """
* `spring_slider_camera`: stick time and force rate cannot be separated, and `identify` says so. No interval holds that.
* `robot_joint_nnfm`: the offset is found by the comparison of forms. Those without it predict held-back rows worse.
* `robot_joint_kinova`: a dip before the growth (1.69, 1.79, 1.79 N m) lies within the interval of a straight line.
  Stribeck's curve has four numbers, and five points do not determine them.
"""


def rows(folder: Path) -> dict[str, list[Row]]:
    """All lines, by record."""
    return {name: list(make(folder)) for name, make in RECORDS.items()}


def page(table: dict[str, list[Row]]) -> str:
    """The page."""
    return INTRODUCTION + "".join(row.line() for part in table.values() for row in part) + NOTES


if __name__ == "__main__":
    where = Path(sys.argv[1] if len(sys.argv) > 1 else os.environ.get("STICKSLIP_DATA", "../shared/data"))
    PAGE.write_text(page(rows(where)), encoding="utf-8")
