"""The search for what the paper leaves open: numbers, under several readings, that make its statements come out.

A *reading* says which numbers are free and what law they make. A candidate draws the numbers, fits the damping so that
stick-slip ends at the drive velocity drawn for it, and is judged by the statements themselves, cheap ones first: a candidate
that fails at one stage is not taken to the next. The search is seeded, writes each candidate to a file as it is judged and
goes on from that file. It is run as ``python -m stickslip.paper.calibration``.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.documents import did_you_mean
from stickslip.errors import InputError
from stickslip.laws import BogaczRyczek, StaticFriction
from stickslip.paper.judges import STATEMENTS
from stickslip.paper.statement import NOT, PARTLY, REPRODUCED
from stickslip.paper.study import Make, Study
from stickslip.simulation import simulate
from stickslip.system import Harmonic, Oscillator

if TYPE_CHECKING:
    import pandas as pd

Numbers = Mapping[str, float]


@dataclass(frozen=True)
class Reading:
    """A way to read the paper: free numbers with their bounds, and the law they make."""

    sentence: str
    bounds: Mapping[str, tuple[float, float]]
    law: Callable[[Numbers], BogaczRyczek]


@dataclass(frozen=True)
class Calibration:
    """A reading with its numbers chosen."""

    reading: str
    damping: float
    law: BogaczRyczek

    def oscillator(self, drive_velocity: float, forcing: Harmonic | None = None) -> Oscillator:
        """The oscillator at one drive velocity, with or without a forcing."""
        return Oscillator(damping=self.damping, drive_velocity=drive_velocity, law=self.law, forcing=forcing)


def falling(numbers: Numbers) -> StaticFriction:
    """The surface whose f_s(0, δ) falls from `at_end_of_stick_slip` (δ = 0.25) to `at_end_of_oscillation` (δ = 0.40).

    >>> surface = falling(dict(at_end_of_oscillation=1.08, at_end_of_stick_slip=1.9, scale=0.36, exponent=9, growth=0.1))
    >>> round(surface.initial + surface.drop / (1 + (0.25 / 0.36) ** 9), 12)
    1.9
    """
    low, high = numbers["at_end_of_oscillation"], numbers["at_end_of_stick_slip"]
    gone = [1 / (1 + (delta / numbers["scale"]) ** numbers["exponent"]) for delta in (0.40, 0.25)]
    drop = (high - low) / (gone[1] - gone[0])
    return StaticFriction(
        initial=low - drop * gone[0],
        drop=drop,
        drop_scale=numbers["scale"],
        drop_exponent=numbers["exponent"],
        limit=numbers["growth"],
        rate=0.3,
        force_rate_scale=0.5,
    )


def law(numbers: Numbers, **geometry: Any) -> BogaczRyczek:
    """The law with that surface, and with α(f_s) = `fall` · (f_s − f_s(0, 0.25)) where that is positive.

    >>> numbers = dict(at_end_of_oscillation=1.08, at_end_of_stick_slip=1.9, scale=0.36, exponent=9, growth=0.1, fall=1.2)
    >>> law(numbers).alpha
    ((1.9, 0.0), (2.9, 1.2))
    """
    high = numbers["at_end_of_stick_slip"]
    alpha = ((high, 0.0), (high + 1.0, numbers["fall"]))
    return BogaczRyczek(static_friction=falling(numbers), alpha=alpha, **geometry)


_COMMON = {"growth": (0.05, 0.4), "end_of_stick_slip": (0.2460, 0.2545)}
_FALLING = {
    "at_end_of_oscillation": (1.062, 1.084),
    "at_end_of_stick_slip": (1.3, 2.4),
    "scale": (0.25, 0.39),
    "exponent": (2.0, 16.0),
    "fall": (0.0, 2.0),
    **_COMMON,
}

READINGS: dict[str, Reading] = {
    "one f_s(0)": Reading(
        "f_s(0, ·) is one number, so every climb ends at the same friction",
        {"at_end_of_oscillation": (1.062, 1.084), **_COMMON},
        lambda numbers: BogaczRyczek(
            static_friction=StaticFriction(
                initial=numbers["at_end_of_oscillation"], limit=numbers["growth"], rate=0.3, force_rate_scale=0.5
            )
        ),
    ),
    "falling f_s(0, δ)": Reading(
        "f_s(0, δ) falls with the force rate, and a climb ends at its value at the turn",
        _FALLING,
        law,
    ),
    "climbs at η": Reading(
        "as before, with D at infinity at every drive velocity",
        _FALLING,
        lambda numbers: law(numbers, D=None),
    ),
}

#: Calibrations to lay beside each other: the default, and what each reading without one of its parts can do.
CALIBRATIONS: dict[str, Calibration] = {
    "default": Calibration("falling f_s(0, δ)", 0.35, BogaczRyczek()),
    "α = 0": Calibration("falling f_s(0, δ)", 0.2615, BogaczRyczek(alpha=0.0)),
    "climbs at η": Calibration("climbs at η", 0.35, BogaczRyczek(D=None)),
    "one f_s(0)": Calibration(
        "one f_s(0)",
        0.28,
        BogaczRyczek(static_friction=StaticFriction(1.084, limit=0.3, rate=0.3, force_rate_scale=0.5), alpha=0.0),
    ),
}

#: Statements by the stage at which a candidate of the search is asked for them; the next stage needs all of one.
STAGES: tuple[tuple[str, ...], ...] = (
    ("always-slipping", "amplitude-falls", "friction-falls"),
    ("passage", "first-break-away"),
    ("forced-0.40-two-periodic", "forced-0.40-non-periodic"),
    ("forced-0.30-two-periodic", "forced-0.30-non-periodic", "forced-0.30-one-amplitude"),
    ("end-of-stick-slip", "end-of-oscillation", "turning-slip-velocity-grows", "single-limit-cycle"),
)

_WORTH = {REPRODUCED: 1.0, PARTLY: 0.5, NOT: 0.0}


def search(
    reading: str,
    path: str | Path,
    *,
    candidates: int = 200,
    seed: int = 1,
    progress: Callable[[str, int, int], Any] | None = None,
) -> pd.DataFrame:
    """Search the free numbers of a reading for those that make the paper's statements come out.

    Every third candidate is drawn from the bounds, the others near one of the five best so far. Its worth is the number of
    statements of :data:`STAGES` reproduced, half for those partly so, and up to a fifth more for a forced statement that
    holds at several forcing amplitudes.

    Parameters
    ----------
    reading : a name of :data:`READINGS`.
    path : JSON lines, one a candidate; a file that is there is gone on from.
    candidates : how many the file shall hold at the end.
    seed : of the random numbers; the same seed gives the same file.
    progress : called as ``progress(what, done, n)`` after each candidate.

    Returns
    -------
    DataFrame of all candidates, the best first: ``worth``, the numbers, ``damping`` and the verdict by statement.

    Raises
    ------
    InputError
        for an unknown reading, or a file of another reading or seed.
    """
    import pandas as pd

    if reading not in READINGS:
        raise InputError(
            f"search: reading must be one of {', '.join(READINGS)}, got {reading!r}{did_you_mean(reading, READINGS)}"
        )
    path = Path(path)
    rows = _resume(path, reading, seed)
    with path.open("a", encoding="utf-8") as file:
        for index in range(len(rows), candidates):
            row = {"reading": reading, "seed": seed, "index": index} | _candidate(READINGS[reading], rows, seed, index)
            rows.append(row)
            file.write(json.dumps(row) + "\n")
            file.flush()
            if progress is not None:
                best = max(row["worth"] for row in rows)
                progress(f"best worth {best:.2f}", index + 1, candidates)
    return pd.DataFrame(rows).sort_values("worth", ascending=False, kind="stable")


def _resume(path: Path, reading: str, seed: int) -> list[dict[str, Any]]:
    if not path.exists():
        return []
    rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    for number, row in enumerate(rows, start=1):
        if (row["reading"], row["seed"], row["index"]) != (reading, seed, number - 1):
            raise InputError(
                f"{path}: row {number} is of another search; choose another file or the same reading and seed"
            )
    return rows


def _candidate(reading: Reading, rows: list[dict[str, Any]], seed: int, index: int) -> dict[str, Any]:
    random = np.random.default_rng([seed, index])
    best = sorted(rows, key=lambda row: -row["worth"])[:5]
    near = best[int(random.integers(len(best)))] if best and index % 3 else None
    numbers = {}
    for name, (low, high) in reading.bounds.items():
        value = random.uniform(low, high) if near is None else random.normal(near[name], 0.04 * (high - low))
        numbers[name] = float(np.clip(value, low, high))
    try:
        law = reading.law(numbers)
    except InputError:
        return {**numbers, "damping": None, "worth": 0.0, "verdicts": {}}
    calibration = Calibration("", fit_damping(law, numbers["end_of_stick_slip"]), law)
    return {**numbers, "damping": calibration.damping, **worth(calibration.oscillator)}


def fit_damping(law: BogaczRyczek, end_of_stick_slip: float) -> float:
    """The damping d at which stick-slip, from the stuck start, ends at a drive velocity; between 0.05 and 0.45, to 0.0004.

    >>> from stickslip import paper
    >>> abs(fit_damping(paper.oscillator(0.3).law, 0.2500) - paper.DAMPING) < 0.05
    True
    """
    low, high = 0.05, 0.45
    for _ in range(10):
        damping = (low + high) / 2
        system = Oscillator(damping=damping, drive_velocity=end_of_stick_slip, law=law)
        sticks = simulate(system, 150 * system.natural_period).regime(transient=0.85) == "stick_slip"
        low, high = (damping, high) if sticks else (low, damping)
    return high


def worth(make: Make) -> dict[str, Any]:
    """The worth of a model for the search, and its verdicts at the stages it was taken to."""
    study = Study(make, periods=150, tolerance=5e-4, forcing_periods=400, workers=1)
    by_id = {statement.id: statement for statement in STATEMENTS}
    total, verdicts = 0.0, {}
    for stage in STAGES:
        passed = True
        for name in stage:
            seen = by_id[name].look(study)
            verdicts[name] = seen.verdict
            total += _WORTH[seen.verdict]
            if name.startswith("forced") and not name.endswith("amplitude"):
                total += 0.04 * min(seen.value, 5.0)
            passed &= seen.verdict == REPRODUCED
        if not passed:
            break
    return {"worth": round(total, 6), "verdicts": verdicts}
