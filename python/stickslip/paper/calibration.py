"""The search for what the paper leaves open: numbers, under several readings, that make its claims come out.

A *reading* says which numbers are free and what law they make. While nothing sticks, the damping and f_s(0, δ) alone decide
the motion: a candidate draws these and is checked by the claims on motions without sticks, cheap and rare ones first; one
that fails at a stage is not taken to the next. Where all of them come out, the numbers that are felt in sticks alone, the
growth of f_s with rest and α(f_s), are drawn many times over and checked by the other claims. The search is seeded, writes
each candidate to a file as it is checked and goes on from that file.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.errors import InputError, did_you_mean
from stickslip.laws import BogaczRyczek, StaticFriction
from stickslip.model.drive import Harmonic
from stickslip.model.system import Oscillator
from stickslip.paper.checks import CLAIMS
from stickslip.paper.claim import NOT, PARTLY, REPRODUCED
from stickslip.paper.default_calibration import DAMPING
from stickslip.paper.study import Make, Study

if TYPE_CHECKING:
    import pandas as pd

Numbers = Mapping[str, float]


@dataclass(frozen=True)
class Reading:
    """A way to read the paper: free numbers with their bounds, and the law they make."""

    sentence: str
    slipping: Mapping[str, tuple[float, float]]
    law: Callable[[Numbers], BogaczRyczek]

    def make(self, numbers: Numbers) -> Make:
        """The oscillators with these numbers."""
        return Calibration("", numbers["damping"], self.law(numbers)).oscillator


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

    A part of that, `second_drop`, may be gone earlier, in a second step.

    >>> numbers = dict(at_end_of_oscillation=1.08, at_end_of_stick_slip=1.9, scale=0.36, exponent=9)
    >>> surface = falling(numbers | dict(growth=0.1, rate=0.3, force_rate_scale=0.5))
    >>> round(surface.initial + surface.drop / (1 + (0.25 / 0.36) ** 9), 12)
    1.9
    """
    low, high = numbers["at_end_of_oscillation"], numbers["at_end_of_stick_slip"]
    second = {name: numbers[name] for name in _SECOND if name in numbers}
    if second:
        late, early = (
            second["second_drop"] * left for left in _left(second["second_drop_scale"], second["second_drop_exponent"])
        )
        low, high = low - late, high - early
    left = _left(numbers["scale"], numbers["exponent"])
    drop = (high - low) / (left[1] - left[0])
    return StaticFriction(
        initial=low - drop * left[0],
        drop=drop,
        drop_scale=numbers["scale"],
        drop_exponent=numbers["exponent"],
        **second,
        **_growth(numbers),
    )


def _left(scale: float, exponent: float) -> tuple[float, float]:
    """What is left of a step at the end of the oscillation, and of stick-slip."""
    late, early = (1 / (1 + (delta / scale) ** exponent) for delta in (0.40, 0.25))
    return late, early


def constant(numbers: Numbers) -> StaticFriction:
    """The surface whose f_s(0, ·) is one number."""
    return StaticFriction(initial=numbers["at_end_of_oscillation"], **_growth(numbers))


def _growth(numbers: Numbers) -> dict[str, float]:
    return {
        "limit": numbers["growth"],
        "rate": numbers["rate"],
        "force_rate_scale": numbers["force_rate_scale"],
    }


def law(numbers: Numbers, surface: Callable[[Numbers], StaticFriction] = falling, **geometry: Any) -> BogaczRyczek:
    """The law with such a surface, and with α(f_s) = `fall` · (f_s − f_s(0, 0.25) − `fall_above`) where that is positive.

    >>> numbers = dict(at_end_of_oscillation=1.08, at_end_of_stick_slip=1.9, scale=0.36, exponent=9)
    >>> law(numbers | dict(growth=0.1, rate=0.3, force_rate_scale=0.5, fall=1.2, fall_above=0.1)).alpha
    ((2.0, 0.0), (3.0, 1.2))
    """
    start = numbers.get("at_end_of_stick_slip", numbers["at_end_of_oscillation"]) + numbers["fall_above"]
    alpha = ((start, 0.0), (start + 1.0, numbers["fall"]))
    return BogaczRyczek(static_friction=surface(numbers), alpha=alpha, **geometry)


_CONSTANT = {"damping": (0.20, 0.42), "at_end_of_oscillation": (0.95, 1.12)}
_FALLING = {**_CONSTANT, "at_end_of_stick_slip": (1.15, 2.4), "scale": (0.22, 0.46), "exponent": (2.0, 40.0)}
_SECOND = {"second_drop": (0.0, 1.4), "second_drop_scale": (0.22, 0.34), "second_drop_exponent": (2.0, 8.0)}

#: The numbers that are felt in sticks alone.
_STICKING = {
    "growth": (0.02, 0.8),
    "rate": (0.05, 1.0),
    "force_rate_scale": (0.1, 2.5),
    "fall": (0.0, 3.0),
    "fall_above": (-0.3, 0.3),
}

READINGS: dict[str, Reading] = {
    "one f_s(0)": Reading(
        "f_s(0, ·) is one number, so every climb ends at the same friction",
        _CONSTANT,
        lambda numbers: law(numbers, constant),
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
    "back along A": Reading(
        "f_s(0, δ) falls in one step, and a turn of ẇ from + to − on the upper line goes back along it",
        _FALLING,
        lambda numbers: law(numbers, upper_turn="back"),
    ),
    "two steps": Reading(
        "likewise, with f_s(0, δ) that falls in two steps",
        {**_FALLING, "exponent": (2.0, 80.0), **_SECOND},
        lambda numbers: law(numbers, upper_turn="back"),
    ),
}

#: Calibrations to lay beside each other: the default; one that meets both claims at s = 0.30 with one forcing amplitude
#: but not the two-periodic one at s = 0.40; one that meets these three, but whose lowest friction grows where s is small; the
#: default with the other reading of a turn on the upper line; the one that shows all claims but one, which has three more
#: free numbers; and what each reading without one of its parts can do.
CALIBRATIONS: dict[str, Calibration] = {
    "default": Calibration("falling f_s(0, δ)", DAMPING, BogaczRyczek()),
    "one u₀": Calibration(
        "falling f_s(0, δ)",
        0.30,
        BogaczRyczek(
            static_friction=StaticFriction(
                0.536, limit=0.66, rate=0.25, force_rate_scale=0.49, drop=1.40, drop_scale=0.363, drop_exponent=5.1
            ),
            alpha=((1.95, 0.0), (2.95, 2.05)),
        ),
    ),
    "steep f_s(0, δ)": Calibration(
        "falling f_s(0, δ)",
        0.316,
        BogaczRyczek(
            static_friction=StaticFriction(
                0.807, limit=0.36, rate=0.18, force_rate_scale=0.72, drop=0.96, drop_scale=0.382, drop_exponent=19.0
            ),
            alpha=((1.8, 0.0), (2.8, 1.65)),
        ),
    ),
    "back along A": Calibration("back along A", DAMPING, BogaczRyczek(upper_turn="back")),
    "two steps": Calibration(
        "two steps",
        0.331,
        BogaczRyczek(
            static_friction=StaticFriction(
                0.525,
                limit=0.26,
                rate=0.1685,
                force_rate_scale=0.405,
                drop=0.69,
                drop_scale=0.3968,
                drop_exponent=51.5,
                second_drop=1.05,
                second_drop_scale=0.2935,
                second_drop_exponent=3.06,
            ),
            alpha=((1.848, 0.0), (2.848, 1.53)),
            upper_turn="back",
        ),
    ),
    "α = 0": Calibration("falling f_s(0, δ)", 0.2615, BogaczRyczek(alpha=0.0)),
    "climbs at η": Calibration("climbs at η", DAMPING, BogaczRyczek(D=None)),
    "one f_s(0)": Calibration(
        "one f_s(0)",
        0.28,
        BogaczRyczek(static_friction=StaticFriction(1.084, limit=0.3, rate=0.3, force_rate_scale=0.5), alpha=0.0),
    ),
}


def trades(names: Sequence[str] = tuple(CALIBRATIONS), **options: Any) -> pd.DataFrame:
    """What each calibration shows of the paper: the verdicts beside each other.

    Parameters
    ----------
    names : of :data:`CALIBRATIONS`.
    options : of :func:`stickslip.paper.score`.

    Returns
    -------
    DataFrame indexed by claim, a column of verdicts for each name.

    >>> trades(["default", "one f_s(0)"], only=("friction-falls",)).loc["friction-falls"].tolist()
    ['reproduced', 'not reproduced']
    """
    import pandas as pd

    from stickslip.paper.scoring import score

    return pd.DataFrame({name: score(CALIBRATIONS[name].oscillator, **options)["verdict"] for name in names})


#: Claims on motions without sticks, by the stage at which a candidate is asked for them; the next needs all of one.
SLIPPING: tuple[tuple[str, ...], ...] = (
    ("always-slipping", "amplitude-falls", "friction-falls"),
    ("end-of-oscillation", "stable-slip"),
    ("forced-0.40-two-periodic",),
    ("forced-0.30-two-periodic",),
    ("forced-0.30-non-periodic", "forced-0.30-one-amplitude"),
    ("forced-0.40-non-periodic",),
)

#: Claims that sticks decide, likewise.
STICKING: tuple[tuple[str, ...], ...] = (
    ("end-of-stick-slip", "stick-slip-at-small-s"),
    ("passage", "first-break-away"),
    ("turning-slip-velocity-grows", "single-limit-cycle"),
)

_SCORE = {REPRODUCED: 1.0, PARTLY: 0.5, NOT: 0.0}

#: How often the numbers felt in sticks alone are drawn for one candidate.
DRAWS = 60


def search(
    reading: str,
    path: str | Path,
    *,
    candidates: int = 200,
    seed: int = 1,
    progress: Callable[[str, int, int], Any] | None = None,
) -> pd.DataFrame:
    """Search the free numbers of a reading for those that make the paper's claims come out.

    Every third candidate is drawn from the bounds, the others near one of the five best so far. Its score is the number of
    claims of :data:`SLIPPING` and :data:`STICKING` reproduced, half for those partly so, and up to a fifth more for a
    forced claim that holds at several forcing amplitudes.

    Parameters
    ----------
    reading : a name of :data:`READINGS`.
    path : JSON lines, one a candidate; a file that is there is gone on from.
    candidates : how many the file shall hold at the end.
    seed : of the random numbers; the same seed gives the same file.
    progress : called as ``progress(what, done, n)`` after each candidate.

    Returns
    -------
    DataFrame of all candidates, the best first: ``score``, the numbers and the verdict by claim.

    Raises
    ------
    InputError
        for an unknown reading, a file of another reading or seed, or one that cannot be written.
    """
    import pandas as pd

    if reading not in READINGS:
        raise InputError(
            f"search: reading must be one of {', '.join(READINGS)}, got {reading!r}{did_you_mean(reading, READINGS)}"
        )
    if candidates < 1:
        raise InputError(f"search: candidates must be at least 1, got {candidates}")
    path = Path(path)
    rows = _resume(path, reading, seed)
    for index in range(len(rows), candidates):
        row = {"reading": reading, "seed": seed, "index": index} | _candidate(READINGS[reading], rows, seed, index)
        rows.append(row)
        _append(path, row)
        if progress is not None:
            progress(f"best score {max(row['score'] for row in rows):.2f}", index + 1, candidates)
    return pd.DataFrame(rows).sort_values("score", ascending=False, kind="stable")


def _resume(path: Path, reading: str, seed: int) -> list[dict[str, Any]]:
    if not path.exists():
        return []
    rows = []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        try:
            row = json.loads(line)
            same = (row["reading"], row["seed"], row["index"]) == (reading, seed, number - 1)
        except (ValueError, KeyError, TypeError):
            raise InputError(
                f"{path}: row {number} is no candidate; delete it and what follows, or choose another file"
            ) from None
        if not same:
            raise InputError(
                f"{path}: row {number} is of another search; choose another file or the same reading and seed"
            )
        rows.append(row)
    return rows


def _append(path: Path, row: dict[str, Any]) -> None:
    try:
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}); choose another file") from None


def _candidate(reading: Reading, rows: list[dict[str, Any]], seed: int, index: int) -> dict[str, Any]:
    random = np.random.default_rng([seed, index])
    best = sorted(rows, key=lambda row: -row["score"])[:5]
    near = best[int(random.integers(len(best)))] if best and index % 3 else None
    slipping = _drawn(reading.slipping, random, near)
    try:
        found = slipping | _drawn(_STICKING, random)
        checked = _checked(reading.make(found), SLIPPING)
        if checked["passed"]:
            stuck = {"score": -1.0}
            for _ in range(DRAWS):
                trial = slipping | _drawn(_STICKING, random)
                also = _checked(reading.make(trial), STICKING)
                if also["score"] > stuck["score"]:
                    found, stuck = trial, also
            checked = {
                "score": checked["score"] + stuck["score"],
                "verdicts": checked["verdicts"] | stuck["verdicts"],
            }
    except InputError:
        return {**slipping, "score": 0.0, "verdicts": {}}
    return {**found, "score": round(checked["score"], 6), "verdicts": checked["verdicts"]}


def _drawn(
    bounds: Mapping[str, tuple[float, float]], random: np.random.Generator, near: Numbers | None = None
) -> dict[str, float]:
    numbers = {}
    for name, (low, high) in bounds.items():
        value = random.uniform(low, high) if near is None else random.normal(near[name], 0.04 * (high - low))
        numbers[name] = float(np.clip(value, low, high))
    return numbers


def _checked(make: Make, stages: tuple[tuple[str, ...], ...]) -> dict[str, Any]:
    """The score of a model for the search, its verdicts at the stages it was taken to, and whether it passed them all."""
    study = Study(make, periods=120, tolerance=5e-4, forcing_periods=300, workers=1)
    by_id = {claim.id: claim for claim in CLAIMS}
    total, verdicts, passed = 0.0, {}, True
    for stage in stages:
        for name in stage:
            checked = by_id[name].check(study)
            verdicts[name] = checked.verdict
            total += _SCORE[checked.verdict]
            if name.startswith("forced") and not name.endswith("amplitude"):
                total += 0.04 * min(checked.value, 5.0)
            passed &= checked.verdict == REPRODUCED
        if not passed:
            break
    return {"score": total, "verdicts": verdicts, "passed": passed}
