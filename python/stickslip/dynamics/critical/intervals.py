"""Intervals of the critical drive velocities of a fitted law."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from stickslip.dynamics.critical.critical_velocities import critical_velocities
from stickslip.errors import InputError, whole_number
from stickslip.files.progress import waiting_by_stage
from stickslip.model.system import Oscillator, System


def critical_intervals(
    system: Oscillator | System,
    samples: int,
    seed: int,
    bounds: tuple[float, float] | None = None,
    *,
    progress: Callable[[str, int, int], Any] | None = None,
) -> pd.DataFrame:
    """95 % intervals of the critical drive velocities under the uncertainty of a fitted law.

    The search of :func:`critical_velocities` is made for each of the laws that :meth:`stickslip.laws.Law.sample` draws.

    Parameters
    ----------
    system : an oscillator whose law has a covariance.
    samples : how many laws, at least 10; the ends of an interval of few laws are rough.
    seed : of the random numbers.
    bounds : as of :func:`critical_velocities`; default those of each law.
    progress : called as ``progress("laws", done, samples)``; without it a terminal or a notebook shows a line.

    Returns
    -------
    DataFrame over the names of the critical velocities (the lowest of each): low and high, the 0.025 and 0.975 quantiles over
    the laws that have one, and laws, how many these are.

    Raises
    ------
    InputError
        for a system of several masses, or a law without a covariance.

    Limits: what the law's covariance does not hold (mass, stiffness, damping) is not in the intervals.

    >>> from stickslip.laws import StaticKinetic
    >>> covariance = pd.DataFrame([[1e-4]], index=["kinetic"], columns=["kinetic"])
    >>> law = StaticKinetic(1.0, 0.6).with_covariance(covariance)
    >>> found = critical_intervals(Oscillator(0.1, 1.0, law), 10, seed=0, bounds=(0.4, 0.5))
    >>> found.loc["end_of_stick_slip"].round(3).to_dict()
    {'low': 0.426, 'high': 0.452, 'laws': 10.0}
    """
    if not isinstance(system, Oscillator):
        raise InputError("critical_intervals: expected an oscillator of one mass, got a system of several")
    whole_number("samples", samples, "critical_intervals", least=10)
    found: dict[str, list[float]] = {}
    say = waiting_by_stage(progress)
    for done, law in enumerate(system.law.sample(samples, seed), start=1):
        one = critical_velocities(replace(system, law=law), bounds, progress=lambda *_: None)
        for name, value in one.items():
            found.setdefault(name, []).append(value)
        say("laws", done, samples)
    rows = {name: [*np.quantile(values, [0.025, 0.975]), len(values)] for name, values in found.items()}
    return pd.DataFrame.from_dict(rows, orient="index", columns=["low", "high", "laws"])
