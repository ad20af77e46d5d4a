"""The words for kinds of motion, simulated or measured, and what each means."""

from __future__ import annotations

from stickslip import _core

#: The criteria in their order, after a transient that is left out. They are decided in one place of the core; a measured
#: record, where a stick is never exact, has the same words by the criteria of `stickslip.measurement.regime`.
REGIMES = {
    "diverged": "the motion runs away: it grew beyond all numbers, by Taylor steps to 1e9 times the speed of its start",
    "unfinished": "the run ended before its time: too many events or an accumulation of them, a limit, numbers out of range",
    "at_rest": "stuck throughout",
    "stick_slip": "sticks and slips alternate",
    "stable_slip": "the slip velocity is constant within 0.2 % of its size",
    "almost_harmonic": "the slip velocity oscillates and keeps its sign",
    "reversing_slip": "the slip velocity changes its sign without a stick",
}

#: Two starts beside each other part where their distance has grown to more than this many times the number of periods, and
#: stay together where it is at most so many times what it was. Chaos lets it grow exponentially; on a torus or beside a
#: periodic orbit it grows at most linearly with time. Between the two, weak chaos and a torus look alike.
PARTS = 100.0

#: How a motion comes back.
RECURRENCE = {
    "rests": "at_rest or stable_slip",
    "periodic": "it repeats after some returns to the section, at most half of those looked at, within the tolerance",
    "chaotic": "it does not repeat, and two starts beside each other part exponentially",
    "not_repeating": "it does not repeat and they stay together: a torus, a longer period, or chaos too weak to be seen",
    "undecided": "it does not repeat in the window, and no more was requested or can be determined, as of weak chaos; or the "
    "motion still changes; or the run did not end",
}


def regime_of_stop(stop: str, enough: bool) -> str | None:
    """What the stop of a run says of its regime by itself; None where the motion is to be looked at.

    Parameters
    ----------
    stop : why the run ended.
    enough : whether so much of the motion was seen that a run which ended before its time tells its regime all the same.

    >>> regime_of_stop("diverged", True), regime_of_stop("accumulation", False), regime_of_stop("t_end", False)
    ('diverged', 'unfinished', None)
    """
    # The integrator of laws with an internal state has stops of its own, for the same reasons.
    return _core.regime_of_stop({"solver": "stiff", "max_evaluations": "max_events"}.get(stop, stop), enough)
