"""Lyapunov exponents through events. Floquet multipliers of a closed orbit: `poincare_map.py`, `state_cycles.py`."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stickslip import _core
from stickslip.dynamics.periodic.event_sequence import as_list, check, layout_of
from stickslip.dynamics.periodic.periodic_orbits import unlike
from stickslip.dynamics.periodic.poincare_map import forcing_period
from stickslip.dynamics.periodic.state_cycles import sizes_of
from stickslip.dynamics.periodic.state_flow import StateFlow
from stickslip.errors import InputError, fraction, number, whole_number
from stickslip.files.equality import ByContent
from stickslip.files.notebook import InNotebook
from stickslip.model.system import Oscillator, System
from stickslip.simulation.integration import integrate

#: The derivatives held at one time are of no more numbers: each event of 100 masses has a million and a half.
_MOST_NUMBERS = 20_000_000
#: Less than this of the largest direction is what rounding leaves, and lost.
_LOST = 1e-12
#: Under laws with an internal state decay is followed up to so many times 1/e in a natural period, by parts in which there is
#: little of it; so many of them are taken together.
_FASTEST, _TOGETHER = 100_000, 8
#: Under them so many periods are left out at the least.
_SETTLING = 10


@dataclass(frozen=True, eq=False)
class LyapunovSpectrum(ByContent, InNotebook):
    """Lyapunov exponents of a motion.

    Attributes
    ----------
    exponents : in 1/time, the largest first; −inf for a direction that sticking forgets at once, or that decays thousands of
        times as fast as the masses swing, which no run follows; 0 for the shift in time of an autonomous motion with events.
    t : time over which they are averaged.
    events : events in it.
    times, running : what the averages were on the way: times, shape (n,), and the exponents found from the first of the run
        up to them, shape (n, number of exponents).
    period : of the forcing, or the natural one.
    """

    exponents: NDArray[np.float64]
    t: float
    events: int
    times: NDArray[np.float64] = field(repr=False, compare=False)
    running: NDArray[np.float64] = field(repr=False, compare=False)
    period: float = field(repr=False, compare=False)

    @property
    def errors(self) -> NDArray[np.float64]:
        """Standard error of each exponent, from its averages over 20 parts of the run; NaN for −inf."""
        edges = np.linspace(0.0, self.t, 21)
        parts = np.diff(self._sums(edges), axis=0) / np.diff(edges)[:, None]
        errors: NDArray[np.float64] = np.std(parts, axis=0, ddof=1) / math.sqrt(20)
        return errors

    def by_period(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The averages up to the end of each period: times, shape (n,), and values, shape (n, number of exponents).

        Within a period stretching and contraction alternate, and the averages swing with them.
        """
        ends = np.asarray(self.period * np.arange(1, int(self.t / self.period * (1 + 1e-9)) + 1), float)
        return ends, np.asarray(self._sums(ends) / ends[:, None], float)

    def _sums(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Growth from the first of the run up to times, ln of its factor; NaN for an exponent of −inf."""
        sums = self.running * self.times[:, None]
        begin = np.append(0.0, self.times)
        columns = [
            np.interp(times, begin, np.append(0.0, column))
            if np.isfinite(column).all()
            else np.full(times.shape, math.nan)
            for column in sums.T
        ]
        return np.stack(columns, axis=1)

    def facts(self) -> dict[str, Any]:
        """What a notebook shows."""
        errors = self.errors
        return {"exponents": self.exponents, "errors": errors, "time": self.t}

    def __repr__(self) -> str:
        values = ", ".join(f"{value:.5g}" for value in self.exponents)
        return f"<LyapunovSpectrum {values} over t = {self.t:g}>"


def lyapunov(
    system: Oscillator | System,
    t_end: float,
    x0: ArrayLike | None = None,
    v0: ArrayLike | None = None,
    *,
    transient: float = 0.1,
    seed: int = 0,
) -> LyapunovSpectrum:
    """The Lyapunov exponents of a motion: its derivative from event to event, memory included, orthogonalised at each.

    λ_i = lim (1/t) Σ ln |R_ii| with the QR factors of the derivatives between events; jumps at events are in them.

    Parameters
    ----------
    system : of one mass or several. Contacts under laws without an internal state must not close a loop; under laws with one
        the variational equation is integrated along with the motion, and each state has an exponent too.
    t_end : time to run; some thousand periods give two digits.
    x0, v0 : start, as for :func:`stickslip.simulate`; by default several masses for which rest at one position does not do
        start at unlike positions.
    transient : the fraction of the run that is left out, in [0, 1).
    seed : of the directions that are followed.

    Returns
    -------
    LyapunovSpectrum of 2 n exponents for n masses (of a forced system without the 0 of its clock).

    Raises
    ------
    InputError
        for a value that makes no sense, or a run that ends early.

    Limits: a finite average; where sticks are rare, the exponent they bring is −inf all the same. Where no event comes in the
    second half of the average, the average begins after the last one: that is the motion it leads to.

    Source: Müller, Chaos Solitons Fractals 5 (1995) 1671; Gottwald & Melbourne, SIAM J. Appl. Dyn. Syst. 8 (2009) 129.

    >>> from stickslip.laws import StaticKinetic
    >>> lyapunov(Oscillator(0.1, 0.2, StaticKinetic(1.0, 0.6)), 500.0).exponents.tolist()
    [0.0, -inf]
    """
    fraction("transient", transient, "lyapunov")
    end = number("t_end", t_end, "lyapunov")
    whole_number("seed", seed, "lyapunov", least=0)
    if isinstance(system, Oscillator | System) and system.integrated:
        return _of_states(system, end, x0, v0, transient * end, seed)
    check(system, "lyapunov")
    starts: list[tuple[Any, Any]] = [(x0, v0)]
    if x0 is None and v0 is None:
        # Masses that begin alike may move alike, at the edge of the motions that a disturbance leads to; the least one first.
        starts += reversed(unlike(system))
    refusals = []
    for x, v in starts:
        try:
            return _through_events(system, end, x, v, transient, seed)
        except InputError as refusal:
            refusals.append(refusal)
    raise refusals[0]


def _through_events(
    system: Oscillator | System, end: float, x0: ArrayLike | None, v0: ArrayLike | None, transient: float, seed: int
) -> LyapunovSpectrum:
    """Exponents under laws without an internal state, orthogonalised at every event by the core."""
    period = forcing_period(system) or system.natural_period
    most = max(2, _MOST_NUMBERS // layout_of(system).width ** 2)
    try:
        times, sums, events, shift = _core.lyapunov(system.core, as_list(x0), as_list(v0), end, most, transient, seed)
    except ValueError as error:
        raise InputError(f"lyapunov: {error}") from None
    columns = sums.reshape(-1, len(times))
    if shift:
        columns = np.concatenate([np.zeros((1, len(times))), columns])
    return _spectrum(times, columns.T, events, period)


def _spectrum(times: NDArray[np.float64], sums: NDArray[np.float64], events: int, period: float) -> LyapunovSpectrum:
    """The averages of the growth of directions up to times, those that grow most first."""
    running = sums / times[:, None]
    running = running[:, np.argsort(running[-1])[::-1]]
    return LyapunovSpectrum(running[-1], float(times[-1]), events, times, running, period)


def _of_states(
    system: Oscillator | System, end: float, x0: ArrayLike | None, v0: ArrayLike | None, begin: float, seed: int
) -> LyapunovSpectrum:
    """The same under laws with an internal state, orthogonalised as often as the fastest of the disturbances asks."""
    period = forcing_period(system) or system.natural_period
    length = period / max(1, math.ceil(period / system.natural_period))
    orbit = integrate(system, max(begin, _SETTLING * period), x0, v0)
    now, y = orbit.t_end, orbit.variables(np.array([orbit.t_end]))[0]
    # Of a motion that hardly moves differences would be rounding.
    flow = StateFlow(system, np.maximum(sizes_of(orbit), 1e-3 * np.abs(y)))
    basis = np.linalg.qr(np.random.default_rng(seed).standard_normal((flow.width, flow.width)))[0]
    sums = np.zeros(flow.width)
    course: list[NDArray[np.float64]] = []
    # The first of them only turn the directions into those that grow and shrink.
    for count in range(-_SETTLING, math.ceil((end - begin) / length * (1 - 1e-9))):
        y, parts = flow.derivatives(y, now, length, _FASTEST / system.natural_period)
        now += length
        while few := list(itertools.islice(parts, _TOGETHER)):
            for part in few:
                basis = part @ basis
            basis, factors = np.linalg.qr(basis)
            sizes = np.abs(np.diag(factors))
            if count >= 0:
                with np.errstate(divide="ignore"):
                    sums += np.log(np.where(sizes > _LOST * sizes.max(), sizes, 0.0))
        if count >= 0:
            course.append(sums.copy())
    times = np.asarray(length * np.arange(1, len(course) + 1), float)
    return _spectrum(times, np.array(course), 0, period)
