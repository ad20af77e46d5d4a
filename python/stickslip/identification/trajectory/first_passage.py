"""Static friction from where scattered sticks end: each is the first time at which its load reaches its own f_s(t_s, δ).

A stick that happens to hold more is also loaded longer: its break-away lies farther up on its loading line. Fitted as force
over stick time such sticks pretend a growth with the slope of that line. What is not touched by the chance of a stick is
where it began. So each stick i is given its own number n_i of the law (say, ``limit``), the one with which its own load
reaches f_s at its own end, and what is asked is that the n_i lie around the shared n whatever the load at the beginning was:

    Σ_i z_i ψ((n_i(θ) − n(θ)) / σ) = 0,

with z_i the derivatives of n_i − n by the wanted numbers θ, taken where the law, instead of chance, would end stick i: an
estimate by instruments (Reiersøl 1945; Amemiya, J. Econometrics 2 (1974) 105).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stickslip.errors import InputError
from stickslip.files.arrays import Array, Mask
from stickslip.identification.estimator.least_squares import OUTLIER
from stickslip.identification.estimator.residual_statistics import robust_scale
from stickslip.identification.law_parameters import LawParameters
from stickslip.laws import Law
from stickslip.laws.numbers import pointers, value, with_values

OWN = ("break_away", "limit", "static_friction.initial", "growth", "static", "break_away[0].force")
"""The number in which one stick differs from the other, the first of these that a law, or the static part of a combined one,
has; f_s is linear in it."""
NUMBER_STEP = 1e-3
"""Of a number, in units of a visible change, for differences."""
BISECTIONS = 50
ITERATIONS = 100
LONGEST_MOVE = 5.0
"""The most by which a number moves in one step, in units of a visible change."""


def own_number(law: Law) -> str:
    """The number of a law that each stick has of its own.

    Raises
    ------
    InputError
        for a law without static friction of its own.

    >>> from stickslip.laws import DwellTime
    >>> own_number(DwellTime(kinetic=0.5, limit=0.5, rate=0.3))
    'limit'
    """
    if (name := varying_number(law)) is None:
        raise InputError(
            f"fit_trajectories: {type(law).__name__} has no static friction that could differ from stick to stick: take a "
            "law with a break-away, such as StaticKinetic, or shoot by records"
        )
    return name


def varying_number(law: Law) -> str | None:
    """What :func:`own_number` gives, None for a law without static friction of its own."""
    known = pointers(law)
    return next((name for name in (*OWN, *(f"static.{name}" for name in OWN)) if name in known), None)


@dataclass(frozen=True)
class Sticks:
    """Sticks and how they were loaded, each of shape (sticks,).

    Attributes
    ----------
    stick_time : t_s.
    force_rate : δ, at which the load grows.
    force : at the break-away.
    """

    stick_time: Array
    force_rate: Array
    force: Array

    def own(self, law: Law) -> tuple[Array, Array]:
        """The number n_i with which f_s(t_s, δ) of the law is the force at the end, and ∂n_i/∂force."""
        name = own_number(law)
        usual = value(law, name)
        step = 0.01 * max(abs(usual), 1e-3)
        here = np.asarray(law.break_away_force(self.stick_time, self.force_rate))
        beside = np.asarray(with_values(law, {name: usual + step}).break_away_force(self.stick_time, self.force_rate))
        by_force = step / np.maximum(beside - here, 1e-300)
        return usual + (self.force - here) * by_force, by_force

    def as_the_law_ends_them(self, law: Law) -> Sticks:
        """The same sticks from the same beginnings, each ended where the shared law ends it."""
        begun = self.force - self.force_rate * self.stick_time

        def holds(time: Array) -> Mask:
            return np.asarray(law.break_away_force(time, self.force_rate)) > begun + self.force_rate * time

        low, high = np.zeros_like(begun), self.stick_time.copy()
        for _ in range(BISECTIONS):
            if not (held := holds(high)).any():
                break
            low, high = np.where(held, high, low), np.where(held, 2 * high, high)
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            held = holds(middle)
            low, high = np.where(held, middle, low), np.where(held, high, middle)
        return Sticks(high, self.force_rate, begun + self.force_rate * high)


@dataclass(frozen=True)
class Passage:
    """The estimating equation of the numbers of static friction at one law, a row for each stick.

    Attributes
    ----------
    own : n_i.
    off : (n_i − n)/σ, shape (sticks,).
    instruments : z_i, shape (sticks, numbers of static friction).
    by : derivatives of `off` by all free numbers, shape (sticks, free numbers).
    by_force : and by the force at the end.
    """

    own: Array
    off: Array
    instruments: Array
    by: Array
    by_force: Array

    @property
    def score(self) -> Array:
        """ψ(off): straight for small scatter, bounded for sticks far out."""
        return np.asarray(self.off / np.sqrt(1 + (self.off / OUTLIER) ** 2))

    @property
    def give(self) -> Array:
        """ψ'(off)."""
        return np.asarray((1 + (self.off / OUTLIER) ** 2) ** -1.5)


def passage(sticks: Sticks, free: LawParameters, numbers: Array, static: list[int]) -> Passage:
    """The estimating equation at these numbers; `static` are those of static friction."""
    law = free.law(numbers)
    usual = value(law, own_number(law))
    own, by_force = sticks.own(law)
    sigma = max(robust_scale(own - usual), 1e-9 * max(abs(usual), 1e-300))
    foreseen = sticks.as_the_law_ends_them(law)
    expected = foreseen.own(law)[0]
    by, instruments = np.zeros((own.size, numbers.size)), np.zeros((own.size, len(static)))
    for j in range(numbers.size):
        trial = numbers.copy()
        trial[j] += NUMBER_STEP if numbers[j] + NUMBER_STEP <= free.high[j] else -NUMBER_STEP
        other = free.law(trial)
        shift, step = value(other, own_number(other)) - usual, trial[j] - numbers[j]
        by[:, j] = (sticks.own(other)[0] - own - shift) / step / sigma
        if j in static:
            instruments[:, static.index(j)] = (foreseen.own(other)[0] - expected - shift) / step / sigma
    return Passage(own, (own - usual) / sigma, instruments, by, by_force / sigma)


def solve(sticks: Sticks, free: LawParameters, numbers: Array, static: list[int]) -> Array:
    """The numbers with those of static friction set so that the sticks end around where the law ends them.

    Raises
    ------
    InputError
        where the sticks do not tell them apart.
    """
    at = numbers.copy()
    for _ in range(ITERATIONS):
        found = passage(sticks, free, at, static)
        steep = found.instruments.T @ (found.give[:, None] * found.by[:, static])
        push = -np.linalg.pinv(steep, rcond=1e-12) @ (found.instruments.T @ found.score)
        push *= min(1.0, LONGEST_MOVE / max(float(np.max(np.abs(push))), 1e-300))
        ahead = at.copy()
        ahead[static] = np.clip(at[static] + push, free.low[static], free.high[static])
        if float(np.max(np.abs(ahead - at))) < 1e-7:
            return at
        at = ahead
    names = " and ".join(free.names[j] for j in static)
    raise InputError(
        f"identify: where the sticks end does not settle {names}: hold one of them fixed, or add records at other drive "
        "velocities"
    )
