"""One word for the motion of a measured record; that of a simulated one is decided in the core (`observer/regime.rs`)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d

from stickslip.files.arrays import Array

SLOW_LEVEL = 0.2
"""Below this fraction of the drive velocity a mass counts as slow."""
STEADY = 0.1
"""Slip is stable if the slip velocity scatters less than this fraction of the drive velocity."""
LINGERS = 0.25
"""A sine that just touches w = 0 is slow for 20 % of the time: a creeping motion that is slow for longer than this lingers
there, and is stick-slip."""
TOUCHES = 0.2
NEARLY = 0.9
"""A sine that just touches w = 0 is slow for so much of the time; what is slow for that share of it may touch it."""
NEVER_SLIPS = 0.99
"""Share of slow time from which on a steady motion is none: the mass rests on the drive."""
ENOUGH = 60
"""Samples in a period of the free mass that show short sticks."""
BLURRED = 0.5
"""Sticks are bounded where w passes half of V: an error of w as large hides what is short."""
PARTS = 8
"""Parts of a record by whose scatter the error of its slow share is told."""
INTERMITTENT = 0.4
"""A creeping mass in stick-slip that is slow for less of the time than this does not stick in every cycle."""


def slow_share(
    slip_velocity: Array, drive_velocity: float, noise: float, step: float, stick_times: Sequence[float] = ()
) -> tuple[float, float]:
    """Share of the time with |w| < 0.2 V, and its standard error by the scatter over eighths of the record.

    w is averaged so that its noise does not decide, nor the average over a stick.

    Parameters
    ----------
    slip_velocity : (n,) w, every `step`, from an extension with this `noise`.
    drive_velocity : V in the same unit.
    stick_times : of the sticks; w is averaged over a quarter of the usual one at most.
    """
    window = quiet_window(noise, step, drive_velocity)
    if len(stick_times):
        window = min(window, round(0.25 * float(np.median(stick_times)) / step))
    window = min(max(window, 1), len(slip_velocity))
    mean = uniform_filter1d(slip_velocity, window, mode="nearest")
    slow = np.abs(mean) < SLOW_LEVEL * drive_velocity
    parts = [float(np.mean(part)) for part in np.array_split(slow, PARTS) if part.size]
    return float(np.mean(slow)), float(np.std(parts, ddof=1)) / math.sqrt(len(parts))


def quiet_window(noise: float, step: float, drive_velocity: float) -> int:
    """Samples over which a slope of the extension is known to 5 % of the drive velocity.

    A straight line through samples a step apart with this noise, over a time T, has the slope error
    noise sqrt(12 step) / T^(3/2).
    """
    length = math.pow(noise * math.sqrt(12 * step) / (0.05 * drive_velocity), 2 / 3)
    return max(round(length / step), 1)


class Regime(NamedTuple):
    """The kind of a motion, and why it is ``"unknown"``.

    Attributes
    ----------
    kind : a word of `stickslip.simulation.regime_names`, or ``"unknown"``.
    doubt : of an unknown kind: ``"noise"`` hides short sticks; or ``"no sticks"`` are seen, and it is slow for as long as in
        stick-slip; or it is slow for about as long as the ``"limit"`` between the kinds; or friction ``"drives"`` it, or the
        record is ``"short"``er than a free period, which are told where they were found. Else ``""``.
    """

    kind: str
    doubt: Literal["", "noise", "no sticks", "limit", "drives", "short"] = ""


def regime(
    slip_velocity: Array,
    drive_velocity: float,
    slow: float,
    slow_error: float,
    blur: float,
    resting: bool,
    sticks: int,
    cycles: int,
) -> Regime:
    """``"stick_slip"``, ``"almost_harmonic"`` or ``"stable_slip"``, as in `stickslip.simulation.regime_names`, with noise.

    - ``at_rest``: the mass goes with the drive, |w| < 0.2 V, all the time;
    - ``stable_slip``: the slip velocity scatters by less than 0.1 V;
    - where sticks are exact (`resting`): ``stick_slip`` if more than one in five cycles sticks, else ``almost_harmonic``;
    - where the mass creeps: ``stick_slip``, be it fast, if it sticks and |w| < 0.2 V for at least 25 % of the time, else
      ``almost_harmonic``;
    - ``unknown`` where that share is not told apart from 25 % by its own error, where it is more and yet nothing is seen to
      stick, or where nothing is and the slip velocity is known so poorly that short sticks would not be seen.

    Parameters
    ----------
    slip_velocity : (n,) w.
    drive_velocity : V in the same unit.
    slow, slow_error : share of the time with |w| < 0.2 V, and its error, from `slow_share`.
    blur : standard error of w at a sample over V.
    resting : whether the mass rests while it sticks, to within the noise.
    sticks, cycles : how many cycles stick, and how many there are.
    """
    if resting:
        lingers = sticks > 0.2 * cycles
        known = lingers or slow < LINGERS + slow_error or slow > NEVER_SLIPS
    else:
        lingers = sticks > 0 and slow > LINGERS
        known = abs(slow - LINGERS) > slow_error if sticks else slow < LINGERS + slow_error or slow > NEVER_SLIPS
    if lingers and known and float(np.std(slip_velocity)) >= STEADY * drive_velocity:
        return Regime("stick_slip")
    if not known or blur > BLURRED:
        return Regime("unknown", "noise" if blur > BLURRED else "limit" if sticks and not resting else "no sticks")
    if float(np.std(slip_velocity)) >= STEADY * drive_velocity:
        return Regime("almost_harmonic")
    return Regime("at_rest" if slow > NEVER_SLIPS else "stable_slip")


def regime_of_slip(slip_velocity: Array, stuck_share: float, sticks: bool, level: float = 0.0) -> str:
    """The kind of a motion whose slip velocity itself was measured, in the order of `stickslip.simulation.regime_names`.

    - ``at_rest``: stuck for at least 99 % of the time;
    - ``stick_slip``: it sticks;
    - ``stable_slip``: the slip velocity scatters by less than a tenth of its mean;
    - ``reversing_slip``: it goes beyond `level` in both senses;
    - ``almost_harmonic`` otherwise.

    Parameters
    ----------
    slip_velocity : (n,) w.
    stuck_share : share of the time in which it sticks.
    sticks : whether that share is more than chance.
    level : a slip velocity as small as this has no sign.

    >>> t = np.linspace(0, 60, 1000)
    >>> regime_of_slip(0.3 + 0.1 * np.sin(t), 0.0, False), regime_of_slip(0.3 + 0.01 * np.sin(t), 0.0, False)
    ('almost_harmonic', 'stable_slip')
    """
    if stuck_share >= NEVER_SLIPS:
        return "at_rest"
    if sticks:
        return "stick_slip"
    w = np.asarray(slip_velocity, float)
    if float(np.var(w)) < (STEADY * float(np.mean(w))) ** 2:
        return "stable_slip"
    return "reversing_slip" if (w > level).any() and (w < -level).any() else "almost_harmonic"


def regime_notes(
    found: Regime, slow: float, blur: float, resting: bool, sticks: int, cycles: int, per_period: float
) -> list[str]:
    """What is said of stick-slip that is intermittent, of an unknown kind, and of a motion that may touch w = 0 unseen.

    Parameters
    ----------
    found : from `regime`.
    slow, blur, resting, sticks, cycles : as of `regime`.
    per_period : samples in a period of the free mass.
    """
    share, percent = f"|w| < {SLOW_LEVEL:g} V for", f"{100 * slow:.0f} % of the time"
    few = f"{per_period:.0f} samples in a period of the free mass, " if per_period < ENOUGH else ""
    hides = (
        f"{few}a low-pass ahead of the converter or an uneven drive may hide sticks, and friction at low slip speed is then "
        f"not as stated; to tell, take {ENOUGH} samples a period without a filter, or a lower drive velocity"
    )
    if found.kind == "unknown":
        why = {
            "noise": f"the slip velocity is known to {blur:.2g} V only, so short sticks would not be seen",
            "no sticks": f"{share} {percent}, as in stick-slip, but hardly a cycle is seen to stick: {hides}",
            "limit": f"{share} {percent}, too near the {100 * LINGERS:.0f} % of stick-slip",
        }
        return [f"the kind of motion cannot be determined: {why[found.doubt]}; no sticks were taken"]
    if found.kind == "stick_slip" and resting and sticks < 0.8 * cycles:
        return [f"the stick-slip is intermittent: {sticks} of {cycles} cycles stick"]
    if found.kind == "stick_slip" and not resting and slow < INTERMITTENT:
        return [f"the stick-slip is intermittent: {share} only {percent}"]
    if found.kind == "almost_harmonic" and slow >= NEARLY * TOUCHES:
        return [
            f"no stick is seen, and {share} {percent} ({100 * TOUCHES:.0f} % where a sine just touches w = 0): {hides}"
        ]
    return []
